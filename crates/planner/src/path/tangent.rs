//! Tangents, speeds and distances of curves.

use drawing::{Point, Segment, Vec2};

/// The largest change of direction that is not a corner, rad: at 1 m/s the velocity jumps by 1
/// um/s.
const SMOOTH_ANGLE: f64 = 1e-6;

pub(super) fn velocity(curve: &Segment, t: f64) -> f64 {
    curve.derivatives(t).0.hypot2().sqrt()
}

/// The unit tangent; `None` where the speed is 0.
pub(super) fn direction_at(piece: &Segment, t: f64) -> Option<Vec2> {
    let (first, _) = piece.derivatives(t);
    let speed = first.hypot2().sqrt();
    (speed > 0.0).then(|| first / speed)
}

pub(super) fn is_smooth(before: Vec2, after: Vec2) -> bool {
    before.dot(after) > 0.0 && before.cross(after).abs() <= SMOOTH_ANGLE
}

pub(super) fn distance(a: Point, b: Point) -> f64 {
    libm::hypot(a.x - b.x, a.y - b.y)
}
