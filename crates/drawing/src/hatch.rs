//! Hatching: the parts of parallel lines that lie inside a closed outline.

use kurbo::{Point, Vec2};

use crate::Segment;

/// How far chords may leave curved edges where hatch lines are cut at them, mm.
const FLATTENING_MM: f64 = 0.005;

/// Which points lie inside an outline that crosses itself or has holes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FillRule {
    /// Inside where the winding number is not 0.
    #[default]
    NonZero,
    /// Inside where a ray crosses the outline an odd number of times.
    EvenOdd,
}

impl FillRule {
    /// Whether a point of that winding number (or number of crossings, for [`Self::EvenOdd`]) is
    /// inside.
    pub fn is_inside(self, winding: i32) -> bool {
        match self {
            Self::NonZero => winding != 0,
            Self::EvenOdd => winding % 2 != 0,
        }
    }
}

/// A part of a hatch line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HatchLine {
    /// Number of its line in the grid; the line through the anchor is 0.
    pub row: i64,
    /// Its end against the grid's direction, mm.
    pub from: Point,
    /// Its end along the grid's direction, mm.
    pub to: Point,
}

/// Parallel lines at equal distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HatchGrid {
    /// A point on line 0, mm. Areas that share it have matching lines.
    pub anchor: Point,
    /// A unit vector along the lines.
    pub direction: Vec2,
    /// Distance of neighbouring lines, mm; positive.
    pub spacing_mm: f64,
}

impl HatchGrid {
    /// The parts of the lines inside closed outlines, line by line, the parts of every odd line in
    /// reverse order, so that a pen goes back and forth (it still has to draw odd lines from `to`
    /// to `from`).
    ///
    /// `outlines` are the pieces of all outlines; the pieces of each must form a closed path.
    /// Curves are flattened to 0.005 mm. Every crossing of a line takes one from `pieces_left`;
    /// `None` if there are more crossings than that.
    ///
    /// In coordinates along and across the lines, with the spacing as unit across, line `k` is
    /// crossed by an edge where one end lies below `k` and the other does not (so that corners
    /// count once). Sorted along the line, the crossings separate inside from outside by their
    /// parity or by the sum of their directions.
    pub fn lines<'a>(
        self,
        outlines: impl IntoIterator<Item = &'a Segment>,
        rule: FillRule,
        pieces_left: &mut u64,
    ) -> Option<Vec<HatchLine>> {
        let across = Vec2::new(-self.direction.y, self.direction.x);
        let mut crossings: Vec<(i64, f64, i32)> = Vec::new();
        for segment in outlines {
            let mut from = self.coordinates(across, segment.start());
            let mut enough = true;
            segment.flatten(FLATTENING_MM, |to| {
                let to = self.coordinates(across, to);
                let (low, high, sense) = if from.y < to.y { (from, to, 1) } else { (to, from, -1) };
                let (first, last) = (low.y.ceil(), high.y.ceil());
                let count = last - first;
                if enough && count > 0.0 {
                    enough = count <= *pieces_left as f64;
                    if enough {
                        *pieces_left -= count as u64;
                        for step in 0..count as i64 {
                            let k = first + step as f64;
                            let x = low.x + (high.x - low.x) * (k - low.y) / (high.y - low.y);
                            crossings.push((k as i64, x, sense));
                        }
                    }
                }
                from = to;
            });
            if !enough {
                return None;
            }
        }
        crossings.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut lines = Vec::new();
        for row in crossings.chunk_by(|a, b| a.0 == b.0) {
            self.inside(across, row, rule, &mut lines);
        }
        Some(lines)
    }

    /// Adds the parts of one line between its sorted crossings.
    fn inside(self, across: Vec2, row: &[(i64, f64, i32)], rule: FillRule, lines: &mut Vec<HatchLine>) {
        let begun = lines.len();
        let (mut winding, mut from) = (0, 0.0);
        for &(k, x, sense) in row {
            let was = rule.is_inside(winding);
            winding += if rule == FillRule::NonZero { sense } else { 1 };
            match (was, rule.is_inside(winding)) {
                (false, true) => from = x,
                (true, false) if x > from => lines.push(HatchLine {
                    row: k,
                    from: self.point(across, from, k),
                    to: self.point(across, x, k),
                }),
                _ => {}
            }
        }
        if row[0].0.rem_euclid(2) == 1 {
            lines[begun..].reverse();
        }
    }

    fn coordinates(self, across: Vec2, p: Point) -> Point {
        let v = p - self.anchor;
        Point::new(v.dot(self.direction), v.dot(across) / self.spacing_mm)
    }

    fn point(self, across: Vec2, x: f64, k: i64) -> Point {
        self.anchor + x * self.direction + k as f64 * self.spacing_mm * across
    }
}

#[cfg(test)]
mod tests {
    use kurbo::Line;

    use super::*;

    fn square(x0: f64, x1: f64, clockwise: bool) -> Vec<Segment> {
        let mut corners = [(x0, x0), (x1, x0), (x1, x1), (x0, x1)].map(Point::from);
        if clockwise {
            corners.reverse();
        }
        (0..4).map(|k| Segment::Line(Line::new(corners[k], corners[(k + 1) % 4]))).collect()
    }

    fn length(outlines: &[Segment], rule: FillRule) -> f64 {
        let grid =
            HatchGrid { anchor: Point::new(0.0, 0.5), direction: Vec2::new(1.0, 0.0), spacing_mm: 1.0 };
        let lines = grid.lines(outlines, rule, &mut 1000).unwrap();
        lines.iter().map(|line| (line.to - line.from).hypot2().sqrt()).sum()
    }

    #[test]
    fn holes_follow_the_fill_rule() {
        let mut same = square(0.0, 10.0, false);
        same.extend(square(3.0, 7.0, false));
        assert_eq!(length(&same, FillRule::NonZero), 100.0);
        assert_eq!(length(&same, FillRule::EvenOdd), 84.0);
        let mut opposite = square(0.0, 10.0, false);
        opposite.extend(square(3.0, 7.0, true));
        assert_eq!(length(&opposite, FillRule::NonZero), 84.0);
    }

    #[test]
    fn crossings_beyond_the_budget_are_refused() {
        let grid = HatchGrid { anchor: Point::ZERO, direction: Vec2::new(1.0, 0.0), spacing_mm: 1e-9 };
        assert!(grid.lines(&square(0.0, 10.0, false), FillRule::NonZero, &mut 1000).is_none());
    }
}
