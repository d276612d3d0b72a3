//! Arcs of ellipses, in the form that affine maps keep exactly.

use kurbo::{Affine, Point, Vec2};

/// An arc of an ellipse: `p(u) = center + cos(u) a + sin(u) b`, with `u` from `start_rad` to
/// `start_rad + sweep_rad`.
///
/// `a` and `b` are conjugate half-diameters in mm: perpendicular and of equal length for a circle.
/// This form is closed under every affine map, including mirroring and shear: the map applies to
/// `center`, `a` and `b`. The usual form (radii and rotation) needs a singular value decomposition
/// and loses the start angle. A degenerate ellipse (`a` parallel to `b`) is a segment traversed
/// back and forth; this is allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipticArc {
    /// Centre, mm.
    pub center: Point,
    /// Half-diameter to the point at `u = 0`, mm.
    pub a: Vec2,
    /// Half-diameter to the point at `u = pi/2`, mm.
    pub b: Vec2,
    /// Parameter of the first point, rad.
    pub start_rad: f64,
    /// Signed range of the parameter, rad; `2 pi` or `-2 pi` for a full ellipse.
    pub sweep_rad: f64,
}

impl EllipticArc {
    /// A circular arc about `center`, counterclockwise for a positive sweep.
    pub fn circular(center: Point, radius_mm: f64, start_rad: f64, sweep_rad: f64) -> Self {
        Self { center, a: Vec2::new(radius_mm, 0.0), b: Vec2::new(0.0, radius_mm), start_rad, sweep_rad }
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

    /// First and second derivative with respect to `t`, mm.
    pub fn derivatives(&self, t: f64) -> (Vec2, Vec2) {
        let (sin, cos) = libm::sincos(self.start_rad + self.sweep_rad * t);
        (
            self.sweep_rad * (cos * self.b - sin * self.a),
            -self.sweep_rad * self.sweep_rad * (cos * self.a + sin * self.b),
        )
    }

    /// The radius in mm if this is an arc of a circle (to a relative error of 1e-12), else `None`.
    pub fn circle_radius(&self) -> Option<f64> {
        let (aa, bb) = (self.a.hypot2(), self.b.hypot2());
        let scale = aa.max(bb);
        ((aa - bb).abs() <= 2e-12 * scale && self.a.dot(self.b).abs() <= 1e-12 * scale).then(|| aa.sqrt())
    }

    /// The semi-axes, longer one first, mm: the singular values of the matrix `[a b]`.
    pub fn semi_axes(&self) -> (f64, f64) {
        // sigma_1 +- sigma_2 = hypot of the two orthogonal combinations of the columns.
        let (a, b) = (self.a, self.b);
        let sum = libm::hypot(a.x + b.y, a.y - b.x);
        let difference = libm::hypot(a.x - b.y, a.y + b.x);
        (0.5 * (sum + difference), 0.5 * (sum - difference).abs())
    }

    /// The arc mapped by an affine map.
    pub fn transformed(&self, map: Affine) -> Self {
        Self {
            center: map * self.center,
            a: apply_linear(map, self.a),
            b: apply_linear(map, self.b),
            ..*self
        }
    }

    /// The same points in the opposite direction.
    pub fn reversed(&self) -> Self {
        Self { start_rad: self.start_rad + self.sweep_rad, sweep_rad: -self.sweep_rad, ..*self }
    }

    /// The part from `t0` to `t1`.
    pub fn part(&self, t0: f64, t1: f64) -> Self {
        Self {
            start_rad: self.start_rad + self.sweep_rad * t0,
            sweep_rad: self.sweep_rad * (t1 - t0),
            ..*self
        }
    }

    /// The number of chords, equal in `t`, that keeps the chord error within `tolerance_mm`.
    ///
    /// An ellipse is the unit circle mapped by the matrix `[a b]`. A chord of angle `d` is
    /// `1 - cos(d/2)` away from the unit circle, and the matrix scales that by the longer semi-axis
    /// `s` at most. So `d <= 2 acos(1 - tolerance / s)`.
    pub fn chord_count(&self, tolerance_mm: f64) -> usize {
        let (longest, _) = self.semi_axes();
        let ratio = tolerance_mm / longest;
        // At most 120 degrees a chord, so that a full circle keeps an area.
        let largest = if ratio < 1.0 {
            (2.0 * libm::acos(1.0 - ratio)).min(2.0 * std::f64::consts::FRAC_PI_3)
        } else {
            2.0 * std::f64::consts::FRAC_PI_3
        };
        let count = (self.sweep_rad.abs() / largest).ceil();
        if count.is_finite() && count >= 1.0 { count as usize } else { 1 }
    }

    /// The angles `base + k * every` in the parameter range.
    pub(crate) fn angles_within(&self, base: f64, every: f64) -> Vec<f64> {
        let (low, high) = if self.sweep_rad < 0.0 {
            (self.start_rad + self.sweep_rad, self.start_rad)
        } else {
            (self.start_rad, self.start_rad + self.sweep_rad)
        };
        let first = ((low - base) / every).ceil();
        let last = ((high - base) / every).floor();
        if last < first || (last - first).is_nan() {
            return Vec::new();
        }
        // Two full ellipses are enough: further angles repeat the same points.
        let count = (last - first).min(2.0 * std::f64::consts::TAU / every) as usize + 1;
        (0..count).map(|k| base + (first + k as f64) * every).collect()
    }
}

/// The linear part of an affine map applied to a vector.
fn apply_linear(map: Affine, v: Vec2) -> Vec2 {
    let [a, b, c, d, _, _] = map.as_coeffs();
    Vec2::new(a * v.x + c * v.y, b * v.x + d * v.y)
}
