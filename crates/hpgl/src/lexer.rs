//! Classes of bytes, and numbers written in unusual ways.

use nom::Parser as _;
use nom::number::complete::double;

use crate::envelope;

/// What a byte can be between and inside commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Class {
    Letter,
    Digit,
    Sign,
    Point,
    Comma,
    /// Blank or tab.
    Blank,
    /// Carriage return or line feed: passed over, even inside numbers.
    LineEnd,
    /// Semicolon, or the colon that some files write for it.
    Terminator,
    Escape,
    /// Any other control byte, DEL, and bytes above 127 (line noise, byte order marks): passed over.
    Control,
    Other,
}

const CLASSES: [Class; 256] = {
    let mut classes = [Class::Other; 256];
    let mut byte = 0;
    while byte < 256 {
        classes[byte] = match byte as u8 {
            b'A'..=b'Z' | b'a'..=b'z' => Class::Letter,
            b'0'..=b'9' => Class::Digit,
            b'+' | b'-' => Class::Sign,
            b'.' => Class::Point,
            b',' => Class::Comma,
            b' ' | b'\t' => Class::Blank,
            b'\r' | b'\n' => Class::LineEnd,
            b';' | b':' => Class::Terminator,
            0x1b => Class::Escape,
            0..=0x1f | 0x7f..=0xff => Class::Control,
            _ => Class::Other,
        };
        byte += 1;
    }
    classes
};

pub(crate) fn class(byte: u8) -> Class {
    CLASSES[usize::from(byte)]
}

/// A number read the long way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScannedNumber {
    /// Its value; nothing where a sign or a point stands alone.
    pub(crate) value: Option<f64>,
    /// How many bytes it takes, at least one.
    pub(crate) bytes: usize,
    /// How many line ends stand between its digits, or, if they part numbers, after it where a digit follows.
    pub(crate) line_ends: usize,
}

/// Reads the number at the start of `bytes`, which begin with a digit, a sign or a point.
///
/// Control bytes, line ends and device control (`ESC .`) may stand inside a number. `lines_part` makes line ends
/// end it. An exponent is read where a digit follows the `E`, with or without a sign: no name of a command has a
/// digit in it, so that nothing else can be meant.
pub(crate) fn scan_number(bytes: &[u8], lines_part: bool) -> ScannedNumber {
    // More digits than these change no f64.
    const LONGEST: usize = 40;
    let mut text: Vec<u8> = Vec::with_capacity(24);
    let mut at = 0;
    // After the last byte that is the number's own: what is passed over at its end is not.
    let mut end = 0;
    let mut line_ends = 0;
    let mut pending_line_ends = 0;
    let (mut point, mut exponent, mut digits, mut dropped) = (false, false, 0, 0i32);
    while let Some(&byte) = bytes.get(at) {
        match class(byte) {
            Class::Digit => {
                if pending_line_ends > 0 && digits > 0 {
                    line_ends += pending_line_ends;
                    if lines_part {
                        break;
                    }
                }
                pending_line_ends = 0;
                if digits < LONGEST || exponent {
                    text.push(byte);
                } else if !point {
                    dropped += 1;
                }
                digits += 1;
            }
            Class::Sign if text.is_empty() || text.last() == Some(&b'e') => text.push(byte),
            Class::Point if !point && !exponent => {
                if pending_line_ends > 0 && digits > 0 {
                    line_ends += pending_line_ends;
                    if lines_part {
                        break;
                    }
                }
                pending_line_ends = 0;
                point = true;
                text.push(byte);
            }
            Class::Letter if byte.eq_ignore_ascii_case(&b'e') && !exponent && digits > 0 => {
                let sign = usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
                if !bytes.get(at + 1 + sign).is_some_and(u8::is_ascii_digit) {
                    break;
                }
                exponent = true;
                text.push(b'e');
            }
            Class::LineEnd => {
                pending_line_ends += usize::from(pending_line_ends == 0);
                at += 1;
                continue;
            }
            Class::Control => {
                at += 1;
                continue;
            }
            Class::Escape => match envelope::device_control(&bytes[at..]) {
                Some(found) => {
                    at += found.bytes;
                    continue;
                }
                None => break,
            },
            _ => break,
        }
        at += 1;
        end = at;
    }
    let value = double::<_, nom::error::Error<&[u8]>>.parse(&text[..]).ok().map(|(_, value)| value);
    // 40 digits and more before the point are out of range anyway: all that matters is that they stay so.
    let value = value.map(|value| if dropped > 0 { f64::INFINITY } else { value }).filter(|_| digits > 0);
    ScannedNumber { value, bytes: end.max(1), line_ends }
}
