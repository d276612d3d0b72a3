//! Firmwares that acknowledge lines and report their position on request.

use std::fmt;

/// An answer of the machine, as far as a session needs it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// A line was accepted.
    Ack,
    /// A line was refused.
    Error(String),
    /// The machine is in alarm and takes no lines.
    Alarm(String),
    /// A position report.
    Status {
        /// Where the machine is, in the unit of its own reports.
        position: [i64; 2],
        /// Whether it moves or has motion queued.
        moving: bool,
        /// Whether it holds until the operator confirms.
        holding: bool,
    },
    /// It does not know its position: it received nothing since it was homed.
    PositionUnknown,
    /// Anything else.
    Other,
}

/// The lines and answers of one firmware.
pub trait StatusProtocol: fmt::Debug + Send {
    /// What ends a line.
    fn line_end(&self) -> &'static str;

    /// The bytes that ask for a position report.
    fn query(&self) -> String;

    /// Called before each new series of queries.
    fn begin_query(&mut self) {}

    /// Whether a partial line must be ended before the first query is understood.
    fn ends_partial_line(&self) -> bool {
        true
    }

    /// Interprets a line from the machine.
    fn parse(&mut self, line: &str) -> Answer;

    /// Largest deviation of a reported position from the commanded one, per axis, in the reports' unit.
    fn position_tolerance(&self) -> u64 {
        0
    }

    /// How many equal reports in a row prove that the machine is at rest.
    fn reports_at_rest(&self) -> u32 {
        1
    }

    /// Whether answers to a query contain an acknowledgement like that of a line.
    fn acknowledges_queries(&self) -> bool {
        false
    }

    /// Whether the machine waits for the operator at this line.
    fn is_pause(&self, _text: &str) -> bool {
        false
    }

    /// The bytes that end such a pause.
    fn cycle_start(&self) -> &'static str {
        ""
    }

    /// A position with its unit, for messages.
    fn describe(&self, position: [i64; 2]) -> String;
}
