//! Character counting with resynchronization by position query, for machines that execute each line they receive, answer
//! `ok`, and report their position on request.
//!
//! The sender keeps the bytes in transit below the machine's receive buffer (grbl's "character counting"). An
//! unacknowledged line must not be retransmitted: it may have been executed, and a second time it would draw again or out
//! of order. Instead the machine is left to finish and asked for its position. The position tells which lines were
//! executed, because a line that leads to a position where an unacknowledged line also leads is held back until that one
//! is acknowledged. Lines that do not move (pen, dwell, modes) may be sent twice. Acknowledgements come in order; before
//! the session ends the position is queried once more.

use crate::program::Program;
use crate::session::{LineReader, Outcome, Progress, Session, Waiting};
use crate::status::{Answer, StatusProtocol};

/// A line that is not acknowledged within this and the time that it may wait for room leads to a query, microseconds.
const ACK_TIMEOUT_US: u64 = 2_000_000;
/// Lines that a machine may have accepted and not executed: grbl plans 16 ahead.
const QUEUE: usize = 40;
/// A moving machine is polled at this interval.
const POLL_INTERVAL_US: u64 = 200_000;
/// How soon after a pause line the machine is asked whether it waits.
const PAUSE_US: u64 = 300_000;
/// Queries without any answer before giving up.
const TRIES: u32 = 60;
/// A firmware that acknowledges queries has this long to do so after its report, microseconds.
const LATE_ACK_GRACE_US: u64 = 300_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Lines are being sent.
    Sending,
    /// The position is being queried; `at_rest` is the last report at rest and how many equal ones came in a row.
    Querying { tries: u32, next_us: u64, at_rest: Option<([i64; 2], u32)> },
    /// Waits for the rest of the answer to a query.
    Settling { until_us: u64 },
}

/// The session.
#[derive(Debug)]
pub struct CharacterCounting {
    program: Program,
    status: Box<dyn StatusProtocol>,
    /// Lines acknowledged, or found to be executed.
    acked: usize,
    /// Lines sent.
    sent: usize,
    /// Lines sent at least once.
    high_water_mark: usize,
    /// Size of the machine's receive buffer, bytes; 0 sends one line at a time.
    window: usize,
    state: State,
    deadline_us: u64,
    /// Position before anything was sent.
    start: Option<[i64; 2]>,
    reader: LineReader,
    /// Whether the machine reported that it holds for the operator, and whether the operator has confirmed.
    holding: bool,
    confirmed: bool,
    /// Lines are only sent up to this number until the operator resumes.
    pause_at: Option<usize>,
    stopping: Option<u64>,
    failing: Option<Outcome>,
    outcome: Option<Outcome>,
    retransmitted: u64,
    queries: u64,
}

impl CharacterCounting {
    /// To a machine with a receive buffer of `window` bytes; 0 sends one line at a time.
    pub fn new(program: Program, status: Box<dyn StatusProtocol>, window: usize) -> Self {
        let mut session = Self {
            program,
            status,
            acked: 0,
            sent: 0,
            high_water_mark: 0,
            window,
            state: State::Sending,
            deadline_us: 0,
            start: None,
            reader: LineReader::default(),
            holding: false,
            confirmed: false,
            pause_at: None,
            stopping: None,
            failing: None,
            outcome: None,
            retransmitted: 0,
            queries: 0,
        };
        session.query(0);
        session
    }

    /// Position once the first `lines` are executed; `None` before the first report.
    fn position(&self, lines: usize) -> Option<[i64; 2]> {
        self.program.lines[..lines].iter().rev().find_map(|line| line.position).or(self.start)
    }

    /// Distance of `position` from where the first `lines` lead, along the farther axis.
    fn distance_to(&self, lines: usize, position: [i64; 2]) -> u64 {
        let farther = |at: [i64; 2]| at[0].abs_diff(position[0]).max(at[1].abs_diff(position[1]));
        self.position(lines).map_or(u64::MAX, farther)
    }

    fn on_ack(&mut self, now_us: u64) {
        let querying = matches!(self.state, State::Querying { .. });
        if matches!(self.state, State::Settling { .. }) {
            self.state = State::Sending;
        } else if querying && self.status.acknowledges_queries() {
            // It cannot be told from the acknowledgement of a line.
        } else if self.acked < self.sent {
            self.acked += 1;
            self.deadline_us = now_us + self.timeout_us();
            if self.acked == self.sent && querying {
                // Everything was acknowledged after all.
                self.state = State::Sending;
            }
        }
    }

    fn on_status(&mut self, position: [i64; 2], moving: bool, now_us: u64) {
        let State::Querying { next_us, at_rest, .. } = self.state else { return };
        if moving {
            self.state = State::Querying { tries: 0, next_us, at_rest: None };
            return;
        }
        let count = at_rest.filter(|(at, _)| *at == position).map_or(0, |(_, count)| count) + 1;
        if count >= self.status.reports_at_rest() {
            self.on_idle_at(position, now_us);
        } else {
            self.state = State::Querying { tries: 0, next_us, at_rest: Some((position, count)) };
        }
    }

    /// The machine is at rest at this position: which lines has it executed?
    fn on_idle_at(&mut self, position: [i64; 2], now_us: u64) {
        self.start.get_or_insert(position);
        // The nearest, and of several the first: what follows it does not move, or leads where the machine already is.
        let fits = |lines: &usize| self.distance_to(*lines, position) <= self.status.position_tolerance();
        let nearest =
            (self.acked..=self.sent).filter(fits).min_by_key(|lines| self.distance_to(*lines, position));
        // An acknowledgement counted for the wrong line can only have been an early one.
        let known = nearest.or_else(|| (self.acked.saturating_sub(3)..self.acked).rev().find(fits));
        let Some(done) = known else {
            let expected = self.position(self.acked).unwrap_or(position);
            let (reported, expected) = (self.status.describe(position), self.status.describe(expected));
            self.fail(format!(
                "the machine reports position {reported}, which matches no line sent (the last acknowledged one ends at {expected})"
            ));
            return;
        };
        (self.acked, self.sent) = (done, done);
        if done == self.program.lines.len() {
            self.outcome = Some(match self.stopping {
                Some(row) => Outcome::Stopped { row },
                None => Outcome::Done,
            });
        }
        self.state = if self.status.acknowledges_queries() {
            State::Settling { until_us: now_us + LATE_ACK_GRACE_US }
        } else {
            State::Sending
        };
    }

    /// The session cannot continue: the pen is lifted, whether or not the machine listens.
    fn fail(&mut self, why: String) {
        if self.failing.is_none() && self.outcome.is_none() {
            let (row, last_sent_row) = (self.program.row(self.acked), self.program.row(self.sent));
            self.failing = Some(Outcome::Failed { row, last_sent_row, why });
        }
    }

    fn query(&mut self, now_us: u64) {
        self.status.begin_query();
        self.state = State::Querying { tries: 0, next_us: now_us, at_rest: None };
    }

    /// Whether the machine reported that it holds at a pause of the program.
    fn machine_waits(&self) -> bool {
        self.holding && self.pausing()
    }

    fn is_pause(&self, line: usize) -> bool {
        self.status.is_pause(&self.program.lines[line].text)
    }

    /// Whether a pause is not acknowledged yet: nothing is sent after it. Lines before it may lack theirs, too.
    fn pausing(&self) -> bool {
        self.sent > self.acked && self.is_pause(self.sent - 1)
    }

    fn timeout_us(&self) -> u64 {
        if self.pausing() {
            return PAUSE_US;
        }
        let waiting = &self.program.lines[self.acked.saturating_sub(QUEUE)..self.sent];
        ACK_TIMEOUT_US + 2 * waiting.iter().map(|line| line.duration_us).sum::<u64>()
    }

    /// Whether the next line may be sent now.
    fn may_send(&self) -> bool {
        let Some(next) = self.program.lines.get(self.sent) else { return false };
        if self.pause_at.is_some_and(|lines| self.sent >= lines) {
            return false;
        }
        if self.sent == self.acked {
            return true;
        }
        // What follows a pause is sent once it is over: a machine stopped meanwhile must not draw with the wrong pen.
        if (self.acked..self.sent).any(|line| self.is_pause(line)) {
            return false;
        }
        let lines = &self.program.lines[self.acked..self.sent];
        let waiting: usize = lines.iter().map(|line| line.text.len() + 1).sum();
        if waiting + next.text.len() + 1 > self.window {
            return false;
        }
        // Two unacknowledged lines must not lead to the same position, unless nothing moves in between.
        let Some(to) = next.position else { return true };
        self.position(self.sent) == Some(to)
            || (self.acked..self.sent).all(|lines| self.position(lines) != Some(to))
    }

    /// The lines that lift the pen, and the end of the session.
    fn finish_failed(&mut self, failed: Outcome) -> Vec<u8> {
        self.outcome = Some(failed);
        let end = self.status.line_end();
        let lift = self.program.lift(&self.program.lines[..self.sent]);
        lift.iter().flat_map(|line| [line.text.as_str(), end]).collect::<String>().into_bytes()
    }
}

impl Session for CharacterCounting {
    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        for line in self.reader.add(bytes) {
            if self.outcome.is_some() {
                return;
            }
            match self.status.parse(&line) {
                Answer::Ack => self.on_ack(now_us),
                Answer::Error(what) => {
                    let line = self.program.lines.get(self.acked).map_or("", |line| line.text.as_str());
                    let why = format!("the machine answers {what} to `{line}`");
                    self.fail(why);
                }
                Answer::Alarm(what) => self.fail(what),
                Answer::Status { position, moving, holding } => {
                    self.holding = holding;
                    self.on_status(position, moving, now_us);
                }
                Answer::PositionUnknown | Answer::Other => {}
            }
        }
    }

    fn transmit(&mut self, now_us: u64) -> Vec<u8> {
        if self.outcome.is_some() {
            return Vec::new();
        }
        if let Some(failed) = self.failing.take() {
            return self.finish_failed(failed);
        }
        if std::mem::take(&mut self.confirmed) {
            self.holding = false;
            return self.status.cycle_start().into();
        }
        match self.state {
            State::Querying { tries, next_us, at_rest } => {
                if now_us < next_us {
                    return Vec::new();
                }
                if tries >= TRIES {
                    let received = self.reader.last_received();
                    self.fail(format!("no answer to {TRIES} position queries; {received}"));
                    return self.transmit(now_us);
                }
                self.queries += 1;
                let next_us = now_us + POLL_INTERVAL_US;
                self.state = State::Querying { tries: tries + 1, next_us, at_rest };
                return self.status.query().into_bytes();
            }
            State::Settling { until_us } if now_us < until_us => return Vec::new(),
            State::Settling { .. } => self.state = State::Sending,
            State::Sending => {}
        }
        let overdue = self.sent > self.acked && now_us >= self.deadline_us;
        if self.acked == self.program.lines.len() || overdue {
            self.query(now_us);
            return self.transmit(now_us);
        }
        let mut out = String::new();
        while self.may_send() {
            self.retransmitted += u64::from(self.sent < self.high_water_mark);
            out.push_str(&self.program.lines[self.sent].text);
            out.push_str(self.status.line_end());
            self.sent += 1;
            self.high_water_mark = self.high_water_mark.max(self.sent);
            self.deadline_us = now_us + self.timeout_us();
        }
        out.into_bytes()
    }

    fn wake_us(&self) -> Option<u64> {
        if self.outcome.is_some() {
            return None;
        }
        if self.failing.is_some() || self.confirmed {
            return Some(0);
        }
        match self.state {
            State::Querying { next_us, .. } => Some(next_us),
            State::Settling { until_us } => Some(until_us),
            State::Sending if self.acked == self.program.lines.len() || self.may_send() => Some(0),
            State::Sending => (self.sent > self.acked).then_some(self.deadline_us),
        }
    }

    fn stop(&mut self, _now_us: u64) {
        if self.stopping.is_some() || self.outcome.is_some() {
            return;
        }
        if self.high_water_mark == 0 {
            self.outcome = Some(Outcome::Stopped { row: self.program.row(0) });
            return;
        }
        self.pause_at = None;
        self.confirmed |= self.machine_waits();
        // Lines sent and found not to be executed are sent again: they are part of what was begun.
        self.stopping = Some(self.program.stop_after(self.high_water_mark));
    }

    fn pause(&mut self) {
        if self.stopping.is_none() {
            self.pause_at = self.program.next_pen_up(self.high_water_mark);
        }
    }

    fn waiting_for(&self) -> Option<Waiting> {
        if self.machine_waits() {
            let comment = self.program.lines[self.sent - 1].comment.clone();
            return Some(Waiting::Machine(comment));
        }
        (self.pause_at == Some(self.acked)).then_some(Waiting::Operator)
    }

    fn resume(&mut self, _now_us: u64) {
        if self.machine_waits() {
            self.confirmed = true;
        } else {
            self.pause_at = None;
        }
    }

    fn reconnected(&mut self, now_us: u64) {
        self.reader.clear();
        self.query(now_us);
    }

    fn progress(&self) -> Progress {
        let sent = self.high_water_mark.max(self.acked);
        let (row, last_sent_row) = (self.program.row(self.acked), self.program.row(sent));
        let known = Progress::of(&self.program.lines, self.acked, row, last_sent_row);
        Progress { retransmitted: self.retransmitted, queries: self.queries, ..known }
    }

    fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }
}
