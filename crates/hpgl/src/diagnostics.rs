//! Diagnostics: one per kind of finding, with its first occurrence and a count.

use std::collections::BTreeMap;
use std::fmt;

use drawing::{Point, Span};

use crate::codes::{Code, Severity};
use crate::mnemonic::Mnemonic;

/// One kind of finding about one command, with its first occurrence.
///
/// Findings of the same code about the same mnemonic are one diagnostic with a `count`.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    /// What kind of finding.
    pub code: Code,
    /// Its severity.
    pub severity: Severity,
    /// The bytes of the first occurrence.
    pub span: Span,
    /// Number of the command at the first occurrence, counted from 1 over all commands of the file.
    pub command: usize,
    /// The pen position at the first occurrence, mm.
    pub pen_position: Point,
    /// What was found there.
    pub message: String,
    /// What can be done about it.
    pub help: Option<String>,
    /// How often it was found.
    pub count: u64,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}[{}] byte {}: {}", self.severity, self.code, self.span.start, self.message)?;
        if self.count > 1 {
            write!(f, " ({} times)", self.count)?;
        }
        Ok(())
    }
}

/// Gathers findings, counting repeats of the same code about the same mnemonic.
#[derive(Clone, Debug, Default)]
pub(crate) struct Findings {
    found: Vec<Diagnostic>,
    by_kind: BTreeMap<(Code, Mnemonic), usize>,
}

impl Findings {
    /// Counts a finding; `message` is called at the first occurrence only.
    pub(crate) fn report(
        &mut self,
        code: Code,
        mnemonic: Mnemonic,
        span: Span,
        command: usize,
        pen_position: Point,
        message: impl FnOnce() -> (String, Option<String>),
    ) {
        if let Some(&index) = self.by_kind.get(&(code, mnemonic)) {
            self.found[index].count += 1;
            return;
        }
        let (message, help) = message();
        self.by_kind.insert((code, mnemonic), self.found.len());
        self.found.push(Diagnostic {
            code,
            severity: code.severity(),
            span,
            command,
            pen_position,
            message,
            help,
            count: 1,
        });
    }

    pub(crate) fn len(&self) -> usize {
        self.found.len()
    }

    /// Sets the pen position of the findings from `index` on.
    pub(crate) fn set_pen_position(&mut self, index: usize, pen_position: Point) {
        for diagnostic in &mut self.found[index..] {
            diagnostic.pen_position = pen_position;
        }
    }

    /// Whether anything of that code was found.
    pub(crate) fn has(&self, code: Code) -> bool {
        self.found.iter().any(|diagnostic| diagnostic.code == code)
    }

    /// Makes all findings of one code a single one of another, at their first occurrence.
    pub(crate) fn recode(&mut self, from: Code, to: Code, message: impl FnOnce() -> String) {
        let Some(first) = self.found.iter().position(|diagnostic| diagnostic.code == from) else { return };
        let count = self.found.iter().filter(|diagnostic| diagnostic.code == from).map(|d| d.count).sum();
        let merged = Diagnostic {
            code: to,
            severity: to.severity(),
            message: message(),
            count,
            ..self.found[first].clone()
        };
        self.found.retain(|diagnostic| diagnostic.code != from);
        self.found.insert(first, merged);
        self.by_kind.clear();
    }

    pub(crate) fn into_vec(self) -> Vec<Diagnostic> {
        self.found
    }
}
