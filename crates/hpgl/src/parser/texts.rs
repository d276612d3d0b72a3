//! Commands whose parameters are not numbers: `LB BL WD DT SM CO PE`. Where their text ends is the whole question.

use drawing::Span;

use super::{Head, Parser};
use crate::codes;
use crate::lexer::{Class, class};
use crate::syntax::Mnemonic;

impl Parser<'_> {
    /// `LB`, `BL`, `WD`: text up to the terminator.
    ///
    /// A label without terminator must not swallow the rest of the file: where none follows, it ends at the next
    /// semicolon; where one follows, but a command that moves the pen reads plainly after a semicolon before it, it
    /// ends there.
    pub(super) fn label(&mut self, mnemonic: Mnemonic, start: usize) -> Head {
        let first = self.at;
        let terminated = self.last_of(self.terminator) >= Some(first);
        let mut end = first;
        let mut cut = None;
        while let Some(&byte) = self.bytes.get(end) {
            if byte == self.terminator {
                break;
            }
            let ends = match byte {
                b';' => !terminated || self.moves_the_pen(end + 1),
                b'\n' | b'\r' => !terminated && self.moves_the_pen(end + 1),
                0x1b => self.bytes.get(end + 1) == Some(&b'%'),
                _ => false,
            };
            if ends {
                cut = Some(end);
                break;
            }
            end += 1;
        }
        let prints = self.prints_terminator && cut.is_none() && end < self.bytes.len();
        let text = Span { start: first, end: end + usize::from(prints) };
        let at_end = end == self.bytes.len();
        if at_end || cut.is_some() {
            let terminator = self.terminator.escape_ascii();
            self.report(codes::LABEL_WITHOUT_TERMINATOR, mnemonic, Span { start, end }, || {
                let place = if at_end { "the end of the file" } else { "the next command" };
                (
                    format!(
                        "the text of `{mnemonic}` has no terminator (`{terminator}`); it is taken to end at {place}"
                    ),
                    Some("end labels with the byte 3, or name the terminator that the file uses".into()),
                )
            });
        }
        self.at = if at_end || self.bytes[end] == 0x1b { end } else { end + 1 };
        self.finish(mnemonic, start, text)
    }

    /// Whether a command that moves or changes the pen reads plainly at `at`.
    fn moves_the_pen(&self, at: usize) -> bool {
        let rest = self.bytes[at..].trim_ascii_start();
        let Some(name) = rest.get(..2) else { return false };
        let known = matches!(&[name[0], name[1]], b"PU" | b"PD" | b"PA" | b"PR" | b"SP");
        known
            && rest[2..].trim_ascii_start().first().is_none_or(|&b| {
                matches!(class(b), Class::Digit | Class::Sign | Class::Point | Class::Terminator)
            })
    }

    /// `DT`: the next byte is the terminator of labels; nothing or a semicolon restores the usual one.
    pub(super) fn define_terminator(&mut self, mnemonic: Mnemonic, start: usize) -> Head {
        match self.bytes.get(self.at) {
            None | Some(b';') => {
                self.restore_terminator();
                self.at = (self.at + 1).min(self.bytes.len());
                return self.textless(mnemonic, start);
            }
            // NUL, ENQ and ESC are what the language excludes.
            Some(&byte @ (0 | 5 | 27)) => {
                let at = self.at;
                self.report(codes::BAD_TERMINATOR, mnemonic, Span { start: at, end: at + 1 }, || {
                    (format!("byte {byte} cannot end labels; the terminator stays as it is"), None)
                });
                if byte != 27 {
                    self.at += 1;
                }
            }
            Some(&byte) => {
                self.terminator = byte;
                self.at += 1;
            }
        }
        let text = Span { start: self.at - 1, end: self.at };
        if self.bytes.get(self.at) == Some(&b',') {
            self.at += 1;
        }
        self.number_list(mnemonic, false, true);
        self.prints_terminator = self.parameters.first() == Some(&0.0);
        self.finish(mnemonic, start, text)
    }

    /// `SM`: the next byte is the symbol; nothing or a semicolon ends symbol mode.
    pub(super) fn symbol(&mut self, mnemonic: Mnemonic, start: usize) -> Head {
        while self.bytes.get(self.at) == Some(&b' ') {
            self.at += 1;
        }
        let text = match self.bytes.get(self.at) {
            Some(&byte) if byte > b' ' && byte != b';' && byte != 127 => {
                self.at += 1;
                Span { start: self.at - 1, end: self.at }
            }
            _ => Span { start: self.at, end: self.at },
        };
        if self.bytes.get(self.at) == Some(&b';') {
            self.at += 1;
        }
        self.finish(mnemonic, start, text)
    }

    /// `CO`: a comment in quotes, in which semicolons mean nothing; without quotes up to the semicolon.
    pub(super) fn comment(&mut self, mnemonic: Mnemonic, start: usize) -> Head {
        let mut at = self.at;
        while self.bytes.get(at) == Some(&b' ') {
            at += 1;
        }
        if self.bytes.get(at) == Some(&b'"') {
            if self.last_of(b'"') > Some(at) {
                at = self.quoted(mnemonic, at);
            } else {
                self.report(codes::OPEN_COMMENT, mnemonic, Span { start, end: at + 1 }, || {
                    ("the comment's quote is never closed; it is ended at the semicolon".into(), None)
                });
            }
        }
        while self.bytes.get(at).is_some_and(|&b| b != b';' && b != 0x1b) {
            // A comment that is closed may have no semicolon after it.
            if self.bytes[at - 1] == b'"' && class(self.bytes[at]) == Class::Letter && at > self.at + 1 {
                break;
            }
            at += 1;
        }
        let text = Span { start: self.at, end: at };
        self.at = if self.bytes.get(at) == Some(&b';') { at + 1 } else { at };
        self.finish(mnemonic, start, text)
    }

    /// `PE`: data up to the first byte that cannot be data.
    pub(super) fn encoded(&mut self, mnemonic: Mnemonic, start: usize) -> Head {
        let first = self.at;
        let bytes = self.bytes;
        let end = first + crate::encoded::scan(&bytes[first..], || self.is_reencoded());
        self.at = end;
        if self.bytes.get(self.at) == Some(&b';') {
            self.at += 1;
        } else {
            self.report(codes::ENCODED_WITHOUT_TERMINATOR, mnemonic, Span { start, end }, || {
                (
                    "the encoded polyline has no terminator; it is ended after its last whole number".into(),
                    Some("end PE with a semicolon".into()),
                )
            });
        }
        self.finish(mnemonic, start, Span { start: first, end })
    }
}
