//! Joints that are the pen's own coordinates.

use drawing::{Point, Vec2};

use super::{JointPos, Unreachable};

/// `q = (x, y)`. CoreXY and H-bot are this geometry with another coupling matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cartesian;

impl Cartesian {
    pub(super) fn forward(self, q: &JointPos) -> Point {
        Point::new(q[0], q[1])
    }

    #[expect(clippy::unnecessary_wraps, reason = "the same shape as the other geometries")]
    pub(super) fn inverse(self, p: Point) -> Result<JointPos, Unreachable> {
        Ok(JointPos::new(p.x, p.y))
    }

    pub(super) fn jacobian(self, _q: &JointPos) -> [Vec2; 2] {
        [Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)]
    }

    pub(super) fn path_derivatives(self, _q: &JointPos, first: Vec2, second: Vec2) -> (JointPos, JointPos) {
        (JointPos::new(first.x, first.y), JointPos::new(second.x, second.y))
    }

    pub(super) fn path_third_derivative(
        self,
        _q: &JointPos,
        _first: Vec2,
        _second: Vec2,
        third: Vec2,
    ) -> JointPos {
        JointPos::new(third.x, third.y)
    }

    pub(super) fn second_derivative_bound(self, _from: &JointPos, _to: &JointPos) -> f64 {
        0.0
    }

    pub(super) fn manipulability(self, _q: &JointPos) -> f64 {
        1.0
    }
}
