//! The polar robot's points as in its program: `float radii[] = {...};` and `float angles[] = {...};`, two decimals.
//!
//! The program never moves to the last point, so that point is written twice. It has no pen: there is one stroke. It
//! contains no time.

use std::io::Write;

use super::points::points;
use crate::Setpoint;
use crate::WriteError;
use plan::file::text::Text;

/// The format's name.
pub(super) const NAME: &str = "c-arrays";

/// Writes the only stroke of a plan.
///
/// # Errors
/// When there are several strokes or a point is out of the robot's range, before anything is written; an error of the
/// writer.
pub(super) fn write<W: Write + ?Sized>(
    setpoints: impl IntoIterator<Item = Setpoint>,
    out: &mut W,
) -> Result<(), WriteError> {
    let mut points = points(setpoints, NAME)?;
    points.extend(points.last().copied());
    let mut text = Text::new(out);
    for (name, values) in [
        ("radii", points.iter().map(|point| point.r).collect::<Vec<f64>>()),
        ("angles", points.iter().map(|point| point.theta).collect()),
    ] {
        text.str("float ").str(name).str("[] = {");
        for (index, value) in values.into_iter().enumerate() {
            text.str(match index {
                0 => "",
                index if index % 12 == 0 => ",\n    ",
                _ => ", ",
            });
            text.str(&format!("{value:.2}")).flush_if_full()?;
        }
        text.str("};\n");
    }
    Ok(text.finish()?)
}
