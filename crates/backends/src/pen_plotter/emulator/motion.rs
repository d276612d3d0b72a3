//! Where the emulated plotter's pen goes: scaling, limits, lines, arcs and the time that they take.

use super::execute::{Interpreter, PAPERS, PEN_MOVE_US, TRAVEL_CM_S, UNITS_A_CM};
use crate::ink::Ink;

impl Interpreter {
    /// The pen and the mode of an instruction of moves.
    pub(super) fn pen_state(&mut self, name: [u8; 2], ink: &mut Ink) -> u64 {
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
    pub(super) fn touch(&mut self, ink: &mut Ink) {
        let at = self.physical(self.at);
        if self.pen_is_down() && self.clip(at, at).is_some() {
            ink.pen(self.pen, at);
        }
    }

    /// A coordinate pair in plotter units.
    pub(super) fn target(&mut self, pair: [f64; 2]) -> [f64; 2] {
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

    pub(super) fn scale_factors(&self) -> [f64; 2] {
        let [p1x, p1y, p2x, p2y] = self.points;
        self.scale.map_or([1.0; 2], |[x1, x2, y1, y2]| [(p2x - p1x) / (x2 - x1), (p2y - p1y) / (y2 - y1)])
    }

    /// From the frame of `RO` to that of the ink.
    pub(super) fn physical(&self, at: [f64; 2]) -> [f64; 2] {
        let ([width, _], _) = self.paper();
        if self.turned { [width - at[1], at[0]] } else { at }
    }

    pub(super) fn paper(&self) -> ([f64; 2], [f64; 4]) {
        PAPERS[usize::from(self.large)]
    }

    /// The part of a segment within limits and window, in the frame of the ink.
    pub(super) fn clip(&self, from: [f64; 2], to: [f64; 2]) -> Option<([f64; 2], [f64; 2])> {
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
    pub(super) fn go(&mut self, to: [f64; 2], ink: &mut Ink) -> u64 {
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
    pub(super) fn arc(&mut self, center: [f64; 2], sweep: f64, chord: f64, ink: &mut Ink) -> u64 {
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

    pub(super) fn default_points(&self) -> [f64; 4] {
        match (self.turned, self.large) {
            (false, _) => self.paper().1,
            (true, false) => [0.0, 610.0, 7200.0, 10_610.0],
            (true, true) => [607.0, 797.0, 10_607.0, 15_997.0],
        }
    }

    /// `RO`: the pen stays where it is.
    pub(super) fn turn(&mut self, turned: bool) {
        let [x, y] = self.physical(self.at);
        let ([width, _], _) = self.paper();
        self.turned = turned;
        self.at = if turned { [y, width - x] } else { [x, y] };
    }

    pub(super) fn circle(&mut self, radius: f64, rest: &[f64], ink: &mut Ink) -> u64 {
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

    pub(super) fn rectangle(&mut self, relative: bool, corner: [f64; 2], ink: &mut Ink) -> u64 {
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

    /// The position in user units.
    pub(super) fn user(&self) -> [f64; 2] {
        let [sx, sy] = self.scale_factors();
        let [x1, _, y1, _] = self.scale.unwrap_or_default();
        [x1 + (self.at[0] - self.points[0]) / sx, y1 + (self.at[1] - self.points[1]) / sy]
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
