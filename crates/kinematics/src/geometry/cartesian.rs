//! Joints that are the pen's own coordinates.

use drawing::{Point, Vec2};
use nalgebra::Matrix2;

use super::{Joints, Unreachable};

/// `q = (x, y)`. CoreXY and H-bot are this geometry with another coupling matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cartesian;

impl Cartesian {
    pub(super) fn forward(self, q: &Joints) -> Point {
        Point::new(q.x, q.y)
    }

    #[expect(clippy::unnecessary_wraps, reason = "the same shape as the other geometries")]
    pub(super) fn inverse(self, p: Point) -> Result<Joints, Unreachable> {
        Ok(Joints::new(p.x, p.y))
    }

    pub(super) fn jacobian(self, _q: &Joints) -> Matrix2<f64> {
        Matrix2::identity()
    }

    pub(super) fn path_derivatives(self, _q: &Joints, first: Vec2, second: Vec2) -> (Joints, Joints) {
        (Joints::new(first.x, first.y), Joints::new(second.x, second.y))
    }

    pub(super) fn path_third_derivative(
        self,
        _q: &Joints,
        _first: Vec2,
        _second: Vec2,
        third: Vec2,
    ) -> Joints {
        Joints::new(third.x, third.y)
    }

    pub(super) fn bend(self, _from: &Joints, _to: &Joints) -> f64 {
        0.0
    }

    pub(super) fn dexterity(self, _q: &Joints) -> f64 {
        1.0
    }
}
