//! What a file says, before any of it is given a meaning: commands with their parameters and bytes.

use std::fmt;

use drawing::Span;

use crate::diagnostics::Findings;

/// The two letters that name a command, in capitals.
///
/// Three names are not of the language: they stand for what the wrappers around it say ([`Mnemonic::RESET`] and so
/// on), and print in angle brackets.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Mnemonic(pub [u8; 2]);

impl Mnemonic {
    /// A printer reset (`ESC E`) or the end of a job (`ESC %-12345X`): what was drawn so far is a page of its own.
    pub const RESET: Self = Self([0, 1]);
    /// A PCL picture frame (`ESC *c #x#Y`); parameters: width and height in plotter units.
    pub const PICTURE_FRAME: Self = Self([0, 2]);
    /// Entry into HP-GL/2 from PCL or RTL (`ESC %#B`); parameter: the number.
    pub const ENTER: Self = Self([0, 3]);
    /// No command at all: findings between commands are filed under it.
    pub(crate) const NONE: Self = Self([0, 0]);
}

impl fmt::Display for Mnemonic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::RESET => f.write_str("<reset>"),
            Self::PICTURE_FRAME => f.write_str("<picture frame>"),
            Self::ENTER => f.write_str("<enter HP-GL/2>"),
            Self::NONE => f.write_str("<none>"),
            Self([a, b]) => write!(f, "{}{}", a.escape_ascii(), b.escape_ascii()),
        }
    }
}

impl fmt::Debug for Mnemonic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// One command of a file, as the parser hands it to the interpreter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command<'a> {
    /// Its name.
    pub mnemonic: Mnemonic,
    /// Its bytes, from the mnemonic to the terminator.
    pub span: Span,
    /// Its number in the file, from 1. A very long coordinate list arrives in pieces that share one number.
    pub number: usize,
    /// Its numbers.
    pub parameters: &'a [f64],
    /// The bytes of its text: a label without its terminator, a symbol, the data of a polyline encoded command.
    /// Empty for all others.
    pub text: &'a [u8],
    /// Where the text lies.
    pub text_span: Span,
    /// The file is Latin-1 that was saved as UTF-8.
    pub(crate) reencoded: bool,
}

/// A command in a [`Syntax`], its numbers kept in a list shared by all.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub(crate) mnemonic: Mnemonic,
    pub(crate) span: Span,
    pub(crate) number: usize,
    pub(crate) first_parameter: usize,
    pub(crate) last_parameter: usize,
    pub(crate) text: Span,
    /// How many findings there were once it was read.
    pub(crate) findings: usize,
}

/// The commands of a file in order, and what was odd about the way it says them.
#[derive(Clone, Debug)]
pub struct Syntax<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) entries: Vec<Entry>,
    pub(crate) parameters: Vec<f64>,
    pub(crate) findings: Findings,
    pub(crate) hints: crate::parser::Hints,
    /// How many commands the file has, unknown ones included.
    pub(crate) command_count: usize,
}

impl<'a> Syntax<'a> {
    /// The file.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// The commands in the order of the file.
    pub fn commands(&self) -> impl Iterator<Item = Command<'_>> {
        self.entries.iter().map(|entry| Command {
            mnemonic: entry.mnemonic,
            span: entry.span,
            number: entry.number,
            parameters: &self.parameters[entry.first_parameter..entry.last_parameter],
            text: &self.bytes[entry.text.start..entry.text.end],
            text_span: entry.text,
            reencoded: self.hints.reencoded,
        })
    }

    /// For each command, how many findings there were once it was read.
    pub(crate) fn findings_until(&self) -> impl Iterator<Item = usize> {
        self.entries.iter().map(|entry| entry.findings)
    }

    /// How many commands there are.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
}
