//! Numbers: the plain ones that files consist of, and those that are written in unusual ways.

use nom::Parser as _;
use nom::branch::alt;
use nom::bytes::complete::take_while1;
use nom::combinator::value;
use nom::multi::fold_many0;
use nom::number::complete::double;

use super::bytes::{Class, class};
use super::escape::device_control;
use super::{Input, Parsed, mismatch};
use crate::units::LARGEST_NUMBER;

/// More digits than these do not fit into a whole number that an f64 holds exactly.
const EXACT_DIGITS: usize = 15;
const POWERS_OF_TEN: [f64; EXACT_DIGITS + 1] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// `plain = [ "+" | "-" ] digit { digit } [ "." { digit } ]` or with digits after the point only;
/// up to 15 digits, in range, and after them (not read) `","`, `";"`, SP, or a letter that begins
/// no exponent.
///
/// The hot loop of the crate. What it does not match is read by [`unusual`].
#[inline]
pub(crate) fn plain(input: Input<'_>) -> Parsed<'_, f64> {
    let sign = usize::from(matches!(input.first(), Some(b'+' | b'-')));
    let mut whole = 0;
    let mut at = digits(input, sign, &mut whole);
    let mut count = at - sign;
    let mut fraction = 0;
    if input.get(at) == Some(&b'.') {
        let point = at + 1;
        at = digits(input, point, &mut whole);
        fraction = at - point;
        count += fraction;
    }
    if !(1..=EXACT_DIGITS).contains(&count)
        || !matches!(input.get(at), Some(b',' | b';' | b' ' | b'A'..=b'D' | b'F'..=b'Z'))
    {
        return mismatch(input);
    }
    let mut value = whole as f64;
    if fraction > 0 {
        // Both are exact, so that the quotient is the nearest f64.
        value /= POWERS_OF_TEN[fraction];
    }
    if value >= LARGEST_NUMBER {
        return mismatch(input);
    }
    Ok((&input[at..], if input[0] == b'-' { -value } else { value }))
}

/// `{ digit }` from `at` on, added to the number `whole`; the value is where they end.
#[inline]
fn digits(input: Input<'_>, mut at: usize, whole: &mut u64) -> usize {
    while let Some(digit) = input.get(at).map(|b| b.wrapping_sub(b'0'))
        && digit < 10
    {
        *whole = whole.wrapping_mul(10).wrapping_add(u64::from(digit));
        at += 1;
    }
    at
}

/// What a line end between two digits means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LineEnds {
    /// Nothing: the digits are one number.
    Join,
    /// The end of a number.
    Part,
}

/// A number that is not [`plain`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unusual {
    /// Its value; `None` where a sign or a point stands alone.
    pub(crate) value: Option<f64>,
    /// How many line ends stand between its digits; where they part numbers, 1 if a digit follows
    /// after one.
    pub(crate) line_ends: usize,
}

/// `filler = { control | line-end | device-control }`: what may stand between the digits of a
/// number. The value is whether there is a line end in it.
fn filler(input: Input<'_>) -> Parsed<'_, bool> {
    let control = value(false, take_while1(|b| class(b) == Class::Control));
    let line_end = value(true, take_while1(|b| class(b) == Class::LineEnd));
    let kind = alt((control, line_end, value(false, device_control)));
    fold_many0(kind, || false, |any, line_end| any | line_end).parse(input)
}

/// `unusual = [ "+" | "-" ] { filler ( digit | point ) } [ filler "E" [ "+" | "-" ] digit { filler digit } ]`,
/// at most one point; `input` begins with a digit, a sign or a point.
///
/// An exponent is read where a digit follows the `E`, with or without a sign: no name of a command
/// has a digit in it, so that nothing else can be meant.
pub(crate) fn unusual(input: Input<'_>, meaning: LineEnds) -> Parsed<'_, Unusual> {
    // More digits than these change no f64.
    const LONGEST: usize = 40;
    let mut text: Vec<u8> = Vec::with_capacity(24);
    // After the last byte that is the number's own: filler at its end is not.
    let mut rest = input;
    let (mut line_ends, mut pending) = (0, false);
    let (mut point, mut exponent, mut digits, mut dropped) = (false, false, 0, false);
    loop {
        let (after, line_end) = filler(rest)?;
        pending |= line_end;
        let Some((&byte, after)) = after.split_first() else { break };
        let class = class(byte);
        if class == Class::Digit || (class == Class::Point && !point && !exponent) {
            if pending && digits > 0 {
                line_ends += 1;
                if meaning == LineEnds::Part {
                    break;
                }
            }
            pending = false;
        }
        match class {
            Class::Digit => {
                if digits < LONGEST || exponent {
                    text.push(byte);
                } else {
                    dropped |= !point;
                }
                digits += 1;
            }
            Class::Sign if text.is_empty() || text.last() == Some(&b'e') => text.push(byte),
            Class::Point if !point && !exponent => {
                point = true;
                text.push(byte);
            }
            Class::Letter if byte.eq_ignore_ascii_case(&b'e') && !exponent && digits > 0 => {
                if !matches!(after, [b'0'..=b'9', ..] | [b'+' | b'-', b'0'..=b'9', ..]) {
                    break;
                }
                exponent = true;
                text.push(b'e');
            }
            _ => break,
        }
        rest = after;
    }
    let value = double::<_, nom::error::Error<&[u8]>>.parse(&text[..]).ok().map(|(_, value)| value);
    // 40 digits and more before the point are out of range anyway: all that matters is that they
    // stay so.
    let value = value.map(|value| if dropped { f64::INFINITY } else { value }).filter(|_| digits > 0);
    Ok((rest, Unusual { value, line_ends }))
}
