/* Feedback loop of a DC motor in fixed point, once a millisecond.
 *
 * The setpoint leads by 10 ms. The loop follows the middle of a window of 21 setpoints, r(-10) to
 * r(10), and differentiates it by its ends, which whole ticks in rows of 3 ms do not disturb:
 *
 *     speed        v = (r(10) - r(-10)) / 20 ms
 *     acceleration a = (r(10) - 2 r(0) + r(-10)) / (10 ms)^2
 *     duty         u = kp e + ki sum e + kv v + ka a + friction sign(v),   e = r(0) - encoder
 *
 * Setpoints are kept modulo 2^16 in 1/64 tick: differences up to 512 ticks are right. */
#ifndef PLOTPLAN_DC_CONTROL_H
#define PLOTPLAN_DC_CONTROL_H

#include <stdint.h>

#include "plotplan_firmware.h"

#define DUTY_LARGEST 800
#define WINDOW_HALF 10
#define WINDOW (2 * WINDOW_HALF + 1)

struct dc_control {
    int16_t window[WINDOW];
    int16_t error; /* of the last call, 1/64 tick */
    int32_t sum;   /* duty, times 2^20 */
};

/* At rest at this setpoint, 1/64 tick modulo 2^16. */
void dc_control_reset(struct dc_control *control, int16_t setpoint);

/* The duty, -800 to 800. `at` is the window's index for this call: 0 to 20, one more each time. */
int16_t dc_control_step(struct dc_control *control, const struct plotplan_loop *loop, int16_t friction,
                        uint8_t at, int16_t setpoint, int16_t encoder);

#endif
