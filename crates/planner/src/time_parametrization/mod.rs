//! Time-optimal speed along a joint path under every motor's speed, acceleration and jerk, from rest to rest.

mod acceleration;
mod constraints;
mod fixed_duration;
mod jerk;
mod polygon;
mod straight;

use kinematics::Machine;

use crate::joint_path::JointPath;

/// A stretch on which the acceleration is even, or changes evenly by time or by the way.
///
/// With `t` from its beginning: `s = start + speed S + acceleration C + jerk t³ / 6`, where `S = t` and `C = t²/2` unless the
/// acceleration grows with the way, `d²s/dt² = acceleration + acceleration_slope (s - start)`: then with k² = acceleration_slope
/// `S = sinh(k t) / k` and `C = (cosh(k t) - 1) / k²` (with sin and cos where it is negative). There is no phase with both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// Index of the piece it lies on.
    pub piece: usize,
    /// Where on the piece it begins, in units of the path's parameter.
    pub start: f64,
    /// Speed at its start, units/s.
    pub speed: f64,
    /// Acceleration at its start, units/s².
    pub acceleration: f64,
    /// How the acceleration grows along the way, 1/s².
    pub acceleration_slope: f64,
    /// How the acceleration grows in time, units/s³.
    pub jerk: f64,
    /// How long it takes, s; positive.
    pub duration: f64,
}

impl Phase {
    /// With an even acceleration.
    fn even(piece: usize, start: f64, speed: f64, acceleration: f64, duration: f64) -> Self {
        Self { piece, start, speed, acceleration, acceleration_slope: 0.0, jerk: 0.0, duration }
    }

    /// Where it is on the piece, `t` s after it began.
    pub fn position_at(&self, t: f64) -> f64 {
        if self.acceleration_slope == 0.0 {
            return self.start + t * (self.speed + t * (0.5 * self.acceleration + t * self.jerk / 6.0));
        }
        let square = self.acceleration_slope * t * t;
        let (first, second) = if square.abs() < 1e-4 {
            // Series: what is left out is below 1e-12 of it.
            (
                t * (1.0 + square / 6.0 * (1.0 + square / 20.0)),
                0.5 * t * t * (1.0 + square / 12.0 * (1.0 + square / 30.0)),
            )
        } else {
            let k = self.acceleration_slope.abs().sqrt();
            if self.acceleration_slope > 0.0 {
                (libm::sinh(k * t) / k, (libm::cosh(k * t) - 1.0) / self.acceleration_slope)
            } else {
                (libm::sin(k * t) / k, (libm::cos(k * t) - 1.0) / self.acceleration_slope)
            }
        };
        self.start + self.speed * first + self.acceleration * second
    }
}

/// A speed profile along a joint path, from rest to rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The phases, in order; at least one.
    pub phases: Vec<Phase>,
    /// How long all of them take, s.
    pub duration: f64,
    /// What it is that does not let it be faster.
    pub limiting: LimitingConstraints,
}

/// What limits the speed beside the motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedCap {
    /// Largest speed of the pen, mm/s; infinite for travel.
    pub pen: f64,
    /// Largest distance (mm) by which linear motion between rows may leave the curve.
    pub row_deviation: f64,
    /// Time between rows, s.
    pub period: f64,
}

/// For how long each limit was what kept a motion from being faster, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LimitingConstraints {
    /// Each motor's speed.
    pub speed: [f64; 2],
    /// Each motor's acceleration, while it mostly speeds up or slows down along the way.
    pub acceleration: [f64; 2],
    /// Each motor's acceleration, while most of it is needed to turn: in corners and curves.
    pub turning: [f64; 2],
    /// Each motor's jerk.
    pub jerk: [f64; 2],
    /// The pen's speed.
    pub pen: f64,
    /// Rows: between them motors move linearly, and more speed would cut a turn by too much.
    pub rows: f64,
}

impl Profile {
    fn new() -> Self {
        Self { phases: Vec::new(), duration: 0.0, limiting: LimitingConstraints::default() }
    }

    /// The same motion in so many times the time.
    fn slowed(mut self, times: f64) -> Self {
        let slower = 1.0 / times;
        for phase in &mut self.phases {
            phase.speed *= slower;
            phase.acceleration *= slower * slower;
            phase.acceleration_slope *= slower * slower;
            phase.jerk *= slower * slower * slower;
            phase.duration *= times;
        }
        self.duration *= times;
        let limiting = std::mem::take(&mut self.limiting);
        self.limiting.add(&limiting, times);
        self
    }

    fn push(&mut self, phase: Phase) {
        self.duration += phase.duration;
        self.phases.push(phase);
    }
}

impl LimitingConstraints {
    /// All of it together, s.
    pub fn total(&self) -> f64 {
        let of = |pair: [f64; 2]| pair[0] + pair[1];
        of(self.speed) + of(self.acceleration) + of(self.turning) + of(self.jerk) + self.pen + self.rows
    }

    /// Adds what limited another motion, `scale` times as long.
    pub fn add(&mut self, other: &Self, scale: f64) {
        for k in 0..2 {
            self.speed_s[k] += scale * other.speed_s[k];
            self.acceleration_s[k] += scale * other.acceleration_s[k];
            self.turning_s[k] += scale * other.turning_s[k];
            self.jerk_s[k] += scale * other.jerk_s[k];
        }
        self.pen += scale * other.pen;
        self.rows += scale * other.rows;
    }
}

pub use fixed_duration::{Easing, fixed_duration};

/// The fastest profile along `path` under the machine's motors and the cap.
pub fn profile(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    if jerk::applies(machine) {
        jerk::profile(machine, path, cap)
    } else {
        acceleration::profile(machine, path, cap)
    }
}

/// The same with no more intervals than the path has: ten times as fast to find, and within a few per cent of the best.
pub fn rough_profile(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    acceleration::rough(machine, path, cap)
}
