#include "segment_queue.h"

static struct segment ring[PLOTPLAN_QUEUE];
/* Written by the producer and by the consumer respectively. */
static volatile uint8_t head, tail;

/* The compiler must write a segment before it publishes the index. */
#define COMPILER_BARRIER() __asm__ volatile("" ::: "memory")

static uint8_t after(uint8_t index) {
    return ++index == PLOTPLAN_QUEUE ? 0 : index;
}

bool queue_is_full(void) {
    return after(head) == tail;
}

bool queue_is_empty(void) {
    return head == tail;
}

void queue_push(int16_t ticks1, int16_t ticks2, uint32_t us, uint8_t pen) {
    struct segment *segment = &ring[head];
    segment->ticks[0] = ticks1;
    segment->ticks[1] = ticks2;
    segment->us_low = (uint16_t)us;
    segment->us_high = (uint8_t)(us >> 16);
    segment->pen = pen;
    COMPILER_BARRIER();
    head = after(head);
}

bool queue_pop(struct segment *segment) {
    if (queue_is_empty()) {
        return false;
    }
    *segment = ring[tail];
    COMPILER_BARRIER();
    tail = after(tail);
    return true;
}

void queue_clear(void) {
    head = tail = 0;
}
