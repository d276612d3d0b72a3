//! Cells: parts of a path on which the motors' derivatives are polynomials, and the limits there.

use kinematics::{Machine, MotorPos};

use super::super::profile::SpeedCap;
use crate::joint_path::GridInterval;

/// A derivative below this share of the larger one is rounding error: the motor stands still.
const STANDSTILL: f64 = 1e-12;

/// Nodes and weights of Gauss's rule of three points on [0, 1], exact for polynomials of degree 5.
const GAUSS: f64 = 0.5 * 0.774_596_669_241_483_4;
const GAUSS_WEIGHTS: [f64; 2] = [5.0 / 18.0, 8.0 / 18.0];

/// A part of a path between two grid points or zero-inertia points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    pub(super) length: f64,
    pub(super) piece: usize,
    pub(super) start: f64,
    /// m' / a by motor, at the start, the middle and the end.
    pub(super) first: [[f64; 2]; 3],
    /// m'' / a, likewise.
    pub(super) second: [[f64; 2]; 3],
    /// |p'|² of the pen and its derivative, likewise.
    pub(super) square_pen: [[f64; 2]; 3],
    /// The largest b at which rows stay within their share of the tolerance.
    pub(super) rows: f64,
    /// Near a corner: `p |u| + beta b <= 1`.
    pub(super) zone: Option<[f64; 2]>,
}

/// The limits of a machine, as squares.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpeedLimits {
    /// Squared ratio of speed to acceleration, by motor.
    pub(super) square_ratios: [f64; 2],
    pub(super) square_pen: f64,
}

impl SpeedLimits {
    pub(super) fn new(machine: &Machine, cap: &SpeedCap) -> Self {
        let square_ratios = machine.motors().each_ref().map(|motor| {
            let ratio = motor.max_speed_ticks_s / motor.max_acceleration_ticks_s2;
            ratio * ratio
        });
        Self { square_ratios, square_pen: cap.pen_mm_s * cap.pen_mm_s }
    }
}

impl Cell {
    pub(super) fn new(machine: &Machine, interval: &GridInterval, cap: &SpeedCap) -> Self {
        let [a, b] = machine.motors().each_ref().map(|motor| motor.max_acceleration_ticks_s2);
        let relative = |m: &MotorPos| [m[0] / a, m[1] / b];
        let mut first = interval.first.each_ref().map(relative);
        let largest = first.as_flattened().iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for x in first.as_flattened_mut() {
            if x.abs() < STANDSTILL * largest {
                *x = 0.0;
            }
        }
        let limit = 8.0 * cap.row_deviation_mm / (cap.period_s * cap.period_s);
        Self {
            length: interval.length,
            piece: interval.piece,
            start: interval.start,
            first,
            second: interval.second.each_ref().map(relative),
            square_pen: interval.square_pen_speeds,
            rows: limit / interval.second_derivative_bound,
            zone: interval
                .near_corner
                .then(|| [interval.pen_speed / limit, interval.second_derivative_bound / limit]),
        }
    }

    /// Appends the cell, cut at its zero-inertia points, where m' of a motor changes its sign.
    pub(super) fn cut(self, limits: &SpeedLimits, to: &mut Vec<Self>) {
        let own = Oriented::new(&self, limits, false);
        let mut roots: Vec<(f64, usize)> = Vec::new();
        for k in 0..2 {
            own.roots(k, |t| roots.push((t, k)));
        }
        if roots.is_empty() {
            to.push(self);
            return;
        }
        roots.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Roots next to each other or to an end are the same point.
        let mut cuts: Vec<(f64, [bool; 2])> = vec![(0.0, [false; 2])];
        for (t, k) in roots.into_iter().chain([(1.0, 2)]) {
            let last = cuts.len() - 1;
            if t - cuts[last].0 > 1e-9 {
                cuts.push((t, [k == 0, k == 1]));
            } else if k < 2 {
                cuts[last].1[k] = true;
            }
        }
        if let Some(last) = cuts.last_mut()
            && last.0 > 1.0 - 1e-9
        {
            last.0 = 1.0;
        }
        for pair in cuts.windows(2) {
            let ((t0, zero0), (t1, zero1)) = (pair[0], pair[1]);
            let at = |share: f64| {
                let t = t0 + share * (t1 - t0);
                let zeros = if share == 0.0 {
                    zero0
                } else if share == 1.0 {
                    zero1
                } else {
                    [false; 2]
                };
                let s = t * self.length;
                let sign = own.signs;
                let first = [0, 1].map(|k| if zeros[k] { 0.0 } else { sign[k] * own.first(k, s) });
                let pen = [own.square_pen(s), own.square_pen_slope(s)];
                (first, [0, 1].map(|k| sign[k] * own.second(k, s)), pen)
            };
            let places = [at(0.0), at(0.5), at(1.0)];
            to.push(Self {
                length: (t1 - t0) * self.length,
                start: self.start + t0 * self.length,
                first: places.map(|place| place.0),
                second: places.map(|place| place.1),
                square_pen: places.map(|place| place.2),
                ..self
            });
        }
    }
}

/// What bounds the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Bound {
    /// A motor's acceleration.
    Motor(usize),
    /// A motor's speed.
    Speed(usize),
    Pen,
    Rows,
    /// Rows near a corner.
    Zone,
    /// The largest b that any acceleration allows both motors.
    Ceiling,
}

/// A cell in the direction of a pass: from its start, or mirrored, from its end. Motors are turned
/// around so that m' >= 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Oriented {
    pub(super) length: f64,
    rate: f64,
    /// m' of each motor as a polynomial in the share of the length.
    first: [[f64; 6]; 2],
    square_pen: [f64; 6],
    /// Whether m'' of both motors is constant.
    pub(super) is_even: bool,
    /// The sign by which each motor was multiplied.
    signs: [f64; 2],
    limits: SpeedLimits,
    rows: f64,
    pub(super) zone: Option<[f64; 2]>,
}

impl Oriented {
    pub(super) fn new(cell: &Cell, limits: &SpeedLimits, mirrored: bool) -> Self {
        let Cell { length, first, second, .. } = cell;
        let signs = [0, 1].map(|k| if first[0][k] + first[1][k] + first[2][k] < 0.0 { -1.0 } else { 1.0 });
        let polynomial = |k: usize| {
            let x = |at: usize| signs[k] * first[at][k];
            let y = |at: usize| signs[k] * second[at][k];
            if mirrored {
                hermite(*length, [x(2), x(1), x(0)], [-y(2), -y(1), -y(0)])
            } else {
                hermite(*length, [x(0), x(1), x(2)], [y(0), y(1), y(2)])
            }
        };
        let first = [polynomial(0), polynomial(1)];
        let pen = |at: usize, of: usize| cell.square_pen[at][of];
        let square_pen = if mirrored {
            hermite(*length, [2, 1, 0].map(|at| pen(at, 0)), [2, 1, 0].map(|at| -pen(at, 1)))
        } else {
            hermite(*length, [0, 1, 2].map(|at| pen(at, 0)), [0, 1, 2].map(|at| pen(at, 1)))
        };
        let is_even = first.iter().all(|c| c[2..].iter().all(|c| *c == 0.0));
        Self {
            length: *length,
            rate: 1.0 / length,
            first,
            square_pen,
            is_even,
            signs,
            limits: *limits,
            rows: cell.rows,
            zone: cell.zone,
        }
    }

    /// m' of motor k, relative to its acceleration limit.
    #[inline]
    pub(super) fn first(&self, k: usize, s: f64) -> f64 {
        let (c, t) = (&self.first[k], s * self.rate);
        if self.is_even { c[0] + t * c[1] } else { value(c, t) }
    }

    /// m'' of motor k.
    #[inline]
    pub(super) fn second(&self, k: usize, s: f64) -> f64 {
        let c = &self.first[k];
        self.rate * if self.is_even { c[1] } else { slope(c, s * self.rate) }
    }

    /// How far motor k moves from s to `to`, without cancellation.
    #[inline]
    pub(super) fn way(&self, k: usize, s: f64, to: f64) -> f64 {
        let middle = 0.5 * (s + to);
        if self.is_even {
            return (to - s) * self.first(k, middle);
        }
        (to - s) * gauss(|t| self.first(k, s + t * (to - s)))
    }

    #[inline]
    pub(super) fn square_pen(&self, s: f64) -> f64 {
        value(&self.square_pen, s * self.rate)
    }

    /// d|p'|²/ds.
    #[inline]
    pub(super) fn square_pen_slope(&self, s: f64) -> f64 {
        self.rate * slope(&self.square_pen, s * self.rate)
    }

    /// The largest b under the speed limits, and which of them that is.
    #[inline]
    pub(super) fn cap(&self, s: f64) -> (f64, Bound) {
        let mut least = (self.limits.square_pen / self.square_pen(s), Bound::Pen);
        if self.rows < least.0 {
            least = (self.rows, Bound::Rows);
        }
        for k in 0..2 {
            let b = self.speed_cap(k, s);
            if b < least.0 {
                least = (b, Bound::Speed(k));
            }
        }
        least
    }

    /// The largest b under one of the speed limits.
    #[inline]
    pub(super) fn cap_by(&self, bound: Bound, s: f64) -> f64 {
        match bound {
            Bound::Speed(k) => self.speed_cap(k, s),
            Bound::Pen => self.limits.square_pen / self.square_pen(s),
            Bound::Rows => self.rows,
            _ => self.ceiling(s),
        }
    }

    #[inline]
    fn speed_cap(&self, k: usize, s: f64) -> f64 {
        let x = self.first(k, s);
        self.limits.square_ratios[k] / (x * x)
    }

    /// Square of motor k's speed limit relative to its acceleration limit.
    pub(super) fn square_ratio(&self, k: usize) -> f64 {
        self.limits.square_ratios[k]
    }

    pub(super) fn square_pen_limit(&self) -> f64 {
        self.limits.square_pen
    }

    /// The largest b that some acceleration allows: `(x1 + x2) / |x1 y2 - x2 y1|`.
    pub(super) fn ceiling(&self, s: f64) -> f64 {
        let [x0, x1] = [self.first(0, s), self.first(1, s)];
        let [y0, y1] = [self.second(0, s), self.second(1, s)];
        let w = (x0 * y1 - x1 * y0).abs();
        let mut b = if w > 0.0 { (x0.abs() + x1.abs()) / w } else { f64::INFINITY };
        // A motor that stands still whatever u is.
        for (x, y) in [(x0, y0), (x1, y1)] {
            if x == 0.0 {
                b = b.min(1.0 / y.abs());
            }
        }
        if let Some([p, beta]) = self.zone {
            b = b.min(1.0 / beta);
            for (x, y) in [(x0, y0), (x1, y1)] {
                b = b.min((x.abs() + p) / (x.abs() * beta + p * y.abs()));
            }
        }
        b
    }

    /// Places, as shares of the length and without the ends, where m' of motor k changes its sign.
    fn roots(&self, k: usize, mut found: impl FnMut(f64)) {
        const PARTS: u32 = 8;
        let c = &self.first[k];
        // Bernstein coefficients: the polynomial lies between the least and the largest.
        let hull = bernstein(c);
        if hull.iter().all(|x| *x >= 0.0) || hull.iter().all(|x| *x <= 0.0) {
            return;
        }
        let at = |part: u32| f64::from(part) / f64::from(PARTS);
        for part in 0..PARTS {
            let (mut low, mut high) = (at(part), at(part + 1));
            let (from, to) = (value(c, low), value(c, high));
            if from == 0.0 && part > 0 {
                found(low);
            }
            if from * to >= 0.0 {
                continue;
            }
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if value(c, middle) * from > 0.0 { low = middle } else { high = middle }
            }
            found(0.5 * (low + high));
        }
    }
}

#[inline]
fn value(c: &[f64; 6], t: f64) -> f64 {
    c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))))
}

#[inline]
fn slope(c: &[f64; 6], t: f64) -> f64 {
    c[1] + t * (2.0 * c[2] + t * (3.0 * c[3] + t * (4.0 * c[4] + t * 5.0 * c[5])))
}

/// The mean of a polynomial of degree up to 5 over [0, 1].
#[inline]
pub(super) fn gauss(of: impl Fn(f64) -> f64) -> f64 {
    GAUSS_WEIGHTS[0] * (of(0.5 - GAUSS) + of(0.5 + GAUSS)) + GAUSS_WEIGHTS[1] * of(0.5)
}

fn bernstein(c: &[f64; 6]) -> [f64; 6] {
    // b_i = Σ_j binomial(i, j) / binomial(5, j) c_j
    const BINOMIAL: [[f64; 6]; 6] = [
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, 2.0, 1.0, 0.0, 0.0, 0.0],
        [1.0, 3.0, 3.0, 1.0, 0.0, 0.0],
        [1.0, 4.0, 6.0, 4.0, 1.0, 0.0],
        [1.0, 5.0, 10.0, 10.0, 5.0, 1.0],
    ];
    BINOMIAL.map(|row| (0..6).map(|j| row[j] / BINOMIAL[5][j] * c[j]).sum())
}

/// The polynomial of degree 5 on [0, 1] with these values at 0, 1/2 and 1, and these derivatives by
/// `s = t length`. Higher terms that are rounding error are 0.
pub(crate) fn hermite(length: f64, x: [f64; 3], y: [f64; 3]) -> [f64; 6] {
    const INVERSE: [[f64; 4]; 4] = [
        [16.0, -8.0, 7.0, -1.0],
        [-32.0, 32.0, -34.0, 5.0],
        [16.0, -40.0, 52.0, -8.0],
        [0.0, 16.0, -24.0, 4.0],
    ];
    let (c0, c1) = (x[0], length * y[0]);
    // What the first two terms leave: p(1/2), p'(1/2), p(1), p'(1).
    let rest = [x[1] - c0 - 0.5 * c1, length * y[1] - c1, x[2] - c0 - c1, length * y[2] - c1];
    let mut c = [c0, c1, 0.0, 0.0, 0.0, 0.0];
    for (c, row) in c[2..].iter_mut().zip(INVERSE) {
        *c = row.iter().zip(rest).map(|(a, b)| a * b).sum();
    }
    let largest = c1.abs().max(x[0].abs()).max(x[2].abs());
    if c[2..].iter().all(|c| c.abs() < 1e-9 * largest) {
        return [c0, x[2] - x[0], 0.0, 0.0, 0.0, 0.0];
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomial_of_degree_five_is_found_from_values_and_derivatives() {
        let c = [0.3, -1.0, 2.0, 0.7, -1.5, 0.4];
        let value = |t: f64| value(&c, t);
        let slope = |t: f64| slope(&c, t);
        assert!((value(0.5) - (0.3 - 0.5 + 0.5 + 0.0875 - 0.09375 + 0.0125)).abs() < 1e-12);
        assert!((slope(0.5) - (-1.0 + 2.0 + 0.525 - 0.75 + 0.125)).abs() < 1e-12);
        let length = 0.25;
        let places = [0.0, 0.5, 1.0];
        let found = hermite(length, places.map(value), places.map(|t| slope(t) / length));
        for (found, c) in found.iter().zip(c) {
            assert!((found - c).abs() < 1e-12, "{found} {c}");
        }
        let integral: f64 = c.iter().enumerate().map(|(k, c)| c / (k as f64 + 1.0)).sum();
        assert!((gauss(value) - integral).abs() < 1e-12);
        for (k, b) in [(0, value(0.0)), (5, value(1.0))] {
            assert!((bernstein(&c)[k] - b).abs() < 1e-12);
        }
    }
}
