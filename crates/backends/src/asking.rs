//! Machines that take each line once, answer `ok`, and can be asked where they stand: grbl and its kin, and the EBB.
//!
//! A line without an answer must not be said again: it may have been done, and a second time it would draw again (EBB) or
//! at the wrong time (G-code). Instead the machine is left to finish and asked where it is. The place tells which lines it
//! has done, because a line that leads to a place where an unanswered line also leads is held back until that one is
//! answered. Lines that do not move (pen, dwell, modes) may be said twice. Answers come in the order in which they were
//! given; before the conversation ends the machine is asked once more.

use crate::conversation::{Conversation, Lines, Outcome, Progress};
use crate::script::{Dialect, Script, Step};

/// What is not answered within this and the time it may have to wait for room makes the sender ask, microseconds.
const PATIENCE_US: u64 = 2_000_000;
/// Lines that a machine may have taken and not done: grbl plans 16 ahead.
const QUEUE: usize = 40;
/// A machine that is going somewhere is asked again after this.
const ASK_AGAIN_US: u64 = 200_000;
/// The line at which the machine waits for another pen; soon after it the machine is asked whether it does.
const PAUSE: &str = "M0";
const PAUSE_US: u64 = 300_000;
/// Questions without any answer before giving up.
const TRIES: u32 = 60;
/// Where grbl says it is, is its steps': half a step off, micrometres. 25 steps/mm are the coarsest that this holds for.
pub(crate) const BLUR_UM: u64 = 20;
/// An EBB answers `OK` to a question, too: so long it may take.
const STRAY_OK_US: u64 = 300_000;

/// What a machine says, as far as it matters.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Answer {
    Taken,
    Refused(String),
    Standing { place: [i64; 2], moving: bool },
    Other,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Lines are being said.
    Talking,
    /// It is asked where it stands.
    Asking { tries: u32, again_us: u64, stood: Option<[i64; 2]> },
    /// What is left of the answer to a question is waited for.
    Settling { until_us: u64 },
}

/// The conversation.
#[derive(Debug)]
pub struct Asking {
    script: Script,
    steps: Vec<Step>,
    /// Everything before this has been answered, or was found to be done.
    taken: usize,
    /// Everything before this has been said.
    said: usize,
    /// Bytes that the machine's buffer holds; for an EBB lines are said one by one.
    window: usize,
    state: State,
    deadline_us: u64,
    /// Where it stood before anything was said.
    begins: Option<[i64; 2]>,
    lines: Lines,
    /// Whether grbl said that it holds when last asked, and whether it is to be told to go on.
    holds: bool,
    goes_on: bool,
    /// Whether an EBB's motors were moving when last asked.
    moving: bool,
    /// grbl's offset of work coordinates, micrometres.
    offset: [i64; 2],
    stopping: Option<u64>,
    failing: Option<Outcome>,
    outcome: Option<Outcome>,
    resent: u64,
    ever: usize,
    asked: u64,
}

impl Asking {
    /// With a receive buffer of so many bytes.
    pub fn new(mut script: Script, window: usize) -> Self {
        Self {
            steps: std::mem::take(&mut script.steps),
            script,
            taken: 0,
            said: 0,
            window,
            state: State::Asking { tries: 0, again_us: 0, stood: None },
            deadline_us: 0,
            begins: None,
            lines: Lines::default(),
            holds: false,
            goes_on: false,
            moving: true,
            offset: [0; 2],
            stopping: None,
            failing: None,
            outcome: None,
            resent: 0,
            ever: 0,
            asked: 0,
        }
    }

    fn is_ebb(&self) -> bool {
        matches!(self.script.dialect, Dialect::Ebb(..))
    }

    fn end(&self) -> &'static str {
        if self.is_ebb() { "\r" } else { "\n" }
    }

    fn row(&self, lines: usize) -> u64 {
        lines.checked_sub(1).map_or(0, |last| self.steps[last].row)
    }

    /// Where the machine is when the first `lines` have been done; nothing before it has been asked.
    fn place(&self, lines: usize) -> Option<[i64; 2]> {
        self.steps[..lines].iter().rev().find_map(|step| step.place).or(self.begins)
    }

    /// How far the machine says it is at the most from where it was sent: grbl's steps are not micrometres.
    fn blur(&self) -> u64 {
        if self.is_ebb() { 0 } else { BLUR_UM }
    }

    /// How far `place` is from where the first `lines` lead, along the farther axis.
    fn off(&self, lines: usize, place: [i64; 2]) -> u64 {
        self.place(lines).map_or(u64::MAX, |at| at[0].abs_diff(place[0]).max(at[1].abs_diff(place[1])))
    }

    fn answer(&mut self, line: &str) -> Answer {
        if line.eq_ignore_ascii_case("ok") {
            return Answer::Taken;
        }
        if self.is_ebb() {
            if let Some(state) = line.strip_prefix("QM,") {
                self.moving = state.split(',').any(|word| word != "0");
                return Answer::Other;
            }
            if line.starts_with('!') {
                return Answer::Refused(line.to_owned());
            }
            return match pair(line) {
                Some(place) => Answer::Standing { place, moving: self.moving },
                None => Answer::Other,
            };
        }
        if line.starts_with("error") || line.starts_with("ALARM") {
            return Answer::Refused(line.to_owned());
        }
        if line.starts_with("<Alarm") {
            return Answer::Refused("the machine is in alarm: home it or unlock it first".to_owned());
        }
        if line.starts_with('<') {
            self.holds = line.starts_with("<Hold");
        }
        match grbl_report(line, &mut self.offset) {
            Some((place, moving)) => Answer::Standing { place, moving },
            None => Answer::Other,
        }
    }

    fn taken(&mut self, now_us: u64) {
        match self.state {
            State::Settling { .. } => self.state = State::Talking,
            // An EBB's answers to questions look like those to lines.
            State::Asking { .. } if self.is_ebb() => {}
            _ => {
                if self.taken < self.said {
                    self.taken += 1;
                    self.deadline_us = now_us + self.patience();
                    if self.taken == self.said && matches!(self.state, State::Asking { .. }) && self.taken > 0
                    {
                        // Everything has been answered after all.
                        self.state = State::Talking;
                    }
                }
            }
        }
    }

    /// The machine is at rest at this place: what has it done?
    fn stands(&mut self, place: [i64; 2], now_us: u64) {
        self.begins.get_or_insert(place);
        // The nearest, and of several the first: what follows it does not move, or leads where the machine is already.
        let fits = |lines: &usize| self.off(*lines, place) <= self.blur();
        let nearest = (self.taken..=self.said).filter(fits).min_by_key(|lines| self.off(*lines, place));
        // An answer that was counted for the wrong line can only have been an early one.
        let known = nearest.or_else(|| (self.taken.saturating_sub(3)..self.taken).rev().find(fits));
        let Some(done) = known else {
            let expected = self.place(self.taken).unwrap_or(place);
            let why = format!(
                "the machine stands at {place:?}, where no line led it (it was last known at {expected:?})"
            );
            self.fail(why);
            return;
        };
        (self.taken, self.said) = (done, done);
        if done == self.steps.len() {
            self.outcome = Some(match self.stopping {
                Some(row) => Outcome::Stopped { row },
                None => Outcome::Done,
            });
        }
        self.state =
            if self.is_ebb() { State::Settling { until_us: now_us + STRAY_OK_US } } else { State::Talking };
    }

    /// It cannot go on: the pen is lifted, whether or not anybody listens.
    fn fail(&mut self, why: String) {
        if self.failing.is_none() && self.outcome.is_none() {
            let (row, at_most) = (self.row(self.taken), self.row(self.said));
            self.failing = Some(Outcome::Failed { row, at_most, why });
        }
    }

    fn ask(&mut self, now_us: u64) {
        // Until it says otherwise: the answer that says so may be lost.
        self.moving = true;
        self.state = State::Asking { tries: 0, again_us: now_us, stood: None };
    }

    /// Whether a pause has no answer yet: nothing is said after it. Lines before it may lack theirs, too.
    fn pauses(&self) -> bool {
        self.said > self.taken && self.steps[self.said - 1].text.starts_with(PAUSE)
    }

    fn patience(&self) -> u64 {
        if self.pauses() {
            return PAUSE_US;
        }
        let waiting = &self.steps[self.taken.saturating_sub(QUEUE)..self.said];
        PATIENCE_US + 2 * waiting.iter().map(|step| step.lasts_us).sum::<u64>()
    }

    /// Whether the next line may be said now.
    fn may_say(&self) -> bool {
        let Some(next) = self.steps.get(self.said) else { return false };
        if self.said == self.taken {
            return true;
        }
        // What follows a pause is said once it is over: a machine that is stopped meanwhile must not draw with the wrong pen.
        if self.is_ebb() || self.steps[self.taken..self.said].iter().any(|step| step.text.starts_with(PAUSE))
        {
            return false;
        }
        let waiting: usize = self.steps[self.taken..self.said].iter().map(|step| step.text.len() + 1).sum();
        if waiting + next.text.len() + 1 > self.window {
            return false;
        }
        // Two unanswered lines must not lead to the same place, unless nothing moves in between.
        let Some(to) = next.place else { return true };
        self.place(self.said) == Some(to)
            || (self.taken..self.said).all(|lines| self.place(lines) != Some(to))
    }
}

impl Conversation for Asking {
    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        for line in self.lines.add(bytes) {
            if self.outcome.is_some() {
                return;
            }
            match self.answer(&line) {
                Answer::Taken => self.taken(now_us),
                Answer::Refused(what) => {
                    let line = self.steps.get(self.taken).map_or("", |step| step.text.as_str());
                    let why = format!("the machine answers {what} to `{line}`");
                    self.fail(why);
                }
                Answer::Standing { place, moving } => {
                    if let State::Asking { again_us, stood, .. } = self.state {
                        // grbl may be idle between two lines: it has to be so twice.
                        let settled = !moving && (self.is_ebb() || stood == Some(place));
                        if settled {
                            self.stands(place, now_us);
                        } else {
                            let stood = (!moving).then_some(place);
                            self.state = State::Asking { tries: 0, again_us, stood };
                        }
                    }
                }
                Answer::Other => {}
            }
        }
    }

    fn transmit(&mut self, now_us: u64) -> Vec<u8> {
        if self.outcome.is_some() {
            return Vec::new();
        }
        let mut out = String::new();
        if let Some(failed) = self.failing.clone() {
            for step in self.script.stopping(&[]).0.iter().filter(|_| !self.is_ebb()) {
                out.push_str(&step.text);
                out.push_str(self.end());
            }
            if self.is_ebb() {
                out.push_str("SP,1,500\r");
            }
            self.outcome = Some(failed);
            return out.into_bytes();
        }
        if std::mem::take(&mut self.goes_on) {
            self.holds = false;
            return b"~".to_vec();
        }
        match self.state {
            State::Asking { tries, again_us, stood } => {
                if now_us < again_us {
                    return Vec::new();
                }
                if tries >= TRIES {
                    self.fail(format!("no answer to {TRIES} questions where the machine stands"));
                    return self.transmit(now_us);
                }
                self.asked += 1;
                self.state = State::Asking { tries: tries + 1, again_us: now_us + ASK_AGAIN_US, stood };
                out.push_str(if self.is_ebb() { "QM\rQS\r" } else { "?" });
                return out.into_bytes();
            }
            State::Settling { until_us } if now_us < until_us => return Vec::new(),
            State::Settling { .. } => self.state = State::Talking,
            State::Talking => {}
        }
        if self.taken == self.steps.len() || self.said > self.taken && now_us >= self.deadline_us {
            self.ask(now_us);
            return self.transmit(now_us);
        }
        while self.may_say() {
            self.resent += u64::from(self.said < self.ever);
            out.push_str(&self.steps[self.said].text);
            out.push_str(self.end());
            self.said += 1;
            self.ever = self.ever.max(self.said);
            self.deadline_us = now_us + self.patience();
        }
        out.into_bytes()
    }

    fn wake_us(&self) -> Option<u64> {
        if self.outcome.is_some() {
            return None;
        }
        if self.failing.is_some() || self.goes_on {
            return Some(0);
        }
        match self.state {
            State::Asking { again_us, .. } => Some(again_us),
            State::Settling { until_us } => Some(until_us),
            State::Talking if self.taken == self.steps.len() || self.may_say() => Some(0),
            State::Talking => (self.said > self.taken).then_some(self.deadline_us),
        }
    }

    fn stop(&mut self, _now_us: u64) {
        if self.stopping.is_some() || self.outcome.is_some() {
            return;
        }
        if self.ever == 0 {
            self.outcome = Some(Outcome::Stopped { row: 0 });
            return;
        }
        self.goes_on |= self.waits_for_hand();
        // Lines that were said and found not to be done are said again: they are part of what was begun.
        let (tail, row) = self.script.stopping(&self.steps[..self.ever]);
        self.steps.truncate(self.ever);
        self.steps.extend(tail);
        self.stopping = Some(row);
    }

    fn waits_for_hand(&self) -> bool {
        self.holds && self.pauses()
    }

    fn go_on(&mut self) {
        self.goes_on |= self.waits_for_hand();
    }

    fn reconnected(&mut self, now_us: u64) {
        self.lines.clear();
        self.ask(now_us);
    }

    fn progress(&self) -> Progress {
        let known =
            Progress::of(&self.steps, self.taken, self.row(self.taken), self.row(self.ever.max(self.taken)));
        Progress { resent: self.resent, asked: self.asked, ..known }
    }

    fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }
}

/// Two whole numbers with a comma between.
fn pair(line: &str) -> Option<[i64; 2]> {
    let (a, b) = line.split_once(',')?;
    Some([a.trim().parse().ok()?, b.trim().parse().ok()?])
}

/// Where grbl stands in work coordinates, micrometres, and whether it moves, of a report such as `<Idle|MPos:1.000,2.000,0.000|...>`.
/// The offset of work coordinates comes with some reports only.
pub(crate) fn grbl_report(line: &str, offset: &mut [i64; 2]) -> Option<([i64; 2], bool)> {
    let mut words = line.strip_prefix('<')?.strip_suffix('>')?.split('|');
    let moving = words.next()? != "Idle";
    let (mut machine, mut work) = (None, None);
    for word in words {
        if let Some(at) = word.strip_prefix("WCO:").and_then(micrometres) {
            *offset = at;
        } else if let Some(at) = word.strip_prefix("MPos:").and_then(micrometres) {
            machine = Some(at);
        } else if let Some(at) = word.strip_prefix("WPos:").and_then(micrometres) {
            work = Some(at);
        }
    }
    let place = work.or(machine.map(|at| [0, 1].map(|axis| at[axis] - offset[axis])))?;
    Some((place, moving))
}

/// x and y of `X,Y,Z` in mm.
fn micrometres(text: &str) -> Option<[i64; 2]> {
    let mut words = text.split(',').map(|word| word.parse::<f64>().ok().filter(|mm| mm.abs() < 1e9));
    let mut next = || Some((words.next()?? * 1000.0).round() as i64);
    Some([next()?, next()?])
}
