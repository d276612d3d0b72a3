#include "parts.h"

static const struct plotplan_machine plotplan_machine = {
    .name = "coaxial",
    .drive = &servo_drive,
    .motor = {RC_SERVO, RC_SERVO},
    .pen = PEN,
    .limits_used = true,
    .stop_used = true,
};
