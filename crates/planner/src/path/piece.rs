//! Pieces and sections: curves with a parametrization whose derivative is continuous.

use drawing::Segment;

/// A stretch of a section, with the path's parameter `s` running evenly in the curve's own parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// The curve.
    pub curve: Segment,
    /// dt/ds, 1/mm: how fast the curve's own parameter runs.
    pub rate: f64,
    /// Whether rows on it may deviate because of how the pen speeds up: on turns and near them.
    pub near_corner: bool,
}

impl Piece {
    /// Its extent in `s`, mm.
    pub fn length(&self) -> f64 {
        1.0 / self.rate
    }
}

/// Pieces that follow one another with a continuous derivative dp/ds; at least one.
///
/// `s` is arc length on lines and circles. On blends it runs evenly in time when the pen's velocity changes evenly, and
/// on ellipses and cubics in the curve's own parameter; each piece's rate is chosen so that dp/ds, not only its
/// direction, is the same on both sides of every joint. So ds/dt needs no jumps.
pub type Section = Vec<Piece>;
