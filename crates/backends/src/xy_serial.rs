//! The serial lines of seed 2's single-belt plotter: `YYY.Y,XXX.X` goes to a point in mm, `P` lowers the pen, `p` lifts it.
//!
//! y comes first, with exactly one decimal and no sign, both below 250.0: what is out of range the firmware drops
//! without an answer. It answers `1` once it is there. Between points both motors run for themselves, so while the pen
//! is down every row of the plan is a point, as far as it differs from the one before; with the pen up only the end of a
//! travel is one. Neither time nor the number of the pen can be said.

use std::io::Write;

use crate::command::{Command, Instant};
use crate::{Unfit, WriteError};
use plan::file::text::Text;

/// The format's name.
pub const NAME: &str = "xy-serial";
/// Coordinates are below this, in tenths of a mm.
const RANGE: i64 = 2500;

/// The lines of a plan, in order.
///
/// # Errors
/// With the first row whose pen position, rounded to a tenth of a mm, is not in range.
pub fn commands(instants: impl IntoIterator<Item = Instant>) -> Result<Vec<Command>, Unfit> {
    let mut commands = vec![Command { text: "p".to_owned(), row: 0, lasts_us: 0 }];
    let mut here: Option<[i64; 2]> = None;
    let mut said_us = 0;
    let mut before: Option<(u64, Instant)> = None;
    for (index, instant) in (0..).zip(instants) {
        let pen_before = before.map_or(0, |(_, instant)| instant.row.pen);
        let mut go = |index: u64, instant: &Instant, said_us: &mut u64| -> Result<(), Unfit> {
            let to = tenths(index, instant)?;
            let lasts_us = instant.row.t_us - *said_us;
            if here != Some(to) {
                commands.push(Command { text: line(to), row: index, lasts_us });
                (here, *said_us) = (Some(to), instant.row.t_us);
            } else if let Some(last) = commands.last_mut() {
                // It is there already: only time has gone by.
                last.row = index;
            }
            Ok(())
        };
        if pen_before != 0 {
            go(index, &instant, &mut said_us)?;
        }
        if instant.row.pen != pen_before {
            go(index, &instant, &mut said_us)?;
            // From one pen to another it goes up first.
            for (text, when) in [("p", pen_before != 0), ("P", instant.row.pen != 0)] {
                if when {
                    commands.push(Command { text: text.to_owned(), row: index, lasts_us: 0 });
                    said_us = instant.row.t_us;
                }
            }
        }
        before = Some((index, instant));
    }
    if let Some((index, instant)) = before {
        let to = tenths(index, &instant)?;
        if here != Some(to) {
            let lasts_us = instant.row.t_us - said_us;
            commands.push(Command { text: line(to), row: index, lasts_us });
        }
    }
    Ok(commands)
}

/// Writes a plan.
///
/// # Errors
/// As [`commands`], before anything is written; whatever the writer says.
pub fn write<W: Write + ?Sized>(
    instants: impl IntoIterator<Item = Instant>,
    out: &mut W,
) -> Result<(), WriteError> {
    let commands = commands(instants)?;
    let mut text = Text::new(out);
    for command in commands {
        text.str(&command.text).byte(b'\n').flush_if_full()?;
    }
    Ok(text.finish()?)
}

fn tenths(row: u64, instant: &Instant) -> Result<[i64; 2], Unfit> {
    let (x, y) = (instant.at.x, instant.at.y);
    let to = [x, y].map(|mm| (mm * 10.0).round() as i64);
    if to.iter().all(|tenths| (0..RANGE).contains(tenths)) {
        return Ok(to);
    }
    Err(Unfit::Range { row, x, y, format: NAME, range: "0.0 to 249.9 mm in x and y" })
}

fn line([x, y]: [i64; 2]) -> String {
    format!("{}.{},{}.{}", y / 10, y % 10, x / 10, x % 10)
}
