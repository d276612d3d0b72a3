//! Open loop: lines are written as they are, at once or on schedule. Nothing received is interpreted, nothing is
//! retransmitted.
//!
//! At once, the port's flow control (hardware or software) sets the pace. On schedule, each line is written at its time in
//! the plan less a lead that the machine's buffer must hold; that needs no flow control.

use crate::program::Program;
use crate::session::{Outcome, Progress, Session, Waiting};

/// The session.
#[derive(Debug)]
pub struct OpenLoop {
    program: Program,
    line_end: &'static str,
    sent: usize,
    /// How long before its time a line is written, microseconds; `None` writes all lines at once.
    lead_us: Option<u64>,
    started_us: Option<u64>,
    /// Plan time before the next line.
    clock_us: u64,
    /// Lines are only sent up to this number until the operator resumes.
    pause_at: Option<usize>,
    stopping: Option<u64>,
    outcome: Option<Outcome>,
}

impl OpenLoop {
    /// All lines at once, or each `lead_us` before its time.
    pub fn new(program: Program, line_end: &'static str, lead_us: Option<u64>) -> Self {
        Self {
            program,
            line_end,
            sent: 0,
            lead_us,
            started_us: None,
            clock_us: 0,
            pause_at: None,
            stopping: None,
            outcome: None,
        }
    }

    /// When the next line is due, or when the last one is done.
    fn due_us(&self) -> u64 {
        let (Some(lead_us), Some(started_us)) = (self.lead_us, self.started_us) else { return 0 };
        let lead_us = if self.sent < self.program.lines.len() { lead_us } else { 0 };
        started_us + self.clock_us.saturating_sub(lead_us)
    }
}

impl Session for OpenLoop {
    fn receive(&mut self, _bytes: &[u8], _now_us: u64) {}

    fn transmit(&mut self, now_us: u64) -> Vec<u8> {
        self.started_us.get_or_insert(now_us);
        let mut out = Vec::new();
        while self.outcome.is_none() && self.waiting_for().is_none() && now_us >= self.due_us() {
            let Some(line) = self.program.lines.get(self.sent) else {
                self.outcome = Some(match self.stopping {
                    Some(row) => Outcome::Stopped { row },
                    None => Outcome::Done,
                });
                break;
            };
            out.extend_from_slice(line.text.as_bytes());
            out.extend_from_slice(self.line_end.as_bytes());
            self.clock_us += line.duration_us;
            self.sent += 1;
            if self.lead_us.is_none() {
                // One line at a time, so that it can be stopped between any two.
                break;
            }
        }
        out
    }

    fn wake_us(&self) -> Option<u64> {
        (self.outcome.is_none() && self.waiting_for().is_none()).then(|| self.due_us())
    }

    fn stop(&mut self, _now_us: u64) {
        if self.stopping.is_some() || self.outcome.is_some() {
            return;
        }
        self.pause_at = None;
        self.stopping = Some(self.program.stop_after(self.sent));
    }

    fn pause(&mut self) {
        if self.stopping.is_none() {
            self.pause_at = self.program.next_pen_up(self.sent);
        }
    }

    fn waiting_for(&self) -> Option<Waiting> {
        (self.pause_at == Some(self.sent)).then_some(Waiting::Operator)
    }

    fn resume(&mut self, now_us: u64) {
        if self.waiting_for().is_some() {
            // The plan's clock stood still meanwhile: the next line is due now.
            self.started_us = Some(now_us.saturating_sub(self.clock_us));
        }
        self.pause_at = None;
    }

    fn reconnected(&mut self, _now_us: u64) {
        let why =
            "the port was lost, and this protocol has no acknowledgements: how far the machine has come is \
                   not known"
                .to_owned();
        let Progress { row, last_sent_row, .. } = self.progress();
        self.outcome.get_or_insert(Outcome::Failed { row, last_sent_row, why });
    }

    fn progress(&self) -> Progress {
        let last_sent_row = self.program.row(self.sent);
        let row = self.program.row(0);
        let known = Progress::of(&self.program.lines, self.sent, row, last_sent_row);
        Progress { done_us: self.clock_us, acknowledged: false, ..known }
    }

    fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }
}
