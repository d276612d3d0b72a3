//! Which instructions are sent next, and where the pen is after each.

use super::super::query::Query;
use super::super::state::{Follower, PenState, mnemonic, numbers};
use super::{AHEAD_US, CURIOUS_US, LATE_US, POLL_US, POLLS_A_CHECK, PlotterSession, UNFINISHED};
use crate::program::Line;

impl PlotterSession {
    /// Estimated duration of what was sent and is still in the buffer.
    pub(super) fn motion_ahead_us(&self) -> u64 {
        self.program.lines[self.drawn..self.sent].iter().map(|line| line.duration_us).sum()
    }

    /// The same with the instructions that have left the buffer and may not be done.
    pub(super) fn unfinished_us(&self) -> u64 {
        let from = self.drawn.saturating_sub(UNFINISHED);
        self.program.lines[from..self.sent].iter().map(|line| line.duration_us).sum()
    }

    /// The state of the pen after the first `lines` instructions.
    pub(super) fn state_after(&self, lines: usize) -> Option<PenState> {
        let start = self.start.map(|at| PenState { at, down: false, tolerance: 0 });
        let before = lines.checked_sub(1).and_then(|line| self.states.get(line));
        before.map_or(start, |states| states.last().copied().flatten())
    }

    /// Splits instructions so that no state of the pen comes twice in one, and follows the pen.
    pub(super) fn follow(&mut self) {
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
    pub(super) fn known_lines(&self) -> usize {
        let known = |states: &Vec<Option<PenState>>| states.last().copied().flatten().is_some();
        self.states.iter().rposition(known).map_or(0, |line| line + 1)
    }

    /// The instructions of the next block: not more than the buffer, the time ahead and their states allow.
    pub(super) fn block(&self) -> std::ops::Range<usize> {
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
    pub(super) fn draw(&mut self, now_us: u64) -> Vec<u8> {
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
    pub(super) fn is_drained(&self) -> bool {
        self.acked == self.sent
            && self.in_flight.is_empty()
            && self.free.is_some_and(|free| free >= self.size)
    }

    /// The number of lines at least `from` after which a stroke has ended.
    pub(super) fn stroke_end(&self, from: usize) -> usize {
        let lines = &self.program.lines;
        (from.max(1)..lines.len()).find(|line| lines[*line].row > lines[*line - 1].row).unwrap_or(lines.len())
    }

    /// Puts `PU` at this place, unless the pen is up there.
    pub(super) fn lift_at(&mut self, place: usize) {
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

    /// The last stroke of which everything is drawn.
    pub(super) fn finished_row(&self) -> u64 {
        let row = self.program.row(self.drawn);
        let rest = self.program.lines[self.drawn..].iter().take_while(|line| line.row == row);
        let draws =
            |line: &Line| !matches!(mnemonic(&line.text).as_str(), "" | "IN" | "PU" | "SP" | "VS" | "PS");
        if rest.into_iter().any(draws) { row.saturating_sub(1) } else { row }
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
