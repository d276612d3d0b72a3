//! Queries the machine's position before a plan is resumed.

use crate::session::LineReader;
use crate::status::{Answer, StatusProtocol};

/// The query is repeated after this, microseconds.
const POLL_INTERVAL_US: u64 = 500_000;
/// Queries without any answer before giving up.
const TRIES: u32 = 10;

/// What the machine reports.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReportedPosition {
    /// It is at rest there: ticks, steps since the motors were switched on, or micrometres.
    At([i64; 2]),
    /// It does not know: it received nothing since it was homed.
    Unknown,
    /// It is in alarm.
    Alarm(String),
    /// It does not answer.
    Silent,
}

/// The query.
#[derive(Debug)]
pub struct PositionQuery {
    status: Box<dyn StatusProtocol>,
    /// The last report at rest, and how many equal ones came in a row.
    at_rest: Option<([i64; 2], u32)>,
    lines: LineReader,
    tries: u32,
    next_us: u64,
    found: Option<ReportedPosition>,
}

impl PositionQuery {
    /// To a machine that speaks this protocol.
    pub fn new(mut status: Box<dyn StatusProtocol>) -> Self {
        status.begin_query();
        Self { status, at_rest: None, lines: LineReader::default(), tries: 0, next_us: 0, found: None }
    }

    /// Processes bytes from the machine.
    pub fn receive(&mut self, bytes: &[u8]) {
        for line in self.lines.add(bytes) {
            self.tries = 0;
            match self.status.parse(&line) {
                Answer::Status { position, moving: false, .. } => {
                    let before = self.at_rest.filter(|(at, _)| *at == position).map_or(0, |(_, count)| count);
                    self.at_rest = Some((position, before + 1));
                    if before + 1 >= self.status.reports_at_rest() {
                        self.found = Some(ReportedPosition::At(position));
                    }
                }
                Answer::Status { .. } => self.at_rest = None,
                Answer::PositionUnknown => self.found = Some(ReportedPosition::Unknown),
                Answer::Alarm(what) => self.found = Some(ReportedPosition::Alarm(what)),
                // An error answers the partial line that the query ended.
                Answer::Ack | Answer::Error(_) | Answer::Other => {}
            }
        }
    }

    /// Bytes to send now.
    pub fn transmit(&mut self, now_us: u64) -> Vec<u8> {
        if self.found.is_some() || now_us < self.next_us {
            return Vec::new();
        }
        self.tries += 1;
        if self.tries > TRIES {
            self.found = Some(ReportedPosition::Silent);
            return Vec::new();
        }
        self.next_us = now_us + POLL_INTERVAL_US;
        let end = if self.status.ends_partial_line() { self.status.line_end() } else { "" };
        format!("{end}{}", self.status.query()).into_bytes()
    }

    /// When [`Self::transmit`] is to be called again.
    pub fn wake_us(&self) -> u64 {
        self.next_us
    }

    /// The result, once there is one.
    pub fn found(&self) -> Option<&ReportedPosition> {
        self.found.as_ref()
    }
}
