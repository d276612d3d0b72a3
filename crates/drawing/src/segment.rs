//! Segments of strokes.

use kurbo::{Affine, CubicBez, Line, ParamCurve, ParamCurveArclen, ParamCurveDeriv, Point, Rect, Vec2};

use crate::EllipticArc;

/// A segment of a stroke: a line, an arc of an ellipse, or a cubic Bézier curve; mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Segment {
    /// A line from `p0` to `p1`.
    Line(Line),
    /// An arc of a circle or an ellipse.
    Arc(EllipticArc),
    /// A cubic Bézier curve.
    Cubic(CubicBez),
}

impl Segment {
    /// First point, mm.
    pub fn start(&self) -> Point {
        match self {
            Self::Line(line) => line.p0,
            Self::Arc(arc) => arc.eval(0.0),
            Self::Cubic(cubic) => cubic.p0,
        }
    }

    /// Last point, mm.
    pub fn end(&self) -> Point {
        match self {
            Self::Line(line) => line.p1,
            Self::Arc(arc) => arc.eval(1.0),
            Self::Cubic(cubic) => cubic.p3,
        }
    }

    /// The point at `t`, 0 at the start and 1 at the end, mm.
    pub fn eval(&self, t: f64) -> Point {
        match self {
            Self::Line(line) => line.eval(t),
            Self::Arc(arc) => arc.eval(t),
            Self::Cubic(cubic) => cubic.eval(t),
        }
    }

    /// First and second derivative with respect to `t`, mm.
    pub fn derivatives(&self, t: f64) -> (Vec2, Vec2) {
        match self {
            Self::Line(line) => (line.p1 - line.p0, Vec2::ZERO),
            Self::Arc(arc) => arc.derivatives(t),
            Self::Cubic(cubic) => {
                let first = cubic.deriv();
                (first.eval(t).to_vec2(), first.deriv().eval(t).to_vec2())
            }
        }
    }

    /// Third derivative with respect to `t`, mm.
    pub fn third_derivative(&self, t: f64) -> Vec2 {
        match self {
            Self::Line(_) => Vec2::ZERO,
            // The third derivative of a cos u + b sin u by u is minus the first one.
            Self::Arc(arc) => -arc.sweep_rad * arc.sweep_rad * arc.derivatives(t).0,
            Self::Cubic(c) => 6.0 * ((c.p3 - c.p0) - 3.0 * (c.p2 - c.p1)),
        }
    }

    /// The part from `t0` to `t1`.
    pub fn part(&self, t0: f64, t1: f64) -> Self {
        match self {
            Self::Line(line) => Self::Line(line.subsegment(t0..t1)),
            Self::Arc(arc) => Self::Arc(arc.part(t0, t1)),
            Self::Cubic(cubic) => Self::Cubic(cubic.subsegment(t0..t1)),
        }
    }

    /// The same points in the opposite direction.
    pub fn reversed(&self) -> Self {
        match self {
            Self::Line(line) => Self::Line(Line::new(line.p1, line.p0)),
            Self::Arc(arc) => Self::Arc(arc.reversed()),
            Self::Cubic(c) => Self::Cubic(CubicBez::new(c.p3, c.p2, c.p1, c.p0)),
        }
    }

    /// The segment mapped by an affine map.
    pub fn transformed(&self, map: Affine) -> Self {
        match self {
            Self::Line(line) => Self::Line(map * *line),
            Self::Arc(arc) => Self::Arc(arc.transformed(map)),
            Self::Cubic(cubic) => Self::Cubic(map * *cubic),
        }
    }

    /// The length, mm; accurate to 1e-6 mm.
    pub fn length(&self) -> f64 {
        match self {
            Self::Line(line) => libm::hypot(line.p1.x - line.p0.x, line.p1.y - line.p0.y),
            Self::Arc(arc) => match arc.circle_radius() {
                Some(radius) => radius * arc.sweep_rad.abs(),
                None => elliptic_length(arc),
            },
            Self::Cubic(cubic) => cubic.arclen(1e-6),
        }
    }

    /// The bounding box, mm.
    pub fn bounding_box(&self) -> Rect {
        match self {
            Self::Line(line) => Rect::from_points(line.p0, line.p1),
            Self::Arc(arc) => {
                let mut bounds = Rect::from_points(arc.eval(0.0), arc.eval(1.0));
                // x is extreme where tan u = b.x / a.x, and y likewise: two angles in 2 pi.
                for (a, b) in [(arc.a.x, arc.b.x), (arc.a.y, arc.b.y)] {
                    let extreme = libm::atan2(b, a);
                    for u in arc.angles_within(extreme, std::f64::consts::PI) {
                        bounds = bounds.union_pt(arc.at_angle(u));
                    }
                }
                bounds
            }
            Self::Cubic(cubic) => kurbo::Shape::bounding_box(cubic),
        }
    }

    /// A box around the bounding box that needs no roots: that of an arc's whole ellipse, and of a
    /// cubic's control points, mm.
    pub fn loose_box(&self) -> Rect {
        let (bounds, margin) = match self {
            Self::Line(line) => return Rect::from_points(line.p0, line.p1),
            Self::Arc(EllipticArc { center, a, b, .. }) => {
                let half = |a: f64, b: f64| (a * a + b * b).sqrt();
                let half = Vec2::new(half(a.x, b.x), half(a.y, b.y));
                (
                    Rect::from_points(*center - half, *center + half),
                    half.x + half.y + center.x.abs() + center.y.abs(),
                )
            }
            Self::Cubic(c) => {
                let bounds = Rect::from_points(c.p0, c.p1).union(Rect::from_points(c.p2, c.p3));
                (bounds, bounds.x0.abs().max(bounds.x1.abs()) + bounds.y0.abs().max(bounds.y1.abs()))
            }
        };
        // For the rounding errors of points.
        bounds.inflate(1e-12 * margin, 1e-12 * margin)
    }

    /// The number of chords, equal in `t`, that keeps the chord error within `tolerance_mm`.
    ///
    /// Cubics: the chord of `f` over a step `h` has an error of `h²/8 max|f''|` at most, and the
    /// second derivative of a cubic is largest at one of its ends. Arcs:
    /// [`EllipticArc::chord_count`].
    pub fn chord_count(&self, tolerance_mm: f64) -> usize {
        match self {
            Self::Line(_) => 1,
            Self::Arc(arc) => arc.chord_count(tolerance_mm),
            Self::Cubic(_) => {
                let (_, at_start) = self.derivatives(0.0);
                let (_, at_end) = self.derivatives(1.0);
                let largest = at_start.hypot2().max(at_end.hypot2()).sqrt();
                let count = (largest / (8.0 * tolerance_mm)).sqrt().ceil();
                if count.is_finite() && count >= 1.0 { count as usize } else { 1 }
            }
        }
    }

    /// Calls `to` with the end of each chord of a flattening within `tolerance_mm`. The start of
    /// the segment is not passed.
    pub fn flatten(&self, tolerance_mm: f64, mut to: impl FnMut(Point)) {
        let count = self.chord_count(tolerance_mm);
        for step in 1..count {
            to(self.eval(step as f64 / count as f64));
        }
        to(self.end());
    }
}

/// The length of an elliptic arc, to about 1e-7 mm a quarter turn: adaptive Simpson quadrature of
/// `|p'(t)|`.
///
/// The integrand is smooth, except that for flat ellipses it almost has a kink at each end of the
/// long axis. A uniform step would have to be as small as the ellipse is flat; bisection needs one
/// halving for each bit of that ratio.
fn elliptic_length(arc: &EllipticArc) -> f64 {
    let speed = |t: f64| arc.derivatives(t).0.hypot2().sqrt();
    let quarters = (arc.sweep_rad.abs() / std::f64::consts::FRAC_PI_2).ceil().clamp(1.0, 4096.0) as usize;
    let mut length = 0.0;
    // Open intervals: bounds, values at start, middle and end, number of halvings.
    let mut open: Vec<([f64; 2], [f64; 3], u32)> = Vec::new();
    for quarter in 0..quarters {
        let at = |k: usize| k as f64 / quarters as f64;
        let (t0, t1) = (at(quarter), at(quarter + 1));
        open.push(([t0, t1], [t0, 0.5 * (t0 + t1), t1].map(speed), 0));
    }
    while let Some(([t0, t1], [f0, f1, f2], halvings)) = open.pop() {
        let middle = 0.5 * (t0 + t1);
        let (left, right) = (speed(0.5 * (t0 + middle)), speed(0.5 * (middle + t1)));
        let whole = (t1 - t0) / 6.0 * (f0 + 4.0 * f1 + f2);
        let halves = (t1 - t0) / 12.0 * (f0 + 4.0 * left + 2.0 * f1 + 4.0 * right + f2);
        // Richardson: the error of the halves is a fifteenth of the difference.
        if halvings >= 3 && (halves - whole).abs() <= 15.0 * 1e-9 || halvings >= 40 {
            length += halves + (halves - whole) / 15.0;
        } else {
            open.push(([t0, middle], [f0, left, f1], halvings + 1));
            open.push(([middle, t1], [f1, right, f2], halvings + 1));
        }
    }
    length
}
