//! Rows of position, velocity and time, for servo drives with PVT interpolation and for loops with velocity feed-forward.
//!
//! A drive moves along the cubic with both positions and both velocities (Hermite). Velocities are
//! central differences of the exact positions, ticks/s, and 0 at rest; so the cubics join with equal
//! velocities.

use std::io::Write;

use crate::setpoint::{Setpoint, motor_speeds};
use plan::file::text::Text;

use crate::WriteError;
use crate::backend::{Backend, EncodeOptions, PenNumbers, PlanSource};

/// Rows of position, velocity and time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pvt;

impl Backend for Pvt {
    fn name(&self) -> &'static str {
        "pvt"
    }

    fn format_help(&self) -> Option<&'static str> {
        Some("Position, velocity and time of each motor")
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
        let setpoints: Vec<Setpoint> = plan.setpoints(self.name())?.collect();
        let names = plan.header().motors.each_ref().map(|motor| motor.name.as_str());
        write(&setpoints, names, out)
    }
}

/// Writes a plan: a line of column names, then one line a row. `names` are the motors'.
///
/// # Errors
/// An error of the writer.
fn write<W: Write + ?Sized>(setpoints: &[Setpoint], names: [&str; 2], out: &mut W) -> Result<(), WriteError> {
    let mut text = Text::new(out);
    text.str("t_s,pen");
    for name in names {
        text.byte(b',').str(name).byte(b',').str(name).str("_per_s");
    }
    text.byte(b'\n');
    for (setpoint, speed) in setpoints.iter().zip(motor_speeds(setpoints)) {
        let us = setpoint.row.t_us;
        text.str(&format!("{}.{:06}", us / 1_000_000, us % 1_000_000)).byte(b',').int(setpoint.row.pen);
        for (position, speed) in setpoint.exact_ticks.into_iter().zip(speed) {
            text.byte(b',').fixed(position).byte(b',').fixed(speed);
        }
        text.byte(b'\n').flush_if_full()?;
    }
    Ok(text.finish()?)
}
