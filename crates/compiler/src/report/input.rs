//! Drawings and plans that were read.

use drawing::{Figures, Pen, Rect};
use schemars::JsonSchema;
use serde::Serialize;
use verify::Certificate;

use super::round;
use crate::import::{Document, Fact, Page};

/// A drawing's file.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DrawingReport {
    /// The format: `HP-GL`, `SVG` or `points`.
    pub format: String,
    /// Facts about the file, such as its dialect.
    pub facts: Vec<FactReport>,
    /// The pages in order.
    pub pages: Vec<PageReport>,
}

/// A fact about a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct FactReport {
    /// What it is about.
    pub key: String,
    /// What it is.
    pub value: String,
}

/// One page of a drawing.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PageReport {
    /// Number of strokes, dots included.
    pub strokes: usize,
    /// Number of dots.
    pub dots: usize,
    /// Length of the ink, mm.
    pub ink_mm: f64,
    /// Bounding box of the ink: left, bottom, right, top; mm in the drawing's frame. `null` without ink.
    pub bounds_mm: Option<[f64; 4]>,
    /// The pens that draw, in the order of their numbers.
    pub pens: Vec<PenReport>,
}

/// A pen of a page.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PenReport {
    /// Its number.
    pub pen: u16,
    /// Number of strokes.
    pub strokes: usize,
    /// Length of its ink, mm.
    pub ink_mm: f64,
    /// Speed that the file states, mm/s.
    pub speed_mm_s: Option<f64>,
    /// Line width that the file states, mm.
    pub width_mm: Option<f64>,
    /// Colour that the file states, as `#rrggbb`.
    pub color: Option<String>,
    /// Name of the layer that it draws.
    pub name: Option<String>,
}

impl DrawingReport {
    /// The report of a file.
    pub fn of(document: &Document) -> Self {
        let figures: Vec<Figures> = document.pages.iter().map(|page| page.drawing.figures()).collect();
        Self::with_figures(document, &figures)
    }

    /// The report of a file; `figures` are those of the drawings of its pages.
    pub fn with_figures(document: &Document, figures: &[Figures]) -> Self {
        let fact = |Fact { key, value }: &Fact| FactReport { key: (*key).to_owned(), value: value.clone() };
        Self {
            format: document.format.to_owned(),
            facts: document.facts.iter().map(fact).collect(),
            pages: document
                .pages
                .iter()
                .zip(figures)
                .map(|(page, figures)| PageReport::of(page, figures))
                .collect(),
        }
    }
}

impl PageReport {
    fn of(page: &Page, figures: &Figures) -> Self {
        Self {
            strokes: page.drawing.strokes.len(),
            dots: figures.dots,
            ink_mm: round::mm(figures.length_mm),
            bounds_mm: figures.bounds.map(corners),
            pens: figures.pens.iter().map(|(pen, of_pen)| PenReport::of(page, *pen, *of_pen)).collect(),
        }
    }
}

/// Left, bottom, right and top of a rectangle.
pub(super) fn corners(rect: Rect) -> [f64; 4] {
    [rect.x0, rect.y0, rect.x1, rect.y1].map(round::mm)
}

impl PenReport {
    fn of(page: &Page, pen: Pen, (strokes, ink_mm): (usize, f64)) -> Self {
        let settings = page.pens.get(&pen).cloned().unwrap_or_default();
        Self {
            pen: pen.0,
            strokes,
            ink_mm: round::mm(ink_mm),
            speed_mm_s: settings.speed_mm_s.map(round::mm),
            width_mm: settings.width_mm.map(round::mm),
            color: settings.color.map(|[red, green, blue]| format!("#{red:02x}{green:02x}{blue:02x}")),
            name: settings.name,
        }
    }
}

/// A G-code program that was read.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ProgramReport {
    /// Lines that are no comments.
    pub lines: usize,
    /// Length of lines and arcs (`G1`, `G2`, `G3`), mm.
    pub ink_mm: f64,
    /// Length of travel (`G0`), mm.
    pub travel_mm: f64,
    /// Time of lines and arcs at their feeds, s; the firmware's accelerations add to it.
    pub drawing_s: f64,
    /// Time of dwells, s.
    pub dwell_s: f64,
    /// Extent of lines and arcs: left, bottom, right, top; mm. `null` without any.
    pub bounds_mm: Option<[f64; 4]>,
    /// Number of pauses for a pen.
    pub pauses: usize,
}

impl ProgramReport {
    /// Rounds the numbers.
    #[must_use]
    pub fn rounded(self) -> Self {
        Self {
            ink_mm: round::mm(self.ink_mm),
            travel_mm: round::mm(self.travel_mm),
            drawing_s: round::s(self.drawing_s),
            dwell_s: round::s(self.dwell_s),
            bounds_mm: self.bounds_mm.map(|bounds| bounds.map(round::mm)),
            ..self
        }
    }
}

/// A plan that was read.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PlanReport {
    /// Name of the machine that it was made for.
    pub machine: String,
    /// Rows of the plan.
    pub rows: u64,
    /// Time between rows, microseconds.
    pub period_us: u64,
    /// Duration, s.
    pub duration_s: f64,
    /// The limits that its header states.
    pub motors: Vec<MotorLimits>,
    /// Length drawn, mm.
    pub ink_mm: f64,
    /// Length travelled with the pen up, mm.
    pub travel_mm: f64,
    /// The pens that draw, in the order of their first use.
    pub pens: Vec<u16>,
    /// Times that the pen goes down.
    pub pen_downs: u64,
}

/// A motor's limits.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MotorLimits {
    /// The motor's name.
    pub name: String,
    /// Speed limit, ticks/s.
    pub speed_ticks_s: f64,
    /// Acceleration limit, ticks/s².
    pub acceleration_ticks_s2: f64,
    /// Jerk limit, ticks/s³; `null` if there is none.
    pub jerk_ticks_s3: Option<f64>,
}

impl PlanReport {
    /// The report of a plan's header and of what its replay measured.
    pub fn of(header: &plan::Header, certificate: &Certificate) -> Self {
        let motor = |motor: &plan::Motor| MotorLimits {
            name: motor.name.clone(),
            speed_ticks_s: round::ticks(motor.limits.speed),
            acceleration_ticks_s2: round::ticks(motor.limits.acceleration),
            jerk_ticks_s3: motor.limits.jerk.map(round::ticks),
        };
        Self {
            machine: header.machine.clone(),
            rows: header.rows,
            period_us: header.period_us,
            duration_s: round::s(header.duration_us as f64 * 1e-6),
            motors: header.motors.iter().map(motor).collect(),
            ink_mm: round::mm(certificate.ink_mm),
            travel_mm: round::mm(certificate.travel_mm),
            pens: certificate.pens.clone(),
            pen_downs: certificate.pen_downs,
        }
    }
}
