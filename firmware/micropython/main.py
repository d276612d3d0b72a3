"""Starts the plotter: draws plan.ticks if it is on the board, else waits for `plotplan send`."""

import os

import config
import pyb
from plotplan.plotter import Plotter
from plotplan.ports import Port

# Bytes of the UART's receive buffer.
ROOM = 512


def draw(name="plan.ticks"):
    """Draws a file. The arm stands in its home pose."""
    plotter = Plotter(config)
    plotter.motion.home()
    with open(name, "rb") as lines:
        plotter.run(plotter.file(lines, lambda line, answer: print(line, answer)))


def serve(baud=115_200):
    """Draws what `plotplan send --protocol ticks` sends. The arm stands in its home pose."""
    plotter = Plotter(config)
    plotter.motion.home()
    port = pyb.UART(2, baud, read_buf_len=ROOM + 1)
    plotter.run(plotter.serial(Port(port, ROOM)))


if __name__ == "__main__":
    if "plan.ticks" in os.listdir():
        draw()
    else:
        serve()
