//! Geometry of a pen drawing: strokes of lines, elliptic arcs and cubic Bézier curves.
//!
//! Units are millimetres and radians. y points up, angles are counterclockwise. A [`Drawing`] is a
//! list of [`Stroke`]s, packed in [`Strokes`]. A stroke is a connected path drawn with one pen; its pieces are
//! [`Segment`]s. Arcs and curves are kept exact; the consumer flattens them at its own tolerance.
//!
//! This crate knows no input format, machine, time or file.
//!
//! Points, vectors and affine maps are those of kurbo. Transcendental functions come from `libm`,
//! so that a drawing has the same bits on every platform.
//!
//! ```
//! use drawing::{Affine, Drawing, EllipticArc, Pen, Point, Span, Stroke};
//! use std::f64::consts::{PI, TAU};
//!
//! // A half circle on a line, drawn in one stroke with pen 1.
//! let mut arch = Stroke::new(Pen(1), Point::new(0.0, 0.0), Span::default());
//! arch.line_to(Point::new(20.0, 0.0));
//! arch.arc(EllipticArc::circular(Point::new(10.0, 0.0), 10.0, 0.0, PI));
//! assert!(arch.end().distance(Point::new(0.0, 0.0)) < 1e-12);
//! assert!((arch.length() - (20.0 + 10.0 * PI)).abs() < 1e-9);
//!
//! // An arc stays an arc under every affine map, mirroring and unequal scales included.
//! let circle = EllipticArc::circular(Point::new(1.0, 2.0), 3.0, 0.0, TAU);
//! assert_eq!(circle.circle_radius(), Some(3.0));
//! let ellipse = circle.transformed(Affine::new([-2.0, 0.0, 0.0, 1.0, 0.0, 0.0]));
//! assert_eq!(ellipse.circle_radius(), None);
//! assert_eq!(ellipse.semi_axes(), (6.0, 3.0));
//!
//! // Chords within 0.01 mm of the stroke.
//! let chords = arch.flatten(0.01);
//! assert!(chords.len() > 30 && chords.len() < 60);
//!
//! // A drawing holds its strokes packed, and makes them when they are asked for.
//! let drawing = Drawing::from(vec![arch.clone()]);
//! assert_eq!(drawing.pens(), [Pen(1)]);
//! assert_eq!(drawing.strokes.iter().next(), Some(arch));
//! ```

mod arc;
mod clip;
mod distance;
mod drawing;
mod figures;
mod hatch;
mod lattice;
mod path;
mod segment;
mod simplify;
mod stroke;
mod strokes;

pub use arc::EllipticArc;
pub use clip::{Side, clip_segment, clip_stroke};
pub use distance::{distance, distance_to_line};
pub use drawing::Drawing;
pub use figures::Figures;
pub use hatch::{FillRule, HatchGrid, HatchLine};
pub use kurbo::{Affine, CubicBez, Line, Point, Rect, Vec2};
pub use lattice::Pitch;
pub use path::Trail;
pub use segment::Segment;
pub use simplify::kept_vertices;
pub use stroke::{Pen, Span, Stroke};
pub use strokes::{IntoIter, Iter, Lettering, Strokes};
