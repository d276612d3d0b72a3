/* The port of this chip, with its pins and timers, for the drives. */
#ifndef PLOTPLAN_PORT_PINS_H
#define PLOTPLAN_PORT_PINS_H

#if defined(PLOTPLAN_MICROBIT)
#include "port_microbit.h"
#else
#include "port_avr.h"
#endif

#endif
