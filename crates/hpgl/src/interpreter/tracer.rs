//! The pen on the paper: joins pen-down movement to strokes, clipped to the window; mm.

use std::sync::Arc;

use drawing::{Lettering, Line, Pen, Pitch, Point, Rect, Segment, Span, Strokes, Trail, clip_segment};

use super::line_type::{Dash, Dashes};

/// Steps shorter than this (mm) are rounding, not movement.
const NO_STEP: f64 = 1e-9;

pub(crate) fn same(a: Point, b: Point) -> bool {
    (a.x - b.x).abs() < NO_STEP && (a.y - b.y).abs() < NO_STEP
}

/// Gathers strokes.
#[derive(Clone, Debug)]
pub(crate) struct Tracer {
    pub(crate) strokes: Strokes,
    /// The plotter unit, by which nearly all points lie.
    pitch: Option<Pitch>,
    /// The pen in use.
    pen: Pen,
    /// The command at work.
    command: Span,
    /// The stroke being drawn.
    trail: Trail,
    /// The bytes of the stroke being drawn.
    source: Span,
    /// The pen came down at the only point yet: it leaves a dot.
    dot: bool,
    clip: Option<Rect>,
    dashes: Option<Dashes>,
    /// How many dashes may still be drawn, in all the file, and whether that was too few.
    dashes_left: f64,
    given_up: bool,
    /// How often ink was cut off since this was last looked at.
    clipped: u64,
}

impl Tracer {
    /// A tracer that draws at most `dashes_left` dashes; `unit_mm` is the plotter unit.
    pub(crate) fn new(dashes_left: f64, unit_mm: f64) -> Self {
        Self {
            strokes: Strokes::default(),
            pitch: Pitch::from_mm(unit_mm),
            pen: Pen(1),
            command: Span::default(),
            trail: Trail::default(),
            source: Span::default(),
            dot: false,
            clip: None,
            dashes: None,
            dashes_left,
            given_up: false,
            clipped: 0,
        }
    }

    /// The command that draws from now on.
    #[inline]
    pub(crate) fn set_command(&mut self, span: Span) {
        self.command = span;
    }

    /// Draws with that pen from now on.
    pub(crate) fn set_pen(&mut self, pen: Pen) {
        if pen != self.pen {
            self.finish();
            self.pen = pen;
        }
    }

    /// Clips to that rectangle from now on; an empty one holds nothing.
    pub(crate) fn set_clip(&mut self, clip: Option<Rect>) {
        if clip != self.clip {
            self.finish();
            self.clip = clip;
        }
    }

    /// Draws with that line pattern from now on, from its beginning.
    pub(crate) fn set_dashes(&mut self, dashes: Option<Dashes>) {
        if dashes.is_some() || self.dashes.is_some() {
            self.finish();
            self.dashes = dashes;
        }
    }

    /// Draws with that line pattern from now on, as far as it has come, and gives the one before
    /// back.
    pub(crate) fn swap_dashes(&mut self, dashes: Option<Dashes>) -> Option<Dashes> {
        std::mem::replace(&mut self.dashes, dashes)
    }

    /// Whether lines were drawn solid because dashes would have been too many, since this was last
    /// asked.
    pub(crate) fn take_given_up(&mut self) -> bool {
        std::mem::take(&mut self.given_up)
    }

    pub(crate) fn take_clipped(&mut self) -> u64 {
        std::mem::take(&mut self.clipped)
    }

    /// Whether anything is drawn on this page.
    pub(crate) fn has_ink(&self) -> bool {
        !self.strokes.is_empty() || !self.trail.is_empty()
    }

    /// Puts the pen down: a dot, unless it moves.
    pub(crate) fn lower(&mut self, at: Point) {
        self.finish();
        if self.clip.is_some_and(|clip| !holds(clip, at)) {
            self.clipped += 1;
            return;
        }
        self.begin(at);
        self.dot = true;
    }

    /// Forgets that the pen came down here, if it has not moved.
    pub(crate) fn discard_dot(&mut self) {
        if self.dot && self.trail.len() == 1 {
            self.trail.clear();
            self.dot = false;
        }
    }

    /// A dot by itself.
    pub(crate) fn dot(&mut self, at: Point) {
        self.lower(at);
        self.finish();
    }

    fn begin(&mut self, at: Point) {
        self.trail.begin(at);
        self.source = self.command;
        self.dot = false;
    }

    /// Draws a straight line.
    #[inline]
    pub(crate) fn line(&mut self, from: Point, to: Point) {
        if self.dashes.is_some() || self.clip.is_some_and(|clip| !(holds(clip, from) && holds(clip, to))) {
            self.segment(&Segment::Line(Line::new(from, to)));
        } else {
            self.append_line(from, to);
        }
    }

    /// Draws an outline by itself: its pieces, as far as their pen is down. The line pattern begins
    /// anew, and continues afterwards where it was.
    pub(crate) fn outline(&mut self, pieces: impl Iterator<Item = (Segment, bool)>) {
        self.finish();
        let dashes = self.dashes.clone();
        self.dashes = dashes.as_ref().map(Dashes::restarted);
        for (segment, down) in pieces {
            if down {
                self.segment(&segment);
            } else {
                self.finish();
            }
        }
        self.finish();
        self.dashes = dashes;
    }

    #[inline]
    fn append_line(&mut self, from: Point, to: Point) {
        self.connect(from);
        if !self.trail.end().is_some_and(|end| same(end, to)) {
            self.trail.line_to(to);
        }
        self.source.end = self.command.end;
    }

    /// Sees to it that the stroke being drawn ends at `from`.
    #[inline]
    fn connect(&mut self, from: Point) {
        if !self.trail.end().is_some_and(|end| same(end, from)) {
            self.finish();
            self.begin(from);
        }
    }

    /// Draws a line, an arc or a curve.
    pub(crate) fn segment(&mut self, segment: &Segment) {
        let Some(mut dashes) = self.dashes.take() else {
            self.solid(segment);
            return;
        };
        let count = dashes.pieces_along(segment.length());
        if count > self.dashes_left {
            self.given_up = true;
            self.solid(segment);
        } else {
            self.dashes_left -= count;
            self.discard_dot();
            dashes.cut(segment, |dash| match dash {
                Dash::Piece(piece) => self.solid(&piece),
                Dash::Dot(at) => self.dot(at),
            });
        }
        self.dashes = Some(dashes);
    }

    fn solid(&mut self, segment: &Segment) {
        let Some(clip) = self.clip else {
            self.append(segment);
            return;
        };
        let parts = clip_segment(segment, clip);
        if parts.as_slice() != [(0.0, 1.0)] {
            self.clipped += 1;
        }
        for (from, to) in parts {
            self.append(&if (from, to) == (0.0, 1.0) { *segment } else { segment.part(from, to) });
        }
    }

    fn append(&mut self, segment: &Segment) {
        if let Segment::Line(line) = segment {
            self.append_line(line.p0, line.p1);
            return;
        }
        self.connect(segment.start());
        self.trail.push(segment);
        self.source.end = self.command.end;
    }

    /// Whether a point is kept by the clip.
    pub(crate) fn keeps(&self, at: Point) -> bool {
        self.clip.is_none_or(|clip| holds(clip, at))
    }

    /// A label of that many strokes, all of them within the clip.
    pub(crate) fn label(&mut self, lettering: &Arc<dyn Lettering>, text: &[u8], strokes: u32) {
        self.finish();
        self.strokes.push_label(self.pen, self.command, lettering, text, strokes);
    }

    /// Lifts the pen: what was drawn is a stroke.
    #[inline]
    pub(crate) fn finish(&mut self) {
        if self.trail.len() > 1 || self.dot {
            self.strokes.push_trail(self.pen, self.source, &self.trail, self.pitch);
        }
        self.trail.clear();
        self.dot = false;
    }

    /// Ends the page.
    pub(crate) fn take_page(&mut self) -> Strokes {
        self.finish();
        let mut strokes = std::mem::take(&mut self.strokes);
        strokes.shrink_to_fit();
        strokes
    }
}

#[inline]
fn holds(clip: Rect, p: Point) -> bool {
    clip.x0 <= p.x && p.x <= clip.x1 && clip.y0 <= p.y && p.y <= clip.y1 && clip.x1 > clip.x0
}
