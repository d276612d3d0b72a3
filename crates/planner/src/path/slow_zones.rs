//! Slow zones: pieces on which the pen's acceleration is limited because a corner is near.
//!
//! Motors move linearly between rows, which are a period `T` apart, so the motion may deviate from
//! the path by `T²/8` times the largest acceleration of the pen in between. On a straight line this
//! is no deviation: the pen only leads or lags. Near a corner it is, also on the line that leads
//! into it: linear motion between a row before the corner and one after it cuts the corner.

use drawing::Segment;

use super::piece::{Piece, Section};

/// Marks every piece that lies in a corner, or so near to one that the next row may lie in the
/// corner. Lines are split at the boundary of that zone.
///
/// In the zone the pen's acceleration is limited to `A = 8 row / T²`, so rows deviate by at most
/// `row` mm. A corner with the second derivative p'' is passed at no more than `c = sqrt(A /
/// |p''|)`; starting from that speed, with an acceleration of at most `A`, the pen covers at most
/// `c T + A T²/2 = sqrt(8 row / |p''|) + 4 row` in a period, which is the width of the zone on each
/// side.
pub(super) fn mark(section: Section, row: f64) -> Section {
    let mut zones: Vec<(f64, f64)> = Vec::new();
    let mut s = 0.0;
    for piece in &section {
        let end = s + piece.length();
        if let Some(second) = second_derivative(piece) {
            let width = (8.0 * row / second).sqrt() + 4.0 * row;
            match zones.last_mut() {
                Some(last) if last.1 >= s - width => last.1 = last.1.max(end + width),
                _ => zones.push((s - width, end + width)),
            }
        }
        s = end;
    }
    let mut marked = Vec::with_capacity(section.len());
    let mut s = 0.0;
    let mut zones = zones.into_iter().peekable();
    for piece in section {
        let end = s + piece.length();
        let mut from = s;
        while from < end {
            while zones.next_if(|zone| zone.1 <= from).is_some() {}
            let (to, near_corner) = match zones.peek() {
                Some(zone) if zone.0 <= from => (zone.1.min(end), true),
                Some(zone) => (zone.0.min(end), false),
                None => (end, false),
            };
            // Do not create pieces shorter than 1e-6 mm.
            let to = if end - to < 1e-6 { end } else { to };
            marked.push(part(&piece, (from - s) * piece.rate, (to - s) * piece.rate, near_corner));
            from = to;
        }
        s = end;
    }
    marked
}

/// p''| of a piece that is not a line.
fn second_derivative(piece: &Piece) -> Option<f64> {
    if matches!(piece.curve, Segment::Line(_)) {
        return None;
    }
    let (_, start) = piece.curve.derivatives(0.0);
    let (_, end) = piece.curve.derivatives(1.0);
    // Where the curvature starts from 0, as on a spline, the constraint comes from the following
    // spans.
    let (least, most) = (start.hypot2().min(end.hypot2()).sqrt(), start.hypot2().max(end.hypot2()).sqrt());
    let second = piece.rate * piece.rate * least.max(0.25 * most);
    Some(second.max(1e-6))
}

/// The part of a piece between t0 and t1 in the curve's own parameter.
fn part(piece: &Piece, t0: f64, t1: f64, near_corner: bool) -> Piece {
    if t0 <= 0.0 && t1 >= 1.0 {
        return Piece { near_corner, ..*piece };
    }
    Piece { curve: piece.curve.part(t0, t1.min(1.0)), rate: piece.rate / (t1.min(1.0) - t0), near_corner }
}

#[cfg(test)]
mod tests {
    use drawing::{CubicBez, Line, Point};

    use super::*;

    #[test]
    fn long_line_is_marked_near_corner_only() {
        let line = |a: (f64, f64), b: (f64, f64)| Segment::Line(Line::new(Point::from(a), Point::from(b)));
        let blend = CubicBez::new(
            Point::new(9.7, 0.0),
            Point::new(9.9, 0.0),
            Point::new(10.0, 0.1),
            Point::new(10.0, 0.3),
        );
        let piece = |curve: Segment, length: f64| Piece { curve, rate: 1.0 / length, near_corner: false };
        let section = vec![
            piece(line((0.0, 0.0), (9.7, 0.0)), 9.7),
            piece(Segment::Cubic(blend), 0.6),
            piece(line((10.0, 0.3), (10.0, 10.0)), 9.7),
        ];
        let marked = mark(section, 0.02);
        let flags: Vec<bool> = marked.iter().map(|piece| piece.near_corner).collect();
        assert_eq!(flags, [false, true, true, true, false]);
        // |p''| = |v - u| / (2 leg) = 1.414 / 0.6.
        let width = (8.0 * 0.02 / (2.0_f64.sqrt() / 0.6)).sqrt() + 0.08;
        assert!((marked[1].length() - width).abs() < 1e-9, "{}", marked[1].length());
        let all: f64 = marked.iter().map(Piece::length).sum();
        assert!((all - 20.0).abs() < 1e-9);
        for pair in marked.windows(2) {
            assert!((pair[0].curve.end() - pair[1].curve.start()).hypot2() < 1e-18);
        }
    }
}
