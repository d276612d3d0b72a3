#include "machine.h"

#include <stddef.h>
#include <stdlib.h>

#include "homing.h"
#include "pen.h"
#include "port.h"
#include "segment_queue.h"

/* A DC motor at rest may be this far from its target. */
#define ARRIVED_TICKS 8
/* A rest that lets the last pen change of a plan happen in the order of the queue. */
#define END_REST_US 1000

const struct plotplan_machine *machine;

/* Where the motors are once the queue is empty; `known` says whether that means anything. */
static int32_t planned[2];
static bool known;
static uint32_t moves, clock_us;
static volatile enum fault fault;
/* A fault that the main loop has not dealt with. */
static volatile bool fault_is_new;
static volatile uint16_t ms;
static volatile uint8_t late;
static uint8_t switches, switches_before;

void machine_init(const struct plotplan_machine *configuration) {
    machine = configuration;
    known = fault_is_new = false;
    fault = FAULT_NONE;
    moves = clock_us = 0;
    late = 0;
    queue_clear();
    pen_init();
    machine->drive->init();
}

uint16_t machine_ms(void) {
    uint8_t state = port_lock();
    uint16_t now = ms;
    port_unlock(state);
    return now;
}

void machine_set_position(int32_t ticks1, int32_t ticks2) {
    planned[0] = ticks1;
    planned[1] = ticks2;
    known = true;
    machine->drive->set_position(ticks1, ticks2);
}

void machine_stop_here(void) {
    uint8_t state = port_lock();
    machine->drive->halt();
    queue_clear();
    port_unlock(state);
    int32_t at[2];
    machine->drive->position(at);
    planned[0] = at[0];
    planned[1] = at[1];
}

static flash_text fault_name(void) {
    switch (fault) {
    case FAULT_LIMIT:
        return TEXT("limit");
    case FAULT_FOLLOW:
        return TEXT("follow");
    case FAULT_STOP:
        return TEXT("stop");
    case FAULT_HOME:
        return TEXT("home");
    default:
        return NULL;
    }
}

void machine_fault(enum fault what) {
    machine->drive->halt();
    pen_set(0);
    if (fault == FAULT_NONE) {
        fault = what;
    }
    fault_is_new = true;
}

/* What speaks against any line of a plan. */
static reason refusal(void) {
    if (homing_is_active()) {
        return TEXT("homing");
    }
    return fault_name();
}

reason machine_begin(void) {
    if (homing_is_active()) {
        return TEXT("homing");
    }
    if (machine->must_home && !known) {
        return TEXT("home");
    }
    if (fault != FAULT_NONE) {
        /* A new plan acknowledges the fault, but not while its cause lasts. */
        if (machine->stop_used && switches & SWITCH_STOP) {
            return TEXT("stop");
        }
        fault = FAULT_NONE;
        if (known) {
            int32_t at[2];
            machine->drive->position(at);
            machine_set_position(at[0], at[1]);
        }
    }
    moves = clock_us = 0;
    return NULL;
}

reason machine_sync(uint32_t row, uint32_t time_us, int32_t ticks1, int32_t ticks2) {
    reason refused = refusal();
    if (refused) {
        return refused;
    }
    if (row != moves || time_us != clock_us) {
        return TEXT("count");
    }
    if (!known) {
        if (machine->must_home) {
            return TEXT("home");
        }
        machine_set_position(ticks1, ticks2);
    } else if (machine->drive->measures_position && row == 0 && !machine->drive->is_moving()
               && labs(ticks1 - planned[0]) <= ARRIVED_TICKS && labs(ticks2 - planned[1]) <= ARRIVED_TICKS) {
        /* A plan that starts where `where` said the motors were, a count ago. */
        planned[0] = ticks1;
        planned[1] = ticks2;
        if (!machine_has_arrived()) {
            return TEXT("place");
        }
    }
    return ticks1 == planned[0] && ticks2 == planned[1] ? NULL : TEXT("place");
}

reason machine_move(uint32_t pen, uint32_t us, int32_t ticks1, int32_t ticks2) {
    const int32_t to[2] = {ticks1, ticks2};
    int16_t distance[2];
    reason refused = refusal();
    if (refused) {
        return refused;
    }
    if (!known) {
        return TEXT("place");
    }
    if (us == 0 || us > SEGMENT_LONGEST_US || pen > UINT8_MAX) {
        return TEXT("range");
    }
    for (uint8_t i = 0; i < 2; i++) {
        const struct plotplan_motor *motor = &machine->motor[i];
        if (to[i] < motor->lowest || to[i] > motor->highest) {
            return TEXT("range");
        }
        int32_t d = to[i] - planned[i];
        if (d < -INT16_MAX || d > INT16_MAX) {
            return TEXT("far");
        }
        distance[i] = (int16_t)d;
        uint16_t ticks = (uint16_t)(d < 0 ? -d : d);
        /* Rounding to ticks may add one to a row. */
        if (ticks > 1 && (uint32_t)(ticks - 1) * motor->shortest_tick_us > us) {
            return TEXT("speed");
        }
    }
    queue_push(distance[0], distance[1], us, (uint8_t)pen);
    planned[0] = ticks1;
    planned[1] = ticks2;
    moves++;
    clock_us += us;
    return NULL;
}

reason machine_end(uint32_t pen, uint32_t plan_moves, uint32_t time_us) {
    reason refused = refusal();
    if (refused) {
        return refused;
    }
    if (pen > UINT8_MAX) {
        return TEXT("range");
    }
    if (plan_moves != moves || time_us != clock_us) {
        return TEXT("count");
    }
    queue_push(0, 0, END_REST_US, (uint8_t)pen);
    return NULL;
}

void machine_push(int16_t ticks1, int16_t ticks2, uint32_t us) {
    planned[0] += ticks1;
    planned[1] += ticks2;
    queue_push(ticks1, ticks2, us, 0);
}

reason machine_home(void) {
    if (homing_is_active()) {
        return NULL; /* the command may be repeated */
    }
    if (machine->drive->is_moving() || !queue_is_empty()) {
        return TEXT("moving");
    }
    if (machine->stop_used && switches & SWITCH_STOP) {
        return TEXT("stop");
    }
    fault = FAULT_NONE;
    if (!homing_start()) {
        return TEXT("no switches");
    }
    known = false;
    return NULL;
}

reason machine_measure(void) {
    if (!machine->drive->measure) {
        return TEXT("no loop");
    }
    if (machine->drive->is_moving() || !queue_is_empty() || homing_is_active()) {
        return TEXT("moving");
    }
    if (fault != FAULT_NONE) {
        return fault_name();
    }
    machine->drive->measure();
    return NULL;
}

bool machine_has_arrived(void) {
    int32_t at[2];
    machine->drive->position(at);
    return labs(at[0] - planned[0]) <= ARRIVED_TICKS && labs(at[1] - planned[1]) <= ARRIVED_TICKS;
}

bool machine_where(int32_t ticks[2], bool *moving) {
    if (!known || homing_is_active()) {
        return false;
    }
    *moving = machine->drive->is_moving() || !queue_is_empty();
    machine->drive->position(ticks);
    /* A DC motor rests within a few counts of its target. The loop still pulls it there, so the
     * target is the position to plan from. */
    if (!*moving && fault == FAULT_NONE && machine_has_arrived()) {
        ticks[0] = planned[0];
        ticks[1] = planned[1];
    }
    return true;
}

flash_text machine_state(void) {
    if (fault != FAULT_NONE) {
        return fault_name();
    }
    if (homing_is_active()) {
        return TEXT("homing");
    }
    return machine->drive->is_moving() || !queue_is_empty() ? TEXT("moving") : TEXT("idle");
}

uint8_t machine_late(void) {
    return late;
}

void machine_count_late(void) {
    /* Homing's moves end in motion on purpose. */
    if (late < UINT8_MAX && !homing_is_active()) {
        late++;
    }
}

void machine_poll(void) {
    if (fault_is_new) {
        fault_is_new = false;
        /* A stepper that is stopped at speed may move on: nobody knows by how much. */
        bool lost = !machine->drive->measures_position || fault == FAULT_FOLLOW || fault == FAULT_HOME
                    || homing_is_active();
        homing_cancel();
        machine_stop_here();
        if (lost) {
            known = false;
        }
    }
    homing_poll();
    machine->drive->poll();
}

void machine_tick(void) {
    ms++;
    /* Two equal samples: a switch wire beside a motor wire picks up spikes. A pin-change interrupt
     * would be a millisecond faster and stop on each of them. */
    uint8_t now = port_switches();
    uint8_t both = now & switches_before;
    switches_before = now;
    uint8_t closed = both & ~switches;
    switches = both;
    if (machine->stop_used && closed & SWITCH_STOP) {
        machine_fault(FAULT_STOP);
    } else if (machine->limits_used && closed & (SWITCH_1 | SWITCH_2) && !homing_is_active()
               && machine->drive->is_moving()) {
        machine_fault(FAULT_LIMIT);
    }
    pen_tick();
    if (machine->drive->tick) {
        machine->drive->tick();
    }
}
