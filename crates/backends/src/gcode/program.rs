//! Programs of G-code: what each line does, so that one can be stopped and resumed.

use std::sync::Arc;

use super::{millimetres, status::POSITION_TOLERANCE_UM};
use crate::program::{Line, LineLanguage, Program};

/// What a program of our own needs to be resumed: the lines that lift the pen.
#[derive(Clone, Debug)]
struct Gcode {
    lift: Vec<String>,
}

/// The line at which the machine waits for the operator.
pub(super) const PAUSE: &str = "M0";

/// A program of lines as [`super::encode`] makes them.
pub(super) fn program(lines: impl IntoIterator<Item = Line>) -> Program {
    let (program, lift) = with_positions(lines);
    Program::of_lines(program, Arc::new(Gcode { lift }))
}

/// The same for lines that go on from where the machine stands; `lift` are the lines that lift the pen.
pub(super) fn continuing(lines: Vec<Line>, lift: &[Line]) -> Program {
    pen_only(with_positions(lines).0, lift)
}

/// Lines with the positions that they lead to, comments apart, and those of them that lift the pen at the start.
fn with_positions(lines: impl IntoIterator<Item = Line>) -> (Vec<Line>, Vec<String>) {
    let mut state = ModalState::default();
    let mut lift: Vec<String> = Vec::new();
    let mut program: Vec<Line> = Vec::new();
    for mut line in lines {
        if let Some((code, comment)) = line.text.split_once(';') {
            let (code, comment) = (code.trim_end().to_owned(), comment.trim().to_owned());
            line = Line { text: code, comment, ..line };
        }
        let moved = state.accept(&line.text);
        // A program begins by lifting the pen: the lines before its first travel, mode words apart.
        let mode = ["G2", "G9", "G1", PAUSE].iter().any(|word| line.text.starts_with(word));
        if program.iter().all(|line| line.position.is_none()) && !moved && !mode {
            lift.push(line.text.clone());
        }
        program.push(Line { position: moved.then_some(state.position_um), ..line });
    }
    (program, lift)
}

/// A program that only moves the pen.
pub(super) fn pen_only(lines: Vec<Line>, lift: &[Line]) -> Program {
    let lift = lift.iter().map(|line| line.text.clone()).collect();
    Program::of_lines(lines, Arc::new(Gcode { lift }))
}

/// A program read from a file; comments and empty lines are left out. A line's row is its number in what is left.
pub(super) fn parse(text: &str) -> Program {
    let is_code = |line: &&str| !line.split(';').next().unwrap_or_default().trim().is_empty();
    let mut state = ModalState::default();
    program((1..).zip(text.lines().map(str::trim).filter(is_code)).map(|(row, text)| Line {
        duration_us: state.duration_us(text.split(';').next().unwrap_or_default()),
        text: text.to_owned(),
        row,
        ..Line::default()
    }))
}

impl LineLanguage for Gcode {
    fn lift(&self) -> Vec<String> {
        self.lift.clone()
    }

    fn resume(&self, done: &[Line]) -> Vec<Line> {
        let mut state = ModalState::default();
        for line in done {
            state.accept(&line.text);
        }
        let line = |text: String| Line { text, ..Line::default() };
        let mut lines: Vec<Line> = self.lift.iter().cloned().map(line).collect();
        lines.extend(["G21", "G90", "G17", "G94"].map(|mode| line(mode.to_owned())));
        let position = done.iter().rev().find_map(|line| line.position);
        if let Some([x, y]) = position {
            let text = format!("G0 X{} Y{}", millimetres(x), millimetres(y));
            lines.push(Line { text, position, ..Line::default() });
        }
        lines.extend(lowering(done, &self.lift).into_iter().map(line));
        lines.extend(state.feed.map(line));
        lines
    }

    fn position_tolerance(&self) -> u64 {
        POSITION_TOLERANCE_UM
    }
}

/// What G-code of our own leaves behind: position and feed.
#[derive(Clone, Debug, Default)]
struct ModalState {
    position_um: [i64; 2],
    feed: Option<String>,
}

impl ModalState {
    /// Applies a line; whether it moves in x or y.
    fn accept(&mut self, text: &str) -> bool {
        let mut moved = false;
        if !text.starts_with('G') {
            return false;
        }
        for word in text.split_ascii_whitespace() {
            let Some((letter, number)) = word.split_at_checked(1) else { continue };
            let axis = match letter {
                "X" => 0,
                "Y" => 1,
                "F" if !text.contains("G93") && !text.contains('Z') => {
                    self.feed = Some(word.to_owned());
                    continue;
                }
                _ => continue,
            };
            if let Ok(mm) = number.parse::<f64>()
                && mm.abs() < 1e9
            {
                self.position_um[axis] = (mm * 1000.0).round() as i64;
                moved = true;
            }
        }
        moved
    }

    /// Applies a line; how long it takes, microseconds: chords at their feed, dwells; accelerations left out.
    fn duration_us(&mut self, text: &str) -> u64 {
        let from = self.position_um;
        let value = |letter: &str| {
            text.split_ascii_whitespace().find_map(|word| word.strip_prefix(letter)?.parse::<f64>().ok())
        };
        let seconds = if text.starts_with("G4") {
            value("P").unwrap_or(0.0)
        } else if !self.accept(text) {
            0.0
        } else if text.contains("G93") {
            60.0 / value("F").unwrap_or(60.0)
        } else {
            let way = [0, 1].map(|axis| (self.position_um[axis] - from[axis]) as f64 * 1e-3);
            let feed = if text.starts_with("G0") { None } else { self.feed.as_deref() };
            let feed = feed.and_then(|feed| feed.strip_prefix('F')?.parse().ok()).unwrap_or(3000.0);
            // A quarter of a circle is 1.11 times its chord.
            1.2 * libm::hypot(way[0], way[1]) * 60.0 / feed
        };
        (seconds * 1e6).clamp(0.0, 1e10) as u64
    }
}

/// The lines that lower the pen again if it is down after `done`: those that last moved it, unless they are in `lift`.
fn lowering(done: &[Line], lift: &[String]) -> Vec<String> {
    let mut lowering: Vec<String> = Vec::new();
    for Line { text, .. } in done {
        let sets =
            ["M3", "M280", "SET_SERVO"].iter().any(|word| text.starts_with(word)) || text.contains('Z');
        if sets {
            lowering.clear();
            if !lift.contains(text) {
                lowering.extend(lift.iter().filter(|line| *line == "M400").cloned());
                lowering.push(text.clone());
            }
        } else if text.starts_with("G4") && !lowering.is_empty() {
            lowering.push(text.clone());
        }
    }
    lowering
}
