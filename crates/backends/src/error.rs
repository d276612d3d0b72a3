//! Why a plan cannot be written for a firmware.

use std::io;

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

/// Why a program was not written to its end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The firmware's format cannot represent the plan.
    #[error(transparent)]
    Unfit(#[from] Unfit),
    /// The writer failed; a closed pipe is [`io::ErrorKind::BrokenPipe`] here.
    #[error(transparent)]
    Io(#[from] io::Error),
}
