"""Tests of the plotter under MicroPython itself, with simulated timers, encoders and motors."""

import math
import sys

import config
import pyb
from plotplan.control import Loop
from plotplan.devices import Encoder
from plotplan.motion import ARRIVED, Motion
from plotplan.plotter import Plotter
from plotplan.tick_lines import Refused, TickLines, checksum

ROOM = 512


def numbered(number, line):
    text = b"%d:%s" % (number, line)
    return b"%s*%d" % (text, checksum(text))


class Still:
    """An encoder of a motor that is where it should be."""

    def __init__(self):
        self.ticks = 0

    def read(self):
        return self.ticks

    def set(self, ticks):
        self.ticks = ticks


def reader():
    motion = Motion(config, [Still(), Still()])
    motion.home()
    return TickLines(motion, ROOM)


def fresh():
    pyb.WORLD.__init__()
    plotter = Plotter(config)
    plotter.motion.home()
    for motor, ticks in zip(pyb.WORLD.arm, config.HOME):
        motor.start = ticks
    return plotter


def at(motor):
    """Where a motor of the world is, in ticks of the plan."""
    return motor.start + motor.position


def plan():
    with open("plan.ticks", "rb") as file:
        return [line.rstrip(b"\n") for line in file if not line.startswith(b";")]


def expect(left, right):
    assert left == right, "%r instead of %r" % (left, right)


# Protocol.


def test_answers_of_numbered_lines():
    lines = reader()
    expect(lines.answer(numbered(0, b"begin 1 2 20000 ; machine coaxial")), b"ok 1 room 512*%d\n" % checksum(b"ok 1 room 512"))
    expect(lines.answer(numbered(1, b"s 0 0 800 0")), b"ok 2*%d\n" % checksum(b"ok 2"))
    expect(lines.answer(numbered(2, b"m 0 10000 801 -1")), b"ok 3*%d\n" % checksum(b"ok 3"))
    # A repeat, a line that comes too early, a damaged one: the answer says which is expected.
    for line in (numbered(2, b"m 0 10000 801 -1"), numbered(7, b"m 0 10000 809 -1"), b"3:m 0 10000 802 -1*1", b"\xff\xfe*3", b"3:*"):
        expect(lines.answer(line), b"ok 3*%d\n" % checksum(b"ok 3"))
    expect(lines.machine.moves, 1)
    expect(lines.answer(numbered(3, b"m 0 10000 802 -1")), b"ok 4*%d\n" % checksum(b"ok 4"))
    expect(lines.answer(numbered(4, b"end 0 2 20000")), b"ok 5*%d\n" % checksum(b"ok 5"))


def test_refusals_name_the_reason():
    for line, why in (
        (b"begin 2 0 0", b"version"),
        (b"begin 1 0 0 ; machine polar", b"machine"),
        (b"s 1 0 800 0", b"count"),
        (b"s 0 0 810 0", b"place"),
        (b"m 0 0 801 0", b"range"),
        (b"m 999 10000 801 0", b"range"),
        (b"m 0 10000 99999 0", b"range"),
        (b"m 0 1000 900 0", b"speed"),
        (b"end 0 1 0", b"count"),
    ):
        lines = reader()
        lines.answer(numbered(0, b"begin 1 2 20000"))
        number = 0 if line.startswith(b"begin") else 1
        text = b"error %d %s" % (number, why)
        expect(lines.answer(numbered(number, line)), b"%s*%d\n" % (text, checksum(text)))
        # Without a number, too.
        expect(lines.answer(line), b"error %s\n" % why)
    for line in (b"m 0 10000 801", b"jump", b"m 0 0x10 801 0", b"m 0 1.5 801 0", b"m 0 - 801 0", b"m 0 10000 801 0 0"):
        expect(reader().answer(line), b"error line\n")
    for line in (b"", b"; comment", b"   "):
        expect(reader().answer(line), None)


def test_any_bytes_are_answered_or_ignored():
    state = 1
    lines = reader()
    for _ in range(3000):
        text = b""
        for _ in range(state % 40):
            state = (state * 1103515245 + 12345) & 0x3FFFFFFF
            text += bytes([(state >> 8) & 0xFF])
        state = (state * 1103515245 + 12345) & 0x3FFFFFFF
        answer = lines.answer(text.replace(b"\n", b""))
        assert answer is None or answer.endswith(b"\n")


def test_where_and_home():
    lines = reader()
    expect(lines.answer(b"where*%d" % checksum(b"where")), b"at 800 0 0*%d\n" % checksum(b"at 800 0 0"))
    lines.answer(b"m 0 10000 801 0")
    expect(lines.answer(b"home*%d" % checksum(b"home")), b"error moving\n")
    lines.machine.fault("follow")
    expect(lines.answer(b"where*%d" % checksum(b"where")), b"at unknown*%d\n" % checksum(b"at unknown"))
    expect(lines.answer(b"m 0 10000 801 0"), b"error follow\n")
    expect(lines.answer(b"home*%d" % checksum(b"home")), b"ok\n")
    expect(lines.answer(b"where*%d" % checksum(b"where")), b"at 800 0 0*%d\n" % checksum(b"at 800 0 0"))


def test_queue_holds_64_lines():
    motion = reader().machine
    motion.begin()
    for k in range(64):
        assert motion.has_room()
        motion.move(0, 10_000, 800 + k % 2, 0)
    assert not motion.has_room()


# Devices.


def test_encoder_counts_beyond_16_bits():
    pyb.WORLD.__init__()
    motor = pyb.WORLD.motors[3]
    encoder = Encoder(8, ("PC6", "PC7"), False)
    for step in (30000, 30000, 30000, -20000, -30000, -30000, -30000):
        motor.counted += step
        expect(encoder.read(), motor.counted)
    encoder.set(5)
    motor.counted += 7
    expect(encoder.read(), 12)


def test_servo_pulse_is_in_microseconds():
    fresh()
    timer = pyb.WORLD.timers[2]
    expect((timer.source_freq() / (timer.prescaler + 1), timer.period() + 1), (1e6, 20_000))
    expect(pyb.WORLD.servo[-1][1], config.PEN_UP_US)


def test_loop_holds_its_place_and_saturates():
    loop = Loop(config.MOTORS[0]["loop"], config.PERIOD_US)
    loop.reset(800 << 6)
    expect(loop.step(800 << 6, 800), 0)
    expect(loop.step(800 << 6, -9000), 1000)
    expect(loop.step(800 << 6, 9000), -1000)
    expect(loop.sum, 0)


# Drawing.


class Line:
    """A serial line of 115200 baud with a sender at its end that repeats what is not acknowledged.
    Every `damage`th byte is changed, each way."""

    ROOM = ROOM

    def __init__(self, lines, damage):
        self.lines = [numbered(number, line) for number, line in enumerate(lines)]
        self.damage = damage
        self.bytes = 0
        self.next = self.acknowledged = 0
        self.last_us = self.sent_us = self.repeated_us = 0
        self.flying = b""
        self.answers = b""
        self.error = None

    def _through(self, data):
        if not self.damage:
            return data
        out = bytearray(data)
        for index in range(len(out)):
            self.bytes += 1
            if self.bytes % self.damage == 0 and out[index] != 10:
                out[index] ^= 4
        return bytes(out)

    def is_done(self):
        return self.acknowledged == len(self.lines) or self.error

    def read(self):
        now = pyb.WORLD.us
        if now - self.last_us > 100_000 and not self.is_done():
            self.next, self.last_us = self.acknowledged, now  # nothing came: again
        window = sum(len(line) + 1 for line in self.lines[self.acknowledged:self.next])
        while self.next < len(self.lines) and window + len(self.lines[self.next]) < self.ROOM:
            self.flying += self._through(self.lines[self.next] + b"\n")
            window += len(self.lines[self.next]) + 1
            self.next += 1
        count = min(64, (now - self.sent_us) * 115_200 // 10_000_000)
        if count:
            self.sent_us = now
        arrived, self.flying = self.flying[:count], self.flying[count:]
        return arrived

    def write(self, data):
        self.answers += self._through(data)
        while b"\n" in self.answers:
            answer, self.answers = self.answers.split(b"\n", 1)
            text, star, total = answer.rpartition(b"*")
            if not star or total != b"%d" % checksum(text):
                continue
            words = text.split()
            if words[0] == b"error":
                self.error = text
            elif words[0] == b"ok":
                number = int(words[1])
                self.last_us = pyb.WORLD.us
                if number > self.acknowledged:
                    self.acknowledged = number
                    self.next = max(self.next, number)
                elif number < self.next and pyb.WORLD.us - self.repeated_us > 50_000:
                    # A line was lost; those behind it, which are still on their way, say the same.
                    self.next, self.repeated_us = number, pyb.WORLD.us


class Recorder:
    """Distance of the pen from the path of the setpoints of the last 40 ms, mm, by the arm's geometry."""

    KEPT = 40_000 // pyb.STEP_US

    def __init__(self, plotter):
        self.plotter = plotter
        self.path = []
        self.squares = self.worst = 0.0
        self.count = 0
        pyb.WORLD.on_step = self.step

    def step(self):
        motion = self.plotter.motion
        self.path.append(point(motion.setpoint(0) / 64, motion.setpoint(1) / 64))
        if len(self.path) > self.KEPT:
            self.path.pop(0)
        if self.plotter.pens[0]:
            here = point(*[at(motor) for motor in pyb.WORLD.arm])
            distance = min(apart(here, self.path[k], self.path[k + 1]) for k in range(len(self.path) - 1))
            self.squares += distance * distance
            self.worst = max(self.worst, distance)
            self.count += 1

    def rms(self):
        return math.sqrt(self.squares / self.count)


def apart(p, a, b):
    """Distance of a point from a segment."""
    x, y = b[0] - a[0], b[1] - a[1]
    square = x * x + y * y
    t = max(0.0, min(1.0, ((p[0] - a[0]) * x + (p[1] - a[1]) * y) / square)) if square else 0.0
    return math.sqrt((a[0] + t * x - p[0]) ** 2 + (a[1] + t * y - p[1]) ** 2)


def point(ticks1, ticks2):
    theta, psi = ticks1 * math.pi / 1600, (800 - ticks2) * math.pi / 1600
    return 206 * math.cos(theta) + 256 * math.cos(psi), 206 * math.sin(theta) + 256 * math.sin(psi)


def ends_where_the_plan_ends(plotter, lines):
    last = [line for line in lines if line.startswith(b"m")][-1].split()
    for motor, tick in zip(pyb.WORLD.arm, last[3:]):
        assert abs(at(motor) - int(tick)) <= ARRIVED, "%.2f instead of %s" % (at(motor), tick)
    expect(plotter.motion.why, None)
    expect(plotter.motion.late, 0)
    # Up, down, up: zot is one stroke.
    expect([us for _, us in pyb.WORLD.servo], [config.PEN_UP_US, config.PEN_DOWN_US, config.PEN_UP_US])


def draws(damage):
    plotter = fresh()
    recorder = None if damage else Recorder(plotter)
    lines = plan()
    line = Line(lines, damage)
    settled = lambda: line.is_done() and not plotter.motion.is_moving()
    plotter.run(plotter.serial(line), settled)
    expect(line.error, None)
    ends_where_the_plan_ends(plotter, lines)
    return recorder


def test_zot_from_a_file():
    plotter = fresh()
    lines = plan()
    bad = []
    plotter.run(plotter.file(lines, lambda line, answer: bad.append((line, answer))))
    expect(bad, [])
    ends_where_the_plan_ends(plotter, lines)


def test_zot_over_a_serial_line():
    recorder = draws(0)
    print("  zot: %.3f mm RMS, %.3f mm at most from the path of the plan" % (recorder.rms(), recorder.worst))
    assert recorder.rms() < 0.35, recorder.rms()


def test_zot_with_damaged_bytes():
    draws(997)


def test_unplugged_encoder_stops_the_motors():
    plotter = fresh()
    line = Line(plan(), 0)

    def unplug():
        if pyb.WORLD.us > 3_000_000:
            pyb.WORLD.motors[3].is_plugged = False

    pyb.WORLD.on_step = unplug
    plotter.run(plotter.serial(line), lambda: line.error or pyb.WORLD.us > 20_000_000)
    expect(line.error.split()[2], b"follow")
    expect(plotter.motion.where(), None)
    expect(pyb.WORLD.servo[-1][1], config.PEN_UP_US)
    for number in (3, 5):
        expect([channel.width for channel in pyb.WORLD.timers[number].channels.values()], [0, 0])


def test_refused_line_of_a_file_ends_the_drawing():
    plotter = fresh()
    bad = []
    plotter.run(plotter.file([b"begin 1 1 10000", b"s 0 0 700 0"], lambda line, answer: bad.append(answer)))
    expect(bad, [b"error place\n"])


def main():
    failed = 0
    tests = sorted(name for name in globals() if name.startswith("test_"))
    for name in tests:
        try:
            globals()[name]()
            print("ok   %s" % name)
        except Exception as error:
            failed += 1
            print("FAIL %s" % name)
            sys.print_exception(error)
    print("%d passed, %d failed" % (len(tests) - failed, failed))
    return failed
