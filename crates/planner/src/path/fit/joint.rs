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
    tube::{add_pair, disc, sum_of_logs},
};

/// Number of Newton steps on a block. On the strokes of `tests/band.rs` drawing takes 0.3 % longer
/// with 7 steps.
pub(super) const STEPS: usize = 8;

/// The same where the barrier's weight is still above this share of the duration: short steps delay
/// it on dense strokes with many turns.
pub(super) const MOST_STEPS: usize = 12;
const LATE_WEIGHT: f64 = 0.01;

/// The barrier's weight a constraint at first, and at which a block is finished, as shares of the
/// duration.
const FIRST_WEIGHT: f64 = 0.5;
const LAST_WEIGHT: f64 = 1e-3;

/// Share of the limits that b starts with: in corners, and for changes of speed.
const GENTLE: (f64, f64) = (0.5, 0.8);

/// Places on a span at which limits are held, as shares of its length.
pub(super) const PLACES: [f64; 3] = [0.0, 0.5, 1.0];

/// A span of the spline. In terms of the change of S over it divided by its length, D, and of S'' at
/// its ends, P and R, with the share f of its length:
///
/// ```text
/// S' = D + h ((1/6 - (1 - f)²/2) P + (f²/2 - 1/6) R),   S'' = (1 - f) P + f R
/// ```
pub(super) struct SpanForms {
    /// Weights of the control points j - 1 to j + 2 for D, P and R.
    pub(super) rows: [[f64; 4]; 3],
    pub(super) length: f64,
    /// At each place.
    pub(super) forms: [MotorForms; 3],
    /// Whether a motor may reach its speed limit before the pen does, by motor.
    pub(super) may_limit_speed: [bool; 2],
}

impl SpanForms {
    /// Of span j; `None` if it leaves the reach.
    pub(super) fn of(limits: &Limits<'_>, spline: &Spline, j: usize) -> Option<Self> {
        let forms = if let Some(forms) = limits.everywhere() {
            [forms; 3]
        } else {
            let curve = drawing::Segment::Cubic(spline.bezier(j));
            let at = |share: f64| limits.near(curve.eval(share));
            [at(PLACES[0])?, at(PLACES[1])?, at(PLACES[2])?]
        };
        let may_limit_speed = [0, 1].map(|k| {
            let fastest = limits.square_pen_speed * limits.square_ratios[k];
            forms.iter().any(|forms| forms.linear[k].hypot2() * fastest > 1.0)
        });
        Some(Self { rows: spline.span_weights(j), length: spline.span(j), forms, may_limit_speed })
    }

    /// D, P and R.
    #[inline]
    pub(super) fn bends(&self, control: &[Vec2], j: usize) -> [Vec2; 3] {
        let last = control.len() - 1;
        // Where an index is clamped its weight is 0.
        let points = [0, 1, 2, 3].map(|k| control[(j + k).saturating_sub(1).min(last)]);
        self.rows.map(|row| row[0] * points[0] + row[1] * points[1] + row[2] * points[2] + row[3] * points[3])
    }

    /// Weights of P and R for S' at a place.
    #[inline]
    pub(super) fn weights(&self, place: usize) -> [f64; 2] {
        let f = PLACES[place];
        [self.length * (1.0 / 6.0 - 0.5 * (1.0 - f) * (1.0 - f)), self.length * (0.5 * f * f - 1.0 / 6.0)]
    }

    /// S' and S'' at a place.
    #[inline]
    pub(super) fn derivatives(&self, [d, p, r]: &[Vec2; 3], place: usize) -> [Vec2; 2] {
        let (f, [by_p, by_r]) = (PLACES[place], self.weights(place));
        [*d + by_p * *p + by_r * *r, (1.0 - f) * *p + f * *r]
    }
}

/// Whether speed limits are held at a place: the end of a span is the start of the next one, where
/// only the change of speed is another.
pub(super) fn has_caps(place: usize) -> bool {
    place < 2
}

/// The path and the limits.
pub(super) struct Problem<'a> {
    pub(super) limits: &'a Limits<'a>,
    pub(super) centers: &'a [Point],
    pub(super) radii: &'a [f64],
    /// The largest number of Newton steps: [`STEPS`] or [`MOST_STEPS`].
    pub(super) most_steps: usize,
}

/// Buffers for the steps.
#[derive(Default)]
pub(super) struct Workspace {
    system: Banded<12>,
    spans: Vec<SpanForms>,
    /// A copy of the control points and of b, equal to them outside of a step.
    control: Vec<Vec2>,
    b: Vec<f64>,
}

impl Problem<'_> {
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
            let span = SpanForms::of(self.limits, spline, j)?;
            let bends = span.bends(&spline.control, j);
            for (place, forms) in span.forms.iter().enumerate() {
                let [first, second] = span.derivatives(&bends, place);
                most = most.min(self.limits.square_pen_speed / first.hypot2());
                for k in 0..2 {
                    let (m1, m2, _) = forms.motor(k, first, second);
                    most = most.min(1.0 / m2.abs()).min(1.0 / (m1 * m1 * self.limits.square_ratios[k]));
                    slowness = slowness.max(m1.abs());
                }
            }
            b[j] = b[j].min(GENTLE.0 * most);
            b[j + 1] = b[j + 1].min(GENTLE.0 * most);
            changes.push(GENTLE.1 * span.length / slowness);
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
        work.spans.clear();
        for j in spans.clone() {
            work.spans.push(SpanForms::of(self.limits, spline, j)?);
        }
        if work.control.len() != spline.count() {
            work.control.clone_from(&spline.control);
            work.b = b.to_vec();
        }
        let around = block.start.saturating_sub(3)..(block.end + 3).min(spline.count());
        work.control[around.clone()].copy_from_slice(&spline.control[around.clone()]);
        work.b[around.clone()].copy_from_slice(&b[around]);
        let constraints = (block.len() * 22) as f64;
        let mut cost = self.cost(spline, &work.control, &work.b, block, &spans, &work.spans)?;
        let mut mu = FIRST_WEIGHT * cost.time / constraints;
        for step in 0..self.most_steps {
            if step >= STEPS && mu * constraints < LATE_WEIGHT * cost.time {
                break;
            }
            self.assemble(spline, b, block, &spans, mu, work);
            if !work.system.solve() {
                break;
            }
            let mut t = 1.0_f64;
            for (i, step) in block.clone().zip(work.system.solution().chunks_exact(3)) {
                if step[2] < 0.0 {
                    t = t.min(-0.95 * b[i] / step[2]);
                }
            }
            let mut accepted = None;
            while t > 1e-5 && accepted.is_none() {
                for (i, step) in block.clone().zip(work.system.solution().chunks_exact(3)) {
                    work.control[i] = spline.control[i] + t * Vec2::new(step[0], step[1]);
                    work.b[i] = b[i] + t * step[2];
                }
                let after = self.cost(spline, &work.control, &work.b, block, &spans, &work.spans);
                accepted = after.filter(|after| after.with(mu) < cost.with(mu));
                t *= if accepted.is_some() { 1.0 } else { 0.7 };
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
        of: &[SpanForms],
    ) -> Option<Cost> {
        if block.clone().any(|i| b[i].is_nan() || b[i] <= 0.0) {
            return None;
        }
        let mut time = 0.0;
        for (j, span) in spans.clone().zip(of) {
            time += 2.0 * span.length / (b[j].sqrt() + b[j + 1].sqrt());
        }
        let knots = (block.start - 1).max(1)..(block.end + 1).min(spline.count() - 1);
        let discs = knots.map(|i| {
            let e = spline.value_of(control, i) - self.centers[i].to_vec2();
            1.0 - e.hypot2() / (self.radii[i] * self.radii[i])
        });
        let slacks = spans
            .clone()
            .zip(of)
            .map(|(j, span)| self.slack(span, &span.bends(control, j), [b[j], b[j + 1]]));
        let barrier = sum_of_logs(discs.chain(slacks));
        (barrier.is_finite() && time.is_finite()).then_some(Cost { time, barrier })
    }

    /// The product of all slacks of a span, -1 if one is not positive.
    #[inline]
    fn slack(&self, span: &SpanForms, bends: &[Vec2; 3], [b0, b1]: [f64; 2]) -> f64 {
        let half_c = 0.5 * (b1 - b0) / span.length;
        let mut product = 1.0;
        let mut valid = true;
        for (place, forms) in span.forms.iter().enumerate() {
            let [first, second] = span.derivatives(bends, place);
            let b = b0 + PLACES[place] * (b1 - b0);
            let mut hold = |slack: f64| {
                valid &= slack > 0.0;
                product *= slack;
            };
            if has_caps(place) {
                hold(1.0 - b * first.hypot2() / self.limits.square_pen_speed);
            }
            for k in 0..2 {
                let (m1, m2, _) = forms.motor(k, first, second);
                if has_caps(place) && span.may_limit_speed[k] {
                    hold(1.0 - b * m1 * m1 * self.limits.square_ratios[k]);
                }
                let g = half_c * m1 + b * m2;
                hold(1.0 - g * g);
            }
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
        let Workspace { system, spans: of, .. } = work;
        let (from, count) = (block.start, block.len());
        system.reset(3 * count);
        let knots = (block.start - 1).max(1)..(block.end + 1).min(spline.count() - 1);
        for i in knots {
            let row = spline.value[i];
            let (first, hessian) = disc(spline.at_knot(i) - self.centers[i].to_vec2(), self.radii[i], mu);
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
        for (j, span) in spans.clone().zip(of) {
            let mut local = Local::default();
            local.add_time(span.length, b[j].sqrt(), b[j + 1].sqrt());
            let bends = span.bends(&spline.control, j);
            for place in 0..PLACES.len() {
                self.add_place(span, place, &bends, [b[j], b[j + 1]], mu, &mut local);
            }
            local.scatter(&span.rows, system, 3 * (j as isize - 1 - from as isize));
        }
    }

    /// Adds the barrier at one place.
    #[inline]
    fn add_place(
        &self,
        span: &SpanForms,
        place: usize,
        bends: &[Vec2; 3],
        [b0, b1]: [f64; 2],
        mu: f64,
        local: &mut Local,
    ) {
        let (f, forms) = (PLACES[place], &span.forms[place]);
        let [first, second] = span.derivatives(bends, place);
        let (b, rate) = (b0 + f * (b1 - b0), 0.5 / span.length);
        let half_c = rate * (b1 - b0);
        let [by_p, by_r] = span.weights(place);
        // The gradient by the span's unknowns, from those by S', S'' and both b.
        let by = |one: Vec2, two: Vec2, b0: f64, b1: f64| {
            let (p, r) = (by_p * one + (1.0 - f) * two, by_r * one + f * two);
            [one.x, p.x, r.x, one.y, p.y, r.y, b0, b1]
        };
        if has_caps(place) {
            // -log(1 - b value), where `slope` is the gradient of value by S'.
            let mut cap = |value: f64, slope: Vec2| {
                let slack = 1.0 / (1.0 - b * value);
                let gradient = by(b * slope, Vec2::ZERO, (1.0 - f) * value, f * value);
                local.add(&gradient, mu * slack, mu * slack * slack);
            };
            let pen = 1.0 / self.limits.square_pen_speed;
            cap(pen * first.hypot2(), 2.0 * pen * first);
            for k in 0..2 {
                if span.may_limit_speed[k] {
                    let (m1, _, _) = forms.motor(k, first, second);
                    let ratio = self.limits.square_ratios[k];
                    cap(ratio * m1 * m1, 2.0 * ratio * m1 * forms.linear[k]);
                }
            }
        }
        for k in 0..2 {
            let (m1, m2, m2_by_first) = forms.motor(k, first, second);
            let g = half_c * m1 + b * m2;
            let (up, down) = (1.0 / (1.0 - g), 1.0 / (1.0 + g));
            let linear = forms.linear[k];
            let gradient = by(
                half_c * linear + b * m2_by_first,
                b * linear,
                (1.0 - f) * m2 - rate * m1,
                f * m2 + rate * m1,
            );
            local.add(&gradient, mu * (up - down), mu * (up * up + down * down));
        }
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

/// Gradient and Hessian by the unknowns of a span: x of D, P and R, y of them, and b at both ends.
#[derive(Default)]
struct Local {
    gradient: [f64; 8],
    /// On and above the diagonal.
    hessian: [[f64; 8]; 8],
}

impl Local {
    /// Adds `slope` times a gradient, and `curvature` times its product with itself.
    #[expect(clippy::needless_range_loop, reason = "fixed bounds, which the compiler unrolls")]
    #[inline]
    fn add(&mut self, by: &[f64; 8], slope: f64, curvature: f64) {
        for p in 0..8 {
            self.gradient[p] += slope * by[p];
        }
        for p in 0..8 {
            let factor = curvature * by[p];
            // In pairs: from the diagonal or the element before it.
            for pair in p / 2..4 {
                self.hessian[p][2 * pair] += factor * by[2 * pair];
                self.hessian[p][2 * pair + 1] += factor * by[2 * pair + 1];
            }
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
        end(6, r0);
        end(7, r1);
        if r0 > 0.0 && r1 > 0.0 {
            self.hessian[6][7] += h / (square * sum * r0 * r1);
        }
    }

    /// Adds it to the system, where the span's first control point has the unknowns from `base` on.
    fn scatter(&self, rows: &[[f64; 4]; 3], system: &mut Banded<12>, base: isize) {
        let h = &self.hessian;
        let block = |at: usize, to: usize| {
            [0, 1, 2].map(|p| {
                [0, 1, 2].map(|q| if at == to && q < p { h[at + q][at + p] } else { h[at + p][to + q] })
            })
        };
        let (xx, xy, yy) = (both(rows, &block(0, 0)), both(rows, &block(0, 3)), both(rows, &block(3, 3)));
        let by_control =
            |k: usize, column: &dyn Fn(usize) -> f64| (0..3).map(|p| rows[p][k] * column(p)).sum::<f64>();
        // As in the system: x, y and b of four knots; the first and last b are not of this span.
        let (mut gradient, mut full) = ([0.0; 12], [[0.0; 12]; 12]);
        for k in 0..4 {
            for l in k..4 {
                full[3 * k][3 * l] = xx[k][l];
                full[3 * k][3 * l + 1] = xy[k][l];
                full[3 * k + 1][3 * l + 1] = yy[k][l];
                if l > k {
                    full[3 * k + 1][3 * l] = xy[l][k];
                }
            }
            for end in 0..2 {
                let b = 3 * (end + 1) + 2;
                let values = [0, 3].map(|of| by_control(k, &|p| h[of + p][6 + end]));
                for (axis, value) in values.into_iter().enumerate() {
                    let at = 3 * k + axis;
                    full[at.min(b)][at.max(b)] = value;
                }
            }
            gradient[3 * k] = by_control(k, &|p| self.gradient[p]);
            gradient[3 * k + 1] = by_control(k, &|p| self.gradient[3 + p]);
        }
        (gradient[5], gradient[8]) = (self.gradient[6], self.gradient[7]);
        (full[5][5], full[5][8], full[8][8]) = (h[6][6], h[6][7], h[7][7]);
        system.add_block(base, &gradient, &full);
    }
}

/// `rowsᵀ m rows`.
#[inline]
pub(super) fn both(rows: &[[f64; 4]; 3], m: &[[f64; 3]; 3]) -> [[f64; 4]; 4] {
    let half = [0, 1, 2]
        .map(|p| [0, 1, 2, 3].map(|l| m[p][0] * rows[0][l] + m[p][1] * rows[1][l] + m[p][2] * rows[2][l]));
    [0, 1, 2, 3].map(|k| {
        [0, 1, 2, 3].map(|l| rows[0][k] * half[0][l] + rows[1][k] * half[1][l] + rows[2][k] * half[2][l])
    })
}
