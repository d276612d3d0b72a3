//! Tick lines, the default format, for any serial sender and for simple firmware.
//!
//! `docs/tick-lines.md` is the specification. In short, a machine knows four commands, each a line of ASCII with
//! absolute whole numbers in it:
//!
//! ```text
//! begin 1 MOVES DURATION      version 1; number of `m` lines; duration, us
//! s ROW TIME T1 T2            sync: position at this row and time, at rest, pen up
//! m PEN DURATION T1 T2        set the pen, then move both motors linearly to T1 and T2 in DURATION us
//! end PEN MOVES DURATION      set the pen; end of the plan, with its totals
//! ```
//!
//! A plan's rows are instants and an `m` line is the way from one row to the next, so its pen is that of the row
//! before. The first row is in the first `s` line, the last row's pen in the `end` line: nothing is lost. Everything
//! else that a [`Header`] holds is in comments before `begin`, for programs; a firmware skips them.

use std::io::Write;

use crate::{Header, Limits, MOTORS, Motor, Rounding, Row, TickTable};

use super::header::{Notes, RowCheck, assemble, hex};
use super::text::{Line, Text, lines, parse_signed, parse_unsigned, shown};
use super::{ReadError, WriteError, check_header};

/// No line is longer than this, its end not counted: grbl's own line buffer takes 79.
pub const LINE_BYTES: usize = 70;

/// Between two progress marks passes at least this much plan time.
const MARK_EVERY_US: u64 = 1_000_000;

/// Writes a plan. The rows must agree with `header`.
///
/// # Errors
/// A header that [`check_header`] refuses, before anything is written; rows that disagree with the
/// header; errors of the writer; a line longer than [`LINE_BYTES`], which needs ticks of 19 digits late in a plan of a million years.
pub fn write<W: Write + ?Sized>(
    header: &Header,
    rows: impl IntoIterator<Item = Row>,
    out: &mut W,
) -> Result<(), WriteError> {
    check_header(header)?;
    let mut text = Text::new(out);
    write_header(&mut text, header);
    let mut check = RowCheck::default();
    let mut before: Option<Row> = None;
    let mut next_mark_us = MARK_EVERY_US;
    for row in rows {
        check.accept_under(header, &row)?;
        if let Some(before) = before {
            text.str("m ").int(before.pen).byte(b' ').int(row.t_us - before.t_us);
            write_ticks(&mut text, row);
        }
        if before.is_none_or(|before| before.pen != 0 && row.pen == 0) {
            write_sync(&mut text, check.count() - 1, row)?;
        }
        if row.t_us >= next_mark_us {
            write_mark(&mut text, row.t_us, header.duration_us);
            next_mark_us = row.t_us.saturating_add(MARK_EVERY_US);
        }
        text.flush_if_full()?;
        before = Some(row);
    }
    check.finish(header.rows, header.duration_us)?;
    text.str("end ").int(before.map_or(0, |row| row.pen)).byte(b' ').int(header.rows - 1);
    text.byte(b' ').int(header.duration_us).byte(b'\n');
    Ok(text.finish()?)
}

fn write_header<W: Write + ?Sized>(text: &mut Text<'_, W>, header: &Header) {
    text.str("; plotplan: 1\n; machine: ").str(&header.machine).str("\n; motors:");
    for motor in &header.motors {
        text.byte(b' ').str(&motor.name);
    }
    text.byte(b'\n');
    for Motor { name, limits } in &header.motors {
        let Limits { speed, acceleration, jerk } = *limits;
        for (what, limit) in [("speed", Some(speed)), ("acceleration", Some(acceleration)), ("jerk", jerk)] {
            if let Some(limit) = limit {
                text.str("; limits ").str(name).byte(b' ').str(what).str(": ").float(limit).byte(b'\n');
            }
        }
    }
    for (names, pair) in ["a b", "c d", "e f"].into_iter().zip(header.placement.chunks_exact(2)) {
        text.str("; placement ").str(names).str(": ").float(pair[0]).byte(b' ').float(pair[1]).byte(b'\n');
    }
    text.str("; period_us: ").int(header.period_us);
    if header.lift_overlap_us > 0 {
        text.str("\n; lift_overlap_us: ").int(header.lift_overlap_us);
    }
    if header.rounding != Rounding::Nearest {
        text.str("\n; rounding: ").str(header.rounding.name());
    }
    for (pen, color) in &header.pen_colors {
        text.str("\n; pen ").int(*pen).str(" color: ").str(&hex(*color));
    }
    text.str("\nbegin 1 ").int(header.rows.saturating_sub(1)).byte(b' ').int(header.duration_us).byte(b'\n');
}

fn write_ticks<W: Write + ?Sized>(text: &mut Text<'_, W>, row: Row) {
    for ticks in row.ticks {
        text.byte(b' ').int(ticks);
    }
    text.byte(b'\n');
}

fn write_sync<W: Write + ?Sized>(text: &mut Text<'_, W>, index: u64, row: Row) -> Result<(), WriteError> {
    let start = text.mark();
    text.str("s ").int(index).byte(b' ').int(row.t_us);
    write_ticks(text, row);
    // The only line that can be too long: an `m` line has 70 bytes with every number at its widest.
    let bytes = text.mark() - start - 1;
    if bytes > LINE_BYTES { Err(WriteError::LineTooLong { row: index, bytes }) } else { Ok(()) }
}

/// Progress of the plan for people who watch a sender: `; @ 12.3s 3.2%`, rounded down.
fn write_mark<W: Write + ?Sized>(text: &mut Text<'_, W>, t_us: u64, duration_us: u64) {
    let tenths = t_us / 100_000;
    let permille = (u128::from(t_us) * 1000 / u128::from(duration_us.max(1))) as u64;
    text.str("; @ ").int(tenths / 10).byte(b'.').int(tenths % 10).str("s ");
    text.int(permille / 10).byte(b'.').int(permille % 10).str("%\n");
}

/// Reads a plan.
///
/// # Errors
/// Anything but a complete plan whose sync lines agree with the rows, with the line number.
pub fn read(bytes: &[u8]) -> Result<TickTable, ReadError> {
    let mut notes = Notes::default();
    let mut begun: Option<(Line, [u64; 2])> = None;
    // A row's pen is in the line after the one that leads to it; it stands at 0 until then.
    let mut rows: Vec<Row> = Vec::new();
    let mut synced = false;
    let mut ended = false;
    let mut last_line = 1;
    for line in lines(bytes) {
        last_line = line.number;
        let end = line.text.iter().position(|&byte| byte == b';').unwrap_or(line.text.len());
        let (command, comment) = line.text.split_at(end);
        if begun.is_none() && command.is_empty() && !comment.is_empty() {
            notes.add(line.number, &comment[1..]);
        }
        let mut words = command.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let Some(verb) = words.next() else { continue };
        if !line.ended {
            break;
        }
        if ended {
            return Err(unexpected(line, "nothing after the `end` line"));
        }
        let mut words = Words { line, words };
        let Some((_, stated)) = begun else {
            if verb != b"begin" {
                return Err(unexpected(line, "`begin 1 MOVES DURATION`"));
            }
            begun = Some((line, words.begin()?));
            continue;
        };
        match (verb, rows.last().copied()) {
            (b"s", None) => {
                rows.push(words.start()?);
                synced = true;
            }
            (_, None) => return Err(unexpected(line, "the sync line of the start, `s 0 0 T1 T2`")),
            (b"s", Some(_)) if synced => return Err(gap(line, "this is the second sync line in a row")),
            (b"s", Some(before)) => {
                let (index, row) = words.sync()?;
                check_counts(
                    line,
                    "this sync line",
                    [index, row.t_us],
                    [rows.len() as u64 - 1, before.t_us],
                )?;
                if row.ticks != before.ticks {
                    let [[a, b], [c, d]] = [row.ticks, before.ticks];
                    let why = format!("this sync line is at {a} {b}, but the line before it goes to {c} {d}");
                    return Err(gap(line, &why));
                }
                synced = true;
            }
            (b"m", Some(before)) => {
                let (pen, duration_us, ticks) = words.step()?;
                set_pen(&mut rows, pen, synced, line)?;
                let t_us = before.t_us.checked_add(duration_us).filter(|_| duration_us > 0);
                let t_us = t_us.ok_or_else(|| unexpected(line, "a duration above 0 and within 64 bits"))?;
                rows.push(Row { t_us, pen: 0, ticks });
                synced = false;
            }
            (b"end", Some(before)) => {
                let (pen, counts) = words.end()?;
                set_pen(&mut rows, pen, synced, line)?;
                let found = [rows.len() as u64 - 1, before.t_us];
                check_counts(line, "this `end` line", counts, found)?;
                check_counts(line, "the `begin` line", stated, found)?;
                ended = true;
            }
            _ => return Err(unexpected(line, "a line that begins with `m`, `s` or `end`")),
        }
    }
    let Some((begin, _)) = begun.filter(|_| ended) else {
        return Err(ReadError::CutOff { line: last_line, why: "there is no whole `end` line".to_owned() });
    };
    let header = read_header(&notes, begin, &rows)?;
    Ok(TickTable { header, rows })
}

fn read_header(notes: &Notes<'_>, begin: Line, rows: &[Row]) -> Result<Header, ReadError> {
    notes.version(begin)?;
    let (_, machine) = notes.text("machine", begin)?;
    let (line, motors) = notes.text("motors", begin)?;
    let names: Vec<&str> = motors.split_ascii_whitespace().collect();
    let names: [&str; MOTORS] = names.try_into().map_err(|_| ReadError::Unexpected {
        line,
        expected: "two motors' names".to_owned(),
        found: shown(motors.as_bytes()),
    })?;
    let motor = |name: &str| -> Result<Motor, ReadError> {
        let limits = Limits {
            speed: notes.number(&format!("limits {name} speed"), begin)?,
            acceleration: notes.number(&format!("limits {name} acceleration"), begin)?,
            jerk: notes.number_if_given(&format!("limits {name} jerk"), begin)?,
        };
        Ok(Motor { name: name.to_owned(), limits })
    };
    let motors = [motor(names[0])?, motor(names[1])?];
    let [[a, b], [c, d], [e, f]] = [
        notes.array("placement a b", begin)?,
        notes.array("placement c d", begin)?,
        notes.array("placement e f", begin)?,
    ];
    Ok(assemble(
        machine,
        motors,
        [a, b, c, d, e, f],
        [notes.count("period_us")?, notes.count("lift_overlap_us")?],
        notes.rounding()?,
        notes.pen_colors(),
        rows,
    )?)
}

/// Gives the last row its pen, which the line after it says. Where the pen goes up, and at the start, there has to
/// be a sync line between the two; nowhere else.
fn set_pen(rows: &mut [Row], pen: u16, synced: bool, line: Line) -> Result<(), ReadError> {
    let goes_up = if let [.., before, _] = rows { before.pen != 0 && pen == 0 } else { true };
    match (goes_up, synced) {
        (true, false) => return Err(gap(line, "the pen goes up without a sync line")),
        (false, true) => return Err(gap(line, "there is a sync line where the pen does not go up")),
        _ => {}
    }
    if let Some(row) = rows.last_mut() {
        row.pen = pen;
    }
    Ok(())
}

fn check_counts(line: Line, who: &str, stated: [u64; 2], found: [u64; 2]) -> Result<(), ReadError> {
    if stated == found {
        return Ok(());
    }
    let [[moves, us], [found_moves, found_us]] = [stated, found];
    Err(gap(
        line,
        &format!("{who} counts {moves} moves in {us} us, but there are {found_moves} in {found_us} us"),
    ))
}

fn gap(line: Line, why: &str) -> ReadError {
    ReadError::Gap { line: line.number, why: why.to_owned() }
}

fn unexpected(line: Line, expected: &str) -> ReadError {
    ReadError::Unexpected { line: line.number, expected: expected.to_owned(), found: shown(line.text) }
}

/// The words of a command after its first.
struct Words<'a, I: Iterator<Item = &'a [u8]>> {
    line: Line<'a>,
    words: I,
}

impl<'a, I: Iterator<Item = &'a [u8]>> Words<'a, I> {
    fn unsigned(&mut self) -> Option<u64> {
        parse_unsigned(self.words.next()?)
    }

    fn pen(&mut self) -> Option<u16> {
        self.unsigned()?.try_into().ok()
    }

    fn ticks(&mut self) -> Option<[i64; MOTORS]> {
        Some([parse_signed(self.words.next()?)?, parse_signed(self.words.next()?)?])
    }

    fn whole<T>(&mut self, parsed: Option<T>, expected: &str) -> Result<T, ReadError> {
        parsed.filter(|_| self.words.next().is_none()).ok_or_else(|| unexpected(self.line, expected))
    }

    fn begin(&mut self) -> Result<[u64; 2], ReadError> {
        let version = self.unsigned();
        if let Some(version) = version
            && version != 1
        {
            return Err(ReadError::Version { line: self.line.number, found: version.to_string() });
        }
        let parsed = version.and_then(|_| Some([self.unsigned()?, self.unsigned()?]));
        self.whole(parsed, "`begin 1 MOVES DURATION`")
    }

    fn start(&mut self) -> Result<Row, ReadError> {
        const EXPECTED: &str = "the sync line of the start, `s 0 0 T1 T2`";
        let (index, row) = self.sync()?;
        if (index, row.t_us) == (0, 0) { Ok(row) } else { Err(unexpected(self.line, EXPECTED)) }
    }

    fn sync(&mut self) -> Result<(u64, Row), ReadError> {
        let mut parse =
            || Some((self.unsigned()?, Row { t_us: self.unsigned()?, pen: 0, ticks: self.ticks()? }));
        let parsed = parse();
        self.whole(parsed, "`s ROW TIME T1 T2` in whole numbers")
    }

    fn step(&mut self) -> Result<(u16, u64, [i64; MOTORS]), ReadError> {
        let mut parse = || Some((self.pen()?, self.unsigned()?, self.ticks()?));
        let parsed = parse();
        self.whole(parsed, "`m PEN DURATION T1 T2` in whole numbers")
    }

    fn end(&mut self) -> Result<(u16, [u64; 2]), ReadError> {
        let mut parse = || Some((self.pen()?, [self.unsigned()?, self.unsigned()?]));
        let parsed = parse();
        self.whole(parsed, "`end PEN MOVES DURATION` in whole numbers")
    }
}
