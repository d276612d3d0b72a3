/* Arduino Mega 2560: ATmega2560 at 16 MHz. */
#ifndef PLOTPLAN_PORT_MEGA_H
#define PLOTPLAN_PORT_MEGA_H

#define PIN_STEP1 E, 4   /* D2 */
#define PIN_STEP2 E, 5   /* D3 */
#define PIN_DIR1 E, 3    /* D5 */
#define PIN_DIR2 H, 3    /* D6 */
#define PIN_ENABLE H, 5  /* D8 */
#define PIN_Z_STEP G, 5  /* D4 */
#define PIN_Z_DIR H, 4   /* D7 */
#define PIN_STEP_LIMIT1 B, 1 /* D52 */
#define PIN_STEP_LIMIT2 B, 2 /* D51 */

#define PIN_PWM1 B, 5    /* D11, OC1A */
#define PIN_PWM2 B, 6    /* D12, OC1B */
#define PIN_IN1A G, 5    /* D4 */
#define PIN_IN1B E, 3    /* D5 */
#define PIN_IN2A H, 4    /* D7 */
#define PIN_IN2B H, 3    /* D6 */
#define PIN_DC_LIMIT1 B, 1 /* D52 */
#define PIN_DC_LIMIT2 B, 2 /* D51 */

#define ENCODER_INPUT PINK /* A8, A9, A10, A11 */
#define ENCODER_PULLUPS PORTK
#define ENCODER_MASK PCMSK2
#define ENCODER_ENABLE PCIE2
#define ENCODER_VECTOR PCINT2_vect

#define PIN_STOP B, 3     /* D50 */
#define PIN_SERVO B, 4    /* D10, OC2A */
#define PIN_SOLENOID B, 7 /* D13 */

#define UART_RECEIVE_VECTOR USART0_RX_vect

#endif
