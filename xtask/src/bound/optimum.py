"""The fastest motion of a pen within a tolerance of polylines, by direct transcription.

Reads problems as JSON from the file named by the first argument and prints one line for each:
machine, stroke, build-up in ms (0 without a jerk limit), seconds, largest distance from the
polyline in mm, status of the solver, nodes. Needs casadi and numpy.

Unknowns are position, speed and acceleration of both motors at the nodes, the jerk (without a jerk
limit the acceleration) between them, and one duration of a step for each line of the stroke. The
pen stays within the tolerance of the line at nodes and half way between them, and passes each
vertex within the tolerance. ipopt finds a local optimum: an upper bound on the optimum. It starts
from a plan (a point of the pen every millisecond, `plan_mm`) and from the centre line, and the faster
result counts.
"""

import json
import math
import sys

import casadi as ca
import numpy as np

# Nodes of a stroke, and the least number of a line.
NODES, LEAST = 140, 3
# Speeds of guesses along the centre line, mm/s: the next one where ipopt gets stuck.
GUESSES = 8.0, 4.0, 16.0
# Seconds of CPU for one solution.
PATIENCE = 120.0


class Motors:
    """Motor coordinates in a unit in which each motor's speed limit is 100: near mm."""

    def __init__(self, machine):
        self.links = machine["links_mm"]
        self.elbow = machine["elbow"]
        self.coupling = np.array(machine["coupling"])
        self.inverse = np.linalg.inv(self.coupling)
        self.unit = np.array(machine["speeds"]) / 100.0
        self.speed = 100.0
        self.acceleration = np.array(machine["accelerations"]) / self.unit
        self.pen_mm_s = machine["pen_mm_s"]

    def pen(self, m):
        """The point at motor coordinates, symbolic."""
        q = ca.mtimes(ca.DM(self.inverse), m * ca.DM(self.unit))
        if self.links is None:
            return q
        (a, b) = self.links
        return ca.vertcat(a * ca.cos(q[0]) + b * ca.cos(q[1]), a * ca.sin(q[0]) + b * ca.sin(q[1]))

    def at(self, p):
        """Motor coordinates of a point."""
        if self.links is None:
            q = np.array(p)
        else:
            (a, b) = self.links
            bend = self.elbow * math.acos((p @ p - a * a - b * b) / (2 * a * b))
            first = math.atan2(p[1], p[0]) - math.atan2(b * math.sin(bend), a + b * math.cos(bend))
            q = np.array([first, first + bend])
        return self.coupling @ q / self.unit


def gentle_guess(motors, points, counts, speed, jerky):
    """Along the lines at one speed."""
    lines = np.diff(points, axis=0)
    lengths = np.hypot(lines[:, 0], lines[:, 1])
    total = sum(counts)
    m, v = np.zeros((2, total + 1)), np.zeros((2, total + 1))
    i = 0
    for k, count in enumerate(counts):
        for share in np.arange(count) / count:
            p = points[k] + lines[k] * share
            m[:, i] = motors.at(p)
            v[:, i] = (motors.at(p + 1e-4 * lines[k] / lengths[k]) - m[:, i]) / 1e-4 * speed
            i += 1
    m[:, total] = motors.at(points[-1])
    v[:, 0] = 0.0
    a = np.zeros((2, total + 1 if jerky else total))
    j = np.zeros((2, total if jerky else 0))
    return m, v, a, j, np.maximum(lengths / speed / counts, 1e-4)


def plan_guess(motors, points, counts, plan, jerky):
    """Along a plan."""
    path = np.array([motors.at(p) for p in plan]).T
    # The rows nearest to the vertices, in order: least sum of squares by dynamic programming.
    rows = len(plan)
    square = ((plan[None, :, :] - points[:, None, :]) ** 2).sum(axis=2)
    best, choices = np.full(rows, np.inf), []
    best[0] = 0.0
    for k in range(1, len(points)):
        # The least before each row, and where it is.
        least = np.minimum.accumulate(best)
        where = np.maximum.accumulate(np.where(best == least, np.arange(rows), 0))
        best = square[k] + np.concatenate([[np.inf], least[:-1]])
        choices.append(np.concatenate([[0], where[:-1]]))
    at = [rows - 1]
    for where in reversed(choices):
        at.append(int(where[at[-1]]))
    at = np.array(at[::-1], dtype=float)
    steps = 1e-3 * np.maximum(np.diff(at), 0.2) / counts
    nodes = np.concatenate([at[k] + np.diff(at)[k] * np.arange(n) / n for k, n in enumerate(counts)] + [at[-1:]])
    sampled = lambda of, t: np.array([np.interp(t, np.arange(rows), values) for values in of])
    speed = np.gradient(path, 1e-3, axis=1)
    acceleration = np.gradient(speed, 1e-3, axis=1)
    v = sampled(speed, nodes)
    v[:, [0, -1]] = 0.0
    a = sampled(acceleration, nodes if jerky else 0.5 * (nodes[1:] + nodes[:-1]))
    a = np.clip(a, -0.99 * motors.acceleration[:, None], 0.99 * motors.acceleration[:, None])
    j = np.diff(a, axis=1) / np.repeat(steps, counts) if jerky else np.zeros((2, 0))
    return sampled(path, nodes), v, a, j, steps


def solve(motors, points, tolerance, build_up, start):
    lines = np.diff(points, axis=0)
    lengths = np.hypot(lines[:, 0], lines[:, 1])
    counts = [max(LEAST, math.ceil(NODES * length / lengths.sum())) for length in lengths]
    total, jerky = sum(counts), build_up > 0
    m, v = ca.MX.sym("m", 2, total + 1), ca.MX.sym("v", 2, total + 1)
    a = ca.MX.sym("a", 2, total + 1 if jerky else total)
    j = ca.MX.sym("j", 2, total if jerky else 0)
    steps = ca.MX.sym("T", len(counts))
    first = np.concatenate([[0], np.cumsum(counts)])
    line_of = np.repeat(np.arange(len(counts)), counts)
    direction = lines / lengths[:, None]
    constraints, low, high = [], [], []

    def hold(value, least, most):
        value = ca.vec(value)
        constraints.append(value)
        low.extend([least] * value.shape[0])
        high.extend([most] * value.shape[0])

    # One step, as a function that is mapped over all of them.
    s = ca.SX.sym
    m0, v0, a0, j0, dt = s("m", 2), s("v", 2), s("a", 2), s("j", 2), s("dt")
    origin, along = s("o", 2), s("d", 2)
    across = ca.vertcat(-along[1], along[0])
    half = m0 + v0 * dt / 2 + a0 * dt**2 / 8 + (j0 * dt**3 / 48 if jerky else 0)
    end = [m0 + v0 * dt + a0 * dt**2 / 2 + (j0 * dt**3 / 6 if jerky else 0)]
    end += [v0 + a0 * dt + (j0 * dt**2 / 2 if jerky else 0)]
    end += [a0 + j0 * dt] if jerky else []
    places = [motors.pen(m0) - origin, motors.pen(half) - origin]
    band = ca.vertcat(*[ca.dot(across, p) / tolerance for p in places])
    reach = ca.vertcat(*[ca.dot(along, p) for p in places])
    pen_speed = ca.jtimes(motors.pen(m0), m0, v0)
    names = [m0, v0, a0, j0, dt, origin, along]
    step = ca.Function("step", names, [ca.vertcat(*end), band, reach, ca.sumsqr(pen_speed)])
    each = steps[line_of.tolist()].T
    inputs = [m[:, :total], v[:, :total], a[:, :total], j if jerky else ca.DM.zeros(2, total), each]
    inputs += [ca.DM(points[line_of].T), ca.DM(direction[line_of].T)]
    ends, band, reach, square_speed = step.map(total)(*inputs)

    hold(m[:, 1:] - ends[0:2, :], 0, 0)
    hold(v[:, 1:] - ends[2:4, :], 0, 0)
    if jerky:
        hold(a[:, 1:] - ends[4:6, :], 0, 0)
        hold(j / ca.repmat(ca.DM(motors.acceleration / build_up), 1, total), -1, 1)
    hold(a / ca.repmat(ca.DM(motors.acceleration), 1, a.shape[1]), -1, 1)
    hold(v / motors.speed, -1, 1)
    hold(square_speed / motors.pen_mm_s**2, -1, 1)
    hold(band, -1, 1)
    for k in range(len(counts)):
        hold(reach[:, int(first[k]) : int(first[k + 1])], -tolerance, lengths[k] + tolerance)
        p = motors.pen(m[:, int(first[k + 1])])
        hold(ca.dot(ca.DM([-direction[k][1], direction[k][0]]), p - ca.DM(points[k])) / tolerance, -1, 1)
        if k + 1 < len(counts):
            hold(ca.sumsqr(p - ca.DM(points[k + 1])) / tolerance**2, 0, 1)
    for end, at in ((0, points[0]), (total, points[-1])):
        hold(m[:, end] - ca.DM(motors.at(at)), 0, 0)
        hold(v[:, end], 0, 0)
        if jerky:
            hold(a[:, end], 0, 0)

    unknowns = ca.vertcat(ca.vec(m), ca.vec(v), ca.vec(a), ca.vec(j), steps)
    is_plan = not np.isscalar(start)
    guess = (plan_guess if is_plan else gentle_guess)(motors, points, counts, start, jerky)
    guess = np.concatenate([part.T.ravel() for part in guess])
    lowest = np.full(len(guess), -np.inf)
    lowest[-len(counts) :] = 1e-6
    time = sum(count * steps[k] for k, count in enumerate(counts))
    options = {"ipopt.print_level": 0, "print_time": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-6}
    options |= {"ipopt.max_iter": 3000, "ipopt.max_cpu_time": PATIENCE}
    if is_plan:
        options |= {"ipopt.mu_init": 1e-3, "ipopt.bound_push": 1e-4, "ipopt.bound_frac": 1e-4}
    problem = {"x": unknowns, "f": time, "g": ca.vertcat(*constraints)}
    solver = ca.nlpsol("solver", "ipopt", problem, options)
    found = solver(x0=guess, lbx=lowest, lbg=low, ubg=high)
    # The pen's path, at six places a step.
    path = ca.Function("path", names, [motors.pen(m0 + v0 * dt + a0 * dt**2 / 2 + j0 * dt**3 / 6)])
    values = ca.Function("inputs", [unknowns], inputs)(found["x"])
    pen = [path.map(total)(*values[:4], share * values[4], *values[5:]).full().T for share in np.arange(6) / 6]
    off = distance(np.vstack([*pen, points[-1:]]), points)
    return float(found["f"]), off, solver.stats()["return_status"], total


def distance(path, points):
    """The largest distance of some points from a polyline."""
    least = np.full(len(path), np.inf)
    for a, b in zip(points[:-1], points[1:]):
        share = np.clip((path - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        least = np.minimum(least, np.linalg.norm(path - a - share[:, None] * (b - a), axis=1))
    return least.max()


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        problems = json.load(file)
    for problem in problems:
        points = np.array(problem["points_mm"])
        motors = Motors(problem["machine"])
        ms = problem["build_up_ms"]
        found = []
        for start in (np.array(problem["plan_mm"]), *GUESSES):
            found.append(solve(motors, points, problem["tolerance_mm"], 1e-3 * ms, start))
            print(problem["stroke"], ms, *found[-1], file=sys.stderr, flush=True)
            solved = [f for f in found if f[2] == "Solve_Succeeded"]
            # From the plan, and once from the centre line.
            if len(found) >= 2 and solved:
                break
        seconds, off, status, nodes = min(solved or found)
        fields = (problem["machine"]["name"], problem["stroke"], ms, f"{seconds:.5f}", f"{off:.4f}", status, nodes)
        print(*fields, sep="\t", flush=True)


main()
