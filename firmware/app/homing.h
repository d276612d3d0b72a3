/* Steppers that are homed by switches. */
#include "parts.h"

static const struct plotplan_machine plotplan_machine = {
    .name = "coaxial",
    .drive = &step_drive,
    .motor = {STEPPER, STEPPER},
    .pen = PEN,
    .homing = {{.limit_switch = 0, MOTOR_1, HOMING_STEPPER}, {.limit_switch = 1, MOTOR_2, HOMING_STEPPER}},
    .home = {-1600, 800},
    .must_home = true,
    .limits_used = true,
    .stop_used = true,
};
