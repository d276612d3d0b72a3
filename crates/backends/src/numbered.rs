//! Tick lines with numbers and checksums: lines may be lost, doubled or garbled in either direction.
//!
//! | to the machine | |
//! |---|---|
//! | `NUMBER:LINE*SUM` | a tick line. 0 begins a conversation, and is the first line that is sent |
//! | `where*SUM` | asks where the motors are |
//!
//! | from the machine | |
//! |---|---|
//! | `ok NUMBER*SUM` | everything before that number has been taken, this is what comes next |
//! | `error NUMBER WHY*SUM` | this line cannot be followed |
//! | `at T1 T2 MOVING*SUM` | where the motors are, and whether they are going to move (1) or not (0) |
//! | `at unknown*SUM` | they have been homed, and nothing was said since |
//!
//! A machine takes a line if its sum is right and its number is the next; whatever else comes, it answers with the number
//! that it wants. So the sender may say anything again at any time: nothing is done twice, nothing is left out.

use std::collections::VecDeque;

use crate::conversation::{Conversation, Lines, Outcome, Progress, framed, unframed};
use crate::script::{Script, Step};

/// A line that is not answered is said again after this and the time that it may have to wait for room, microseconds.
const PATIENCE_US: u64 = 1_000_000;
/// A line is said so often without any progress.
const TRIES: u32 = 12;
/// A pen that is lifted because of an error has so long, microseconds.
const LIFT_US: u64 = 300_000;
/// So many lines may wait in the machine before a new one is answered.
const QUEUE: usize = 48;

/// The conversation.
#[derive(Debug)]
pub struct Numbered {
    script: Script,
    steps: Vec<Step>,
    /// Everything before this has been taken.
    taken: usize,
    /// Everything before this has been said since the last time that had to be said again.
    said: usize,
    /// Everything before this has been said at least once.
    ever: usize,
    window: usize,
    lines: Lines,
    out: VecDeque<u8>,
    /// When the line after `taken` is said again.
    again_us: u64,
    tries: u32,
    stopping: Option<u64>,
    failing: Option<Outcome>,
    outcome: Option<Outcome>,
    resent: u64,
}

impl Numbered {
    /// With so many lines on the way at once.
    pub fn new(mut script: Script, window: usize) -> Self {
        Self {
            steps: std::mem::take(&mut script.steps),
            script,
            taken: 0,
            said: 0,
            ever: 0,
            window: window.max(1),
            lines: Lines::default(),
            out: VecDeque::new(),
            again_us: 0,
            tries: 0,
            stopping: None,
            failing: None,
            outcome: None,
            resent: 0,
        }
    }

    fn patience(&self) -> u64 {
        let waiting = &self.steps[self.taken.saturating_sub(QUEUE)..self.said.min(self.steps.len())];
        PATIENCE_US + waiting.iter().map(|step| step.lasts_us).sum::<u64>()
    }

    fn row(&self, lines: usize) -> u64 {
        lines.checked_sub(1).map_or(0, |last| self.steps[last].row)
    }

    /// Nobody listens any more.
    fn give_up(&mut self, why: String) {
        let (row, at_most) = (self.row(self.taken), self.row(self.ever));
        let failed = self.failing.take().unwrap_or(Outcome::Failed { row, at_most, why });
        self.outcome.get_or_insert(failed);
    }

    /// The machine cannot follow; it still listens, and lifts the pen where it is.
    fn fail(&mut self, why: String) {
        if self.failing.is_some() {
            return self.give_up(why);
        }
        let row = self.row(self.taken);
        self.failing = Some(Outcome::Failed { row, at_most: row, why });
        let moved = self.steps[..self.taken].iter().rev().find(|step| step.place.is_some());
        let lift = moved.filter(|step| !step.text.starts_with("m 0 ")).and_then(|step| {
            let [a, b] = step.place?;
            let text = format!("m 0 {LIFT_US} {a} {b}");
            Some(Step { text, row, lasts_us: LIFT_US, place: step.place })
        });
        self.steps.truncate(self.taken);
        self.steps.extend(lift);
        (self.said, self.ever) = (self.taken, self.taken);
    }

    fn finish_if_done(&mut self) {
        if self.taken == self.steps.len() && self.outcome.is_none() {
            self.outcome = Some(match (self.failing.take(), self.stopping) {
                (Some(failed), _) => failed,
                (None, Some(row)) => Outcome::Stopped { row },
                (None, None) => Outcome::Done,
            });
        }
    }
}

impl Conversation for Numbered {
    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        for line in self.lines.add(bytes) {
            let Some(text) = unframed(&line) else { continue };
            let mut words = text.splitn(3, ' ');
            let (verb, number) = (words.next(), words.next().and_then(|word| word.parse::<usize>().ok()));
            match (verb, number) {
                (Some("ok"), Some(next)) if next <= self.ever => {
                    if next > self.taken {
                        self.taken = next;
                        self.tries = 0;
                        self.again_us = now_us + self.patience();
                        self.said = self.said.max(next);
                    } else if next == self.taken && self.said > next {
                        // It wants this one, and has thrown away what came after: what is on the way is answered too, so
                        // only once, and soon.
                        self.again_us = self.again_us.min(now_us + PATIENCE_US / 4);
                    }
                }
                (Some("error"), Some(number)) => {
                    let why = words.next().unwrap_or("no reason given").to_owned();
                    self.fail(format!("the machine cannot follow line {number}: {why}"));
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
        if self.said > self.taken && now_us >= self.again_us {
            self.tries += 1;
            if self.tries > TRIES {
                self.give_up(format!("no answer to line {} after {TRIES} tries", self.taken));
                return Vec::new();
            }
            self.said = self.taken;
        }
        // The first line begins the numbers anew: it must have been taken before another follows.
        let window = if self.taken == 0 { 1 } else { self.window };
        while self.said < self.steps.len() && self.said < self.taken + window {
            if self.said == self.taken {
                self.again_us = now_us;
            }
            self.resent += u64::from(self.said < self.ever);
            let line = framed(&format!("{}:{}", self.said, self.steps[self.said].text));
            self.out.extend(line.bytes());
            self.out.push_back(b'\n');
            self.said += 1;
            self.ever = self.ever.max(self.said);
            self.again_us = now_us + self.patience();
        }
        self.out.drain(..).collect()
    }

    fn wake_us(&self) -> Option<u64> {
        (self.outcome.is_none() && self.said > self.taken).then_some(self.again_us)
    }

    fn stop(&mut self, now_us: u64) {
        if self.stopping.is_some() || self.failing.is_some() || self.outcome.is_some() {
            return;
        }
        if self.ever == 0 {
            self.outcome = Some(Outcome::Stopped { row: self.row(0) });
            return;
        }
        let (tail, row) = self.script.stopping(&self.steps[..self.ever]);
        self.steps.truncate(self.ever);
        self.steps.extend(tail);
        self.stopping = Some(row);
        self.again_us = self.again_us.max(now_us);
    }

    fn reconnected(&mut self, now_us: u64) {
        self.lines.clear();
        self.out.clear();
        self.tries = 0;
        self.again_us = now_us;
    }

    fn progress(&self) -> Progress {
        let known = Progress::of(&self.steps, self.taken, self.row(self.taken), self.row(self.ever));
        Progress { resent: self.resent, ..known }
    }

    fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }
}
