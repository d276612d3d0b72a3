#include "parts.h"

static const struct plotplan_machine plotplan_machine = {
    .name = "coaxial",
    .drive = &step_drive,
    .motor = {STEPPER, STEPPER},
    .pen = PEN,
    .limits_used = true,
    .stop_used = true,
};
