//! The independent verifier: replays a table of motor ticks and certifies what it draws.
//!
//! It knows forward kinematics, the drawing as placed on the machine (mm), and the table; it shares neither code nor
//! formulas with whatever made the table. Rows are handed in one after the other and forgotten: memory follows the
//! drawing, not the time of the plot.
//!
//! ```text
//! Row --limits--> first and second differences of whole ticks against each motor's speed and acceleration
//!  \--forward kinematics--> the pen's path --trace--> distance to the drawing's strokes, and theirs to the ink
//! ```
//!
//! Every distance is an **upper bound** that is tight to well below the tolerance: what the replay leaves out between
//! two points (the bulge of an arm's path over its chord, the sagitta of a flattened curve) is added, so a
//! certificate that holds is a proof. Units: mm, s or whole microseconds, ticks.

mod certificate;
mod failure;
mod histogram;
mod jerk;
mod limits;
mod target;
mod trace;
mod verifier;

pub use certificate::{Certificate, Deviation, DeviationStats, JerkPeak, MotorPeak, TickFloor};
pub use failure::{Failure, Location, PenMotion, Violation};
pub use verifier::{ExactRow, Verifier, certify};
