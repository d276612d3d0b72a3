//! The syntax of a file: commands with their parameters and bytes, without their meaning.

use drawing::Span;

use crate::diagnostics::Findings;
use crate::mnemonic::Mnemonic;
use crate::summary::Wrappers;

/// One command of a file, as the parser hands it to the interpreter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command<'a> {
    /// Its name.
    pub mnemonic: Mnemonic,
    /// Its bytes, from the mnemonic to the terminator.
    pub span: Span,
    /// Its number in the file, from 1. A very long coordinate list arrives in pieces that share one
    /// number.
    pub number: usize,
    /// Its numbers.
    pub parameters: &'a [f64],
    /// The bytes of its text: a label without its terminator, a symbol, the data of a polyline
    /// encoded command. Empty for all others.
    pub text: &'a [u8],
    /// Where the text lies.
    pub text_span: Span,
    /// The file is Latin-1 that was saved as UTF-8.
    pub(crate) reencoded: bool,
}

/// What the parser noticed about the file as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Hints {
    /// The file is UTF-8 made from Latin-1: bytes above 127 arrive as two.
    pub(crate) reencoded: bool,
    /// What stands around the commands.
    pub(crate) wrappers: Wrappers,
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

/// The commands of a file in order, and the syntax errors found.
#[derive(Clone, Debug)]
pub struct Syntax<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) entries: Vec<Entry>,
    pub(crate) parameters: Vec<f64>,
    pub(crate) findings: Findings,
    pub(crate) hints: Hints,
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
