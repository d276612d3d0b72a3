#include "parts.h"

static const struct plotplan_machine plotplan_machine = {
    .name = "coaxial",
    .drive = &dc_drive,
    .motor = {GEARMOTOR, GEARMOTOR},
    .pen = PEN,
    .limits_used = true,
    .stop_used = true,
};
