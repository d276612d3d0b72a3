/* The reader of docs/tick-lines.md on an ATmega328P at 16 MHz, 115200 baud: what a firmware adds to it.
   Motors and pen are variables; a real firmware queues the moves and steps them from a timer. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdint.h>

#include "reader.c"

static volatile uint8_t ring[ROOM + 1];
static volatile uint8_t head;
static uint8_t tail;
static volatile int32_t position[2];
static volatile uint16_t pen_now;
static uint8_t is_homed;

ISR(USART_RX_vect) {
    ring[head] = UDR0;
    head = (head + 1) & ROOM;
}

void pen(uint16_t number) { pen_now = number; }

void move_to(int32_t t1, int32_t t2, uint32_t microseconds) {
    (void)microseconds;
    position[0] = t1;
    position[1] = t2;
}

int position_is(int32_t t1, int32_t t2) {
    if (!is_homed) {
        is_homed = 1;
        position[0] = t1;
        position[1] = t2;
    }
    return position[0] == t1 && position[1] == t2;
}

int where(int32_t *t1, int32_t *t2) {
    *t1 = position[0];
    *t2 = position[1];
    return is_homed ? 0 : -1;
}

void answer(const char *text) {
    for (; *text; text++) {
        while (!(UCSR0A & (1 << UDRE0))) {}
        UDR0 = (uint8_t)*text;
    }
}

int main(void) {
    static char line[96];
    uint8_t length = 0;
    UCSR0A = 1 << U2X0;
    UBRR0 = 16;
    UCSR0B = (1 << RXEN0) | (1 << TXEN0) | (1 << RXCIE0);
    sei();
    for (;;) {
        if (tail == head) continue;
        char byte = (char)ring[tail];
        tail = (tail + 1) & ROOM;
        if (byte == '\n') {
            line[length] = '\0';
            received(line);
            length = 0;
        } else if (length < sizeof line - 1) {
            line[length++] = byte;
        }
    }
}
