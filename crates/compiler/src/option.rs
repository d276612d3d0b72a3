//! Values of planning options as text, for the command line and for the studio's page.

use crate::import;
use crate::quantity;

/// Position between left (0) and right (1) edge, and bottom (0) and top (1) edge: `center`, `top-left`.
///
/// # Errors
/// What is expected.
pub fn align(text: &str) -> Result<(f64, f64), String> {
    let (mut x, mut y) = (0.5, 0.5);
    for word in text.split('-') {
        match word {
            "left" => x = 0.0,
            "right" => x = 1.0,
            "bottom" => y = 0.0,
            "top" => y = 1.0,
            "center" | "centre" | "middle" => {}
            _ => {
                return Err("expected center, left, right, top, bottom or a corner such as top-left".into());
            }
        }
    }
    Ok((x, y))
}

/// A positive factor: `0.5` or `50%`.
///
/// # Errors
/// What is expected.
pub fn scale(text: &str) -> Result<f64, String> {
    let (number, unit) = text.strip_suffix('%').map_or((text, 1.0), |number| (number, 0.01));
    let factor = number.trim().parse::<f64>().ok().map(|factor| factor * unit);
    factor
        .filter(|factor| *factor > 0.0 && factor.is_finite())
        .ok_or_else(|| "expected a positive factor such as 0.5, or a percentage such as 50%".to_owned())
}

/// An angle in rad, at most a full turn; a bare number is in degrees.
pub fn angle(text: &str) -> Result<f64, String> {
    let degrees = text.trim().parse::<f64>().ok().filter(|degrees| degrees.is_finite());
    let angle = match degrees {
        Some(degrees) => degrees.to_radians(),
        None => quantity::angle_rad(text).map_err(|_| {
            "expected an angle in degrees such as 90, or with a unit such as 1.57rad".to_owned()
        })?,
    };
    if angle.abs() > std::f64::consts::TAU + 1e-9 {
        return Err("expected an angle of at most a full turn: -360 to 360 degrees".to_owned());
    }
    Ok(angle)
}

/// A length in mm; a bare number is in mm.
///
/// # Errors
/// What is expected.
pub fn length(text: &str) -> Result<f64, String> {
    quantity::length_mm(text, true).map_err(|error| error.to_string())
}

/// Spacing of a hatch, and its angle after a comma.
pub fn hatch(text: &str) -> Result<import::Hatch, String> {
    let (spacing, direction) = text.split_once(',').unwrap_or((text, "0"));
    let spacing_mm = length(spacing)?;
    if !(1e-3..1e4).contains(&spacing_mm) {
        return Err("the spacing must be between 0.001 mm and 10 m".into());
    }
    Ok(import::Hatch { spacing_mm, angle_rad: angle(direction)? })
}

/// Numbers of pens with commas between.
///
/// # Errors
/// What is expected.
pub fn pens(text: &str) -> Result<Vec<u16>, String> {
    let what = "expected numbers of pens with commas between, such as 2,1";
    let pen = |text: &str| text.trim().parse().ok().filter(|pen| *pen > 0).ok_or_else(|| what.to_owned());
    text.split(',').map(pen).collect()
}

/// Columns and rows of a grid.
///
/// # Errors
/// What is expected.
pub fn grid(text: &str) -> Result<(u16, u16), String> {
    let what = "expected columns and rows such as 3x2, from 1 to 1000";
    let (columns, rows) = text.split_once('x').ok_or(what)?;
    let count = |text: &str| text.trim().parse::<u16>().ok().filter(|n| (1..=1000).contains(n)).ok_or(what);
    Ok((count(columns)?, count(rows)?))
}

/// A time in s.
///
/// # Errors
/// What is expected.
pub fn time(text: &str) -> Result<f64, String> {
    quantity::time_s(text).map_err(|error| error.to_string())
}

/// Two lengths with a comma between, mm.
///
/// # Errors
/// What is expected.
pub fn place(text: &str) -> Result<(f64, f64), String> {
    let (x, y) =
        text.split_once(',').ok_or("a place is two lengths with a comma between, such as 10mm,2cm")?;
    Ok((length(x)?, length(y)?))
}
