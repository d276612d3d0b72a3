//! Sends HP-GL to a pen plotter that is asked how much room its buffer has.
//!
//! `ESC.B` is answered as soon as it is received. So its answer proves that everything before it has
//! arrived, and says how many bytes the plotter has not drawn yet. Instructions are sent in blocks, each
//! with an `ESC.B` behind it; the next block waits for the answer. An answer that comes late counts fewer
//! free bytes than there are by then, plus what was sent after it was asked: that much is subtracted.
//!
//! No two states of the pen (position, up or down) within a block are the same. After the port was lost the
//! plotter draws what it has; its position then names the instruction of the last block that it reached.

mod answers;
mod blocks;

use std::collections::VecDeque;

use super::check;
use super::plotter::{Handshake, Plotter};
use super::query::{Asked, Query};
use super::state::PenState;
use crate::program::Program;
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
