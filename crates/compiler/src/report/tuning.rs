//! Reports of searches of gains and of identified motors.

use std::fmt::Write as _;

use schemars::JsonSchema;
use serde::Serialize;
use simulation::{Estimate, Identified};

use crate::tune::{Measure, Tuning};

/// The result of a search. Lengths are mm, times s.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct TuningReport {
    /// What each measure buys, each on top of the last one.
    pub measures: Vec<Measure>,
    /// The ink of the plan's own rounding to ticks, RMS.
    pub rounding_rms_mm: f64,
    /// The tuned drive without friction, RMS.
    pub frictionless_rms_mm: f64,
    /// Share of the loop's calls with the duty at its limit.
    pub saturated_share: f64,
    /// One parameter off at a time.
    pub off: Vec<OffReport>,
    /// Simulations in all.
    pub simulations: usize,
}

/// One parameter off.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct OffReport {
    /// Its key.
    pub key: &'static str,
    /// The factor on it.
    pub factor: f64,
    /// Root mean square of stray ink.
    pub stray_rms_mm: f64,
    /// The smaller gain margin of both motors; `null` where no gain is too large.
    pub gain_margin: Option<f64>,
    /// The smaller phase margin of both motors, degrees.
    pub phase_margin_deg: f64,
}

impl TuningReport {
    /// The report of a search.
    pub fn of(tuning: &Tuning) -> Self {
        let off = tuning.off.iter().map(|case| OffReport {
            key: case.key,
            factor: case.factor,
            stray_rms_mm: case.stray_rms_mm,
            gain_margin: Some(case.gain_margin).filter(|gain| gain.is_finite()),
            phase_margin_deg: case.phase_margin_deg,
        });
        Self {
            measures: tuning.measures.clone(),
            rounding_rms_mm: tuning.rounding_rms_mm,
            frictionless_rms_mm: tuning.frictionless_rms_mm,
            saturated_share: tuning.saturated_share,
            off: off.collect(),
            simulations: tuning.simulations,
        }
    }
}

/// A search as text.
pub fn text(drawing: &str, machine: &str, tuning: &Tuning) -> String {
    let mut out = format!("{machine}, {drawing}: what each measure buys, distance of ink in mm\n");
    let _ = writeln!(
        out,
        "{:<36} {:>8} {:>8} {:>8}  {:>6}  {:>6} {:>6} {:>7}  {:>6} {:>6}",
        "", "max", "RMS", "missed", "period", "kp", "ki", "kd", "gain", "phase"
    );
    for (index, measure) in tuning.measures.iter().enumerate() {
        let name = if index < 2 { measure.name.to_owned() } else { format!("+ {}", measure.name) };
        let gain = |gain: Option<f64>| gain.map_or_else(|| "-".to_owned(), |gain| format!("{gain:.3}"));
        let _ = writeln!(
            out,
            "{name:<36} {:>8.3} {:>8.3} {:>8.3}  {:>4}ms  {:>6} {:>6} {:>7}  {:>6} {:>6}",
            measure.stray_max_mm,
            measure.stray_rms_mm,
            measure.missed_rms_mm,
            (measure.period_s * 1e4).round() / 10.0,
            gain(measure.kp),
            gain(measure.ki),
            measure.kd.map_or_else(|| "-".to_owned(), |kd| format!("{kd:.4}")),
            measure.gain_margin.map_or_else(|| "-".to_owned(), |gain| format!("{gain:.2}")),
            measure.phase_margin_deg.map_or_else(|| "-".to_owned(), |phase| format!("{phase:.0}deg")),
        );
    }
    let worst = tuning.off.iter().max_by(|a, b| a.stray_rms_mm.total_cmp(&b.stray_rms_mm));
    if let Some(worst) = worst {
        let gain = tuning.off.iter().map(|case| case.gain_margin).fold(f64::INFINITY, f64::min);
        let phase = tuning.off.iter().map(|case| case.phase_margin_deg).fold(f64::INFINITY, f64::min);
        let _ = writeln!(
            out,
            "each parameter 20 % off: at worst {:.3} mm RMS ({} x {}), gain margin {gain:.2}, phase margin {phase:.0} deg",
            worst.stray_rms_mm, worst.key, worst.factor
        );
    }
    out.push_str(&limits(tuning));
    out
}

/// What limits the tuned drive, the largest gain first.
fn limits(tuning: &Tuning) -> String {
    let of = |name: &str| tuning.measures.iter().find(|measure| measure.name == name);
    let Some(tuned) = of("I and D") else { return String::new() };
    let mut causes = vec![
        ("without friction", tuning.frictionless_rms_mm),
        ("with drives that follow exactly", tuning.rounding_rms_mm),
    ];
    if let Some(faster) = of("faster loop") {
        causes.push(("with a faster loop", faster.stray_rms_mm));
    }
    causes.sort_by(|a, b| a.1.total_cmp(&b.1));
    let listed: Vec<String> = causes.iter().map(|(what, rms)| format!("{rms:.3} {what}")).collect();
    let mut out =
        format!("what limits now: of {:.3} mm RMS would remain {}\n", tuned.stray_rms_mm, listed.join(", "));
    if tuned.stray_rms_mm < 1.5 * tuning.rounding_rms_mm {
        out.push_str("mostly the ticks: only a finer encoder draws better\n");
    }
    if tuning.saturated_share > 0.01 {
        let _ = writeln!(
            out,
            "the duty is at its limit {:.1} % of the time: lower max_speed or max_acceleration of the motors",
            100.0 * tuning.saturated_share
        );
    }
    out
}

/// An identified motor.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MotorEstimates {
    /// Speed without load per percent of duty.
    pub speed_per_duty_ticks_s: EstimateReport,
    /// Time constant.
    pub time_constant_s: EstimateReport,
    /// Stiction, % of duty.
    pub stiction_percent: EstimateReport,
    /// Values of the stiction that fit equally well, % of duty.
    pub stiction_range_percent: [f64; 2],
    /// Coulomb friction, % of duty.
    pub friction_percent: EstimateReport,
    /// What the model leaves over, ticks RMS.
    pub residual_rms_ticks: f64,
}

/// A value with its standard deviation; `null` where it is not finite.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct EstimateReport {
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub deviation: f64,
    /// Whether the record determines it.
    pub determined: bool,
}

impl From<Estimate> for EstimateReport {
    fn from(estimate: Estimate) -> Self {
        let Estimate { value, deviation, determined } = estimate;
        Self { value, deviation, determined }
    }
}

impl MotorEstimates {
    /// The report of an identification.
    pub fn of(found: &Identified) -> Self {
        Self {
            speed_per_duty_ticks_s: found.speed_per_duty_ticks_s.into(),
            time_constant_s: found.time_constant_s.into(),
            stiction_percent: found.stiction_percent.into(),
            stiction_range_percent: [found.stiction_range.0, found.stiction_range.1],
            friction_percent: found.friction_percent.into(),
            residual_rms_ticks: found.residual_rms_ticks,
        }
    }

    fn rows(&self) -> [(&'static str, &'static str, f64, EstimateReport); 4] {
        [
            ("speed_per_duty", "ticks/s", 1.0, self.speed_per_duty_ticks_s),
            ("time_constant", "ms", 1e3, self.time_constant_s),
            ("stiction", "% of duty", 1.0, self.stiction_percent),
            ("friction", "% of duty", 1.0, self.friction_percent),
        ]
    }

    /// The report as text, with a table to paste where all is determined.
    pub fn text(&self, rows: usize) -> String {
        let mut out = format!("{rows} rows, {:.2} ticks RMS left over\n", self.residual_rms_ticks);
        for (key, unit, scale, estimate) in self.rows() {
            let _ = write!(out, "{key:<15} ");
            let _ = if estimate.determined {
                let (value, deviation) = (scale * estimate.value, scale * estimate.deviation);
                writeln!(out, "{value:.3} {unit}, standard deviation {deviation:.3}")
            } else if key == "stiction" {
                let [from, to] = self.stiction_range_percent;
                writeln!(out, "not determined: anything from {from:.2} to {to:.2} {unit} fits")
            } else {
                writeln!(out, "not determined")
            };
        }
        if self.undetermined().is_none() {
            let _ = write!(
                out,
                "\n[[drive.motor]]\nkind = \"dc\"\nspeed_per_duty = \"{:.2}ticks/s\"\ntime_constant = \"{:.2}ms\"\nstiction = {:.2}\nfriction = {:.2}\n",
                self.speed_per_duty_ticks_s.value,
                1e3 * self.time_constant_s.value,
                self.stiction_percent.value.max(self.friction_percent.value),
                self.friction_percent.value,
            );
        }
        out
    }

    /// What the record does not determine, and what would help; `None` if it determines all.
    pub fn undetermined(&self) -> Option<String> {
        let open: Vec<&str> =
            self.rows().iter().filter(|row| !row.3.determined).map(|(key, ..)| *key).collect();
        if open.is_empty() {
            return None;
        }
        let help = if open == ["stiction"] {
            "add a slow ramp of the duty from rest until the motor moves"
        } else {
            "record a slow ramp from rest, then runs at two or more duties and back to rest"
        };
        Some(format!("the record does not determine {}: {help}", open.join(", ")))
    }
}
