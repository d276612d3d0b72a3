//! The choice of whole ticks along the path.
//!
//! A motor takes whole ticks only. Rounding each motor to the nearest one scatters the rows about the
//! path, and the pen draws a zigzag through them. Here a row may take any ticks within 1.5 of its
//! exact position, and the search takes those whose polyline in the plane of the pen is nearest to
//! the path. Equations, figures and measurements: docs/rounding.md.
//!
//! With `h` the root mean square of the pen's movement for one tick of a motor, `P_c` the pen
//! position of the candidate `c`, `s_c` the arc length of its foot on the path, `e` its ticks less
//! the exact ones, and `d(f)` the distance between the points at the share `f` of the edge and of
//! the path between the feet, the search minimizes the sum over all rows of
//!
//! ```text
//! max(l, |ds|) mean of g(d(f)) + 0.3 h² (l - ds)               b -> c:  l = |P_c - P_b|, ds = s_c - s_b
//!   + 0.01 h³ Σ (second differences)² + 0.01 h³ |e|²           g(d) = d² (1 + 200 (d / h)⁴)
//! ```
//!
//! The first term is the deviation, counted both ways because points are matched by arc length; the
//! second is ink that is longer than the path; the last two keep the motion smooth and on time.
//!
//! **Limits.** Each row has safe ticks: the nearest ones, or at a rest those nearest to the path. Rows
//! of safe ticks keep the bounds on their differences ([`bounds`]). A candidate is allowed only if
//! the differences up to the safe ticks of the next three rows keep them too. Then those are allowed
//! after it, so that there is always a way on, whatever the search has dropped.
//!
//! The search keeps the cheapest way to each candidate of a row and decides a row when it is `WINDOW`
//! rows old: memory is constant, and rows do not depend on the number of threads.

mod bounds;
mod choices;
mod curve;
mod search;

use std::collections::VecDeque;

use drawing::{Point, Vec2};
use kinematics::{JointPos, Machine, MotorPos};

pub(crate) use self::choices::Choices;
use self::{
    bounds::{Bounds, Differences},
    curve::Curve,
    search::{CANDIDATES, Candidate, Place, Search},
};
use crate::trajectory::{ExactRow, Sample};

/// Positions of both motors.
type Ticks = [i64; 2];

/// Number of rows that are known ahead of the one that is searched.
const AHEAD: usize = 64;

/// A rest of more rows than this is divided.
const LONGEST_REST: usize = 24;

/// Largest distance of a row from its exact position, ticks.
const FARTHEST: f64 = 1.5;

/// Largest distance of a candidate from the path, as a share of the distance that rounding to the
/// nearest ticks can have.
const NEAR_PATH: f64 = 0.8;

/// Largest distance of a candidate's foot from its row along the path, in `h`.
const REACH: f64 = 2.5;

/// The pen's movement about a row.
#[derive(Clone, Copy, Debug)]
struct Geometry {
    pose: JointPos,
    point: Point,
    /// The pen's movement for one tick of each motor, mm.
    columns: [Vec2; 2],
    /// Mean of their squares: `h²`.
    tick_mm2: f64,
}

impl Geometry {
    fn at(&self, off: [f64; 2]) -> Point {
        self.point + off[0] * self.columns[0] + off[1] * self.columns[1]
    }

    /// The pen's distance from the path at the worse corner of half a tick.
    fn half_tick_mm(&self) -> f64 {
        let [a, b] = self.columns;
        0.5 * (a + b).hypot2().max((a - b).hypot2()).sqrt()
    }
}

/// A row that waits for the search.
#[derive(Clone, Copy, Debug)]
struct Step {
    row: ExactRow,
    /// Whether it is a row of the plan, not a period of a rest between two rows.
    is_row: bool,
    /// Ticks that are always allowed.
    safe: Ticks,
    /// Bounds of the differences that end here.
    bounds: Bounds,
    /// Whether it may take other ticks than the safe ones.
    is_free: bool,
    /// The curve that is drawn on the way here, and the one that is drawn from here.
    drawn: Option<usize>,
    draws: Option<usize>,
    /// Arc length on the curve drawn on the way here, mm.
    s: f64,
    /// Where the pen draws.
    geometry: Option<Geometry>,
}

impl Step {
    /// Whether the motors stand still from one to the other.
    fn is_at(&self, other: &Self) -> bool {
        (0..2).all(|motor: usize| (self.row.exact[motor] - other.row.exact[motor]).abs() < 1e-6)
    }
}

/// Chooses the ticks of the rows of a plan, as a stream.
#[derive(Clone, Debug)]
pub(crate) struct AlongPath<'a> {
    machine: &'a Machine,
    period_us: u64,
    bounds: Bounds,
    /// Joint displacement of one tick of each motor.
    tick: [JointPos; 2],
    steps: VecDeque<Step>,
    /// How many of them have their final safe ticks.
    safe: usize,
    /// The last of those that were final, and the differences that end there.
    last_safe: Option<Step>,
    differences: Differences,
    /// The curves of strokes that are not finished yet, the number of the first, and that of the next.
    curves: VecDeque<Curve>,
    first_curve: usize,
    next_curve: usize,
    candidates: Vec<Candidate>,
    search: Search,
    /// The last row that came in.
    last: Option<Step>,
    ended: bool,
}

impl<'a> AlongPath<'a> {
    pub(crate) fn new(machine: &'a Machine, period_us: u64) -> Self {
        Self {
            machine,
            period_us,
            bounds: Bounds::of(machine, period_us),
            tick: [MotorPos::new(1.0, 0.0), MotorPos::new(0.0, 1.0)].map(|tick| machine.joint_rates(&tick)),
            steps: VecDeque::new(),
            safe: 0,
            last_safe: None,
            differences: Differences::default(),
            curves: VecDeque::new(),
            first_curve: 0,
            next_curve: 0,
            candidates: Vec::new(),
            search: Search::default(),
            last: None,
            ended: false,
        }
    }

    /// The next row of the plan, from its samples.
    pub(crate) fn next(&mut self, samples: &mut impl Iterator<Item = Sample>) -> Option<ExactRow> {
        loop {
            if let Some(row) = self.search.take() {
                return Some(row);
            }
            while self.steps.len() <= AHEAD && !self.ended {
                match samples.next() {
                    Some(sample) => self.sample(&sample),
                    None => self.end(),
                }
            }
            if self.steps.is_empty() {
                return None;
            }
            while self.safe < self.steps.len().min(4) {
                self.make_safe();
            }
            self.search();
        }
    }

    /// Adds the row, after the periods of the rest before it.
    fn sample(&mut self, sample: &Sample) {
        if let Some(last) = self.last {
            let since_us = sample.row.row.t_us - last.row.row.t_us;
            let omitted = (since_us / self.period_us.max(1)).saturating_sub(1);
            // More than three periods of rest are like three for a third difference.
            for _ in 0..omitted.min(3) {
                let geometry = last.geometry.filter(|_| last.row.row.pen != 0);
                self.add(Step { is_row: false, geometry, ..last }, true);
            }
        }
        let ExactRow { row, .. } = sample.row;
        let inks = row.pen != 0 || self.last.is_some_and(|last| last.row.row.pen != 0);
        let step = Step {
            row: sample.row,
            is_row: true,
            safe: row.ticks,
            bounds: self.bounds,
            is_free: false,
            drawn: None,
            draws: None,
            s: 0.0,
            geometry: inks.then(|| self.geometry(&sample.pose)),
        };
        self.add(step, sample.may_turn);
    }

    /// The motors rest after the last row.
    fn end(&mut self) {
        if let Some(last) = self.last {
            self.add(Step { is_row: false, ..last }, true);
        }
        self.ended = true;
    }

    fn geometry(&self, pose: &JointPos) -> Geometry {
        let mechanism = self.machine.mechanism();
        let jacobian = mechanism.jacobian(pose);
        let columns = self.tick.map(|tick| tick[0] * jacobian[0] + tick[1] * jacobian[1]);
        let tick_mm2 = 0.5 * (columns[0].hypot2() + columns[1].hypot2());
        Geometry { pose: *pose, point: mechanism.forward(pose), columns, tick_mm2 }
    }

    /// Adds a step, and its point to the curves that it ends or starts.
    fn add(&mut self, mut step: Step, may_turn: bool) {
        let pen = step.row.row.pen;
        let (before, drawn) = self.last.map_or((0, None), |last| (last.row.row.pen, last.draws));
        (step.drawn, step.draws) = (drawn, drawn.filter(|_| pen == before));
        step.is_free = step.is_row && pen != 0 && pen == before;
        if let Some(geometry) = step.geometry {
            let tick_mm = geometry.tick_mm2.sqrt();
            if let Some(number) = drawn {
                let curve = &mut self.curves[number - self.first_curve];
                let s = curve.add(geometry.point, may_turn || pen != before, tick_mm);
                if let (Some(last), Some(s)) = (self.steps.back_mut(), s)
                    && last.drawn == drawn
                {
                    last.s = s;
                }
                if pen != before {
                    step.s = curve.finish(tick_mm);
                }
            }
            if pen != before && pen != 0 {
                let mut curve = Curve::default();
                curve.add(geometry.point, true, tick_mm);
                self.curves.push_back(curve);
                step.draws = Some(self.next_curve);
                self.next_curve += 1;
            }
        }
        self.steps.push_back(step);
        self.last = Some(step);
    }

    /// Makes the safe ticks and bounds of the next steps final: one step, or all steps of a rest.
    fn make_safe(&mut self) {
        let first = self.steps[self.safe];
        let count =
            self.steps.range(self.safe..).take(LONGEST_REST).take_while(|step| step.is_at(&first)).count();
        let steps = self.safe..self.safe + count;
        let continues = self.last_safe.is_some_and(|last| last.is_at(&first));
        let before = self.last_safe.map_or(0, |step| step.row.row.pen);
        let pens = self.steps.range(steps.clone()).map(|step| step.row.row.pen);
        // The motors stand still while the pen moves.
        let rests = continues || pens.chain([before]).any(|pen| pen != first.row.row.pen);
        // The start pose is that of the nearest ticks, and a longer rest is not looked through.
        let at_end = self.ended && steps.end == self.steps.len();
        let is_whole = !continues && count < LONGEST_REST && self.last_safe.is_some() && !at_end;
        let ticks = if rests && is_whole { self.rest(steps.clone()) } else { None };
        let count = if rests { count } else { 1 };
        for index in self.safe..self.safe + count {
            let step = &mut self.steps[index];
            step.is_free &= !rests;
            step.safe = ticks.unwrap_or(step.safe);
            let from = self.last_safe.map_or(step.safe, |last| last.safe);
            self.differences = self.differences.step(from, step.safe);
            step.bounds = self.bounds.or(&self.differences);
            self.last_safe = Some(*step);
        }
        self.safe += count;
    }

    /// The ticks nearest to the path for a rest where the pen goes down or up, if the nearest ticks of
    /// the rows around it leave room for them.
    fn rest(&self, steps: std::ops::Range<usize>) -> Option<Ticks> {
        let geometry = self.steps.range(steps.clone()).find_map(|step| step.geometry)?;
        let Step { row: ExactRow { row, exact }, .. } = self.steps[steps.start];
        let mut best: Option<(f64, Ticks)> = None;
        for ticks in around(row.ticks) {
            let off = [0, 1].map(|motor| ticks[motor] as f64 - exact[motor]);
            if off[0].abs() > FARTHEST || off[1].abs() > FARTHEST || !self.allows(&geometry, off) {
                continue;
            }
            let away = (geometry.at(off) - geometry.point).hypot2();
            if best.is_none_or(|(least, _)| away < least) {
                best = Some((away, ticks));
            }
        }
        let (_, ticks) = best.filter(|(_, ticks)| *ticks != row.ticks)?;
        let end = steps.end;
        let mut differences = self.differences;
        let mut from = self.last_safe.map_or(ticks, |last| last.safe);
        for (index, step) in self.steps.range(steps.start..).take(steps.len() + 3).enumerate() {
            let to = if steps.start + index < end { ticks } else { step.safe };
            differences = differences.step(from, to);
            if !differences.within(&self.bounds) {
                return None;
            }
            from = to;
        }
        Some(ticks)
    }

    /// Whether the joints stay within their ranges, which the exact pose does.
    fn allows(&self, geometry: &Geometry, off: [f64; 2]) -> bool {
        let joints = &self.machine.parts().joints;
        let moved = geometry.pose + self.tick[0] * off[0] + self.tick[1] * off[1];
        (0..2).all(|joint| moved[joint] >= joints[joint].min && moved[joint] <= joints[joint].max)
    }

    /// Searches the next step.
    fn search(&mut self) {
        self.find_candidates();
        let Some(step) = self.steps.pop_front() else { return };
        self.safe -= 1;
        let (mut bounds, mut next) = ([step.bounds; 4], [step.safe; 3]);
        for index in 0..3 {
            // After the last row the motors rest.
            let known = self.steps.get(index).filter(|_| index < self.safe);
            next[index] =
                known.map_or(if index == 0 { step.safe } else { next[index - 1] }, |step| step.safe);
            bounds[index + 1] = known.map_or(self.bounds.or(&self.differences), |step| step.bounds);
        }
        let place = Place {
            row: step.is_row.then_some(step.row),
            bounds,
            next,
            curve: step.drawn.map(|number| &self.curves[number - self.first_curve]),
            tick_mm2: step.geometry.map_or(0.0, |geometry| geometry.tick_mm2),
        };
        self.search.add(&place, &self.candidates);
        let Some(number) = step.drawn else { return };
        if step.draws == step.drawn {
            let margin = 2.0 * REACH * place.tick_mm2.sqrt();
            self.curves[number - self.first_curve].forget(step.s - margin);
        } else {
            self.curves.pop_front();
            self.first_curve += 1;
            self.search.restart();
        }
    }

    /// Finds the candidates of the next step: the safe ticks, and those nearest to the path.
    fn find_candidates(&mut self) {
        self.candidates.clear();
        let Some(step) = self.steps.front() else { return };
        let (Some(geometry), Some(number)) = (step.geometry, step.drawn.or(step.draws)) else {
            self.candidates.push(Candidate::travel(step.safe));
            return;
        };
        let curve = &self.curves[number - self.first_curve];
        let reach = REACH * geometry.tick_mm2.sqrt();
        let s = if step.drawn.is_some() { step.s } else { 0.0 };
        let chords = curve.chords(s - reach, s + reach);
        let candidate = |ticks: Ticks| {
            let off = [0, 1].map(|motor| ticks[motor] as f64 - step.row.exact[motor]);
            let point = geometry.at(off);
            let foot = curve.foot(point, s, chords.clone());
            Candidate { ticks, point, foot, off: off[0] * off[0] + off[1] * off[1] }
        };
        self.candidates.push(candidate(step.safe));
        if !step.is_free {
            return;
        }
        let farthest = NEAR_PATH * geometry.half_tick_mm();
        for ticks in around(step.safe).into_iter().filter(|ticks| *ticks != step.safe) {
            let off = [0, 1].map(|motor| ticks[motor] as f64 - step.row.exact[motor]);
            if off[0].abs() > FARTHEST || off[1].abs() > FARTHEST || !self.allows(&geometry, off) {
                continue;
            }
            let candidate = candidate(ticks);
            if candidate.foot.distance <= farthest {
                self.candidates.push(candidate);
            }
        }
        self.candidates[1..].sort_by(|a, b| a.foot.distance.total_cmp(&b.foot.distance));
        self.candidates.truncate(CANDIDATES);
    }
}

/// The nine pairs of ticks around a pair.
fn around([a, b]: Ticks) -> [Ticks; 9] {
    [
        [a - 1, b - 1],
        [a - 1, b],
        [a - 1, b + 1],
        [a, b - 1],
        [a, b],
        [a, b + 1],
        [a + 1, b - 1],
        [a + 1, b],
        [a + 1, b + 1],
    ]
}
