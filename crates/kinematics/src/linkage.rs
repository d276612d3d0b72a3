//! A mechanism as points and the parts between them, so that it can be drawn in any pose without
//! knowing its kinematics.

use drawing::{Point, Vec2};

use crate::JointPos;

/// The geometry of a mechanism: points that follow the joints, and the parts between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Linkage {
    /// The points; each depends on the joints and on points before it only.
    pub anchors: Vec<Anchor>,
    /// What is drawn between the points.
    pub parts: Vec<Part>,
    /// Index of the pen's point.
    pub pen: usize,
}

/// A point of a mechanism, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anchor {
    /// It does not move.
    Fixed(Point),
    /// It lies at a distance and in a direction from an earlier point.
    Moving {
        /// Index of that point.
        from: usize,
        /// The distance, mm; negative against the direction.
        length_mm: JointAffine,
        /// The direction, counterclockwise from +x, rad.
        angle_rad: JointAffine,
    },
    /// It lies where two circles about earlier points cross.
    Crossing {
        /// Indices of their centres.
        from: [usize; 2],
        /// Their radii, mm.
        radii_mm: [JointAffine; 2],
        /// Whether it is on the left of the way from the first centre to the second.
        is_left: bool,
    },
}

/// An affine function of the joints: `constant + factors . q`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointAffine {
    /// The value where both joints are 0.
    pub constant: f64,
    /// The factor of each joint.
    pub factors: [f64; 2],
}

impl JointAffine {
    /// The same value in every pose.
    pub const fn fixed(constant: f64) -> Self {
        Self { constant, factors: [0.0; 2] }
    }

    /// The position of one joint.
    pub fn joint(index: usize) -> Self {
        let mut factors = [0.0; 2];
        factors[index] = 1.0;
        Self { constant: 0.0, factors }
    }

    fn at(&self, q: &JointPos) -> f64 {
        self.constant + self.factors[0] * q[0] + self.factors[1] * q[1]
    }
}

/// A part of a mechanism, drawn between two of its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// What it is.
    pub kind: PartKind,
    /// Index of the point where it begins.
    pub from: usize,
    /// Index of the point where it ends; the same for a pivot.
    pub to: usize,
}

/// What a part is, and so how it is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartKind {
    /// A guide on which another part slides.
    Rail,
    /// A link, beam or rack.
    Link,
    /// A bearing or carriage.
    Pivot,
}

impl PartKind {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rail => "rail",
            Self::Link => "link",
            Self::Pivot => "pivot",
        }
    }
}

impl Linkage {
    /// The points in a pose, mm, in the order of the anchors.
    pub fn points(&self, q: &JointPos) -> Vec<Point> {
        let mut points: Vec<Point> = Vec::with_capacity(self.anchors.len());
        for anchor in &self.anchors {
            points.push(match anchor {
                Anchor::Fixed(point) => *point,
                Anchor::Moving { from, length_mm, angle_rad } => {
                    let (sin, cos) = libm::sincos(angle_rad.at(q));
                    points[*from] + length_mm.at(q) * Vec2::new(cos, sin)
                }
                Anchor::Crossing { from, radii_mm, is_left } => {
                    let centers = from.map(|index| points[index]);
                    crossing(centers, radii_mm.each_ref().map(|radius| radius.at(q)), *is_left)
                }
            });
        }
        points
    }
}

/// Where two circles cross, on one side of the way from centre to centre: with `d` the distance of the
/// centres, `a = (r1² - r2² + d²) / (2 d)` along it and `sqrt(r1² - a²)` across. Circles that do not meet
/// give the point between them.
pub(crate) fn crossing([first, second]: [Point; 2], [r1, r2]: [f64; 2], is_left: bool) -> Point {
    let between = second - first;
    let d = between.hypot2().sqrt();
    let along = between / d;
    let a = ((r1 - r2) * (r1 + r2) + d * d) / (2.0 * d);
    let across = ((r1 - a) * (r1 + a)).max(0.0).sqrt();
    let side = if is_left { across } else { -across };
    first + a * along + side * Vec2::new(-along.y, along.x)
}

/// A point at a distance and in a direction from an earlier one.
pub(crate) fn moving(from: usize, length_mm: JointAffine, angle_rad: JointAffine) -> Anchor {
    Anchor::Moving { from, length_mm, angle_rad }
}

/// A part between two points.
pub(crate) fn part(kind: PartKind, from: usize, to: usize) -> Part {
    Part { kind, from, to }
}
