//! One path of the pen against the drawing, both ways, as it streams by.
//!
//! The path arrives as short chords. Chords that lie on one line are merged; what is left is called a **run**, a
//! straight line that stands for a part of the path and is at most `error` away from it, both ways.
//!
//! **Ink to drawing.** The distance from a point to one straight piece is convex along a run, so over the whole run it
//! is at most what it is at the run's ends. Where different pieces are nearest to the two ends (at the drawing's
//! corners) the run is halved until the bound is tight. No sampling is involved.
//!
//! **Drawing to ink.** Each straight piece of the drawing is divided into short cells. The distance to one run is
//! convex along a cell, so the cell is covered to within the larger value at its ends; the least over all runs is kept.
//! A cell that lies beside the joint `v` of two consecutive runs is divided at `m`, the point nearest to `v`: one run
//! answers for each half.
//!
//! **Following.** Where strokes lie so close that hundreds are near, looking at all of them for every run takes too long.
//! Then only those stretches of strokes are looked at that have been near since the pen came here. Every distance so
//! found is a bound from above still; what may be lost is that ink covers a stroke in passing. So a table that does not
//! hold when followed is measured again in full, see [`crate::certify`].

use std::collections::VecDeque;
use std::ops::Range;

use drawing::{Point, Rect, Vec2};

use crate::{
    DeviationStats, Location,
    histogram::Histogram,
    target::{BLOCK, PenTarget, Piece, Target, meet},
};

/// Chords are merged into a run that stays within this share of the tolerance of each of them.
const MERGE: f64 = 1.0 / 5000.0;
/// No run is merged beyond so many tolerances.
const LONGEST_RUN: f64 = 40.0;
/// A bound on the ink's distance is tight enough if it is above the value at the ends by this share of the tolerance
/// or of itself, whichever is more,
const TIGHT: (f64, f64) = (1.0 / 200.0, 1.0 / 16.0);
/// or, where it would be the largest so far, by this share of the tolerance.
const TIGHTEST: f64 = 1.0 / 5000.0;
/// A run is not halved more often than this.
const HALVINGS: u32 = 24;

/// So many pieces near a run are enough to follow the nearest,
const CROWD: usize = 48;

/// as long as they are within this share of the radius: less than a plan that holds may be off.
const FOLLOWED: f64 = 0.75;

/// Where in the table something happens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct At {
    pub(crate) row: u64,
    pub(crate) t_us: u64,
}

/// A straight line that stands for a part of the path.
#[derive(Clone, Copy, Debug)]
struct Run {
    from: Point,
    to: Point,
    error: f64,
    at: At,
}

/// Chords being merged: all that start at `anchor` and go in a direction between `right` and `left` pass every
/// point so far within the merging distance.
#[derive(Clone, Copy, Debug)]
struct Chain {
    anchor: Point,
    last: Point,
    chords: u32,
    /// Unit vectors; nothing so far.
    cone: Option<(Vec2, Vec2)>,
    error: f64,
    at: At,
    /// The run before, if the pen came from there.
    before: Option<Run>,
    moved: bool,
}

/// The largest distance of the ink from the drawing so far, and where.
#[derive(Clone, Copy, Debug)]
struct Worst {
    mm: f64,
    at: At,
    point: Point,
    stroke: u32,
    pen: u16,
}

/// A part of the drawing that no ink comes near enough to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UncoveredPart {
    pub(crate) pen: u16,
    pub(crate) mm: f64,
    /// Whether `mm` is only known to be exceeded.
    pub(crate) is_lower_bound: bool,
    /// Length of what is missed.
    pub(crate) length: f64,
    /// How many strokes part a part.
    pub(crate) strokes: u64,
    pub(crate) location: Location,
}

/// One path of the pen.
#[derive(Clone, Debug)]
pub(crate) struct Trace {
    tolerance: f64,
    merge: f64,
    /// Cells further than this from a run are not touched by it.
    radius: f64,
    smallest_radius: f64,
    cover: Cover,
    pen: usize,
    chain: Option<Chain>,
    /// Pieces of this pen that meet `near_bounds`, with their boxes.
    near: Vec<(u32, Rect)>,
    near_bounds: Option<Rect>,
    /// How much further than the radius `near_bounds` reaches.
    margin: f64,
    /// Whether strokes may be followed at all.
    follows: bool,
    /// The stretches of strokes that are being followed, as ranges of pieces; none while everything is looked at.
    followed: Vec<Range<u32>>,
    /// The latest runs while strokes are followed, with those before them.
    recent: VecDeque<(Run, Option<Run>)>,
    /// Bounds found along a run: at either end of a part of it, and the part's length.
    bounds: Vec<([f64; 2], f64)>,
    /// Working memory of [`Near::bound`]: distances of pieces, and which.
    candidates: Vec<(f64, u32)>,
    distances: Histogram,
    worst: Option<Worst>,
    pub(crate) length: f64,
    pub(crate) dots: u64,
}

impl Trace {
    pub(crate) fn new(target: &Target, tolerance: f64, floor: f64, follows: bool) -> Self {
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
            followed: Vec::new(),
            recent: VecDeque::new(),
            bounds: Vec::new(),
            candidates: Vec::new(),
            distances: Histogram::new(),
            worst: None,
            length: 0.0,
            dots: 0,
        };
        trace.widen(floor);
        trace.smallest_radius = trace.radius;
        trace
    }

    /// Ink may be off by the tolerance and `floor`: look a quarter further than that. Where strokes lie close, the work
    /// grows with the square of this.
    pub(crate) fn widen(&mut self, floor: f64) {
        let radius = 1.25 * (self.tolerance + floor);
        if radius > self.radius {
            self.radius = radius;
            self.near_bounds = None;
        }
    }

    /// The tolerance that resolutions follow, mm.
    pub(crate) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// The pen, whose strokes are `target.pens[pen]`, is put down at `point`.
    pub(crate) fn down(&mut self, pen: usize, point: Point, at: At) {
        if self.pen != pen {
            self.pen = pen;
            self.near_bounds = None;
        }
        self.followed.clear();
        self.recent.clear();
        self.chain = Some(Chain::new(point, at, None, false));
    }

    /// The pen goes on to `point`, on a path at most `error` away from the chord.
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

    /// Measures one run both ways; `before` is the run that ends where it begins.
    fn measure(&mut self, target: &Target, run: Run, before: Option<Run>) {
        let strokes = &target.pens[self.pen];
        let bounds = Rect::from_points(run.from, run.to).inflate(self.radius, self.radius);
        let following = self.follow(strokes, &run, bounds);
        if !following {
            self.gather(target, bounds);
            self.select(strokes, &run, bounds);
            // What was covered in passing before the strokes at hand were known to be followed.
            for (run, before) in std::mem::take(&mut self.recent) {
                self.cover_all(strokes, &run, before.as_ref());
            }
        }
        self.cover_all(strokes, &run, before.as_ref());

        let mut nearest = [(f64::INFINITY, 0_u32); 2];
        // The distances of the run's ends from one piece: the one for which the larger is the least.
        let mut common = [f64::INFINITY; 2];
        for &(_, index) in &self.candidates {
            let distances = strokes.pieces[index as usize].distances([run.from, run.to]);
            for (best, distance) in nearest.iter_mut().zip(distances) {
                if distance < best.0 {
                    *best = (distance, index);
                }
            }
            common = better(common, distances);
        }
        // Beyond the radius the list may not hold the nearest piece.
        for (best, point) in nearest.iter_mut().zip([run.from, run.to]) {
            if best.0 > self.radius {
                *best = strokes.nearest(point);
                common = better(common, strokes.pieces[best.1 as usize].distances([run.from, run.to]));
            }
        }
        if self.follows {
            if !following && self.candidates.len() > CROWD {
                self.start_following(strokes, run.to);
            }
            self.remember(run, before);
        }

        let length = distance(run.from, run.to);
        let ends = [(run.from, nearest[0].0), (run.to, nearest[1].0)];
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
        near.bound(all, ends, common, HALVINGS, &mut |[from, to], length| {
            largest = largest.max(from.max(to) + run.error);
            bounds.push(([from, to], length));
        });
        if following && largest > FOLLOWED * self.radius {
            // Something else may be nearer.
            self.followed.clear();
            self.recent.pop_back();
            self.measure(target, run, before);
            return;
        }
        self.length += length;
        for &([from, to], length) in &self.bounds {
            // Along the run the distance is at most what evenly leads from the one end's to the other's.
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
                point: ends[end].0,
                stroke: strokes.pieces[nearest[end].1 as usize].stroke,
                pen: strokes.pen,
            });
        }
    }

    /// Notes how well a run covers the candidates.
    fn cover_all(&mut self, strokes: &PenTarget, run: &Run, before: Option<&Run>) {
        for &(_, index) in &self.candidates {
            let piece = &strokes.pieces[index as usize];
            let local = LocalRun::new(piece, run);
            self.cover.run(piece, &local, self.radius);
            if let Some(before) = before {
                self.cover.joint(piece, before, &local, self.radius);
            }
        }
    }

    /// Makes the pieces that may be near the run, whose box with the radius around it is `bounds`, the candidates.
    fn select(&mut self, strokes: &PenTarget, run: &Run, bounds: Rect) {
        self.candidates.clear();
        let radius = self.radius;
        let may_be_near = |index: u32| strokes.pieces[index as usize].may_be_near(run.from, run.to, radius);
        let meeting = self.near.iter().filter(|(index, piece)| meet(*piece, bounds) && may_be_near(*index));
        self.candidates.extend(meeting.map(|(index, _)| (0.0, *index)));
    }

    /// Makes the followed stretches the candidates, moved on to where the run goes; false if none is near enough to it,
    /// or none is followed.
    fn follow(&mut self, strokes: &PenTarget, run: &Run, bounds: Rect) -> bool {
        if self.followed.is_empty() {
            return false;
        }
        let radius = self.radius;
        let meets = |index: u32| {
            let piece = &strokes.pieces[index as usize];
            meet(piece.bounds(), bounds) && piece.may_be_near(run.from, run.to, radius)
        };
        let stroke = |index: u32| strokes.pieces[index as usize].stroke;
        let count = strokes.pieces.len() as u32;
        self.candidates.clear();
        let candidates = &mut self.candidates;
        self.followed.retain_mut(|stretch| {
            let own = stroke(stretch.start);
            while stretch.end < count && stroke(stretch.end) == own && meets(stretch.end) {
                stretch.end += 1;
            }
            while stretch.start > 0 && stroke(stretch.start - 1) == own && meets(stretch.start - 1) {
                stretch.start -= 1;
            }
            while stretch.start < stretch.end && !meets(stretch.start) {
                stretch.start += 1;
            }
            while stretch.start < stretch.end && !meets(stretch.end - 1) {
                stretch.end -= 1;
            }
            candidates.extend(stretch.clone().map(|index| (0.0, index)));
            stretch.start < stretch.end
        });
        // Near enough that a plan that holds need not look further.
        let near = |point: Point| {
            let mut pieces = self.candidates.iter().map(|(_, index)| &strokes.pieces[*index as usize]);
            pieces.any(|piece| piece.distance(piece.local(point)) <= FOLLOWED * self.radius)
        };
        if near(run.from) && near(run.to) {
            return true;
        }
        self.followed.clear();
        false
    }

    /// From now on follows the stretches of strokes that are near `point`.
    fn start_following(&mut self, strokes: &PenTarget, point: Point) {
        let radius = self.radius;
        let is_near = |index: &u32| {
            let piece = &strokes.pieces[*index as usize];
            piece.distance(piece.local(point)) <= radius
        };
        let mut near: Vec<u32> = self.candidates.iter().map(|(_, index)| *index).filter(is_near).collect();
        near.sort_unstable();
        for index in near {
            let stroke = strokes.pieces[index as usize].stroke;
            match self.followed.last_mut() {
                Some(last) if last.end == index && strokes.pieces[last.start as usize].stroke == stroke => {
                    last.end += 1;
                }
                _ => self.followed.push(index..index + 1),
            }
        }
    }

    /// Keeps the run for as long as the pen may still be near what it was near to then.
    fn remember(&mut self, run: Run, before: Option<Run>) {
        self.recent.push_back((run, before));
        while self.recent.len() > 1 && distance(self.recent[1].0.from, run.to) > 2.0 * self.radius {
            self.recent.pop_front();
        }
    }

    /// Makes sure that `near` holds every piece that meets `bounds`: a wider list is kept while the pen stays near.
    fn gather(&mut self, target: &Target, bounds: Rect) {
        let holds = |known: Rect| {
            known.x0 <= bounds.x0 && bounds.x1 <= known.x1 && known.y0 <= bounds.y0 && bounds.y1 <= known.y1
        };
        if self.near_bounds.is_some_and(holds) {
            return;
        }
        // Few pieces to look through again and again, but not few runs for which they last.
        match self.near.len() {
            0..16 => self.margin = (2.0 * self.margin).min(4.0 * self.radius),
            16..48 => {}
            _ => self.margin = (0.5 * self.margin).max(self.radius / 16.0),
        }
        let wider = bounds.inflate(self.margin, self.margin);
        self.near.clear();
        target.pens[self.pen].visit(wider, |index, piece| self.near.push((index, piece)));
        self.near_bounds = Some(wider);
    }

    /// How far the ink strays.
    pub(crate) fn ink_to_drawing(&self) -> DeviationStats {
        let max_mm = self.worst.map_or(0.0, |worst| worst.mm);
        DeviationStats {
            max_mm,
            p99_mm: self.distances.percentile(0.99, max_mm),
            is_lower_bound: false,
            sampling_error_mm: 0.0,
        }
    }

    /// Pen, distance and place of the ink that strays furthest.
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

    /// How much of the drawing is missed, and, pen by pen, what is missed by more than `allowed`.
    pub(crate) fn drawing_to_ink(
        &self,
        target: &Target,
        allowed: f64,
    ) -> (DeviationStats, Vec<UncoveredPart>) {
        let mut distances = Histogram::new();
        let (mut max_mm, mut is_lower_bound) = (0.0_f64, false);
        let mut uncovered = Vec::new();
        for strokes in &target.pens {
            let mut part: Option<UncoveredPart> = None;
            let mut uncovered_strokes = Vec::new();
            for piece in &strokes.pieces {
                let cell = piece.length / f64::from(piece.cells);
                let first = piece.first_cell as usize;
                for (index, covered) in
                    self.cover.cells[first..first + piece.cells as usize].iter().enumerate()
                {
                    let unknown = *covered == f32::INFINITY;
                    let mm = if unknown { self.smallest_radius } else { f64::from(*covered) };
                    distances.add(mm, cell);
                    max_mm = max_mm.max(mm);
                    is_lower_bound |= unknown;
                    if mm <= allowed {
                        continue;
                    }
                    let stroke = piece.stroke as usize;
                    uncovered_strokes.push(stroke);
                    let part = part.get_or_insert(UncoveredPart {
                        pen: strokes.pen,
                        mm: 0.0,
                        is_lower_bound: false,
                        length: 0.0,
                        strokes: 0,
                        location: Location::default(),
                    });
                    part.length += cell;
                    part.is_lower_bound |= unknown;
                    if mm > part.mm {
                        part.mm = mm;
                        part.location = Location {
                            point_mm: Some(piece.at((index as f64 + 0.5) * cell)),
                            stroke: Some(stroke),
                            source: target.sources.get(stroke).copied(),
                            ..Location::default()
                        };
                    }
                }
                uncovered_strokes.dedup();
            }
            uncovered_strokes.sort_unstable();
            uncovered_strokes.dedup();
            uncovered
                .extend(part.map(|part| UncoveredPart { strokes: uncovered_strokes.len() as u64, ..part }));
        }
        let p99_mm = distances.percentile(0.99, max_mm);
        (
            DeviationStats { max_mm, p99_mm, is_lower_bound, sampling_error_mm: 0.5 * target.sparse_mm },
            uncovered,
        )
    }
}

impl Chain {
    fn new(anchor: Point, at: At, before: Option<Run>, moved: bool) -> Self {
        Self { anchor, last: anchor, chords: 0, cone: None, error: 0.0, at, before, moved }
    }

    /// Takes the chord from `last` to `point` into the chain if one line from the anchor then still passes every point
    /// within `merge`; a first chord always.
    ///
    /// Each point so far narrows the cone of the directions that pass it (Sklansky and Gonzalez 1980, Williams 1978). The points
    /// come ever further from the anchor, so none lies beyond the line's end. The path is connected and stays in a
    /// strip about the line from its beginning to its end, so each point of the line has one of the path beside it:
    /// `merge` holds both ways.
    fn extend(&mut self, point: Point, error: f64, merge: f64, longest: f64) -> bool {
        let to = point - self.anchor;
        let reach = to.hypot2().sqrt();
        if self.chords > 0 {
            let in_order = reach >= (self.last - self.anchor).hypot2().sqrt() && reach <= longest;
            let inside = self.cone.is_none_or(|(right, left)| {
                right.cross(to) >= 0.0 && to.cross(left) >= 0.0 && to.dot(right) > 0.0
            });
            if !(in_order && inside) {
                return false;
            }
        }
        if reach > merge {
            let u = to / reach;
            let sin = merge / reach;
            let cos = (1.0 - sin * sin).sqrt();
            let aside = sin * Vec2::new(-u.y, u.x);
            let (right, left) = (cos * u - aside, cos * u + aside);
            self.cone = Some(self.cone.map_or((right, left), |(old_right, old_left)| {
                (
                    if old_right.cross(right) > 0.0 { right } else { old_right },
                    if left.cross(old_left) > 0.0 { left } else { old_left },
                )
            }));
        }
        self.last = point;
        self.chords += 1;
        self.error = self.error.max(error);
        self.moved = true;
        true
    }

    fn run(&self, merge: f64) -> Run {
        let merged = if self.chords > 1 { merge } else { 0.0 };
        Run { from: self.anchor, to: self.last, error: self.error + merged, at: self.at }
    }
}

/// A run in the frame of one piece of the drawing.
#[derive(Clone, Copy, Debug)]
struct LocalRun {
    ends: [(f64, f64); 2],
    vector: (f64, f64),
    /// 1 over the square of its length; 0 for a dot.
    inverse: f64,
    error: f64,
}

impl LocalRun {
    fn new(piece: &Piece, run: &Run) -> Self {
        let ends = [piece.local(run.from), piece.local(run.to)];
        let vector = (ends[1].0 - ends[0].0, ends[1].1 - ends[0].1);
        let square = vector.0 * vector.0 + vector.1 * vector.1;
        let inverse = if square > 0.0 { 1.0 / square } else { 0.0 };
        Self { ends, vector, inverse, error: run.error + piece.error }
    }

    /// Square of the distance from the piece's point `along` to the run.
    fn square_at(&self, along: f64) -> f64 {
        let (x, y) = (along - self.ends[0].0, -self.ends[0].1);
        let t = ((x * self.vector.0 + y * self.vector.1) * self.inverse).clamp(0.0, 1.0);
        let (x, y) = (x - t * self.vector.0, y - t * self.vector.1);
        x * x + y * y
    }
}

/// How well the ink covers each cell of the drawing.
#[derive(Clone, Debug)]
struct Cover {
    /// Bound on each cell's distance from the ink, mm; infinite where no ink came near.
    cells: Vec<f32>,
    /// The largest of each block.
    blocks: Vec<f32>,
    /// Whether only the cells' middles are looked at.
    sparse: bool,
}

impl Cover {
    fn new(target: &Target) -> Self {
        Self {
            cells: vec![f32::INFINITY; target.cells],
            blocks: vec![f32::INFINITY; target.blocks],
            sparse: target.sparse_mm > 0.0,
        }
    }

    /// Notes how well a run covers the cells of a piece.
    fn run(&mut self, piece: &Piece, run: &LocalRun, radius: f64) {
        let [(x0, y0), (x1, y1)] = run.ends;
        let (low, high) = (x0.min(x1), x0.max(x1));
        // The run is nowhere nearer to the piece's line than this.
        let aside = y0.min(y1).max(-y0.max(y1)).max(0.0);
        if high + radius < 0.0 || low - radius > piece.length || aside > radius {
            return;
        }
        let count = piece.cells as usize;
        let cell = piece.length / f64::from(piece.cells);
        let (first, last) = if piece.length > 0.0 {
            let first = ((low - radius) / cell) as usize;
            (first / BLOCK, (((high + radius) / cell) as usize).saturating_add(1).min(count).div_ceil(BLOCK))
        } else {
            (0, 1)
        };
        let (error, limit) = (run.error as f32, radius as f32);
        for block in first..last {
            let from = block * BLOCK;
            let to = (from + BLOCK).min(count);
            let (start, end) = (from as f64 * cell, to as f64 * cell);
            let beyond = (low - end).max(start - high).max(0.0);
            let worst = &mut self.blocks[piece.first_block as usize + block];
            // No cell of the block can get nearer than it is.
            if f64::from(*worst) * f64::from(*worst) <= aside * aside + beyond * beyond {
                continue;
            }
            let at = piece.first_cell as usize;
            let cells = &mut self.cells[at + from..at + to];
            let start = if self.sparse { start + 0.5 * cell } else { start };
            let mut squares = [0.0; BLOCK + 1];
            for (index, square) in (0..).zip(&mut squares[..=cells.len()]) {
                *square = run.square_at(start + f64::from(index) * cell);
            }
            // Plain comparisons, which the compiler turns into vectors.
            let ends = if self.sparse { &squares[..] } else { &squares[1..] };
            let mut largest = 0.0_f32;
            for ((covered, at_start), at_end) in cells.iter_mut().zip(&squares).zip(ends) {
                let square = if at_end > at_start { *at_end } else { *at_start };
                let kept = bound(square as f32, error, limit);
                *covered = if kept < *covered { kept } else { *covered };
                largest = if *covered > largest { *covered } else { largest };
            }
            *worst = largest;
        }
    }

    /// Notes how well two consecutive runs together cover the cell beside their joint.
    fn joint(&mut self, piece: &Piece, before: &Run, next: &LocalRun, radius: f64) {
        let (along, across) = next.ends[0];
        let middle = along.clamp(0.0, piece.length);
        let joint = (along - middle) * (along - middle) + across * across;
        if joint > radius * radius {
            return;
        }
        let cell = piece.length / f64::from(piece.cells);
        let index = if cell > 0.0 { ((middle / cell) as usize).min(piece.cells as usize - 1) } else { 0 };
        let covered = &mut self.cells[piece.first_cell as usize + index];
        if self.sparse || f64::from(*covered) * f64::from(*covered) <= joint {
            return;
        }
        let before = LocalRun::new(piece, before);
        let (start, end) = (index as f64 * cell, (index + 1) as f64 * cell);
        let square = (before.square_at(start).max(next.square_at(end)))
            .min(next.square_at(start).max(before.square_at(end)))
            .max(joint);
        *covered = covered.min(bound(square as f32, before.error.max(next.error) as f32, radius as f32));
    }
}

/// A distance as it is kept: never rounded down, and only up to the radius.
///
/// Rounding square and error to f32, the root, the sum and the product cost half a unit in the last place (or a unit of
/// `EPSILON / 2`) each; `4 EPSILON` makes up for all of them.
fn bound(square: f32, error: f32, radius: f32) -> f32 {
    let mm = (square.sqrt() + error) * (1.0 + 4.0 * f32::EPSILON);
    if mm <= radius { mm } else { f32::INFINITY }
}

/// The pieces about a run.
struct Near<'a> {
    strokes: &'a PenTarget,
    /// At first all pieces within `radius` of the run; then, behind them, those that matter to a part of it.
    candidates: &'a mut Vec<(f64, u32)>,
    radius: f64,
    tolerance: f64,
    /// What is no larger than this need not be known so well.
    largest: f64,
}

impl Near<'_> {
    /// Hands on bounds of the distance along the run between two points whose own distances are known: a bound at
    /// either end, between which the distance stays below the even slope, and the length they hold for. `common`
    /// are the distances of both points from one piece; `among` are the candidates.
    fn bound(
        &mut self,
        among: Range<usize>,
        ends: [(Point, f64); 2],
        common: [f64; 2],
        halvings: u32,
        to: &mut impl FnMut([f64; 2], f64),
    ) {
        let [(from, at_from), (end, at_end)] = ends;
        let length = distance(from, end);
        // Distance changes by no more than one goes: it is largest on the way where it rises from both ends alike.
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
            let index = self.candidates[candidate].1;
            let piece = &self.strokes.pieces[index as usize];
            let here = piece.distance(piece.local(middle));
            nearest = nearest.min(here);
            self.candidates.push((here, index));
        }
        if nearest > self.radius {
            let found = self.strokes.nearest(middle);
            nearest = found.0;
            self.candidates.push(found);
        }
        // Half the length away a piece can be nearer by that, and the nearest one further.
        let mut kept = first;
        let mut halves = [[f64::INFINITY; 2]; 2];
        for candidate in first..self.candidates.len() {
            let (here, index) = self.candidates[candidate];
            if here > nearest + length {
                continue;
            }
            self.candidates[kept] = (here, index);
            kept += 1;
            let [at_from, at_end] = self.strokes.pieces[index as usize].distances([from, end]);
            halves = [better(halves[0], [at_from, here]), better(halves[1], [here, at_end])];
        }
        self.candidates.truncate(kept);
        self.bound(first..kept, [ends[0], (middle, nearest)], halves[0], halvings - 1, to);
        self.bound(first..kept, [(middle, nearest), ends[1]], halves[1], halvings - 1, to);
        self.candidates.truncate(first);
    }
}

/// The pair whose larger value is the smaller.
fn better(known: [f64; 2], new: [f64; 2]) -> [f64; 2] {
    if new[0].max(new[1]) < known[0].max(known[1]) { new } else { known }
}

fn distance(a: Point, b: Point) -> f64 {
    (b - a).hypot2().sqrt()
}

#[cfg(test)]
mod tests {
    use super::{At, Chain, distance};
    use drawing::{Point, Vec2};
    use proptest::prelude::*;

    fn to_segment(p: Point, from: Point, to: Point) -> f64 {
        let along: Vec2 = to - from;
        let t = if along.hypot2() > 0.0 { (p - from).dot(along) / along.hypot2() } else { 0.0 };
        distance(p, from + t.clamp(0.0, 1.0) * along)
    }

    proptest! {
        /// Every point that was merged is as near to the run as promised, the run's points to the path too.
        #[test]
        fn merged_points_stay_beside_their_run(
            steps in prop::collection::vec((-0.1..1.0, -0.15..0.15), 1..60),
            bend in -0.02..0.02,
        ) {
            let merge = 0.1;
            let mut points = vec![Point::ZERO];
            let mut chain = Chain::new(Point::ZERO, At { row: 0, t_us: 0 }, None, false);
            for (index, (x, y)) in steps.iter().enumerate() {
                let next = points[points.len() - 1] + Vec2::new(*x, y + bend * index as f64);
                if !chain.extend(next, 0.0, merge, f64::INFINITY) {
                    break;
                }
                points.push(next);
            }
            let run = chain.run(merge);
            let allowed = if points.len() > 2 { merge } else { 0.0 } + 1e-9;
            prop_assert!(run.error <= allowed);
            prop_assert_eq!(run.to, points[points.len() - 1]);
            for p in &points {
                let off = to_segment(*p, run.from, run.to);
                prop_assert!(off <= allowed, "{off} in {points:?}");
            }
            for k in 0..=100 {
                let p = run.from.lerp(run.to, f64::from(k) / 100.0);
                let off = points.windows(2).map(|pair| to_segment(p, pair[0], pair[1])).fold(f64::INFINITY, f64::min);
                prop_assert!(off <= allowed, "{off} in {points:?}");
            }
        }
    }
}
