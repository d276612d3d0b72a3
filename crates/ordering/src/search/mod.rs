//! The search for a short tour.

mod construct;
mod problem;
mod tree;

pub(crate) use problem::{End, Problem};

/// The best tour found from several starts, the file's own order among them: never worse than that.
pub(crate) fn solve(problem: &Problem, _effort: u8) -> Vec<End> {
    let mut best = problem.file_order();
    let mut best_cost = problem.tour_cost(&best);
    for construct in [construct::nearest_neighbour, construct::greedy_edge] {
        let tour = construct(problem);
        let cost = problem.tour_cost(&tour);
        if tour.len() == best.len() && cost < best_cost {
            (best, best_cost) = (tour, cost);
        }
    }
    problem.canonical(&mut best);
    best
}
