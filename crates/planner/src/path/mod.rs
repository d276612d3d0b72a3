//! From a stroke to smooth sections, which the pen can follow without stopping. Units are machine
//! mm.
//!
//! ```text
//! Stroke --clean--> pieces --simplify--> fewer lines --blend--> sections with a continuous tangent
//! ```
//! Zero-length pieces are removed, collinear lines are merged, vertices that are redundant within
//! the tolerance are removed, and corners are blended within the tolerance. The pen stops at
//! reversals.

mod blend;
mod fit;
mod piece;
mod simplify;
mod slow_zones;
mod tangent;

use drawing::{Line, Segment, Stroke};

pub use blend::CornerBlend;
pub use fit::{Aim, Limits, fitted};
pub use piece::{Piece, Section};
pub(crate) use slow_zones::bound_speed;
use tangent::{direction_at, velocity};

/// Distance below which a vertex counts as collinear with its neighbors, mm.
const COLLINEAR: f64 = 1e-9;

/// A curve whose speed |p'(t)| falls below this share of its maximum is replaced by chords: at a
/// cusp the direction is not differentiable with respect to arc length.
const REGULAR: f64 = 1e-3;

/// How far the planned path may deviate from the drawing, by cause.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathBudget {
    /// Chords that replace curves with a cusp.
    pub chord_mm: f64,
    /// Lines that replace several lines.
    pub simplify_mm: f64,
    /// Blends that replace corners.
    pub blend_mm: f64,
    /// The shape of blends.
    pub corner: CornerBlend,
    /// Linear motion between rows, if the motors are strong enough to exceed it: pieces near
    /// corners are then marked. Otherwise infinite.
    pub row_mm: f64,
}

/// The smooth sections of a stroke, in order; empty for a dot or a stroke of length 0.
pub fn sections(stroke: &Stroke, budget: &PathBudget) -> Vec<Section> {
    let pieces = clean(stroke, budget.chord_mm);
    let pieces =
        if budget.simplify_mm > 0.0 { simplify::simplify(&pieces, budget.simplify_mm) } else { pieces };
    let sections = blend::sections(&pieces, budget.blend_mm, budget.corner).into_iter().map(parametrise);
    sections
        .map(
            |section| {
                if budget.row_mm.is_finite() { slow_zones::mark(section, budget.row_mm) } else { section }
            },
        )
        .collect()
}

/// About the length of the shortest path within `tolerance` mm of a stroke, mm.
pub(crate) fn shortest_length(stroke: &Stroke, tolerance: f64) -> f64 {
    simplify::simplify(&clean(stroke, tolerance), tolerance).iter().map(Segment::length).sum()
}

/// Every piece of a stroke as a section of its own: the pen stops at every vertex, except between
/// collinear lines.
pub(crate) fn vertex_to_vertex(stroke: &Stroke, budget: &PathBudget) -> Vec<Section> {
    clean(stroke, budget.chord_mm).into_iter().map(|curve| parametrise(vec![curve])).collect()
}

/// The stroke's pieces without those of length 0; collinear lines are merged and curves with a cusp
/// are replaced by chords.
fn clean(stroke: &Stroke, chord_tolerance: f64) -> Vec<Segment> {
    let mut pieces: Vec<Segment> = Vec::with_capacity(stroke.segment_count());
    let mut add = |piece: Segment| {
        if direction_at(&piece, 0.0).is_none() {
            return;
        }
        if let (Some(Segment::Line(before)), Segment::Line(next)) = (pieces.last_mut(), &piece)
            && in_line(before, next)
        {
            before.p1 = next.p1;
            return;
        }
        pieces.push(piece);
    };
    for segment in stroke.segments() {
        if is_regular(&segment) {
            add(segment);
        } else {
            let mut from = segment.start();
            segment.flatten(chord_tolerance, |to| {
                add(Segment::Line(Line::new(from, to)));
                from = to;
            });
        }
    }
    pieces
}

/// Sets the rate of every piece.
fn parametrise(curves: Vec<Segment>) -> Section {
    let mut speed = 1.0;
    let piece = |curve: Segment| {
        let (start, end) = (velocity(&curve, 0.0), velocity(&curve, 1.0));
        let rate = speed / start;
        speed = rate * end;
        Piece { curve, rate, near_corner: false, row_bound: None }
    };
    curves.into_iter().map(piece).collect()
}

/// Whether `next` continues `before`: the vertex between them lies on their chord, and neither line
/// reverses.
fn in_line(before: &Line, next: &Line) -> bool {
    let (chord, first) = (next.p1 - before.p0, before.p1 - before.p0);
    let second = next.p1 - next.p0;
    first.dot(chord) > 0.0
        && second.dot(chord) > 0.0
        && first.cross(chord).abs() <= COLLINEAR * chord.hypot2().sqrt()
}

/// Whether the speed along the curve stays well above zero, sampled finely enough for arcs and
/// cubics.
fn is_regular(segment: &Segment) -> bool {
    let samples = match segment {
        Segment::Line(_) => return true,
        Segment::Arc(_) => 64,
        Segment::Cubic(_) => 32,
    };
    let speeds = (0..=samples).map(|k| velocity(segment, f64::from(k) / f64::from(samples)));
    let (least, most) = speeds.fold((f64::INFINITY, 0.0_f64), |(l, m), v| (l.min(v), m.max(v)));
    least > REGULAR * most || most == 0.0
}

#[cfg(test)]
mod tests {
    use drawing::{EllipticArc, Pen, Point, Span, Vec2};

    use super::*;

    const EXACT: PathBudget = PathBudget {
        chord_mm: 0.01,
        simplify_mm: 0.0,
        blend_mm: 0.0,
        corner: CornerBlend::Parabola,
        row_mm: f64::INFINITY,
    };

    fn polyline(points: &[(f64, f64)]) -> Stroke {
        let points = points.iter().map(|&(x, y)| Point::new(x, y)).collect();
        Stroke::polyline(Pen(1), points, Span::default()).unwrap()
    }

    #[test]
    fn collinear_and_repeated_vertices_are_merged() {
        let stroke = polyline(&[(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (5.0, 0.0), (5.0, 3.0)]);
        let sections = sections(&stroke, &EXACT);
        assert_eq!(sections.len(), 2);
        let line = Segment::Line(Line::new(Point::new(0.0, 0.0), Point::new(5.0, 0.0)));
        assert_eq!(sections[0], vec![Piece { curve: line, rate: 0.2, near_corner: false, row_bound: None }]);
    }

    #[test]
    fn reversal_is_stop_with_blends() {
        let budget = PathBudget { blend_mm: 0.1, ..EXACT };
        assert_eq!(sections(&polyline(&[(0.0, 0.0), (5.0, 0.0), (2.0, 0.0)]), &budget).len(), 2);
    }

    #[test]
    fn tangent_arc_continues_section() {
        let mut stroke = polyline(&[(0.0, 0.0), (5.0, 0.0)]);
        let down = -std::f64::consts::FRAC_PI_2;
        stroke.arc(EllipticArc::circular(Point::new(5.0, 2.0), 2.0, down, 1.0));
        assert_eq!(sections(&stroke, &EXACT).len(), 1);
    }

    #[test]
    fn flat_ellipse_reverses_at_ends() {
        let mut stroke = Stroke::new(Pen(1), Point::new(4.0, 0.0), Span::default());
        stroke.arc(EllipticArc {
            center: Point::ZERO,
            a: Vec2::new(4.0, 0.0),
            b: Vec2::ZERO,
            start_rad: 0.0,
            sweep_rad: std::f64::consts::TAU,
        });
        let sections = sections(&stroke, &EXACT);
        assert_eq!(sections.len(), 2);
        assert!((sections[0][0].curve.end().x + 4.0).abs() < 0.02);
    }

    #[test]
    fn dot_has_no_sections() {
        assert!(sections(&polyline(&[(1.0, 1.0)]), &EXACT).is_empty());
        assert!(sections(&polyline(&[(1.0, 1.0), (1.0, 1.0)]), &EXACT).is_empty());
    }

    #[test]
    fn chords_of_circle_form_one_section() {
        let points: Vec<(f64, f64)> =
            (0..=60).map(|k| libm::sincos(f64::from(k) * 0.05)).map(|(s, c)| (20.0 * c, 20.0 * s)).collect();
        let sections = sections(&polyline(&points), &PathBudget { blend_mm: 0.05, ..EXACT });
        assert_eq!(sections.len(), 1);
        // Neighboring blends divide their segments completely: only the two ends remain straight.
        let straight: f64 = sections[0]
            .iter()
            .filter(|piece| matches!(piece.curve, Segment::Line(_)))
            .map(Piece::length)
            .sum();
        assert!(straight < 1.01, "{straight}");
    }
}
