//! Files of HP-GL as programs, and what restores the plotter's state in the middle of one.

use super::state::{Follower, PEN_CHANGE_US, PEN_MOVE_US, TRAVEL_SPEED, mnemonic, move_us, numbers};
use crate::Setpoint;
use crate::program::{Line, LineLanguage};

/// Pairs of coordinates in one instruction: plotters with a buffer of 60 bytes take them.
const PAIRS: usize = 4;
/// The longest instruction made of a plan, bytes.
const PLAN_LINE_BYTES: usize = 48;

/// HP-GL, as far as sending it needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HpGl;

/// Settings that last until they are given again, or until `IN` or `DF`.
const SETTINGS: [&str; 25] = [
    "PS", "RO", "IP", "IW", "SC", "SP", "VS", "FS", "AS", "DT", "CS", "CA", "SS", "SA", "DI", "DR", "SI",
    "SR", "SL", "LT", "FT", "PT", "TL", "PW", "CT",
];
/// Those that `DF` leaves as they are.
const KEPT_BY_DF: [&str; 6] = ["PS", "RO", "IP", "SP", "VS", "FS"];

impl LineLanguage for HpGl {
    fn lift(&self) -> Vec<String> {
        vec!["PU;".to_owned()]
    }

    /// `IN`, the settings in the order in which they were last given, and the position, pen up.
    fn resume(&self, done: &[Line]) -> Vec<Line> {
        let mut settings: Vec<(String, &str)> = Vec::new();
        let mut prologue: Option<&str> = None;
        // The last absolute position, and relative steps from there.
        let (mut position, mut relative) = (None, false);
        for line in done {
            let name = mnemonic(&line.text);
            match name.as_str() {
                "IN" => {
                    settings.retain(|(name, _)| name == "SP" || name == "PS");
                    relative = false;
                }
                "DF" => {
                    settings.retain(|(name, _)| KEPT_BY_DF.contains(&name.as_str()));
                    relative = false;
                }
                "PU" | "PD" | "PA" | "PR" => {
                    relative = if name == "PA" { false } else { relative || name == "PR" };
                    for pair in numbers(&line.text).chunks_exact(2) {
                        let from = if relative { position } else { Some((0.0, 0.0)) };
                        position = from.map(|(x, y): (f64, f64)| (x + pair[0], y + pair[1]));
                    }
                }
                "" if line.text.starts_with('\u{1b}') => prologue = Some(&line.text),
                setting if SETTINGS.contains(&setting) => {
                    if matches!(setting, "SC" | "RO" | "IP") {
                        position = None;
                    }
                    settings.retain(|(known, _)| *known != name);
                    settings.push((name.clone(), &line.text));
                }
                "AA" | "AR" | "LB" | "PE" | "BR" | "BZ" | "RT" | "AT" | "BL" | "PB" | "UC" | "CP" => {
                    position = None;
                }
                _ => {}
            }
        }
        let mut lines: Vec<String> = prologue.into_iter().map(str::to_owned).collect();
        lines.push("IN;".to_owned());
        lines.extend(settings.into_iter().map(|(_, text)| text.to_owned()));
        if let Some((x, y)) = position {
            lines.push(format!("PU{x},{y};"));
        }
        if relative {
            lines.push("PR;".to_owned());
        }
        lines.into_iter().map(|text| Line { text, ..Line::default() }).collect()
    }
}

/// The instructions of a file, in pieces of a few coordinates; [`Line::row`] counts strokes: from one
/// pen-down to the next pen-up. What is around the instructions (handshake settings, printer commands)
/// is left out.
pub(crate) fn parse(bytes: &[u8]) -> Vec<Line> {
    let syntax = hpgl::parse(bytes, &hpgl::Options::default());
    let mut lines = Vec::new();
    let mut strokes = Strokes::default();
    let mut name = String::new();
    let mut number = 0;
    for command in syntax.commands() {
        if command.mnemonic == hpgl::Mnemonic::ENTER {
            lines.push(Line { text: "\u{1b}%-1B".to_owned(), row: strokes.row, ..Line::default() });
            continue;
        }
        if command.mnemonic == hpgl::Mnemonic::RESET || command.mnemonic == hpgl::Mnemonic::PICTURE_FRAME {
            continue;
        }
        // A long list of coordinates arrives in pieces.
        let is_piece = number == command.number;
        number = command.number;
        if !is_piece {
            name = command.mnemonic.to_string();
        }
        let raw = &syntax.bytes()[command.span.start..command.span.end];
        if let "PU" | "PD" | "PA" | "PR" = name.as_str() {
            let pairs = command.parameters.chunks_exact(2);
            let first = pairs.len() == 0 && !is_piece;
            let mut texts: Vec<String> = if first { vec![format!("{name};")] } else { Vec::new() };
            for piece in command.parameters[..2 * pairs.len()].chunks(2 * PAIRS) {
                let list: Vec<String> = piece.iter().map(f64::to_string).collect();
                texts.push(format!("{name}{};", list.join(",")));
            }
            for text in texts {
                let row = strokes.row_of(&text);
                lines.push(Line { text, row, ..Line::default() });
            }
            continue;
        }
        // Latin-1: one character a byte.
        let mut text: String = raw.iter().map(|byte| char::from(*byte)).collect();
        let text_end = text.trim_end().len();
        if !matches!(name.as_str(), "LB" | "BL" | "PB" | "SM" | "DT" | "PE" | "CO" | "WD") {
            text.truncate(text_end);
            if !text.ends_with(';') {
                text.push(';');
            }
        }
        let row = strokes.row_of(&text);
        lines.push(Line { text, row, ..Line::default() });
    }
    with_durations(lines)
}

/// Counts strokes.
#[derive(Debug, Default)]
struct Strokes {
    row: u64,
    down: bool,
    /// Within a stroke.
    drawing: bool,
    /// A move with the pen up has begun the next stroke already.
    moved: bool,
}

impl Strokes {
    fn begin(&mut self) {
        self.row += u64::from(!self.moved);
        self.moved = false;
    }

    fn draw(&mut self) {
        if !self.drawing {
            self.begin();
        }
        self.drawing = true;
    }

    /// The stroke that an instruction belongs to. A move with the pen up belongs to the stroke after it.
    fn row_of(&mut self, text: &str) -> u64 {
        let has_pairs = numbers(text).len() >= 2;
        match mnemonic(text).as_str() {
            "PU" | "IN" | "SP" => {
                (self.down, self.drawing) = (false, false);
                if mnemonic(text) == "PU" && has_pairs {
                    self.begin();
                    self.moved = true;
                }
            }
            "PD" => {
                self.down = true;
                self.draw();
            }
            "PA" | "PR" if !has_pairs => {}
            "PA" | "PR" | "AA" | "AR" | "RT" | "AT" | "BR" | "BZ" if self.down => self.draw(),
            "CI" | "EA" | "ER" | "RA" | "RR" | "EW" | "WG" | "EP" | "FP" | "LB" | "PB" | "UC" | "PE"
            | "XT" | "YT" => self.draw(),
            _ => {}
        }
        self.drawing &= self.down;
        self.row
    }
}

/// Rows of a plan, pen positions in mm: their strokes, one point a row, in plotter units.
pub(crate) fn of_plan(setpoints: impl Iterator<Item = Setpoint>, unit_mm: f64, speed_mm_s: f64) -> Vec<Line> {
    let mut strokes: Vec<(u16, Vec<(i64, i64)>)> = Vec::new();
    let mut before = 0;
    for setpoint in setpoints {
        let units = |mm: f64| (mm / unit_mm).round() as i64;
        let at = (units(setpoint.at.x), units(setpoint.at.y));
        if before != 0
            && let Some((_, points)) = strokes.last_mut()
            && points.last() != Some(&at)
        {
            points.push(at);
        }
        if setpoint.row.pen != 0 && setpoint.row.pen != before {
            strokes.push((setpoint.row.pen, vec![at]));
        }
        before = setpoint.row.pen;
    }
    let line = |row: usize, text: String| Line { text, row: row as u64, ..Line::default() };
    let mut lines = vec![line(0, "IN;".to_owned())];
    let speed_cm_s = (speed_mm_s / 10.0).clamp(0.5, 38.0);
    let mut pen = 0;
    for (index, (number, points)) in strokes.iter().enumerate() {
        if *number != pen {
            pen = *number;
            lines.push(line(index, format!("SP{pen};")));
            lines.push(line(index, format!("VS{speed_cm_s};")));
        }
        let (x, y) = points[0];
        lines.push(line(index + 1, format!("PU{x},{y};")));
        if points.len() == 1 {
            lines.push(line(index + 1, "PD;".to_owned()));
        }
        for text in polyline(&points[1..], PLAN_LINE_BYTES) {
            lines.push(line(index + 1, text));
        }
        lines.push(line(index + 1, "PU;".to_owned()));
    }
    lines.push(line(strokes.len(), "SP0;".to_owned()));
    with_durations(lines)
}

/// `PD` instructions of at most `most` bytes through these points.
pub(crate) fn polyline(points: &[(i64, i64)], most: usize) -> Vec<String> {
    let mut texts = Vec::new();
    let mut list = String::new();
    for (x, y) in points {
        let pair = format!("{x},{y}");
        if !list.is_empty() && list.len() + pair.len() + "PD,;".len() > most {
            texts.push(format!("PD{list};"));
            list.clear();
        }
        if !list.is_empty() {
            list.push(',');
        }
        list.push_str(&pair);
    }
    if !list.is_empty() {
        texts.push(format!("PD{list};"));
    }
    texts
}

/// The lines with their estimated durations.
pub(crate) fn with_durations(mut lines: Vec<Line>) -> Vec<Line> {
    let mut follower = Follower::new(None, 38.1);
    for line in &mut lines {
        let (before, pen) = (follower.state, follower.pen);
        let was_down = follower.down;
        let mut last = before;
        let mut us = 0;
        let states = follower.execute(&line.text);
        for state in states {
            if let (Some(from), Some(to)) = (last, state) {
                us += move_us(from.distance(&to), if to.down { follower.speed } else { TRAVEL_SPEED });
            }
            last = state;
        }
        if follower.down != was_down {
            us += PEN_MOVE_US;
        }
        if follower.pen != pen {
            us += PEN_CHANGE_US;
        }
        line.duration_us = us;
        line.position = last.map(|state| [state.at.0, state.at.1]);
    }
    lines
}
