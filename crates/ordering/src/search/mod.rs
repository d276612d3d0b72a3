//! The search for a short tour (a travelling salesman problem over stroke ends).

mod construct;
mod contract;
mod improve;
mod orient;
mod problem;
mod random;
mod tour;
mod tree;

use crate::progress::Progress;
use contract::Contracted;
use improve::Search;
use orient::orient;
pub(crate) use problem::{End, Problem};
use random::Random;

/// The levels of the search: per mille of the links that are contracted, cheapest first, and per
/// mille of the work spent on that level. A level without contraction still renumbers the strokes
/// in tour order, so that near strokes are near in memory.
const LEVELS: [(usize, u64); 6] = [(0, 900), (500, 13), (750, 13), (900, 12), (950, 12), (0, 0)];

/// The level on which runs are mirrored, and per mille of the work spent on that.
const MIRRORED: (usize, u64) = (950, 50);

/// Up to this number of strokes every start is searched from; they share the work.
const SEVERAL_STARTS: usize = 3000;

/// The share of a descent in the progress of a level.
const DESCENT: f64 = 0.3;

/// The shares of the starts in the progress of a large search: until the nearest neighbours are linked, and
/// until the cheapest links are.
const STARTS: [f64; 2] = [0.04, 0.12];

/// The best tour found from several starts. File order is one of them, so the result is never
/// worse.
pub(crate) fn solve(problem: &Problem, (effort, all): (u8, usize), progress: Progress<'_>) -> Vec<End> {
    let starts = [
        problem.file_order(),
        construct::nearest_neighbour(problem, progress.part(0.0, STARTS[0])),
        construct::greedy_edge(problem, progress.part(STARTS[0], STARTS[1])),
    ];
    let progress = progress.part(STARTS[1], 1.0);
    let mut best = Best::new(problem, starts[0].clone());
    let n = problem.stroke_count();
    // Several pens share the work of one drawing.
    let work = (u128::from(work_of(all, effort)) * n as u128 / all.max(n) as u128) as u64;
    if n <= SEVERAL_STARTS {
        for (start, progress) in starts[1..].iter().zip([progress.part(0.0, 0.5), progress.part(0.5, 1.0)]) {
            best.offer(improve(problem, start.clone(), work / 2, progress));
        }
    } else {
        for start in &starts[1..] {
            best.offer(start.clone());
        }
        let start = best.tour.clone();
        best.offer(improve(problem, start, work, progress));
    }
    Problem::canonical(&mut best.tour);
    best.tour
}

/// The budget: number of candidates to evaluate.
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

/// The best tour offered.
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

/// Improves a tour level by level; most of the work is spent on the level of single strokes.
///
/// Contraction (multilevel refinement, Walshaw 2002) finds the links between hatches: the right
/// partner of an end at the edge of a hatch is not among its nearest ends, which all belong to the
/// same hatch.
fn improve(problem: &Problem, tour: Vec<End>, work: u64, progress: Progress<'_>) -> Vec<End> {
    let mut random = Random::new();
    let mut best = Best::new(problem, tour);
    let mut before = 0;
    for (contracted, share) in LEVELS {
        let progress = progress.part(before as f64 / 1000.0, (before + share) as f64 / 1000.0);
        before += share;
        let mut level = Contracted::new(problem, best.tour.clone(), contracted);
        let mut search = Search::new(&level.problem, level.problem.file_order());
        let (descent, kicks) = (progress.part(0.0, DESCENT), progress.part(DESCENT, 1.0));
        search.descend(|share| descent.done(share));
        search.kick(work / 1000 * share, &mut random, |share| kicks.done(share));
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

/// Mirrors random runs, re-optimizes the order of the runs, and keeps improvements.
fn mirror(level: &mut Contracted, tour: Vec<End>, work: u64, random: &mut Random) -> Vec<End> {
    let runs = level.problem.stroke_count();
    let contracted: Vec<usize> = (1..runs).filter(|&run| level.is_contracted(run)).collect();
    let mut best = tour;
    let mut done = 0;
    while done < work && !contracted.is_empty() {
        let run = contracted[random.below(contracted.len())];
        let before = level.problem.tour_cost(&best);
        let increase = level.mirror(run);
        let mut search = Search::new(&level.problem, best.clone());
        search.descend(|_| {});
        search.kick(20 * runs as u64, random, |_| {});
        done += search.work();
        let tour = search.finish();
        if level.problem.tour_cost(&tour) + increase <= before {
            best = tour;
        } else {
            level.mirror(run);
        }
    }
    best
}
