//! SVG to a [`Drawing`]: the strokes of an SVG file in millimetres, y up.
//!
//! ```
//! let file = br##"<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="20mm" viewBox="0 0 40 20">
//!   <path d="M5 5H15" stroke="#000" fill="none"/></svg>"##;
//! let document = svg::read(file, &svg::Options::default());
//! assert!((document.drawing.length() - 10.0).abs() < 1e-12); // mm
//! assert!(document.diagnostics.is_empty());
//! ```
//!
//! [`read`] never fails and never panics: what cannot be drawn is reported in [`Diagnostic`]s with
//! line, column and element.
//!
//! # Why a resolver of our own
//!
//! usvg resolves styles, references and clips well, but computes in `f32`, converts circles and
//! arcs to cubics (0.027 mm off at a radius of 100 mm), drops layer labels and source positions,
//! and drops text without a font. To recover the exact shape, every element would have to be tagged
//! beforehand, and its transform, dashes, markers and clips computed again in `f64`: that is the
//! resolver, next to a second one. So this crate resolves by itself, on `roxmltree` (XML,
//! positions), `svgtypes` (paths, transforms, lengths, colours) and `kurbo` (cubics). Selectors are
//! read and matched here, because simplecss lacks `:not()`, `:nth-child()`, `~` and `[a^=b]`, matches
//! without a bound on work and counts specificity in `u8`.
//!
//! # Exactness
//!
//! Lines, circles, ellipses and `A` commands keep their shape under every transform
//! ([`drawing::EllipticArc`]); quadratic curves become the same curves as cubics. Coordinates are
//! `f64`, transcendental functions are `libm`'s: the same file gives the same bits on every
//! platform.
//!
//! # Bounded work
//!
//! Entity expansion, nesting, references, CSS matching, dashes, hatches and the size of the result
//! have limits (see `limits.rs`); beyond them an error is reported and the rest is left out.

mod attributes;
mod clip;
mod codes;
mod colors;
mod css;
mod dashes;
mod diagnostics;
mod limits;
mod markers;
mod media;
mod meet;
mod output;
mod path;
mod pens;
mod selector;
mod shapes;
mod source;
mod structure;
mod style;
mod text;
mod units;
mod viewport;
mod walk;

use std::collections::BTreeMap;
use std::fmt::Debug;

pub use diagnostics::{Code, Diagnostic, Severity};
pub use drawing::{Drawing, Pen, Point, Segment, Span};
pub use source::looks_like_svg;

/// How pens are numbered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pens {
    /// One pen per layer. A layer whose name begins with a number is drawn with that pen; the
    /// others take the free numbers in order of appearance. Ink outside layers, and a drawing of
    /// fewer than two layers without numbers, is numbered by colour.
    #[default]
    Layers,
    /// One pen per colour, in order of first appearance.
    Colors,
    /// Pen 1 for everything.
    One,
}

/// How filled areas are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hatch {
    /// Distance of the lines, mm; positive.
    pub spacing_mm: f64,
    /// Direction of the lines, rad, counterclockwise from the x axis.
    pub angle_rad: f64,
}

/// A character as strokes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StrokeGlyph {
    /// Distance from its origin to that of the next character, units of the font.
    pub advance: f64,
    /// Polylines in units of the font; base line at 0, y up.
    pub strokes: Vec<Vec<Point>>,
}

/// A font of strokes that text is drawn in.
pub trait StrokeFont: Debug {
    /// Height of capital letters, units of the font.
    fn cap_height(&self) -> f64;
    /// The glyph of a character; `None` if the font lacks it.
    fn glyph(&self, character: char) -> Option<StrokeGlyph>;
}

/// A character as closed outlines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OutlineGlyph {
    /// Distance from its origin to that of the next character, in font sizes.
    pub advance: f64,
    /// Connected pieces, each list from a point back to it, in font sizes; base line at 0, y up.
    pub contours: Vec<Vec<Segment>>,
}

/// A face of a font, as CSS names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaceQuery<'a> {
    /// Families as written, with commas between; may be empty.
    pub families: &'a str,
    /// Weight, 400 for normal and 700 for bold.
    pub weight: u16,
    /// Whether it is italic or oblique.
    pub italic: bool,
}

/// Fonts whose outlines text is drawn with.
pub trait OutlineFonts: Debug {
    /// The family that stands for this face; `None` if there is none at all.
    fn family(&self, query: FaceQuery<'_>) -> Option<String>;
    /// The glyph of a character; `None` if the face lacks it.
    fn glyph(&self, query: FaceQuery<'_>, character: char) -> Option<OutlineGlyph>;
    /// What is added to the advance of a character before another one, in font sizes; 0 where the face
    /// has no kerning for the pair.
    fn kerning(&self, _query: FaceQuery<'_>, _pair: [char; 2]) -> f64 {
        0.0
    }
}

/// How a file is read.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options<'a> {
    /// How pens are numbered.
    pub pens: Pens,
    /// How filled areas are drawn; not at all by default.
    pub hatch: Option<Hatch>,
    /// Whether the outlines of shapes that are filled but not stroked are drawn.
    pub outline_fills: bool,
    /// Pixels (user units) per inch; 96 by default, 72 for old files of Illustrator.
    pub dpi: Option<f64>,
    /// The font that text is drawn in; without one, text is reported as missing.
    pub font: Option<&'a dyn StrokeFont>,
    /// Fonts for text, where outlines are wanted; characters that they lack are drawn in `font`.
    pub outlines: Option<&'a dyn OutlineFonts>,
}

/// What a file says about a pen.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PenSettings {
    /// Name of the layer it stands for.
    pub name: Option<String>,
    /// Colour of its first stroke: red, green, blue.
    pub color: Option<[u8; 3]>,
}

/// A drawing read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// Its ink; mm, y up, the origin in the page's lower-left corner.
    pub drawing: Drawing,
    /// Width and height of the page, mm.
    pub page_mm: [f64; 2],
    /// The pens that draw.
    pub pens: BTreeMap<Pen, PenSettings>,
    /// Findings, one per kind and subject with a count, in the order of their first places.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads an SVG file, plain or gzipped (`.svgz`).
///
/// Spans of strokes and diagnostics are bytes of the file's text as UTF-8: of the uncompressed text
/// for `.svgz`.
pub fn read(bytes: &[u8], options: &Options<'_>) -> Document {
    let mut findings = diagnostics::Findings::default();
    let Some(text) = source::text(bytes, &mut findings) else {
        return Document {
            drawing: Drawing::default(),
            page_mm: [0.0; 2],
            pens: BTreeMap::new(),
            diagnostics: findings.into_vec(""),
        };
    };
    let (result, text) =
        structure::with_tree(text, &mut findings, |tree, findings| walk::read(tree, options, findings));
    let result = result.unwrap_or_default();
    Document {
        drawing: result.drawing,
        page_mm: result.page_mm,
        pens: result.pens,
        diagnostics: findings.into_vec(&text),
    }
}
