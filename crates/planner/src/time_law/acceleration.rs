//! Speed under motor speeds and accelerations: reachable sets, cells cut finer where that gains time.
//!
//! Reachable-set method (Pham & Pham 2018, arXiv 1707.07239). Since (0, 0) is allowed everywhere and all conditions are
//! convex, the set of b from which the end can be reached is an interval [0, top] at every node. Backward sweep: `top`
//! at a node is the largest b for which some u fulfils the cell's conditions and leads into [0, top of the next node].
//! Forward sweep: the largest u at each node. Cost linear in the number of cells.
//!
//! With one acceleration a cell, no motor stays at its limit throughout a cell on which its derivatives change. Where
//! motors idle for that reason, cells are cut in two and the law is laid anew, a window of cells at a time, until what
//! idling costs is below a share of the time that nobody will see.

use kinematics::Machine;

use super::{Limiting, Profile, SpeedCap, bounds::Bounds};
use crate::lift::{Cell, Course, JointPath};

/// How many of the path's own cells are refined together: memory and cost follow it, and its ends are held to the
/// speeds of the coarse law.
const WINDOW: usize = 256;

/// Cells are refined until idle motors cost no more than this share of the time...
const IDLE_COST: f64 = 4e-4;

/// ... or until cutting them in two brings no more than this share.
const LEAST_GAIN: f64 = 1e-4;

/// A cell is not cut if its motors idle by less than this share of their limits.
const IDLE: f64 = 2e-3;

/// How often cells are cut in two.
const ROUNDS: usize = 8;

pub(super) fn profile(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    let bounds = |cells: &[Cell]| cells.iter().map(|cell| Bounds::new(machine, cell, cap)).collect::<Vec<_>>();
    let coarse = Law::within(bounds(&path.cells), 0.0, 0.0);
    let mut profile = Profile { phases: Vec::new(), duration: 0.0, limiting: Limiting::default() };
    let (mut from, mut speed) = (0, 0.0);
    while from < path.cells.len() {
        let to = coarse.cut(&path.cells, from + WINDOW);
        let end = coarse.nodes[to];
        let (cells, law) = refined(machine, path, cap, from..to, speed, end);
        speed = law.nodes[cells.len()];
        law.emit(&cells, &mut profile);
        from = to;
    }
    profile
}

/// The cells of a window, cut as often as it pays, and their law: from `speed` (as b, at most what the coarse law has
/// there) to at most `end`.
fn refined(
    machine: &Machine,
    path: &JointPath,
    cap: &SpeedCap,
    window: std::ops::Range<usize>,
    speed: f64,
    end: f64,
) -> (Vec<Cell>, Law) {
    let mut cells = path.cells[window].to_vec();
    let bounds = |cells: &[Cell]| cells.iter().map(|cell| Bounds::new(machine, cell, cap)).collect::<Vec<_>>();
    let mut law = Law::within(bounds(&cells), speed, end);
    for _ in 0..ROUNDS {
        let Some(finer) = law.cut_idle(machine, &path.course, &cells) else { break };
        // The finer cells' conditions are held in more places, so in rare cases the speed given is too high for them.
        let Some(finer_law) = Law::new(bounds(&finer), speed, end) else { break };
        let before = law.time();
        (cells, law) = (finer, finer_law);
        if before.is_finite() && before - law.time() < LEAST_GAIN * before {
            break;
        }
    }
    (cells, law)
}

/// The fastest way over some cells.
struct Law {
    bounds: Vec<Bounds>,
    /// b at every node.
    nodes: Vec<f64>,
}

impl Law {
    /// From b = `start` to at most `end`; nothing if there is no way.
    fn new(bounds: Vec<Bounds>, start: f64, end: f64) -> Option<Self> {
        let law = Self::within(bounds, start, end);
        (law.nodes[0] >= start).then_some(law)
    }

    /// The same from at most `start`.
    fn within(bounds: Vec<Bounds>, start: f64, end: f64) -> Self {
        let mut nodes = vec![end; bounds.len() + 1];
        for k in (0..bounds.len()).rev() {
            let before = if k > 0 { bounds[k - 1].cap } else { start };
            nodes[k] = bounds[k].largest(nodes[k + 1]).min(bounds[k].cap).min(before);
        }
        for k in 0..bounds.len() {
            nodes[k + 1] = bounds[k].fastest(nodes[k], nodes[k + 1]);
        }
        Self { bounds, nodes }
    }

    fn time(&self) -> f64 {
        self.bounds.iter().zip(self.nodes.windows(2)).map(|(bounds, b)| bounds.time(b[0], b[1])).sum()
    }

    /// The node at which a window that is to end at `wanted` should: where the law is nearest to the largest speed, or on
    /// a straight way, so that nothing is lost by keeping to the coarse law there.
    fn cut(&self, cells: &[Cell], wanted: usize) -> usize {
        if wanted + WINDOW / 4 >= cells.len() {
            return cells.len();
        }
        let room = |k: &usize| {
            let straight = cells[k - 1].is_straight() && cells[*k].is_straight();
            let cap = self.bounds[k - 1].cap.min(self.bounds[*k].cap);
            if straight { 2.0 } else { self.nodes[*k] / cap }
        };
        let best = (wanted..wanted + WINDOW / 4).fold((wanted, 0.0), |best, k| {
            let room = room(&k);
            if room > best.1 { (k, room) } else { best }
        });
        best.0
    }

    /// The cells with those cut in two whose motors idle, unless idling costs next to nothing.
    fn cut_idle(&self, machine: &Machine, course: &Course, cells: &[Cell]) -> Option<Vec<Cell>> {
        let mut idle = Vec::with_capacity(cells.len());
        let (mut total, mut cost, mut hanging) = (0.0, 0.0, false);
        for (bounds, b) in self.bounds.iter().zip(self.nodes.windows(2)) {
            let (time, idleness) = (bounds.time(b[0], b[1]), bounds.idleness(b[0], b[1]));
            total += time;
            // A motion with limits lower by a share takes longer by half of it.
            cost += 0.5 * idleness * time;
            let hangs = bounds.hangs_on_speed(b[0], b[1]);
            hanging |= hangs;
            idle.push(if hangs { 1.0 } else { idleness });
        }
        if total.is_finite() && !hanging && cost <= IDLE_COST * total {
            return None;
        }
        let mut finer = Vec::with_capacity(2 * cells.len());
        for (cell, idleness) in cells.iter().zip(idle) {
            match if idleness > IDLE { cell.halves(machine, course) } else { None } {
                Some(halves) => finer.extend(halves),
                None => finer.push(cell.clone()),
            }
        }
        (finer.len() > cells.len()).then_some(finer)
    }

    fn emit(&self, cells: &[Cell], profile: &mut Profile) {
        let first = profile.phases.len();
        for ((cell, bounds), b) in cells.iter().zip(&self.bounds).zip(self.nodes.windows(2)) {
            bounds.phases(cell, b[0], b[1], &mut profile.phases, &mut profile.limiting);
        }
        profile.duration += profile.phases[first..].iter().map(|phase| phase.duration).sum::<f64>();
    }
}
