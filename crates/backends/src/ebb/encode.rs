//! Lines for an EiBotBoard (EBB): `LT` moves of firmware 2.7 and later, or `SM` moves.
//!
//! Every 40 us the board adds a rate to each axis' accumulator and steps when that reaches 2^31; `LT,T,R1,A1,R2,A2` does so
//! `T` times (ebb command reference, "LT"). Motors move evenly between a plan's rows, so accelerations are 0 and the rates are
//!
//! ```text
//! R = round((2^31 d + H - C) / T)
//! ```
//!
//! for `d` steps in `T` intervals, with `C` the accumulator before the move and `H = 2^30` its target afterwards: a step
//! falls where the motor passes the midpoint between two positions. The accumulators are tracked exactly, so no step is
//! lost or gained in a plan of any length; the rounding remainder goes into the next move. Times are rounded to whole
//! intervals since the start, not one by one.

use std::io::Write;

use plan::Row;

use crate::Line;
use crate::{Unrepresentable, WriteError};
use plan::file::text::Text;

/// The format's name.
pub(super) const NAME: &str = "ebb";
/// One interval of the board's clock, microseconds.
const INTERVAL_US: u64 = 40;
/// A full accumulator: one step.
const FULL: i64 = 1 << 31;
/// The target of an accumulator after each move.
const HALF: i64 = 1 << 30;
/// Most steps a second, one an interval.
const MOST: u64 = 25_000;

/// The move command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Moves {
    /// `LT`: firmware 2.7 and later.
    Timed,
    /// `SM`: every firmware; times in whole milliseconds.
    Stepper,
}

/// What moves the pen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pen {
    /// `SP`, with the positions set on the board.
    Toggle,
    /// `S2`, a servo output with positions of its own, in units of 1/12 us.
    Servo {
        /// Position with the pen up.
        up: u16,
        /// Position with the pen down.
        down: u16,
        /// The output's pin, RPn.
        pin: u8,
    },
}

impl Pen {
    /// The line that moves the pen and waits.
    pub(super) fn line(self, down: bool, ms: u64) -> String {
        match self {
            Self::Toggle => format!("SP,{},{ms}", u8::from(!down)),
            Self::Servo { up, down: low, pin } => {
                format!("S2,{},{pin},0,{ms}", if down { low } else { up })
            }
        }
    }
}

/// Encodes rows one after the other.
#[derive(Clone, Debug)]
pub(super) struct Encoder {
    moves: Moves,
    pen: Pen,
    /// The accumulators. The first move clears them.
    accumulators: [i64; 2],
    cleared: bool,
    /// Intervals (or milliseconds) since the start that were written.
    written: u64,
    clock_us: u64,
}

impl Encoder {
    /// At the start of a plan.
    pub(super) fn new(moves: Moves, pen: Pen) -> Self {
        Self { moves, pen, accumulators: [0; 2], cleared: false, written: 0, clock_us: 0 }
    }

    /// The lines before the first move: motors on with sixteenth steps, pen up.
    pub(super) fn start(&self) -> Vec<String> {
        vec!["EM,1,1".to_owned(), self.pen.line(false, 500)]
    }

    /// The line that moves the pen and waits.
    pub(super) fn pen(&mut self, down: bool, wait_us: u64) -> String {
        self.clock_us += wait_us;
        let unit = self.unit();
        let ms = (self.clock_us / unit).saturating_sub(self.written) * unit / 1000;
        self.written += ms * 1000 / unit;
        self.pen.line(down, ms)
    }

    fn unit(&self) -> u64 {
        match self.moves {
            Moves::Timed => INTERVAL_US,
            Moves::Stepper => 1000,
        }
    }

    /// The line that moves by `steps` in `duration_us`; `None` if nothing moves in less than one unit of time. `row` is the
    /// row at the end, for error messages.
    ///
    /// # Errors
    /// A step rate or a duration that the board cannot execute.
    pub(super) fn go(
        &mut self,
        row: u64,
        steps: [i64; 2],
        duration_us: u64,
    ) -> Result<Option<String>, Unrepresentable> {
        let unit = self.unit();
        self.clock_us += duration_us;
        let time = ((self.clock_us + unit / 2) / unit).saturating_sub(self.written);
        if time == 0 {
            if steps == [0, 0] {
                return Ok(None);
            }
            return Err(Unrepresentable::TooShort { row, us: duration_us, format: NAME, least: unit });
        }
        let most = steps[0].unsigned_abs().max(steps[1].unsigned_abs());
        // Rates stay below 2^31, with a margin for the rounding remainder.
        if u128::from(most) * 1_000_000 >= u128::from(MOST) * u128::from(time * unit) {
            return Err(Unrepresentable::TooFast {
                row,
                steps: most,
                us: time * unit,
                format: NAME,
                most: MOST,
            });
        }
        if self.moves == Moves::Stepper {
            self.written += time;
            return Ok(Some(format!("SM,{time},{},{}", steps[0], steps[1])));
        }
        if steps == [0, 0] {
            // A rate of 0 is no move; `SM` without steps waits, in whole milliseconds.
            let ms = time * unit / 1000;
            self.written += ms * 1000 / unit;
            return Ok((ms > 0).then(|| format!("SM,{ms},0,0")));
        }
        self.written += time;
        let rates = [0, 1].map(|axis| self.rate(axis, steps[axis], time));
        let clear = if self.cleared { "" } else { ",3" };
        self.cleared = true;
        Ok(Some(format!("LT,{time},{},0,{},0{clear}", rates[0], rates[1])))
    }

    /// The rate that makes exactly `steps` steps; updates the accumulator.
    fn rate(&mut self, axis: usize, steps: i64, intervals: u64) -> i64 {
        if steps == 0 {
            return 0;
        }
        let (count, intervals) = (steps.abs(), intervals as i64);
        let before = self.accumulators[axis];
        let wanted = count * FULL + HALF - before;
        let rate = ((2 * wanted + intervals) / (2 * intervals)).min(FULL - 1);
        self.accumulators[axis] = before + rate * intervals - count * FULL;
        rate * steps.signum()
    }
}

/// The lines of a plan, in order. With `continues` nothing goes before the rows, and the pen stays as it is
/// before and after them.
///
/// # Errors
/// As [`Encoder::go`].
pub(super) fn lines(
    rows: impl IntoIterator<Item = Row>,
    moves: Moves,
    pen: Pen,
    continues: bool,
) -> Result<Vec<Line>, Unrepresentable> {
    let mut rows = rows.into_iter().peekable();
    let mut encoder = Encoder::new(moves, pen);
    let start = if continues { Vec::new() } else { encoder.start() };
    let mut lines: Vec<Line> =
        start.into_iter().map(|text| Line { text, row: 0, duration_us: 0, ..Line::default() }).collect();
    let mut before: Option<Row> = None;
    let mut down = continues && rows.peek().is_some_and(|row| row.pen != 0);
    for (index, row) in (0..).zip(rows) {
        if let Some(last) = before {
            let duration_us = row.t_us - last.t_us;
            let steps = [0, 1].map(|motor| row.ticks[motor] - last.ticks[motor]);
            let pen_moves = (last.pen != 0) != down;
            if pen_moves {
                down = last.pen != 0;
                // Where the motors are at rest for the pen, the pen's line waits.
                let waits = if steps == [0, 0] { duration_us } else { 0 };
                lines.push(Line {
                    text: encoder.pen(down, waits),
                    row: index - 1,
                    duration_us: waits,
                    ..Line::default()
                });
            }
            if !(pen_moves && steps == [0, 0])
                && let Some(text) = encoder.go(index, steps, duration_us)?
            {
                lines.push(Line { text, row: index, duration_us, ..Line::default() });
            } else if let Some(line) = lines.last_mut() {
                line.row = index;
            }
        }
        before = Some(row);
    }
    if down && !continues {
        lines.push(Line {
            text: encoder.pen(false, 0),
            row: lines.last().map_or(0, |c| c.row),
            duration_us: 0,
            ..Line::default()
        });
    }
    Ok(lines)
}

/// Writes a plan. Lines end with a carriage return, as the board wants them.
///
/// # Errors
/// As [`lines`], before anything is written; an error of the writer.
pub(super) fn write<W: Write + ?Sized>(
    rows: impl IntoIterator<Item = Row>,
    moves: Moves,
    pen: Pen,
    out: &mut W,
) -> Result<(), WriteError> {
    let lines = lines(rows, moves, pen, false)?;
    let mut text = Text::new(out);
    for line in lines {
        text.str(&line.text).byte(b'\r').flush_if_full()?;
    }
    Ok(text.finish()?)
}
