#include "plotplan_firmware.h"

static const struct plotplan_machine plotplan_machine = {
    .name = "coaxial",
    .drive = &dc_drive,
    .motor = {
        {.shortest_tick_us = 1500, .loop = {.kp = 3072, .ki = 262, .kv = 3840, .ka = 1440, .friction = 48, .follow_counts = 40}, .lowest = -1000000, .highest = 1000000},
        {.shortest_tick_us = 1500, .loop = {.kp = 3072, .ki = 262, .kv = 3840, .ka = 1440, .friction = 48, .follow_counts = 40}, .lowest = -1000000, .highest = 1000000},
    },
    .pen = {.kind = PEN_SERVO, .up = 1000, .down = 1500},
    .limits_used = true,
    .stop_used = true,
};
