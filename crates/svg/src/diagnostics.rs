//! Findings: one [`Diagnostic`] per kind and subject, with its first place and a count.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;

use drawing::Span;

use crate::codes::{CODES, Entry};
use crate::limits;

/// How much a finding matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Worth knowing; the drawing is as intended.
    Note,
    /// The drawing may differ from what was intended.
    Warning,
    /// Ink is lost: the drawing lacks something that the file draws.
    Error,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        })
    }
}

/// The stable name of a kind of finding, such as `S0201`. A code never changes its meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Code(pub(crate) u16);

impl Code {
    /// All codes, in the order of their numbers.
    pub fn all() -> impl Iterator<Item = Self> {
        CODES.iter().map(|entry| Self(entry.number))
    }

    /// The code of that name, in any case.
    pub fn from_name(name: &str) -> Option<Self> {
        CODES
            .iter()
            .find(|entry| entry.name.eq_ignore_ascii_case(name.trim()))
            .map(|entry| Self(entry.number))
    }

    fn entry(self) -> &'static Entry {
        // Codes come from the table only, so the search succeeds.
        CODES.iter().find(|entry| entry.number == self.0).unwrap_or(&CODES[0])
    }

    /// Its name, such as `S0201`.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// Its subject, in a few words.
    pub fn title(self) -> &'static str {
        self.entry().title
    }

    /// How much a finding of this kind matters.
    pub fn severity(self) -> Severity {
        self.entry().severity
    }

    /// What happened, how it was handled, and what can be changed in the file; a paragraph.
    pub fn explanation(self) -> &'static str {
        self.entry().explanation
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// One kind of finding about one subject, with its first place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// What kind of finding.
    pub code: Code,
    /// How much it matters.
    pub severity: Severity,
    /// The bytes of the first place.
    pub span: Span,
    /// Line of the first place, from 1.
    pub line: usize,
    /// Column of the first place in characters, from 1.
    pub column: usize,
    /// Name of the element, with `#` and its id if it has one; empty if the finding is about the
    /// file.
    pub element: String,
    /// What was found there.
    pub message: String,
    /// What could be done about it.
    pub help: Option<String>,
    /// How often it was found.
    pub count: u64,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}[{}]: {}", self.line, self.column, self.severity, self.code, self.message)?;
        if !self.element.is_empty() {
            write!(f, " ({})", self.element)?;
        }
        if self.count > 1 {
            write!(f, " ({} times)", self.count)?;
        }
        Ok(())
    }
}

/// Where a finding is: bytes of the text and the name of the element.
#[derive(Clone, Debug, Default)]
pub(crate) struct Place {
    pub(crate) range: Range<usize>,
    pub(crate) element: String,
}

/// Gathers findings, counting repeats of the same code about the same subject.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    found: Vec<Diagnostic>,
    by_kind: BTreeMap<Code, BTreeMap<String, usize>>,
    /// Bytes inserted into the text by repairs: where, and how many.
    pub(crate) inserted: Option<(usize, usize)>,
}

impl Findings {
    /// Counts a finding about `subject`; place and message are computed at its first place only.
    pub(crate) fn report(
        &mut self,
        code: Code,
        subject: &str,
        place: impl FnOnce() -> Place,
        message: impl FnOnce() -> (String, Option<String>),
    ) {
        let kind = self.by_kind.entry(code).or_default();
        if let Some(&index) = kind.get(subject) {
            self.found[index].count += 1;
            return;
        }
        if self.found.len() >= limits::FINDINGS {
            // Counted with the first of its code, if there is one.
            if let Some(&index) = kind.values().next() {
                self.found[index].count += 1;
                return;
            }
        }
        kind.insert(subject.to_owned(), self.found.len());
        let Place { range, element } = place();
        let (message, help) = message();
        self.found.push(Diagnostic {
            code,
            severity: code.severity(),
            span: Span { start: range.start, end: range.end },
            line: 1,
            column: 1,
            element,
            message,
            help,
            count: 1,
        });
    }

    /// The findings with their lines and columns in `text`, in the order of their places.
    pub(crate) fn into_vec(mut self, text: &str) -> Vec<Diagnostic> {
        let mut lines = vec![0];
        lines.extend(text.bytes().enumerate().filter(|&(_, byte)| byte == b'\n').map(|(at, _)| at + 1));
        for diagnostic in &mut self.found {
            let at = diagnostic.span.start.min(text.len());
            let line = lines.partition_point(|&start| start <= at).max(1);
            let begin = lines[line - 1];
            diagnostic.line = line;
            let count = |from: usize, to: usize| text.get(from..to).map_or(0, |part| part.chars().count());
            diagnostic.column = count(begin, at) + 1;
            if let Some((place, length)) = self.inserted {
                if begin <= place && place <= at {
                    diagnostic.column = count(begin, place) + count((place + length).min(at), at) + 1;
                }
                for byte in [&mut diagnostic.span.start, &mut diagnostic.span.end] {
                    if *byte > place {
                        *byte = byte.saturating_sub(length).max(place);
                    }
                }
            }
        }
        self.found.sort_by_key(|diagnostic| diagnostic.span.start);
        self.found
    }
}
