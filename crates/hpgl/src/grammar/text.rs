//! Commands whose parameters are not numbers: `LB BL WD DT SM CO`. Where their text ends is the
//! whole question.

use nom::Parser as _;
use nom::branch::alt;
use nom::bytes::complete::{tag, take_until, take_while};
use nom::character::complete::char;
use nom::combinator::{eof, map, opt, peek, recognize, value, verify};
use nom::number::complete::u8 as byte;
use nom::sequence::{delimited, terminated};

use super::bytes::{Class, class, one};
use super::{Input, Parsed};

/// `quoted = '"' { byte - '"' } '"'`.
pub(crate) fn quoted(input: Input<'_>) -> Parsed<'_, Input<'_>> {
    delimited(char('"'), take_until("\""), char('"')).parse(input)
}

/// What ended the text of a label. None of them is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LabelEnd {
    Terminator,
    /// A semicolon or a line end, where a terminator is missing.
    Recovered,
    /// A change of language (`ESC %`).
    Escape,
    /// The end of the file.
    Eof,
}

/// `label = { byte - terminator }`, and what ends it.
///
/// A label without terminator must not swallow the rest of the file. Where none follows
/// (`terminated` is false), it ends at the next semicolon, or at a line end before a
/// [`pen_command`]. Where one follows, but a pen command reads plainly after a semicolon before it,
/// it ends at that semicolon.
#[expect(clippy::unnecessary_wraps, reason = "it has the type of all productions")]
pub(crate) fn label(input: Input<'_>, terminator: u8, terminated: bool) -> Parsed<'_, (Input<'_>, LabelEnd)> {
    let mut at = 0;
    let end = loop {
        let Some(&byte) = input.get(at) else { break LabelEnd::Eof };
        let before_pen_command = || pen_command(&input[at + 1..]).is_ok();
        match byte {
            _ if byte == terminator => break LabelEnd::Terminator,
            b';' if !terminated || before_pen_command() => break LabelEnd::Recovered,
            b'\n' | b'\r' if !terminated && before_pen_command() => break LabelEnd::Recovered,
            0x1b if input.get(at + 1) == Some(&b'%') => break LabelEnd::Escape,
            _ => at += 1,
        }
    };
    Ok((&input[at..], (&input[..at], end)))
}

/// `pen-command = ( "PU" | "PD" | "PA" | "PR" | "SP" ) ( number | ";" | ":" | end )` with blanks
/// and line ends between.
fn pen_command(input: Input<'_>) -> Parsed<'_, Input<'_>> {
    let space = || take_while(|b: u8| b.is_ascii_whitespace());
    let name = alt((tag("PU"), tag("PD"), tag("PA"), tag("PR"), tag("SP")));
    let first = alt((
        value((), one(Class::Digit)),
        value((), one(Class::Sign)),
        value((), one(Class::Point)),
        value((), one(Class::Terminator)),
        value((), eof),
    ));
    recognize((space(), name, space(), first)).parse(input)
}

/// What `DT` makes the terminator of labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Definition {
    /// `DT;`: the usual one again.
    Default,
    Byte(u8),
    /// One of those that the language excludes: NUL, ENQ, ESC. ESC is not read.
    Impossible(u8),
}

/// `definition = ";" | end | byte [ "," ]`; a mode may follow as a number.
pub(crate) fn definition(input: Input<'_>) -> Parsed<'_, Definition> {
    let excluded = verify(byte, |byte| matches!(byte, 0 | 5));
    let escape = map(peek(char('\x1b')), |_| Definition::Impossible(27));
    let named = alt((escape, map(excluded, Definition::Impossible), map(byte, Definition::Byte)));
    alt((
        value(Definition::Default, char(';')),
        value(Definition::Default, eof),
        terminated(named, opt(char(','))),
    ))
    .parse(input)
}

/// `symbol = { SP } [ printable - ";" ]`, then `[ ";" ]`: the byte that `SM` draws at each point.
pub(crate) fn symbol(input: Input<'_>) -> Parsed<'_, Input<'_>> {
    let printable = verify(byte, |&byte| byte > b' ' && byte != b';' && byte != 127);
    delimited(take_while(|b| b == b' '), recognize(opt(printable)), opt(char(';'))).parse(input)
}

/// What `CO` remarks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Comment<'a> {
    pub(crate) text: Input<'a>,
    /// Where a quote stands that is never closed.
    pub(crate) open_quote: Option<Input<'a>>,
}

/// `comment = { SP } [ quoted | '"' ] { byte - ";" - ESC }`, up to a letter right after a quote: a
/// comment that is closed may have no semicolon after it.
pub(crate) fn comment(input: Input<'_>) -> Parsed<'_, Comment<'_>> {
    let (rest, _) = take_while(|b| b == b' ').parse(input)?;
    let (rest, closed) = opt(quoted).parse(rest)?;
    let (rest, open_quote) = opt(recognize(char('"'))).parse(rest)?;
    let open_quote = open_quote.filter(|_| closed.is_none());
    let mut after_quote = closed.is_some();
    let length = rest.iter().position(|&byte| {
        let ends = matches!(byte, b';' | 0x1b) || (after_quote && class(byte) == Class::Letter);
        after_quote = byte == b'"';
        ends
    });
    let rest = &rest[length.unwrap_or(rest.len())..];
    Ok((rest, Comment { text: &input[..input.len() - rest.len()], open_quote }))
}
