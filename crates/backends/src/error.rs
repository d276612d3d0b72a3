//! Why a plan cannot be written for a firmware.

use std::io;

/// Why a format cannot represent a plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unrepresentable {
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
    #[error(
        "row {row} lasts {us} us, less than {format} can represent ({least} us); plan with a longer --period"
    )]
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
    /// The plan itself is not valid.
    #[error("the plan is not valid: {what}")]
    InvalidPlan {
        /// What is wrong with it.
        what: String,
    },
    /// The firmware is for machines of another kind.
    #[error("this format is for {wanted}; machine {machine} is not one")]
    OtherMachine {
        /// What the format is for.
        wanted: &'static str,
        /// The machine's name.
        machine: String,
    },
    /// The format needs the machine's kinematics.
    #[error("{format} needs the machine: --machine NAME or FILE.toml")]
    NoMachine {
        /// The format's name.
        format: &'static str,
    },
    /// The format is made of the drawing, and there is only a plan.
    #[error("{format} is made of a drawing; this is a plan")]
    NoDrawing {
        /// The format's name.
        format: &'static str,
    },
    /// There is no protocol that sends the format.
    #[error("{format} is only written as a file")]
    NotSent {
        /// The format's name.
        format: &'static str,
    },
    /// The backend only sends plans.
    #[error("{format} only sends plans")]
    NotWritten {
        /// The format's name.
        format: &'static str,
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
    Unrepresentable(#[from] Unrepresentable),
    /// The writer failed; a closed pipe is [`io::ErrorKind::BrokenPipe`] here.
    #[error(transparent)]
    Io(#[from] io::Error),
}
