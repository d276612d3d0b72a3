//! Speed under motor speeds and accelerations: reachable sets, intervals cut finer where that gains time.
//!
//! Reachable-set method (Pham & Pham 2018, arXiv 1707.07239). Since (0, 0) is allowed everywhere and all conditions are
//! convex, the set of b from which the end can be reached is an interval [0, top] at every node. Backward sweep: `top`
//! at a node is the largest b for which some u fulfils the interval's conditions and leads into [0, top of the next node].
//! Forward sweep: the largest u at each node. Cost linear in the number of intervals.
//!
//! With one acceleration a interval, no motor stays at its limit throughout a interval on which its derivatives change. Where
//! motors idle for that reason, intervals are cut in two and the law is laid anew, a window of intervals at a time, until what
//! idling costs is below a share of the time that nobody will see.

use kinematics::Machine;

use super::constraints::IntervalConstraints;
use super::profile::{Profile, SpeedCap};
use crate::joint_path::{GridInterval, JointPath, PathGeometry};

/// How many of the path's own intervals are refined together: memory and cost follow it, and its ends are interval to the
/// speeds of the coarse law.
const WINDOW: usize = 256;

/// Cells are refined until idle motors cost no more than this share of the time...
const UNUSED_COST: f64 = 4e-4;

/// ... or until cutting them in two brings no more than this share.
const LEAST_GAIN: f64 = 1e-4;

/// A interval is not cut if its motors idle by less than this share of their limits.
const UNUSED: f64 = 2e-3;

/// Cells that take less than this share of the time between rows are not cut: nobody would see where in it motors idle.
const SHORTEST: f64 = 1.0 / 16.0;

/// How often intervals are cut in two.
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

/// With no more intervals than the path has, but for such as begin and end at rest.
#[cfg(feature = "unstable")]
pub(super) fn profile_without_refinement(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    let mut profile = Profile::new();
    let grid = Grid::of(machine, path, cap);
    grid.emit(&mut profile);
    profile.slowed(grid.limit_excess(machine).sqrt())
}

/// A interval with its conditions.
#[derive(Clone)]
struct ConstrainedInterval {
    interval: GridInterval,
    constraints: IntervalConstraints,
}

/// The fastest way over some intervals.
#[derive(Default)]
struct Grid {
    intervals: Vec<ConstrainedInterval>,
    /// The intervals' order along the path, as indices.
    order: Vec<usize>,
    /// b at every node.
    nodes: Vec<f64>,
}

impl Grid {
    /// Over all of a path, from rest to rest.
    fn of(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Self {
        let hold = |interval: &GridInterval| ConstrainedInterval {
            constraints: IntervalConstraints::new(machine, interval, cap),
            interval: *interval,
        };
        let mut grid = Self { intervals: path.intervals.iter().map(hold).collect(), ..Self::default() };
        grid.sweep(0.0, 0.0);
        grid
    }

    /// Finds b at every node of all intervals in a row: from `start`, or the largest b from which there is a way if that is
    /// less, to at most `end`.
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

    /// The node at which a window that is to end at `wanted` should: where the law is nearest to the largest speed, or on
    /// a straight way, so that nothing is lost by keeping to the coarse law there.
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

    /// Cuts the intervals as often as it pays.
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
            // The finer intervals' conditions are interval in more places, so in rare cases the speed given is too high for them.
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

    /// How often each interval that takes longer than `shortest` is to be cut in two because its motors idle; nothing if that
    /// costs next to no `time`.
    fn subdivisions(&self, time: f64, shortest: f64) -> Option<Vec<u32>> {
        let mut subdivisions = Vec::with_capacity(self.order.len());
        let (mut cost, mut near_zero_inertia) = (0.0, false);
        for (ConstrainedInterval { constraints, interval }, from, to) in self.solved_intervals() {
            let own_time = constraints.time(from, to);
            if own_time < shortest {
                subdivisions.push(0);
                continue;
            }
            // What the limits were lowered by for want of samples counts as idle too.
            let unused_capacity = constraints.unused_capacity(from, to) + interval.interpolation_error;
            // A motion with limits lower by a share takes longer by half of it.
            cost += 0.5 * unused_capacity * own_time;
            let is_near = constraints.is_near_zero_inertia_point(from, to);
            near_zero_inertia |= is_near;
            // Half the length, half the unused_capacity.
            let thresholds = [UNUSED, 3.0 * UNUSED, 6.0 * UNUSED];
            let count = thresholds.iter().filter(|threshold| unused_capacity > **threshold).count() as u32;
            subdivisions.push(count.max(u32::from(is_near)));
        }
        (!time.is_finite() || near_zero_inertia || cost > UNUSED_COST * time).then_some(subdivisions)
    }

    /// How many times its limit a motor's acceleration may be between the places where it was interval to it, at least 1.
    ///
    /// With m'' and b linear between them, `m' u + m'' b` is a parabola: its distance from a straight line is largest half
    /// way. That is a few millionths as a rule; the motion is made slower by as much.
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

/// b at every node: backward from where the end can still be reached, forward as fast as that allows.
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
