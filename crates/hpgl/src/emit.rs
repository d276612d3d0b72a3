//! Writing HP-GL: the plainest words of the language, so that every reader takes them.

use std::collections::BTreeMap;

use drawing::{Drawing, Pen, Point, Stroke};

use crate::units::PLOTTER_UNIT_MM;

/// Pairs of coordinates a `PD`: plotters with a small buffer, and senders that split at semicolons,
/// take commands of a hundred bytes or so.
const PAIRS_A_COMMAND: usize = 16;

/// How coordinates are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoding {
    /// `PU` and `PD` with decimal numbers: every reader takes it.
    #[default]
    Decimal,
    /// `PE` in base 64: the fewest bytes; needs HP-GL/2 and 8-bit lines.
    Base64,
    /// `PE` in base 32: needs HP-GL/2, passes 7-bit lines.
    Base32,
}

/// How to write a drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct EmitOptions {
    /// Size of a plotter unit, mm.
    pub plotter_unit_mm: f64,
    /// How far chords may leave arcs and curves, mm, before coordinates are rounded to whole
    /// plotter units.
    pub tolerance_mm: f64,
    /// How coordinates are written.
    pub encoding: Encoding,
    /// Colours of pens, red, green and blue. Written (`PC`) only with the encodings of HP-GL/2.
    pub colors: BTreeMap<Pen, [u8; 3]>,
}

impl Default for EmitOptions {
    /// Plotter units of 0.025 mm, chords within a quarter of one, decimal numbers.
    fn default() -> Self {
        Self {
            plotter_unit_mm: PLOTTER_UNIT_MM,
            tolerance_mm: PLOTTER_UNIT_MM / 4.0,
            encoding: Encoding::Decimal,
            colors: BTreeMap::new(),
        }
    }
}

/// Writes a drawing in absolute whole plotter units, with `IN SP PU PD` (or `IN PC SP PE PU`)
/// and nothing else.
///
/// Strokes come in the order of the drawing, each from its first point to its last; dots are `PD`
/// without coordinates. Points that round to the same whole units become one. Strokes of pen 0 draw
/// nothing and are left out. What is written reads back as the same drawing, rounded; written
/// again, it gives the same bytes.
pub fn emit(drawing: &Drawing, options: &EmitOptions) -> Vec<u8> {
    let mut out = b"IN;\n".to_vec();
    if options.encoding != Encoding::Decimal {
        for (Pen(pen), [red, green, blue]) in &options.colors {
            out.extend_from_slice(format!("PC{pen},{red},{green},{blue};\n").as_bytes());
        }
    }
    let mut pen = 0;
    for stroke in drawing.strokes.iter().filter(|stroke| stroke.pen.0 > 0) {
        if stroke.pen.0 != pen {
            pen = stroke.pen.0;
            out.extend_from_slice(format!("SP{pen};\n").as_bytes());
        }
        let points = whole_units(&stroke, options);
        match options.encoding {
            Encoding::Decimal => decimal(&points, &mut out),
            Encoding::Base64 => encoded(&points, 64, &mut out),
            Encoding::Base32 => encoded(&points, 32, &mut out),
        }
    }
    out.extend_from_slice(b"PU;SP0;\n");
    out
}

/// The stroke's points in whole plotter units, none twice in a row.
fn whole_units(stroke: &Stroke, options: &EmitOptions) -> Vec<(i64, i64)> {
    // `as` saturates: a coordinate can be large, never undefined.
    let units = |mm: f64| (mm / options.plotter_unit_mm).round() as i64;
    let mut points: Vec<(i64, i64)> =
        stroke.flatten(options.tolerance_mm).into_iter().map(|Point { x, y }| (units(x), units(y))).collect();
    points.dedup();
    points
}

fn decimal(points: &[(i64, i64)], out: &mut Vec<u8>) {
    let Some((&(x, y), rest)) = points.split_first() else { return };
    out.extend_from_slice(format!("PU{x},{y};").as_bytes());
    if rest.is_empty() {
        out.extend_from_slice(b"PD;\n");
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
}

/// One `PE` a stroke: with the pen up to its first point, absolute; from there on steps. A dot is a
/// step of nothing.
fn encoded(points: &[(i64, i64)], base: u64, out: &mut Vec<u8>) {
    let Some((&(x, y), rest)) = points.split_first() else { return };
    out.extend_from_slice(if base == 32 { b"PE7<=" } else { b"PE<=" });
    number(x, base, out);
    number(y, base, out);
    let mut from = (x, y);
    for &to in if rest.is_empty() { &points[..1] } else { rest } {
        number(to.0.saturating_sub(from.0), base, out);
        number(to.1.saturating_sub(from.1), base, out);
        from = to;
    }
    out.extend_from_slice(b";\n");
}

/// A number in digits of the base, least significant first, its sign in the lowest bit; see the
/// `encoded` module.
fn number(value: i64, base: u64, out: &mut Vec<u8>) {
    let mut rest = (value.unsigned_abs() << 1) | u64::from(value < 0);
    while rest >= base {
        out.push(63 + (rest % base) as u8);
        rest /= base;
    }
    out.push(rest as u8 + if base == 64 { 191 } else { 95 });
}
