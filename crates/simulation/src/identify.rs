//! Identification of a DC motor from a record of time, position and duty.
//!
//! The model of [`DcMotor`] is driven by the recorded duty and fitted to the recorded
//! positions: `g`, `tau` and `f` by Levenberg-Marquardt (D. Marquardt, SIAM J. 1963) from several
//! starts, the stiction `s` by a search over the recorded duties, because the position depends on it
//! only where a motor breaks away or sticks. Standard deviations come from the covariance
//! `sigma² (J^T J)^-1`, with as many independent residuals as their autocorrelation leaves; that of
//! the stiction from the interval of values that fit equally well.

use nalgebra::{Matrix3, Vector3};

use crate::plant::{DcMotor, DcParameters, Motor as _, STEP_S};

/// One row of a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recorded {
    /// Time, s.
    pub t_s: f64,
    /// Position, ticks.
    pub position: f64,
    /// Duty from now on, %.
    pub duty: f64,
}

/// A value with its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub deviation: f64,
    /// Whether the record determines it.
    pub determined: bool,
}

/// What a record says about a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Identified {
    /// Speed without load per percent of duty, ticks/s.
    pub speed_per_duty_ticks_s: Estimate,
    /// Time constant, s.
    pub time_constant_s: Estimate,
    /// Coulomb friction, %.
    pub friction_percent: Estimate,
    /// Stiction, %.
    pub stiction_percent: Estimate,
    /// The range of values of the stiction that fit equally well, %.
    pub stiction_range: (f64, f64),
    /// Root mean square of what the model leaves over, ticks.
    pub residual_rms_ticks: f64,
}

/// Why a record cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// Too few rows.
    #[error("{0} rows are too few: at least 20 are needed")]
    TooShort(usize),
    /// Times do not increase.
    #[error("row {0}: time does not increase")]
    Time(usize),
    /// A value is not finite, or a duty beyond 100 %.
    #[error("row {0}: position and duty must be numbers, the duty from -100 to 100")]
    Value(usize),
    /// The motor never moves.
    #[error("the motor moves by {0} ticks only: the record says nothing about it")]
    NoMotion(f64),
    /// No parameters fit.
    #[error(
        "no motor fits the record: {0:.0} ticks RMS are left over of a motion of {1:.0} ticks; are position and duty of the same sign?"
    )]
    NoFit(f64, f64),
}

const LEAST_ROWS: usize = 20;
/// Largest relative standard deviation of a parameter that counts as determined.
const DETERMINED: f64 = 0.2;
/// Friction and stiction are determined within this, %, whatever their size.
const DETERMINED_PERCENT: f64 = 0.5;
/// Rounding of positions to ticks: variance of a uniform distribution.
const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;
/// Guesses of the stiction as multiples of the friction.
const STICTION_GUESSES: [f64; 10] = [1.1, 1.2, 1.35, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 6.0];
/// Rounds of the search for the stiction, and candidates in each.
const ROUNDS: u32 = 5;
const STICTIONS: usize = 12;
/// Iterations of a fit, and of one that starts near its end.
const ITERATIONS: u32 = 40;
const PROFILE_ITERATIONS: u32 = 8;

/// Logarithms of `g` and `tau`, and `f`.
type Parameters = Vector3<f64>;

struct Fit<'a> {
    record: &'a [Recorded],
}

impl Fit<'_> {
    /// Model less record, ticks.
    fn residuals(&self, p: &Parameters, stiction: f64) -> Vec<f64> {
        let friction = p[2].max(0.0);
        let motor = DcParameters::first_order(libm::exp(p[0]), libm::exp(p[1]))
            .with_friction(stiction.max(friction), friction);
        let first = self.record[0];
        let mut motor = DcMotor::new(motor, first.position);
        let (mut steps, mut duty) = (0_u64, first.duty);
        let mut out = Vec::with_capacity(self.record.len());
        for row in self.record {
            let time = (row.t_s - first.t_s) / STEP_S;
            let until = (time + 1e-6).floor() as u64;
            motor.advance(duty, (until - steps) as u32);
            steps = until;
            // Between steps at constant speed.
            let rest = (time - until as f64).max(0.0) * STEP_S;
            out.push(motor.position() + rest * motor.speed() - row.position);
            duty = row.duty;
        }
        out
    }

    fn squares(&self, p: &Parameters, stiction: f64) -> f64 {
        self.residuals(p, stiction).iter().map(|r| r * r).sum()
    }

    /// `J^T J` and `J^T r` by central differences.
    fn normal(&self, p: &Parameters, stiction: f64) -> (Matrix3<f64>, Vector3<f64>) {
        const STEPS: [f64; 3] = [1e-3, 1e-3, 1e-2];
        let r = self.residuals(p, stiction);
        let columns: [Vec<f64>; 3] = [0, 1, 2].map(|k: usize| {
            let mut delta = Parameters::zeros();
            delta[k] = STEPS[k];
            let (up, down) = (self.residuals(&(p + delta), stiction), self.residuals(&(p - delta), stiction));
            up.iter().zip(&down).map(|(a, b)| (a - b) / (2.0 * STEPS[k])).collect()
        });
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let square = Matrix3::from_fn(|i, j| dot(&columns[i], &columns[j]));
        (square, Vector3::from_fn(|i, _| dot(&columns[i], &r)))
    }

    /// Levenberg-Marquardt.
    fn refine(&self, start: Parameters, stiction: f64, iterations: u32) -> (Parameters, f64) {
        let (mut p, mut best) = (start, self.squares(&start, stiction));
        let mut damping = 1e-3;
        for _ in 0..iterations {
            let (square, gradient) = self.normal(&p, stiction);
            let mut moved = false;
            for _ in 0..8 {
                let mut damped = square;
                for k in 0..3 {
                    damped[(k, k)] += damping * square[(k, k)] + 1e-12;
                }
                let step = damped.try_inverse().map(|inverse| -(inverse * gradient));
                let Some(step) = step.filter(|step| step.iter().all(|x| x.is_finite())) else { break };
                let mut next = p + step;
                // g from 0.01 to 1e6 ticks/s, tau from 1 ms to 10 s, f up to 100 %.
                next[0] = next[0].clamp(-4.6, 13.8);
                next[1] = next[1].clamp(-6.9, 2.3);
                next[2] = next[2].clamp(0.0, 100.0);
                let squares = self.squares(&next, stiction);
                if squares < best {
                    moved = (best - squares) > 1e-9 * best;
                    (p, best, damping) = (next, squares, 0.3 * damping);
                    break;
                }
                damping *= 4.0;
            }
            if !moved {
                break;
            }
        }
        (p, best)
    }

    /// The stictions that fit as well as the best one (from, to), each with the other parameters
    /// fitted to it, and the best fit.
    fn stiction(&self, start: (Parameters, f64)) -> ((f64, f64), (Parameters, f64)) {
        let largest = self.record.iter().map(|row| row.duty.abs()).fold(0.0, f64::max);
        // Friction of a fit with another stiction is off, too.
        let lowest = 0.7 * start.0[2].max(0.0);
        let mut levels: Vec<f64> = self.record.iter().map(|row| row.duty.abs()).collect();
        levels.retain(|level| *level >= lowest);
        levels.push(lowest);
        levels.sort_by(f64::total_cmp);
        levels.dedup_by(|a, b| *a - *b < 1e-6);
        let (mut from, mut to) = (lowest, largest);
        let mut best = start;
        // Rounds of candidates, each between the neighbours of those that fit.
        for _ in 0..ROUNDS {
            let inside: Vec<f64> =
                levels.iter().copied().filter(|level| *level >= from && *level <= to).collect();
            let thin = inside.len().div_ceil(STICTIONS).max(1);
            let mut edges: Vec<f64> = inside.iter().copied().step_by(thin).collect();
            if edges.last() != inside.last() {
                edges.extend(inside.last());
            }
            if edges.len() < 2 {
                break;
            }
            // Between two recorded duties every stiction does the same.
            let fits: Vec<(Parameters, f64)> = edges
                .windows(2)
                .map(|pair| self.refine(best.0, 0.5 * (pair[0] + pair[1]), PROFILE_ITERATIONS))
                .collect();
            for fit in &fits {
                if fit.1 < best.1 {
                    best = *fit;
                }
            }
            let variance = (best.1 / self.record.len() as f64).max(ROUNDING_VARIANCE);
            let good = |fit: &(Parameters, f64)| fit.1 <= best.1 + 9.0 * variance;
            let first = fits.iter().position(good).unwrap_or(0);
            let last = fits.iter().rposition(good).unwrap_or(0);
            (from, to) = (edges[first], edges[last + 1]);
            if thin == 1 {
                break;
            }
        }
        ((from, to), best)
    }
}

/// Identifies a motor from a record that begins at rest.
///
/// # Errors
/// When the record is too short, not a record, without motion, or of something else than a motor. A
/// record that does not determine a parameter is no error: see [`Estimate::determined`].
pub fn identify(record: &[Recorded]) -> Result<Identified, IdentifyError> {
    check(record)?;
    let fit = Fit { record };
    let (low, high) = record.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), row| {
        (low.min(row.position), high.max(row.position))
    });
    if high - low < 10.0 {
        return Err(IdentifyError::NoMotion(high - low));
    }
    let mut best: Option<(Parameters, f64)> = None;
    for tau in [0.02, 0.06, 0.2] {
        for friction in [1.0, 5.0] {
            let start = Parameters::new(libm::log(first_gain(record, friction)), libm::log(tau), friction);
            let found = fit.refine(start, friction, ITERATIONS);
            if best.is_none_or(|(_, squares)| found.1 < squares) {
                best = Some(found);
            }
        }
    }
    let (mut p, mut squares) = best.unwrap_or((Parameters::zeros(), f64::INFINITY));
    // Where stiction is much larger than friction, the fit without it is biased: each guess with a fit
    // of its own.
    let friction = p[2].max(0.5);
    for factor in STICTION_GUESSES {
        let found = fit.refine(p, factor * friction, ITERATIONS);
        if found.1 < squares {
            (p, squares) = found;
        }
    }
    let (range, (p, squares)) = fit.stiction((p, squares));
    let range = (range.0.max(p[2]), range.1.max(p[2]));
    let count = record.len() as f64;
    let rms = (squares / count).sqrt();
    if rms.is_nan() || rms >= 0.1 * (high - low) {
        return Err(IdentifyError::NoFit(rms, high - low));
    }
    Ok(identified(&fit, &p, range, squares))
}

/// A gain with which the motion has about the recorded length.
fn first_gain(record: &[Recorded], friction: f64) -> f64 {
    let (mut way, mut driven) = (0.0, 0.0);
    for pair in record.windows(2) {
        let duty = (pair[0].duty.abs() - friction).max(0.0);
        way += (pair[1].position - pair[0].position).abs();
        driven += duty * (pair[1].t_s - pair[0].t_s);
    }
    (way / driven.max(1e-6)).clamp(0.02, 1e5)
}

fn check(record: &[Recorded]) -> Result<(), IdentifyError> {
    if record.len() < LEAST_ROWS {
        return Err(IdentifyError::TooShort(record.len()));
    }
    for (index, row) in record.iter().enumerate() {
        if !row.position.is_finite() || !(-100.0..=100.0).contains(&row.duty) || !row.t_s.is_finite() {
            return Err(IdentifyError::Value(index + 1));
        }
        if index > 0 && row.t_s <= record[index - 1].t_s {
            return Err(IdentifyError::Time(index + 1));
        }
    }
    Ok(())
}

fn identified(fit: &Fit<'_>, p: &Parameters, range: (f64, f64), squares: f64) -> Identified {
    let stiction = 0.5 * (range.0 + range.1);
    let residuals = fit.residuals(p, stiction);
    let count = residuals.len() as f64;
    let products: f64 = residuals.windows(2).map(|pair| pair[0] * pair[1]).sum();
    // Residuals that follow each other count as fewer: (1 + rho) / (1 - rho) of them are one.
    let rho = if squares > 0.0 { (products / squares).clamp(0.0, 0.99) } else { 0.0 };
    let variance = (squares / (count - 3.0)).max(ROUNDING_VARIANCE) * (1.0 + rho) / (1.0 - rho);
    let (square, _) = fit.normal(p, stiction);
    let covariance = square.try_inverse();
    let deviation = |k: usize| match covariance {
        Some(matrix) if matrix[(k, k)] >= 0.0 => (variance * matrix[(k, k)]).sqrt(),
        _ => f64::INFINITY,
    };
    let relative = |k: usize| {
        let value = libm::exp(p[k]);
        Estimate { value, deviation: value * deviation(k), determined: deviation(k) < DETERMINED }
    };
    let enough = |value: f64, deviation: f64| {
        deviation < DETERMINED_PERCENT.max(DETERMINED * value) && deviation.is_finite()
    };
    let stiction_deviation = (range.1 - range.0) / 12.0_f64.sqrt();
    Identified {
        speed_per_duty_ticks_s: relative(0),
        time_constant_s: relative(1),
        friction_percent: Estimate {
            value: p[2],
            deviation: deviation(2),
            determined: enough(p[2], deviation(2)),
        },
        stiction_percent: Estimate {
            value: stiction,
            deviation: stiction_deviation,
            determined: enough(stiction, stiction_deviation),
        },
        stiction_range: range,
        residual_rms_ticks: (squares / count).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A record of a motor under a duty that depends on time.
    fn record(parameters: DcParameters, end_s: f64, duty: impl Fn(f64) -> f64) -> Vec<Recorded> {
        let mut motor = DcMotor::new(parameters, 0.0);
        let rows = (end_s / 0.01) as u32;
        (0..rows)
            .map(|row| {
                let t_s = f64::from(row) * 0.01;
                let row = Recorded { t_s, position: motor.position().round(), duty: duty(t_s) };
                motor.advance(row.duty, 50);
                row
            })
            .collect()
    }

    fn motor() -> DcParameters {
        DcParameters::first_order(106.67, 0.12).with_friction(8.0, 6.0)
    }

    /// A slow ramp, a fast run, back again.
    fn rich(t: f64) -> f64 {
        match t {
            t if t < 2.0 => 5.0 * t,
            t if t < 3.0 => 60.0,
            t if t < 4.0 => 0.0,
            t if t < 5.0 => -25.0,
            _ => 0.0,
        }
    }

    #[test]
    fn ramp_and_runs_determine_all_parameters() {
        let found = identify(&record(motor(), 6.0, rich)).unwrap();
        for (name, estimate, truth, error) in [
            ("g", found.speed_per_duty_ticks_s, 106.67, 0.5),
            ("tau", found.time_constant_s, 0.12, 0.002),
            ("f", found.friction_percent, 6.0, 0.1),
            ("s", found.stiction_percent, 8.0, 0.3),
        ] {
            assert!(estimate.determined, "{name}: {estimate:?}");
            assert!((estimate.value - truth).abs() < error, "{name}: {estimate:?}");
            assert!((estimate.value - truth).abs() < 4.0 * estimate.deviation + 1e-3, "{name}: {estimate:?}");
        }
    }

    #[test]
    fn constant_duty_does_not_separate_gain_and_friction() {
        let found = identify(&record(motor(), 3.0, |_| 50.0)).unwrap();
        assert!(!found.speed_per_duty_ticks_s.determined, "{found:?}");
        assert!(!found.friction_percent.determined, "{found:?}");
        assert!(!found.stiction_percent.determined, "{found:?}");
        assert!(found.time_constant_s.determined, "{found:?}");
    }

    #[test]
    fn records_that_are_none_are_refused() {
        let good = record(motor(), 6.0, rich);
        assert_eq!(identify(&good[..10]), Err(IdentifyError::TooShort(10)));
        let mut bad = good.clone();
        bad[5].t_s = 0.0;
        assert_eq!(identify(&bad), Err(IdentifyError::Time(6)));
        bad = good.clone();
        bad[7].duty = 300.0;
        assert_eq!(identify(&bad), Err(IdentifyError::Value(8)));
        assert!(matches!(identify(&record(motor(), 3.0, |_| 5.0)), Err(IdentifyError::NoMotion(_))));
        bad = good.clone();
        for row in &mut bad {
            row.position = -row.position;
        }
        assert!(matches!(identify(&bad), Err(IdentifyError::NoFit(..))));
    }
}
