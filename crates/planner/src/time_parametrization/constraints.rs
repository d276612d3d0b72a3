//! The constraints of a grid interval, and the two-variable programs that the passes solve on it.
//!
//! With `b = (ds/dt)²` and `u = d²s/dt²`, so `db/ds = 2 u`, a motor with position m(s) has
//!
//! ```text
//! speed         |m'| sqrt(b)     <= v      so  b <= (v / |m'|)²
//! acceleration  |m' u + m'' b|   <= a      linear in (u, b)
//! ```
//! `u` is constant on an interval, so b is linear in s. The constraints are enforced at the
//! interval's start, middle and end, with limits lowered by [`GridInterval::interpolation_error`].
//! With `b(f) = b + 2 f length u` at the fraction f of the interval an acceleration limit is
//!
//! ```text
//! |P u + R b| <= 1     P = (m'_f + 2 f length m''_f) / a     R = m''_f / a
//! ```
//! These are six strips in the plane of (u, b), and two more near corners for the deviation of
//! linear motion between rows (see `path::slow_zones`).
//!
//! The programs in (u, b) are solved in closed form by comparing every lower bound of u with every
//! upper bound.

use kinematics::Machine;

use super::profile::{LimitingConstraints, Phase, Profile, SpeedCap};
use crate::joint_path::GridInterval;

/// The constraint `|p u + r b| <= 1`, p >= 0, with b at the interval's start.
#[derive(Clone, Copy, Debug, Default)]
struct Strip {
    p: f64,
    r: f64,
}

/// The constraints of an interval.
#[derive(Clone, Debug)]
pub(super) struct IntervalConstraints {
    /// Three per motor, at the interval's start, middle and end, and two near corners.
    strips: [Strip; 8],
    /// Twice the interval's length: b at its end is `b + two_h * u`.
    two_h: f64,
    /// The largest b on the interval under the speed limits.
    pub(super) cap: f64,
    /// The largest b at its start for which some u satisfies the constraints, wherever it leads.
    top: f64,
    /// The speed limit that determines `cap`.
    capped_by: SpeedLimit,
}

/// Kinds of speed limits.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SpeedLimit {
    Pen,
    Rows,
    Motor(usize),
}

/// How the speed changes over an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SpeedShape {
    /// One acceleration.
    Ramp,
    /// Acceleration to this b over the length `up`, constant speed, deceleration over the length
    /// `down`.
    Peak { b: f64, up: f64, down: f64 },
}

impl IntervalConstraints {
    pub(super) fn new(machine: &Machine, interval: &GridInterval, cap: &SpeedCap) -> Self {
        let mut strips = [Strip::default(); 8];
        let pen = cap.pen_mm_s / interval.pen_speed;
        let rows = 8.0 * cap.row_deviation_mm / (cap.period_s * cap.period_s);
        let (mut largest, mut capped_by) = (pen * pen, SpeedLimit::Pen);
        let mut lower = |b: f64, by: SpeedLimit| {
            if b < largest {
                (largest, capped_by) = (b, by);
            }
        };
        lower(rows / interval.second_derivative_bound, SpeedLimit::Rows);
        for (k, motor) in machine.motors().iter().enumerate() {
            let limit = motor.max_acceleration_ticks_s2 / (1.0 + interval.interpolation_error);
            let mut fastest = 0.0_f64;
            for (j, share) in [0.0, 0.5, 1.0].into_iter().enumerate() {
                let (m1, m2) = (interval.first[j][k] / limit, interval.second[j][k] / limit);
                let p = m1 + 2.0 * share * interval.length * m2;
                strips[3 * k + j] = if p < 0.0 { Strip { p: -p, r: -m2 } } else { Strip { p, r: m2 } };
                fastest = fastest.max(interval.first[j][k].abs());
            }
            let speed = motor.max_speed_ticks_s / (fastest * (1.0 + interval.interpolation_error));
            lower(speed * speed, SpeedLimit::Motor(k));
        }
        if interval.near_corner {
            // p'| |u| + bound b <= 8 row / T², with b largest at either end: two strips for the
            // start, and `cap`.
            let (p, r) = (interval.pen_speed / rows, interval.second_derivative_bound / rows);
            strips[6] = Strip { p, r };
            strips[7] = Strip { p, r: -r };
        }
        let two_h = 2.0 * interval.length;
        let top =
            largest_feasible(if interval.near_corner { &strips } else { &strips[..6] }, two_h).min(largest);
        Self { strips, two_h, cap: largest, top, capped_by }
    }

    /// The largest b at the start for which some u satisfies all constraints and leads into [0,
    /// next].
    pub(super) fn largest_start(&self, next: f64) -> f64 {
        // (-1 - r b) / p <= (next - b) / two_h: the speed at the end is not too large.
        let most = |strip: &Strip| {
            let slope = strip.p - self.two_h * strip.r;
            if slope > 0.0 { (strip.p * next + self.two_h) / slope } else { f64::INFINITY }
        };
        self.strips.iter().map(most).fold(self.top, f64::min)
    }

    /// The largest b at the end, at most `top`, that is reachable from b at the start.
    pub(super) fn largest_end(&self, b: f64, top: f64) -> f64 {
        let highest =
            |strip: &Strip| if strip.p > 0.0 { (1.0 - strip.r * b) / strip.p } else { f64::INFINITY };
        let u = self.strips.iter().map(highest).fold(f64::INFINITY, f64::min);
        (b + self.two_h * u).clamp(0.0, top)
    }

    /// The strip with the largest utilization from b0 to b1, and its utilization.
    fn active_constraint(&self, b0: f64, b1: f64, strips: &[usize]) -> (usize, f64) {
        let u = (b1 - b0) / self.two_h;
        let uses = strips.iter().map(|&index| {
            let strip = &self.strips[index];
            (index, (strip.p * u + strip.r * b0).abs())
        });
        uses.fold((0, 0.0), |most, one| if one.1 > most.1 { one } else { most })
    }

    fn is_straight(&self) -> bool {
        self.strips.iter().all(|strip| strip.r == 0.0)
    }

    /// Appends the phases from b0 to b1 and records what limits them.
    pub(super) fn phases(&self, interval: &GridInterval, b0: f64, b1: f64, profile: &mut Profile) {
        let mut start = interval.start;
        let mut push = |length: f64, from: f64, to: f64| {
            if length > 0.0 && from + to > 0.0 {
                let (slow, fast) = (from.sqrt(), to.sqrt());
                let duration = 2.0 * length / (slow + fast);
                let acceleration = (fast - slow) / duration;
                profile.push(Phase::even(interval.piece, start, slow, acceleration, duration));
                self.record_active_constraint(from, to, duration, &mut profile.limiting);
            }
            start += length;
        };
        match self.speed_shape(b0, b1) {
            SpeedShape::Ramp => push(interval.length, b0, b1),
            SpeedShape::Peak { b, up, down } => {
                push(up, b0, b);
                push(interval.length - up - down, b, b);
                push(down, b, b1);
            }
        }
    }

    /// A ramp; or acceleration, constant speed and deceleration where the motor positions are
    /// linear in s, so that one acceleration is feasible over the whole interval, and where it
    /// begins and ends at rest.
    fn speed_shape(&self, b0: f64, b1: f64) -> SpeedShape {
        if !self.is_straight() && b0 + b1 > 0.0 {
            return SpeedShape::Ramp;
        }
        // To `b` and down again with |m'| |u| + |m''| b <= a, where |m'| <= p + f two_h |r|:
        // u = (1 - |r| b) / (p + two_h |r|), and (2 b - b0 - b1) / 2 = u length.
        let mut b = self.cap;
        for Strip { p, r } in self.strips {
            let (m1, m2) = (p + self.two_h * r.abs(), r.abs());
            b = b.min((self.two_h + m1 * (b0 + b1)) / (2.0 * m1 + self.two_h * m2));
        }
        let strongest =
            self.strips.iter().map(|Strip { p, r }| (1.0 - r.abs() * b) / (p + self.two_h * r.abs()));
        let u = strongest.fold(f64::INFINITY, f64::min);
        let length = 0.5 * self.two_h;
        let (up, down) = ((b - b0) / (2.0 * u), (b - b1) / (2.0 * u));
        // The peak may be the speed at an end, for example where the interval ends at its cap: then
        // it is reached before the end and kept. Up to rounding, since `b` is recomputed here.
        if b >= b0.max(b1) * (1.0 - 1e-12) && u > 0.0 && up + down <= length * (1.0 + 1e-9) {
            let (up, down) = (up.clamp(0.0, length), down.max(0.0));
            SpeedShape::Peak { b, up, down: down.min(length - up) }
        } else {
            SpeedShape::Ramp
        }
    }

    /// Adds the duration of a ramp to the constraint that is closest to its limit.
    fn record_active_constraint(&self, b0: f64, b1: f64, duration: f64, limiting: &mut LimitingConstraints) {
        let (strip, most) = self.active_constraint(b0, b1, &[0, 1, 2, 3, 4, 5, 6, 7]);
        if b0.max(b1) / self.cap >= most {
            match self.capped_by {
                SpeedLimit::Pen => limiting.pen_s += duration,
                SpeedLimit::Rows => limiting.rows_s += duration,
                SpeedLimit::Motor(k) => limiting.speed_s[k] += duration,
            }
        } else if strip >= 6 {
            limiting.rows_s += duration;
        } else {
            // m' u + m'' b = (P - 2 f length R) u + R b, at the fraction f of the strip.
            let (k, share) = (strip / 3, 0.5 * (strip % 3) as f64);
            let Strip { p, r } = self.strips[strip];
            let u = (b1 - b0) / self.two_h;
            let along = (p - share * self.two_h * r) * u;
            let turning = r * (b0 + share * (b1 - b0));
            let of = if turning.abs() > along.abs() {
                &mut limiting.turning_s
            } else {
                &mut limiting.acceleration_s
            };
            of[k] += duration;
        }
    }
}

/// The largest b for which the strips have a common u that does not lead to b below 0.
fn largest_feasible(strips: &[Strip], two_h: f64) -> f64 {
    // For every pair of a lower and an upper bound of u: lower(b) <= upper(b).
    let mut least = 0.0_f64;
    for (i, one) in strips.iter().enumerate() {
        for other in &strips[i + 1..] {
            // (-1 - r_i b) / p_i <= (1 - r_j b) / p_j, and with i and j exchanged; 0 / 0 where both
            // motors rest.
            least = least.max((one.p * other.r - other.p * one.r).abs() / (one.p + other.p));
        }
        // A motor that rests here whatever u is.
        if one.p == 0.0 {
            least = least.max(one.r.abs());
        }
        // -b / two_h <= (1 - r b) / p: b at the end is not negative.
        least = least.max(one.r - one.p / two_h);
    }
    1.0 / least
}
