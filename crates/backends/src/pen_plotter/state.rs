//! Where the pen is after each instruction, as far as the instructions alone determine it.

/// Position in plotter units and whether the pen is down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PenState {
    pub(crate) at: (i64, i64),
    pub(crate) down: bool,
    /// How far a reported position may be off: the plotter rounds the ends of its arcs.
    pub(crate) tolerance: i64,
}

impl PenState {
    /// Whether a report of the plotter can mean this state.
    pub(crate) fn matches(&self, at: (i64, i64), down: bool) -> bool {
        let near = |a: i64, b: i64| (a - b).abs() <= self.tolerance;
        self.down == down && near(self.at.0, at.0) && near(self.at.1, at.1)
    }

    /// Whether a report could mean this state or `other`.
    pub(crate) fn resembles(&self, other: &Self) -> bool {
        let tolerance = self.tolerance + other.tolerance;
        let near = |a: i64, b: i64| (a - b).abs() <= tolerance;
        self.down == other.down && near(self.at.0, other.at.0) && near(self.at.1, other.at.1)
    }

    pub(crate) fn distance(&self, other: &Self) -> f64 {
        libm::hypot((self.at.0 - other.at.0) as f64, (self.at.1 - other.at.1) as f64)
    }
}

/// The mnemonic of an instruction, in capitals; empty for anything else.
pub(crate) fn mnemonic(text: &str) -> String {
    let name: String = text.chars().take(2).collect();
    if name.len() == 2 && name.bytes().all(|byte| byte.is_ascii_alphabetic()) {
        name.to_ascii_uppercase()
    } else {
        String::new()
    }
}

/// The numbers of an instruction.
pub(crate) fn numbers(text: &str) -> Vec<f64> {
    let rest = text.get(2..).unwrap_or_default();
    let mut numbers = Vec::new();
    let mut number = String::new();
    for c in rest.chars().chain([';']) {
        // A sign also separates.
        if !(c.is_ascii_digit() || c == '.') {
            numbers.extend(number.parse::<f64>());
            number.clear();
        }
        if c.is_ascii_digit() || matches!(c, '.' | '-' | '+') {
            number.push(c);
        }
    }
    numbers
}

/// Follows the pen through instructions.
#[derive(Clone, Debug)]
pub(crate) struct Follower {
    /// `None` where it is not known.
    pub(crate) state: Option<PenState>,
    relative: bool,
    /// Coordinates are user units: the plotter maps them.
    scaled: bool,
    pub(crate) down: bool,
    /// The pen in the holder; 0 for none.
    pub(crate) pen: f64,
    /// Speed with the pen down, plotter units/s.
    pub(crate) speed: f64,
}

/// Plotter units in a centimetre.
const UNITS_A_CM: f64 = 400.0;

impl Follower {
    /// From a reported position, or from an unknown one.
    pub(crate) fn new(at: Option<(i64, i64)>, max_speed_cm_s: f64) -> Self {
        let state = at.map(|at| PenState { at, down: false, tolerance: 0 });
        let speed = max_speed_cm_s * UNITS_A_CM;
        Self { state, relative: false, scaled: false, down: false, pen: 0.0, speed }
    }

    /// Executes an instruction: the states of the pen after each of its parts, `None` where unknown.
    pub(crate) fn execute(&mut self, text: &str) -> Vec<Option<PenState>> {
        let parameters = numbers(text);
        match mnemonic(text).as_str() {
            "PU" | "PD" | "PA" | "PR" => return self.moves(text, &parameters),
            "AA" | "AR" => self.arc(&parameters, mnemonic(text) == "AR"),
            "IN" => {
                (self.relative, self.scaled, self.down) = (false, false, false);
                self.lift();
            }
            "SP" => {
                self.pen = parameters.first().copied().unwrap_or(0.0);
                if self.pen == 0.0 {
                    // The pen is put away: the position is that of its stall.
                    (self.state, self.down) = (None, false);
                }
            }
            "VS" => {
                if let Some(speed) = parameters.first().filter(|speed| **speed > 0.0) {
                    self.speed = speed * UNITS_A_CM;
                }
            }
            "SC" | "RO" => {
                self.scaled = !parameters.is_empty();
                self.state = None;
            }
            // They change no position.
            "IP" | "IW" | "DF" | "PS" | "LT" | "FT" | "PT" | "FS" | "AS" | "DT" | "CS" | "CA" | "SS"
            | "SA" | "DI" | "DR" | "SI" | "SR" | "SL" | "TL" | "IM" | "CO" | "CT" | "PW" | "" => {}
            _ => self.state = None,
        }
        vec![self.state]
    }

    fn lift(&mut self) {
        if let Some(state) = &mut self.state {
            state.down = false;
        }
    }

    fn moves(&mut self, text: &str, parameters: &[f64]) -> Vec<Option<PenState>> {
        match mnemonic(text).as_str() {
            "PU" => self.down = false,
            "PD" => self.down = true,
            "PA" => self.relative = false,
            _ => self.relative = true,
        }
        if let Some(state) = &mut self.state {
            state.down = self.down;
        }
        let mut states = Vec::new();
        for pair in parameters.chunks_exact(2) {
            let base = if self.relative { self.state.map(|state| state.at) } else { Some((0, 0)) };
            // Unscaled decimals go to the next lower unit.
            let step = (pair[0].floor() as i64, pair[1].floor() as i64);
            let at = base.map(|base| (base.0 + step.0, base.1 + step.1)).filter(|_| !self.scaled);
            self.state = at.map(|at| PenState { at, down: self.down, tolerance: 0 });
            states.push(self.state);
        }
        if states.is_empty() {
            states.push(self.state);
        }
        states
    }

    fn arc(&mut self, parameters: &[f64], relative: bool) {
        let (Some(state), [x, y, sweep, ..]) = (self.state, parameters) else {
            self.state = None;
            return;
        };
        let from = (state.at.0 as f64, state.at.1 as f64);
        let center = if relative { (from.0 + x, from.1 + y) } else { (*x, *y) };
        let (sin, cos) = libm::sincos(sweep.to_radians());
        let arm = (from.0 - center.0, from.1 - center.1);
        let end = (center.0 + cos * arm.0 - sin * arm.1, center.1 + sin * arm.0 + cos * arm.1);
        let at = (end.0.round() as i64, end.1.round() as i64);
        self.state = Some(PenState { at, down: self.down, tolerance: 1 });
    }
}

/// Acceleration that durations are estimated with, plotter units/s²: 0.5 g, as plotters of this kind
/// have after `VS`.
const ACCELERATION: f64 = 0.5 * 9.806_65 * 40_000.0;
/// How long a change of pens takes, microseconds: an estimate.
pub(crate) const PEN_CHANGE_US: u64 = 2_000_000;
/// How long the pen takes to lift or drop, microseconds: an estimate.
pub(crate) const PEN_MOVE_US: u64 = 60_000;
/// Speed with the pen up, plotter units/s: 50.8 cm/s.
pub(crate) const TRAVEL_SPEED: f64 = 50.8 * UNITS_A_CM;

/// How long a move from rest to rest takes, microseconds: `d / v + v / a`, or `2 sqrt(d / a)` where
/// `v` is not reached.
pub(crate) fn move_us(distance: f64, speed: f64) -> u64 {
    let seconds = if distance * ACCELERATION >= speed * speed {
        distance / speed + speed / ACCELERATION
    } else {
        2.0 * (distance / ACCELERATION).sqrt()
    };
    (seconds * 1e6) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pen_states_of_instructions() {
        let mut follower = Follower::new(Some((7, 8)), 38.1);
        let state = |x, y, down| Some(PenState { at: (x, y), down, tolerance: 0 });
        assert_eq!(follower.execute("IN;"), [state(7, 8, false)]);
        assert_eq!(follower.execute("SP2;"), [state(7, 8, false)]);
        assert_eq!(follower.execute("PU100,-200;"), [state(100, -200, false)]);
        assert_eq!(follower.execute("PD;"), [state(100, -200, true)]);
        assert_eq!(follower.execute("PA0,0,10,1.9;"), [state(0, 0, true), state(10, 1, true)]);
        assert_eq!(follower.execute("PR5 5-1-1"), [state(15, 6, true), state(14, 5, true)]);
        assert_eq!(follower.execute("PA"), [state(14, 5, true)]);
        let arc = follower.execute("AA0,0,90,5;");
        assert_eq!(arc, [Some(PenState { at: (-5, 14), down: true, tolerance: 1 })]);
        assert_eq!(follower.execute("LBhello\u{3}"), [None]);
        assert_eq!(follower.execute("PU1,1;"), [state(1, 1, false)]);
        let _ = follower.execute("SC0,1,0,1;");
        assert_eq!(follower.execute("PD0,1;"), [None]);
    }

    #[test]
    fn duration_of_moves() {
        // 0.5 g: 1 g takes 9.8 m/s² over 25 um units.
        assert_eq!(move_us(0.0, 15_240.0), 0);
        let short = move_us(10.0, 15_240.0);
        assert!((14_000..15_000).contains(&short), "{short}");
        let long = move_us(15_240.0, 15_240.0);
        assert!((1_070_000..1_090_000).contains(&long), "{long}");
    }
}
