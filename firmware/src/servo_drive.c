/* Two RC servos as motors: pulses by timer 1, new ones every 20 ms, positions along the rows. */
#if defined(__AVR__)

#include <stddef.h>

#include "drive.h"
#include "machine.h"
#include "pen.h"
#include "port_avr.h"
#include "segment_queue.h"
#include "setpoint.h"

#define START_DELAY_MS 200
/* Timer counts of half a microsecond. */
#define FRAME_COUNTS 40000

static struct setpoint setpoint;
static volatile bool engaged;
static uint8_t pen_wanted;
static uint16_t wait_ms;

static void init(void) {
    port_use_dc_limits();
    PIN_OUTPUT(PIN_PWM1);
    PIN_OUTPUT(PIN_PWM2);
    ICR1 = FRAME_COUNTS - 1;
    TCCR1A = _BV(WGM11); /* no pulses before the position is known */
    TCCR1B = _BV(WGM13) | _BV(WGM12) | _BV(CS11);
    engaged = false;
}

/* Half microseconds. A pulse that has begun is not cut: the timer takes the value at its next period. */
static uint16_t pulse_of(uint8_t i) {
    const struct plotplan_servo *servo = &machine->motor[i].servo;
    int32_t us = servo->zero_us + ((setpoint_of(&setpoint, i) * servo->us_per_256_ticks) >> (8 + SETPOINT_SHIFT));
    return (uint16_t)(us * 2);
}

static void apply(void) {
    uint16_t pulse1 = pulse_of(0), pulse2 = pulse_of(1);
    uint8_t state = port_lock();
    OCR1A = pulse1;
    OCR1B = pulse2;
    port_unlock(state);
}

static void set_position(int32_t ticks1, int32_t ticks2) {
    uint8_t state = port_lock();
    setpoint_set(&setpoint, ticks1, ticks2);
    engaged = true;
    apply();
    TCCR1A = _BV(COM1A1) | _BV(COM1B1) | _BV(WGM11);
    port_unlock(state);
}

static void position(int32_t ticks[2]) {
    uint8_t state = port_lock();
    for (uint8_t i = 0; i < 2; i++) {
        ticks[i] = setpoint_of(&setpoint, i) >> SETPOINT_SHIFT;
    }
    port_unlock(state);
}

static bool is_moving(void) {
    return setpoint.running;
}

static void poll(void) {
}

static void tick(void) {
    if (!engaged) {
        return;
    }
    if (setpoint.running) {
        setpoint_advance(&setpoint);
    } else if (queue_is_empty()) {
        wait_ms = 0;
    } else if (queue_is_full() || ++wait_ms > START_DELAY_MS) {
        wait_ms = 0;
        setpoint_start(&setpoint);
    }
    if (setpoint.running && setpoint.pen != pen_wanted) {
        pen_wanted = setpoint.pen;
        pen_set(pen_wanted);
    }
    apply();
}

/* The servos hold where they are. */
static void halt(void) {
    uint8_t state = port_lock();
    if (engaged) {
        int32_t here[2];
        position(here);
        setpoint_set(&setpoint, here[0], here[1]);
    }
    pen_wanted = 0;
    port_unlock(state);
}

const struct drive servo_drive = {
    .name = "servo",
    .init = init,
    .set_position = set_position,
    .position = position,
    .is_moving = is_moving,
    .poll = poll,
    .tick = tick,
    .halt = halt,
    .measure = NULL,
    .measures_position = true, /* a servo goes where its pulse says */
};

#endif
