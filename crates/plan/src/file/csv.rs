//! CSV plans: `# key: value` comments, a header row, and one row an instant.
//!
//! ```text
//! # plotplan: 1
//! # machine: coaxial
//! # placement: 1 0 0 1 12.7 76.2
//! # limits arm1: 533.3 2666.7
//! # limits arm2: 533.3 2666.7
//! # period_us: 10000
//! # rows: 2
//! # duration_us: 10000
//! t_us,pen,arm1,arm2
//! 0,0,800,0
//! 10000,0,801,-1
//! ```
//!
//! `placement` is [`Header::placement`]; `limits` are speed, acceleration and, where given, jerk, in ticks and
//! seconds; `pen 2 color: #cc0000` is the colour that the drawing gives pen 2. A reader needs `plotplan`, `machine`, `placement` and the limits of both motors; the last three comments
//! may be missing from a plan that another program wrote, and comments with other keys mean nothing here. Columns
//! are in this order. Every line has its end, or the file was cut off.

use std::io::Write;

use crate::{Header, Limits, MOTORS, Motor, Rounding, Row, TickTable};

use super::header::{Notes, RowCheck, assemble, hex};
use super::text::{Line, Text, lines, parse_signed, parse_unsigned, shown};
use super::{ReadError, RowsError, WriteError, check_header};

/// Writes a plan. The rows must agree with `header`.
///
/// # Errors
/// A header that [`check_header`] refuses, before anything is written; rows that disagree with the
/// header; errors of the writer.
pub fn write<W: Write + ?Sized>(
    header: &Header,
    rows: impl IntoIterator<Item = Row>,
    out: &mut W,
) -> Result<(), WriteError> {
    check_header(header)?;
    let mut text = Text::new(out);
    text.str("# plotplan: 1\n# machine: ").str(&header.machine).str("\n# placement:");
    for coefficient in header.placement {
        text.byte(b' ').float(coefficient);
    }
    for Motor { name, limits } in &header.motors {
        text.str("\n# limits ").str(name).str(": ").float(limits.speed).byte(b' ').float(limits.acceleration);
        if let Some(jerk) = limits.jerk {
            text.byte(b' ').float(jerk);
        }
    }
    text.str("\n# period_us: ").int(header.period_us);
    if header.lift_overlap_us > 0 {
        text.str("\n# lift_overlap_us: ").int(header.lift_overlap_us);
    }
    if header.rounding != Rounding::Nearest {
        text.str("\n# rounding: ").str(header.rounding.name());
    }
    for (pen, color) in &header.pen_colors {
        text.str("\n# pen ").int(*pen).str(" color: ").str(&hex(*color));
    }
    text.str("\n# rows: ").int(header.rows);
    text.str("\n# duration_us: ").int(header.duration_us).str("\nt_us,pen");
    for Motor { name, .. } in &header.motors {
        text.byte(b',').str(name);
    }
    text.byte(b'\n');

    let mut check = RowCheck::default();
    for row in rows {
        check.accept_under(header, &row)?;
        text.int(row.t_us).byte(b',').int(row.pen);
        for ticks in row.ticks {
            text.byte(b',').int(ticks);
        }
        text.byte(b'\n').flush_if_full()?;
    }
    check.finish(header.rows, header.duration_us)?;
    Ok(text.finish()?)
}

/// Reads a plan.
///
/// # Errors
/// Anything but a complete plan, with the line number.
pub fn read(bytes: &[u8]) -> Result<TickTable, ReadError> {
    let mut lines = lines(bytes);
    let mut notes = Notes::default();
    let (names, head) = loop {
        let Some(line) = lines.next() else {
            return Err(ReadError::CutOff {
                line: bytes.split(|&byte| byte == b'\n').count() as u64,
                why: "there is no row of column names".to_owned(),
            });
        };
        match line.text.strip_prefix(b"#") {
            Some(comment) => notes.add(line.number, comment),
            None if line.text.is_empty() => {}
            None => break (column_names(line)?, line),
        }
    };
    notes.version(head)?;
    let (_, machine) = notes.text("machine", head)?;
    let placement = notes.array("placement", head)?;
    let motor = |name: &str| -> Result<Motor, ReadError> {
        let limits = notes.numbers(&format!("limits {name}"), 2, 3, head)?;
        let limits = Limits { speed: limits[0], acceleration: limits[1], jerk: limits.get(2).copied() };
        Ok(Motor { name: name.to_owned(), limits })
    };
    let motors = [motor(names[0])?, motor(names[1])?];
    let stated_rows = notes.count("rows")?;
    let stated_us = notes.count("duration_us")?;

    let mut rows = Vec::new();
    let mut check = RowCheck::default();
    let mut last = head;
    for line in lines.filter(|line| !line.text.is_empty()) {
        last = line;
        if !line.ended {
            break;
        }
        let row = parse_row(line)?;
        check.accept(row.t_us).map_err(|error| match error {
            RowsError::Start { .. } => unexpected(line, "0 as the first time"),
            _ => unexpected(line, &format!("a time after {} us", check.last_us())),
        })?;
        rows.push(row);
    }
    if !last.ended {
        return Err(ReadError::CutOff { line: last.number, why: "the last line has no end".to_owned() });
    }
    check
        .finish(stated_rows.unwrap_or(check.count()), stated_us.unwrap_or(check.last_us()))
        .map_err(|error| ReadError::CutOff { line: last.number, why: error.to_string() })?;
    let header = assemble(
        machine,
        motors,
        placement,
        [notes.count("period_us")?, notes.count("lift_overlap_us")?],
        notes.rounding()?,
        notes.pen_colors(),
        &rows,
    )?;
    Ok(TickTable { header, rows })
}

fn unexpected(line: Line, expected: &str) -> ReadError {
    ReadError::Unexpected { line: line.number, expected: expected.to_owned(), found: shown(line.text) }
}

/// The names of the motors' columns.
fn column_names(line: Line<'_>) -> Result<[&str; MOTORS], ReadError> {
    let fields = || -> Option<[&str; MOTORS]> {
        let mut fields = std::str::from_utf8(line.text).ok()?.split(',').map(str::trim);
        if fields.next()? != "t_us" || fields.next()? != "pen" {
            return None;
        }
        let names = [fields.next()?, fields.next()?];
        fields.next().is_none().then_some(names)
    };
    fields().ok_or_else(|| unexpected(line, "the column names `t_us,pen,` and two motors' names"))
}

fn parse_row(line: Line<'_>) -> Result<Row, ReadError> {
    let mut fields = line.text.split(|&byte| byte == b',').map(<[u8]>::trim_ascii);
    let mut field = || fields.next().unwrap_or_default();
    let row = || -> Option<Row> {
        Some(Row {
            t_us: parse_unsigned(field())?,
            pen: parse_unsigned(field())?.try_into().ok()?,
            ticks: [parse_signed(field())?, parse_signed(field())?],
        })
    }();
    row.filter(|_| fields.next().is_none())
        .ok_or_else(|| unexpected(line, "a row of four whole numbers: time, pen and two motors' ticks"))
}
