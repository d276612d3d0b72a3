"""The loop of one DC motor: PID with feed-forward of speed, acceleration and friction.

The loop follows the middle of a window of setpoints, and takes speed and acceleration from its ends,
so that whole ticks in short rows do not disturb it. All motion, and the pen, is late by half of the
window. Whole numbers only; duty in 1/1000.
"""

from array import array

FULL = 1000
# The integral may make at most half of the duty.
SUM_LARGEST = (FULL // 2) << 16
# Half of the window, us.
HALF_US = 10_000
# Below this difference over the window the motor rests: half a tick a second at 10 ms.
MOVING = 1


class Loop:
    """`gains`: kp (% a tick), ki (% a tick and s), model: ticks_s_percent, time_constant_s, friction (%)."""

    def __init__(self, gains, period_us):
        self.half = max(1, HALF_US // period_us)
        self.size = 2 * self.half + 1
        self.window = array("i", [0] * self.size)
        self.at = 0
        self.sum = self.error = 0
        half_s = self.half * period_us * 1e-6
        # Setpoints are in 1/64 tick, duty in 0.1 %.
        per_tick = FULL / 100 / 64
        speed = gains["ticks_s_percent"]
        self.kp = round(gains["kp"] * per_tick * 4096)
        self.ki = round(gains["ki"] * per_tick * period_us * 1e-6 * 65536)
        self.kv = round(per_tick / speed / (2 * half_s) * 4096)
        self.ka = round(per_tick * gains["time_constant_s"] / speed / (half_s * half_s) * 256)
        self.friction = round(gains["friction"] * FULL / 100)

    def reset(self, setpoint):
        for index in range(self.size):
            self.window[index] = setpoint
        self.sum = self.error = 0

    def is_settling(self):
        """Whether the middle of the window still moves."""
        newest = self.window[self.at]
        return any(setpoint != newest for setpoint in self.window)

    def step(self, setpoint, ticks):
        """Duty for the setpoint (1/64 tick) that is reached half a window from now."""
        window, size = self.window, self.size
        self.at = at = (self.at + 1) % size
        window[at] = setpoint
        oldest = window[(at + 1) % size]
        middle = window[(at + 1 + self.half) % size]
        self.error = error = max(-131072, min(131071, middle - (ticks << 6)))
        speed = setpoint - oldest
        duty = ((self.kp * error) >> 12) + (self.sum >> 16) + ((self.kv * speed) >> 12)
        duty += (self.ka * (setpoint - 2 * middle + oldest)) >> 8
        if speed > MOVING:
            duty += self.friction
        elif speed < -MOVING:
            duty -= self.friction
        # A saturated loop does not integrate.
        if duty > FULL:
            return FULL
        if duty < -FULL:
            return -FULL
        self.sum = max(-SUM_LARGEST, min(SUM_LARGEST, self.sum + self.ki * error))
        return duty
