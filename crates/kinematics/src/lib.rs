//! Planar two-axis machines: how a pair of motors moves a pen over a sheet.
//!
//! One model for all machines: `pen = FK(q)` and `ticks = ticks_per_unit * (C q) + offset`. `q` are
//! the two **joints** of the [`Mechanism`] (x and y; the absolute angles of two links; angle and
//! radius), `C` is an invertible 2 x 2 **coupling matrix** (the identity, the sums and differences
//! of CoreXY, a belt that carries one angle into the other motor), and `ticks_per_unit` converts
//! joint units into the motors' own smallest command units, here called ticks.
//!
//! Units: mm, rad, s, ticks. Angles are counterclockwise from +x. Everything here is a pure function
//! of its arguments and independent of trajectories, files and formats. The equations are in each
//! mechanism's file, with their source.
//!
//! # Examples
//! Inverse and forward kinematics of a two-link arm:
//! ```
//! use drawing::Point;
//! use kinematics::{Mechanism, TwoLink, Unreachable};
//!
//! let arm = TwoLink { l1_mm: 200.0, l2_mm: 250.0, elbow_left: true };
//! let q = arm.inverse(Point::new(120.0, 300.0))?;
//! let p = arm.forward(&q);
//! assert!((p.x - 120.0).abs() < 1e-9 && (p.y - 300.0).abs() < 1e-9);
//! // The elbow on the left: the second link is turned clockwise from the first.
//! assert!(q[1] < q[0]);
//! assert_eq!(arm.inverse(Point::new(0.0, 460.0)), Err(Unreachable::TooFar(10.0)));
//! # Ok::<(), Unreachable>(())
//! ```
//!
//! A machine from its parts, and the quantization of the pen's position by whole ticks:
//! ```
//! use std::f64::consts::TAU;
//!
//! use drawing::{Point, Rect};
//! use kinematics::{Machine, MachineParts, Motor, MotorPos, TwoLink};
//!
//! let arm = TwoLink { l1_mm: 200.0, l2_mm: 250.0, elbow_left: true };
//! // 3200 ticks per revolution, 1 rad/s, 5 rad/s².
//! let motors = ["shoulder", "elbow"].map(|name| Motor::new(name, 3200.0 / TAU, 1.0, 5.0));
//! let sheet = Rect::new(50.0, 150.0, 250.0, 350.0);
//! let machine = Machine::new(MachineParts {
//!     // The second motor turns the second link's absolute angle, clockwise.
//!     coupling: [[1.0, 0.0], [0.0, -1.0]],
//!     ..MachineParts::new("arm", arm, motors, sheet)
//! })?;
//!
//! let p = Point::new(120.0, 300.0);
//! let q = machine.pose_near(p, &machine.start())?;
//! let ticks = MotorPos(<[f64; 2]>::from(machine.motor_positions(&q)).map(f64::round));
//! let error = (machine.forward_from_motors(&ticks) - p).hypot2().sqrt();
//! assert!(error > 0.0 && error <= machine.quantization_error(&q));
//! // Which points and segments can be drawn.
//! assert!(machine.check_point(p).is_ok());
//! assert!(machine.check_point(Point::new(10.0, 10.0)).is_err());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod coupling;
mod homing;
mod linkage;
mod machine;
pub mod mechanism;
mod play;
mod position;
mod reach;
mod workspace;

pub use coupling::{Coupling, SingularCoupling};
pub use homing::{Homing, HomingAxis, HomingMethod, HomingMove, TIMEOUT_FACTOR};
pub use linkage::{Anchor, JointAffine, Linkage, Part, PartKind};
pub use machine::{JointRange, Machine, MachineError, MachineParts, Motor, PenLimits, PenServo, Quantity};
pub use mechanism::{Cartesian, FiveBar, JointKind, Mechanism, Polar, Polargraph, TwoLink, Unreachable};
pub use play::{Corners, Play};
pub use position::{JointPos, MotorPos};
pub use reach::{Fault, OutOfReach};
pub use workspace::reach_outlines;
