//! The smoothest spline within a distance of the samples, by a barrier method.
//!
//! Minimizes `½ Σ w |S''|² + ½ λ Σ h |S'''|²` over the knots (w half of the spans on both sides) and
//! spans, with every knot closer than r to its sample, by Newton steps on
//!
//! ```text
//! E(d) - k Σ log(1 - |S(knot) - sample|² / r²),   k = u E / n,   u = 1, 0.1, 0.01
//! ```
//! The knots depend on three control points each and `S'''` on four, so the Hessian in x and y has
//! seven diagonals below the main one. The start is the spline through the samples, in the middle of
//! all discs; steps stop short of their boundaries. Every iterate is feasible, so a fixed number of
//! steps gives a usable result.

use std::ops::Range;

use drawing::{Point, Vec2};

use super::{banded::Banded, spline::Spline};

/// Largest share of the way to the boundary of a disc in one step.
const SHORT_OF: f64 = 0.95;

/// The barrier's weights, as shares of the energy a knot.
const WEIGHTS: [f64; 3] = [1.0, 0.1, 0.01];

/// A quadratic form in the control points, the same for x and y.
pub(super) struct Energy {
    /// Row i: the coefficients (i, i) to (i, i + 3).
    rows: Vec<[f64; 4]>,
    bending: f64,
    third: f64,
}

impl Energy {
    /// `bending ½ Σ w |S''|² + third ½ Σ h |S'''|²`.
    pub(super) fn new(spline: &Spline, bending: f64, third: f64) -> Self {
        let count = spline.count();
        let mut rows = vec![[0.0; 4]; count];
        let mut add = |first: usize, row: &[f64], weight: f64| {
            for (a, x) in row.iter().enumerate() {
                for (b, y) in row.iter().enumerate().skip(a) {
                    rows[first + a][b - a] += weight * x * y;
                }
            }
        };
        for i in 1..count - 1 {
            let width = 0.5 * (spline.span(i - 1) + spline.span(i));
            add(i - 1, &spline.second[i], bending * width);
        }
        for j in 0..count - 1 {
            let h = spline.span(j);
            // (S''[j + 1] - S''[j]) / h by the control points j - 1 to j + 2; S'' is 0 at the ends.
            let mut row = [0.0; 4];
            if j > 0 {
                spline.second[j].iter().zip(&mut row[..3]).for_each(|(s, row)| *row -= s / h);
            }
            if j + 2 < count {
                spline.second[j + 1].iter().zip(&mut row[1..]).for_each(|(s, row)| *row += s / h);
            }
            let (skip, first) = if j == 0 { (1, 0) } else { (0, j - 1) };
            let end = if j + 2 < count { 4 } else { 3 };
            add(first, &row[skip..end], third * h);
        }
        Self { rows, bending, third }
    }

    /// The coefficients (i, i) to (i, i + 3).
    pub(super) fn row(&self, i: usize) -> &[f64; 4] {
        &self.rows[i]
    }

    /// The derivative by control point i.
    pub(super) fn gradient(&self, control: &[Vec2], i: usize) -> Vec2 {
        let mut sum = self.rows[i][0] * control[i];
        for k in 1..4 {
            if i + k < control.len() {
                sum += self.rows[i][k] * control[i + k];
            }
            if i >= k {
                sum += self.rows[i - k][k] * control[i - k];
            }
        }
        sum
    }

    /// Its value for these control points, over the knots of a range and the spans before them.
    pub(super) fn of(&self, spline: &Spline, control: &[Vec2], range: Range<usize>) -> f64 {
        let mut sum = 0.0;
        for i in range {
            let second = spline.second_of(control, i);
            if i > 0 {
                let (h, before) = (spline.span(i - 1), spline.second_of(control, i - 1));
                let after = if i + 1 < spline.count() { spline.span(i) } else { 0.0 };
                sum += self.bending * 0.25 * (h + after) * second.hypot2();
                sum += self.third * 0.5 * (second - before).hypot2() / h;
            }
        }
        sum
    }
}

/// Buffers for the steps.
#[derive(Default)]
pub(super) struct Workspace {
    system: Banded<8>,
    /// By knot: the distance from the sample, and how a step changes it.
    offsets: Vec<(Vec2, Vec2)>,
    /// A step of all control points; 0 outside the block.
    step: Vec<Vec2>,
}

/// Newton steps on the control points of a block, at most all but the first and the last one.
/// `steps` is their number at each weight of the barrier.
pub(super) fn smooth(
    spline: &mut Spline,
    samples: &[Point],
    radii: &[f64],
    energy: &Energy,
    block: Range<usize>,
    steps: usize,
    work: &mut Workspace,
) {
    let knots = (block.start - 1).max(1)..(block.end + 1).min(spline.count() - 1);
    work.step.resize(spline.count(), Vec2::ZERO);
    for weight in WEIGHTS {
        for _ in 0..steps {
            let value = energy.of(spline, &spline.control, knots.clone()).max(1e-9);
            let k = weight * value / block.len() as f64;
            if !newton(spline, samples, radii, energy, &block, &knots, k, work) {
                break;
            }
        }
    }
    work.step[block].fill(Vec2::ZERO);
}

/// One step; false if the system has no solution.
#[expect(clippy::too_many_arguments, reason = "all of the problem")]
fn newton(
    spline: &mut Spline,
    samples: &[Point],
    radii: &[f64],
    energy: &Energy,
    block: &Range<usize>,
    knots: &Range<usize>,
    k: f64,
    work: &mut Workspace,
) -> bool {
    let Workspace { system, offsets, step } = work;
    let (from, count) = (block.start, block.len());
    system.reset(2 * count);
    for i in block.clone() {
        let gradient = energy.gradient(&spline.control, i);
        for (distance, value) in energy.row(i).iter().enumerate() {
            if i + distance < block.end {
                let (a, b) = (2 * (i - from), 2 * (i + distance - from));
                system.add(a, b, *value);
                system.add(a + 1, b + 1, *value);
            }
        }
        system.right[2 * (i - from)] -= gradient.x;
        system.right[2 * (i - from) + 1] -= gradient.y;
    }
    offsets.clear();
    for i in knots.clone() {
        let e = spline.at_knot(i) - samples[i].to_vec2();
        offsets.push((e, Vec2::ZERO));
        let row = spline.value[i];
        let (first, hessian) = disc(e, radii[i], k);
        let at = |p: usize| (i + p).checked_sub(from + 1).filter(|index| *index < count);
        for p in 0..3 {
            let Some(ip) = at(p) else { continue };
            system.right[2 * ip] -= row[p] * first.x;
            system.right[2 * ip + 1] -= row[p] * first.y;
            for o in p..3 {
                let Some(io) = at(o) else { continue };
                add_pair(system, 2 * ip, 2 * io, row[p] * row[o], hessian);
            }
        }
    }
    if !system.solve() {
        return false;
    }
    let mut longest = f64::INFINITY;
    for (q, pair) in system.solution().chunks_exact(2).enumerate() {
        step[from + q] = Vec2::new(pair[0], pair[1]);
    }
    for (i, offset) in knots.clone().zip(offsets.iter_mut()) {
        offset.1 = spline.value_of(step, i);
        longest = longest.min(to_boundary(offset.0, offset.1, radii[i]));
    }
    // The energy along the step: `slope t + curve t²`.
    let (mut slope, mut curve) = (0.0, 0.0);
    for i in block.clone() {
        curve += 0.5 * step[i].dot(energy.gradient(step, i));
        slope += step[i].dot(energy.gradient(&spline.control, i));
    }
    let merit = |t: f64| {
        let slacks = knots.clone().zip(offsets.iter()).map(|(i, (e, x))| {
            let e = *e + t * *x;
            1.0 - e.hypot2() / (radii[i] * radii[i])
        });
        t * (slope + t * curve) - k * sum_of_logs(slacks)
    };
    let before = merit(0.0);
    let mut t = (SHORT_OF * longest).min(1.0);
    let is_worse = |merit: f64| merit.is_nan() || merit > before;
    while t > 1e-3 && is_worse(merit(t)) {
        t *= 0.5;
    }
    if t > 1e-3 {
        block.clone().for_each(|i| spline.control[i] += t * step[i]);
    }
    true
}

/// First and second derivative of `-k log(1 - |e|²/r²)` by e: a vector, and xx, xy and yy.
#[inline]
pub(super) fn disc(e: Vec2, radius: f64, k: f64) -> (Vec2, [f64; 3]) {
    let square = radius * radius;
    let slack = 1.0 - e.hypot2() / square;
    let a = 2.0 * k / (square * slack);
    let b = 4.0 * k / (square * square * slack * slack);
    (a * e, [a + b * e.x * e.x, b * e.x * e.y, a + b * e.y * e.y])
}

/// Adds `weight` times a symmetric matrix (xx, xy, yy) to the pairs of unknowns from a and from b.
#[inline]
pub(super) fn add_pair<const W: usize>(
    system: &mut Banded<W>,
    a: usize,
    b: usize,
    weight: f64,
    [xx, xy, yy]: [f64; 3],
) {
    system.add(a, b, weight * xx);
    system.add(a + 1, b + 1, weight * yy);
    system.add(a, b + 1, weight * xy);
    if a != b {
        system.add(a + 1, b, weight * xy);
    }
}

/// How far a point at `e` can go in steps of `x` before it leaves the disc of this radius.
fn to_boundary(e: Vec2, x: Vec2, radius: f64) -> f64 {
    let (a, b, c) = (x.hypot2(), x.dot(e), e.hypot2() - radius * radius);
    if a > 0.0 { ((b * b - a * c).max(0.0).sqrt() - b) / a } else { f64::INFINITY }
}

/// The sum of the logarithms of positive numbers up to about 1; NaN if one is not positive.
pub(super) fn sum_of_logs(numbers: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut product) = (0.0, 1.0);
    for number in numbers {
        if number.is_nan() || number <= 0.0 {
            return f64::NAN;
        }
        product *= number;
        if product < 1e-200 {
            sum += libm::log(product);
            product = 1.0;
        }
    }
    sum + libm::log(product)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energy_is_that_of_its_quadratic_form() {
        let samples: Vec<Point> = [(0.0, 0.0), (1.0, 0.2), (1.5, 1.0), (2.5, 1.0), (2.6, 0.1), (3.5, 0.0)]
            .iter()
            .map(|p| Point::from(*p))
            .collect();
        let spline = Spline::through(&samples);
        let energy = Energy::new(&spline, 0.7, 0.3);
        let form: f64 =
            (0..6).map(|i| 0.5 * spline.control[i].dot(energy.gradient(&spline.control, i))).sum();
        let sum = energy.of(&spline, &spline.control, 0..6);
        assert!((form - sum).abs() < 1e-9 * sum, "{form} and {sum}");
    }

    #[test]
    fn zigzag_is_smoothed_within_its_discs() {
        let samples: Vec<Point> =
            (0..40).map(|k| Point::new(0.25 * f64::from(k), if k % 2 == 0 { 0.03 } else { -0.03 })).collect();
        let mut spline = Spline::through(&samples);
        let energy = Energy::new(&spline, 1.0, 0.05);
        let before = energy.of(&spline, &spline.control, 0..40);
        let radii = [0.1; 40];
        smooth(&mut spline, &samples, &radii, &energy, 1..39, 6, &mut Workspace::default());
        assert!(energy.of(&spline, &spline.control, 0..40) < 1e-3 * before);
        for (i, sample) in samples.iter().enumerate() {
            assert!((spline.at_knot(i) - sample.to_vec2()).hypot() < 0.1);
        }
    }
}
