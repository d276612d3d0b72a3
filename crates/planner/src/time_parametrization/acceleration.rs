//! Time parametrization under speed and acceleration limits: controllable sets on an adaptive grid.
//!
//! Reachability analysis, TOPP-RA (Pham & Pham 2018, arXiv 1707.07239). Since (0, 0) is always
//! feasible and all constraints are convex, the set of b from which the end can be reached is an
//! interval [0, top] at every grid point. Backward pass: `top` is the largest b for which some u
//! satisfies the interval's constraints and leads into [0, top of the next point]. Forward pass:
//! the largest u at each point. The cost is linear in the number of intervals.
//!
//! With one acceleration per interval, no motor stays at its limit over an interval on which its
//! derivatives change. Where motors are below their limits for that reason, intervals are bisected
//! and both passes are repeated, on a window of intervals at a time, until the estimated loss is
//! negligible.

use kinematics::Machine;

use super::constraints::IntervalConstraints;
use super::profile::{Profile, SpeedCap};
use crate::joint_path::{GridInterval, JointPath, PathGeometry};

/// Number of the path's intervals that are refined together. Memory and cost are proportional to
/// it; the speeds at its ends are those of the coarse solution.
const WINDOW: usize = 256;

/// Refinement ends when unused capacity costs no more than this share of the duration,
const UNUSED_COST: f64 = 4e-4;

/// or when a round of bisections gains no more than this share.
const LEAST_GAIN: f64 = 1e-4;

/// An interval is not bisected if its unused capacity is below this share of the limits.
const UNUSED: f64 = 2e-3;

/// Intervals that take less than this share of the time between rows are not bisected: the effect
/// is invisible in the rows.
const SHORTEST: f64 = 1.0 / 16.0;

/// Largest number of refinement rounds.
const ROUNDS: usize = 8;

pub(super) fn profile(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    let coarse = Grid::of(machine, path, cap);
    let mut profile = Profile::new();
    let mut window = Grid::default();
    let (mut from, mut speed, mut slower) = (0, 0.0, 1.0_f64);
    while from < path.intervals.len() {
        let to = coarse.window_end(from + WINDOW);
        window.intervals.clear();
        window.intervals.extend_from_slice(&coarse.intervals[from..to]);
        window.sweep(speed, coarse.nodes[to]);
        window.refine(machine, &path.geometry, cap);
        speed = window.nodes[window.order.len()];
        slower = slower.max(window.limit_excess(machine).sqrt());
        window.emit(&mut profile);
        from = to;
    }
    profile.slowed(slower)
}

pub(super) fn rough_duration(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> f64 {
    Grid::of(machine, path, cap).time()
}

/// On the path's own grid. Only intervals that begin and end at rest are divided.
#[cfg(feature = "unstable")]
pub(super) fn profile_without_refinement(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    let mut profile = Profile::new();
    let grid = Grid::of(machine, path, cap);
    grid.emit(&mut profile);
    profile.slowed(grid.limit_excess(machine).sqrt())
}

/// An interval with its constraints.
#[derive(Clone)]
struct ConstrainedInterval {
    interval: GridInterval,
    constraints: IntervalConstraints,
}

/// The fastest motion over a sequence of intervals.
#[derive(Default)]
struct Grid {
    intervals: Vec<ConstrainedInterval>,
    /// The order of the intervals along the path, as indices.
    order: Vec<usize>,
    /// b at every grid point.
    nodes: Vec<f64>,
}

impl Grid {
    /// Over a whole path, from rest to rest.
    fn of(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Self {
        let hold = |interval: &GridInterval| ConstrainedInterval {
            constraints: IntervalConstraints::new(machine, interval, cap),
            interval: *interval,
        };
        let mut grid = Self { intervals: path.intervals.iter().map(hold).collect(), ..Self::default() };
        grid.sweep(0.0, 0.0);
        grid
    }

    /// Computes b at every grid point for all intervals in sequence: from `start`, or the largest
    /// feasible b if that is less, to at most `end`.
    fn sweep(&mut self, start: f64, end: f64) {
        self.order.clear();
        self.order.extend(0..self.intervals.len());
        sweeps(&self.intervals, &self.order, start, end, &mut self.nodes);
    }

    /// Every interval with b at its start and end.
    fn solved_intervals(&self) -> impl Iterator<Item = (&ConstrainedInterval, f64, f64)> {
        let intervals = self.order.iter().map(|index| &self.intervals[*index]);
        intervals.zip(self.nodes.windows(2)).map(|(interval, b)| (interval, b[0], b[1]))
    }

    fn time(&self) -> f64 {
        self.solved_intervals().map(|(interval, from, to)| interval.constraints.time(from, to)).sum()
    }

    /// The grid point near `wanted` at which to end a window: where the speed is closest to its
    /// cap, or on a line, so that keeping the coarse solution's speed there costs nothing.
    fn window_end(&self, wanted: usize) -> usize {
        if wanted + WINDOW / 4 >= self.intervals.len() {
            return self.intervals.len();
        }
        let headroom = |k: usize| {
            let (before, after) = (&self.intervals[k - 1], &self.intervals[k]);
            let straight = before.interval.is_straight() && after.interval.is_straight();
            if straight { 2.0 } else { self.nodes[k] / before.constraints.cap.min(after.constraints.cap) }
        };
        let best = (wanted..wanted + WINDOW / 4).fold((wanted, 0.0), |best, k| {
            let headroom = headroom(k);
            if headroom > best.1 { (k, headroom) } else { best }
        });
        best.0
    }

    /// Bisects intervals while that gains enough.
    fn refine(&mut self, machine: &Machine, geometry: &PathGeometry, cap: &SpeedCap) {
        let (start, end) = (self.nodes[0], self.nodes[self.order.len()]);
        let mut time = self.time();
        let (mut order, mut nodes, mut finer) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..ROUNDS {
            let Some(subdivisions) = self.subdivisions(time, SHORTEST * cap.period_s) else { break };
            order.clear();
            for (index, subdivisions) in self.order.iter().zip(subdivisions) {
                finer.clear();
                self.intervals[*index].interval.subdivide(machine, geometry, subdivisions, &mut finer);
                if finer.len() > 1 {
                    order.extend(self.intervals.len()..self.intervals.len() + finer.len());
                    let hold = |interval: &GridInterval| ConstrainedInterval {
                        constraints: IntervalConstraints::new(machine, interval, cap),
                        interval: *interval,
                    };
                    self.intervals.extend(finer.iter().map(hold));
                } else {
                    order.push(*index);
                }
            }
            sweeps(&self.intervals, &order, start, end, &mut nodes);
            // The constraints of the finer intervals hold at more points, so in rare cases the
            // given start speed is infeasible for them.
            if order.len() == self.order.len() || nodes[0] < start {
                break;
            }
            std::mem::swap(&mut self.order, &mut order);
            std::mem::swap(&mut self.nodes, &mut nodes);
            let before = std::mem::replace(&mut time, self.time());
            if before.is_finite() && before - time < LEAST_GAIN * before {
                break;
            }
        }
    }

    /// How often to bisect each interval that takes longer than `shortest`; `None` if the loss is
    /// negligible.
    fn subdivisions(&self, time: f64, shortest: f64) -> Option<Vec<u32>> {
        let mut subdivisions = Vec::with_capacity(self.order.len());
        let (mut cost, mut near_zero_inertia) = (0.0, false);
        for (ConstrainedInterval { constraints, interval }, from, to) in self.solved_intervals() {
            let own_time = constraints.time(from, to);
            if own_time < shortest {
                subdivisions.push(0);
                continue;
            }
            // Limits lowered by the interpolation error count as unused capacity too.
            let unused_capacity = constraints.unused_capacity(from, to) + interval.interpolation_error;
            // Lowering all limits by a small share lengthens the motion by half of that share.
            cost += 0.5 * unused_capacity * own_time;
            let is_near = constraints.is_near_zero_inertia_point(from, to);
            near_zero_inertia |= is_near;
            // Half the length, half the unused capacity.
            let thresholds = [UNUSED, 3.0 * UNUSED, 6.0 * UNUSED];
            let count = thresholds.iter().filter(|threshold| unused_capacity > **threshold).count() as u32;
            subdivisions.push(count.max(u32::from(is_near)));
        }
        (!time.is_finite() || near_zero_inertia || cost > UNUSED_COST * time).then_some(subdivisions)
    }

    /// The largest ratio of a motor's acceleration to its limit between the points where the limit
    /// was enforced, at least 1.
    ///
    /// With m'' and b linear between them, `m' u + m'' b` is a parabola, whose deviation from a
    /// line is largest in the middle. The excess is typically some millionths; the motion is slowed
    /// down to compensate.
    fn limit_excess(&self, machine: &Machine) -> f64 {
        let mut excess = 1.0_f64;
        for (ConstrainedInterval { interval, .. }, from, to) in self.solved_intervals() {
            let u = 0.5 * (to - from) / interval.length;
            for (half, share) in [0.25, 0.75].into_iter().enumerate() {
                let b = from + share * (to - from);
                let first = 0.5 * (interval.first[half] + interval.first[half + 1]);
                let second = 0.5 * (interval.second[half] + interval.second[half + 1]);
                for (k, motor) in machine.motors().iter().enumerate() {
                    let acceleration = (first[k] * u + second[k] * b).abs();
                    excess = excess.max(
                        acceleration * (1.0 + interval.interpolation_error) / motor.max_acceleration_ticks_s2,
                    );
                }
            }
        }
        excess
    }

    fn emit(&self, profile: &mut Profile) {
        for (interval, from, to) in self.solved_intervals() {
            interval.constraints.phases(&interval.interval, from, to, profile);
        }
    }
}

/// b at every grid point: a backward pass for the controllable sets, a forward pass for the largest
/// speeds in them.
fn sweeps(intervals: &[ConstrainedInterval], order: &[usize], start: f64, end: f64, nodes: &mut Vec<f64>) {
    nodes.clear();
    nodes.resize(order.len() + 1, end);
    for (k, index) in order.iter().enumerate().rev() {
        let constraints = &intervals[*index].constraints;
        let before = if k > 0 { intervals[order[k - 1]].constraints.cap } else { start };
        nodes[k] = constraints.largest_start(nodes[k + 1]).min(before);
    }
    for (k, index) in order.iter().enumerate() {
        nodes[k + 1] = intervals[*index].constraints.largest_end(nodes[k], nodes[k + 1]);
    }
}
