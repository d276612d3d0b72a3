//! What reading a file comes to.

use std::collections::BTreeMap;

use drawing::{Drawing, Pen};

use crate::diagnostics::Diagnostic;
use crate::summary::Summary;

/// What a file draws, and what there is to say about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// The sheets in order; at least one, even where nothing is drawn.
    pub pages: Vec<Page>,
    /// What was found, one entry a kind, in the order of their first places.
    pub diagnostics: Vec<Diagnostic>,
    /// What the file consists of, and what it was read for.
    pub summary: Summary,
}

/// One sheet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    /// Its ink; mm, y up, the origin where the file has it.
    pub drawing: Drawing,
    /// What the file says about each pen that draws on it.
    pub pens: BTreeMap<Pen, PenSettings>,
}

/// What a file says about a pen. Where it says different things in the course of a page, the least speed, force and
/// acceleration, and the last width.
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
}
