//! Calibration of two-motor drawing machines: from touched points to the parameters of the machine.
//!
//! Each touch is a known place on the sheet and the motors' ticks while the pen is there. The
//! parameters of the machine (start pose, place of the sheet, link lengths, belt ratio, counts,
//! anchors) are those for which forward kinematics puts the pen where it was: least squares of
//! `forward(C^-1 (ticks - offset)) - corner - place`, by Levenberg and Marquardt's method.
//!
//! **Gauge.** Turning an arm about its base together with the sheet changes no measurement, so the
//! sheet stays parallel to the machine's axes and the motors' offsets take the rotation.
//!
//! **Backlash.** A motor that came to a touch from lower ticks leads the mechanism by half its backlash, one that
//! came from higher ticks by minus half of it. Where that is known of enough touches the backlash is free.
//!
//! **Order.** Unknowns are freed in groups ([`Setup::unknowns`]): the pose, then lengths and counts,
//! then the belt ratio, as far as there are more measurements than unknowns and the condition of the
//! scaled problem is at most [`LARGEST_CONDITION`].
//!
//! The crate `levenberg-marquardt` is not used: its version 0.15 needs nalgebra 0.34, the workspace has
//! 0.35, and the method is sixty lines for problems of at most ten unknowns.
//!
//! # Examples
//! ```
//! use std::collections::BTreeMap;
//! use std::f64::consts::TAU;
//!
//! use calibration::{Measurements, Options, Parameter, Setup, Touch, fit};
//! use drawing::Point;
//!
//! let arm = Setup {
//!     kind: Setup::kind_of("two-link").unwrap(),
//!     geometry: BTreeMap::from([
//!         ("l1".into(), Parameter::Length(206.0)),
//!         ("l2".into(), Parameter::Length(256.0)),
//!         ("elbow".into(), Parameter::Choice("left".into())),
//!     ]),
//!     coupling: [[1.0, 0.0], [0.0, -1.0]],
//!     ticks_per_unit: [3200.0 / TAU; 2],
//!     offset_ticks: [0.0, 800.0],
//!     backlash_ticks: [0.0; 2],
//!     corner: Point::new(12.7, 76.2),
//!     sheet_mm: [215.9, 279.4],
//! };
//! // The arm as it is: started a little off, and with a longer first link.
//! let mut hidden = arm.clone();
//! hidden.offset_ticks = [20.0, 770.0];
//! hidden.geometry.insert("l1".into(), Parameter::Length(207.0));
//! let corners = [(0.0, 0.0), (215.9, 0.0), (215.9, 279.4), (0.0, 279.4)];
//! let touches = corners.map(|(x, y)| {
//!     let place = Point::new(x, y);
//!     Touch { place, ticks: hidden.ticks(place, [0.0; 2]).unwrap(), approach: [0.0; 2], elbow_left: None }
//! });
//! let data = Measurements { touches: touches.into(), distances: Vec::new() };
//! let found = fit(&arm, &data, &Options::default())?;
//! assert!((found.setup.offset_ticks[0] - 20.0).abs() < 1e-3);
//! assert!(found.rms_mm < 1e-6);
//! # Ok::<(), calibration::CalibrationError>(())
//! ```

mod alternatives;
mod fit;
mod minimize;
mod setup;

pub use alternatives::{Alternative, alternatives};
pub use fit::{
    CalibrationError, Distance, Fit, Helpful, LARGEST_CONDITION, LeftOut, Measurements, Options, PageError,
    Touch, Value, fit,
};
pub use setup::{InvalidSetup, Parameter, Setup, Unknown};
