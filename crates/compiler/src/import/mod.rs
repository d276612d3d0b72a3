//! Importers: a file's bytes in, its drawing and diagnostics out.
//!
//! One file a format. [`read`] takes the first importer of [`IMPORTERS`] that recognizes the
//! bytes; HP-GL has no signature and comes last. A new input format is one file here and one line
//! in that list.

mod document;
mod foreign;
mod hpgl;
mod points;
mod svg;

use std::fmt::Write as _;

use sha2::Digest as _;

pub use self::document::{Diagnostic, Document, Fact, Page, PenSettings, Severity};
pub use self::svg::{Fonts, Hatch, PenRule, SvgOptions};
pub use ::svg::{FaceQuery, OutlineFonts, OutlineGlyph};

/// What a reader needs to know besides the bytes.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Options {
    /// The HP-GL plotter that the file was made for; found from the file if `None`.
    pub plotter: Option<String>,
    /// The paper loaded in that plotter; the plotter's first one if `None`.
    pub paper: Option<String>,
    /// HP-GL: whether the ink of pens that `PC` makes white is left out.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub skip_white_pens: bool,
    /// How an SVG file is read.
    #[serde(skip_serializing_if = "is_default")]
    pub svg: SvgOptions,
    /// Fonts for the text of SVG files; the stroke font if `None`. A plan made with fonts depends on
    /// them.
    #[serde(skip)]
    pub fonts: Option<Fonts>,
}

/// Whether the options for SVG are those that apply without being asked for.
fn is_default(options: &SvgOptions) -> bool {
    *options == SvgOptions::default()
}

/// Why a file is not read at all.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The file is in a format that holds no drawing, or one that is not read.
    #[error("this is {what}, not a drawing that plotplan reads; {help}")]
    Foreign {
        /// What it is.
        what: &'static str,
        /// What makes a readable drawing of it.
        help: &'static str,
    },
    /// No plotter has this name.
    #[error("unknown plotter {name}; known: {}", known.join(", "))]
    Plotter {
        /// The name given.
        name: String,
        /// All names.
        known: Vec<&'static str>,
    },
    /// Options are given that mean nothing for this format.
    #[error("{options} not for {format}: no effect on this file")]
    NoEffect {
        /// The options, with their verb.
        options: &'static str,
        /// The format's name.
        format: &'static str,
    },
    /// The plotter does not take this paper.
    #[error("plotter {plotter} has no paper {name}; it takes {}", known.join(", "))]
    Paper {
        /// The plotter's name.
        plotter: String,
        /// The paper given.
        name: String,
        /// All papers of that plotter.
        known: Vec<&'static str>,
    },
}

/// A reader of one format.
#[derive(Clone, Copy, Debug)]
pub struct Importer {
    /// The format's name.
    pub name: &'static str,
    /// Whether the bytes, seen from their start, are in this format.
    pub recognizes: fn(&[u8]) -> bool,
    /// Reads them. Never fails: what cannot be read is reported in the document's diagnostics.
    pub read: fn(&[u8], &Options) -> Result<Document, ImportError>,
}

/// All importers, in the order in which they are asked.
pub const IMPORTERS: &[Importer] = &[svg::IMPORTER, points::IMPORTER, hpgl::IMPORTER];

/// Reads a drawing of any recognized format.
///
/// # Errors
/// A file of another kind, options that name an unknown plotter or paper, or that have no effect
/// on the format.
pub fn read(bytes: &[u8], options: &Options) -> Result<Document, ImportError> {
    let importer = IMPORTERS.iter().find(|importer| (importer.recognizes)(bytes));
    let importer = importer.unwrap_or(&hpgl::IMPORTER);
    if importer.name == hpgl::IMPORTER.name
        && let Some(foreign::Foreign { what, help }) = foreign::recognize(bytes)
    {
        return Err(ImportError::Foreign { what, help });
    }
    if importer.name != svg::IMPORTER.name && !is_default(&options.svg) {
        let options = "--pens, --hatch, --outline-fills and --dpi are";
        return Err(ImportError::NoEffect { options, format: importer.name });
    }
    if importer.name != hpgl::IMPORTER.name && options.skip_white_pens {
        return Err(ImportError::NoEffect { options: "--white-pens is", format: importer.name });
    }
    if importer.name != svg::IMPORTER.name && options.fonts.is_some() {
        return Err(ImportError::NoEffect { options: "--text outlines is", format: importer.name });
    }
    (importer.read)(bytes, options)
}

/// The name of the format that these bytes are read as.
pub fn format(bytes: &[u8]) -> &'static str {
    let importer = IMPORTERS.iter().find(|importer| (importer.recognizes)(bytes));
    importer.unwrap_or(&hpgl::IMPORTER).name
}

impl Options {
    /// The options for one of several files of these formats: those of another file's format are left
    /// out. An option that is for none of the formats stays, so that [`read`] refuses it.
    #[must_use]
    pub fn for_format(&self, format: &str, formats: &[&str]) -> Self {
        let mut options = self.clone();
        if format != svg::IMPORTER.name && formats.contains(&svg::IMPORTER.name) {
            options.svg = SvgOptions::default();
            options.fonts = None;
        }
        if format != hpgl::IMPORTER.name && formats.contains(&hpgl::IMPORTER.name) {
            options.plotter = None;
            options.paper = None;
        }
        options
    }
}

/// The title, severity and explanation of a diagnostic's code, whichever importer reports it.
pub fn explain(code: &str) -> Option<(String, &'static str)> {
    hpgl::explain(code).or_else(|| svg::explain(code))
}

/// The codes and titles of all diagnostics of drawings, one a line, in their order.
pub fn codes() -> String {
    let hpgl = hpgl::codes();
    let svg = svg::codes();
    hpgl.chain(svg).flat_map(|(code, title)| [code, " ", title, "\n"]).collect()
}

/// The known HP-GL plotters with their papers, one a line.
pub fn plotters() -> String {
    let mut text = String::new();
    for plotter in ::hpgl::plotters() {
        let papers: Vec<&str> = plotter.papers.iter().map(|paper| paper.name).collect();
        let _ = writeln!(text, "{:<12} {}; papers: {}", plotter.name, plotter.title, papers.join(", "));
    }
    text
}

/// SHA-256 of a file's bytes, in lowercase hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    sha2::Sha256::digest(bytes).iter().fold(String::with_capacity(64), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
