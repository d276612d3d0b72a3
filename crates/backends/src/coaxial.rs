//! The command file of the coaxial arm (report 1 in docs/references.md): one command a line, each a
//! bracketed list of quoted strings.
//!
//! ```text
//! ['IN;1; 0x0']
//! ['SP;1; 0x0']
//! ['PU;1;', '800x0']
//! ['PD;3;', '803x-4', '804x-4', '804x-4']
//! ```
//!
//! The first string is a mnemonic and the number of points; a point is the ticks of both motors, or in the other form
//! inches, y down from the sheet's upper edge. The semantics differ from HP-GL: `PU` moves to its point
//! with the pen as it is and lifts there; `PD` moves to its first point with the pen as it is, lowers
//! it, and traces the others but never the last. So the pen is lifted in place, travel is a `PU` of its
//! own, and a stroke's last point is written twice. Between points the motors move independently:
//! wherever both move, points are close enough that the slower one moves by a single tick.

use std::io::Write;

use drawing::Point;
use kinematics::Machine;
use plan::Row;
use plan::file::text::Text;

use crate::backend::{Backend, EncodeOptions, PenNumbers, PlanSource};
use crate::{Setpoint, Unrepresentable, WriteError};

/// The command file, by the unit of its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Commands {
    /// Motor positions.
    Ticks,
    /// Pen positions.
    Inches,
}

impl Backend for Commands {
    fn name(&self) -> &'static str {
        match self {
            Self::Ticks => "coaxial-commands",
            Self::Inches => "coaxial-commands-inches",
        }
    }

    fn format_help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Ticks => "The coaxial arm's command file, in ticks",
            Self::Inches => "The coaxial arm's command file, in inches",
        })
    }

    fn check(&self, machine: &Machine) -> Result<(), Unrepresentable> {
        if machine.mechanism().kind() == "two-link" {
            return Ok(());
        }
        let machine = machine.name().to_owned();
        Err(Unrepresentable::OtherMachine { wanted: "an arm with two links, such as coaxial", machine })
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Sent
    }

    fn needs_machine(&self) -> bool {
        true
    }

    fn write(
        &self,
        plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        out: &mut dyn Write,
    ) -> Result<(), WriteError> {
        let setpoints = plan.setpoints(self.name())?;
        match self {
            Self::Ticks => write_ticks(setpoints, out),
            Self::Inches => {
                let sheet = plan.machine(self.name())?.sheet();
                write_inches(setpoints, Point::new(sheet.x0, sheet.y1), out)
            }
        }
    }
}

/// A place to go to: a row's ticks and pen position.
#[derive(Clone, Copy)]
struct Place {
    ticks: [i64; 2],
    at: Point,
}

/// Writes the form in ticks.
///
/// # Errors
/// An error of the writer.
fn write_ticks<W: Write + ?Sized>(
    setpoints: impl IntoIterator<Item = Setpoint>,
    out: &mut W,
) -> Result<(), WriteError> {
    write_as(setpoints, out, true, |text, place| {
        text.int(place.ticks[0]).byte(b'x').int(place.ticks[1]);
    })
}

/// Writes the form in inches, for a sheet whose upper left corner is at `corner`, machine mm.
///
/// # Errors
/// An error of the writer.
fn write_inches<W: Write + ?Sized>(
    setpoints: impl IntoIterator<Item = Setpoint>,
    corner: Point,
    out: &mut W,
) -> Result<(), WriteError> {
    write_as(setpoints, out, false, |text, place| {
        let inches = [place.at.x - corner.x, corner.y - place.at.y].map(|mm| mm / 25.4);
        text.byte(b'[').str(&decimal(inches[0])).str(", ").str(&decimal(inches[1])).byte(b']');
    })
}

/// Four decimals (1/400 mm), at least one.
fn decimal(inches: f64) -> String {
    let text = format!("{inches:.4}");
    let text = text.trim_end_matches('0');
    let text = if text.ends_with('.') { format!("{text}0") } else { text.to_owned() };
    if text == "-0.0" { "0.0".to_owned() } else { text }
}

fn write_as<W: Write + ?Sized>(
    setpoints: impl IntoIterator<Item = Setpoint>,
    out: &mut W,
    whole_ticks: bool,
    mut point: impl FnMut(&mut Text<'_, W>, Place),
) -> Result<(), WriteError> {
    let mut text = Text::new(out);
    text.str("['IN;1; 0x0']\n");
    let mut command = |text: &mut Text<'_, W>, mnemonic: &str, places: &[Place]| -> Result<(), WriteError> {
        text.str("['").str(mnemonic).byte(b';').int(places.len()).str(";'");
        for place in places {
            text.str(", '");
            point(text, *place);
            text.byte(b'\'');
        }
        text.str("]\n");
        Ok(text.flush_if_full()?)
    };
    let mut before: Option<(Row, Place)> = None;
    let mut stroke: Vec<Place> = Vec::new();
    let mut selected = 0;
    for setpoint in setpoints {
        let place = Place { ticks: setpoint.row.ticks, at: setpoint.at };
        let Some((last, from)) = before else {
            command(&mut text, "PU", &[place])?;
            before = Some((setpoint.row, place));
            continue;
        };
        if last.pen != 0 {
            if stroke.is_empty() {
                if last.pen != selected {
                    selected = last.pen;
                    text.str("['SP;").int(selected).str("; 0x0']\n");
                }
                // It has travelled here with the pen up: nothing is drawn on the way to the stroke's first point.
                command(&mut text, "PU", &[from])?;
                stroke.push(from);
            }
            if whole_ticks {
                between(from, place, &mut stroke);
            } else {
                stroke.push(place);
            }
            if setpoint.row.pen != last.pen {
                stroke.dedup_by(|a, b| if whole_ticks { a.ticks == b.ticks } else { a.at == b.at });
                // The last one is never traced; a dot is a point that is never left.
                stroke.push(place);
                command(&mut text, "PD", &stroke)?;
                command(&mut text, "PU", &[place])?;
                stroke.clear();
            }
        }
        before = Some((setpoint.row, place));
    }
    if let Some((_, place)) = before {
        command(&mut text, "PU", &[place])?;
    }
    text.str("['SP;1; 0x0']\n['IN;1; 0x0']\n");
    Ok(text.finish()?)
}

/// Points on the straight way in ticks: as many as the motor with fewer steps makes, so that it makes one at a time.
fn between(from: Place, to: Place, stroke: &mut Vec<Place>) {
    let way = [0, 1].map(|motor| to.ticks[motor] - from.ticks[motor]);
    let parts = way[0].abs().min(way[1].abs()).max(1);
    for part in 1..=parts {
        let share = part as f64 / parts as f64;
        let ticks = [0, 1].map(|motor| from.ticks[motor] + (share * way[motor] as f64).round() as i64);
        stroke.push(Place { ticks, at: from.at.lerp(to.at, share) });
    }
}
