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

    fn answering(answer: String) -> Self {
        Self { duration_us: 0, answer: Some(answer) }
    }
}

/// A change of pens, microseconds: not measured anywhere; seconds on the real machine.
const PEN_CHANGE_US: u64 = 2_000_000;
/// The pen up or down, microseconds: an assumption.
const PEN_MOVE_US: u64 = 50_000;
/// A character of a label, microseconds: an assumption.
const LETTER_US: u64 = 150_000;
/// Pens that it holds.
const STALLS: usize = 6;
/// Plotter units in a centimetre, and 1 g in plotter units/s².
const UNITS_A_CM: f64 = 400.0;
const G: f64 = 9.806_65 * 40_000.0;
const MAX_SPEED_CM_S: f64 = 38.1;
const TRAVEL_CM_S: f64 = 50.8;

/// Limits, P1 and P2 of A4 and A3.
const PAPERS: [([f64; 2], [f64; 4]); 2] = [
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
    plotter: &'static Plotter,
    parsing: Parsing,
    number: String,
    parameters: Vec<f64>,
    /// The instruction has executed pairs.
    has_pairs: bool,
    at: [f64; 2],
    down: bool,
    /// The pen has lifted by itself, until the next vector.
    rests: bool,
    /// The pen in the holder, 0 for none, and whether each stall holds its pen.
    pen: u16,
    stalls: [bool; STALLS],
    relative: bool,
    scale: Option<[f64; 4]>,
    large: bool,
    turned: bool,
    points: [f64; 4],
    window: Option<[f64; 4]>,
    speed: f64,
    acceleration: f64,
    terminator: u8,
    error: u8,
    initialized: bool,
    points_changed: bool,
    lever: bool,
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

    /// The pen and the mode of an instruction of moves.
    fn pen_state(&mut self, name: [u8; 2], ink: &mut Ink) -> u64 {
        let before = self.down && !self.rests;
        self.rests = false;
        match &name {
            b"PU" => self.down = false,
            b"PD" => self.down = true,
            b"PA" => self.relative = false,
            _ => self.relative = true,
        }
        if self.down == before {
            return 0;
        }
        if self.down {
            self.touch(ink);
        } else {
            ink.pen(0, self.physical(self.at));
        }
        PEN_MOVE_US
    }

    /// The pen touches the paper where it is.
    fn touch(&mut self, ink: &mut Ink) {
        let at = self.physical(self.at);
        if self.pen_is_down() && self.clip(at, at).is_some() {
            ink.pen(self.pen, at);
        }
    }

    fn fail(&mut self, number: u8) {
        if self.error == 0 {
            self.error = number;
        }
    }

    /// A coordinate pair in plotter units.
    fn target(&mut self, pair: [f64; 2]) -> [f64; 2] {
        if pair.iter().any(|value| value.abs() > 32_767.999_9) {
            self.fail(6);
        }
        let pair = if self.scale.is_none() { pair.map(f64::floor) } else { pair };
        let [sx, sy] = self.scale_factors();
        if self.relative {
            return [self.at[0] + pair[0] * sx, self.at[1] + pair[1] * sy];
        }
        match self.scale {
            None => pair,
            Some([x1, _, y1, _]) => {
                [self.points[0] + (pair[0] - x1) * sx, self.points[1] + (pair[1] - y1) * sy].map(f64::round)
            }
        }
    }

    fn scale_factors(&self) -> [f64; 2] {
        let [p1x, p1y, p2x, p2y] = self.points;
        self.scale.map_or([1.0; 2], |[x1, x2, y1, y2]| [(p2x - p1x) / (x2 - x1), (p2y - p1y) / (y2 - y1)])
    }

    /// From the frame of `RO` to that of the ink.
    fn physical(&self, at: [f64; 2]) -> [f64; 2] {
        let ([width, _], _) = self.paper();
        if self.turned { [width - at[1], at[0]] } else { at }
    }

    fn paper(&self) -> ([f64; 2], [f64; 4]) {
        PAPERS[usize::from(self.large)]
    }

    /// The part of a segment within limits and window, in the frame of the ink.
    fn clip(&self, from: [f64; 2], to: [f64; 2]) -> Option<([f64; 2], [f64; 2])> {
        let ([width, height], _) = self.paper();
        let mut area = [0.0, 0.0, width, height];
        if let Some([x1, y1, x2, y2]) = self.window {
            let (a, b) = (self.physical([x1, y1]), self.physical([x2, y2]));
            area = [
                area[0].max(a[0].min(b[0])),
                area[1].max(a[1].min(b[1])),
                area[2].min(a[0].max(b[0])),
                area[3].min(a[1].max(b[1])),
            ];
        }
        // Liang and Barsky: the range of the parameter within all four edges.
        let (mut t0, mut t1) = (0.0_f64, 1.0_f64);
        for axis in 0..2 {
            let step = to[axis] - from[axis];
            for (room, step) in [(from[axis] - area[axis], -step), (area[axis + 2] - from[axis], step)] {
                if step == 0.0 && room < 0.0 {
                    return None;
                } else if step < 0.0 {
                    t0 = t0.max(room / step);
                } else if step > 0.0 {
                    t1 = t1.min(room / step);
                }
            }
        }
        let at = |t: f64| [0, 1].map(|axis: usize| from[axis] + t * (to[axis] - from[axis]));
        (t0 <= t1).then(|| (if t0 == 0.0 { from } else { at(t0) }, if t1 == 1.0 { to } else { at(t1) }))
    }

    /// Moves in a straight line; how long that takes.
    fn go(&mut self, to: [f64; 2], ink: &mut Ink) -> u64 {
        if self.lever {
            self.fail(8);
            return 0;
        }
        self.rests = false;
        let (a, b) = (self.physical(self.at), self.physical(to));
        if self.pen_is_down() {
            match self.clip(a, b) {
                None => ink.pen(0, a),
                Some((from, until)) => {
                    if from != a {
                        ink.pen(0, a);
                    }
                    ink.pen(self.pen, from);
                    ink.go(until);
                    if until != b {
                        ink.pen(0, until);
                    }
                }
            }
        }
        let way = (to[0] - self.at[0]).abs().max((to[1] - self.at[1]).abs());
        self.at = to;
        let speed = if self.down { self.speed } else { TRAVEL_CM_S * UNITS_A_CM };
        duration_us(way, speed, self.acceleration)
    }

    /// An arc about `center` through the pen's position, in chords.
    fn arc(&mut self, center: [f64; 2], sweep: f64, chord: f64, ink: &mut Ink) -> u64 {
        let from = self.at;
        let count = (sweep.abs() / chord.clamp(0.36, 180.0)).ceil().max(1.0) as u32;
        let mut us = 0;
        for k in 1..=count {
            let (sin, cos) = libm::sincos((sweep * f64::from(k) / f64::from(count)).to_radians());
            let arm = [from[0] - center[0], from[1] - center[1]];
            us += self
                .go([center[0] + cos * arm[0] - sin * arm[1], center[1] + sin * arm[0] + cos * arm[1]], ink);
        }
        us
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

    fn default_points(&self) -> [f64; 4] {
        match (self.turned, self.large) {
            (false, _) => self.paper().1,
            (true, false) => [0.0, 610.0, 7200.0, 10_610.0],
            (true, true) => [607.0, 797.0, 10_607.0, 15_997.0],
        }
    }

    /// `RO`: the pen stays where it is.
    fn turn(&mut self, turned: bool) {
        let [x, y] = self.physical(self.at);
        let ([width, _], _) = self.paper();
        self.turned = turned;
        self.at = if turned { [y, width - x] } else { [x, y] };
    }

    fn circle(&mut self, radius: f64, rest: &[f64], ink: &mut Ink) -> u64 {
        let (center, was_down) = (self.at, self.down);
        let [scale, _] = self.scale_factors();
        let chord = rest.first().copied().unwrap_or(5.0).abs();
        self.down = false;
        ink.pen(0, self.physical(center));
        let mut us = self.go([center[0] + radius * scale, center[1]], ink);
        self.down = true;
        self.touch(ink);
        us += self.arc(center, 360.0, chord, ink);
        self.lift(ink);
        us += self.go(center, ink);
        self.down = was_down;
        self.touch(ink);
        us + 2 * PEN_MOVE_US
    }

    fn rectangle(&mut self, relative: bool, corner: [f64; 2], ink: &mut Ink) -> u64 {
        let (from, was_down) = (self.at, self.down);
        let mode = std::mem::replace(&mut self.relative, relative);
        let to = self.target(corner);
        self.relative = mode;
        self.down = true;
        self.touch(ink);
        let corners = [[to[0], from[1]], to, [from[0], to[1]], from];
        let us = corners.into_iter().map(|corner| self.go(corner, ink)).sum::<u64>();
        if !was_down {
            self.lift(ink);
        }
        us + 2 * PEN_MOVE_US
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

    /// The position in user units.
    fn user(&self) -> [f64; 2] {
        let [sx, sy] = self.scale_factors();
        let [x1, _, y1, _] = self.scale.unwrap_or_default();
        [x1 + (self.at[0] - self.points[0]) / sx, y1 + (self.at[1] - self.points[1]) / sy]
    }

    /// The answer of `O` and this letter.
    fn output(&mut self, letter: u8) -> Step {
        let rounded = |values: &[f64]| {
            let texts: Vec<String> = values.iter().map(|value| format!("{:.0}", value + 0.0)).collect();
            texts.join(",")
        };
        let [x, y] = self.at;
        let down = f64::from(u8::from(self.down));
        Step::answering(match letter {
            b'C' if self.scale.is_some() => {
                let [x, y] = self.user();
                format!("{x:.4},{y:.4},{down}")
            }
            b'E' => std::mem::take(&mut self.error).to_string(),
            b'F' => "40,40".to_owned(),
            b'H' => {
                let ([width, height], _) = self.paper();
                if self.turned {
                    rounded(&[0.0, 0.0, height, width])
                } else {
                    rounded(&[0.0, 0.0, width, height])
                }
            }
            b'I' => "7475A".to_owned(),
            b'O' => "0,1,0,0,1,0,0,0".to_owned(),
            b'P' => {
                self.points_changed = false;
                rounded(&self.points)
            }
            b'S' => {
                let bits = [
                    (1, self.down),
                    (2, self.points_changed),
                    (8, std::mem::take(&mut self.initialized)),
                    (16, !self.lever),
                    (32, self.error != 0),
                ];
                bits.iter().map(|(bit, set)| if *set { *bit } else { 0 }).sum::<u32>().to_string()
            }
            b'W' => {
                let ([width, height], _) = self.paper();
                rounded(&self.window.unwrap_or([0.0, 0.0, width, height]))
            }
            _ => rounded(&[x, y, down]),
        })
    }
}

/// From rest to rest: `d / v + v / a`, or `2 sqrt(d / a)`.
fn duration_us(way: f64, speed: f64, acceleration: f64) -> u64 {
    let seconds = if way * acceleration >= speed * speed {
        way / speed + speed / acceleration
    } else {
        2.0 * (way / acceleration).sqrt()
    };
    (seconds * 1e6) as u64
}
