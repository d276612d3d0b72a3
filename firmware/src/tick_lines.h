/* Layer 1 of 3: tick lines with numbers, checksums and answers (docs/tick-lines.md, docs/sending.md).
 *
 * Bytes are parsed as they come out of the receive buffer: there is no buffer for a line. */
#ifndef PLOTPLAN_TICK_LINES_H
#define PLOTPLAN_TICK_LINES_H

#include <stdbool.h>
#include <stdint.h>

/* Longest answer, line end and terminator included. */
#define ANSWER_BYTES 56

/* The machine's name, and the bytes that may be in flight. The name must not go away. */
void tick_lines_init(const char *machine_name, uint8_t room);

/* Takes a byte. Returns false if it is the end of a line that the queue has no room for: then the
 * byte stays in the receive buffer and is offered again. The caller does not offer a byte while an
 * answer is owed. */
bool tick_lines_byte(uint8_t byte);

/* Whether a line waits for its answer. */
bool tick_lines_owes_answer(void);

/* Writes the answer, line end included, and returns its length. */
uint8_t tick_lines_answer(char answer[ANSWER_BYTES]);

#endif
