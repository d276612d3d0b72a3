//! Optimal directions of strokes in a fixed order.

use super::problem::{End, Problem, mate};

/// Chooses the direction of each stroke so that the tour, which begins with the depot, has the
/// lowest cost in this order.
///
/// Dynamic programming over the strokes with two states each. It mirrors a whole hatch, drawn back
/// and forth, in one step, where exchanges of links would have to reverse each of its lines.
pub(crate) fn orient(problem: &Problem, tour: &mut [End]) {
    if problem.one_way || tour.len() < 2 {
        return;
    }
    // For each stroke and direction the best direction of the stroke before it.
    let mut before = vec![[false; 2]; tour.len()];
    let mut best = [0.0, f64::INFINITY];
    for place in 1..tour.len() {
        let mut next = [f64::INFINITY; 2];
        for turned in [false, true] {
            let entry = tour[place] ^ End::from(turned);
            for turned_before in [false, true] {
                let leave = mate(tour[place - 1]) ^ End::from(turned_before);
                let cost = best[usize::from(turned_before)];
                if cost == f64::INFINITY {
                    continue;
                }
                let cost = cost + problem.cost(leave, entry);
                if cost < next[usize::from(turned)] {
                    next[usize::from(turned)] = cost;
                    before[place][usize::from(turned)] = turned_before;
                }
            }
        }
        best = next;
    }
    let last = tour[tour.len() - 1];
    let close = |turned| problem.cost(mate(last) ^ End::from(turned), tour[0]);
    let mut turned = best[1] + close(true) < best[0] + close(false);
    for place in (1..tour.len()).rev() {
        let turned_before = before[place][usize::from(turned)];
        tour[place] ^= End::from(turned);
        turned = turned_before;
    }
}
