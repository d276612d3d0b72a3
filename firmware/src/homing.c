#include "homing.h"

#include <stddef.h>

#include "machine.h"
#include "port.h"
#include "segment_queue.h"

/* Units of the move in one segment: short enough that a stop does not wait. */
#define UNITS 8

enum phase { IDLE, CLEAR, FAST, BACK, SLOW, BACK_AGAIN };

static volatile enum phase phase;
static uint8_t move;
static uint16_t units_left;

static const struct plotplan_homing *current(void) {
    return &machine->homing[move];
}

static bool switch_is_closed(void) {
    return port_switches() & (current()->limit_switch ? SWITCH_2 : SWITCH_1);
}

static void enter(enum phase next, uint16_t units) {
    phase = next;
    units_left = units;
}

/* A switch that is closed at the start is left first. */
static void start_move(void) {
    const struct plotplan_homing *homing = current();
    if (switch_is_closed()) {
        enter(CLEAR, homing->longest);
    } else {
        enter(FAST, homing->longest);
    }
}

bool homing_start(void) {
    move = 0;
    if (!machine->homing[0].used) {
        return false;
    }
    int32_t at[2];
    machine->drive->position(at);
    machine_set_position(at[0], at[1]);
    start_move();
    return true;
}

bool homing_is_active(void) {
    return phase != IDLE;
}

void homing_cancel(void) {
    phase = IDLE;
}

static void fail(void) {
    phase = IDLE;
    machine_fault(FAULT_HOME);
}

static void next_move(void) {
    move++;
    if (move < 2 && current()->used) {
        start_move();
        return;
    }
    phase = IDLE;
    machine_set_position(machine->home[0], machine->home[1]);
}

/* Keeps two segments in the queue. */
static void push_units(int8_t sign, uint16_t unit_us) {
    const struct plotplan_homing *homing = current();
    uint8_t units = units_left < UNITS ? (uint8_t)units_left : UNITS;
    if (units == 0 || queue_is_full()) {
        return;
    }
    machine_push(sign * homing->ticks[0] * units, sign * homing->ticks[1] * units,
                 (uint32_t)unit_us * units);
    units_left -= units;
}

static bool is_at_rest(void) {
    return queue_is_empty() && !machine->drive->is_moving();
}

static void stop_and_enter(enum phase next, uint16_t units) {
    machine_stop_here();
    int32_t at[2];
    machine->drive->position(at);
    machine_set_position(at[0], at[1]);
    enter(next, units);
}

static void search(uint16_t unit_us, enum phase next) {
    if (switch_is_closed()) {
        stop_and_enter(next, current()->back_off);
    } else if (units_left == 0 && is_at_rest()) {
        fail();
    } else if (queue_is_empty()) {
        push_units(1, unit_us);
    }
}

/* Away from a switch that is closed at the start, slowly. */
static void clear(void) {
    const struct plotplan_homing *homing = current();
    if (!switch_is_closed()) {
        stop_and_enter(FAST, homing->longest);
    } else if (units_left == 0 && is_at_rest()) {
        fail();
    } else if (queue_is_empty()) {
        push_units(-1, homing->slow_us);
    }
}

void homing_poll(void) {
    const struct plotplan_homing *homing = current();
    switch (phase) {
    case IDLE:
        return;
    case CLEAR:
        clear();
        return;
    case BACK:
    case BACK_AGAIN:
        if (units_left > 0) {
            if (queue_is_empty()) {
                push_units(-1, phase == BACK_AGAIN ? homing->slow_us : homing->fast_us);
            }
        } else if (is_at_rest()) {
            if (switch_is_closed()) {
                fail();
            } else if (phase == BACK) {
                enter(SLOW, 2 * homing->back_off);
            } else {
                next_move();
            }
        }
        return;
    case FAST:
        search(homing->fast_us, BACK);
        return;
    case SLOW:
        search(homing->slow_us, BACK_AGAIN);
        return;
    }
}
