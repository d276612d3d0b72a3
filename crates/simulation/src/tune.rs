//! Search of gains: the least ink error within stability margins.
//!
//! Bounded and deterministic: a grid over the proportional gain, with derivative gains that cancel a
//! share of the motor's time constant (`kd = c kp tau`) and integral gains in ratio to it, then a
//! pattern search (R. Hooke, T. Jeeves: "Direct search", J. ACM 1961) from the best point. A candidate
//! counts only if its loop keeps both margins with every parameter of the motor 20 % off, either way.

use crate::AntiWindup;
use crate::controller::{FeedForward, MotorModel, PidGains};
use crate::drive::{Drive, Feedback, MotorPlant};
use crate::ink::{InkError, InkRecorder, Target};
use crate::margins::{Margins, margins};
use crate::plant::DcParameters;
use crate::run::{Job, SimulationError, simulate};
use crate::setpoint::SetpointKind;

/// Least gain margin.
pub const LEAST_GAIN_MARGIN: f64 = 2.0;
/// Least phase margin, degrees.
pub const LEAST_PHASE_DEG: f64 = 45.0;
/// How far off a parameter may be, as a share.
pub const OFF: f64 = 0.2;

/// Every fifth sample and points 1 mm apart are enough for a search.
const THIN: usize = 5;
const STEP_MM: f64 = 1.0;
/// Proportional gains of the grid, from the largest admissible one down: factors of 1.5.
const GRID: usize = 7;
const GRID_FACTOR: f64 = 1.5;
/// Shares of the motor's pole that the derivative cancels, in the grid.
const CANCELLED: [f64; 2] = [0.5, 1.0];
/// Integral gains in the grid, as shares of kp per s.
const INTEGRAL: [f64; 2] = [0.0, 3.0];
/// Evaluations of the pattern search.
const EVALUATIONS: usize = 24;

/// What is allowed to be nonzero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Terms {
    /// The proportional gain.
    P,
    /// All three.
    Pid,
}

/// The gains found for a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuned {
    /// The drive with its gains.
    pub drive: Drive,
    /// Its ink.
    pub ink: InkError,
    /// Share of the loop's calls with the duty at its limit, the larger one of both motors.
    pub saturated_share: f64,
    /// Simulations that were needed.
    pub simulations: usize,
}

/// What happens with one parameter off.
#[derive(Clone, Debug, PartialEq)]
pub struct OffCase {
    /// The parameter's key.
    pub key: &'static str,
    /// The factor on it.
    pub factor: f64,
    /// Root mean square of stray ink, mm.
    pub stray_rms_mm: f64,
    /// The smallest gain margin of both motors.
    pub gain_margin: f64,
    /// The smallest phase margin of both motors, degrees.
    pub phase_margin_deg: f64,
}

/// A search on one plan and drawing.
#[derive(Clone, Copy, Debug)]
pub struct Tuner<'a> {
    /// The plan.
    pub job: Job<'a>,
    /// The drawing.
    pub target: &'a Target,
}

/// The drive with these parameters of its DC motors.
fn with_motors(drive: &Drive, change: impl Fn(DcParameters) -> DcParameters) -> Drive {
    let mut drive = drive.clone();
    for motor in &mut drive.motors {
        if let MotorPlant::Dc(parameters) = &mut motor.plant {
            *parameters = change(*parameters);
        }
    }
    drive
}

/// The DC motors of a drive.
fn dc_motors(drive: &Drive) -> impl Iterator<Item = &DcParameters> {
    drive.motors.iter().filter_map(|motor| match &motor.plant {
        MotorPlant::Dc(parameters) => Some(parameters),
        _ => None,
    })
}

/// The smaller margins of a drive's loops.
fn worst_margins(gains: &PidGains, drive: &Drive) -> Option<Margins> {
    let all = dc_motors(drive).map(|motor| margins(gains, motor, drive.period_s));
    all.reduce(|a, b| {
        let (a, b) = (a?, b?);
        Some(Margins {
            stable: a.stable && b.stable,
            gain: a.gain.min(b.gain),
            phase_deg: a.phase_deg.min(b.phase_deg),
            crossover_rad_s: a.crossover_rad_s.max(b.crossover_rad_s),
        })
    })
    .flatten()
}

/// Parameters and how they are changed.
type Change = (&'static str, fn(DcParameters, f64) -> DcParameters);

const CHANGES: [Change; 4] = [
    ("speed_per_duty", |p, factor| DcParameters {
        speed_per_duty_ticks_s: factor * p.speed_per_duty_ticks_s,
        ..p
    }),
    ("time_constant", |p, factor| DcParameters { time_constant_s: factor * p.time_constant_s, ..p }),
    // Stiction never below friction: the motor would not start by itself.
    ("stiction", |p, factor| DcParameters {
        stiction_percent: (factor * p.stiction_percent).max(p.friction_percent),
        ..p
    }),
    ("friction", |p, factor| DcParameters {
        friction_percent: factor * p.friction_percent,
        stiction_percent: p.stiction_percent.max(factor * p.friction_percent),
        ..p
    }),
];

/// Whether the loop keeps its margins, also with the motor's parameters off.
pub fn is_admissible(gains: &PidGains, drive: &Drive) -> bool {
    let keeps = |drive: &Drive| {
        worst_margins(gains, drive).is_some_and(|margins| {
            margins.stable && margins.gain >= LEAST_GAIN_MARGIN && margins.phase_deg >= LEAST_PHASE_DEG
        })
    };
    keeps(drive)
        && CHANGES[..2].iter().all(|(_, change)| {
            [1.0 - OFF, 1.0 + OFF].iter().all(|factor| keeps(&with_motors(drive, |p| change(p, *factor))))
        })
}

impl Tuner<'_> {
    /// The ink of a drive.
    ///
    /// # Errors
    /// Those of [`simulate`].
    pub fn measure(&self, drive: &Drive) -> Result<Tuned, SimulationError> {
        let mut recorder = InkRecorder::new(self.job.machine);
        let outcome = simulate(&self.job, drive, |sample| recorder.observe(sample))?;
        let [first, second] = outcome.motors;
        Ok(Tuned {
            drive: drive.clone(),
            ink: recorder.compare(self.target),
            saturated_share: first.saturated_share.max(second.saturated_share),
            simulations: 1,
        })
    }

    /// The error that the search minimizes, mm.
    fn quick(&self, drive: &Drive) -> f64 {
        let mut recorder = InkRecorder::new(self.job.machine);
        match simulate(&self.job, drive, |sample| recorder.observe(sample)) {
            Ok(_) => recorder.quick_rms(self.target, THIN, STEP_MM),
            Err(_) => f64::INFINITY,
        }
    }

    /// The gains with the least ink error for this drive: its motors, period, and feed-forward stay,
    /// its setpoints are interpolated.
    ///
    /// # Errors
    /// Those of [`simulate`].
    pub fn tune(&self, drive: &Drive, terms: Terms, forward: FeedForward) -> Result<Tuned, SimulationError> {
        let base = Drive {
            setpoints: SetpointKind::Interpolated,
            feed_forward: forward,
            feedback: Feedback::Pid(PidGains::default(), AntiWindup::Conditional),
            ..drive.clone()
        };
        let with = |gains: PidGains| Drive {
            feedback: Feedback::Pid(gains, AntiWindup::Conditional),
            ..base.clone()
        };
        let tau = dc_motors(drive).map(|motor| motor.time_constant_s).fold(0.0, f64::max);
        let mut simulations = 0;
        let mut best: Option<(f64, PidGains)> = None;
        let mut consider = |gains: PidGains, best: &mut Option<(f64, PidGains)>| {
            if !is_admissible(&gains, &base) {
                return false;
            }
            simulations += 1;
            let error = self.quick(&with(gains));
            let better = best.is_none_or(|(least, _)| error < least);
            if better {
                *best = Some((error, gains));
            }
            better
        };
        for gains in grid(&base, terms, tau) {
            consider(gains, &mut best);
        }
        let Some((_, mut at)) = best else {
            // Not even the smallest gain keeps its margins: nothing can be said.
            return self.measure(&with(PidGains::default()));
        };
        // Pattern search: factors on each gain, smaller ones where nothing improves.
        let mut factor = 1.25;
        let mut evaluations = 0;
        while evaluations < EVALUATIONS && factor > 1.02 {
            let mut improved = false;
            for candidate in neighbours(&at, factor, terms) {
                evaluations += 1;
                if consider(candidate, &mut best) {
                    at = candidate;
                    improved = true;
                    break;
                }
            }
            if !improved {
                factor = f64::sqrt(factor);
            }
        }
        let measured = self.measure(&with(at))?;
        Ok(Tuned { simulations: simulations + 1, ..measured })
    }

    /// The ink and margins with every parameter of the motors off by [`OFF`], one at a time; the
    /// controller keeps the model it was tuned with.
    ///
    /// # Errors
    /// Those of [`simulate`].
    pub fn off_cases(&self, tuned: &Drive) -> Result<Vec<OffCase>, SimulationError> {
        let Feedback::Pid(gains, _) = tuned.feedback else { return Ok(Vec::new()) };
        let model = |index: usize| match &tuned.motors[index].plant {
            MotorPlant::Dc(parameters) => MotorModel::from(parameters),
            _ => MotorModel {
                speed_per_duty_ticks_s: 1.0,
                time_constant_s: 0.0,
                friction_percent: 0.0,
                viscous_percent: 0.0,
            },
        };
        let models = tuned.models.or(Some([model(0), model(1)]));
        let mut cases = Vec::new();
        for (key, change) in CHANGES {
            for factor in [1.0 - OFF, 1.0 + OFF] {
                let drive = Drive { models, ..with_motors(tuned, |p| change(p, factor)) };
                let margins = worst_margins(&gains, &drive);
                cases.push(OffCase {
                    key,
                    factor,
                    stray_rms_mm: self.measure(&drive)?.ink.stray.rms_mm,
                    gain_margin: margins.map_or(f64::INFINITY, |margins| margins.gain),
                    phase_margin_deg: margins.map_or(180.0, |margins| margins.phase_deg),
                });
            }
        }
        Ok(cases)
    }
}

/// The candidates of the grid: the largest admissible gain for each ratio, and smaller ones.
fn grid(drive: &Drive, terms: Terms, tau: f64) -> Vec<PidGains> {
    let mut ratios = vec![(0.0, 0.0)];
    if terms == Terms::Pid {
        ratios.clear();
        for cancelled in std::iter::once(0.0).chain(CANCELLED) {
            for integral in INTEGRAL {
                ratios.push((cancelled * tau, integral));
            }
        }
    }
    let mut all = Vec::new();
    for (kd, ki) in ratios {
        let gains = |kp: f64| PidGains {
            kp,
            ki: ki * kp,
            kd: kd * kp,
            // Half the lag of the loop's own period.
            kd_filter_s: if kd > 0.0 { drive.period_s } else { 0.0 },
        };
        if let Some(largest) = largest_admissible(drive, &gains) {
            let mut kp = largest;
            for _ in 0..GRID {
                all.push(gains(kp));
                kp /= GRID_FACTOR;
            }
        }
    }
    all
}

/// The largest gain of a ratio that keeps its margins, by bisection; `None` if there is none.
fn largest_admissible(drive: &Drive, gains: &impl Fn(f64) -> PidGains) -> Option<f64> {
    let g = dc_motors(drive).map(|motor| motor.speed_per_duty_ticks_s).fold(0.0, f64::max);
    if g <= 0.0 {
        return None;
    }
    // Loop gains from 0.01 to 2 / period, 1/s: beyond that no sampled loop is stable.
    let (mut low, mut high) = (libm::log(0.01 / g), libm::log(2.0 / (drive.period_s * g)));
    // With an integral, small gains have no phase margin: the first admissible one from above.
    let steps = 40;
    let step = (high - low) / f64::from(steps);
    let found = (0..=steps)
        .map(|index| high - step * f64::from(index))
        .find(|log| is_admissible(&gains(libm::exp(*log)), drive))?;
    (low, high) = (found, found + step);
    for _ in 0..8 {
        let middle = 0.5 * (low + high);
        if is_admissible(&gains(libm::exp(middle)), drive) {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(libm::exp(low))
}

/// The neighbours of a point: each gain larger or smaller by a factor.
fn neighbours(at: &PidGains, factor: f64, terms: Terms) -> Vec<PidGains> {
    let mut all = vec![PidGains { kp: at.kp * factor, ..*at }, PidGains { kp: at.kp / factor, ..*at }];
    if terms == Terms::Pid {
        if at.kd > 0.0 {
            all.push(PidGains { kd: at.kd * factor, ..*at });
            all.push(PidGains { kd: at.kd / factor, ..*at });
            all.push(PidGains { kp: at.kp * factor, kd: at.kd * factor, ..*at });
        }
        let ki = if at.ki > 0.0 { at.ki } else { 0.3 * at.kp };
        all.push(PidGains { ki: ki * factor, ..*at });
        all.push(PidGains { ki: ki / factor, ..*at });
    }
    all
}

/// Rounds a gain to three digits, as a machine file shows it.
pub fn three_digits(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let scale = libm::pow(10.0, 2.0 - libm::floor(libm::log10(value.abs())));
    libm::round(value * scale) / scale
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(period_s: f64) -> Drive {
        let motor = DcParameters::first_order(106.67, 0.12).with_friction(8.0, 6.0);
        Drive::proportional(MotorPlant::Dc(motor), 0.05, period_s)
    }

    #[test]
    fn largest_admissible_gain_keeps_its_margins_and_ten_percent_more_does_not() {
        let drive = drive(0.01);
        for (kd, ki) in [(0.0, 0.0), (0.12, 0.0), (0.06, 1.0)] {
            let gains = |kp: f64| PidGains {
                kp,
                ki: ki * kp,
                kd: kd * kp,
                kd_filter_s: if kd > 0.0 { 0.01 } else { 0.0 },
            };
            let largest = largest_admissible(&drive, &gains).unwrap();
            assert!(is_admissible(&gains(largest), &drive));
            assert!(!is_admissible(&gains(1.1 * largest), &drive), "kd {kd} ki {ki}");
        }
    }

    #[test]
    fn gains_are_rounded_to_three_digits() {
        assert_eq!(three_digits(0.123_456), 0.123);
        assert_eq!(three_digits(98_765.0), 98_800.0);
        assert_eq!(three_digits(0.0), 0.0);
    }
}
