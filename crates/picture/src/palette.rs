//! Colours for pens.

use std::collections::BTreeMap;

/// Red, green and blue, 0 to 255.
pub type Colour = [u8; 3];

/// Colours that stay apart for colour-blind eyes and stand out on white paper: those of Okabe and Ito ("Color
/// Universal Design", 2002) without their yellow, which white paper swallows, and the wine red of Tol's muted scheme
/// in its place. Pen 1 is black, as in most plotters.
const PENS: [Colour; 8] = [
    [0x00, 0x00, 0x00],
    [0xD5, 0x5E, 0x00],
    [0x00, 0x72, 0xB2],
    [0x00, 0x9E, 0x73],
    [0xE6, 0x9F, 0x00],
    [0xCC, 0x79, 0xA7],
    [0x56, 0xB4, 0xE9],
    [0x88, 0x22, 0x55],
];

/// The colours that a drawing gives its pens: red, green and blue by pen number. Pens without an
/// entry have one of the palette's.
pub type PenColors = BTreeMap<u16, Colour>;

/// The colour of a pen, from 1 up: the drawing's own, or one of the palette, which repeats after the
/// eighth.
pub(crate) fn pen_colour(pen: u16, own: &PenColors) -> Colour {
    own.get(&pen).copied().unwrap_or(PENS[usize::from(pen.saturating_sub(1)) % PENS.len()])
}

/// Colours lighter than this do not show on white paper: relative luminance (ITU-R BT.709), of 255.
const LIGHTEST: f64 = 235.0;

/// The colour of a pen on white paper. Pens that would not show there have a colour of the palette.
pub(crate) fn colour_on_white(pen: u16, own: &PenColors) -> Colour {
    let [red, green, blue] = pen_colour(pen, own).map(f64::from);
    let luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
    if luminance > LIGHTEST { pen_colour(pen, &PenColors::new()) } else { pen_colour(pen, own) }
}

/// The colour of a pen's ink on white paper, as `#rrggbb`.
pub fn ink_color(pen: u16, own: &PenColors) -> String {
    hex(colour_on_white(pen, own))
}

/// The colour as SVG writes it.
pub(crate) fn hex([red, green, blue]: Colour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_colours_win_unless_white_paper_hides_them() {
        let own = PenColors::from([(1, [0, 128, 0]), (2, [255, 255, 255]), (3, [255, 255, 0])]);
        assert_eq!(pen_colour(1, &own), [0, 128, 0]);
        assert_eq!(pen_colour(2, &own), [255, 255, 255]);
        assert_eq!(colour_on_white(1, &own), [0, 128, 0]);
        assert_eq!(colour_on_white(2, &own), PENS[1]);
        // Yellow has a luminance of 237: too light for a thin line.
        assert_eq!(colour_on_white(3, &own), PENS[2]);
        assert_eq!(pen_colour(9, &own), PENS[0]);
    }
}
