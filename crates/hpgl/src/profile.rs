//! What the file does not say: the plotter that it is read for.

use drawing::{Point, Rect};

use crate::units::PLOTTER_UNIT_MM;

/// What the file does not say.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Size of a plotter unit, mm: 0.025 by default.
    pub plotter_unit_mm: f64,
    /// The scaling points P1 and P2 until the file sets others, plotter units.
    pub scaling_points: (Point, Point),
    /// The area that the plotter can reach, plotter units. `RO` turns within it and `IR` measures by it; ink is not
    /// clipped to it, since many files are made for larger plotters than they name.
    pub hard_clip: Rect,
    /// The byte that ends labels until `DT` names another; ETX (3) if nothing is given.
    pub label_terminator: Option<u8>,
}

impl Default for Options {
    /// An HP 7475A with A4 paper (its P1, P2 and hard clip limits), but with the plotter unit of all other machines.
    fn default() -> Self {
        Self {
            plotter_unit_mm: PLOTTER_UNIT_MM,
            scaling_points: (Point::new(603.0, 521.0), Point::new(10603.0, 7721.0)),
            hard_clip: Rect::new(0.0, 0.0, 11040.0, 7721.0),
            label_terminator: None,
        }
    }
}
