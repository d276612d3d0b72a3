//! The drawing as the verifier uses it: straight pieces by pen, divided into cells, in a bounding
//! box tree.

use drawing::{Drawing, Point, Rect, Segment, Span, Vec2};

use crate::run::Run;

/// Chord error of flattened curves, as a share of the tolerance. It is added to what is measured.
const FLATNESS: f64 = 1.0 / 500.0;

/// Length of a cell, as a share of the tolerance.
const CELL: f64 = 1.0 / 4.0;

/// Largest number of cells, plus one a piece. Above it, cells are longer and only their middles are
/// sampled.
const MAX_CELLS: f64 = (1_u32 << 24) as f64;

/// Longer lines are cut into pieces of about this length, mm, so that the bounding boxes of slanted
/// lines stay small.
const LONGEST_PIECE: f64 = 8.0;

/// Largest number of pieces made by that.
const MAX_CUTS: f64 = 500_000.0;

/// Number of cells of a piece that are examined together.
pub(crate) const BLOCK: usize = 16;

/// Strokes between two reports of progress.
const PROGRESS_STROKES: usize = 4096;

/// Number of children of a box of the tree.
const FAN: usize = 8;

/// A straight piece of a stroke with its own frame: coordinates (along, across) from `start`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    start: Point,
    /// Unit vector; arbitrary for a dot.
    along: Vec2,
    /// 0 for a dot.
    pub(crate) length: f64,
    /// Chord error of this piece, mm; 0 for lines.
    pub(crate) error: f64,
    /// Index of its first cell.
    pub(crate) first_cell: u32,
    /// Number of equal cells; at least 1.
    pub(crate) cells: u32,
    /// Index of its first block of [`BLOCK`] cells.
    pub(crate) first_block: u32,
    /// Index of its stroke in the drawing.
    pub(crate) stroke: u32,
}

impl Piece {
    fn new(start: Point, end: Point, error: f64, stroke: usize) -> Self {
        let vector = end - start;
        let length = libm::hypot(vector.x, vector.y);
        let along = if length > 0.0 { vector / length } else { Vec2::new(1.0, 0.0) };
        Self { start, along, length, error, first_cell: 0, cells: 1, first_block: 0, stroke: stroke as u32 }
    }

    /// `p` in the frame of the piece: along it, and to its left.
    pub(crate) fn local(&self, p: Point) -> (f64, f64) {
        let v = p - self.start;
        (v.dot(self.along), self.along.cross(v))
    }

    /// The point at the coordinate `along`.
    pub(crate) fn at(&self, along: f64) -> Point {
        self.start + along * self.along
    }

    /// Upper bound of the distance from a point in the piece's frame to the stroke; overstated by
    /// at most `2 error`.
    pub(crate) fn distance(&self, (along, across): (f64, f64)) -> f64 {
        let beyond = along - along.clamp(0.0, self.length);
        (beyond * beyond + across * across).sqrt() + self.error
    }

    /// The distances of two points from the stroke.
    #[inline]
    pub(crate) fn distances(&self, points: [Point; 2]) -> [f64; 2] {
        [self.distance(self.local(points[0])), self.distance(self.local(points[1]))]
    }

    /// Whether a line may come within `radius` of the stroke. It does not if both its ends are
    /// beyond the radius on the same side of the piece, before its start or after its end.
    #[inline]
    pub(crate) fn may_be_near(&self, from: Point, to: Point, radius: f64) -> bool {
        let ((x0, y0), (x1, y1)) = (self.local(from), self.local(to));
        let radius = radius + self.error;
        y0.min(y1) <= radius
            && y0.max(y1) >= -radius
            && x0.min(x1) <= self.length + radius
            && x0.max(x1) >= -radius
    }

    fn ends(&self) -> [Point; 2] {
        [self.start, self.at(self.length)]
    }

    pub(crate) fn bounds(&self) -> Rect {
        let [start, end] = self.ends();
        Rect::from_points(start, end)
    }
}

/// A straight line by its ends, to the precision of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line([f32; 4]);

impl Line {
    fn new([from, to]: [Point; 2]) -> Self {
        Self([from.x, from.y, to.x, to.y].map(|c| c as f32))
    }

    fn ends(&self) -> [Point; 2] {
        let [x0, y0, x1, y1] = self.0.map(f64::from);
        [Point::new(x0, y0), Point::new(x1, y1)]
    }

    /// Whether line and box have a point in common: they have none if they are apart along an axis of the
    /// box or across the line (separating axes of convex sets).
    pub(crate) fn meets(&self, bounds: Rect) -> bool {
        let [x0, y0, x1, y1] = self.0.map(f64::from);
        let apart = x0.min(x1) > bounds.x1
            || x0.max(x1) < bounds.x0
            || y0.min(y1) > bounds.y1
            || y0.max(y1) < bounds.y0;
        let (x, y) = (x1 - x0, y1 - y0);
        let middle = bounds.center();
        let across = (x * (middle.y - y0) - y * (middle.x - x0)).abs();
        let half = 0.5 * (y.abs() * bounds.width() + x.abs() * bounds.height());
        !(apart || across > half)
    }

    /// Whether the run may draw this line: no end of either that is beside the other is farther than
    /// `radius` from it. A stroke that the run only crosses leaves the radius.
    pub(crate) fn is_alongside(&self, run: &Run, radius: f64) -> bool {
        let (line, run) = (self.ends(), [run.from, run.to]);
        let is_far = |[from, to]: [Point; 2], end: Point| {
            let (vector, v) = (to - from, end - from);
            let (square, along, across) = (vector.hypot2(), v.dot(vector), vector.cross(v));
            (0.0..=square).contains(&along) && across * across > radius * radius * square
        };
        !(run.iter().any(|end| is_far(line, *end)) || line.iter().any(|end| is_far(run, *end)))
    }
}

/// Whether two boxes have a point in common.
pub(crate) fn meet(a: Rect, b: Rect) -> bool {
    a.x0 <= b.x1 && b.x0 <= a.x1 && a.y0 <= b.y1 && b.y0 <= a.y1
}

fn distance_to_box(p: Point, bounds: Rect) -> f64 {
    let x = p.x - p.x.clamp(bounds.x0, bounds.x1);
    let y = p.y - p.y.clamp(bounds.y0, bounds.y1);
    (x * x + y * y).sqrt()
}

/// All ink of one pen.
#[derive(Clone, Debug)]
pub(crate) struct PenTarget {
    pub(crate) pen: u16,
    /// In the order of the strokes, and within a stroke along it.
    pub(crate) pieces: Vec<Piece>,
    all: BoxTree,
    /// Where strokes begin and end, with their first or last piece.
    ends: Vec<(Point, u32)>,
    ends_tree: BoxTree,
}

/// A bounding box tree of lines that are numbered from 0.
#[derive(Clone, Debug)]
struct BoxTree {
    /// The lines by location, see [`by_position`].
    order: Vec<u32>,
    /// The lines in that order: a search reads them in sequence, not from all over the memory.
    lines: Vec<Line>,
    /// Largest difference of a coordinate from its `f32`, mm.
    rounding: f64,
    /// `levels[0][i]` bounds the items `order[FAN * i..FAN * (i + 1)]`, `levels[k + 1][i]` the
    /// boxes of `levels[k]` likewise; the last level is one box.
    levels: Vec<Vec<Rect>>,
}

impl BoxTree {
    /// Of `count` lines, at least one; `line` returns the ends of each. It is asked for them several times
    /// instead of keeping them: copies would take more memory than the tree.
    fn new(count: usize, line: impl Fn(u32) -> [Point; 2]) -> Self {
        let bounds = |index: u32| {
            let [from, to] = line(index);
            Rect::from_points(from, to)
        };
        let order = by_position(count, bounds);
        let union = |boxes: &[Rect]| boxes[1..].iter().fold(boxes[0], |sum, next| sum.union(*next));
        let of_lines =
            |chunk: &[u32]| chunk[1..].iter().fold(bounds(chunk[0]), |sum, next| sum.union(bounds(*next)));
        let mut levels: Vec<Vec<Rect>> = Vec::new();
        let mut level: Vec<Rect> = order.chunks(FAN).map(of_lines).collect();
        while level.len() > 1 {
            let next = level.chunks(FAN).map(union).collect();
            levels.push(std::mem::replace(&mut level, next));
        }
        let all = level[0];
        levels.push(level);
        let largest = [all.x0, all.y0, all.x1, all.y1].into_iter().fold(0.0_f64, |sum, c| sum.max(c.abs()));
        Self {
            lines: order.iter().map(|index| Line::new(line(*index))).collect(),
            rounding: largest * f64::from(f32::EPSILON),
            order,
            levels,
        }
    }

    /// Calls `to` with every line that meets `bounds`, and perhaps with others that nearly do, and its
    /// number.
    fn visit(&self, bounds: Rect, mut to: impl FnMut(Line, u32)) {
        let wider = bounds.inflate(self.rounding, self.rounding);
        self.visit_box(self.levels.len() - 1, 0, [bounds, wider], &mut to);
    }

    /// The lines in a box of a level. There are at most 11 levels.
    fn visit_box(&self, level: usize, index: usize, bounds: [Rect; 2], to: &mut impl FnMut(Line, u32)) {
        if !meet(self.levels[level][index], bounds[0]) {
            return;
        }
        let (first, end) = (FAN * index, FAN * (index + 1));
        if level > 0 {
            for child in (first..end.min(self.levels[level - 1].len())).rev() {
                self.visit_box(level - 1, child, bounds, to);
            }
            return;
        }
        let items = first..end.min(self.order.len());
        for (line, index) in self.lines[items.clone()].iter().zip(&self.order[items]) {
            if line.meets(bounds[1]) {
                to(*line, *index);
            }
        }
    }
}

impl PenTarget {
    fn new(pen: u16, pieces: Vec<Piece>) -> Self {
        let all = BoxTree::new(pieces.len(), |index| pieces[index as usize].ends());
        let stroke = |index: usize| pieces.get(index).map(|piece| piece.stroke);
        let mut ends = Vec::new();
        for (index, piece) in pieces.iter().enumerate() {
            if index == 0 || stroke(index - 1) != stroke(index) {
                ends.push((piece.start, index as u32));
            }
            if stroke(index) != stroke(index + 1) {
                ends.push((piece.at(piece.length), index as u32));
            }
        }
        let ends_tree = BoxTree::new(ends.len(), |index| [ends[index as usize].0; 2]);
        Self { pen, pieces, all, ends, ends_tree }
    }

    /// Calls `to` with every piece that meets `bounds`, and perhaps with others that nearly do: its line
    /// and its index.
    pub(crate) fn visit(&self, bounds: Rect, to: impl FnMut(Line, u32)) {
        self.all.visit(bounds, to);
    }

    /// Largest difference of a coordinate of a [`Line`] from that of its piece, mm.
    pub(crate) fn line_error(&self) -> f64 {
        self.all.rounding
    }

    /// Calls `to` with the first or last piece of every stroke that begins or ends in `bounds`.
    pub(crate) fn visit_ends(&self, bounds: Rect, mut to: impl FnMut(u32)) {
        self.ends_tree.visit(bounds, |_, end| {
            let (point, piece) = self.ends[end as usize];
            if bounds.contains(point) {
                to(piece);
            }
        });
    }

    /// Where the stroke of this piece begins, if this is its first piece, and ends, if it is the last.
    pub(crate) fn ends_of(&self, index: u32) -> [Option<Point>; 2] {
        let index = index as usize;
        let piece = &self.pieces[index];
        let other = |index: usize| self.pieces.get(index).is_none_or(|other| other.stroke != piece.stroke);
        let first = index == 0 || other(index - 1);
        [first.then_some(piece.start), other(index + 1).then(|| piece.at(piece.length))]
    }

    /// The nearest piece to `p` and its distance, by branch and bound.
    pub(crate) fn nearest(&self, p: Point) -> (f64, u32) {
        let BoxTree { order, levels, .. } = &self.all;
        let mut best = (f64::INFINITY, 0);
        let mut open = vec![(0.0, levels.len() - 1, 0)];
        while let Some((at_least, level, index)) = open.pop() {
            if at_least > best.0 {
                continue;
            }
            let children = FAN * index..FAN * (index + 1);
            if level > 0 {
                let first = open.len();
                for i in children.take_while(|i| *i < levels[level - 1].len()) {
                    open.push((distance_to_box(p, levels[level - 1][i]), level - 1, i));
                }
                // The nearest box is visited first.
                open[first..].sort_by(|a, b| b.0.total_cmp(&a.0));
            } else {
                for &i in &order[children.start..children.end.min(order.len())] {
                    let piece = &self.pieces[i as usize];
                    let distance = piece.distance(piece.local(p));
                    if distance < best.0 {
                        best = (distance, i);
                    }
                }
            }
        }
        best
    }
}

/// The numbers below `count` along a Morton (Z-order) curve through the middles of their boxes, so that
/// neighbours share boxes.
fn by_position(count: usize, bounds: impl Fn(u32) -> Rect) -> Vec<u32> {
    let Some(all) = (0..count as u32).map(&bounds).reduce(|a, b| a.union(b)) else { return Vec::new() };
    let scale = 65535.0 / all.width().max(all.height()).max(f64::MIN_POSITIVE);
    let spread = |value: f64| {
        let mut bits = u64::from(value as u16);
        bits = (bits | bits << 8) & 0x00ff_00ff;
        bits = (bits | bits << 4) & 0x0f0f_0f0f;
        bits = (bits | bits << 2) & 0x3333_3333;
        (bits | bits << 1) & 0x5555_5555
    };
    // The place on the curve above the number, so that equal places stay in the order of their numbers.
    let mut order: Vec<u64> = (0..count as u32)
        .map(|index| {
            let middle = bounds(index).center();
            let place = spread((middle.x - all.x0) * scale) | spread((middle.y - all.y0) * scale) << 1;
            place << 32 | u64::from(index)
        })
        .collect();
    order.sort_unstable();
    order.into_iter().map(|item| item as u32).collect()
}

/// The whole drawing.
#[derive(Clone, Debug)]
pub(crate) struct Target {
    /// Sorted by pen; none is empty.
    pub(crate) pens: Vec<PenTarget>,
    /// Byte range of each stroke in the source.
    pub(crate) sources: Vec<Span>,
    /// Number of cells.
    pub(crate) cells: usize,
    /// Number of blocks of cells.
    pub(crate) blocks: usize,
    /// Length of the longest cell if only their middles are sampled, otherwise 0.
    pub(crate) sparse_mm: f64,
    /// Strokes with coordinates that are not finite.
    pub(crate) broken: Vec<usize>,
}

impl Target {
    /// `indexed` is called now and then with the number of strokes read.
    pub(crate) fn new(drawing: &Drawing, tolerance_mm: f64, indexed: &dyn Fn(usize)) -> Self {
        let flatness = tolerance_mm * FLATNESS;
        let mut by_pen: Vec<(u16, Vec<Piece>)> =
            drawing.pens().into_iter().filter(|pen| pen.0 != 0).map(|pen| (pen.0, Vec::new())).collect();
        let longest = LONGEST_PIECE.max(drawing.length() / MAX_CUTS);
        let mut broken = Vec::new();
        for (index, stroke) in drawing.strokes.iter().enumerate() {
            if index.is_multiple_of(PROGRESS_STROKES) {
                indexed(index);
            }
            let Ok(slot) = by_pen.binary_search_by_key(&stroke.pen.0, |(pen, _)| *pen) else { continue };
            let pieces = &mut by_pen[slot].1;
            let first = pieces.len();
            for segment in stroke.segments() {
                let error = if matches!(segment, Segment::Line(_)) { 0.0 } else { flatness };
                let mut from = segment.start();
                segment.flatten(flatness, |to| {
                    if to != from {
                        let cuts = (libm::hypot(to.x - from.x, to.y - from.y) / longest).ceil().max(1.0);
                        let at = |k: f64| if k < cuts { from.lerp(to, k / cuts) } else { to };
                        for k in 0..cuts as usize {
                            pieces.push(Piece::new(at(k as f64), at(k as f64 + 1.0), error, index));
                        }
                    }
                    from = to;
                });
            }
            if pieces.len() == first {
                pieces.push(Piece::new(stroke.start(), stroke.start(), 0.0, index));
            }
            if pieces[first..].iter().any(|piece| !piece.length.is_finite() || !piece.start.is_finite()) {
                pieces.truncate(first);
                broken.push(index);
            }
        }
        let length: f64 = by_pen.iter().flat_map(|(_, pieces)| pieces).map(|piece| piece.length).sum();
        let fine = tolerance_mm * CELL;
        let (cell, sparse) =
            if length / fine > MAX_CELLS { (length / MAX_CELLS, true) } else { (fine, false) };
        let mut pens: Vec<PenTarget> = by_pen
            .into_iter()
            .filter(|(_, pieces)| !pieces.is_empty())
            .map(|(pen, pieces)| PenTarget::new(pen, pieces))
            .collect();
        let (mut cells, mut blocks) = (0, 0);
        for pen in &mut pens {
            // In the order of the tree: a run reads and writes the cells of pieces that lie close to each other,
            // which then do so in memory too. The cells of a piece stay together.
            for index in &pen.all.order {
                let piece = &mut pen.pieces[*index as usize];
                piece.first_cell = cells;
                piece.cells = (piece.length / cell).ceil().max(1.0) as u32;
                cells += piece.cells;
                piece.first_block = blocks;
                blocks += piece.cells.div_ceil(BLOCK as u32);
            }
        }
        Self {
            pens,
            sources: drawing.strokes.iter().map(|stroke| stroke.source()).collect(),
            cells: cells as usize,
            blocks: blocks as usize,
            sparse_mm: if sparse { cell } else { 0.0 },
            broken,
        }
    }

    pub(crate) fn pen(&self, pen: u16) -> Option<usize> {
        self.pens.binary_search_by_key(&pen, |target| target.pen).ok()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::run::At;

    /// Whether the part of the line within each pair of parallel edges leaves something (Liang and Barsky
    /// 1984).
    fn clips(from: Point, to: Point, bounds: Rect) -> bool {
        let (mut first, mut last) = (0.0_f64, 1.0_f64);
        for (start, end, low, high) in
            [(from.x, to.x, bounds.x0, bounds.x1), (from.y, to.y, bounds.y0, bounds.y1)]
        {
            let step = end - start;
            if step == 0.0 {
                if start < low || start > high {
                    return false;
                }
                continue;
            }
            let (a, b) = ((low - start) / step, (high - start) / step);
            first = first.max(a.min(b));
            last = last.min(a.max(b));
        }
        first <= last
    }

    proptest! {
        #[test]
        fn tree_visits_every_line_that_meets_a_box(
            ends in prop::collection::vec((-9.0..9.0, -9.0..9.0, -3.0..3.0, -3.0..3.0), 1..120),
            (x, y, width, height) in (-9.0..9.0, -9.0..9.0, 0.0..2.0, 0.0..2.0),
            offset in prop::sample::select(vec![0.0, 1e3, 1e6]),
        ) {
            let lines: Vec<[Point; 2]> = ends
                .iter()
                .map(|(x, y, dx, dy)| [Point::new(x + offset, *y), Point::new(x + dx + offset, y + dy)])
                .collect();
            let bounds = Rect::new(x + offset, y, x + width + offset, y + height);
            let mut found = Vec::new();
            BoxTree::new(lines.len(), |index| lines[index as usize]).visit(bounds, |_, index| found.push(index as usize));
            found.sort_unstable();
            let slack = 4.0 * (offset + 12.0) * f64::from(f32::EPSILON);
            for (index, [from, to]) in lines.iter().enumerate() {
                if clips(*from, *to, bounds) {
                    prop_assert!(found.contains(&index), "line {index} is lost");
                }
                if found.contains(&index) {
                    prop_assert!(clips(*from, *to, bounds.inflate(slack, slack)), "line {index} is not near");
                }
            }
        }
    }

    #[test]
    fn crossing_piece_is_not_alongside_and_drawn_one_is() {
        let at = At { row: 0, t_us: 0 };
        let run = Run { from: Point::ZERO, to: Point::new(4.0, 0.1), error: 0.0, at };
        let piece = |from, to| Line::new([Point::from(from), Point::from(to)]);
        for drawn in
            [piece((-1.0, 0.2), (9.0, 0.0)), piece((1.0, -0.2), (1.5, 0.3)), piece((3.9, 0.3), (3.9, 9.0))]
        {
            assert!(drawn.is_alongside(&run, 0.5), "{drawn:?}");
        }
        for crossing in [piece((1.0, -2.0), (1.0, 2.0)), piece((-5.0, -3.0), (9.0, 4.0))] {
            assert!(!crossing.is_alongside(&run, 0.5), "{crossing:?}");
        }
        // By the ends of the piece, in mm whatever the length of the run.
        assert!(piece((0.1, 0.4), (3.0, 0.4)).is_alongside(&run, 0.5));
        assert!(!piece((1.0, 0.8), (1.5, 0.8)).is_alongside(&run, 0.5));
    }
}
