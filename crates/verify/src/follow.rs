//! Following: a fast path for drawings with hundreds of strokes near each run.
//!
//! Where strokes are that close, examining all of them for every run takes too long. Then only
//! those pieces are examined that the run may draw ([`Line::is_alongside`]), and then those stretches of
//! strokes that have stayed near since the pen came here. Every distance found this way is still an
//! upper bound. Strokes that begin or end where a followed stroke does join in, because ordering may
//! have joined them. What may be lost is that ink covers a stroke in passing; so a table that fails while
//! following is measured again in full, see [`crate::certify`].
//!
//! [`Line::is_alongside`]: crate::target::Line::is_alongside

use std::collections::VecDeque;
use std::ops::Range;

use drawing::{Point, Rect, distance};

use crate::{
    near::Candidate,
    run::Run,
    target::{PenTarget, meet},
};

/// Number of pieces near a run from which on strokes are followed.
pub(crate) const CROWD: usize = 48;

/// Following continues while the distance is below this share of the radius, which is less than the
/// deviation of a plan that holds can be.
pub(crate) const FOLLOWED: f64 = 0.75;

/// Two strokes touch if their ends are at most this far apart, as a share of the radius. Ordering
/// joins ends within 1.5e-6 mm.
const TOUCH: f64 = 1e-3;

/// The stretches of strokes that are being followed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Follower {
    /// Ranges of pieces; empty while everything is examined.
    followed: Vec<Range<u32>>,
    /// The latest runs while strokes are followed, with those before them.
    recent: VecDeque<(Run, Option<Run>)>,
}

impl Follower {
    /// Starts again: nothing is followed, no run is remembered.
    pub(crate) fn reset(&mut self) {
        self.followed.clear();
        self.recent.clear();
    }

    /// Stops following, and forgets the last run, which will be measured again.
    pub(crate) fn fail(&mut self) {
        self.followed.clear();
        self.recent.pop_back();
    }

    /// Takes the runs that were measured while following.
    pub(crate) fn take_recent(&mut self) -> VecDeque<(Run, Option<Run>)> {
        std::mem::take(&mut self.recent)
    }

    /// Advances the followed stretches to the run and makes their pieces the candidates. Returns
    /// false if nothing is followed, or if no followed piece is near enough to the run.
    ///
    /// `bounds` is the bounding box of the run, inflated by the radius.
    pub(crate) fn advance(
        &mut self,
        strokes: &PenTarget,
        run: &Run,
        bounds: Rect,
        radius: f64,
        candidates: &mut Vec<Candidate>,
    ) -> bool {
        if self.followed.is_empty() {
            return false;
        }
        let meets = |index: u32| {
            let piece = &strokes.pieces[index as usize];
            meet(piece.bounds(), bounds) && piece.may_be_near(run.from, run.to, radius)
        };
        self.followed.retain_mut(|stretch| advance_stretch(stretch, strokes, meets));
        self.followed.retain(|stretch| is_near(stretch, strokes, run.from, FOLLOWED * radius));
        self.join(strokes, bounds, TOUCH * radius, meets);
        candidates.clear();
        candidates.extend(self.followed.iter().cloned().flatten().map(Candidate::new));
        // Near enough that a plan that holds need not look further.
        let near = |point: Point| {
            self.followed.iter().any(|stretch| is_near(stretch, strokes, point, FOLLOWED * radius))
        };
        if near(run.from) && near(run.to) {
            return true;
        }
        self.followed.clear();
        false
    }

    /// Strokes that begin or end in `bounds`, within `touch` of an end of a followed stroke, are
    /// followed from there, if their piece there meets the run.
    fn join(&mut self, strokes: &PenTarget, bounds: Rect, touch: f64, meets: impl Fn(u32) -> bool) {
        let mut visited: Vec<Point> = Vec::new();
        let mut found = Vec::new();
        for stretch in &self.followed {
            let [start, end] = [stretch.start, stretch.end - 1].map(|index| strokes.ends_of(index));
            for point in [start[0], end[1]].into_iter().flatten() {
                if bounds.contains(point) && visited.iter().all(|known| distance(*known, point) > 0.5 * touch)
                {
                    visited.push(point);
                    let near = Rect::from_points(point, point).inflate(touch, touch);
                    strokes.visit_ends(near, |index| found.push(index));
                }
            }
        }
        // Sorted by where they start: a piece belongs to the last stretch that starts at or before it.
        self.followed.sort_unstable_by_key(|stretch| (stretch.start, stretch.end));
        let known = |index: u32| {
            let after = self.followed.partition_point(|stretch| stretch.start <= index);
            after > 0 && self.followed[after - 1].contains(&index)
        };
        found.retain(|index| meets(*index) && !known(*index));
        found.sort_unstable();
        found.dedup();
        for index in found {
            let mut stretch = index..index + 1;
            advance_stretch(&mut stretch, strokes, &meets);
            self.followed.push(stretch);
        }
        // Two stretches of one stroke may have grown together.
        self.followed.sort_unstable_by_key(|stretch| (stretch.start, stretch.end));
        self.followed.dedup();
    }

    /// Follows the stretches of strokes near `point` from now on.
    pub(crate) fn start(&mut self, strokes: &PenTarget, point: Point, radius: f64, candidates: &[Candidate]) {
        let is_near = |index: &u32| {
            let piece = &strokes.pieces[*index as usize];
            piece.distance(piece.local(point)) <= radius
        };
        let mut near: Vec<u32> = candidates.iter().map(|candidate| candidate.index).filter(is_near).collect();
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

    /// Remembers the run while the pen is near it.
    pub(crate) fn remember(&mut self, run: Run, before: Option<Run>, radius: f64) {
        self.recent.push_back((run, before));
        while self.recent.len() > 1 && distance(self.recent[1].0.from, run.to) > 2.0 * radius {
            self.recent.pop_front();
        }
    }
}

/// Extends the stretch by the pieces of its stroke that meet the run, and drops those at its ends that
/// do not. Returns false if none is left.
fn advance_stretch(stretch: &mut Range<u32>, strokes: &PenTarget, meets: impl Fn(u32) -> bool) -> bool {
    let stroke = |index: u32| strokes.pieces[index as usize].stroke;
    let count = strokes.pieces.len() as u32;
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
    stretch.start < stretch.end
}

/// Whether a piece of the stretch is within `distance` of the point.
fn is_near(stretch: &Range<u32>, strokes: &PenTarget, point: Point, distance: f64) -> bool {
    let mut pieces = stretch.clone().map(|index| &strokes.pieces[index as usize]);
    pieces.any(|piece| piece.distance(piece.local(point)) <= distance)
}

#[cfg(test)]
mod tests {
    use drawing::{Drawing, Pen, Span, Stroke};

    use super::*;
    use crate::{run::At, target::Target};

    const RADIUS: f64 = 0.5;
    const STEP: f64 = 0.2;

    /// The strokes followed by a pen that moves along x from (0, 0) to `end`, after the last step.
    fn followed_at(end: f64, lines: &[[(f64, f64); 2]]) -> Vec<u32> {
        let strokes = lines
            .iter()
            .filter_map(|line| Stroke::polyline(Pen(1), line.map(Point::from).to_vec(), Span::default()));
        let strokes = Target::new(&Drawing { strokes: strokes.collect() }, 0.1, &|_| {}).pens.remove(0);
        let mut follower = Follower::default();
        let mut candidates: Vec<Candidate> = (0..strokes.pieces.len() as u32).map(Candidate::new).collect();
        follower.start(&strokes, Point::ZERO, RADIUS, &candidates);
        for step in 0..(end / STEP) as usize {
            let x = step as f64 * STEP;
            let (from, to) = (Point::new(x, 0.0), Point::new(x + STEP, 0.0));
            let run = Run { from, to, error: 0.0, at: At { row: 0, t_us: 0 } };
            let bounds = Rect::from_points(from, to).inflate(RADIUS, RADIUS);
            assert!(follower.advance(&strokes, &run, bounds, RADIUS, &mut candidates), "lost at {x}");
        }
        let mut found: Vec<u32> =
            candidates.iter().map(|candidate| strokes.pieces[candidate.index as usize].stroke).collect();
        found.dedup();
        found
    }

    #[test]
    fn strokes_that_cross_or_end_beside_the_pen_are_not_followed() {
        let drawn = [(0.0, 0.0), (30.0, 0.0)];
        let across = [(0.0, -5.0), (0.1, 5.0)];
        let slanted = [(-2.0, -0.1), (20.0, 4.0)];
        let beside = [(10.0, 0.3), (10.0, 9.0)];
        assert_eq!(followed_at(11.0, &[across, slanted, beside, drawn]), [3]);
        assert_eq!(followed_at(29.0, &[across, slanted, beside, drawn]), [3]);
    }

    #[test]
    fn strokes_that_continue_a_followed_stroke_are_followed() {
        let lines = [[(0.0, 0.0), (5.0, 0.0)], [(9.0, 0.0), (5.0, 0.0)], [(9.0, 0.0), (14.0, 0.0)]];
        assert_eq!(followed_at(13.0, &lines), [2]);
    }
}
