//! Time parametrization under speed and acceleration limits: arcs on which one bound holds.
//!
//! With `b = (ds/dt)²` and `u = d²s/dt²` the fastest motion has one bound at its limit at every
//! place: a motor's acceleration, a speed limit, or the limit near corners (Bobrow et al. 1985, Shin
//! and `McKay` 1985). While that is a motor's acceleration b is known in closed form for any geometry
//! (`flow`), so an arc lasts until another bound takes over and nothing is refined.
//!
//! The path is divided into cells on which the motors' derivatives are polynomials of degree 5,
//! exact for lines, blends and splines on linear kinematics, cut at zero-inertia points (`cell`).
//! One pass against the motion finds the largest b from which the end can be reached, K, as arcs;
//! one pass along it moves as fast as possible below K and, where it meets K, brakes along K's arc.
//! Both use the same routine, on mirrored cells. Solutions of a differential equation do not cross,
//! so a larger b at one place never leads to a smaller one elsewhere: the result is the optimum.
//!
//! Rows are sampled from polynomials s(t) of degree 5 with the right place, speed and acceleration
//! at both ends of a part of an arc, short enough for both motors to keep their limits.

mod cell;
mod flow;

use kinematics::Machine;

use super::profile::{LimitingConstraints, Phase, Profile, SpeedCap};
use crate::joint_path::JointPath;
pub(crate) use cell::hermite;
use cell::{Bound, Cell, Oriented, SpeedLimits};
use flow::{Arc, root};

/// How far the polynomials s(t) may exceed a motor's acceleration limit, as a share.
const EXCESS: f64 = 1e-4;

/// A profile with a larger excess than this is no solution: at a cusp the passes may fail.
const LARGEST_EXCESS: f64 = 2e-3;

/// Parts of an arc shorter than this share of the cell get one acceleration: rounding errors would
/// exceed the terms of higher order.
const SHORTEST: f64 = 1e-7;

/// How often a part of an arc is halved.
const HALVINGS: u32 = 8;

/// The fastest profile along a path; `None` where the passes fail.
pub(super) fn profile(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Option<Profile> {
    let limits = SpeedLimits::new(machine, cap);
    let mut cells = Vec::with_capacity(path.intervals.len());
    let mut error = 0.0_f64;
    let mut finer = Vec::new();
    for interval in &path.intervals {
        finer.clear();
        interval.refine(machine, &path.geometry, &mut finer);
        for interval in &finer {
            error = error.max(interval.polynomial_error);
            Cell::new(machine, interval, cap).cut(&limits, &mut cells);
        }
    }
    let largest = against(&cells, &limits);
    let mut phases = Phases::new();
    along(&cells, &limits, &largest, &mut phases)?;
    let slower = (phases.excess * (1.0 + error)).max(1.0);
    let is_solution = phases.profile.duration_s.is_finite() && phases.excess <= 1.0 + LARGEST_EXCESS;
    is_solution.then(|| phases.profile.slowed(slower.sqrt()))
}

/// A part of K, the largest b from which the end can be reached: one arc of the pass against the
/// motion, in the coordinates of the mirrored cell.
struct Part {
    cell: usize,
    /// In the direction of the motion.
    from: f64,
    to: f64,
    arc: Arc,
    /// K at `from`, at most what the piece before allows.
    k_from: f64,
}

/// The pass against the motion, in the order of the path.
fn against(cells: &[Cell], limits: &SpeedLimits) -> Vec<Part> {
    let mut parts: Vec<Part> = Vec::with_capacity(2 * cells.len());
    let mut arcs = Vec::new();
    let mut k = 0.0_f64;
    for (index, cell) in cells.iter().enumerate().rev() {
        let own = Oriented::new(cell, limits, true);
        let h = cell.length;
        arcs.clear();
        let start = own.flow(0.0, h, k.min(own.ceiling(0.0)).min(own.cap(0.0).0), false, &mut arcs);
        k = start.min(own.ceiling(h)).min(own.cap(h).0);
        parts.extend(arcs.iter().map(|arc| Part {
            cell: index,
            from: h - arc.to,
            to: h - arc.from,
            arc: *arc,
            k_from: arc.b_to,
        }));
        if let Some(last) = parts.last_mut() {
            last.k_from = k;
        }
    }
    parts.reverse();
    parts
}

/// The pass along the motion; `None` where it would have to follow the ceiling.
fn along(cells: &[Cell], limits: &SpeedLimits, largest: &[Part], phases: &mut Phases) -> Option<()> {
    let mut b = 0.0_f64;
    let mut arcs = Vec::new();
    let mut own: Option<(usize, [Oriented; 2])> = None;
    for (index, part) in largest.iter().enumerate() {
        let cell = &cells[part.cell];
        let oriented = match own.take() {
            Some((which, oriented)) if which == part.cell => oriented,
            _ => [false, true].map(|mirrored| Oriented::new(cell, limits, mirrored)),
        };
        let [forward, mirrored] = own.insert((part.cell, oriented)).1;
        let (h, next) = (cell.length, largest.get(index + 1));
        let k_end = next.map_or(0.0, |next| next.k_from.min(part.arc.b_from));
        b = b.min(part.k_from);
        arcs.clear();
        let end = forward.flow(part.from, part.to, b, true, &mut arcs);
        let stopped = arcs.last().is_some_and(|arc| arc.bound == Bound::Ceiling);
        if end <= k_end * (1.0 + 1e-13) && !stopped {
            for arc in &arcs {
                phases.push(cell, &forward, arc, [arc.from, arc.to], false);
            }
            b = end.min(k_end);
            continue;
        }
        // Where the arcs meet the one arc of K.
        let k_at = |s: f64| mirrored.b(&part.arc, (h - s).clamp(part.arc.from, part.arc.to));
        let meets = |arc: &Arc| arc.bound == Bound::Ceiling || arc.b_to > k_at(arc.to);
        let mut meeting = part.to;
        for arc in &arcs {
            if !meets(arc) {
                phases.push(cell, &forward, arc, [arc.from, arc.to], false);
                continue;
            }
            let above = |s: f64| forward.b(arc, s) / k_at(s) - 1.0;
            let low = above(arc.from).min(0.0);
            meeting = if arc.bound == Bound::Ceiling || low > -1e-15 {
                arc.from
            } else {
                root((arc.from, low), (arc.to, above(arc.to)), 1e-14 * h, above)
            };
            phases.push(cell, &forward, arc, [arc.from, meeting], false);
            break;
        }
        let brake = [(h - part.to).max(part.arc.from), (h - meeting).min(part.arc.to)];
        if part.arc.bound == Bound::Ceiling && brake[1] - brake[0] > 1e-9 * h {
            return None;
        }
        phases.push(cell, &mirrored, &part.arc, brake, true);
        b = k_end;
    }
    Some(())
}

/// Place, speed and acceleration at an end of a phase.
#[derive(Clone, Copy)]
struct Place {
    /// In the oriented cell, and along the piece.
    own: f64,
    s: f64,
    speed: f64,
    u: f64,
}

/// The phases so far.
struct Phases {
    profile: Profile,
    /// The largest share of a limit that they use, as a factor of b.
    excess: f64,
}

impl Phases {
    fn new() -> Self {
        Self { profile: Profile::new(), excess: 1.0 }
    }

    /// Appends the phases of a part of an arc of a cell, given in the direction of the pass.
    fn push(&mut self, cell: &Cell, own: &Oriented, arc: &Arc, [from, to]: [f64; 2], mirrored: bool) {
        if to - from <= 1e-12 * cell.length {
            return;
        }
        let place = |at: f64| {
            // At a zero-inertia point the limit value.
            let is_turning = matches!(arc.bound, Bound::Motor(k) if own.first(k, at) <= 1e-6 * own.first(k, 0.5 * (from + to)));
            let inside = if is_turning { at + 1e-5 * (0.5 * (from + to) - at) } else { at };
            let b = own.b(arc, inside).max(0.0);
            let u = own.u(arc.bound, inside, b);
            let speed = if is_turning { own.b(arc, at).max(0.0).sqrt() } else { b.sqrt() };
            let (s, u) = if mirrored { (cell.length - at, -u) } else { (at, u) };
            Place { own: at, s: cell.start + s, speed, u }
        };
        let mut pending = vec![(place(from), place(to), 0)];
        while let Some((a, b, halvings)) = pending.pop() {
            let duration = own.time(arc, a.own, b.own);
            let (first, last) = if mirrored { (b, a) } else { (a, b) };
            let phase = quintic(cell.piece, &first, &last, duration);
            if b.own - a.own <= SHORTEST * cell.length {
                let acceleration = (last.speed - first.speed) / duration;
                if duration > 0.0 && acceleration.is_finite() {
                    self.profile.push(Phase::even(cell.piece, first.s, first.speed, acceleration, duration));
                }
                continue;
            }
            let (excess, middle) = self.check(cell, own, &phase, duration, mirrored);
            if (excess > 1.0 + EXCESS || excess.is_nan()) && halvings < HALVINGS {
                // Half way in time, so that both halves get better.
                let middle = if middle > a.own && middle < b.own { middle } else { 0.5 * (a.own + b.own) };
                let middle = place(middle);
                let halves = [(a, middle, halvings + 1), (middle, b, halvings + 1)];
                pending.extend(if mirrored { halves } else { [halves[1], halves[0]] });
                continue;
            }
            self.excess = if excess.is_nan() { f64::INFINITY } else { self.excess.max(excess) };
            record(own, arc.bound, 0.5 * (a.own + b.own), &phase, &mut self.profile.limiting);
            self.profile.push(phase);
        }
    }

    /// The largest share of its limits that a phase uses, as a factor of b, and the place at half of
    /// its time in the oriented cell.
    fn check(&self, cell: &Cell, own: &Oriented, phase: &Phase, duration: f64, mirrored: bool) -> (f64, f64) {
        let (mut excess, mut middle) = (0.0_f64, 0.0);
        for share in [0.1, 0.3, 0.5, 0.7, 0.9] {
            let (s, speed, u) = phase.motion_at(share * duration);
            let s = s - cell.start;
            let (at, u) = if mirrored { (cell.length - s, -u) } else { (s, u) };
            let (at, b) = (at.clamp(0.0, cell.length), speed * speed);
            if share == 0.5 {
                middle = at;
            }
            let alpha = own.alpha(0, at, b, u).abs().max(own.alpha(1, at, b, u).abs());
            let zone = own.zone.map_or(0.0, |[p, beta]| p * u.abs() + beta * b);
            let used = alpha.max(zone).max(b / own.cap(at).0);
            if used.is_nan() {
                return (f64::NAN, middle);
            }
            excess = excess.max(used);
        }
        (excess, middle)
    }
}

/// The motion of degree 5 in time between two places.
fn quintic(piece: usize, from: &Place, to: &Place, duration: f64) -> Phase {
    let t = duration;
    let way = to.s - from.s - t * (from.speed + 0.5 * t * from.u);
    let (speed, u) = (to.speed - from.speed - t * from.u, to.u - from.u);
    let (way, speed, u) = (way / (t * t * t), speed / (t * t), u / t);
    Phase {
        jerk: 6.0 * (10.0 * way - 4.0 * speed + 0.5 * u),
        fourth: (-15.0 * way + 7.0 * speed - u) / t,
        fifth: (6.0 * way - 3.0 * speed + 0.5 * u) / (t * t),
        ..Phase::even(piece, from.s, from.speed, from.u, duration)
    }
}

/// Adds the duration of a phase to what limits it.
fn record(own: &Oriented, bound: Bound, at: f64, phase: &Phase, limiting: &mut LimitingConstraints) {
    let duration = phase.duration_s;
    match bound {
        Bound::Motor(k) => {
            let (_, speed, u) = phase.motion_at(0.5 * duration);
            let turning = (own.second(k, at) * speed * speed).abs() > (own.first(k, at) * u).abs();
            let of = if turning { &mut limiting.turning_s } else { &mut limiting.acceleration_s };
            of[k] += duration;
        }
        Bound::Speed(k) => limiting.speed_s[k] += duration,
        Bound::Pen => limiting.pen_s += duration,
        Bound::Rows | Bound::Zone => limiting.rows_s += duration,
        Bound::Ceiling => limiting.turning_s[0] += duration,
    }
}
