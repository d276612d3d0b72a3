//! Controllable sets on the path's own grid: the fallback where `arcs` finds no solution.
//!
//! Reachability analysis, TOPP-RA (Pham & Pham 2018, arXiv 1707.07239). Since (0, 0) is always
//! feasible and all constraints are convex, the set of b from which the end can be reached is an
//! interval [0, top] at every grid point. Backward pass: `top` is the largest b for which some u
//! satisfies the interval's constraints and leads into [0, top of the next point]. Forward pass:
//! the largest u at each point. The cost is linear in the number of intervals. With one
//! acceleration per interval no motor stays at its limit over an interval on which its derivatives
//! change, so the result is some per cent slower than the optimum.

use kinematics::Machine;

use super::constraints::IntervalConstraints;
use super::profile::{Profile, SpeedCap};
use crate::joint_path::{GridInterval, JointPath};

/// The profile on the path's grid. Only intervals that begin and end at rest are divided.
pub(super) fn profile(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    let grid = Grid::of(machine, path, cap);
    let mut profile = Profile::new();
    grid.emit(&mut profile);
    profile.slowed(grid.limit_excess(machine).sqrt())
}

/// The fastest motion over a sequence of intervals, from rest to rest.
struct Grid {
    intervals: Vec<(GridInterval, IntervalConstraints)>,
    /// b at every grid point.
    nodes: Vec<f64>,
}

impl Grid {
    fn of(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Self {
        let hold = |interval: &GridInterval| (*interval, IntervalConstraints::new(machine, interval, cap));
        let intervals: Vec<_> = path.intervals.iter().map(hold).collect();
        let mut nodes = vec![0.0; intervals.len() + 1];
        for (k, (_, constraints)) in intervals.iter().enumerate().rev() {
            let before = if k > 0 { intervals[k - 1].1.cap } else { 0.0 };
            nodes[k] = constraints.largest_start(nodes[k + 1]).min(before);
        }
        for (k, (_, constraints)) in intervals.iter().enumerate() {
            nodes[k + 1] = constraints.largest_end(nodes[k], nodes[k + 1]);
        }
        Self { intervals, nodes }
    }

    /// Every interval with b at its start and end.
    fn solved_intervals(&self) -> impl Iterator<Item = (&GridInterval, &IntervalConstraints, f64, f64)> {
        self.intervals
            .iter()
            .zip(self.nodes.windows(2))
            .map(|((i, constraints), b)| (i, constraints, b[0], b[1]))
    }

    /// The largest ratio of a motor's acceleration to its limit between the points where the limit
    /// was enforced, at least 1.
    ///
    /// With m'' and b linear between them, `m' u + m'' b` is a parabola, whose deviation from a
    /// line is largest in the middle. The excess is typically some millionths; the motion is slowed
    /// down to compensate.
    fn limit_excess(&self, machine: &Machine) -> f64 {
        let mut excess = 1.0_f64;
        for (interval, _, from, to) in self.solved_intervals() {
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
        for (interval, constraints, from, to) in self.solved_intervals() {
            constraints.phases(interval, from, to, profile);
        }
    }
}
