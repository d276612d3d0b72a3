//! Rows of position, velocity and time, for servo drives with PVT interpolation and for loops with velocity feed-forward.
//!
//! A drive moves along the cubic that has both positions and both velocities (Hermite). Velocities are central differences of
//! the positions before rounding, in ticks/s, and 0 where the motors rest; so the cubics join with equal velocities.

use std::io::Write;

use crate::WriteError;
use crate::command::{Instant, speeds};
use plan::file::text::Text;

/// Writes a plan: a line of column names, then one line a row. `names` are the motors'.
///
/// # Errors
/// Whatever the writer says.
pub fn write<W: Write + ?Sized>(
    instants: &[Instant],
    names: [&str; 2],
    out: &mut W,
) -> Result<(), WriteError> {
    let mut text = Text::new(out);
    text.str("t_s,pen");
    for name in names {
        text.byte(b',').str(name).byte(b',').str(name).str("_per_s");
    }
    text.byte(b'\n');
    for (instant, speed) in instants.iter().zip(speeds(instants)) {
        let us = instant.row.t_us;
        text.str(&format!("{}.{:06}", us / 1_000_000, us % 1_000_000)).byte(b',').int(instant.row.pen);
        for (position, speed) in instant.exact.into_iter().zip(speed) {
            text.byte(b',').fixed(position).byte(b',').fixed(speed);
        }
        text.byte(b'\n').flush_if_full()?;
    }
    Ok(text.finish()?)
}
