/* Two DC motors with quadrature encoders: a loop at 1 kHz (dc_control.h), PWM of 20 kHz by timer 1. */
#if defined(__AVR__)

#include <stddef.h>

#include "dc_control.h"
#include "drive.h"
#include "machine.h"
#include "pen.h"
#include "port_avr.h"
#include "segment_queue.h"
#include "setpoint.h"

#define START_DELAY_MS 200
/* The error has been too large for this long when the motors stop. */
#define FOLLOW_MS 20
/* A motor at the largest duty of a search has found its stop once its encoder has moved by at most a count for
 * this long: at twice the duty that moves it, a free one makes a count in a few milliseconds. */
#define STALL_MS 100
#define STALL_COUNTS 1

/* Measurement of friction: a slow ramp of duty up to the first counts, then down until they stop.
 * The ramp down is slow against the motor's time constant: 2 %/s lags 0.2 % behind at 0.12 s. */
#define MEASURE_RISE_MS 16
#define MEASURE_FALL_MS 64
#define MEASURE_MOVED 3
#define MEASURE_STOPPED_MS 150
#define MEASURE_LARGEST (DUTY_LARGEST / 2)
/* The way back, a few hundred counts at most. */
#define RETURN_US 2000000UL

static volatile int16_t count1, count2; /* encoders, modulo 2^16 */
static uint8_t encoder_pins;

static int32_t at[2]; /* the same in 32 bits, once a millisecond */
static int16_t last_count[2];
static struct setpoint setpoint;
static struct dc_control control[2];
static int16_t friction[2];
static uint8_t window_at, too_far_ms[2], drain_ms, pen_delay, pen_wanted;
static uint16_t wait_ms;
static volatile bool engaged;

/* The motors that search a stop, as a mask. */
static struct {
    uint8_t motors, still_ms[2];
    int16_t duty, still_at[2];
    volatile bool stalled;
} seeking;

static struct {
    volatile enum { MEASURE_NOT, MEASURE_RISE, MEASURE_FALL, MEASURE_STORE } phase;
    uint8_t motor, ms;
    bool backwards;
    int16_t duty, stopped_at_duty;
    int16_t start_count, last_count;
    uint16_t still_ms;
    int16_t found[2];
    int32_t from[2];
} measuring;

/* Old pins of one encoder (bits 0, 1) and new ones (bits 2, 3): counts. Channel A leads forwards. A
 * jump over two counts is none. */
static const IN_FLASH int8_t quadrature[16] = {0, -1, 1, 0, 1, 0, 0, -1, -1, 0, 0, 1, 0, 1, -1, 0};

ISR(ENCODER_VECTOR) {
    uint8_t now = ENCODER_INPUT & 15, before = encoder_pins;
    encoder_pins = now;
    count1 += quadrature[(before & 3) | (uint8_t)((now & 3) << 2)];
    count2 += quadrature[(before >> 2) | (now & 12)];
}

static void init(void) {
    port_use_dc_limits();
    PIN_OUTPUT(PIN_PWM1);
    PIN_OUTPUT(PIN_PWM2);
    PIN_OUTPUT(PIN_IN1A);
    PIN_OUTPUT(PIN_IN1B);
    PIN_OUTPUT(PIN_IN2A);
    PIN_OUTPUT(PIN_IN2B);
    ENCODER_PULLUPS |= 15;
    encoder_pins = ENCODER_INPUT & 15;
    ENCODER_MASK |= 15;
    PCICR |= _BV(ENCODER_ENABLE);
    OCR1A = OCR1B = 0;
    ICR1 = DUTY_LARGEST - 1;
    TCCR1A = _BV(WGM11);
    TCCR1B = _BV(WGM13) | _BV(WGM12) | _BV(CS10);
    for (uint8_t i = 0; i < 2; i++) {
        friction[i] = machine->motor[i].loop.friction;
    }
    port_load_friction(friction);
    engaged = false;
    seeking.motors = 0;
}

static void apply1(int16_t duty) {
    if (machine->motor[0].reversed) {
        duty = -duty;
    }
    if (duty < 0) {
        PIN_LOW(PIN_IN1A);
        PIN_HIGH(PIN_IN1B);
        duty = -duty;
    } else {
        PIN_HIGH(PIN_IN1A);
        PIN_LOW(PIN_IN1B);
    }
    OCR1A = (uint16_t)duty;
}

static void apply2(int16_t duty) {
    if (machine->motor[1].reversed) {
        duty = -duty;
    }
    if (duty < 0) {
        PIN_LOW(PIN_IN2A);
        PIN_HIGH(PIN_IN2B);
        duty = -duty;
    } else {
        PIN_HIGH(PIN_IN2A);
        PIN_LOW(PIN_IN2B);
    }
    OCR1B = (uint16_t)duty;
}

/* Both outputs off: at duty 0 the timer would still make pulses of one count. */
static void release(void) {
    TCCR1A = _BV(WGM11);
    PIN_LOW(PIN_PWM1);
    PIN_LOW(PIN_PWM2);
    OCR1A = OCR1B = 0;
}

static void drive_outputs(void) {
    TCCR1A = _BV(COM1A1) | _BV(COM1B1) | _BV(WGM11);
}

static void read_encoders(void) {
    uint8_t state = port_lock();
    const int16_t count[2] = {count1, count2};
    port_unlock(state);
    for (uint8_t i = 0; i < 2; i++) {
        int16_t moved = count[i] - last_count[i];
        last_count[i] = count[i];
        at[i] += machine->motor[i].encoder_reversed ? -moved : moved;
    }
}

static void set_position(int32_t ticks1, int32_t ticks2) {
    uint8_t state = port_lock();
    at[0] = ticks1;
    at[1] = ticks2;
    last_count[0] = count1;
    last_count[1] = count2;
    setpoint_set(&setpoint, ticks1, ticks2);
    for (uint8_t i = 0; i < 2; i++) {
        dc_control_reset(&control[i], (int16_t)setpoint_of(&setpoint, i));
        too_far_ms[i] = 0;
    }
    drain_ms = 0;
    engaged = true;
    drive_outputs();
    port_unlock(state);
}

static void position(int32_t ticks[2]) {
    uint8_t state = port_lock();
    ticks[0] = at[0];
    ticks[1] = at[1];
    port_unlock(state);
}

static bool is_moving(void) {
    return setpoint.running || drain_ms != 0 || measuring.phase != MEASURE_NOT;
}

static void halt(void) {
    uint8_t state = port_lock();
    release();
    engaged = setpoint.running = false;
    drain_ms = pen_delay = 0;
    measuring.phase = MEASURE_NOT;
    port_unlock(state);
}

/* Row by row out of the queue, 10 ms ahead of the motors. */
static void advance(void) {
    if (setpoint.running) {
        if (!setpoint_advance(&setpoint)) {
            drain_ms = WINDOW_HALF + 1;
        }
    } else {
        if (drain_ms) {
            drain_ms--;
        }
        if (queue_is_empty()) {
            wait_ms = 0;
        } else if (queue_is_full() || ++wait_ms > START_DELAY_MS) {
            wait_ms = 0;
            setpoint_start(&setpoint);
        }
    }
    if (setpoint.running && setpoint.pen != pen_wanted) {
        pen_wanted = setpoint.pen;
        pen_delay = WINDOW_HALF;
    }
    if (pen_delay && --pen_delay == 0) {
        pen_set(pen_wanted);
    }
}

static void seek_stop(uint8_t motors, int16_t duty) {
    uint8_t state = port_lock();
    seeking.motors = motors;
    seeking.duty = duty;
    seeking.still_ms[0] = seeking.still_ms[1] = 0;
    seeking.stalled = false;
    port_unlock(state);
}

static bool is_stalled(void) {
    return seeking.stalled;
}

/* The duty of a motor on its way to a stop. */
static int16_t sought(uint8_t i, int16_t duty) {
    if (!(seeking.motors & (1 << i))) {
        return duty;
    }
    int16_t count = (int16_t)at[i], moved = count - seeking.still_at[i];
    bool limited = duty >= seeking.duty || duty <= -seeking.duty;
    if (!limited || moved > STALL_COUNTS || moved < -STALL_COUNTS) {
        seeking.still_at[i] = count;
        seeking.still_ms[i] = 0;
    } else if (++seeking.still_ms[i] >= STALL_MS) {
        seeking.still_ms[i] = STALL_MS;
        seeking.stalled = true;
    }
    return duty > seeking.duty ? seeking.duty : duty < -seeking.duty ? -seeking.duty : duty;
}

static bool follows(uint8_t i) {
    if (seeking.motors & (1 << i)) {
        return true;
    }
    uint16_t error = (uint16_t)(control[i].error < 0 ? -control[i].error : control[i].error);
    if (error >> SETPOINT_SHIFT < machine->motor[i].loop.follow_counts) {
        too_far_ms[i] = 0;
    } else if (++too_far_ms[i] > FOLLOW_MS) {
        return false;
    }
    return true;
}

static int16_t loop_of(uint8_t i) {
    const struct plotplan_motor *motor = &machine->motor[i];
    return dc_control_step(&control[i], &motor->loop, friction[i], window_at,
                           (int16_t)setpoint_of(&setpoint, i), (int16_t)((uint16_t)at[i] << SETPOINT_SHIFT));
}

static void next_measurement(void) {
    measuring.duty = measuring.ms = 0;
    measuring.still_ms = 0;
    measuring.start_count = (int16_t)at[measuring.motor];
    measuring.phase = MEASURE_RISE;
}

static void measure_tick(void) {
    int16_t count = (int16_t)at[measuring.motor];
    int16_t moved = count - measuring.start_count;
    if (measuring.phase == MEASURE_RISE) {
        if (++measuring.ms == MEASURE_RISE_MS) {
            measuring.ms = 0;
            measuring.duty++;
        }
        if (measuring.duty > MEASURE_LARGEST) {
            machine_fault(FAULT_FOLLOW);
            return;
        }
        if (moved >= MEASURE_MOVED || moved <= -MEASURE_MOVED) {
            measuring.phase = MEASURE_FALL;
            measuring.ms = 0;
            measuring.last_count = count;
        }
    } else {
        if (++measuring.ms == MEASURE_FALL_MS) {
            measuring.ms = 0;
            measuring.duty--;
        }
        if (count != measuring.last_count) {
            measuring.last_count = count;
            measuring.stopped_at_duty = measuring.duty;
            measuring.still_ms = 0;
        } else if (++measuring.still_ms > MEASURE_STOPPED_MS) {
            /* The mean of both directions: gravity and a bent shaft cancel. */
            measuring.found[measuring.motor] += measuring.stopped_at_duty;
            if (measuring.backwards) {
                measuring.motor++;
            }
            measuring.backwards = !measuring.backwards;
            measuring.duty = 0;
            if (measuring.motor == 2) {
                measuring.phase = MEASURE_STORE;
            } else {
                next_measurement();
            }
        }
    }
    int16_t duty = measuring.backwards ? -measuring.duty : measuring.duty;
    apply1(measuring.motor == 0 ? duty : 0);
    apply2(measuring.motor == 1 ? duty : 0);
}

static void measure(void) {
    uint8_t state = port_lock();
    measuring.motor = 0;
    measuring.backwards = false;
    measuring.found[0] = measuring.found[1] = 0;
    measuring.from[0] = at[0];
    measuring.from[1] = at[1];
    next_measurement();
    drive_outputs();
    port_unlock(state);
}

static void tick(void) {
    read_encoders();
    if (measuring.phase == MEASURE_RISE || measuring.phase == MEASURE_FALL) {
        measure_tick();
        return;
    }
    if (!engaged || measuring.phase == MEASURE_STORE) {
        return;
    }
    advance();
    int16_t duty1 = loop_of(0), duty2 = loop_of(1);
    window_at = window_at == WINDOW - 1 ? 0 : window_at + 1;
    if (!follows(0) || !follows(1)) {
        machine_fault(FAULT_FOLLOW);
        return;
    }
    apply1(sought(0, duty1));
    apply2(sought(1, duty2));
}

static void poll(void) {
    if (measuring.phase != MEASURE_STORE) {
        return;
    }
    for (uint8_t i = 0; i < 2; i++) {
        friction[i] = measuring.found[i] / 2;
    }
    release();
    port_store_friction(friction);
    /* Back to where it began, under the loop: a pose that was set by hand stays. */
    int32_t here[2];
    position(here);
    int32_t back1 = measuring.from[0] - here[0], back2 = measuring.from[1] - here[1];
    measuring.phase = MEASURE_NOT;
    set_position(here[0], here[1]);
    queue_push((int16_t)back1, (int16_t)back2, RETURN_US, 0);
}

static void get_friction(int16_t duty[2]) {
    duty[0] = friction[0];
    duty[1] = friction[1];
}

const struct drive dc_drive = {
    .name = "dc",
    .init = init,
    .set_position = set_position,
    .position = position,
    .is_moving = is_moving,
    .poll = poll,
    .tick = tick,
    .halt = halt,
    .measure = measure,
    .friction = get_friction,
    .seek_stop = seek_stop,
    .is_stalled = is_stalled,
    .measures_position = true,
};

#endif
