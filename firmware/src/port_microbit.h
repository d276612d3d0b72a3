/* BBC micro:bit (version 1): nRF51822, Cortex-M0 at 16 MHz. Steppers only. Pins are those of the edge
 * connector; register names follow the nRF51 Series Reference Manual 3.0. */
#ifndef PLOTPLAN_PORT_MICROBIT_H
#define PLOTPLAN_PORT_MICROBIT_H

#include "port.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))

/* A pin is the number of the chip's port 0. */
#define PIN_STEP1 3       /* P0 */
#define PIN_DIR1 2        /* P1 */
#define PIN_SERVO 1       /* P2 */
#define PIN_STEP2 23      /* P13 */
#define PIN_DIR2 22       /* P14 */
#define PIN_ENABLE 21     /* P15, low */
#define PIN_STEP_LIMIT1 18 /* P8 */
#define PIN_STEP_LIMIT2 16 /* P16 */
#define PIN_STOP 20       /* P12 */
#define PIN_Z_STEP 0      /* not on a numbered contact: no Z axis */
#define PIN_Z_DIR 0

#define GPIO 0x50000000u
#define PIN_HIGH(pin) (REGISTER(GPIO + 0x508) = 1u << (pin))
#define PIN_LOW(pin) (REGISTER(GPIO + 0x50c) = 1u << (pin))
#define PIN_OUTPUT(pin) (REGISTER(GPIO + 0x518) = 1u << (pin))
/* Input, connected, pull-up. */
#define PIN_INPUT_PULLUP(pin) (REGISTER(GPIO + 0x700 + 4 * (pin)) = 3u << 2)
#define PIN_IS_LOW(pin) (!(REGISTER(GPIO + 0x510) & 1u << (pin)))

/* Steps: timer 0 with 16 bits in half us, compare register 0; register 1 captures the count. */
#define STEP_TIMER 0x40008000u
static inline uint16_t step_count(void) {
    REGISTER(STEP_TIMER + 0x044) = 1;
    return (uint16_t)REGISTER(STEP_TIMER + 0x544);
}
#define STEP_COUNT() step_count()
#define STEP_MATCH(time) (REGISTER(STEP_TIMER + 0x540) = (time))
#define STEP_CLEAR() (REGISTER(STEP_TIMER + 0x140) = 0)
#define STEP_ENABLE() (REGISTER(STEP_TIMER + 0x304) = 1u << 16)
#define STEP_DISABLE() (REGISTER(STEP_TIMER + 0x308) = 1u << 16)
void port_start_step_timer(void);
#define STEP_START() port_start_step_timer()
#define STEP_INTERRUPT void timer0_interrupt(void)
/* The event stays until it is cleared. */
#define STEP_ACKNOWLEDGE() STEP_CLEAR()

#endif
