//! What the answers of the plotter mean.

use super::super::check;
use super::super::plotter::Plotter;
use super::super::query::{Asked, Query, instruction_error, line_error};
use super::super::state::{mnemonic, numbers};
use super::{INITIALIZED, LEVER, OPENING, POLL_US, PlotterSession, RECOVERY, Stage, VIEW};
use crate::session::{Outcome, Progress, Session as _};

impl PlotterSession {
    /// An answer to `query`.
    pub(super) fn answered(&mut self, asked: Asked, values: &[i64], text: &str, now_us: u64) {
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
    pub(super) fn initializes_itself(&self) -> bool {
        self.program.lines[..self.sent].iter().skip(1).any(|line| mnemonic(&line.text) == "IN")
    }

    pub(super) fn room(&mut self, asked: Asked, free: i64, now_us: u64) {
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
    pub(super) fn drained(&mut self, now_us: u64) {
        let known = self.known_lines();
        if self.sent == self.program.lines.len() || self.sent == known && known > self.limits.confirmed {
            self.stage = Stage::Confirm;
            self.next_us = now_us;
        }
    }

    pub(super) fn held_by_operator(&mut self, status: i64, now_us: u64) {
        self.note = None;
        if status & LEVER != 0 {
            (self.note, self.progressed_us) = (Some("the lever or the wheels are up"), now_us);
        } else if status & VIEW != 0 {
            (self.note, self.progressed_us) = (Some("VIEW is pressed"), now_us);
        }
        self.next_us = now_us + POLL_US;
    }

    pub(super) fn opened(&mut self, query: Query, values: &[i64], text: &str) {
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
    pub(super) fn identified(&mut self, model: &str) {
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
    pub(super) fn next_question(&mut self, now_us: u64) {
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
    pub(super) fn begin(&mut self, now_us: u64) {
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
    pub(super) fn confirmed(&mut self, values: &[i64], now_us: u64) {
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
    pub(super) fn error(&mut self, query: Query, number: i64) {
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
    pub(super) fn recovered(&mut self, values: &[i64], now_us: u64) {
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
}
