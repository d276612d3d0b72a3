//! What all sessions have in common. A session sends one program to one machine: bytes in, bytes out, time passed in.

use crate::program::Line;

/// How far a session has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Lines that the machine has acknowledged.
    pub lines: u64,
    /// Lines in all.
    pub of_lines: u64,
    /// Plan time of the acknowledged lines, microseconds.
    pub done_us: u64,
    /// Plan time of all lines, microseconds.
    pub of_us: u64,
    /// Index of the row reached once the acknowledged lines are done.
    pub row: u64,
    /// Index of the row reached once every line sent is done.
    pub last_sent_row: u64,
    /// Lines sent more than once.
    pub retransmitted: u64,
    /// Position queries sent.
    pub queries: u64,
    /// Whether the machine has acknowledged anything; without that, `lines` and `done_us` count what was sent.
    pub acknowledged: bool,
    /// Ink drawn, and ink of the whole program, mm; where the session knows it.
    pub ink_mm: Option<[u64; 2]>,
    /// Why the machine does not move, if it says so.
    pub note: Option<&'static str>,
}

impl Progress {
    /// With the first `acked` of the lines acknowledged, which end at `row`, and every line sent ending at `last_sent_row`.
    pub(crate) fn of(lines: &[Line], acked: usize, row: u64, last_sent_row: u64) -> Self {
        let time = |lines: &[Line]| lines.iter().map(|line| line.duration_us).sum();
        Self {
            lines: acked as u64,
            of_lines: lines.len() as u64,
            done_us: time(&lines[..acked]),
            of_us: time(lines),
            row,
            last_sent_row,
            retransmitted: 0,
            queries: 0,
            acknowledged: acked > 0,
            ink_mm: None,
            note: None,
        }
    }
}

/// How a session ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The machine has done everything.
    Done,
    /// Stopped on request: pen up, machine at rest at this row.
    Stopped {
        /// The row to resume from.
        row: u64,
    },
    /// The session cannot continue.
    Failed {
        /// The machine has acknowledged everything up to this row.
        row: u64,
        /// The last row of which anything was sent: the machine may have reached it.
        last_sent_row: u64,
        /// Why.
        why: String,
    },
}

/// What a session waits for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Waiting {
    /// The machine pauses for the operator. The text is the program's comment, such as `put in pen 2`.
    Machine(String),
    /// The operator paused; the pen is up.
    Operator,
}

/// A session with one machine.
pub trait Session {
    /// Processes bytes from the machine.
    fn receive(&mut self, bytes: &[u8], now_us: u64);
    /// Bytes to send now; empty if there are none.
    fn transmit(&mut self, now_us: u64) -> Vec<u8>;
    /// When [`Self::transmit`] is to be called again if nothing is received.
    fn wake_us(&self) -> Option<u64>;
    /// Requests a stop: decelerate, lift, report the row.
    fn stop(&mut self, now_us: u64);
    /// The port is open again after it was away: everything in transit is lost.
    fn reconnected(&mut self, now_us: u64);
    /// Requests a pause at the next place where the pen is up and the motors are at rest.
    fn pause(&mut self);
    /// What the session waits for, if it waits for the operator.
    fn waiting_for(&self) -> Option<Waiting>;
    /// The operator confirmed.
    fn resume(&mut self, now_us: u64);
    /// How far it has come.
    fn progress(&self) -> Progress;
    /// How it ended, once it has.
    fn outcome(&self) -> Option<&Outcome>;
}

/// Splits received bytes into lines. CR or LF ends a line; empty lines are skipped.
#[derive(Clone, Debug, Default)]
pub(crate) struct LineReader {
    pending: Vec<u8>,
    last: Option<String>,
}

/// Longer lines are noise.
const LONGEST: usize = 256;

impl LineReader {
    pub(crate) fn add(&mut self, bytes: &[u8]) -> Vec<String> {
        let mut lines = Vec::new();
        for &byte in bytes {
            if byte == b'\n' || byte == b'\r' {
                if !self.pending.is_empty() {
                    let line = String::from_utf8_lossy(&self.pending).trim().to_owned();
                    self.pending.clear();
                    self.last = Some(line.clone());
                    lines.push(line);
                }
            } else if self.pending.len() < LONGEST {
                self.pending.push(byte);
            }
        }
        lines
    }

    pub(crate) fn clear(&mut self) {
        self.pending.clear();
    }

    /// What the machine sent last, as a clause of a message.
    pub(crate) fn last_received(&self) -> String {
        match &self.last {
            Some(line) => format!("the machine last sent `{}`", line.escape_debug()),
            None if self.pending.is_empty() => "nothing was received".to_owned(),
            None => format!("only `{}` was received, without a line end", self.pending.escape_ascii()),
        }
    }
}
