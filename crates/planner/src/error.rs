//! Why a drawing cannot be planned.

use drawing::{Pen, Span};
use kinematics::OutOfReach;

/// Why a drawing cannot be planned on a machine.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// A stroke leaves what the machine can reach.
    #[error("stroke {} (pen {}): {source}", stroke + 1, pen.0)]
    OutOfReach {
        /// Index of the stroke in the drawing.
        stroke: usize,
        /// Its pen.
        pen: Pen,
        /// Where the source says it.
        span: Span,
        /// The point and the reason.
        source: OutOfReach,
    },
    /// There is nothing to draw.
    #[error("the drawing has no ink")]
    NoInk,
    /// A setting makes no sense.
    #[error("{what}")]
    Setting {
        /// What is wrong with which.
        what: String,
    },
    /// No placement of the drawing fits the machine.
    #[error("the drawing cannot be placed: {why}")]
    NoPlacement {
        /// Why not.
        why: String,
    },
}
