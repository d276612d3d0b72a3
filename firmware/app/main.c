/* The firmware without Arduino: the machine header is chosen by the Makefile. */
#include MACHINE_HEADER

#include <avr/interrupt.h>

int main(void) {
    plotplan_setup(&plotplan_machine);
    sei();
    for (;;) {
        plotplan_loop();
    }
}
