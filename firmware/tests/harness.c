/* Checks, random numbers, and the fakes behind the portable layers. */
#include "tests.h"

#include <string.h>

#include "homing.h"
#include "pen.h"
#include "segment_queue.h"
#include "tick_lines.h"

int passed, failed;

void check(int holds, const char *what, const char *file, int line) {
    if (holds) {
        passed++;
    } else {
        failed++;
        printf("%s:%d: %s\n", file, line, what);
    }
}

static uint64_t random_state = 88172645463325252u;
uint32_t random32(void) {
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return (uint32_t)(random_state >> 24);
}
uint32_t random_below(uint32_t n) {
    return random32() % n;
}

/* ---- fake port ---- */
uint8_t closed_switches;
uint16_t servo_us;
int solenoid, z_steps;
uint8_t port_switches(void) { return closed_switches; }
void port_servo(uint16_t us) { servo_us = us; }
void port_solenoid(bool on) { solenoid = on; }
void port_z_step(bool down) { z_steps += down ? 1 : -1; }
flash_text port_reset_cause(void) { return "power"; }
uint8_t port_lock(void) { return 0; }
void port_unlock(uint8_t state) { (void)state; }

/* ---- fake drive: executes the queue at once, a unit of ticks a poll, or holds it ---- */
int32_t drive_at[2];
bool hold, halted, measures;
static struct segment executing;
static bool has_segment;
/* A switch closes while motor 0 is at or below this; `physical` is not changed by a new datum. */
int32_t switch_at, physical;
bool switch_fitted;
/* A mechanical stop, which motor 0 does not pass, and a place above it where it sticks once. A drive that feels it
 * does not move on and is stalled after 10 ticks more; another one counts steps that are not made. */
int32_t stop_at, sticks_at;
bool stop_fitted, jammed, seeks;
uint8_t held_back, sought_motors;
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
void update_switch(void) {
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
struct drive fake_drive = {
    .name = "fake", .init = drive_init, .set_position = drive_set, .position = drive_position,
    .is_moving = drive_moving, .poll = drive_poll, .halt = drive_halt,
};

struct plotplan_machine config;

void fresh(void) {
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
const char *raw(const char *bytes, size_t length) {
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

void frame(char *to, const char *text) {
    uint8_t sum = 0;
    for (const char *at = text; *at; at++) {
        sum ^= (uint8_t)*at;
    }
    sprintf(to, "%s*%u\n", text, sum);
}

/* The answer's text if its checksum is right. */
const char *framed(const char *text) {
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

int answers(const char *text, const char *expected) {
    const char *got = framed(text);
    if (strcmp(got, expected) != 0) {
        printf("%s: answered '%s' instead of '%s'\n", text, got, expected);
        return 0;
    }
    return 1;
}

void finish_motion(void) {
    for (int i = 0; i < 1000000 && (has_segment || !queue_is_empty()); i++) {
        machine_poll();
    }
}
