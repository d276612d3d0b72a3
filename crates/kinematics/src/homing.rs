//! How a machine finds its start pose.

use crate::{Machine, MachineError};

/// How a machine finds its start pose after it was switched on.
#[derive(Clone, Debug, PartialEq)]
pub struct Homing {
    /// What is done.
    pub method: HomingMethod,
    /// Whether the file's numbers come from a calibration of this machine.
    pub calibrated: bool,
}

/// What is done to find the start pose.
#[derive(Clone, Debug, PartialEq)]
pub enum HomingMethod {
    /// A person sets this pose, described in words, and confirms.
    Pose(String),
    /// Moves, one after the other. The last one ends in the start pose.
    Moves(Vec<HomingMove>),
}

/// What a homing move turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HomingAxis {
    /// One joint, 0 or 1: coupled motors move together.
    Joint(usize),
    /// One motor, 0 or 1.
    Motor(usize),
}

/// One homing move: towards a switch or a stop, back, and towards it again slowly.
///
/// Lengths and speeds are in the units of the axis: rad or mm.
#[derive(Clone, Debug, PartialEq)]
pub struct HomingMove {
    /// What moves.
    pub axis: HomingAxis,
    /// The name of the switch; `None` for a mechanical stop.
    pub switch: Option<String>,
    /// Signed speed of the first approach, units/s.
    pub speed: f64,
    /// Speed of the second approach, units/s; positive.
    pub slow_speed: f64,
    /// How far it moves back from the switch, units; positive.
    pub back_off: f64,
    /// The longest way to the switch, units.
    pub travel: f64,
    /// Time after which the first approach has failed, s.
    pub timeout_s: f64,
}

/// A first approach may take this much longer than the way needs at its speed.
pub const TIMEOUT_FACTOR: f64 = 1.5;

impl HomingMove {
    /// Ticks of each motor per unit of the move, in the positive direction of the axis.
    pub fn ticks_per_unit(&self, machine: &Machine) -> [f64; 2] {
        match self.axis {
            HomingAxis::Joint(joint) => {
                let mut rates = crate::JointPos::ZERO;
                rates[joint] = 1.0;
                machine.motor_rates(&rates).0
            }
            HomingAxis::Motor(motor) => {
                let mut ticks = [0.0; 2];
                ticks[motor] = machine.motors()[motor].ticks_per_unit;
                ticks
            }
        }
    }

    /// The longest time that the move may take in all, s: both approaches and both ways back.
    pub fn longest_s(&self) -> f64 {
        let back_s = self.back_off / self.speed.abs() + self.back_off / self.slow_speed;
        self.timeout_s + back_s + 2.0 * self.back_off / self.slow_speed
    }

    pub(crate) fn validate(&self) -> Result<(), MachineError> {
        MachineError::require_positive("the speed of homing", self.speed.abs())?;
        MachineError::require_positive("the slow_speed of homing", self.slow_speed)?;
        MachineError::require_positive("the back_off of homing", self.back_off)?;
        MachineError::require_positive("the travel of homing", self.travel)?;
        MachineError::require_positive("the timeout of homing", self.timeout_s)
    }
}

impl Homing {
    /// The moves; none for a pose that a person sets.
    pub fn moves(&self) -> &[HomingMove] {
        match &self.method {
            HomingMethod::Pose(_) => &[],
            HomingMethod::Moves(moves) => moves,
        }
    }

    /// Whether a move goes to a mechanical stop instead of a switch.
    pub fn needs_stop(&self) -> bool {
        self.moves().iter().any(|mv| mv.switch.is_none())
    }

    /// The longest time that homing may take, s.
    pub fn longest_s(&self) -> f64 {
        self.moves().iter().map(HomingMove::longest_s).sum()
    }
}
