/* Layers 2 and 3: steps, setpoints, the loop of a DC motor. */
#include "tests.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "dc_control.h"
#include "segment_queue.h"
#include "setpoint.h"
#include "step_clock.h"

void steps_come_at_their_time(void) {
    long steps = 0;
    double early = 0, late = 0;
    for (int plan = 0; plan < 1000; plan++) {
        struct cutter cutter;
        double segment_start = 0;
        uint16_t now = (uint16_t)random32();
        double clock = 0; /* half us since the start, of `now` */
        for (int k = 0; k < 20; k++) {
            uint32_t us = random_below(4) ? 1000 + random_below(20000) : 1 + random_below(400000);
            struct segment segment = {.us_low = (uint16_t)us, .us_high = (uint8_t)(us >> 16)};
            for (int i = 0; i < 2; i++) {
                int32_t most = (int32_t)(us / 40);
                most = most > INT16_MAX ? INT16_MAX : most;
                segment.ticks[i] = random_below(5) ? (int16_t)(random_below((uint32_t)(2 * most + 1)) - (uint32_t)most) : 0;
            }
            int made[2] = {0, 0};
            cutter_start(&cutter, &segment);
            while (!cutter_is_done(&cutter)) {
                struct piece piece;
                struct step_clock clocks[2];
                cutter_cut(&cutter, &piece);
                uint16_t end = now + piece.duration;
                for (int i = 0; i < 2; i++) {
                    step_clock_load(&clocks[i], &piece.motor[i], now);
                }
                while (now != end) {
                    uint16_t wait = (uint16_t)(end - now);
                    wait = step_clock_wait(&clocks[0], now, wait);
                    wait = step_clock_wait(&clocks[1], now, wait);
                    now += wait;
                    clock += wait;
                    for (int i = 0; i < 2; i++) {
                        if (step_clock_is_due(&clocks[i], now)) {
                            step_clock_advance(&clocks[i]);
                            made[i]++;
                            double ideal = segment_start + (made[i] - 0.5) * 2.0 * us / abs(segment.ticks[i]);
                            double off = clock - ideal;
                            early = off < early ? off : early;
                            late = off > late ? off : late;
                            steps++;
                        }
                    }
                }
                CHECK(clocks[0].left == 0 && clocks[1].left == 0);
            }
            CHECK(made[0] == abs(segment.ticks[0]) && made[1] == abs(segment.ticks[1]));
            segment_start += 2.0 * us;
            CHECK(clock == segment_start);
        }
    }
    printf("%ld steps of 1000 random plans: each %.2f us early to %.2f us late\n", steps, -early / 2, late / 2);
    /* Times are rounded down; near steps of both motors are made together. */
    CHECK(early > -1.0 - STEPS_TOGETHER && late <= 1.0);
}

void cuts_of_long_rows_keep_clear_of_steps(void) {
    long cuts = 0;
    double nearest = 1e9;
    for (int row = 0; row < 3000; row++) {
        uint32_t us = 16001 + random_below(200000);
        struct segment segment = {.us_low = (uint16_t)us, .us_high = (uint8_t)(us >> 16)};
        for (int i = 0; i < 2; i++) {
            /* Up to the limit of 20,000 steps/s, often close to it. */
            uint32_t most = us / 50 > INT16_MAX ? INT16_MAX : us / 50;
            segment.ticks[i] = (int16_t)(random_below(2) ? most - random_below(most / 20 + 1) : random_below(most + 1));
        }
        struct cutter cutter;
        cutter_start(&cutter, &segment);
        double cut = 0;
        for (;;) {
            struct piece piece;
            cutter_cut(&cutter, &piece);
            CHECK(piece.duration <= 32767);
            cut += piece.duration;
            if (cutter_is_done(&cutter)) {
                break;
            }
            cuts++;
            for (int i = 0; i < 2; i++) {
                if (segment.ticks[i]) {
                    double step = 2.0 * us / segment.ticks[i], before = fmod(cut + step / 2, step);
                    nearest = fmin(nearest, cut > step / 2 ? fmin(before, step - before) : step - before);
                }
            }
        }
    }
    printf("%ld cuts of long rows: no step within %.1f us\n", cuts, nearest / 2);
    CHECK(nearest >= CUT_CLEARANCE - 1);
}

void setpoints_follow_rows_of_any_length(void) {
    fresh();
    double worst = 0;
    for (int plan = 0; plan < 300; plan++) {
        struct setpoint setpoint;
        double time[65], place[65];
        queue_clear();
        time[0] = place[0] = 0;
        int32_t target = 0;
        for (int k = 1; k <= 60; k++) {
            uint32_t us = plan % 3 == 0 ? 1 + random_below(900) : 1 + random_below(30000);
            int16_t d = (int16_t)(random_below(401) - 200);
            queue_push(d, (int16_t)-d, us, 0);
            target += d;
            time[k] = time[k - 1] + us;
            place[k] = target;
        }
        setpoint_set(&setpoint, 0, 0);
        CHECK(setpoint_start(&setpoint));
        int k = 1;
        for (double t = 1000; setpoint_advance(&setpoint); t += 1000) {
            while (t >= time[k]) {
                k++;
            }
            double ideal = place[k - 1] + (place[k] - place[k - 1]) * (t - time[k - 1]) / (time[k] - time[k - 1]);
            double off = fabs(setpoint_of(&setpoint, 0) / 64.0 - ideal);
            worst = off > worst ? off : worst;
            CHECK(setpoint_of(&setpoint, 1) == -setpoint_of(&setpoint, 0));
        }
        CHECK(setpoint_of(&setpoint, 0) == target * 64);
    }
    CHECK(worst < 2.0 / 64);
}

/* tau dv/dt = g (u - f sign v) - v, at rest while |u| <= s. */
static double follow_sine(int16_t friction, int16_t ki, double start, double *final) {
    static const struct plotplan_loop loop = {.kp = 3072, .kv = 3840, .ka = 1440, .follow_counts = 40};
    struct plotplan_loop with_ki = loop;
    with_ki.ki = ki;
    struct dc_control control;
    double x = start, v = 0, sum = 0;
    uint8_t at = 0;
    int n = 0;
    double lead[WINDOW_HALF + 1] = {0};
    dc_control_reset(&control, (int16_t)(int32_t)(start * 64));
    for (int i = 0; i <= WINDOW_HALF; i++) {
        lead[i] = start;
    }
    for (int ms = 0; ms < 6000; ms++) {
        double target = start + (ms < 5000 ? 200 * (1 - cos(2 * 3.14159265358979 * ms / 1000.0)) : 0);
        memmove(lead, lead + 1, sizeof *lead * WINDOW_HALF);
        lead[WINDOW_HALF] = target;
        int16_t duty = dc_control_step(&control, &with_ki, friction, at, (int16_t)(int32_t)lrint(target * 64),
                                       (int16_t)(int32_t)(floor(x + 0.5) * 64));
        at = at == WINDOW - 1 ? 0 : (uint8_t)(at + 1);
        double u = duty / 8.0;
        for (int k = 0; k < 20; k++) {
            if (fabs(v) < 1 && fabs(u) <= 8) {
                v = 0;
            } else {
                double s = fabs(v) < 1 ? (u > 0) - (u < 0) : (v > 0) - (v < 0);
                v += (106.67 * (u - 6 * s) - v) / 0.12 * 5e-5;
                x += v * 5e-5;
            }
        }
        if (ms > 1000 && ms < 5000) {
            sum += (x - lead[0]) * (x - lead[0]);
            n++;
        }
        *final = x - lead[0];
    }
    return sqrt(sum / n);
}

void loop_follows_within_a_count(void) {
    double rest, modelled = follow_sine(48, 262, 0, &rest);
    printf("loop on a motor with 6 %% friction: %.2f counts RMS at 1257 counts/s", modelled);
    CHECK(modelled < 1.0);
    CHECK(fabs(rest) < 3);
    double without = follow_sine(0, 262, 0, &rest);
    printf("; without friction fed forward %.2f\n", without);
    CHECK(without > 1.5 * modelled);
    /* Setpoints modulo 2^16: at 1023 counts they wrap. */
    CHECK(fabs(follow_sine(48, 262, 900, &rest) - modelled) < 0.1);
}

void duty_saturates_without_windup(void) {
    const struct plotplan_loop loop = {.kp = 3072, .ki = 262, .kv = 3840, .ka = 1440};
    struct dc_control control;
    dc_control_reset(&control, 0);
    uint8_t at = 0;
    for (int i = 0; i < 2000; i++) {
        int16_t duty = dc_control_step(&control, &loop, 48, at, 0, -500 * 64);
        CHECK(duty == DUTY_LARGEST);
        at = at == WINDOW - 1 ? 0 : (uint8_t)(at + 1);
    }
    CHECK(control.sum == 0);
    for (int i = 0; i < 50000; i++) {
        int16_t duty = dc_control_step(&control, &loop, 48, at, 0, (int16_t)(i & 1 ? 30 * 64 : -20 * 64));
        CHECK(duty <= DUTY_LARGEST && duty >= -DUTY_LARGEST);
        at = at == WINDOW - 1 ? 0 : (uint8_t)(at + 1);
    }
}
