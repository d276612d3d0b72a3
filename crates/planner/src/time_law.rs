//! Trapezoidal speed along a joint path: the fastest that every bound of every cell allows, from rest to rest.
//!
//! With `b = (ds/dt)²` and `u = d²s/dt²`, so `db/ds = 2 u`, a motor with position m(s) has
//!
//! ```text
//! speed         |m'| sqrt(b)          <= v        so  b <= (v / |m'|)²
//! acceleration  |m' u + m'' b|        <= a        if  |m'| |u| + |m''| b <= a   (sufficient)
//! ```
//! Each cell bounds |m'| by Q1 and |m''| by Q2 all over, so on a cell where b nowhere exceeds `top` any u with
//! `|u| <= (a - Q2 top) / Q1` is allowed: speed rises, stays and falls linearly in time, a trapezoid. Two sweeps over
//! the cells, forward for rising and backward for falling speed, give the largest b at every node (the reachable and
//! controllable sets of Pham & Pham 2018, arXiv 1707.07239, in the special case of symmetric bounds, where each is an
//! interval from 0 and the step has a closed form). Cost linear in the number of cells.

use kinematics::Machine;

use crate::lift::{Cell, JointPath};

/// A stretch of constant acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// Index of the cell it lies in.
    pub cell: usize,
    /// Where in the cell it begins, in units of the path's parameter.
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
    /// The phases, in order.
    pub phases: Vec<Phase>,
    /// How long all of them take, s.
    pub duration: f64,
}

/// What limits the speed beside the motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedCap {
    /// Largest speed along the path, units of its parameter per second; infinite for travel.
    pub speed: f64,
    /// Largest distance (mm) that linear motion between rows may leave the curve by.
    pub row_deviation: f64,
    /// Time between rows, s.
    pub period: f64,
}

/// Within a cell the speed may rise above that of both its ends only if it rises by a good deal: otherwise the small
/// steps between neighbouring cells' bounds would make the motors chatter.
const WORTHWHILE_RISE: f64 = 1.44;

/// The fastest profile along `path` under the machine's motors and the cap.
pub fn profile(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    let cells = &path.cells;
    let caps: Vec<f64> = cells.iter().map(|cell| largest_square_speed(machine, cell, cap)).collect();
    // b at the nodes: at rest at both ends, elsewhere at most what both neighbours allow.
    let mut nodes = vec![0.0; cells.len() + 1];
    for k in 1..cells.len() {
        nodes[k] = caps[k - 1].min(caps[k]);
    }
    for k in 0..cells.len() {
        nodes[k + 1] = nodes[k + 1].min(reachable(machine, &cells[k], nodes[k]));
    }
    for k in (0..cells.len()).rev() {
        nodes[k] = nodes[k].min(reachable(machine, &cells[k], nodes[k + 1]));
    }
    let mut phases = Vec::with_capacity(cells.len() + 2);
    for (k, cell) in cells.iter().enumerate() {
        trapezoid(machine, cell, k, caps[k], nodes[k], nodes[k + 1], &mut phases);
    }
    let duration = phases.iter().map(|phase| phase.duration).sum();
    Profile { phases, duration }
}

/// The largest b anywhere on the cell at even speed (u = 0).
fn largest_square_speed(machine: &Machine, cell: &Cell, cap: &SpeedCap) -> f64 {
    let mut largest = cap.speed * cap.speed;
    for (k, motor) in machine.motors().iter().enumerate() {
        let speed = motor.max_speed / cell.first[k];
        largest = largest.min(speed * speed).min(motor.max_acceleration / cell.second[k]);
    }
    // Rows h = sqrt(b) T apart leave the curve by h² bend / 8.
    largest.min(8.0 * cap.row_deviation / (cap.period * cap.period * cell.bend))
}

/// The largest b at one end of the cell when it is `from` at the other: pure acceleration over the whole cell, bounded
/// by its largest b: (b - from) Q1 <= 2 length (a - Q2 b) for every motor.
///
/// It never is below `from` as long as `from <= a / Q2`, which the cap sees to; it grows with `from`, so that the
/// backward sweep leaves the forward sweep's conditions true.
fn reachable(machine: &Machine, cell: &Cell, from: f64) -> f64 {
    let twice = 2.0 * cell.length;
    let reached = machine.motors().iter().enumerate().map(|(k, motor)| {
        (from * cell.first[k] + twice * motor.max_acceleration) / (cell.first[k] + twice * cell.second[k])
    });
    reached.fold(f64::INFINITY, f64::min)
}

/// The phases over one cell from b0 to b1: up, along, down.
fn trapezoid(
    machine: &Machine,
    cell: &Cell,
    index: usize,
    cap: f64,
    b0: f64,
    b1: f64,
    phases: &mut Vec<Phase>,
) {
    // Up to `top` and down again: (2 top - b0 - b1) Q1 <= 2 length (a - Q2 top).
    let twice = 2.0 * cell.length;
    let peak = machine.motors().iter().enumerate().map(|(k, motor)| {
        (twice * motor.max_acceleration + cell.first[k] * (b0 + b1))
            / (2.0 * cell.first[k] + twice * cell.second[k])
    });
    let peak = peak.fold(cap, f64::min);
    let higher = b0.max(b1);
    let top = if peak > WORTHWHILE_RISE * higher { peak } else { higher };
    let allowed = machine
        .motors()
        .iter()
        .enumerate()
        .map(|(k, motor)| (motor.max_acceleration - cell.second[k] * top) / cell.first[k]);
    let allowed = allowed.fold(f64::INFINITY, f64::min);
    // Only as hard as needed: a ramp between two unequal ends takes the whole cell.
    let needed = if top > higher { allowed } else { (b1 - b0).abs() / twice };
    let (up, down) = ((top - b0) / 2.0, (top - b1) / 2.0);
    let (up, down) = if needed > 0.0 { (up / needed, down / needed) } else { (0.0, 0.0) };
    let along = (cell.length - up - down).max(0.0);
    let fast = top.sqrt();
    let mut start = 0.0;
    let mut push = |length: f64, from: f64, to: f64| {
        if length > 0.0 && from + to > 0.0 {
            let duration = 2.0 * length / (from + to);
            let acceleration = (to - from) / duration;
            phases.push(Phase { cell: index, start, speed: from, acceleration, duration });
        }
        start += length;
    };
    push(up.min(cell.length), b0.sqrt(), fast);
    push(along, fast, fast);
    push(down.min(cell.length), fast, b1.sqrt());
}
