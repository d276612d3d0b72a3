/* Times of steps. A segment of n ticks in D makes step i at (i - 1/2) D / n, so that segments of the
 * same speed join without a gap. Times are in half microseconds, the counts of a 16-bit timer.
 *
 * Segments are cut into pieces of about 16 ms outside of interrupts; the interrupt only adds. Cuts
 * do not move a step: the remainder of the division is carried from piece to piece. */
#ifndef PLOTPLAN_STEP_CLOCK_H
#define PLOTPLAN_STEP_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#include "segment_queue.h"

/* With the shifts of a cut below half of the 16-bit counter's range, so that a signed difference says what is
 * earlier. */
#define PIECE_LONGEST 32000U
/* A cut is at least this far from the steps on either side: to load a piece after a step takes 22 us. Two motors at
 * 20,000 steps/s leave a gap of 25 us (50 counts) once in 50 us, so that a cut moves twice at most. */
#define CUT_CLEARANCE 24U
#define CUT_SHIFTS 3
/* Steps of the two motors that are at most this far apart are made together, which needs no second event: the later one
 * is 4 us early instead of 10 us late. */
#define STEPS_TOGETHER 8U

/* One motor's steps in a piece: the first at `first`, then every interval + remainder / total. */
struct piece_steps {
    uint16_t steps, first, interval, remainder, total, error;
};

struct piece {
    uint16_t duration;
    uint8_t backwards; /* bit i: motor i */
    uint8_t pen;
    struct piece_steps motor[2];
};

/* A segment while it is cut. */
struct cutter {
    uint32_t left; /* duration that is not cut yet */
    uint8_t backwards, pen;
    struct {
        uint32_t next, interval; /* from the end of the last piece to the next step; between steps */
        uint16_t steps, remainder, total, error;
    } motor[2];
};

void cutter_start(struct cutter *cutter, const struct segment *segment);
/* Whether the segment is cut completely. */
static inline bool cutter_is_done(const struct cutter *cutter) {
    return cutter->left == 0;
}
void cutter_cut(struct cutter *cutter, struct piece *piece);

/* The interrupt's copy of a motor's steps; `at` is the absolute time of the next one. */
struct step_clock {
    uint16_t left, at, interval, remainder, total, error;
};

static inline void step_clock_load(struct step_clock *clock, const struct piece_steps *steps, uint16_t now) {
    clock->left = steps->steps;
    clock->at = now + steps->first;
    clock->interval = steps->interval;
    clock->remainder = steps->remainder;
    clock->total = steps->total;
    clock->error = steps->error;
}

static inline bool step_clock_is_due(const struct step_clock *clock, uint16_t now) {
    return clock->left && (uint16_t)(clock->at - now) <= STEPS_TOGETHER;
}

static inline void step_clock_advance(struct step_clock *clock) {
    clock->left--;
    clock->at += clock->interval;
    clock->error += clock->remainder;
    if (clock->error >= clock->total) {
        clock->error -= clock->total;
        clock->at++;
    }
}

/* The shorter of `wait` and the time to the next step. */
static inline uint16_t step_clock_wait(const struct step_clock *clock, uint16_t now, uint16_t wait) {
    uint16_t own = clock->at - now;
    return clock->left && own < wait ? own : wait;
}

#endif
