//! Time-optimal speed along a joint path under every motor's speed and acceleration, from rest to rest.

mod acceleration;
mod bounds;

use kinematics::Machine;

use crate::lift::JointPath;

/// A stretch of constant acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// Index of the piece it lies on.
    pub piece: usize,
    /// Where on the piece it begins, in units of the path's parameter.
    pub start: f64,
    /// Speed at its start, units/s.
    pub speed: f64,
    /// Acceleration, units/s².
    pub acceleration: f64,
    /// How long it takes, s; positive.
    pub duration: f64,
}

/// A speed profile along a joint path, from rest to rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The phases, in order; at least one.
    pub phases: Vec<Phase>,
    /// How long all of them take, s.
    pub duration: f64,
    /// What it is that does not let it be faster.
    pub limiting: Limiting,
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
pub struct Limiting {
    /// Each motor's speed.
    pub speed: [f64; 2],
    /// Each motor's acceleration, while it mostly speeds up or slows down along the way.
    pub acceleration: [f64; 2],
    /// Each motor's acceleration, while most of it is needed to turn: in corners and curves.
    pub turning: [f64; 2],
    /// The pen's speed.
    pub pen: f64,
    /// Rows: between them motors move linearly, and more speed would cut a turn by too much.
    pub rows: f64,
}

impl Limiting {
    /// All of it together, s.
    pub fn total(&self) -> f64 {
        let of = |pair: [f64; 2]| pair[0] + pair[1];
        of(self.speed) + of(self.acceleration) + of(self.turning) + self.pen + self.rows
    }

    /// Adds what limited another motion, `scale` times as long.
    pub fn add(&mut self, other: &Self, scale: f64) {
        for k in 0..2 {
            self.speed[k] += scale * other.speed[k];
            self.acceleration[k] += scale * other.acceleration[k];
            self.turning[k] += scale * other.turning[k];
        }
        self.pen += scale * other.pen;
        self.rows += scale * other.rows;
    }
}

/// The fastest profile along `path` under the machine's motors and the cap.
pub fn profile(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    acceleration::profile(machine, path, cap)
}
