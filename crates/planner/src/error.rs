//! Why a drawing cannot be planned.

use drawing::{Pen, Point, Span};
use kinematics::OutOfReach;

/// Why a drawing cannot be planned on a machine.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// A stroke leaves the machine's reach. The point and the reason are in the source, which the
    /// message does not repeat.
    #[error("stroke {} (pen {}) leaves the machine's reach", stroke + 1, pen.0)]
    OutOfReach {
        /// Index of the stroke in the drawing.
        stroke: usize,
        /// The stroke's pen.
        pen: Pen,
        /// Byte range of the stroke in the source file.
        span: Span,
        /// The point and the reason.
        source: OutOfReach,
    },
    /// The motors cannot move the pen from one stroke to another without passing a singular pose.
    #[error(
        "there is no way with the pen up from {:.1}, {:.1} mm to {:.1}, {:.1} mm: the mechanism would pass a \
         singular pose", from.x, from.y, to.x, to.y
    )]
    NoTravel {
        /// Where the pen is, machine mm.
        from: Point,
        /// Where it is to go, machine mm.
        to: Point,
    },
    /// The drawing is empty.
    #[error("the drawing has no ink")]
    NoInk,
    /// A setting is outside its valid range.
    #[error("{what}")]
    Setting {
        /// The setting and its valid range.
        what: &'static str,
    },
    /// No placement of the drawing fits the machine.
    #[error("the drawing cannot be placed: {why}")]
    NoPlacement {
        /// The reason.
        why: &'static str,
    },
    /// The plan would be too long.
    #[error("the plan would have {rows} rows, more than {max}: choose a longer period or higher limits")]
    TooManyRows {
        /// The number of rows.
        rows: u64,
        /// The largest number.
        max: u64,
    },
}
