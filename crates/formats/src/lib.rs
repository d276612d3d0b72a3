//! One file a format: plans in and out, pictures out.
//!
//! A format knows the plan as data ([`plan::Header`], [`plan::Row`]), the drawing, and [`std::io::Write`]; it does
//! not know how a plan was computed, where its bytes go, or what a machine is. A new format is a new file here.
//!
//! | module | format | writes | reads |
//! |---|---|---|---|
//! | [`ticks`] | tick lines, for any serial sender (the default) | header, rows | table |
//! | [`csv`] | comma-separated values, for every other tool | header, rows | table |
//! | [`json`] | plan document, with machine, settings and certificate | document, header, rows (replayed) | document, table |
//! | [`coaxial_commands`] | seed 1's command file, in ticks or inches | instants | - |
//! | [`xy_serial`] | seed 2's serial lines | instants | - |
//! | [`polar_csv`], [`c_arrays`] | seed 4's table and its program's arrays | instants | - |
//! | [`ebb`] | an EiBotBoard's `LT` or `SM` moves | rows | - |
//! | [`gcode`] | G-code of grbl, FluidNC, Marlin, Klipper | drawing, or instants | - |
//! | [`klipper_steps`] | Klipper's `queue_step` | rows | - |
//! | [`joint_trajectory`] | ROS `JointTrajectory` | instants | - |
//! | [`halstreamer`] | LinuxCNC's streamer columns | instants | - |
//! | [`pvt`] | position, velocity, time | instants | - |
//! | [`points`] | seed 4's points `<x, y>` | - | drawing |
//! | [`svg`] | a drawing as understood | drawing | - |
//! | [`preview`], [`png`] | a picture of a drawing or a plan on its machine | scene | - |
//!
//! Writers of plans stream: they take rows one at a time and hold a block of text, so that memory does not grow with
//! plot time. Readers take the whole file and hold the whole table, never panic whatever the bytes are, and take
//! nothing for whole that was cut off. [`read_plan`] recognises the format by its first bytes.
//!
//! ```
//! use plan::{Header, Limits, Motor, Row};
//!
//! let limits = Limits { speed: 533.3, acceleration: 2666.7, jerk: None };
//! let motors = ["arm1", "arm2"].map(|name| Motor { name: name.to_owned(), limits });
//! let placement = [1.0, 0.0, 0.0, 1.0, 12.7, 76.2];
//! let header =
//!     Header { machine: "coaxial".to_owned(), motors, placement, period_us: 10_000, lift_overlap_us: 0, rows: 2, duration_us: 10_000 };
//! let rows = [Row { t_us: 0, pen: 0, ticks: [800, 0] }, Row { t_us: 10_000, pen: 0, ticks: [801, -1] }];
//!
//! let mut bytes = Vec::new();
//! formats::ticks::write(&header, rows, &mut bytes)?;
//! let file = formats::read_plan(&bytes)?;
//! assert_eq!(file.table.header, header);
//! assert_eq!(file.table.rows, rows);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod c_arrays;
pub mod coaxial_commands;
mod command;
pub mod csv;
pub mod ebb;
mod error;
pub mod gcode;
pub mod halstreamer;
mod header;
pub mod joint_trajectory;
pub mod json;
pub mod klipper_steps;
mod palette;
pub mod png;
pub mod points;
pub mod polar_csv;
mod polar_points;
pub mod preview;
pub mod pvt;
mod sniff;
pub mod svg;
mod text;
pub mod ticks;
pub mod xy_serial;

pub use command::{Command, Instant};
pub use error::{HeaderError, ReadError, RowsError, Unfit, WriteError};
pub use header::check_header;
pub use preview::{Ink, Scene};
pub use sniff::{PlanFile, PlanFormat, looks_like_plan, read_plan};
