//! The cost of pen-up moves.

use drawing::Point;

/// A point in the space in which costs are computed: joint positions, or the plane itself.
pub type CostPoint = [f64; 2];

/// The cost of a pen-up move between two points in mm: in seconds on a machine, or in mm.
///
/// It must be symmetric, finite, not negative, and a pure function of its arguments. Any function
/// or closure of two points is a cost. The search evaluates the same points many times: a cost that
/// needs inverse kinematics does it once a point, in `to_cost_space`.
pub trait Cost {
    /// Maps a point of the plane to the space in which costs are computed.
    fn to_cost_space(&self, point: Point) -> CostPoint;

    /// The cost of a move between two mapped points.
    fn between_cost_points(&self, a: CostPoint, b: CostPoint) -> f64;

    /// The cost of a move between two points of the plane.
    fn between(&self, a: Point, b: Point) -> f64 {
        self.between_cost_points(self.to_cost_space(a), self.to_cost_space(b))
    }
}

impl<F: Fn(Point, Point) -> f64 + Sync> Cost for F {
    fn to_cost_space(&self, point: Point) -> CostPoint {
        [point.x, point.y]
    }

    fn between_cost_points(&self, a: CostPoint, b: CostPoint) -> f64 {
        self(Point::from((a[0], a[1])), Point::from((b[0], b[1])))
    }
}
