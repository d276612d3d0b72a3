//! The stroke font that labels are drawn in, and the character sets of their bytes.

mod encodings;
mod newstroke;

use std::sync::LazyLock;

pub(crate) use encodings::{CharacterSet, Mark, compose};

/// Height of capitals, units of the font.
pub const CAP_HEIGHT: f64 = 21.0;
/// Width of wide capitals such as A, units of the font: what plotters call the width of a
/// character.
pub(crate) const BODY_WIDTH: f64 = 14.0;

/// A character as strokes. The base line is at 0, y goes up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glyph {
    /// From this character's origin to the next one's where characters have widths of their own.
    pub advance: f64,
    strokes: &'static str,
}

impl Glyph {
    /// The glyph of a character, if the font has it.
    pub fn of(character: char) -> Option<Self> {
        let glyphs = newstroke::GLYPHS;
        let index = glyphs.binary_search_by_key(&character, |glyph| glyph.0).ok()?;
        let (_, advance, strokes) = glyphs[index];
        Some(Self { advance: f64::from(advance), strokes })
    }

    /// The lowest and the highest of its ink; 0 for a blank.
    pub(crate) fn vertical_extent(self) -> (f64, f64) {
        let y = || self.strokes().flatten().map(|point| point.1);
        y().reduce(f64::min).zip(y().reduce(f64::max)).unwrap_or_default()
    }

    /// The middle of its ink; the origin for a blank.
    pub(crate) fn middle(self) -> (f64, f64) {
        let middle = |of: fn((f64, f64)) -> f64| {
            let values = || self.strokes().flatten().map(of);
            let (low, high) = (values().reduce(f64::min), values().reduce(f64::max));
            low.zip(high).map_or(0.0, |(low, high)| 0.5 * (low + high))
        };
        (middle(|p| p.0), middle(|p| p.1))
    }

    /// Its strokes, each as points in units of the font.
    pub fn strokes(self) -> impl Iterator<Item = impl Iterator<Item = (f64, f64)>> {
        let unit = |byte: u8| f64::from(byte) - f64::from(b'R');
        self.strokes.split(' ').filter(|stroke| !stroke.is_empty()).map(move |stroke| {
            stroke.as_bytes().chunks_exact(2).map(move |pair| (unit(pair[0]), unit(pair[1])))
        })
    }
}

/// A glyph and what its ink takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Measured {
    pub(crate) glyph: Glyph,
    pub(crate) strokes: u32,
    /// Its ink is no farther from its origin, in character widths along x and in capital heights along
    /// y, in its cell or not.
    pub(crate) reach: f64,
}

impl Measured {
    fn of(character: char) -> Option<Self> {
        let glyph = Glyph::of(character).filter(|_| Mark::of(character).is_none())?;
        let shift = (0.5 * (BODY_WIDTH - glyph.advance)).abs();
        let reach = |(x, y): (f64, f64)| f64::max((x.abs() + shift) / BODY_WIDTH, y.abs() / CAP_HEIGHT);
        let reach = glyph.strokes().flatten().map(reach).fold(0.0, f64::max);
        Some(Self { glyph, strokes: glyph.strokes().count() as u32, reach })
    }
}

/// The glyph of a character that stands by itself, if the font has it.
pub(crate) fn measured(character: char) -> Option<Measured> {
    /// Most labels have no other characters.
    static LATIN_1: LazyLock<[Option<Measured>; 256]> =
        LazyLock::new(|| std::array::from_fn(|code| Measured::of(char::from(code as u8))));
    match u8::try_from(u32::from(character)) {
        Ok(code) => LATIN_1[usize::from(code)],
        Err(_) => Measured::of(character),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glyph_table_is_sorted_and_complete() {
        assert!(newstroke::GLYPHS.windows(2).all(|pair| pair[0].0 < pair[1].0));
        for &(character, advance, strokes) in newstroke::GLYPHS {
            assert!(advance > 0, "{character}");
            assert!(strokes.split(' ').all(|stroke| stroke.len() % 2 == 0), "{character}");
        }
    }

    #[test]
    fn every_printable_character_of_ascii_and_latin_1_has_one() {
        for character in (' '..='~').chain('¡'..='ÿ').filter(|&c| c != '\u{ad}') {
            assert!(Glyph::of(character).is_some(), "{character}");
        }
    }

    #[test]
    fn capital_on_base_line() {
        let glyph = Glyph::of('A').unwrap();
        let points: Vec<(f64, f64)> = glyph.strokes().flatten().collect();
        let height = points.iter().map(|p| p.1).fold(0.0, f64::max);
        let width =
            points.iter().map(|p| p.0).fold(0.0, f64::max) - points.iter().map(|p| p.0).fold(99.0, f64::min);
        assert_eq!((height, width), (CAP_HEIGHT, BODY_WIDTH));
        assert_eq!(points.iter().map(|p| p.1).fold(0.0, f64::min), 0.0);
    }
}
