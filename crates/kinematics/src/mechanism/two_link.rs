//! A planar arm of two links.

use drawing::{Line, Point, Rect, Vec2};

use super::parameters::{FromParameters, ParameterError, Parameters};
use super::{JointKind, Mechanism, Unreachable, frame};
use crate::linkage::{moving, part};
use crate::{Anchor, JointAffine, JointPos, Linkage, MachineError, PartKind};

/// `q = (theta, psi)`, the **absolute** angles of the first and second link:
///
/// ```text
///            elbow
///              o
///     L1    /     \   L2                p = L1 e(theta) + L2 e(psi)
///        /           \                  beta = psi - theta, the fold at the elbow
///   base o             pen
///
/// r² = x² + y²,  cos beta = (r² - L1² - L2²) / (2 L1 L2),  sin beta = -+ sqrt(1 - cos² beta)
/// theta = atan2(y, x) - atan2(L2 sin beta, L1 + L2 cos beta),  psi = theta + beta
/// det J = L1 L2 sin beta
/// theta' =  v.e(psi)   / (L1 sin beta)
/// psi'   = -v.e(theta) / (L2 sin beta)
/// theta'' =  (a.e(psi)   + L1 theta'^2 cos beta + L2 psi'^2) / (L1 sin beta)
/// psi''   = -(a.e(theta) + L1 theta'^2 + L2 psi'^2 cos beta) / (L2 sin beta)
/// with u = 3 L1 theta' theta'' and w = 3 L2 psi' psi'':
/// theta''' =  (j.e(psi)   + u cos beta + w) / (L1 sin beta) + theta'^3
/// psi'''   = -(j.e(theta) + u + w cos beta) / (L2 sin beta) + psi'^3
/// ```
/// The elbow on the left of the line from base to pen means beta < 0. Singular when stretched or
/// folded (beta = 0 or pi). Source: the report of the coaxial arm (docs/references.md) for the position;
/// the derivatives by differentiating `p` and solving for the joints (the tests compare them with finite
/// differences).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoLink {
    /// Length of the first link, mm.
    pub l1_mm: f64,
    /// Length of the second link, mm.
    pub l2_mm: f64,
    /// Whether the elbow is on the left of the line from base to pen, seen along it.
    pub elbow_left: bool,
}

impl Mechanism for TwoLink {
    fn kind(&self) -> &'static str {
        Self::KIND
    }

    fn joint_names(&self) -> [&'static str; 2] {
        ["theta", "psi"]
    }

    fn joint_kinds(&self) -> [JointKind; 2] {
        [JointKind::Revolute; 2]
    }

    fn validate(&self) -> Result<(), MachineError> {
        MachineError::require_positive("l1", self.l1_mm)?;
        MachineError::require_positive("l2", self.l2_mm)
    }

    fn forward(&self, q: &JointPos) -> Point {
        (self.l1_mm * frame(q[0]).0 + self.l2_mm * frame(q[1]).0).to_point()
    }

    fn inverse(&self, p: Point) -> Result<JointPos, Unreachable> {
        let Self { l1_mm: l1, l2_mm: l2, elbow_left } = *self;
        let r = libm::hypot(p.x, p.y);
        let (farthest, nearest) = (l1 + l2, (l1 - l2).abs());
        if r > farthest {
            return Err(Unreachable::TooFar(r - farthest));
        }
        if r < nearest || r == 0.0 {
            return Err(Unreachable::TooNear(nearest - r));
        }
        let cos = ((r * r - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)).clamp(-1.0, 1.0);
        // 1 - cos² by factors: no cancellation near the stretched pose.
        let factors = (farthest - r) * (farthest + r) * (r - nearest) * (r + nearest);
        let size = factors.max(0.0).sqrt() / (2.0 * l1 * l2);
        let sin = if elbow_left { -size } else { size };
        // theta is the direction of p minus that of (a, b), psi the direction from the elbow to p: two
        // arctangents where the formula above has three.
        let (a, b) = (l1 + l2 * cos, l2 * sin);
        let first = Vec2::new(p.x * a + p.y * b, p.y * a - p.x * b);
        let elbow = l1 / first.hypot2().sqrt() * first;
        let theta = libm::atan2(first.y, first.x);
        let psi = libm::atan2(p.y - elbow.y, p.x - elbow.x);
        // The sign of beta is that of the elbow's side.
        let turn = std::f64::consts::TAU;
        let psi = match (elbow_left, psi > theta) {
            (true, true) => psi - turn,
            (false, false) => psi + turn,
            _ => psi,
        };
        Ok(JointPos::new(theta, psi))
    }

    fn jacobian(&self, q: &JointPos) -> [Vec2; 2] {
        let [t1, t2] = [self.l1_mm * frame(q[0]).1, self.l2_mm * frame(q[1]).1];
        [t1, t2]
    }

    fn path_derivatives(&self, q: &JointPos, first: Vec2, second: Vec2) -> (JointPos, JointPos) {
        let Self { l1_mm: l1, l2_mm: l2, .. } = *self;
        let ((e1, t1), (e2, _)) = (frame(q[0]), frame(q[1]));
        // sin and cos of beta from the two directions.
        let (sin, cos) = (t1.dot(e2), e1.dot(e2));
        let theta_1 = first.dot(e2) / (l1 * sin);
        let psi_1 = -first.dot(e1) / (l2 * sin);
        let (w1, w2) = (l1 * theta_1 * theta_1, l2 * psi_1 * psi_1);
        let theta_2 = (second.dot(e2) + w1 * cos + w2) / (l1 * sin);
        let psi_2 = -(second.dot(e1) + w1 + w2 * cos) / (l2 * sin);
        (JointPos::new(theta_1, psi_1), JointPos::new(theta_2, psi_2))
    }

    fn path_third_derivative(&self, q: &JointPos, first: Vec2, second: Vec2, third: Vec2) -> JointPos {
        let Self { l1_mm: l1, l2_mm: l2, .. } = *self;
        let ((e1, t1), (e2, _)) = (frame(q[0]), frame(q[1]));
        let (sin, cos) = (t1.dot(e2), e1.dot(e2));
        let (rates, turns) = self.path_derivatives(q, first, second);
        let (u, w) = (3.0 * l1 * rates[0] * turns[0], 3.0 * l2 * rates[1] * turns[1]);
        let cube = |rate: f64| rate * rate * rate;
        let theta_3 = (third.dot(e2) + u * cos + w) / (l1 * sin) + cube(rates[0]);
        let psi_3 = -(third.dot(e1) + u + w * cos) / (l2 * sin) + cube(rates[1]);
        JointPos::new(theta_3, psi_3)
    }

    /// d²p/du² = -L1 theta'^2 e(theta) - L2 psi'^2 e(psi).
    fn second_derivative_bound(&self, from: &JointPos, to: &JointPos) -> f64 {
        let change = *to - *from;
        self.l1_mm * change[0] * change[0] + self.l2_mm * change[1] * change[1]
    }

    /// |sin beta|.
    fn manipulability(&self, q: &JointPos) -> f64 {
        libm::sin(q[1] - q[0]).abs()
    }

    /// The joints turn at most ten times as fast as they need to elsewhere.
    fn default_min_manipulability(&self) -> f64 {
        0.1
    }

    fn full_rotation(&self) -> Option<JointPos> {
        Some(JointPos::new(std::f64::consts::TAU, std::f64::consts::TAU))
    }

    fn base(&self) -> Option<Point> {
        Some(Point::ZERO)
    }

    fn is_linear(&self) -> bool {
        false
    }

    /// Base, elbow and pen with the links between them.
    fn linkage(&self, _sheet: Rect) -> Linkage {
        let anchors = vec![
            Anchor::Fixed(Point::ZERO),
            moving(0, JointAffine::fixed(self.l1_mm), JointAffine::joint(0)),
            moving(1, JointAffine::fixed(self.l2_mm), JointAffine::joint(1)),
        ];
        let parts = vec![
            part(PartKind::Link, 0, 1),
            part(PartKind::Link, 1, 2),
            part(PartKind::Pivot, 0, 0),
            part(PartKind::Pivot, 1, 1),
        ];
        Linkage { anchors, parts, pen: 2 }
    }

    fn as_two_link(&self) -> Option<&TwoLink> {
        Some(self)
    }

    /// theta' = 0 where the second link is perpendicular to the line, psi' = 0 where the first is (see
    /// the derivatives above). With n the line's normal at distance d from the base: in the first case
    /// the elbow is at the distance d -+ L2 along n and on the circle about the base; in the second it
    /// is at +-L1 n, and the pen on the circle about it.
    fn joint_extrema_on_line(&self, line: &Line) -> Vec<f64> {
        let mut extrema = Vec::with_capacity(8);
        extrema.extend(perpendicular_distal(line, self.l1_mm, self.l2_mm));
        extrema.extend(perpendicular_distal(line, self.l2_mm, self.l1_mm));
        extrema
    }

    fn reach_box(&self) -> Option<Rect> {
        let reach = self.l1_mm + self.l2_mm;
        Some(Rect::from_center_size(Point::ZERO, (2.0 * reach, 2.0 * reach)))
    }
}

/// Where the distal link is perpendicular to a line on which the pen is, as parameters of the line: the
/// elbow, at the distance `d -+ distal` along its normal, is on the circle of `proximal` about the origin.
pub(super) fn perpendicular_distal(
    line: &Line,
    proximal: f64,
    distal: f64,
) -> impl Iterator<Item = f64> + use<> {
    let along = line.p1 - line.p0;
    let length = along.hypot2().sqrt();
    let u = along / length;
    let (start, d) = (line.p0.to_vec2().dot(u), line.p0.to_vec2().dot(Vec2::new(-u.y, u.x)));
    [d - distal, d + distal]
        .into_iter()
        .map(move |offset| proximal * proximal - offset * offset)
        .filter(|square| *square >= 0.0)
        .flat_map(move |square| [-square.sqrt(), square.sqrt()].map(|x| (x - start) / length))
}

impl FromParameters for TwoLink {
    const KIND: &'static str = "two-link";
    const PARAMETERS: &'static [&'static str] = &["l1", "l2", "elbow"];

    fn from_parameters(parameters: &mut dyn Parameters) -> Result<Self, ParameterError> {
        Ok(Self {
            l1_mm: parameters.length_mm("l1")?,
            l2_mm: parameters.length_mm("l2")?,
            elbow_left: parameters.choice("elbow", &["left", "right"])? == 0,
        })
    }
}
