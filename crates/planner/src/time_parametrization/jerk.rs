//! Time parametrization under speed, acceleration and jerk limits: controllable sets in the plane
//! of b and db/ds.
//!
//! With `b = (ds/dt)²`, `c = db/ds` and `w = d²b/ds²` a motor with position m(s) has
//!
//! ```text
//! acceleration  |½ m' c + m'' b|                          <= a
//! jerk          |½ m' w + 3/2 m'' c + m''' b|  √b         <= j
//! ```
//! `w` is constant on an interval, so b is a parabola and the motion is `d²s/dt² = c/2 + w s/2`.
//! Divided by √b, the right side of the second constraint, `j / √b`, is convex in b. Its tangent at
//! any b* lies below it, so with `j (3/2 - b / (2 b*)) / √b*` in its place the constraint is linear
//! and at least as strict (the step by which sequential programs stay feasible: Debrouwere et al.
//! 2013; Lee et al. 2024, arXiv 2404.07889). All constraints on (b, c, w) at an interval's start,
//! middle and end are then half-spaces, and the controllable set of (b, c) at a grid point is a
//! convex polygon: the set of the next point, propagated back through the interval, with w
//! eliminated by comparing every upper bound of w with every lower bound. The forward pass takes
//! the largest w at each point that stays within the next polygon. The passes are repeated with b*
//! at the speeds found while that gains time.
//!
//! From rest `b` grows as `s^(4/3)`, faster than any parabola: the first interval of a path has
//! constant jerk in time instead, which leads to a point on the ray `c = 4 b / (3 length)`, and the
//! last one likewise.
//!
//! Between the points where they are enforced, limits may be exceeded slightly. The excess is
//! measured at more points, and the motion is slowed down to compensate.

use drawing::Segment;
use kinematics::{JointPos, Machine, MotorPos};

use super::polygon::Polygon;
use super::profile::{Phase, Profile, SpeedCap};
use super::{acceleration, straight};
use crate::joint_path::{JointPath, PathDerivatives, PathGeometry, third_derivative};
use crate::path::Piece;

/// Largest number of passes, each with b* at the speeds of the one before.
const PASSES: usize = 4;

/// Passes end when one gains no more than this share of the duration.
const LEAST_GAIN: f64 = 1e-3;

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
            let fastest = acceleration::profile(machine, path, cap);
            let mut intervals = intervals(machine, path, section, cap, &fastest).unwrap_or_default();
            let mut best: Option<Profile> = None;
            for _ in 0..PASSES {
                let Some(states) = solve(&intervals) else { break };
                let (found, excess) = build_profile(machine, section, &intervals, &states);
                if !found.duration_s.is_finite() {
                    break;
                }
                let gain =
                    best.as_ref().map_or(f64::INFINITY, |best| 1.0 - found.duration_s / best.duration_s);
                if gain > 0.0 {
                    best = Some(found);
                }
                if gain < LEAST_GAIN && excess.iter().all(|excess| *excess == (1.0, 1.0)) {
                    break;
                }
                for ((interval, state), excess) in intervals.iter_mut().zip(states.windows(2)).zip(excess) {
                    interval.linearize_at(state[0], state[1]);
                    interval.tighten(excess);
                }
            }
            best.unwrap_or_else(|| slowed_until_smooth(machine, fastest, cap))
        }
    }
}

/// The constraints at one point of a path.
#[derive(Clone, Copy, Debug)]
struct PointConstraints {
    /// Derivatives with respect to s over the motors' limits: m' / v; m' / a, m'' / a; m' / j, m''
    /// / j, m''' / j.
    speed: [f64; 2],
    acceleration: [[f64; 2]; 2],
    jerk: [[f64; 3]; 2],
    pen_speed: f64,
    second_derivative_bound: f64,
}

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

    /// The largest utilization of the acceleration and of the jerk limits.
    fn utilization(&self, state: State, w: f64) -> (f64, f64) {
        let [b, c] = state;
        let acceleration = |[m1, m2]: [f64; 2]| (0.5 * m1 * c + m2 * b).abs();
        let jerk = |[m1, m2, m3]: [f64; 3]| (0.5 * m1 * w + 1.5 * m2 * c + m3 * b).abs() * b.max(0.0).sqrt();
        let most = |f: &dyn Fn(usize) -> f64| f(0).max(f(1));
        (most(&|k| acceleration(self.acceleration[k])), most(&|k| jerk(self.jerk[k])))
    }
}

/// b and c.
type State = [f64; 2];

/// A part of a path with constant w.
#[derive(Clone, Debug)]
struct JerkInterval {
    piece: usize,
    start: f64,
    length: f64,
    /// At its start, middle and end.
    points: [PointConstraints; 3],
    cap: f64,
    /// Bound on `|p'| |u| + second_derivative_bound b` of the pen near corners; infinite elsewhere.
    row_limit: f64,
    /// b* at its start, middle and end.
    tangent_points: [f64; 3],
    /// The shares of the acceleration and jerk limits that may be used.
    allowed: (f64, f64),
    /// A b that is known to be gentle at its start, see [`set_lower_bounds`].
    lower_bound: f64,
}

const FRACTIONS: [f64; 3] = [0.0, 0.5, 1.0];

impl JerkInterval {
    /// b and c at a fraction of it.
    fn state(&self, from: State, w: f64, share: f64) -> State {
        let s = share * self.length;
        [from[0] + s * (from[1] + 0.5 * s * w), from[1] + s * w]
    }

    /// Sets b* to the current speeds.
    fn linearize_at(&mut self, from: State, to: State) {
        let w = (to[1] - from[1]) / self.length;
        let speeds = FRACTIONS.map(|share| self.state(from, w, share)[0]);
        for (tangent_point, b) in self.tangent_points.iter_mut().zip(speeds) {
            *tangent_point = b.max(1e-3 * *tangent_point);
        }
    }

    fn tighten(&mut self, excess: (f64, f64)) {
        let stricter = |allowed: f64, excess: f64| {
            if excess > 1.0 { (allowed / excess).max(0.5 * allowed) } else { allowed }
        };
        self.allowed = (stricter(self.allowed.0, excess.0), stricter(self.allowed.1, excess.1));
    }

    /// All constraints on w and on (b, c) at its start: `x b + y c + z w <= offset`.
    fn conditions(&self) -> Vec<[f64; 4]> {
        let mut all = Vec::with_capacity(40);
        for (j, share) in FRACTIONS.into_iter().enumerate() {
            let (point, s) = (&self.points[j], share * self.length);
            // b there is b + s c + s²/2 w, c there is c + s w.
            let mut hold = |of_b: f64, of_c: f64, of_w: f64, offset: f64| {
                all.push([of_b, of_b * s + of_c, 0.5 * of_b * s * s + of_c * s + of_w, offset]);
            };
            hold(1.0, 0.0, 0.0, self.cap);
            hold(-1.0, 0.0, 0.0, 0.0);
            let tangent = (
                1.5 / self.tangent_points[j].sqrt(),
                -0.5 / (self.tangent_points[j] * self.tangent_points[j].sqrt()),
            );
            for k in 0..2 {
                for sign in [1.0, -1.0] {
                    let [m1, m2] = point.acceleration[k].map(|m| sign * m);
                    hold(m2, 0.5 * m1, 0.0, self.allowed.0);
                    if point.jerk[k] != [0.0; 3] {
                        let [m1, m2, m3] = point.jerk[k].map(|m| sign * m);
                        let (offset, slope) = (self.allowed.1 * tangent.0, self.allowed.1 * tangent.1);
                        hold(m3 - slope, 1.5 * m2, 0.5 * m1, offset);
                    }
                }
            }
            if self.row_limit.is_finite() {
                for sign in [1.0, -1.0] {
                    hold(point.second_derivative_bound, 0.5 * sign * point.pen_speed, 0.0, self.row_limit);
                }
            }
        }
        all
    }

    /// The largest b at the other end that constant jerk from rest may lead to. The utilization of
    /// all limits grows with b, so it is largest at that end.
    fn largest_from_rest(&self) -> f64 {
        let h = self.length;
        // With b there: c = 4 b / (3 h), u = c / 2, and the jerk of s is √b³ / (the rest of this),
        // by s = j t³/6.
        let jerk = JERK_OF_REST / (h * h);
        let mut most = self.cap;
        for point in &self.points {
            for k in 0..2 {
                let [m1, m2] = point.acceleration[k].map(f64::abs);
                most = most.min(self.allowed.0 / (m1 * 2.0 / (3.0 * h) + m2));
                let [m1, m2, m3] = point.jerk[k].map(f64::abs);
                let by = self.allowed.1 / (m1 * jerk + 2.0 * m2 / h + m3);
                most = most.min(libm::cbrt(by * by));
            }
            if self.row_limit.is_finite() {
                most = most.min(
                    self.row_limit / (point.pen_speed * 2.0 / (3.0 * h) + point.second_derivative_bound),
                );
            }
        }
        most
    }
}

/// `j h² / √b³` for motion with the jerk j from rest to b at h: with `h = j t³/6` and `b = j² t⁴/4`
/// it is `(t⁶ j³ / 36) (8 / (j³ t⁶)) = 2/9`.
const JERK_OF_REST: f64 = 2.0 / 9.0;

/// c over b at the end of an interval that begins at rest.
fn rest_ray_slope(length: f64) -> f64 {
    4.0 / (3.0 * length)
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
            let tangent_points = FRACTIONS.map(|share| {
                let s = s + share * length;
                let b = speeds.square(interval.piece, start + share * length).min(top);
                let rest = s.min(total - s).max(0.1 * length);
                points[1].initial_tangent_point(b, rest)
            });
            intervals.push(JerkInterval {
                piece: interval.piece,
                start,
                length,
                points,
                cap: top,
                row_limit,
                tangent_points,
                allowed: (1.0, 1.0),
                lower_bound: 0.0,
            });
            at += length;
        }
        done += interval.length;
    }
    set_lower_bounds(&mut intervals);
    Some(intervals)
}

/// What is left of a length; `None` if it is rounding error, on which no profile exists.
fn remaining_length(length: f64, at: f64) -> Option<f64> {
    let left = length - at;
    (left > 1e-9 * length).then_some(left)
}

/// Sets lower bounds on the speed: speeds at which the path can be followed gently. No corner uses
/// more than a share of the limits, and accelerating and braking use no more acceleration than can
/// be released while the speed changes by half.
///
/// Without them, maximizing the speed from the start would brake for a corner so late that the pen
/// almost stops before the brake is released.
fn set_lower_bounds(intervals: &mut [JerkInterval]) {
    let total: f64 = intervals.iter().map(|interval| interval.length).sum();
    let mut at = 0.0_f64;
    for interval in intervals.iter_mut() {
        let most = |of: &dyn Fn(&PointConstraints) -> f64| interval.points.iter().map(of).fold(0.0, f64::max);
        let turn = most(&|point| point.jerk[0][2].abs().max(point.jerk[1][2].abs()));
        let second_derivative_bound =
            most(&|point| point.acceleration[0][1].abs().max(point.acceleration[1][1].abs()));
        let rest = interval.points[0].initial_tangent_point(interval.cap, at.min(total - at));
        interval.lower_bound =
            rest.min(libm::cbrt(0.25 / (turn * turn))).min(0.5 / second_derivative_bound).min(interval.cap);
        at += interval.length;
    }
    let steps = |interval: &JerkInterval, b: f64| {
        let point = &interval.points[1];
        let jerk = 1.0 / point.jerk[0][0].abs().max(point.jerk[1][0].abs());
        let acceleration = 1.0 / point.acceleration[0][0].abs().max(point.acceleration[1][0].abs());
        b + interval.length * acceleration.min((jerk * b.sqrt()).sqrt())
    };
    for k in 1..intervals.len() {
        intervals[k].lower_bound = intervals[k]
            .lower_bound
            .min(steps(&intervals[k - 1], intervals[k - 1].lower_bound.max(1e-9 * intervals[k].cap)));
    }
    for k in (1..intervals.len()).rev() {
        intervals[k - 1].lower_bound =
            intervals[k - 1].lower_bound.min(steps(&intervals[k - 1], intervals[k].lower_bound));
    }
}

impl PointConstraints {
    /// An initial b*: at most b, what jerk allows in a corner, and what jerk allows this close to
    /// rest.
    fn initial_tangent_point(&self, b: f64, to_rest: f64) -> f64 {
        let (mut turn, mut ramp) = (0.0_f64, 0.0_f64);
        for [m1, _, m3] in self.jerk {
            (turn, ramp) = (turn.max(m3.abs()), ramp.max(m1.abs()));
        }
        // By JERK_OF_REST: √b³ = j s² / (2/9).
        let jerk = to_rest * to_rest / (JERK_OF_REST * ramp);
        let third = |x: f64| libm::cbrt(x * x);
        b.min(third(1.0 / turn)).min(third(jerk)).max(1e-12)
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
        let way = (s - phase.start).clamp(0.0, phase.position_at(phase.duration_s) - phase.start);
        let way = if phase.piece > piece { 0.0 } else { way };
        (phase.speed * phase.speed + 2.0 * phase.acceleration * way).max(0.0)
    }
}

/// The states at all grid points; `None` if no motion is found.
fn solve(intervals: &[JerkInterval]) -> Option<Vec<State>> {
    [0.5, 0.1, 0.0].into_iter().find_map(|bound_share| solve_above(intervals, bound_share))
}

/// The states at all grid points, with b at least `bound_share` times the lower bounds.
fn solve_above(intervals: &[JerkInterval], bound_share: f64) -> Option<Vec<State>> {
    let count = intervals.len();
    if count < 4 {
        return None;
    }
    let (last, last_but_one) = (&intervals[count - 1], &intervals[count - 2]);
    // Sets at the starts of intervals 1 to count - 2. From the last of them the ray of the terminal
    // interval is met exactly.
    let terminal = TerminalInterval::new(last_but_one, rest_ray_slope(last.length));
    let mut sets = vec![Polygon::default(); count - 1];
    sets[count - 2] = terminal.set(last_but_one, bound_share, last.largest_from_rest());
    for k in (1..count - 2).rev() {
        sets[k] = controllable_set(&intervals[k], bound_share, &sets[k + 1]);
        if sets[k].0.is_empty() {
            return None;
        }
    }
    // From rest, as far along the ray as the set allows.
    let start = sets[1].farthest(rest_ray_slope(intervals[0].length))?.min(intervals[0].largest_from_rest());
    if start <= 0.0 {
        return None;
    }
    let mut states = vec![[0.0, 0.0], [start, rest_ray_slope(intervals[0].length) * start]];
    for k in 1..count - 1 {
        let from = states[k];
        let w = if k == count - 2 {
            terminal.w(from)
        } else {
            largest_w_into(&sets[k + 1], &intervals[k], from)?
        };
        let to = intervals[k].state(from, w, 1.0);
        states.push([to[0].max(0.0), to[1]]);
    }
    states.push([0.0, 0.0]);
    states.iter().flatten().all(|x| x.is_finite()).then_some(states)
}

/// The interval before the last: its w is such that it ends on the ray from which constant jerk
/// leads to rest.
struct TerminalInterval {
    /// w = x b + y c.
    w: [f64; 2],
    /// b at its end, by b and c.
    end: [f64; 2],
}

impl TerminalInterval {
    /// From `c + w h = -g (b + c h + w h²/2)`.
    fn new(interval: &JerkInterval, g: f64) -> Self {
        let h = interval.length;
        let below = h + 0.5 * g * h * h;
        let w = [-g / below, -(1.0 + g * h) / below];
        Self { w, end: [1.0 + 0.5 * h * h * w[0], h + 0.5 * h * h * w[1]] }
    }

    fn w(&self, [b, c]: State) -> f64 {
        self.w[0] * b + self.w[1] * c
    }

    fn set(&self, interval: &JerkInterval, bound_share: f64, most: f64) -> Polygon {
        let mut set = initial_set(interval, bound_share);
        for [x, y, z, offset] in interval.conditions() {
            set.clip(x + z * self.w[0], y + z * self.w[1], offset);
        }
        set.clip(self.end[0], self.end[1], most);
        set.clip(-self.end[0], -self.end[1], 0.0);
        set
    }
}

/// All states at an interval's start that can be reached from rest and from which rest can be
/// reached.
///
/// Multiplied by √b, the jerk constraint vanishes with b, so what it excludes there must be stated
/// separately. A motion with jerk j that decelerates at u needs the speed u² / (2 j) to end its
/// deceleration, so `c² <= 8 j √b`: a convex set. These are corners of the set for twice the jerk,
/// so that the chords between them exclude nothing.
fn initial_set(interval: &JerkInterval, bound_share: f64) -> Polygon {
    let point = &interval.points[0];
    let jerk = 1.0 / point.jerk.iter().map(|[m1, ..]| m1.abs()).fold(0.0, f64::max);
    // And |½ m' c| <= 1 + |m''| b, whatever the jerk is.
    let c = point.acceleration.iter().map(|[m1, m2]| 2.0 * (1.0 + m2.abs() * interval.cap) / m1.abs());
    let most = c.fold(f64::INFINITY, f64::min);
    let at = |share: &f64| {
        let b = share * interval.cap;
        [b, (16.0 * jerk * b.sqrt()).sqrt().min(most)]
    };
    let levels = [1e-9, 1e-7, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.4, 1.0];
    let mut corners = vec![[0.0, 0.0]];
    corners.extend(levels.iter().map(at).map(|[b, c]| [b, -c]));
    corners.extend(levels.iter().rev().map(at));
    let mut set = Polygon(corners);
    set.clip(-1.0, 0.0, -bound_share * interval.lower_bound);
    set
}

/// The states at an interval's start from which some w leads into `next`.
fn controllable_set(interval: &JerkInterval, bound_share: f64, next: &Polygon) -> Polygon {
    let mut set = initial_set(interval, bound_share);
    let (mut upper, mut lower) = (Vec::with_capacity(40), Vec::with_capacity(40));
    for [x, y, z, offset] in interval.conditions().into_iter().chain(propagate(interval, next)) {
        if z > 0.0 {
            upper.push([x / z, y / z, offset / z]);
        } else if z < 0.0 {
            lower.push([x / -z, y / -z, offset / -z]);
        } else {
            set.clip(x, y, offset);
        }
    }
    set.keep_tight(&mut upper);
    set.keep_tight(&mut lower);
    // w <= offset - x b - y c for the upper bounds, w >= x b + y c - offset for the lower bounds.
    for [x, y, offset] in &upper {
        for [x1, y1, room1] in &lower {
            set.clip(x + x1, y + y1, offset + room1);
        }
    }
    set.simplify();
    set
}

/// The constraints on w and the state at an interval's start for ending in `set`.
fn propagate(interval: &JerkInterval, set: &Polygon) -> impl Iterator<Item = [f64; 4]> {
    let h = interval.length;
    // b at the end is b + h c + h²/2 w, c there is c + h w.
    set.edges().map(move |[x, y, offset]| [x, x * h + y, 0.5 * x * h * h + y * h, offset])
}

/// The largest w by which an interval leads from a state into a set; `None` if there is none.
fn largest_w_into(set: &Polygon, interval: &JerkInterval, [b, c]: State) -> Option<f64> {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for [x, y, z, offset] in interval.conditions().into_iter().chain(propagate(interval, set)) {
        let left = offset - x * b - y * c;
        if z > 0.0 {
            high = high.min(left / z);
        } else if z < 0.0 {
            low = low.max(left / z);
        }
    }
    if set.0.is_empty() || !(high.is_finite() && low.is_finite()) {
        return None;
    }
    // They cross by rounding error only, since the state is in the controllable set.
    Some(if high >= low { high } else { 0.5 * (high + low) })
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
        let h = interval.length;
        if k == 0 || k + 1 == intervals.len() {
            let b = from[0].max(to[0]);
            let jerk = JERK_OF_REST * b * b.sqrt() / (h * h);
            let duration = libm::cbrt(6.0 * h / jerk);
            let (speed, acceleration) = if k == 0 { (0.0, 0.0) } else { (b.sqrt(), -jerk * duration) };
            let phase = Phase::even(interval.piece, interval.start, speed, acceleration, duration);
            profile.push(Phase { jerk, ..phase });
            profile.limiting.jerk_s
                [usize::from(interval.points[1].jerk[1][0].abs() > interval.points[1].jerk[0][0].abs())] +=
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
        let speed = from[0].max(to[0]).max(top) / interval.cap;
        let shares = [0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0].map(|share| {
            let point = match share {
                0.0 => interval.points[0],
                0.5 => interval.points[1],
                1.0 => interval.points[2],
                // The whole curve is within reach, so the point always exists.
                _ => PointConstraints::at(machine, &section[interval.piece], interval.start + share * h)
                    .unwrap_or(interval.points[1]),
            };
            point.utilization(interval.state(from, w, share), w)
        });
        let excess = (peak(shares.map(|share| share.0)), peak(shares.map(|share| share.1)));
        record_active_constraint(interval, from, to, excess, phase.duration_s, &mut profile);
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
    interval: &JerkInterval,
    from: State,
    to: State,
    excess: (f64, f64),
    duration: f64,
    profile: &mut Profile,
) {
    let limiting = &mut profile.limiting;
    let point = &interval.points[1];
    let w = (to[1] - from[1]) / interval.length;
    let [b, c] = interval.state(from, w, 0.5);
    let speed = from[0].max(to[0]) / interval.cap;
    if speed >= excess.0.max(excess.1) {
        let fastest = [0, 1].map(|k| point.speed[k] * point.speed[k] * interval.cap);
        if fastest[0].max(fastest[1]) > 0.999 {
            limiting.speed_s[usize::from(fastest[1] > fastest[0])] += duration;
        } else if point.second_derivative_bound * interval.cap > 0.999 * interval.row_limit {
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
