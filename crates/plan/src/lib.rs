//! The joint-space plan as data: a table of motor ticks against time, whole numbers throughout.
//!
//! This is what the planner hands over, the verifier replays and the formats write. It knows neither machines nor
//! drawings nor files. Every machine of plotplan moves a pen in a plane with as many motors as the plane has
//! dimensions, so a row holds two motor positions. [`mod@file`] reads and writes plans.
//!
//! ```
//! use plan::{Header, Limits, Motor, Rounding, Row, file};
//!
//! let limits = Limits { speed: 533.3, acceleration: 2666.7, jerk: None };
//! let motors = ["arm1", "arm2"].map(|name| Motor { name: name.to_owned(), limits });
//! let placement = [1.0, 0.0, 0.0, 1.0, 12.7, 76.2];
//! let header =
//!     Header { machine: "coaxial".to_owned(), motors, placement, period_us: 10_000, lift_overlap_us: 0, rounding: Rounding::Path, rows: 2, duration_us: 10_000,
//!         pen_colors: [(2, [204, 0, 0])].into() };
//! let rows = [Row { t_us: 0, pen: 0, ticks: [800, 0] }, Row { t_us: 10_000, pen: 0, ticks: [801, -1] }];
//!
//! let mut bytes = Vec::new();
//! file::tick_lines::write(&header, rows, &mut bytes)?;
//! let read = file::read(&bytes)?;
//! assert_eq!(read.table.header, header);
//! assert_eq!(read.table.rows, rows);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod file;

use std::collections::BTreeMap;

/// How many motors move the pen: as many as the plane has dimensions, since the coupling is invertible.
pub const MOTORS: usize = 2;

/// One instant of a plan.
///
/// Motors move linearly from each row to the next; `pen` holds from this row to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Time since the plan's start, in whole microseconds; strictly increasing from 0.
    pub t_us: u64,
    /// 0 for pen up, otherwise the number of the pen that is down.
    pub pen: u16,
    /// Absolute position of each motor, in its own smallest command unit.
    pub ticks: [i64; MOTORS],
}

/// The limits that one motor's column obeys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest speed, ticks/s.
    pub speed: f64,
    /// Largest acceleration, ticks/s^2.
    pub acceleration: f64,
    /// Largest jerk, ticks/s^3, where the machine states one.
    pub jerk: Option<f64>,
}

/// One motor's column.
#[derive(Clone, Debug, PartialEq)]
pub struct Motor {
    /// The motor's name, which heads its column.
    pub name: String,
    /// The limits the plan was made under.
    pub limits: Limits,
}

/// How rows take whole ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rounding {
    /// The nearest ticks: within 0.5 of the exact position.
    #[default]
    Nearest,
    /// Ticks within 1.5 of the exact position, so that motion between rows stays near the path.
    Path,
}

impl Rounding {
    /// Its name in plan files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nearest => "nearest",
            Self::Path => "path",
        }
    }

    /// The rounding of this name.
    pub fn of_name(name: &str) -> Option<Self> {
        [Self::Nearest, Self::Path].into_iter().find(|rounding| rounding.name() == name)
    }

    /// Largest distance of a row from its exact position, ticks of each motor.
    pub fn farthest_ticks(self) -> f64 {
        match self {
            Self::Nearest => 0.5,
            Self::Path => 1.5,
        }
    }
}

/// What is true of a whole plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Name of the machine the plan is for.
    pub machine: String,
    /// The motors, in the order of the columns.
    pub motors: [Motor; MOTORS],
    /// Coefficients `a b c d e f` of the map from drawing mm to machine mm: `x' = a x + c y + e`, `y' = b x + d y + f`.
    pub placement: [f64; 6],
    /// Time between rows while anything moves, in whole microseconds.
    pub period_us: u64,
    /// For how much of the time that a lift takes the motors may already travel, in microseconds; mostly 0.
    pub lift_overlap_us: u64,
    /// How the rows take whole ticks.
    pub rounding: Rounding,
    /// Red, green and blue of the pens whose colours the drawing states, by pen number.
    pub pen_colors: BTreeMap<u16, [u8; 3]>,
    /// How many rows there are.
    pub rows: u64,
    /// Time of the last row, in microseconds.
    pub duration_us: u64,
}

/// A whole plan in memory, as read back from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct TickTable {
    /// What is true of the whole plan.
    pub header: Header,
    /// The rows, in the order of time.
    pub rows: Vec<Row>,
}
