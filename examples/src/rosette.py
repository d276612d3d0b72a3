"""rosette.svg: a guilloche rosette in three layers, one pen each, on a US letter sheet (millimetres).

Every curve is r(t) = a + b cos(n t + phase), drawn as cubic Bezier pieces that share position and slope with it.
Usage: python3 rosette.py > rosette.svg
"""
import math

WIDTH, HEIGHT, CENTRE = 215.9, 279.4, (107.95, 139.7)


def curve(mean, swing, lobes, phase, pieces):
    """A closed Bezier path through `pieces` points of the curve (cubic Hermite to Bezier: handles of a third of the slope)."""
    def at(t):
        r, dr = mean + swing * math.cos(lobes * t + phase), -lobes * swing * math.sin(lobes * t + phase)
        c, s = math.cos(t), math.sin(t)
        return (CENTRE[0] + r * c, CENTRE[1] + r * s), (dr * c - r * s, dr * s + r * c)

    h = 2 * math.pi / pieces / 3
    text = "M{:.3f},{:.3f}".format(*at(0)[0])
    for i in range(pieces):
        (x0, y0), (u0, v0) = at(2 * math.pi * i / pieces)
        (x1, y1), (u1, v1) = at(2 * math.pi * (i + 1) / pieces)
        text += f" C{x0 + h * u0:.3f},{y0 + h * v0:.3f} {x1 - h * u1:.3f},{y1 - h * v1:.3f} {x1:.3f},{y1:.3f}"
    return text + " Z"


layers = {
    1: [curve(73, 20, 12, 2 * math.pi * k / 4, 120) for k in range(4)] + [curve(98, 0, 0, 0, 8), curve(96, 0, 0, 0, 8)],
    2: [curve(42, 14, 9, 2 * math.pi * k / 5, 90) for k in range(5)],
    3: [curve(17, 9, 5, 2 * math.pi * k / 4, 50) for k in range(4)] + [curve(5, 0, 0, 0, 8)],
}
colours = {1: "#1b3a6b", 2: "#b3261e", 3: "#2e6b34"}

print(f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
      f' width="{WIDTH}mm" height="{HEIGHT}mm" viewBox="0 0 {WIDTH} {HEIGHT}">')
for pen, paths in layers.items():
    print(f'<g inkscape:groupmode="layer" inkscape:label="Pen {pen}" fill="none" stroke="{colours[pen]}" stroke-width="0.3">')
    for path in paths:
        print(f'<path d="{path}"/>')
    print("</g>")
print("</svg>")
