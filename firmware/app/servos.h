#include "plotplan_firmware.h"

static const struct plotplan_machine plotplan_machine = {
    .name = "coaxial",
    .drive = &servo_drive,
    .motor = {
        {.shortest_tick_us = 50, .servo = {.zero_us = 1000, .us_per_256_ticks = 64}, .lowest = -1000000, .highest = 1000000},
        {.shortest_tick_us = 50, .servo = {.zero_us = 1000, .us_per_256_ticks = 64}, .lowest = -1000000, .highest = 1000000},
    },
    .pen = {.kind = PEN_SERVO, .up = 1000, .down = 1500},
    .limits_used = true,
    .stop_used = true,
};
