//! Stability margins of a PID loop around a DC motor, sampled with the period `T`.
//!
//! Between calls the duty is constant, so the motor `g / (s (tau s + 1))` becomes (zero-order hold,
//! G. Franklin, J. Powell, M. Workman: "Digital Control of Dynamic Systems", chapter 4), with
//! `E = exp(-T / tau)`:
//!
//! ```text
//! G(z) = g ((T - tau (1 - E)) z + tau (1 - E) - T E) / ((z - 1) (z - E))
//! C(z) = kp + ki T / (z - 1) + kd (a / T) (z - 1) / (z - 1 + a),   a = T / (T + T_f)
//! ```
//!
//! Friction is left out: it only adds damping to a motor that moves.

use std::f64::consts::PI;

use crate::controller::PidGains;
use crate::plant::DcParameters;

/// Margins of one loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Whether the closed loop is stable.
    pub stable: bool,
    /// The factor by which the loop's gain may grow; below 1 where it is already too large; infinite
    /// where no gain makes it unstable.
    pub gain: f64,
    /// The phase that may be lost, degrees.
    pub phase_deg: f64,
    /// The frequency at which the loop's gain is 1, rad/s; 0 if there is none.
    pub crossover_rad_s: f64,
}

/// Frequencies of the search.
const FREQUENCIES: u32 = 500;
/// The lowest one, rad/s.
const LOWEST_RAD_S: f64 = 0.01;

#[derive(Clone, Copy, Debug)]
struct Complex(f64, f64);

impl Complex {
    fn times(self, other: Self) -> Self {
        Self(self.0 * other.0 - self.1 * other.1, self.0 * other.1 + self.1 * other.0)
    }

    fn over(self, other: Self) -> Self {
        let square = other.0 * other.0 + other.1 * other.1;
        let Self(re, im) = self.times(Self(other.0, -other.1));
        Self(re / square, im / square)
    }

    fn plus(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }

    fn scaled(self, factor: f64) -> Self {
        Self(self.0 * factor, self.1 * factor)
    }
}

/// The sampled loop.
#[derive(Clone, Copy, Debug)]
struct Loop {
    /// Coefficients of the motor's numerator: of `z` and of 1.
    motor: [f64; 2],
    e: f64,
    gains: PidGains,
    period_s: f64,
    a: f64,
}

impl Loop {
    fn new(gains: &PidGains, motor: &DcParameters, period_s: f64) -> Self {
        let viscous = 1.0 + 0.01 * motor.viscous_percent;
        let (g, tau) = (motor.speed_per_duty_ticks_s / viscous, motor.time_constant_s / viscous);
        let e = libm::exp(-period_s / tau);
        let glide = tau * (1.0 - e);
        Self {
            motor: [g * (period_s - glide), g * (glide - period_s * e)],
            e,
            gains: *gains,
            period_s,
            a: period_s / (period_s + gains.kd_filter_s),
        }
    }

    /// `L(z)` at `z = exp(i omega T)`.
    fn at(&self, omega: f64) -> Complex {
        let (sin, cos) = libm::sincos(omega * self.period_s);
        let z = Complex(cos, sin);
        let less = |number: f64| Complex(cos - number, sin);
        let motor = z.scaled(self.motor[0]).plus(Complex(self.motor[1], 0.0));
        let motor = motor.over(less(1.0).times(less(self.e)));
        let integral = Complex(self.gains.ki * self.period_s, 0.0).over(less(1.0));
        let derivative = less(1.0).over(less(1.0 - self.a)).scaled(self.gains.kd * self.a / self.period_s);
        Complex(self.gains.kp, 0.0).plus(integral).plus(derivative).times(motor)
    }

    /// The characteristic polynomial of the closed loop, highest power first.
    fn characteristic(&self) -> Vec<f64> {
        let PidGains { kp, ki, kd, .. } = self.gains;
        // Controller over (z - 1)^i (z - 1 + a)^d.
        let integrator: &[f64] = if ki > 0.0 { &[1.0, -1.0] } else { &[1.0] };
        let filter_coefficients = [1.0, self.a - 1.0];
        let filter: &[f64] = if kd > 0.0 { &filter_coefficients } else { &[1.0] };
        let mut numerator = scaled(&product(integrator, filter), kp);
        if ki > 0.0 {
            numerator = sum(&numerator, &scaled(filter, ki * self.period_s));
        }
        if kd > 0.0 {
            let derivative = scaled(&product(integrator, &[1.0, -1.0]), kd * self.a / self.period_s);
            numerator = sum(&numerator, &derivative);
        }
        let poles = product(&[1.0, -1.0], &[1.0, -self.e]);
        let denominator = product(&product(integrator, filter), &poles);
        sum(&denominator, &product(&numerator, &self.motor))
    }
}

fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] += x * y;
        }
    }
    out
}

fn scaled(a: &[f64], factor: f64) -> Vec<f64> {
    a.iter().map(|x| x * factor).collect()
}

/// The sum of two polynomials, highest power first.
fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    let degree = a.len().max(b.len());
    let mut out = vec![0.0; degree];
    for list in [a, b] {
        for (x, y) in out[degree - list.len()..].iter_mut().zip(list) {
            *x += y;
        }
    }
    out
}

/// Whether all roots are inside the unit circle (Schur-Cohn: reflection coefficients below 1).
fn is_schur(polynomial: &[f64]) -> bool {
    let mut p = polynomial.to_vec();
    while p.len() > 1 {
        let (first, last) = (p[0], p[p.len() - 1]);
        let k = last / first;
        if k.is_nan() || k.abs() >= 1.0 {
            return false;
        }
        let reversed: Vec<f64> = p.iter().rev().copied().collect();
        p = p.iter().zip(&reversed).map(|(x, y)| x - k * y).collect();
        p.pop();
    }
    true
}

/// The margins of a loop with these gains around this motor; `None` without any gain.
pub fn margins(gains: &PidGains, motor: &DcParameters, period_s: f64) -> Option<Margins> {
    if gains.kp == 0.0 && gains.ki == 0.0 && gains.kd == 0.0 {
        return None;
    }
    let open = Loop::new(gains, motor, period_s);
    let stable = is_schur(&open.characteristic());
    let highest = PI / period_s;
    let ratio = libm::log(highest / LOWEST_RAD_S) / f64::from(FREQUENCIES);
    let frequency = |index: u32| LOWEST_RAD_S * libm::exp(ratio * f64::from(index));
    // Gains at phase crossovers; phases at gain crossovers.
    let (mut gain, mut phase, mut crossover) = (f64::INFINITY, f64::INFINITY, 0.0);
    let mut consider_gain = |magnitude: f64| {
        let factor = 1.0 / magnitude;
        // A stable loop with an integrator also has a smallest gain: the largest one is meant.
        if factor > 1.0 || !stable {
            gain = gain.min(factor);
        }
    };
    let mut before = (frequency(0), open.at(frequency(0)));
    for index in 1..=FREQUENCIES {
        let omega = frequency(index).min(highest);
        let here = open.at(omega);
        let (Complex(re, im), Complex(re0, im0)) = (here, before.1);
        let (size, size0) = (libm::hypot(re, im), libm::hypot(re0, im0));
        if (im > 0.0) != (im0 > 0.0) && re + re0 < 0.0 {
            let share = im0 / (im0 - im);
            consider_gain((re0 + share * (re - re0)).abs());
        }
        if (size > 1.0) != (size0 > 1.0) {
            let share = libm::log(size0) / (libm::log(size0) - libm::log(size));
            let angle = |re: f64, im: f64| libm::atan2(-im, -re).to_degrees();
            let (from, to) = (angle(re0, im0), angle(re, im));
            // Across the cut of the angle the nearer end will do.
            let at = if (to - from).abs() < 180.0 { from + share * (to - from) } else { to };
            if at.abs() < f64::abs(phase) {
                phase = at;
                crossover = before.0 + share * (omega - before.0);
            }
        }
        before = (omega, here);
    }
    // At the highest frequency the loop is real.
    if before.1.0 < 0.0 {
        consider_gain(before.1.0.abs());
    }
    let phase_deg = if phase.is_finite() { phase } else { 180.0 };
    Some(Margins { stable, gain, phase_deg, crossover_rad_s: crossover })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn p(kp: f64) -> PidGains {
        PidGains { kp, ..PidGains::default() }
    }

    #[test]
    fn fast_loop_has_the_margins_of_the_continuous_one() {
        // L = k / (s (tau s + 1)), k = kp g: crossover w with w sqrt(1 + w²tau²) = k; phase margin
        // 90 - atan(w tau), less half a period.
        let motor = DcParameters::first_order(100.0, 0.1);
        let margins = margins(&p(0.1 * std::f64::consts::SQRT_2), &motor, 0.0002).unwrap();
        assert!(margins.stable);
        assert!((margins.crossover_rad_s - 10.0).abs() < 0.02, "{margins:?}");
        assert!((margins.phase_deg - (45.0 - 0.0573)).abs() < 0.05, "{margins:?}");
    }

    #[test]
    fn largest_stable_gain_is_where_the_gain_margin_says() {
        let motor = DcParameters::first_order(106.67, 0.12);
        for gains in [
            p(0.5),
            PidGains { kp: 0.5, ki: 2.0, ..PidGains::default() },
            PidGains { kp: 0.4, ki: 1.0, kd: 0.04, kd_filter_s: 0.005 },
        ] {
            let found = margins(&gains, &motor, 0.01).unwrap();
            assert!(found.stable && found.gain > 1.0, "{found:?}");
            for (factor, stable) in [(0.99, true), (1.01, false)] {
                let f = factor * found.gain;
                let scaled = PidGains { kp: f * gains.kp, ki: f * gains.ki, kd: f * gains.kd, ..gains };
                assert_eq!(margins(&scaled, &motor, 0.01).unwrap().stable, stable, "{scaled:?}");
            }
        }
    }

    #[test]
    fn report_1_loop_becomes_unstable_with_gain_and_period() {
        let motor = DcParameters::first_order(106.67, 0.035);
        let stable = |kp: f64, period: f64| margins(&p(kp), &motor, period).unwrap().stable;
        assert!(stable(0.05, 0.05) && stable(0.05, 0.01) && stable(0.01, 0.05));
        assert!(!stable(3.0, 0.05));
    }

    #[test]
    fn loop_without_gain_has_no_margins() {
        assert_eq!(margins(&PidGains::default(), &DcParameters::first_order(1.0, 1.0), 0.01), None);
    }
}
