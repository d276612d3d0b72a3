//! From bytes to commands: the state and the recovery around the [`crate::grammar`].
//!
//! The parser never fails. It keeps just enough state to know where a command ends (the label
//! terminator, and whether the bytes are HP-GL, PCL or job control) and leaves meaning to the
//! interpreter.

mod names;
mod numbers;
mod state;
mod texts;
mod wrappers;

use drawing::Span;

use crate::codes;
use crate::grammar::bytes::{Class, class, gap, unread};
use crate::grammar::name::Form;
use crate::mnemonic::Mnemonic;
use crate::summary::is_second_generation;
use crate::syntax::{Command, Entry, Syntax};
pub(crate) use state::Parser;
use state::{Head, Language, Step};

impl<'a> Parser<'a> {
    /// The next command; `None` at the end of the file.
    #[inline]
    pub(crate) fn next(&mut self) -> Option<Command<'_>> {
        let head = self.head()?;
        Some(Command {
            mnemonic: head.mnemonic,
            span: head.span,
            number: head.number,
            parameters: &self.parameters,
            text: &self.bytes[head.text.start..head.text.end],
            text_span: head.text,
            reencoded: self.hints.reencoded,
        })
    }

    /// All commands.
    pub(crate) fn collect(mut self) -> Syntax<'a> {
        let mut entries = Vec::new();
        let mut parameters = Vec::new();
        while let Some(head) = self.head() {
            let first_parameter = parameters.len();
            parameters.extend_from_slice(&self.parameters);
            entries.push(Entry {
                mnemonic: head.mnemonic,
                span: head.span,
                number: head.number,
                first_parameter,
                last_parameter: parameters.len(),
                text: head.text,
                findings: self.findings.len(),
            });
        }
        Syntax {
            bytes: self.bytes,
            entries,
            parameters,
            findings: self.findings,
            hints: self.hints,
            command_count: self.number,
        }
    }

    #[inline]
    fn head(&mut self) -> Option<Head> {
        self.parameters.clear();
        if let Some((mnemonic, start)) = self.unfinished.take() {
            let head = self.numbers(mnemonic, start);
            if head.is_some() {
                return head;
            }
        }
        loop {
            let step = match self.language {
                Language::HpGl => self.hpgl(),
                Language::Pcl => self.pcl(),
                Language::Job => self.job(),
            };
            match step {
                Step::End => return None,
                Step::Nothing => {}
                Step::Command(head) => return Some(head),
            }
        }
    }

    /// One step in HP-GL: a command, or what stands between two.
    #[inline]
    fn hpgl(&mut self) -> Step {
        let start = self.at();
        let Some((&byte, after)) = self.rest.split_first() else { return Step::End };
        match class(byte) {
            Class::Letter => {
                let Some((mnemonic, form)) = self.name() else { return Step::Nothing };
                return self.command(mnemonic, form, start).into();
            }
            Class::Terminator | Class::Blank | Class::Comma | Class::LineEnd => {
                self.take(gap);
            }
            Class::Escape => return self.escape().into(),
            Class::Control => {
                self.rest = after;
                self.report_control(Mnemonic::NONE, start);
            }
            Class::Digit | Class::Sign | Class::Point => {
                self.take(unread);
                let span = Span { start, end: self.at() };
                self.report(codes::NUMBERS_WITHOUT_COMMAND, Mnemonic::NONE, span, || {
                    ("numbers that belong to no command are skipped".into(), None)
                });
            }
            Class::Other if self.rest.starts_with(b"@PJL") => self.language = Language::Job,
            Class::Other if byte == b'!' && self.vendor_command() => {}
            Class::Other => {
                self.rest = after;
                self.report_stray(Mnemonic::NONE, start);
            }
        }
        Step::Nothing
    }

    /// The rest of a command whose name was read.
    #[inline]
    fn command(&mut self, mnemonic: Mnemonic, form: Form, start: usize) -> Option<Head> {
        self.number += 1;
        if matches!(&mnemonic.0, b"IN" | b"DF" | b"BP") {
            self.restore_terminator();
        }
        match form {
            Form::Numbers => self.numbers(mnemonic, start),
            Form::Label => self.label(mnemonic, start),
            Form::Terminator => self.define_terminator(mnemonic, start),
            Form::Symbol => self.symbol(mnemonic, start),
            Form::Comment => self.comment(mnemonic, start),
            Form::Encoded => self.encoded(mnemonic, start),
        }
    }

    /// Whether the file is HP-GL/2: reads all of it once, up to the first sign of that.
    fn is_hpgl2(&mut self) -> bool {
        if let Some(known) = self.is_hpgl2 {
            return known;
        }
        let mut ahead = Parser::new(self.bytes, Some(self.default_terminator));
        // Ends the recursion. Printed or not, a terminator ends its label at the same byte.
        ahead.is_hpgl2 = Some(true);
        let mut second = false;
        while !second && let Some(head) = ahead.head() {
            second = is_second_generation(head.mnemonic) || ahead.hints.wrappers.pcl;
        }
        self.is_hpgl2 = Some(second);
        second
    }
}
