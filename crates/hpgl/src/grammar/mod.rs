//! The grammar of HP-GL and HP-GL/2, as nom parsers: one production a function, its syntax in the
//! doc comment.
//!
//! ```text
//! file       = { gap | command | parameters | prose | escape | job-line | control | stray }
//! command    = name ( parameters | label | definition | symbol | comment | encoded )
//! name       = letter letter                                        (name)
//! parameters = { number | "," | blank | quoted | ... } [ ";" ]      (parameters, number)
//! label      = { byte } terminator                                  (text)
//! encoded    = { flag | coordinate } [ ";" ]                        (encoded)
//! escape     = ESC "." ... | ESC "%" ... | ESC "E" | ...            (escape)
//! job-line   = "@PJL" { byte } line-end                             (job)
//! ```
//!
//! Notation: `{ x }` any number of times, `[ x ]` at most once, `x - y` x but not y. A production
//! knows neither the parser's state nor diagnostics: which language the next byte is in, what ends
//! a label, what to do about damage and what to report is decided in [`crate::parser`].
//!
//! Two parsers are written by hand, as functions of nom's type, because files consist of what they
//! read: [`number::plain`] and [`encoded::data`].

pub(crate) mod bytes;
pub(crate) mod encoded;
pub(crate) mod escape;
pub(crate) mod job;
pub(crate) mod name;
pub(crate) mod number;
pub(crate) mod parameters;
pub(crate) mod text;

/// What is still to be read.
pub(crate) type Input<'a> = &'a [u8];

/// What a production comes to: the rest of the input, and a value.
pub(crate) type Parsed<'a, T> = nom::IResult<Input<'a>, T>;

/// The error of a production that does not match.
fn mismatch<T>(input: Input<'_>) -> Parsed<'_, T> {
    Err(nom::Err::Error(nom::error::Error::new(input, nom::error::ErrorKind::Verify)))
}
