#include "step_clock.h"

void cutter_start(struct cutter *cutter, const struct segment *segment) {
    uint32_t duration = segment_us(segment) * 2;
    cutter->left = duration;
    cutter->pen = segment->pen;
    cutter->backwards = 0;
    for (uint8_t i = 0; i < 2; i++) {
        int16_t ticks = segment->ticks[i];
        uint16_t n = (uint16_t)(ticks < 0 ? -ticks : ticks);
        cutter->backwards |= ticks < 0 ? 1 << i : 0;
        cutter->motor[i].steps = cutter->motor[i].total = n;
        if (n == 0) {
            continue;
        }
        uint32_t interval = duration / n;
        uint16_t remainder = (uint16_t)(duration - interval * n);
        cutter->motor[i].interval = interval;
        cutter->motor[i].remainder = remainder;
        /* D / (2n) = interval/2, rounded down, and error/n. */
        cutter->motor[i].next = interval / 2;
        cutter->motor[i].error = (uint16_t)(((interval & 1 ? (uint32_t)n : 0) + remainder) / 2);
    }
}

/* Advances from the last piece's end to this one's and counts the steps in between. */
static void cut_motor(struct cutter *cutter, uint8_t i, struct piece_steps *steps, uint16_t duration) {
    uint32_t next = cutter->motor[i].next, interval = cutter->motor[i].interval;
    uint16_t total = cutter->motor[i].total, left = cutter->motor[i].steps;
    uint16_t error = cutter->motor[i].error, remainder = cutter->motor[i].remainder, made = 0;
    steps->steps = 0;
    if (left == 0) {
        return;
    }
    if (next < duration) {
        steps->first = (uint16_t)next;
        steps->interval = interval > UINT16_MAX ? UINT16_MAX : (uint16_t)interval;
        steps->remainder = remainder;
        steps->total = total;
        steps->error = error;
        if (cutter->left == duration) {
            made = left; /* the segment's last piece has all that is left */
        } else {
            do {
                made++;
                next += interval;
                error += remainder;
                if (error >= total) {
                    error -= total;
                    next++;
                }
            } while (made < left && next < duration);
        }
    }
    steps->steps = made;
    cutter->motor[i].steps = left - made;
    cutter->motor[i].next = next - duration;
    cutter->motor[i].error = error;
}

void cutter_cut(struct cutter *cutter, struct piece *piece) {
    uint32_t left = cutter->left;
    /* Two halves instead of a long and a very short one. */
    uint16_t duration = left > 2UL * PIECE_LONGEST ? PIECE_LONGEST
                        : left > PIECE_LONGEST     ? (uint16_t)(left / 2)
                                                   : (uint16_t)left;
    piece->duration = duration;
    piece->backwards = cutter->backwards;
    piece->pen = cutter->pen;
    for (uint8_t i = 0; i < 2; i++) {
        cut_motor(cutter, i, &piece->motor[i], duration);
    }
    cutter->left = left - duration;
}
