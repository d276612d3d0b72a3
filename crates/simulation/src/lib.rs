//! Simulates the drives of a two-motor drawing machine: what it will draw before it is built.
//!
//! A plan says where the motors should be. [`simulate`] follows it with a [`Drive`]: a plant for each
//! motor ([`plant`]), a feedback loop with feed-forward ([`controller`]), encoders, backlash, and the
//! way the firmware turns rows into setpoints. [`InkRecorder`] turns the motion into ink and compares
//! it with the drawing. [`margins()`] gives the stability margins of a loop, [`step_response()`] its
//! response to a step, [`identify()`] the parameters of a motor from a recorded response, and
//! [`tune`] the gains with the least ink error.
//!
//! Fixed step of 0.2 ms, no clock, no random numbers, transcendental functions from `libm`: the same
//! bytes on every platform. Units: ticks, s, % of duty, mm; SI where masses are given.
//!
//! ```
//! use simulation::plant::{DcMotor, DcParameters, Motor as _};
//!
//! // The first report's motor without load: 106.67 ticks/s per percent of duty.
//! let parameters = DcParameters::first_order(106.67, 0.035).with_friction(2.5, 2.5);
//! let mut motor = DcMotor::new(parameters, 0.0);
//! motor.advance(2.5, 5000);
//! assert_eq!(motor.position(), 0.0);
//! motor.advance(50.0, 5000);
//! assert!((motor.speed() - 106.67 * 47.5).abs() < 1e-3);
//! ```

pub mod controller;
mod drive;
mod identify;
mod ink;
mod margins;
pub mod plant;
mod run;
mod setpoint;
mod step_response;
pub mod tune;

pub use controller::{AntiWindup, CascadeGains, FeedForward, MotorModel, PidGains};
pub use drive::{Drive, DriveError, Feedback, MotorDrive, MotorPlant};
pub use identify::{Estimate, Identified, IdentifyError, Recorded, identify};
pub use ink::{Distances, InkError, InkRecorder, Tails, Target, Worst};
pub use margins::{Margins, margins};
pub use plant::{
    ArmInertia, DcParameters, DcSheet, LinkInertia, RcServoParameters, STEP_S, StepperParameters,
};
pub use run::{Job, MotorOutcome, Outcome, Sample, SimulationError, simulate, vertices};
pub use setpoint::{SetpointKind, Vertex};
pub use step_response::{StepPoint, StepResponse, step_response};
