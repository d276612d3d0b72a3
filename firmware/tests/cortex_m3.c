/* Vectors of a Cortex-M3: the stack, and the start of the C library. */
#include <stdint.h>

extern uint32_t stack_top;
void _start(void);

__attribute__((section(".vectors"), used)) static void (*const vectors[])(void) = {
    (void (*)(void))&stack_top,
    _start,
};
