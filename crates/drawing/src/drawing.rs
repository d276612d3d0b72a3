//! Drawings.

use kurbo::{Affine, Rect};

use crate::{Pen, Side, Strokes, clip_stroke};

/// The ink on the paper: strokes in the order in which they are drawn; mm, y up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// The strokes.
    pub strokes: Strokes,
}

impl<S: Into<Strokes>> From<S> for Drawing {
    fn from(strokes: S) -> Self {
        Self { strokes: strokes.into() }
    }
}

impl Drawing {
    /// Whether there are no strokes.
    pub fn is_empty(&self) -> bool {
        self.strokes.is_empty()
    }

    /// The bounding box of all strokes, mm; `None` for an empty drawing.
    pub fn bounding_box(&self) -> Option<Rect> {
        self.strokes.iter().map(|stroke| stroke.bounding_box()).reduce(|bounds, other| bounds.union(other))
    }

    /// The length of all strokes, mm.
    pub fn length(&self) -> f64 {
        self.strokes.iter().fold(0.0, |sum, stroke| sum + stroke.length())
    }

    /// Applies an affine map to every stroke.
    pub fn transform(&mut self, map: Affine) {
        self.strokes.transform(map);
    }

    /// The parts of its strokes on one side of the window; see [`clip_stroke`].
    #[must_use]
    pub fn clipped(&self, window: Rect, side: Side) -> Self {
        Self { strokes: self.strokes.iter().flat_map(|stroke| clip_stroke(&stroke, window, side)).collect() }
    }

    /// The pens of its strokes, each once, in ascending order.
    pub fn pens(&self) -> Vec<Pen> {
        self.strokes.pens()
    }
}
