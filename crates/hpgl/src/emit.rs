//! Writing HP-GL: the plainest words of the language, so that every reader takes them.

use drawing::{Drawing, Point, Stroke};

use crate::units::PLOTTER_UNIT_MM;

/// Pairs of coordinates a `PD`: plotters with a small buffer, and senders that split at semicolons, take commands of
/// a hundred bytes or so.
const PAIRS_A_COMMAND: usize = 16;

/// How to write a drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct EmitOptions {
    /// Size of a plotter unit, mm.
    pub plotter_unit_mm: f64,
    /// How far chords may leave arcs and curves, mm, before coordinates are rounded to whole plotter units.
    pub tolerance_mm: f64,
}

impl Default for EmitOptions {
    /// Plotter units of 0.025 mm, chords within a quarter of one.
    fn default() -> Self {
        Self { plotter_unit_mm: PLOTTER_UNIT_MM, tolerance_mm: PLOTTER_UNIT_MM / 4.0 }
    }
}

/// Writes a drawing in absolute whole plotter units, with `IN SP PU PD` and nothing else.
///
/// Strokes come in the order of the drawing, each from its first point to its last; dots are `PD` without
/// coordinates. Points that round to the same whole units become one. Strokes of pen 0 draw nothing and are left out.
pub fn emit(drawing: &Drawing, options: &EmitOptions) -> Vec<u8> {
    let mut out = b"IN;\n".to_vec();
    let mut pen = 0;
    for stroke in drawing.strokes.iter().filter(|stroke| stroke.pen.0 > 0) {
        if stroke.pen.0 != pen {
            pen = stroke.pen.0;
            out.extend_from_slice(format!("SP{pen};\n").as_bytes());
        }
        emit_stroke(stroke, options, &mut out);
    }
    out.extend_from_slice(b"PU;SP0;\n");
    out
}

fn emit_stroke(stroke: &Stroke, options: &EmitOptions, out: &mut Vec<u8>) {
    let mut points: Vec<(i64, i64)> = stroke
        .flatten(options.tolerance_mm)
        .into_iter()
        .map(|Point { x, y }| {
            // `as` saturates: a coordinate can be large, never undefined.
            ((x / options.plotter_unit_mm).round() as i64, (y / options.plotter_unit_mm).round() as i64)
        })
        .collect();
    points.dedup();
    let Some((&(x, y), rest)) = points.split_first() else { return };
    out.extend_from_slice(format!("PU{x},{y};").as_bytes());
    if rest.is_empty() {
        out.extend_from_slice(b"PD;");
    }
    for piece in rest.chunks(PAIRS_A_COMMAND) {
        out.extend_from_slice(b"PD");
        for (index, (x, y)) in piece.iter().enumerate() {
            if index > 0 {
                out.push(b',');
            }
            out.extend_from_slice(format!("{x},{y}").as_bytes());
        }
        out.extend_from_slice(b";\n");
    }
    if rest.is_empty() {
        out.push(b'\n');
    }
}
