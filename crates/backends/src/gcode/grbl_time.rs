//! How long grbl 1.1 takes for a program, by a model of what its documentation and its reports describe:
//! the look-ahead of a ring of 16 blocks, limits of speed and acceleration for each axis, junction
//! deviation, arcs cut into chords, stops before pen and dwell, and the serial line that feeds it.
//!
//! Not modelled: rounding of step times, feed holds, overrides, soft limits.

use std::collections::VecDeque;
use std::f64::consts::TAU;

/// Blocks that are planned at once: one of the ring's 16 stays empty.
const BLOCKS: usize = 15;
/// Motion is handed to the step interrupt in pieces of this time, s, or up to the end of a block; what was
/// handed over is not planned again.
const PIECE_S: f64 = 0.01;
/// The piece that is executed and those that wait.
const PIECES: usize = 5;
/// Dwells take a multiple of this, s.
const DWELL_STEP_S: f64 = 0.05;
/// Bytes of the receive buffer that a sender may fill.
const RECEIVE_BYTES: usize = 127;
/// A byte at 115200 baud, s.
const BYTE_S: f64 = 10.0 / 115_200.0;
/// Parsing and planning a line, s: assumed, not measured.
pub(super) const LINE_S: f64 = 1.5e-3;
/// Cosines nearer to +-1 are a reversal or a straight line.
const STRAIGHT_COS: f64 = 0.999_999;

/// The settings of grbl that its time depends on, in units of mm and s; axes x, y and z.
#[derive(Clone, Debug, PartialEq)]
pub struct GrblSettings {
    /// `$1` below 255: every stop takes this much longer, s.
    pub idle_delay_s: f64,
    /// `$11`.
    pub junction_deviation_mm: f64,
    /// `$12`.
    pub arc_tolerance_mm: f64,
    /// `$100` to `$102`.
    pub steps_per_mm: [f64; 3],
    /// `$110` to `$112`, divided by 60.
    pub max_rate_mm_s: [f64; 3],
    /// `$120` to `$122`.
    pub acceleration_mm_s2: [f64; 3],
}

impl Default for GrblSettings {
    /// No delay at stops (`$1=255`), and what grbl has for a machine that it does not know.
    fn default() -> Self {
        Self {
            idle_delay_s: 0.0,
            junction_deviation_mm: 0.01,
            arc_tolerance_mm: 0.002,
            steps_per_mm: [250.0; 3],
            max_rate_mm_s: [500.0 / 60.0; 3],
            acceleration_mm_s2: [10.0; 3],
        }
    }
}

/// A line of a program as far as time depends on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Command {
    /// To a place, mm; at the rapid rate without a feed, mm/s. With a center: an arc.
    Move { to: [f64; 3], feed_mm_s: Option<f64>, arc: Option<Arc> },
    /// A wait for all motion, then this time, s.
    Dwell(f64),
    /// A wait for all motion.
    Wait,
    /// Nothing.
    Mode,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Arc {
    center: [f64; 2],
    is_clockwise: bool,
}

/// Reads lines as plotplan writes them: absolute mm, modal motion and feed.
#[derive(Debug)]
pub(super) struct Reader {
    at: [f64; 3],
    motion: u8,
    feed_mm_s: f64,
    is_inverse_time: bool,
}

impl Default for Reader {
    fn default() -> Self {
        Self { at: [0.0; 3], motion: 0, feed_mm_s: f64::INFINITY, is_inverse_time: false }
    }
}

impl Reader {
    pub(super) fn read(&mut self, line: &str) -> Command {
        let code = line.split([';', '(']).next().unwrap_or_default();
        let mut is_dwell = false;
        let (mut to, mut moves) = (self.at, false);
        let (mut offset, mut dwell_s, mut feed) = ([0.0; 2], 0.0, None);
        for word in code.split_ascii_whitespace() {
            let Some((letter, number)) = word.split_at_checked(1) else { continue };
            let value: f64 = number.parse().unwrap_or(0.0);
            match (letter, number) {
                ("G", "0" | "1" | "2" | "3") => self.motion = value as u8,
                ("G", "4") => is_dwell = true,
                ("G", "93") => self.is_inverse_time = true,
                ("G", "94") => self.is_inverse_time = false,
                ("M", "0" | "2" | "3" | "4" | "5" | "30") => return Command::Wait,
                ("X", _) => (to[0], moves) = (value, true),
                ("Y", _) => (to[1], moves) = (value, true),
                ("Z", _) => (to[2], moves) = (value, true),
                ("I", _) => offset[0] = value,
                ("J", _) => offset[1] = value,
                ("P", _) => dwell_s = value,
                ("F", _) => feed = Some(value),
                _ => {}
            }
        }
        if is_dwell {
            return Command::Dwell(dwell_s);
        }
        if let Some(feed) = feed
            && !self.is_inverse_time
        {
            self.feed_mm_s = feed / 60.0;
        }
        if !moves {
            return Command::Mode;
        }
        let arc = (self.motion >= 2).then(|| Arc {
            center: [self.at[0] + offset[0], self.at[1] + offset[1]],
            is_clockwise: self.motion == 2,
        });
        let feed_mm_s = match (self.motion, self.is_inverse_time, feed) {
            (0, ..) => None,
            (_, true, Some(per_min)) => Some(distance(self.at, to) * per_min / 60.0),
            _ => Some(self.feed_mm_s),
        };
        self.at = to;
        Command::Move { to, feed_mm_s, arc }
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    libm::sqrt((0..3).map(|axis| (b[axis] - a[axis]) * (b[axis] - a[axis])).sum())
}

/// A straight move, as planned.
#[derive(Clone, Copy, Debug)]
struct Block {
    left_mm: f64,
    acceleration: f64,
    nominal: f64,
    /// Squares of speeds at its start, (mm/s)²: what the junction allows, and what is planned.
    most_entry: f64,
    entry: f64,
}

/// The firmware while it executes a program.
#[derive(Debug)]
pub(super) struct Model<'a> {
    settings: &'a GrblSettings,
    blocks: VecDeque<Block>,
    steps: [f64; 3],
    direction: [f64; 3],
    nominal_before: f64,
    /// What the program has come to, s.
    now: f64,
    /// Ends of the pieces that were handed over, s; the time and the speed at the end of the last one.
    pieces: VecDeque<f64>,
    handed: f64,
    speed: f64,
}

impl<'a> Model<'a> {
    /// At rest at a place, mm.
    pub(super) fn new(settings: &'a GrblSettings, at: [f64; 3]) -> Self {
        Self {
            settings,
            blocks: VecDeque::with_capacity(BLOCKS),
            steps: in_steps(settings, at),
            direction: [0.0; 3],
            nominal_before: 0.0,
            now: 0.0,
            pieces: VecDeque::with_capacity(PIECES),
            handed: 0.0,
            speed: 0.0,
        }
    }

    /// Executes a command; motion may still be queued.
    pub(super) fn execute(&mut self, command: Command) {
        match command {
            Command::Move { to, feed_mm_s, arc: Some(arc) } => self.arc(to, feed_mm_s, arc),
            Command::Move { to, feed_mm_s, arc: None } => self.line(to, feed_mm_s),
            Command::Dwell(seconds) => {
                self.finish();
                // 0.15 s are three steps, not four.
                self.now += (seconds / DWELL_STEP_S - 1e-6).ceil().max(0.0) * DWELL_STEP_S;
            }
            Command::Wait => {
                self.finish();
            }
            Command::Mode => {}
        }
    }

    /// Waits until everything has been executed; the time, s.
    pub(super) fn finish(&mut self) -> f64 {
        let moves = !self.blocks.is_empty() || self.handed > self.now;
        while !self.blocks.is_empty() {
            self.hand_over_piece();
        }
        self.pieces.clear();
        self.now = self.now.max(self.handed);
        if moves {
            self.now += self.settings.idle_delay_s;
        }
        self.now
    }

    /// Time passes.
    pub(super) fn pass_time(&mut self, seconds: f64) {
        self.pass(self.now + seconds);
    }

    /// Time passes while a line is read.
    fn pass(&mut self, until: f64) {
        self.hand_over();
        while let Some(end) = self.pieces.front().copied().filter(|end| *end <= until) {
            self.now = self.now.max(end);
            self.hand_over();
        }
        self.now = self.now.max(until);
    }

    /// As many pieces as there is room for.
    fn hand_over(&mut self) {
        while self.pieces.front().is_some_and(|end| *end <= self.now) {
            self.pieces.pop_front();
        }
        while self.pieces.len() < PIECES && !self.blocks.is_empty() {
            self.handed = self.handed.max(self.now);
            self.hand_over_piece();
            self.pieces.push_back(self.handed);
        }
    }

    /// Cut so that the chords are within `$12`.
    fn arc(&mut self, to: [f64; 3], feed_mm_s: Option<f64>, arc: Arc) {
        let from: [f64; 2] = [0, 1].map(|axis: usize| self.steps[axis] / self.settings.steps_per_mm[axis]);
        let polar = |at: [f64; 2]| {
            let [x, y] = [at[0] - arc.center[0], at[1] - arc.center[1]];
            (libm::hypot(x, y), libm::atan2(y, x))
        };
        let ((radius, first), (_, last)) = (polar(from), polar([to[0], to[1]]));
        let mut sweep = last - first;
        if arc.is_clockwise {
            while sweep >= -5e-7 {
                sweep -= TAU;
            }
        } else {
            while sweep <= 5e-7 {
                sweep += TAU;
            }
        }
        if sweep.abs() > TAU + 1e-6 {
            sweep -= TAU * sweep.signum();
        }
        let tolerance = self.settings.arc_tolerance_mm;
        let chord = libm::sqrt((tolerance * (2.0 * radius - tolerance)).max(0.0));
        let parts = if chord > 0.0 { (0.5 * sweep.abs() * radius / chord).floor() } else { 0.0 };
        for part in 1..parts as u32 {
            let (sin, cos) = libm::sincos(first + sweep * f64::from(part) / parts);
            self.line([arc.center[0] + radius * cos, arc.center[1] + radius * sin, to[2]], feed_mm_s);
        }
        self.line(to, feed_mm_s);
    }

    fn line(&mut self, to: [f64; 3], feed_mm_s: Option<f64>) {
        self.hand_over();
        while self.blocks.len() >= BLOCKS
            && let Some(end) = self.pieces.front().copied()
        {
            self.now = self.now.max(end);
            self.hand_over();
        }
        let steps = in_steps(self.settings, to);
        if steps == self.steps {
            return;
        }
        let delta: [f64; 3] =
            [0, 1, 2].map(|axis: usize| (steps[axis] - self.steps[axis]) / self.settings.steps_per_mm[axis]);
        let length = distance([0.0; 3], delta);
        let direction = delta.map(|part| part / length);
        let limit = |limits: &[f64; 3], direction: &[f64; 3]| {
            (0..3)
                .filter(|axis| direction[*axis] != 0.0)
                .fold(f64::INFINITY, |least, axis| least.min(limits[axis] / direction[axis].abs()))
        };
        let rapid = limit(&self.settings.max_rate_mm_s, &direction);
        let nominal = feed_mm_s.map_or(rapid, |feed| feed.min(rapid)).max(1.0 / 60.0);
        let mut most_entry = 0.0;
        if self.blocks.is_empty() {
            self.speed = 0.0;
        } else {
            let before = self.direction;
            let cos: f64 = -(0..3).map(|axis| before[axis] * direction[axis]).sum::<f64>();
            most_entry = if cos > STRAIGHT_COS {
                0.0
            } else if cos < -STRAIGHT_COS {
                f64::INFINITY
            } else {
                let turn: [f64; 3] = [0, 1, 2].map(|axis: usize| direction[axis] - before[axis]);
                let turn = turn.map(|part| part / distance([0.0; 3], turn));
                let sin_half = libm::sqrt(0.5 * (1.0 - cos));
                limit(&self.settings.acceleration_mm_s2, &turn)
                    * self.settings.junction_deviation_mm
                    * sin_half
                    / (1.0 - sin_half)
            };
            let slower = nominal.min(self.nominal_before);
            most_entry = most_entry.min(slower * slower);
        }
        let acceleration = limit(&self.settings.acceleration_mm_s2, &direction);
        self.blocks.push_back(Block { left_mm: length, acceleration, nominal, most_entry, entry: 0.0 });
        (self.steps, self.direction, self.nominal_before) = (steps, direction, nominal);
        self.plan();
        self.hand_over();
    }

    /// Entry speeds: down to rest at the end of the queue, up from the present speed.
    fn plan(&mut self) {
        let mut exit = 0.0;
        for block in self.blocks.iter_mut().skip(1).rev() {
            let entry = block.most_entry.min(exit + 2.0 * block.acceleration * block.left_mm);
            block.entry = entry;
            exit = entry;
        }
        let Some(first) = self.blocks.front_mut() else { return };
        first.entry = self.speed * self.speed;
        let mut reached = first.entry + 2.0 * first.acceleration * first.left_mm;
        for block in self.blocks.iter_mut().skip(1) {
            block.entry = block.entry.min(reached);
            reached = block.entry + 2.0 * block.acceleration * block.left_mm;
        }
    }

    /// Hands over the next piece of the first block: up to its end, or the time of a piece.
    fn hand_over_piece(&mut self) {
        let exit = self.blocks.get(1).map_or(0.0, |next| libm::sqrt(next.entry));
        let Some(block) = self.blocks.front_mut() else { return };
        let (mut left_s, mut speed, a) = (PIECE_S, self.speed, block.acceleration);
        // Speeds at which it stops accelerating and starts to brake.
        let top = libm::sqrt(a * block.left_mm + 0.5 * (speed * speed + exit * exit)).min(block.nominal);
        let brake_mm = ((top * top - exit * exit) / (2.0 * a)).max(0.0);
        let ramps = [(top, brake_mm), (exit, 0.0)];
        for (target, until_mm) in ramps {
            let mut way_mm = block.left_mm - until_mm;
            // A ramp to the target, then at its speed until the way is done.
            let ramp_s = ((target - speed).abs() / a).min(left_s);
            if ramp_s > 0.0 {
                let after = speed + a.copysign(target - speed) * ramp_s;
                let ramp_mm = 0.5 * (speed + after) * ramp_s;
                if ramp_mm > way_mm + 1e-12 && until_mm == 0.0 {
                    // The block ends within the ramp.
                    let spent = 2.0 * way_mm / (speed + after).max(1e-9);
                    left_s -= spent.min(left_s);
                    block.left_mm = 0.0;
                    speed = exit;
                    break;
                }
                (speed, left_s) = (after, left_s - ramp_s);
                block.left_mm -= ramp_mm;
                way_mm -= ramp_mm;
            }
            if left_s <= 0.0 {
                break;
            }
            if way_mm > 0.0 && speed > 0.0 {
                let cruise_s = (way_mm / speed).min(left_s);
                block.left_mm -= speed * cruise_s;
                left_s -= cruise_s;
            }
            if left_s <= 0.0 {
                break;
            }
        }
        self.handed += PIECE_S - left_s.max(0.0);
        self.speed = speed;
        if block.left_mm < 1e-7 || left_s > 1e-9 {
            self.blocks.pop_front();
            self.speed = if self.blocks.is_empty() { 0.0 } else { speed };
        }
    }
}

fn in_steps(settings: &GrblSettings, at: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis: usize| (at[axis] * settings.steps_per_mm[axis]).round())
}

/// The time that grbl takes for a program sent at 115200 baud, s.
pub fn duration_s<'a>(lines: impl IntoIterator<Item = &'a str>, settings: &GrblSettings) -> f64 {
    let mut reader = Reader::default();
    let mut model = Model::new(settings, [0.0; 3]);
    // Lines on their way: bytes, and when they were taken out of the buffer.
    let mut sent: VecDeque<(usize, f64)> = VecDeque::new();
    let (mut in_flight, mut wire_s) = (0, 0.0_f64);
    for line in lines {
        let bytes = line.len() + 1;
        while in_flight + bytes > RECEIVE_BYTES
            && let Some((taken, at)) = sent.pop_front()
        {
            in_flight -= taken;
            wire_s = wire_s.max(at);
        }
        wire_s += bytes as f64 * BYTE_S;
        model.pass(model.now.max(wire_s) + LINE_S);
        sent.push_back((bytes, model.now));
        in_flight += bytes;
        model.execute(reader.read(line));
    }
    model.finish()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;
    use std::fmt::Write as _;

    use super::*;

    /// Settings as the durations below were computed with: rate and acceleration of x, of y.
    fn settings(idle_delay_s: f64, deviation_mm: f64, x: [f64; 2], y: [f64; 2]) -> GrblSettings {
        GrblSettings {
            idle_delay_s,
            junction_deviation_mm: deviation_mm,
            arc_tolerance_mm: 0.002,
            steps_per_mm: [80.0; 3],
            max_rate_mm_s: [x[0], y[0], x[0]],
            acceleration_mm_s2: [x[1], y[1], x[1]],
        }
    }

    /// Durations that grbl 1.1h's own planner and segment generator gave for these programs, compiled for the
    /// host with a clock in place of the step interrupt, s.
    #[test]
    fn durations_are_those_of_grbl() {
        let corners = "G1 X10 F6000\nX10 Y10\nX20 Y10\nX20 Y20\nX30 Y20\n";
        let arcs = "G1 F3000\nX10 Y0\nG3 X-10 Y0 I-10 J0\nG3 X10 Y0 I10 J0\n";
        let (mut circle, mut pieces) = ("G1 F3000\n".to_owned(), "G1 F3000\n".to_owned());
        for k in 0..400 {
            let (sin, cos) = libm::sincos(f64::from(k) * 0.05);
            writeln!(circle, "X{:.3} Y{:.3}", 20.0 * cos, 20.0 * sin).unwrap();
            writeln!(pieces, "X{:.3}", 0.2 * f64::from(k)).unwrap();
        }
        let cases = [
            ("G0 X100\n", [1.127, 1.102, 1.869]),
            (corners, [0.982, 0.868, 1.571]),
            (arcs, [1.575, 1.531, 1.704]),
            (&circle, [8.493, 8.449, 8.648]),
            (&pieces, [1.710, 1.685, 2.119]),
        ];
        let all = [
            settings(0.025, 0.01, [100.0, 1000.0], [100.0, 1000.0]),
            settings(0.0, 0.1, [100.0, 1000.0], [100.0, 1000.0]),
            settings(0.0, 0.02, [60.0, 300.0], [100.0, 500.0]),
        ];
        for (program, wanted) in cases {
            for (settings, wanted_s) in all.iter().zip(wanted) {
                let found_s = duration_s(program.lines(), settings);
                let head: String = program.chars().take(30).collect();
                assert!((found_s / wanted_s - 1.0).abs() < 0.003, "{head:?}: {found_s} s, grbl {wanted_s} s");
            }
        }
    }

    #[test]
    fn trapezoid_dwell_and_stop_delay() {
        let settings = settings(0.025, 0.01, [100.0, 1000.0], [100.0, 1000.0]);
        // 0.1 s of acceleration, 0.9 s at 100 mm/s, 0.1 s to rest; a dwell of 0.12 s takes 0.15 s.
        let program = "G0 X100\nM3 S90\nG4 P0.12\n";
        let found_s = duration_s(program.lines(), &settings);
        let lines_s = 3.0 * LINE_S + program.len() as f64 * BYTE_S;
        assert!((found_s - (1.1 + 0.025 + 0.15)).abs() < lines_s, "{found_s}");
    }

    #[test]
    fn arcs_and_full_circles_have_their_length() {
        let settings = settings(0.0, 10.0, [1e3, 1e6], [1e3, 1e6]);
        for (program, turns) in [
            ("G0 X10 Y0\nG2 X-10 Y0 I-10 J0 F600\n", 0.5),
            ("G0 X10 Y0\nG3 X0 Y-10 I-10 J0 F600\n", 0.75),
            ("G0 X10 Y0\nG3 X10 Y0 I-10 J0 F600\n", 1.0),
        ] {
            let found_s = duration_s(program.lines(), &settings);
            // 10 mm/s; at this acceleration ramps do not count.
            assert!((found_s - turns * TAU).abs() < 0.05, "{program}: {found_s}");
        }
    }
}
