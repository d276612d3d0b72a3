//! The serial lines of the single-belt plotter (report 2 in docs/references.md): `YYY.Y,XXX.X` moves to a point in mm, `P`
//! lowers the pen, `p` lifts it.
//!
//! y comes first, with exactly one decimal and no sign, both below 250.0: the firmware drops anything out of range without
//! an answer. It answers `1` on arrival. Between points the motors move independently, so while the pen is down every row
//! of the plan that differs from the one before is a point; with the pen up only the end of a travel is one. The lines
//! contain neither time nor pen numbers.

use std::io::Write;

use crate::{Line, Setpoint};
use crate::{Unrepresentable, WriteError};
use plan::file::text::Text;

/// The format's name.
pub(super) const NAME: &str = "xy-serial";
/// Coordinates are below this, in tenths of a mm.
const RANGE: i64 = 2500;

/// The lines of a plan, in order.
///
/// # Errors
/// With the first row whose pen position, rounded to a tenth of a mm, is not in range.
pub(super) fn lines(setpoints: impl IntoIterator<Item = Setpoint>) -> Result<Vec<Line>, Unrepresentable> {
    let mut lines = vec![Line { text: "p".to_owned(), row: 0, duration_us: 0, ..Line::default() }];
    let mut here: Option<[i64; 2]> = None;
    let mut sent_us = 0;
    let mut before: Option<(u64, Setpoint)> = None;
    for (index, setpoint) in (0..).zip(setpoints) {
        let pen_before = before.map_or(0, |(_, setpoint)| setpoint.row.pen);
        let mut go = |index: u64, setpoint: &Setpoint, sent_us: &mut u64| -> Result<(), Unrepresentable> {
            let to = tenths(index, setpoint)?;
            let duration_us = setpoint.row.t_us - *sent_us;
            if here != Some(to) {
                lines.push(Line { text: point(to), row: index, duration_us, ..Line::default() });
                (here, *sent_us) = (Some(to), setpoint.row.t_us);
            } else if let Some(last) = lines.last_mut() {
                // It is there already: only time has passed.
                last.row = index;
            }
            Ok(())
        };
        if pen_before != 0 {
            go(index, &setpoint, &mut sent_us)?;
        }
        if setpoint.row.pen != pen_before {
            go(index, &setpoint, &mut sent_us)?;
            // Between two pens it is lifted.
            for (text, when) in [("p", pen_before != 0), ("P", setpoint.row.pen != 0)] {
                if when {
                    lines.push(Line { text: text.to_owned(), row: index, duration_us: 0, ..Line::default() });
                    sent_us = setpoint.row.t_us;
                }
            }
        }
        before = Some((index, setpoint));
    }
    if let Some((index, setpoint)) = before {
        let to = tenths(index, &setpoint)?;
        if here != Some(to) {
            let duration_us = setpoint.row.t_us - sent_us;
            lines.push(Line { text: point(to), row: index, duration_us, ..Line::default() });
        }
    }
    Ok(lines)
}

/// Writes a plan.
///
/// # Errors
/// As [`lines`], before anything is written; an error of the writer.
pub(super) fn write<W: Write + ?Sized>(
    setpoints: impl IntoIterator<Item = Setpoint>,
    out: &mut W,
) -> Result<(), WriteError> {
    let lines = lines(setpoints)?;
    let mut text = Text::new(out);
    for line in lines {
        text.str(&line.text).byte(b'\n').flush_if_full()?;
    }
    Ok(text.finish()?)
}

fn tenths(row: u64, setpoint: &Setpoint) -> Result<[i64; 2], Unrepresentable> {
    let (x, y) = (setpoint.at.x, setpoint.at.y);
    let to = [x, y].map(|mm| (mm * 10.0).round() as i64);
    if to.iter().all(|tenths| (0..RANGE).contains(tenths)) {
        return Ok(to);
    }
    Err(Unrepresentable::Range { row, x, y, format: NAME, range: "0.0 to 249.9 mm in x and y" })
}

fn point([x, y]: [i64; 2]) -> String {
    format!("{}.{},{}.{}", y / 10, y % 10, x / 10, x % 10)
}
