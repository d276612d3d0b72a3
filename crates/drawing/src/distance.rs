//! Distances in the plane.

use kurbo::{Line, Point};

/// The distance between two points, mm: `sqrt(dx² + dy²)`.
///
/// Only `+ - *` and the square root are used, so that the result has the same bits on every
/// platform. It overflows beyond 1e154 mm, where `hypot` would not.
pub fn distance(a: Point, b: Point) -> f64 {
    (b - a).hypot2().sqrt()
}

/// The distance from a point to the nearest point of a straight line segment, mm.
///
/// A line of length 0 counts as a point.
pub fn distance_to_line(p: Point, line: Line) -> f64 {
    let vector = line.p1 - line.p0;
    let square = vector.hypot2();
    let t = if square > 0.0 { ((p - line.p0).dot(vector) / square).clamp(0.0, 1.0) } else { 0.0 };
    distance(p, line.p0 + t * vector)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_to_line_inside_beyond_and_to_a_point() {
        let line = Line::new((0.0, 0.0), (4.0, 0.0));
        assert_eq!(distance_to_line(Point::new(1.0, -2.0), line), 2.0);
        assert_eq!(distance_to_line(Point::new(7.0, 4.0), line), 5.0);
        let dot = Line::new((1.0, 1.0), (1.0, 1.0));
        assert_eq!(distance_to_line(Point::new(4.0, 5.0), dot), 5.0);
    }
}
