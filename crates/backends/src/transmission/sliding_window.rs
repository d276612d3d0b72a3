//! Sliding window (go-back-N): lines carry numbers and checksums, so they may be lost, doubled or garbled in either
//! direction.
//!
//! A machine accepts a line if its checksum is right and its number is the next one, and answers anything with the number
//! that it expects. So the sender may retransmit anything at any time: nothing is done twice, nothing is left out.

use std::fmt;

use crate::program::Program;
use crate::session::{LineReader, Outcome, Progress, Session, Waiting};

/// A line is retransmitted after this and the time that it may wait for room, microseconds.
const ACK_TIMEOUT_US: u64 = 1_000_000;
/// Transmissions of a line without any progress before giving up.
const TRIES: u32 = 12;
/// Lines that may be queued in the machine before a new one is acknowledged.
const QUEUE: usize = 48;

/// What a line from the machine says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reply {
    /// Every line before `number` was accepted.
    Next {
        /// The number of the line expected next.
        number: usize,
        /// Free bytes of the receive buffer, where the machine announces them.
        room: Option<usize>,
    },
    /// This line cannot be executed.
    Error {
        /// The line's number.
        number: usize,
        /// The machine's reason.
        why: String,
    },
}

/// How lines are numbered and protected.
pub trait Framing: fmt::Debug + Send {
    /// A line as it is sent, with number, checksum and line end.
    fn frame(&self, number: usize, text: &str) -> String;
    /// Interprets a line from the machine; `None` for anything that is not an intact reply.
    fn parse(&self, line: &str) -> Option<Reply>;
}

/// Bytes in transit before the machine has acknowledged more.
const FIRST_WINDOW: usize = 48;
/// Bytes in transit at most: with a round trip of 16 ms they feed 435 lines/s, more than a wire of 115200 baud carries.
const LARGEST_WINDOW: usize = 255;
/// Growth per acknowledged line, bytes.
const GROWTH: usize = 8;
/// Above the size at which a line was lost the window grows by one byte in this many acknowledged lines.
const PROBE_LINES: usize = 64;

/// The bytes that may be in transit. A machine that announces the room in its receive buffer sets them. Otherwise they grow
/// with each acknowledged line and are halved on a loss, and then grow only to three quarters of the size at which the
/// line was lost: an Uno with a buffer of 64 bytes loses one line, not one after the other.
#[derive(Clone, Copy, Debug)]
struct Window {
    announced: Option<usize>,
    bytes: usize,
    ceiling: usize,
    acked_at_ceiling: usize,
    max_lines: Option<usize>,
}

impl Window {
    fn new(max_lines: Option<usize>) -> Self {
        let (bytes, ceiling) = (FIRST_WINDOW, LARGEST_WINDOW);
        Self { announced: None, bytes, ceiling, acked_at_ceiling: 0, max_lines }
    }

    fn allows(&self, lines: usize, bytes: usize) -> bool {
        bytes <= self.announced.unwrap_or(self.bytes) && self.max_lines.is_none_or(|most| lines <= most)
    }

    fn on_ack(&mut self, lines: usize) {
        if self.bytes + GROWTH * lines <= self.ceiling {
            self.bytes += GROWTH * lines;
            return;
        }
        self.bytes = self.bytes.max(self.ceiling);
        self.acked_at_ceiling += lines;
        if self.acked_at_ceiling >= PROBE_LINES && self.ceiling < LARGEST_WINDOW {
            self.acked_at_ceiling = 0;
            self.ceiling += 1;
        }
    }

    fn on_loss(&mut self) {
        self.ceiling = (self.bytes * 3 / 4).max(FIRST_WINDOW / 2);
        self.bytes = (self.bytes / 2).max(FIRST_WINDOW / 2);
        self.acked_at_ceiling = 0;
    }
}

/// The session.
#[derive(Debug)]
pub struct SlidingWindow {
    program: Program,
    framing: Box<dyn Framing>,
    /// Lines acknowledged.
    acked: usize,
    /// Lines sent since the last retransmission began.
    sent: usize,
    /// Lines sent at least once.
    high_water_mark: usize,
    window: Window,
    reader: LineReader,
    /// When the line after `acked` is retransmitted.
    again_us: u64,
    tries: u32,
    /// Lines are only sent up to this number until the operator resumes.
    pause_at: Option<usize>,
    stopping: Option<u64>,
    failing: Option<Outcome>,
    outcome: Option<Outcome>,
    retransmitted: u64,
}

impl SlidingWindow {
    /// With at most `max_lines` lines in transit; otherwise the bytes in transit are the only limit.
    pub fn new(program: Program, framing: Box<dyn Framing>, max_lines: Option<usize>) -> Self {
        Self {
            program,
            framing,
            acked: 0,
            sent: 0,
            high_water_mark: 0,
            window: Window::new(max_lines),
            pause_at: None,
            reader: LineReader::default(),
            again_us: 0,
            tries: 0,
            stopping: None,
            failing: None,
            outcome: None,
            retransmitted: 0,
        }
    }

    fn timeout_us(&self) -> u64 {
        let lines = &self.program.lines;
        let waiting = &lines[self.acked.saturating_sub(QUEUE)..self.sent.min(lines.len())];
        ACK_TIMEOUT_US + waiting.iter().map(|line| line.duration_us).sum::<u64>()
    }

    /// The machine no longer answers.
    fn give_up(&mut self, why: String) {
        let Progress { row, last_sent_row, .. } = self.progress();
        let failed = self.failing.take().unwrap_or(Outcome::Failed { row, last_sent_row, why });
        self.outcome.get_or_insert(failed);
    }

    /// The machine cannot execute a line; it still listens, and lifts the pen where it is.
    fn fail(&mut self, why: String) {
        if self.failing.is_some() {
            return self.give_up(why);
        }
        let row = self.program.row(self.acked);
        self.failing = Some(Outcome::Failed { row, last_sent_row: row, why });
        let lift = self.program.lift(&self.program.lines[..self.acked]);
        self.program.lines.truncate(self.acked);
        self.program.lines.extend(lift);
        (self.sent, self.high_water_mark) = (self.acked, self.acked);
    }

    /// The machine expects line `next`.
    fn on_next(&mut self, next: usize, room: Option<usize>, now_us: u64) {
        if next > self.acked {
            if self.acked == 0 {
                self.window.announced = room;
            }
            self.window.on_ack(next - self.acked);
            self.acked = next;
            self.tries = 0;
            self.again_us = now_us + self.timeout_us();
            self.sent = self.sent.max(next);
        } else if next == self.acked && self.sent > next {
            // It expects this line and has dropped those after it. They are answered too, so the retransmission happens
            // only once, and soon.
            self.again_us = self.again_us.min(now_us + ACK_TIMEOUT_US / 4);
        } else if next == 0 && self.acked > 0 {
            // Answers come in order: only a machine that was reset expects line 0 again.
            self.fail("the machine was reset: it expects line 0 again, and its position is lost".to_owned());
        }
    }

    /// Whether the next line fits into the window; one line in transit always does.
    fn may_send(&self) -> bool {
        if self.sent == self.program.lines.len() || self.pause_at.is_some_and(|lines| self.sent >= lines) {
            return false;
        }
        if self.sent == self.acked {
            return true;
        }
        // Line 0 restarts the numbering: it must have been accepted before another follows.
        if self.acked == 0 {
            return false;
        }
        let framed = |number: usize| self.framing.frame(number, &self.program.lines[number].text).len();
        let bytes: usize = (self.acked..=self.sent).map(framed).sum();
        self.window.allows(self.sent + 1 - self.acked, bytes)
    }

    fn finish_if_done(&mut self) {
        if self.acked == self.program.lines.len() && self.outcome.is_none() {
            self.outcome = Some(match (self.failing.take(), self.stopping) {
                (Some(failed), _) => failed,
                (None, Some(row)) => Outcome::Stopped { row },
                (None, None) => Outcome::Done,
            });
        }
    }
}

impl Session for SlidingWindow {
    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        for line in self.reader.add(bytes) {
            match self.framing.parse(&line) {
                Some(Reply::Next { number, room }) if number <= self.high_water_mark => {
                    self.on_next(number, room, now_us);
                }
                Some(Reply::Error { number, why }) => {
                    self.fail(format!("the machine cannot execute line {number}: {why}"));
                }
                _ => {}
            }
        }
        self.finish_if_done();
    }

    fn transmit(&mut self, now_us: u64) -> Vec<u8> {
        self.finish_if_done();
        if self.outcome.is_some() {
            return Vec::new();
        }
        if self.sent > self.acked && now_us >= self.again_us {
            self.tries += 1;
            if self.tries > TRIES {
                let received = self.reader.last_received();
                let line = self.acked;
                self.give_up(format!("line {line} was not acknowledged in {TRIES} tries; {received}"));
                return Vec::new();
            }
            if self.sent > self.acked + 1 {
                self.window.on_loss();
            }
            self.sent = self.acked;
        }
        let mut out = Vec::new();
        while self.may_send() {
            if self.sent == self.acked {
                self.again_us = now_us;
            }
            self.retransmitted += u64::from(self.sent < self.high_water_mark);
            out.extend(self.framing.frame(self.sent, &self.program.lines[self.sent].text).into_bytes());
            self.sent += 1;
            self.high_water_mark = self.high_water_mark.max(self.sent);
            self.again_us = now_us + self.timeout_us();
        }
        out
    }

    fn wake_us(&self) -> Option<u64> {
        (self.outcome.is_none() && self.sent > self.acked).then_some(self.again_us)
    }

    fn stop(&mut self, now_us: u64) {
        if self.stopping.is_some() || self.failing.is_some() || self.outcome.is_some() {
            return;
        }
        if self.high_water_mark == 0 {
            self.outcome = Some(Outcome::Stopped { row: self.program.row(0) });
            return;
        }
        self.pause_at = None;
        self.stopping = Some(self.program.stop_after(self.high_water_mark));
        self.again_us = self.again_us.max(now_us);
    }

    fn pause(&mut self) {
        if self.stopping.is_none() && self.failing.is_none() {
            self.pause_at = self.program.next_pen_up(self.high_water_mark);
        }
    }

    fn waiting_for(&self) -> Option<Waiting> {
        (self.pause_at == Some(self.acked)).then_some(Waiting::Operator)
    }

    fn resume(&mut self, _now_us: u64) {
        self.pause_at = None;
    }

    fn reconnected(&mut self, now_us: u64) {
        self.reader.clear();
        self.tries = 0;
        self.again_us = now_us;
    }

    fn progress(&self) -> Progress {
        let (row, last_sent_row) = (self.program.row(self.acked), self.program.row(self.high_water_mark));
        let known = Progress::of(&self.program.lines, self.acked, row, last_sent_row);
        Progress { retransmitted: self.retransmitted, ..known }
    }

    fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn window_begins_small_grows_and_halves_on_loss() {
        let mut window = Window::new(None);
        assert!(window.allows(2, FIRST_WINDOW) && !window.allows(2, FIRST_WINDOW + 1));
        for _ in 0..100 {
            window.on_ack(1);
        }
        assert!(window.allows(9, LARGEST_WINDOW - GROWTH) && !window.allows(9, LARGEST_WINDOW + 1));
        let before = window.bytes;
        window.on_loss();
        assert_eq!(window.bytes, before / 2);
        for _ in 0..PROBE_LINES / 2 {
            window.on_ack(1);
        }
        assert_eq!(window.bytes, before * 3 / 4);
    }

    #[test]
    fn announced_room_and_line_limit_bound_the_window() {
        let mut window = Window::new(Some(2));
        window.announced = Some(500);
        assert!(window.allows(2, 500) && !window.allows(2, 501) && !window.allows(3, 100));
    }
}
