#include "setpoint.h"

#include "segment_queue.h"

void setpoint_set(struct setpoint *setpoint, int32_t ticks1, int32_t ticks2) {
    const int32_t ticks[2] = {ticks1, ticks2};
    for (uint8_t i = 0; i < 2; i++) {
        setpoint->motor[i].base = ticks[i];
        setpoint->motor[i].ticks = 0;
        setpoint->motor[i].covered = 0;
    }
    setpoint->running = false;
}

/* Loads the next segment, of which `elapsed_us` have passed already. */
static bool load(struct setpoint *setpoint, uint32_t elapsed_us) {
    struct segment segment;
    if (!queue_pop(&segment)) {
        return false;
    }
    uint32_t duration = segment_us(&segment);
    setpoint->duration_us = duration;
    setpoint->elapsed_us = elapsed_us;
    setpoint->pen = segment.pen;
    for (uint8_t i = 0; i < 2; i++) {
        int16_t ticks = segment.ticks[i];
        setpoint->motor[i].ticks = ticks;
        setpoint->motor[i].covered = setpoint->motor[i].error = 0;
        setpoint->motor[i].rate = setpoint->motor[i].remainder = 0;
        if (ticks == 0) {
            continue;
        }
        /* At most 2^15 * 2^6 * 1000 < 2^31. */
        uint32_t distance = (uint32_t)(ticks < 0 ? -ticks : ticks) << SETPOINT_SHIFT;
        uint32_t product = distance * SETPOINT_PERIOD_US;
        setpoint->motor[i].rate = product / duration;
        setpoint->motor[i].remainder = product % duration;
        if (elapsed_us > 0 && elapsed_us < SETPOINT_PERIOD_US) {
            product = distance * elapsed_us;
            setpoint->motor[i].covered = product / duration;
            setpoint->motor[i].error = product % duration;
        }
    }
    return true;
}

static void finish_segment(struct setpoint *setpoint) {
    for (uint8_t i = 0; i < 2; i++) {
        setpoint->motor[i].base += setpoint->motor[i].ticks;
        setpoint->motor[i].ticks = 0;
        setpoint->motor[i].covered = 0;
    }
}

bool setpoint_start(struct setpoint *setpoint) {
    setpoint->running = load(setpoint, 0);
    return setpoint->running;
}

bool setpoint_advance(struct setpoint *setpoint) {
    setpoint->elapsed_us += SETPOINT_PERIOD_US;
    if (setpoint->elapsed_us < setpoint->duration_us) {
        for (uint8_t i = 0; i < 2; i++) {
            setpoint->motor[i].covered += setpoint->motor[i].rate;
            setpoint->motor[i].error += setpoint->motor[i].remainder;
            if (setpoint->motor[i].error >= setpoint->duration_us) {
                setpoint->motor[i].error -= setpoint->duration_us;
                setpoint->motor[i].covered++;
            }
        }
        return true;
    }
    /* The end of a segment, or of several that are shorter than the period. */
    uint32_t elapsed = setpoint->elapsed_us;
    do {
        elapsed -= setpoint->duration_us;
        finish_segment(setpoint);
        if (!load(setpoint, elapsed)) {
            setpoint->running = false;
            return false;
        }
    } while (elapsed >= setpoint->duration_us);
    return true;
}
