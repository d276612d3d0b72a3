//! Colours for pens.

/// Red, green and blue, 0 to 255.
pub(crate) type Colour = [u8; 3];

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

/// The colour of a pen, from 1 up; they come round again after the eighth.
pub(crate) fn pen_colour(pen: u16) -> Colour {
    PENS[usize::from(pen.saturating_sub(1)) % PENS.len()]
}

/// The colour as SVG writes it.
pub(crate) fn hex([red, green, blue]: Colour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}
