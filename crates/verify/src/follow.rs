//! Following: a fast path for drawings with hundreds of strokes near each run.
//!
//! Where strokes are that close, examining all of them for every run takes too long. Then only
//! those stretches of strokes are examined that have stayed near since the pen came here. Every
//! distance found this way is still an upper bound. Strokes that begin or end near the pen join in,
//! because ordering may have joined them to the one that is being drawn. What may be lost is that ink
//! covers a stroke in passing; so a table that fails while following is measured again in full, see
//! [`crate::certify`].

use std::collections::VecDeque;
use std::ops::Range;

use drawing::{Point, Rect, distance};

use crate::{
    run::Run,
    target::{PenTarget, meet},
};

/// Number of pieces near a run from which on strokes are followed.
pub(crate) const CROWD: usize = 48;

/// Following continues while the distance is below this share of the radius, which is less than the
/// deviation of a plan that holds can be.
pub(crate) const FOLLOWED: f64 = 0.75;

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
        candidates: &mut Vec<(f64, u32)>,
    ) -> bool {
        if self.followed.is_empty() {
            return false;
        }
        let meets = |index: u32| {
            let piece = &strokes.pieces[index as usize];
            meet(piece.bounds(), bounds) && piece.may_be_near(run.from, run.to, radius)
        };
        let stroke = |index: u32| strokes.pieces[index as usize].stroke;
        let count = strokes.pieces.len() as u32;
        let followed = &mut self.followed;
        let before = followed.len();
        strokes.visit_ends(bounds, |index, _| {
            if meets(index) && !followed.iter().any(|stretch| stretch.contains(&index)) {
                followed.push(index..index + 1);
            }
        });
        let joined = followed.len() > before;
        candidates.clear();
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
        if joined {
            // Two ends of one stroke may have grown together.
            self.followed.sort_unstable_by_key(|stretch| (stretch.start, stretch.end));
            self.followed.dedup();
        }
        // Near enough that a plan that holds need not look further.
        let near = |point: Point| {
            let mut pieces = candidates.iter().map(|(_, index)| &strokes.pieces[*index as usize]);
            pieces.any(|piece| piece.distance(piece.local(point)) <= FOLLOWED * radius)
        };
        if near(run.from) && near(run.to) {
            return true;
        }
        self.followed.clear();
        false
    }

    /// Follows the stretches of strokes near `point` from now on.
    pub(crate) fn start(
        &mut self,
        strokes: &PenTarget,
        point: Point,
        radius: f64,
        candidates: &[(f64, u32)],
    ) {
        let is_near = |index: &u32| {
            let piece = &strokes.pieces[*index as usize];
            piece.distance(piece.local(point)) <= radius
        };
        let mut near: Vec<u32> = candidates.iter().map(|(_, index)| *index).filter(is_near).collect();
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
