//! Errors of reading and writing plan files.

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
    /// A tick line would be longer than [`tick_lines::LINE_BYTES`](super::tick_lines::LINE_BYTES).
    #[error("row {row} needs a tick line of {bytes} bytes, more than serial senders take")]
    LineTooLong {
        /// Number of the row, the first being 0.
        row: u64,
        /// Length of the line.
        bytes: usize,
    },
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
    #[error("the plan document is not JSON of its form")]
    Json(#[from] serde_json::Error),
    /// The columns of a plan document, or the rows in them, do not make a plan.
    #[error("the plan document's rows: {0}")]
    Columns(String),
    /// The header says what no plan can.
    #[error(transparent)]
    Header(#[from] HeaderError),
}
