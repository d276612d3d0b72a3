//! Merging of chords to runs: straight lines that stand for a part of the pen's path.

use drawing::{Point, Vec2};

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct At {
    pub(crate) row: u64,
    pub(crate) t_us: u64,
}

/// A straight line that is at most `error` away from the part of the path that it stands for, in
/// both directions, mm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    pub(crate) from: Point,
    pub(crate) to: Point,
    pub(crate) error: f64,
    pub(crate) at: At,
}

/// Chords being merged: every line from `anchor` in a direction between `right` and `left` passes
/// all points of the chain within the merging distance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chain {
    anchor: Point,
    pub(crate) last: Point,
    pub(crate) chords: u32,
    /// Unit vectors (right, left); `None` while all directions are possible.
    cone: Option<(Vec2, Vec2)>,
    error: f64,
    at: At,
    /// The run before, if the pen came from there.
    pub(crate) before: Option<Run>,
    pub(crate) moved: bool,
}

impl Chain {
    pub(crate) fn new(anchor: Point, at: At, before: Option<Run>, moved: bool) -> Self {
        Self { anchor, last: anchor, chords: 0, cone: None, error: 0.0, at, before, moved }
    }

    /// Adds the chord from `last` to `point` if one line from the anchor then still passes all
    /// points within `merge`; returns whether it did. A first chord is always added.
    ///
    /// Each point narrows the cone of possible directions (Williams 1978, Sklansky and Gonzalez
    /// 1980). The points move away from the anchor monotonically, so none is beyond the line's end.
    /// The path is connected and inside a strip about the line over its whole length, so each point
    /// of the line has a point of the path beside it: `merge` bounds both directions.
    pub(crate) fn extend(&mut self, point: Point, error: f64, merge: f64, longest: f64) -> bool {
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

    pub(crate) fn run(&self, merge: f64) -> Run {
        let merged = if self.chords > 1 { merge } else { 0.0 };
        Run { from: self.anchor, to: self.last, error: self.error + merged, at: self.at }
    }
}

#[cfg(test)]
mod tests {
    use super::{At, Chain};
    use drawing::{Line, Point, Vec2, distance_to_line};
    use proptest::prelude::*;

    proptest! {
        /// Merged points are within the merging distance of the run, and points of the run of the
        /// path.
        #[test]
        fn merged_points_are_within_the_merging_distance(
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
                let off = distance_to_line(*p, Line::new(run.from, run.to));
                prop_assert!(off <= allowed, "{off} in {points:?}");
            }
            for k in 0..=100 {
                let p = run.from.lerp(run.to, f64::from(k) / 100.0);
                let off = points.windows(2).map(|pair| distance_to_line(p, Line::new(pair[0], pair[1]))).fold(f64::INFINITY, f64::min);
                prop_assert!(off <= allowed, "{off} in {points:?}");
            }
        }
    }
}
