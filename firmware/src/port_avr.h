/* Pins and timers common to the AVR ports, for the drives. */
#ifndef PLOTPLAN_PORT_AVR_H
#define PLOTPLAN_PORT_AVR_H

#include <avr/interrupt.h>
#include <avr/io.h>

#include "port.h"

#if defined(__AVR_ATmega328P__)
#include "port_uno.h"
#elif defined(__AVR_ATmega2560__)
#include "port_mega.h"
#else
#error "no port for this chip: add a port_*.h and include it here"
#endif

/* A pin is `letter, bit`. */
#define PIN_PASTE(a, b) a##b
#define PIN_PORT_OF(letter, bit) PIN_PASTE(PORT, letter)
#define PIN_DDR_OF(letter, bit) PIN_PASTE(DDR, letter)
#define PIN_PIN_OF(letter, bit) PIN_PASTE(PIN, letter)
#define PIN_MASK_OF(letter, bit) (1 << (bit))
#define PIN_APPLY(macro, ...) macro(__VA_ARGS__)
#define PIN_HIGH(...) (PIN_APPLY(PIN_PORT_OF, __VA_ARGS__) |= PIN_APPLY(PIN_MASK_OF, __VA_ARGS__))
#define PIN_LOW(...) (PIN_APPLY(PIN_PORT_OF, __VA_ARGS__) &= (uint8_t)~PIN_APPLY(PIN_MASK_OF, __VA_ARGS__))
#define PIN_OUTPUT(...) (PIN_APPLY(PIN_DDR_OF, __VA_ARGS__) |= PIN_APPLY(PIN_MASK_OF, __VA_ARGS__))
#define PIN_INPUT_PULLUP(...) \
    (PIN_APPLY(PIN_DDR_OF, __VA_ARGS__) &= (uint8_t)~PIN_APPLY(PIN_MASK_OF, __VA_ARGS__), PIN_HIGH(__VA_ARGS__))
#define PIN_IS_LOW(...) (!(PIN_APPLY(PIN_PIN_OF, __VA_ARGS__) & PIN_APPLY(PIN_MASK_OF, __VA_ARGS__)))

/* Steps: timer 1 in half us, compare unit A. */
#define STEP_COUNT() TCNT1
#define STEP_MATCH(time) (OCR1A = (time))
#define STEP_CLEAR() (TIFR1 = _BV(OCF1A))
#define STEP_ENABLE() (TIMSK1 = _BV(OCIE1A))
#define STEP_DISABLE() (TIMSK1 = 0)
#define STEP_START() (TCCR1A = 0, TCCR1B = _BV(CS11))
#define STEP_INTERRUPT ISR(TIMER1_COMPA_vect)
/* The chip has cleared the flag when the interrupt begins. */
#define STEP_ACKNOWLEDGE() ((void)0)

/* Which pins are the limit switches: the drives of DC motors and servos need those of the steppers. */
void port_use_dc_limits(void);

#endif
