//! What the parser knows between two bytes, and how it reports.

use drawing::{Point, Span};
use nom::Offset as _;

use crate::codes::{self, Code};
use crate::diagnostics::Findings;
use crate::grammar::{Input, Parsed};
use crate::mnemonic::Mnemonic;
use crate::syntax::Hints;

/// The terminator of labels until `DT` names another: ETX.
const ETX: u8 = 3;

/// In what language the next byte is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Language {
    HpGl,
    Pcl,
    Job,
}

/// The result of a search that is done at most once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Searched {
    NotYet,
    Nowhere,
    At(usize),
}

/// What one step of reading comes to.
pub(super) enum Step {
    /// The file is at its end.
    End,
    /// Something was read that is no command.
    Nothing,
    Command(Head),
}

impl From<Option<Head>> for Step {
    fn from(head: Option<Head>) -> Self {
        head.map_or(Self::Nothing, Self::Command)
    }
}

/// A command without its parameters, which the parser keeps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Head {
    pub(super) mnemonic: Mnemonic,
    pub(super) span: Span,
    pub(super) number: usize,
    pub(super) text: Span,
}

/// Reads commands one after the other.
pub(crate) struct Parser<'a> {
    pub(super) bytes: Input<'a>,
    /// What is still to be read of them.
    pub(super) rest: Input<'a>,
    pub(super) language: Language,
    pub(super) default_terminator: u8,
    pub(super) terminator: u8,
    /// The terminator is printed too (`DT` with mode 0, or in HP-GL without a mode).
    pub(super) prints_terminator: bool,
    pub(super) number: usize,
    pub(super) parameters: Vec<f64>,
    /// The mnemonic and start of a coordinate list whose next piece begins here.
    pub(super) unfinished: Option<(Mnemonic, usize)>,
    pub(crate) findings: Findings,
    pub(crate) hints: Hints,
    /// Where each byte value occurs last, as far as it was asked for.
    last: Vec<Searched>,
    /// The next entry into HP-GL/2, once searched for.
    pub(super) next_entry: Searched,
    encoding_known: bool,
    /// Whether the file is HP-GL/2, once that was asked for.
    pub(super) is_hpgl2: Option<bool>,
}

impl<'a> Parser<'a> {
    pub(crate) fn new(bytes: Input<'a>, label_terminator: Option<u8>) -> Self {
        let terminator = label_terminator.unwrap_or(ETX);
        Self {
            bytes,
            rest: bytes,
            language: Language::HpGl,
            default_terminator: terminator,
            terminator,
            prints_terminator: false,
            number: 0,
            parameters: Vec::new(),
            unfinished: None,
            findings: Findings::default(),
            hints: Hints::default(),
            last: vec![Searched::NotYet; 256],
            next_entry: Searched::NotYet,
            encoding_known: false,
            is_hpgl2: None,
        }
    }

    /// How many commands were met up to here, unknown ones included.
    pub(crate) fn number(&self) -> usize {
        self.number
    }

    /// The offset of the next byte.
    #[inline]
    pub(super) fn at(&self) -> usize {
        self.bytes.len() - self.rest.len()
    }

    /// Reads a production; `None`, and nothing read, where it does not match.
    #[inline]
    pub(super) fn take<T>(&mut self, production: impl FnOnce(Input<'a>) -> Parsed<'a, T>) -> Option<T> {
        let (rest, value) = production(self.rest).ok()?;
        self.rest = rest;
        Some(value)
    }

    /// Where a part of the file lies in it.
    pub(super) fn span_of(&self, part: Input<'a>) -> Span {
        let start = self.bytes.offset(part);
        Span { start, end: start + part.len() }
    }

    /// A command that ends here.
    #[inline]
    pub(super) fn finish(&mut self, mnemonic: Mnemonic, start: usize, text: Span) -> Head {
        Head { mnemonic, span: Span { start, end: self.at() }, number: self.number, text }
    }

    /// A command without text that ends here.
    #[inline]
    pub(super) fn textless(&mut self, mnemonic: Mnemonic, start: usize) -> Head {
        let at = self.at();
        self.finish(mnemonic, start, Span { start: at, end: at })
    }

    pub(super) fn restore_terminator(&mut self) {
        self.terminator = self.default_terminator;
        self.prints_terminator = false;
    }

    /// Where a byte occurs last in the file.
    pub(super) fn last_of(&mut self, byte: u8) -> Option<usize> {
        let bytes = self.bytes;
        let last = &mut self.last[usize::from(byte)];
        if *last == Searched::NotYet {
            *last = bytes.iter().rposition(|&b| b == byte).map_or(Searched::Nowhere, Searched::At);
        }
        match *last {
            Searched::At(offset) => Some(offset),
            _ => None,
        }
    }

    /// Whether the file is Latin-1 that was saved as UTF-8: all of it reads as UTF-8, no character
    /// is beyond Latin-1, and some byte pair stands for one of the bytes that end numbers in
    /// encoded polylines.
    pub(super) fn is_reencoded(&mut self) -> bool {
        if !self.encoding_known {
            self.encoding_known = true;
            self.hints.reencoded = std::str::from_utf8(self.bytes).is_ok_and(|text| {
                text.chars().all(|c| c <= '\u{ff}')
                    && text.chars().any(|c| ('\u{c0}'..='\u{fe}').contains(&c))
            });
        }
        self.hints.reencoded
    }

    pub(super) fn report(
        &mut self,
        code: Code,
        mnemonic: Mnemonic,
        span: Span,
        message: impl FnOnce() -> (String, Option<String>),
    ) {
        // The parser does not know the pen position: `Findings::set_pen_position` fills it in.
        self.findings.report(code, mnemonic, span, self.number.max(1), Point::ZERO, message);
    }

    pub(super) fn report_control(&mut self, mnemonic: Mnemonic, at: usize) {
        let byte = self.bytes[at];
        self.report(codes::CONTROL_BYTE, mnemonic, Span { start: at, end: at + 1 }, || {
            (format!("byte {byte} is skipped"), None)
        });
    }

    pub(super) fn report_stray(&mut self, mnemonic: Mnemonic, at: usize) {
        let byte = self.bytes[at];
        self.report(codes::STRAY_BYTE, mnemonic, Span { start: at, end: at + 1 }, || {
            (format!("`{}` has no meaning here and is skipped", byte.escape_ascii()), None)
        });
    }
}
