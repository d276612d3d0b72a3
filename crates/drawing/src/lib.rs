//! Geometry of a pen drawing: what ends up on paper, and nothing about how it was said or how it will be driven.
//!
//! Units are millimetres, y points up, angles are radians, counterclockwise positive. A [`Drawing`] is a list of
//! [`Stroke`]s; a stroke is a connected path drawn with one pen, made of straight [`Segment`]s, elliptic arcs and
//! cubics. Arcs stay arcs: flattening is the business of whoever needs chords, at the tolerance he needs.
//!
//! Points, vectors and affine maps are kurbo's; transcendental functions come from `libm`, so that the same drawing
//! has the same bits on every platform.

mod arc;
mod clip;
mod hatch;
mod lattice;
mod segment;
mod stroke;

pub use arc::EllipticArc;
pub use clip::clip_segment;
pub use hatch::{FillRule, HatchGrid, HatchLine};
pub use kurbo::{Affine, CubicBez, Line, Point, Rect, Vec2};
pub use lattice::Pitch;
pub use segment::Segment;
pub use stroke::{Drawing, Pen, Span, Stroke};
