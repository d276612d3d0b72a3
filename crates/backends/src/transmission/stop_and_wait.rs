//! Stop and wait: one line at a time, retransmitted until it is acknowledged, for machines whose lines are idempotent.
//!
//! A position is absolute and a pen state is a state: the same line twice does what it does once, as long as no other
//! line comes between. So only one line is ever in transit, and after a line was sent `k` times the next one waits for
//! `k` acknowledgements, or until the missing ones can no longer arrive: a late acknowledgement must not be taken for
//! the next line's.

use crate::program::{Line, Program};
use crate::session::{LineReader, Outcome, Progress, Session, Waiting};

/// A line is retransmitted after this and the time that it should take, microseconds.
const ACK_TIMEOUT_US: u64 = 1_000_000;
/// Transmissions of a line before giving up; the first line has longer, since the machine may be homing.
const TRIES: u32 = 12;
const FIRST_TRIES: u32 = 120;
/// How long nothing may arrive after an acknowledgement before a missing one is given up.
const QUIET_US: u64 = 1_000_000;

/// What the session must know about the firmware.
#[derive(Clone, Copy, Debug)]
pub struct Acknowledgement {
    /// The line that acknowledges.
    pub text: &'static str,
    /// The line of the program during which the machine acknowledges once more, by itself.
    pub extra_at: Option<usize>,
    /// A line may take this many times its time in the plan.
    pub slowness: u64,
    /// Whether a line moves the pen.
    pub is_pen: fn(&Line) -> bool,
    /// Pause before and after the pen moves, microseconds.
    pub pen_pause_us: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// The line after `acked` may be sent from this time on.
    Ready(u64),
    /// It was sent `times` times, and is retransmitted at this time.
    Sent { times: u32, again_us: u64 },
    /// It was acknowledged; `missing` more acknowledgements are outstanding, and given up at this time.
    Late { missing: u32, until_us: u64 },
}

/// The session.
#[derive(Debug)]
pub struct StopAndWait {
    program: Program,
    acknowledgement: Acknowledgement,
    acked: usize,
    state: State,
    reader: LineReader,
    /// Lines are only sent up to this number until the operator resumes.
    pause_at: Option<usize>,
    stopping: Option<u64>,
    outcome: Option<Outcome>,
    retransmitted: u64,
}

impl StopAndWait {
    /// From the program's first line on.
    pub fn new(program: Program, acknowledgement: Acknowledgement) -> Self {
        Self {
            program,
            acknowledgement,
            acked: 0,
            state: State::Ready(0),
            reader: LineReader::default(),
            pause_at: None,
            stopping: None,
            outcome: None,
            retransmitted: 0,
        }
    }

    fn is_pen(&self, line: usize) -> bool {
        self.program.lines.get(line).is_some_and(self.acknowledgement.is_pen)
    }

    /// The number of lines sent at least once.
    fn sent(&self) -> usize {
        self.acked + usize::from(!matches!(self.state, State::Ready(_)))
    }

    /// The line was acknowledged and nothing more is expected.
    fn advance(&mut self, now_us: u64) {
        self.acked += 1;
        let pauses = self.is_pen(self.acked) || self.is_pen(self.acked - 1);
        self.state = State::Ready(now_us + if pauses { self.acknowledgement.pen_pause_us } else { 0 });
        self.finish_if_done();
    }

    fn finish_if_done(&mut self) {
        if self.acked == self.program.lines.len() {
            self.outcome = Some(match self.stopping {
                Some(row) => Outcome::Stopped { row },
                None => Outcome::Done,
            });
        }
    }

    fn acknowledged(&mut self, now_us: u64) {
        match self.state {
            State::Sent { times, .. } => {
                let missing = times - 1 + u32::from(self.acknowledgement.extra_at == Some(self.acked));
                if missing == 0 {
                    self.advance(now_us);
                } else {
                    let until_us = now_us + QUIET_US + u64::from(times - 1) * ACK_TIMEOUT_US;
                    self.state = State::Late { missing, until_us };
                }
            }
            State::Late { missing, until_us } => {
                if missing == 1 {
                    self.advance(now_us);
                } else {
                    self.state = State::Late { missing: missing - 1, until_us };
                }
            }
            State::Ready(_) => {}
        }
    }
}

impl Session for StopAndWait {
    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        for line in self.reader.add(bytes) {
            if line == self.acknowledgement.text && self.outcome.is_none() {
                self.acknowledged(now_us);
            }
        }
    }

    fn transmit(&mut self, now_us: u64) -> Vec<u8> {
        if self.outcome.is_none() && self.program.lines.is_empty() {
            self.finish_if_done();
        }
        if self.outcome.is_some() {
            return Vec::new();
        }
        if let State::Late { until_us, .. } = self.state
            && now_us >= until_us
        {
            self.advance(now_us);
        }
        if self.outcome.is_some() || self.waiting_for().is_some() {
            return Vec::new();
        }
        let line = &self.program.lines[self.acked];
        let again_us = now_us + ACK_TIMEOUT_US + self.acknowledgement.slowness * line.duration_us;
        let text = format!("{}\n", line.text);
        match self.state {
            State::Ready(from_us) if now_us >= from_us => {
                self.state = State::Sent { times: 1, again_us };
                text.into_bytes()
            }
            State::Sent { times, again_us: due_us } if now_us >= due_us => {
                let most = if self.acked == 0 { FIRST_TRIES } else { TRIES };
                if times >= most {
                    let why = format!(
                        "no answer to `{}` after {times} tries; {}",
                        self.program.lines[self.acked].text,
                        self.reader.last_received()
                    );
                    let Progress { row, last_sent_row, .. } = self.progress();
                    self.outcome = Some(Outcome::Failed { row, last_sent_row, why });
                    return Vec::new();
                }
                self.retransmitted += 1;
                self.state = State::Sent { times: times + 1, again_us };
                text.into_bytes()
            }
            _ => Vec::new(),
        }
    }

    fn wake_us(&self) -> Option<u64> {
        if self.outcome.is_some() || self.waiting_for().is_some() {
            return None;
        }
        Some(match self.state {
            State::Ready(from_us) => from_us,
            State::Sent { again_us, .. } => again_us,
            State::Late { until_us, .. } => until_us,
        })
    }

    fn stop(&mut self, _now_us: u64) {
        if self.stopping.is_some() || self.outcome.is_some() {
            return;
        }
        if self.sent() == 0 {
            self.outcome = Some(Outcome::Stopped { row: self.program.row(0) });
            return;
        }
        self.pause_at = None;
        // The line in transit is waited for: it cannot be recalled.
        self.stopping = Some(self.program.stop_after(self.sent()));
    }

    fn pause(&mut self) {
        if self.stopping.is_none() {
            self.pause_at = self.program.next_pen_up(self.sent());
        }
    }

    fn waiting_for(&self) -> Option<Waiting> {
        (self.pause_at == Some(self.sent()))
            .then_some(Waiting::Operator)
            .filter(|_| self.sent() == self.acked)
    }

    fn resume(&mut self, _now_us: u64) {
        self.pause_at = None;
    }

    fn reconnected(&mut self, now_us: u64) {
        self.reader.clear();
        // What was in transit is lost or done: retransmitting it does no harm.
        if let State::Sent { times, .. } = self.state {
            self.state = State::Sent { times, again_us: now_us };
        }
    }

    fn progress(&self) -> Progress {
        let (row, last_sent_row) = (self.program.row(self.acked), self.program.row(self.sent()));
        let known = Progress::of(&self.program.lines, self.acked, row, last_sent_row);
        Progress { retransmitted: self.retransmitted, ..known }
    }

    fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }
}
