//! Options of ordering.

use drawing::{Pen, Point};

/// Options of [`optimize`](crate::optimize).
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// 0: local optimum from several starts. 1, 2 (default), 3: perturbation search after that,
    /// each eight times as long as the one before.
    pub effort: u8,
    /// Removes strokes all of whose segments are drawn by other strokes of the same pen.
    pub dedupe: bool,
    /// Joins strokes whose ends touch (within 1e-6 mm) into the fewest possible strokes.
    pub merge: bool,
    /// Never reverses a stroke.
    pub keep_direction: bool,
    /// Pen position before the first stroke. If `None`, the first stroke costs nothing to reach.
    pub start: Option<Point>,
    /// Pen position after the last stroke. If `None`, there is no move after it.
    pub park: Option<Point>,
    /// Pen order. Pens that are not listed follow in the order of their first stroke.
    pub pen_order: Option<Vec<Pen>>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            effort: 2,
            dedupe: false,
            merge: true,
            keep_direction: false,
            start: None,
            park: None,
            pen_order: None,
        }
    }
}
