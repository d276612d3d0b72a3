/* Pen: servo, solenoid, or a Z axis that makes one step a millisecond. */
#ifndef PLOTPLAN_PEN_H
#define PLOTPLAN_PEN_H

#include <stdint.h>

void pen_init(void);
/* Sets the pen: 0 lifts. From any context. */
void pen_set(uint8_t number);
/* From the interrupt, every millisecond. */
void pen_tick(void);

#endif
