//! A rail that turns about the base, with a pen that slides along it.

use drawing::{Point, Rect, Vec2};

use super::parameters::{FromParameters, ParameterError, Parameters};
use super::{JointKind, Mechanism, Unreachable, frame};
use crate::linkage::{moving, part};
use crate::{Anchor, JointAffine, JointPos, Linkage, PartKind};

/// `q = (phi, r)`: `p = r e(phi)`, with e(phi) = (cos phi, sin phi) and t(phi) = (-sin phi, cos phi).
///
/// ```text
/// J   = [ r t   e ]                 det J = -r
/// phi' = (v.t) / r                  r' = v.e
/// phi'' = (a.t - 2 r' phi') / r     r'' = a.e + r phi'^2
/// phi''' = (j.t - phi' a.e - 3 r' phi'' - 2 r'' phi') / r
/// r''' = j.e + phi' a.t + r' phi'^2 + 2 r phi' phi''
/// ```
/// Singular at the pole, but on lines that end there: phi rests on them, so that its derivatives are
/// taken as 0 at r = 0, where the formulas are 0 / 0. Source: differentiating the definition; the report of the polar machine
/// (docs/references.md).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Polar;

impl Mechanism for Polar {
    fn kind(&self) -> &'static str {
        Self::KIND
    }

    fn joint_names(&self) -> [&'static str; 2] {
        ["phi", "r"]
    }

    fn joint_kinds(&self) -> [JointKind; 2] {
        [JointKind::Revolute, JointKind::Prismatic]
    }

    fn forward(&self, q: &JointPos) -> Point {
        (q[1] * frame(q[0]).0).to_point()
    }

    /// Every point has a pose. At the pole, which is singular, phi is 0.
    fn inverse(&self, p: Point) -> Result<JointPos, Unreachable> {
        Ok(JointPos::new(libm::atan2(p.y, p.x), libm::hypot(p.x, p.y)))
    }

    fn jacobian(&self, q: &JointPos) -> [Vec2; 2] {
        let (e, t) = frame(q[0]);
        [q[1] * t, e]
    }

    fn path_derivatives(&self, q: &JointPos, first: Vec2, second: Vec2) -> (JointPos, JointPos) {
        let ((e, t), r) = (frame(q[0]), q[1]);
        if r == 0.0 {
            return (JointPos::new(0.0, first.dot(e)), JointPos::new(0.0, second.dot(e)));
        }
        let (phi_1, r_1) = (first.dot(t) / r, first.dot(e));
        let phi_2 = (second.dot(t) - 2.0 * r_1 * phi_1) / r;
        let r_2 = second.dot(e) + r * phi_1 * phi_1;
        (JointPos::new(phi_1, r_1), JointPos::new(phi_2, r_2))
    }

    fn path_third_derivative(&self, q: &JointPos, first: Vec2, second: Vec2, third: Vec2) -> JointPos {
        let ((e, t), r) = (frame(q[0]), q[1]);
        if r == 0.0 {
            return JointPos::new(0.0, third.dot(e));
        }
        let (rates, turns) = self.path_derivatives(q, first, second);
        let ((phi_1, r_1), (phi_2, r_2)) = ((rates[0], rates[1]), (turns[0], turns[1]));
        let phi_3 = (third.dot(t) - phi_1 * second.dot(e) - 3.0 * r_1 * phi_2 - 2.0 * r_2 * phi_1) / r;
        let r_3 = third.dot(e) + phi_1 * second.dot(t) + r_1 * phi_1 * phi_1 + 2.0 * r * phi_1 * phi_2;
        JointPos::new(phi_3, r_3)
    }

    /// d²p/du² = 2 r' phi' t - r phi'^2 e, largest at the largest r.
    fn second_derivative_bound(&self, from: &JointPos, to: &JointPos) -> f64 {
        let change = *to - *from;
        libm::hypot(2.0 * change[1] * change[0], from[1].abs().max(to[1].abs()) * change[0] * change[0])
    }

    /// r / 10 mm, at most 1: from 10 mm on, the angle is well determined.
    fn manipulability(&self, q: &JointPos) -> f64 {
        (q[1].abs() / 10.0).min(1.0)
    }

    /// The pen draws no nearer to the pole than 1 mm, but on lines that end there.
    fn default_min_manipulability(&self) -> f64 {
        0.1
    }

    fn full_rotation(&self) -> Option<JointPos> {
        Some(JointPos::new(std::f64::consts::TAU, 0.0))
    }

    fn base(&self) -> Option<Point> {
        Some(Point::ZERO)
    }

    fn pole(&self) -> Option<Point> {
        Some(Point::ZERO)
    }

    fn is_linear(&self) -> bool {
        false
    }

    /// A rail that turns about the pole, and a rack on it that carries the pen: as long as the way
    /// to the sheet's farthest corner.
    fn linkage(&self, sheet: Rect) -> Linkage {
        let corners =
            [(sheet.x0, sheet.y0), (sheet.x1, sheet.y0), (sheet.x0, sheet.y1), (sheet.x1, sheet.y1)];
        let farthest = corners.into_iter().map(|(x, y)| libm::hypot(x, y)).fold(0.0, f64::max);
        let phi = JointAffine::joint(0);
        let anchors = vec![
            Anchor::Fixed(Point::ZERO),
            moving(0, JointAffine::joint(1), phi),
            moving(1, JointAffine::fixed(-farthest), phi),
            moving(0, JointAffine::fixed(-0.2 * farthest), phi),
            moving(0, JointAffine::fixed(0.2 * farthest), phi),
        ];
        let parts = vec![part(PartKind::Rail, 3, 4), part(PartKind::Link, 2, 1), part(PartKind::Pivot, 0, 0)];
        Linkage { anchors, parts, pen: 1 }
    }
    // No joint_extrema_on_line: phi is monotone on a whole line, r on both sides of the foot.
}

impl FromParameters for Polar {
    const KIND: &'static str = "polar";
    const PARAMETERS: &'static [&'static str] = &[];

    fn from_parameters(_parameters: &mut dyn Parameters) -> Result<Self, ParameterError> {
        Ok(Self)
    }
}
