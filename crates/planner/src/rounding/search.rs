//! The cheapest sequence of candidates, row by row.

use std::collections::VecDeque;

use drawing::Point;

use super::{
    Ticks,
    bounds::{Bounds, Differences},
    curve::{Curve, Foot},
};
use crate::trajectory::ExactRow;

/// Largest number of candidates of a row.
pub(super) const CANDIDATES: usize = 6;

/// A choice is final once this number of rows after it has been searched.
const WINDOW: usize = 24;

/// Number of rows that are decided together.
const BLOCK: usize = 8;

/// The weights of the cost, see the documentation of [`super`].
const FAR: f64 = 200.0;
const LENGTH: f64 = 0.3;
const ROUGHNESS: f64 = 0.01;
const TIMING: f64 = 0.01;

/// Whole ticks that a row may take.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) ticks: Ticks,
    pub(super) point: Point,
    pub(super) foot: Foot,
    /// Squared distance from the exact position, ticks².
    pub(super) off: f64,
}

impl Candidate {
    /// Of a row without a choice, with the pen up.
    pub(super) fn travel(ticks: Ticks) -> Self {
        Self { ticks, point: Point::ZERO, foot: Foot::default(), off: 0.0 }
    }
}

/// The cheapest way to one candidate of the last row.
#[derive(Clone, Copy, Debug)]
struct State {
    candidate: Candidate,
    /// The differences that end at it.
    differences: Differences,
    cost: f64,
    /// The state before it, in the column before.
    back: u8,
}

/// The choices of one row that is not decided yet.
#[derive(Clone, Debug)]
struct Column {
    row: ExactRow,
    /// Ticks of each candidate that a state stands at, and the state before it.
    choices: [(Ticks, u8); CANDIDATES],
}

/// A row for the search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    /// The row; `None` for a period of rest that has no row.
    pub(super) row: Option<ExactRow>,
    /// Bounds of the differences that end here and at the next three rows.
    pub(super) bounds: [Bounds; 4],
    /// The safe ticks of the next three rows.
    pub(super) next: [Ticks; 3],
    /// The curve that is drawn on the way here; `None` while the pen is up.
    pub(super) curve: Option<&'a Curve>,
    /// Mean square of the pen's movement for one tick, mm².
    pub(super) tick_mm2: f64,
}

/// The search over all rows of a plan.
#[derive(Clone, Debug, Default)]
pub(super) struct Search {
    states: Vec<State>,
    /// Working memory.
    next: Vec<Option<State>>,
    /// The rows that are not decided. The states belong to the last one.
    columns: VecDeque<Column>,
    /// Decided rows.
    decided: VecDeque<ExactRow>,
}

impl Search {
    /// Takes a decided row.
    pub(super) fn take(&mut self) -> Option<ExactRow> {
        self.decided.pop_front()
    }

    /// Adds a row that takes one of the candidates. The first one is the safe one.
    pub(super) fn add(&mut self, place: &Place<'_>, candidates: &[Candidate]) {
        self.next.clear();
        self.next.resize(candidates.len(), None);
        if self.states.is_empty() {
            // The motors rest before the first row.
            let rest = candidates.first().map(|candidate| State {
                candidate: *candidate,
                differences: Differences::default(),
                cost: 0.0,
                back: 0,
            });
            self.states.extend(rest);
        }
        let edges = Edges::new(place);
        for (back, from) in (0_u8..).zip(&self.states) {
            for (candidate, known) in candidates.iter().zip(&mut self.next) {
                let differences = from.differences.step(from.candidate.ticks, candidate.ticks);
                let rough = edges.roughness(&differences);
                let before = from.cost + rough + edges.timing(candidate);
                let least = known.as_ref().map_or(f64::INFINITY, |known| known.cost);
                let edge = edges.start(&from.candidate, candidate);
                if before + edge.least >= least || !may_follow(&differences, candidate.ticks, place) {
                    continue;
                }
                let cost = before + edges.cost(&edge, &from.candidate, candidate);
                if cost < least || known.is_none() {
                    *known = Some(State { candidate: *candidate, differences, cost, back });
                }
            }
        }
        let last = self.states.first().copied();
        self.states.clear();
        self.states.extend(self.next.iter().flatten());
        if let (true, Some(from), Some(safe)) = (self.states.is_empty(), last, candidates.first()) {
            // Not reached: the safe candidate may follow every state.
            debug_assert!(false, "no candidate may follow");
            let differences = from.differences.step(from.candidate.ticks, safe.ticks);
            self.states.push(State { candidate: *safe, differences, cost: from.cost, back: 0 });
        }
        // Cheap ones first: they make most of the others needless.
        self.sort();
        self.record(place.row);
    }

    /// The next row is the first of another curve, which starts here.
    pub(super) fn restart(&mut self) {
        for state in &mut self.states {
            state.candidate.foot = Foot { s: 0.0, chord: 0, ..state.candidate.foot };
        }
    }

    /// Insertion sort, stable.
    fn sort(&mut self) {
        for end in 1..self.states.len() {
            let mut at = end;
            while at > 0 && self.states[at].cost < self.states[at - 1].cost {
                self.states.swap(at, at - 1);
                at -= 1;
            }
        }
    }

    /// Records the choices of a row, and decides rows that are far enough back.
    fn record(&mut self, row: Option<ExactRow>) {
        let mut choices = [([0; 2], 0); CANDIDATES];
        match row {
            Some(row) => {
                for (choice, state) in choices.iter_mut().zip(&self.states) {
                    *choice = (state.candidate.ticks, state.back);
                }
                self.columns.push_back(Column { row, choices });
            }
            // Without a row of its own: its one state stands for one of the row before.
            None => {
                if let Some(last) = self.columns.back_mut() {
                    let old = last.choices;
                    for (choice, state) in last.choices.iter_mut().zip(&self.states) {
                        *choice = old[usize::from(state.back)];
                    }
                }
            }
        }
        if self.states.len() == 1 {
            self.decide(self.columns.len());
        } else if self.columns.len() >= WINDOW + BLOCK {
            self.decide(BLOCK);
        }
    }

    /// Decides the first `count` rows as the cheapest state has them, and drops the states that differ.
    fn decide(&mut self, count: usize) {
        let Self { states, columns, decided, .. } = self;
        let trace = |columns: &VecDeque<Column>, state: usize| {
            let undecided = columns.range(count..).rev();
            undecided.fold(state, |state, column| usize::from(column.choices[state].1))
        };
        let chosen = trace(columns, 0);
        let mut kept = 0;
        for index in 0..states.len() {
            if trace(columns, index) != chosen {
                continue;
            }
            states.swap(kept, index);
            if let Some(last) = columns.back_mut() {
                last.choices[kept] = last.choices[index];
            }
            kept += 1;
        }
        states.truncate(kept);
        let mut state = chosen;
        for column in columns.range_mut(..count).rev() {
            let (ticks, back) = column.choices[state];
            column.row.row.ticks = ticks;
            state = usize::from(back);
        }
        decided.extend(columns.drain(..count).map(|column| column.row));
        let base = states.first().map_or(0.0, |state| state.cost);
        for state in states {
            state.cost -= base;
        }
    }
}

/// Whether candidate ticks with these differences keep the bounds, and leave the safe ticks of the next
/// rows within theirs.
fn may_follow(differences: &Differences, ticks: Ticks, place: &Place<'_>) -> bool {
    let (mut here, mut at) = (*differences, ticks);
    if !here.within(&place.bounds[0]) {
        return false;
    }
    for (next, bounds) in place.next.iter().zip(&place.bounds[1..]) {
        here = here.step(at, *next);
        at = *next;
        if !here.within(bounds) {
            return false;
        }
    }
    true
}

/// The costs of ink that leads to one row.
struct Edges<'a> {
    curve: Option<&'a Curve>,
    /// `h²` and `h³`.
    square: f64,
    cube: f64,
    /// `FAR / h⁴`.
    far: f64,
}

/// An edge before its distance from the curve is known.
struct Edge {
    length: f64,
    along: f64,
    /// Lower bound of its cost.
    least: f64,
}

impl<'a> Edges<'a> {
    fn new(place: &Place<'a>) -> Self {
        let square = place.tick_mm2;
        let far = FAR / (square * square).max(f64::MIN_POSITIVE);
        Self { curve: place.curve, square, cube: square * square.sqrt(), far }
    }

    /// `g(d) = d² (1 + FAR (d / h)⁴)` of the squared distance.
    fn weigh(&self, square: f64) -> f64 {
        square * (1.0 + self.far * square * square)
    }

    fn roughness(&self, differences: &Differences) -> f64 {
        if self.curve.is_none() {
            return 0.0;
        }
        let [a, b] = differences.second.map(|second| second as f64);
        ROUGHNESS * self.cube * (a * a + b * b)
    }

    fn timing(&self, candidate: &Candidate) -> f64 {
        if self.curve.is_none() { 0.0 } else { TIMING * self.cube * candidate.off }
    }

    fn start(&self, from: &Candidate, to: &Candidate) -> Edge {
        if self.curve.is_none() {
            return Edge { length: 0.0, along: 0.0, least: 0.0 };
        }
        let length = (to.point - from.point).hypot2().sqrt();
        let along = to.foot.s - from.foot.s;
        let ends = self.ends(from, to);
        let least = length.max(along.abs()) * ends / 12.0 + LENGTH * self.square * (length - along);
        Edge { length, along, least }
    }

    fn ends(&self, from: &Candidate, to: &Candidate) -> f64 {
        let [a, b] = [from, to].map(|end| end.foot.distance * end.foot.distance);
        self.weigh(a) + self.weigh(b)
    }

    /// Simpson's rule over two halves.
    fn cost(&self, edge: &Edge, from: &Candidate, to: &Candidate) -> f64 {
        let Some(curve) = self.curve else { return 0.0 };
        let between = curve.between([from.point, to.point], [&from.foot, &to.foot]);
        let [quarter, half, last] = between.map(|square| self.weigh(square));
        let mean = (self.ends(from, to) + 4.0 * (quarter + last) + 2.0 * half) / 12.0;
        edge.length.max(edge.along.abs()) * mean + LENGTH * self.square * (edge.length - edge.along)
    }
}
