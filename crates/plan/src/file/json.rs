//! Plan documents: one JSON object with the plan and all that it was made from.
//!
//! ```text
//! {
//!   "format": "plotplan-plan",
//!   "version": 1,
//!   "source": {"name": ..., "sha256": ...},
//!   "plan": {"machine": ..., "motors": [{"name": ..., "limits": {"speed": ..., "acceleration": ..., "jerk": ...}}, ...],
//!            "placement": [a, b, c, d, e, f], "period_us": ..., "rows": ..., "duration_us": ...},
//!   "machine": ..., "settings": ..., "summary": ..., "certificate": ...,
//!   "rows": {"t_us": [...], "pen": [...], "ticks": {"arm1": [...], "arm2": [...]}}
//! }
//! ```
//!
//! `machine`, `settings`, `summary` and `certificate` are opaque to this module.
//! Unknown keys elsewhere are ignored.

use std::collections::BTreeMap;
use std::io::Write;

use crate::{Header, Limits, MOTORS, Motor, Rounding, Row, TickTable};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::header::{RowCheck, color, hex};
use super::text::Text;
use super::{ReadError, WriteError, check_header};

/// Value of the key `format`.
pub(crate) const FORMAT: &str = "plotplan-plan";
const VERSION: u64 = 1;
/// Numbers on one line of a column.
const NUMBERS_A_LINE: u64 = 20;

/// The source of a plan.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// Name of the drawing's file, as given.
    pub name: String,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
}

/// A plan document without its plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Document {
    /// The drawing that the plan was made from.
    pub source: Source,
    /// The resolved machine.
    pub machine: Value,
    /// The settings the plan was made with.
    pub settings: Value,
    /// Durations, lengths and the like.
    pub summary: Value,
    /// The certificate.
    pub certificate: Value,
}

/// Writes a plan document. `rows` is asked for the same rows once a column, so that no column has to be kept.
///
/// # Errors
/// A header that [`check_header`] refuses, before anything is written; rows that are not those that `header`
/// promises; whatever the writer says.
pub fn write<W, I>(
    document: &Document,
    header: &Header,
    mut rows: impl FnMut() -> I,
    out: &mut W,
) -> Result<(), WriteError>
where
    W: Write + ?Sized,
    I: IntoIterator<Item = Row>,
{
    check_header(header)?;
    let mut text = Text::new(out);
    text.str("{\n  \"format\": \"").str(FORMAT).str("\",\n  \"version\": ").int(VERSION).str(",\n");
    member(&mut text, "source", &document.source)?;
    write_header(&mut text, header);
    member(&mut text, "machine", &document.machine)?;
    member(&mut text, "settings", &document.settings)?;
    member(&mut text, "summary", &document.summary)?;
    member(&mut text, "certificate", &document.certificate)?;

    text.str("  \"rows\": {\n    \"t_us\": ");
    column(&mut text, header, rows(), |text, row| {
        text.int(row.t_us);
    })?;
    text.str(",\n    \"pen\": ");
    column(&mut text, header, rows(), |text, row| {
        text.int(row.pen);
    })?;
    text.str(",\n    \"ticks\": {");
    for (motor, Motor { name, .. }) in header.motors.iter().enumerate() {
        text.str(if motor == 0 { "\n      \"" } else { ",\n      \"" }).str(name).str("\": ");
        column(&mut text, header, rows(), |text, row| {
            text.int(row.ticks[motor]);
        })?;
    }
    text.str("\n    }\n  }\n}\n");
    Ok(text.finish()?)
}

/// A member of the outermost object, laid out over lines.
fn member<W: Write + ?Sized>(
    text: &mut Text<'_, W>,
    key: &str,
    value: &impl Serialize,
) -> Result<(), WriteError> {
    let pretty = serde_json::to_vec_pretty(value).map_err(std::io::Error::from)?;
    text.str("  \"").str(key).str("\": ");
    for byte in pretty {
        text.byte(byte);
        // A line end never stands inside a string of JSON.
        if byte == b'\n' {
            text.str("  ");
        }
    }
    text.str(",\n");
    Ok(())
}

/// Written by hand for the shortest numbers; names need no escapes, as [`check_header`] knows.
fn write_header<W: Write + ?Sized>(text: &mut Text<'_, W>, header: &Header) {
    text.str("  \"plan\": {\n    \"machine\": \"").str(&header.machine).str("\",\n    \"motors\": [");
    for (motor, Motor { name, limits }) in header.motors.iter().enumerate() {
        text.str(if motor == 0 { "\n" } else { ",\n" }).str("      {\"name\": \"").str(name);
        text.str("\", \"limits\": {\"speed\": ").float(limits.speed);
        text.str(", \"acceleration\": ").float(limits.acceleration);
        if let Some(jerk) = limits.jerk {
            text.str(", \"jerk\": ").float(jerk);
        }
        text.str("}}");
    }
    text.str("\n    ],\n    \"placement\": [");
    for (index, &coefficient) in header.placement.iter().enumerate() {
        text.str(if index == 0 { "" } else { ", " }).float(coefficient);
    }
    text.str("],\n    \"period_us\": ").int(header.period_us);
    if header.lift_overlap_us > 0 {
        text.str(",\n    \"lift_overlap_us\": ").int(header.lift_overlap_us);
    }
    if header.rounding != Rounding::Nearest {
        text.str(",\n    \"rounding\": \"").str(header.rounding.name()).byte(b'"');
    }
    for (index, (pen, color)) in header.pen_colors.iter().enumerate() {
        text.str(if index == 0 { ",\n    \"pen_colors\": {\"" } else { ", \"" }).int(*pen);
        text.str("\": \"").str(&hex(*color)).byte(b'"');
    }
    if !header.pen_colors.is_empty() {
        text.byte(b'}');
    }
    text.str(",\n    \"rows\": ").int(header.rows);
    text.str(",\n    \"duration_us\": ").int(header.duration_us).str("\n  },\n");
}

fn column<W: Write + ?Sized>(
    text: &mut Text<'_, W>,
    header: &Header,
    rows: impl IntoIterator<Item = Row>,
    mut entry: impl FnMut(&mut Text<'_, W>, &Row),
) -> Result<(), WriteError> {
    let mut check = RowCheck::default();
    text.byte(b'[');
    for row in rows {
        check.accept_under(header, &row)?;
        let index = check.count() - 1;
        if index > 0 {
            text.str(if index % NUMBERS_A_LINE == 0 { ",\n" } else { "," });
        }
        entry(text, &row);
        text.flush_if_full()?;
    }
    check.finish(header.rows, header.duration_us)?;
    text.byte(b']');
    Ok(())
}

#[derive(Deserialize)]
struct Head {
    format: String,
    version: u64,
}

#[derive(Deserialize)]
struct Wire {
    source: Source,
    plan: WirePlan,
    machine: Value,
    settings: Value,
    summary: Value,
    certificate: Value,
    rows: WireRows,
}

#[derive(Deserialize)]
struct WirePlan {
    machine: String,
    motors: [WireMotor; MOTORS],
    placement: [f64; 6],
    period_us: u64,
    #[serde(default)]
    lift_overlap_us: u64,
    #[serde(default)]
    rounding: WireRounding,
    #[serde(default)]
    pen_colors: BTreeMap<u16, String>,
    rows: u64,
    duration_us: u64,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum WireRounding {
    #[default]
    Nearest,
    Path,
}

#[derive(Deserialize)]
struct WireMotor {
    name: String,
    limits: WireLimits,
}

#[derive(Deserialize)]
struct WireLimits {
    speed: f64,
    acceleration: f64,
    jerk: Option<f64>,
}

#[derive(Deserialize)]
struct WireRows {
    t_us: Vec<u64>,
    pen: Vec<u16>,
    ticks: BTreeMap<String, Vec<i64>>,
}

/// Reads a plan document.
///
/// # Errors
/// Anything but a whole document of version 1, with the line where JSON itself is at fault.
pub fn read(bytes: &[u8]) -> Result<(Document, TickTable), ReadError> {
    // The version first: a document of another one need not have the members of this one.
    let head: Head = serde_json::from_slice(bytes)?;
    if head.format != FORMAT {
        return Err(ReadError::NotAPlan);
    }
    if head.version != VERSION {
        return Err(ReadError::Version { line: 1, found: head.version.to_string() });
    }
    let wire: Wire = serde_json::from_slice(bytes)?;
    let Wire { source, plan, machine, settings, summary, certificate, rows } = wire;
    let header = Header {
        machine: plan.machine,
        motors: plan.motors.map(|WireMotor { name, limits: WireLimits { speed, acceleration, jerk } }| {
            Motor { name, limits: Limits { speed, acceleration, jerk } }
        }),
        placement: plan.placement,
        period_us: plan.period_us,
        lift_overlap_us: plan.lift_overlap_us,
        rounding: match plan.rounding {
            WireRounding::Nearest => Rounding::Nearest,
            WireRounding::Path => Rounding::Path,
        },
        pen_colors: plan.pen_colors.iter().filter_map(|(pen, text)| Some((*pen, color(text)?))).collect(),
        rows: plan.rows,
        duration_us: plan.duration_us,
    };
    check_header(&header)?;
    let rows = assemble_rows(&header, &rows)?;
    Ok((Document { source, machine, settings, summary, certificate }, TickTable { header, rows }))
}

fn assemble_rows(header: &Header, wire: &WireRows) -> Result<Vec<Row>, ReadError> {
    let ticks_of = |Motor { name, .. }: &Motor| -> Result<&[i64], ReadError> {
        let column =
            wire.ticks.get(name).ok_or_else(|| ReadError::Columns(format!("there is no column `{name}`")))?;
        if column.len() == wire.t_us.len() {
            return Ok(column);
        }
        let why = format!("`{name}` has {} numbers, but `t_us` has {}", column.len(), wire.t_us.len());
        Err(ReadError::Columns(why))
    };
    let [first, second] = [ticks_of(&header.motors[0])?, ticks_of(&header.motors[1])?];
    if wire.pen.len() != wire.t_us.len() {
        let why = format!("`pen` has {} numbers, but `t_us` has {}", wire.pen.len(), wire.t_us.len());
        return Err(ReadError::Columns(why));
    }
    let mut check = RowCheck::default();
    let mut rows = Vec::with_capacity(wire.t_us.len());
    for (((&t_us, &pen), &first), &second) in wire.t_us.iter().zip(&wire.pen).zip(first).zip(second) {
        check.accept(t_us).map_err(|error| ReadError::Columns(error.to_string()))?;
        rows.push(Row { t_us, pen, ticks: [first, second] });
    }
    check.finish(header.rows, header.duration_us).map_err(|error| ReadError::Columns(error.to_string()))?;
    Ok(rows)
}
