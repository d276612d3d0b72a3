/* For tests: steppers that are homed against mechanical stops, one after the other. */
#include "plotplan_firmware.h"

static const struct plotplan_machine plotplan_machine = {
    .name = "coaxial",
    .drive = &step_drive,
    .motor = {
        {.shortest_tick_us = 50, .lowest = -1000000, .highest = 1000000},
        {.shortest_tick_us = 50, .lowest = -1000000, .highest = 1000000},
    },
    .pen = {.kind = PEN_SERVO, .up = 1000, .down = 1500},
    .homing = {
        {.used = true, .limit_switch = PLOTPLAN_STOP, .ticks = {-1, 0}, .fast_us = 1000, .slow_us = 8000, .back_off = 30, .longest = 2000},
        {.used = true, .limit_switch = PLOTPLAN_STOP, .ticks = {0, -1}, .fast_us = 1000, .slow_us = 8000, .back_off = 30, .longest = 2000},
    },
    .home = {-1600, 800},
    .must_home = true,
    .stop_used = true,
};
