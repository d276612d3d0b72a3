//! A rail that turns about the base, with a pen that slides along it.

use drawing::{Point, Rect, Vec2};

use super::parameters::{FromParameters, ParameterError, Parameters};
use super::{JointKind, Mechanism, Unreachable, frame};
use crate::linkage::{moving, part};
use crate::{Anchor, JointAffine, JointPos, Linkage, MachineError, PartKind};

/// `q = (phi, r)`: `p = r e(phi) + d t(phi)`, with e(phi) = (cos phi, sin phi), t(phi) = (-sin phi,
/// cos phi), and d the distance at which the rack passes the pivot, to its left:
///
/// ```text
/// r = sqrt(x² + y² - d²)            phi = atan2(y, x) - atan2(d, r)
/// J   = [ r t - d e   e ]           det J = -r
/// phi' = (v.t) / r                  r' = v.e + d phi'
/// phi'' = (a.t - 2 r' phi' + d phi'^2) / r
/// r'' = a.e + r phi'^2 + d phi''
/// phi''' = (j.t - phi' a.e - 3 r' phi'' - 2 r'' phi' + 2 d phi' phi'') / r
/// r''' = j.e + phi' a.t + r' phi'^2 + 2 r phi' phi'' + d phi'''
/// ```
/// Singular at r = 0: at the pole, or on the circle of radius d about it; but without an offset not on
/// lines that end at the pole: phi rests on them, so that its derivatives are taken as 0 at r = 0, where the
/// formulas are 0 / 0. Source: differentiating the definition; the report of the polar machine
/// (docs/references.md).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Polar {
    /// Distance at which the rack passes the pivot, to its left seen along the rack, mm; negative to its
    /// right.
    pub rack_offset_mm: f64,
}

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

    fn validate(&self) -> Result<(), MachineError> {
        if self.rack_offset_mm.is_finite() {
            return Ok(());
        }
        Err(MachineError::NotFinite { quantity: "rack_offset".into() })
    }

    fn forward(&self, q: &JointPos) -> Point {
        let (e, t) = frame(q[0]);
        (q[1] * e + self.rack_offset_mm * t).to_point()
    }

    /// Without an offset every point has a pose. At the pole, which is singular, phi is 0.
    fn inverse(&self, p: Point) -> Result<JointPos, Unreachable> {
        let (direction, distance) = (libm::atan2(p.y, p.x), libm::hypot(p.x, p.y));
        let d = self.rack_offset_mm;
        if d == 0.0 {
            return Ok(JointPos::new(direction, distance));
        }
        let square = (distance - d.abs()) * (distance + d.abs());
        if square < 0.0 {
            return Err(Unreachable::TooNear(d.abs() - distance));
        }
        let r = square.sqrt();
        Ok(JointPos::new(direction - libm::atan2(d, r), r))
    }

    fn jacobian(&self, q: &JointPos) -> [Vec2; 2] {
        let (e, t) = frame(q[0]);
        [q[1] * t - self.rack_offset_mm * e, e]
    }

    fn path_derivatives(&self, q: &JointPos, first: Vec2, second: Vec2) -> (JointPos, JointPos) {
        let ((e, t), r, d) = (frame(q[0]), q[1], self.rack_offset_mm);
        if r == 0.0 && d == 0.0 {
            return (JointPos::new(0.0, first.dot(e)), JointPos::new(0.0, second.dot(e)));
        }
        let phi_1 = first.dot(t) / r;
        let r_1 = first.dot(e) + d * phi_1;
        let phi_2 = (second.dot(t) - 2.0 * r_1 * phi_1 + d * phi_1 * phi_1) / r;
        let r_2 = second.dot(e) + r * phi_1 * phi_1 + d * phi_2;
        (JointPos::new(phi_1, r_1), JointPos::new(phi_2, r_2))
    }

    fn path_third_derivative(&self, q: &JointPos, first: Vec2, second: Vec2, third: Vec2) -> JointPos {
        let ((e, t), r, d) = (frame(q[0]), q[1], self.rack_offset_mm);
        if r == 0.0 && d == 0.0 {
            return JointPos::new(0.0, third.dot(e));
        }
        let (rates, turns) = self.path_derivatives(q, first, second);
        let ((phi_1, r_1), (phi_2, r_2)) = ((rates[0], rates[1]), (turns[0], turns[1]));
        let offset = 2.0 * d * phi_1 * phi_2;
        let phi_3 =
            (third.dot(t) - phi_1 * second.dot(e) - 3.0 * r_1 * phi_2 - 2.0 * r_2 * phi_1 + offset) / r;
        let r_3 = third.dot(e) + phi_1 * second.dot(t) + r_1 * phi_1 * phi_1 + 2.0 * r * phi_1 * phi_2;
        JointPos::new(phi_3, r_3 + d * phi_3)
    }

    /// d²p/du² = (2 r' phi' - d phi'^2) t - r phi'^2 e, largest at the largest r.
    fn second_derivative_bound(&self, from: &JointPos, to: &JointPos) -> f64 {
        let change = *to - *from;
        let across = 2.0 * change[1] * change[0] - self.rack_offset_mm * change[0] * change[0];
        libm::hypot(across, from[1].abs().max(to[1].abs()) * change[0] * change[0])
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

    /// With an offset the rack does not pass the pivot.
    fn pole(&self) -> Option<Point> {
        (self.rack_offset_mm == 0.0).then_some(Point::ZERO)
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
        let across = JointAffine { constant: std::f64::consts::FRAC_PI_2, factors: [1.0, 0.0] };
        let anchors = vec![
            Anchor::Fixed(Point::ZERO),
            moving(0, JointAffine::fixed(self.rack_offset_mm), across),
            moving(1, JointAffine::joint(1), phi),
            moving(2, JointAffine::fixed(-farthest), phi),
            moving(1, JointAffine::fixed(-0.2 * farthest), phi),
            moving(1, JointAffine::fixed(0.2 * farthest), phi),
        ];
        let parts = vec![part(PartKind::Rail, 4, 5), part(PartKind::Link, 3, 2), part(PartKind::Pivot, 0, 0)];
        Linkage { anchors, parts, pen: 2 }
    }
    // No joint_extrema_on_line: phi is monotone on a whole line (phi' = 0 only where the rack lies along
    // it), r on both sides of the foot.
}

impl FromParameters for Polar {
    const KIND: &'static str = "polar";
    const PARAMETERS: &'static [&'static str] = &["rack_offset"];

    fn from_parameters(parameters: &mut dyn Parameters) -> Result<Self, ParameterError> {
        Ok(Self { rack_offset_mm: parameters.optional_length_mm("rack_offset")?.unwrap_or(0.0) })
    }
}
