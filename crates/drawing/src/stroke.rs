//! Strokes and drawings.

use std::borrow::Cow;
use std::collections::BTreeSet;

use kurbo::{Affine, CubicBez, Line, Point, Rect};

use crate::lattice::{self, Encoding, Pair, Points, Steps};
use crate::{EllipticArc, Pitch, Segment};

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

/// PathPoints, and between them curves.
#[derive(Clone, Debug, Default)]
struct Free {
    /// At least one.
    vertices: Vec<Point>,
    /// Sorted by the index of the piece, which goes from `vertices[index]` to `vertices[index + 1]`.
    curves: Vec<(usize, Curve)>,
}

/// The forms of a path, from the smallest on.
#[derive(Clone, Debug)]
enum Path {
    Pair(Pair),
    Steps(Steps),
    /// At least one point, all of them joined by lines.
    Line(Box<[Point]>),
    Free(Box<Free>),
}

/// A connected path drawn with one pen, pen down from its first point to its last; mm.
///
/// Polylines whose points lie on a lattice can be kept in 2 to 4 bytes a vertex ([`Stroke::on_lattice`]), others in 16; the
/// few pieces that are not straight are kept beside the vertices. All of it is the same to whoever looks at a stroke, and
/// changes a stroke. A stroke of one vertex and no pieces is a **dot**.
#[derive(Clone, Debug)]
pub struct Stroke {
    /// The pen it is drawn with.
    pub pen: Pen,
    /// First byte and length of its source.
    source: [u32; 2],
    path: Path,
}

impl PartialEq for Stroke {
    fn eq(&self, other: &Self) -> bool {
        self.pen == other.pen
            && self.source == other.source
            && self.points().eq(other.points())
            && self.curves() == other.curves()
    }
}

/// The vertices of a stroke, one after the other.
enum PathPoints<'a> {
    Pair(std::array::IntoIter<Point, 2>),
    Steps(Points<'a>),
    List(std::iter::Copied<std::slice::Iter<'a, Point>>),
}

impl Iterator for PathPoints<'_> {
    type Item = Point;

    #[inline]
    fn next(&mut self) -> Option<Point> {
        match self {
            Self::Pair(points) => points.next(),
            Self::Steps(points) => points.next(),
            Self::List(points) => points.next(),
        }
    }
}

impl Stroke {
    /// A stroke that so far is a dot at `start`.
    pub fn new(pen: Pen, start: Point, source: Span) -> Self {
        Self { pen, source: packed(source), path: Path::Line(Box::new([start])) }
    }

    /// A stroke through the given points; nothing if there are none.
    pub fn polyline(pen: Pen, points: Vec<Point>, source: Span) -> Option<Self> {
        let points = points.into_boxed_slice();
        (!points.is_empty()).then(|| Self { pen, source: packed(source), path: Path::Line(points) })
    }

    /// A stroke through the given points, nothing if there are none: in few bytes if all of them are whole multiples of
    /// `pitch` and not far from one another.
    pub fn on_lattice(pen: Pen, points: &[Point], source: Span, pitch: Pitch) -> Option<Self> {
        let path = match lattice::fit(points, pitch) {
            Some(Encoding::Pair(pair)) => Path::Pair(pair),
            Some(Encoding::Steps(steps)) => Path::Steps(steps),
            None => return Self::polyline(pen, points.to_vec(), source),
        };
        Some(Self { pen, source: packed(source), path })
    }

    /// Where the source says it. Places beyond 4 GiB are given as the last one before.
    pub fn source(&self) -> Span {
        let [start, length] = self.source.map(|number| number as usize);
        Span { start, end: start + length }
    }

    /// Changes where the source is said to say it.
    pub fn set_source(&mut self, source: Span) {
        self.source = packed(source);
    }

    /// Changes its path, in the form that can be changed.
    fn change(&mut self, change: impl FnOnce(&mut Free)) {
        if let Path::Free(free) = &mut self.path {
            change(free);
            return;
        }
        let mut free = Box::new(Free { vertices: self.vertices().into_owned(), curves: Vec::new() });
        change(&mut free);
        self.path = Path::Free(free);
    }

    /// Goes on straight to `point`.
    pub fn line_to(&mut self, point: Point) {
        self.change(|free| free.vertices.push(point));
    }

    /// Goes on along `arc`, which should begin at the stroke's end; its own last point is the new end.
    pub fn arc(&mut self, arc: EllipticArc) {
        self.change(|free| {
            free.curves.push((free.vertices.len() - 1, Curve::Arc(arc)));
            free.vertices.push(arc.eval(1.0));
        });
    }

    /// Goes on along a cubic Bézier curve with the given control points.
    pub fn cubic_to(&mut self, control1: Point, control2: Point, end: Point) {
        self.change(|free| {
            free.curves.push((free.vertices.len() - 1, Curve::Cubic(control1, control2)));
            free.vertices.push(end);
        });
    }

    /// Goes on along `segment`, which should begin at the stroke's end.
    pub fn push(&mut self, segment: Segment) {
        match segment {
            Segment::Line(line) => self.line_to(line.p1),
            Segment::Arc(arc) => self.arc(arc),
            Segment::Cubic(c) => self.cubic_to(c.p1, c.p2, c.p3),
        }
    }

    /// Gives memory back that was kept for more pieces.
    pub fn shrink_to_fit(&mut self) {
        if let Path::Free(free) = &mut self.path {
            free.vertices.shrink_to_fit();
            free.curves.shrink_to_fit();
        }
    }

    /// First point, mm.
    pub fn start(&self) -> Point {
        match &self.path {
            Path::Pair(pair) => pair.points()[0],
            Path::Steps(steps) => steps.start(),
            Path::Line(points) => points[0],
            Path::Free(free) => free.vertices[0],
        }
    }

    /// Last point, mm. On a lattice, the way to it is all of the stroke.
    pub fn end(&self) -> Point {
        match &self.path {
            Path::Pair(pair) => pair.points()[1],
            Path::Steps(steps) => steps.points().last().unwrap_or_else(|| steps.start()),
            Path::Line(points) => points[points.len() - 1],
            Path::Free(free) => free.vertices[free.vertices.len() - 1],
        }
    }

    /// Whether it is a dot: a pen put down and lifted without moving.
    pub fn is_dot(&self) -> bool {
        self.segment_count() == 0
    }

    /// Whether it ends exactly where it began, having moved.
    pub fn is_closed(&self) -> bool {
        !self.is_dot() && self.start() == self.end()
    }

    /// How many pieces it has; none for a dot.
    pub fn segment_count(&self) -> usize {
        match &self.path {
            Path::Pair(_) => 1,
            Path::Steps(steps) => steps.len() - 1,
            Path::Line(points) => points.len() - 1,
            Path::Free(free) => free.vertices.len() - 1,
        }
    }

    /// The vertices one after the other, mm.
    pub fn points(&self) -> impl Iterator<Item = Point> + '_ {
        match &self.path {
            Path::Pair(pair) => PathPoints::Pair(pair.points().into_iter()),
            Path::Steps(steps) => PathPoints::Steps(steps.points()),
            Path::Line(points) => PathPoints::List(points.iter().copied()),
            Path::Free(free) => PathPoints::List(free.vertices.iter().copied()),
        }
    }

    fn curves(&self) -> &[(usize, Curve)] {
        match &self.path {
            Path::Free(free) => &free.curves,
            Path::Pair(_) | Path::Steps(_) | Path::Line(_) => &[],
        }
    }

    /// The vertices: the ends of its pieces, mm.
    pub fn vertices(&self) -> Cow<'_, [Point]> {
        match &self.path {
            Path::Pair(pair) => pair.points().to_vec().into(),
            Path::Steps(steps) => steps.points().collect::<Vec<_>>().into(),
            Path::Line(points) => Cow::Borrowed(points),
            Path::Free(free) => Cow::Borrowed(&free.vertices),
        }
    }

    /// The pieces in the order they are drawn.
    pub fn segments(&self) -> impl Iterator<Item = Segment> + '_ {
        let mut curves = self.curves().iter().peekable();
        let mut from = self.start();
        self.points().skip(1).enumerate().map(move |(index, to)| {
            let from = std::mem::replace(&mut from, to);
            match curves.next_if(|(at, _)| *at == index) {
                None => Segment::Line(Line::new(from, to)),
                Some((_, Curve::Arc(arc))) => Segment::Arc(*arc),
                Some((_, Curve::Cubic(c1, c2))) => Segment::Cubic(CubicBez::new(from, *c1, *c2, to)),
            }
        })
    }

    /// The same ink drawn from the other end.
    pub fn reverse(&mut self) {
        self.change(|free| {
            let last = free.vertices.len() - 1;
            free.vertices.reverse();
            free.curves.reverse();
            for (index, curve) in &mut free.curves {
                *index = last - 1 - *index;
                *curve = match *curve {
                    Curve::Arc(arc) => Curve::Arc(arc.reversed()),
                    Curve::Cubic(c1, c2) => Curve::Cubic(c2, c1),
                };
            }
        });
    }

    /// Applies an affine map to every point.
    pub fn transform(&mut self, map: Affine) {
        match &mut self.path {
            Path::Line(points) => points.iter_mut().for_each(|point| *point = map * *point),
            Path::Pair(_) | Path::Steps(_) => {
                self.path = Path::Line(self.points().map(|point| map * point).collect());
            }
            Path::Free(free) => {
                free.vertices.iter_mut().for_each(|point| *point = map * *point);
                for (_, curve) in &mut free.curves {
                    *curve = match *curve {
                        Curve::Arc(arc) => Curve::Arc(arc.transformed(map)),
                        Curve::Cubic(c1, c2) => Curve::Cubic(map * c1, map * c2),
                    };
                }
            }
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
        if self.curves().is_empty() {
            return self.vertices().into_owned();
        }
        let mut points = vec![self.start()];
        for segment in self.segments() {
            segment.flatten(tolerance, |point| points.push(point));
        }
        points
    }
}

/// First byte and length, as far as they can be told in 32 bits: a stroke should not cost more than what it holds.
fn packed(source: Span) -> [u32; 2] {
    let cut = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
    [cut(source.start), cut(source.end).saturating_sub(cut(source.start))]
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
        let pens: BTreeSet<Pen> = self.strokes.iter().map(|stroke| stroke.pen).collect();
        pens.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_strokes_are_small() {
        // Drawings of millions of strokes of two points are common: `PU1,2;PD3,4;`.
        assert_eq!(size_of::<Stroke>(), 40);
    }
}
