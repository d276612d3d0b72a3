//! SVG of a drawing as understood: one layer a pen, one path a stroke, arcs as arcs.
//!
//! One unit is one millimetre and x is the drawing's own. SVG's y points down, so every y is the drawing's negated,
//! and the view box is where that puts the ink. Layers are marked as Inkscape marks them, which vpype reads too.

use std::f64::consts::{FRAC_PI_3, TAU};
use std::io::{self, Write};

use drawing::{Drawing, EllipticArc, Point, Rect, Segment, Stroke};

use crate::palette::{PenColors, hex, pen_colour};
use plan::file::text::Text;

/// Width of the lines, mm: a common fibre pen's.
const LINE_MM: f64 = 0.3;
/// White space around the ink, mm.
const MARGIN_MM: f64 = 1.0;
/// Where an ellipse is too flat for SVG's arcs, chords stay this close to it, mm.
const FLAT_TOLERANCE_MM: f64 = 0.001;

/// What surrounds the strokes of a drawing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Style {
    /// The page, mm in the drawing's frame; the ink with a margin of 1 mm if `None`.
    pub page: Option<Rect>,
    /// The pens' own colours.
    pub colors: PenColors,
}

/// Writes the drawing. Strokes keep their order within each pen's layer; pens are in the order of their numbers.
/// A dot is a path of no length with round ends, which shows as a dot. A drawing without ink is an empty page.
///
/// # Errors
/// Whatever the writer says.
pub fn write<W: Write + ?Sized>(drawing: &Drawing, style: &Style, out: &mut W) -> io::Result<()> {
    let mut text = Text::new(out);
    let ink = || drawing.bounding_box().unwrap_or(Rect::ZERO).inflate(MARGIN_MM, MARGIN_MM);
    let page = style.page.unwrap_or_else(ink);
    text.str("<svg xmlns=\"http://www.w3.org/2000/svg\"");
    text.str(" xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\"");
    view_box(&mut text, page);
    text.str(" fill=\"none\" stroke-width=\"").fixed(LINE_MM);
    text.str("\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n");
    for pen in drawing.pens() {
        text.str("<g id=\"pen")
            .int(pen.0)
            .str("\" inkscape:groupmode=\"layer\" inkscape:label=\"pen ")
            .int(pen.0);
        text.str("\" stroke=\"").str(&hex(pen_colour(pen.0, &style.colors))).str("\">\n");
        for stroke in drawing.strokes.iter().filter(|stroke| stroke.pen == pen) {
            text.str("<path d=\"");
            path(&mut text, &stroke)?;
            text.str("\"/>\n").flush_if_full()?;
        }
        text.str("</g>\n");
    }
    text.str("</svg>\n");
    text.finish()
}

/// The size on paper and the view box of a page that shows `bounds`, given with y up.
pub(crate) fn view_box<W: Write + ?Sized>(text: &mut Text<'_, W>, bounds: Rect) {
    text.str(" width=\"")
        .fixed(bounds.width())
        .str("mm\" height=\"")
        .fixed(bounds.height())
        .str("mm\" viewBox=\"");
    text.fixed(bounds.x0).byte(b' ').fixed(-bounds.y1).byte(b' ');
    text.fixed(bounds.width()).byte(b' ').fixed(bounds.height()).byte(b'"');
}

/// A point's coordinates, y down.
pub(crate) fn point<W: Write + ?Sized>(text: &mut Text<'_, W>, point: Point) {
    text.fixed(point.x).byte(b' ').fixed(-point.y);
}

/// A polyline as path data; a single point as a stretch of no length.
pub(crate) fn polyline<W: Write + ?Sized>(text: &mut Text<'_, W>, points: &[Point]) -> io::Result<()> {
    let [first, others @ ..] = points else { return Ok(()) };
    text.byte(b'M');
    point(text, *first);
    if others.is_empty() {
        text.str("h0");
    }
    for (index, &other) in others.iter().enumerate() {
        text.byte(if index == 0 { b'L' } else { b' ' });
        point(text, other);
        text.flush_if_full()?;
    }
    Ok(())
}

pub(crate) fn path<W: Write + ?Sized>(text: &mut Text<'_, W>, stroke: &Stroke) -> io::Result<()> {
    text.byte(b'M');
    point(text, stroke.start());
    if stroke.is_dot() {
        text.str("h0");
    }
    let mut after_line = false;
    for segment in stroke.segments() {
        match segment {
            Segment::Line(line) => {
                text.byte(if after_line { b' ' } else { b'L' });
                point(text, line.p1);
            }
            Segment::Cubic(cubic) => {
                text.byte(b'C');
                point(text, cubic.p1);
                text.byte(b' ');
                point(text, cubic.p2);
                text.byte(b' ');
                point(text, cubic.p3);
            }
            Segment::Arc(arc) => write_arc(text, &arc)?,
        }
        after_line = matches!(segment, Segment::Line(_));
        text.flush_if_full()?;
    }
    Ok(())
}

/// SVG's arcs go by radii, the first one's angle, and flags. The radii and the angle are the singular values of `[a b]` and
/// the direction of the first left singular vector: the eigenvector of `[a b][a b]^T` to its larger eigenvalue.
/// Pieces of a third of a turn at the most never need the large-arc flag.
fn write_arc<W: Write + ?Sized>(text: &mut Text<'_, W>, arc: &EllipticArc) -> io::Result<()> {
    let (longest, shortest) = arc.semi_axes();
    // Whole turns beyond the first two pieces' worth draw nothing new; the last point stays what it is.
    let sweep = if arc.sweep_rad.abs() > 2.0 * TAU {
        arc.sweep_rad % TAU + TAU.copysign(arc.sweep_rad)
    } else {
        arc.sweep_rad
    };
    let arc = EllipticArc { sweep_rad: sweep, ..*arc };
    if !(shortest >= FLAT_TOLERANCE_MM && longest.is_finite()) {
        let mut points = Vec::new();
        Segment::Arc(arc).flatten(FLAT_TOLERANCE_MM, |point| points.push(point));
        for chord_end in points {
            text.byte(b'L');
            point(text, chord_end);
            text.flush_if_full()?;
        }
        return Ok(());
    }
    let degrees = if arc.circle_radius().is_some() {
        0.0
    } else {
        let (a, b) = (arc.a, arc.b);
        let twice = libm::atan2(2.0 * (a.x * a.y + b.x * b.y), a.x * a.x + b.x * b.x - a.y * a.y - b.y * b.y);
        -(0.5 * twice).to_degrees()
    };
    // Counterclockwise with y up is the direction that SVG calls negative, flag 0.
    let clockwise = (arc.a.cross(arc.b) > 0.0) != (sweep > 0.0);
    let pieces = (sweep.abs() / (2.0 * FRAC_PI_3)).ceil().max(1.0) as u32;
    for piece in 1..=pieces {
        text.byte(b'A').fixed(longest).byte(b' ').fixed(shortest).byte(b' ').fixed(degrees);
        text.str(if clockwise { " 0 1 " } else { " 0 0 " });
        point(text, arc.eval(f64::from(piece) / f64::from(pieces)));
    }
    Ok(())
}
