//! Reports of calibrations.

use std::fmt::Write as _;

use ::calibration::{Alternative, Fit, Helpful, Measurements, Setup, Unknown, Value};
use schemars::JsonSchema;
use serde::Serialize;

use crate::calibrate::CORNER_NAMES;

/// A calibration. Lengths are mm.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CalibrationReport {
    /// The found values.
    pub values: Vec<FoundValue>,
    /// Values that the touches do not determine, in sentences that say what would.
    pub kept: Vec<String>,
    /// One for each touch, in order.
    pub residuals: Vec<Residual>,
    /// Root mean square of the residuals.
    pub rms_mm: f64,
    /// Equations less unknowns.
    pub freedom: usize,
    /// Standard deviation of one coordinate of a touch.
    pub sigma_mm: f64,
    /// Ratio of the largest singular value of the problem to the smallest.
    pub condition: f64,
    /// Expected distance from drawing to ink over the sheet, RMS.
    pub page_rms_mm: f64,
    /// The largest one on the sheet.
    pub page_worst_mm: f64,
    /// The touch without which the others fit best.
    pub worst: Option<WithoutTouch>,
    /// Other readings of the touches that fit much better, in sentences.
    pub alternatives: Vec<String>,
}

/// A found value.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FoundValue {
    /// What, in the words of the machine file.
    pub name: String,
    /// Unit of the numbers; empty for a ratio.
    pub unit: String,
    /// In the machine file.
    pub before: f64,
    /// As found.
    pub found: f64,
    /// Standard deviation.
    pub deviation: f64,
}

/// From a touched place to the pen of the calibrated machine.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Residual {
    /// The place.
    pub place_mm: [f64; 2],
    /// Along x and y.
    pub off_mm: [f64; 2],
}

/// The fit without one touch.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct WithoutTouch {
    /// Number of the touch, from 1.
    pub touch: usize,
    /// How far it is from where the others expect it.
    pub off_mm: f64,
    /// Root mean square residual of the others.
    pub rms_mm: f64,
    /// What comes out for the values.
    pub values: Vec<f64>,
}

/// What an unknown is called, its unit, and its value in a setup.
fn named(unknown: Unknown, setup: &Setup, motors: [&str; 2]) -> (String, &'static str, f64) {
    match unknown {
        Unknown::SheetX => ("x of the sheet".into(), "mm", setup.corner.x),
        Unknown::SheetY => ("y of the sheet".into(), "mm", setup.corner.y),
        Unknown::Offset(motor) => {
            (format!("offset of {}", motors[motor]), "ticks", setup.offset_ticks[motor])
        }
        Unknown::Counts(motor) => {
            (format!("counts of {}", motors[motor]), "ticks/mm", setup.ticks_per_unit[motor])
        }
        Unknown::Backlash(motor) => {
            (format!("backlash of {}", motors[motor]), "ticks", setup.backlash_ticks[motor])
        }
        Unknown::Length(key) => match setup.geometry.get(key) {
            Some(::calibration::Parameter::Length(mm)) => (key.into(), "mm", *mm),
            _ => (key.into(), "mm", 0.0),
        },
        Unknown::Spread => ("distance of the bases or anchors".into(), "mm", setup.distance_of_points()),
        Unknown::Turn => ("turn of the machine".into(), "deg", 0.0),
        Unknown::Skew => ("skew of the axes".into(), "deg", 0.0),
        Unknown::Belt => ("ratio of the elbow's belt".into(), "", 1.0),
    }
}

/// The value of an unknown in the calibrated setup, and the factor on its standard deviation.
fn found(value: &Value, before: &Setup, after: &Setup, motors: [&str; 2]) -> (f64, f64) {
    match value.unknown {
        Unknown::Turn | Unknown::Skew => (value.change.to_degrees(), 1.0_f64.to_degrees()),
        Unknown::Belt => (1.0 + value.change, 1.0),
        Unknown::Offset(motor) | Unknown::Counts(motor) | Unknown::Backlash(motor) => {
            (named(value.unknown, after, motors).2, before.ticks_per_unit[motor].abs())
        }
        _ => (named(value.unknown, after, motors).2, 1.0),
    }
}

/// What a touch would help, as a sentence.
pub fn advice(helpful: &Helpful) -> String {
    let elbow = if helpful.other_elbow { ", with the elbow on the other side" } else { "" };
    format!("a touch at {:.1}, {:.1} mm of the sheet{elbow} would help", helpful.place.x, helpful.place.y)
}

/// What an alternative reading of the touches says, as a sentence.
pub fn alternative(what: &Alternative, rms_mm: f64, motors: [&str; 2]) -> String {
    let what = match what {
        Alternative::Reversed([true, true]) => {
            format!("motors {} and {} count the other way (negate both counts)", motors[0], motors[1])
        }
        Alternative::Reversed([first, _]) => {
            format!("motor {} counts the other way (negate its counts)", motors[usize::from(!first)])
        }
        Alternative::Order(order) => {
            format!(
                "the corners were touched in the order {}",
                order.map(|corner| CORNER_NAMES[corner]).join(", ")
            )
        }
    };
    format!("{what}: {rms_mm:.2} mm RMS")
}

impl CalibrationReport {
    /// The report of a fit.
    pub fn of(fit: &Fit, before: &Setup, data: &Measurements, motors: [&str; 2]) -> Self {
        let value = |value: &Value| {
            let (name, unit, file) = named(value.unknown, before, motors);
            let (found, factor) = found(value, before, &fit.setup, motors);
            FoundValue { name, unit: unit.into(), before: file, found, deviation: factor * value.deviation }
        };
        let kept = fit.kept.iter().map(|(unknowns, helpful)| {
            let names: Vec<String> =
                unknowns.iter().map(|unknown| named(*unknown, before, motors).0).collect();
            let advice = helpful.as_ref().map_or(String::new(), |helpful| format!("; {}", advice(helpful)));
            format!("not determined, kept as in the file: {}{advice}", names.join(", "))
        });
        let residuals = data.touches.iter().zip(&fit.residuals).map(|(touch, off)| Residual {
            place_mm: [touch.place.x, touch.place.y],
            off_mm: [off.x, off.y],
        });
        let without = |worst: &::calibration::LeftOut| WithoutTouch {
            touch: worst.touch + 1,
            off_mm: worst.off_mm,
            rms_mm: worst.rms_mm,
            values: fit.values.iter().map(|value| named(value.unknown, &worst.setup, motors).2).collect(),
        };
        Self {
            values: fit.values.iter().map(value).collect(),
            kept: kept.collect(),
            residuals: residuals.collect(),
            rms_mm: fit.rms_mm,
            freedom: fit.freedom,
            sigma_mm: fit.sigma_mm,
            condition: fit.condition,
            page_rms_mm: fit.page.rms_mm,
            page_worst_mm: fit.page.worst_mm,
            worst: fit.worst.as_ref().map(without),
            alternatives: Vec::new(),
        }
    }

    /// The report as text.
    pub fn text(&self, machine: &str, equations: usize) -> String {
        let mut text = format!(
            "{machine}: {equations} equations, {} unknowns, {} to spare\n",
            self.values.len(),
            self.freedom
        );
        let _ = writeln!(text, "  {:<34} {:>12} {:>12} {:>10}", "", "file", "found", "+-");
        for FoundValue { name, unit, before, found, deviation } in &self.values {
            let _ = writeln!(text, "  {name:<34} {before:>12.4} {found:>12.4} {deviation:>10.4} {unit}");
        }
        for kept in &self.kept {
            let _ = writeln!(text, "  {kept}");
        }
        if !self.residuals.is_empty() {
            let _ = writeln!(text, "residuals, mm");
        }
        for (index, Residual { place_mm: [x, y], off_mm: [dx, dy] }) in self.residuals.iter().enumerate() {
            let size = libm::hypot(*dx, *dy);
            let number = index + 1;
            let _ =
                writeln!(text, "  touch {number:>2} at {x:>7.1}, {y:>7.1}: {dx:>7.3} {dy:>7.3}, {size:.3}");
        }
        let _ = writeln!(
            text,
            "  {:.3} mm RMS; one coordinate has a standard deviation of {:.3} mm",
            self.rms_mm, self.sigma_mm
        );
        if let Some(worst) = &self.worst {
            let _ = writeln!(
                text,
                "worst: touch {}, {:.2} mm from where the others expect it; without it {:.3} mm RMS:",
                worst.touch, worst.off_mm, worst.rms_mm
            );
            let values = self.values.iter().zip(&worst.values);
            let values = values.filter(|(value, _)| !["deg", ""].contains(&value.unit.as_str()));
            let values: Vec<String> =
                values.map(|(value, number)| format!("{} {number:.3} {}", value.name, value.unit)).collect();
            let _ = writeln!(text, "  {}", values.join(", "));
        }
        let _ = writeln!(text, "condition {:.1}", self.condition);
        let _ = writeln!(
            text,
            "expected page error {:.2} mm RMS, {:.2} mm at worst",
            self.page_rms_mm, self.page_worst_mm
        );
        text
    }
}
