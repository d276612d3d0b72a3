//! The effect of ordering.

use drawing::{Point, Stroke};

use crate::{Cost, Options, distance};

/// The effect of [`optimize`](crate::optimize). Travel is pen-up motion: from the start to the
/// first stroke, between strokes, and from the last stroke to the park position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Number of strokes in the input.
    pub strokes_before: usize,
    /// Number of strokes in the output; each takes a drop and a lift of the pen.
    pub strokes_after: usize,
    /// Number of strokes saved by merging.
    pub merged: usize,
    /// Number of duplicate strokes removed.
    pub duplicates_removed: usize,
    /// Travel in file order, in the unit of the cost.
    pub travel_cost_before: f64,
    /// Travel in the new order, in the unit of the cost.
    pub travel_cost_after: f64,
    /// Travel in file order, mm.
    pub travel_mm_before: f64,
    /// Travel in the new order, mm.
    pub travel_mm_after: f64,
}

/// The travel of strokes in this order: in the unit of the cost, and in mm.
pub(crate) fn travel<'a>(
    strokes: impl IntoIterator<Item = &'a Stroke>,
    cost: &dyn Cost,
    options: &Options,
) -> (f64, f64) {
    let mut from = options.start;
    let mut total = (0.0, 0.0);
    let mut go = |from: Option<Point>, to: Option<Point>| {
        if let (Some(from), Some(to)) = (from, to) {
            total = (total.0 + cost.between(from, to), total.1 + distance(from, to));
        }
    };
    let mut is_empty = true;
    for stroke in strokes {
        go(from, Some(stroke.start()));
        from = Some(stroke.end());
        is_empty = false;
    }
    if !is_empty {
        go(from, options.park);
    }
    total
}
