#include "homing.h"

#include <stddef.h>
#include <stdlib.h>

#include "machine.h"
#include "port.h"
#include "segment_queue.h"

/* Units of the move in one segment: short enough that a stop does not wait. */
#define UNITS 8
/* The way from where a DC motor came to rest to its target, a few counts. */
#define SETTLE_US 100000UL

enum phase { IDLE, CLEAR, FAST, BACK, SLOW, BACK_AGAIN, SETTLE };

static volatile enum phase phase;
static uint8_t move;
static uint16_t units_left;
/* Where the moves made up to now end if the motors are exactly at their targets, in the ticks of the
 * drive. Contact is what is measured; where the motors come to rest afterwards is not. */
static int32_t place[2];
/* The motor that makes most of the move, and its position at the first contact. */
static uint8_t leader;
static int32_t first_contact;

static const struct plotplan_homing *current(void) {
    return &machine->homing[move];
}

static bool goes_to_stop(void) {
    return current()->limit_switch == PLOTPLAN_STOP;
}

static bool switch_is_closed(void) {
    return !goes_to_stop() && port_switches() & (current()->limit_switch ? SWITCH_2 : SWITCH_1);
}

static void enter(enum phase next, uint16_t units) {
    phase = next;
    units_left = units;
}

/* Limits the force on the way to a stop and back. */
static void limit_duty(void) {
    if (machine->drive->seek_stop) {
        uint8_t motors = (current()->ticks[0] ? 1 : 0) | (current()->ticks[1] ? 2 : 0);
        machine->drive->seek_stop(goes_to_stop() ? motors : 0, current()->stop_duty);
    }
}

/* A switch that is closed at the start is left first. */
static void start_move(void) {
    const struct plotplan_homing *homing = current();
    leader = abs(homing->ticks[1]) > abs(homing->ticks[0]) ? 1 : 0;
    limit_duty();
    if (switch_is_closed()) {
        enter(CLEAR, homing->longest);
    } else {
        enter(FAST, homing->longest);
    }
}

/* A drive that knows its position without a search, such as RC servos, has nothing to find at a stop. */
static bool can_home(void) {
    for (uint8_t i = 0; i < 2; i++) {
        const struct plotplan_homing *homing = &machine->homing[i];
        if (homing->used && homing->limit_switch == PLOTPLAN_STOP && machine->drive->measures_position
            && !machine->drive->seek_stop) {
            return false;
        }
    }
    return machine->homing[0].used;
}

bool homing_start(void) {
    if (!can_home()) {
        return false;
    }
    move = 0;
    machine->drive->position(place);
    machine_set_position(place[0], place[1]);
    start_move();
    return true;
}

bool homing_is_active(void) {
    return phase != IDLE;
}

void homing_cancel(void) {
    if (phase != IDLE && machine->drive->seek_stop) {
        machine->drive->seek_stop(0, 0);
    }
    phase = IDLE;
}

static void fail(void) {
    homing_cancel();
    machine_fault(FAULT_HOME);
}

static bool is_at_rest(void) {
    return queue_is_empty() && !machine->drive->is_moving();
}

/* Of the end of a move: `place` after the leader has touched the switch or stop at `contact` and the motors
 * have backed off. The other motor keeps the ratio of the move. */
static void advance_place(int32_t contact) {
    const struct plotplan_homing *homing = current();
    int32_t ticks = homing->ticks[leader];
    int32_t way = contact - place[leader] - ticks * homing->back_off;
    uint8_t other = !leader;
    place[leader] += way;
    place[other] += way * homing->ticks[other] / ticks;
}

static void next_move(void) {
    move++;
    if (move < 2 && current()->used) {
        start_move();
        return;
    }
    move--;
    int32_t at[2];
    machine->drive->position(at);
    for (uint8_t i = 0; i < 2; i++) {
        at[i] += machine->home[i] - place[i];
    }
    if (machine->drive->seek_stop) {
        machine->drive->seek_stop(0, 0);
    }
    machine_set_position(at[0], at[1]);
    int16_t rest[2];
    for (uint8_t i = 0; i < 2; i++) {
        rest[i] = (int16_t)(machine->home[i] - at[i]);
    }
    if (rest[0] || rest[1]) {
        machine_push(rest[0], rest[1], SETTLE_US);
    }
    enter(SETTLE, 0);
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

/* Stops where the motors are; that of the leader. */
static int32_t stop_and_enter(enum phase next, uint16_t units) {
    machine_stop_here();
    int32_t at[2];
    machine->drive->position(at);
    machine_set_position(at[0], at[1]);
    limit_duty();
    enter(next, units);
    return at[leader];
}

/* A drive that does not feel a stop is at it once it has made all steps. */
static bool is_at_contact(bool has_ended) {
    if (!goes_to_stop()) {
        return switch_is_closed();
    }
    return machine->drive->is_stalled ? machine->drive->is_stalled() : has_ended;
}

static void search(uint16_t unit_us) {
    const struct plotplan_homing *homing = current();
    bool has_ended = units_left == 0 && is_at_rest();
    if (is_at_contact(has_ended)) {
        if (phase == FAST) {
            first_contact = stop_and_enter(BACK, homing->back_off);
            return;
        }
        int32_t contact = stop_and_enter(BACK_AGAIN, homing->back_off);
        /* What held the motor back the first time was not the stop, or it has not moved since. */
        int32_t off = labs(contact - first_contact);
        if (goes_to_stop() && machine->drive->is_stalled
            && off > (int32_t)homing->back_off * abs(homing->ticks[leader]) / 2) {
            fail();
        } else {
            advance_place(contact);
        }
    } else if (has_ended) {
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

static void back_off(uint16_t unit_us) {
    if (goes_to_stop() && machine->drive->is_stalled && machine->drive->is_stalled()) {
        fail(); /* blocked, or the encoder does not count */
    } else if (units_left > 0) {
        if (queue_is_empty()) {
            push_units(-1, unit_us);
        }
    } else if (is_at_rest()) {
        if (switch_is_closed() || !machine_has_arrived()) {
            fail();
        } else if (phase == BACK) {
            enter(SLOW, 2 * current()->back_off);
        } else {
            next_move();
        }
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
        back_off(homing->fast_us);
        return;
    case BACK_AGAIN:
        back_off(homing->slow_us);
        return;
    case FAST:
        search(homing->fast_us);
        return;
    case SLOW:
        search(homing->slow_us);
        return;
    case SETTLE:
        if (is_at_rest()) {
            phase = IDLE;
        }
        return;
    }
}
