//! What stands in a list of numbers besides plain ones.

use nom::Parser as _;
use nom::branch::alt;
use nom::bytes::complete::take_while1;
use nom::combinator::{map, opt, value};

use super::bytes::{Class, class, one};
use super::escape::device_control;
use super::number::{LineEnds, Unusual, unusual};
use super::text::quoted;
use super::{Input, Parsed, mismatch};

/// A part of a list of numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Part {
    Number(Unusual),
    Comma,
    /// Blanks and line ends.
    Gap,
    /// A byte that is skipped.
    Control,
    /// Device control (`ESC .`), which plotters obey in the middle of a command.
    DeviceControl,
    /// A string in quotes (`BP` names the plot in one).
    Quoted,
    /// A byte without a meaning here.
    Stray,
}

/// `part = number | "," | gap | control | device-control | quoted | stray`; nothing else belongs to
/// a list.
pub(crate) fn part(input: Input<'_>, meaning: LineEnds) -> Parsed<'_, Part> {
    let gap = take_while1(|b| matches!(class(b), Class::Blank | Class::LineEnd));
    let number = |input| number(input, meaning);
    alt((
        map(number, Part::Number),
        value(Part::Gap, gap),
        value(Part::Comma, one(Class::Comma)),
        value(Part::Control, one(Class::Control)),
        value(Part::DeviceControl, device_control),
        value(Part::Quoted, quoted),
        value(Part::Stray, one(Class::Other)),
    ))
    .parse(input)
}

fn number(input: Input<'_>, meaning: LineEnds) -> Parsed<'_, Unusual> {
    match input.first().map(|&byte| class(byte)) {
        Some(Class::Digit | Class::Sign | Class::Point) => unusual(input, meaning),
        _ => mismatch(input),
    }
}

/// `list-end = [ ";" | ":" ]`: the next name ends a list, too.
pub(crate) fn list_end(input: Input<'_>) -> Parsed<'_, Option<u8>> {
    opt(one(Class::Terminator)).parse(input)
}
