//! Strokes as splines within the tolerance, on which the pen is faster than on the drawing itself.
//!
//! A stroke of many short lines, or of noisy ones, bends at every vertex, however well its corners
//! are blended. Within the tolerance there are smoother paths, and the fastest of them takes as
//! little as half of the time. A stroke becomes one cubic spline with a continuous second
//! derivative:
//!
//! 1. `samples`: all vertices after simplification, and points between them.
//! 2. `tube`: the smoothest spline whose knots stay within a radius r of the samples.
//! 3. `joint`: from there, path and speed together, the fastest such spline; `joint_jerk` under jerk
//!    limits.
//! 4. `proof`: between the knots too, spline and drawing are within r of each other in both
//!    directions; where they are not, r is reduced at the knots around and the fit is repeated there.
//!
//! Long strokes are fitted in blocks of knots that overlap, with the knots outside of a block fixed:
//! one tight place would limit the steps of the whole stroke. All numbers of steps are fixed, so the
//! result is deterministic and the cost linear in the length.
//!
//! The whole deviation is at most that of cleaning up (`merge`, `simplify`, and chords of curves
//! with a cusp) plus r: each step is within its own bound of the step before, in both directions,
//! and such distances add up (triangle inequality of the Hausdorff distance).

mod banded;
mod joint;
mod joint_jerk;
mod limits;
mod proof;
mod samples;
mod spline;
mod tube;

use std::ops::Range;

use drawing::{Line, Point, Segment, Stroke, Vec2};

use super::{
    clean, is_regular,
    piece::{Piece, Section},
    simplify::{deviation, simplify},
    tangent::distance,
};
pub use limits::Limits;
use samples::{Grading, Samples};
use spline::Spline;
use tube::Energy;

/// Shares of the path's tolerance: chords of curves with a cusp, if there are any,
const CHORD: f64 = 0.05;
/// vertices closer than this to the one before, which would only make the spans uneven,
const MERGE: f64 = 0.02;
/// and simplification. The rest is the radius of the tube.
const SIMPLIFY: f64 = 0.08;

/// The cautious radius at first, as a share of what is proved afterwards: between knots the spline bulges.
const CAUTIOUS: f64 = 0.985;

/// The radius as a share of the stroke's extent, at most: within a larger one a small circle would
/// shrink to a dot.
const EXTENT_SHARE: f64 = 0.25;

/// The same where the ends are far apart.
const OPEN_EXTENT_SHARE: f64 = 0.4;

/// Weight of `|S'''|²` next to `|S''|²`, mm².
const THIRD: f64 = 0.05;

/// Newton steps at each weight of the barrier, before the joint fit and without it.
const STEPS_BEFORE_JOINT: usize = 2;
const STEPS_ALONE: usize = 6;

/// Number of knots of a block, and by how many blocks overlap: the effect of a cut decays to 0.1 %
/// of the time over 30 knots.
const BLOCK: usize = 300;
const OVERLAP: usize = 30;

/// Largest number of repetitions with smaller radii.
const ROUNDS: usize = 8;

/// Number of knots on both sides of a failure that are fitted again.
const AROUND: usize = 24;

/// What the fit aims at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim {
    /// The fastest path without jerk limits.
    Fastest,
    /// The smoothest path.
    Smoothest,
    /// The fastest path under jerk limits.
    FastestUnderJerk,
}

/// The stroke as a spline within `tolerance` mm; `None` for strokes that are one line or a dot, and
/// where no spline is found: outside the reach, or if the radius would become too small.
///
/// `cautious` takes fewer samples and steps, a smaller radius, and discs within the reach, for strokes where the
/// proof fails or the spline leaves the reach.
pub fn fitted(
    stroke: &Stroke,
    limits: &Limits<'_>,
    tolerance: f64,
    aim: Aim,
    cautious: bool,
) -> Option<Section> {
    let all_regular = stroke.segments().all(|segment| is_regular(&segment));
    let chord = if all_regular { 0.0 } else { CHORD * tolerance };
    let cleaned = clean(stroke, if all_regular { 1.0 } else { chord });
    let all = cleaned.len();
    let merged = merge(cleaned, MERGE * tolerance);
    let moved = if merged.len() == all { 0.0 } else { MERGE * tolerance };
    let pieces = simplify(&merged, SIMPLIFY * tolerance);
    if matches!(pieces[..], [] | [Segment::Line(_)]) {
        return None;
    }
    // What was not needed so far makes corners faster.
    let radius = tolerance - moved - deviation(&merged, &pieces) - chord;
    let grading = if aim == Aim::Fastest { Grading::FAST } else { Grading::SMOOTH };
    if cautious {
        let radius = tolerance - (MERGE + SIMPLIFY) * tolerance - chord;
        let samples = Samples::of(&pieces, tolerance, grading.without_corners());
        return Fit::new(samples, radius, true)?.within_reach(limits).run(limits, aim);
    }
    Fit::new(Samples::of(&pieces, tolerance, grading), radius, false)?.run(limits, aim)
}

/// Removes vertices of sequences of lines that are within half of `least` of the last one kept; the
/// end of a sequence replaces such a vertex. All points move by at most `least`.
fn merge(pieces: Vec<Segment>, least: f64) -> Vec<Segment> {
    let mut merged = Vec::with_capacity(pieces.len());
    let mut run: Vec<Point> = Vec::new();
    let mut end: Option<Point> = None;
    for piece in pieces {
        match piece {
            Segment::Line(line) => {
                if run.is_empty() {
                    run.push(line.p0);
                }
                end = Some(line.p1);
                if distance(run[run.len() - 1], line.p1) >= 0.5 * least {
                    run.push(line.p1);
                }
            }
            curve => {
                finish(&mut run, end.take(), &mut merged);
                merged.push(curve);
            }
        }
    }
    finish(&mut run, end, &mut merged);
    merged
}

/// Appends the lines of a sequence that ends at `end`.
fn finish(run: &mut Vec<Point>, end: Option<Point>, to: &mut Vec<Segment>) {
    if let Some(end) = end
        && run.last() != Some(&end)
    {
        if run.len() > 1 {
            run.pop();
        }
        run.push(end);
    }
    to.extend(run.windows(2).map(|pair| Segment::Line(Line::new(pair[0], pair[1]))));
    run.clear();
}

/// The fit of one stroke.
struct Fit {
    samples: Samples,
    spline: Spline,
    /// The bound that is proved, mm.
    bound: f64,
    /// The disc within which each knot is: its center, the sample unless that is near the edge of
    /// the reach, and its radius, mm.
    centers: Vec<Point>,
    radii: Vec<f64>,
    energy: Energy,
    /// Whether the first attempt was not proved or left the reach.
    cautious: bool,
}

impl Fit {
    fn new(samples: Samples, radius: f64, cautious: bool) -> Option<Self> {
        if samples.points.windows(2).any(|pair| pair[0] == pair[1]) {
            return None;
        }
        let (first, last) = (samples.points[0], samples.points[samples.points.len() - 1]);
        let extent = samples.extent();
        let share = if distance(first, last) > 0.5 * extent { OPEN_EXTENT_SHARE } else { EXTENT_SHARE };
        let bound = radius.min(share * extent);
        let spline = Spline::through(&samples.points);
        let energy = Energy::new(&spline, 1.0, THIRD);
        let at_first = if cautious { CAUTIOUS } else { 1.0 };
        let radii = vec![at_first * bound; samples.points.len()];
        let centers = samples.points.clone();
        Some(Self { samples, spline, bound, centers, radii, energy, cautious })
    }

    /// With smaller discs at the edge of the reach, so that the spline does not leave it.
    fn within_reach(mut self, limits: &Limits<'_>) -> Self {
        for i in 1..self.count() - 1 {
            (self.centers[i], self.radii[i]) = limits.disc_within_reach(self.centers[i], self.radii[i]);
        }
        if self.centers != self.samples.points {
            self.spline = Spline::through(&self.centers);
            self.energy = Energy::new(&self.spline, 1.0, THIRD);
        }
        self
    }

    /// The number of knots.
    fn count(&self) -> usize {
        self.samples.points.len()
    }

    fn run(mut self, limits: &Limits<'_>, aim: Aim) -> Option<Section> {
        let mut blocks = blocks(1..self.count() - 1);
        let mut interpolating = None;
        for _ in 0..ROUNDS {
            self.fit(limits, aim, &blocks)?;
            let failures = self.failures(&blocks);
            if failures.is_empty() {
                return Some(self.section());
            }
            for &(j, distance) in &failures {
                let factor = (1.0 - 1.3 * (distance / self.bound - 1.0) - 0.02).max(0.6);
                self.radii[j] *= factor;
                self.radii[j + 1] *= factor;
            }
            blocks = clusters(&failures, self.count());
            let through = interpolating.get_or_insert_with(|| self.spline.interpolating(&self.centers));
            for block in &blocks {
                restart(&mut self.spline, through, block);
            }
            let inside = |i: usize| {
                let e = self.spline.at_knot(i) - self.centers[i].to_vec2();
                e.hypot2() < self.radii[i] * self.radii[i]
            };
            if !blocks.iter().all(|block| block.clone().all(inside)) {
                self.spline.control.clone_from(through);
                blocks = self::blocks(1..self.count() - 1);
            }
        }
        None
    }

    /// Fits the knots of the blocks.
    fn fit(&mut self, limits: &Limits<'_>, aim: Aim, blocks: &[Range<usize>]) -> Option<()> {
        let Self { spline, centers, radii, energy, cautious, .. } = self;
        let steps = if aim == Aim::Fastest { STEPS_BEFORE_JOINT } else { STEPS_ALONE };
        let mut work = tube::Workspace::default();
        for block in blocks {
            tube::smooth(spline, centers, radii, energy, block.clone(), steps, &mut work);
        }
        // Where no start is feasible the smoothest path is kept.
        match aim {
            Aim::Smoothest => {}
            Aim::Fastest => {
                let most_steps = if *cautious { joint::STEPS } else { joint::MOST_STEPS };
                let problem = joint::Problem { limits, centers, radii, most_steps };
                let mut b = problem.gentle_speeds(spline)?;
                let mut work = joint::Workspace::default();
                for block in blocks {
                    let _: Option<()> = problem.minimize(spline, &mut b, block, &mut work);
                }
            }
            Aim::FastestUnderJerk => {
                let problem = joint_jerk::Problem { limits, centers, radii };
                let mut work = joint_jerk::Workspace::default();
                let Some(mut z) = problem.gentle_speeds(spline, &mut work) else { return Some(()) };
                for block in blocks {
                    let _: Option<()> = problem.minimize(spline, &mut z, block, &mut work);
                }
            }
        }
        Some(())
    }

    /// The spans around the blocks that are not within the bound, or whose ends are not within it of their
    /// samples, and by which distance.
    fn failures(&self, blocks: &[Range<usize>]) -> Vec<(usize, f64)> {
        let mut failures = Vec::new();
        let mut next = 0;
        for block in blocks {
            let spans = block.start.saturating_sub(2).max(next)..(block.end + 1).min(self.count() - 1);
            next = spans.end;
            failures.extend(spans.filter_map(|j| {
                let curve = self.spline.bezier(j);
                let ends = [(curve.p0, j), (curve.p3, j + 1)];
                let off = ends
                    .map(|(knot, i)| distance(knot, self.samples.points[i]))
                    .into_iter()
                    .fold(0.0, f64::max);
                if off > self.bound {
                    return Some((j, off));
                }
                proof::excess(&curve, j, &self.samples.spans, self.bound).map(|distance| (j, distance))
            }));
        }
        failures
    }

    fn section(&self) -> Section {
        let piece = |j: usize| Piece {
            curve: Segment::Cubic(self.spline.bezier(j)),
            rate: 1.0 / self.spline.span(j),
            near_corner: false,
            row_bound: Some(0.0),
        };
        (0..self.count() - 1).map(piece).collect()
    }
}

/// Overlapping blocks of a range of knots.
fn blocks(knots: Range<usize>) -> Vec<Range<usize>> {
    let mut blocks = Vec::new();
    let mut from = knots.start;
    loop {
        let to = from + BLOCK;
        // Do not leave a small rest.
        if to + BLOCK / 2 >= knots.end {
            blocks.push(from..knots.end);
            return blocks;
        }
        blocks.push(from..to);
        from = to - OVERLAP;
    }
}

/// The knots around failures, in blocks that do not overlap.
fn clusters(failures: &[(usize, f64)], count: usize) -> Vec<Range<usize>> {
    let mut blocks: Vec<Range<usize>> = Vec::new();
    for &(j, _) in failures {
        let block = (j + 1).saturating_sub(AROUND).max(1)..(j + 1 + AROUND).min(count - 1);
        match blocks.last_mut() {
            Some(last) if last.end + 3 >= block.start => last.end = last.end.max(block.end),
            _ => blocks.push(block),
        }
    }
    blocks
}

/// Replaces the control points of a block by those of the spline through the samples, which is
/// feasible with any radius; towards the block's ends, if they are not those of the stroke, by
/// combinations of both.
fn restart(spline: &mut Spline, through: &[Vec2], block: &Range<usize>) {
    let ramp = (AROUND / 2) as f64;
    let last = spline.count() - 2;
    for i in block.clone() {
        let before = if block.start == 1 { ramp } else { (i + 1 - block.start) as f64 };
        let after = if block.end > last { ramp } else { (block.end - i) as f64 };
        let share = (before.min(after) / ramp).min(1.0);
        spline.control[i] = spline.control[i].lerp(through[i], share);
    }
}

#[cfg(test)]
mod tests;
