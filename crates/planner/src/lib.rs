//! Plans the motion of a drawing machine: from strokes to motor ticks against time.
//!
//! ```text
//! Stroke --path--> smooth sections (mm) --joint_path--> joint path --time_parametrization-->
//!     velocity profile --trajectory--> rows of ticks
//! ```
//! 1. `path`: a stroke becomes smooth **sections**: redundant vertices are removed within the
//!    tolerance, corners are blended with parabolas, or with cubic splines where jerk is limited.
//!    The pen stops only at reversals. Or it becomes one spline within the tolerance (`path::fit`),
//!    if that is faster.
//! 2. `joint_path`: inverse kinematics along a section gives a joint path, divided into **grid
//!    intervals** with the motors' first and second derivatives at start, middle and end, and a
//!    bound on how far linear motion between rows leaves the path.
//! 3. `time_parametrization`: the fastest velocity profile along a joint path, from rest to rest,
//!    under the limits of the motors, of the pen and of linear motion between rows.
//! 4. `stroke`: steps 1 to 3 for one stroke, from one of the poses in which the machine can begin.
//! 5. `trajectory`: strokes, travel in joint space, pen lifts and drops in sequence, sampled at a
//!    fixed period.
//! 6. `rounding`: whole ticks for each row, chosen so that motion between rows stays near the path.
//!    Each row is within 1.5 ticks of its exact position, so rounding errors do not accumulate.
//!
//! [`plan()`] expects a drawing in machine mm; [`place`] maps drawing mm to machine mm. This
//! crate knows neither HPGL nor output formats nor files.
//!
//! # Example
//! From a machine and a line to rows of ticks, and a line out of reach:
//! ```
//! use drawing::{Drawing, Pen, Point, Rect, Span, Stroke};
//! use kinematics::{Cartesian, JointRange, Machine, MachineParts, Mechanism as _, Motor};
//! use planner::{PlanError, Settings, plan};
//!
//! let motors = ["x", "y"].map(|name| Motor::new(name, 80.0, 100.0, 1000.0));
//! let sheet = Rect::new(0.0, 0.0, 300.0, 300.0);
//! let mut parts = MachineParts::new("table", Cartesian, motors, sheet);
//! parts.joints = [JointRange { min: 0.0, max: 300.0 }; 2];
//! parts.start = Cartesian.inverse(Point::ZERO)?;
//! let machine = Machine::new(parts)?;
//! let line = |to: Point| -> Option<Drawing> {
//!     let points = vec![Point::new(10.0, 10.0), to];
//!     Some(Drawing::from(vec![Stroke::polyline(Pen(1), points, Span::default())?]))
//! };
//! let settings = Settings::new(0.1, 10_000);
//!
//! let drawing = line(Point::new(60.0, 10.0)).expect("two points");
//! let trajectory = plan(&machine, drawing, &settings)?;
//! let highest = trajectory.rows().map(|row| row.row.ticks[0]).max();
//! assert_eq!(highest, Some(60 * 80));
//! assert_eq!(trajectory.rows().last().map(|row| row.row.ticks), Some([0, 0]));
//!
//! let drawing = line(Point::new(301.0, 10.0)).expect("two points");
//! let error = plan(&machine, drawing, &settings).expect_err("x goes to 300 mm");
//! assert!(matches!(error, PlanError::OutOfReach { stroke: 0, .. }));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![cfg_attr(
    not(feature = "unstable"),
    allow(unreachable_pub, reason = "the feature `unstable` exports these items")
)]

mod backlash;
mod error;
mod joint_path;
mod path;
mod placement;
mod rounding;
mod settings;
mod stroke;
mod time_parametrization;
mod trajectory;
mod travel;

pub use error::PlanError;
pub use placement::{Mirror, PlacementOptions, Scale, Surface, beyond_sheet_mm, place};
pub use plan::Rounding;
pub use settings::{Settings, TimingLaw};
pub use time_parametrization::{Easing, LimitingConstraints};
pub use trajectory::{ExactRow, Rows, Times, Trajectory, check_reach, plan, plan_with_progress};
pub use travel::{travel_pose, travel_time};

/// The planner's stages one by one, for benchmarks, reference tests and pictures. No stability is
/// promised: these items change whenever the planner does.
#[cfg(feature = "unstable")]
pub mod unstable {
    pub use crate::joint_path::{GridInterval, JointPath, PathGeometry};
    pub use crate::path::{Aim, Limits, fitted};
    pub use crate::path::{CornerBlend, PathBudget, Piece, Section, sections};
    pub use crate::time_parametrization::{Phase, Profile, SpeedCap, profile, profile_on_grid};
}
