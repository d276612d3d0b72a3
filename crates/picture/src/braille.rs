//! The picture in Braille characters, for a terminal: each holds two by four dots.

use crate::overlay::Overlay;
use crate::png::{Canvas, PngError};
use crate::scene::Scene;

/// Darker pixels become dots, of 255.
const DARK: u32 = 150;
/// The bit of each dot of a character, by column and row (Unicode, block Braille Patterns).
const BITS: [[u8; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];

/// Sheet, ink and lines of a scene in at most `columns` columns and `lines` lines of characters.
///
/// # Errors
/// Where there is no memory for the picture.
pub fn encode(scene: &Scene, columns: u32, lines: u32) -> Result<String, PngError> {
    // Without travel and start, which may lie far away: the characters are few.
    let overlay = Overlay { lines: scene.overlay.lines.clone(), ..Overlay::default() };
    let near = Scene { travel: Vec::new(), reference: Vec::new(), start: None, overlay, ..scene.clone() };
    let bounds = near.bounds();
    let (columns, lines) = (columns.clamp(4, 500), lines.clamp(2, 500));
    let scale = (f64::from(2 * columns) / bounds.width()).min(f64::from(4 * lines) / bounds.height());
    let mut canvas = Canvas::new(bounds, scale)?;
    canvas.sheet(scene.sheet, [0; 3]);
    canvas.ink(scene, |_| [0; 3]);
    for line in &scene.overlay.lines {
        canvas.line(&line.points, false, [0; 3], 0.0, None);
    }
    let pixmap = &canvas.pixmap;
    let is_dark = |x: u32, y: u32| {
        pixmap.pixel(x, y).is_some_and(|pixel| {
            u32::from(pixel.red()) + u32::from(pixel.green()) + u32::from(pixel.blue()) < 3 * DARK
        })
    };
    let mut text = String::new();
    for line in 0..pixmap.height().div_ceil(4) {
        let row: String = (0..pixmap.width().div_ceil(2))
            .map(|column| {
                let mut dots = 0;
                for (x, bits) in (0..).zip(BITS) {
                    for (y, bit) in (0..).zip(bits) {
                        if is_dark(2 * column + x, 4 * line + y) {
                            dots |= bit;
                        }
                    }
                }
                char::from_u32(0x2800 + u32::from(dots)).unwrap_or(' ')
            })
            .collect();
        text.push_str(row.trim_end_matches('\u{2800}'));
        text.push('\n');
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use drawing::{Point, Rect};

    use super::*;
    use crate::{Ink, InkLine, PenColors};

    #[test]
    fn sheet_and_ink_become_dots() {
        let line = InkLine::Points(vec![Point::new(0.0, 0.0), Point::new(100.0, 50.0)]);
        let scene = Scene {
            title: String::new(),
            sheet: Rect::new(0.0, 0.0, 100.0, 50.0),
            reach: Vec::new(),
            shades: None,
            reference: Vec::new(),
            ink: vec![Ink { pen: 1, line }],
            colors: PenColors::new(),
            travel: Vec::new(),
            start: None,
            overlay: Overlay::default(),
        };
        let text = encode(&scene, 20, 10).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines.len() <= 10 && lines.iter().all(|line| line.chars().count() <= 20), "{text}");
        // The diagonal: from the lower left to the upper right, inside the frame.
        let dots = |line: &str| line.chars().filter(|c| *c != '\u{2800}').count();
        assert!(dots(lines[0]) > 15 && dots(lines[lines.len() - 1]) > 15, "{text}");
        let inner = lines[lines.len() / 2];
        assert!((3..=8).contains(&dots(inner)), "{text}");
    }
}
