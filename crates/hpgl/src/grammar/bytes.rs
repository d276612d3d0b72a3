//! Classes of bytes, and the productions that are one byte or a run of them.

use nom::bytes::complete::{take_while, take_while1};
use nom::combinator::opt;
use nom::{Parser as _, combinator::recognize};

use super::{Input, Parsed, mismatch};

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
    /// Carriage return or line feed: skipped, even inside numbers.
    LineEnd,
    /// Semicolon, or the colon that some files write instead.
    Terminator,
    Escape,
    /// Any other control byte, DEL, and bytes above 127 (line noise, byte order marks): skipped.
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

/// One byte of that class.
pub(crate) fn one(of: Class) -> impl Fn(Input<'_>) -> Parsed<'_, u8> {
    move |input| match input {
        [byte, rest @ ..] if class(*byte) == of => Ok((rest, *byte)),
        _ => mismatch(input),
    }
}

/// `gap = ( ";" | ":" | "," | SP | TAB | CR | LF ) { gap }`: what stands between commands.
pub(crate) fn gap(input: Input<'_>) -> Parsed<'_, Input<'_>> {
    take_while1(|b| matches!(class(b), Class::Terminator | Class::Comma | Class::Blank | Class::LineEnd))
        .parse(input)
}

/// `unread = { byte - letter - ESC - ";" - ":" } [ ";" | ":" ]`: the parameters of something that
/// is no command.
pub(crate) fn unread(input: Input<'_>) -> Parsed<'_, Input<'_>> {
    let parameters = take_while(|b| !matches!(class(b), Class::Letter | Class::Escape | Class::Terminator));
    recognize((parameters, opt(one(Class::Terminator)))).parse(input)
}
