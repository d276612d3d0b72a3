/* Steppers that are homed against mechanical stops. */
#include "parts.h"

static const struct plotplan_machine plotplan_machine = {
    .name = "coaxial",
    .drive = &step_drive,
    .motor = {STEPPER, STEPPER},
    .pen = PEN,
    .homing = {
        {.limit_switch = PLOTPLAN_STOP, MOTOR_1, HOMING_STEPPER},
        {.limit_switch = PLOTPLAN_STOP, MOTOR_2, HOMING_STEPPER},
    },
    .home = {-1600, 800},
    .must_home = true,
    .stop_used = true,
};
