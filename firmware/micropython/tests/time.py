"""MicroPython's clock, simulated: it stands still while a task runs, and wraps at 2^30 us."""

from pyb import WORLD

_WRAP = 1 << 30


def ticks_us():
    return WORLD.us % _WRAP


def ticks_add(ticks, delta):
    return (ticks + delta) % _WRAP


def ticks_diff(a, b):
    return (a - b + _WRAP // 2) % _WRAP - _WRAP // 2


def sleep_us(us):
    WORLD.pass_time(us)
