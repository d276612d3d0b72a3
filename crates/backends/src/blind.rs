//! Machines that do not answer: lines are written as they are, at once or at their time.
//!
//! At once, pacing is the port's: hardware or software flow control. At their time, a line goes out when the plan comes to it,
//! less a lead that the machine's buffer has to hold: that needs no flow control at all. Whatever comes in is passed over,
//! nothing is said again.

use crate::conversation::{Conversation, Outcome, Progress};
use crate::script::{Dialect, Script, Step};

/// The conversation.
#[derive(Debug)]
pub struct Blind {
    script: Script,
    steps: Vec<Step>,
    said: usize,
    /// How long before its time a line is written, microseconds; nothing where all are written at once.
    lead_us: Option<u64>,
    started_us: Option<u64>,
    /// Plan time before the next line.
    clock_us: u64,
    stopping: Option<u64>,
    outcome: Option<Outcome>,
}

impl Blind {
    /// All at once, or each line so long before its time.
    pub fn new(mut script: Script, lead_us: Option<u64>) -> Self {
        Self {
            steps: std::mem::take(&mut script.steps),
            script,
            said: 0,
            lead_us,
            started_us: None,
            clock_us: 0,
            stopping: None,
            outcome: None,
        }
    }

    /// When the next line goes out, or when the last one has been done.
    fn due_us(&self) -> u64 {
        let (Some(lead_us), Some(started_us)) = (self.lead_us, self.started_us) else { return 0 };
        let lead_us = if self.said < self.steps.len() { lead_us } else { 0 };
        started_us + self.clock_us.saturating_sub(lead_us)
    }
}

impl Conversation for Blind {
    fn receive(&mut self, _bytes: &[u8], _now_us: u64) {}

    fn transmit(&mut self, now_us: u64) -> Vec<u8> {
        self.started_us.get_or_insert(now_us);
        let mut out = Vec::new();
        while self.outcome.is_none() && now_us >= self.due_us() {
            let Some(step) = self.steps.get(self.said) else {
                self.outcome = Some(match self.stopping {
                    Some(row) => Outcome::Stopped { row },
                    None => Outcome::Done,
                });
                break;
            };
            out.extend_from_slice(step.text.as_bytes());
            if self.script.dialect != Dialect::Unknown {
                out.push(if matches!(self.script.dialect, Dialect::Ebb(..)) { b'\r' } else { b'\n' });
            }
            self.clock_us += step.lasts_us;
            self.said += 1;
            if self.lead_us.is_none() {
                // One line at a time, so that it can be stopped between any two.
                break;
            }
        }
        out
    }

    fn wake_us(&self) -> Option<u64> {
        self.outcome.is_none().then(|| self.due_us())
    }

    fn stop(&mut self, _now_us: u64) {
        if self.stopping.is_some() || self.outcome.is_some() {
            return;
        }
        let (tail, row) =
            if self.said == 0 { (Vec::new(), 0) } else { self.script.stopping(&self.steps[..self.said]) };
        self.steps.truncate(self.said);
        self.steps.extend(tail);
        self.stopping = Some(row);
    }

    fn reconnected(&mut self, _now_us: u64) {
        let row = self.said.checked_sub(1).map_or(0, |last| self.steps[last].row);
        let why =
            "the port went away, and without answers nobody knows how far the machine has come".to_owned();
        self.outcome.get_or_insert(Outcome::Failed { row: 0, at_most: row, why });
    }

    fn progress(&self) -> Progress {
        let row = self.said.checked_sub(1).map_or(0, |last| self.steps[last].row);
        Progress {
            lines: self.said as u64,
            of_lines: self.steps.len() as u64,
            done_us: self.clock_us,
            of_us: self.steps.iter().map(|step| step.lasts_us).sum(),
            row,
            at_most: row,
            resent: 0,
            asked: 0,
        }
    }

    fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }
}
