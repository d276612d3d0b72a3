//! Reports of searches of gains and of identified motors.

use std::fmt::Write as _;

use schemars::JsonSchema;
use serde::Serialize;
use simulation::Identified;

use super::round;
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
            stray_rms_mm: round::mm(case.stray_rms_mm),
            gain_margin: Some(case.gain_margin).filter(|gain| gain.is_finite()).map(round::margin),
            phase_margin_deg: round::margin(case.phase_margin_deg),
        });
        Self {
            measures: tuning.measures.iter().map(rounded).collect(),
            rounding_rms_mm: round::mm(tuning.rounding_rms_mm),
            frictionless_rms_mm: round::mm(tuning.frictionless_rms_mm),
            saturated_share: round::share(tuning.saturated_share),
            off: off.collect(),
            simulations: tuning.simulations,
        }
    }
}

/// A measure with numbers rounded to what they mean.
fn rounded(measure: &Measure) -> Measure {
    Measure {
        stray_max_mm: round::mm(measure.stray_max_mm),
        stray_rms_mm: round::mm(measure.stray_rms_mm),
        missed_rms_mm: round::mm(measure.missed_rms_mm),
        period_s: round::s(measure.period_s),
        kp: measure.kp.map(round::coefficient),
        ki: measure.ki.map(round::coefficient),
        kd: measure.kd.map(round::coefficient),
        gain_margin: measure.gain_margin.map(round::margin),
        phase_margin_deg: measure.phase_margin_deg.map(round::margin),
        ..measure.clone()
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

/// An identified motor, each value with its standard deviation. Deviations are `null` where the record
/// says nothing.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MotorEstimates {
    /// Speed without load per percent of duty, ticks/s.
    pub speed_per_duty_ticks_s: f64,
    /// Its standard deviation, ticks/s.
    pub speed_per_duty_deviation_ticks_s: f64,
    /// Time constant, s.
    pub time_constant_s: f64,
    /// Its standard deviation, s.
    pub time_constant_deviation_s: f64,
    /// Stiction, % of duty.
    pub stiction_percent: f64,
    /// Its standard deviation, % of duty.
    pub stiction_deviation_percent: f64,
    /// Values of the stiction that fit equally well, from and to, % of duty.
    pub stiction_range_percent: [f64; 2],
    /// Coulomb friction, % of duty.
    pub friction_percent: f64,
    /// Its standard deviation, % of duty.
    pub friction_deviation_percent: f64,
    /// What the model leaves over, ticks RMS.
    pub residual_rms_ticks: f64,
    /// The keys of a machine file that the record does not determine.
    pub undetermined: Vec<&'static str>,
}

impl MotorEstimates {
    /// The report of an identification.
    pub fn of(found: &Identified) -> Self {
        let [g, tau, stiction, friction] = [
            found.speed_per_duty_ticks_s,
            found.time_constant_s,
            found.stiction_percent,
            found.friction_percent,
        ];
        let keys = ["speed_per_duty", "time_constant", "stiction", "friction"];
        let open = keys.into_iter().zip([g, tau, stiction, friction]);
        Self {
            speed_per_duty_ticks_s: g.value,
            speed_per_duty_deviation_ticks_s: g.deviation,
            time_constant_s: tau.value,
            time_constant_deviation_s: tau.deviation,
            stiction_percent: stiction.value,
            stiction_deviation_percent: stiction.deviation,
            stiction_range_percent: [found.stiction_range.0, found.stiction_range.1],
            friction_percent: friction.value,
            friction_deviation_percent: friction.deviation,
            residual_rms_ticks: found.residual_rms_ticks,
            undetermined: open.filter(|(_, estimate)| !estimate.determined).map(|(key, _)| key).collect(),
        }
    }

    /// Key, unit, value and standard deviation of each parameter.
    fn rows(&self) -> [(&'static str, &'static str, [f64; 2]); 4] {
        let ms = |time_s: f64| 1e3 * time_s;
        [
            (
                "speed_per_duty",
                "ticks/s",
                [self.speed_per_duty_ticks_s, self.speed_per_duty_deviation_ticks_s],
            ),
            ("time_constant", "ms", [self.time_constant_s, self.time_constant_deviation_s].map(ms)),
            ("stiction", "% of duty", [self.stiction_percent, self.stiction_deviation_percent]),
            ("friction", "% of duty", [self.friction_percent, self.friction_deviation_percent]),
        ]
    }

    /// The report as text, with a table to paste where all is determined.
    pub fn text(&self, rows: usize) -> String {
        let mut out = format!("{rows} rows, {:.2} ticks RMS left over\n", self.residual_rms_ticks);
        for (key, unit, [value, deviation]) in self.rows() {
            let _ = write!(out, "{key:<15} ");
            let _ = if !self.undetermined.contains(&key) {
                writeln!(out, "{value:.3} {unit}, standard deviation {deviation:.3}")
            } else if key == "stiction" {
                let [from, to] = self.stiction_range_percent;
                writeln!(out, "not determined: anything from {from:.2} to {to:.2} {unit} fits")
            } else {
                writeln!(out, "not determined")
            };
        }
        if self.undetermined.is_empty() {
            let _ = write!(
                out,
                "\n[[drive.motor]]\nkind = \"dc\"\nspeed_per_duty = \"{:.2}ticks/s\"\ntime_constant = \"{:.2}ms\"\nstiction = {:.2}\nfriction = {:.2}\n",
                self.speed_per_duty_ticks_s,
                1e3 * self.time_constant_s,
                self.stiction_percent.max(self.friction_percent),
                self.friction_percent,
            );
        }
        out
    }

    /// What the record does not determine, and what would help; `None` if it determines all.
    pub fn advice(&self) -> Option<String> {
        if self.undetermined.is_empty() {
            return None;
        }
        let help = if self.undetermined == ["stiction"] {
            "add a slow ramp of the duty from rest until the motor moves"
        } else {
            "record a slow ramp from rest, then runs at two or more duties and back to rest"
        };
        Some(format!("the record does not determine {}: {help}", self.undetermined.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_are_rounded_to_what_they_mean() {
        let measure = Measure {
            name: "I and D",
            stray_max_mm: 46.520_769_487_228_79,
            stray_rms_mm: 10.105_960_597_167_817,
            missed_rms_mm: 27.893_326_214_156_627,
            period_s: 0.001_000_000_000_000_2,
            kp: Some(0.082_075_784_178_417_95),
            ki: None,
            kd: Some(1.0 / 3.0),
            gain_margin: Some(23.168_153_048_612_837),
            phase_margin_deg: Some(48.894_550_400_870_8),
        };
        let json = serde_json::to_string(&rounded(&measure)).expect("numbers and names");
        assert_eq!(
            json,
            "{\"name\":\"I and D\",\"stray_max_mm\":46.5208,\"stray_rms_mm\":10.106,\"missed_rms_mm\":27.8933,\
             \"period_s\":0.001,\"kp\":0.082075784,\"ki\":null,\"kd\":0.333333333,\"gain_margin\":23.168,\
             \"phase_margin_deg\":48.895}"
        );
    }
}
