/* Parts that the machines of the tests have in common. */
#ifndef PLOTPLAN_PARTS_H
#define PLOTPLAN_PARTS_H

#include "plotplan_firmware.h"

#define FAR_LIMITS .lowest = -1000000, .highest = 1000000
#define STEPPER {.shortest_tick_us = 50, FAR_LIMITS}
#define RC_SERVO {.shortest_tick_us = 50, .servo = {.zero_us = 1000, .us_per_256_ticks = 64}, FAR_LIMITS}
#define GAINS {.kp = 3072, .ki = 262, .kv = 3840, .ka = 1440, .friction = 48, .follow_counts = 40}
#define GEARMOTOR {.shortest_tick_us = 1500, .loop = GAINS, FAR_LIMITS}

/* Both motors are homed one after the other, towards smaller ticks. */
#define HOMING_STEPPER .used = true, .fast_us = 1000, .slow_us = 8000, .back_off = 30, .longest = 2000
#define HOMING_GEARMOTOR \
    .used = true, .fast_us = 5000, .slow_us = 25000, .back_off = 40, .longest = 2000, .stop_duty = 160
#define MOTOR_1 .ticks = {-1, 0}
#define MOTOR_2 .ticks = {0, -1}

#define PEN {.kind = PEN_SERVO, .up = 1000, .down = 1500}

#endif
