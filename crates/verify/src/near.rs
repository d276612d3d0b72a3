//! Bounds of the distance from a run to the drawing.
//!
//! The distance from a point to one straight piece is convex along a run, so over the whole run it
//! is at most its larger value at the ends. Where different pieces are nearest to the two ends (at
//! corners of the drawing) the run is halved until the bound is tight. Nothing is sampled.

use std::ops::Range;

use drawing::{Point, distance};

use crate::target::PenTarget;

/// A bound is tight enough if it exceeds the value at the ends by this share of the tolerance, or
/// by this share of itself.
const TIGHT: (f64, f64) = (1.0 / 200.0, 1.0 / 16.0);
/// The same share of the tolerance where the bound would be the new maximum.
const TIGHTEST: f64 = 1.0 / 5000.0;
/// Largest number of halvings of a run.
pub(crate) const HALVINGS: u32 = 24;

/// A piece that may be the nearest one somewhere on a run or on a part of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) index: u32,
    /// The distances of the part's start, middle and end from the piece, mm, once they are known.
    pub(crate) at: [f64; 3],
}

impl Candidate {
    pub(crate) fn new(index: u32) -> Self {
        Self { index, at: [f64::NAN; 3] }
    }

    /// Lower bound of the distance between two points that are `length` apart, at which the distances are
    /// those of `at` with these indices: distances are 1-Lipschitz. NaN while they are not known.
    pub(crate) fn at_least(&self, [from, end]: [usize; 2], length: f64) -> f64 {
        0.5 * (self.at[from] + self.at[end] - length)
    }
}

/// The pieces near a run.
pub(crate) struct Near<'a> {
    pub(crate) strokes: &'a PenTarget,
    /// All pieces within `radius` of the run; behind them, those that matter for a part of it.
    pub(crate) candidates: &'a mut Vec<Candidate>,
    pub(crate) radius: f64,
    pub(crate) tolerance: f64,
    /// Bounds up to this value may be loose.
    pub(crate) largest: f64,
}

impl Near<'_> {
    /// Passes bounds of the distance between two points of the run to `to`: a bound at either end
    /// (between them the distance is below the linear interpolation) and the length they hold for.
    ///
    /// `ends` are the two points with their distances, `common` the distances of both points from
    /// one piece, `among` the candidates; `known` says which of their distances are those of the points.
    pub(crate) fn bound(
        &mut self,
        among: Range<usize>,
        known: [usize; 2],
        ends: [(Point, f64); 2],
        common: [f64; 2],
        halvings: u32,
        to: &mut impl FnMut([f64; 2], f64),
    ) {
        let [(from, at_from), (end, at_end)] = ends;
        let length = distance(from, end);
        // The distance is 1-Lipschitz along the run: an upper bound between the ends.
        let rise = 0.5 * (at_from + at_end + length);
        let common = better(common, [rise, rise]);
        let bound = common[0].max(common[1]);
        let slack = if bound <= self.largest {
            (TIGHT.0 * self.tolerance).max(TIGHT.1 * bound)
        } else {
            TIGHTEST * self.tolerance
        };
        if bound <= at_from.max(at_end) + slack || halvings == 0 {
            to(common, length);
            return;
        }
        let middle = from.midpoint(end);
        let first = self.candidates.len();
        let mut nearest = f64::INFINITY;
        for candidate in among {
            let Candidate { index, at } = self.candidates[candidate];
            let piece = &self.strokes.pieces[index as usize];
            let here = piece.distance(piece.local(middle));
            nearest = nearest.min(here);
            self.candidates.push(Candidate { index, at: [at[known[0]], here, at[known[1]]] });
        }
        if nearest > self.radius {
            let (here, index) = self.strokes.nearest(middle);
            nearest = here;
            let [at_from, at_end] = self.strokes.pieces[index as usize].distances([from, end]);
            self.candidates.push(Candidate { index, at: [at_from, here, at_end] });
        }
        let mut halves = [[f64::INFINITY; 2]; 2];
        for Candidate { at: [at_from, here, at_end], .. } in &self.candidates[first..] {
            halves = [better(halves[0], [*at_from, *here]), better(halves[1], [*here, *at_end])];
        }
        // Those that may be nearer than the best bound on either half.
        let most = halves.map(|[at_start, at_end]| at_start.max(at_end));
        let mut kept = first;
        for index in first..self.candidates.len() {
            let candidate = self.candidates[index];
            if candidate.at_least([0, 1], 0.5 * length) <= most[0]
                || candidate.at_least([1, 2], 0.5 * length) <= most[1]
            {
                self.candidates[kept] = candidate;
                kept += 1;
            }
        }
        self.candidates.truncate(kept);
        self.bound(first..kept, [0, 1], [ends[0], (middle, nearest)], halves[0], halvings - 1, to);
        self.bound(first..kept, [1, 2], [(middle, nearest), ends[1]], halves[1], halvings - 1, to);
        self.candidates.truncate(first);
    }
}

/// The pair with the smaller maximum.
pub(crate) fn better(known: [f64; 2], new: [f64; 2]) -> [f64; 2] {
    if new[0].max(new[1]) < known[0].max(known[1]) { new } else { known }
}
