//! The machine file with the found values: comments, order and everything else stay.

use calibration::{Parameter, Setup};
use kinematics::{JointKind, Machine};
use toml_edit::{Array, DocumentMut, Item, Table, TableLike, Value};

/// The machine file of a calibrated machine. The start pose is the one at the same ticks as before, or the
/// nearest one that the joint limits allow.
///
/// # Errors
/// When the text is not TOML, or not a machine file.
pub fn calibrated(toml: &str, machine: &Machine, before: &Setup, after: &Setup) -> Result<String, String> {
    let mut document: DocumentMut = toml.parse().map_err(|error: toml_edit::TomlError| error.to_string())?;
    let geometry = table(&mut document, "geometry")?;
    for (key, value) in &after.geometry {
        if before.geometry.get(key) == Some(value) {
            continue;
        }
        match value {
            Parameter::Length(mm) => set(geometry, key, millimetres(*mm)),
            Parameter::Choice(word) => set(geometry, key, word.as_str().into()),
            Parameter::Point(point) => {
                let both: Array = [millimetres(point.x), millimetres(point.y)].into_iter().collect();
                set(geometry, key, both.into());
            }
        }
    }
    if before.coupling != after.coupling {
        let rows = after
            .coupling
            .map(|row| Value::from(row.map(|entry| number(entry, 9)).into_iter().collect::<Array>()));
        set(table(&mut document, "coupling")?, "matrix", rows.into_iter().collect::<Array>().into());
    }
    motors(&mut document, machine, before, after)?;
    let sheet = table(&mut document, "sheet")?;
    for (key, from, to) in [("x", before.corner.x, after.corner.x), ("y", before.corner.y, after.corner.y)] {
        if from != to {
            set(sheet, key, millimetres(to));
        }
    }
    let size = [("width", machine.sheet().width()), ("height", machine.sheet().height())];
    for ((key, from), to) in size.into_iter().zip(after.sheet_mm) {
        if (from - to).abs() > 1e-6 {
            set(sheet, key, millimetres(to));
        }
    }
    start(&mut document, machine, after)?;
    if let Some(homing) = document.get_mut("homing").and_then(Item::as_table_like_mut) {
        set(homing, "calibrated", true.into());
    }
    Ok(document.to_string())
}

fn table<'a>(document: &'a mut DocumentMut, key: &str) -> Result<&'a mut dyn TableLike, String> {
    let item = document.entry(key).or_insert_with(|| Item::Table(Table::new()));
    item.as_table_like_mut().ok_or_else(|| format!("{key} is not a table"))
}

/// Sets a key; what stands around the old value, comments included, stays.
fn set(table: &mut dyn TableLike, key: &str, mut new: Value) {
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) => {
            *new.decor_mut() = old.decor().clone();
            *old = new;
        }
        None => {
            table.insert(key, Item::Value(new));
        }
    }
}

fn decimals(value: f64, digits: i32) -> f64 {
    let scale = libm::pow(10.0, f64::from(digits));
    (value * scale).round() / scale
}

/// Whole numbers without a point.
fn number(value: f64, digits: i32) -> Value {
    let rounded = decimals(value, digits);
    if rounded.fract() == 0.0 && rounded.abs() < 1e15 {
        Value::from(rounded as i64)
    } else {
        Value::from(rounded)
    }
}

fn millimetres(mm: f64) -> Value {
    format!("{}mm", decimals(mm, 4)).into()
}

fn motors(
    document: &mut DocumentMut,
    machine: &Machine,
    before: &Setup,
    after: &Setup,
) -> Result<(), String> {
    let motors = document.get_mut("motor").ok_or("the file has no motors")?;
    for motor in 0..2 {
        let table: Option<&mut dyn TableLike> = match motors {
            Item::ArrayOfTables(tables) => tables.get_mut(motor).map(|table| table as &mut dyn TableLike),
            Item::Value(Value::Array(array)) => {
                let inline = array.get_mut(motor).and_then(Value::as_inline_table_mut);
                inline.map(|table| table as &mut dyn TableLike)
            }
            _ => None,
        };
        let table = table.ok_or("a machine has two motors")?;
        if before.offset_ticks[motor] != after.offset_ticks[motor] {
            set(table, "offset", number(after.offset_ticks[motor], 3));
        }
        if before.backlash_ticks[motor] != after.backlash_ticks[motor] {
            // Errors of pointing may make a small one negative.
            set(table, "backlash", number(after.backlash_ticks[motor].max(0.0), 2));
        }
        if before.ticks_per_unit[motor] != after.ticks_per_unit[motor] {
            let first = usize::from(after.coupling[motor][0] == 0.0);
            let counts = match machine.mechanism().joint_kinds()[first] {
                JointKind::Prismatic => format!("{}/mm", decimals(after.ticks_per_unit[motor], 6)),
                JointKind::Revolute => {
                    format!("{}/rev", decimals(after.ticks_per_unit[motor] * std::f64::consts::TAU, 6))
                }
            };
            set(table, "counts", counts.into());
        }
    }
    Ok(())
}

fn start(document: &mut DocumentMut, machine: &Machine, after: &Setup) -> Result<(), String> {
    let ticks = machine.motor_positions(&machine.start()).0;
    let mechanism = after.mechanism().map_err(|error| error.to_string())?;
    let joints = after.joints(ticks).map_err(|error| error.to_string())?;
    let table = table(document, "start")?;
    let names = mechanism.joint_names();
    if table.contains_key("x") && names != ["x", "y"] {
        let pen = mechanism.forward(&joints.into());
        set(table, "x", millimetres(pen.x));
        set(table, "y", millimetres(pen.y));
        return Ok(());
    }
    for (k, name) in names.into_iter().enumerate() {
        let range = machine.parts().joints[k];
        let value = joints[k].clamp(range.min, range.max);
        let text = match mechanism.joint_kinds()[k] {
            JointKind::Prismatic => millimetres(value),
            JointKind::Revolute => format!("{}deg", decimals(value.to_degrees(), 5)).into(),
        };
        set(table, name, text);
    }
    Ok(())
}
