//! What stands around the language: device control, PCL, RTL and job control. Grammars only; what they mean for the
//! bytes after them is the parser's business.

use nom::branch::alt;
use nom::bytes::complete::{tag, take, take_while, take_while1};
use nom::character::complete::{char, one_of, satisfy};
use nom::combinator::{map, opt, recognize, value, verify};
use nom::multi::many0_count;
use nom::sequence::{pair, preceded};
use nom::{IResult, Parser as _};

/// An escape sequence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Escape {
    /// `ESC . x`: device control of a plotter.
    DeviceControl(DeviceControl),
    /// `ESC % # B`: HP-GL/2 follows.
    EnterHpGl(i32),
    /// `ESC % # A`: PCL or RTL follows.
    LeaveHpGl,
    /// `ESC %-12345X`: the job ends, job control may follow.
    EndOfJob,
    /// `ESC E`.
    Reset,
    /// Any other PCL or RTL sequence, with what it carries.
    Pcl(Pcl),
    /// ESC and a byte, or ESC at the end.
    Other,
}

/// A device control sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct DeviceControl {
    /// Its length, ESC included.
    pub(crate) bytes: usize,
    /// Whether it has the colon that ends its parameters, where it takes any.
    pub(crate) terminated: bool,
}

/// What matters of a PCL sequence.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pcl {
    /// Bytes of binary data inside and after it: raster rows, fonts, transparent text.
    pub(crate) binary: usize,
    /// Picture frame width and height, decipoints.
    pub(crate) frame: (Option<f64>, Option<f64>),
}

type Input<'a> = &'a [u8];

/// The device control sequence at the start of `bytes`, if there is one.
///
/// Parameters are whole numbers between semicolons and end at a colon. Any other byte ends them too: a missing colon
/// must not swallow the plot.
pub(crate) fn device_control(bytes: &[u8]) -> Option<DeviceControl> {
    let mut with_parameters = (
        tag(&b"\x1b."[..]),
        one_of(&b"@HIMNPSTQhimnpstq"[..]),
        take_while(|b: u8| b.is_ascii_digit() || matches!(b, b';' | b',' | b' ' | b'-')),
        opt(char(':')),
    );
    let result: IResult<Input, _> = with_parameters.parse(bytes);
    if let Ok((rest, (_, _, _, colon))) = result {
        return Some(DeviceControl { bytes: bytes.len() - rest.len(), terminated: colon.is_some() });
    }
    let result: IResult<Input, _> = recognize((tag(&b"\x1b."[..]), take(1usize))).parse(bytes);
    result.ok().map(|(_, sequence)| DeviceControl { bytes: sequence.len(), terminated: true })
}

/// The escape sequence at the start of `bytes`, which begin with ESC, and its length with all data it carries.
pub(crate) fn escape(bytes: &[u8]) -> (Escape, usize) {
    if let Some(found) = device_control(bytes) {
        return (Escape::DeviceControl(found), found.bytes);
    }
    let mut grammar = preceded(
        char('\x1b'),
        alt((
            value(Escape::EndOfJob, tag(&b"%-12345X"[..])),
            mode,
            value(Escape::Reset, char('E')),
            map(pcl, Escape::Pcl),
            value(Escape::Other, satisfy(|c| ('0'..='~').contains(&c))),
            value(Escape::Other, nom::combinator::success(())),
        )),
    );
    match grammar.parse(bytes) {
        Ok((rest, found)) => {
            let length = bytes.len() - rest.len();
            match found {
                Escape::Pcl(pcl) => (found, length.saturating_add(pcl.binary).min(bytes.len())),
                _ => (found, length),
            }
        }
        Err(_) => (Escape::Other, 1),
    }
}

/// A decimal number of PCL.
fn number(input: Input) -> IResult<Input, f64> {
    let mut digits =
        recognize((opt(one_of(&b"+-"[..])), take_while1(|b: u8| b.is_ascii_digit() || b == b'.')));
    let (rest, text) = digits.parse(input)?;
    let value = std::str::from_utf8(text).ok().and_then(|text| text.parse().ok()).unwrap_or(0.0);
    Ok((rest, value))
}

/// `% # A` and `% # B`.
fn mode(input: Input) -> IResult<Input, Escape> {
    let mut grammar = (char('%'), opt(number), one_of(&b"AB"[..]));
    let (rest, (_, parameter, letter)) = grammar.parse(input)?;
    let found =
        if letter == 'A' { Escape::LeaveHpGl } else { Escape::EnterHpGl(parameter.unwrap_or(0.0) as i32) };
    Ok((rest, found))
}

/// A parametrised sequence: a character `!` to `/`, a group character, then values each ended by a letter, the last a
/// capital one.
fn pcl(input: Input) -> IResult<Input, Pcl> {
    let (rest, (family, group)) =
        pair(satisfy(|c| ('!'..='/').contains(&c) && c != '.'), opt(satisfy(|c| ('`'..='~').contains(&c))))
            .parse(input)?;
    let mut found = Pcl::default();
    let mut remaining = rest;
    loop {
        let mut field =
            pair(opt(number), verify(take(1usize), |letter: &[u8]| (b'@'..=b'~').contains(&letter[0])));
        let parsed: IResult<Input, _> = field.parse(remaining);
        let Ok((after, (parameter, letter))) = parsed else {
            // Damaged: what was read so far is skipped.
            return Ok((remaining, found));
        };
        remaining = after;
        let (size, name) = (parameter.unwrap_or(0.0), letter[0]);
        let carries = match (family, group, name.to_ascii_uppercase()) {
            (_, _, b'W') | ('*', Some('b'), b'V') | ('&', Some('p'), b'X') => size.max(0.0) as usize,
            _ => 0,
        };
        match (family, group, name.to_ascii_uppercase()) {
            ('*', Some('c'), b'X') => found.frame.0 = Some(size),
            ('*', Some('c'), b'Y') => found.frame.1 = Some(size),
            _ => {}
        }
        if name.is_ascii_uppercase() || name == b'@' || !name.is_ascii_alphabetic() {
            found.binary = found.binary.saturating_add(carries);
            return Ok((remaining, found));
        }
        remaining = &remaining[carries.min(remaining.len())..];
    }
}

/// A line of job control at the start of `bytes`, and the language it enters, if it does.
pub(crate) fn job_line(bytes: &[u8]) -> Option<(usize, Option<&[u8]>)> {
    let mut line =
        (nom::bytes::complete::tag_no_case(&b"@PJL"[..]), take_while(|b: u8| b != b'\n' && b != 0x1b));
    let parsed: IResult<Input, _> = line.parse(bytes);
    let (rest, (_, text)) = parsed.ok()?;
    let ended: IResult<Input, usize> = many0_count(one_of(&b"\r\n"[..])).parse(rest);
    let rest = ended.map_or(rest, |(rest, _)| rest);
    Some((bytes.len() - rest.len(), entered_language(text)))
}

fn entered_language(text: &[u8]) -> Option<&[u8]> {
    let mut grammar = (
        take_while(|b: u8| b == b' '),
        nom::bytes::complete::tag_no_case(&b"ENTER"[..]),
        take_while(|b: u8| b == b' '),
        nom::bytes::complete::tag_no_case(&b"LANGUAGE"[..]),
        take_while(|b: u8| b == b' ' || b == b'='),
        take_while(|b: u8| !b.is_ascii_whitespace()),
    );
    let parsed: IResult<Input, _> = grammar.parse(text);
    parsed.ok().map(|(_, found)| found.5)
}
