//! Seed 2's plotter: one line at a time, said again until the plotter answers `1`.
//!
//! A place is absolute and a pen state is a state: a line that is said twice does what it does once, as long as no other
//! has been said in between. So only one line is ever on the way, and after a line was said `k` times the next is not
//! said before `k` answers have come, or time enough has passed that the missing ones are lost: an answer that is late
//! must not be taken for the next line's. The plotter answers places from within 1 mm (it rounds 0.2 down to 0); before
//! the pen moves there is a pause for the rest of the way.
//!
//! A plotter that has just homed goes to 125, 125 by itself and says `1` there, which nobody asked for. So the
//! conversation begins by sending it there: that is answered once, whether it was on the way, there already, or elsewhere; and
//! if its own arrival was a moment earlier, the second answer follows at once, and is waited for.

use crate::conversation::{Conversation, Lines, Outcome, Progress};
use crate::script::{Script, Step};

/// What is not answered within this and the time that it should take is said again, microseconds.
const PATIENCE_US: u64 = 1_000_000;
/// What it should take is the plan's time times this: the plotter keeps no time.
const SLOWNESS: u64 = 3;
/// A line is said so often; the first for longer, as the plotter may be homing.
const TRIES: u32 = 12;
const FIRST_TRIES: u32 = 120;
/// Where the plotter goes by itself after homing, and how long that may take, microseconds.
const MIDDLE: &str = "125.0,125.0";
const TO_MIDDLE_US: u64 = 10_000_000;
/// Which of the lines that is, and how long nothing must come after its answer.
const MIDDLE_LINE: usize = 1;
const QUIET_US: u64 = 1_000_000;
/// Before and after the pen moves, microseconds.
const PEN_PAUSE_US: u64 = 150_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// The line after `done` may be said from this time on.
    Ready(u64),
    /// It was said so often, and is said again at this time.
    Said { times: u32, again_us: u64 },
    /// It was answered; so many answers are outstanding, and given up at this time.
    Late { missing: u32, until_us: u64 },
}

/// The conversation.
#[derive(Debug)]
pub struct Repeating {
    script: Script,
    steps: Vec<Step>,
    done: usize,
    state: State,
    lines: Lines,
    stopping: Option<u64>,
    outcome: Option<Outcome>,
    resent: u64,
}

impl Repeating {
    /// From the script's first line on.
    pub fn new(mut script: Script) -> Self {
        if let Some(first) = script.steps.first() {
            let middle =
                Step { text: MIDDLE.to_owned(), row: first.row, lasts_us: TO_MIDDLE_US, place: None };
            script.steps.insert(MIDDLE_LINE, middle);
        }
        Self {
            steps: std::mem::take(&mut script.steps),
            script,
            done: 0,
            state: State::Ready(0),
            lines: Lines::default(),
            stopping: None,
            outcome: None,
            resent: 0,
        }
    }

    fn row(&self, lines: usize) -> u64 {
        lines.checked_sub(1).map_or(0, |last| self.steps[last].row)
    }

    fn is_pen(&self, step: usize) -> bool {
        self.steps.get(step).is_some_and(|step| step.text.eq_ignore_ascii_case("p"))
    }

    /// The line has been answered and nothing more is to come.
    fn next(&mut self, now_us: u64) {
        self.done += 1;
        let pauses = self.is_pen(self.done) || self.is_pen(self.done - 1);
        self.state = State::Ready(now_us + if pauses { PEN_PAUSE_US } else { 0 });
        self.finish_if_done();
    }

    fn finish_if_done(&mut self) {
        if self.done == self.steps.len() {
            self.outcome = Some(match self.stopping {
                Some(row) => Outcome::Stopped { row },
                None => Outcome::Done,
            });
        }
    }

    fn answered(&mut self, now_us: u64) {
        match self.state {
            State::Said { times, .. } => {
                let missing = times - 1 + u32::from(self.done == MIDDLE_LINE);
                if missing == 0 {
                    self.next(now_us);
                } else {
                    let until_us = now_us + QUIET_US + u64::from(times - 1) * PATIENCE_US;
                    self.state = State::Late { missing, until_us };
                }
            }
            State::Late { missing, until_us } => {
                if missing == 1 {
                    self.next(now_us);
                } else {
                    self.state = State::Late { missing: missing - 1, until_us };
                }
            }
            State::Ready(_) => {}
        }
    }
}

impl Conversation for Repeating {
    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        for line in self.lines.add(bytes) {
            if line == "1" && self.outcome.is_none() {
                self.answered(now_us);
            }
        }
    }

    fn transmit(&mut self, now_us: u64) -> Vec<u8> {
        if self.outcome.is_none() && self.steps.is_empty() {
            self.finish_if_done();
        }
        if self.outcome.is_some() {
            return Vec::new();
        }
        if let State::Late { until_us, .. } = self.state
            && now_us >= until_us
        {
            self.next(now_us);
        }
        if self.outcome.is_some() {
            return Vec::new();
        }
        let step = &self.steps[self.done];
        let again_us = now_us + PATIENCE_US + SLOWNESS * step.lasts_us;
        let text = format!("{}\n", step.text);
        match self.state {
            State::Ready(from_us) if now_us >= from_us => {
                self.state = State::Said { times: 1, again_us };
                text.into_bytes()
            }
            State::Said { times, again_us: due_us } if now_us >= due_us => {
                let most = if self.done == 0 { FIRST_TRIES } else { TRIES };
                if times >= most {
                    let (row, at_most) = (self.row(self.done), self.row(self.done + 1));
                    let why = format!("no answer to `{}` after {times} tries", self.steps[self.done].text);
                    self.outcome = Some(Outcome::Failed { row, at_most, why });
                    return Vec::new();
                }
                self.resent += 1;
                self.state = State::Said { times: times + 1, again_us };
                text.into_bytes()
            }
            _ => Vec::new(),
        }
    }

    fn wake_us(&self) -> Option<u64> {
        if self.outcome.is_some() {
            return None;
        }
        Some(match self.state {
            State::Ready(from_us) => from_us,
            State::Said { again_us, .. } => again_us,
            State::Late { until_us, .. } => until_us,
        })
    }

    fn stop(&mut self, _now_us: u64) {
        if self.stopping.is_some() || self.outcome.is_some() {
            return;
        }
        if self.done == 0 && matches!(self.state, State::Ready(_)) {
            self.outcome = Some(Outcome::Stopped { row: 0 });
            return;
        }
        // The line that is on the way is waited for: it cannot be called back.
        let said = self.done + usize::from(!matches!(self.state, State::Ready(_)));
        let (tail, row) = self.script.stopping(&self.steps[..said]);
        self.steps.truncate(said);
        self.steps.extend(tail);
        self.stopping = Some(row);
    }

    fn reconnected(&mut self, now_us: u64) {
        self.lines.clear();
        // What was on the way is lost or has been done: said again, it does no harm.
        if let State::Said { times, .. } = self.state {
            self.state = State::Said { times, again_us: now_us };
        }
    }

    fn progress(&self) -> Progress {
        let known = Progress::of(
            &self.steps,
            self.done,
            self.row(self.done),
            self.row(self.steps.len().min(self.done + 1)),
        );
        Progress { resent: self.resent, ..known }
    }

    fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }
}
