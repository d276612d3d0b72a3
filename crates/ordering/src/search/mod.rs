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

/// How many links of a thousand are glued, cheapest first, for the problems above the strokes themselves.
const LEVELS: [usize; 4] = [500, 750, 900, 950];

/// Up to this many strokes, the search is done from every start, and shares the work.
const SEVERAL_STARTS: usize = 3000;

/// The best tour found from several starts, the file's own order among them: never worse than that.
pub(crate) fn solve(problem: &Problem, effort: u8) -> Vec<End> {
    let starts =
        [problem.file_order(), construct::nearest_neighbour(problem), construct::greedy_edge(problem)];
    let mut best = Best::new(problem, starts[0].clone());
    let n = problem.stroke_count();
    let work = work_of(n, effort);
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
    let default = 50_000 * n.min(1000) + 4500 * n;
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

/// Improves a tour, on the strokes themselves with nine parts of the work in ten, then on all levels.
///
/// Gluing what is near (multilevel refinement, Walshaw 2002) is what finds the way from hatch to hatch: the right
/// partner of an end at the edge of a hatch is never among the nearest, which all are of the same hatch.
fn improve(problem: &Problem, tour: Vec<End>, work: u64) -> Vec<End> {
    let mut random = Random::new();
    let mut best = Best::new(problem, tour);
    let mut search = Search::new(problem, best.tour.clone());
    search.descend();
    search.kick(work / 10 * 9, &mut random);
    best.offer(search.finish());
    for glued in LEVELS {
        let mut level = Contracted::new(problem, best.tour.clone(), glued);
        let mut search = Search::new(&level.problem, level.problem.file_order());
        search.descend();
        search.kick(work / 20 / LEVELS.len() as u64, &mut random);
        let mut tour = search.finish();
        if glued == LEVELS[LEVELS.len() - 1] && !problem.one_way {
            tour = mirror(&mut level, tour, work / 20, &mut random);
        }
        let mut tour = level.expand(&tour);
        orient(problem, &mut tour);
        best.offer(tour);
    }
    let mut search = Search::new(problem, best.tour.clone());
    search.descend();
    best.offer(search.finish());
    best.tour
}

/// Mirrors one run after another, and keeps what is better when the order of the runs has adapted to it.
fn mirror(level: &mut Contracted, tour: Vec<End>, work: u64, random: &mut Random) -> Vec<End> {
    let runs = level.problem.stroke_count();
    let glued: Vec<usize> = (1..runs).filter(|&run| level.is_glued(run)).collect();
    let mut best = tour;
    let mut done = 0;
    while done < work && !glued.is_empty() {
        let run = glued[random.below(glued.len())];
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
