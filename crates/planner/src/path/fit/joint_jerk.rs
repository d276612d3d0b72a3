//! Path and speed together under jerk limits.
//!
//! As in [`super::joint`], but with `b = (ds/dt)²` a quadratic spline over the spans, with
//! `c = db/ds` continuous and `w = d²b/ds²` constant on a span, and for each motor with the limits a
//! and j also
//!
//! ```text
//! 1/√b ± (½ m' w + 3/2 m'' c + m''' b) / j  >=  0     m''' = J S''' + 3 S'ᵀ K S''
//! ```
//! at the start, middle and end of a span. The unknowns of b are the middle Bézier ordinates z of the
//! spans between the first and the last one, on which the jerk is constant in time: b grows from
//! rest as `s^(4/3)`. With x, y and z of each knot in a row the Hessian again has eleven diagonals
//! below the main one. Of the jerk limits too only the product of gradients is kept.
//!
//! Knots slide along the path, which changes the time little, so the Newton steps are damped: without
//! that they shrink to a sixteenth.

use std::ops::Range;

use drawing::{Point, Vec2};

use super::{
    banded::Banded,
    joint::{PLACES, SpanForms, both, has_caps},
    limits::Limits,
    spline::Spline,
    tube::{add_pair, disc, sum_of_logs},
};

/// Number of Newton steps on a block.
const STEPS: usize = 25;

/// The barrier's weight a constraint at first, and at which a block is finished, as shares of the
/// duration.
const FIRST_WEIGHT: f64 = 0.5;
const LAST_WEIGHT: f64 = 1e-3;

/// The curvature added to that of the discs, as a multiple of theirs in the middle.
const DAMPING: f64 = 100.0;

/// Weights of Simpson's rule.
const SIMPSON: [f64; 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];

/// `j h² / √b³` for motion with the jerk j from rest to b at h.
const JERK_OF_REST: f64 = 2.0 / 9.0;

/// The path and the limits.
pub(super) struct Problem<'a> {
    pub(super) limits: &'a Limits<'a>,
    pub(super) centers: &'a [Point],
    pub(super) radii: &'a [f64],
}

/// Buffers for the steps.
#[derive(Default)]
pub(super) struct Workspace {
    system: Banded<12>,
    spans: Vec<Span>,
    /// A copy of the control points and of z, equal to them outside of a step.
    control: Vec<Vec2>,
    z: Vec<f64>,
}

/// A span, and how b follows there from the z of the span before it, its own and that of the one behind
/// it.
struct Span {
    forms: SpanForms,
    kind: Kind,
    /// The Bézier ordinates of b by these three z.
    of_z: [[f64; 3]; 3],
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Inner,
    /// The first or last one, where the jerk is constant: limits are held with the b, c and w of its
    /// inner end, where the utilization is largest. All three ordinates are that b.
    Rest {
        /// 1 for the first span, -1 for the last one.
        sign: f64,
    },
}

/// Derivatives of the path and of b by s at a place.
struct At {
    first: Vec2,
    second: Vec2,
    third: Vec2,
    b: f64,
    c: f64,
    w: f64,
}

impl Span {
    fn at(&self, bends: &[Vec2; 3], [b0, b1, b2]: [f64; 3], place: usize) -> At {
        let [first, second] = self.forms.derivatives(bends, place);
        let h = self.forms.length;
        let ([v, s, w], third) = (self.place_weights(place), (1.0 / h) * (bends[2] - bends[1]));
        let sum = |x: [f64; 3]| x[0] * b0 + x[1] * b1 + x[2] * b2;
        At { first, second, third, b: sum(v), c: sum(s), w: sum(w) }
    }

    fn ordinates(&self, z: &[f64], j: usize) -> [f64; 3] {
        let around = [z[j.saturating_sub(1)], z[j], z.get(j + 1).copied().unwrap_or(0.0)];
        self.of_z.map(|row| row[0] * around[0] + row[1] * around[1] + row[2] * around[2])
    }

    /// The weights of the ordinates for b, c and w at a place.
    #[inline]
    fn place_weights(&self, place: usize) -> [[f64; 3]; 3] {
        let (f, h) = (PLACES[place], self.forms.length);
        let g = 1.0 - f;
        match self.kind {
            Kind::Inner => [
                [g * g, 2.0 * f * g, f * f],
                [-2.0 * g / h, 2.0 * (g - f) / h, 2.0 * f / h],
                [2.0 / (h * h), -4.0 / (h * h), 2.0 / (h * h)],
            ],
            // With s = j t³/6: c = 4 b / (3 h), and d³s/dt³ = ½ w √b with w = 4 b / (9 h²).
            Kind::Rest { sign } => {
                [[1.0, 0.0, 0.0], [sign * 4.0 / (3.0 * h), 0.0, 0.0], [4.0 / (9.0 * h * h), 0.0, 0.0]]
            }
        }
    }

    /// The share of 1 / √b at a place in the time over the span.
    fn time_weight(&self, place: usize) -> f64 {
        self.forms.length
            * match self.kind {
                Kind::Inner => SIMPSON[place],
                // From rest to b at h with constant jerk: 3 h / √b.
                Kind::Rest { .. } => [0.0, 3.0, 0.0][place],
            }
    }
}

/// The third derivative of motor k, and its gradient by S' and S''.
#[inline]
fn third_of(forms: &SpanForms, place: usize, k: usize, at: &At) -> (f64, Vec2, Vec2) {
    let motor = &forms.forms[place];
    let (by_second, by_first) = (motor.half(k, at.first), motor.half(k, at.second));
    (motor.linear[k].dot(at.third) + 3.0 * by_second.dot(at.second), 3.0 * by_first, 3.0 * by_second)
}

impl Problem<'_> {
    fn span(&self, spline: &Spline, j: usize) -> Option<Span> {
        let last = spline.count() - 2;
        let forms = SpanForms::of(self.limits, spline, j)?;
        let h = spline.span(j);
        // From the ray c = 4 b / (3 h) at an end: b = z / (1 + 2/3 h / end), where h is that of the
        // inner span.
        let ray = |h: f64, end: f64| 1.0 / (1.0 + 2.0 / 3.0 * h / end);
        if j == 0 {
            let row = [0.0, 0.0, ray(spline.span(1), h)];
            return Some(Span { forms, kind: Kind::Rest { sign: 1.0 }, of_z: [row; 3] });
        }
        if j == last {
            let row = [ray(spline.span(j - 1), h), 0.0, 0.0];
            return Some(Span { forms, kind: Kind::Rest { sign: -1.0 }, of_z: [row; 3] });
        }
        let (before, after) = (spline.span(j - 1), spline.span(j + 1));
        let start =
            if j == 1 { [0.0, ray(h, before), 0.0] } else { [h / (before + h), before / (before + h), 0.0] };
        let end = if j + 1 == last {
            [0.0, ray(h, after), 0.0]
        } else {
            [0.0, after / (after + h), h / (after + h)]
        };
        Some(Span { forms, kind: Kind::Inner, of_z: [start, [0.0, 1.0, 0.0], end] })
    }

    /// Low z at all spans from which any limit is some way off.
    ///
    /// As in the time parametrization: what one term of a limit alone would allow, from rest as
    /// `s^(4/3)`, and scaled down until it is feasible.
    pub(super) fn gentle_speeds(&self, spline: &Spline, work: &mut Workspace) -> Option<Vec<f64>> {
        let count = spline.count();
        let length = spline.knots[count - 1];
        let mut z = vec![0.0; count];
        let mut steps = vec![(0.0, 0.0); count];
        let spans = 0..count - 1;
        work.spans.clear();
        for j in spans.clone() {
            let span = self.span(spline, j)?;
            let bends = span.forms.bends(&spline.control, j);
            let [mut turn, mut bend, mut rate, mut jerk] = [1e-12_f64; 4];
            let mut cap = f64::INFINITY;
            for place in 0..PLACES.len() {
                let at = span.at(&bends, [1.0; 3], place);
                cap = cap.min(self.limits.square_pen_speed / at.first.hypot2());
                for k in 0..2 {
                    let build_up = self.limits.build_ups_s[k];
                    let (m1, m2, _) = span.forms.forms[place].motor(k, at.first, at.second);
                    let (m3, _, _) = third_of(&span.forms, place, k, &at);
                    cap = cap.min(1.0 / (m1 * m1 * self.limits.square_ratios[k]));
                    bend = bend.max(m2.abs());
                    turn = turn.max(build_up * m3.abs());
                    rate = rate.max(m1.abs());
                    jerk = jerk.max(build_up * m1.abs());
                }
            }
            let h = span.forms.length;
            let middle = spline.knots[j] + 0.5 * h;
            let rest = middle.min(length - middle);
            let square = |x: f64| libm::cbrt(x * x);
            z[j] = (0.5 * cap)
                .min(0.5 / bend)
                .min(square(0.3 / turn))
                .min(0.5 * square(rest * rest / (JERK_OF_REST * jerk)));
            steps[j] = (0.4 * h / rate, 0.16 * h * h / jerk);
            work.spans.push(span);
        }
        (z[0], z[count - 2]) = (0.0, 0.0);
        let step = |b: f64, (by_acceleration, by_jerk): (f64, f64)| {
            b + by_acceleration.min((by_jerk * b.sqrt()).sqrt())
        };
        for j in 2..count - 2 {
            z[j] = z[j].min(step(z[j - 1], steps[j]));
        }
        for j in (1..count - 3).rev() {
            z[j] = z[j].min(step(z[j + 1], steps[j]));
        }
        work.control.clone_from(&spline.control);
        let block = 1..count - 1;
        for _ in 0..60 {
            if self.cost(spline, &work.control, &z, &block, &spans, work).is_some() {
                for z in &mut z {
                    *z *= 0.9;
                }
                work.z.clone_from(&z);
                return Some(z);
            }
            for z in &mut z {
                *z *= 0.7;
            }
        }
        None
    }

    /// Newton steps on the control points and z of a block of knots, which contains neither the
    /// first nor the last one. Does nothing where the start is not feasible.
    pub(super) fn minimize(
        &self,
        spline: &mut Spline,
        z: &mut [f64],
        block: &Range<usize>,
        work: &mut Workspace,
    ) -> Option<()> {
        let count = spline.count();
        let spans = block.start.saturating_sub(2)..(block.end + 1).min(count - 1);
        work.spans.clear();
        for j in spans.clone() {
            work.spans.push(self.span(spline, j)?);
        }
        let around = block.start.saturating_sub(3)..(block.end + 3).min(count);
        work.control[around.clone()].copy_from_slice(&spline.control[around.clone()]);
        work.z[around.clone()].copy_from_slice(&z[around]);
        let constraints = (block.len() * 34) as f64;
        let mut time = self.cost(spline, &spline.control, z, block, &spans, work)?.0;
        let mut mu = FIRST_WEIGHT * time / constraints;
        for _ in 0..STEPS {
            self.assemble(spline, z, block, &spans, mu, work);
            if !work.system.solve() {
                break;
            }
            let Some(before) = self.cost(spline, &spline.control, z, block, &spans, work) else { break };
            let mut t = 1.0_f64;
            for (i, step) in block.clone().zip(work.system.solution().chunks_exact(3)) {
                if step[2] < 0.0 && i < count - 2 {
                    t = t.min(-0.98 * z[i] / step[2]);
                }
            }
            let mut accepted = None;
            while t > 1e-5 && accepted.is_none() {
                for (i, step) in block.clone().zip(work.system.solution().chunks_exact(3)) {
                    work.control[i] = spline.control[i] + t * Vec2::new(step[0], step[1]);
                    work.z[i] = z[i] + t * step[2];
                }
                let after = self.cost(spline, &work.control, &work.z, block, &spans, work);
                accepted = after.filter(|after| after.0 - mu * after.1 < before.0 - mu * before.1);
                t *= if accepted.is_some() { 1.0 } else { 0.5 };
            }
            if let Some((found, _)) = accepted {
                spline.control[block.clone()].copy_from_slice(&work.control[block.clone()]);
                z[block.clone()].copy_from_slice(&work.z[block.clone()]);
                time = found;
            } else {
                work.control[block.clone()].copy_from_slice(&spline.control[block.clone()]);
                work.z[block.clone()].copy_from_slice(&z[block.clone()]);
                t = 0.0;
            }
            if mu * constraints < LAST_WEIGHT * time && t > 0.5 {
                break;
            }
            // Short steps mean that the path of minima is left: catch up before going on.
            if t > 0.2 || accepted.is_none() {
                let factor =
                    if t > 0.4 || accepted.is_none() { 0.5 } else { std::f64::consts::FRAC_1_SQRT_2 };
                mu = (factor * mu).max(0.2 * LAST_WEIGHT * time / constraints);
            }
        }
        Some(())
    }

    /// The time over the spans of a block, and the barrier; `None` if a constraint is violated.
    fn cost(
        &self,
        spline: &Spline,
        control: &[Vec2],
        z: &[f64],
        block: &Range<usize>,
        spans: &Range<usize>,
        work: &Workspace,
    ) -> Option<(f64, f64)> {
        let count = spline.count();
        let mut time = 0.0;
        let knots = (block.start - 1).max(1)..(block.end + 1).min(count - 1);
        let discs = knots.map(|i| {
            let e = spline.value_of(control, i) - self.centers[i].to_vec2();
            1.0 - e.hypot2() / (self.radii[i] * self.radii[i])
        });
        let slacks = spans.clone().zip(&work.spans).map(|(j, span)| {
            let (part, slack) = self.slack(span, &span.forms.bends(control, j), span.ordinates(z, j));
            time += part;
            slack
        });
        let barrier = sum_of_logs(discs.chain(slacks));
        (barrier.is_finite() && time.is_finite()).then_some((time, barrier))
    }

    /// The time over a span, and the product of all its slacks, -1 if one is not positive.
    fn slack(&self, span: &Span, bends: &[Vec2; 3], ordinates: [f64; 3]) -> (f64, f64) {
        let (mut time, mut product, mut valid) = (0.0, 1.0, true);
        for place in 0..PLACES.len() {
            let at = span.at(bends, ordinates, place);
            if at.b.is_nan() || at.b <= 0.0 {
                return (time, -1.0);
            }
            let mut hold = |slack: f64| {
                valid &= slack > 0.0;
                product *= slack;
            };
            time += span.time_weight(place) / at.b.sqrt();
            if has_caps(place) {
                hold(1.0 - at.b * at.first.hypot2() / self.limits.square_pen_speed);
            }
            for k in 0..2 {
                let (m1, m2, _) = span.forms.forms[place].motor(k, at.first, at.second);
                let (m3, _, _) = third_of(&span.forms, place, k, &at);
                if has_caps(place) && span.forms.may_limit_speed[k] {
                    hold(1.0 - at.b * m1 * m1 * self.limits.square_ratios[k]);
                }
                let g = 0.5 * at.c * m1 + at.b * m2;
                hold(1.0 - g * g);
                let g = self.limits.build_ups_s[k] * (0.5 * m1 * at.w + 1.5 * m2 * at.c + m3 * at.b);
                hold(1.0 - g * g * at.b);
            }
        }
        (time, if valid { product } else { -1.0 })
    }

    fn assemble(
        &self,
        spline: &Spline,
        z: &[f64],
        block: &Range<usize>,
        spans: &Range<usize>,
        mu: f64,
        work: &mut Workspace,
    ) {
        let Workspace { system, spans: of, .. } = work;
        let (from, count, total) = (block.start, block.len(), spline.count());
        system.reset(3 * count);
        let knots = (block.start - 1).max(1)..(block.end + 1).min(total - 1);
        for i in knots {
            let row = spline.value[i];
            let (first, mut hessian) = disc(spline.at_knot(i) - self.centers[i].to_vec2(), self.radii[i], mu);
            let damping = 2.0 * DAMPING * mu / (self.radii[i] * self.radii[i]);
            hessian[0] += damping;
            hessian[2] += damping;
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
        for (j, span) in spans.clone().zip(of.iter()) {
            let mut local = Local::default();
            let bends = span.forms.bends(&spline.control, j);
            let ordinates = span.ordinates(z, j);
            for place in 0..PLACES.len() {
                self.add_place(span, place, &bends, ordinates, mu, &mut local);
            }
            local.scatter(span, system, 3 * (j as isize - 1 - from as isize));
        }
        if block.end == total - 1 {
            // The last knot has no z.
            system.add(3 * count - 1, 3 * count - 1, 1.0);
        }
    }

    /// Adds the time and the barrier at one place.
    fn add_place(
        &self,
        span: &Span,
        place: usize,
        bends: &[Vec2; 3],
        ordinates: [f64; 3],
        mu: f64,
        local: &mut Local,
    ) {
        let (f, h, forms) = (PLACES[place], span.forms.length, &span.forms.forms[place]);
        let at = span.at(bends, ordinates, place);
        let [by_p, by_r] = span.forms.weights(place);
        let [of_b, of_c, of_w] = span.place_weights(place);
        let by = |[one, two, three]: [Vec2; 3], [b, c, w]: [f64; 3]| {
            let p = by_p * one + (1.0 - f) * two - (1.0 / h) * three;
            let r = by_r * one + f * two + (1.0 / h) * three;
            let z = [0, 1, 2].map(|q| b * of_b[q] + c * of_c[q] + w * of_w[q]);
            [one.x, p.x, r.x, one.y, p.y, r.y, z[0], z[1], z[2]]
        };
        let none = Vec2::ZERO;
        if has_caps(place) {
            let mut cap = |value: f64, slope: Vec2| {
                let slack = 1.0 / (1.0 - at.b * value);
                local.add(&by([at.b * slope, none, none], [value, 0.0, 0.0]), mu * slack, mu * slack * slack);
            };
            let pen = 1.0 / self.limits.square_pen_speed;
            cap(pen * at.first.hypot2(), 2.0 * pen * at.first);
            for k in 0..2 {
                if span.forms.may_limit_speed[k] {
                    let (m1, _, _) = forms.motor(k, at.first, at.second);
                    let ratio = self.limits.square_ratios[k];
                    cap(ratio * m1 * m1, 2.0 * ratio * m1 * forms.linear[k]);
                }
            }
        }
        // 1 / √b and its derivatives: the time, and the slack of jerk limits.
        let slowness = 1.0 / at.b.sqrt();
        let slope = -0.5 * slowness / at.b;
        let weight = span.time_weight(place);
        let mut of_slowness = weight * slope;
        for k in 0..2 {
            let linear = forms.linear[k];
            let (m1, m2, m2_by_first) = forms.motor(k, at.first, at.second);
            let (m3, m3_by_first, m3_by_second) = third_of(&span.forms, place, k, &at);
            let g = 0.5 * at.c * m1 + at.b * m2;
            let (up, down) = (1.0 / (1.0 - g), 1.0 / (1.0 + g));
            let gradient =
                by([0.5 * at.c * linear + at.b * m2_by_first, at.b * linear, none], [m2, 0.5 * m1, 0.0]);
            local.add(&gradient, mu * (up - down), mu * (up * up + down * down));
            let build_up = self.limits.build_ups_s[k];
            if build_up > 0.0 {
                let g = build_up * (0.5 * m1 * at.w + 1.5 * m2 * at.c + m3 * at.b);
                let one = 0.5 * at.w * linear + 1.5 * at.c * m2_by_first + at.b * m3_by_first;
                let two = 1.5 * at.c * linear + at.b * m3_by_second;
                let by_path = [one, two, at.b * linear].map(|v| build_up * v);
                let by_speed = [m3, 1.5 * m2, 0.5 * m1].map(|x| build_up * x);
                for sign in [1.0, -1.0] {
                    let slack = 1.0 / (slowness - sign * g);
                    let speed = [slope - sign * by_speed[0], -sign * by_speed[1], -sign * by_speed[2]];
                    local.add(&by(by_path.map(|v| -sign * v), speed), -mu * slack, mu * slack * slack);
                }
                // The slacks are those of |g| √b <= 1 divided by √b.
                of_slowness += 2.0 * mu * slope / slowness;
            }
        }
        let curvature = weight * 0.75 * slowness / (at.b * at.b);
        local.add(&by([none; 3], [1.0, 0.0, 0.0]), of_slowness, curvature);
    }
}

/// Gradient and Hessian by the unknowns of a span: x of D, P and R, y of them, and the ordinates of b.
#[derive(Default)]
struct Local {
    gradient: [f64; 9],
    /// On and above the diagonal.
    hessian: [[f64; 9]; 9],
}

impl Local {
    /// Adds `slope` times a gradient, and `curvature` times its product with itself.
    #[expect(clippy::needless_range_loop, reason = "fixed bounds, which the compiler unrolls")]
    #[inline]
    fn add(&mut self, by: &[f64; 9], slope: f64, curvature: f64) {
        for p in 0..9 {
            self.gradient[p] += slope * by[p];
            let factor = curvature * by[p];
            for q in p..9 {
                self.hessian[p][q] += factor * by[q];
            }
        }
    }

    /// Adds it to the system, where the span's first control point has the unknowns from `base` on.
    fn scatter(&self, span: &Span, system: &mut Banded<12>, base: isize) {
        let (h, rows) = (&self.hessian, &span.forms.rows);
        let of_z = span.of_z;
        let block = |at: usize, to: usize| {
            [0, 1, 2].map(|p| {
                [0, 1, 2].map(|q| if at == to && q < p { h[at + q][at + p] } else { h[at + p][to + q] })
            })
        };
        let (xx, xy, yy) = (both(rows, &block(0, 0)), both(rows, &block(0, 3)), both(rows, &block(3, 3)));
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
            for axis in 0..2 {
                let at = 3 * k + axis;
                let column = |q: usize| (0..3).map(|p| rows[p][k] * h[3 * axis + p][6 + q]).sum::<f64>();
                let columns = [column(0), column(1), column(2)];
                for l in 0..3 {
                    let to = 3 * l + 2;
                    full[at.min(to)][at.max(to)] =
                        columns.iter().zip(of_z).map(|(column, row)| column * row[l]).sum();
                }
                gradient[at] = (0..3).map(|p| rows[p][k] * self.gradient[3 * axis + p]).sum();
            }
        }
        let speeds = block(6, 6);
        for k in 0..3 {
            for l in k..3 {
                let product = |p: usize| (0..3).map(|q| speeds[p][q] * of_z[q][l]).sum::<f64>();
                full[3 * k + 2][3 * l + 2] = (0..3).map(|p| of_z[p][k] * product(p)).sum();
            }
            gradient[3 * k + 2] = (0..3).map(|p| of_z[p][k] * self.gradient[6 + p]).sum();
        }
        system.add_block(base, &gradient, &full);
    }
}
