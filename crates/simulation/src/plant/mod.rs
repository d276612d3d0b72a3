//! Plants: what a motor and the machine behind it do with a command. One plant is one file.
//!
//! A [`Motor`] moves one motor coordinate. DC motors take a duty in percent; steppers, RC servos and
//! ideal drives take a position in ticks. A [`Plant`] is the pair of motors: independent of each other
//! ([`Independent`]), or coupled by the inertia of an arm ([`Arm`]).

mod arm;
mod backlash;
mod dc;
mod ideal;
mod rc_servo;
mod stepper;

use std::fmt::Debug;

pub use arm::{Arm, ArmInertia, ArmMotor, LinkInertia};
pub use backlash::Backlash;
pub use dc::{DcMotor, DcParameters, DcSheet, STICTION_BAND_TICKS_S};
pub use ideal::Ideal;
pub use rc_servo::{RcServo, RcServoParameters};
pub use stepper::{Stepper, StepperParameters};

/// The fixed step of every simulation, s.
pub const STEP_S: f64 = 2e-4;

/// One motor with its load.
pub trait Motor: Debug {
    /// Advances by whole steps of [`STEP_S`] while the command (% of duty, or ticks) is constant.
    fn advance(&mut self, command: f64, steps: u32);

    /// Position on the motor's side, where the encoder is, ticks.
    fn position(&self) -> f64;

    /// Speed on the motor's side, ticks/s.
    fn speed(&self) -> f64;

    /// Position of the load, ticks: behind the backlash, if there is one.
    fn load(&self) -> f64 {
        self.position()
    }

    /// Current while `duty` (%) is applied, A; 0 for plants without a model of it.
    fn current_a(&self, _duty: f64) -> f64 {
        0.0
    }

    /// Steps lost, in ticks; 0 for motors that cannot lose any.
    fn lost_ticks(&self) -> f64 {
        0.0
    }

    /// The largest share of the available torque that was needed, and the largest speed beyond the
    /// data of the motor, ticks/s; `None` for motors without such data.
    fn torque_margin(&self) -> Option<(f64, f64)> {
        None
    }
}

/// The pair of motors.
pub trait Plant: Debug {
    /// Advances both motors by whole steps of [`STEP_S`] with constant commands.
    fn advance(&mut self, commands: [f64; 2], steps: u32);

    /// Positions on the motors' side, ticks.
    fn positions(&self) -> [f64; 2];

    /// Speeds on the motors' side, ticks/s.
    fn speeds(&self) -> [f64; 2];

    /// Positions of the loads, ticks.
    fn loads(&self) -> [f64; 2] {
        self.positions()
    }

    /// Currents under these duties, A.
    fn currents_a(&self, duties: [f64; 2]) -> [f64; 2];

    /// See [`Motor::lost_ticks`].
    fn lost_ticks(&self) -> [f64; 2] {
        [0.0; 2]
    }

    /// See [`Motor::torque_margin`].
    fn torque_margins(&self) -> [Option<(f64, f64)>; 2] {
        [None; 2]
    }
}

/// Two motors that do not influence each other.
#[derive(Debug)]
pub struct Independent(pub [Box<dyn Motor>; 2]);

impl Independent {
    fn both<T>(&self, of: impl Fn(&dyn Motor) -> T) -> [T; 2] {
        self.0.each_ref().map(|motor| of(&**motor))
    }
}

impl Plant for Independent {
    fn advance(&mut self, commands: [f64; 2], steps: u32) {
        for (motor, command) in self.0.iter_mut().zip(commands) {
            motor.advance(command, steps);
        }
    }

    fn positions(&self) -> [f64; 2] {
        self.both(|motor| motor.position())
    }

    fn speeds(&self) -> [f64; 2] {
        self.both(|motor| motor.speed())
    }

    fn loads(&self) -> [f64; 2] {
        self.both(|motor| motor.load())
    }

    fn currents_a(&self, duties: [f64; 2]) -> [f64; 2] {
        [self.0[0].current_a(duties[0]), self.0[1].current_a(duties[1])]
    }

    fn lost_ticks(&self) -> [f64; 2] {
        self.both(|motor| motor.lost_ticks())
    }

    fn torque_margins(&self) -> [Option<(f64, f64)>; 2] {
        self.both(|motor| motor.torque_margin())
    }
}
