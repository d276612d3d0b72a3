//! The compiler from pen-plotter drawings to motor motion: the front door of the house.
//!
//! [`machine_file`] reads machines, [`pipeline`] takes a drawing from bytes to a certified plan, [`report`] says what
//! came of it. The binary beside it parses the command line and talks to the terminal; everything else is in the
//! crates below: `hpgl`, `ordering`, `kinematics`, `planner`, `verify`, `formats`.

pub mod machine_file;
pub mod pipeline;
pub mod quantity;
pub mod report;
