//! The result of reading a file.

use std::collections::BTreeMap;

use drawing::{Drawing, Pen};

use crate::diagnostics::Diagnostic;
use crate::summary::Summary;

/// A file that was read: its pages, diagnostics and a summary.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// The sheets in order; at least one, even where nothing is drawn.
    pub pages: Vec<Page>,
    /// One entry per kind of finding, ordered by first occurrence.
    pub diagnostics: Vec<Diagnostic>,
    /// Command counts, wrappers and the plotter profile.
    pub summary: Summary,
}

/// One sheet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    /// Its strokes; mm, y up, in the file's own origin.
    pub drawing: Drawing,
    /// Settings of each pen that draws on it.
    pub pens: BTreeMap<Pen, PenSettings>,
}

/// Settings of a pen on one page. Where they change in the course of a page: the least speed, force
/// and acceleration, and the last width and colour.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PenSettings {
    /// Speed with the pen down, mm/s (`VS`).
    pub speed_mm_s: Option<f64>,
    /// Force in the plotter's own steps (`FS`).
    pub force: Option<f64>,
    /// Acceleration in the plotter's own steps (`AS`).
    pub acceleration: Option<f64>,
    /// Width of the line, mm (`PW`).
    pub width_mm: Option<f64>,
    /// Red, green and blue, where the file states them (`PC`) and they are not white.
    pub color: Option<[u8; 3]>,
}
