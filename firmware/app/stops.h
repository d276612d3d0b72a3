/* DC motors that are homed against mechanical stops. */
#include "parts.h"

static const struct plotplan_machine plotplan_machine = {
    .name = "coaxial",
    .drive = &dc_drive,
    .motor = {GEARMOTOR, GEARMOTOR},
    .pen = PEN,
    .homing = {
        {.limit_switch = PLOTPLAN_STOP, MOTOR_1, HOMING_GEARMOTOR},
        {.limit_switch = PLOTPLAN_STOP, MOTOR_2, HOMING_GEARMOTOR},
    },
    .home = {800, 800},
    .must_home = true,
    .stop_used = true,
};
