//! What ordering brought.

use drawing::{Point, Stroke};

use crate::{Cost, Options, distance};

/// What [`optimize`](crate::optimize) did. Travel is all that is moved with the pen up: from the start to the first
/// stroke, between strokes, and from the last stroke to the park position, where there are such.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Strokes handed in.
    pub strokes_before: usize,
    /// Strokes handed back: every one is a lift and a drop of the pen.
    pub strokes_after: usize,
    /// Strokes saved by joining what touches.
    pub merged: usize,
    /// Strokes removed because other strokes draw the same.
    pub duplicates_removed: usize,
    /// Travel of the file's order, in the unit of the cost.
    pub travel_cost_before: f64,
    /// Travel of the new order, in the unit of the cost.
    pub travel_cost_after: f64,
    /// Travel of the file's order, mm.
    pub travel_mm_before: f64,
    /// Travel of the new order, mm.
    pub travel_mm_after: f64,
}

/// The travel of strokes drawn in this order: by the cost, and in mm.
pub(crate) fn travel(strokes: &[Stroke], cost: &dyn Cost, options: &Options) -> (f64, f64) {
    let mut from = options.start;
    let mut total = (0.0, 0.0);
    let mut go = |from: Option<Point>, to: Option<Point>| {
        if let (Some(from), Some(to)) = (from, to) {
            total = (total.0 + cost.between(from, to), total.1 + distance(from, to));
        }
    };
    for stroke in strokes {
        go(from, Some(stroke.start()));
        from = Some(stroke.end());
    }
    if !strokes.is_empty() {
        go(from, options.park);
    }
    total
}
