//! Local search: 2-opt and 3-opt moves with the gain criterion of Lin and Kernighan, and
//! perturbations (kicks) to leave local optima.

use std::collections::VecDeque;

use super::construct::Partners;
use super::problem::{End, Problem, mate};
use super::random::Random;
use super::tour::{MOST_LINKS, Tour};

/// Number of candidates of an end: the nearest ends in the plane.
const CANDIDATES: usize = 10;

/// Number of candidates that are extended to a third link, the most promising first.
const BREADTH: usize = 8;

/// A kick exchanges two neighbouring segments of the tour. One of these bounds on their length is
/// drawn at random: short segments do better with little work a stroke, long ones with much.
const KICKS: [usize; 2] = [5, 50];

/// Threshold accepting (Dueck and Scheuer 1990): a kick that increases the cost is accepted up to
/// this multiple of (mean link cost - cheapest link cost), times a random share. The threshold
/// falls to 0 at the end.
const TOLERANCE: f64 = 2.0;

/// A pen-up move.
#[derive(Clone, Copy, Default)]
struct Link {
    cost: f64,
    /// Its other end.
    to: End,
}

/// State of the local search.
pub(crate) struct Search<'p> {
    problem: &'p Problem<'p>,
    tour: Tour,
    /// The link at each end, as in the tour: one place in memory instead of three in the tour.
    links: Vec<Link>,
    /// Overwritten links since the last commit, for undo.
    changed: Vec<(End, Link)>,
    /// Candidates of each end with their costs, cheapest first; those of end `e` are at
    /// `first[e]..first[e + 1]`.
    candidates: Vec<(f64, End)>,
    first: Vec<u32>,
    /// Ends whose links have changed.
    queue: VecDeque<End>,
    queued: Vec<bool>,
    /// The exchange under construction: links `(0,1), (2,3), …` are removed, `(1,2), (3,4), …,
    /// (last,0)` are added.
    ends: [End; 2 * MOST_LINKS],
    /// The cost of the initial tour.
    total: f64,
    /// Work done: number of candidates evaluated.
    work: u64,
}

/// Kicks from one report of progress to the next: some milliseconds.
const KICKS_BETWEEN_REPORTS: u32 = 4096;

/// Places of a descent from one report of progress to the next.
const PLACES_BETWEEN_REPORTS: usize = 1024;

impl<'p> Search<'p> {
    /// Work of `new` an end.
    const WORK_OF_END: u64 = 40;

    pub(crate) fn new(problem: &'p Problem<'p>, tour: Vec<End>) -> Self {
        let all: Vec<End> = (0..problem.end_count() as End).collect();
        let partners = Partners::new(problem, &all);
        let mut candidates = Vec::with_capacity(all.len() * CANDIDATES);
        let mut first = vec![0];
        let mut found = Vec::new();
        for &end in &all {
            let begin = candidates.len();
            if problem.is_placed(end) {
                partners.of(end).nearest(problem.point(end), CANDIDATES, [end, mate(end)], &mut found);
                candidates.extend(found.iter().map(|&(_, to)| (problem.cost(end, to), to)));
                candidates[begin..].sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            }
            first.push(candidates.len() as u32);
        }
        let mut search = Self {
            problem,
            tour: Tour::new(tour),
            links: vec![Link::default(); all.len()],
            changed: Vec::new(),
            candidates,
            first,
            queue: VecDeque::new(),
            queued: vec![false; all.len()],
            ends: [0; 2 * MOST_LINKS],
            total: 0.0,
            work: all.len() as u64 * Self::WORK_OF_END,
        };
        for place in 0..search.tour.len() {
            let [left, right] = search.tour.link_before(place);
            let cost = problem.cost(left, right);
            search.set_link(left, right, cost);
            search.total += cost;
        }
        search
    }

    /// Work done: number of candidates evaluated.
    pub(crate) fn work(&self) -> u64 {
        self.work
    }

    /// Descends to a local optimum.
    pub(crate) fn descend(&mut self, progress: impl Fn(f64)) {
        for place in 0..self.tour.len() {
            if place.is_multiple_of(PLACES_BETWEEN_REPORTS) {
                progress(place as f64 / self.tour.len() as f64);
            }
            for end in self.tour.link_before(place) {
                self.enqueue(end);
                self.settle();
                self.commit();
            }
        }
    }

    /// Perturbs and re-optimizes the tour until `work` more candidates have been evaluated. A
    /// result that is worse than the threshold allows is undone.
    ///
    /// A kick is a double bridge of short segments at a random position (Martin, Otto and Felten
    /// 1991; local form: Applegate, Cook and Rohe 2003). The search continues at its six ends only.
    pub(crate) fn kick(&mut self, work: u64, random: &mut Random, progress: impl Fn(f64)) {
        let n = self.tour.len();
        if n < 4 {
            return;
        }
        // A constant part of all costs (lift and drop) must not raise the threshold.
        let cheapest = self.candidates.iter().map(|&(cost, _)| cost).fold(f64::INFINITY, f64::min);
        let tolerance = TOLERANCE * (self.total / n as f64 - cheapest).max(0.0);
        let begin = self.work;
        for kicks in 0_u32.. {
            if self.work - begin >= work {
                break;
            }
            if kicks % KICKS_BETWEEN_REPORTS == 0 {
                progress((self.work - begin) as f64 / work as f64);
            }
            // The kick itself is work too, so that the loop ends.
            self.work += 10;
            let left = 1.0 - (self.work - begin) as f64 / work as f64;
            let loss = tolerance * left.max(0.0) * random.share();
            let longest = KICKS[random.below(KICKS.len())].min((n - 1) / 2);
            let first = random.below(n);
            let second = first + 1 + random.below(longest);
            let third = second + 1 + random.below(longest);
            let [a, b] = self.tour.link_before(first);
            let [c, d] = self.tour.link_before(second % n);
            let [e, f] = self.tour.link_before(third % n);
            self.ends[..6].copy_from_slice(&[a, b, e, f, c, d]);
            let Some(gain) = self.exchange(3) else { continue };
            if gain + self.settle() >= -loss {
                self.commit();
            } else {
                self.undo();
            }
        }
    }

    /// The tour, beginning with the depot.
    pub(crate) fn finish(self) -> Vec<End> {
        self.tour.finish()
    }

    fn set_link(&mut self, a: End, b: End, cost: f64) {
        self.links[a as usize] = Link { cost, to: b };
        self.links[b as usize] = Link { cost, to: a };
    }

    fn enqueue(&mut self, end: End) {
        if !std::mem::replace(&mut self.queued[end as usize], true) {
            self.queue.push_back(end);
        }
    }

    fn commit(&mut self) {
        self.tour.commit();
        self.changed.clear();
    }

    fn undo(&mut self) {
        self.tour.undo();
        while let Some((end, link)) = self.changed.pop() {
            self.links[end as usize] = link;
        }
    }

    /// Gains below this are rounding errors: gains are differences of sums of links, which are
    /// below the cost of the tour.
    fn least_gain(&self) -> f64 {
        1e-12 * self.total
    }

    /// Improves at the queued ends until the queue is empty; returns the total gain.
    fn settle(&mut self) -> f64 {
        let mut total = 0.0;
        while let Some(end) = self.queue.pop_front() {
            self.queued[end as usize] = false;
            self.ends[0] = end;
            self.ends[1] = self.links[end as usize].to;
            // An exchange enqueues its ends, `end` among them.
            total += self.improve_at().unwrap_or(0.0);
        }
        total
    }

    /// Applies the first improving exchange of two or three links that removes the link
    /// `(ends[0], ends[1])`; returns its gain.
    fn improve_at(&mut self) -> Option<f64> {
        let begin = self.links[self.ends[0] as usize].cost;
        // Sorted by the gain after the first added link and the second removed link, largest first.
        let mut steps = [(0.0, 0, 0); CANDIDATES];
        let mut count = 0;
        for at in self.candidates_of(self.ends[1]) {
            let (cost, next) = self.candidates[at];
            self.work += 1;
            if begin - cost <= self.least_gain() {
                break;
            }
            if self.ends[..2].contains(&next) {
                continue;
            }
            let link = self.links[next as usize];
            let step = (begin - cost + link.cost, next, link.to);
            let mut place = count;
            while place > 0 && steps[place - 1].0 < step.0 {
                steps[place] = steps[place - 1];
                place -= 1;
            }
            steps[place] = step;
            count += 1;
        }
        for &(gain, next, other) in &steps[..count.min(BREADTH)] {
            (self.ends[2], self.ends[3]) = (next, other);
            if gain - self.problem.cost(other, self.ends[0]) > self.least_gain()
                && let Some(gain) = self.exchange(2)
            {
                return Some(gain);
            }
            if let Some(gain) = self.improve_with_third(gain) {
                return Some(gain);
            }
        }
        None
    }

    /// Tries a third link; `before` is the gain after two removed links and one added link.
    fn improve_with_third(&mut self, before: f64) -> Option<f64> {
        for at in self.candidates_of(self.ends[3]) {
            let (cost, next) = self.candidates[at];
            self.work += 1;
            if before - cost <= self.least_gain() {
                break;
            }
            if self.ends[..4].contains(&next) {
                continue;
            }
            let Link { cost: removed, to: other } = self.links[next as usize];
            let gain = before - cost + removed - self.problem.cost(other, self.ends[0]);
            if gain > self.least_gain() {
                (self.ends[4], self.ends[5]) = (next, other);
                if let Some(gain) = self.exchange(3) {
                    return Some(gain);
                }
            }
        }
        None
    }

    /// The index range of the candidates of an end.
    fn candidates_of(&self, end: End) -> std::ops::Range<usize> {
        self.first[end as usize] as usize..self.first[end as usize + 1] as usize
    }

    /// Exchanges the first `count` links in `ends` and returns the gain; `None` if the result would
    /// not be one tour.
    fn exchange(&mut self, count: usize) -> Option<f64> {
        let ends = self.ends;
        let ends = &ends[..2 * count];
        let plan = self.tour.reconnect(ends)?;
        self.work += self.tour.apply(&plan) as u64 / 4;
        let mut gain = 0.0;
        for link in ends.chunks_exact(2) {
            gain += self.links[link[0] as usize].cost;
            for &end in link {
                self.changed.push((end, self.links[end as usize]));
            }
        }
        for at in 0..count {
            let (a, b) = (ends[2 * at + 1], ends[(2 * at + 2) % ends.len()]);
            let cost = self.problem.cost(a, b);
            gain -= cost;
            self.set_link(a, b, cost);
        }
        for &end in ends {
            self.enqueue(end);
        }
        Some(gain)
    }
}
