//! Numbers with units, as people write them: `206mm`, `0.5 in`, `60deg/s`, `3200/rev`, `10ms`.

use std::str::FromStr;

/// A number and the unit that was written behind it, which may be empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// The number.
    pub value: f64,
    /// The unit, without spaces around it.
    pub unit: String,
}

/// What was written is not a quantity of the wanted kind.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct QuantityError {
    text: String,
    wanted: String,
}

impl std::fmt::Display for QuantityError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { text, wanted } = self;
        if text.trim().parse::<f64>().is_ok() {
            return write!(f, "`{text}` has no unit: it is not {wanted}");
        }
        write!(f, "`{text}` is not {wanted}")
    }
}

/// Units of length with their size in mm.
const LENGTHS: &[(&str, f64)] = &[("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("um", 1e-3), ("in", 25.4)];
/// Units of time with their size in s.
const TIMES: &[(&str, f64)] = &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("min", 60.0)];
/// Units of angle with their size in rad.
const ANGLES: &[(&str, f64)] =
    &[("deg", std::f64::consts::PI / 180.0), ("rad", 1.0), ("rev", std::f64::consts::TAU)];

impl FromStr for Quantity {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        let trimmed = text.trim();
        let wrong = || QuantityError { text: text.into(), wanted: "a number with a unit".into() };
        // The longest prefix that is a number: `5e3` is one, `5em` is 5 and a unit.
        let number = (1..=trimmed.len()).rev().filter(|end| trimmed.is_char_boundary(*end)).find_map(|end| {
            let prefix = &trimmed[..end];
            let plain = prefix.bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b));
            prefix.parse::<f64>().ok().filter(|value| plain && value.is_finite()).map(|value| (value, end))
        });
        let (value, end) = number.ok_or_else(wrong)?;
        Ok(Self { value, unit: trimmed[end..].trim().to_owned() })
    }
}

impl Quantity {
    fn in_units(&self, text: &str, units: &[(&str, f64)], kind: &str) -> Result<f64, QuantityError> {
        let size = units.iter().find(|(name, _)| *name == self.unit).map(|(_, size)| size);
        size.map(|size| self.value * size).ok_or_else(|| {
            let names: Vec<&str> = units.iter().map(|(name, _)| *name).collect();
            QuantityError {
                text: text.into(),
                wanted: format!("{kind} (a number with {})", names.join(", ")),
            }
        })
    }
}

/// A length in mm. A bare number is refused unless `bare` says that it means mm.
///
/// # Errors
/// When the text is not a length.
pub fn length_mm(text: &str, bare: bool) -> Result<f64, QuantityError> {
    let quantity: Quantity = text.parse()?;
    if bare && quantity.unit.is_empty() {
        return Ok(quantity.value);
    }
    quantity.in_units(text, LENGTHS, "a length")
}

/// A time in s.
///
/// # Errors
/// When the text is not a time.
pub fn time_s(text: &str) -> Result<f64, QuantityError> {
    text.parse::<Quantity>()?.in_units(text, TIMES, "a time")
}

/// An angle in rad.
///
/// # Errors
/// When the text is not an angle.
pub fn angle_rad(text: &str) -> Result<f64, QuantityError> {
    text.parse::<Quantity>()?.in_units(text, ANGLES, "an angle")
}

/// What a motor's coordinate is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// mm
    Length,
    /// rad
    Angle,
}

impl Dimension {
    fn units(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Length => LENGTHS,
            Self::Angle => ANGLES,
        }
    }

    fn kind(self) -> &'static str {
        match self {
            Self::Length => "a length",
            Self::Angle => "an angle",
        }
    }

    /// A value of this dimension in mm or rad.
    ///
    /// # Errors
    /// When the text is something else.
    pub fn value(self, text: &str) -> Result<f64, QuantityError> {
        text.parse::<Quantity>()?.in_units(text, self.units(), self.kind())
    }
}

/// Counts of a motor: `3200/rev`, `80/mm`, `360/44mm`. Gives ticks per mm or per rad, and which of the two.
///
/// # Errors
/// When the text is not of that form.
pub fn counts(text: &str) -> Result<(f64, Dimension), QuantityError> {
    let wrong = || QuantityError {
        text: text.into(),
        wanted: "counts per length or angle, such as 3200/rev, 80/mm or 360/44mm".into(),
    };
    let (ticks, per) = text.split_once('/').ok_or_else(wrong)?;
    let ticks: f64 = ticks.trim().parse().map_err(|_| wrong())?;
    // `/mm` is `/1mm`.
    let per = per.trim();
    let per =
        if per.starts_with(|c: char| c.is_ascii_alphabetic()) { format!("1{per}") } else { per.to_owned() };
    for dimension in [Dimension::Length, Dimension::Angle] {
        if let Ok(size) = dimension.value(&per)
            && size > 0.0
            && ticks.is_finite()
        {
            return Ok((ticks / size, dimension));
        }
    }
    Err(wrong())
}

/// A motor's speed (`power` 1), acceleration (2) or jerk (3) in ticks: `60deg/s`, `500mm/s2`, `2000ticks/s`.
///
/// # Errors
/// When the unit is not of that form or of the other dimension.
pub fn rate_ticks(
    text: &str,
    power: u8,
    counts_per_unit: f64,
    dimension: Dimension,
) -> Result<f64, QuantityError> {
    let suffix = match power {
        1 => "/s",
        2 => "/s2",
        _ => "/s3",
    };
    let examples = match dimension {
        Dimension::Length => "mm",
        Dimension::Angle => "deg",
    };
    let wrong = || QuantityError {
        text: text.into(),
        wanted: format!("a rate such as 10{examples}{suffix} or 1000ticks{suffix}"),
    };
    let quantity: Quantity = text.parse()?;
    let unit = quantity.unit.replace('²', "2").replace('³', "3").replace('^', "");
    let unit = unit.strip_suffix(suffix).ok_or_else(wrong)?.trim();
    if unit == "ticks" || unit == "counts" || unit == "steps" {
        return Ok(quantity.value);
    }
    let size = dimension.units().iter().find(|(name, _)| *name == unit).map(|(_, size)| size);
    size.map(|size| quantity.value * size * counts_per_unit.abs()).ok_or_else(wrong)
}

/// Quantities of motors and masses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhysicalUnit {
    /// V
    Voltage,
    /// A
    Current,
    /// ohm
    Resistance,
    /// N m
    Torque,
    /// N m/A, equal to V s/rad
    TorqueConstant,
    /// kg m²
    Inertia,
    /// kg
    Mass,
}

impl PhysicalUnit {
    /// What it is called, and its units with their size in SI units.
    fn units(self) -> (&'static str, &'static [(&'static str, f64)]) {
        match self {
            Self::Voltage => ("a voltage", &[("V", 1.0), ("mV", 1e-3)]),
            Self::Current => ("a current", &[("A", 1.0), ("mA", 1e-3)]),
            Self::Resistance => ("a resistance", &[("ohm", 1.0), ("mohm", 1e-3)]),
            Self::Torque => ("a torque", &[("Nm", 1.0), ("mNm", 1e-3), ("Ncm", 1e-2)]),
            Self::TorqueConstant => ("a torque constant", &[("Nm/A", 1.0), ("mNm/A", 1e-3), ("Vs/rad", 1.0)]),
            Self::Inertia => ("a moment of inertia", &[("kgm2", 1.0), ("gcm2", 1e-7)]),
            Self::Mass => ("a mass", &[("kg", 1.0), ("g", 1e-3)]),
        }
    }

    /// The value in SI units.
    ///
    /// # Errors
    /// When the text is something else.
    pub fn value(self, text: &str) -> Result<f64, QuantityError> {
        let (kind, units) = self.units();
        text.parse::<Quantity>()?.in_units(text, units, kind)
    }
}

/// A speed of the pen in mm/s.
///
/// # Errors
/// When the text is not one.
pub fn speed_mm_s(text: &str) -> Result<f64, QuantityError> {
    rate_ticks(text, 1, 1.0, Dimension::Length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_take_units() {
        assert_eq!(length_mm("0.5in", false), Ok(12.7));
        assert_eq!(length_mm(" 3 cm ", false), Ok(30.0));
        assert_eq!(length_mm("-1.5e1mm", false), Ok(-15.0));
        assert_eq!(length_mm("5", true), Ok(5.0));
        assert!(length_mm("5", false).is_err());
        assert!(length_mm("5s", true).is_err());
        assert!(length_mm("inf mm", true).is_err());
        assert!(length_mm("", true).is_err());
    }

    #[test]
    fn times_and_angles_take_units() {
        assert_eq!(time_s("10ms"), Ok(0.01));
        assert_eq!(angle_rad("0.5rev"), Ok(std::f64::consts::PI));
        assert!(time_s("10").is_err());
    }

    #[test]
    fn counts_are_per_length_or_angle() {
        assert_eq!(counts("80/mm"), Ok((80.0, Dimension::Length)));
        assert_eq!(counts("360/44mm"), Ok((360.0 / 44.0, Dimension::Length)));
        assert_eq!(counts("3200/rev"), Ok((3200.0 / std::f64::consts::TAU, Dimension::Angle)));
        assert!(counts("80").is_err());
        assert!(counts("80/s").is_err());
        assert!(counts("80/0mm").is_err());
    }

    #[test]
    fn physical_quantities_take_units() {
        assert_eq!(PhysicalUnit::Voltage.value("12V"), Ok(12.0));
        assert_eq!(PhysicalUnit::Current.value("300 mA"), Ok(0.3));
        assert_eq!(PhysicalUnit::Inertia.value("54gcm2"), Ok(54e-7));
        assert!(PhysicalUnit::Mass.value("12V").is_err());
    }

    #[test]
    fn rates_become_ticks() {
        let (per_rad, dimension) = counts("3200/rev").unwrap();
        assert!((rate_ticks("60deg/s", 1, per_rad, dimension).unwrap() - 1600.0 / 3.0).abs() < 1e-9);
        assert!((rate_ticks("300 deg/s²", 2, per_rad, dimension).unwrap() - 8000.0 / 3.0).abs() < 1e-9);
        assert_eq!(rate_ticks("2000ticks/s2", 2, per_rad, dimension), Ok(2000.0));
        assert!(rate_ticks("60deg/s", 2, per_rad, dimension).is_err());
        assert!(rate_ticks("60mm/s", 1, per_rad, dimension).is_err());
    }
}
