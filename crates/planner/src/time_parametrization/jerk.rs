//! Time parametrization under speed, acceleration and jerk limits.
//!
//! With `b = (ds/dt)²`, `c = db/ds` and `w = d²b/ds²` a motor with position m(s) has
//!
//! ```text
//! acceleration  |½ m' c + m'' b|                          <= a
//! jerk          |½ m' w + 3/2 m'' c + m''' b|  √b         <= j
//! ```
//! `w` is constant on an interval, so b is a parabola and the motion is `d²s/dt² = c/2 + w s/2`.
//! From rest `b` grows as `s^(4/3)`, faster than any parabola: the first interval of a path has
//! constant jerk in time instead, which leads to a point on the ray `c = 4 b / (3 length)`, and the
//! last one likewise. The speeds start gentle and are optimized by a method that stays feasible
//! (`barrier`).
//!
//! Between the points where they are enforced, limits may be exceeded slightly. The excess is
//! measured at more points, and the motion is slowed down to compensate.

use drawing::Segment;
use kinematics::{JointPos, Machine, MotorPos};

use super::barrier::{Constraints, JERK_OF_REST, NEXT_WEIGHT, PointConstraints, Problem, SWEEPS, State};
use super::profile::{Phase, Profile, SpeedCap};
use super::straight;
use crate::joint_path::{JointPath, PathDerivatives, PathGeometry, third_derivative};
use crate::path::Piece;

/// Largest number of passes: each one lowers the limits where the one before exceeded them.
const PASSES: usize = 3;

/// Where limits are exceeded by more than this factor between the points where they are enforced,
/// the next pass uses stricter limits.
const EXCESS: f64 = 1.002;

/// Whether any motor has a jerk limit.
pub(super) fn applies(machine: &Machine) -> bool {
    machine.motors().iter().any(|motor| motor.max_jerk_ticks_s3.is_some())
}

/// The profile along a path.
pub(super) fn profile(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    match &path.geometry {
        PathGeometry::Travel(..) => {
            straight::profile(machine, path.intervals[0].first[0], cap.pen_mm_s / path.intervals[0].pen_speed)
        }
        PathGeometry::Drawn(_, section) => {
            let fastest = super::without_jerk(machine, path, cap);
            let intervals = intervals(machine, path, section, cap, &fastest);
            let found = intervals.and_then(|intervals| optimize(machine, section, &intervals));
            found.unwrap_or_else(|| slowed_until_smooth(machine, fastest, cap))
        }
    }
}

/// The fastest profile over some intervals, by passes with limits lowered where they were exceeded
/// between the points where they are enforced; `None` if no start is feasible.
fn optimize(machine: &Machine, section: &[Piece], intervals: &[JerkInterval]) -> Option<Profile> {
    let mut constraints: Vec<Constraints> =
        intervals.iter().map(|interval| interval.constraints.clone()).collect();
    let mut z: Vec<f64> = intervals.iter().map(|interval| interval.gentle).collect();
    if z.len() < 3 {
        return None;
    }
    z.remove(0);
    z.pop();
    let mut best: Option<Profile> = None;
    let (mut weight, mut sweeps) = (FIRST_WEIGHT, SWEEPS);
    for _ in 0..PASSES {
        let problem = Problem::new(&constraints)?;
        let Some(mut start) = problem.feasible(&z) else { break };
        problem.minimize(&mut start, weight, sweeps);
        let states = problem.states(&start);
        z = start;
        let (found, excess) = build_profile(machine, section, intervals, &states);
        if !found.duration_s.is_finite() {
            break;
        }
        if best.as_ref().is_none_or(|best| found.duration_s < best.duration_s) {
            best = Some(found);
        }
        if excess.iter().all(|excess| *excess == (1.0, 1.0)) {
            break;
        }
        for (constraints, excess) in constraints.iter_mut().zip(excess) {
            tighten(constraints, excess);
        }
        (weight, sweeps) = (NEXT_WEIGHT, 1);
    }
    best
}

/// The first weight of the barrier, as a share of the duration.
const FIRST_WEIGHT: f64 = 0.5;

impl PointConstraints {
    fn at(machine: &Machine, piece: &Piece, s: f64) -> Option<Self> {
        let t = (s * piece.rate).clamp(0.0, 1.0);
        let pose: JointPos = machine.mechanism().inverse(piece.curve.eval(t)).ok()?;
        let PathDerivatives { first: m1, second: m2, pen_speed, second_derivative_bound, .. } =
            PathDerivatives::of(machine, piece, t, &pose);
        let m3 = third_derivative(machine, piece, t, &pose);
        let motors = machine.motors();
        let of = |k: usize, m: &MotorPos, limit: f64| m[k] / limit;
        let jerk = |k: usize| motors[k].max_jerk_ticks_s3.unwrap_or(f64::INFINITY);
        Some(Self {
            speed: [0, 1].map(|k| of(k, &m1, motors[k].max_speed_ticks_s)),
            acceleration: [0, 1].map(|k| [&m1, &m2].map(|m| of(k, m, motors[k].max_acceleration_ticks_s2))),
            jerk: [0, 1].map(|k| [&m1, &m2, &m3].map(|m| of(k, m, jerk(k)))),
            pen_speed,
            second_derivative_bound,
        })
    }

    /// The largest b under the speed limits and the row deviation.
    fn cap(&self, cap: &SpeedCap) -> f64 {
        let rows = 8.0 * cap.row_deviation_mm / (cap.period_s * cap.period_s);
        let speed =
            (cap.pen_mm_s / self.pen_speed).min(1.0 / self.speed[0].abs()).min(1.0 / self.speed[1].abs());
        (speed * speed).min(rows / self.second_derivative_bound)
    }
}

/// A part of a path with constant w.
#[derive(Clone, Debug)]
struct JerkInterval {
    piece: usize,
    start: f64,
    constraints: Constraints,
    /// A b that is gentle here, see [`set_gentle_speeds`].
    gentle: f64,
}

/// Lowers the limits where they were exceeded.
fn tighten(constraints: &mut Constraints, excess: (f64, f64)) {
    let stricter = |allowed: f64, excess: f64| {
        if excess > 1.0 { (allowed / excess).max(0.5 * allowed) } else { allowed }
    };
    let allowed = constraints.allowed;
    constraints.allowed = (stricter(allowed.0, excess.0), stricter(allowed.1, excess.1));
}

/// b and c at a distance from a state.
fn state_after(from: State, w: f64, s: f64) -> State {
    [from[0] + s * (from[1] + 0.5 * s * w), from[1] + s * w]
}

/// Divides the path into intervals short enough for constant w: in time, a fifth of what a motor
/// needs to build up its acceleration, and shorter towards rest. Returns `None` if a point has no
/// pose, which `JointPath::from_section` has excluded.
fn intervals(
    machine: &Machine,
    path: &JointPath,
    section: &[Piece],
    cap: &SpeedCap,
    fastest: &Profile,
) -> Option<Vec<JerkInterval>> {
    let rows = 8.0 * cap.row_deviation_mm / (cap.period_s * cap.period_s);
    let build_up = machine
        .motors()
        .iter()
        .filter_map(|motor| motor.max_jerk_ticks_s3.map(|jerk| motor.max_acceleration_ticks_s2 / jerk));
    let build_up = build_up.fold(0.0, f64::max);
    let total: f64 = path.intervals.iter().map(|interval| interval.length).sum();
    let mut speeds = SquaredSpeeds { phases: &fastest.phases, at: 0 };
    let mut intervals = Vec::new();
    let mut done = 0.0;
    for interval in &path.intervals {
        let piece = &section[interval.piece];
        let acceleration = machine
            .motors()
            .iter()
            .enumerate()
            .map(|(k, motor)| motor.max_acceleration_ticks_s2 / interval.first[1][k].abs());
        let ramp = 0.02 * acceleration.fold(f64::INFINITY, f64::min) * build_up * build_up;
        let longest = interval.length / if matches!(piece.curve, Segment::Line(_)) { 1.0 } else { 2.0 };
        let mut at = 0.0;
        while let Some(left) = remaining_length(interval.length, at) {
            let s = done + at;
            let to_rest = s.min(total - s);
            let speed = speeds.square(interval.piece, interval.start + at).sqrt();
            let wanted = (0.2 * speed * build_up)
                .max(ramp)
                .min(0.25 * (to_rest + 4.0 * ramp))
                .min(0.1 * total)
                .min(longest);
            // The last steps towards rest are as short as the first ones from rest.
            let wanted = wanted.min(0.25 * (total - s).max(0.0) + ramp).max(1e-6 * total);
            let length = if left < 1.5 * wanted { left } else { wanted };
            let start = interval.start + at;
            let point = |share: f64| PointConstraints::at(machine, piece, start + share * length);
            let points = [point(0.0)?, point(0.5)?, point(1.0)?];
            let top = points.iter().map(|point| point.cap(cap)).fold(f64::INFINITY, f64::min);
            let row_limit = if interval.near_corner { rows } else { f64::INFINITY };
            let constraints = Constraints { length, points, cap: top, row_limit, allowed: (1.0, 1.0) };
            intervals.push(JerkInterval { piece: interval.piece, start, constraints, gentle: 0.0 });
            at += length;
        }
        done += interval.length;
    }
    set_gentle_speeds(&mut intervals);
    Some(intervals)
}

/// What is left of a length; `None` if it is rounding error, on which no profile exists.
fn remaining_length(length: f64, at: f64) -> Option<f64> {
    let left = length - at;
    (left > 1e-9 * length).then_some(left)
}

/// Sets gentle speeds, from which the optimization starts: no corner uses more than a share of the
/// limits, and accelerating and braking use no more acceleration than can be released while the
/// speed changes by half.
fn set_gentle_speeds(intervals: &mut [JerkInterval]) {
    let total: f64 = intervals.iter().map(|interval| interval.constraints.length).sum();
    let mut at = 0.0_f64;
    for interval in intervals.iter_mut() {
        let Constraints { length, points, cap, .. } = &interval.constraints;
        let largest = |of: &dyn Fn(&PointConstraints) -> f64| points.iter().map(of).fold(0.0, f64::max);
        let turn = largest(&|point| point.jerk[0][2].abs().max(point.jerk[1][2].abs()));
        let ramp = largest(&|point| point.jerk[0][0].abs().max(point.jerk[1][0].abs()));
        let curvature = largest(&|point| point.acceleration[0][1].abs().max(point.acceleration[1][1].abs()));
        // By JERK_OF_REST: √b³ = j s² / (2/9).
        let rest = at.min(total - at).max(0.0);
        let square = |x: f64| libm::cbrt(x * x);
        interval.gentle = square(rest * rest / (JERK_OF_REST * ramp))
            .min(square(0.5 / turn))
            .min(0.5 / curvature)
            .min(*cap)
            .max(1e-12);
        at += length;
    }
    let step = |interval: &JerkInterval, b: f64| {
        let Constraints { length, points, .. } = &interval.constraints;
        let point = &points[1];
        let jerk = 1.0 / point.jerk[0][0].abs().max(point.jerk[1][0].abs());
        let acceleration = 1.0 / point.acceleration[0][0].abs().max(point.acceleration[1][0].abs());
        b + length * acceleration.min((jerk * b.sqrt()).sqrt())
    };
    for k in 1..intervals.len() {
        let before = intervals[k - 1].gentle.max(1e-9 * intervals[k].constraints.cap);
        intervals[k].gentle = intervals[k].gentle.min(step(&intervals[k - 1], before));
    }
    for k in (1..intervals.len()).rev() {
        intervals[k - 1].gentle = intervals[k - 1].gentle.min(step(&intervals[k - 1], intervals[k].gentle));
    }
}

/// (ds/dt)² along a profile, queried in order.
struct SquaredSpeeds<'a> {
    phases: &'a [Phase],
    at: usize,
}

impl SquaredSpeeds<'_> {
    fn square(&mut self, piece: usize, s: f64) -> f64 {
        let before = |phase: &Phase| {
            phase.piece < piece || (phase.piece == piece && phase.position_at(phase.duration_s) < s)
        };
        while self.at + 1 < self.phases.len() && before(&self.phases[self.at]) {
            self.at += 1;
        }
        let phase = &self.phases[self.at];
        // Even in between, as with constant acceleration.
        let (end, last, _) = phase.motion_at(phase.duration_s);
        let share =
            if phase.piece > piece { 0.0 } else { ((s - phase.start) / (end - phase.start)).clamp(0.0, 1.0) };
        let square = phase.speed * phase.speed;
        square + share * (last * last - square)
    }
}

/// The phases through the states, slowed down until the limits hold between the enforced points
/// too; and by how much each interval exceeded its limits on acceleration and jerk.
fn build_profile(
    machine: &Machine,
    section: &[Piece],
    intervals: &[JerkInterval],
    states: &[State],
) -> (Profile, Vec<(f64, f64)>) {
    let mut profile = Profile::new();
    let mut excesses = Vec::with_capacity(intervals.len());
    let mut slower = 1.0_f64;
    for (k, (interval, state)) in intervals.iter().zip(states.windows(2)).enumerate() {
        let (from, to) = (state[0], state[1]);
        let Constraints { length: h, points, cap, .. } = interval.constraints;
        if k == 0 || k + 1 == intervals.len() {
            let b = from[0].max(to[0]);
            let jerk = JERK_OF_REST * b * b.sqrt() / (h * h);
            let duration = libm::cbrt(6.0 * h / jerk);
            let (speed, acceleration) = if k == 0 { (0.0, 0.0) } else { (b.sqrt(), -jerk * duration) };
            let phase = Phase::even(interval.piece, interval.start, speed, acceleration, duration);
            profile.push(Phase { jerk, ..phase });
            profile.limiting.jerk_s[usize::from(points[1].jerk[1][0].abs() > points[1].jerk[0][0].abs())] +=
                duration;
            excesses.push((1.0, 1.0));
            continue;
        }
        let w = (to[1] - from[1]) / h;
        let phase = Phase::even(
            interval.piece,
            interval.start,
            from[0].sqrt(),
            0.5 * from[1],
            duration(h, from, to, w),
        );
        profile.push(Phase { acceleration_slope: 0.5 * w, ..phase });
        // b is largest at an end, or where c is 0.
        let top = if from[1] > 0.0 && to[1] < 0.0 { from[0] - 0.5 * from[1] * from[1] / w } else { 0.0 };
        let speed = from[0].max(to[0]).max(top) / cap;
        let shares = [0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0].map(|share| {
            let point = match share {
                0.0 => points[0],
                0.5 => points[1],
                1.0 => points[2],
                // The whole curve is within reach, so the point always exists.
                _ => PointConstraints::at(machine, &section[interval.piece], interval.start + share * h)
                    .unwrap_or(points[1]),
            };
            point.utilization(state_after(from, w, share * h), w)
        });
        let excess = (peak(shares.map(|share| share.0)), peak(shares.map(|share| share.1)));
        record_active_constraint(&interval.constraints, from, to, excess, phase.duration_s, &mut profile);
        slower = slower.max(excess.0.sqrt()).max(libm::cbrt(excess.1)).max(speed.sqrt());
        let beyond = |share: f64| if share > EXCESS { share } else { 1.0 };
        excesses.push((beyond(excess.0), beyond(excess.1)));
    }
    (profile.slowed(slower), excesses)
}

/// The largest of equidistant samples, or the vertex of the parabola through three of them.
fn peak<const N: usize>(samples: [f64; N]) -> f64 {
    let top = |w: &[f64]| {
        let (slope, second_derivative_bound) = (0.5 * (w[2] - w[0]), 2.0 * w[1] - w[0] - w[2]);
        if slope.abs() < second_derivative_bound {
            w[1] + 0.5 * slope * slope / second_derivative_bound
        } else {
            w[1]
        }
    };
    samples.windows(3).map(top).fold(samples[0].max(samples[N - 1]), f64::max)
}

/// Adds the duration of an interval to the constraint that is closest to its limit.
fn record_active_constraint(
    interval: &Constraints,
    from: State,
    to: State,
    excess: (f64, f64),
    duration: f64,
    profile: &mut Profile,
) {
    let limiting = &mut profile.limiting;
    let Constraints { length, points, cap, row_limit, .. } = interval;
    let (point, cap) = (&points[1], *cap);
    let w = (to[1] - from[1]) / length;
    let [b, c] = state_after(from, w, 0.5 * length);
    let speed = from[0].max(to[0]) / cap;
    if speed >= excess.0.max(excess.1) {
        let fastest = [0, 1].map(|k| point.speed[k] * point.speed[k] * cap);
        if fastest[0].max(fastest[1]) > 0.999 {
            limiting.speed_s[usize::from(fastest[1] > fastest[0])] += duration;
        } else if point.second_derivative_bound * cap > 0.999 * row_limit {
            limiting.rows_s += duration;
        } else {
            limiting.pen_s += duration;
        }
    } else if excess.1 >= excess.0 {
        let of = |[m1, m2, m3]: [f64; 3]| (0.5 * m1 * w + 1.5 * m2 * c + m3 * b).abs();
        limiting.jerk_s[usize::from(of(point.jerk[1]) > of(point.jerk[0]))] += duration;
    } else {
        let of = |[m1, m2]: [f64; 2]| (0.5 * m1 * c + m2 * b).abs();
        let k = usize::from(of(point.acceleration[1]) > of(point.acceleration[0]));
        let [m1, m2] = point.acceleration[k];
        let turning = (m2 * b).abs() > (0.5 * m1 * c).abs();
        *(if turning { &mut limiting.turning_s[k] } else { &mut limiting.acceleration_s[k] }) += duration;
    }
}

/// The duration over a length on which b is a parabola: `d²s/dt² = u + g s` with `g = w / 2`.
///
/// With k² = g, `v k + u` grows as `exp(k t)` and `v k - u` decays as `exp(-k t)`; with k² = -g the
/// point (k v, u) rotates by k t.
fn duration(length: f64, from: State, to: State, w: f64) -> f64 {
    let (v0, v1) = (from[0].max(0.0).sqrt(), to[0].max(0.0).sqrt());
    let (u0, u1) = (0.5 * from[1], 0.5 * to[1]);
    let mean = from[0] + 0.5 * length * (from[1] + 0.25 * length * w);
    if (w * length * length).abs() < 1e-4 * mean {
        // b is nearly linear; the correction for w is (w / 4) ∫ s (h - s) b^(-3/2) ds.
        return 2.0 * length / (v0 + v1) + w * length * length * length / (24.0 * mean * mean.sqrt());
    }
    let k = (0.5 * w).abs().sqrt();
    if w > 0.0 {
        let ratio = if u0 + u1 > 0.0 { (v1 * k + u1) / (v0 * k + u0) } else { (v0 * k - u0) / (v1 * k - u1) };
        libm::log(ratio) / k
    } else {
        (libm::atan2(u0, k * v0) - libm::atan2(u1, k * v1)) / k
    }
}

/// A profile without jerk limits, slowed down until its acceleration jumps, at most from one limit
/// to the other, do not exceed the jerk limits in rows one period apart.
fn slowed_until_smooth(machine: &Machine, profile: Profile, cap: &SpeedCap) -> Profile {
    let of = |motor: &kinematics::Motor| {
        motor
            .max_jerk_ticks_s3
            .map_or(1.0, |jerk| (2.0 * motor.max_acceleration_ticks_s2 / (jerk * cap.period_s)).sqrt())
    };
    let slower = machine.motors().iter().map(of).fold(1.0, f64::max);
    profile.slowed(slower)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::remaining_length;

    proptest! {
        /// An interval of 1e-17 mm at the end of a piece once made the plan of
        /// examples/rosette.hpgl take 31 minutes instead of 13.
        #[test]
        fn rounding_error_is_no_interval(length in 1e-3..1e3f64, share in 0.0..1.0f64) {
            let at = share * length;
            if let Some(left) = remaining_length(length, at) {
                prop_assert_eq!(remaining_length(length, at + left), None);
            }
        }
    }
}
