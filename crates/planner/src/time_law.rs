//! Time-optimal speed along a joint path under every motor's speed and acceleration, from rest to rest.
//!
//! With `b = (ds/dt)²` and `u = d²s/dt²`, so `db/ds = 2 u`, a motor with position m(s) has
//!
//! ```text
//! speed         |m'| sqrt(b)     <= v      so  b <= (v / |m'|)²
//! acceleration  |m' u + m'' b|   <= a      linear in (u, b)
//! ```
//! On a cell `u` is constant, so b is linear in s; where m' and m'' are linear too, `m' u + m'' b` is convex or concave
//! enough that its bounds at the cell's start, middle and end hold between them (what is left is the cell's
//! [`Cell::slack`], by which the limits are lowered). With `b(f) = b + 2 f length u` at the share f of the cell that is
//! `|P u + R b| <= 1` with `P = (m'_f + 2 f length m''_f) / a` and `R = m''_f / a`: six strips in the plane of (u, b), and
//! two more near turns, where rows would cut them (see `path::zones`).
//!
//! Reachable-set method (Pham & Pham 2018, arXiv 1707.07239). Since (0, 0) is allowed everywhere and all conditions are
//! convex, the set of b from which the end can be reached is an interval [0, top] at every node. Backward sweep: `top`
//! at a node is the largest b for which some u fulfils the cell's conditions and leads into [0, top of the next node].
//! Forward sweep: the largest u at each node. The programs in two variables are solved in closed form by comparing
//! every lower bound of u with every upper one. Cost linear in the number of cells.

use kinematics::Machine;

use crate::lift::{Cell, JointPath};

/// A stretch of constant acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// Index of the piece it lies on.
    pub piece: usize,
    /// Where on the piece it begins, in units of the path's parameter.
    pub start: f64,
    /// Speed at its start, units/s.
    pub speed: f64,
    /// Acceleration, units/s².
    pub acceleration: f64,
    /// How long it takes, s; positive.
    pub duration: f64,
}

/// A speed profile along a joint path, from rest to rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The phases, in order; at least one.
    pub phases: Vec<Phase>,
    /// How long all of them take, s.
    pub duration: f64,
}

/// What limits the speed beside the motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedCap {
    /// Largest speed of the pen, mm/s; infinite for travel.
    pub pen: f64,
    /// Largest distance (mm) by which linear motion between rows may leave the curve.
    pub row_deviation: f64,
    /// Time between rows, s.
    pub period: f64,
}

/// The fastest profile along `path` under the machine's motors and the cap.
pub fn profile(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    let cells = &path.cells;
    let bounds: Vec<Bounds> = cells.iter().map(|cell| Bounds::new(machine, cell, cap)).collect();
    let mut tops = vec![0.0; cells.len() + 1];
    for k in (0..cells.len()).rev() {
        let before = if k > 0 { bounds[k - 1].cap } else { 0.0 };
        tops[k] = bounds[k].largest(tops[k + 1]).min(bounds[k].cap).min(before);
    }
    let mut phases = Vec::with_capacity(cells.len() + 2);
    let mut b = 0.0;
    for (k, cell) in cells.iter().enumerate() {
        let next = bounds[k].fastest(b, tops[k + 1]);
        bounds[k].phases(cell, b, next, &mut phases);
        b = next;
    }
    let duration = phases.iter().map(|phase| phase.duration).sum();
    Profile { phases, duration }
}

/// The condition `|p u + r b| <= 1`, p >= 0, with b at the cell's start.
#[derive(Clone, Copy, Debug, Default)]
struct Strip {
    p: f64,
    r: f64,
}

/// A cell's conditions.
struct Bounds {
    strips: [Strip; 8],
    /// Twice the cell's length: b at its end is `b + twice * u`.
    twice: f64,
    /// The largest b anywhere on it by speed.
    cap: f64,
    /// For peaks inside the cell: bounds on |m'| / a and |m''| / a of each motor, and of the pen near a turn.
    first: [f64; 3],
    second: [f64; 3],
}

impl Bounds {
    fn new(machine: &Machine, cell: &Cell, cap: &SpeedCap) -> Self {
        let mut strips = [Strip::default(); 8];
        let (mut first, mut second) = ([0.0_f64; 2], [0.0_f64; 2]);
        let pen = cap.pen / cell.pen_speed;
        let mut largest = (pen * pen).min(8.0 * cap.row_deviation / (cap.period * cap.period * cell.bend));
        for (k, motor) in machine.motors().iter().enumerate() {
            let limit = motor.max_acceleration / (1.0 + cell.slack);
            let mut fastest = 0.0_f64;
            for (j, share) in [0.0, 0.5, 1.0].into_iter().enumerate() {
                let (m1, m2) = (cell.first[j][k] / limit, cell.second[j][k] / limit);
                let p = m1 + 2.0 * share * cell.length * m2;
                strips[3 * k + j] = if p < 0.0 { Strip { p: -p, r: -m2 } } else { Strip { p, r: m2 } };
                first[k] = first[k].max(m1.abs());
                second[k] = second[k].max(m2.abs());
                fastest = fastest.max(cell.first[j][k].abs());
            }
            let speed = motor.max_speed / (fastest * (1.0 + cell.slack));
            largest = largest.min(speed * speed);
        }
        let mut bounds = Self {
            strips,
            twice: 2.0 * cell.length,
            cap: largest,
            first: [first[0], first[1], 0.0],
            second: [second[0], second[1], 0.0],
        };
        if cell.near_turn {
            // |p'| |u| + bend b <= 8 row / T², b largest at either end: two strips that hold at the start, and `cap`.
            let limit = 8.0 * cap.row_deviation / (cap.period * cap.period);
            let (p, r) = (cell.pen_speed / limit, cell.bend / limit);
            bounds.strips[6] = Strip { p, r };
            bounds.strips[7] = Strip { p, r: -r };
            (bounds.first[2], bounds.second[2]) = (p, r);
        }
        bounds
    }

    /// The largest b at the start for which some u fulfils all conditions and leads into [0, next].
    fn largest(&self, next: f64) -> f64 {
        // Of every pair of a lower and an upper bound of u: lower(b) <= upper(b).
        let mut largest = f64::INFINITY;
        let mut allow = |slope: f64, room: f64| {
            if slope > 0.0 {
                largest = largest.min(room / slope);
            }
        };
        for (i, one) in self.strips.iter().enumerate() {
            for other in &self.strips[i + 1..] {
                // (-1 - r_i b) / p_i <= (1 - r_j b) / p_j, and with i and j exchanged.
                allow((one.p * other.r - other.p * one.r).abs(), one.p + other.p);
            }
            // A motor that stands still here, whatever u.
            if one.p == 0.0 {
                allow(one.r.abs(), 1.0);
            }
            // (-1 - r b) / p <= (next - b) / twice: the end is not too fast.
            allow(one.p - self.twice * one.r, one.p * next + self.twice);
            // -b / twice <= (1 - r b) / p: the end is not below rest.
            allow(self.twice * one.r - one.p, self.twice);
        }
        largest
    }

    /// The largest b at the end, at most `top`, that can be reached from b at the start.
    fn fastest(&self, b: f64, top: f64) -> f64 {
        let highest =
            |strip: &Strip| if strip.p > 0.0 { (1.0 - strip.r * b) / strip.p } else { f64::INFINITY };
        let u = self.strips.iter().map(highest).fold(f64::INFINITY, f64::min);
        (b + self.twice * u).clamp(0.0, top)
    }

    /// The phases over one cell from b0 to b1: an even ramp, or up to a peak and down again where that is faster.
    fn phases(&self, cell: &Cell, b0: f64, b1: f64, phases: &mut Vec<Phase>) {
        // Up to `top` and down again with |u| <= (1 - second * top) / first: (2 top - b0 - b1) first <= twice (1 - second top).
        let mut top = self.cap;
        for (first, second) in self.first.iter().zip(self.second) {
            top = top.min((self.twice + first * (b0 + b1)) / (2.0 * first + self.twice * second));
        }
        let mut start = cell.start;
        let mut push = |length: f64, from: f64, to: f64| {
            if length > 0.0 && from + to > 0.0 {
                let (from, to) = (from.sqrt(), to.sqrt());
                let duration = 2.0 * length / (from + to);
                let acceleration = (to - from) / duration;
                phases.push(Phase { piece: cell.piece, start, speed: from, acceleration, duration });
            }
            start += length;
        };
        let strongest =
            self.first.iter().zip(self.second).map(|(first, second)| (1.0 - second * top) / first);
        let u = strongest.fold(f64::INFINITY, f64::min);
        let (up, down) = ((top - b0) / (2.0 * u), (top - b1) / (2.0 * u));
        let cruise = cell.length - up - down;
        // Not where the bound is too coarse for a peak, and not for small gains: between cells whose bounds differ a
        // little they would only make the motors chatter.
        let over = |length: f64, b: f64| 2.0 * length / (b.sqrt() + top.sqrt());
        let even = 2.0 * cell.length / (b0.sqrt() + b1.sqrt());
        let peaked = over(up, b0) + cruise / top.sqrt() + over(down, b1);
        let worthwhile = if self.second == [0.0; 3] { 1.0 - 1e-9 } else { 0.99 };
        let fits = top >= b0.max(b1) && u > 0.0 && cruise >= -1e-9 * cell.length;
        if !(fits && peaked < worthwhile * even) {
            push(cell.length, b0, b1);
            return;
        }
        let up = up.min(cell.length);
        let down = down.min(cell.length - up);
        push(up, b0, top);
        push(cell.length - up - down, top, top);
        push(down, top, b1);
    }
}
