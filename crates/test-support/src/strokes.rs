//! Strokes and distances.

use drawing::{Line, Pen, Point, Span, Stroke, distance, distance_to_line};

/// A polyline of pen 1 without a place in a source.
pub fn polyline(points: impl IntoIterator<Item = impl Into<Point>>) -> Stroke {
    let points = points.into_iter().map(Into::into).collect();
    Stroke::polyline(Pen(1), points, Span::default()).expect("a polyline has points")
}

/// The distance from a point to a polyline of at least one point.
pub fn distance_to_polyline(p: Point, line: &[Point]) -> f64 {
    match line {
        [only] => distance(p, *only),
        _ => line
            .windows(2)
            .map(|pair| distance_to_line(p, Line::new(pair[0], pair[1])))
            .fold(f64::INFINITY, f64::min),
    }
}
