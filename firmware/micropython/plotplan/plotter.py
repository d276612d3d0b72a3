"""The plotter: loop, pen and lines as cooperative tasks."""

import gc
import time

from . import scheduler
from .control import HALF_US, Loop
from .devices import Encoder, Motor, Servo
from .motion import Motion
from .tick_lines import LONGEST, TickLines

# The motors stop when they are this far behind, ticks, for this long, us.
FOLLOW = 40
FOLLOW_US = 20_000
# Lines and garbage, us.
LINES_US = 1_000
GARBAGE_US = 100_000


class Plotter:
    """`config` is the module config.py, as `plotplan machine show M --firmware-config micropython` writes it."""

    def __init__(self, config):
        self.period_us = config.PERIOD_US
        self.motors = [Motor(*motor["driver"], motor["reversed"]) for motor in config.MOTORS]
        self.encoders = [Encoder(*motor["encoder"], motor["encoder_reversed"]) for motor in config.MOTORS]
        self.loops = [Loop(motor["loop"], self.period_us) for motor in config.MOTORS]
        self.servo = Servo(*config.SERVO)
        self.pen_us = config.PEN_UP_US, config.PEN_DOWN_US
        self.motion = Motion(config, self.encoders)
        self.motion.is_settling = lambda: any(loop.is_settling() for loop in self.loops)
        # The pen is as late as the motors are.
        self.pens = [0] * max(1, HALF_US // self.period_us)
        self.behind_us = 0
        self.is_on = False
        self.servo.set_us(self.pen_us[0])

    def control(self):
        """Task: setpoints, loops and pen, once a period."""
        motion = self.motion
        while True:
            motion.advance(self.period_us)
            if motion.why or not motion.known:
                self._off()
            else:
                self._follow()
            self.pens.append(motion.pen)
            pen = self.pens.pop(0) if not motion.why else 0
            self.servo.set_us(self.pen_us[1 if pen else 0])
            yield

    def _follow(self):
        motion = self.motion
        if not self.is_on:
            self.is_on = True
            for index, loop in enumerate(self.loops):
                loop.reset(motion.setpoint(index))
        worst = 0
        for index in (0, 1):
            loop = self.loops[index]
            self.motors[index].set(loop.step(motion.setpoint(index), self.encoders[index].read()))
            worst = max(worst, abs(loop.error))
        self.behind_us = self.behind_us + self.period_us if worst > FOLLOW << 6 else 0
        if self.behind_us > FOLLOW_US:
            motion.fault("follow")
            self._off()

    def _off(self):
        self.is_on = False
        self.behind_us = 0
        for motor, encoder in zip(self.motors, self.encoders):
            motor.set(0)
            encoder.read()

    def serial(self, port):
        """Task: lines from a serial port, each answered. A line leaves the port's buffer, whose room is
        announced, when it is executed."""
        lines = TickLines(self.motion, port.ROOM)
        pending = b""
        while True:
            pending += port.read()
            if b"\n" in pending:
                line, rest = pending.split(b"\n", 1)
                line = line.rstrip(b"\r")
                if lines.can_take(line):
                    pending = rest
                    answer = lines.answer(line)
                    if answer:
                        port.write(answer)
            elif len(pending) > LONGEST:
                pending = b""  # noise without a line end
            yield

    def file(self, lines, failed):
        """Task: lines of a file. Ends when the plan has been drawn; `failed` gets the answer to a bad line."""
        reader = TickLines(self.motion, 0)
        for line in lines:
            line = line.rstrip(b"\r\n")
            while not reader.can_take(line):
                yield
            answer = reader.answer(line)
            if answer and answer[:2] != b"ok":
                failed(line, answer)
                break
        while self.motion.is_moving():
            yield

    def garbage(self):
        """Task: collects garbage at times of its own, so that no allocation has to wait for it."""
        while True:
            gc.collect()
            yield

    def run(self, lines, until=lambda: False):
        """Runs the tasks; `lines` is `serial(...)` or `file(...)`."""
        tasks = [
            scheduler.Task(self.control(), self.period_us),
            scheduler.Task(lines, LINES_US),
            scheduler.Task(self.garbage(), GARBAGE_US),
        ]
        try:
            scheduler.run(tasks, until)
        finally:
            self._off()
            self.servo.set_us(self.pen_us[0])
        return tasks
