//! The search for a short tour.

mod construct;
mod contract;
mod improve;
mod orient;
mod problem;
mod random;
mod tour;
mod tree;

use contract::Contracted;
use improve::Search;
use orient::orient;
pub(crate) use problem::{End, Problem};
use random::Random;

/// The levels of the search: how many links of a thousand are contracted, cheapest first, and how many parts of the work
/// in a thousand are done on what is left. Nothing contracted is not nothing done: strokes that are near then have numbers
/// that are near, and what is looked at together is together in memory.
const LEVELS: [(usize, u64); 6] = [(0, 900), (500, 13), (750, 13), (900, 12), (950, 12), (0, 0)];

/// The level whose runs are mirrored, and with how many parts of the work in a thousand.
const MIRRORED: (usize, u64) = (950, 50);

/// Up to this many strokes, the search is done from every start, and shares the work.
const SEVERAL_STARTS: usize = 3000;

/// The best tour found from several starts, the file's own order among them: never worse than that.
pub(crate) fn solve(problem: &Problem, (effort, all): (u8, usize)) -> Vec<End> {
    let starts =
        [problem.file_order(), construct::nearest_neighbour(problem), construct::greedy_edge(problem)];
    let mut best = Best::new(problem, starts[0].clone());
    let n = problem.stroke_count();
    // Several pens share the work of one drawing.
    let work = (u128::from(work_of(all, effort)) * n as u128 / all.max(n) as u128) as u64;
    if n <= SEVERAL_STARTS {
        for start in &starts[1..] {
            best.offer(improve(problem, start.clone(), work / 2));
        }
    } else {
        for start in &starts[1..] {
            best.offer(start.clone());
        }
        let start = best.tour.clone();
        best.offer(improve(problem, start, work));
    }
    Problem::canonical(&mut best.tour);
    best.tour
}

/// How many candidates may be looked at.
fn work_of(strokes: usize, effort: u8) -> u64 {
    let n = strokes as u64;
    let default = 50_000 * n.min(1000) + 4500 * n.min(10_000) + 600 * n;
    match effort {
        0 => 0,
        1 => default / 8,
        2 => default,
        _ => default * 8,
    }
}

/// A tour, and the best of those it was compared with.
struct Best<'p> {
    problem: &'p Problem<'p>,
    tour: Vec<End>,
    cost: f64,
}

impl<'p> Best<'p> {
    fn new(problem: &'p Problem<'p>, tour: Vec<End>) -> Self {
        let cost = problem.tour_cost(&tour);
        Self { problem, tour, cost }
    }

    fn offer(&mut self, tour: Vec<End>) {
        let cost = self.problem.tour_cost(&tour);
        if cost < self.cost && tour.len() == self.tour.len() {
            (self.tour, self.cost) = (tour, cost);
        }
    }
}

/// Improves a tour on one level after another, most of all on the strokes themselves.
///
/// Gluing what is near (multilevel refinement, Walshaw 2002) is what finds the way from hatch to hatch: the right
/// partner of an end at the edge of a hatch is never among the nearest, which all are of the same hatch.
fn improve(problem: &Problem, tour: Vec<End>, work: u64) -> Vec<End> {
    let mut random = Random::new();
    let mut best = Best::new(problem, tour);
    for (contracted, share) in LEVELS {
        let mut level = Contracted::new(problem, best.tour.clone(), contracted);
        let mut search = Search::new(&level.problem, level.problem.file_order());
        search.descend();
        search.kick(work / 1000 * share, &mut random);
        let mut tour = search.finish();
        if contracted == MIRRORED.0 && !problem.one_way {
            tour = mirror(&mut level, tour, work / 1000 * MIRRORED.1, &mut random);
        }
        let mut tour = level.expand(&tour);
        orient(problem, &mut tour);
        best.offer(tour);
    }
    best.tour
}

/// Mirrors one run after another, and keeps what is better when the order of the runs has adapted to it.
fn mirror(level: &mut Contracted, tour: Vec<End>, work: u64, random: &mut Random) -> Vec<End> {
    let runs = level.problem.stroke_count();
    let contracted: Vec<usize> = (1..runs).filter(|&run| level.is_contracted(run)).collect();
    let mut best = tour;
    let mut done = 0;
    while done < work && !contracted.is_empty() {
        let run = contracted[random.below(contracted.len())];
        let before = level.problem.tour_cost(&best);
        let dearer = level.mirror(run);
        let mut search = Search::new(&level.problem, best.clone());
        search.descend();
        search.kick(20 * runs as u64, random);
        done += search.work();
        let tour = search.finish();
        if level.problem.tour_cost(&tour) + dearer <= before {
            best = tour;
        } else {
            level.mirror(run);
        }
    }
    best
}
