"""Motor driver, encoder and servo on an STM32 with the `pyb` module."""

import pyb

PWM_HZ = 20_000
SERVO_HZ = 50


class Motor:
    """A motor on an L6206 (Nucleo IHM04A1): both inputs are channels of one timer."""

    def __init__(self, timer, enable, pins, reversed):
        self.enable = pyb.Pin(enable, pyb.Pin.OUT_PP)
        self.enable.low()
        self.timer = pyb.Timer(timer, freq=PWM_HZ)
        pins = pins[::-1] if reversed else pins
        channels = (2, 1) if reversed else (1, 2)
        self.channels = [
            self.timer.channel(channel, pyb.Timer.PWM, pin=pyb.Pin(pin)) for channel, pin in zip(channels, pins)
        ]
        self.full = self.timer.period() + 1
        self.set(0)
        self.enable.high()

    def set(self, duty):
        """Duty in 1/1000; positive turns forwards."""
        width = abs(duty) * self.full // 1000
        forwards, backwards = self.channels
        forwards.pulse_width(width if duty > 0 else 0)
        backwards.pulse_width(width if duty < 0 else 0)


class Encoder:
    """A quadrature encoder on a timer of 16 bits, counted on from there."""

    def __init__(self, timer, pins, reversed):
        self.timer = pyb.Timer(timer, prescaler=0, period=0xFFFF)
        for channel, pin in enumerate(pins, 1):
            self.timer.channel(channel, pyb.Timer.ENC_AB, pin=pyb.Pin(pin))
        self.sign = -1 if reversed else 1
        self.last = self.timer.counter()
        self.ticks = 0

    def read(self):
        """Position, ticks. To be called before it can move by 32768 counts."""
        now = self.timer.counter()
        step = (now - self.last) & 0xFFFF
        self.last = now
        self.ticks += self.sign * (step - 0x10000 if step > 0x7FFF else step)
        return self.ticks

    def set(self, ticks):
        self.read()
        self.ticks = ticks


class Servo:
    """A servo by its pulse. The timer is set up for 1 us a count: the report's prescaler was one too large."""

    def __init__(self, timer, channel, pin):
        self.timer = pyb.Timer(timer, prescaler=0, period=0xFFFF)
        per_us = self.timer.source_freq() // 1_000_000
        self.timer.init(prescaler=per_us - 1, period=1_000_000 // SERVO_HZ - 1)
        self.channel = self.timer.channel(channel, pyb.Timer.PWM, pin=pyb.Pin(pin))

    def set_us(self, us):
        self.channel.pulse_width(us)
