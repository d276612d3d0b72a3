//! Escape sequences: device control of plotters, PCL and RTL, and the ways between them and
//! HP-GL/2.

use nom::Parser as _;
use nom::branch::alt;
use nom::bytes::complete::{tag, take, take_while, take_while1};
use nom::character::complete::{char, one_of, satisfy};
use nom::combinator::{eof, map, not, opt, recognize, success, value, verify};
use nom::sequence::{pair, preceded};

use super::{Input, Parsed};

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
    Unknown,
}

/// `escape = device-control | end-of-job | mode | reset | pcl | unknown`, with all binary data that
/// it announces.
///
/// `unknown = ESC [ "0" to "~" ]`
pub(crate) fn escape(input: Input<'_>) -> Parsed<'_, Escape> {
    let unknown = alt((value((), satisfy(|c| ('0'..='~').contains(&c))), success(())));
    let other = preceded(
        char('\x1b'),
        alt((end_of_job, mode, reset, map(pcl, Escape::Pcl), value(Escape::Unknown, unknown))),
    );
    alt((map(device_control, Escape::DeviceControl), other)).parse(input)
}

/// A device control sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct DeviceControl {
    /// Whether it has the colon that ends its parameters, where it takes any.
    pub(crate) terminated: bool,
}

/// `device-control = ESC "." ( letter { digit | ";" | "," | SP | "-" } [ ":" ] | byte )`
///
/// Parameters are whole numbers between semicolons and end at a colon. Any other byte ends them
/// too: a missing colon must not swallow the plot.
pub(crate) fn device_control(input: Input<'_>) -> Parsed<'_, DeviceControl> {
    let parameters = take_while(|b: u8| b.is_ascii_digit() || matches!(b, b';' | b',' | b' ' | b'-'));
    let with_parameters = preceded((one_of("@HIMNPSTQhimnpstq"), parameters), opt(char(':')));
    let control = alt((
        map(with_parameters, |colon| DeviceControl { terminated: colon.is_some() }),
        map(take(1_usize), |_| DeviceControl { terminated: true }),
    ));
    preceded(tag("\x1b."), control).parse(input)
}

/// `end-of-job = "%-12345X"`
fn end_of_job(input: Input<'_>) -> Parsed<'_, Escape> {
    value(Escape::EndOfJob, tag("%-12345X")).parse(input)
}

/// `mode = "%" [ number ] ( "A" | "B" )`
fn mode(input: Input<'_>) -> Parsed<'_, Escape> {
    let (rest, (number, letter)) = preceded(char('%'), pair(opt(number), one_of("AB"))).parse(input)?;
    let mode =
        if letter == 'A' { Escape::LeaveHpGl } else { Escape::EnterHpGl(number.unwrap_or(0.0) as i32) };
    Ok((rest, mode))
}

/// `reset = "E"`
fn reset(input: Input<'_>) -> Parsed<'_, Escape> {
    value(Escape::Reset, char('E')).parse(input)
}

/// What matters of a PCL sequence.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pcl {
    /// Whether binary data follow it: raster rows, fonts, transparent text.
    pub(crate) binary: bool,
    /// Picture frame width and height, decipoints.
    pub(crate) frame: (Option<f64>, Option<f64>),
    /// Size of the plot that is scaled to the picture frame, inches.
    pub(crate) plot_size: (Option<f64>, Option<f64>),
}

/// `pcl = family [ group ] { field }`, up to a field that ends in a capital letter, then its binary
/// data.
///
/// `family = "!" to "/" - "."`, `group = 0x60 to "~"`. Binary data inside a sequence are skipped as
/// well; a damaged sequence ends after its last whole field.
fn pcl(input: Input<'_>) -> Parsed<'_, Pcl> {
    let family = satisfy(|c| ('!'..='/').contains(&c) && c != '.');
    let group = opt(satisfy(|c| ('`'..='~').contains(&c)));
    let (mut rest, names) = pair(family, group).parse(input)?;
    let mut found = Pcl::default();
    loop {
        let Ok((after, (size, letter))) = field(rest) else { return Ok((rest, found)) };
        let data_bytes = match (names, letter.to_ascii_uppercase()) {
            (_, b'W') | (('*', Some('b')), b'V') | (('&', Some('p')), b'X') => size.max(0.0) as usize,
            _ => 0,
        };
        match (names, letter.to_ascii_uppercase()) {
            (('*', Some('c')), b'X') => found.frame.0 = Some(size),
            (('*', Some('c')), b'Y') => found.frame.1 = Some(size),
            (('*', Some('c')), b'K') => found.plot_size.0 = Some(size),
            (('*', Some('c')), b'L') => found.plot_size.1 = Some(size),
            _ => {}
        }
        rest = &after[data_bytes.min(after.len())..];
        if !letter.is_ascii_lowercase() {
            found.binary = data_bytes > 0;
            return Ok((rest, found));
        }
    }
}

/// `field = [ number ] "@" to "~"`; a missing number is 0.
fn field(input: Input<'_>) -> Parsed<'_, (f64, u8)> {
    let letter =
        map(verify(take(1_usize), |letter: &[u8]| (b'@'..=b'~').contains(&letter[0])), |l: &[u8]| l[0]);
    pair(map(opt(number), Option::unwrap_or_default), letter).parse(input)
}

/// `number = [ "+" | "-" ] ( digit | "." ) { digit | "." }`; what is no number with that many
/// points is 0.
fn number(input: Input<'_>) -> Parsed<'_, f64> {
    let digits = take_while1(|b: u8| b.is_ascii_digit() || b == b'.');
    map(recognize((opt(one_of("+-")), digits)), |text: &[u8]| {
        std::str::from_utf8(text).ok().and_then(|text| text.parse().ok()).unwrap_or(0.0)
    })
    .parse(input)
}

/// `text = { byte - ESC }`, at least one byte of the file left: what a printer sets in its own
/// fonts.
pub(crate) fn text(input: Input<'_>) -> Parsed<'_, Input<'_>> {
    preceded(not(eof), take_while(|b| b != 0x1b)).parse(input)
}
