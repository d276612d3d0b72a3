"""Cooperative tasks: generators that are resumed when their time has come, the most urgent first."""

import time


class Task:
    """A generator, resumed every `period_us`; `late` counts periods that were missed."""

    def __init__(self, steps, period_us):
        self.steps = steps
        self.period_us = period_us
        self.due = time.ticks_us()
        self.late = 0


def run(tasks, until=lambda: False):
    """Runs tasks in the order of their importance, until one ends or `until` says so."""
    now = time.ticks_us()
    for task in tasks:
        task.due = now
    while not until():
        for task in tasks:
            now = time.ticks_us()
            if time.ticks_diff(now, task.due) < 0:
                continue
            task.due = time.ticks_add(task.due, task.period_us)
            if time.ticks_diff(now, task.due) >= 0:
                task.late += 1
                task.due = time.ticks_add(now, task.period_us)
            try:
                next(task.steps)
            except StopIteration:
                return
            break
        else:
            time.sleep_us(100)
