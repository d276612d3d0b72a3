/* Faults, homing, pens. */
#include "tests.h"

#include <stdlib.h>
#include <string.h>

#include "homing.h"
#include "pen.h"
#include "segment_queue.h"

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

void switch_stops_motors_and_lifts_the_pen(void) {
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

void stop_command_and_follow_fault(void) {
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

void homing_finds_the_switch_from_ten_poses(void) {
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

void homing_fails_without_a_switch(void) {
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

void homing_finds_a_mechanical_stop_from_ten_poses(void) {
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

void homing_to_a_stop_fails(void) {
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

void pens_of_all_kinds(void) {
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
