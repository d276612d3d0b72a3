//! A rail that turns about the base and a pen that slides along it.

use drawing::{Point, Vec2};
use nalgebra::Matrix2;

use super::{Joints, Unreachable, frame};

/// `q = (phi, r)`: `p = r e(phi)`, with e(phi) = (cos phi, sin phi) and t(phi) = (-sin phi, cos phi).
///
/// ```text
/// J   = [ r t   e ]                 det J = -r
/// phi' = (v.t) / r                  r' = v.e
/// phi'' = (a.t - 2 r' phi') / r     r'' = a.e + r phi'^2
/// phi''' = (j.t - phi' a.e - 3 r' phi'' - 2 r'' phi') / r
/// r''' = j.e + phi' a.t + r' phi'^2 + 2 r phi' phi''
/// ```
/// Singular at the centre. Source: differentiating the definition; seed 4 (drawing robot with rack and pinion).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Polar;

impl Polar {
    pub(super) fn forward(self, q: &Joints) -> Point {
        (q.y * frame(q.x).0).to_point()
    }

    /// Every point has a pose; at the pole, which is singular, phi is 0.
    #[expect(clippy::unnecessary_wraps, reason = "the same shape as the other geometries")]
    pub(super) fn inverse(self, p: Point) -> Result<Joints, Unreachable> {
        Ok(Joints::new(libm::atan2(p.y, p.x), libm::hypot(p.x, p.y)))
    }

    pub(super) fn jacobian(self, q: &Joints) -> Matrix2<f64> {
        let (e, t) = frame(q.x);
        Matrix2::new(q.y * t.x, e.x, q.y * t.y, e.y)
    }

    pub(super) fn path_derivatives(self, q: &Joints, first: Vec2, second: Vec2) -> (Joints, Joints) {
        let ((e, t), r) = (frame(q.x), q.y);
        let (phi_1, r_1) = (first.dot(t) / r, first.dot(e));
        let phi_2 = (second.dot(t) - 2.0 * r_1 * phi_1) / r;
        let r_2 = second.dot(e) + r * phi_1 * phi_1;
        (Joints::new(phi_1, r_1), Joints::new(phi_2, r_2))
    }

    pub(super) fn path_third_derivative(self, q: &Joints, first: Vec2, second: Vec2, third: Vec2) -> Joints {
        let ((e, t), r) = (frame(q.x), q.y);
        let (rates, turns) = self.path_derivatives(q, first, second);
        let ((phi_1, r_1), (phi_2, r_2)) = ((rates.x, rates.y), (turns.x, turns.y));
        let phi_3 = (third.dot(t) - phi_1 * second.dot(e) - 3.0 * r_1 * phi_2 - 2.0 * r_2 * phi_1) / r;
        let r_3 = third.dot(e) + phi_1 * second.dot(t) + r_1 * phi_1 * phi_1 + 2.0 * r * phi_1 * phi_2;
        Joints::new(phi_3, r_3)
    }

    /// d²p/du² = 2 r' phi' t - r phi'^2 e, largest where r is.
    pub(super) fn bend(self, from: &Joints, to: &Joints) -> f64 {
        let change = to - from;
        libm::hypot(2.0 * change.y * change.x, from.y.abs().max(to.y.abs()) * change.x * change.x)
    }

    /// r counted in units of a page's centimetre: the angle is well held from 10 mm on.
    pub(super) fn dexterity(self, q: &Joints) -> f64 {
        (q.y.abs() / 10.0).min(1.0)
    }
}
