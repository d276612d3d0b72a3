//! Firmwares: what plans become for each, how to send it, and an emulated device to try it on.

pub mod asking;
pub mod blind;
pub mod c_arrays;
pub mod coaxial_commands;
mod command;
pub mod conversation;
pub mod device;
pub mod ebb;
mod error;
pub mod gcode;
pub mod halstreamer;
pub mod ink;
pub mod joint_trajectory;
pub mod klipper_steps;
pub mod locating;
pub mod numbered;
pub mod polar_csv;
mod polar_points;
pub mod pvt;
pub mod repeating;
mod retime;
pub mod script;
pub mod simulate;
pub mod xy_serial;

pub use command::{Command, Instant};
pub use conversation::{Conversation, Outcome, Progress};
pub use error::{Unfit, WriteError};
pub use ink::Ink;
pub use script::{Dialect, Script, ScriptError, Step};
