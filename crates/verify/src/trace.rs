//! One path of the pen, measured against the drawing in both directions as a stream.
//!
//! The path arrives as short chords. Chords on one line are merged to runs ([`crate::run`]). Each
//! run is measured: from the ink to the drawing ([`crate::near`]), and from the drawing to the ink
//! ([`crate::cover`]). In crowded drawings only followed strokes are examined ([`crate::follow`]).

use std::collections::VecDeque;

use drawing::{Point, Rect, distance};

use crate::{
    DeviationStats, Location,
    cover::{Cover, LocalRun, UncoveredPart},
    follow::{CROWD, FOLLOWED, Follower},
    histogram::Histogram,
    near::{Candidate, HALVINGS, Near, better},
    run::{At, Chain, Run},
    target::{Line, PenTarget, Target, meet},
};

/// Merging distance of chords, as a share of the tolerance.
const MERGE: f64 = 1.0 / 5000.0;
/// Largest length of a merged run, in tolerances.
const LONGEST_RUN: f64 = 40.0;

/// The pieces of the drawing that a run is measured against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scope {
    /// Those of the strokes that are followed.
    Followed,
    /// In a crowd, those that the run may draw.
    Alongside,
    /// All near it.
    All,
}

/// The largest distance of the ink from the drawing, and its location.
#[derive(Clone, Copy, Debug)]
struct Worst {
    mm: f64,
    at: At,
    point: Point,
    stroke: u32,
    pen: u16,
}

/// One path of the pen.
#[derive(Clone, Debug)]
pub(crate) struct Trace {
    tolerance: f64,
    merge: f64,
    /// A run does not affect cells farther away than this.
    radius: f64,
    smallest_radius: f64,
    cover: Cover,
    pen: usize,
    chain: Option<Chain>,
    /// Pieces of this pen that meet `near_bounds`.
    near: Vec<(Line, u32)>,
    near_bounds: Option<Rect>,
    /// `near_bounds` extends the radius by this, mm.
    margin: f64,
    /// Whether strokes may be followed.
    follows: bool,
    follower: Follower,
    /// Bounds along a run: at either end of a part of it, and the length of the part.
    bounds: Vec<([f64; 2], f64)>,
    /// The pieces that are examined for the run.
    candidates: Vec<Candidate>,
    distances: Histogram,
    worst: Option<Worst>,
    pub(crate) length: f64,
    pub(crate) dots: u64,
}

impl Trace {
    pub(crate) fn new(target: &Target, tolerance: f64, quantization: f64, follows: bool) -> Self {
        let mut trace = Self {
            tolerance,
            merge: tolerance * MERGE,
            radius: 0.0,
            smallest_radius: 0.0,
            cover: Cover::new(target),
            pen: 0,
            chain: None,
            near: Vec::new(),
            near_bounds: None,
            margin: tolerance,
            follows,
            follower: Follower::default(),
            bounds: Vec::new(),
            candidates: Vec::new(),
            distances: Histogram::new(),
            worst: None,
            length: 0.0,
            dots: 0,
        };
        trace.widen(quantization);
        trace.smallest_radius = trace.radius;
        trace
    }

    /// Ink may deviate by the tolerance plus `quantization`: the radius is a quarter more than
    /// that. Where strokes are close, the work grows with its square.
    pub(crate) fn widen(&mut self, quantization: f64) {
        let radius = 1.25 * (self.tolerance + quantization);
        if radius > self.radius {
            self.radius = radius;
            self.near_bounds = None;
        }
    }

    /// The tolerance that determines resolutions, mm.
    pub(crate) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// The pen, whose strokes are `target.pens[pen]`, is lowered at `point`.
    pub(crate) fn down(&mut self, pen: usize, point: Point, at: At) {
        if self.pen != pen {
            self.pen = pen;
            self.near_bounds = None;
        }
        self.follower.reset();
        self.chain = Some(Chain::new(point, at, None, false));
    }

    /// The pen moves to `point`, on a path at most `error` away from the chord.
    pub(crate) fn to(&mut self, target: &Target, point: Point, error: f64, at: At) {
        let Some(chain) = &mut self.chain else { return };
        if point == chain.last && error == 0.0 {
            return;
        }
        if chain.extend(point, error, self.merge, LONGEST_RUN * self.tolerance) {
            return;
        }
        let (run, before, from) = (chain.run(self.merge), chain.before, chain.last);
        let mut next = Chain::new(from, at, Some(run), true);
        next.extend(point, error, self.merge, f64::INFINITY);
        self.chain = Some(next);
        self.measure(target, run, before);
    }

    /// The pen is lifted.
    pub(crate) fn up(&mut self, target: &Target) {
        let Some(chain) = self.chain.take() else { return };
        if !chain.moved {
            self.dots += 1;
        }
        if chain.chords > 0 || !chain.moved {
            self.measure(target, chain.run(self.merge), chain.before);
        }
    }

    /// Measures one run in both directions; `before` is the run that ends at its start.
    fn measure(&mut self, target: &Target, run: Run, before: Option<Run>) {
        let strokes = &target.pens[self.pen];
        let bounds = Rect::from_points(run.from, run.to).inflate(self.radius, self.radius);
        let following = self.follower.advance(strokes, &run, bounds, self.radius, &mut self.candidates);
        let mut scope = if following { Scope::Followed } else { self.examine(target, &run, bounds) };
        let mut passed = VecDeque::new();
        loop {
            if scope != Scope::Followed {
                // Strokes that the runs before this one covered in passing, while following.
                passed.extend(self.follower.take_recent());
                for (run, before) in &passed {
                    self.cover_all(strokes, run, before.as_ref());
                }
            }
            let (nearest, common) = self.nearest_to_ends(strokes, &run);
            self.cover_all(strokes, &run, before.as_ref());
            if self.follows {
                let is_crowded = scope == Scope::Alongside || self.candidates.len() > CROWD;
                if scope != Scope::Followed && is_crowded {
                    self.follower.start(strokes, run.to, self.radius, &self.candidates);
                }
                // With all pieces as candidates the run has covered what it can.
                if scope != Scope::All {
                    self.follower.remember(run, before, self.radius);
                }
            }
            let largest = self.bound_along(strokes, &run, nearest, common);
            let known = self.worst.map_or(0.0, |worst| worst.mm);
            if scope != Scope::All && (largest > FOLLOWED * self.radius || largest > known) {
                // Another stroke may be nearer. All strokes are looked at for the maximum.
                self.follower.fail();
                if scope == Scope::Followed {
                    scope = self.examine(target, &run, bounds);
                } else {
                    self.select(strokes, &run, bounds);
                    scope = Scope::All;
                }
                continue;
            }
            self.record(strokes, &run, nearest, largest);
            return;
        }
    }

    /// Makes the pieces near the run the candidates: all, or in a crowd those alongside it.
    fn examine(&mut self, target: &Target, run: &Run, bounds: Rect) -> Scope {
        let strokes = &target.pens[self.pen];
        self.gather(target, bounds);
        if self.follows {
            // By the lines, which lie side by side in memory: which pieces are left out does not matter here.
            let near = self.near.iter().filter(|(line, _)| line.meets(bounds));
            if near.clone().nth(CROWD).is_some() {
                let radius = self.radius + strokes.line_error();
                self.candidates.clear();
                let alongside = near.filter(|(line, _)| line.is_alongside(run, radius));
                self.candidates.extend(alongside.map(|(_, index)| Candidate::new(*index)));
                if !self.candidates.is_empty() {
                    return Scope::Alongside;
                }
            }
        }
        self.select(strokes, run, bounds);
        Scope::All
    }

    /// For each end of the run the nearest piece with its distance; and the distances of both ends
    /// from that one piece for which the larger distance is smallest.
    fn nearest_to_ends(&mut self, strokes: &PenTarget, run: &Run) -> ([(f64, u32); 2], [f64; 2]) {
        let mut nearest = [(f64::INFINITY, 0_u32); 2];
        let mut common = [f64::INFINITY; 2];
        for Candidate { index, at } in &mut self.candidates {
            let distances = strokes.pieces[*index as usize].distances([run.from, run.to]);
            (at[0], at[2]) = (distances[0], distances[1]);
            for (best, distance) in nearest.iter_mut().zip(distances) {
                if distance < best.0 {
                    *best = (distance, *index);
                }
            }
            common = better(common, distances);
        }
        // Beyond the radius the nearest piece need not be a candidate.
        for (best, point) in nearest.iter_mut().zip([run.from, run.to]) {
            if best.0 > self.radius {
                *best = strokes.nearest(point);
                common = better(common, strokes.pieces[best.1 as usize].distances([run.from, run.to]));
            }
        }
        (nearest, common)
    }

    /// Fills `bounds` along the run; returns the largest bound of the ink's distance on it.
    fn bound_along(
        &mut self,
        strokes: &PenTarget,
        run: &Run,
        nearest: [(f64, u32); 2],
        common: [f64; 2],
    ) -> f64 {
        let ends = [(run.from, nearest[0].0), (run.to, nearest[1].0)];
        let (length, most) = (distance(run.from, run.to), common[0].max(common[1]));
        self.candidates.retain(|candidate| candidate.at_least([0, 2], length) <= most);
        let mut near = Near {
            strokes,
            candidates: &mut self.candidates,
            radius: self.radius,
            tolerance: self.tolerance,
            largest: self.worst.map_or(0.0, |worst| worst.mm - run.error),
        };
        let mut largest = 0.0_f64;
        let all = 0..near.candidates.len();
        let bounds = &mut self.bounds;
        bounds.clear();
        near.bound(all, [0, 2], ends, common, HALVINGS, &mut |[from, to], length| {
            largest = largest.max(from.max(to) + run.error);
            bounds.push(([from, to], length));
        });
        largest
    }

    /// Adds the measured run to length, histogram and maximum.
    fn record(&mut self, strokes: &PenTarget, run: &Run, nearest: [(f64, u32); 2], largest: f64) {
        self.length += distance(run.from, run.to);
        for &([from, to], length) in &self.bounds {
            // Along the part the distance is below the linear interpolation of its two ends.
            let steps = ((from - to).abs() / (0.1 * largest + 1e-12)).ceil().clamp(1.0, 8.0);
            for step in 0..steps as usize {
                let t = if to > from { step + 1 } else { step } as f64 / steps;
                self.distances.add(from + t * (to - from) + run.error, length / steps);
            }
        }
        if self.worst.is_none_or(|worst| largest > worst.mm) {
            let end = usize::from(nearest[1].0 > nearest[0].0);
            self.worst = Some(Worst {
                mm: largest,
                at: run.at,
                point: [run.from, run.to][end],
                stroke: strokes.pieces[nearest[end].1 as usize].stroke,
                pen: strokes.pen,
            });
        }
    }

    /// Updates the cover of the candidates, but not of those that nearer ink has covered.
    fn cover_all(&mut self, strokes: &PenTarget, run: &Run, before: Option<&Run>) {
        let length = distance(run.from, run.to);
        for candidate in &self.candidates {
            let piece = &strokes.pieces[candidate.index as usize];
            if self.cover.is_nearer(piece, candidate.at_least([0, 2], length) - piece.error) {
                continue;
            }
            let local = LocalRun::new(piece, run);
            self.cover.run(piece, &local, self.radius);
            if let Some(before) = before {
                self.cover.joint(piece, before, &local, self.radius);
            }
        }
    }

    /// Makes the pieces that may be within the radius of the run the candidates.
    fn select(&mut self, strokes: &PenTarget, run: &Run, bounds: Rect) {
        self.candidates.clear();
        let radius = self.radius;
        let wider = bounds.inflate(strokes.line_error(), strokes.line_error());
        let may_be_near = |(line, index): &&(Line, u32)| {
            line.meets(wider) && {
                let piece = &strokes.pieces[*index as usize];
                meet(piece.bounds(), bounds) && piece.may_be_near(run.from, run.to, radius)
            }
        };
        self.candidates.extend(self.near.iter().filter(may_be_near).map(|(_, index)| Candidate::new(*index)));
    }

    /// Ensures that `near` holds every piece that meets `bounds`. A wider list is kept while the
    /// pen stays near.
    fn gather(&mut self, target: &Target, bounds: Rect) {
        let holds = |known: Rect| {
            known.x0 <= bounds.x0 && bounds.x1 <= known.x1 && known.y0 <= bounds.y0 && bounds.y1 <= known.y1
        };
        if self.near_bounds.is_some_and(holds) {
            return;
        }
        // A short list that still lasts for many runs.
        match self.near.len() {
            0..16 => self.margin = (2.0 * self.margin).min(4.0 * self.radius),
            16..48 => {}
            _ => self.margin = (0.5 * self.margin).max(self.radius / 16.0),
        }
        let wider = bounds.inflate(self.margin, self.margin);
        self.near.clear();
        target.pens[self.pen].visit(wider, |line, index| self.near.push((line, index)));
        self.near_bounds = Some(wider);
    }

    /// The distances from the ink to the drawing.
    pub(crate) fn ink_to_drawing(&self) -> DeviationStats {
        let max_mm = self.worst.map_or(0.0, |worst| worst.mm);
        let p99_mm = self.distances.percentile(0.99, max_mm);
        DeviationStats { max_mm, p99_mm, is_lower_bound: false, sampling_error_mm: 0.0 }
    }

    /// Pen, distance and location of the ink that deviates most.
    pub(crate) fn worst_ink(&self, target: &Target) -> Option<(u16, f64, Location)> {
        self.worst.map(|worst| {
            let stroke = worst.stroke as usize;
            let location = Location {
                row: Some(worst.at.row),
                t_us: Some(worst.at.t_us),
                point_mm: Some(worst.point),
                stroke: Some(stroke),
                source: target.sources.get(stroke).copied(),
            };
            (worst.pen, worst.mm, location)
        })
    }

    /// The distances from the drawing to the ink, and for each pen the part farther than `allowed`.
    pub(crate) fn drawing_to_ink(
        &self,
        target: &Target,
        allowed: f64,
    ) -> (DeviationStats, Vec<UncoveredPart>) {
        self.cover.drawing_to_ink(target, allowed, self.smallest_radius)
    }
}
