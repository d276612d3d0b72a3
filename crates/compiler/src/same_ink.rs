//! Equality of drawings as ink.

use drawing::{Drawing, Point, Segment};

/// Whether two drawings consist of the same pieces with the same pens, in any order and direction.
pub(crate) fn same_ink(one: &Drawing, other: &Drawing) -> bool {
    pieces_of(one) == pieces_of(other)
}

/// Pen, ends (the smaller first) and middle of every piece, in nm, sorted. The middle distinguishes
/// curves between the same ends; reversing a curve may move it by a rounding error. A dot is a piece.
fn pieces_of(drawing: &Drawing) -> Vec<(u16, [[i64; 2]; 3])> {
    let nanometres = |p: Point| [p.x, p.y].map(|mm| (mm * 1e6).round() as i64);
    let mut pieces = Vec::new();
    for stroke in &drawing.strokes {
        let mut add = |a: Point, b: Point, middle: Point| {
            let (a, b) = (nanometres(a), nanometres(b));
            pieces.push((stroke.pen.0, [a.min(b), a.max(b), nanometres(middle)]));
        };
        if stroke.is_dot() {
            add(stroke.start(), stroke.start(), stroke.start());
        }
        for (ends, segment) in stroke.vertices().windows(2).zip(stroke.segments()) {
            if let Segment::Arc(arc) = segment
                && (arc.sweep_rad.abs() - std::f64::consts::TAU).abs() < 1e-9
            {
                // A full circle may begin at any of its points.
                add(arc.center + arc.a, arc.center - arc.a, arc.center + arc.b);
                continue;
            }
            add(ends[0], ends[1], segment.eval(0.5));
        }
    }
    pieces.sort_unstable();
    pieces
}

#[cfg(test)]
mod tests {
    use drawing::{EllipticArc, Pen, Span, Stroke};

    use super::*;

    fn drawing(points: &[&[(f64, f64)]]) -> Drawing {
        let stroke = |points: &&[(f64, f64)]| {
            let points = points.iter().map(|&(x, y)| Point::new(x, y)).collect();
            Stroke::polyline(Pen(1), points, Span::default()).unwrap()
        };
        Drawing { strokes: points.iter().map(stroke).collect() }
    }

    #[test]
    fn same_ink_ignores_order_direction_and_joining() {
        let one = drawing(&[&[(0.0, 0.0), (1.0, 0.0)], &[(1.0, 0.0), (1.0, 2.0)], &[(5.0, 5.0)]]);
        let other = drawing(&[&[(5.0, 5.0)], &[(1.0, 2.0), (1.0, 0.0), (0.0, 0.0)]]);
        assert!(same_ink(&one, &other));
    }

    #[test]
    fn same_ink_of_a_circle_with_another_start() {
        let circle = |radius: f64, start: f64| {
            let arc = EllipticArc::circular(Point::new(5.0, 5.0), radius, start, std::f64::consts::TAU);
            let mut stroke = Stroke::new(Pen(1), arc.eval(0.0), Span::default());
            stroke.arc(arc);
            Drawing::from(vec![stroke])
        };
        assert!(same_ink(&circle(2.0, 0.0), &circle(2.0, 1.0)));
        assert!(!same_ink(&circle(2.0, 0.0), &circle(2.1, 0.0)));
    }

    #[test]
    fn same_ink_notices_lost_moved_and_bent_pieces() {
        let one = drawing(&[&[(0.0, 0.0), (1.0, 0.0)], &[(5.0, 5.0)]]);
        assert!(!same_ink(&one, &drawing(&[&[(0.0, 0.0), (1.0, 0.0)]])));
        assert!(!same_ink(&one, &drawing(&[&[(0.0, 0.0), (1.0, 1e-5)], &[(5.0, 5.0)]])));
        let half = |sweep: f64| {
            let arc = EllipticArc::circular(Point::ZERO, 1.0, 0.0, sweep);
            let mut stroke = Stroke::new(Pen(1), Point::new(1.0, 0.0), Span::default());
            stroke.arc(arc);
            Drawing::from(vec![stroke])
        };
        assert!(!same_ink(&half(std::f64::consts::PI), &half(-std::f64::consts::PI)));
        let mut turned = half(2.0);
        turned.strokes.update(Stroke::reverse);
        assert!(same_ink(&half(2.0), &turned));
    }
}
