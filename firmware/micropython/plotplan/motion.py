"""The queue of segments, the setpoints of both motors, faults and the pose.

Positions of setpoints are in 1/64 tick, as whole numbers: a float would be an allocation, and a
collection of garbage delays the loop.
"""

from array import array

from .tick_lines import Refused

SHIFT = 6
QUEUE = 64
FIELDS = 4  # duration, pen, ticks of both motors
# Distance from the planned position at which a motor at rest has arrived, ticks.
ARRIVED = 8
# The pen has this time after the last line, us.
END_REST_US = 100_000
# Longest line, us, and largest distance in it, ticks.
LONGEST_US = 30_000_000
FARTHEST = 32_767
# Motion starts when the queue is full, or this long after its last line, us.
START_US = 200_000


class Motion:
    """What a plan's lines do to the machine. `encoders` measure, `config` is config.py."""

    def __init__(self, config, encoders):
        self.name = config.NAME
        self.motors = config.MOTORS
        self.homed_at = config.HOME
        self.must_home = config.MUST_HOME
        self.encoders = encoders
        self.queue = array("i", [0] * (QUEUE * FIELDS))
        self.first = self.queued = 0
        self.planned = [0, 0]  # after the queue
        self.base = [0, 0]  # at the start of the segment
        self.ticks = [0, 0]
        self.duration = self.elapsed = self.since_line = 0
        self.pen = 0
        self.running = False
        self.known = not self.must_home
        self.why = None
        self.moves = self.clock = 0
        self.late = 0
        self.is_settling = lambda: False

    # Lines of a plan.

    def begin(self):
        if self.must_home and not self.known:
            raise Refused("home")
        if self.why:
            # A new plan acknowledges the fault.
            self.why = None
            if self.known:
                self.stay()
        self.moves = self.clock = 0

    def sync(self, row, time_us, ticks1, ticks2):
        self._refuse_in_fault()
        if row != self.moves or time_us != self.clock:
            raise Refused("count")
        to = (ticks1, ticks2)
        if not self.known:
            if self.must_home:
                raise Refused("home")
            self.set_position(to)
        elif row == 0 and not self.is_moving():
            # A DC motor rests within a few ticks of its target.
            if all(abs(encoder.read() - tick) <= ARRIVED for encoder, tick in zip(self.encoders, to)):
                self.planned[:] = to
                self.base[:] = to
        if tuple(self.planned) != to:
            raise Refused("place")

    def move(self, pen, us, ticks1, ticks2):
        self._refuse_in_fault()
        if not self.known:
            raise Refused("place")
        if not 0 < us <= LONGEST_US or not 0 <= pen <= 255:
            raise Refused("range")
        distance = (ticks1 - self.planned[0], ticks2 - self.planned[1])
        for motor, tick, far in zip(self.motors, (ticks1, ticks2), distance):
            if not motor["lowest"] <= tick <= motor["highest"]:
                raise Refused("range")
            if abs(far) > FARTHEST:
                raise Refused("far")
            # Rounding to ticks may add one to a row.
            if (abs(far) - 1) * 1_000_000 > us * motor["ticks_s"]:
                raise Refused("speed")
        self._push(us, pen, distance[0], distance[1])
        self.planned[0], self.planned[1] = ticks1, ticks2
        self.moves += 1
        self.clock += us

    def end(self, pen, moves, time_us):
        self._refuse_in_fault()
        if moves != self.moves or time_us != self.clock:
            raise Refused("count")
        if not 0 <= pen <= 255:
            raise Refused("range")
        self._push(END_REST_US, pen, 0, 0)

    def _refuse_in_fault(self):
        if self.why:
            raise Refused(self.why)

    # The machine.

    def home(self):
        """Takes the present pose as the home pose: the arm is put there by hand."""
        if self.is_moving():
            raise Refused("moving")
        self.why = None
        self.set_position(self.homed_at)

    def set_position(self, ticks):
        for encoder, tick in zip(self.encoders, ticks):
            encoder.set(tick)
        self.known = True
        self._rest_at(ticks)

    def stay(self):
        """The motors rest where they are."""
        self._rest_at([encoder.read() for encoder in self.encoders])

    def _rest_at(self, ticks):
        self.planned[:] = ticks
        self.base[:] = ticks
        self.ticks[:] = (0, 0)
        self.duration = self.elapsed = 0

    def fault(self, why):
        """Stops: the motors are switched off, the pen is lifted, the queue is emptied."""
        self.why = self.why or why
        self.queued = 0
        self.running = False
        self.pen = 0
        self.stay()
        if why == "follow":
            self.known = False  # an encoder does not count

    def is_moving(self):
        return self.running or self.queued > 0 or self.is_settling()

    def where(self):
        """Ticks of both motors and whether they move; None if nobody knows."""
        if not self.known:
            return None
        moving = self.is_moving()
        at = [encoder.read() for encoder in self.encoders]
        # The loop still pulls a motor to its target, which is where the next plan starts.
        near = all(abs(tick - goal) <= ARRIVED for tick, goal in zip(at, self.planned))
        if not moving and not self.why and near:
            at = self.planned
        return at[0], at[1], int(moving)

    def state(self):
        return self.why or ("moving" if self.is_moving() else "idle")

    # The queue.

    def has_room(self):
        return self.queued < QUEUE

    def _push(self, us, pen, ticks1, ticks2):
        at = (self.first + self.queued) % QUEUE * FIELDS
        self.queue[at] = us
        self.queue[at + 1] = pen
        self.queue[at + 2] = ticks1
        self.queue[at + 3] = ticks2
        self.queued += 1
        self.since_line = 0

    def _load(self):
        if not self.queued:
            return False
        at = self.first * FIELDS
        self.duration = self.queue[at]
        self.pen = self.queue[at + 1]
        self.ticks[0] = self.queue[at + 2]
        self.ticks[1] = self.queue[at + 3]
        self.first = (self.first + 1) % QUEUE
        self.queued -= 1
        return True

    def advance(self, us):
        """Goes on by this time. Between plans the setpoints rest."""
        if not self.running:
            self.since_line += us
            if not self.queued or (self.queued < QUEUE and self.since_line < START_US):
                return
            self.running = self._load()
            self.elapsed = 0
            return
        self.elapsed += us
        while self.elapsed >= self.duration:
            self.elapsed -= self.duration
            self.base[0] += self.ticks[0]
            self.base[1] += self.ticks[1]
            moved = self.ticks[0] or self.ticks[1]
            if not self._load():
                self.ticks[0] = self.ticks[1] = self.elapsed = self.duration = 0
                self.running = False
                if moved:
                    self.late += 1  # the queue ran empty in motion
                return

    def setpoint(self, motor):
        """Position now, 1/64 tick."""
        if not self.duration:
            return self.base[motor] << SHIFT
        return (self.base[motor] << SHIFT) + (self.ticks[motor] << SHIFT) * self.elapsed // self.duration
