/* Tests of the portable layers on the host, under address and undefined-behaviour sanitizers. The port
 * and the drive are fakes; time is a number of milliseconds. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dc_control.h"
#include "homing.h"
#include "machine.h"
#include "pen.h"
#include "port.h"
#include "segment_queue.h"
#include "setpoint.h"
#include "step_clock.h"
#include "tick_lines.h"

static int passed, failed;

static void check(int holds, const char *what, int line) {
    if (holds) {
        passed++;
    } else {
        failed++;
        printf("tests.c:%d: %s\n", line, what);
    }
}
#define CHECK(condition) check(!!(condition), #condition, __LINE__)

static uint64_t random_state = 88172645463325252u;
static uint32_t random32(void) {
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return (uint32_t)(random_state >> 24);
}
static uint32_t random_below(uint32_t n) {
    return random32() % n;
}

/* ---- fake port ---- */
static uint8_t closed_switches;
static uint16_t servo_us;
static int solenoid, z_steps;
uint8_t port_switches(void) { return closed_switches; }
void port_servo(uint16_t us) { servo_us = us; }
void port_solenoid(bool on) { solenoid = on; }
void port_z_step(bool down) { z_steps += down ? 1 : -1; }
flash_text port_reset_cause(void) { return "power"; }
uint8_t port_lock(void) { return 0; }
void port_unlock(uint8_t state) { (void)state; }

/* ---- fake drive: executes the queue at once, a unit of ticks a poll, or holds it ---- */
static int32_t drive_at[2];
static bool hold, halted, measures;
static struct segment executing;
static bool has_segment;
/* A switch closes while motor 0 is at or below this; `physical` is not changed by a new datum. */
static int32_t switch_at, physical;
static bool switch_fitted;
/* A mechanical stop, which motor 0 does not pass, and a place above it where it sticks once. A drive that feels it
 * does not move on and is stalled after 10 ticks more; another one counts steps that are not made. */
static int32_t stop_at, sticks_at;
static bool stop_fitted, jammed, seeks;
static uint8_t held_back, sought_motors;
static void drive_seek(uint8_t motors, int16_t duty) { (void)duty; sought_motors = motors; held_back = 0; }
static bool drive_stalled(void) { return sought_motors && held_back >= 10; }
/* Whether motor 0 cannot make this tick. */
static bool is_held(int d) {
    bool held = (stop_fitted && d < 0 && (physical <= stop_at || physical == sticks_at)) || (jammed && d != 0);
    if (d != 0) {
        held_back = !held ? 0 : held_back < 255 ? held_back + 1 : 255;
    }
    return held;
}

static void drive_init(void) { has_segment = halted = false; }
static void drive_set(int32_t a, int32_t b) { drive_at[0] = a; drive_at[1] = b; halted = false; }
static void drive_position(int32_t out[2]) { out[0] = drive_at[0]; out[1] = drive_at[1]; }
static bool drive_moving(void) { return has_segment; }
static void drive_halt(void) { has_segment = false; halted = true; }
static void update_switch(void) {
    if (switch_fitted) {
        closed_switches = (closed_switches & ~SWITCH_1) | (physical <= switch_at ? SWITCH_1 : 0);
    }
}
static void drive_poll(void) {
    if (hold || halted) {
        return;
    }
    if (!has_segment && queue_pop(&executing)) {
        has_segment = true;
        pen_set(executing.pen);
    }
    if (has_segment) {
        for (int i = 0; i < 2; i++) {
            int d = (executing.ticks[i] > 0) - (executing.ticks[i] < 0);
            executing.ticks[i] -= d;
            bool held = i == 0 && is_held(d);
            drive_at[i] += held && seeks ? 0 : d;
            physical += i == 0 && !held ? d : 0;
        }
        has_segment = executing.ticks[0] || executing.ticks[1];
    }
    update_switch();
}
static struct drive fake_drive = {
    .name = "fake", .init = drive_init, .set_position = drive_set, .position = drive_position,
    .is_moving = drive_moving, .poll = drive_poll, .halt = drive_halt,
};

static struct plotplan_machine config;

static void fresh(void) {
    memset(&config, 0, sizeof config);
    fake_drive.measures_position = measures;
    fake_drive.seek_stop = seeks ? drive_seek : NULL;
    fake_drive.is_stalled = seeks ? drive_stalled : NULL;
    config.name = "coaxial";
    config.drive = &fake_drive;
    for (int i = 0; i < 2; i++) {
        config.motor[i].shortest_tick_us = 50;
        config.motor[i].lowest = -100000;
        config.motor[i].highest = 100000;
    }
    config.pen.kind = PEN_SERVO;
    config.pen.up = 1000;
    config.pen.down = 1500;
    config.limits_used = config.stop_used = true;
    closed_switches = 0;
    switch_fitted = hold = stop_fitted = jammed = false;
    sticks_at = INT32_MIN;
    sought_motors = held_back = 0;
    drive_at[0] = drive_at[1] = 0;
    homing_cancel();
    machine_init(&config);
    tick_lines_init(config.name, 127);
    machine_tick();
    machine_tick();
}

/* Sends bytes as they are; the last answer without its line end, "" without one. */
static char last_answer[ANSWER_BYTES + 1];
static const char *raw(const char *bytes, size_t length) {
    last_answer[0] = '\0';
    for (size_t i = 0; i < length; i++) {
        for (int tries = 0; !tick_lines_byte((uint8_t)bytes[i]); tries++) {
            if (tries > 100000) {
                return "stuck";
            }
            machine_poll();
        }
        if (tick_lines_owes_answer()) {
            char answer[ANSWER_BYTES];
            uint8_t n = tick_lines_answer(answer);
            CHECK(n <= ANSWER_BYTES && answer[n - 1] == '\n');
            memcpy(last_answer, answer, n - 1);
            last_answer[n - 1] = '\0';
        }
    }
    return last_answer;
}

static void frame(char *to, const char *text) {
    uint8_t sum = 0;
    for (const char *at = text; *at; at++) {
        sum ^= (uint8_t)*at;
    }
    sprintf(to, "%s*%u\n", text, sum);
}

/* The answer's text if its checksum is right. */
static const char *framed(const char *text) {
    char line[200], again[200];
    frame(line, text);
    const char *answer = raw(line, strlen(line));
    char *star = strrchr(last_answer, '*');
    if (star) {
        *star = '\0';
        frame(again, last_answer);
        *star = '*';
        again[strlen(again) - 1] = '\0';
        CHECK(strcmp(again, last_answer) == 0);
        *star = '\0';
    }
    return answer;
}

static int answers(const char *text, const char *expected) {
    const char *got = framed(text);
    if (strcmp(got, expected) != 0) {
        printf("%s: answered '%s' instead of '%s'\n", text, got, expected);
        return 0;
    }
    return 1;
}

static void finish_motion(void) {
    for (int i = 0; i < 1000000 && (has_segment || !queue_is_empty()); i++) {
        machine_poll();
    }
}

/* ---- layer 1 ---- */
static void lines_are_answered_as_documented(void) {
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

static void errors_name_the_cause(void) {
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

static void plain_lines_are_answered_without_numbers(void) {
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

static void times_wrap_after_71_minutes(void) {
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

static void damaged_line_is_never_executed(void) {
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

static void random_bytes_do_no_harm(void) {
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

static void full_queue_holds_the_line(void) {
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

/* ---- layer 2 and 3 ---- */
static void steps_come_at_their_time(void) {
    long steps = 0;
    double early = 0, late = 0;
    for (int plan = 0; plan < 1000; plan++) {
        struct cutter cutter;
        double segment_start = 0;
        uint16_t now = (uint16_t)random32();
        double clock = 0; /* half us since the start, of `now` */
        for (int k = 0; k < 20; k++) {
            uint32_t us = random_below(4) ? 1000 + random_below(20000) : 1 + random_below(400000);
            struct segment segment = {.us_low = (uint16_t)us, .us_high = (uint8_t)(us >> 16)};
            for (int i = 0; i < 2; i++) {
                int32_t most = (int32_t)(us / 40);
                most = most > INT16_MAX ? INT16_MAX : most;
                segment.ticks[i] = random_below(5) ? (int16_t)(random_below((uint32_t)(2 * most + 1)) - (uint32_t)most) : 0;
            }
            int made[2] = {0, 0};
            cutter_start(&cutter, &segment);
            while (!cutter_is_done(&cutter)) {
                struct piece piece;
                struct step_clock clocks[2];
                cutter_cut(&cutter, &piece);
                uint16_t end = now + piece.duration;
                for (int i = 0; i < 2; i++) {
                    step_clock_load(&clocks[i], &piece.motor[i], now);
                }
                while (now != end) {
                    uint16_t wait = (uint16_t)(end - now);
                    wait = step_clock_wait(&clocks[0], now, wait);
                    wait = step_clock_wait(&clocks[1], now, wait);
                    now += wait;
                    clock += wait;
                    for (int i = 0; i < 2; i++) {
                        if (step_clock_is_due(&clocks[i], now)) {
                            step_clock_advance(&clocks[i]);
                            made[i]++;
                            double ideal = segment_start + (made[i] - 0.5) * 2.0 * us / abs(segment.ticks[i]);
                            double off = clock - ideal;
                            early = off < early ? off : early;
                            late = off > late ? off : late;
                            steps++;
                        }
                    }
                }
                CHECK(clocks[0].left == 0 && clocks[1].left == 0);
            }
            CHECK(made[0] == abs(segment.ticks[0]) && made[1] == abs(segment.ticks[1]));
            segment_start += 2.0 * us;
            CHECK(clock == segment_start);
        }
    }
    printf("%ld steps of 1000 random plans: each %.2f us early to %.2f us late\n", steps, -early / 2, late / 2);
    /* Times are rounded down; near steps of both motors are made together. */
    CHECK(early > -1.0 - STEPS_TOGETHER && late <= 1.0);
}

static void cuts_of_long_rows_keep_clear_of_steps(void) {
    long cuts = 0;
    double nearest = 1e9;
    for (int row = 0; row < 3000; row++) {
        uint32_t us = 16001 + random_below(200000);
        struct segment segment = {.us_low = (uint16_t)us, .us_high = (uint8_t)(us >> 16)};
        for (int i = 0; i < 2; i++) {
            /* Up to the limit of 20,000 steps/s, often close to it. */
            uint32_t most = us / 50 > INT16_MAX ? INT16_MAX : us / 50;
            segment.ticks[i] = (int16_t)(random_below(2) ? most - random_below(most / 20 + 1) : random_below(most + 1));
        }
        struct cutter cutter;
        cutter_start(&cutter, &segment);
        double cut = 0;
        for (;;) {
            struct piece piece;
            cutter_cut(&cutter, &piece);
            CHECK(piece.duration <= 32767);
            cut += piece.duration;
            if (cutter_is_done(&cutter)) {
                break;
            }
            cuts++;
            for (int i = 0; i < 2; i++) {
                if (segment.ticks[i]) {
                    double step = 2.0 * us / segment.ticks[i], before = fmod(cut + step / 2, step);
                    nearest = fmin(nearest, cut > step / 2 ? fmin(before, step - before) : step - before);
                }
            }
        }
    }
    printf("%ld cuts of long rows: no step within %.1f us\n", cuts, nearest / 2);
    CHECK(nearest >= CUT_CLEARANCE - 1);
}

static void setpoints_follow_rows_of_any_length(void) {
    fresh();
    double worst = 0;
    for (int plan = 0; plan < 300; plan++) {
        struct setpoint setpoint;
        double time[65], place[65];
        queue_clear();
        time[0] = place[0] = 0;
        int32_t target = 0;
        for (int k = 1; k <= 60; k++) {
            uint32_t us = plan % 3 == 0 ? 1 + random_below(900) : 1 + random_below(30000);
            int16_t d = (int16_t)(random_below(401) - 200);
            queue_push(d, (int16_t)-d, us, 0);
            target += d;
            time[k] = time[k - 1] + us;
            place[k] = target;
        }
        setpoint_set(&setpoint, 0, 0);
        CHECK(setpoint_start(&setpoint));
        int k = 1;
        for (double t = 1000; setpoint_advance(&setpoint); t += 1000) {
            while (t >= time[k]) {
                k++;
            }
            double ideal = place[k - 1] + (place[k] - place[k - 1]) * (t - time[k - 1]) / (time[k] - time[k - 1]);
            double off = fabs(setpoint_of(&setpoint, 0) / 64.0 - ideal);
            worst = off > worst ? off : worst;
            CHECK(setpoint_of(&setpoint, 1) == -setpoint_of(&setpoint, 0));
        }
        CHECK(setpoint_of(&setpoint, 0) == target * 64);
    }
    CHECK(worst < 2.0 / 64);
}

/* tau dv/dt = g (u - f sign v) - v, at rest while |u| <= s. */
static double follow_sine(int16_t friction, int16_t ki, double start, double *final) {
    static const struct plotplan_loop loop = {.kp = 3072, .kv = 3840, .ka = 1440, .follow_counts = 40};
    struct plotplan_loop with_ki = loop;
    with_ki.ki = ki;
    struct dc_control control;
    double x = start, v = 0, sum = 0;
    uint8_t at = 0;
    int n = 0;
    double lead[WINDOW_HALF + 1] = {0};
    dc_control_reset(&control, (int16_t)(int32_t)(start * 64));
    for (int i = 0; i <= WINDOW_HALF; i++) {
        lead[i] = start;
    }
    for (int ms = 0; ms < 6000; ms++) {
        double target = start + (ms < 5000 ? 200 * (1 - cos(2 * 3.14159265358979 * ms / 1000.0)) : 0);
        memmove(lead, lead + 1, sizeof *lead * WINDOW_HALF);
        lead[WINDOW_HALF] = target;
        int16_t duty = dc_control_step(&control, &with_ki, friction, at, (int16_t)(int32_t)lrint(target * 64),
                                       (int16_t)(int32_t)(floor(x + 0.5) * 64));
        at = at == WINDOW - 1 ? 0 : (uint8_t)(at + 1);
        double u = duty / 8.0;
        for (int k = 0; k < 20; k++) {
            if (fabs(v) < 1 && fabs(u) <= 8) {
                v = 0;
            } else {
                double s = fabs(v) < 1 ? (u > 0) - (u < 0) : (v > 0) - (v < 0);
                v += (106.67 * (u - 6 * s) - v) / 0.12 * 5e-5;
                x += v * 5e-5;
            }
        }
        if (ms > 1000 && ms < 5000) {
            sum += (x - lead[0]) * (x - lead[0]);
            n++;
        }
        *final = x - lead[0];
    }
    return sqrt(sum / n);
}

static void loop_follows_within_a_count(void) {
    double rest, modelled = follow_sine(48, 262, 0, &rest);
    printf("loop on a motor with 6 %% friction: %.2f counts RMS at 1257 counts/s", modelled);
    CHECK(modelled < 1.0);
    CHECK(fabs(rest) < 3);
    double without = follow_sine(0, 262, 0, &rest);
    printf("; without friction fed forward %.2f\n", without);
    CHECK(without > 1.5 * modelled);
    /* Setpoints modulo 2^16: at 1023 counts they wrap. */
    CHECK(fabs(follow_sine(48, 262, 900, &rest) - modelled) < 0.1);
}

static void duty_saturates_without_windup(void) {
    const struct plotplan_loop loop = {.kp = 3072, .ki = 262, .kv = 3840, .ka = 1440};
    struct dc_control control;
    dc_control_reset(&control, 0);
    uint8_t at = 0;
    for (int i = 0; i < 2000; i++) {
        int16_t duty = dc_control_step(&control, &loop, 48, at, 0, -500 * 64);
        CHECK(duty == DUTY_LARGEST);
        at = at == WINDOW - 1 ? 0 : (uint8_t)(at + 1);
    }
    CHECK(control.sum == 0);
    for (int i = 0; i < 50000; i++) {
        int16_t duty = dc_control_step(&control, &loop, 48, at, 0, (int16_t)(i & 1 ? 30 * 64 : -20 * 64));
        CHECK(duty <= DUTY_LARGEST && duty >= -DUTY_LARGEST);
        at = at == WINDOW - 1 ? 0 : (uint8_t)(at + 1);
    }
}

/* ---- faults and homing ---- */
static void start_long_move(void) {
    framed("0:begin 1 1 9000000");
    framed("1:s 0 0 0 0");
    CHECK(answers("2:m 1 9000000 30000 100", "ok 3"));
    for (int i = 0; i < 50; i++) {
        machine_poll();
        machine_tick();
    }
    CHECK(drive_at[0] > 20 && servo_us == 1500);
}

static void switch_stops_motors_and_lifts_the_pen(void) {
    const struct {
        uint8_t closed;
        const char *error;
    } causes[] = {{SWITCH_1, "limit"}, {SWITCH_2, "limit"}, {SWITCH_STOP, "stop"}};
    for (int with_encoder = 0; with_encoder < 2; with_encoder++) {
        for (int i = 0; i < 3; i++) {
            measures = with_encoder;
            fresh();
            start_long_move();
            closed_switches = causes[i].closed;
            machine_tick();
            CHECK(!halted); /* one sample may be a spike */
            machine_tick();
            CHECK(halted && servo_us == 1000);
            machine_poll();
            CHECK(queue_is_empty());
            char expected[32];
            sprintf(expected, "error 3 %s", causes[i].error);
            CHECK(answers("3:m 1 1000 40 100", expected));
            CHECK(with_encoder ? strncmp(framed("where"), "at unknown", 10) != 0 : answers("where", "at unknown"));
            /* A new plan acknowledges a limit; the emergency stop only once it is released. */
            if (causes[i].closed == SWITCH_STOP) {
                CHECK(answers("0:begin 1 1 10000", "error 0 stop"));
                closed_switches = 0;
                machine_tick();
                machine_tick();
            }
            CHECK(answers("0:begin 1 1 10000", "ok 1 room 127"));
        }
    }
    measures = false;
    fresh();
    start_long_move();
    closed_switches = SWITCH_1;
    machine_tick();
    closed_switches = 0;
    machine_tick();
    machine_tick();
    CHECK(!halted);
}

static void stop_command_and_follow_fault(void) {
    measures = true;
    fresh();
    start_long_move();
    CHECK(strcmp(framed("stop"), "ok") == 0 && halted);
    machine_poll();
    CHECK(answers("3:m 1 1000 40 100", "error 3 stop"));
    fresh();
    start_long_move();
    machine_fault(FAULT_FOLLOW);
    machine_poll();
    CHECK(answers("3:m 1 1000 40 100", "error 3 follow"));
    CHECK(answers("where", "at unknown"));
    measures = false;
}

static void homing_finds_the_switch_from_ten_poses(void) {
    for (int pose = 0; pose < 10; pose++) {
        fresh();
        config.must_home = true;
        config.homing[0] = (struct plotplan_homing){.used = true, .ticks = {-1, 1}, .fast_us = 500, .slow_us = 4000, .back_off = 40, .longest = 3000};
        config.home[0] = 7;
        config.home[1] = -7;
        switch_fitted = true;
        switch_at = -100 * pose + 10; /* closed at the start of pose 0 */
        physical = 0;
        update_switch();
        machine_tick();
        machine_tick();
        CHECK(answers("0:begin 1 1 10000", "error 0 home"));
        CHECK(strcmp(framed("home"), "ok") == 0);
        CHECK(answers("where", "at unknown"));
        CHECK(answers("0:begin 1 1 10000", "error 0 homing"));
        long polls = 0;
        for (long i = 0; i < 100000 && homing_is_active(); i++) {
            machine_poll();
            if (i % 3 == 0) {
                machine_tick();
            }
            polls = i;
        }
        CHECK(polls < 99999);
        /* Backed off from the switch, wherever that was. */
        CHECK(physical == switch_at + 40);
        CHECK(answers("where", "at 7 -7 0"));
        CHECK(!(closed_switches & SWITCH_1));
        CHECK(answers("0:begin 1 1 10000", "ok 1 room 127"));
        CHECK(answers("1:s 0 0 7 -7", "ok 2"));
    }
}

static void homing_fails_without_a_switch(void) {
    fresh();
    CHECK(strcmp(framed("home"), "error no switches") == 0);
    config.homing[0] = (struct plotplan_homing){.used = true, .ticks = {-1, 0}, .fast_us = 500, .slow_us = 4000, .back_off = 40, .longest = 300};
    CHECK(strcmp(framed("home"), "ok") == 0);
    CHECK(strcmp(framed("home"), "ok") == 0); /* repeated */
    for (int i = 0; i < 5000; i++) {
        machine_poll();
    }
    CHECK(!homing_is_active() && drive_at[0] >= -301);
    CHECK(answers("status", "status home late 0 start power"));
    CHECK(answers("where", "at unknown"));
}

static void run_homing(void) {
    for (long i = 0; i < 200000 && homing_is_active(); i++) {
        machine_poll();
    }
    machine_poll();
    CHECK(!homing_is_active() && sought_motors == 0);
}

static void prepare_stop(bool feels, int32_t at, int32_t from) {
    measures = seeks = feels;
    fresh();
    config.must_home = true;
    config.homing[0] = (struct plotplan_homing){.used = true, .limit_switch = PLOTPLAN_STOP, .ticks = {-1, 1},
        .fast_us = 500, .slow_us = 4000, .back_off = 40, .longest = 3000, .stop_duty = 160};
    config.home[0] = 7;
    config.home[1] = -7;
    stop_fitted = true;
    stop_at = at;
    physical = from;
}

static void homing_finds_a_mechanical_stop_from_ten_poses(void) {
    for (int feels = 0; feels < 2; feels++) {
        for (int pose = 0; pose < 10; pose++) {
            prepare_stop(feels, -500, -500 + 120 * pose); /* pose 0 stands at the stop */
            closed_switches = SWITCH_1 | SWITCH_2; /* the pins of switches do not matter */
            CHECK(answers("0:begin 1 1 10000", "error 0 home"));
            CHECK(strcmp(framed("home"), "ok") == 0);
            run_homing();
            CHECK(physical == -460);
            CHECK(answers("where", "at 7 -7 0"));
            CHECK(drive_at[0] == 7 && drive_at[1] == -7);
            closed_switches = 0;
            CHECK(answers("0:begin 1 1 10000", "ok 1 room 127"));
        }
    }
    measures = seeks = false;
}

static void homing_to_a_stop_fails(void) {
    for (int way = 0; way < 4; way++) {
        prepare_stop(true, way == 0 ? -5000 : -500, 0);
        jammed = way == 1;    /* or an encoder without counts */
        sticks_at = way == 2 ? -100 : INT32_MIN; /* held back once, 400 ticks before the stop */
        CHECK(strcmp(framed("home"), "ok") == 0);
        for (int i = 0; i < 4000 && way == 2; i++) {
            machine_poll();
            if (held_back >= 10) {
                sticks_at = INT32_MIN;
            }
        }
        if (way == 3) {
            for (int i = 0; i < 100; i++) {
                machine_poll();
            }
            CHECK(sought_motors == 3 && strcmp(framed("stop"), "ok") == 0);
        }
        run_homing();
        CHECK(answers("status", way == 3 ? "status stop late 0 start power" : "status home late 0 start power"));
        CHECK(answers("where", "at unknown"));
        CHECK(answers("0:begin 1 1 10000", "error 0 home"));
    }
    /* An RC servo has nothing to find there. */
    prepare_stop(false, -500, 0);
    fake_drive.measures_position = true;
    CHECK(strcmp(framed("home"), "error no switches") == 0);
    measures = seeks = false;
}

static void pens_of_all_kinds(void) {
    fresh();
    config.pen.kind = PEN_SOLENOID;
    pen_init();
    pen_set(2);
    CHECK(solenoid == 1);
    pen_set(0);
    CHECK(solenoid == 0);
    config.pen.kind = PEN_Z;
    config.pen.up = 0;
    config.pen.down = 400;
    pen_init();
    z_steps = 0;
    pen_set(1);
    for (int i = 0; i < 500; i++) {
        pen_tick();
    }
    CHECK(z_steps == 400);
    pen_set(0);
    for (int i = 0; i < 500; i++) {
        pen_tick();
    }
    CHECK(z_steps == 0);
}

int main(void) {
    lines_are_answered_as_documented();
    errors_name_the_cause();
    plain_lines_are_answered_without_numbers();
    times_wrap_after_71_minutes();
    damaged_line_is_never_executed();
    random_bytes_do_no_harm();
    full_queue_holds_the_line();
    steps_come_at_their_time();
    cuts_of_long_rows_keep_clear_of_steps();
    setpoints_follow_rows_of_any_length();
    loop_follows_within_a_count();
    duty_saturates_without_windup();
    switch_stops_motors_and_lifts_the_pen();
    stop_command_and_follow_fault();
    homing_finds_the_switch_from_ten_poses();
    homing_fails_without_a_switch();
    homing_finds_a_mechanical_stop_from_ten_poses();
    homing_to_a_stop_fails();
    pens_of_all_kinds();
    printf("%d checks passed, %d failed\n", passed, failed);
    return failed != 0;
}
