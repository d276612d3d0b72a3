//! Path and speed together: the spline within the tolerance on which the pen is fastest.
//!
//! With `b = (ds/dt)²` at the knots, linear between them, and `c = db/ds`, Newton steps minimize
//!
//! ```text
//! Σ 2 h / (√b0 + √b1) - mu [ Σ log(1 - |S(knot) - sample|²/r²)  +  at start, middle and end of a
//!     span, for each motor  log(1 - g²), g = (½ c m' + b m'') / a  and  log(1 - b m'²/v²),
//!     and for the pen       log(1 - b |S'|²/v²) ]
//! ```
//! over control points and b, with decreasing mu. A span depends on four control points and two b,
//! so with x, y and b of each knot in a row the Hessian has eleven diagonals below the main one. It
//! is exact for the time and the distances; the other terms are bilinear in path and speed, of which
//! only the product of gradients is kept, so it is positive definite.
//!
//! b starts low enough to be feasible and is dropped afterwards: the time parametrization of the
//! finished path finds a better one. Every iterate is feasible.

use std::ops::Range;

use drawing::{Point, Vec2};

use super::{
    banded::Banded,
    limits::{Limits, MotorForms},
    spline::Spline,
    tube::{Energy, add_pair, disc, sum_of_logs},
};

/// Number of Newton steps on a block. 8 take 1.007 times the optimum, 10 to
/// 20 1.006.
const STEPS: usize = 10;

/// The barrier's weight a constraint at first, and at which a block is finished, as shares of the
/// duration.
const FIRST_WEIGHT: f64 = 0.5;
const LAST_WEIGHT: f64 = 1e-3;

/// Share of the limits that b starts with: in corners, and for changes of speed.
const GENTLE: (f64, f64) = (0.5, 0.8);

/// A place on a span.
struct Place {
    /// Weights of the control points j - 1 to j + 2 for S' and S''.
    rows: [[f64; 4]; 2],
    forms: MotorForms,
    /// The share of the span's length.
    share: f64,
}

/// The path and the limits.
pub(super) struct Problem<'a> {
    pub(super) limits: &'a Limits<'a>,
    pub(super) samples: &'a [Point],
    pub(super) radii: &'a [f64],
    /// What is added to the time, in s.
    pub(super) smoothing: Option<&'a Energy>,
}

/// Buffers for the steps.
#[derive(Default)]
pub(super) struct Workspace {
    system: Banded<12>,
    places: Vec<[Place; 3]>,
    /// A copy of the control points and of b, equal to them outside of a step.
    control: Vec<Vec2>,
    b: Vec<f64>,
}

impl Problem<'_> {
    /// The derivatives at three places of span j.
    fn places(&self, spline: &Spline, j: usize) -> Option<[Place; 3]> {
        let curve = drawing::Segment::Cubic(spline.bezier(j));
        let place = |share: f64| {
            let forms = self.limits.near(curve.eval(share))?;
            Some(Place { rows: spline.derivative_weights(j, share), forms, share })
        };
        Some([place(0.0)?, place(0.5)?, place(1.0)?])
    }

    /// Low b at all knots from which any limit is some way off; `None` if the path leaves the reach.
    ///
    /// b is at most half of what any motor's curvature term or speed, or the pen's speed allows on
    /// the spans around, and changes by at most `0.8 h a / |m'|` from knot to knot, so that the sum
    /// of both terms stays below 0.9 of the limit.
    pub(super) fn gentle_speeds(&self, spline: &Spline) -> Option<Vec<f64>> {
        let count = spline.count();
        let mut b = vec![f64::INFINITY; count];
        let mut changes = Vec::with_capacity(count - 1);
        for j in 0..count - 1 {
            let (mut most, mut slowness) = (f64::INFINITY, 0.0_f64);
            for place in self.places(spline, j)? {
                let [first, second] = derivatives(&spline.control, &place.rows, j);
                most = most.min(self.limits.square_pen_speed / first.hypot2());
                for k in 0..2 {
                    let (m1, m2, _) = place.forms.motor(k, first, second);
                    most = most.min(1.0 / m2.abs()).min(1.0 / (m1 * m1 * self.limits.square_ratios[k]));
                    slowness = slowness.max(m1.abs());
                }
            }
            b[j] = b[j].min(GENTLE.0 * most);
            b[j + 1] = b[j + 1].min(GENTLE.0 * most);
            changes.push(GENTLE.1 * spline.span(j) / slowness);
        }
        (b[0], b[count - 1]) = (0.0, 0.0);
        for j in 0..count - 1 {
            b[j + 1] = b[j + 1].min(b[j] + changes[j]);
        }
        for j in (0..count - 1).rev() {
            b[j] = b[j].min(b[j + 1] + changes[j]);
        }
        b.iter().all(|b| b.is_finite()).then_some(b)
    }

    /// Newton steps on the control points and b of a block of knots, which contains neither the
    /// first nor the last one. Does nothing where the start is not feasible.
    pub(super) fn minimize(
        &self,
        spline: &mut Spline,
        b: &mut [f64],
        block: &Range<usize>,
        work: &mut Workspace,
    ) -> Option<()> {
        let spans = block.start.saturating_sub(2)..(block.end + 1).min(spline.count() - 1);
        work.places.clear();
        for j in spans.clone() {
            work.places.push(self.places(spline, j)?);
        }
        if work.control.len() != spline.count() {
            work.control.clone_from(&spline.control);
            work.b = b.to_vec();
        }
        let around = block.start.saturating_sub(3)..(block.end + 3).min(spline.count());
        work.control[around.clone()].copy_from_slice(&spline.control[around.clone()]);
        work.b[around.clone()].copy_from_slice(&b[around]);
        let constraints = (block.len() * 22) as f64;
        let mut cost = self.cost(spline, &work.control, &work.b, block, &spans, &work.places)?;
        let mut mu = FIRST_WEIGHT * cost.time / constraints;
        for _ in 0..STEPS {
            self.assemble(spline, b, block, &spans, mu, work);
            if !work.system.solve() {
                break;
            }
            let mut t = 1.0_f64;
            for (i, step) in block.clone().zip(work.system.right.chunks_exact(3)) {
                if step[2] < 0.0 {
                    t = t.min(-0.95 * b[i] / step[2]);
                }
            }
            let mut accepted = None;
            while t > 1e-5 && accepted.is_none() {
                for (i, step) in block.clone().zip(work.system.right.chunks_exact(3)) {
                    work.control[i] = spline.control[i] + t * Vec2::new(step[0], step[1]);
                    work.b[i] = b[i] + t * step[2];
                }
                let after = self.cost(spline, &work.control, &work.b, block, &spans, &work.places);
                accepted = after.filter(|after| after.with(mu) < cost.with(mu));
                t *= if accepted.is_some() { 1.0 } else { 0.5 };
            }
            if let Some(accepted) = accepted {
                spline.control[block.clone()].copy_from_slice(&work.control[block.clone()]);
                b[block.clone()].copy_from_slice(&work.b[block.clone()]);
                cost = accepted;
            } else {
                work.control[block.clone()].copy_from_slice(&spline.control[block.clone()]);
                work.b[block.clone()].copy_from_slice(&b[block.clone()]);
                t = 0.0;
            }
            if mu * constraints < LAST_WEIGHT * cost.time && t > 0.5 {
                break;
            }
            // Short steps mean that the path of minima is left: catch up before going on.
            if t > 0.2 || accepted.is_none() {
                let factor =
                    if t > 0.4 || accepted.is_none() { 0.5 } else { std::f64::consts::FRAC_1_SQRT_2 };
                mu = (factor * mu).max(0.2 * LAST_WEIGHT * cost.time / constraints);
            }
        }
        Some(())
    }

    /// The time over the spans of a block, and the barrier; `None` if a constraint is violated.
    fn cost(
        &self,
        spline: &Spline,
        control: &[Vec2],
        b: &[f64],
        block: &Range<usize>,
        spans: &Range<usize>,
        places: &[[Place; 3]],
    ) -> Option<Cost> {
        if block.clone().any(|i| b[i].is_nan() || b[i] <= 0.0) {
            return None;
        }
        let mut time = 0.0;
        for j in spans.clone() {
            time += 2.0 * spline.span(j) / (b[j].sqrt() + b[j + 1].sqrt());
        }
        if let Some(energy) = self.smoothing {
            // A control point changes the second derivative of the knots next to it.
            let knots = block.start - 1..(block.end + 2).min(spline.count());
            time += energy.of(spline, control, knots);
        }
        let knots = (block.start - 1).max(1)..(block.end + 1).min(spline.count() - 1);
        let discs = knots.map(|i| {
            let e = spline.value_of(control, i) - self.samples[i].to_vec2();
            1.0 - e.hypot2() / (self.radii[i] * self.radii[i])
        });
        let slacks = spans.clone().zip(places).flat_map(|(j, places)| {
            let c = (b[j + 1] - b[j]) / spline.span(j);
            places.iter().map(move |place| self.slack(place, control, j, b, c))
        });
        let barrier = sum_of_logs(discs.chain(slacks));
        (barrier.is_finite() && time.is_finite()).then_some(Cost { time, barrier })
    }

    /// The product of all slacks at a place, -1 if one is not positive.
    #[inline]
    fn slack(&self, place: &Place, control: &[Vec2], j: usize, b: &[f64], c: f64) -> f64 {
        let [first, second] = derivatives(control, &place.rows, j);
        let b = (1.0 - place.share) * b[j] + place.share * b[j + 1];
        let mut product = 1.0;
        let mut valid = true;
        let mut hold = |slack: f64| {
            valid &= slack > 0.0;
            product *= slack;
        };
        hold(1.0 - b * first.hypot2() / self.limits.square_pen_speed);
        for k in 0..2 {
            let (m1, m2, _) = place.forms.motor(k, first, second);
            hold(1.0 - b * m1 * m1 * self.limits.square_ratios[k]);
            let g = 0.5 * c * m1 + b * m2;
            hold(1.0 - g * g);
        }
        if valid { product } else { -1.0 }
    }

    fn assemble(
        &self,
        spline: &Spline,
        b: &[f64],
        block: &Range<usize>,
        spans: &Range<usize>,
        mu: f64,
        work: &mut Workspace,
    ) {
        let Workspace { system, places, .. } = work;
        let (from, count) = (block.start, block.len());
        system.reset(3 * count);
        if let Some(energy) = self.smoothing {
            for i in block.clone() {
                let gradient = energy.gradient(&spline.control, i);
                for (distance, value) in energy.row(i).iter().enumerate() {
                    if i + distance < block.end {
                        let (p, q) = (3 * (i - from), 3 * (i + distance - from));
                        system.add(p, q, *value);
                        system.add(p + 1, q + 1, *value);
                    }
                }
                system.right[3 * (i - from)] -= gradient.x;
                system.right[3 * (i - from) + 1] -= gradient.y;
            }
        }
        let knots = (block.start - 1).max(1)..(block.end + 1).min(spline.count() - 1);
        for i in knots {
            let row = spline.value[i];
            let (first, hessian) = disc(spline.at_knot(i) - self.samples[i].to_vec2(), self.radii[i], mu);
            let at = |p: usize| (i + p).checked_sub(from + 1).filter(|index| *index < count);
            for p in 0..3 {
                let Some(ip) = at(p) else { continue };
                system.right[3 * ip] -= row[p] * first.x;
                system.right[3 * ip + 1] -= row[p] * first.y;
                for o in p..3 {
                    let Some(io) = at(o) else { continue };
                    add_pair(system, 3 * ip, 3 * io, row[p] * row[o], hessian);
                }
            }
        }
        for (j, places) in spans.clone().zip(places) {
            let mut local = Local::default();
            let (h, b0, b1) = (spline.span(j), b[j], b[j + 1]);
            local.add_time(h, b0.sqrt(), b1.sqrt());
            for place in places.iter() {
                self.add_place(place, &spline.control, j, [b0, b1], h, mu, &mut local);
            }
            local.scatter(system, j, from, count);
        }
    }

    /// Adds the barrier at one place.
    #[expect(clippy::too_many_arguments, reason = "all of the problem")]
    fn add_place(
        &self,
        place: &Place,
        control: &[Vec2],
        j: usize,
        [b0, b1]: [f64; 2],
        h: f64,
        mu: f64,
        local: &mut Local,
    ) {
        let [first, second] = derivatives(control, &place.rows, j);
        let (w0, w1) = (1.0 - place.share, place.share);
        let (b, c) = (w0 * b0 + w1 * b1, (b1 - b0) / h);
        let mut quadratic = Quadratic::default();
        // -log(1 - b value), where `by` is the gradient of value by S'.
        let mut cap = |value: f64, by: Vec2| {
            let slack = 1.0 / (1.0 - b * value);
            quadratic.add(&[b * by.x, b * by.y, 0.0, 0.0, value, 0.0], mu * slack, mu * slack * slack);
        };
        let pen = 1.0 / self.limits.square_pen_speed;
        cap(pen * first.hypot2(), 2.0 * pen * first);
        for k in 0..2 {
            let (m1, _, _) = place.forms.motor(k, first, second);
            let ratio = self.limits.square_ratios[k];
            cap(ratio * m1 * m1, 2.0 * ratio * m1 * place.forms.linear[k]);
        }
        for k in 0..2 {
            let (m1, m2, m2_by_first) = place.forms.motor(k, first, second);
            let g = 0.5 * c * m1 + b * m2;
            let (up, down) = (1.0 / (1.0 - g), 1.0 / (1.0 + g));
            let linear = place.forms.linear[k];
            let by = 0.5 * c * linear + b * m2_by_first;
            let gradient = [by.x, by.y, b * linear.x, b * linear.y, m2, 0.5 * m1];
            quadratic.add(&gradient, mu * (up - down), mu * (up * up + down * down));
        }
        local.add(&quadratic, &place.rows, [w0, w1], 1.0 / h);
    }
}

/// The parts of the objective.
#[derive(Clone, Copy)]
struct Cost {
    /// s.
    time: f64,
    /// The sum of the logarithms of all slacks.
    barrier: f64,
}

impl Cost {
    fn with(&self, mu: f64) -> f64 {
        self.time - mu * self.barrier
    }
}

/// S' and S''.
#[inline]
fn derivatives(control: &[Vec2], rows: &[[f64; 4]; 2], j: usize) -> [Vec2; 2] {
    let last = control.len() - 1;
    let mut sums = [Vec2::ZERO; 2];
    for k in 0..4 {
        // Where an index is clamped its weight is 0.
        let point = control[(j + k).saturating_sub(1).min(last)];
        sums[0] += rows[0][k] * point;
        sums[1] += rows[1][k] * point;
    }
    sums
}

/// Gradient and Hessian by S', S'', b and c at one place.
#[derive(Default)]
struct Quadratic {
    gradient: [f64; 6],
    hessian: [[f64; 6]; 6],
}

impl Quadratic {
    /// Adds `slope` times a gradient, and `curvature` times its product with itself.
    #[inline]
    fn add(&mut self, by: &[f64; 6], slope: f64, curvature: f64) {
        for p in 0..6 {
            self.gradient[p] += slope * by[p];
            let factor = curvature * by[p];
            self.hessian[p].iter_mut().zip(by).for_each(|(h, by)| *h += factor * by);
        }
    }
}

/// Gradient and Hessian by the unknowns of a span: x and y of four control points, and two b.
#[derive(Default)]
struct Local {
    gradient: [f64; 10],
    hessian: [[f64; 10]; 10],
}

impl Local {
    /// Adds a function of S', S'', b and c, given how those depend on the unknowns: the weights of
    /// the control points and of b, and `1 / h` for c.
    #[expect(clippy::needless_range_loop, reason = "columns of two matrices")]
    #[inline]
    fn add(&mut self, of: &Quadratic, [d1, d2]: &[[f64; 4]; 2], [w0, w1]: [f64; 2], rate: f64) {
        // The six rows of the Hessian times the derivatives by the unknowns.
        let mut half = [[0.0; 10]; 6];
        for (row, half) in of.hessian.iter().zip(&mut half) {
            for p in 0..4 {
                half[2 * p] = d1[p] * row[0] + d2[p] * row[2];
                half[2 * p + 1] = d1[p] * row[1] + d2[p] * row[3];
            }
            half[8] = w0 * row[4] - rate * row[5];
            half[9] = w1 * row[4] + rate * row[5];
        }
        let g = &of.gradient;
        for p in 0..4 {
            self.gradient[2 * p] += d1[p] * g[0] + d2[p] * g[2];
            self.gradient[2 * p + 1] += d1[p] * g[1] + d2[p] * g[3];
            for q in 0..10 {
                self.hessian[2 * p][q] += d1[p] * half[0][q] + d2[p] * half[2][q];
                self.hessian[2 * p + 1][q] += d1[p] * half[1][q] + d2[p] * half[3][q];
            }
        }
        self.gradient[8] += w0 * g[4] - rate * g[5];
        self.gradient[9] += w1 * g[4] + rate * g[5];
        for q in 8..10 {
            self.hessian[8][q] += w0 * half[4][q] - rate * half[5][q];
            self.hessian[9][q] += w1 * half[4][q] + rate * half[5][q];
        }
    }

    /// Adds the time `2 h / (r0 + r1)` with `r = √b`.
    fn add_time(&mut self, h: f64, r0: f64, r1: f64) {
        let sum = r0 + r1;
        let square = sum * sum;
        let mut end = |index: usize, r: f64| {
            if r > 0.0 {
                self.gradient[index] -= h / (square * r);
                self.hessian[index][index] += h / (2.0 * square * r * r * r) + h / (square * sum * r * r);
            }
        };
        end(8, r0);
        end(9, r1);
        if r0 > 0.0 && r1 > 0.0 {
            self.hessian[8][9] += h / (square * sum * r0 * r1);
        }
    }

    /// Adds it to the system of the knots from `from` on.
    fn scatter(&self, system: &mut Banded<12>, j: usize, from: usize, count: usize) {
        let mut at = [usize::MAX; 10];
        for p in 0..4 {
            if let Some(index) = (j + p).checked_sub(from + 1).filter(|index| *index < count) {
                at[2 * p] = 3 * index;
                at[2 * p + 1] = 3 * index + 1;
            }
        }
        for p in 0..2 {
            if let Some(index) = (j + p).checked_sub(from).filter(|index| *index < count) {
                at[8 + p] = 3 * index + 2;
            }
        }
        for p in 0..10 {
            if at[p] == usize::MAX {
                continue;
            }
            system.right[at[p]] -= self.gradient[p];
            for q in p..10 {
                if at[q] != usize::MAX {
                    system.add(at[p], at[q], self.hessian[p][q]);
                }
            }
        }
    }
}
