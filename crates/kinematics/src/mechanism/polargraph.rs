//! A pen that hangs from two cords.

use drawing::{Line, Point, Rect, Vec2};

use super::parameters::{FromParameters, ParameterError, Parameters};
use super::{JointKind, Mechanism, Unreachable};
use crate::linkage::{crossing, part};
use crate::{Anchor, JointAffine, JointPos, Linkage, MachineError, PartKind};

/// `q = (l_1, l_2)`, the lengths of the left and the right cord:
///
/// ```text
///   left o-------------o right     u_i = (p - a_i) / l_i          along the cords, away from the anchors
///         \     w     /            sin gamma = u_2 x u_1          the angle at the pen
///       l1 \         / l2          x = (l1² - l2² + w²) / (2 w)   along the way from anchor to anchor
///           \  pen  /              h = sqrt(l1² - x²)             below it
///              \ o /
///
/// l_i'   = u_i.v
/// l_i''  = (v.v - l_i'^2) / l_i + u_i.a
/// l_i''' = 3 (v.a - l_i' l_i'') / l_i + u_i.j
/// Jacobian: u_i . p' = l_i', so dp/dl_1 = n_2 / (u_1.n_2)
/// tension: T_1 = m g sin a_2 / sin gamma, T_2 = m g sin a_1 / sin gamma, a_i: angle of cord i from
///          the vertical
/// ```
/// Singular on the line of the anchors (`gamma = pi`). A cord that does not pull is no joint: the pen
/// stays between the anchors (`sin a_i > 0`). Source: differentiating `|p - a_i| = l_i`; the balance of
/// forces at the pen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polargraph {
    /// The left and the right anchor, where the cords leave their pulleys, mm.
    pub anchors: [Point; 2],
}

impl Polargraph {
    /// Directions of the cords from the anchors to the pen.
    fn cords(&self, q: &JointPos) -> [Vec2; 2] {
        let pen = self.forward(q);
        [(pen - self.anchors[0]) / q[0], (pen - self.anchors[1]) / q[1]]
    }

    /// A bound on the length of the pen's path, mm, while the joints move linearly from one pose to the
    /// other: `|p'|² sin² gamma = l_1'^2 + l_2'^2 - 2 l_1' l_2' cos gamma`. The least `sin gamma` by
    /// Heron's formula: sum and difference of the cords are linear, extreme at the ends. `None` where
    /// gamma may be 0 or pi on the way.
    fn pen_travel(&self, from: &JointPos, to: &JointPos) -> Option<f64> {
        let w = (self.anchors[1] - self.anchors[0]).hypot2().sqrt();
        let sum = (from[0] + from[1]).min(to[0] + to[1]);
        let difference = (from[0] - from[1]).abs().max((to[0] - to[1]).abs());
        if sum <= w || difference >= w || from[0].min(to[0]) <= 0.0 || from[1].min(to[1]) <= 0.0 {
            return None;
        }
        let longest = [from[0].max(to[0]), from[1].max(to[1])];
        let factors = (sum - w) * (sum + w) * (w - difference) * (w + difference);
        let sin = (factors.sqrt() / (2.0 * longest[0] * longest[1])).min(1.0);
        let change = (*to - *from).abs();
        Some((change[0] + change[1]) / sin)
    }

    /// The angle at the pen and those of the cords from the vertical, as sines.
    fn sines(&self, q: &JointPos) -> [f64; 3] {
        let [first, second] = self.cords(q);
        [second.cross(first), first.x, -second.x]
    }
}

impl Mechanism for Polargraph {
    fn kind(&self) -> &'static str {
        Self::KIND
    }

    fn joint_names(&self) -> [&'static str; 2] {
        ["left", "right"]
    }

    fn joint_kinds(&self) -> [JointKind; 2] {
        [JointKind::Prismatic; 2]
    }

    fn validate(&self) -> Result<(), MachineError> {
        let [left, right] = self.anchors;
        for (name, anchor) in [("left", left), ("right", right)] {
            if !anchor.is_finite() {
                return Err(MachineError::NotFinite { quantity: name.into() });
            }
        }
        if left.x < right.x {
            return Ok(());
        }
        Err(MachineError::Dimensions { why: "the left anchor must be on the left of the right one" })
    }

    fn forward(&self, q: &JointPos) -> Point {
        crossing(self.anchors, q.0, false)
    }

    /// # Errors
    /// Where a cord would be slack: beside the anchors, and above the line between them.
    fn inverse(&self, p: Point) -> Result<JointPos, Unreachable> {
        let [first, second] = self.anchors.map(|anchor| p - anchor);
        let between = self.anchors[1] - self.anchors[0];
        let below = first.cross(between) / between.hypot2().sqrt();
        let slack = (-below).max(-first.x).max(second.x);
        if slack >= 0.0 {
            return Err(Unreachable::Slack(slack));
        }
        Ok(JointPos::new(first.hypot2().sqrt(), second.hypot2().sqrt()))
    }

    fn jacobian(&self, q: &JointPos) -> [Vec2; 2] {
        let [first, second] = self.cords(q);
        let column = |cord: Vec2, other: Vec2| {
            let normal = Vec2::new(-other.y, other.x);
            normal / cord.dot(normal)
        };
        [column(first, second), column(second, first)]
    }

    fn path_derivatives(&self, q: &JointPos, first: Vec2, second: Vec2) -> (JointPos, JointPos) {
        let cords = self.cords(q);
        let rates = cords.map(|cord| cord.dot(first));
        // |v|² - l'^2 without cancellation: the part of v across the cord.
        let across = cords.map(|cord| cord.cross(first));
        let turn = |k: usize| across[k] * across[k] / q[k] + cords[k].dot(second);
        (JointPos(rates), JointPos::new(turn(0), turn(1)))
    }

    fn path_third_derivative(&self, q: &JointPos, first: Vec2, second: Vec2, third: Vec2) -> JointPos {
        let cords = self.cords(q);
        let (rates, turns) = self.path_derivatives(q, first, second);
        let of = |k: usize| 3.0 * (first.dot(second) - rates[k] * turns[k]) / q[k] + cords[k].dot(third);
        JointPos::new(of(0), of(1))
    }

    /// `u_i.p'' = -(|p'|² - l_i'^2) / l_i` and `|p'| <= (|l_1'| + |l_2'|) / sin gamma`.
    fn second_derivative_bound(&self, from: &JointPos, to: &JointPos) -> f64 {
        let Some(speed) = self.pen_travel(from, to) else { return f64::INFINITY };
        let shortest = [from[0].min(to[0]), from[1].min(to[1])];
        let sin = (*to - *from).abs();
        let sin = if speed > 0.0 { (sin[0] + sin[1]) / speed } else { 1.0 };
        speed * speed * (1.0 / shortest[0] + 1.0 / shortest[1]) / sin
    }

    /// The least of sin gamma and the sines of both cords' angles from the vertical.
    fn manipulability(&self, q: &JointPos) -> f64 {
        self.sines(q).into_iter().fold(1.0, f64::min).max(0.0)
    }

    /// Both cords pull with a tenth of the pen's weight at least.
    fn default_min_manipulability(&self) -> f64 {
        0.1
    }

    fn full_rotation(&self) -> Option<JointPos> {
        None
    }

    fn base(&self) -> Option<Point> {
        None
    }

    fn center(&self) -> Point {
        self.anchors[0].midpoint(self.anchors[1])
    }

    /// Per mm of the pen a cord turns by at most `1 / l_i`, which doubles at most within half the
    /// length of the shorter cord.
    fn clearance_mm(&self, q: &JointPos, least: f64) -> f64 {
        let margin = self.manipulability(q) - least;
        (0.5 * q[0].min(q[1])).min(margin / (2.0 / q[0] + 2.0 / q[1]))
    }

    /// The pen stays within the clearance of one of the ends, each over half of its path.
    fn stays_regular(&self, from: &JointPos, to: &JointPos) -> bool {
        let mut pending = vec![(*from, *to, 0)];
        while let Some((from, to, depth)) = pending.pop() {
            let clearance = self.clearance_mm(&from, 0.0).min(self.clearance_mm(&to, 0.0));
            if clearance <= 0.0 || depth > 12 {
                return false;
            }
            if self.pen_travel(&from, &to).is_none_or(|travel| 0.5 * travel >= clearance) {
                let middle = from + (to - from) * 0.5;
                pending.extend([(from, middle, depth + 1), (middle, to, depth + 1)]);
            }
        }
        true
    }

    fn is_linear(&self) -> bool {
        false
    }

    /// The feet of the perpendiculars from both anchors.
    fn joint_extrema_on_line(&self, line: &Line) -> Vec<f64> {
        let along = line.p1 - line.p0;
        self.anchors.map(|anchor| (anchor - line.p0).dot(along) / along.hypot2()).into()
    }

    fn linkage(&self, _sheet: Rect) -> Linkage {
        let [left, right] = self.anchors;
        let anchors = vec![
            Anchor::Fixed(left),
            Anchor::Fixed(right),
            Anchor::Crossing {
                from: [0, 1],
                radii_mm: [JointAffine::joint(0), JointAffine::joint(1)],
                is_left: false,
            },
        ];
        let parts = vec![
            part(PartKind::Rail, 0, 2),
            part(PartKind::Rail, 1, 2),
            part(PartKind::Pivot, 0, 0),
            part(PartKind::Pivot, 1, 1),
        ];
        Linkage { anchors, parts, pen: 2 }
    }

    /// Down to one and a half times the distance of the anchors: the cords have no longest length of
    /// their own.
    fn reach_box(&self) -> Option<Rect> {
        let [left, right] = self.anchors;
        let top = left.y.max(right.y);
        Some(Rect::new(left.x, left.y.min(right.y) - 1.5 * (right.x - left.x), right.x, top))
    }
}

impl FromParameters for Polargraph {
    const KIND: &'static str = "polargraph";
    const PARAMETERS: &'static [&'static str] = &["left", "right"];

    fn from_parameters(parameters: &mut dyn Parameters) -> Result<Self, ParameterError> {
        Ok(Self { anchors: [parameters.point_mm("left")?, parameters.point_mm("right")?] })
    }
}
