//! Backends: what plans become for each firmware, how they are sent, and an emulated device to test senders with.
//!
//! One folder (or file) a firmware, each with an implementation of [`Backend`]; [`ALL`] lists them. The command line, the
//! documentation's tables and the conformance tests are made from that list. [`transmission`] holds the strategies that
//! sessions share; they know no firmware.

mod backend;
mod coaxial;
mod device;
mod ebb;
mod error;
mod fault_injection;
pub mod gcode;
mod halstreamer;
pub mod homing;
mod ink;
mod joint_trajectory;
mod klipper_steps;
pub mod pen_plotter;
mod polar;
mod position_query;
pub mod program;
mod pvt;
mod retime;
mod session;
mod setpoint;
pub mod simulate;
pub mod status;
mod tick_lines;
pub mod transmission;
mod xy_serial;

pub use backend::{
    Backend, EmulatorOptions, EncodeOptions, InkFrame, Loss, PenActuator, PenNumbers, PlanSource, RowIter,
    SessionOptions,
};
pub use device::{Device, Port};
pub use error::{Unrepresentable, WriteError};
pub use fault_injection::{Fault, FaultInjector};
pub use ink::Ink;
pub use position_query::{PositionQuery, ReportedPosition};
pub use program::{Line, Program, ProgramError};
pub use session::{Outcome, Progress, Session, Waiting};
pub use setpoint::Setpoint;

/// Every backend, in the order of the command line's help.
pub const ALL: &[&dyn Backend] = &[
    &tick_lines::Answered,
    &coaxial::Commands::Ticks,
    &coaxial::Commands::Inches,
    &xy_serial::XySerial,
    &polar::PolarCsv,
    &polar::CArrays,
    &ebb::Ebb::Timed,
    &ebb::Ebb::Stepper,
    &gcode::Paths(gcode::Flavour::Grbl),
    &gcode::Paths(gcode::Flavour::FluidNc),
    &gcode::Paths(gcode::Flavour::Marlin),
    &gcode::Paths(gcode::Flavour::Klipper),
    &gcode::Timed,
    &klipper_steps::KlipperSteps,
    &joint_trajectory::JointTrajectory,
    &halstreamer::Halstreamer,
    &pvt::Pvt,
    &pen_plotter::HpGlPlotter,
    &tick_lines::Raw,
    &tick_lines::Paced,
];

/// The backend of this name.
pub fn find(name: &str) -> Option<&'static dyn Backend> {
    ALL.iter().copied().find(|backend| backend.name() == name)
}
