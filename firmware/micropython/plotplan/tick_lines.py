"""Tick lines with numbers, checksums and answers (docs/tick-lines.md, docs/sending.md).

To the machine: NUMBER:LINE*SUM, or LINE alone. From it: `ok NUMBER*SUM` and so on. SUM is the
exclusive or of the bytes before the asterisk.
"""

VERSION = 1
# Longest line with its number and its checksum.
LONGEST = 86
MACHINE = "; machine "


class Refused(Exception):
    """Why a line is not executed, in one word."""


def checksum(text):
    total = 0
    for byte in text:
        total ^= byte
    return total


def whole(text):
    """A whole number in decimal digits; `int` would also take `0x1` and ` 1`."""
    digits = text[1:] if text[:1] == "-" else text
    if not digits or not all("0" <= digit <= "9" for digit in digits):
        raise Refused("line")
    return int(text)


class TickLines:
    """Lines to calls of a machine, and its answers to lines."""

    def __init__(self, machine, room):
        self.machine = machine
        self.room = room
        self.expected = 0

    def can_take(self, line):
        """Whether there is room for what the line asks for. `m` and `end` fill the queue."""
        text = line.split(b":", 1)[-1]
        return not (text[:2] == b"m " or text[:4] == b"end ") or self.machine.has_room()

    def answer(self, line):
        """Executes a line without its line end. The answer; None for blank lines and comments."""
        text, star, total = line.rpartition(b"*")
        if not star:
            return self._unnumbered(line)
        # A damaged line is answered with the number that is expected: the sender repeats it.
        if total.strip() != b"%d" % checksum(text):
            return self._ok()
        try:
            text = text.decode()
        except UnicodeError:
            return self._ok()
        number, colon, body = text.partition(":")
        if not colon:
            return self._command(text)
        if not number.isdigit():
            return self._ok()
        number = int(number)
        # 0 begins a session. Any other number than the expected one is a repeat, or comes too early.
        if number not in (0, self.expected):
            return self._ok()
        try:
            self._execute(body)
        except Refused as refused:
            if refused.args[0] == "line":
                return self._ok()  # damaged twice, so that the checksum is right
            self.expected = number
            return framed("error %d %s" % (number, refused.args[0]))
        self.expected = number + 1
        return self._ok()

    def _ok(self):
        if self.expected == 1:
            return framed("ok 1 room %d" % self.room)
        return framed("ok %d" % self.expected)

    def _unnumbered(self, line):
        try:
            text = line.decode()
            if not text.split(";")[0].strip():
                return None
            self._execute(text)
        except UnicodeError:
            return b"error line\n"
        except Refused as refused:
            return b"error %s\n" % refused.args[0].encode()
        return b"ok\n"

    def _command(self, text):
        machine = self.machine
        try:
            if text == "where":
                at = machine.where()
                return framed("at unknown" if at is None else "at %d %d %d" % at)
            if text == "status":
                return framed("status %s late %d start power" % (machine.state(), machine.late))
            if text == "machine":
                return framed("machine %s %d" % (machine.name, VERSION))
            if text == "home":
                machine.home()
            elif text == "stop":
                machine.fault("stop")
            else:
                return self._ok()
        except Refused as refused:
            return b"error %s\n" % refused.args[0].encode()
        return b"ok\n"

    def _execute(self, line):
        text, _, comment = line.partition(";")
        words = text.split()
        if not words:
            return
        verb, fields = words[0], [whole(word) for word in words[1:]]
        if len(fields) != {"m": 4, "s": 4, "begin": 3, "end": 3}.get(verb):
            raise Refused("line")
        if verb == "m":
            self.machine.move(*fields)
        elif verb == "s":
            self.machine.sync(*fields)
        elif verb == "end":
            self.machine.end(*fields)
        else:
            if fields[0] != VERSION:
                raise Refused("version")
            comment = ";" + comment.rstrip()
            if comment.startswith(MACHINE) and comment[len(MACHINE):] != self.machine.name:
                raise Refused("machine")
            self.machine.begin()


def framed(text):
    return b"%s*%d\n" % (text.encode(), checksum(text.encode()))
