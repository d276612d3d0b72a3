//! Commands whose parameters are not numbers: `LB BL WD DT SM CO PE`.

use drawing::Span;
use nom::Parser as _;
use nom::character::complete::char;
use nom::combinator::opt;

use super::state::{Head, Parser};
use crate::codes;
use crate::grammar::encoded::data;
use crate::grammar::number::LineEnds;
use crate::grammar::text::{Definition, LabelEnd, comment, definition, label, symbol};
use crate::mnemonic::Mnemonic;

impl Parser<'_> {
    /// `LB`, `BL`, `WD`: text up to the terminator.
    pub(super) fn label(&mut self, mnemonic: Mnemonic, start: usize) -> Option<Head> {
        let terminator = self.terminator;
        let terminated = self.last_of(terminator) >= Some(self.at());
        let (text, end) = self.take(|input| label(input, terminator, terminated))?;
        let mut text = self.span_of(text);
        if end != LabelEnd::Terminator {
            self.report(codes::LABEL_WITHOUT_TERMINATOR, mnemonic, Span { start, end: text.end }, || {
                let end_name = if end == LabelEnd::Eof { "the end of the file" } else { "the next command" };
                let terminator = terminator.escape_ascii();
                (
                    format!(
                        "the text of `{mnemonic}` has no terminator (`{terminator}`); it is ended at {end_name}"
                    ),
                    Some("end labels with the byte 3, or name the terminator that the file uses".into()),
                )
            });
        }
        match end {
            LabelEnd::Terminator => {
                text.end += usize::from(self.prints_terminator);
                self.rest = &self.rest[1..];
            }
            LabelEnd::Recovered => self.rest = &self.rest[1..],
            LabelEnd::Escape | LabelEnd::Eof => {}
        }
        Some(self.finish(mnemonic, start, text))
    }

    /// `DT`: the next byte is the terminator of labels; without one the default is restored.
    pub(super) fn define_terminator(&mut self, mnemonic: Mnemonic, start: usize) -> Option<Head> {
        let at = self.at();
        match self.take(definition)? {
            Definition::Default => {
                self.restore_terminator();
                return Some(self.textless(mnemonic, start));
            }
            Definition::Impossible(byte) => {
                self.report(codes::BAD_TERMINATOR, mnemonic, Span { start: at, end: at + 1 }, || {
                    (format!("byte {byte} cannot end labels; the terminator stays as it is"), None)
                });
            }
            Definition::Byte(byte) => self.terminator = byte,
        }
        self.number_list(mnemonic, LineEnds::Join, true);
        self.prints_terminator = match self.parameters.first() {
            Some(&mode) => mode == 0.0,
            None => !self.is_hpgl2(),
        };
        Some(self.finish(mnemonic, start, Span { start: at, end: at + 1 }))
    }

    /// `SM`: the next byte is the symbol; without one symbol mode ends.
    pub(super) fn symbol(&mut self, mnemonic: Mnemonic, start: usize) -> Option<Head> {
        let text = self.take(symbol)?;
        let text = self.span_of(text);
        Some(self.finish(mnemonic, start, text))
    }

    /// `CO`: a comment in quotes, in which semicolons mean nothing; without quotes up to the
    /// semicolon.
    pub(super) fn comment(&mut self, mnemonic: Mnemonic, start: usize) -> Option<Head> {
        let comment = self.take(comment)?;
        if let Some(quote) = comment.open_quote {
            let span = Span { start, end: self.span_of(quote).end };
            self.report(codes::OPEN_COMMENT, mnemonic, span, || {
                ("the comment's quote is never closed; it is ended at the semicolon".into(), None)
            });
        }
        let text = self.span_of(comment.text);
        self.take(|input| opt(char(';')).parse(input));
        Some(self.finish(mnemonic, start, text))
    }

    /// `PE`: data up to the first byte that cannot be data.
    pub(super) fn encoded(&mut self, mnemonic: Mnemonic, start: usize) -> Option<Head> {
        let input = self.rest;
        let (rest, text) = data(input, || self.is_reencoded()).ok()?;
        self.rest = rest;
        let text = self.span_of(text);
        if self.take(|input| char(';').parse(input)).is_none() {
            self.report(codes::ENCODED_WITHOUT_TERMINATOR, mnemonic, Span { start, end: text.end }, || {
                (
                    "the encoded polyline has no terminator; it is ended after its last whole number".into(),
                    Some("end PE with a semicolon".into()),
                )
            });
        }
        Some(self.finish(mnemonic, start, text))
    }
}
