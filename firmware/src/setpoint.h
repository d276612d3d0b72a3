/* Setpoints every millisecond out of the queue, for drives that follow positions. Exact: a segment's
 * remainder of the division is carried, so nothing drifts whatever the segments' durations are. */
#ifndef PLOTPLAN_SETPOINT_H
#define PLOTPLAN_SETPOINT_H

#include <stdbool.h>
#include <stdint.h>

/* A setpoint is in 1/64 tick. */
#define SETPOINT_SHIFT 6
#define SETPOINT_PERIOD_US 1000

struct setpoint {
    struct {
        int32_t base;  /* ticks at the start of the segment */
        int16_t ticks; /* its distance */
        /* Magnitudes in 1/64 tick: distance covered, distance a period, and their remainders. */
        uint32_t covered, rate, remainder, error;
    } motor[2];
    uint32_t elapsed_us, duration_us;
    bool running;
    uint8_t pen;
};

/* At rest at these ticks. */
void setpoint_set(struct setpoint *setpoint, int32_t ticks1, int32_t ticks2);
/* Starts with the first segment of the queue; false if there is none. */
bool setpoint_start(struct setpoint *setpoint);
/* Advances by one period. Returns false when the queue runs out: the motors rest at the last target. */
bool setpoint_advance(struct setpoint *setpoint);
/* The setpoint of a motor, 1/64 tick. */
static inline int32_t setpoint_of(const struct setpoint *setpoint, uint8_t motor) {
    int32_t base = (int32_t)((uint32_t)setpoint->motor[motor].base << SETPOINT_SHIFT);
    int32_t covered = (int32_t)setpoint->motor[motor].covered;
    return setpoint->motor[motor].ticks < 0 ? base - covered : base + covered;
}

#endif
