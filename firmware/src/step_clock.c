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

/* A motor's steps in a piece whose end is not decided yet. */
struct course {
    uint32_t next, last; /* the first step that is not made, the last one that is; 0 if none is */
    uint16_t made, error;
};

/* Makes the steps before `end`. */
static void advance(const struct cutter *cutter, uint8_t i, struct course *course, uint32_t end) {
    uint32_t next = course->next, last = course->last, interval = cutter->motor[i].interval;
    uint16_t steps = cutter->motor[i].steps, total = cutter->motor[i].total, remainder = cutter->motor[i].remainder;
    uint16_t made = course->made, error = course->error;
    while (made < steps && next < end) {
        made++;
        last = next;
        next += interval;
        error += remainder;
        if (error >= total) {
            error -= total;
            next++;
        }
    }
    *course = (struct course){.next = next, .last = last, .made = made, .error = error};
}

/* Where to cut a row at about `end`: clear of the steps of both motors, so that the next piece is loaded in time for the
 * step after the cut. */
static uint16_t cut_clear(const struct cutter *cutter, struct course courses[2], uint32_t end) {
    for (uint8_t shift = 0; shift < CUT_SHIFTS; shift++) {
        uint32_t clear = end;
        for (uint8_t i = 0; i < 2; i++) {
            struct course *course = &courses[i];
            advance(cutter, i, course, end);
            uint32_t step = course->made < cutter->motor[i].steps && course->next < end + CUT_CLEARANCE ? course->next
                            : course->made                                                             ? course->last
                                                                                                       : 0;
            if (step && step + CUT_CLEARANCE > clear) {
                clear = step + CUT_CLEARANCE;
            }
        }
        if (clear == end) {
            break;
        }
        end = clear;
    }
    return (uint16_t)end;
}

void cutter_cut(struct cutter *cutter, struct piece *piece) {
    uint32_t left = cutter->left, duration = left;
    struct course courses[2];
    for (uint8_t i = 0; i < 2; i++) {
        courses[i] = (struct course){.next = cutter->motor[i].next, .error = cutter->motor[i].error};
    }
    if (left > PIECE_LONGEST) {
        /* Two halves instead of a long and a very short one. */
        duration = cut_clear(cutter, courses, left > 2UL * PIECE_LONGEST ? PIECE_LONGEST : left / 2);
    }
    piece->duration = (uint16_t)duration;
    piece->backwards = cutter->backwards;
    piece->pen = cutter->pen;
    for (uint8_t i = 0; i < 2; i++) {
        struct course *course = &courses[i];
        struct piece_steps *steps = &piece->motor[i];
        uint32_t interval = cutter->motor[i].interval;
        if (duration == left) {
            course->made = cutter->motor[i].steps; /* the segment's last piece has all that is left */
        } else {
            advance(cutter, i, course, duration);
        }
        steps->steps = course->made;
        if (course->made) {
            steps->first = (uint16_t)cutter->motor[i].next;
            steps->interval = interval > UINT16_MAX ? UINT16_MAX : (uint16_t)interval;
            steps->remainder = cutter->motor[i].remainder;
            steps->total = cutter->motor[i].total;
            steps->error = cutter->motor[i].error;
        }
        cutter->motor[i].steps -= course->made;
        cutter->motor[i].next = course->next - duration;
        cutter->motor[i].error = course->error;
    }
    cutter->left = left - duration;
}
