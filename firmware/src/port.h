/* What the firmware needs from a chip. A port is one header with pins and timers (port_uno.h,
 * port_mega.h), here chosen by the compiler's -mmcu; port_avr.c is common to them. */
#ifndef PLOTPLAN_PORT_H
#define PLOTPLAN_PORT_H

#include <stdbool.h>
#include <stdint.h>

/* Constants stay in flash: `TEXT("...")` is a string that takes no RAM. */
#ifdef __AVR__
#define IN_FLASH __flash
#else
#define IN_FLASH
#endif
#define TEXT(string) (__extension__({ static const IN_FLASH char text_in_flash[] = string; text_in_flash; }))
typedef const IN_FLASH char *flash_text;

/* Receive buffer, bytes, a power of 2; one byte stays free. */
#ifndef PLOTPLAN_RECEIVE
#define PLOTPLAN_RECEIVE 128
#endif

/* Switches, as bits of `port_switches`. */
#define SWITCH_1 1
#define SWITCH_2 2
#define SWITCH_STOP 4

void port_init(void);
/* A received byte without removing it; -1 if there is none. */
int16_t port_peek(void);
void port_drop(void);
/* Sends a byte if the transmitter is free. */
bool port_send(uint8_t byte);
/* Closed switches. */
uint8_t port_switches(void);
/* Times the pulse of the pen servo; 0 for no pulses. */
void port_servo(uint16_t pulse_us);
void port_solenoid(bool on);
/* One step of the Z axis. */
void port_z_step(bool down);
/* The watchdog resets the chip unless this is called every 250 ms. */
void port_feed_watchdog(void);
/* Why the chip started: "power", "reset", "watchdog", "brownout". */
flash_text port_reset_cause(void);
/* Friction of both motors in EEPROM, duty; false if it was never stored or is damaged. */
bool port_load_friction(int16_t friction[2]);
void port_store_friction(const int16_t friction[2]);

/* Saves the interrupt flag and disables interrupts; restores it. */
uint8_t port_lock(void);
void port_unlock(uint8_t state);

#endif
