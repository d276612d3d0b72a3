//! At a letter: the name of a command, or what to do about letters that are none.

use drawing::Span;

use super::state::Parser;
use crate::codes;
use crate::grammar::bytes::unread;
use crate::grammar::name::{Form, form_of, name, parted_name, prose, stray_letters, vendor_command, word};
use crate::mnemonic::Mnemonic;

impl Parser<'_> {
    /// Reads the name of a command; `None` if the letters are none and were skipped.
    #[inline]
    pub(super) fn name(&mut self) -> Option<(Mnemonic, Form)> {
        let Ok((rest, mnemonic)) = name(self.rest) else { return self.parted_name() };
        if let Some(word) = self.take(prose) {
            let span = self.span_of(word);
            self.number += 1;
            self.report(codes::PROSE, Mnemonic::NONE, span, || {
                ("text between commands is skipped".into(), None)
            });
            self.take(unread);
            return None;
        }
        let Some(form) = form_of(mnemonic) else {
            self.resynchronise();
            return None;
        };
        self.rest = rest;
        Some((mnemonic, form))
    }

    /// A letter with something else than a letter after it; one that stands alone is nothing.
    fn parted_name(&mut self) -> Option<(Mnemonic, Form)> {
        let start = self.at();
        if let Some((mnemonic, form)) = self.take(parted_name) {
            let span = Span { start, end: self.at() };
            self.report(codes::PARTED_NAME, mnemonic, span, || {
                (format!("the letters of `{mnemonic}` stand apart; they are read as one name"), None)
            });
            return Some((mnemonic, form));
        }
        self.rest = &self.rest[1..];
        self.report_unknown(Span { start, end: start + 1 });
        self.take(unread);
        None
    }

    /// An unknown pair of letters: the next command begins in the same word, or after what looks
    /// like parameters.
    fn resynchronise(&mut self) {
        let start = self.at();
        if let Some(letters) = self.take(stray_letters) {
            self.report_unknown(self.span_of(letters));
            return;
        }
        self.report_unknown(Span { start, end: start + 2 });
        self.take(word);
        self.take(unread);
    }

    /// Skips a vendor's command with its parameters; false if there is none.
    pub(super) fn vendor_command(&mut self) -> bool {
        let Some(name) = self.take(vendor_command) else { return false };
        self.number += 1;
        self.report(codes::VENDOR_COMMAND, Mnemonic::NONE, self.span_of(name), || {
            (format!("vendor command `{}` is skipped", name.escape_ascii()), None)
        });
        true
    }

    fn report_unknown(&mut self, span: Span) {
        let name = self.bytes[span.start..span.end].to_ascii_uppercase();
        let mnemonic = Mnemonic([name[0], name.get(1).copied().unwrap_or(b' ')]);
        self.number += 1;
        self.report(codes::UNKNOWN_COMMAND, mnemonic, span, || {
            (format!("unknown command `{}` is skipped", name.escape_ascii()), None)
        });
    }
}
