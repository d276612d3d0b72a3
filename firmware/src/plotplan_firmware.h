/* The firmware's interface to a program or Arduino sketch: a machine, `plotplan_setup` and
 * `plotplan_loop`. `plotplan machine show NAME --firmware-config` writes a header with the machine. */
#ifndef PLOTPLAN_FIRMWARE_H
#define PLOTPLAN_FIRMWARE_H

#ifdef __cplusplus
extern "C" {
#endif

#include "drive.h"

/* Layout of `struct plotplan_machine`; a header written for another layout does not compile. */
#define PLOTPLAN_CONFIG_VERSION 2
/* Version of tick lines that the firmware executes. */
#define PLOTPLAN_TICK_LINES_VERSION 1

/* Loop of a DC motor. Duty is in 1/800, errors and differences in 1/64 count. */
struct plotplan_loop {
    int16_t kp;             /* 1/256 duty per count */
    int16_t ki;             /* duty per count and ms, 2^-14 */
    int16_t kv;             /* feed-forward of speed: duty per count/ms, times 2^16 / (20 * 64) */
    int16_t ka;             /* of acceleration: duty per count/ms^2, times 2^10 / (100 * 64) */
    int16_t friction;       /* duty; EEPROM has priority once it was measured */
    uint16_t follow_counts; /* the motors stop if the error exceeds this for 20 ms */
};

/* An RC servo as motor: pulse = zero_us + ticks * us_per_256_ticks / 256. */
struct plotplan_servo {
    int16_t zero_us, us_per_256_ticks;
};

struct plotplan_motor {
    uint16_t shortest_tick_us; /* 1e6 / largest speed; a faster line is refused */
    bool reversed;             /* direction pin, or motor leads */
    bool encoder_reversed;
    int32_t lowest, highest; /* ticks that a line may ask for */
    struct plotplan_loop loop;
    struct plotplan_servo servo;
};

enum plotplan_pen_kind { PEN_NONE, PEN_SERVO, PEN_SOLENOID, PEN_Z };

struct plotplan_pen {
    enum plotplan_pen_kind kind;
    /* PEN_SERVO: pulse widths, us. PEN_Z: steps, at 1000 steps/s. */
    int16_t up, down;
};

/* In place of a switch: a mechanical stop. A DC motor finds it when its encoder stands still at `stop_duty`; a
 * stepper makes `longest` units towards it and loses those that the stop holds back. */
#define PLOTPLAN_STOP 255

/* One homing move: both motors move in this ratio until the switch closes or the stop is reached, back off,
 * approach again slowly and back off. */
struct plotplan_homing {
    bool used;
    uint8_t limit_switch;             /* 0, 1, or PLOTPLAN_STOP */
    int8_t ticks[2];                  /* direction: ticks of each motor per unit of the move */
    uint16_t fast_us, slow_us;        /* time of one unit */
    uint16_t back_off;                /* units */
    uint16_t longest;                 /* units after which the search fails */
    int16_t stop_duty;                /* largest duty of a DC motor on its way to a stop, 1/800 */
};

struct plotplan_machine {
    const char *name;
    const struct drive *drive;
    struct plotplan_motor motor[2];
    struct plotplan_pen pen;
    struct plotplan_homing homing[2]; /* in this order */
    int32_t home[2];                  /* ticks after homing */
    bool must_home;                   /* refuse plans until homed */
    bool limits_used, stop_used;      /* the pins are wired: switches to ground */
};

/* The machine must not go away. */
void plotplan_setup(const struct plotplan_machine *machine);
void plotplan_loop(void);

#ifdef __cplusplus
}
#endif

#endif
