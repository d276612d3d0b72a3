//! A table whose joints are the pen's coordinates.

use std::f64::consts::FRAC_PI_2;

use drawing::{Point, Rect, Vec2};

use super::parameters::{FromParameters, ParameterError, Parameters};
use super::{JointKind, Mechanism, Unreachable};
use crate::linkage::{moving, part};
use crate::{Anchor, JointAffine, JointPos, Linkage, PartKind};

/// `q = (x, y)` and `p = q`: plain tables, CoreXY, H-bot (these differ in their coupling only).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cartesian;

impl Mechanism for Cartesian {
    fn kind(&self) -> &'static str {
        Self::KIND
    }

    fn joint_names(&self) -> [&'static str; 2] {
        ["x", "y"]
    }

    fn joint_kinds(&self) -> [JointKind; 2] {
        [JointKind::Prismatic; 2]
    }

    fn forward(&self, q: &JointPos) -> Point {
        Point::new(q[0], q[1])
    }

    /// Every point has a pose.
    fn inverse(&self, p: Point) -> Result<JointPos, Unreachable> {
        Ok(JointPos::new(p.x, p.y))
    }

    fn jacobian(&self, _q: &JointPos) -> [Vec2; 2] {
        [Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)]
    }

    fn path_derivatives(&self, _q: &JointPos, first: Vec2, second: Vec2) -> (JointPos, JointPos) {
        (JointPos::new(first.x, first.y), JointPos::new(second.x, second.y))
    }

    fn path_third_derivative(&self, _q: &JointPos, _first: Vec2, _second: Vec2, third: Vec2) -> JointPos {
        JointPos::new(third.x, third.y)
    }

    fn second_derivative_bound(&self, _from: &JointPos, _to: &JointPos) -> f64 {
        0.0
    }

    fn manipulability(&self, _q: &JointPos) -> f64 {
        1.0
    }

    fn default_min_manipulability(&self) -> f64 {
        0.0
    }

    fn full_rotation(&self) -> Option<JointPos> {
        None
    }

    fn base(&self) -> Option<Point> {
        None
    }

    fn is_linear(&self) -> bool {
        true
    }

    /// Two rails along x beside the sheet, a gantry along y between them, and a carriage on it.
    fn linkage(&self, sheet: Rect) -> Linkage {
        let beside = 0.04 * sheet.width().max(sheet.height());
        let frame = sheet.inflate(beside, beside);
        let fixed = |x: f64, y: f64| Anchor::Fixed(Point::new(x, y));
        let (x, y) = (JointAffine::joint(0), JointAffine::joint(1));
        let (along_x, along_y) = (JointAffine::default(), JointAffine::fixed(FRAC_PI_2));
        let anchors = vec![
            fixed(frame.x0, frame.y0),
            fixed(frame.x1, frame.y0),
            fixed(frame.x0, frame.y1),
            fixed(frame.x1, frame.y1),
            fixed(0.0, frame.y0),
            fixed(0.0, frame.y1),
            fixed(0.0, 0.0),
            moving(4, x, along_x),
            moving(5, x, along_x),
            moving(6, x, along_x),
            moving(9, y, along_y),
        ];
        let rails = [part(PartKind::Rail, 0, 1), part(PartKind::Rail, 2, 3)];
        let gantry = [part(PartKind::Link, 7, 8), part(PartKind::Pivot, 10, 10)];
        Linkage { anchors, parts: [rails, gantry].concat(), pen: 10 }
    }
}

impl FromParameters for Cartesian {
    const KIND: &'static str = "cartesian";
    const PARAMETERS: &'static [&'static str] = &[];

    fn from_parameters(_parameters: &mut dyn Parameters) -> Result<Self, ParameterError> {
        Ok(Self)
    }
}
