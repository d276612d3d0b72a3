//! Differences between two plans, drawings or machines.

use std::fmt::Write as _;

use schemars::JsonSchema;
use serde::Serialize;

use super::round;
use super::text::{duration, length, pluralize};
use crate::diff::{Changed, Diff, Matching};

/// What differs between an old and a new plan, drawing or machine file.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DiffReport {
    /// Whether nothing differs.
    pub same: bool,
    /// Strokes are the same within this distance, mm.
    pub within_mm: f64,
    /// Strokes; `null` where a side is a machine.
    pub strokes: Option<StrokesReport>,
    /// Times, lengths and counts that both sides have.
    pub quantities: Vec<QuantityReport>,
    /// Options, machine keys and header values that differ: they explain the rest.
    pub causes: Vec<CauseReport>,
}

/// How many strokes became what.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct StrokesReport {
    /// The same ink with the same pen.
    pub same: usize,
    /// Of these, drawn in the other direction.
    pub reversed: usize,
    /// Of these, drawn at another place in the order.
    pub reordered: usize,
    /// The same shape elsewhere or at another size.
    pub moved: usize,
    /// Factor and shift (mm) of all strokes that moved together: x' = factor x + shift.
    pub moved_by: Option<[f64; 3]>,
    /// The same ink with another pen.
    pub other_pen: usize,
    /// Old strokes without a new one.
    pub gone: usize,
    /// New strokes without an old one.
    pub added: usize,
}

/// A quantity of both sides.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct QuantityReport {
    /// What it is, with its unit: `time_s`, `ink_mm`, `travel_mm`, `rows`, `strokes`. Of the certificates
    /// of plan documents: `stray_max_mm` (from the ink to the drawing), `missed_max_mm` (from the drawing
    /// to the ink), and the largest of the motors' `speed_share`, `acceleration_share` and `jerk_share`
    /// (peak divided by limit).
    pub key: String,
    /// Its old value.
    pub old: f64,
    /// Its new value.
    pub new: f64,
}

/// A key whose value differs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct CauseReport {
    /// The key, such as `settings.tolerance_mm` or `machine.motor.0.max_speed`.
    pub key: String,
    /// Its old value; `null` where there was none.
    pub old: Option<String>,
    /// Its new value.
    pub new: Option<String>,
}

impl StrokesReport {
    fn of(matching: &Matching) -> Self {
        let moved_by = matching.map.map(|map| {
            let [a, _, _, _, e, f] = map.as_coeffs();
            [round::coefficient(a), round::mm(e), round::mm(f)]
        });
        Self {
            same: matching.same.len(),
            reversed: matching.reversed(),
            reordered: matching.reordered(),
            moved: matching.moved.len(),
            moved_by,
            other_pen: matching.repenned.len(),
            gone: matching.gone.len(),
            added: matching.added.len(),
        }
    }

    fn text(&self) -> String {
        let mut parts = vec![format!("{} the same", self.same)];
        let mut add = |count: usize, what: &str| {
            if count > 0 {
                parts.push(format!("{count} {what}"));
            }
        };
        add(self.reversed, "of them reversed");
        add(self.reordered, "of them in another order");
        add(self.moved, "moved");
        add(self.other_pen, "with another pen");
        add(self.gone, "gone");
        add(self.added, "added");
        let mut text = parts.join(", ");
        if let Some([factor, x, y]) = self.moved_by {
            if (factor - 1.0).abs() < 1e-6 {
                let _ = write!(text, " (moved by {x:.2}, {y:.2} mm)");
            } else {
                let _ = write!(text, " (moved and scaled by {factor:.4})");
            }
        }
        text
    }
}

impl CauseReport {
    fn of(changed: &Changed) -> Self {
        Self { key: changed.key.clone(), old: changed.old.clone(), new: changed.new.clone() }
    }
}

impl DiffReport {
    /// The report of a comparison.
    pub fn of(diff: &Diff) -> Self {
        let rounded = |key: &str, value| if key.ends_with("_s") { round::s(value) } else { round::mm(value) };
        let quantities = diff.quantities().into_iter();
        Self {
            same: diff.is_empty(),
            within_mm: round::mm(diff.within_mm),
            strokes: diff.strokes.as_ref().map(StrokesReport::of),
            quantities: quantities
                .map(|(key, old, new)| QuantityReport {
                    key: key.to_owned(),
                    old: rounded(key, old),
                    new: rounded(key, new),
                })
                .collect(),
            causes: diff.facts.iter().map(CauseReport::of).collect(),
        }
    }

    /// The differences in words, a line each; without the names of the sides.
    pub fn text(&self) -> String {
        let mut text = String::new();
        if self.same {
            text.push_str("no difference\n");
            return text;
        }
        if let Some(strokes) = &self.strokes {
            let _ = writeln!(text, "strokes  {}", strokes.text());
        }
        for quantity in &self.quantities {
            // What is the same in print is noise.
            if quantity.shown(quantity.old) == quantity.shown(quantity.new) || quantity.key == "strokes" {
                continue;
            }
            let _ = writeln!(text, "{}", quantity.text());
        }
        for CauseReport { key, old, new } in &self.causes {
            let _ = match (old, new) {
                (Some(old), Some(new)) => writeln!(text, "{key}: {old} -> {new}"),
                (None, Some(new)) => writeln!(text, "{key}: {new} (new)"),
                (Some(old), None) => writeln!(text, "{key}: {old} (gone)"),
                (None, None) => Ok(()),
            };
        }
        text
    }

    /// The differences in one line: strokes and time, and the first causes.
    pub fn line(&self) -> String {
        if self.same {
            return "no difference".to_owned();
        }
        let mut parts = Vec::new();
        if let Some(strokes) = self.strokes.as_ref().filter(|strokes| !strokes.is_same()) {
            parts.push(pluralized(strokes));
        }
        let shown = self
            .quantities
            .iter()
            .filter(|quantity| quantity.old != quantity.new && quantity.key == "time_s");
        parts.extend(shown.map(|quantity| quantity.text().split_whitespace().collect::<Vec<_>>().join(" ")));
        parts.extend(self.causes.iter().take(3).map(|cause| cause.key.clone()));
        if parts.is_empty() { "rows".to_owned() } else { parts.join("; ") }
    }
}

fn pluralized(strokes: &StrokesReport) -> String {
    let changed = strokes.moved + strokes.other_pen + strokes.gone + strokes.added + strokes.reordered;
    format!("{} differ: {}", pluralize(changed.max(strokes.reversed), "stroke"), strokes.text())
}

impl StrokesReport {
    fn is_same(&self) -> bool {
        self.moved + self.other_pen + self.gone + self.added + self.reordered + self.reversed == 0
    }
}

impl QuantityReport {
    fn shown(&self, value: f64) -> String {
        match &*self.key {
            "time_s" => duration(value),
            "ink_mm" | "travel_mm" => length(value),
            key if key.ends_with("_mm") => format!("{value:.3} mm"),
            key if key.ends_with("_share") => format!("{:.1} %", 100.0 * value),
            _ => format!("{value:.0}"),
        }
    }

    fn text(&self) -> String {
        let name = match self.key.split('_').next() {
            Some("acceleration") => "accel",
            Some(name) => name,
            None => &self.key,
        };
        let mut text = format!("{name:<8} {} -> {}", self.shown(self.old), self.shown(self.new));
        let per_cent = 100.0 * (self.new / self.old - 1.0);
        if self.key.ends_with("_share") {
            text.push_str(" of the limit");
        } else if self.old > 0.0 && per_cent.abs() >= 0.05 {
            let _ = write!(text, " ({per_cent:+.1} %)");
        }
        text
    }
}
