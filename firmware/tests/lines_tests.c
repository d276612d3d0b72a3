/* Layer 1: tick lines. */
#include "tests.h"

#include <string.h>

#include "segment_queue.h"
#include "tick_lines.h"

void lines_are_answered_as_documented(void) {
    fresh();
    CHECK(answers("where", "at unknown"));
    CHECK(answers("0:begin 1 2 30000", "ok 1 room 127"));
    CHECK(answers("1:s 0 0 800 -5", "ok 2"));
    CHECK(answers("2:m 0 10000 801 -4", "ok 3"));
    CHECK(answers("2:m 0 10000 801 -4", "ok 3")); /* a duplicate has no effect */
    CHECK(answers("5:m 0 10000 801 -4", "ok 3")); /* lines are missing */
    CHECK(answers("3:m 1 20000 790 0", "ok 4"));
    CHECK(answers("4:s 2 30000 790 0", "ok 5"));
    CHECK(answers("5:end 0 2 30000", "ok 6"));
    finish_motion();
    CHECK(answers("where", "at 790 0 0"));
    CHECK(answers("status", "status idle late 0 start power"));
    CHECK(answers("machine", "machine coaxial 1"));
}

void errors_name_the_cause(void) {
    fresh();
    CHECK(answers("0:begin 2 1 1", "error 0 version"));
    CHECK(answers("0:begin 1 1", "ok 0")); /* damaged twice: send it again */
    CHECK(answers("0:begin 1 1 1 ; machine hbot", "error 0 machine"));
    CHECK(answers("0:begin 1 1 1 ; machine coaxial2", "error 0 machine"));
    CHECK(answers("0:begin 1 1 1 ; machine coaxia", "error 0 machine"));
    CHECK(answers("0:begin 1 1 1 ; machine coaxial", "ok 1 room 127"));
    CHECK(answers("0:begin 1 1 1 ; my first plan", "ok 1 room 127"));
    CHECK(answers("1:m 0 10000 1 1", "error 1 place"));
    CHECK(answers("1:s 1 0 0 0", "error 1 count"));
    CHECK(answers("1:s 0 0 0 0", "ok 2"));
    CHECK(answers("2:m 0 0 1 1", "error 2 range"));
    CHECK(answers("2:m 0 16777216 1 1", "error 2 range"));
    CHECK(answers("2:m 256 1000 1 1", "error 2 range"));
    CHECK(answers("2:m 0 1000 100001 0", "error 2 range"));
    CHECK(answers("2:m 0 1000 4294967297 0", "error 2 range"));
    CHECK(answers("2:m 0 9000000 40000 0", "error 2 far"));
    CHECK(answers("2:m 0 100 4 0", "error 2 speed"));
    CHECK(answers("2:m 0 100 3 0", "ok 3"));
    CHECK(answers("3:s 1 100 2 0", "error 3 place"));
    CHECK(answers("3:end 0 2 100", "error 3 count"));
    CHECK(answers("3:dance 1", "ok 3"));
    CHECK(answers("3:m 0 100", "ok 3"));
    CHECK(answers("3:m 0 x 1 1", "ok 3"));
}

void plain_lines_are_answered_without_numbers(void) {
    fresh();
    const char *plan = "; comment\n\nbegin 1 1 10000 ; hello\n";
    CHECK(strcmp(raw(plan, strlen(plan)), "ok") == 0);
    CHECK(strcmp(raw("s 0 0 5 -5\r\n", 12), "ok") == 0);
    CHECK(strcmp(raw("m 1 10000 6 -6 ; down\n", 22), "ok") == 0);
    CHECK(strcmp(raw("m 1 10000 6\n", 12), "error line") == 0);
    CHECK(strcmp(raw("12\n", 3), "error line") == 0);
    CHECK(strcmp(raw("end 0 1 10000\n", 14), "ok") == 0);
    finish_motion();
    CHECK(drive_at[0] == 6 && drive_at[1] == -6);
}

void times_wrap_after_71_minutes(void) {
    fresh();
    CHECK(answers("0:begin 1 258 4299000000", "ok 1 room 127"));
    CHECK(answers("1:s 0 0 0 0", "ok 2"));
    char line[100], expected[40];
    unsigned long long total = 0;
    for (int i = 0; i < 258; i++) {
        unsigned us = i == 257 ? 4299000000u - 257u * 16700000u : 16700000u;
        total += us;
        sprintf(line, "%d:m 0 %u %d 0", i + 2, us, i & 1);
        sprintf(expected, "ok %d", i + 3);
        CHECK(answers(line, expected));
        finish_motion();
    }
    CHECK(total == 4299000000ull);
    CHECK(answers("260:s 258 4299000000 1 0", "ok 261"));
    CHECK(answers("261:end 0 258 4299000000", "ok 262"));
}

void damaged_line_is_never_executed(void) {
    char line[64];
    fresh();
    framed("0:begin 1 1 10000");
    framed("1:s 0 0 800 0");
    frame(line, "2:m 1 10000 804 -4");
    size_t length = strlen(line);
    for (size_t at = 0; at < length; at++) {
        for (int bit = 0; bit < 8; bit++) {
            char damaged[64];
            memcpy(damaged, line, length);
            damaged[at] ^= (char)(1 << bit);
            raw(damaged, length);
            /* The end of the line itself may be what was damaged. */
            raw("\n", 1);
            CHECK(queue_is_empty());
        }
    }
    CHECK(answers("2:m 1 10000 804 -4", "ok 3") && !queue_is_empty());
}

void random_bytes_do_no_harm(void) {
    static const char alphabet[] = "0123456789 :*-;\r\nmsbeginndwhere";
    fresh();
    for (int i = 0; i < 300000; i++) {
        char byte = random_below(4) ? alphabet[random_below(sizeof alphabet - 1)] : (char)random32();
        raw(&byte, 1);
        machine_poll();
    }
    raw("\n", 1);
    CHECK(strncmp(framed("where"), "at ", 3) == 0);
}

void full_queue_holds_the_line(void) {
    fresh();
    hold = true;
    framed("0:begin 1 100 1000000");
    framed("1:s 0 0 0 0");
    char line[100], text[64];
    int accepted = 0;
    for (; accepted < 200; accepted++) {
        sprintf(text, "%d:m 0 10000 %d 0", accepted + 2, accepted + 1);
        frame(line, text);
        size_t i = 0;
        while (line[i] && tick_lines_byte((uint8_t)line[i])) {
            i++;
        }
        if (line[i]) {
            break;
        }
        char answer[ANSWER_BYTES];
        tick_lines_answer(answer);
    }
    CHECK(accepted == PLOTPLAN_QUEUE - 1);
    CHECK(!tick_lines_owes_answer());
    hold = false;
    machine_poll();
    CHECK(tick_lines_byte('\n') && tick_lines_owes_answer());
}
