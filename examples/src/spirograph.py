"""Points of four hypotrochoids for GNU graph: x y per line, a blank line between curves.

A wheel of `wheel` teeth rolls inside a ring of `ring`; the pen's hole is at `hole` wheel radii from the wheel's centre:
    x = (R - r) cos t + h r cos((R - r) t / r),   y = (R - r) sin t - h r sin((R - r) t / r),   t up to 2 pi r / gcd(R, r).
Usage: python3 spirograph.py | HPGL_VERSION=2 graph -T hpgl (options in ../../tests/drawings/README.md)
"""
import math

for ring, wheel, hole, points in (96, 52, 0.95, 900), (96, 80, 0.6, 300), (96, 30, 0.5, 360), (96, 56, 0.3, 420):
    turns = wheel // math.gcd(ring, wheel)
    for i in range(points + 1):
        t = 2 * math.pi * turns * i / points
        rolled = (ring - wheel) / wheel * t
        x = (ring - wheel) * math.cos(t) + hole * wheel * math.cos(rolled)
        y = (ring - wheel) * math.sin(t) - hole * wheel * math.sin(rolled)
        print(f"{x:.3f} {y:.3f}")
    print()
