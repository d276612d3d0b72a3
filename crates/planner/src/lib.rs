//! From strokes to motor ticks against time.
//!
//! ```text
//! Stroke --path--> smooth sections (mm) --lift--> joint path --time_law--> profile --trajectory--> rows of ticks
//! ```
//! 1. [`path`]: a stroke becomes smooth **sections**: fewer pieces within the tolerance, corners as parabolas. The pen rests
//!    only where it turns back.
//! 2. [`joint_path`]: a section is lifted into joint space as a [`JointPath`]: **cells** with the motors' first and second
//!    derivatives along it at start, middle and end, and how much rows bend against it.
//! 3. [`time_parametrization`]: along a joint path, the fastest speed profile that the motors and the rows allow, from rest to rest.
//! 4. `stroke`: the three for one stroke, from one of the poses in which the machine can begin it.
//! 5. [`trajectory`]: strokes, travel in joint space, pen lifts and drops one after the other, sampled at a fixed
//!    period into rows whose ticks are rounded from exact positions, so that nothing drifts.
//!
//! Drawings come in machine mm (see [`placement`]). Nothing here knows HPGL, formats or files.

mod error;
pub mod joint_path;
pub mod path;
pub mod placement;
pub mod settings;
mod stroke;
pub mod time_parametrization;
pub mod trajectory;
mod travel;

pub use error::PlanError;
pub use joint_path::JointPath;
pub use settings::{Law, Settings};
pub use time_parametrization::{Easing, LimitingConstraints};
pub use trajectory::{ExactRow, Times, Trajectory, check_reach, plan};
pub use travel::{travel_pose, travel_time};
