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

mod coupling;
mod machine;
pub mod mechanism;
mod position;
mod reach;
mod workspace;

pub use coupling::{Coupling, SingularCoupling};
pub use machine::{JointRange, Machine, MachineError, MachineParts, Motor, PenLimits, Quantity};
pub use mechanism::{Cartesian, JointKind, Mechanism, Polar, TwoLink, Unreachable};
pub use position::{JointPos, MotorPos};
pub use reach::{Fault, OutOfReach};
pub use workspace::reach_outlines;
