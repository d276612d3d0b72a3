"""toppra (Pham & Pham) on the planner's workload: as its users run it, and on plotplan's own path.

usage: toppra_side.py POINTS NODES   both in mm of belt; prints one tab-separated line per run:
name, nodes, CPU s, motion time s, worst acceleration in finite differences of 1 ms as a share of the limit, mm off
"""
import sys
import time

try:
    import numpy as np
    import toppra as ta
    import toppra.algorithm as algorithm
    import toppra.constraint as constraint
except ImportError as missing:
    print(missing, file=sys.stderr)
    sys.exit(3)

ta.setup_logging("ERROR")
V, A, PERIOD = 141.42, 1414.2, 1e-3
limits = [
    constraint.JointVelocityConstraint(np.array([[-V, V]] * 2)),
    constraint.JointAccelerationConstraint(np.array([[-A, A]] * 2)),
]


class Quadratic(ta.interpolator.AbstractGeometricPath):
    """q(s) by its value and both derivatives at the start of each stretch: exact for lines and parabolas."""

    def __init__(self, nodes):
        self.s, self.q = nodes[:, 0], [nodes[:, 1:3], nodes[:, 3:5], nodes[:, 5:7]]

    def __call__(self, at, order=0):
        at = np.asarray(at, dtype=float)
        k = np.clip(np.searchsorted(self.s, at, side="right") - 1, 0, len(self.s) - 2)
        d = (at - self.s[k])[..., None]
        q, q1, q2 = (table[k] for table in self.q)
        return (q + d * (q1 + 0.5 * d * q2), q1 + d * q2, q2)[order]

    @property
    def dof(self):
        return 2

    @property
    def path_interval(self):
        return np.array([self.s[0], self.s[-1]])

    @property
    def waypoints(self):
        return self.s, self.q[0]


def run(name, path, grid, off):
    instance = algorithm.TOPPRA(limits, path, gridpoints=grid)
    before = time.process_time()
    _, speed, _ = instance.compute_parameterization(0, 0)
    cpu = time.process_time() - before
    if speed is None or not np.isfinite(speed).all():
        print(name, len(grid), cpu, "nan", "nan", "nan", sep="\t")
        return
    steps = np.diff(grid)
    t = np.concatenate([[0], np.cumsum(2 * steps / (speed[1:] + speed[:-1]))])
    at = np.arange(0, t[-1], PERIOD)
    k = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(steps) - 1)
    u = (speed[k + 1] ** 2 - speed[k] ** 2) / (2 * steps[k])
    since = at - t[k]
    q = path(np.minimum(grid[k] + since * (speed[k] + 0.5 * u * since), grid[-1]))
    worst = np.abs(np.diff(q, 2, axis=0)).max() / PERIOD**2 / A
    print(name, len(grid), cpu, t[-1], worst, off(q), sep="\t")


points = np.loadtxt(sys.argv[1])
chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
way = np.concatenate([[0], np.cumsum(chords)])


def to_chords(p, start, chord):
    """Distances of the points p from chords."""
    to = p - start
    along = np.clip((to * chord).sum(-1) / (chord * chord).sum(-1), 0, 1)
    return np.linalg.norm(to - along[..., None] * chord, axis=-1)


def off_polyline(_):
    """Largest distance between the spline and the polyline, mm of pen: a = x + y, b = x - y stretch lengths by sqrt(2)."""
    inside = np.repeat(np.arange(len(chords)), 8)
    p = spline(way[inside] + np.tile(np.linspace(0, 1, 8, endpoint=False), len(chords)) * chords[inside])
    start, chord = points[:-1], np.diff(points, axis=0)
    own = to_chords(p, start[inside], chord[inside])
    worst = 0.0
    for k in np.argsort(-own):  # the distance to its own chord bounds the distance to all of them
        if own[k] <= worst:
            break
        worst = max(worst, to_chords(p[k], start, chord).min())
    return worst / np.sqrt(2)


spline = ta.SplineInterpolator(way, points)
run("cubic spline through the points", spline, np.linspace(0, way[-1], 40_001), off_polyline)
nodes = np.loadtxt(sys.argv[2])
run("plotplan's path, its nodes", Quadratic(nodes), nodes[:, 0].copy(), lambda q: 0.0)
