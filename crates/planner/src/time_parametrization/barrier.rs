//! Minimum-time speed along a path under jerk limits, by a barrier method that stays feasible.
//!
//! `b = (ds/dt)²` is a quadratic spline with continuous derivative `c = db/ds` and constant
//! `w = d²b/ds²` on every interval. Its unknowns are the middle Bézier ordinates `z` of the
//! intervals: with the lengths h, interval k has the ordinates
//!
//! ```text
//! B0 = (h[k] z[k-1] + h[k-1] z[k]) / (h[k-1] + h[k])     B1 = z[k]
//! B2 = (h[k+1] z[k] + h[k] z[k+1]) / (h[k] + h[k+1])
//! ```
//! so its state depends on three unknowns, and the Hessian has five diagonals. The first interval
//! of the path has constant jerk in time and ends on the ray `c = g b`, `g = 4 / (3 h)`, which
//! gives `B0 = z / (1 + g h / 2)` at the start of the next one; the last interval likewise.
//!
//! The method minimizes `∫ ds / √b` (Simpson's rule) plus mu times the logarithmic barrier of all
//! constraints at the start, middle and end of every interval, by Newton steps with decreasing mu.
//! The jerk constraint is `j / √b ∓ g >= 0` with `g = ½ m' w + 3/2 m'' c + m''' b`. It is convex in
//! b where it should be concave; its second derivative is dropped, which keeps the Hessian positive
//! definite and is the step of sequential convex programming (Debrouwere et al. 2013; Lee et al.
//! 2024, arXiv 2404.07889) without an outer loop. Every iterate is feasible, so the result is never
//! slower than the start, and the number of steps is fixed.
//!
//! Long paths are solved in overlapping blocks with the unknowns outside a block fixed: one tight
//! place would limit the step length of the whole path. Cost and memory are linear in the length.

use std::ops::Range;

/// Number of unknowns in a block; blocks overlap by half.
const BLOCK: usize = 512;

/// Largest number of sweeps over all blocks from a slow start. The end of a block is limited by the
/// slow start behind it, from which it may not have recovered where the next block begins.
pub(super) const SWEEPS: usize = 4;

/// Sweeps end when one gains no more than this share of the duration.
const LEAST_GAIN: f64 = 2e-3;

/// The barrier's first weight in later sweeps, as a share of the duration.
pub(super) const NEXT_WEIGHT: f64 = 0.02;

/// Largest number of Newton steps in a block.
const STEPS: usize = 100;

/// The barrier's weight, as a share of the duration, at which a block is finished.
const FINAL_WEIGHT: f64 = 2e-4;

/// The constraints at one point of a path, relative to the limits.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointConstraints {
    /// m' / v.
    pub(super) speed: [f64; 2],
    /// m' / a and m'' / a.
    pub(super) acceleration: [[f64; 2]; 2],
    /// m' / j, m'' / j and m''' / j; 0 without a jerk limit.
    pub(super) jerk: [[f64; 3]; 2],
    /// |dp/ds|.
    pub(super) pen_speed: f64,
    /// See `GridInterval::second_derivative_bound`.
    pub(super) second_derivative_bound: f64,
}

/// b, c.
pub(super) type State = [f64; 2];

impl PointConstraints {
    /// The largest utilization of the acceleration and of the jerk limits.
    pub(super) fn utilization(&self, [b, c]: State, w: f64) -> (f64, f64) {
        let acceleration = |[m1, m2]: [f64; 2]| (0.5 * m1 * c + m2 * b).abs();
        let jerk = |[m1, m2, m3]: [f64; 3]| (0.5 * m1 * w + 1.5 * m2 * c + m3 * b).abs() * b.max(0.0).sqrt();
        let most = |f: &dyn Fn(usize) -> f64| f(0).max(f(1));
        (most(&|k| acceleration(self.acceleration[k])), most(&|k| jerk(self.jerk[k])))
    }
}

/// The constraints of an interval.
#[derive(Clone, Debug)]
pub(super) struct Constraints {
    pub(super) length: f64,
    /// At its start, middle and end.
    pub(super) points: [PointConstraints; 3],
    /// The largest b.
    pub(super) cap: f64,
    /// Bound on `|p'| |u| + second_derivative_bound b` of the pen near corners; infinite elsewhere.
    pub(super) row_limit: f64,
    /// The shares of the acceleration and jerk limits that may be used.
    pub(super) allowed: (f64, f64),
}

/// Simpson's rule.
const WEIGHTS: [f64; 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];

/// `j h² / √b³` for motion with the jerk j from rest to b at h: with `h = j t³/6` and `b = j² t⁴/4`
/// it is `(t⁶ j³ / 36) (8 / (j³ t⁶)) = 2/9`.
pub(super) const JERK_OF_REST: f64 = 2.0 / 9.0;

impl Constraints {
    /// The largest b at the other end that constant jerk from rest may lead to. The utilization of
    /// all limits grows with b, so it is largest at that end.
    fn largest_from_rest(&self) -> f64 {
        let h = self.length;
        // With b there: c = 4 b / (3 h), u = c / 2, and the jerk of s is JERK_OF_REST √b³ / h².
        let jerk = JERK_OF_REST / (h * h);
        let mut most = self.cap;
        for point in &self.points {
            for k in 0..2 {
                let [m1, m2] = point.acceleration[k].map(f64::abs);
                most = most.min(self.allowed.0 / (m1 * 2.0 / (3.0 * h) + m2));
                let [m1, m2, m3] = point.jerk[k].map(f64::abs);
                let by = self.allowed.1 / (m1 * jerk + 2.0 * m2 / h + m3);
                most = most.min(libm::cbrt(by * by));
            }
            if self.row_limit.is_finite() {
                most = most.min(
                    self.row_limit / (point.pen_speed * 2.0 / (3.0 * h) + point.second_derivative_bound),
                );
            }
        }
        most
    }
}

/// A symmetric 3x3 matrix and a vector in (b, c, w).
#[derive(Clone, Copy, Default)]
struct Quadratic {
    gradient: [f64; 3],
    hessian: [[f64; 3]; 3],
}

impl Quadratic {
    /// Adds `-log(slack)` with the slack's gradient `d`, taking the slack as linear.
    fn barrier(&mut self, slack: f64, d: [f64; 3]) {
        let inverse = 1.0 / slack;
        for i in 0..3 {
            self.gradient[i] -= d[i] * inverse;
            for j in 0..3 {
                self.hessian[i][j] += d[i] * d[j] * inverse * inverse;
            }
        }
    }
}

/// The inner intervals of a path, with their Bézier weights.
pub(super) struct Problem<'a> {
    intervals: &'a [Constraints],
    /// B0 = w[0] z[k-1] + w[1] z[k], B2 = w[2] z[k] + w[3] z[k+1].
    weights: Vec<[f64; 4]>,
    /// Lengths of the first and last interval of the path, and the largest b at their inner ends.
    ends: [(f64, f64); 2],
}

impl<'a> Problem<'a> {
    /// For all intervals of a path, of which the first and the last start and end at rest; `None`
    /// if there are none between them.
    pub(super) fn new(all: &'a [Constraints]) -> Option<Self> {
        let [first, intervals @ .., last] = all else { return None };
        let count = intervals.len();
        let length = |k: usize| intervals[k].length;
        // From the ray at an end: B0 = z / (1 + g h / 2).
        let ray = |end: f64, h: f64| 1.0 / (1.0 + 2.0 / 3.0 * h / end);
        let weights = (0..count).map(|k| {
            let h = length(k);
            let (w0, w1) = if k == 0 {
                (0.0, ray(first.length, h))
            } else {
                (h / (length(k - 1) + h), length(k - 1) / (length(k - 1) + h))
            };
            let (w2, w3) = if k + 1 == count {
                (ray(last.length, h), 0.0)
            } else {
                (length(k + 1) / (length(k + 1) + h), h / (length(k + 1) + h))
            };
            [w0, w1, w2, w3]
        });
        let weights: Vec<[f64; 4]> = weights.collect();
        let ends = [first, last].map(|end| (end.length, end.largest_from_rest()));
        (count > 0).then_some(Self { intervals, weights, ends })
    }

    fn count(&self) -> usize {
        self.intervals.len()
    }

    /// The Bézier ordinates of an interval.
    fn ordinates(&self, z: &[f64], k: usize) -> [f64; 3] {
        let [w0, w1, w2, w3] = self.weights[k];
        let before = if k > 0 { w0 * z[k - 1] } else { 0.0 };
        let after = if k + 1 < z.len() { w3 * z[k + 1] } else { 0.0 };
        [before + w1 * z[k], z[k], w2 * z[k] + after]
    }

    /// b and c at all grid points of the path.
    pub(super) fn states(&self, z: &[f64]) -> Vec<State> {
        let mut states = Vec::with_capacity(z.len() + 3);
        states.push([0.0, 0.0]);
        for k in 0..z.len() {
            let [b0, b1, _] = self.ordinates(z, k);
            states.push([b0, 2.0 * (b1 - b0) / self.intervals[k].length]);
        }
        let last = z.len() - 1;
        let [_, b1, b2] = self.ordinates(z, last);
        states.push([b2, 2.0 * (b2 - b1) / self.intervals[last].length]);
        states.push([0.0, 0.0]);
        states
    }

    /// Scales speeds down until they are feasible: all utilizations fall with the scale. `None` if
    /// that takes too long.
    pub(super) fn feasible(&self, start: &[f64]) -> Option<Vec<f64>> {
        let mut scale = 1.0;
        (0..200).find_map(|round| {
            let z: Vec<f64> = start.iter().map(|z| scale * z).collect();
            scale *= if round < 5 { 0.99 } else { 0.8 };
            self.cost(&z, 0..self.count(), 1.0).is_some().then_some(z)
        })
    }

    /// Minimizes the duration from a feasible start. `weight` is the barrier's first weight, as a
    /// share of the duration; long paths are swept up to `sweeps` times.
    pub(super) fn minimize(&self, z: &mut [f64], mut weight: f64, sweeps: usize) {
        let all = 0..self.count();
        for _ in 0..sweeps {
            let before = self.cost(z, all.clone(), 0.0);
            self.sweep(z, weight);
            if z.len() < BLOCK + BLOCK / 2 {
                return;
            }
            let after = self.cost(z, all.clone(), 0.0);
            let gain = before.zip(after).map_or(0.0, |(before, after)| 1.0 - after.0 / before.0);
            if gain < LEAST_GAIN {
                return;
            }
            weight = weight.min(NEXT_WEIGHT);
        }
    }

    /// Minimizes the duration block by block.
    fn sweep(&self, z: &mut [f64], weight: f64) {
        let mut trial = z.to_vec();
        let mut from = 0;
        loop {
            let to = (from + BLOCK).min(z.len());
            // Do not leave a small rest.
            let to = if z.len() - to < BLOCK / 2 { z.len() } else { to };
            self.minimize_block(z, &mut trial, from..to, weight);
            trial[from..to].copy_from_slice(&z[from..to]);
            if to == z.len() {
                return;
            }
            from += BLOCK / 2;
        }
    }

    /// Newton steps on the unknowns of a block. `trial` is a copy of `z`.
    fn minimize_block(&self, z: &mut [f64], trial: &mut [f64], block: Range<usize>, weight: f64) {
        let (from, to) = (block.start, block.end);
        let range = from.saturating_sub(1)..(to + 1).min(self.count());
        let count = range.len() as f64;
        let Some((time, _)) = self.cost(z, range.clone(), 0.0) else { return };
        let (mut mu, mut time) = (weight * time / count, time);
        let mut system = Pentadiagonal::default();
        for _ in 0..STEPS {
            self.assemble(z, range.clone(), block.clone(), mu, &mut system);
            let slope = system.solve();
            let Some((_, cost)) = self.cost(z, range.clone(), mu) else { return };
            let mut step = 1.0;
            let accepted = (0..12).find_map(|_| {
                for (k, d) in system.right.iter().enumerate() {
                    trial[from + k] = z[from + k] + step * d;
                }
                let found = self.cost(trial, range.clone(), mu);
                let found = found.filter(|(_, found)| *found <= cost + 1e-4 * step * slope);
                step *= if found.is_some() { 1.0 } else { 0.5 };
                found
            });
            if let Some((found, _)) = accepted {
                z[from..to].copy_from_slice(&trial[from..to]);
                time = found;
            }
            let decrement = -step * slope;
            if mu * count <= FINAL_WEIGHT * time {
                // At the final weight, until a step gains nothing more.
                if accepted.is_none() || decrement < 0.2 * mu * count {
                    return;
                }
            } else {
                // Short steps mean that the path of minima is left: catch up before going on.
                mu *= match step {
                    _ if accepted.is_none() => 0.5,
                    0.9.. => 0.35,
                    0.4.. => 0.5,
                    0.2.. => 0.7,
                    _ => 1.0,
                };
            }
        }
    }

    /// The duration of some intervals, and the same plus `mu` times the barrier; `None` if a
    /// constraint is violated.
    fn cost(&self, z: &[f64], range: Range<usize>, mu: f64) -> Option<(f64, f64)> {
        let (mut time, mut barrier) = (0.0, 0.0);
        let last = self.count() - 1;
        for k in range {
            let interval = &self.intervals[k];
            let h = interval.length;
            let [b0, b1, b2] = self.ordinates(z, k);
            let w = 2.0 * (b0 - 2.0 * b1 + b2) / (h * h);
            let at = [
                [b0, 2.0 * (b1 - b0) / h],
                [0.25 * (b0 + 2.0 * b1 + b2), (b2 - b0) / h],
                [b2, 2.0 * (b2 - b1) / h],
            ];
            for ((state, point), weight) in at.into_iter().zip(&interval.points).zip(WEIGHTS) {
                time += weight * h / state[0].sqrt();
                barrier -= libm::log(interval.slack(point, state, w)?);
            }
            for (end, b) in [(0, b0), (last, b2)]
                .into_iter()
                .zip(self.ends)
                .filter_map(|((at, b), end)| (at == k).then_some((end, b)))
            {
                let (h, most) = end;
                if b >= most {
                    return None;
                }
                time += 3.0 * h / b.sqrt();
                barrier -= libm::log(1.0 - b / most);
            }
        }
        (time.is_finite() && barrier.is_finite()).then_some((time, time + mu * barrier))
    }

    /// Gradient and Hessian of the cost by the unknowns from `from` to `to`.
    fn assemble(
        &self,
        z: &[f64],
        range: Range<usize>,
        block: Range<usize>,
        mu: f64,
        system: &mut Pentadiagonal,
    ) {
        system.reset(block.len());
        let last = self.count() - 1;
        for k in range {
            let interval = &self.intervals[k];
            let h = interval.length;
            let [b0, b1, b2] = self.ordinates(z, k);
            let [w0, w1, w2, w3] = self.weights[k];
            // The ordinates by z[k-1], z[k] and z[k+1].
            let (d0, d1, d2) = ([w0, w1, 0.0], [0.0, 1.0, 0.0], [0.0, w2, w3]);
            let combine = |x: f64, y: f64, z: f64| [0, 1, 2].map(|i| x * d0[i] + y * d1[i] + z * d2[i]);
            let w = 2.0 * (b0 - 2.0 * b1 + b2) / (h * h);
            let dw = combine(2.0 / (h * h), -4.0 / (h * h), 2.0 / (h * h));
            let at = [
                ([b0, 2.0 * (b1 - b0) / h], combine(1.0, 0.0, 0.0), combine(-2.0 / h, 2.0 / h, 0.0)),
                (
                    [0.25 * (b0 + 2.0 * b1 + b2), (b2 - b0) / h],
                    combine(0.25, 0.5, 0.25),
                    combine(-1.0 / h, 0.0, 1.0 / h),
                ),
                ([b2, 2.0 * (b2 - b1) / h], combine(0.0, 0.0, 1.0), combine(0.0, -2.0 / h, 2.0 / h)),
            ];
            for (((state, db, dc), point), weight) in at.into_iter().zip(&interval.points).zip(WEIGHTS) {
                let local = interval.quadratic(point, state, w, weight * h, mu);
                system.add(k, block.start, &local, &[db, dc, dw]);
            }
            for (end, b, db) in [(0, b0, d0), (last, b2, d2)]
                .into_iter()
                .zip(self.ends)
                .filter_map(|((at, b, db), end)| (at == k).then_some((end, b, db)))
            {
                let (h, most) = end;
                let mut local = Quadratic::default();
                local.barrier(most - b, [-1.0, 0.0, 0.0]);
                local.scale(mu);
                local.add_time(b, 3.0 * h);
                system.add(k, block.start, &local, &[db, [0.0; 3], [0.0; 3]]);
            }
        }
    }
}

impl Quadratic {
    fn scale(&mut self, by: f64) {
        self.gradient.iter_mut().for_each(|x| *x *= by);
        self.hessian.iter_mut().flatten().for_each(|x| *x *= by);
    }

    /// Adds `length / √b`.
    fn add_time(&mut self, b: f64, length: f64) {
        let time = length / b.sqrt();
        self.gradient[0] -= 0.5 * time / b;
        self.hessian[0][0] += 0.75 * time / (b * b);
    }
}

impl Constraints {
    /// The product of all slacks, relative to their limits; `None` if one is not positive.
    fn slack(&self, point: &PointConstraints, [b, c]: State, w: f64) -> Option<f64> {
        let (acceleration, jerk) = self.allowed;
        let mut product = 1.0 - b / self.cap;
        if !(b > 0.0 && product > 0.0) {
            return None;
        }
        let mut hold = |limit: f64, x: f64| {
            product *= (limit - x) * (limit + x);
            x.abs() < limit
        };
        for k in 0..2 {
            let [m1, m2] = point.acceleration[k];
            let [j1, j2, j3] = point.jerk[k];
            let g = (0.5 * j1 * w + 1.5 * j2 * c + j3 * b) * b.sqrt();
            if !(hold(acceleration, 0.5 * m1 * c + m2 * b) && hold(jerk, g)) {
                return None;
            }
        }
        if self.row_limit.is_finite() {
            let limit = 1.0 - point.second_derivative_bound * b / self.row_limit;
            if !hold(limit, 0.5 * point.pen_speed * c / self.row_limit) {
                return None;
            }
        }
        Some(product)
    }

    /// Gradient and Hessian by (b, c, w) of the time over `length` plus `mu` times the barrier.
    fn quadratic(&self, point: &PointConstraints, [b, c]: State, w: f64, length: f64, mu: f64) -> Quadratic {
        let mut local = Quadratic::default();
        local.barrier(self.cap - b, [-1.0, 0.0, 0.0]);
        let root = b.sqrt();
        for k in 0..2 {
            let [m1, m2] = point.acceleration[k];
            let q = 0.5 * m1 * c + m2 * b;
            local.barrier(self.allowed.0 - q, [-m2, -0.5 * m1, 0.0]);
            local.barrier(self.allowed.0 + q, [m2, 0.5 * m1, 0.0]);
            if point.jerk[k] == [0.0; 3] {
                continue;
            }
            // -log(j ∓ g √b) = -log(j / √b ∓ g) - ½ log b.
            let [j1, j2, j3] = point.jerk[k];
            let g = 0.5 * j1 * w + 1.5 * j2 * c + j3 * b;
            let limit = self.allowed.1 / root;
            let slope = -0.5 * limit / b;
            local.barrier(limit - g, [slope - j3, -1.5 * j2, -0.5 * j1]);
            local.barrier(limit + g, [slope + j3, 1.5 * j2, 0.5 * j1]);
            local.gradient[0] -= 1.0 / b;
            local.hessian[0][0] += 1.0 / (b * b);
        }
        if self.row_limit.is_finite() {
            let (bound, speed) = (point.second_derivative_bound, 0.5 * point.pen_speed);
            let left = self.row_limit - bound * b;
            local.barrier(left - speed * c, [-bound, -speed, 0.0]);
            local.barrier(left + speed * c, [-bound, speed, 0.0]);
        }
        local.scale(mu);
        local.add_time(b, length);
        local
    }
}

/// A symmetric system with five diagonals.
#[derive(Default)]
struct Pentadiagonal {
    /// The diagonal, and the first and second one below it: `lower[i]` couples i and i + 1.
    diagonal: Vec<f64>,
    lower: [Vec<f64>; 2],
    /// The gradient; after [`Self::solve`] the Newton direction.
    right: Vec<f64>,
}

impl Pentadiagonal {
    fn reset(&mut self, count: usize) {
        for column in [&mut self.diagonal, &mut self.right].into_iter().chain(&mut self.lower) {
            column.clear();
            column.resize(count, 0.0);
        }
    }

    /// Adds a quadratic in (b, c, w), given their derivatives by z[k-1], z[k] and z[k+1], of which
    /// those outside the system are fixed. `from` is the index of its first unknown.
    fn add(&mut self, k: usize, from: usize, local: &Quadratic, rows: &[[f64; 3]; 3]) {
        let count = self.diagonal.len();
        let index = |i: usize| (k + i).checked_sub(from + 1).filter(|index| *index < count);
        let product = [0, 1, 2]
            .map(|i| [0, 1, 2].map(|q| (0..3).map(|p| rows[p][i] * local.hessian[p][q]).sum::<f64>()));
        for (i, half) in product.iter().enumerate() {
            let Some(row) = index(i) else { continue };
            self.right[row] += (0..3).map(|p| rows[p][i] * local.gradient[p]).sum::<f64>();
            for distance in 0..3 - i {
                if index(i + distance).is_none() {
                    continue;
                }
                let value: f64 = half.iter().zip(rows).map(|(x, row)| x * row[i + distance]).sum();
                match distance {
                    0 => self.diagonal[row] += value,
                    _ => self.lower[distance - 1][row] += value,
                }
            }
        }
    }

    /// Replaces the gradient by the Newton direction, and returns their product.
    fn solve(&mut self) -> f64 {
        let count = self.diagonal.len();
        let gradient = self.right.clone();
        // L D Lᵀ in place: `lower` becomes L.
        for i in 0..count {
            let mut d = self.diagonal[i];
            if i > 0 {
                d -= self.lower[0][i - 1] * self.lower[0][i - 1] * self.diagonal[i - 1];
            }
            if i > 1 {
                d -= self.lower[1][i - 2] * self.lower[1][i - 2] * self.diagonal[i - 2];
            }
            // Positive but for rounding.
            let d = d.max(1e-14 * self.diagonal[i]).max(f64::MIN_POSITIVE);
            self.diagonal[i] = d;
            if i + 1 < count {
                let mut e = self.lower[0][i];
                if i > 0 {
                    e -= self.lower[1][i - 1] * self.lower[0][i - 1] * self.diagonal[i - 1];
                }
                self.lower[0][i] = e / d;
            }
            if i + 2 < count {
                self.lower[1][i] /= d;
            }
        }
        for i in 0..count {
            if i > 0 {
                self.right[i] -= self.lower[0][i - 1] * self.right[i - 1];
            }
            if i > 1 {
                self.right[i] -= self.lower[1][i - 2] * self.right[i - 2];
            }
        }
        for i in (0..count).rev() {
            self.right[i] /= self.diagonal[i];
            if i + 1 < count {
                self.right[i] -= self.lower[0][i] * self.right[i + 1];
            }
            if i + 2 < count {
                self.right[i] -= self.lower[1][i] * self.right[i + 2];
            }
        }
        self.right.iter_mut().for_each(|x| *x = -*x);
        self.right.iter().zip(&gradient).map(|(d, g)| d * g).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pentadiagonal_solution_satisfies_the_system() {
        let (diagonal, lower) = ([4.0, 5.0, 6.0, 5.0, 4.0], [[1.0, -1.0, 2.0, 0.5], [0.3, 1.0, -0.4, 0.0]]);
        let gradient = [1.0, -2.0, 3.0, 0.5, 1.5];
        let mut system = Pentadiagonal {
            diagonal: diagonal.to_vec(),
            lower: [lower[0].to_vec(), lower[1][..3].to_vec()],
            right: gradient.to_vec(),
        };
        system.lower.iter_mut().for_each(|column| column.resize(5, 0.0));
        let slope = system.solve();
        let x = &system.right;
        let entry = |i: usize, j: usize| match j.abs_diff(i) {
            0 => diagonal[i],
            distance @ 1..=2 => lower[distance - 1][i.min(j)],
            _ => 0.0,
        };
        for (i, gradient) in gradient.iter().enumerate() {
            let product: f64 = (0..5).map(|j| entry(i, j) * x[j]).sum();
            assert!((product + gradient).abs() < 1e-12, "row {i}");
        }
        let product: f64 = x.iter().zip(gradient).map(|(d, g)| d * g).sum();
        assert!((slope - product).abs() < 1e-12 && slope < 0.0);
    }

    /// A line of length 1 with both motors alike: |c| <= 2 a, |w| √b <= 2 j.
    fn line(count: usize, cap: f64, a: f64, j: f64) -> Vec<Constraints> {
        let point = PointConstraints {
            speed: [1.0, 1.0],
            acceleration: [[1.0 / a, 0.0]; 2],
            jerk: [[1.0 / j, 0.0, 0.0]; 2],
            pen_speed: 1.0,
            second_derivative_bound: 0.0,
        };
        let length = 1.0 / count as f64;
        let interval =
            Constraints { length, points: [point; 3], cap, row_limit: f64::INFINITY, allowed: (1.0, 1.0) };
        vec![interval; count]
    }

    #[test]
    fn duration_on_a_line_is_near_the_seven_phase_optimum() {
        let (v, a, j) = (2.0, 10.0, 200.0);
        let all = line(600, v * v, a, j);
        let problem = Problem::new(&all).expect("there are inner intervals");
        let mut z = problem.feasible(&[1e-3; 598]).expect("slow speeds are feasible");
        let duration = |z: &[f64]| problem.cost(z, 0..598, 0.0).expect("feasible speeds").0;
        let before = duration(&z);
        problem.minimize(&mut z, 0.5, SWEEPS);
        let duration = duration(&z);
        // 1/v + v/a + a/j, with a ramp of v/a + a/j at both ends.
        let best = 1.0 / v + v / a + a / j;
        assert!(duration < before && duration >= best * (1.0 - 1e-4), "{duration} s, at best {best} s");
        assert!(duration < 1.005 * best, "{duration} s, at best {best} s");
        let states = problem.states(&z);
        for (k, pair) in states.windows(2).enumerate().skip(1).take(598) {
            let w = (pair[1][1] - pair[0][1]) * 600.0;
            let (acceleration, jerk) = all[k].points[0].utilization(pair[0], w);
            assert!(acceleration <= 1.0 && jerk <= 1.0 && pair[0][0] <= v * v, "interval {k}");
        }
    }
}
