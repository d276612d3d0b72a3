//! Machines: how a pair of motors holds a pen over a sheet.
//!
//! One model for all of them: `pen = FK(q)` and `ticks = ticks_per_unit * (C q) + offset`. `q` are the two **geometric joints**
//! (x and y; the absolute angles of two links; angle and radius), `C` is any invertible 2 x 2 **coupling matrix**
//! (the identity, CoreXY's sums and differences, a belt that carries one angle into the other motor), `ticks_per_unit` turns
//! joint units into the motors' own smallest command units, here called ticks whatever they are.
//!
//! Units: mm, rad, s, ticks. Angles are counterclockwise from +x. Everything here is a pure function of its arguments;
//! nothing knows time laws, files or formats. Mathematics: each geometry's file, with its source.

mod coupling;
pub mod geometry;
mod machine;
mod position;
mod reach;
mod workspace;

pub use coupling::{Coupling, SingularCoupling};
pub use geometry::{Cartesian, Geometry, Polar, TwoLink, Unreachable};
pub use machine::{Joint, Machine, MachineError, MachineParts, Motor, PenLimits};
pub use position::{JointPos, MotorPos};
pub use reach::{Fault, OutOfReach};
pub use workspace::reach_outlines;
