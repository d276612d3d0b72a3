/* Layer 2 of 3: the queue of segments between the lines of a plan and the drives.
 *
 * One producer (the main loop) and one consumer (the main loop or one interrupt), so that a byte for
 * each end is enough and no interrupt has to be blocked. */
#ifndef PLOTPLAN_SEGMENT_QUEUE_H
#define PLOTPLAN_SEGMENT_QUEUE_H

#include <stdbool.h>
#include <stdint.h>

/* Segments that fit, minus one. 64 rows of 10 ms are 0.63 s of motion, 512 bytes. */
#ifndef PLOTPLAN_QUEUE
#define PLOTPLAN_QUEUE 64
#endif

/* Longest segment, us: 24 bits. */
#define SEGMENT_LONGEST_US 0xffffffUL

/* A linear motion of both motors; both arrive after `us`. */
struct segment {
    int16_t ticks[2]; /* signed distance */
    uint16_t us_low;
    uint8_t us_high;
    uint8_t pen; /* number of the pen that is down, 0 for none; set when the segment starts */
};

static inline uint32_t segment_us(const struct segment *segment) {
    return segment->us_low | (uint32_t)segment->us_high << 16;
}

bool queue_is_full(void);
bool queue_is_empty(void);

/* Appends a segment. The caller has checked that the queue is not full. */
void queue_push(int16_t ticks1, int16_t ticks2, uint32_t us, uint8_t pen);

/* Removes the oldest segment; false if there is none. */
bool queue_pop(struct segment *segment);

/* Drops everything. The consumer must not run meanwhile. */
void queue_clear(void);

#endif
