//! Strokes.

use std::borrow::Cow;

use kurbo::{Affine, Point, Rect};

use crate::path::{Curve, Path};
use crate::{EllipticArc, Pitch, Segment};

/// A pen number of the drawing, from 1. 0 means "no pen" and never draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Pen(pub u16);

/// A half-open byte range of the source.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Span {
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

/// A connected path drawn with one pen, pen down from its first point to its last; mm.
///
/// Polylines on a lattice can be stored in 2 to 4 bytes a vertex ([`Stroke::on_lattice`]), others
/// take 16. The form of storage cannot be observed and changes on demand. A stroke of one vertex
/// and no segments is a **dot**.
#[derive(Clone, Debug)]
pub struct Stroke {
    /// The pen it is drawn with.
    pub pen: Pen,
    /// First byte and length of its source.
    pub(crate) source: [u32; 2],
    pub(crate) path: Path,
}

impl PartialEq for Stroke {
    fn eq(&self, other: &Self) -> bool {
        self.pen == other.pen
            && self.source == other.source
            && self.points().eq(other.points())
            && self.path.curves() == other.path.curves()
    }
}

impl Stroke {
    /// A dot at `start`, which can be extended.
    pub fn new(pen: Pen, start: Point, source: Span) -> Self {
        Self { pen, source: packed(source), path: Path::dot(start) }
    }

    /// A stroke through the given points; `None` without points.
    pub fn polyline(pen: Pen, points: Vec<Point>, source: Span) -> Option<Self> {
        Some(Self { pen, source: packed(source), path: Path::polyline(points)? })
    }

    /// A stroke through the given points; `None` without points.
    ///
    /// Stored compactly if all coordinates are multiples of `pitch` and all steps are short.
    pub fn on_lattice(pen: Pen, points: &[Point], source: Span, pitch: Pitch) -> Option<Self> {
        Some(Self { pen, source: packed(source), path: Path::on_lattice(points, pitch)? })
    }

    /// Byte range in the source. Offsets saturate at `u32::MAX`.
    pub fn source(&self) -> Span {
        let [start, length] = self.source.map(|number| number as usize);
        Span { start, end: start + length }
    }

    /// Sets the byte range in the source.
    pub fn set_source(&mut self, source: Span) {
        self.source = packed(source);
    }

    /// Appends a line segment to `point`.
    pub fn line_to(&mut self, point: Point) {
        self.path.line_to(point);
    }

    /// Appends an arc, which should begin at the stroke's end. The arc's last point is the new end.
    pub fn arc(&mut self, arc: EllipticArc) {
        self.path.curve_to(Curve::Arc(arc), arc.eval(1.0));
    }

    /// Appends an arc whose last point equals `end` up to rounding; `end` is the new end, exactly.
    /// A whole circle that ends at its start is closed only this way, because sin 2π is not 0 in
    /// floating point.
    pub fn arc_to(&mut self, arc: EllipticArc, end: Point) {
        self.path.curve_to(Curve::Arc(arc), end);
    }

    /// Appends a cubic Bézier curve with the given control points.
    pub fn cubic_to(&mut self, control1: Point, control2: Point, end: Point) {
        self.path.curve_to(Curve::Cubic(control1, control2), end);
    }

    /// Appends a segment, which should begin at the stroke's end.
    pub fn push(&mut self, segment: Segment) {
        match segment {
            Segment::Line(line) => self.line_to(line.p1),
            Segment::Arc(arc) => self.arc(arc),
            Segment::Cubic(c) => self.cubic_to(c.p1, c.p2, c.p3),
        }
    }

    /// Releases memory reserved for further segments.
    pub fn shrink_to_fit(&mut self) {
        self.path.shrink_to_fit();
    }

    /// First point, mm.
    pub fn start(&self) -> Point {
        self.path.start()
    }

    /// Last point, mm. Takes time proportional to the length of a polyline on a lattice.
    pub fn end(&self) -> Point {
        self.path.end()
    }

    /// Whether it is a dot: the pen goes down and up without moving.
    pub fn is_dot(&self) -> bool {
        self.segment_count() == 0
    }

    /// Whether it ends exactly where it begins. A dot is not closed.
    pub fn is_closed(&self) -> bool {
        !self.is_dot() && self.start() == self.end()
    }

    /// The number of segments; 0 for a dot.
    pub fn segment_count(&self) -> usize {
        self.path.segment_count()
    }

    /// The vertices in order, mm.
    pub fn points(&self) -> impl Iterator<Item = Point> + '_ {
        self.path.points()
    }

    /// The vertices (the end points of its segments), mm.
    pub fn vertices(&self) -> Cow<'_, [Point]> {
        self.path.vertices()
    }

    /// The segments in the order in which they are drawn.
    pub fn segments(&self) -> impl Iterator<Item = Segment> + '_ {
        self.path.segments()
    }

    /// Reverses the drawing direction.
    pub fn reverse(&mut self) {
        self.path.reverse();
    }

    /// Applies an affine map to every point.
    pub fn transform(&mut self, map: Affine) {
        self.path.transform(map);
    }

    /// Its length, mm; 0 for a dot.
    pub fn length(&self) -> f64 {
        self.segments().fold(0.0, |sum, segment| sum + segment.length())
    }

    /// Its bounding box, mm.
    pub fn bounding_box(&self) -> Rect {
        let start = self.start();
        self.segments()
            .fold(Rect::from_points(start, start), |bounds, segment| bounds.union(segment.bounding_box()))
    }

    /// A polyline whose chords stay within `tolerance_mm` of the stroke; one point for a dot.
    pub fn flatten(&self, tolerance_mm: f64) -> Vec<Point> {
        if self.path.curves().is_empty() {
            return self.vertices().into_owned();
        }
        let mut points = vec![self.start()];
        for segment in self.segments() {
            segment.flatten(tolerance_mm, |point| points.push(point));
        }
        points
    }
}

/// First byte and length in 32 bits each: most strokes hold no more than that themselves.
pub(crate) fn packed(source: Span) -> [u32; 2] {
    let cut = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
    [cut(source.start), cut(source.end).saturating_sub(cut(source.start))]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Drawings of millions of strokes of two points are common: `PU1,2;PD3,4;`.
    #[test]
    fn stroke_size_is_40_bytes() {
        assert_eq!(size_of::<Stroke>(), 40);
    }
}
