//! Contraction: runs of strokes of a tour become single strokes of a smaller problem.

use super::problem::{End, Problem, mate};

/// A problem whose strokes are runs of strokes of a tour of another problem.
pub(crate) struct Contracted<'p> {
    pub(crate) problem: Problem<'p>,
    parent: &'p Problem<'p>,
    /// The tour that was cut into runs. It begins with the depot, which is a run of its own.
    tour: Vec<End>,
    /// Run `r` is `tour[begin[r]..begin[r + 1]]`.
    begin: Vec<usize>,
}

impl<'p> Contracted<'p> {
    /// Contracts the cheapest `contracted` per mille of the links of a tour that begins with the
    /// depot.
    pub(crate) fn new(parent: &'p Problem<'p>, tour: Vec<End>, contracted: usize) -> Self {
        let costs: Vec<f64> = tour.windows(2).map(|pair| parent.cost(mate(pair[0]), pair[1])).collect();
        let mut sorted = costs.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let limit = match sorted.len() * contracted / 1000 {
            0 => f64::NEG_INFINITY,
            count => sorted[count - 1],
        };
        let mut begin = vec![0];
        begin.extend((1..tour.len()).filter(|&place| place == 1 || costs[place - 1] > limit));
        begin.push(tour.len());
        let ends = |run: &[usize]| [tour[run[0]], mate(tour[run[1] - 1])].map(|end| parent.point(end));
        let problem = parent.with_strokes(begin[1..].windows(2).map(ends));
        Self { problem, parent, tour, begin }
    }

    /// Reverses every stroke of a run, and returns the increase of the run's inner cost.
    ///
    /// A hatch drawn back and forth then costs the same, but begins and ends at its other corners.
    pub(crate) fn mirror(&mut self, run: usize) -> f64 {
        let inner = |strokes: &[End]| -> f64 {
            strokes.windows(2).map(|pair| self.parent.cost(mate(pair[0]), pair[1])).sum()
        };
        let strokes = &mut self.tour[self.begin[run]..self.begin[run + 1]];
        let before = inner(strokes);
        for entry in strokes.iter_mut() {
            *entry = mate(*entry);
        }
        let ends = [strokes[0], mate(strokes[strokes.len() - 1])];
        self.problem.set_ends(run, ends.map(|end| self.parent.point(end)));
        inner(strokes) - before
    }

    /// Whether a run has more than one stroke.
    pub(crate) fn is_contracted(&self, run: usize) -> bool {
        self.begin[run + 1] - self.begin[run] > 1
    }

    /// The tour of the parent's strokes for a tour of the runs.
    pub(crate) fn expand(&self, tour: &[End]) -> Vec<End> {
        let mut strokes = Vec::with_capacity(self.tour.len());
        for &entry in tour {
            let run = entry as usize / 2;
            let run = &self.tour[self.begin[run]..self.begin[run + 1]];
            if entry % 2 == 0 {
                strokes.extend_from_slice(run);
            } else {
                strokes.extend(run.iter().rev().map(|&end| mate(end)));
            }
        }
        strokes
    }
}
