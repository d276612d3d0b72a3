//! SVG, plain or gzipped.

use std::sync::Arc;

use serde::Serialize;
use svg::{StrokeFont, StrokeGlyph};

use super::{Diagnostic, Document, Fact, ImportError, Importer, Options, Page, PenSettings, Severity};

/// Recognized by an `svg` element in the first 64 KiB.
pub(super) const IMPORTER: Importer = Importer { name: "SVG", recognizes: svg::looks_like_svg, read };

/// How an SVG file is read.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SvgOptions {
    /// How pens are numbered.
    pub pens: PenRule,
    /// How filled areas are drawn; not at all if `None`.
    pub hatch: Option<Hatch>,
    /// Whether outlines of shapes that are filled but not stroked are drawn.
    pub outline_fills: bool,
    /// Pixels per inch; as the file's program has it if `None`.
    pub dpi: Option<f64>,
}

/// Fonts whose outlines text is drawn with. Two are equal if they are the same object.
#[derive(Clone, Debug)]
pub struct Fonts(pub Arc<dyn svg::OutlineFonts + Send + Sync>);

impl PartialEq for Fonts {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// How pens are numbered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PenRule {
    /// A pen per layer, numbered by the number that its name begins with.
    #[default]
    Layers,
    /// A pen per colour.
    Colors,
    /// Pen 1 for everything.
    One,
}

/// How filled areas are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Hatch {
    /// Distance of the lines, mm.
    pub spacing_mm: f64,
    /// Direction of the lines, rad.
    pub angle_rad: f64,
}

/// All codes with their titles.
pub(super) fn codes() -> impl Iterator<Item = (&'static str, &'static str)> {
    svg::Code::all().map(|code| (code.name(), code.title()))
}

/// The title with severity, and the explanation of a code.
pub(super) fn explain(code: &str) -> Option<(String, &'static str)> {
    let code = svg::Code::from_name(code)?;
    Some((format!("{code}: {} ({})", code.title(), code.severity()), code.explanation()))
}

fn read(bytes: &[u8], options: &Options) -> Result<Document, ImportError> {
    if options.plotter.is_some() || options.paper.is_some() {
        return Err(ImportError::NoEffect { options: "--plotter is", format: IMPORTER.name });
    }
    let wanted = &options.svg;
    let document = svg::read(
        bytes,
        &svg::Options {
            pens: match wanted.pens {
                PenRule::Layers => svg::Pens::Layers,
                PenRule::Colors => svg::Pens::Colors,
                PenRule::One => svg::Pens::One,
            },
            hatch: wanted
                .hatch
                .map(|hatch| svg::Hatch { spacing_mm: hatch.spacing_mm, angle_rad: hatch.angle_rad }),
            outline_fills: wanted.outline_fills,
            dpi: wanted.dpi,
            font: Some(&LabelFont),
            outlines: options.fonts.as_ref().map(|fonts| &*fonts.0 as &dyn svg::OutlineFonts),
        },
    );
    let [width, height] = document.page_mm;
    let strokes = document.drawing.strokes.len();
    let pens = document.pens.into_iter().map(|(pen, settings)| {
        let settings = PenSettings { name: settings.name, color: settings.color, ..PenSettings::default() };
        (pen, settings)
    });
    Ok(Document {
        format: IMPORTER.name,
        pages: vec![Page { drawing: document.drawing, pens: pens.collect() }],
        diagnostics: document.diagnostics.into_iter().map(diagnostic).collect(),
        size: format!("{strokes} strokes"),
        facts: vec![
            Fact { key: "dialect", value: "SVG".to_owned() },
            Fact { key: "page", value: format!("{width:.2} x {height:.2} mm") },
        ],
    })
}

fn diagnostic(found: svg::Diagnostic) -> Diagnostic {
    let element = if found.element.is_empty() { String::new() } else { format!(", {}", found.element) };
    Diagnostic {
        code: found.code.name(),
        title: found.code.title(),
        severity: match found.severity {
            svg::Severity::Note => Severity::Note,
            svg::Severity::Warning => Severity::Warning,
            svg::Severity::Error => Severity::Error,
        },
        place: format!("line {}, column {}{element}", found.line, found.column),
        line_column: Some([found.line, found.column]),
        message: found.message,
        help: found.help,
        count: found.count,
        span: found.span,
        command: None,
        pen_mm: None,
    }
}

/// The stroke font of HP-GL labels, for text.
#[derive(Debug)]
struct LabelFont;

impl StrokeFont for LabelFont {
    fn cap_height(&self) -> f64 {
        hpgl::FONT_CAP_HEIGHT
    }

    fn glyph(&self, character: char) -> Option<StrokeGlyph> {
        let glyph = hpgl::Glyph::of(character)?;
        let strokes = glyph.strokes().map(|points| points.map(svg::Point::from).collect());
        Some(StrokeGlyph { advance: glyph.advance, strokes: strokes.collect() })
    }
}
