//! Pieces and sections: curves with a parametrization whose derivative is continuous.

use drawing::Segment;

/// A part of a section. The path's parameter `s` is proportional to the curve's own parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// The curve.
    pub curve: Segment,
    /// dt/ds, 1/mm: the rate of the curve's own parameter `t`.
    pub rate: f64,
    /// Whether rows on it deviate when the pen accelerates along it: in corners and near them.
    pub near_corner: bool,
    /// On a piece of a fitted spline, `|p'|² k` with the largest curvature `k` within reach of a row,
    /// 1/mm; 0 if rows are so close together that they need no such bound. `None` on all others.
    pub row_bound: Option<f64>,
}

impl Piece {
    /// Its length in `s`, mm.
    pub fn length(&self) -> f64 {
        1.0 / self.rate
    }
}

/// Consecutive pieces with a continuous derivative dp/ds; at least one.
///
/// `s` is arc length on lines and circles. On blends it is proportional to time when the pen's
/// velocity changes linearly; on ellipses and cubics it is proportional to the curve's own
/// parameter. The rate of each piece is such that dp/ds, not only its direction, is continuous at
/// every junction, so ds/dt is continuous too.
pub type Section = Vec<Piece>;
