//! Polyline encoded (`PE`): where its data end, and what numbers and flags they hold.
//!
//! A number is written in digits of base 64 or, after the flag `7`, of base 32, the least
//! significant first. Base 64: all but the last digit are the bytes 63 to 126, the last one 191 to
//! 254. Base 32: 63 to 94, and 95 to 126. Its lowest bit is the sign, the rest the size.

use super::escape::device_control;
use super::name::form_of;
use super::{Input, Parsed, mismatch};
use crate::mnemonic::Mnemonic;

/// What one byte of the data can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Digit,
    Flag,
    /// Skipped.
    Filler,
    End,
}

const KINDS: [Kind; 256] = {
    let mut kinds = [Kind::End; 256];
    let mut byte = 0;
    while byte < 256 {
        kinds[byte] = match byte as u8 {
            63..=126 | 191..=254 => Kind::Digit,
            27 => Kind::End,
            0..=32 | 127..=160 => Kind::Filler,
            other => match other & 0x7f {
                b':' | b'<' | b'=' | b'>' | b'7' => Kind::Flag,
                _ => Kind::End,
            },
        };
        byte += 1;
    }
    kinds
};

fn kind(byte: u8) -> Kind {
    KINDS[usize::from(byte)]
}

/// `data-byte = byte`, or two where the file is Latin-1 that was saved as UTF-8.
#[inline]
fn data_byte(input: Input<'_>, reencoded: bool) -> Parsed<'_, u8> {
    match input {
        [byte @ (0xc2 | 0xc3), next @ 0x80..=0xbf, rest @ ..] if reencoded => {
            Ok((rest, ((byte & 3) << 6) | (next & 0x3f)))
        }
        [byte, rest @ ..] => Ok((rest, *byte)),
        [] => mismatch(input),
    }
}

/// `data = { flag | coordinate | filler }`, up to the first byte that cannot be data, as a rule the
/// semicolon.
///
/// Where that is missing, the letters of the next command look like the beginning of a number: then
/// the data end after their last whole number. `is_reencoded` is called at the first byte pair that
/// could be one byte re-encoded as UTF-8.
pub(crate) fn data(input: Input<'_>, mut is_reencoded: impl FnMut() -> bool) -> Parsed<'_, Input<'_>> {
    // Longer than any number: its digits hold more than 64 bits.
    const TOO_LONG: usize = 64;
    let mut rest = input;
    // After the last whole number or flag, and how many digits there were since.
    let mut whole = input;
    let mut digits = 0;
    let mut base32 = false;
    let mut reencoded = None;
    while !rest.is_empty() {
        let suspicious = matches!(rest, [0xc2 | 0xc3, 0x80..=0xbf, ..]);
        let (after, byte) = data_byte(rest, suspicious && *reencoded.get_or_insert_with(&mut is_reencoded))?;
        match kind(byte) {
            Kind::Digit => {
                rest = after;
                digits += 1;
                if if base32 { (95..=126).contains(&byte) } else { byte >= 191 } {
                    (whole, digits) = (rest, 0);
                } else if digits == TOO_LONG {
                    break;
                }
            }
            Kind::Flag => {
                base32 |= byte & 0x7f == b'7';
                rest = after;
                (whole, digits) = (rest, 0);
            }
            Kind::Filler => rest = after,
            Kind::End => match device_control(rest) {
                Ok((after, _)) => rest = after,
                Err(_) => break,
            },
        }
    }
    let unfinished = whole[..whole.len() - rest.len()].trim_ascii();
    let next_name = unfinished.get(..2).map(|pair| Mnemonic([pair[0], pair[1]]));
    let a_command = next_name.is_some_and(|name| form_of(name).is_some());
    if a_command && (unfinished.len() == 2 || rest.first() != Some(&b';')) {
        rest = whole;
    }
    Ok((rest, &input[..input.len() - rest.len()]))
}

/// A flag or a number of the data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Item {
    /// Selects a pen.
    Pen(f64),
    /// The next pair is travelled with the pen up.
    Up,
    /// The next pair is absolute.
    Absolute,
    /// A coordinate, in current units.
    Coordinate(f64),
    /// A number of fractional bits that the language does not allow; it stays as it was.
    BadFraction(f64),
    /// A number without its last digit.
    Unfinished,
}

/// A whole number, or one without its last digit.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Number {
    Value(f64),
    Unfinished,
}

/// `number = { digit | filler } last-digit`, least significant digit first, the sign in the lowest
/// bit.
fn number(input: Input<'_>, base32: bool, reencoded: bool) -> Parsed<'_, Number> {
    let mut rest = input;
    let mut value: u64 = 0;
    let mut shift = 0;
    let mut too_long = false;
    let mut begun = false;
    while let Ok((after, byte)) = data_byte(rest, reencoded) {
        let (digit, last) = match (kind(byte), base32) {
            (Kind::Filler, _) => {
                rest = after;
                continue;
            }
            (Kind::Digit, false) if byte >= 191 => (byte - 191, true),
            (Kind::Digit, false) => (byte - 63, false),
            // Base 32 is for serial lines that drop the eighth bit.
            (Kind::Digit, true) if byte & 0x7f >= 95 => ((byte & 0x7f) - 95, true),
            (Kind::Digit, true) => ((byte & 0x7f) - 63, false),
            (Kind::End, _) if byte == 0x1b => {
                rest = device_control(rest).map_or(after, |(after, _)| after);
                continue;
            }
            _ => break,
        };
        rest = after;
        begun = true;
        let width = if base32 { 5 } else { 6 };
        if shift + width <= 60 {
            value |= u64::from(digit) << shift;
            shift += width;
        } else {
            too_long |= digit > 0;
        }
        if last {
            let size = if too_long { f64::INFINITY } else { (value >> 1) as f64 };
            return Ok((rest, Number::Value(if value & 1 == 1 { -size } else { size })));
        }
    }
    if begun { Ok((rest, Number::Unfinished)) } else { mismatch(input) }
}

/// Takes the data apart.
#[derive(Clone, Debug)]
pub(crate) struct Decoder<'a> {
    rest: Input<'a>,
    reencoded: bool,
    base32: bool,
    /// What a whole number is multiplied by.
    scale: f64,
}

impl<'a> Decoder<'a> {
    pub(crate) fn new(data: Input<'a>, reencoded: bool) -> Self {
        Self { rest: data, reencoded, base32: false, scale: 1.0 }
    }

    fn number(&mut self) -> Option<Number> {
        let (rest, number) = number(self.rest, self.base32, self.reencoded).ok()?;
        self.rest = rest;
        Some(number)
    }

    fn next_item(&mut self) -> Option<Item> {
        loop {
            let (after, byte) = data_byte(self.rest, self.reencoded).ok()?;
            match kind(byte) {
                Kind::Filler => {
                    self.rest = after;
                    continue;
                }
                Kind::End => {
                    self.rest = device_control(self.rest).map_or(after, |(after, _)| after);
                    continue;
                }
                Kind::Digit => {
                    return match self.number() {
                        Some(Number::Value(value)) => Some(Item::Coordinate(value * self.scale)),
                        Some(Number::Unfinished) | None => Some(Item::Unfinished),
                    };
                }
                Kind::Flag => self.rest = after,
            }
            let flag = byte & 0x7f;
            match flag {
                b'<' => return Some(Item::Up),
                b'=' => return Some(Item::Absolute),
                b'7' => self.base32 = true,
                _ => {
                    let value = match self.number() {
                        Some(Number::Value(value)) => value,
                        Some(Number::Unfinished) => return Some(Item::Unfinished),
                        None => continue,
                    };
                    if flag == b':' {
                        return Some(Item::Pen(value));
                    }
                    if value.abs() > 26.0 {
                        return Some(Item::BadFraction(value));
                    }
                    // A power of two: exact, and so is the product with any coordinate.
                    self.scale = libm::ldexp(1.0, -(value as i32));
                }
            }
        }
    }
}

impl Iterator for Decoder<'_> {
    type Item = Item;

    #[inline]
    fn next(&mut self) -> Option<Item> {
        // The everyday number: a small step, in one digit.
        if let Some((&byte, rest)) = self.rest.split_first()
            && let digit = byte.wrapping_sub(if self.base32 { 95 } else { 191 })
            && digit < if self.base32 { 32 } else { 64 }
            && !self.reencoded
        {
            self.rest = rest;
            let size = f64::from(digit >> 1) * self.scale;
            return Some(Item::Coordinate(if digit & 1 == 1 { -size } else { size }));
        }
        self.next_item()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items(bytes: &[u8]) -> Vec<Item> {
        Decoder::new(bytes, false).collect()
    }

    fn data_length(bytes: &[u8]) -> usize {
        data(bytes, || false).map_or(0, |(_, data)| data.len())
    }

    #[test]
    fn numbers_of_base_64() {
        // 800 = 32 + 12 * 64; half of it is 400, the sign bit 0.
        assert_eq!(items(&[63 + 32, 191 + 12, 191]), [Item::Coordinate(400.0), Item::Coordinate(0.0)]);
        // 801 has the sign bit.
        assert_eq!(items(&[63 + 33, 191 + 12]), [Item::Coordinate(-400.0)]);
    }

    #[test]
    fn numbers_of_base_32() {
        // 800 = 0 + 25 * 32
        assert_eq!(items(&[b'7', 63, 95 + 25]), [Item::Coordinate(400.0)]);
    }

    #[test]
    fn encoded_fractions() {
        // `>` 8 bits (16 = 8 << 1), then 400 * 256.
        let encoded = (400_u32 * 256) << 1;
        let digits =
            [63 + (encoded & 63) as u8, 63 + (encoded >> 6 & 63) as u8, 191 + (encoded >> 12 & 63) as u8];
        let mut data = vec![b'>', 191 + 16];
        data.extend(digits);
        assert_eq!(items(&data), [Item::Coordinate(400.0)]);
    }

    #[test]
    fn encoded_flag_after_line_end() {
        // gnuplot ends a line after each pair; the flag after it once went unseen.
        assert_eq!(
            items(b"\xbf\xbf\n<\xbf\xbf"),
            [
                Item::Coordinate(0.0),
                Item::Coordinate(0.0),
                Item::Up,
                Item::Coordinate(0.0),
                Item::Coordinate(0.0)
            ]
        );
    }

    #[test]
    fn encoded_data_without_terminator() {
        let bytes = [95, 203, 191, b'P', b'U', b';'];
        assert_eq!(data_length(&bytes), 3);
        let bytes = [95, 203, 191, b'P', b'D', b'4', b'0'];
        assert_eq!(data_length(&bytes), 3);
        // Not a command: the letters are an unfinished number.
        let bytes = [95, 203, 191, b'Q', b'Q', b';'];
        assert_eq!(data_length(&bytes), 5);
    }
}
