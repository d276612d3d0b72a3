//! Sends HP-GL to a pen plotter that is asked how much room its buffer has.
//!
//! `ESC.B` is answered as soon as it is received. So its answer proves that everything before it has
//! arrived, and says how many bytes the plotter has not drawn yet. Instructions are sent in blocks, each
//! with an `ESC.B` behind it; the next block waits for the answer. An answer that comes late counts fewer
//! free bytes than there are by then, plus what was sent after it was asked: that much is subtracted.
//!
//! No two states of the pen (position, up or down) within a block are the same. After the port was lost the
//! plotter draws what it has; its position then names the instruction of the last block that it reached.

use std::collections::VecDeque;

use super::check;
use super::plotter::{Handshake, Plotter};
use super::query::{Asked, Query, instruction_error, line_error};
use super::state::{Follower, PenState, mnemonic, numbers};
use crate::program::{Line, Program};
use crate::session::{LineReader, Outcome, Progress, Session, Waiting};

/// A port that was just opened may lose its first bytes; microseconds.
const OPENING_US: u64 = 500_000;
/// How long an answer to an escape sequence may take, microseconds.
const ANSWER_US: u64 = 2_000_000;
/// Tries of the first question.
const FIRST_TRIES: u32 = 10;
/// Tries of any other question.
const TRIES: u32 = 40;
/// An answer that has not arrived after this will not arrive, microseconds.
const LATE_US: u64 = 7_000_000;
/// The buffer is asked for at this interval, microseconds.
const POLL_US: u64 = 50_000;
/// Motion that the plotter holds in advance, microseconds: more delays a stop, less starves the pen.
const AHEAD_US: u64 = 1_500_000;
/// Instructions out of the buffer that may still move the pen.
const UNFINISHED: usize = 3;
/// Without any progress for this long the session fails, microseconds.
const STALL_US: u64 = 60_000_000;
/// Without progress for this long the plotter is asked why, microseconds.
const CURIOUS_US: u64 = 3_000_000;
/// On a stop a stroke that takes longer than this is cut, microseconds.
const STOP_US: u64 = 5_000_000;
/// Errors of the line are asked for after this many polls.
const POLLS_A_CHECK: u32 = 64;
/// `ESC.O`: VIEW pressed, lever or wheels up.
const VIEW: i64 = 16;
/// The same: lever or wheels up.
const LEVER: i64 = 32;
/// `OS`: initialized since the last `OS`.
const INITIALIZED: i64 = 8;

/// What the session does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Asks these questions before the first instruction: place in [`OPENING`].
    Opening(usize),
    /// Sends instructions.
    Draw,
    /// Everything was drawn: asks where the pen is.
    Confirm,
    /// Asks for errors of instructions, then of the line.
    Errors(Query),
    /// The port was lost: waits until the plotter has drawn what it received.
    Drain,
    /// Then drops half an instruction and asks these: place in [`RECOVERY`].
    Recover(usize),
}

const OPENING: [Query; 7] = [
    Query::LineError,
    Query::Room,
    Query::Model,
    Query::HardClip,
    Query::Points,
    Query::Initialized,
    Query::Position,
];
const RECOVERY: [Query; 2] = [Query::Initialized, Query::Position];

/// The session.
#[derive(Debug)]
pub(crate) struct PlotterSession {
    program: Program,
    plotter: Plotter,
    /// Whether the operator named the plotter.
    is_named: bool,
    handshake: Handshake,
    stage: Stage,
    /// States of the pen after each part of each instruction.
    states: Vec<Vec<Option<PenState>>>,
    /// Ink up to the end of each instruction, plotter units.
    ink: Vec<f64>,
    /// The state before the first instruction.
    start: Option<(i64, i64)>,
    sent: usize,
    acked: usize,
    drawn: usize,
    /// Instructions on their way or in the buffer: number after it, HP-GL bytes sent up to its end.
    in_flight: VecDeque<(usize, u64)>,
    sent_bytes: u64,
    /// Size of the buffer, bytes.
    size: usize,
    /// Free bytes at least.
    free: Option<usize>,
    /// Questions that may still be answered.
    asked: VecDeque<Asked>,
    /// The question that is waited for, when it is asked again, and how often it was asked.
    waiting: Option<(Query, u64, u32)>,
    /// Nothing is sent before this time.
    next_us: u64,
    polls: u32,
    progressed_us: u64,
    /// XOFF was received.
    held: bool,
    note: Option<&'static str>,
    limits: check::Limits,
    reader: LineReader,
    /// Instructions are only sent up to this number until the operator resumes.
    pause_at: Option<usize>,
    /// A pause was asked for before the first instruction.
    pauses_first: bool,
    stopping: Option<u64>,
    /// Sent once, after the session has failed.
    last_words: Option<&'static str>,
    retransmitted: u64,
    queries: u64,
    outcome: Option<Outcome>,
}

impl PlotterSession {
    /// From the program's first line on. Without a plotter its answer to `OI` chooses one.
    pub(crate) fn new(program: Program, plotter: Option<&Plotter>, handshake: Option<Handshake>) -> Self {
        let is_named = plotter.is_some();
        let plotter = plotter.unwrap_or(Plotter::generic()).clone();
        Self {
            handshake: handshake.unwrap_or(Handshake::Polling),
            size: plotter.buffer_bytes,
            program,
            plotter,
            is_named,
            stage: Stage::Opening(0),
            states: Vec::new(),
            ink: Vec::new(),
            start: None,
            sent: 0,
            acked: 0,
            drawn: 0,
            in_flight: VecDeque::new(),
            sent_bytes: 0,
            free: None,
            asked: VecDeque::new(),
            waiting: None,
            next_us: 0,
            polls: 0,
            progressed_us: 0,
            held: false,
            note: None,
            limits: check::Limits::default(),
            reader: LineReader::default(),
            pause_at: None,
            pauses_first: false,
            stopping: None,
            last_words: None,
            retransmitted: 0,
            queries: 0,
            outcome: None,
        }
    }

    fn fail(&mut self, why: String) {
        let Progress { row, last_sent_row, .. } = self.progress();
        if self.sent > 0 {
            // Drops what is not drawn yet, then lifts.
            self.last_words = Some("\u{1b}.K;PU;");
        }
        self.outcome.get_or_insert(Outcome::Failed { row, last_sent_row, why });
    }

    /// The question of the current stage, if it has one.
    fn question(&self) -> Option<Query> {
        match self.stage {
            Stage::Opening(step) => OPENING.get(step).copied(),
            Stage::Recover(step) => RECOVERY.get(step).copied(),
            Stage::Confirm => Some(Query::Position),
            Stage::Errors(query) => Some(query),
            Stage::Draw | Stage::Drain => None,
        }
    }

    /// Asks, if no answer to another question of the same form may still arrive.
    fn ask(&mut self, query: Query, now_us: u64) -> Vec<u8> {
        self.asked.retain(|asked| asked.at_us + LATE_US > now_us);
        let confusable = |asked: &&Asked| asked.query != query && asked.query.numbers() == query.numbers();
        if let Some(other) = self.asked.iter().filter(confusable).map(|asked| asked.at_us).max() {
            self.next_us = other + LATE_US;
            return Vec::new();
        }
        let tries = match self.waiting {
            Some((waiting, _, tries)) if waiting == query => tries + 1,
            _ => 1,
        };
        // Answers in the order of the buffer wait for the motion before them.
        let motion_us = if query.text().starts_with('\u{1b}') { 0 } else { 2 * self.unfinished_us() };
        self.waiting = Some((query, now_us + ANSWER_US + motion_us, tries));
        self.asked.push_back(Asked { query, at_us: now_us, sent_bytes: self.sent_bytes, sent: self.sent });
        self.queries += 1;
        let mut bytes = Vec::new();
        if self.stage == Stage::Opening(0) {
            bytes.extend_from_slice(self.hello().as_bytes());
        }
        if query == Query::Model {
            bytes.extend_from_slice(b"IN;");
        }
        bytes.extend_from_slice(query.text().as_bytes());
        bytes
    }

    /// Switches the plotter on, drops what it has half received, and sets the handshake.
    fn hello(&self) -> String {
        let handshake = match self.handshake {
            Handshake::Polling => "\u{1b}.@;0:",
            Handshake::XonXoff => "\u{1b}.I81;;17:\u{1b}.N;19:\u{1b}.@;0:",
            Handshake::Hardware => "\u{1b}.I80:\u{1b}.@;1:",
        };
        format!("\u{1b}.(\u{1b}.J\u{1b}.K\u{1b}.R{handshake}")
    }

    /// Estimated duration of what was sent and is still in the buffer.
    fn motion_ahead_us(&self) -> u64 {
        self.program.lines[self.drawn..self.sent].iter().map(|line| line.duration_us).sum()
    }

    /// The same with the instructions that have left the buffer and may not be done.
    fn unfinished_us(&self) -> u64 {
        let from = self.drawn.saturating_sub(UNFINISHED);
        self.program.lines[from..self.sent].iter().map(|line| line.duration_us).sum()
    }

    /// The state of the pen after the first `lines` instructions.
    fn state_after(&self, lines: usize) -> Option<PenState> {
        let start = self.start.map(|at| PenState { at, down: false, tolerance: 0 });
        let before = lines.checked_sub(1).and_then(|line| self.states.get(line));
        before.map_or(start, |states| states.last().copied().flatten())
    }

    /// Splits instructions so that no state of the pen comes twice in one, and follows the pen.
    fn follow(&mut self) {
        let mut follower = Follower::new(self.start, self.plotter.max_speed_cm_s);
        let mut lines = Vec::with_capacity(self.program.lines.len());
        self.states.clear();
        for line in std::mem::take(&mut self.program.lines) {
            let before = follower.state;
            let states = follower.execute(&line.text);
            let pieces = distinct_pieces(before, &states);
            if pieces.len() == 1 {
                self.states.push(states);
                lines.push(line);
                continue;
            }
            let pairs = numbers(&line.text);
            for piece in &pieces {
                let list: Vec<String> =
                    pairs[2 * piece.start..2 * piece.end].iter().map(f64::to_string).collect();
                let text = format!("{}{};", mnemonic(&line.text), list.join(","));
                let duration_us = line.duration_us * piece.len() as u64 / states.len() as u64;
                self.states.push(states[piece.clone()].to_vec());
                lines.push(Line { text, duration_us, ..line.clone() });
            }
        }
        self.program.lines = lines;
        let mut last = self.start.map(|at| PenState { at, down: false, tolerance: 0 });
        let mut ink = 0.0;
        self.ink = Vec::with_capacity(self.states.len());
        for states in &self.states {
            for state in states {
                if let (Some(from), Some(to)) = (last, state) {
                    ink += if to.down { from.distance(to) } else { 0.0 };
                }
                last = *state;
            }
            self.ink.push(ink);
        }
    }

    /// Up to here the position of the pen is known, and is compared at the end.
    fn known_lines(&self) -> usize {
        let known = |states: &Vec<Option<PenState>>| states.last().copied().flatten().is_some();
        self.states.iter().rposition(known).map_or(0, |line| line + 1)
    }

    /// The instructions of the next block: not more than the buffer, the time ahead and their states allow.
    fn block(&self) -> std::ops::Range<usize> {
        let free = self.free.unwrap_or(0);
        // A USB adapter may hold some bytes back, and the plotter's own count may be late.
        let room = if free >= self.size { self.size } else { free.saturating_sub(self.size / 8) };
        let most = room.min((self.size / 4).max(self.plotter.line_bytes()));
        let mut limit = self.program.lines.len().min(self.pause_at.unwrap_or(usize::MAX));
        let known = self.known_lines();
        if known > self.limits.confirmed {
            // What follows has no position: the one before is confirmed first.
            limit = limit.min(known);
        }
        let mut ahead_us = self.motion_ahead_us();
        let (mut end, mut bytes) = (self.sent, 0);
        // With what may not have arrived: an old answer acknowledges less than there is.
        let unsure = self.states[self.acked..self.sent].iter().flatten().copied();
        let mut seen: Vec<PenState> =
            [self.state_after(self.acked)].into_iter().chain(unsure).flatten().collect();
        while end < limit {
            let line = &self.program.lines[end];
            let states: Vec<PenState> = self.states[end].iter().copied().flatten().collect();
            let comes_again = states.iter().any(|state| {
                let earlier = &seen[..seen.len().saturating_sub(1)];
                earlier.iter().any(|seen| seen.resembles(state))
            });
            bytes += line.text.chars().count();
            if bytes > most || comes_again || ahead_us > AHEAD_US {
                break;
            }
            ahead_us += line.duration_us;
            seen.extend(states);
            end += 1;
        }
        self.sent..end
    }

    /// The next block, and the question for the room behind it.
    fn draw(&mut self, now_us: u64) -> Vec<u8> {
        let stuck_us = now_us.saturating_sub(self.progressed_us);
        // An XON may be lost.
        if self.held && stuck_us < LATE_US {
            self.next_us = now_us + POLL_US;
            return Vec::new();
        }
        let block = self.block();
        let mut bytes = Vec::new();
        for line in block.clone() {
            // One byte a character: texts are Latin-1.
            bytes.extend(self.program.lines[line].text.chars().map(|c| c as u8));
            self.sent_bytes += self.program.lines[line].text.chars().count() as u64;
            self.in_flight.push_back((line + 1, self.sent_bytes));
        }
        if !block.is_empty() {
            self.sent = block.end;
            self.progressed_us = now_us;
        }
        self.polls += 1;
        let is_free = block.is_empty() && self.asked.iter().all(|asked| asked.query.numbers() != 1);
        let query = if is_free && stuck_us > CURIOUS_US && self.polls.is_multiple_of(8) {
            Query::Status
        } else if is_free && self.polls > POLLS_A_CHECK {
            self.polls = 0;
            Query::LineError
        } else {
            Query::Room
        };
        bytes.extend(self.ask(query, now_us));
        bytes
    }

    /// Whether everything that may be sent is drawn as far as the buffer shows.
    fn is_drained(&self) -> bool {
        self.acked == self.sent
            && self.in_flight.is_empty()
            && self.free.is_some_and(|free| free >= self.size)
    }

    /// An answer to `query`.
    fn answered(&mut self, asked: Asked, values: &[i64], text: &str, now_us: u64) {
        if self.waiting.is_some_and(|(query, _, _)| query == asked.query) {
            self.waiting = None;
        }
        match asked.query {
            Query::Room => return self.room(asked, values[0], now_us),
            Query::Status => return self.held_by_operator(values[0], now_us),
            Query::LineError if self.stage == Stage::Draw && values[0] >= 15 => {
                let why =
                    format!("the plotter reports error {} (ESC.E): {}", values[0], line_error(values[0]));
                return self.fail(why);
            }
            _ => {}
        }
        match self.stage {
            Stage::Opening(step) if OPENING.get(step) == Some(&asked.query) => {
                self.opened(asked.query, values, text);
                self.next_question(now_us);
            }
            Stage::Recover(step) if RECOVERY.get(step) == Some(&asked.query) => {
                if asked.query == Query::Position {
                    return self.recovered(values, now_us);
                }
                if values[0] & INITIALIZED != 0 && !self.initializes_itself() {
                    let why = "the plotter was switched off or reset: it was initialized since the last instruction";
                    self.last_words = None;
                    let Progress { row, last_sent_row, .. } = self.progress();
                    self.outcome = Some(Outcome::Failed { row, last_sent_row, why: why.to_owned() });
                    return;
                }
                self.stage = Stage::Recover(step + 1);
            }
            Stage::Confirm if asked.query == Query::Position => self.confirmed(values, now_us),
            Stage::Errors(query) if query == asked.query => self.error(query, values[0]),
            _ => {}
        }
    }

    /// Whether an instruction of the program other than the first initializes the plotter.
    fn initializes_itself(&self) -> bool {
        self.program.lines[..self.sent].iter().skip(1).any(|line| mnemonic(&line.text) == "IN")
    }

    fn room(&mut self, asked: Asked, free: i64, now_us: u64) {
        let free = usize::try_from(free).unwrap_or(0);
        if self.stage == Stage::Opening(1) {
            self.size = free.max(1);
            self.free = Some(free);
            self.next_question(now_us);
            return;
        }
        let since = (self.sent_bytes - asked.sent_bytes.min(self.sent_bytes)) as usize;
        let bound = free.saturating_sub(since);
        let drawn_bytes = asked.sent_bytes.saturating_sub(self.size.saturating_sub(free) as u64);
        if self.free != Some(bound) {
            self.progressed_us = now_us;
        }
        self.free = Some(bound);
        if self.stage == Stage::Drain {
            // What was on its way is not known to have arrived.
            self.next_us = now_us + POLL_US;
            if free >= self.size {
                self.stage = Stage::Recover(0);
            }
            return;
        }
        self.acked = self.acked.max(asked.sent.min(self.sent));
        while let Some((line, _)) = self.in_flight.front().copied().filter(|(_, end)| *end <= drawn_bytes) {
            self.drawn = self.drawn.max(line);
            self.in_flight.pop_front();
            (self.progressed_us, self.note) = (now_us, None);
        }
        self.next_us = now_us;
        if self.is_drained() {
            self.drained(now_us);
        }
        if self.stage == Stage::Draw && self.block().is_empty() {
            self.next_us = now_us + POLL_US;
        }
    }

    /// Nothing is in the buffer any more: the end, a place to compare the position, or a pause.
    fn drained(&mut self, now_us: u64) {
        let known = self.known_lines();
        if self.sent == self.program.lines.len() || self.sent == known && known > self.limits.confirmed {
            self.stage = Stage::Confirm;
            self.next_us = now_us;
        }
    }

    fn held_by_operator(&mut self, status: i64, now_us: u64) {
        self.note = None;
        if status & LEVER != 0 {
            (self.note, self.progressed_us) = (Some("the lever or the wheels are up"), now_us);
        } else if status & VIEW != 0 {
            (self.note, self.progressed_us) = (Some("VIEW is pressed"), now_us);
        }
        self.next_us = now_us + POLL_US;
    }

    fn opened(&mut self, query: Query, values: &[i64], text: &str) {
        match (query, values) {
            (Query::Model, _) => self.identified(text),
            (Query::HardClip, [left, bottom, right, top]) => {
                self.limits.hard_clip = Some([*left, *bottom, *right, *top]);
            }
            (Query::Points, [x1, y1, x2, y2]) => self.limits.points = Some([*x1, *y1, *x2, *y2]),
            (Query::Position, [x, y, ..]) => self.start = Some((*x, *y)),
            _ => {}
        }
    }

    /// The plotter by its own name.
    fn identified(&mut self, model: &str) {
        if self.is_named {
            if !self.plotter.answers_as(model) {
                let (name, known) = (&self.plotter.name, self.plotter.identification.join(" or "));
                let why =
                    format!("the plotter calls itself {model}; {name} is {known}: choose another --plotter");
                self.fail(why);
            }
        } else if let Some(plotter) = Plotter::identified(model) {
            self.plotter = plotter.clone();
        }
    }

    /// The next question of the opening that this plotter can answer, or the first instruction.
    fn next_question(&mut self, now_us: u64) {
        let Stage::Opening(mut step) = self.stage else { return };
        loop {
            step += 1;
            match OPENING.get(step) {
                Some(query) if !self.plotter.knows(&query.text()[..2]) && query.text().ends_with(';') => {}
                Some(_) => break,
                None => return self.begin(now_us),
            }
        }
        self.stage = Stage::Opening(step);
    }

    /// The first instruction, unless the plotter cannot draw the program.
    fn begin(&mut self, now_us: u64) {
        if let Some(why) = check::fault(&self.program, &self.plotter, &self.limits) {
            return self.fail(why);
        }
        self.follow();
        // The opening has initialized the plotter already.
        if self.program.lines.first().is_some_and(|line| line.text == "IN;") {
            (self.sent, self.acked, self.drawn) = (1, 1, 1);
        }
        (self.free, self.stage) = (Some(self.size), Stage::Draw);
        (self.next_us, self.progressed_us) = (now_us, now_us);
        if std::mem::take(&mut self.pauses_first) {
            self.pause();
        }
    }

    /// Where the pen is once everything was drawn.
    fn confirmed(&mut self, values: &[i64], now_us: u64) {
        let &[x, y, pen] = values else { return };
        if let Some(state) = self.state_after(self.sent)
            && !state.matches((x, y), pen != 0)
        {
            let (wanted, down) = (state.at, |down: bool| if down { "down" } else { "up" });
            let why = format!(
                "everything was drawn, but the pen is at {x},{y} ({}) instead of {},{} ({}): bytes were lost or garbled on the way",
                down(pen != 0),
                wanted.0,
                wanted.1,
                down(state.down)
            );
            return self.fail(why);
        }
        self.drawn = self.sent;
        self.limits.confirmed = self.sent;
        if self.sent < self.program.lines.len() {
            (self.stage, self.next_us) = (Stage::Draw, now_us);
        } else if let Some(row) = self.stopping {
            self.outcome = Some(Outcome::Stopped { row });
        } else {
            self.stage = Stage::Errors(Query::Error);
        }
    }

    /// Errors that the plotter reports at the end.
    fn error(&mut self, query: Query, number: i64) {
        if query == Query::Error && number != 0 {
            let what = instruction_error(number);
            return self
                .fail(format!("everything was sent, but the plotter reports error {number} (OE): {what}"));
        }
        if query == Query::Error {
            self.stage = Stage::Errors(Query::LineError);
        } else if number > 10 {
            let what = line_error(number);
            self.fail(format!("everything was sent, but the plotter reports error {number} (ESC.E): {what}"));
        } else {
            self.outcome = Some(Outcome::Done);
        }
    }

    /// The plotter stands still after the port was lost: the instruction that it has reached.
    fn recovered(&mut self, values: &[i64], now_us: u64) {
        let &[x, y, pen] = values else { return };
        let at = ((x, y), pen != 0);
        // The last instruction that certainly arrived, then each part of those after it.
        let arrived = self.state_after(self.acked);
        let is_there = arrived.map_or(self.acked == self.sent, |state| state.matches(at.0, at.1));
        let mut found = is_there.then_some((self.acked, 0));
        let mut repeatable = None;
        for line in self.acked..self.sent {
            for (part, state) in self.states[line].iter().enumerate() {
                match state {
                    Some(state) if found.is_none() && state.matches(at.0, at.1) => {
                        let ends = part + 1 == self.states[line].len();
                        found = Some(if ends { (line + 1, 0) } else { (line, part + 1) });
                    }
                    None if mnemonic(&self.program.lines[line].text) == "SP" => {
                        repeatable = repeatable.or(Some((line, 0)));
                    }
                    _ => {}
                }
            }
        }
        let Some((line, part)) = found.or(repeatable) else {
            let why = format!(
                "the port was lost, and the pen is at {x},{y}, which is no position of the {} instructions then on their way",
                self.sent - self.acked
            );
            return self.fail(why);
        };
        self.retransmitted += (self.sent - line) as u64;
        if part > 0 {
            let text = &self.program.lines[line].text;
            let rest: Vec<String> = numbers(text)[2 * part..].iter().map(f64::to_string).collect();
            self.program.lines[line].text = format!("{}{};", mnemonic(text), rest.join(","));
            self.states[line].drain(..part);
        }
        (self.sent, self.acked, self.drawn) = (line, line, line);
        self.in_flight.clear();
        (self.sent_bytes, self.free) = (0, Some(self.size));
        self.asked.clear();
        (self.stage, self.next_us, self.progressed_us) = (Stage::Draw, now_us, now_us);
        if self.is_drained() {
            self.drained(now_us);
        }
    }

    /// The number of lines at least `from` after which a stroke has ended.
    fn stroke_end(&self, from: usize) -> usize {
        let lines = &self.program.lines;
        (from.max(1)..lines.len()).find(|line| lines[*line].row > lines[*line - 1].row).unwrap_or(lines.len())
    }

    /// Puts `PU` at this place, unless the pen is up there.
    fn lift_at(&mut self, place: usize) {
        let row = self.program.row(place);
        let is_lifted = place.checked_sub(1).is_some_and(|line| self.program.lines[line].text == "PU;");
        let state = self.state_after(place).map(|state| PenState { down: false, ..state });
        if !is_lifted {
            let lift = Line { text: "PU;".to_owned(), row, ..Line::default() };
            self.program.lines.insert(place, lift);
            self.states.insert(place, vec![state]);
            self.ink.insert(place, place.checked_sub(1).map_or(0.0, |line| self.ink[line]));
        }
    }
}

/// The pieces of an instruction with these states after each pair, such that in none of them a state comes
/// twice with other states between.
fn distinct_pieces(before: Option<PenState>, states: &[Option<PenState>]) -> Vec<std::ops::Range<usize>> {
    let mut pieces = Vec::new();
    let mut begin = 0;
    let mut seen: Vec<PenState> = before.into_iter().collect();
    for (part, state) in states.iter().enumerate() {
        let Some(state) = state else { continue };
        let earlier = &seen[..seen.len().saturating_sub(1)];
        if part > begin && earlier.iter().any(|seen| seen.resembles(state)) {
            pieces.push(begin..part);
            begin = part;
            seen = seen.pop().into_iter().collect();
        }
        seen.push(*state);
    }
    pieces.push(begin..states.len());
    pieces
}

impl Session for PlotterSession {
    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        let mut text = Vec::with_capacity(bytes.len());
        for byte in bytes {
            match byte {
                0x13 => self.held = true,
                0x11 => (self.held, self.next_us) = (false, self.next_us.min(now_us)),
                _ => text.push(*byte),
            }
        }
        for line in self.reader.add(&text) {
            if self.outcome.is_some() {
                return;
            }
            let place = self.asked.iter().position(|asked| asked.query.parse(&line).is_some());
            if let Some(place) = place
                && let Some(asked) = self.asked.remove(place)
                && let Some(values) = asked.query.parse(&line)
            {
                self.answered(asked, &values, &line, now_us);
            }
        }
    }

    fn transmit(&mut self, now_us: u64) -> Vec<u8> {
        if self.outcome.is_some() {
            return self.last_words.take().map(|words| words.as_bytes().to_vec()).unwrap_or_default();
        }
        if self.stage == Stage::Opening(0) && self.next_us == 0 {
            self.next_us = now_us + OPENING_US;
        }
        if let Some((query, due_us, tries)) = self.waiting {
            if now_us < due_us {
                return Vec::new();
            }
            let most = if self.stage == Stage::Opening(0) { FIRST_TRIES } else { TRIES };
            if tries >= most {
                let received = self.reader.last_received();
                self.fail(format!("no answer to {} after {tries} tries; {received}", query.name()));
                return Vec::new();
            }
            return self.ask(query, now_us);
        }
        if now_us < self.next_us || self.waiting_for().is_some() {
            return Vec::new();
        }
        let stuck_us = now_us.saturating_sub(self.progressed_us);
        if self.stage == Stage::Draw && stuck_us > STALL_US + 2 * self.unfinished_us() {
            self.fail(format!("the plotter has drawn nothing for {} s", stuck_us / 1_000_000));
            return Vec::new();
        }
        match (self.stage, self.question()) {
            (Stage::Recover(0), Some(query)) => {
                let mut bytes = b"\x1b.J\x1b.K".to_vec();
                let question = self.ask(query, now_us);
                if question.is_empty() {
                    return question;
                }
                bytes.extend(question);
                bytes
            }
            (_, Some(query)) => self.ask(query, now_us),
            (Stage::Drain, None) => self.ask(Query::Room, now_us),
            (_, None) => self.draw(now_us),
        }
    }

    fn wake_us(&self) -> Option<u64> {
        if self.outcome.is_some() || self.waiting_for().is_some() {
            return None;
        }
        Some(self.waiting.map_or(self.next_us, |(_, due_us, _)| due_us.max(self.next_us)))
    }

    fn stop(&mut self, _now_us: u64) {
        if self.stopping.is_some() || self.outcome.is_some() {
            return;
        }
        if self.sent == 0 {
            self.outcome = Some(Outcome::Stopped { row: self.program.row(0) });
            return;
        }
        self.pause_at = None;
        let end = self.stroke_end(self.sent);
        let left_us: u64 = self.program.lines[self.sent..end].iter().map(|line| line.duration_us).sum();
        let row = self.program.row(self.sent);
        let (cut, resumed) = if left_us > STOP_US { (self.sent, row.saturating_sub(1)) } else { (end, row) };
        self.program.lines.truncate(cut);
        self.states.truncate(cut);
        self.ink.truncate(cut);
        self.lift_at(cut);
        self.stopping = Some(resumed);
        if self.stage == Stage::Draw && self.waiting.is_none() {
            self.next_us = 0;
        }
        if matches!(self.stage, Stage::Errors(_)) {
            self.stage = Stage::Confirm;
        }
    }

    fn reconnected(&mut self, now_us: u64) {
        self.reader.clear();
        self.asked.clear();
        (self.waiting, self.held) = (None, false);
        (self.next_us, self.progressed_us) = (now_us + OPENING_US, now_us);
        self.stage = match self.stage {
            Stage::Opening(_) => Stage::Opening(0),
            _ => Stage::Drain,
        };
    }

    fn pause(&mut self) {
        if matches!(self.stage, Stage::Opening(_)) {
            self.pauses_first = true;
        } else if self.stopping.is_none() && self.outcome.is_none() {
            let end = self.stroke_end(self.sent);
            if end < self.program.lines.len() {
                self.lift_at(end);
                let is_inserted = self.program.lines[end].text == "PU;";
                self.pause_at = Some(end + usize::from(is_inserted));
            }
        }
    }

    fn waiting_for(&self) -> Option<Waiting> {
        let is_there = self.pause_at == Some(self.sent) && self.stage == Stage::Draw && self.is_drained();
        is_there.then_some(Waiting::Operator)
    }

    fn resume(&mut self, now_us: u64) {
        (self.pause_at, self.pauses_first) = (None, false);
        self.next_us = self.next_us.min(now_us);
        self.progressed_us = now_us;
    }

    fn progress(&self) -> Progress {
        let (row, last_sent_row) = (self.finished_row(), self.program.row(self.sent));
        let known = Progress::of(&self.program.lines, self.drawn, row, last_sent_row);
        let acknowledged = self.acked > 0;
        let (retransmitted, queries) = (self.retransmitted, self.queries);
        let ink =
            |lines: usize| lines.checked_sub(1).and_then(|line| self.ink.get(line)).copied().unwrap_or(0.0);
        let mm = |lines: usize| (ink(lines) * self.plotter.unit_mm).round() as u64;
        let ink_mm = Some([mm(self.drawn), mm(self.program.lines.len())]);
        Progress { retransmitted, queries, acknowledged, ink_mm, note: self.note, ..known }
    }

    fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }
}

impl PlotterSession {
    /// The last stroke of which everything is drawn.
    fn finished_row(&self) -> u64 {
        let row = self.program.row(self.drawn);
        let rest = self.program.lines[self.drawn..].iter().take_while(|line| line.row == row);
        let draws =
            |line: &Line| !matches!(mnemonic(&line.text).as_str(), "" | "IN" | "PU" | "SP" | "VS" | "PS");
        if rest.into_iter().any(draws) { row.saturating_sub(1) } else { row }
    }
}
