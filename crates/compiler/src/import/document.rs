//! What every importer returns.

use std::collections::BTreeMap;
use std::fmt;

use drawing::{Drawing, Pen, Span};
use serde::Serialize;

/// A drawing's file, read.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// The format's name, such as `HP-GL`.
    pub format: &'static str,
    /// The sheets in order; at least one, even where nothing is drawn.
    pub pages: Vec<Page>,
    /// What the reader found, one entry a kind, in the order of their first places.
    pub diagnostics: Vec<Diagnostic>,
    /// The file's size in units of its format, such as `6 commands`; empty where there are none.
    pub size: String,
    /// Facts about the file besides its drawing, in the order in which they are shown.
    pub facts: Vec<Fact>,
}

impl Document {
    /// Whether any diagnostic is at least as severe.
    pub fn has(&self, severity: Severity) -> bool {
        self.diagnostics.iter().any(|diagnostic| diagnostic.severity >= severity)
    }
}

/// A fact about a file, such as its dialect. `value` may have several lines.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Fact {
    /// What it is about.
    pub key: &'static str,
    /// What it is.
    pub value: String,
}

/// One sheet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    /// Its ink; mm, y up, with the file's own origin.
    pub drawing: Drawing,
    /// What the file states about each pen that draws on this sheet.
    pub pens: BTreeMap<Pen, PenSettings>,
}

/// What a file states about a pen.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PenSettings {
    /// Speed with the pen down, mm/s.
    pub speed_mm_s: Option<f64>,
    /// Width of the line, mm.
    pub width_mm: Option<f64>,
    /// Name of the layer that it draws.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Its colour: red, green, blue.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub color: Option<[u8; 3]>,
}

/// How much a finding matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// For information; the drawing is what the file states.
    Note,
    /// The file had to be interpreted: the drawing may differ from what was meant.
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

/// One kind of finding, with its first place and a count.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    /// The stable name of the kind, such as `H0101`.
    pub code: &'static str,
    /// The kind in a few words.
    pub title: &'static str,
    /// How much it matters.
    pub severity: Severity,
    /// What was found at the first place.
    pub message: String,
    /// What could be done about it.
    pub help: Option<String>,
    /// How often it was found.
    pub count: u64,
    /// The bytes of the first place.
    pub span: Span,
    /// The first place in the terms of the format, such as `command 3, pen at 1.00, 2.00 mm`.
    pub place: String,
    /// Line and column of the first place, from 1, in formats of lines.
    pub line_column: Option<[usize; 2]>,
    /// Number of the command at the first place, from 1, in formats of commands.
    pub command: Option<usize>,
    /// Where the pen was at the first place, mm, in formats that move a pen.
    pub pen_mm: Option<[f64; 2]>,
}
