//! How a stroke's path is stored: four forms, from the smallest to the most general.

use std::borrow::Cow;

use kurbo::{Affine, CubicBez, Line, Point};

use crate::lattice::{self, Form, Pair, Points, Steps};
use crate::{EllipticArc, Pitch, Segment};

/// A segment of a path that is not straight, without its end points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Curve {
    Arc(EllipticArc),
    Cubic(Point, Point),
}

/// A path that can be extended: vertices, and the curves between some of them. An importer keeps one
/// and uses it again for each stroke ([`Strokes::push_trail`](crate::Strokes::push_trail)).
#[derive(Clone, Debug, Default)]
pub struct Trail {
    pub(crate) vertices: Vec<Point>,
    /// Sorted by segment index; segment `i` leads from `vertices[i]` to `vertices[i + 1]`.
    pub(crate) curves: Vec<(usize, Curve)>,
}

impl Trail {
    /// Forgets the path, and begins another at `start`.
    pub fn begin(&mut self, start: Point) {
        self.clear();
        self.vertices.push(start);
    }

    /// Forgets the path. Its memory is used again.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.curves.clear();
    }

    /// The number of vertices; 0 without a path, 1 for a dot.
    #[inline]
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// Whether there is no path.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// The last vertex, mm.
    #[inline]
    pub fn end(&self) -> Option<Point> {
        self.vertices.last().copied()
    }

    /// Appends a line.
    #[inline]
    pub fn line_to(&mut self, point: Point) {
        self.vertices.push(point);
    }

    /// Appends a segment, which should begin at the end of the path.
    pub fn push(&mut self, segment: &Segment) {
        match segment {
            Segment::Line(line) => self.line_to(line.p1),
            Segment::Arc(arc) => self.curve_to(Curve::Arc(*arc), arc.eval(1.0)),
            Segment::Cubic(c) => self.curve_to(Curve::Cubic(c.p1, c.p2), c.p3),
        }
    }

    pub(crate) fn curve_to(&mut self, curve: Curve, end: Point) {
        self.curves.push((self.vertices.len() - 1, curve));
        self.vertices.push(end);
    }
}

/// The path of a stroke. All forms have at least one vertex.
#[derive(Clone, Debug)]
pub(crate) enum Path {
    /// A line between two lattice points.
    Pair(Pair),
    /// A polyline on a lattice.
    Steps(Steps),
    /// Any polyline.
    Line(Box<[Point]>),
    /// Lines, arcs and cubics, at least one vertex. The only form that can be extended.
    Free(Box<Trail>),
}

/// Iterator over the vertices of a [`Path`].
pub(crate) enum PathPoints<'a> {
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

impl Path {
    pub(crate) fn dot(point: Point) -> Self {
        Self::Line(Box::new([point]))
    }

    /// `None` without points.
    pub(crate) fn polyline(points: Vec<Point>) -> Option<Self> {
        (!points.is_empty()).then(|| Self::Line(points.into_boxed_slice()))
    }

    /// The smallest form for these points; `None` without points.
    pub(crate) fn on_lattice(points: &[Point], pitch: Pitch) -> Option<Self> {
        let mut code = Vec::new();
        match lattice::encode(points, pitch, &mut code) {
            Some(Form::Pair) => Pair::read(&code).map(Self::Pair),
            Some(Form::Steps) => Some(Self::Steps(Steps::of_code(&code))),
            None => Self::polyline(points.to_vec()),
        }
    }

    /// Converts to the form that can be extended, and changes it.
    fn change(&mut self, change: impl FnOnce(&mut Trail)) {
        if let Self::Free(free) = self {
            change(free);
            return;
        }
        let mut free = Box::new(Trail { vertices: self.vertices().into_owned(), curves: Vec::new() });
        change(&mut free);
        *self = Self::Free(free);
    }

    pub(crate) fn line_to(&mut self, point: Point) {
        self.change(|free| free.vertices.push(point));
    }

    pub(crate) fn curve_to(&mut self, curve: Curve, end: Point) {
        self.change(|free| free.curve_to(curve, end));
    }

    pub(crate) fn shrink_to_fit(&mut self) {
        if let Self::Free(free) = self {
            free.vertices.shrink_to_fit();
            free.curves.shrink_to_fit();
        }
    }

    pub(crate) fn start(&self) -> Point {
        match self {
            Self::Pair(pair) => pair.points()[0],
            Self::Steps(steps) => steps.start(),
            Self::Line(points) => points[0],
            Self::Free(free) => free.vertices[0],
        }
    }

    pub(crate) fn end(&self) -> Point {
        match self {
            Self::Pair(pair) => pair.points()[1],
            Self::Steps(steps) => steps.points().last().unwrap_or_else(|| steps.start()),
            Self::Line(points) => points[points.len() - 1],
            Self::Free(free) => free.vertices[free.vertices.len() - 1],
        }
    }

    pub(crate) fn segment_count(&self) -> usize {
        match self {
            Self::Pair(_) => 1,
            Self::Steps(steps) => steps.len() - 1,
            Self::Line(points) => points.len() - 1,
            Self::Free(free) => free.vertices.len() - 1,
        }
    }

    pub(crate) fn points(&self) -> PathPoints<'_> {
        match self {
            Self::Pair(pair) => PathPoints::Pair(pair.points().into_iter()),
            Self::Steps(steps) => PathPoints::Steps(steps.points()),
            Self::Line(points) => PathPoints::List(points.iter().copied()),
            Self::Free(free) => PathPoints::List(free.vertices.iter().copied()),
        }
    }

    pub(crate) fn curves(&self) -> &[(usize, Curve)] {
        match self {
            Self::Free(free) => &free.curves,
            Self::Pair(_) | Self::Steps(_) | Self::Line(_) => &[],
        }
    }

    pub(crate) fn vertices(&self) -> Cow<'_, [Point]> {
        match self {
            Self::Pair(pair) => pair.points().to_vec().into(),
            Self::Steps(steps) => steps.points().collect::<Vec<_>>().into(),
            Self::Line(points) => Cow::Borrowed(points),
            Self::Free(free) => Cow::Borrowed(&free.vertices),
        }
    }

    pub(crate) fn segments(&self) -> impl Iterator<Item = Segment> + '_ {
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

    pub(crate) fn reverse(&mut self) {
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

    pub(crate) fn transform(&mut self, map: Affine) {
        match self {
            Self::Line(points) => points.iter_mut().for_each(|point| *point = map * *point),
            Self::Pair(_) | Self::Steps(_) => {
                *self = Self::Line(self.points().map(|point| map * point).collect());
            }
            Self::Free(free) => {
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
}
