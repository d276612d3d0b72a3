/* Serial port, clock, switches, pen servo, watchdog and EEPROM of the AVR ports. */
#if defined(__AVR__)

#include "port_avr.h"

#include <avr/eeprom.h>
#include <avr/wdt.h>
#include <stddef.h>

#include "machine.h"
#include "port_receive.h"

#ifndef F_CPU
#define F_CPU 16000000UL
#endif
#ifndef PLOTPLAN_BAUD
#define PLOTPLAN_BAUD 115200UL
#endif

/* Timer 2 counts in 4 us. One compare unit gives the millisecond, the other the servo's edges. */
#define TICK_COUNTS 250
#define SERVO_PERIOD_MS 20
/* The servo's pulse starts this long after a tick: later than the tick's interrupt can be. */
#define SERVO_START_US 200
#define SERVO_LATER_START_US 600

static bool dc_limits;
static volatile uint16_t pulse_us;
static uint8_t reset_flags __attribute__((section(".noinit")));

/* The watchdog stays on after it has reset the chip: off before main. */
void port_keep_reset_cause(void) __attribute__((naked, used, section(".init3")));
void port_keep_reset_cause(void) {
    reset_flags = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

void port_init(void) {
    UCSR0A = _BV(U2X0);
    UBRR0 = (F_CPU + PLOTPLAN_BAUD * 4) / (PLOTPLAN_BAUD * 8) - 1;
    UCSR0B = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    PIN_INPUT_PULLUP(PIN_STOP);
    PIN_OUTPUT(PIN_SERVO);
    PIN_OUTPUT(PIN_SOLENOID);
    /* Edges instead of the low level: nothing enables these interrupts, but an emulator looks. */
    EICRA = _BV(ISC11) | _BV(ISC10) | _BV(ISC01) | _BV(ISC00);
    TCCR2A = 0;
    TCCR2B = _BV(CS22);
    OCR2B = TICK_COUNTS;
    TIMSK2 = _BV(OCIE2B);
    wdt_enable(WDTO_250MS);
}

uint8_t port_lock(void) {
    uint8_t state = SREG;
    cli();
    return state;
}

void port_unlock(uint8_t state) {
    __asm__ volatile("" ::: "memory");
    SREG = state;
}

ISR(UART_RECEIVE_VECTOR) {
    port_received(UDR0);
}

bool port_send(uint8_t byte) {
    if (!(UCSR0A & _BV(UDRE0))) {
        return false;
    }
    UDR0 = byte;
    return true;
}

void port_use_dc_limits(void) {
    dc_limits = true;
    PIN_INPUT_PULLUP(PIN_DC_LIMIT1);
    PIN_INPUT_PULLUP(PIN_DC_LIMIT2);
}

uint8_t port_switches(void) {
    uint8_t closed = PIN_IS_LOW(PIN_STOP) ? SWITCH_STOP : 0;
    if (dc_limits) {
        closed |= PIN_IS_LOW(PIN_DC_LIMIT1) ? SWITCH_1 : 0;
        closed |= PIN_IS_LOW(PIN_DC_LIMIT2) ? SWITCH_2 : 0;
    } else {
        closed |= PIN_IS_LOW(PIN_STEP_LIMIT1) ? SWITCH_1 : 0;
        closed |= PIN_IS_LOW(PIN_STEP_LIMIT2) ? SWITCH_2 : 0;
    }
    return closed;
}

void port_servo(uint16_t us) {
    uint8_t state = port_lock();
    pulse_us = us;
    port_unlock(state);
}

void port_solenoid(bool on) {
    uint8_t state = port_lock();
    if (on) {
        PIN_HIGH(PIN_SOLENOID);
    } else {
        PIN_LOW(PIN_SOLENOID);
    }
    port_unlock(state);
}

void port_z_step(bool down) {
    uint8_t state = port_lock();
    if (down) {
        PIN_HIGH(PIN_Z_DIR);
    } else {
        PIN_LOW(PIN_Z_DIR);
    }
    PIN_HIGH(PIN_Z_STEP);
    /* 2 us */
    __builtin_avr_delay_cycles(32);
    PIN_LOW(PIN_Z_STEP);
    port_unlock(state);
}

/* The hardware makes the edges; the interrupt only says when and which, well before. So pulses do
 * not shake, whatever the interrupts of steps do. `base` is the count of this tick. */
static inline void servo_edges(uint8_t base) {
    static uint8_t phase, fall_phase, fall_counts;
    static bool pulsing;
    if (++phase == SERVO_PERIOD_MS) {
        phase = 0;
        uint8_t state = port_lock();
        uint16_t us = pulse_us;
        port_unlock(state);
        pulsing = us != 0;
        if (!pulsing) {
            TCCR2A = 0;
            return;
        }
        uint16_t start = SERVO_START_US, fall = start + us;
        if (fall % 1000 < SERVO_START_US) {
            start = SERVO_LATER_START_US;
            fall = start + us;
        }
        fall_phase = fall / 1000;
        fall_counts = fall % 1000 / 4;
        OCR2A = base + start / 4;
        TCCR2A = _BV(COM2A1) | _BV(COM2A0); /* high at the match */
    }
    if (pulsing && phase == fall_phase) {
        OCR2A = base + fall_counts;
        TCCR2A = _BV(COM2A1); /* low at the match */
    }
}

ISR(TIMER2_COMPB_vect, ISR_NOBLOCK) {
    static volatile bool inside;
    uint8_t base = OCR2B;
    OCR2B = base + TICK_COUNTS;
    if (inside) {
        return; /* a tick took longer than a millisecond */
    }
    inside = true;
    servo_edges(base);
    machine_tick();
    inside = false;
}

void port_feed_watchdog(void) {
    wdt_reset();
}

flash_text port_reset_cause(void) {
    return reset_flags & _BV(WDRF)    ? TEXT("watchdog")
           : reset_flags & _BV(BORF)  ? TEXT("brownout")
           : reset_flags & _BV(EXTRF) ? TEXT("reset")
                                      : TEXT("power");
}

/* EEPROM: both values and a check that erased and zero bytes fail. */
#define FRICTION_AT ((uint16_t *)16)
#define FRICTION_CHECK 0x5aa5

bool port_load_friction(int16_t friction[2]) {
    uint16_t first = eeprom_read_word(FRICTION_AT), second = eeprom_read_word(FRICTION_AT + 1);
    if (eeprom_read_word(FRICTION_AT + 2) != (uint16_t)(first + second + FRICTION_CHECK)) {
        return false;
    }
    friction[0] = (int16_t)first;
    friction[1] = (int16_t)second;
    return true;
}

void port_store_friction(const int16_t friction[2]) {
    eeprom_update_word(FRICTION_AT, (uint16_t)friction[0]);
    eeprom_update_word(FRICTION_AT + 1, (uint16_t)friction[1]);
    eeprom_update_word(FRICTION_AT + 2, (uint16_t)friction[0] + (uint16_t)friction[1] + FRICTION_CHECK);
}

#endif
