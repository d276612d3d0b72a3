//! Columns for LinuxCNC's `halstreamer` with `cfg=ffb`: both motors' positions and the pen, one line a servo period.
//!
//! A line has no time of its own: it is the period of the thread that the streamer runs in. The plan's period is to be that
//! (`--period 1ms`); where the motors stand still lines repeat. Positions are those before rounding, in ticks.

use std::io::Write;

use crate::setpoint::{Setpoint, at_rest};
use plan::Header;
use plan::file::text::Text;

use crate::backend::{Backend, EncodeOptions, PenNumbers, PlanSource};
use crate::{Unrepresentable, WriteError};

/// LinuxCNC's halstreamer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Halstreamer;

impl Backend for Halstreamer {
    fn name(&self) -> &'static str {
        "halstreamer"
    }

    fn format_help(&self) -> Option<&'static str> {
        Some("Columns for LinuxCNC's halstreamer")
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Dropped
    }

    fn caveat(&self, header: &Header) -> Option<String> {
        let period_us = header.period_us;
        (period_us != 1000).then(|| {
            format!(
                "a line is one period of the streamer's thread, here {period_us} us; --period 1ms suits the usual servo thread"
            )
        })
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
        let period_us = plan.header().period_us;
        check(plan.setpoints(self.name())?, period_us)?;
        write(plan.setpoints(self.name())?, period_us, out)
    }
}

/// Whether rows are whole periods apart, and one period where the motors move.
fn check(setpoints: impl Iterator<Item = Setpoint>, period_us: u64) -> Result<(), Unrepresentable> {
    let mut before: Option<Setpoint> = None;
    for (row, setpoint) in (0..).zip(setpoints) {
        if let Some(last) = before {
            let duration_us = setpoint.row.t_us - last.row.t_us;
            let periods = duration_us / period_us.max(1);
            if periods * period_us != duration_us || periods > 1 && !at_rest(&last, &setpoint) {
                return Err(Unrepresentable::Uneven { row, period_us });
            }
        }
        before = Some(setpoint);
    }
    Ok(())
}

/// Writes a plan that passed [`check`], with a line every `period_us`.
///
/// # Errors
/// An error of the writer.
fn write<W: Write + ?Sized>(
    setpoints: impl IntoIterator<Item = Setpoint>,
    period_us: u64,
    out: &mut W,
) -> Result<(), WriteError> {
    let mut text = Text::new(out);
    let mut before: Option<Setpoint> = None;
    for setpoint in setpoints {
        if let Some(last) = before {
            let periods = (setpoint.row.t_us - last.row.t_us) / period_us.max(1);
            for _ in 0..periods {
                line(&mut text, &last)?;
            }
        }
        before = Some(setpoint);
    }
    if let Some(last) = before {
        line(&mut text, &last)?;
    }
    Ok(text.finish()?)
}

fn line<W: Write + ?Sized>(text: &mut Text<'_, W>, setpoint: &Setpoint) -> Result<(), WriteError> {
    text.fixed(setpoint.exact_ticks[0]).byte(b' ').fixed(setpoint.exact_ticks[1]).byte(b' ');
    text.int(u8::from(setpoint.row.pen != 0)).byte(b'\n').flush_if_full()?;
    Ok(())
}
