//! Ink: pieces in mm, clipped, as strokes.

use std::rc::Rc;

use drawing::{FillRule, HatchGrid, Line, Pen, Point, Segment, Span, Stroke, Vec2};

use crate::Hatch;
use crate::attributes;
use crate::clip::Region;
use crate::limits;
use crate::path::Subpath;
use crate::pens::Keys;

/// With what, within what and for which element something is drawn.
#[derive(Clone, Debug)]
pub(crate) struct Ink {
    pub(crate) key: Pen,
    pub(crate) clips: Rc<Vec<Rc<Region>>>,
    pub(crate) span: Span,
    /// Whether a path without length is a dot.
    pub(crate) dots: bool,
}

/// Why something could not be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refused {
    OutOfRange,
    TooMany,
    TooFine,
}

/// The strokes of a document, and how much more work may be done.
#[derive(Debug)]
pub(crate) struct Output {
    pub(crate) strokes: Vec<Stroke>,
    pub(crate) keys: Keys,
    pieces_left: u64,
    clip_work: u64,
    hatch_left: u64,
    pub(crate) clip_edges_left: u64,
    pub(crate) dashes_left: u64,
}

impl Default for Output {
    fn default() -> Self {
        Self {
            strokes: Vec::new(),
            keys: Keys::default(),
            pieces_left: limits::PIECES,
            clip_work: limits::CLIP_PAIRS,
            hatch_left: limits::HATCH_CROSSINGS,
            clip_edges_left: limits::CLIP_EDGES,
            dashes_left: limits::DASHES,
        }
    }
}

impl Output {
    /// Draws connected pieces (mm), clipped.
    pub(crate) fn run(&mut self, pieces: Vec<Segment>, closed: bool, ink: &Ink) -> Result<(), Refused> {
        if !pieces.iter().all(in_range) {
            return Err(Refused::OutOfRange);
        }
        self.pieces_left = self.pieces_left.saturating_sub(pieces.len() as u64);
        if self.pieces_left == 0 || self.clip_work == 0 {
            return Err(Refused::TooMany);
        }
        if ink.clips.is_empty() {
            self.stroke(&pieces, closed, ink);
            return Ok(());
        }
        let mut runs = vec![(pieces, closed)];
        for region in ink.clips.iter() {
            let clipped = runs
                .into_iter()
                .flat_map(|(run, closed)| clipped(&run, closed, region, ink.dots, &mut self.clip_work));
            runs = clipped.collect();
        }
        for (run, closed) in runs {
            self.pieces_left = self.pieces_left.saturating_sub(run.len() as u64);
            self.stroke(&run, closed, ink);
        }
        Ok(())
    }

    fn stroke(&mut self, pieces: &[Segment], closed: bool, ink: &Ink) {
        let Some(first) = pieces.first() else { return };
        let start = first.start();
        let moves = |piece: &&Segment| !matches!(piece, Segment::Line(line) if line.p0 == line.p1);
        let last = pieces.iter().rposition(|piece| moves(&piece));
        let Some(last) = last else {
            if ink.dots {
                self.strokes.push(Stroke::new(ink.key, start, ink.span));
            }
            return;
        };
        let drawn = pieces[..=last].iter().filter(moves);
        if pieces[..=last].iter().all(|piece| matches!(piece, Segment::Line(_))) {
            let mut points = vec![start];
            points.extend(drawn.map(Segment::end));
            if closed && let Some(end) = points.last_mut() {
                *end = start;
            }
            self.strokes.extend(Stroke::polyline(ink.key, points, ink.span));
            return;
        }
        let mut stroke = Stroke::new(ink.key, start, ink.span);
        let mut drawn = drawn.peekable();
        while let Some(piece) = drawn.next() {
            // Rounding must not leave a closed outline open.
            let end = if closed && drawn.peek().is_none() { start } else { piece.end() };
            match piece {
                Segment::Line(_) => stroke.line_to(end),
                Segment::Arc(arc) => stroke.arc_to(*arc, end),
                Segment::Cubic(cubic) => stroke.cubic_to(cubic.p1, cubic.p2, end),
            }
        }
        stroke.shrink_to_fit();
        self.strokes.push(stroke);
    }

    /// Hatches the inside of subpaths (mm).
    pub(crate) fn hatch(
        &mut self,
        subpaths: &[Subpath],
        rule: FillRule,
        hatch: Hatch,
        ink: &Ink,
    ) -> Result<(), Refused> {
        let mut outline: Vec<Segment> = Vec::new();
        for subpath in subpaths {
            outline.extend(&subpath.segments);
            let end = subpath.segments.last().map_or(subpath.start, Segment::end);
            if end != subpath.start {
                outline.push(Segment::Line(Line::new(end, subpath.start)));
            }
        }
        if !outline.iter().all(in_range) {
            return Err(Refused::OutOfRange);
        }
        let (sin, cos) = attributes::sin_cos(hatch.angle_rad.to_degrees());
        // All areas share the page's corner, so that lines of neighbours match.
        let grid =
            HatchGrid { anchor: Point::ZERO, direction: Vec2::new(cos, sin), spacing_mm: hatch.spacing_mm };
        let lines = grid.lines(&outline, rule, &mut self.hatch_left).ok_or(Refused::TooFine)?;
        for line in lines {
            let (from, to) =
                if line.row.rem_euclid(2) == 1 { (line.to, line.from) } else { (line.from, line.to) };
            self.run(vec![Segment::Line(Line::new(from, to))], false, ink)?;
        }
        Ok(())
    }
}

fn in_range(piece: &Segment) -> bool {
    let near = |p: Point| p.x.abs() <= limits::COORDINATE_MM && p.y.abs() <= limits::COORDINATE_MM;
    match piece {
        Segment::Line(line) => near(line.p0) && near(line.p1),
        Segment::Arc(arc) => {
            near(arc.center)
                && near(arc.a.to_point())
                && near(arc.b.to_point())
                && arc.start_rad.is_finite()
                && arc.sweep_rad.is_finite()
        }
        Segment::Cubic(cubic) => near(cubic.p0) && near(cubic.p1) && near(cubic.p2) && near(cubic.p3),
    }
}

/// The parts of connected pieces inside a region, each with whether it is closed.
fn clipped(
    run: &[Segment],
    closed: bool,
    region: &Region,
    dots: bool,
    work: &mut u64,
) -> Vec<(Vec<Segment>, bool)> {
    let Some(first) = run.first() else { return Vec::new() };
    let is_dot = run.iter().all(|piece| matches!(piece, Segment::Line(line) if line.p0 == line.p1));
    if is_dot {
        let stays = dots && region.has(first.start(), work);
        return if stays { vec![(run.to_vec(), closed)] } else { Vec::new() };
    }
    let mut runs: Vec<Vec<Segment>> = Vec::new();
    let (mut is_whole, mut goes_on, mut from_start) = (true, false, false);
    let moving = run.iter().filter(|piece| !matches!(piece, Segment::Line(line) if line.p0 == line.p1));
    for (index, piece) in moving.enumerate() {
        let parts = region.inside(piece, work);
        is_whole &= parts == [(0.0, 1.0)];
        let mut reaches_end = false;
        for &(from, to) in &parts {
            let part = if (from, to) == (0.0, 1.0) { *piece } else { piece.part(from, to) };
            from_start |= index == 0 && from == 0.0;
            match runs.last_mut() {
                Some(last) if goes_on && from == 0.0 => last.push(part),
                _ => runs.push(vec![part]),
            }
            goes_on = false;
            reaches_end = to == 1.0;
        }
        goes_on = reaches_end;
    }
    if is_whole {
        return vec![(run.to_vec(), closed)];
    }
    // A closed outline that is inside at its start goes on there.
    if closed && from_start && goes_on && runs.len() > 1 {
        let first = runs.remove(0);
        if let Some(last) = runs.last_mut() {
            last.extend(first);
        }
    }
    runs.into_iter().map(|run| (run, false)).collect()
}
