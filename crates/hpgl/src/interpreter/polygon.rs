//! The polygon buffer: `PM EP FP`.

use drawing::{Line, Point, Segment};

use super::Interpreter;
use crate::codes;

/// One outline of a polygon, on the page in mm.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outline {
    /// Its pieces, each with whether the pen was down: those with the pen up bound the area but are
    /// not edged.
    pub(crate) pieces: Vec<(Segment, bool)>,
    start: Option<Point>,
}

impl Outline {
    fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }
}

/// What stands between `PM0` and `PM2`.
#[derive(Clone, Copy, Debug)]
struct Before {
    down: bool,
    position: Point,
    relative: bool,
}

/// The polygon buffer.
#[derive(Clone, Debug, Default)]
pub(crate) struct Polygon {
    outlines: Vec<Outline>,
    current: Outline,
    /// The next point begins an outline, whatever the pen does.
    fresh: bool,
    before: Option<Before>,
}

impl Polygon {
    pub(crate) fn is_open(&self) -> bool {
        self.before.is_some()
    }

    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Holds one outline that is given whole.
    pub(crate) fn set(&mut self, segments: &[Segment]) {
        self.clear();
        self.add_outline(segments);
    }

    /// Adds one outline that is given whole.
    pub(crate) fn add_outline(&mut self, segments: &[Segment]) {
        self.outlines.push(Outline {
            pieces: segments.iter().map(|segment| (*segment, true)).collect(),
            start: segments.first().map(Segment::start),
        });
    }

    pub(crate) fn line(&mut self, from: Point, to: Point, down: bool) {
        self.segment(Segment::Line(Line::new(from, to)), down);
    }

    pub(crate) fn segment(&mut self, segment: Segment, down: bool) {
        if self.fresh {
            self.fresh = false;
            self.current.start = Some(segment.end());
            return;
        }
        if self.current.start.is_none() {
            self.current.start = Some(segment.start());
        }
        self.current.pieces.push((segment, down));
    }

    /// Closes the outline at hand with a straight piece where it is open.
    fn close(&mut self, down: bool) {
        let mut outline = std::mem::take(&mut self.current);
        if outline.is_empty() {
            return;
        }
        if let (Some(start), Some((last, _))) = (outline.start, outline.pieces.last()) {
            let end = last.end();
            if (end - start).hypot2() > 1e-18 {
                outline.pieces.push((Segment::Line(Line::new(end, start)), down));
            }
        }
        self.outlines.push(outline);
    }

    pub(crate) fn outlines(&self) -> &[Outline] {
        &self.outlines
    }
}

impl Interpreter {
    /// `PM`: 0 begins a polygon, 1 its next outline, 2 ends it.
    pub(super) fn polygon_mode(&mut self, p: &[f64]) {
        match p.first().copied().unwrap_or(0.0) {
            0.0 => {
                self.tracer.discard_dot();
                self.tracer.finish();
                self.polygon.clear();
                self.polygon.before =
                    Some(Before { down: self.down, position: self.position, relative: self.relative });
                self.polygon.current.start = Some(self.position_mm);
            }
            1.0 if self.polygon.is_open() => {
                self.polygon.close(self.down);
                self.polygon.fresh = true;
            }
            2.0 if self.polygon.is_open() => {
                self.polygon.close(self.down);
                self.polygon.fresh = false;
                if let Some(before) = self.polygon.before.take() {
                    self.down = before.down;
                    self.relative = before.relative;
                    self.set_pen_position(before.position);
                }
            }
            1.0 | 2.0 => self.report(codes::BAD_PARAMETERS, || "PM1 and PM2 need a PM0 before them".into()),
            _ => self.bad_parameters("0, 1 or 2"),
        }
    }

    /// `EP`: draws the outlines, as far as the pen was down.
    pub(super) fn edge_polygon(&mut self) {
        if self.polygon.outlines().is_empty() {
            self.report(codes::EMPTY_POLYGON, || "there is no polygon to draw".into());
            return;
        }
        self.ink();
        for outline in self.polygon.outlines() {
            self.tracer.outline(outline.pieces.iter().copied());
        }
    }

    /// `FP`: fills the outlines; 0 by parity, 1 by winding.
    pub(super) fn fill_polygon(&mut self, p: &[f64]) {
        if self.polygon.outlines().is_empty() {
            self.report(codes::EMPTY_POLYGON, || "there is no polygon to fill".into());
            return;
        }
        self.fill_outlines(p.first() == Some(&1.0));
    }
}
