//! Initial tours: nearest neighbour and greedy edge.

use super::problem::{End, Problem, mate};
use super::tree::Tree;
use crate::progress::Progress;

const UNLINKED: End = End::MAX;

/// Strokes from one report of progress to the next.
const STROKES_BETWEEN_REPORTS: usize = 1024;

/// Search trees for partners of an end: all ends, or ends of the other parity if strokes may not be
/// reversed.
pub(crate) struct Partners {
    trees: Vec<Tree>,
    one_way: bool,
}

impl Partners {
    pub(crate) fn new(problem: &Problem, ends: &[End]) -> Self {
        let of_parity =
            |parity| Tree::new(problem, ends.iter().copied().filter(move |&end| end % 2 == parity));
        let trees = if problem.one_way {
            vec![of_parity(1), of_parity(0)]
        } else {
            vec![Tree::new(problem, ends.iter().copied())]
        };
        Self { trees, one_way: problem.one_way }
    }

    pub(crate) fn of(&self, end: End) -> &Tree {
        &self.trees[if self.one_way { end as usize % 2 } else { 0 }]
    }

    fn remove(&mut self, end: End) {
        for tree in &mut self.trees {
            tree.remove(end);
        }
    }
}

/// From the depot, always to the nearest end (in the plane) of an undrawn stroke. Best on hatches.
///
/// If the start is free, the tour starts with the first stroke of the file.
pub(crate) fn nearest_neighbour(problem: &Problem, progress: Progress<'_>) -> Vec<End> {
    let ends: Vec<End> = (2..problem.end_count() as End).collect();
    let mut partners = Partners::new(problem, &ends);
    let mut tour = Vec::with_capacity(problem.stroke_count());
    tour.push(0);
    let mut found = Vec::with_capacity(1);
    while tour.len() < problem.stroke_count() {
        if tour.len().is_multiple_of(STROKES_BETWEEN_REPORTS) {
            progress.done(tour.len() as f64 / problem.stroke_count() as f64);
        }
        let from = mate(tour[tour.len() - 1]);
        let entry = if problem.is_placed(from) {
            partners.of(from).nearest(problem.point(from), 1, [from; 2], &mut found);
            found.first().map(|&(_, end)| end)
        } else {
            Some(2)
        };
        let Some(entry) = entry else { break };
        tour.push(entry);
        partners.remove(entry);
        partners.remove(mate(entry));
    }
    tour
}

/// Takes the cheapest links first, if they close no cycle. Best on lettering and scattered strokes.
///
/// Candidates are the nearest ends in the plane. Linked strokes become one fragment; the open ends
/// of the fragments are the points of the next round, until one fragment is left. Every round
/// accepts at least the cheapest candidate.
pub(crate) fn greedy_edge(problem: &Problem, progress: Progress<'_>) -> Vec<End> {
    const CANDIDATES: usize = 6;
    let count = problem.end_count() as End;
    let mut link = vec![UNLINKED; count as usize];
    // For each open end the other end of its fragment.
    let mut opposite: Vec<End> = (0..count).map(mate).collect();
    let mut found = Vec::with_capacity(CANDIDATES);
    loop {
        let open: Vec<End> = (0..count).filter(|&end| link[end as usize] == UNLINKED).collect();
        progress.done(1.0 - open.len() as f64 / f64::from(count));
        let partners = Partners::new(problem, &open);
        let mut moves: Vec<(f64, End, End)> = Vec::with_capacity(open.len() * CANDIDATES);
        for &end in open.iter().filter(|&&end| problem.is_placed(end)) {
            let but = [end, opposite[end as usize]];
            partners.of(end).nearest(problem.point(end), CANDIDATES, but, &mut found);
            moves.extend(found.iter().map(|&(_, to)| (problem.cost(end, to), end.min(to), end.max(to))));
        }
        moves.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut joined = false;
        for (_, a, b) in moves {
            let (a_at, b_at) = (a as usize, b as usize);
            if link[a_at] == UNLINKED && link[b_at] == UNLINKED && opposite[a_at] != b {
                (link[a_at], link[b_at]) = (b, a);
                let (a_far, b_far) = (opposite[a_at], opposite[b_at]);
                (opposite[a_far as usize], opposite[b_far as usize]) = (b_far, a_far);
                joined = true;
            }
        }
        if !joined {
            return close(problem, &mut link, &opposite);
        }
    }
}

/// Closes the fragments to a tour: one fragment, or two if the depot is not placed and was never
/// linked.
fn close(problem: &Problem, link: &mut [End], opposite: &[End]) -> Vec<End> {
    let open: Vec<End> = (0..link.len() as End).filter(|&end| link[end as usize] == UNLINKED).collect();
    // `one_way`: the last fragment begins with an even end and ends with an odd one, like the
    // depot.
    if let Some(&first) = open.iter().find(|&&end| end > 1 && (!problem.one_way || end % 2 == 0)) {
        let last = opposite[first as usize];
        let (leave, arrive) = if last < 2 || open.len() == 2 { (last, first) } else { (1, first) };
        (link[leave as usize], link[arrive as usize]) = (arrive, leave);
        if open.len() > 2 {
            (link[last as usize], link[0]) = (0, last);
        }
    }
    let mut tour = vec![0];
    while tour.len() < problem.stroke_count() {
        let entry = link[mate(tour[tour.len() - 1]) as usize];
        if entry == UNLINKED || entry < 2 {
            break;
        }
        tour.push(entry);
    }
    tour
}
