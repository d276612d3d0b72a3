/* For tests: DC motors that are homed against mechanical stops, one after the other. */
#include "plotplan_firmware.h"

static const struct plotplan_machine plotplan_machine = {
    .name = "coaxial",
    .drive = &dc_drive,
    .motor = {
        {.shortest_tick_us = 1500, .loop = {.kp = 3072, .ki = 262, .kv = 3840, .ka = 1440, .friction = 48, .follow_counts = 40}, .lowest = -1000000, .highest = 1000000},
        {.shortest_tick_us = 1500, .loop = {.kp = 3072, .ki = 262, .kv = 3840, .ka = 1440, .friction = 48, .follow_counts = 40}, .lowest = -1000000, .highest = 1000000},
    },
    .pen = {.kind = PEN_SERVO, .up = 1000, .down = 1500},
    .homing = {
        {.used = true, .limit_switch = PLOTPLAN_STOP, .ticks = {-1, 0}, .fast_us = 5000, .slow_us = 25000, .back_off = 40, .longest = 2000, .stop_duty = 160},
        {.used = true, .limit_switch = PLOTPLAN_STOP, .ticks = {0, -1}, .fast_us = 5000, .slow_us = 25000, .back_off = 40, .longest = 2000, .stop_duty = 160},
    },
    .home = {800, 800},
    .must_home = true,
    .stop_used = true,
};
