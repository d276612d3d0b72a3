//! A drawing in the instructions of one plotter.

use std::f64::consts::PI;

use drawing::{Drawing, EllipticArc, Point, Segment, Stroke, Vec2, distance};

use super::plotter::Sheet;
use super::program::{polyline, with_durations};
use crate::program::Line;

/// How far chords may leave curves, plotter units: what the plotter's own rounding leaves of one.
const CHORD_UNITS: f64 = 0.2;
/// How far the pen may leave the drawing, plotter units.
const DEVIATION_UNITS: f64 = 0.95;
/// Shorter arcs than this many plotter units are drawn as chords: an `AA` would not be shorter.
const SHORTEST_ARC_UNITS: f64 = 80.0;
/// Ink this close to the limits is clamped to them: half a unit of rounding, and rounding errors of
/// placements that put it exactly there.
const CLAMPED_UNITS: f64 = 0.51;

/// Why a plotter cannot draw a drawing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlotterLimit {
    /// Ink lies where the pen cannot go.
    #[error(
        "the drawing reaches {x:.2}, {y:.2} mm (stroke {stroke}); {plotter} draws from 0, 0 to {width:.2}, {height:.2} mm on {paper}"
    )]
    OffPaper {
        /// Number of the stroke, from 1.
        stroke: usize,
        /// Where it lies, mm from the lower left corner of what the pen reaches.
        x: f64,
        /// The same, up.
        y: f64,
        /// The plotter's name.
        plotter: String,
        /// The paper's name.
        paper: String,
        /// What the pen reaches, mm.
        width: f64,
        /// The same, up.
        height: f64,
    },
    /// The drawing uses a pen that the plotter has not.
    #[error("the drawing uses pen {pen}; {plotter} holds pens 1 to {pens}")]
    NoSuchPen {
        /// The pen.
        pen: u16,
        /// The plotter's name.
        plotter: String,
        /// How many pens it holds.
        pens: u16,
    },
}

/// A position in whole plotter units.
type Units = (i64, i64);

/// The instructions that draw `drawing`, in mm from the lower left corner of what the pen reaches.
/// [`Line::row`] counts strokes, from 1; the instructions before the first stroke have row 0.
///
/// The pen stays within one plotter unit of the drawing: corners are rounded to whole units, curves
/// become chords, arcs of circles are `AA` where the plotter has it and its whole units and degrees
/// allow that.
///
/// # Errors
/// Ink that the pen cannot reach, or a pen that the plotter has not.
pub fn encode(drawing: &Drawing, sheet: &Sheet<'_>) -> Result<Vec<Line>, PlotterLimit> {
    let mut encoder = Encoder { sheet, lines: Vec::new(), row: 0 };
    let plotter = sheet.plotter;
    if !plotter.prologue.is_empty() {
        encoder.instruction(plotter.prologue.clone());
    }
    encoder.instruction("IN;".to_owned());
    if !sheet.paper.select.is_empty() {
        encoder.instruction(sheet.paper.select.clone());
    }
    let mut pen = 0;
    for (index, stroke) in drawing.strokes.iter().enumerate().filter(|(_, stroke)| stroke.pen.0 > 0) {
        if stroke.pen.0 > plotter.pens {
            let (pen, pens) = (stroke.pen.0, plotter.pens);
            return Err(PlotterLimit::NoSuchPen { pen, plotter: plotter.name.clone(), pens });
        }
        if stroke.pen.0 != pen {
            pen = stroke.pen.0;
            encoder.instruction(format!("SP{pen};"));
        }
        encoder.row += 1;
        encoder.stroke(&stroke, index + 1)?;
    }
    encoder.instruction("SP0;".to_owned());
    if !plotter.epilogue.is_empty() {
        encoder.instruction(plotter.epilogue.clone());
    }
    Ok(with_durations(encoder.lines))
}

struct Encoder<'a> {
    sheet: &'a Sheet<'a>,
    lines: Vec<Line>,
    row: u64,
}

impl Encoder<'_> {
    fn instruction(&mut self, text: String) {
        self.lines.push(Line { text, row: self.row, ..Line::default() });
    }

    fn stroke(&mut self, stroke: &Stroke, number: usize) -> Result<(), PlotterLimit> {
        let map = self.sheet.to_units();
        let mut here = self.rounded(map * stroke.start(), number)?;
        self.instruction(format!("PU{},{};", here.0, here.1));
        // Points of chords that are not written yet.
        let mut points: Vec<Units> = Vec::new();
        let mut drew = false;
        for segment in stroke.segments() {
            let segment = segment.transformed(map);
            let end = self.rounded(segment.end(), number)?;
            let arc = match &segment {
                Segment::Arc(arc) if self.sheet.plotter.knows("AA") => DeviceArc::of(arc, here, end),
                _ => None,
            };
            if let Some(arc) = arc {
                for point in arc.vertices(here) {
                    self.inside(point, number)?;
                }
                self.polyline(&points);
                points.clear();
                if !drew {
                    self.instruction("PD;".to_owned());
                }
                self.instruction(arc.text());
                drew = true;
                // Whole degrees end up to one degree short of the end, and the plotter may or may not round
                // where it stops.
                if distance(arc.at(here, arc.sweep_degrees as f64), point_of(end)) > 1e-6 {
                    points.push(end);
                }
            } else {
                let mut chords = Vec::new();
                segment.flatten(CHORD_UNITS, |point| chords.push(point));
                for point in chords {
                    let to = self.rounded(point, number)?;
                    if to != here {
                        points.push(to);
                        (here, drew) = (to, true);
                    }
                }
            }
            here = end;
        }
        if drew {
            self.polyline(&points);
        } else {
            self.instruction("PD;".to_owned());
        }
        self.instruction("PU;".to_owned());
        Ok(())
    }

    /// `PD` with as many points as the plotter's buffer takes.
    fn polyline(&mut self, points: &[Units]) {
        for text in polyline(points, self.sheet.plotter.line_bytes()) {
            self.instruction(text);
        }
    }

    /// The point in whole plotter units within the hard-clip limits.
    fn rounded(&self, point: Point, stroke: usize) -> Result<Units, PlotterLimit> {
        self.inside(point, stroke)?;
        let [left, bottom, right, top] = self.sheet.paper.hard_clip;
        // `as` saturates, and a NaN is outside of every limit.
        Ok(((point.x.round() as i64).clamp(left, right), (point.y.round() as i64).clamp(bottom, top)))
    }

    /// Refuses a point that the pen cannot reach.
    fn inside(&self, point: Point, stroke: usize) -> Result<(), PlotterLimit> {
        let [left, bottom, right, top] = self.sheet.paper.hard_clip.map(|units| units as f64);
        let x_fits = point.x >= left - CLAMPED_UNITS && point.x <= right + CLAMPED_UNITS;
        let y_fits = point.y >= bottom - CLAMPED_UNITS && point.y <= top + CLAMPED_UNITS;
        if x_fits && y_fits {
            return Ok(());
        }
        let at = self.sheet.to_units().inverse() * point;
        let area = self.sheet.area_mm();
        Err(PlotterLimit::OffPaper {
            stroke,
            x: at.x,
            y: at.y,
            plotter: self.sheet.plotter.name.clone(),
            paper: self.sheet.paper.name.clone(),
            width: area.width(),
            height: area.height(),
        })
    }
}

fn point_of(units: Units) -> Point {
    Point::new(units.0 as f64, units.1 as f64)
}

/// An `AA` instruction. Its centre is in whole plotter units, its angles in whole degrees (HP 7470A
/// manual, 3-17): the plotter turns its position about that centre.
#[derive(Clone, Copy, Debug, PartialEq)]
struct DeviceArc {
    center: Units,
    sweep_degrees: i64,
    chord_degrees: i64,
}

impl DeviceArc {
    /// The instruction that stays closest to `arc` (plotter units) from `start` to `end`; `None` if
    /// none stays close enough, and for ellipses.
    fn of(arc: &EllipticArc, start: Units, end: Units) -> Option<Self> {
        let radius = arc.circle_radius()?;
        let is_short = radius * arc.sweep_rad.abs() < SHORTEST_ARC_UNITS;
        if !radius.is_finite() || is_short || arc.sweep_rad.abs() > 2.0 * PI + 1e-9 {
            return None;
        }
        let center = (arc.center.x.round() as i64, arc.center.y.round() as i64);
        let neighbours = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (center.0 + dx, center.1 + dy)));
        let mut best: Option<(f64, Self)> = None;
        for center in neighbours {
            let Some(candidate) = Self::about(center, arc, start, end) else { continue };
            let off = candidate.deviation(arc, radius, start, end);
            if off <= DEVIATION_UNITS && best.is_none_or(|(least, _)| off < least) {
                best = Some((off, candidate));
            }
        }
        best.map(|(_, arc)| arc)
    }

    /// About this centre from `start` to less than a degree short of `end`, as many turns as `arc`.
    fn about(center: Units, arc: &EllipticArc, start: Units, end: Units) -> Option<Self> {
        let arm = |to: Units| Vec2::new((to.0 - center.0) as f64, (to.1 - center.1) as f64);
        let (from, to) = (arm(start), arm(end));
        let radius = libm::hypot(from.x, from.y);
        // Counterclockwise for positive sweeps on the paper: the sign of the map of `a` and `b`.
        let turn = if arc.a.cross(arc.b) >= 0.0 { 1.0 } else { -1.0 };
        let sweep_rad = turn * arc.sweep_rad;
        // Rounded ends and centre change the angle: by at most half a turn, or the arc is too small.
        let change =
            libm::remainder(libm::atan2(to.y, to.x) - libm::atan2(from.y, from.x) - sweep_rad, 2.0 * PI);
        // A full circle is 360 up to rounding; all others stop short.
        let degrees = (sweep_rad + change).to_degrees();
        let sweep_degrees = (degrees + degrees.signum() * 1e-6).trunc() as i64;
        let largest = 2.0 * libm::acos((1.0 - CHORD_UNITS / radius).max(-1.0));
        let chord_degrees = (largest.to_degrees().floor() as i64).min(30);
        (sweep_degrees != 0 && chord_degrees >= 1).then_some(Self { center, sweep_degrees, chord_degrees })
    }

    fn text(self) -> String {
        let Self { center: (x, y), sweep_degrees, chord_degrees } = self;
        format!("AA{x},{y},{sweep_degrees},{chord_degrees};")
    }

    /// The point that the plotter reaches after `degrees` from `start`.
    fn at(self, start: Units, degrees: f64) -> Point {
        let center = Point::new(self.center.0 as f64, self.center.1 as f64);
        let arm = Point::new(start.0 as f64, start.1 as f64) - center;
        let (sin, cos) = libm::sincos(degrees.to_radians());
        center + Vec2::new(cos * arm.x - sin * arm.y, sin * arm.x + cos * arm.y)
    }

    /// The ends of its chords.
    fn vertices(self, start: Units) -> impl Iterator<Item = Point> {
        let count = (self.sweep_degrees.abs() as f64 / self.chord_degrees as f64).ceil() as usize;
        let step = self.sweep_degrees as f64 / count as f64;
        (1..=count).map(move |k| self.at(start, step * k as f64))
    }

    /// The largest distance between what the plotter draws and `arc`.
    ///
    /// The executed circle is off by `|c' - c| cos(u - u0) + r' - r` at angle `u`: 64 samples find its
    /// largest value to 0.2 %. The chords' own error comes on top. Infinite if the pen stops elsewhere than
    /// less than a degree short of the end.
    fn deviation(self, arc: &EllipticArc, radius: f64, start: Units, end: Units) -> f64 {
        const SAMPLES: u32 = 64;
        let sweep = self.sweep_degrees as f64;
        let off = |k: u32| {
            let at = self.at(start, sweep * f64::from(k) / f64::from(SAMPLES));
            (distance(at, arc.center) - radius).abs()
        };
        let circle = (0..=SAMPLES).map(off).fold(0.0, f64::max);
        let chord = radius * (1.0 - libm::cos((0.5 * self.chord_degrees as f64).to_radians()));
        let short = (arc.sweep_rad.abs().to_degrees() - sweep.abs()).max(0.0);
        // Half diagonals of two rounded points.
        let rest = radius * short.to_radians() + 1.5;
        let gap = distance(self.at(start, sweep), point_of(end));
        if gap > rest { f64::INFINITY } else { circle + chord }
    }
}
