//! Reading small files and printing their ink.
#![allow(dead_code, reason = "each test binary uses its part")]

use std::fmt::Write as _;

use hpgl::{Document, Options, read};

pub(crate) fn document(bytes: &[u8]) -> Document {
    let options = Options::default();
    let document = read(bytes, &options);
    assert_eq!(document, hpgl::interpret(&hpgl::parse(bytes, &options), &options), "one pass and two differ");
    document
}

/// The strokes of the first page in plotter units: `pen: x,y x,y ...`, curves marked by `~` before
/// their end.
pub(crate) fn ink(document: &Document) -> Vec<String> {
    let stroke = |stroke: drawing::Stroke| {
        let plu = |mm: f64| {
            let value = mm / hpgl::PLOTTER_UNIT_MM;
            ((value * 1e4).round() / 1e4 + 0.0).to_string()
        };
        let mut text = format!("{}: {},{}", stroke.pen.0, plu(stroke.start().x), plu(stroke.start().y));
        for segment in stroke.segments() {
            let curve = if matches!(segment, drawing::Segment::Line(_)) { "" } else { "~" };
            let _ = write!(text, " {curve}{},{}", plu(segment.end().x), plu(segment.end().y));
        }
        text
    };
    document.pages[0].drawing.strokes.iter().map(stroke).collect()
}

pub(crate) fn codes(document: &Document) -> Vec<&'static str> {
    document.diagnostics.iter().map(|diagnostic| diagnostic.code.name()).collect()
}

#[track_caller]
pub(crate) fn check(bytes: &[u8], strokes: &[&str], diagnostics: &[&str]) {
    let document = document(bytes);
    assert_eq!(ink(&document), strokes, "ink of {:?}", bytes.escape_ascii().to_string());
    assert_eq!(codes(&document), diagnostics, "diagnostics of {:?}", bytes.escape_ascii().to_string());
}
