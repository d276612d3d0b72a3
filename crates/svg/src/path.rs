//! Path data to exact pieces.

use drawing::{Affine, CubicBez, EllipticArc, Line, Point, Rect, Segment, Vec2};
use svgtypes::{PathParser, PathSegment};

use crate::attributes;

/// A connected part of a path, user units.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Subpath {
    /// Its first point.
    pub(crate) start: Point,
    /// Its pieces, those without length included; with the closing line if it is closed.
    pub(crate) segments: Vec<Segment>,
    /// Whether its end is joined to its start.
    pub(crate) closed: bool,
}

impl Subpath {
    /// The same under an affine map.
    pub(crate) fn transformed(&self, map: Affine) -> Self {
        Self {
            start: map * self.start,
            segments: self.segments.iter().map(|segment| segment.transformed(map)).collect(),
            closed: self.closed,
        }
    }

    /// A polyline; a polygon if `closed`.
    pub(crate) fn polyline(points: &[Point], closed: bool) -> Option<Self> {
        let (&start, &end) = (points.first()?, points.last()?);
        let line = |pair: &[Point]| Segment::Line(Line::new(pair[0], pair[1]));
        let mut segments: Vec<Segment> = points.windows(2).map(line).collect();
        if closed && end != start {
            segments.push(Segment::Line(Line::new(end, start)));
        }
        Some(Self { start, segments, closed })
    }
}

/// The smallest upright rectangle around subpaths.
pub(crate) fn bounds(subpaths: &[Subpath]) -> Option<Rect> {
    let segments = subpaths.iter().flat_map(|subpath| &subpath.segments);
    segments.map(Segment::bounding_box).reduce(|bounds, other| bounds.union(other))
}

/// The subpaths of path data, as far as the data are right; and whether they are.
pub(crate) fn parse(data: &str) -> (Vec<Subpath>, bool) {
    let mut builder = Builder::default();
    let data = data.trim();
    if data == "none" {
        return (Vec::new(), true);
    }
    for segment in PathParser::from(data) {
        let Ok(segment) = segment else {
            builder.finish();
            return (builder.subpaths, false);
        };
        builder.add(segment);
    }
    builder.finish();
    (builder.subpaths, true)
}

#[derive(Debug, Default)]
struct Builder {
    subpaths: Vec<Subpath>,
    current: Option<Subpath>,
    at: Point,
    start: Point,
    /// The last control point, and whether it is that of a cubic.
    control: Option<(Point, bool)>,
}

impl Builder {
    fn finish(&mut self) {
        if let Some(subpath) = self.current.take().filter(|subpath| !subpath.segments.is_empty()) {
            self.subpaths.push(subpath);
        }
    }

    fn push(&mut self, segment: Segment, end: Point) {
        let start = self.at;
        let subpath = self.current.get_or_insert_with(|| Subpath { start, ..Subpath::default() });
        subpath.segments.push(segment);
        self.at = end;
    }

    fn line(&mut self, end: Point) {
        self.push(Segment::Line(Line::new(self.at, end)), end);
    }

    fn cubic(&mut self, control1: Point, control2: Point, end: Point) {
        self.push(Segment::Cubic(CubicBez::new(self.at, control1, control2, end)), end);
    }

    /// The same curve as a cubic: its control points lie two thirds of the way to the one of the
    /// quadratic.
    fn quadratic(&mut self, control: Point, end: Point) {
        let toward = |from: Point| from + (2.0 / 3.0) * (control - from);
        self.cubic(toward(self.at), toward(end), end);
    }

    /// The reflection of the last control point where the last piece was of the same kind.
    fn reflected(&self, cubic: bool) -> Point {
        match self.control {
            Some((control, kind)) if kind == cubic => self.at + (self.at - control),
            _ => self.at,
        }
    }

    fn add(&mut self, segment: PathSegment) {
        let at = self.at;
        let point = |abs: bool, x: f64, y: f64| {
            if abs { Point::new(x, y) } else { at + Vec2::new(x, y) }
        };
        let mut control = None;
        match segment {
            PathSegment::MoveTo { abs, x, y } => {
                self.finish();
                self.at = point(abs, x, y);
                self.start = self.at;
            }
            PathSegment::LineTo { abs, x, y } => self.line(point(abs, x, y)),
            PathSegment::HorizontalLineTo { abs, x } => {
                self.line(Point::new(if abs { x } else { at.x + x }, at.y));
            }
            PathSegment::VerticalLineTo { abs, y } => {
                self.line(Point::new(at.x, if abs { y } else { at.y + y }));
            }
            PathSegment::CurveTo { abs, x1, y1, x2, y2, x, y } => {
                control = Some((point(abs, x2, y2), true));
                self.cubic(point(abs, x1, y1), point(abs, x2, y2), point(abs, x, y));
            }
            PathSegment::SmoothCurveTo { abs, x2, y2, x, y } => {
                control = Some((point(abs, x2, y2), true));
                self.cubic(self.reflected(true), point(abs, x2, y2), point(abs, x, y));
            }
            PathSegment::Quadratic { abs, x1, y1, x, y } => {
                control = Some((point(abs, x1, y1), false));
                self.quadratic(point(abs, x1, y1), point(abs, x, y));
            }
            PathSegment::SmoothQuadratic { abs, x, y } => {
                let reflected = self.reflected(false);
                control = Some((reflected, false));
                self.quadratic(reflected, point(abs, x, y));
            }
            PathSegment::EllipticalArc { abs, rx, ry, x_axis_rotation, large_arc, sweep, x, y } => {
                let end = point(abs, x, y);
                match arc(at, end, Vec2::new(rx, ry), x_axis_rotation, large_arc, sweep) {
                    Some(arc) => self.push(Segment::Arc(arc), end),
                    None => self.line(end),
                }
            }
            PathSegment::ClosePath { .. } => self.close(),
        }
        self.control = control;
    }

    fn close(&mut self) {
        if self.at != self.start || self.current.is_none() {
            self.line(self.start);
        }
        if let Some(subpath) = &mut self.current {
            subpath.closed = true;
        }
        self.finish();
        // What follows without a moveto starts here.
        self.at = self.start;
    }
}

/// An `A` command: from `from` to `to` on an ellipse of those radii, turned by degrees (SVG 2,
/// appendix B.2.4).
///
/// Nothing if the ends coincide or a radius is 0: then it is a line. Radii that are too small are
/// scaled up.
pub(crate) fn arc(
    from: Point,
    to: Point,
    radii: Vec2,
    degrees: f64,
    large: bool,
    positive: bool,
) -> Option<EllipticArc> {
    let (mut rx, mut ry) = (radii.x.abs(), radii.y.abs());
    if from == to || rx == 0.0 || ry == 0.0 {
        return None;
    }
    let (sin, cos) = attributes::sin_cos(degrees);
    // Half the chord in the ellipse's own axes.
    let half = 0.5 * (from - to);
    let h = Vec2::new(cos * half.x + sin * half.y, cos * half.y - sin * half.x);
    let (u, v) = (h.x / rx, h.y / ry);
    let squared = u * u + v * v;
    if squared > 1.0 {
        let scale = squared.sqrt();
        rx *= scale;
        ry *= scale;
    }
    // On the unit circle: chord ends at +-(u, v) from the chord's middle, the centre beside it at a
    // distance of sqrt(1 - |(u, v)|^2).
    let (u, v) = (h.x / rx, h.y / ry);
    let squared = (u * u + v * v).min(1.0);
    let beside = ((1.0 - squared) / squared).max(0.0).sqrt();
    let beside = if large == positive { -beside } else { beside };
    let (cu, cv) = (beside * v, -beside * u);
    let (start, end) = (libm::atan2(v - cv, u - cu), libm::atan2(-v - cv, -u - cu));
    let tau = std::f64::consts::TAU;
    let mut sweep = end - start;
    if positive && sweep < 0.0 {
        sweep += tau;
    } else if !positive && sweep > 0.0 {
        sweep -= tau;
    }
    let (a, b) = (rx * Vec2::new(cos, sin), ry * Vec2::new(-sin, cos));
    let center = from.midpoint(to) + cu * a + cv * b;
    let arc = EllipticArc { center, a, b, start_rad: start, sweep_rad: sweep };
    (center.is_finite() && sweep != 0.0).then_some(arc)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces(data: &str) -> Vec<Segment> {
        let (subpaths, right) = parse(data);
        assert!(right, "{data}");
        subpaths.into_iter().flat_map(|subpath| subpath.segments).collect()
    }

    #[test]
    fn relative_and_absolute_commands_agree() {
        let absolute =
            pieces("M10 10L20 10H30V20C30 30 40 30 40 20S50 10 50 20Q60 30 70 20T90 20A5 5 0 0 1 100 20Z");
        let relative = pieces("m10 10l10 0h10v10c0 10 10 10 10 0s10-10 10 0q10 10 20 0t20 0a5 5 0 01 10 0z");
        assert_eq!(absolute, relative);
        assert_eq!(absolute.len(), 9);
    }

    #[test]
    fn a_subpath_after_close_starts_at_its_start() {
        let (subpaths, _) = parse("M1 2h3v4zl5 6");
        assert_eq!((subpaths.len(), subpaths[1].start, subpaths[1].closed), (2, Point::new(1.0, 2.0), false));
    }

    #[test]
    fn path_data_are_drawn_up_to_the_error() {
        let (subpaths, right) = parse("M0 0L10 0L20 oops");
        assert!(!right);
        assert_eq!(subpaths[0].segments.len(), 1);
    }

    #[test]
    fn arcs_pass_through_their_ends() {
        for flags in 0..4 {
            let (large, positive) = (flags & 1 == 1, flags & 2 == 2);
            let (from, to) = (Point::new(10.0, 20.0), Point::new(30.0, 25.0));
            let arc = arc(from, to, Vec2::new(20.0, 12.0), 30.0, large, positive).unwrap();
            assert!((arc.eval(0.0) - from).hypot2() < 1e-24);
            assert!((arc.eval(1.0) - to).hypot2() < 1e-24);
            assert_eq!(arc.sweep_rad > 0.0, positive);
            assert_eq!(arc.sweep_rad.abs() > std::f64::consts::PI, large);
        }
    }

    #[test]
    fn radii_that_are_too_small_grow() {
        let arc = arc(Point::ZERO, Point::new(10.0, 0.0), Vec2::new(1.0, 1.0), 0.0, false, true).unwrap();
        assert!((arc.circle_radius().unwrap() - 5.0).abs() < 1e-12);
        assert!((arc.center - Point::new(5.0, 0.0)).hypot2() < 1e-24);
    }
}
