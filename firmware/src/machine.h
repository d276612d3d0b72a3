/* The state that the three layers share: what is planned, whether the position is known, faults. */
#ifndef PLOTPLAN_MACHINE_H
#define PLOTPLAN_MACHINE_H

#include "plotplan_firmware.h"
#include "port.h"

enum fault {
    FAULT_NONE,
    FAULT_LIMIT,  /* a limit switch closed outside of homing */
    FAULT_FOLLOW, /* an encoder does not follow: unplugged, or the motor is blocked */
    FAULT_STOP,   /* emergency stop */
    FAULT_HOME    /* homing failed */
};

/* Why a line cannot be executed; NULL if it was. */
typedef flash_text reason;

extern const struct plotplan_machine *machine;

void machine_init(const struct plotplan_machine *configuration);

/* The lines of a plan, after their syntax has been checked. TIME and DURATION are modulo 2^32 us. */
reason machine_begin(void);
reason machine_sync(uint32_t row, uint32_t time_us, int32_t ticks1, int32_t ticks2);
reason machine_move(uint32_t pen, uint32_t us, int32_t ticks1, int32_t ticks2);
reason machine_end(uint32_t pen, uint32_t moves, uint32_t time_us);

/* The commands outside of a plan. */
reason machine_home(void);
reason machine_measure(void);
/* Position, and whether the motors move; false if the position is unknown. */
bool machine_where(int32_t ticks[2], bool *moving);
/* The name of a state: idle, moving, homing, measuring, or a fault. */
flash_text machine_state(void);
/* Times that the queue ran empty while the motors moved. */
uint8_t machine_late(void);
void machine_count_late(void);

/* From the main loop. */
void machine_poll(void);
/* From the interrupt, every millisecond. */
void machine_tick(void);
/* Stops everything. From any context. */
void machine_fault(enum fault fault);

/* Homing's own moves: in ticks, unchecked. */
void machine_push(int16_t ticks1, int16_t ticks2, uint32_t us);
/* Halts the drive and empties the queue; what was planned is where the motors are. */
void machine_stop_here(void);
void machine_set_position(int32_t ticks1, int32_t ticks2);
/* Whether both motors at rest are within a few ticks of where they should be. */
bool machine_has_arrived(void);

/* Milliseconds since the start, modulo 2^16. */
uint16_t machine_ms(void);

#endif
