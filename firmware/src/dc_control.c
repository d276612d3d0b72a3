#include "dc_control.h"

/* The integral may make at most half of the duty. */
#define SUM_LARGEST ((int32_t)(DUTY_LARGEST / 2) << 20)
/* Below this difference over the window the motor rests: half a tick a second. */
#define MOVING 1

void dc_control_reset(struct dc_control *control, int16_t setpoint) {
    for (uint8_t i = 0; i < WINDOW; i++) {
        control->window[i] = setpoint;
    }
    control->sum = 0;
    control->error = 0;
}

static int16_t difference(int16_t a, int16_t b) {
    return (int16_t)((uint16_t)a - (uint16_t)b);
}

static int16_t saturate(int32_t value) {
    return value > INT16_MAX ? INT16_MAX : value < INT16_MIN ? INT16_MIN : (int16_t)value;
}

int16_t dc_control_step(struct dc_control *control, const struct plotplan_loop *loop, int16_t friction,
                        uint8_t at, int16_t setpoint, int16_t encoder) {
    uint8_t oldest_at = at == WINDOW - 1 ? 0 : at + 1;
    uint8_t middle_at = at < WINDOW_HALF ? at + WINDOW_HALF + 1 : at - WINDOW_HALF;
    int16_t oldest = control->window[oldest_at];
    control->window[at] = setpoint;
    int16_t middle = control->window[middle_at];

    int16_t error = difference(middle, encoder);
    int16_t speed = difference(setpoint, oldest);
    int16_t acceleration = saturate((int32_t)difference(setpoint, middle) - difference(middle, oldest));
    control->error = error;

    int32_t duty = ((int32_t)loop->kp * error) >> 14;
    duty += control->sum >> 20;
    duty += ((int32_t)loop->kv * speed) >> 16;
    duty += ((int32_t)loop->ka * acceleration) >> 10;
    if (speed > MOVING) {
        duty += friction;
    } else if (speed < -MOVING) {
        duty -= friction;
    }
    /* A saturated loop does not integrate. */
    if (duty > DUTY_LARGEST) {
        return DUTY_LARGEST;
    }
    if (duty < -DUTY_LARGEST) {
        return -DUTY_LARGEST;
    }
    int32_t sum = control->sum + (int32_t)loop->ki * error;
    control->sum = sum > SUM_LARGEST ? SUM_LARGEST : sum < -SUM_LARGEST ? -SUM_LARGEST : sum;
    return (int16_t)duty;
}
