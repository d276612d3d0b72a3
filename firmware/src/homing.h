/* Homing: for each move of the machine's list fast to the switch or stop, back, slowly to it, back. */
#ifndef PLOTPLAN_HOMING_H
#define PLOTPLAN_HOMING_H

#include <stdbool.h>

/* Starts; false if the machine has no moves, or its drive cannot make them. */
bool homing_start(void);
bool homing_is_active(void);
void homing_cancel(void);
/* From the main loop. */
void homing_poll(void);

#endif
