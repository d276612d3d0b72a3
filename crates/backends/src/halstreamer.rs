//! Columns for LinuxCNC's `halstreamer` with `cfg=ffb`: both motors' positions and the pen, one line a servo period.
//!
//! A line has no time of its own: it is the period of the thread that the streamer runs in. The plan's period is to be that
//! (`--period 1ms`); where the motors stand still lines repeat. Positions are those before rounding, in ticks.

use std::io::Write;

use crate::command::{Instant, rests};
use crate::{Unfit, WriteError};
use plan::file::text::Text;

/// Writes a plan with a line every `period_us`.
///
/// # Errors
/// Rows that are not whole periods apart; whatever the writer says.
pub fn write<W: Write + ?Sized>(
    instants: impl IntoIterator<Item = Instant>,
    period_us: u64,
    out: &mut W,
) -> Result<(), WriteError> {
    let mut text = Text::new(out);
    let mut before: Option<Instant> = None;
    for (row, instant) in (0..).zip(instants) {
        if let Some(last) = before {
            let lasts = instant.row.t_us - last.row.t_us;
            let periods = lasts / period_us.max(1);
            if periods * period_us != lasts || periods > 1 && !rests(&last, &instant) {
                return Err(Unfit::Uneven { row, period_us }.into());
            }
            for _ in 0..periods {
                line(&mut text, &last)?;
            }
        }
        before = Some(instant);
    }
    if let Some(last) = before {
        line(&mut text, &last)?;
    }
    Ok(text.finish()?)
}

fn line<W: Write + ?Sized>(text: &mut Text<'_, W>, instant: &Instant) -> Result<(), WriteError> {
    text.fixed(instant.exact[0]).byte(b' ').fixed(instant.exact[1]).byte(b' ');
    text.int(u8::from(instant.row.pen != 0)).byte(b'\n').flush_if_full()?;
    Ok(())
}
