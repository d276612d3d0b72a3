//! Controllers: from setpoint and measurement to a command. One controller is one file.

mod cascade;
mod direct;
mod feed_forward;
mod pid;

use std::fmt::Debug;

pub use cascade::{Cascade, CascadeGains};
pub use direct::Direct;
pub use feed_forward::{FeedForward, MotorModel};
pub use pid::{AntiWindup, Pid, PidGains};

/// Largest duty, %.
pub const FULL_DUTY_PERCENT: f64 = 100.0;

/// Where a motor should be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Setpoint {
    /// Position, ticks.
    pub position: f64,
    /// Planned speed, ticks/s; 0 for setpoints without time.
    pub speed: f64,
    /// Planned acceleration, ticks/s²; 0 for setpoints without time.
    pub acceleration: f64,
}

/// What the controller measures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measurement {
    /// Position by the encoder, ticks: a multiple of its resolution.
    pub position: f64,
    /// Current, A.
    pub current_a: f64,
}

/// A controller of one motor, called once a period.
pub trait Controller: Debug {
    /// The command until the next call: % of duty, or ticks for [`Direct`].
    fn update(&mut self, setpoint: &Setpoint, measured: &Measurement) -> f64;

    /// Whether the last command was limited.
    fn is_saturated(&self) -> bool {
        false
    }
}
