#include "tick_lines.h"

#include <stddef.h>
#include <string.h>

#include "machine.h"
#include "segment_queue.h"

/* To the machine: `NUMBER:LINE*SUM`, or LINE alone; from it `ok NUMBER*SUM` and so on. SUM is the
 * exclusive or of the bytes before the asterisk. */
enum state { AT_START, IN_NUMBER, IN_VERB, IN_FIELDS, IN_COMMENT, IN_SUM };
enum owed { NOTHING, OK, ERROR, PLAIN_OK, PLAIN_ERROR, WHERE, STATUS, IDENTITY, FRICTION };

/* A line names the machine that it was planned for in a comment: `begin ... ; machine NAME`. */
static const IN_FLASH char MACHINE_COMMENT[] = "; machine ";

#define FIELDS 4
#define VERB_BYTES 9

static struct {
    enum state state;
    bool numbered, bad, negative, in_field, has_sum;
    uint8_t fields, verb_length, sum, sum_value, comment_at;
    /* Fields above 2^32: times wrap on purpose, everything else is out of range. */
    uint8_t wrapped;
    bool other_machine;
    uint32_t number;
    uint32_t field[FIELDS];
    char verb[VERB_BYTES];
} line;

static const char *name;
static uint8_t announced_room;
/* The number of the line expected next. */
static uint32_t expected;
static enum owed owed;
static reason why;

static void start_line(void) {
    memset(&line, 0, sizeof line);
}

void tick_lines_init(const char *machine_name, uint8_t room) {
    name = machine_name;
    announced_room = room;
    expected = 0;
    owed = NOTHING;
    start_line();
}

static void end_field(void) {
    if (line.negative) {
        if (line.in_field) {
            line.field[line.fields - 1] = -line.field[line.fields - 1];
        } else {
            line.bad = true;
        }
    }
    line.negative = line.in_field = false;
}

static uint32_t append_digit(uint32_t value, uint8_t digit) {
    return value * 10 + digit;
}

static void field_byte(uint8_t byte) {
    uint8_t digit = byte - '0';
    if (digit < 10) {
        if (!line.in_field) {
            if (line.fields == FIELDS) {
                line.bad = true;
                return;
            }
            line.in_field = true;
            line.fields++;
        }
        uint32_t *value = &line.field[line.fields - 1];
        if (*value > 429496728UL) {
            line.wrapped |= 1 << (line.fields - 1);
        }
        *value = append_digit(*value, digit);
    } else if (byte == '-' && !line.in_field && !line.negative) {
        line.negative = true;
    } else if (byte == ' ') {
        end_field();
    } else if (byte != '\r') {
        line.bad = true;
    }
}

/* Compares a comment with `; machine NAME` as it comes in. */
static void comment_byte(uint8_t byte) {
    const uint8_t prefix = sizeof MACHINE_COMMENT - 1;
    if (byte == '\r') {
        return;
    }
    if (line.comment_at < prefix) {
        line.comment_at = byte == (uint8_t)MACHINE_COMMENT[line.comment_at] ? line.comment_at + 1 : UINT8_MAX;
    } else if (line.comment_at != UINT8_MAX && !line.other_machine) {
        uint8_t wanted = name[line.comment_at - prefix];
        line.other_machine = byte != wanted;
        line.comment_at++;
    }
}

static bool names_other_machine(void) {
    const uint8_t prefix = sizeof MACHINE_COMMENT - 1;
    if (line.comment_at < prefix || line.comment_at == UINT8_MAX) {
        return false;
    }
    return line.other_machine || name[line.comment_at - prefix] != '\0';
}

static void line_byte(uint8_t byte) {
    if (line.state == IN_SUM) {
        uint8_t digit = byte - '0';
        if (digit < 10) {
            line.sum_value = line.sum_value * 10 + digit;
            line.has_sum = true;
        } else if (byte != '\r') {
            line.bad = true;
        }
        return;
    }
    if (byte == '*') {
        end_field();
        line.state = IN_SUM;
        return;
    }
    line.sum ^= byte;
    if (byte == ';' && line.state != IN_COMMENT) {
        end_field();
        line.state = IN_COMMENT;
    }
    switch (line.state) {
    case AT_START:
        if (byte == ' ' || byte == '\r') {
            return;
        }
        if (byte >= '0' && byte <= '9') {
            line.number = byte - '0';
            line.state = IN_NUMBER;
            return;
        }
        line.state = IN_VERB;
        /* fall through */
    case IN_VERB:
        if (byte == ' ') {
            line.state = IN_FIELDS;
        } else if (byte == '\r') {
            return;
        } else if (line.verb_length + 1 < VERB_BYTES) {
            line.verb[line.verb_length++] = byte;
        } else {
            line.bad = true;
        }
        return;
    case IN_NUMBER:
        if (byte >= '0' && byte <= '9') {
            line.number = append_digit(line.number, byte - '0');
        } else if (byte == ':') {
            line.numbered = true;
            line.state = IN_VERB;
        } else {
            line.bad = true;
        }
        return;
    case IN_FIELDS:
        field_byte(byte);
        return;
    case IN_COMMENT:
        comment_byte(byte);
        return;
    default:
        return;
    }
}

static bool verb_is(flash_text verb) {
    const char *own = line.verb;
    while (*own && *own == *verb) {
        own++;
        verb++;
    }
    return *own == *verb;
}

/* Whether it is a line of a plan with the right number of fields. */
static bool is_well_formed(void) {
    if (line.bad) {
        return false;
    }
    if (verb_is(TEXT("m")) || verb_is(TEXT("s"))) {
        return line.fields == 4;
    }
    return (verb_is(TEXT("begin")) || verb_is(TEXT("end"))) && line.fields == 3;
}

/* Executes the line; NULL, or why it cannot be. */
static reason execute(void) {
    const uint32_t *n = line.field;
    if (!is_well_formed()) {
        return TEXT("line");
    }
    if (verb_is(TEXT("m"))) {
        return line.wrapped ? TEXT("range") : machine_move(n[0], n[1], (int32_t)n[2], (int32_t)n[3]);
    }
    if (verb_is(TEXT("s"))) {
        return line.wrapped & 0xc ? TEXT("range") : machine_sync(n[0], n[1], (int32_t)n[2], (int32_t)n[3]);
    }
    if (verb_is(TEXT("begin"))) {
        if (n[0] != PLOTPLAN_TICK_LINES_VERSION) {
            return TEXT("version");
        }
        return names_other_machine() ? TEXT("machine") : machine_begin();
    }
    return machine_end(n[0], n[1], n[2]);
}

/* Lines outside of a plan: `where*SUM`. False if it is none of them. */
static bool execute_command(void) {
    reason result = NULL;
    if (verb_is(TEXT("where"))) {
        owed = WHERE;
        return true;
    }
    if (verb_is(TEXT("status"))) {
        owed = STATUS;
        return true;
    }
    if (verb_is(TEXT("machine"))) {
        owed = IDENTITY;
        return true;
    }
    if (verb_is(TEXT("friction")) && machine->drive->friction) {
        owed = FRICTION;
        return true;
    }
    if (verb_is(TEXT("home"))) {
        result = machine_home();
    } else if (verb_is(TEXT("measure"))) {
        result = machine_measure();
    } else if (verb_is(TEXT("stop"))) {
        machine_fault(FAULT_STOP);
    } else {
        return false;
    }
    why = result;
    owed = result ? PLAIN_ERROR : PLAIN_OK;
    return true;
}

static void numbered_line(void) {
    owed = OK;
    /* Damaged, or not the one expected: the answer says which is. Line 0 starts again. */
    if (line.state != IN_SUM || (line.number != 0 && line.number != expected)) {
        return;
    }
    /* A line that is not one, although its sum is right: damaged twice. */
    if (!is_well_formed()) {
        return;
    }
    why = execute();
    if (why) {
        expected = line.number;
        owed = ERROR;
    } else {
        expected = line.number + 1;
    }
}

static void end_line(void) {
    bool summed = line.state == IN_SUM;
    end_field();
    if (summed && (!line.has_sum || line.sum_value != line.sum)) {
        owed = OK; /* damaged: the answer makes the sender repeat it */
    } else if (line.numbered) {
        numbered_line();
    } else if (line.verb_length == 0 && line.state != IN_NUMBER) {
        return; /* blank or a comment */
    } else if (!line.bad && execute_command()) {
        return;
    } else if (summed) {
        owed = OK;
    } else {
        why = line.state == IN_NUMBER ? TEXT("line") : execute();
        owed = why ? PLAIN_ERROR : PLAIN_OK;
    }
}

bool tick_lines_byte(uint8_t byte) {
    if (byte != '\n') {
        line_byte(byte);
        return true;
    }
    /* `m` and `end` put a segment into the queue. */
    if (queue_is_full() && (verb_is(TEXT("m")) || verb_is(TEXT("end")))) {
        return false;
    }
    end_line();
    start_line();
    return true;
}

bool tick_lines_owes_answer(void) {
    return owed != NOTHING;
}

static char *put(char *to, flash_text text) {
    while (*text) {
        *to++ = *text++;
    }
    return to;
}

static char *put_unsigned(char *to, uint32_t value) {
    /* Subtraction is faster than division on a chip without one. */
    static const IN_FLASH uint32_t powers[] = {1000000000, 100000000, 10000000, 1000000, 100000,
                                      10000,      1000,      100,      10};
    bool begun = false;
    for (uint8_t i = 0; i < sizeof powers / sizeof *powers; i++) {
        char digit = '0';
        while (value >= powers[i]) {
            value -= powers[i];
            digit++;
        }
        if (begun || digit != '0') {
            *to++ = digit;
            begun = true;
        }
    }
    *to++ = (char)('0' + value);
    return to;
}

static char *put_signed(char *to, int32_t value) {
    if (value < 0) {
        *to++ = '-';
        return put_unsigned(to, -(uint32_t)value);
    }
    return put_unsigned(to, (uint32_t)value);
}

static char *put_where(char *to) {
    int32_t at[2];
    bool moving;
    if (!machine_where(at, &moving)) {
        return put(to, TEXT("at unknown"));
    }
    to = put_signed(put(to, TEXT("at ")), at[0]);
    *to++ = ' ';
    to = put_signed(to, at[1]);
    return put(to, moving ? TEXT(" 1") : TEXT(" 0"));
}

uint8_t tick_lines_answer(char answer[ANSWER_BYTES]) {
    char *to = answer;
    bool summed = true;
    switch (owed) {
    case OK:
        to = put_unsigned(put(to, TEXT("ok ")), expected);
        if (expected == 1) {
            to = put_unsigned(put(to, TEXT(" room ")), announced_room);
        }
        break;
    case ERROR:
        to = put_unsigned(put(to, TEXT("error ")), expected);
        *to++ = ' ';
        to = put(to, why);
        break;
    case WHERE:
        to = put_where(to);
        break;
    case STATUS:
        to = put(put(to, TEXT("status ")), machine_state());
        to = put_unsigned(put(to, TEXT(" late ")), machine_late());
        to = put(put(to, TEXT(" start ")), port_reset_cause());
        break;
    case IDENTITY:
        to = put(to, TEXT("machine "));
        for (const char *at = name; *at; at++) {
            *to++ = *at;
        }
        *to++ = ' ';
        to = put_unsigned(to, PLOTPLAN_TICK_LINES_VERSION);
        break;
    case FRICTION: {
        int16_t duty[2];
        machine->drive->friction(duty);
        to = put_signed(put(to, TEXT("friction ")), duty[0]);
        *to++ = ' ';
        to = put_signed(to, duty[1]);
        break;
    }
    case PLAIN_ERROR:
        to = put(put(to, TEXT("error ")), why);
        summed = false;
        break;
    default:
        to = put(to, TEXT("ok"));
        summed = false;
        break;
    }
    owed = NOTHING;
    if (summed) {
        uint8_t sum = 0;
        for (const char *at = answer; at < to; at++) {
            sum ^= (uint8_t)*at;
        }
        *to++ = '*';
        to = put_unsigned(to, sum);
    }
    *to++ = '\n';
    return (uint8_t)(to - answer);
}
