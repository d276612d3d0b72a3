//! Lengths.

use std::str::FromStr as _;

use svgtypes::{Length, LengthUnit};

/// Pixels per inch as CSS defines them.
pub(crate) const CSS_DPI: f64 = 96.0;
pub(crate) const MM_PER_INCH: f64 = 25.4;

/// What percentages of a length refer to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axis {
    X,
    Y,
    Diagonal,
}

/// What relative lengths refer to, user units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Basis {
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) font_size: f64,
}

/// A length as written; suffixes in any case.
pub(crate) fn parse(text: &str) -> Option<Length> {
    let text = text.trim();
    Length::from_str(text).ok().or_else(|| Length::from_str(&text.to_ascii_lowercase()).ok())
}

/// Pixels of CSS (user units) of a length; `None` for percentages and font sizes.
pub(crate) fn absolute(length: Length) -> Option<f64> {
    let factor = match length.unit {
        LengthUnit::None | LengthUnit::Px => 1.0,
        LengthUnit::In => CSS_DPI,
        LengthUnit::Cm => CSS_DPI / 2.54,
        LengthUnit::Mm => CSS_DPI / MM_PER_INCH,
        LengthUnit::Pt => CSS_DPI / 72.0,
        LengthUnit::Pc => CSS_DPI / 6.0,
        LengthUnit::Em | LengthUnit::Ex | LengthUnit::Percent => return None,
    };
    Some(length.number * factor)
}

impl Basis {
    /// User units of a length.
    pub(crate) fn user(&self, length: Length, axis: Axis) -> f64 {
        let whole = match axis {
            Axis::X => self.width,
            Axis::Y => self.height,
            Axis::Diagonal => libm::hypot(self.width, self.height) / std::f64::consts::SQRT_2,
        };
        absolute(length).unwrap_or(match length.unit {
            LengthUnit::Percent => length.number / 100.0 * whole,
            LengthUnit::Ex => length.number * self.font_size / 2.0,
            _ => length.number * self.font_size,
        })
    }
}
