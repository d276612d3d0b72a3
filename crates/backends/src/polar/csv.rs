//! The polar robot's table of coordinates (report 4 in docs/references.md): `r,theta,dist`, one point a line.
//!
//! r in mm from the pivot, theta in degrees clockwise from the left, dist in mm from the point before (nothing for the
//! first). The robot's pen cannot be lifted, so there is one stroke. It contains no time.

use std::io::Write;

use super::points::points;
use crate::Setpoint;
use crate::WriteError;
use plan::file::text::Text;

/// The format's name.
pub(super) const NAME: &str = "polar-csv";

/// Writes the only stroke of a plan.
///
/// # Errors
/// When there are several strokes or a point is out of the robot's range, before anything is written; an error of the
/// writer.
pub(super) fn write<W: Write + ?Sized>(
    setpoints: impl IntoIterator<Item = Setpoint>,
    out: &mut W,
) -> Result<(), WriteError> {
    let points = points(setpoints, NAME)?;
    let mut text = Text::new(out);
    text.str("r,theta,dist\n");
    for (index, point) in points.iter().enumerate() {
        text.fixed(point.r).byte(b',').fixed(point.theta).byte(b',');
        if let Some(before) = index.checked_sub(1).map(|before| points[before].at) {
            text.fixed(libm::hypot(point.at.x - before.x, point.at.y - before.y));
        }
        text.byte(b'\n').flush_if_full()?;
    }
    Ok(text.finish()?)
}
