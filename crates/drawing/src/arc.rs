//! Arcs of ellipses, in the form that affine maps keep exactly.

use kurbo::{Affine, Point, Vec2};

use crate::segment::apply_linear;

/// An arc of an ellipse: `p(u) = center + cos(u) * a + sin(u) * b`, `u` from `start` to `start + sweep`.
///
/// `a` and `b` are a pair of conjugate half-diameters in mm: perpendicular and equally long for a circle. This form
/// is closed under every affine map, mirrored and sheared ones included (the map is applied to `center`, `a` and
/// `b`), where the usual form by radii and rotation needs a singular value decomposition and loses its start angle.
/// A degenerate ellipse (parallel `a` and `b`) is a stretch of a line, gone to and fro; it is legal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipticArc {
    /// Centre, mm.
    pub center: Point,
    /// Half-diameter reached at `u = 0`, mm.
    pub a: Vec2,
    /// Half-diameter reached at `u = pi/2`, mm.
    pub b: Vec2,
    /// Parameter of the first point, rad.
    pub start_rad: f64,
    /// Signed range of the parameter, rad; a whole turn is `2 pi` in size.
    pub sweep_rad: f64,
}

impl EllipticArc {
    /// The circular arc about `center` with `radius` (mm) from angle `start` over `sweep` (rad, counterclockwise positive).
    pub fn circular(center: Point, radius: f64, start: f64, sweep: f64) -> Self {
        Self {
            center,
            a: Vec2::new(radius, 0.0),
            b: Vec2::new(0.0, radius),
            start_rad: start,
            sweep_rad: sweep,
        }
    }

    /// The point at parameter `u` (rad).
    pub fn at_angle(&self, u: f64) -> Point {
        let (sin, cos) = libm::sincos(u);
        self.center + cos * self.a + sin * self.b
    }

    /// The point at `t`, 0 at the start and 1 at the end.
    pub fn eval(&self, t: f64) -> Point {
        self.at_angle(self.start_rad + self.sweep_rad * t)
    }

    /// First and second derivative by `t`, mm.
    pub fn derivatives(&self, t: f64) -> (Vec2, Vec2) {
        let (sin, cos) = libm::sincos(self.start_rad + self.sweep_rad * t);
        (
            self.sweep_rad * (cos * self.b - sin * self.a),
            -self.sweep_rad * self.sweep_rad * (cos * self.a + sin * self.b),
        )
    }

    /// Radius in mm if this is an arc of a circle (to a relative 1e-12), otherwise nothing.
    pub fn circle_radius(&self) -> Option<f64> {
        let (aa, bb) = (self.a.hypot2(), self.b.hypot2());
        let scale = aa.max(bb);
        ((aa - bb).abs() <= 2e-12 * scale && self.a.dot(self.b).abs() <= 1e-12 * scale).then(|| aa.sqrt())
    }

    /// Half the longest and half the shortest diameter, mm: the singular values of the matrix `[a b]`.
    pub fn semi_axes(&self) -> (f64, f64) {
        // sigma_1 +- sigma_2 = hypot of the two orthogonal combinations of the columns.
        let (a, b) = (self.a, self.b);
        let sum = libm::hypot(a.x + b.y, a.y - b.x);
        let difference = libm::hypot(a.x - b.y, a.y + b.x);
        (0.5 * (sum + difference), 0.5 * (sum - difference).abs())
    }

    /// The same arc under an affine map.
    pub fn transformed(&self, map: Affine) -> Self {
        Self {
            center: map * self.center,
            a: apply_linear(map, self.a),
            b: apply_linear(map, self.b),
            ..*self
        }
    }

    /// The same points in the opposite order.
    pub fn reversed(&self) -> Self {
        Self { start_rad: self.start_rad + self.sweep_rad, sweep_rad: -self.sweep_rad, ..*self }
    }

    /// The part between `t0` and `t1`.
    pub fn part(&self, t0: f64, t1: f64) -> Self {
        Self {
            start_rad: self.start_rad + self.sweep_rad * t0,
            sweep_rad: self.sweep_rad * (t1 - t0),
            ..*self
        }
    }

    /// Into how many equal steps of `t` the arc must be cut so that every chord stays within `tolerance` mm of its arc.
    ///
    /// An ellipse is a unit circle under the matrix `[a b]`; a chord of angle `d` leaves the unit circle by
    /// `1 - cos(d/2)`, and the matrix stretches that by the longest semi-axis `s` at the most. So
    /// `d <= 2 acos(1 - tolerance / s)`.
    pub fn chord_count(&self, tolerance: f64) -> usize {
        let (longest, _) = self.semi_axes();
        let ratio = tolerance / longest;
        // A chord never spans more than a third of a turn, so that a full circle keeps an inside.
        let largest = if ratio < 1.0 {
            (2.0 * libm::acos(1.0 - ratio)).min(2.0 * std::f64::consts::FRAC_PI_3)
        } else {
            2.0 * std::f64::consts::FRAC_PI_3
        };
        let count = (self.sweep_rad.abs() / largest).ceil();
        if count.is_finite() && count >= 1.0 { count as usize } else { 1 }
    }
}
