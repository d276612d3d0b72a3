//! Slow zones: pieces on which the pen's acceleration is limited because a corner is near.
//!
//! Motors move linearly between rows, which are a period `T` apart, so the motion may deviate from
//! the path by `T²/8` times the largest acceleration of the pen in between. On a straight line this
//! is no deviation: the pen only leads or lags. Near a corner it is, also on the line that leads
//! into it: linear motion between a row before the corner and one after it cuts the corner. On a
//! fitted spline the speed is bounded instead.

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

/// Sets the bounds of a fitted spline, on which rows deviate by its curvature.
///
/// A chord of length L to a curve with a curvature of at most k leaves it by at most `k L² / 8`. So
/// rows deviate by at most `row` if the pen, wherever it has a place with the curvature k within
/// `w = √(8 row / k)`, is no faster than `w / T`: then no chord that contains the place is longer
/// than w. Acceleration along the path does not matter here, unlike in [`mark`]. A w longer than
/// `reach`, the largest distance between two rows, has no effect. `None` if that is unbounded.
pub(crate) fn bound_speed(mut section: Section, row: f64, reach: f64) -> Option<Section> {
    if !reach.is_finite() {
        return None;
    }
    // Chords, which are no longer than the path between two places.
    let mut at = Vec::with_capacity(section.len() + 1);
    let mut s = 0.0;
    at.push(s);
    let mut bends = Vec::with_capacity(section.len());
    for piece in &section {
        s += (piece.curve.end() - piece.curve.start()).hypot2().sqrt();
        at.push(s);
        bends.push([0.0, 0.25, 0.5, 0.75, 1.0].map(|t| curvature(piece, t)).into_iter().fold(0.0, f64::max));
    }
    let mut largest = bends.clone();
    for (j, &bend) in bends.iter().enumerate() {
        let width = (8.0 * row / bend).sqrt();
        if width >= reach {
            continue;
        }
        for i in (0..j).rev().take_while(|i| at[j] - at[i + 1] <= width) {
            largest[i] = largest[i].max(bend);
        }
        for i in (j + 1..section.len()).take_while(|i| at[*i] - at[j + 1] <= width) {
            largest[i] = largest[i].max(bend);
        }
    }
    for (piece, bend) in section.iter_mut().zip(largest) {
        let speed = [0.0, 0.5, 1.0].map(|t| piece.curve.derivatives(t).0.hypot2());
        let square = piece.rate * piece.rate * speed.into_iter().fold(0.0, f64::max);
        piece.row_bound = Some(bend * square);
    }
    Some(section)
}

/// The curvature of a piece, 1/mm; infinite where the path turns back.
fn curvature(piece: &Piece, t: f64) -> f64 {
    let (first, second) = piece.curve.derivatives(t);
    let speed = first.hypot2().sqrt();
    if speed > 0.0 { first.cross(second).abs() / (speed * speed * speed) } else { f64::INFINITY }
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
    Piece {
        curve: piece.curve.part(t0, t1.min(1.0)),
        rate: piece.rate / (t1.min(1.0) - t0),
        near_corner,
        row_bound: None,
    }
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
        let piece = |curve: Segment, length: f64| Piece {
            curve,
            rate: 1.0 / length,
            near_corner: false,
            row_bound: None,
        };
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

    #[test]
    fn speed_is_bounded_within_reach_of_a_bend() {
        // Straight, a quarter turn of radius about 0.2 mm, straight.
        let turn = CubicBez::new((1.0, 0.0), (1.11, 0.0), (1.2, 0.09), (1.2, 0.2));
        let mut section: Section = (0..10)
            .map(|k| {
                let (from, to) = (0.1 * f64::from(k), 0.1 * f64::from(k + 1));
                let line = Line::new(Point::new(from, 0.0), Point::new(to, 0.0));
                let (a, b) = (line.p0.lerp(line.p1, 1.0 / 3.0), line.p0.lerp(line.p1, 2.0 / 3.0));
                Segment::Cubic(CubicBez::new(line.p0, a, b, line.p1))
            })
            .chain([Segment::Cubic(turn)])
            .map(|curve| Piece { curve, rate: 10.0, near_corner: false, row_bound: Some(0.0) })
            .collect();
        section[10].rate = 1.0 / 0.33;
        let row = 0.01;
        let bounded = bound_speed(section.clone(), row, 10.0).expect("a finite reach");
        let bend = bounded[10].row_bound.expect("it is a spline");
        assert!((4.0..7.0).contains(&bend), "{bend}");
        // Within √(8 row / 5) = 0.126 mm the same bound holds; the place 0.4 mm away is free.
        for (k, free) in [(9, false), (8, false), (5, true), (0, true)] {
            let bound = bounded[k].row_bound.expect("it is a spline");
            assert_eq!(bound < 1e-6, free, "piece {k}: {bound}");
        }
        assert!(bound_speed(section.clone(), row, 0.05).expect("a finite reach")[9].row_bound < Some(1e-6));
        assert!(bound_speed(section, row, f64::INFINITY).is_none());
    }
}
