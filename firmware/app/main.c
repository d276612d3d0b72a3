/* The firmware without Arduino: the machine header is chosen by the Makefile. */
#include MACHINE_HEADER

#ifdef __AVR__
#include <avr/interrupt.h>
#endif

int main(void) {
    plotplan_setup(&plotplan_machine);
#ifdef __AVR__
    sei();
#endif
    for (;;) {
        plotplan_loop();
    }
}
