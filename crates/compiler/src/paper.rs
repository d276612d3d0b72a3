//! Sheets of paper by name.

use crate::quantity;

/// Name and size of a sheet, portrait, mm. ISO 216, and ANSI Y14.1 (letter is A).
const PAPERS: [(&str, [f64; 2]); 15] = [
    ("a0", [841.0, 1189.0]),
    ("a1", [594.0, 841.0]),
    ("a2", [420.0, 594.0]),
    ("a3", [297.0, 420.0]),
    ("a4", [210.0, 297.0]),
    ("a5", [148.0, 210.0]),
    ("a6", [105.0, 148.0]),
    ("letter", [215.9, 279.4]),
    ("legal", [215.9, 355.6]),
    ("tabloid", [279.4, 431.8]),
    ("a", [215.9, 279.4]),
    ("b", [279.4, 431.8]),
    ("c", [431.8, 558.8]),
    ("d", [558.8, 863.6]),
    ("e", [863.6, 1117.6]),
];

/// The size of a sheet, mm: `A4`, `A4,landscape`, `letter`, or `WIDTHxHEIGHT` with units, where a
/// bare number is in mm.
///
/// # Errors
/// A message that names the known sheets.
pub fn size_mm(text: &str) -> Result<[f64; 2], String> {
    let (name, landscape) = match text.split_once(',') {
        None => (text, false),
        Some((name, "landscape")) => (name, true),
        Some((name, "portrait")) => (name, false),
        Some((_, other)) => return Err(format!("`{other}` is neither landscape nor portrait")),
    };
    let name = name.trim().to_ascii_lowercase();
    let size = match PAPERS.iter().find(|(known, _)| *known == name) {
        Some((_, size)) => *size,
        None => explicit(&name).ok_or_else(|| {
            let known: Vec<&str> = PAPERS.iter().map(|(name, _)| *name).collect();
            format!("unknown paper `{text}`; known: {}, or WIDTHxHEIGHT such as 200x300mm", known.join(", "))
        })?,
    };
    Ok(if landscape { [size[1], size[0]] } else { size })
}

/// `200x300`, `200x300mm`, `8.5inx11in`.
fn explicit(text: &str) -> Option<[f64; 2]> {
    let (width, height) = text.split_once('x')?;
    let unit = height.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
    let bare = width.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    let width = if bare { format!("{width}{unit}") } else { width.to_owned() };
    let size = [&*width, height].map(|side| quantity::length_mm(side, true).ok());
    match size {
        [Some(width), Some(height)] if width > 0.0 && height > 0.0 => Some([width, height]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn papers_by_name_and_by_size() {
        assert_eq!(size_mm("A4"), Ok([210.0, 297.0]));
        assert_eq!(size_mm("a4,landscape"), Ok([297.0, 210.0]));
        assert_eq!(size_mm("200x300"), Ok([200.0, 300.0]));
        assert_eq!(size_mm("20x30cm"), Ok([200.0, 300.0]));
        let [width, height] = size_mm("8.5inx11in").unwrap();
        assert!((width - 215.9).abs() < 1e-9 && (height - 279.4).abs() < 1e-9);
        for wrong in ["A9", "0x5", "x", "a4,upright", "12", ""] {
            assert!(size_mm(wrong).is_err(), "{wrong}");
        }
    }
}
