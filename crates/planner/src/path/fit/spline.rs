//! Cubic splines over uneven knots, given by control points.
//!
//! Knot i of n carries one control point; the spline is twice continuously differentiable, starts
//! and ends at the first and last control point, and its second derivative is 0 there. Beyond the
//! ends knots and control points are mirrored: `d[-1] = 2 d[0] - d[1]`. Value and second derivative
//! at knot i are combinations of the control points i - 1, i and i + 1 (de Boor 1978).

use drawing::{CubicBez, Point, Vec2};

/// A spline; at least 3 knots.
pub(super) struct Spline {
    /// Length along the samples, mm.
    pub(super) knots: Vec<f64>,
    /// Weights of the value at each knot.
    pub(super) value: Vec<[f64; 3]>,
    /// Weights of the second derivative at each knot.
    pub(super) second: Vec<[f64; 3]>,
    /// The inner Bézier points of span j, as shares of the way from control point j to j + 1.
    legs: Vec<[f64; 2]>,
    /// The control points.
    pub(super) control: Vec<Vec2>,
}

impl Spline {
    /// The spline that passes through the samples; knots at the length along their polyline.
    pub(super) fn through(samples: &[Point]) -> Self {
        let mut knots = Vec::with_capacity(samples.len());
        let mut at = 0.0;
        knots.push(at);
        for pair in samples.windows(2) {
            at += (pair[1] - pair[0]).hypot2().sqrt();
            knots.push(at);
        }
        let mut spline = Self::with_knots(knots);
        spline.control = spline.interpolating(samples);
        spline
    }

    fn with_knots(knots: Vec<f64>) -> Self {
        let count = knots.len() as isize;
        let last = count - 1;
        let knot = |i: isize| {
            if i < 0 {
                2.0 * knots[0] - knots[(-i).min(last) as usize]
            } else if i > last {
                2.0 * knots[last as usize] - knots[(2 * last - i).max(0) as usize]
            } else {
                knots[i as usize]
            }
        };
        // Of span j: the shares of its inner Bézier points, and the rate of its control leg.
        let leg = |j: isize| {
            let all = knot(j + 2) - knot(j - 1);
            ([(knot(j) - knot(j - 1)) / all, (knot(j + 1) - knot(j - 1)) / all], 3.0 / all)
        };
        let (mut value, mut second) = (Vec::with_capacity(knots.len()), Vec::with_capacity(knots.len()));
        for i in 0..count {
            let around = knot(i + 1) - knot(i - 1);
            let w = (knot(i) - knot(i - 1)) / around;
            let (([_, a], e0), ([b, _], e1)) = (leg(i - 1), leg(i));
            value.push([(1.0 - w) * (1.0 - a), (1.0 - w) * a + w * (1.0 - b), w * b]);
            let q = 2.0 / around;
            second.push([q * e0, -q * (e0 + e1), q * e1]);
        }
        let legs = (0..last).map(|j| leg(j).0).collect();
        Self { value, second, legs, knots, control: Vec::new() }
    }

    pub(super) fn count(&self) -> usize {
        self.knots.len()
    }

    /// Length of span j in the parameter.
    pub(super) fn span(&self, j: usize) -> f64 {
        self.knots[j + 1] - self.knots[j]
    }

    /// The control points of the spline through the samples, by a tridiagonal system.
    pub(super) fn interpolating(&self, samples: &[Point]) -> Vec<Vec2> {
        let count = samples.len();
        let mut control: Vec<Vec2> = samples.iter().map(|sample| sample.to_vec2()).collect();
        let mut factor = vec![0.0; count];
        for i in 1..count - 1 {
            let [before, own, after] = self.value[i];
            // The first and last control points are known.
            let (eliminated, known) =
                if i == 1 { (0.0, control[0]) } else { (factor[i - 1], control[i - 1]) };
            let pivot = own - before * eliminated;
            factor[i] = after / pivot;
            control[i] = (control[i] - before * known) / pivot;
        }
        for i in (1..count - 1).rev() {
            control[i] = control[i] - factor[i] * control[i + 1];
        }
        control
    }

    /// A combination of the control points i - 1, i and i + 1.
    #[inline]
    fn combine(&self, control: &[Vec2], row: [f64; 3], i: usize) -> Vec2 {
        let last = control.len() - 1;
        let before = if i == 0 { 2.0 * control[0] - control[1] } else { control[i - 1] };
        let after = if i == last { 2.0 * control[last] - control[last - 1] } else { control[i + 1] };
        row[0] * before + row[1] * control[i] + row[2] * after
    }

    /// The point at knot i.
    #[inline]
    pub(super) fn at_knot(&self, i: usize) -> Vec2 {
        self.combine(&self.control, self.value[i], i)
    }

    /// The same combination of other control points (a step).
    #[inline]
    pub(super) fn value_of(&self, control: &[Vec2], i: usize) -> Vec2 {
        self.combine(control, self.value[i], i)
    }

    /// The second derivative at knot i with these control points.
    #[inline]
    pub(super) fn second_of(&self, control: &[Vec2], i: usize) -> Vec2 {
        if i == 0 || i + 1 == self.count() {
            return Vec2::ZERO;
        }
        self.combine(control, self.second[i], i)
    }

    /// Span j as a Bézier curve.
    pub(super) fn bezier(&self, j: usize) -> CubicBez {
        let (a, b) = (self.control[j], self.control[j + 1]);
        let [one, two] = self.legs[j];
        // The ends are the first and last sample exactly, not up to rounding.
        let end = |i: usize| {
            let is_end = i == 0 || i + 1 == self.count();
            (if is_end { self.control[i] } else { self.at_knot(i) }).to_point()
        };
        CubicBez::new(end(j), a.lerp(b, one).to_point(), a.lerp(b, two).to_point(), end(j + 1))
    }

    /// Weights of the control points j - 1 to j + 2 for the change over span j divided by its length,
    /// and for the second derivatives at its start and end, with the mirrored control points folded
    /// in.
    pub(super) fn span_weights(&self, j: usize) -> [[f64; 4]; 3] {
        let h = self.span(j);
        let (mut start, mut end) = ([0.0; 4], [0.0; 4]);
        let (mut bend0, mut bend1) = ([0.0; 4], [0.0; 4]);
        start[..3].copy_from_slice(&self.value[j]);
        end[1..].copy_from_slice(&self.value[j + 1]);
        if j > 0 {
            bend0[..3].copy_from_slice(&self.second[j]);
        }
        if j + 2 < self.count() {
            bend1[1..].copy_from_slice(&self.second[j + 1]);
        }
        let fold = |mut row: [f64; 4]| {
            if j == 0 {
                row = [0.0, row[1] + 2.0 * row[0], row[2] - row[0], row[3]];
            }
            if j + 2 == self.count() {
                row = [row[0], row[1] - row[3], row[2] + 2.0 * row[3], 0.0];
            }
            row
        };
        [fold([0, 1, 2, 3].map(|k| (end[k] - start[k]) / h)), fold(bend0), fold(bend1)]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn samples() -> impl Strategy<Value = Vec<Point>> {
        proptest::collection::vec((0.05..2.0f64, -3.0..3.0f64), 4..20).prop_map(|steps| {
            let mut at = Point::new(3.0, -2.0);
            let mut points = vec![at];
            for (length, angle) in steps {
                at += length * Vec2::new(libm::cos(angle), libm::sin(angle));
                points.push(at);
            }
            points
        })
    }

    proptest! {
        #[test]
        fn interpolating_spline_is_smooth_and_meets_samples(samples in samples()) {
            let spline = Spline::through(&samples);
            let mut before: Option<(CubicBez, f64)> = None;
            for j in 0..samples.len() - 1 {
                let (curve, h) = (spline.bezier(j), spline.span(j));
                prop_assert!((curve.p0 - samples[j]).hypot() < 1e-9);
                prop_assert!((curve.p3 - samples[j + 1]).hypot() < 1e-9);
                let first = |a: Point, b: Point, h: f64| 3.0 * (b - a) / h;
                let second = |a: Point, b: Point, c: Point, h: f64| 6.0 * ((c - b) - (b - a)) / (h * h);
                if let Some((last, width)) = before {
                    let jump = first(last.p2, last.p3, width) - first(curve.p0, curve.p1, h);
                    prop_assert!(jump.hypot() < 1e-8, "{:?}", jump);
                    let bend = second(curve.p0, curve.p1, curve.p2, h);
                    let jump = second(last.p1, last.p2, last.p3, width) - bend;
                    prop_assert!(jump.hypot() < 1e-6, "{:?}", jump);
                    prop_assert!((bend - spline.second_of(&spline.control, j)).hypot() < 1e-6);
                }
                for f in [0.0, 0.3, 0.5, 1.0] {
                    let [d, p, r] = spline.span_weights(j).map(|row| (0..4).fold(Vec2::ZERO, |sum, k| {
                        let index = (j + k).checked_sub(1).filter(|index| *index < samples.len());
                        sum + index.map_or(Vec2::ZERO, |index| row[k] * spline.control[index])
                    }));
                    let by_p = h * (1.0 / 6.0 - 0.5 * (1.0 - f) * (1.0 - f));
                    let first = d + by_p * p + h * (0.5 * f * f - 1.0 / 6.0) * r;
                    let exact = drawing::Segment::Cubic(curve).derivatives(f);
                    prop_assert!((first - exact.0 / h).hypot() < 1e-7);
                    prop_assert!(((1.0 - f) * p + f * r - exact.1 / (h * h)).hypot() < 1e-5);
                }
                before = Some((curve, h));
            }
        }
    }
}
