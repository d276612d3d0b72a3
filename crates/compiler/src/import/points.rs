//! Text with points `<x, y>` in mm, such as Inkscape's POV-Ray export and the polar robot's program
//! use (docs/references.md, report 4). Everything else in the file is skipped.
//!
//! All points are one stroke of pen 1; a point equal to the one before it is left out. The robot's
//! own program also leaves out the last point where it equals the first, and with it the line that
//! closes a figure: here that line is drawn. The drawing's (0, 0) is the lower left corner of the
//! robot's box, at -138 mm, 0 from its pivot, where the preset `polar` has its sheet.

use drawing::{Drawing, Pen, Point, Span, Stroke};

use super::{Document, Fact, Importer, Page};

/// Recognized by a first byte that HP-GL does not begin with, and a point in the first 4 KiB.
pub(super) const IMPORTER: Importer = Importer {
    name: "points",
    recognizes: looks_like_points,
    read: |bytes, _| {
        Ok(Document {
            format: "points",
            pages: vec![Page { drawing: read(bytes), ..Page::default() }],
            diagnostics: Vec::new(),
            size: format!("{} points", points(bytes).count()),
            facts: vec![Fact { key: "dialect", value: "points <x, y>, mm".to_owned() }],
        })
    },
};

/// The first point begins within this many bytes.
const HEAD_BYTES: usize = 4096;

/// Whether a file's first bytes are those of a list of points.
fn looks_like_points(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(HEAD_BYTES)];
    // POV-Ray's comments and directives begin with these bytes; no plotter language does.
    head.trim_ascii_start().first().is_some_and(|byte| b"</#".contains(byte)) && points(head).next().is_some()
}

/// The points of a file as one stroke; no stroke where there are no points.
fn read(bytes: &[u8]) -> Drawing {
    let mut vertices: Vec<Point> = Vec::new();
    let mut span: Option<Span> = None;
    for (point, start, end) in points(bytes) {
        if vertices.last() != Some(&point) {
            vertices.push(point);
        }
        span = Some(Span { start: span.map_or(start, |span| span.start), end });
    }
    let stroke = Stroke::polyline(Pen(1), vertices, span.unwrap_or_default());
    Drawing { strokes: stroke.into_iter().collect() }
}

/// The points, each with its first byte and the one after its last.
fn points(bytes: &[u8]) -> impl Iterator<Item = (Point, usize, usize)> + '_ {
    let opens = bytes.iter().enumerate().filter(|(_, byte)| **byte == b'<').map(|(at, _)| at);
    opens.filter_map(|start| {
        // Two numbers of doubles take less than this.
        let rest = &bytes[start + 1..bytes.len().min(start + 80)];
        let length = rest.iter().position(|byte| *byte == b'>')?;
        let (x, y) = std::str::from_utf8(&rest[..length]).ok()?.split_once(',')?;
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|mm| mm.abs() < 1e6);
        Some((Point::new(number(x)?, number(y)?), start, start + length + 2))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const POV: &[u8] = b"/* a comment <1> <1, 2, 3> */\n#declare a = prism {\n  <70.05, 82.46>, <70.05, 82.46>,\n  <74.1,83>,\n<70.05, 82.46>\n}";

    #[test]
    fn points_are_one_stroke() {
        assert!(looks_like_points(POV));
        let drawing = read(POV);
        let stroke = &drawing.strokes.to_vec()[0];
        let expected = [(70.05, 82.46), (74.1, 83.0), (70.05, 82.46)].map(|(x, y)| Point::new(x, y));
        assert_eq!(stroke.flatten(0.1), expected);
        assert_eq!(drawing.strokes.len(), 1);
    }

    #[test]
    fn other_files_are_not_points() {
        for other in
            [&b"IN;SP1;LB<1.0, 2.0>\x03;"[..], b"", b"<svg width=\"3\">", b"/* no points */", b"# t <1,2"]
        {
            assert!(!looks_like_points(other), "{}", other.escape_ascii());
        }
    }
}
