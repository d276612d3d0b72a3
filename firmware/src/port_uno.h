/* Arduino Uno and Nano: ATmega328P at 16 MHz. Step pins as on the CNC shield. */
#ifndef PLOTPLAN_PORT_UNO_H
#define PLOTPLAN_PORT_UNO_H

/* Steppers: STEP, DIR, ENABLE (low). */
#define PIN_STEP1 D, 2   /* D2 */
#define PIN_STEP2 D, 3   /* D3 */
#define PIN_DIR1 D, 5    /* D5 */
#define PIN_DIR2 D, 6    /* D6 */
#define PIN_ENABLE B, 0  /* D8 */
#define PIN_Z_STEP D, 4  /* D4 */
#define PIN_Z_DIR D, 7   /* D7 */
#define PIN_STEP_LIMIT1 B, 1 /* D9 */
#define PIN_STEP_LIMIT2 B, 2 /* D10 */

/* DC motors: PWM on the outputs of timer 1, two direction pins each. RC servos on the PWM pins. */
#define PIN_PWM1 B, 1    /* D9, OC1A */
#define PIN_PWM2 B, 2    /* D10, OC1B */
#define PIN_IN1A D, 4    /* D4: high forwards */
#define PIN_IN1B D, 5    /* D5: the opposite */
#define PIN_IN2A D, 7    /* D7 */
#define PIN_IN2B D, 6    /* D6 */
#define PIN_DC_LIMIT1 D, 2 /* D2 */
#define PIN_DC_LIMIT2 D, 3 /* D3 */

/* Encoders: A, B of motor 1, A, B of motor 2 on bits 0 to 3 of one port with one interrupt. */
#define ENCODER_INPUT PINC /* A0, A1, A2, A3 */
#define ENCODER_PULLUPS PORTC
#define ENCODER_MASK PCMSK1
#define ENCODER_ENABLE PCIE1
#define ENCODER_VECTOR PCINT1_vect

#define PIN_STOP B, 4     /* D12 */
#define PIN_SERVO B, 3    /* D11, OC2A */
#define PIN_SOLENOID B, 5 /* D13 */

#define UART_RECEIVE_VECTOR USART_RX_vect

#endif
