//! The exact path of the pen between rows, as a polyline by arc length.

use drawing::{Point, Vec2};

/// Chords between two rows.
const CHORDS: u32 = 4;

/// Shortest chord, as a share of the pen's movement for one tick: in slow motion rows share a chord.
const SHORTEST: f64 = 1.0 / 8.0;

/// Points that may be out of use before they are removed.
const STALE: usize = 256;

/// Weight of the distance along the curve from the row, against the distance from the curve.
const PULL: f64 = 0.1;

/// A vertex of the polyline, with the chord that starts there.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    point: Point,
    /// Arc length up to here, mm.
    s: f64,
    /// The vector to the next vertex, and 1 / its squared length.
    chord: Vec2,
    inverse: f64,
    length: f64,
}

/// The point of the curve that belongs to a candidate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Foot {
    /// Its arc length, mm.
    pub(super) s: f64,
    /// Its distance from the candidate, mm.
    pub(super) distance: f64,
    /// The chord it lies on, counted from the curve's start.
    pub(super) chord: usize,
}

/// A row on the curve.
#[derive(Clone, Copy, Debug)]
struct Knot {
    point: Point,
    /// Whether the path may turn here.
    corner: bool,
}

/// The path of one stroke, from pen down to pen up, known as far as rows have been added.
///
/// Between two rows it is a cubic Hermite curve through the exact pen positions, with the tangents
/// of a parabola through three rows (Catmull-Rom): collinear rows give a line. Where two
/// motions meet the path may turn, so tangents there use the rows of one side only.
#[derive(Clone, Debug, Default)]
pub(super) struct Curve {
    vertices: Vec<Vertex>,
    /// Number of vertices removed from the front.
    removed: usize,
    /// Arc length at the last point, which need not be a vertex.
    length: f64,
    last: Point,
    /// The last rows.
    knots: [Option<Knot>; 3],
}

impl Curve {
    /// Adds a row. `tick_mm` is the movement of the pen for one tick. Returns the arc length of the
    /// row before it once that is known: one row later.
    pub(super) fn add(&mut self, point: Point, corner: bool, tick_mm: f64) -> Option<f64> {
        let next = Knot { point, corner };
        let [before, from, to] = self.knots;
        self.knots = [from, to, Some(next)];
        match (from, to) {
            (Some(from), Some(to)) => self.span(before, from, to, Some(next), tick_mm),
            (None, Some(to)) => self.start(to.point),
            _ => return None,
        }
        Some(self.length)
    }

    /// Ends the curve at the last row added. Returns its arc length.
    pub(super) fn finish(&mut self, tick_mm: f64) -> f64 {
        let [before, from, to] = self.knots;
        match (from, to) {
            (Some(from), Some(to)) => self.span(before, from, to, None, tick_mm),
            (None, Some(to)) => self.start(to.point),
            _ => {}
        }
        if self.vertices.last().is_some_and(|vertex| vertex.s < self.length) {
            self.push(self.last);
        }
        self.length
    }

    fn start(&mut self, point: Point) {
        self.last = point;
        self.push(point);
    }

    /// Adds the curve from one row to the next.
    fn span(&mut self, before: Option<Knot>, from: Knot, to: Knot, next: Option<Knot>, tick_mm: f64) {
        let step = to.point - from.point;
        let before = before.filter(|_| !from.corner).map(|knot| from.point - knot.point);
        let next = next.filter(|_| !to.corner).map(|knot| knot.point - to.point);
        // Tangents times the period: the mean of the neighbouring steps, or at an end the slope
        // there of the parabola through the three nearest rows.
        let start = match (before, next) {
            (Some(before), _) => 0.5 * (before + step),
            (None, Some(next)) => 1.5 * step - 0.5 * next,
            (None, None) => step,
        };
        let end = match (next, before) {
            (Some(next), _) => 0.5 * (step + next),
            (None, Some(before)) => 1.5 * step - 0.5 * before,
            (None, None) => step,
        };
        let (linear, quadratic, cubic) = (start, 3.0 * step - 2.0 * start - end, start + end - 2.0 * step);
        for k in 1..=CHORDS {
            let t = f64::from(k) / f64::from(CHORDS);
            let point =
                if k == CHORDS { to.point } else { from.point + t * (linear + t * (quadratic + t * cubic)) };
            self.length += (point - self.last).hypot2().sqrt();
            self.last = point;
            let since = self.length - self.vertices.last().map_or(0.0, |vertex| vertex.s);
            if since >= SHORTEST * tick_mm || (k == CHORDS && to.corner && since > 0.0) {
                self.push(point);
            }
        }
    }

    fn push(&mut self, point: Point) {
        let s = self.length;
        if let Some(last) = self.vertices.last_mut() {
            last.chord = point - last.point;
            last.length = s - last.s;
            last.inverse = 1.0 / last.chord.hypot2().max(f64::MIN_POSITIVE);
        }
        self.vertices.push(Vertex { point, s, chord: Vec2::ZERO, inverse: 0.0, length: 0.0 });
    }

    /// Removes what lies before the arc length `s`.
    pub(super) fn forget(&mut self, s: f64) {
        if self.vertices.len() <= STALE || self.vertices[STALE].s > s {
            return;
        }
        let count = self.vertices.partition_point(|vertex| vertex.s <= s).saturating_sub(2);
        self.vertices.drain(..count);
        self.removed += count;
    }

    /// The chord at the arc length `s`, an index into `vertices`.
    fn chord_at(&self, s: f64, near: usize) -> usize {
        let last = self.vertices.len().saturating_sub(2);
        let mut index = near.saturating_sub(self.removed).min(last);
        while index < last && self.vertices[index + 1].s < s {
            index += 1;
        }
        while index > 0 && self.vertices[index].s > s {
            index -= 1;
        }
        index
    }

    /// The chords between two arc lengths: indices into `vertices`, for [`Self::foot`].
    pub(super) fn chords(&self, from: f64, to: f64) -> std::ops::Range<usize> {
        let first = self.vertices.partition_point(|vertex| vertex.s <= from).saturating_sub(1);
        let rest = &self.vertices[first..];
        let count = rest.iter().take_while(|vertex| vertex.s <= to).count();
        first..(first + count).min(self.vertices.len().saturating_sub(1))
    }

    /// The foot of `p` on one of the chords: where `d² + PULL (s - s_row)²` is least, `d` being the
    /// distance from `p`. The second term selects the branch where the path returns.
    pub(super) fn foot(&self, p: Point, row_s: f64, chords: std::ops::Range<usize>) -> Foot {
        let mut best = Foot { s: self.length, distance: 0.0, chord: self.removed + chords.start };
        let mut least = f64::INFINITY;
        let mut square = None;
        for (index, vertex) in self.vertices[chords.clone()].iter().enumerate() {
            let v = p - vertex.point;
            let share = (v.dot(vertex.chord) * vertex.inverse).clamp(0.0, 1.0);
            let across = (v - share * vertex.chord).hypot2();
            let s = vertex.s + share * vertex.length;
            let value = across + PULL * (s - row_s) * (s - row_s);
            if value < least {
                least = value;
                square = Some(across);
                best.s = s;
                best.chord = self.removed + chords.start + index;
            }
        }
        // A stroke without length: the pen rests.
        best.distance = square.unwrap_or_else(|| (p - self.last).hypot2()).sqrt();
        best
    }

    /// Squared distances of three points of a line, at a quarter, half and three quarters of it, from
    /// the points of the curve at the same shares of the way between two feet.
    pub(super) fn between(&self, line: [Point; 2], feet: [&Foot; 2]) -> [f64; 3] {
        let mut chord = feet[0].chord;
        [0.25, 0.5, 0.75].map(|share| {
            let s = feet[0].s + share * (feet[1].s - feet[0].s);
            let index = self.chord_at(s, chord);
            chord = index + self.removed;
            let vertex = &self.vertices[index];
            let along =
                if vertex.length > 0.0 { ((s - vertex.s) / vertex.length).clamp(0.0, 1.0) } else { 0.0 };
            let on_line = line[0] + share * (line[1] - line[0]);
            (on_line - (vertex.point + along * vertex.chord)).hypot2()
        })
    }
}
