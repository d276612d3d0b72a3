//! Differences between two plans, drawings or machine files, in any mix.
//!
//! Both sides become the same thing: strokes as polylines, quantities (time, ink, travel), and facts
//! (settings, machine, header). Strokes are paired by where they lie ([`Matching`]), quantities are
//! compared one by one, and facts that differ explain the rest.

mod facts;
mod picture;
mod strokes;

use drawing::{Affine, Drawing, Point};
use kinematics::{Machine, MotorPos};
use plan::file::PlanFile;

pub use self::facts::{Changed, Facts};
pub use self::picture::{html, scene};
pub use self::strokes::{Matching, Pair};
use crate::import::Page;
use crate::machine_file::{MachineFile, MachineFileError};
use crate::replay::{Motion, Polyline};

/// Chords of curves deviate from them by at most this, mm: less than any distance that counts.
const CHORD_MM: f64 = 0.002;
/// Strokes of two drawings are the same within this, mm: the unit of HP-GL is 0.025 mm.
const DRAWING_MM: f64 = 0.01;
/// The tolerance of plans that state none, mm.
const PLAN_TOLERANCE_MM: f64 = 0.1;

/// What one side is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A drawing.
    Drawing,
    /// A plan.
    Plan,
    /// A machine file.
    Machine,
}

/// One of the two things compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Side {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// Strokes in the order of drawing; none for machines.
    pub strokes: Vec<Polyline>,
    /// Numbers, each with its name and unit.
    pub quantities: Vec<Quantity>,
    /// Settings, machine and header.
    pub facts: Facts,
    /// How far the ink may lie from the drawing that it stands for, mm.
    within_mm: f64,
    /// The map from the drawing to the plan.
    placement: Option<Affine>,
}

/// A number that describes a side.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// What it is: `time_s`, `ink_mm`, `strokes`.
    pub key: &'static str,
    /// How much it is.
    pub value: f64,
}

impl Side {
    /// A page of a drawing, in its own frame.
    pub fn of_drawing(name: &str, page: &Page) -> Self {
        let drawing = &page.drawing;
        let line = |stroke: drawing::Stroke| Polyline { pen: stroke.pen.0, points: stroke.flatten(CHORD_MM) };
        let mut facts = Facts::new();
        for (pen, settings) in &page.pens {
            let mut add = |what: &str, value: Option<String>| {
                facts.extend(value.map(|value| (format!("pen.{}.{what}", pen.0), value)));
            };
            add("color", settings.color.map(|[r, g, b]| format!("#{r:02x}{g:02x}{b:02x}")));
            add("width_mm", settings.width_mm.map(|mm| mm.to_string()));
            add("speed_mm_s", settings.speed_mm_s.map(|speed| speed.to_string()));
            add("name", settings.name.clone());
        }
        Self {
            name: name.to_owned(),
            kind: Kind::Drawing,
            strokes: drawing.strokes.iter().map(line).collect(),
            quantities: ink_quantities(drawing),
            facts,
            within_mm: DRAWING_MM,
            placement: None,
        }
    }

    /// A plan on its machine: the ink that its rows draw, in machine mm.
    pub fn of_plan(name: &str, plan: &PlanFile, machine: &Machine) -> Self {
        let header = &plan.table.header;
        let rows = &plan.table.rows;
        let setting = |key: &str| plan.document.as_ref().and_then(|document| document.settings[key].as_f64());
        let tolerance_mm = setting("tolerance_mm").unwrap_or(PLAN_TOLERANCE_MM);
        let chord_mm = 0.1 * tolerance_mm.max(0.02);
        let Motion { ink, travel } = Motion::of(rows, machine, chord_mm);
        // Whole ticks: the quantization error where the pen draws.
        let floor_mm = rows.iter().filter(|row| row.pen != 0).step_by(rows.len() / 1000 + 1).map(|row| {
            let motors = MotorPos::from(row.ticks.map(|ticks| ticks as f64));
            machine.quantization_error(&machine.joint_positions(&motors))
        });
        let floor_mm = floor_mm.fold(0.0, f64::max);
        let length = |lines: &[Polyline]| lines.iter().map(|line| length_mm(&line.points)).sum::<f64>();
        let mut quantities = vec![
            Quantity { key: "time_s", value: header.duration_us as f64 * 1e-6 },
            Quantity { key: "strokes", value: ink.len() as f64 },
            Quantity { key: "ink_mm", value: length(&ink) },
            Quantity { key: "travel_mm", value: length(&travel) },
            Quantity { key: "rows", value: header.rows as f64 },
        ];
        if let Some(document) = &plan.document {
            quantities.extend(certified(&document.certificate));
        }
        Self {
            name: name.to_owned(),
            kind: Kind::Plan,
            strokes: ink,
            quantities,
            facts: plan_facts(plan),
            within_mm: tolerance_mm + 2.0 * floor_mm + chord_mm,
            placement: Some(Affine::new(header.placement)),
        }
    }

    /// A machine file.
    ///
    /// # Errors
    /// A file that describes no machine.
    pub fn of_machine(name: &str, file: &MachineFile) -> Result<Self, MachineFileError> {
        let machine = file.machine()?;
        let mut facts = Facts::new();
        // Keys of a machine file are texts and numbers: they have a JSON form.
        facts::flatten("machine", &serde_json::to_value(file).unwrap_or_default(), &mut facts);
        facts.insert("machine.name".to_owned(), machine.name().to_owned());
        for (index, motor) in machine.motors().iter().enumerate() {
            let limits = plan::Limits {
                speed: motor.max_speed_ticks_s,
                acceleration: motor.max_acceleration_ticks_s2,
                jerk: motor.max_jerk_ticks_s3,
            };
            facts.extend(limit_facts(index, &motor.name, &limits));
        }
        Ok(Self {
            name: name.to_owned(),
            kind: Kind::Machine,
            strokes: Vec::new(),
            quantities: Vec::new(),
            facts,
            within_mm: 0.0,
            placement: None,
        })
    }

    /// Whether it states all keys of its machine: a machine file or a plan document, not a table of ticks.
    fn states_all(&self) -> bool {
        self.kind != Kind::Plan || self.facts.contains_key(PROGRAM)
    }
}

fn length_mm(points: &[Point]) -> f64 {
    points.windows(2).map(|ends| ends[0].distance(ends[1])).sum()
}

fn ink_quantities(drawing: &Drawing) -> Vec<Quantity> {
    vec![
        Quantity { key: "strokes", value: drawing.strokes.len() as f64 },
        Quantity { key: "ink_mm", value: drawing.length() },
    ]
}

/// Distances and peaks of a plan document's certificate, a [`crate::report::CertificateReport`].
fn certified(certificate: &serde_json::Value) -> Vec<Quantity> {
    let distance = |path: &str| certificate["after_rounding"][path]["max_mm"].as_f64();
    let motors = certificate["motors"].as_array().map_or(&[][..], Vec::as_slice);
    let largest =
        |of: &dyn Fn(&serde_json::Value) -> Option<f64>| motors.iter().filter_map(of).max_by(f64::total_cmp);
    let all = [
        ("stray_max_mm", distance("ink_to_drawing")),
        ("missed_max_mm", distance("drawing_to_ink")),
        ("speed_share", largest(&|motor| motor["speed_share"].as_f64())),
        ("acceleration_share", largest(&|motor| motor["acceleration_share"].as_f64())),
        ("jerk_share", largest(&|motor| motor["jerk"]["share"].as_f64())),
    ];
    all.into_iter().filter_map(|(key, value)| Some(Quantity { key, value: value? })).collect()
}

/// What a plan states of itself, less what is compared as a quantity.
fn plan_facts(plan: &PlanFile) -> Facts {
    let header = &plan.table.header;
    let mut facts = Facts::new();
    let mut add = |key: &str, value: String| facts.insert(key.to_owned(), value);
    add("machine.name", header.machine.clone());
    add("period_us", header.period_us.to_string());
    add("lift_overlap_us", header.lift_overlap_us.to_string());
    add("rounding", header.rounding.name().to_owned());
    add("placement", format!("{:?}", header.placement.map(|value| libm::round(value * 1e6) / 1e6)));
    for (index, motor) in header.motors.iter().enumerate() {
        facts.extend(limit_facts(index, &motor.name, &motor.limits));
    }
    if let Some(document) = &plan.document {
        facts.insert("drawing.sha256".to_owned(), document.source.sha256.clone());
        facts.insert("drawing.name".to_owned(), document.source.name.clone());
        facts::flatten("machine", &document.machine, &mut facts);
        facts::flatten("settings", &document.settings, &mut facts);
    }
    facts
}

/// A motor's name and limits, as headers of plans state them.
fn limit_facts(index: usize, name: &str, limits: &plan::Limits) -> Vec<(String, String)> {
    let key = |what: &str| format!("motor.{index}.{what}");
    // To 0.1: the limits in a file have as many digits.
    let mut facts = vec![
        (key("name"), name.to_owned()),
        (key("speed_ticks_s"), format!("{:.1}", limits.speed)),
        (key("acceleration_ticks_s2"), format!("{:.1}", limits.acceleration)),
    ];
    facts.extend(limits.jerk.map(|jerk| (key("jerk_ticks_s3"), format!("{jerk:.1}"))));
    facts
}

/// The fact that plan documents have and tables of ticks have not.
const PROGRAM: &str = "settings.program";

/// Whether other keys of a plan document or of a machine file explain this one.
fn follows_from_others(key: &str) -> bool {
    let of_header = ["placement", "period_us", "lift_overlap_us", "rounding", "settings.command_line"];
    key.starts_with("motor.") || of_header.contains(&key)
}

/// What differs between two sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Diff {
    /// The old side.
    pub old: Side,
    /// The new side.
    pub new: Side,
    /// Pairs of strokes; `None` where a side has no ink.
    pub strokes: Option<Matching>,
    /// Facts that both kinds of sides can state, and that differ.
    pub facts: Vec<Changed>,
    /// The largest distance of strokes that count as the same, mm.
    pub within_mm: f64,
}

impl Diff {
    /// Compares two sides. A drawing is moved to where a plan on the other side places it. Strokes are
    /// the same within `within_mm`, or if that is not given, within the sum of what both sides may
    /// deviate from their drawing: 0.01 mm for a drawing; tolerance and whole ticks for a plan.
    pub fn of(mut old: Side, mut new: Side, within_mm: Option<f64>) -> Self {
        let usual_mm = match (old.kind, new.kind) {
            (Kind::Drawing, Kind::Drawing) => DRAWING_MM,
            _ => old.within_mm + new.within_mm,
        };
        let within_mm = within_mm.unwrap_or(usual_mm);
        match (old.kind, new.kind) {
            (Kind::Drawing, Kind::Plan) => place(&mut old, new.placement),
            (Kind::Plan, Kind::Drawing) => place(&mut new, old.placement),
            _ => {}
        }
        let has_ink = old.kind != Kind::Machine && new.kind != Kind::Machine;
        let strokes = has_ink.then(|| Matching::of(&old.strokes, &new.strokes, within_mm));
        let mut facts = facts::changed(&old.facts, &new.facts);
        if old.states_all() != new.states_all() || old.kind != new.kind {
            // The header of a plan states less than a plan document or a machine file.
            facts.retain(|changed| changed.old.is_some() && changed.new.is_some());
        } else if old.states_all() {
            facts.retain(|changed| !follows_from_others(&changed.key));
        }
        Self { old, new, strokes, facts, within_mm }
    }

    /// Whether nothing differs: strokes with their order, quantities and facts.
    pub fn is_empty(&self) -> bool {
        let same_strokes = self.strokes.as_ref().is_none_or(|strokes| {
            strokes.is_same_ink() && strokes.reordered() == 0 && strokes.reversed() == 0
        });
        same_strokes && self.facts.is_empty() && self.quantities().iter().all(|(_, old, new)| old == new)
    }

    /// Quantities that both sides state: key, old, new.
    pub fn quantities(&self) -> Vec<(&'static str, f64, f64)> {
        let value = |side: &Side, key: &str| {
            side.quantities.iter().find(|quantity| quantity.key == key).map(|quantity| quantity.value)
        };
        let row = |quantity: &Quantity| Some((quantity.key, quantity.value, value(&self.new, quantity.key)?));
        self.old.quantities.iter().filter_map(row).collect()
    }
}

/// Moves a drawing to where a plan places it.
fn place(side: &mut Side, placement: Option<Affine>) {
    let Some(map) = placement else { return };
    for point in side.strokes.iter_mut().flat_map(|line| &mut line.points) {
        *point = map * *point;
    }
    let scale = map.determinant().abs().sqrt();
    for quantity in side.quantities.iter_mut().filter(|quantity| quantity.key == "ink_mm") {
        quantity.value *= scale;
    }
}
