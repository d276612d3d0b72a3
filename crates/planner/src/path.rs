//! From a stroke to smooth sections: what the pen can follow without stopping.

use drawing::{Line, Segment, Stroke, Vec2};

/// Vertices that lie on the straight line between their neighbours, to this distance in mm, are not corners.
const COLLINEAR: f64 = 1e-9;

/// The largest break of direction that is not a corner, rad: at 1 m/s it asks for a jump of 1 um/s.
const SMOOTH_ANGLE: f64 = 1e-6;

/// A curve whose speed |p'(t)| somewhere falls below this share of its largest is taken as chords: at a cusp its
/// direction has no derivative by length.
const REGULAR: f64 = 1e-3;

/// Pieces that follow one another without a break of direction; at least one, none of no length.
pub type Section = Vec<Segment>;

/// The smooth sections of a stroke, in order; none for a dot or a stroke that goes nowhere.
///
/// Pieces of no length are dropped and straight pieces in line are joined. `chord_tolerance` (mm) is how far the chords
/// may be off that stand for curves with a cusp; all other curves stay what they are.
pub fn sections(stroke: &Stroke, chord_tolerance: f64) -> Vec<Section> {
    let mut sections: Vec<Section> = Vec::new();
    let mut add = |piece: Segment| {
        let Some(direction) = direction_at(&piece, 0.0) else { return };
        if let Some(section) = sections.last_mut() {
            let last = section.len() - 1;
            if let (Segment::Line(before), Segment::Line(next)) = (&section[last], &piece)
                && in_line(before, next)
            {
                section[last] = Segment::Line(Line::new(before.p0, next.p1));
                return;
            }
            if direction_at(&section[last], 1.0).is_some_and(|before| is_smooth(before, direction)) {
                section.push(piece);
                return;
            }
        }
        sections.push(vec![piece]);
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
    sections
}

/// The unit tangent at an end; nothing for a piece of no length.
fn direction_at(piece: &Segment, t: f64) -> Option<Vec2> {
    let (first, _) = piece.derivatives(t);
    let speed = first.hypot2().sqrt();
    (speed > 0.0).then(|| first / speed)
}

fn is_smooth(before: Vec2, after: Vec2) -> bool {
    before.dot(after) > 0.0 && before.cross(after).abs() <= SMOOTH_ANGLE
}

/// Whether `next` goes on in the direction of `before`: the vertex between lies on the chord, and neither turns back.
fn in_line(before: &Line, next: &Line) -> bool {
    let (chord, first) = (next.p1 - before.p0, before.p1 - before.p0);
    let second = next.p1 - next.p0;
    first.dot(chord) > 0.0
        && second.dot(chord) > 0.0
        && first.cross(chord).abs() <= COLLINEAR * chord.hypot2().sqrt()
}

/// Whether the speed along the curve stays well above zero, sampled finely enough for arcs and cubics.
fn is_regular(segment: &Segment) -> bool {
    let samples = match segment {
        Segment::Line(_) => return true,
        Segment::Arc(_) => 64,
        Segment::Cubic(_) => 32,
    };
    let speeds = (0..=samples).map(|k| {
        let (first, _) = segment.derivatives(f64::from(k) / f64::from(samples));
        first.hypot2().sqrt()
    });
    let (least, most) = speeds.fold((f64::INFINITY, 0.0_f64), |(l, m), v| (l.min(v), m.max(v)));
    least > REGULAR * most || most == 0.0
}

#[cfg(test)]
mod tests {
    use drawing::{EllipticArc, Pen, Point, Span};

    use super::*;

    fn polyline(points: &[(f64, f64)]) -> Stroke {
        let points = points.iter().map(|&(x, y)| Point::new(x, y)).collect();
        Stroke::polyline(Pen(1), points, Span::default()).unwrap()
    }

    #[test]
    fn collinear_and_repeated_vertices_are_not_corners() {
        let stroke = polyline(&[(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (5.0, 0.0), (5.0, 3.0)]);
        let sections = sections(&stroke, 0.01);
        assert_eq!(sections.len(), 2);
        assert_eq!(sections[0], vec![Segment::Line(Line::new(Point::new(0.0, 0.0), Point::new(5.0, 0.0)))]);
    }

    #[test]
    fn a_reversal_is_a_corner() {
        assert_eq!(sections(&polyline(&[(0.0, 0.0), (5.0, 0.0), (2.0, 0.0)]), 0.01).len(), 2);
    }

    #[test]
    fn a_tangent_arc_goes_on_in_the_same_section() {
        let mut stroke = polyline(&[(0.0, 0.0), (5.0, 0.0)]);
        stroke.arc(EllipticArc::circular(Point::new(5.0, 2.0), 2.0, -std::f64::consts::FRAC_PI_2, 1.0));
        assert_eq!(sections(&stroke, 0.01).len(), 1);
    }

    #[test]
    fn a_flat_ellipse_turns_back_at_its_ends() {
        let mut stroke = Stroke::new(Pen(1), Point::new(4.0, 0.0), Span::default());
        stroke.arc(EllipticArc {
            center: Point::ZERO,
            a: Vec2::new(4.0, 0.0),
            b: Vec2::ZERO,
            start: 0.0,
            sweep: std::f64::consts::TAU,
        });
        let sections = sections(&stroke, 0.01);
        assert_eq!(sections.len(), 2);
        assert!((sections[0][0].end().x + 4.0).abs() < 0.02);
    }

    #[test]
    fn a_dot_has_no_sections() {
        assert!(sections(&polyline(&[(1.0, 1.0)]), 0.01).is_empty());
        assert!(sections(&polyline(&[(1.0, 1.0), (1.0, 1.0)]), 0.01).is_empty());
    }
}
