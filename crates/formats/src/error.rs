//! What can go wrong on the way out and on the way in.

use std::io;

/// Why a plan's header cannot be written in any format.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HeaderError {
    /// The machine's name is empty, too long, or has characters that a sender may act on.
    #[error(
        "the machine's name {0:?} is not 1 to 48 letters, digits, spaces or any of `_ . + - /` (ASCII, no space at either end)"
    )]
    MachineName(String),
    /// A motor's name is empty, too long, or has characters that a column's name cannot have.
    #[error(
        "the motor's name {0:?} is not a letter followed by up to 19 letters, digits or any of `_ . -` (ASCII)"
    )]
    MotorName(String),
    /// Two columns of the table would have the same name.
    #[error("two columns of the plan are named {0:?}")]
    SameName(String),
    /// A coefficient of the placement or a limit is infinite or not a number.
    #[error("{0} is not a finite number")]
    NotFinite(&'static str),
}

/// Why a format cannot say what a plan asks for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unfit {
    /// A point lies where the firmware takes no commands.
    #[error("row {row} is at {x:.2}, {y:.2} mm; {format} takes {range}")]
    Range {
        /// Number of the row.
        row: u64,
        /// Where the pen is, mm.
        x: f64,
        /// Where the pen is, mm.
        y: f64,
        /// The format's name.
        format: &'static str,
        /// What it takes.
        range: &'static str,
    },
    /// The format has no pen: everything is one line.
    #[error(
        "{format} cannot lift the pen, and this drawing lifts it between {strokes} strokes; what lies between them would be drawn"
    )]
    NoPenLift {
        /// The format's name.
        format: &'static str,
        /// How many strokes there are.
        strokes: u64,
    },
    /// A motor is faster than the firmware can step.
    #[error("row {row} needs {steps} steps in {us} us; {format} makes at most {most} a second")]
    TooFast {
        /// Number of the row.
        row: u64,
        /// How many steps.
        steps: u64,
        /// In which time, microseconds.
        us: u64,
        /// The format's name.
        format: &'static str,
        /// Most steps a second.
        most: u64,
    },
    /// The time between rows is shorter than the firmware's own clock.
    #[error("row {row} lasts {us} us, less than {format} can say ({least} us); plan with a longer --period")]
    TooShort {
        /// Number of the row.
        row: u64,
        /// How long it lasts, microseconds.
        us: u64,
        /// The format's name.
        format: &'static str,
        /// The shortest time, microseconds.
        least: u64,
    },
    /// Rows are not one period apart, and the format knows nothing but periods.
    #[error("row {row} is not a whole number of periods ({period_us} us) after the one before it")]
    Uneven {
        /// Number of the row.
        row: u64,
        /// The period, microseconds.
        period_us: u64,
    },
}

/// Why rows do not make a plan.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RowsError {
    /// A plan has at least the row of its start.
    #[error("there are no rows")]
    None,
    /// The first row is not at time 0.
    #[error("the first row is at {t_us} us, not at 0")]
    Start {
        /// The first row's time, microseconds.
        t_us: u64,
    },
    /// A row is not later than the one before it.
    #[error("row {row} is at {t_us} us, not later than the row before it ({before_us} us)")]
    Order {
        /// Number of the row, the first being 0.
        row: u64,
        /// Its time, microseconds.
        t_us: u64,
        /// The time of the row before it, microseconds.
        before_us: u64,
    },
    /// The number of rows is not what the header says.
    #[error("there are {found} rows, but the header says {stated}")]
    Count {
        /// What the header says.
        stated: u64,
        /// How many there are (or one more than stated, where more follow).
        found: u64,
    },
    /// The last row is not at the duration that the header says.
    #[error("the last row is at {found_us} us, but the header says {stated_us} us")]
    Duration {
        /// What the header says, microseconds.
        stated_us: u64,
        /// The last row's time, microseconds.
        found_us: u64,
    },
}

/// Why a plan was not written to its end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The header cannot be said in a plan file; nothing was written.
    #[error(transparent)]
    Header(#[from] HeaderError),
    /// The rows are not what the header promises; what was written is no whole plan, and reads as such.
    #[error(transparent)]
    Rows(#[from] RowsError),
    /// A tick line would be longer than [`ticks::LINE_BYTES`](crate::ticks::LINE_BYTES).
    #[error("row {row} needs a tick line of {bytes} bytes, more than serial senders take")]
    LineTooLong {
        /// Number of the row, the first being 0.
        row: u64,
        /// Length of the line.
        bytes: usize,
    },
    /// The format cannot say what the plan asks for.
    #[error(transparent)]
    Unfit(#[from] Unfit),
    /// The writer failed; a closed pipe is [`io::ErrorKind::BrokenPipe`] here.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Why bytes are not a whole, consistent plan.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The first bytes are those of no plan format.
    #[error(
        "this is no plan: it begins neither like a CSV plan (`# plotplan: 1`), nor like tick lines (`; plotplan: 1`), \
         nor like a plan document (`{{\"format\": \"plotplan-plan\"`)"
    )]
    NotAPlan,
    /// The plan is of a version that this program does not know.
    #[error("line {line}: this plan is of version {found}; version 1 is the one understood here")]
    Version {
        /// Number of the line, the first being 1.
        line: u64,
        /// What stands for the version.
        found: String,
    },
    /// Something else stands where the format wants something.
    #[error("line {line}: expected {expected}, found {found}")]
    Unexpected {
        /// Number of the line, the first being 1.
        line: u64,
        /// What the format wants there.
        expected: String,
        /// What stands there, shortened.
        found: String,
    },
    /// The file ends before the plan does.
    #[error("line {line}: the plan is cut off: {why}")]
    CutOff {
        /// Number of the last line, the first being 1.
        line: u64,
        /// How that shows.
        why: String,
    },
    /// Lines are missing from the middle, or stand there twice.
    #[error("line {line}: lines before this one are missing, doubled or changed: {why}")]
    Gap {
        /// Number of the line where that shows, the first being 1.
        line: u64,
        /// How that shows.
        why: String,
    },
    /// A plan document is not JSON, or not of the right shape.
    #[error("the plan document: {0}")]
    Json(#[from] serde_json::Error),
    /// The columns of a plan document, or the rows in them, do not make a plan.
    #[error("the plan document's rows: {0}")]
    Columns(String),
    /// The header says what no plan can.
    #[error(transparent)]
    Header(#[from] HeaderError),
}
