//! From strokes to motor ticks against time.
//!
//! ```text
//! Stroke --path--> smooth sections (mm) --lift--> joint path --time_law--> profile --trajectory--> rows of ticks
//! ```
//! 1. [`path`]: a stroke's pieces are cleaned and cut into **sections** at every corner: the pen rests between sections.
//! 2. [`lift`]: a section is lifted into joint space as a [`JointPath`]: **cells** on which the pen's curve, the motors'
//!    first and second derivative along it, and the bend between rows are bounded.
//! 3. [`time_law`]: along a joint path, the fastest speed profile that those bounds allow, from rest to rest.
//! 4. [`trajectory`]: sections, travel in joint space, pen lifts and drops one after the other, sampled at a fixed
//!    period into rows whose ticks are rounded from exact positions, so that nothing drifts.
//!
//! Drawings come in machine mm (see [`placement`]). Nothing here knows HPGL, formats or files.

mod error;
pub mod lift;
pub mod path;
pub mod placement;
pub mod time_law;
pub mod trajectory;
mod travel;

pub use error::PlanError;
pub use lift::JointPath;
pub use trajectory::{ExactRow, Settings, Times, Trajectory, check_reach, plan};
pub use travel::{travel_pose, travel_time};
