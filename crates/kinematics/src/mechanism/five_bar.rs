//! Two arms on two bases that hold one pen between them.

use drawing::{Line, Point, Rect, Vec2};

use super::parameters::{FromParameters, ParameterError, Parameters};
use super::two_link::perpendicular_distal;
use super::{JointKind, Mechanism, Unreachable, frame};
use crate::linkage::{crossing, moving, part};
use crate::{Anchor, JointAffine, JointPos, Linkage, MachineError, Part, PartKind};

/// `q = (theta1, theta2)`, the absolute angles of the two proximal links:
///
/// ```text
///          pen
///       D1 /  \ D2            E_i = b_i + P_i e(theta_i)           the elbows
///         /    \              p   = E_i + D_i u_i                  u_i: unit vectors
///     E1 o      o E2          sin beta_i = t(theta_i).u_i          the fold at an elbow
///     P1 |      | P2          sin gamma  = u_1 x u_2               the angle at the pen
///   base1 o    o base2
///
/// inverse: two planar arms about b_1 and b_2, each with its elbow on its own side (working mode)
/// forward: the circles about E_1 and E_2; the pen is left or right of the way from E_1 to E_2
///          (assembly mode). With d = |E_2 - E_1| and a = (D1² - D2² + d²) / (2 d):
///          p = E_1 + a (E_2 - E_1) / d +- sqrt(D1² - a²) n
/// theta_i' = v.u_i / (P_i sin beta_i), psi_i' = -v.e(theta_i) / (D_i sin beta_i)
/// theta_i'', theta_i''': those of the planar arm, see `TwoLink`
/// Jacobian: u_i . p' = P_i sin beta_i theta_i', so dp/dtheta_1 = P_1 sin beta_1 n_2 / (u_1.n_2)
/// ```
/// Singular where an arm is stretched or folded (`sin beta_i = 0`, type 1: the pen cannot move along
/// that arm), and where both distal links are in line (`sin gamma = 0`, type 2: the motors cannot hold
/// the pen, the machine gives way). Both bases may be on one axis. The pen may not cross the line
/// between the bases, about whose ends the two arms would turn in opposite senses.
///
/// Source: Gosselin and Angeles (docs/references.md) for the two types of singular poses; the
/// derivatives by differentiating `|p - E_i|² = D_i²` (the tests compare them with finite
/// differences).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FiveBar {
    /// The two bases, mm.
    pub bases: [Point; 2],
    /// Lengths of the links from the bases to the elbows, mm.
    pub proximal_mm: [f64; 2],
    /// Lengths of the links from the elbows to the pen, mm.
    pub distal_mm: [f64; 2],
    /// For each arm, whether its elbow is on the left of the line from its base to the pen.
    pub elbow_left: [bool; 2],
    /// Whether the pen is on the left of the way from elbow 1 to elbow 2.
    pub pen_left: bool,
}

/// One of the two arms in a pose.
#[derive(Clone, Copy)]
struct Arm {
    proximal: f64,
    distal: f64,
    /// Direction of the proximal link.
    e: Vec2,
    /// Direction of the distal link.
    u: Vec2,
    /// Sine and cosine of the fold at the elbow.
    sin: f64,
    cos: f64,
}

/// First, second (and third) derivatives of the angles of an arm's two links.
struct Rates {
    theta: [f64; 2],
    psi: [f64; 2],
}

impl Arm {
    fn rates(&self, first: Vec2, second: Vec2) -> Rates {
        let Self { proximal, distal, e, u, sin, cos, .. } = *self;
        let theta_1 = first.dot(u) / (proximal * sin);
        let psi_1 = -first.dot(e) / (distal * sin);
        let (w1, w2) = (proximal * theta_1 * theta_1, distal * psi_1 * psi_1);
        let theta_2 = (second.dot(u) + w1 * cos + w2) / (proximal * sin);
        let psi_2 = -(second.dot(e) + w1 + w2 * cos) / (distal * sin);
        Rates { theta: [theta_1, theta_2], psi: [psi_1, psi_2] }
    }

    fn third(&self, first: Vec2, second: Vec2, third: Vec2) -> f64 {
        let Rates { theta, psi } = self.rates(first, second);
        let w1 = 3.0 * self.proximal * theta[0] * theta[1];
        let w2 = 3.0 * self.distal * psi[0] * psi[1];
        (third.dot(self.u) + w1 * self.cos + w2) / (self.proximal * self.sin) + theta[0] * theta[0] * theta[0]
    }
}

impl FiveBar {
    fn elbow(&self, arm: usize, angle: f64) -> Point {
        self.bases[arm] + self.proximal_mm[arm] * frame(angle).0
    }

    /// Where the pen is with the elbows there. Elbows too far apart or too close for the distal links
    /// give the nearest pose in which these are in line.
    fn pen(&self, elbows: [Point; 2]) -> Point {
        crossing(elbows, self.distal_mm, self.pen_left)
    }

    fn arms(&self, q: &JointPos) -> [Arm; 2] {
        let frames = [frame(q[0]), frame(q[1])];
        let elbow = |k: usize| self.bases[k] + self.proximal_mm[k] * frames[k].0;
        let elbows = [elbow(0), elbow(1)];
        let pen = self.pen(elbows);
        [0, 1].map(|k| {
            let ((e, t), distal) = (frames[k], self.distal_mm[k]);
            let u = (pen - elbows[k]) / distal;
            Arm { proximal: self.proximal_mm[k], distal, e, u, sin: t.dot(u), cos: e.dot(u) }
        })
    }

    /// |sin gamma| for the least and the greatest distance of the elbows: its least value between, as
    /// it has one maximum. `None` where the distal links do not span the distance.
    fn least_sin_at_pen(&self, least: f64, greatest: f64) -> Option<f64> {
        let [d1, d2] = self.distal_mm;
        if least <= (d1 - d2).abs() || greatest >= d1 + d2 {
            return None;
        }
        let sin = |d: f64| {
            let factors = (d1 + d2 - d) * (d1 + d2 + d) * (d - (d1 - d2)) * (d + (d1 - d2));
            factors.sqrt() / (2.0 * d1 * d2)
        };
        Some(sin(least).min(sin(greatest)))
    }

    /// By how much the elbows move while the joints go from one pose to the other, and the least
    /// |sin gamma| on the way: `d` changes by at most that much, from either end.
    fn sweep(&self, from: &JointPos, to: &JointPos) -> Option<Sweep> {
        let change = (*to - *from).abs();
        let moved = [self.proximal_mm[0] * change[0], self.proximal_mm[1] * change[1]];
        let total = moved[0] + moved[1];
        let distance = |q: &JointPos| {
            let between = self.elbow(1, q[1]) - self.elbow(0, q[0]);
            between.hypot2().sqrt()
        };
        let (a, b) = (distance(from), distance(to));
        let least = (0.5 * (a + b - total)).min(a.min(b));
        let greatest = (0.5 * (a + b + total)).max(a.max(b));
        let sin = self.least_sin_at_pen(least, greatest)?;
        Some(Sweep { change, moved, total, sin })
    }

    /// The angle from one base to the other seen from the pen, rad: -pi to pi.
    fn angle_between_bases(&self, p: Point) -> f64 {
        let [first, second] = self.bases.map(|base| p - base);
        libm::atan2(first.cross(second), first.dot(second))
    }
}

/// See [`FiveBar::sweep`].
struct Sweep {
    /// Of the joints, rad.
    change: JointPos,
    /// Of the elbows, mm, and their sum.
    moved: [f64; 2],
    total: f64,
    /// The least |sin gamma|.
    sin: f64,
}

impl Mechanism for FiveBar {
    fn kind(&self) -> &'static str {
        Self::KIND
    }

    fn joint_names(&self) -> [&'static str; 2] {
        ["theta1", "theta2"]
    }

    fn joint_kinds(&self) -> [JointKind; 2] {
        [JointKind::Revolute; 2]
    }

    fn validate(&self) -> Result<(), MachineError> {
        for (name, length_mm) in [
            ("proximal1", self.proximal_mm[0]),
            ("proximal2", self.proximal_mm[1]),
            ("distal1", self.distal_mm[0]),
            ("distal2", self.distal_mm[1]),
        ] {
            MachineError::require_positive(name, length_mm)?;
        }
        for (name, base) in [("base1", self.bases[0]), ("base2", self.bases[1])] {
            if !base.is_finite() {
                return Err(MachineError::NotFinite { quantity: name.into() });
            }
        }
        Ok(())
    }

    fn forward(&self, q: &JointPos) -> Point {
        self.pen([self.elbow(0, q[0]), self.elbow(1, q[1])])
    }

    /// The first angle is a principal value. The second is that of the same turn: both change by a full
    /// rotation when the pen goes around both bases.
    fn inverse(&self, p: Point) -> Result<JointPos, Unreachable> {
        let mut directions = [Vec2::ZERO; 2];
        let mut turned = [0.0; 2];
        for k in 0..2 {
            let (l1, l2) = (self.proximal_mm[k], self.distal_mm[k]);
            let to_pen = p - self.bases[k];
            let square = to_pen.hypot2();
            let r = square.sqrt();
            let (farthest, nearest) = (l1 + l2, (l1 - l2).abs());
            if r > farthest {
                return Err(Unreachable::TooFar(r - farthest));
            }
            if r < nearest || r == 0.0 {
                return Err(Unreachable::TooNear(nearest - r));
            }
            // The elbow in the frame whose first axis points to the pen: (a, b), as its distances from
            // the base and the pen are l1 and l2.
            let a = (square + (l1 - l2) * (l1 + l2)) / (2.0 * r);
            let factors = (farthest - r) * (farthest + r) * (r - nearest) * (r + nearest);
            let b = factors.max(0.0).sqrt() / (2.0 * r);
            let b = if self.elbow_left[k] { b } else { -b };
            directions[k] = Vec2::new(to_pen.x * a - to_pen.y * b, to_pen.y * a + to_pen.x * b) / r;
            turned[k] = libm::atan2(b, a);
        }
        let [first, second] = directions;
        let (e1, e2) = (self.bases[0] + first, self.bases[1] + second);
        let side = (e2 - e1).cross(p - e1);
        if side == 0.0 || (side > 0.0) != self.pen_left {
            return Err(Unreachable::OtherAssembly);
        }
        let theta_1 = libm::atan2(first.y, first.x);
        let theta_2 = theta_1 - turned[0] + self.angle_between_bases(p) + turned[1];
        Ok(JointPos::new(theta_1, theta_2))
    }

    fn jacobian(&self, q: &JointPos) -> [Vec2; 2] {
        let [first, second] = self.arms(q);
        let column = |arm: &Arm, other: &Arm| {
            let normal = Vec2::new(-other.u.y, other.u.x);
            arm.proximal * arm.sin / arm.u.dot(normal) * normal
        };
        [column(&first, &second), column(&second, &first)]
    }

    fn path_derivatives(&self, q: &JointPos, first: Vec2, second: Vec2) -> (JointPos, JointPos) {
        let [a, b] = self.arms(q).map(|arm| arm.rates(first, second).theta);
        (JointPos::new(a[0], b[0]), JointPos::new(a[1], b[1]))
    }

    fn path_third_derivative(&self, q: &JointPos, first: Vec2, second: Vec2, third: Vec2) -> JointPos {
        JointPos(self.arms(q).map(|arm| arm.third(first, second, third)))
    }

    /// `u_i.p'' = u_i.E_i'' - |p' - E_i'|² / D_i` with `|E_i''| = P_i theta_i'^2` and
    /// `|p' - E_i'| <= |E_1' - E_2'| / sin gamma`, so `|p''|` is at most the sum of both right sides
    /// over the least `sin gamma`. Infinite where that may be 0.
    fn second_derivative_bound(&self, from: &JointPos, to: &JointPos) -> f64 {
        let Some(Sweep { change, moved, total, sin }) = self.sweep(from, to) else { return f64::INFINITY };
        let relative = total / sin;
        let side = |k: usize| moved[k] * change[k] + relative * relative / self.distal_mm[k];
        (side(0) + side(1)) / sin
    }

    /// The least of |sin beta1|, |sin beta2| and |sin gamma|.
    fn manipulability(&self, q: &JointPos) -> f64 {
        let [first, second] = self.arms(q);
        first.sin.abs().min(second.sin.abs()).min(first.u.cross(second.u).abs()).min(1.0)
    }

    /// As for the planar arm, which each half is.
    fn default_min_manipulability(&self) -> f64 {
        0.1
    }

    fn full_rotation(&self) -> Option<JointPos> {
        Some(JointPos::new(std::f64::consts::TAU, std::f64::consts::TAU))
    }

    fn base(&self) -> Option<Point> {
        None
    }

    fn center(&self) -> Point {
        self.bases[0].midpoint(self.bases[1])
    }

    /// Per mm of the pen, `beta_i` turns by at most `(1/P_i + 1/D_i) / |sin beta_i|`, so `sin² beta_i`
    /// changes by at most `2 (1/P_i + 1/D_i)`; and gamma by at most the sum of
    /// `1 / (D_i |sin beta_i|)`, `sin² gamma` by at most that.
    fn clearance_mm(&self, q: &JointPos, least: f64) -> f64 {
        let arms = self.arms(q);
        let least = least * least;
        let folds = arms.each_ref().map(|arm| {
            let square = arm.sin * arm.sin;
            ((square - least) / (2.0 * (1.0 / arm.proximal + 1.0 / arm.distal)), square)
        });
        // Within half the clearance of the folds, sin² beta_i loses at most half of its excess.
        let rate = |k: usize| 1.0 / (self.distal_mm[k] * (0.5 * (folds[k].1 + least)).sqrt());
        let sin = arms[0].u.cross(arms[1].u);
        let at_pen = (sin * sin - least) / (rate(0) + rate(1));
        let pen = self.forward(q);
        let bases = Line::new(self.bases[0], self.bases[1]);
        (0.5 * folds[0].0.min(folds[1].0)).min(at_pen).min(distance_to(&bases, pen))
    }

    /// The distance of the elbows bounds gamma; `|psi_i'| <= |E_1' - E_2'| / (D_i sin gamma)` then
    /// bounds the folds.
    fn stays_regular(&self, from: &JointPos, to: &JointPos) -> bool {
        let mut pending = vec![(*from, *to, 0)];
        while let Some((from, to, depth)) = pending.pop() {
            let fold = |q: &JointPos| self.arms(q).map(|arm| libm::atan2(arm.sin, arm.cos));
            let (before, after) = (fold(&from), fold(&to));
            let left = self.elbow_left;
            // sin beta < 0 for an elbow on the left.
            if (0..2).any(|k| (before[k] < 0.0) != left[k] || (after[k] < 0.0) != left[k]) {
                return false;
            }
            let regular = self.sweep(&from, &to).is_some_and(|sweep| {
                (0..2).all(|k| {
                    let turn = sweep.change[k] + sweep.total / (self.distal_mm[k] * sweep.sin);
                    let margin = |beta: f64| beta.abs().min(std::f64::consts::PI - beta.abs());
                    // From whichever end is nearer, at most half of the turn.
                    0.5 * turn < margin(before[k]).min(margin(after[k]))
                })
            });
            if regular {
                continue;
            }
            if depth > 12 {
                return false;
            }
            let middle = from + (to - from) * 0.5;
            pending.extend([(from, middle, depth + 1), (middle, to, depth + 1)]);
        }
        true
    }

    fn is_linear(&self) -> bool {
        false
    }

    /// `theta_i' = 0` where the distal link is perpendicular to the line.
    fn joint_extrema_on_line(&self, line: &Line) -> Vec<f64> {
        let mut extrema = Vec::with_capacity(8);
        for k in 0..2 {
            let line = Line::new(line.p0 - self.bases[k].to_vec2(), line.p1 - self.bases[k].to_vec2());
            extrema.extend(perpendicular_distal(&line, self.proximal_mm[k], self.distal_mm[k]));
        }
        extrema
    }

    fn linkage(&self, _sheet: Rect) -> Linkage {
        let [b1, b2] = self.bases;
        let [p1, p2] = self.proximal_mm.map(JointAffine::fixed);
        let anchors = vec![
            Anchor::Fixed(b1),
            Anchor::Fixed(b2),
            moving(0, p1, JointAffine::joint(0)),
            moving(1, p2, JointAffine::joint(1)),
            Anchor::Crossing {
                from: [2, 3],
                radii_mm: self.distal_mm.map(JointAffine::fixed),
                is_left: self.pen_left,
            },
        ];
        let links = [(0, 2), (1, 3), (2, 4), (3, 4)];
        let mut parts: Vec<Part> = links.map(|(from, to)| part(PartKind::Link, from, to)).into();
        parts.extend((0..4).map(|pivot| part(PartKind::Pivot, pivot, pivot)));
        Linkage { anchors, parts, pen: 4 }
    }

    fn reach_box(&self) -> Option<Rect> {
        let around = |k: usize| {
            let r = self.proximal_mm[k] + self.distal_mm[k];
            Rect::from_center_size(self.bases[k], (2.0 * r, 2.0 * r))
        };
        Some(around(0).intersect(around(1)))
    }
}

/// The distance of a point from a line, which may be a single point, mm.
fn distance_to(line: &Line, p: Point) -> f64 {
    let along = line.p1 - line.p0;
    let t = (p - line.p0).dot(along) / along.hypot2();
    let t = if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 };
    (p - (line.p0 + t * along)).hypot2().sqrt()
}

impl FromParameters for FiveBar {
    const KIND: &'static str = "five-bar";
    const PARAMETERS: &'static [&'static str] =
        &["base1", "base2", "proximal1", "proximal2", "distal1", "distal2", "elbow1", "elbow2", "pen"];

    fn from_parameters(parameters: &mut dyn Parameters) -> Result<Self, ParameterError> {
        let sides = &["left", "right"];
        Ok(Self {
            bases: [parameters.point_mm("base1")?, parameters.point_mm("base2")?],
            proximal_mm: [parameters.length_mm("proximal1")?, parameters.length_mm("proximal2")?],
            distal_mm: [parameters.length_mm("distal1")?, parameters.length_mm("distal2")?],
            elbow_left: [parameters.choice("elbow1", sides)? == 0, parameters.choice("elbow2", sides)? == 0],
            pen_left: parameters.choice("pen", sides)? == 0,
        })
    }
}
