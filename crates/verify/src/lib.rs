//! The verifier: replays a table of motor ticks and certifies what it draws.
//!
//! Input is the machine, the drawing as placed on the machine (mm), and the table, row by row. With
//! the planner it shares the machine model (forward kinematics and limits, crate `kinematics`) and
//! the geometry of strokes (crate `drawing`), and no other code; `tests/replay.rs` of the workspace
//! checks that model independently, with forward kinematics of its own. Memory depends on the
//! drawing, not on the duration of the plan.
//!
//! ```text
//! Row --limits--> first, second, third differences of ticks against the motors' limits
//!  \--forward kinematics--> pen path --trace--> distance ink to drawing and drawing to ink
//! ```
//!
//! All limits are those of the machine. The header of a plan provides the time between rows only;
//! [`mismatches`] lists where it contradicts the machine.
//!
//! Every distance is an **upper bound**, tight to a small part of the tolerance: what the replay
//! leaves out between two points (chord errors of an arm's path and of curves) is added. Units: mm,
//! s, us, ticks.
//!
//! ```
//! use drawing::{Drawing, Pen, Point, Rect, Span, Stroke};
//! use kinematics::{Cartesian, JointPos, Machine, MachineParts, Motor, PenLimits};
//! use plan::{Rounding, Row};
//! use verify::{Timing, Violation, certify};
//!
//! // A Cartesian machine: 10 ticks/mm, at most 1000 ticks/s and 10,000 ticks/s².
//! let motors = [Motor::new("x", 10.0, 1e3, 1e4), Motor::new("y", 10.0, 1e3, 1e4)];
//! let sheet = Rect::new(0.0, 0.0, 100.0, 100.0);
//! let machine = Machine::new(MachineParts {
//!     pen: PenLimits {
//!         max_speed_mm_s: 100.0,
//!         max_travel_speed_mm_s: f64::INFINITY,
//!         lift_time_s: 0.1,
//!         drop_time_s: 0.1,
//!     },
//!     start: JointPos::ZERO,
//!     ..MachineParts::new("table", Cartesian, motors, sheet)
//! })?;
//! // Down, 10 mm along x and back, up. Rows are 0.1 s apart; each step has 50 ticks.
//! let ends = vec![Point::new(0.0, 0.0), Point::new(10.0, 0.0)];
//! let stroke = Stroke::polyline(Pen(1), ends, Span::default()).expect("two points");
//! let drawing = Drawing::from(vec![stroke]);
//! let ticks = [0, 0, 0, 50, 100, 50, 0, 0, 0];
//! let mut rows: Vec<Row> = (0..9)
//!     .map(|k| {
//!         let pen = u16::from((1..7).contains(&k));
//!         Row { t_us: 100_000 * k, pen, ticks: [ticks[k as usize], 0] }
//!     })
//!     .collect();
//! let timing = Timing { period_us: 100_000, lift_overlap_us: 0, rounding: Rounding::Nearest };
//! let verify = |rows: &[Row]| {
//!     certify(&machine, &drawing, timing, 0.1, || rows.iter().map(|row| (*row, None)))
//! };
//!
//! let certificate = verify(&rows);
//! assert!(certificate.holds, "{:?}", certificate.failures);
//! assert!((certificate.ink_mm - 20.0).abs() < 1e-9);
//! assert!((certificate.motors[0].whole_tick_speed_ticks_s - 500.0).abs() < 1e-9);
//!
//! // One row that is 3 mm off the line: the ink deviates there.
//! rows[4].ticks[1] = 30;
//! let certificate = verify(&rows);
//! assert!(!certificate.holds);
//! let failure = &certificate.failures[0];
//! assert!(matches!(failure.violation, Violation::Deviates { pen: 1, .. }), "{failure}");
//! assert!((certificate.after_rounding.max_mm() - 3.0).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod certificate;
mod cover;
mod failure;
mod follow;
mod histogram;
mod jerk;
mod limits;
mod mismatch;
mod near;
mod quantization;
mod run;
mod target;
mod trace;
mod verifier;

pub use certificate::{Certificate, Deviation, DeviationStats, JerkPeak, MotorPeak, QuantizationError};
pub use failure::{Failure, Location, PenMotion, Violation};
pub use mismatch::{Mismatch, mismatches};
pub use verifier::{ExactRow, Timing, Verifier, certify, certify_with_progress};
