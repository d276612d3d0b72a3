//! Strokes and drawings.

use kurbo::{Affine, CubicBez, Line, Point, Rect};

use crate::{EllipticArc, Segment};

/// The number of a pen, as the drawing names it: 1 and up. 0 is "no pen" and never draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Pen(pub u16);

/// A half-open range of bytes in the source that something was said in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Span {
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

/// What a piece of a stroke is where it is not straight.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Curve {
    Arc(EllipticArc),
    Cubic(Point, Point),
}

/// A connected path drawn with one pen, pen down from its first point to its last; mm.
///
/// Vertices are kept in one flat list and the few pieces that are not straight beside it, so that a polyline of a
/// million vertices costs 16 bytes a vertex. A stroke of one vertex and no pieces is a **dot**.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// The pen it is drawn with.
    pub pen: Pen,
    /// Where the source says it.
    pub source: Span,
    vertices: Vec<Point>,
    /// Sorted by the index of the piece, which goes from `vertices[index]` to `vertices[index + 1]`.
    curves: Vec<(usize, Curve)>,
}

impl Stroke {
    /// A stroke that so far is a dot at `start`.
    pub fn new(pen: Pen, start: Point, source: Span) -> Self {
        Self { pen, source, vertices: vec![start], curves: Vec::new() }
    }

    /// A stroke through the given points; nothing if there are none.
    pub fn polyline(pen: Pen, points: Vec<Point>, source: Span) -> Option<Self> {
        (!points.is_empty()).then_some(Self { pen, source, vertices: points, curves: Vec::new() })
    }

    /// Goes on straight to `point`.
    pub fn line_to(&mut self, point: Point) {
        self.vertices.push(point);
    }

    /// Goes on along `arc`, which should begin at the stroke's end; its own last point is the new end.
    pub fn arc(&mut self, arc: EllipticArc) {
        self.curves.push((self.vertices.len() - 1, Curve::Arc(arc)));
        self.vertices.push(arc.eval(1.0));
    }

    /// Goes on along a cubic Bézier curve with the given control points.
    pub fn cubic_to(&mut self, control1: Point, control2: Point, end: Point) {
        self.curves.push((self.vertices.len() - 1, Curve::Cubic(control1, control2)));
        self.vertices.push(end);
    }

    /// Goes on along `segment`, which should begin at the stroke's end.
    pub fn push(&mut self, segment: Segment) {
        match segment {
            Segment::Line(line) => self.line_to(line.p1),
            Segment::Arc(arc) => self.arc(arc),
            Segment::Cubic(c) => self.cubic_to(c.p1, c.p2, c.p3),
        }
    }

    /// First point, mm.
    pub fn start(&self) -> Point {
        self.vertices[0]
    }

    /// Last point, mm.
    pub fn end(&self) -> Point {
        self.vertices[self.vertices.len() - 1]
    }

    /// Whether it is a dot: a pen put down and lifted without moving.
    pub fn is_dot(&self) -> bool {
        self.vertices.len() == 1
    }

    /// Whether it ends exactly where it began, having moved.
    pub fn is_closed(&self) -> bool {
        !self.is_dot() && self.start() == self.end()
    }

    /// How many pieces it has; none for a dot.
    pub fn segment_count(&self) -> usize {
        self.vertices.len() - 1
    }

    /// The vertices: the ends of its pieces, mm.
    pub fn vertices(&self) -> &[Point] {
        &self.vertices
    }

    /// The pieces in the order they are drawn.
    pub fn segments(&self) -> impl Iterator<Item = Segment> + '_ {
        let mut curves = self.curves.iter().peekable();
        self.vertices.windows(2).enumerate().map(move |(index, ends)| {
            match curves.next_if(|(at, _)| *at == index) {
                None => Segment::Line(Line::new(ends[0], ends[1])),
                Some((_, Curve::Arc(arc))) => Segment::Arc(*arc),
                Some((_, Curve::Cubic(c1, c2))) => Segment::Cubic(CubicBez::new(ends[0], *c1, *c2, ends[1])),
            }
        })
    }

    /// The same ink drawn from the other end.
    pub fn reverse(&mut self) {
        let last = self.segment_count();
        self.vertices.reverse();
        self.curves.reverse();
        for (index, curve) in &mut self.curves {
            *index = last - 1 - *index;
            *curve = match *curve {
                Curve::Arc(arc) => Curve::Arc(arc.reversed()),
                Curve::Cubic(c1, c2) => Curve::Cubic(c2, c1),
            };
        }
    }

    /// Applies an affine map to every point.
    pub fn transform(&mut self, map: Affine) {
        for point in &mut self.vertices {
            *point = map * *point;
        }
        for (_, curve) in &mut self.curves {
            *curve = match *curve {
                Curve::Arc(arc) => Curve::Arc(arc.transformed(map)),
                Curve::Cubic(c1, c2) => Curve::Cubic(map * c1, map * c2),
            };
        }
    }

    /// Length of its ink, mm; 0 for a dot.
    pub fn length(&self) -> f64 {
        self.segments().fold(0.0, |sum, segment| sum + segment.length())
    }

    /// The smallest upright rectangle that holds it, mm.
    pub fn bounding_box(&self) -> Rect {
        let start = self.start();
        self.segments()
            .fold(Rect::from_points(start, start), |bounds, segment| bounds.union(segment.bounding_box()))
    }

    /// Its points as a polyline whose chords stay within `tolerance` mm of it; one point for a dot.
    pub fn flatten(&self, tolerance: f64) -> Vec<Point> {
        if self.curves.is_empty() {
            return self.vertices.clone();
        }
        let mut points = vec![self.start()];
        for segment in self.segments() {
            segment.flatten(tolerance, |point| points.push(point));
        }
        points
    }
}

/// What ends up on paper: strokes in the order they are drawn; mm, y up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// The strokes.
    pub strokes: Vec<Stroke>,
}

impl Drawing {
    /// Whether there is no ink at all.
    pub fn is_empty(&self) -> bool {
        self.strokes.is_empty()
    }

    /// The smallest upright rectangle that holds all ink, mm; nothing for an empty drawing.
    pub fn bounding_box(&self) -> Option<Rect> {
        self.strokes.iter().map(Stroke::bounding_box).reduce(|bounds, other| bounds.union(other))
    }

    /// Length of all ink, mm.
    pub fn length(&self) -> f64 {
        self.strokes.iter().fold(0.0, |sum, stroke| sum + stroke.length())
    }

    /// Applies an affine map to every stroke.
    pub fn transform(&mut self, map: Affine) {
        for stroke in &mut self.strokes {
            stroke.transform(map);
        }
    }

    /// The pens it uses, each once, in the order of their numbers.
    pub fn pens(&self) -> Vec<Pen> {
        let mut pens: Vec<Pen> = self.strokes.iter().map(|stroke| stroke.pen).collect();
        pens.sort_unstable();
        pens.dedup();
        pens
    }
}
