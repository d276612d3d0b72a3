/* Layer 3 of 3: drives. A drive takes segments from the queue and moves two motors.
 *
 * `step_drive`  step and direction pins, one compare event for each step
 * `dc_drive`    DC motors with quadrature encoders, PID with feed-forward at 1 kHz
 * `servo_drive` RC servos as motors
 *
 * A machine header names one of them; the linker leaves the others out. */
#ifndef PLOTPLAN_DRIVE_H
#define PLOTPLAN_DRIVE_H

#include <stdbool.h>
#include <stdint.h>

struct drive {
    const char *name;
    /* Pins and timers. Interrupts are off. */
    void (*init)(void);
    /* The motors are at these ticks, at rest; the drive may hold them there. */
    void (*set_position)(int32_t ticks1, int32_t ticks2);
    /* Where the motors are: steps made, or encoder counts. */
    void (*position)(int32_t ticks[2]);
    /* Whether motion is executed or queued. */
    bool (*is_moving)(void);
    /* Called by the main loop as often as possible. */
    void (*poll)(void);
    /* Called every millisecond from an interrupt, which other interrupts may interrupt. */
    void (*tick)(void);
    /* Stops both motors at once. From any context. */
    void (*halt)(void);
    /* Measures friction and keeps it in EEPROM; NULL if there is nothing to measure. */
    void (*measure)(void);
    /* The friction of both motors that is fed forward, duty in 1/800; NULL if none is. */
    void (*friction)(int16_t duty[2]);
    /* From now on the motors of this mask turn with at most this duty and may fall behind, as on the way to a
     * mechanical stop; 0 ends it. NULL if the drive does not feel a stop. */
    void (*seek_stop)(uint8_t motors, int16_t duty);
    /* Whether one of them stands still at that duty. */
    bool (*is_stalled)(void);
    /* Whether `position` is still right after `halt` in motion (encoders: yes, steps: no). */
    bool measures_position;
};

extern const struct drive step_drive, dc_drive, servo_drive;

#endif
