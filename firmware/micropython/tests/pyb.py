"""The part of `pyb` that the plotter uses, on simulated motors and a simulated clock.

Each motor is first order with stiction: its speed tends to `speed_per_duty` (duty less friction) with
the time constant. Its timer makes the duty, another timer counts its encoder, modulo 2^16.
"""

import math


class World:
    """Motors by the number of their PWM timer; `us` is the time."""

    def __init__(self):
        self.us = 0
        self.motors = {3: MotorModel(encoder=8), 5: MotorModel(encoder=4)}
        # MicroPython's dictionaries have no order.
        self.arm = (self.motors[3], self.motors[5])
        self.timers = {}
        self.servo = []  # time and pulse of each change
        self.on_step = lambda: None

    def pass_time(self, us):
        end = self.us + us
        while self.us < end:
            step = min(STEP_US, end - self.us)
            self.us += step
            for number, motor in self.motors.items():
                motor.step(self._duty(number), step * 1e-6)
            self.on_step()

    def _duty(self, number):
        timer = self.timers.get(number)
        if timer is None:
            return 0.0
        width = {channel: timer.channels[channel].width for channel in timer.channels}
        return 100.0 * (width.get(1, 0) - width.get(2, 0)) / (timer.period() + 1)


STEP_US = 1000


class MotorModel:
    def __init__(self, encoder, speed_per_duty=106.67, time_constant=0.12, stiction=8.0, friction=6.0):
        self.encoder = encoder
        self.speed_per_duty = speed_per_duty
        self.time_constant = time_constant
        self.stiction = stiction
        self.friction = friction
        self.position = 0.0
        self.speed = 0.0
        self.is_plugged = True
        self.counted = 0

    def step(self, duty, dt):
        if self.speed == 0.0:
            if abs(duty) <= self.stiction:
                return
            sign = 1.0 if duty > 0 else -1.0
        else:
            sign = 1.0 if self.speed > 0 else -1.0
        goal = self.speed_per_duty * (duty - sign * self.friction)
        decay = math.exp(-dt / self.time_constant)
        new = goal + (self.speed - goal) * decay
        if new * sign <= 0.0:
            new = 0.0
        self.position += 0.5 * (self.speed + new) * dt
        self.speed = new
        if self.is_plugged:
            self.counted = math.floor(self.position + 0.5)


WORLD = World()


class Pin:
    OUT_PP = 1

    def __init__(self, name, mode=None):
        self.name = name

    def low(self):
        pass

    def high(self):
        pass


class Channel:
    def __init__(self, timer, mode):
        self.timer = timer
        self.mode = mode
        self.width = 0

    def pulse_width(self, width):
        if not 0 <= width <= self.timer.period() + 1:
            raise ValueError("pulse width")
        if self.timer.number == 2 and width != self.width:
            WORLD.servo.append((WORLD.us, width))
        self.width = width


class Timer:
    PWM = "pwm"
    ENC_AB = "enc_ab"

    def __init__(self, number, freq=None, prescaler=0, period=None):
        self.number = number
        self.channels = {}
        self.init(freq=freq, prescaler=prescaler, period=period)
        WORLD.timers[number] = self

    def init(self, freq=None, prescaler=0, period=None):
        self.prescaler = prescaler
        self._period = self.source_freq() // freq - 1 if freq else period

    def source_freq(self):
        return 80_000_000

    def period(self):
        return self._period

    def channel(self, number, mode, pin=None):
        self.channels[number] = Channel(self, mode)
        return self.channels[number]

    def counter(self):
        for motor in WORLD.motors.values():
            if motor.encoder == self.number:
                return motor.counted & 0xFFFF
        raise ValueError("no encoder at timer %d" % self.number)
