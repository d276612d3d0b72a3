//! Job control (PJL), line by line.

use nom::Parser as _;
use nom::bytes::complete::{tag_no_case, take_while};
use nom::combinator::opt;
use nom::sequence::preceded;

use super::{Input, Parsed};

/// `job-line = "@PJL" { byte - LF - ESC } { CR | LF }`, in any case; the value is the language that
/// it enters, if it does.
pub(crate) fn job_line(input: Input<'_>) -> Parsed<'_, Option<Input<'_>>> {
    let text = take_while(|b| b != b'\n' && b != 0x1b);
    let (rest, text) = preceded(tag_no_case("@PJL"), text).parse(input)?;
    let (rest, _) = take_while(|b| matches!(b, b'\r' | b'\n')).parse(rest)?;
    let (_, language) = opt(enter_language).parse(text)?;
    Ok((rest, language))
}

/// `enter-language = { SP } "ENTER" { SP } "LANGUAGE" { SP | "=" } { byte - white-space }`, in any
/// case.
fn enter_language(input: Input<'_>) -> Parsed<'_, Input<'_>> {
    let blanks = || take_while(|b| b == b' ');
    let keywords = (blanks(), tag_no_case("ENTER"), blanks(), tag_no_case("LANGUAGE"));
    let equals = take_while(|b| matches!(b, b' ' | b'='));
    let language = take_while(|b: u8| !b.is_ascii_whitespace());
    preceded((keywords, equals), language).parse(input)
}
