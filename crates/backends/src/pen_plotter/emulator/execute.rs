//! The emulated plotter's interpreter of HP-GL. Letters and fills are not drawn: letters move the pen along.

use crate::ink::Ink;
use crate::pen_plotter::plotter::Plotter;

/// What one step takes and answers.
#[derive(Clone, Debug, Default)]
pub(super) struct Step {
    pub(super) duration_us: u64,
    pub(super) answer: Option<String>,
}

impl Step {
    fn lasting(duration_us: u64) -> Self {
        Self { duration_us, answer: None }
    }

    pub(super) fn answering(answer: String) -> Self {
        Self { duration_us: 0, answer: Some(answer) }
    }
}

/// A change of pens, microseconds: not measured anywhere; seconds on the real machine.
const PEN_CHANGE_US: u64 = 2_000_000;
/// The pen up or down, microseconds: an assumption.
pub(super) const PEN_MOVE_US: u64 = 50_000;
/// A character of a label, microseconds: an assumption.
const LETTER_US: u64 = 150_000;
/// Pens that it holds.
const STALLS: usize = 6;
/// Plotter units in a centimetre, and 1 g in plotter units/s².
pub(super) const UNITS_A_CM: f64 = 400.0;
const G: f64 = 9.806_65 * 40_000.0;
const MAX_SPEED_CM_S: f64 = 38.1;
pub(super) const TRAVEL_CM_S: f64 = 50.8;

/// Limits, P1 and P2 of A4 and A3.
pub(super) const PAPERS: [([f64; 2], [f64; 4]); 2] = [
    ([11_040.0, 7721.0], [603.0, 521.0, 10_603.0, 7721.0]),
    ([16_158.0, 11_040.0], [170.0, 602.0, 15_370.0, 10_602.0]),
];

/// What is being parsed.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Parsing {
    Name(Option<u8>),
    Parameters([u8; 2]),
    Label,
    Terminator,
    Symbol,
}

/// State of the interpreter. Positions are in plotter units, in the frame that `RO` has chosen.
#[derive(Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of the machine")]
pub(super) struct Interpreter {
    pub(super) plotter: &'static Plotter,
    parsing: Parsing,
    pub(super) number: String,
    pub(super) parameters: Vec<f64>,
    /// The instruction has executed pairs.
    pub(super) has_pairs: bool,
    pub(super) at: [f64; 2],
    pub(super) down: bool,
    /// The pen has lifted by itself, until the next vector.
    pub(super) rests: bool,
    /// The pen in the holder, 0 for none, and whether each stall holds its pen.
    pub(super) pen: u16,
    pub(super) stalls: [bool; STALLS],
    pub(super) relative: bool,
    pub(super) scale: Option<[f64; 4]>,
    pub(super) large: bool,
    pub(super) turned: bool,
    pub(super) points: [f64; 4],
    pub(super) window: Option<[f64; 4]>,
    pub(super) speed: f64,
    pub(super) acceleration: f64,
    pub(super) terminator: u8,
    pub(super) error: u8,
    pub(super) initialized: bool,
    pub(super) points_changed: bool,
    pub(super) lever: bool,
}

impl Interpreter {
    pub(super) fn new(plotter: &'static Plotter) -> Self {
        Self {
            plotter,
            parsing: Parsing::Name(None),
            number: String::new(),
            parameters: Vec::new(),
            has_pairs: false,
            at: [0.0; 2],
            down: false,
            rests: false,
            pen: 0,
            stalls: [true; STALLS],
            relative: false,
            scale: None,
            large: false,
            turned: false,
            points: PAPERS[0].1,
            window: None,
            speed: MAX_SPEED_CM_S * UNITS_A_CM,
            acceleration: 2.0 * G,
            terminator: 3,
            error: 0,
            initialized: true,
            points_changed: false,
            lever: false,
        }
    }

    /// `ESC.K`: half an instruction is dropped.
    pub(super) fn forget(&mut self) {
        self.parsing = Parsing::Name(None);
        self.number.clear();
        self.parameters.clear();
        self.has_pairs = false;
    }

    /// Whether no instruction is half parsed.
    pub(super) fn is_between(&self) -> bool {
        self.parsing == Parsing::Name(None)
    }

    pub(super) fn lever_is_up(&self) -> bool {
        self.lever
    }

    /// The lever: up, the pen is stored.
    #[cfg(test)]
    pub(super) fn set_lever(&mut self, up: bool, ink: &mut Ink) {
        self.lever = up;
        if up {
            self.store(ink);
        } else if self.error == 8 {
            self.error = 0;
        }
    }

    #[cfg(test)]
    pub(super) fn remove_pen(&mut self, stall: usize) {
        self.stalls[stall - 1] = false;
    }

    pub(super) fn at(&self) -> [f64; 2] {
        self.at
    }

    pub(super) fn move_to(&mut self, at: [f64; 2]) {
        self.at = at;
    }

    pub(super) fn pen_is_down(&self) -> bool {
        self.down && self.pen != 0 && !self.lever && !self.rests
    }

    /// The pen lifts by itself.
    pub(super) fn rest(&mut self, ink: &mut Ink) {
        self.rests = true;
        ink.pen(0, self.physical(self.at));
    }

    pub(super) fn lift(&mut self, ink: &mut Ink) {
        self.down = false;
        ink.pen(0, self.physical(self.at));
    }

    /// Takes bytes out of the buffer until something was executed; `None` if it holds too few.
    pub(super) fn step(&mut self, buffer: &mut Vec<u8>, ink: &mut Ink) -> Option<Step> {
        let mut taken = 0;
        let mut step = None;
        while step.is_none() && taken < buffer.len() {
            let byte = buffer[taken];
            let (is_taken, executed) = self.take(byte, ink);
            taken += usize::from(is_taken);
            step = executed;
        }
        buffer.drain(..taken);
        step
    }

    /// Whether the byte was used up, and what was executed.
    fn take(&mut self, byte: u8, ink: &mut Ink) -> (bool, Option<Step>) {
        match self.parsing.clone() {
            Parsing::Name(first) => (true, self.name(first, byte)),
            Parsing::Label if byte == self.terminator => {
                self.forget();
                (true, Some(Step::default()))
            }
            Parsing::Label => {
                // Cells of 1.5 widths of 0.187 cm.
                self.at[0] += if byte < b' ' { 0.0 } else { 1.5 * 0.187 * UNITS_A_CM };
                (true, Some(Step::lasting(LETTER_US)))
            }
            Parsing::Terminator => {
                self.terminator = if byte == b';' { 3 } else { byte };
                self.forget();
                (true, Some(Step::default()))
            }
            Parsing::Symbol => {
                self.forget();
                (true, Some(Step::default()))
            }
            Parsing::Parameters(name) => self.parameter(name, byte, ink),
        }
    }

    fn name(&mut self, first: Option<u8>, byte: u8) -> Option<Step> {
        if !byte.is_ascii_alphabetic() {
            self.parsing = Parsing::Name(None);
            return None;
        }
        let byte = byte.to_ascii_uppercase();
        let Some(first) = first else {
            self.parsing = Parsing::Name(Some(byte));
            return None;
        };
        self.parsing = match [first, byte] {
            [b'L', b'B'] => Parsing::Label,
            [b'D', b'T'] => Parsing::Terminator,
            [b'S', b'M'] => Parsing::Symbol,
            name => Parsing::Parameters(name),
        };
        None
    }

    fn parameter(&mut self, name: [u8; 2], byte: u8, ink: &mut Ink) -> (bool, Option<Step>) {
        match byte {
            b'0'..=b'9' | b'.' => {
                self.number.push(char::from(byte));
                (true, None)
            }
            // A sign also separates.
            b'+' | b'-' if self.number.is_empty() => {
                self.number.push(char::from(byte));
                (true, None)
            }
            b'+' | b'-' => (false, self.end_of_number(name, ink)),
            b',' | b' ' => (true, self.end_of_number(name, ink)),
            b';' | b'\n' | b'A'..=b'Z' | b'a'..=b'z' => {
                if !self.number.is_empty() {
                    let pair = self.end_of_number(name, ink);
                    if pair.is_some() && byte.is_ascii_alphabetic() {
                        return (false, pair);
                    }
                    if let Some(pair) = pair {
                        let end = self.end_of_instruction(name, ink);
                        return (true, Some(Step::lasting(pair.duration_us + end.duration_us)));
                    }
                }
                let step = self.end_of_instruction(name, ink);
                (byte == b';' || byte == b'\n', Some(step))
            }
            _ => (true, None),
        }
    }

    /// Pairs of coordinates are executed as they come.
    fn end_of_number(&mut self, name: [u8; 2], ink: &mut Ink) -> Option<Step> {
        if let Ok(number) = self.number.parse() {
            self.parameters.push(number);
        }
        self.number.clear();
        if !matches!(&name, b"PU" | b"PD" | b"PA" | b"PR") {
            return None;
        }
        let &[x, y] = self.parameters.as_slice() else { return None };
        self.parameters.clear();
        let pen_us = if self.has_pairs { 0 } else { self.pen_state(name, ink) };
        self.has_pairs = true;
        let to = self.target([x, y]);
        Some(Step::lasting(pen_us + self.go(to, ink)))
    }

    fn end_of_instruction(&mut self, name: [u8; 2], ink: &mut Ink) -> Step {
        let parameters = std::mem::take(&mut self.parameters);
        let had_pairs = std::mem::take(&mut self.has_pairs);
        self.parsing = Parsing::Name(None);
        let text = String::from_utf8_lossy(&name).into_owned();
        if !self.plotter.knows(&text) {
            self.fail(1);
            return Step::default();
        }
        if matches!(&name, b"PU" | b"PD" | b"PA" | b"PR") {
            let us = if had_pairs { 0 } else { self.pen_state(name, ink) };
            if !parameters.is_empty() {
                self.fail(2);
            }
            return Step::lasting(us);
        }
        if name[0] == b'O' {
            return self.output(name[1]);
        }
        self.instruction(name, &parameters, ink)
    }

    pub(super) fn fail(&mut self, number: u8) {
        if self.error == 0 {
            self.error = number;
        }
    }

    fn instruction(&mut self, name: [u8; 2], parameters: &[f64], ink: &mut Ink) -> Step {
        match (&name, parameters) {
            (b"IN", _) => {
                self.lift(ink);
                self.turn(false);
                (self.error, self.initialized) = (0, true);
                self.defaults();
                self.points = self.paper().1;
            }
            (b"DF", _) => self.defaults(),
            (b"SP", _) => return Step::lasting(self.select(parameters.first().copied().unwrap_or(0.0), ink)),
            (b"VS", []) => (self.speed, self.acceleration) = (MAX_SPEED_CM_S * UNITS_A_CM, 2.0 * G),
            (b"VS", [speed]) if (0.0..128.0).contains(speed) => {
                let steps = (speed.min(MAX_SPEED_CM_S) / 0.38).round().max(1.0);
                (self.speed, self.acceleration) = (0.38 * steps * UNITS_A_CM, 0.5 * G);
            }
            (b"PS", [code]) if (0.0..128.0).contains(code) => {
                self.large = *code < 4.0;
                self.points = self.paper().1;
                self.window = None;
            }
            (b"RO", [] | [0.0]) => self.turn(false),
            (b"RO", [90.0]) => self.turn(true),
            (b"IP", []) => self.points = self.default_points(),
            (b"IP", [x, y]) => {
                let [p1x, p1y, p2x, p2y] = self.points;
                self.points = [*x, *y, x + p2x - p1x, y + p2y - p1y];
            }
            (b"IP", [x1, y1, x2, y2]) => self.points = [*x1, *y1, *x2, *y2],
            (b"SC", []) => self.scale = None,
            (b"SC", [x1, x2, y1, y2]) if x1 != x2 && y1 != y2 => self.scale = Some([*x1, *x2, *y1, *y2]),
            (b"IW", []) => self.window = None,
            (b"IW", [x1, y1, x2, y2]) => {
                let relative = std::mem::take(&mut self.relative);
                let (a, b) = (self.target([*x1, *y1]), self.target([*x2, *y2]));
                self.relative = relative;
                self.window = Some([a[0], a[1], b[0], b[1]]);
            }
            (b"AA" | b"AR", [x, y, sweep, rest @ ..]) => {
                let relative = std::mem::replace(&mut self.relative, name == *b"AR");
                let center = self.target([*x, *y]);
                self.relative = relative;
                let chord = rest.first().copied().unwrap_or(5.0).abs();
                let us = self.arc(center, *sweep, chord, ink);
                return Step::lasting(us);
            }
            (b"CI", [radius, rest @ ..]) => return Step::lasting(self.circle(*radius, rest, ink)),
            (b"EA" | b"ER", [x, y]) => return Step::lasting(self.rectangle(name == *b"ER", [*x, *y], ink)),
            (b"VS" | b"PS" | b"RO", _) => self.fail(3),
            (b"IP" | b"SC" | b"IW" | b"AA" | b"AR" | b"CI" | b"EA" | b"ER", _) => self.fail(2),
            _ => {}
        }
        if name == *b"IP" {
            self.points_changed = true;
        }
        Step::default()
    }

    fn defaults(&mut self) {
        (self.relative, self.scale, self.window, self.terminator) = (false, None, None, 3);
        (self.speed, self.acceleration) = (MAX_SPEED_CM_S * UNITS_A_CM, 2.0 * G);
    }

    /// `SP`: a number that no stall has is ignored; of an empty stall another pen is taken, without an error.
    fn select(&mut self, number: f64, ink: &mut Ink) -> u64 {
        if number == f64::from(self.pen) || !(0.0..=STALLS as f64).contains(&number) {
            return 0;
        }
        self.lift(ink);
        self.store(ink);
        if number >= 1.0 && !self.lever {
            let wanted = number as usize - 1;
            let taken = Some(wanted).filter(|stall| self.stalls[*stall]);
            if let Some(stall) = taken.or_else(|| self.stalls.iter().position(|full| *full)) {
                self.stalls[stall] = false;
                self.pen = stall as u16 + 1;
            }
        }
        PEN_CHANGE_US
    }

    fn store(&mut self, ink: &mut Ink) {
        self.lift(ink);
        if self.pen != 0 {
            self.stalls[usize::from(self.pen) - 1] = true;
            self.pen = 0;
        }
    }
}
