/* Bytes received and not read yet: a ring of the size that the answer to line 0 announces. A port's receive
 * interrupt fills it, the main loop empties it; every port includes this in its one file. */

#ifndef PORT_RECEIVE_H
#define PORT_RECEIVE_H

#include "port.h"

static volatile uint8_t receive[PLOTPLAN_RECEIVE];
static volatile uint8_t receive_head, receive_tail;

/* From the interrupt. A full ring drops the byte; the line's checksum shows it. */
static inline void port_received(uint8_t byte) {
    uint8_t head = receive_head, next = (head + 1) & (PLOTPLAN_RECEIVE - 1);
    if (next != receive_tail) {
        receive[head] = byte;
        receive_head = next;
    }
}

int16_t port_peek(void) {
    uint8_t tail = receive_tail;
    return tail == receive_head ? -1 : receive[tail];
}

void port_drop(void) {
    receive_tail = (receive_tail + 1) & (PLOTPLAN_RECEIVE - 1);
}

#endif
