//! Samples of a stroke: the points near which the fitted spline has its knots.

use drawing::{CubicBez, EllipticArc, Point, Segment};

use crate::path::tangent::direction_at;

/// How far samples are apart on lines.
#[derive(Clone, Copy)]
pub(super) struct Grading {
    /// The step next to a vertex, as a share of the tolerance.
    first: f64,
    /// The same on lines that begin or end at a corner.
    corner: f64,
    /// Each further step is longer by this factor.
    growth: f64,
    /// Least number of samples of a stroke. With fewer there is no freedom to bend.
    least: usize,
}

impl Grading {
    /// On paths without jerk limits. On the strokes of `tests/band.rs` a first step of 4 at corners
    /// takes 0.6 % longer in the mean and 6 % at worst, where the lines of a zigzag are short.
    pub(super) const FAST: Self = Self { first: 4.0, corner: 1.0, growth: 2.0, least: 9 };

    /// Under jerk limits, where S''' matters too: a first step of 2.5 at corners takes 1 to 2 % longer,
    /// 9 samples on tiny corners 3 %.
    pub(super) const SMOOTH: Self = Self { first: 2.5, corner: 1.2, growth: 1.5, least: 17 };

    /// With the same step next to all vertices.
    pub(super) fn without_corners(self) -> Self {
        Self { corner: self.first, ..self }
    }
}

/// The chord error of a step on a curve, as a share of the tolerance: at 2 instead of 0.25 mm on a
/// circle of 3 mm, within 0.1 mm, the spline needed 6 % longer.
const SAGITTA: f64 = 1.0 / 8.0;

/// Of the least change of direction in a corner.
const CORNER_COSINE: f64 = 0.87;

/// Samples along a stroke, and the drawing between them.
pub(super) struct Samples {
    pub(super) points: Vec<Point>,
    /// The drawing from sample i to i + 1: lines, and cubics for curves.
    pub(super) spans: Vec<Segment>,
}

impl Samples {
    /// All vertices, and points between them that are closest next to the vertices.
    pub(super) fn of(pieces: &[Segment], tolerance: f64, grading: Grading) -> Self {
        let mut spans = Vec::new();
        let mut after_corner = false;
        for (k, piece) in pieces.iter().enumerate() {
            let before_corner = pieces.get(k + 1).is_some_and(|next| is_corner(piece, next));
            let first = if after_corner || before_corner { grading.corner } else { grading.first };
            after_corner = before_corner;
            let length = piece.length();
            let longest = match piece {
                Segment::Line(_) => f64::INFINITY,
                curve => length / curve.chord_count(SAGITTA * tolerance) as f64,
            };
            let shares = graded(length, first * tolerance, longest, grading.growth);
            spans.extend(shares.windows(2).map(|ends| between(piece, ends[0], ends[1])));
        }
        while !spans.is_empty() && spans.len() + 1 < grading.least {
            spans = spans.iter().flat_map(|span| [span.part(0.0, 0.5), span.part(0.5, 1.0)]).collect();
        }
        let mut points: Vec<Point> = spans.iter().map(Segment::start).collect();
        // Exactly, not up to rounding as the end of a part.
        points.extend(pieces.last().map(Segment::end));
        Self { points, spans }
    }

    /// The larger side of the bounding box of all samples, mm.
    pub(super) fn extent(&self) -> f64 {
        let range = |of: fn(&Point) -> f64| {
            let (low, high) = self
                .points
                .iter()
                .map(of)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
            high - low
        };
        range(|p| p.x).max(range(|p| p.y))
    }
}

/// Whether the direction changes by more than 30 degrees between two pieces.
fn is_corner(before: &Segment, after: &Segment) -> bool {
    match (direction_at(before, 1.0), direction_at(after, 0.0)) {
        (Some(before), Some(after)) => before.dot(after) < CORNER_COSINE,
        _ => true,
    }
}

/// Shares of a length from 0 to 1, symmetric, in steps that grow from `first` towards the middle up
/// to `longest`.
fn graded(length: f64, first: f64, longest: f64, growth: f64) -> Vec<f64> {
    let half = 0.5 * length;
    let mut at = vec![0.0];
    let (mut last, mut step) = (0.0, first.min(longest));
    if length >= 1.5 * step {
        while last + 0.75 * step < half {
            last += step;
            at.push(last);
            step = (growth * step).min(longest);
        }
    }
    if at.len() == 1 {
        return vec![0.0, 1.0];
    }
    let mut shares: Vec<f64> = at.iter().map(|x| 0.5 * x / last).collect();
    let mirrored: Vec<f64> = shares.iter().rev().skip(1).map(|share| 1.0 - share).collect();
    shares.extend(mirrored);
    shares
}

/// The part of a piece between two shares, as a line or a cubic.
fn between(piece: &Segment, t0: f64, t1: f64) -> Segment {
    match piece.part(t0, t1) {
        Segment::Arc(arc) => Segment::Cubic(cubic_of(&arc)),
        other => other,
    }
}

/// The cubic that approximates a short arc: of a circle of radius R, over an angle of `a` rad, to
/// about 2e-5 R a⁶, below 1e-4 of the tolerance for steps as short as those here.
fn cubic_of(arc: &EllipticArc) -> CubicBez {
    let (start, end) = (arc.eval(0.0), arc.eval(1.0));
    let share = 4.0 / 3.0 * libm::tan(0.25 * arc.sweep_rad) / arc.sweep_rad;
    CubicBez::new(start, start + share * arc.derivatives(0.0).0, end - share * arc.derivatives(1.0).0, end)
}

#[cfg(test)]
mod tests {
    use drawing::Line;

    use super::*;

    #[test]
    fn steps_grow_towards_the_middle_and_are_symmetric() {
        let shares = graded(10.0, 0.25, f64::INFINITY, 2.0);
        for (a, b) in shares.iter().zip(shares.iter().rev()) {
            assert!((a + b - 1.0).abs() < 1e-12);
        }
        let steps: Vec<f64> = shares.windows(2).map(|pair| 10.0 * (pair[1] - pair[0])).collect();
        assert!(steps.iter().all(|step| *step > 0.0));
        assert!((0.15..0.5).contains(&steps[0]), "{steps:?}");
        assert!((steps[1] / steps[0] - 2.0).abs() < 1e-9, "{steps:?}");
        assert_eq!(graded(0.2, 0.25, f64::INFINITY, 2.0), [0.0, 1.0]);
        let even = graded(10.0, 0.25, 0.5, 2.0);
        assert!(even.windows(2).all(|pair| 10.0 * (pair[1] - pair[0]) < 0.8), "{even:?}");
    }

    #[test]
    fn cubics_of_arcs_stay_near_them() {
        let arc = EllipticArc::circular(Point::new(4.0, 5.0), 3.0, 0.3, 1.0);
        let cubic = cubic_of(&arc);
        for k in 0..=10 {
            let point = Segment::Cubic(cubic).eval(f64::from(k) / 10.0);
            assert!(((point - Point::new(4.0, 5.0)).hypot() - 3.0).abs() < 6e-5);
        }
    }

    #[test]
    fn short_strokes_have_at_least_nine_samples() {
        let line = |a: (f64, f64), b: (f64, f64)| Segment::Line(Line::new(Point::from(a), Point::from(b)));
        let samples =
            Samples::of(&[line((0.0, 0.0), (0.1, 0.0)), line((0.1, 0.0), (0.1, 0.2))], 0.1, Grading::FAST);
        assert_eq!(samples.points.len(), 13);
        assert_eq!(samples.spans.len(), 12);
        let straight = Samples::of(&[line((0.0, 0.0), (0.1, 0.0))], 0.1, Grading::FAST);
        assert_eq!(straight.points.len(), 9);
        assert!((samples.extent() - 0.2).abs() < 1e-12);
    }
}
