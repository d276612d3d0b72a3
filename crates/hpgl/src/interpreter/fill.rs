//! Fills: `FT AC PT`, and the hatch lines that stand for them.
//!
//! A pen fills an area by lines: solid fills as close as the pen is thick, hatches as set by `FT`,
//! shades by the share of paper that they cover. Lines lie on a grid through the anchor corner, so
//! that neighbouring areas match, are cut at the area's edges, and are drawn to and fro.

use drawing::{Affine, FillRule, HatchGrid, HatchLine, Point, Vec2};

use super::Interpreter;
use crate::codes;

/// Pen thickness without `PT` or `PW`, mm.
const DEFAULT_PEN_MM: f64 = 0.3;
/// Shares of paper that raster fills and patterns of printers are taken for.
const RASTER_SHARE: f64 = 0.25;

/// What `FT` set.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FillType {
    number: i32,
    /// Spacing in current units and angle in degrees of types 3 and 4; a spacing of nothing is 1 %
    /// of the diagonal.
    hatch: [(Option<f64>, f64); 2],
    /// Percent of type 10.
    shade: f64,
    /// Pattern of type 21.
    pattern: i32,
    /// Current units at the time, plotter units of the turned frame.
    pub(super) anchor: Point,
    /// Pen thickness by `PT`, mm.
    pub(super) pen_thickness: Option<f64>,
}

impl Default for FillType {
    fn default() -> Self {
        Self {
            number: 1,
            hatch: [(None, 0.0); 2],
            shade: 50.0,
            pattern: 1,
            anchor: Point::ZERO,
            pen_thickness: None,
        }
    }
}

impl FillType {
    /// The default fill with a pen of that thickness, mm.
    pub(super) fn with_pen(pen_thickness: Option<f64>) -> Self {
        Self { pen_thickness, ..Self::default() }
    }
}

/// One set of parallel lines.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Hatch {
    spacing_mm: f64,
    /// In the turned frame, degrees.
    angle: f64,
    /// Lines all drawn in the same direction.
    one_way: bool,
}

impl Interpreter {
    /// `FT`.
    pub(super) fn fill_type(&mut self, p: &[f64]) {
        let fill = &mut self.fill;
        match *p {
            [] => {
                *fill = FillType {
                    anchor: fill.anchor,
                    pen_thickness: fill.pen_thickness,
                    ..FillType::default()
                };
            }
            [number, ref options @ ..] => {
                let number = number.trunc() as i32;
                match number {
                    1 | 2 | 11 | 22 => {}
                    3 | 4 => {
                        let hatch = &mut fill.hatch[number as usize - 3];
                        if let Some(&spacing) = options.first() {
                            hatch.0 = (spacing > 0.0).then_some(spacing);
                        }
                        if let Some(&angle) = options.get(1) {
                            hatch.1 = angle;
                        }
                    }
                    10 => fill.shade = options.first().copied().unwrap_or(fill.shade),
                    21 => {
                        fill.pattern = options.first().map_or(fill.pattern, |pattern| pattern.trunc() as i32);
                    }
                    _ => {
                        self.bad_parameters("a fill type: 1 to 4, 10, 11, 21 or 22");
                        return;
                    }
                }
                fill.number = number;
            }
        }
    }

    /// `AC`: the point that hatch lines go through.
    pub(super) fn anchor_corner(&mut self, p: &[f64]) {
        self.fill.anchor = match *p {
            [x, y, ..] => self.frame.plu_of_user(Point::new(x, y)),
            _ => Point::ZERO,
        };
        self.apply_line_type();
    }

    /// `PT`: how thick the pen is, mm.
    pub(super) fn pen_thickness(&mut self, p: &[f64]) {
        self.fill.pen_thickness = p.first().copied().filter(|&mm| mm > 0.0);
    }

    fn hatches(&mut self) -> Vec<Hatch> {
        let pen = self.fill.pen_thickness.unwrap_or(DEFAULT_PEN_MM).clamp(0.1, 5.0);
        let one = |spacing_mm, angle| vec![Hatch { spacing_mm, angle, one_way: false }];
        let two = |spacing_mm, angle: f64| {
            vec![
                Hatch { spacing_mm, angle, one_way: false },
                Hatch { spacing_mm, angle: angle + 90.0, one_way: false },
            ]
        };
        let shade = |percent: f64| {
            if percent > 0.0 { one(pen * 100.0 / percent.min(100.0), 45.0) } else { Vec::new() }
        };
        match self.fill.number {
            2 => vec![Hatch { spacing_mm: pen, angle: 0.0, one_way: true }],
            number @ (3 | 4) => {
                let (spacing, angle) = self.fill.hatch[number as usize - 3];
                let (p1, p2) = self.frame.points();
                let spacing_plu = match spacing {
                    Some(spacing) => self.frame.plu_of_user_step(Vec2::new(spacing, 0.0)).x.abs(),
                    None => (p2 - p1).hypot2().sqrt() / 100.0,
                };
                let spacing_mm = spacing_plu * self.frame.unit_mm();
                if number == 3 { one(spacing_mm, angle) } else { two(spacing_mm, angle) }
            }
            10 => shade(self.fill.shade),
            11 | 22 => {
                let number = self.fill.number;
                self.report(codes::FILL_REPLACED, || {
                    format!("fill type {number} is a raster of a printer: a hatch of a quarter of the paper is drawn")
                });
                shade(100.0 * RASTER_SHARE)
            }
            21 => {
                let spacing = pen / RASTER_SHARE;
                match self.fill.pattern {
                    1 => one(spacing, 0.0),
                    2 => one(spacing, 90.0),
                    3 => one(spacing, 45.0),
                    4 => one(spacing, -45.0),
                    5 => two(spacing, 0.0),
                    _ => two(spacing, 45.0),
                }
            }
            _ => one(pen, 0.0),
        }
    }

    /// Fills the polygon buffer.
    pub(super) fn fill_outlines(&mut self, non_zero: bool) {
        let hatches = self.hatches();
        if hatches.is_empty() {
            return;
        }
        let rule = if non_zero { FillRule::NonZero } else { FillRule::EvenOdd };
        self.ink();
        self.tracer.finish();
        // Solid fills and shades are areas, not lines: a line type does not break them.
        let dashed = matches!(self.fill.number, 3 | 4);
        let dashes = self.tracer.swap_dashes(None);
        let anchor = self.frame.mm_of_plu(self.fill.anchor);
        for hatch in hatches {
            let direction = self.frame.direction_mm(hatch.angle);
            let grid = HatchGrid { anchor, direction, spacing_mm: hatch.spacing_mm };
            let pieces = self.polygon.outlines().iter().flat_map(|outline| &outline.pieces);
            let lines = grid.lines(pieces.map(|(segment, _)| segment), rule, &mut self.pieces_left);
            let Some(lines) = lines else {
                self.report(codes::TOO_MANY_PIECES, || {
                    "the hatch is too fine for an area of this size: it is not filled".into()
                });
                break;
            };
            for HatchLine { row, from, to } in lines {
                if dashed {
                    self.tracer.swap_dashes(dashes.as_ref().map(super::line_type::Dashes::restarted));
                }
                let backwards = !hatch.one_way && row.rem_euclid(2) == 1;
                let (from, to) = if backwards { (to, from) } else { (from, to) };
                self.tracer.line(from, to);
                self.tracer.finish();
            }
        }
        self.tracer.swap_dashes(dashes);
    }
}

/// The direction of an angle under the linear part of a map, as a unit vector.
pub(super) fn direction_under(map: Affine, degrees: f64) -> Vec2 {
    let v = super::arcs::turned(Vec2::new(1.0, 0.0), degrees);
    let [a, b, c, d, _, _] = map.as_coeffs();
    let v = Vec2::new(a * v.x + c * v.y, b * v.x + d * v.y);
    v / v.hypot2().sqrt()
}
