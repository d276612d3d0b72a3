//! Which points and which segments a machine can draw.

use drawing::{Line, Point, Segment};

use crate::{JointKind, JointPos, JointRange, Machine, Unreachable};

/// Why the pen cannot draw at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// Beyond the reach by this many mm.
    TooFar(f64),
    /// Nearer to the base than the arm can fold, by this many mm.
    TooNear(f64),
    /// A joint would leave its range.
    JointLimit {
        /// The joint's name.
        joint: &'static str,
        /// Whether the values are rad or mm.
        kind: JointKind,
        /// The value it would take.
        value: f64,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// Too close to a singular pose, in which the pen cannot move in every direction: a stretched or
    /// folded arm, the pole of a polar machine.
    Singular {
        /// See [`crate::Mechanism::manipulability`].
        manipulability: f64,
        /// The smallest value that the machine allows.
        min: f64,
    },
    /// The pen would be on the other side of the elbows: another assembly mode of a five-bar.
    OtherAssembly,
    /// A cord would not pull: beside or above its anchors, by this many mm.
    Slack(f64),
    /// The line passes between the bases of a five-bar.
    BetweenBases,
}

impl From<Unreachable> for Fault {
    fn from(unreachable: Unreachable) -> Self {
        match unreachable {
            Unreachable::TooFar(by) => Self::TooFar(by),
            Unreachable::TooNear(by) => Self::TooNear(by),
            Unreachable::OtherAssembly => Self::OtherAssembly,
            Unreachable::Slack(by) => Self::Slack(by),
        }
    }
}

impl std::error::Error for Fault {}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::TooFar(by) if by < 0.005 => {
                write!(f, "it is at the edge of the machine's reach, where the arm is stretched")
            }
            Self::TooNear(by) if by < 0.005 => write!(
                f,
                "the arm would have to fold completely, so that no line can pass through this point"
            ),
            Self::TooFar(by) => write!(f, "it is {} mm beyond the machine's reach", readable(by)),
            Self::TooNear(by) => write!(f, "it is {by:.2} mm too near to the machine's base"),
            Self::OtherAssembly => {
                write!(
                    f,
                    "the pen would be on the other side of the line between the elbows (pen in [geometry])"
                )
            }
            Self::Slack(by) => write!(f, "a cord would be slack: it is {by:.2} mm beyond the anchors"),
            Self::BetweenBases => write!(f, "the line passes between the bases"),
            Self::JointLimit { joint, kind, value, min, max } => {
                let (scale, unit) = match kind {
                    JointKind::Revolute => (180.0 / std::f64::consts::PI, "deg"),
                    JointKind::Prismatic => (1.0, "mm"),
                };
                let (value, min, max) = (readable(value * scale), min * scale, max * scale);
                write!(f, "joint {joint} would be {value} {unit} (range {min:.2} to {max:.2} {unit})")
            }
            Self::Singular { manipulability, min } => write!(
                f,
                "it is too close to a singularity (manipulability {manipulability:.3}, minimum {min:.3}: min_dexterity in \
                 [geometry])"
            ),
        }
    }
}

/// A point at which a machine cannot draw.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the point {}, {} mm cannot be drawn: {fault}", readable(point.x), readable(point.y))]
pub struct OutOfReach {
    /// The point, machine mm.
    pub point: Point,
    /// Why.
    pub fault: Fault,
}

/// A number with two digits after the point, or with a power of ten where it is huge.
fn readable(number: f64) -> String {
    if number.abs() < 1e7 { format!("{number:.2}") } else { format!("{number:.2e}") }
}

/// Curves are checked as chords within this distance, mm: far below any machine's tick.
pub(crate) const CHORD_TOLERANCE: f64 = 1e-3;

impl Machine {
    /// Whether the pen may draw at `p`: reachable, within the joint limits, not too close to a
    /// singular pose.
    ///
    /// # Errors
    /// When it may not.
    pub fn check_point(&self, p: Point) -> Result<(), OutOfReach> {
        let pose = self.pose_near(p, &self.start()).map_err(Fault::from);
        // Full rotations change the joint positions, but not the manipulability.
        let fault = match pose {
            Err(fault) => Some(fault),
            Ok(q) => {
                let limit = self.joint_fault(&q).and_then(|_| self.poses(p, &self.start()).err());
                let (manipulability, min) =
                    (self.mechanism().manipulability(&q), self.parts().min_manipulability);
                // At the pole itself the pen may rest, whatever the direction.
                let singular = manipulability < min && self.mechanism().pole() != Some(p);
                limit.or_else(|| singular.then_some(Fault::Singular { manipulability, min }))
            }
        };
        fault.map_or(Ok(()), |fault| Err(OutOfReach { point: p, fault }))
    }

    /// Whether the pen may draw the whole segment, not only its ends.
    ///
    /// On a straight line of a mechanism with a [`crate::Mechanism::base`], the distance from the base (which alone decides the fold of an elbow, and so
    /// reach and manipulability) is convex: it is extreme at an end or at the foot of the perpendicular
    /// from the base. Joints are monotone between these points and those of
    /// [`crate::Mechanism::joint_extrema_on_line`]. Without a base, the check steps along the line, each
    /// step as long as the clearance that the mechanism guarantees. Curves are checked as chords within
    /// 1e-3 mm.
    ///
    /// A line through [`crate::Mechanism::pole`] is two lines that end there: the planner stops there
    /// with the pen up ([`Self::pole_on`]). On such a line the first joint rests at any distance.
    ///
    /// # Errors
    /// With an offending point.
    pub fn check_segment(&self, segment: &Segment) -> Result<(), OutOfReach> {
        match segment {
            Segment::Line(line) => match self.pole_on(line) {
                Some(pole) => {
                    self.check_radius(pole, line.p0)?;
                    self.check_radius(pole, line.p1)
                }
                None => self.check_line(line),
            },
            curve => {
                let mut from = curve.start();
                let mut result = Ok(());
                curve.flatten(CHORD_TOLERANCE, |to| {
                    let chord = Line::new(from, to);
                    if let (Ok(()), Some(pole)) = (result, self.pole_on(&chord)) {
                        // A curve leaves its tangent, and the first joint would turn.
                        let min = self.parts().min_manipulability;
                        let fault = Fault::Singular { manipulability: 0.0, min };
                        result = Err(OutOfReach { point: pole, fault });
                    }
                    if result.is_ok() {
                        result = self.check_line(&chord);
                    }
                    from = to;
                });
                result
            }
        }
    }

    /// The pole, if the line goes through it or ends there, to within 1e-6 mm.
    pub fn pole_on(&self, line: &Line) -> Option<Point> {
        let pole = self.mechanism().pole()?;
        let along = line.p1 - line.p0;
        let length_2 = along.hypot2();
        let t = if length_2 > 0.0 { ((pole - line.p0).dot(along) / length_2).clamp(0.0, 1.0) } else { 0.0 };
        ((at(line, t) - pole).hypot2() <= AT_POLE * AT_POLE).then_some(pole)
    }

    /// The poses at the pole from which the pen can draw a straight line to `towards`, in the order of
    /// [`Self::poses`].
    ///
    /// # Errors
    /// When there is none.
    pub fn poses_at_pole(&self, towards: Point, near: &JointPos) -> Result<Vec<JointPos>, Fault> {
        let outer = self.poses(towards, near)?;
        let poses = outer.into_iter().map(|pose| JointPos::new(pose[0], 0.0));
        let mut fault = None;
        let allowed: Vec<JointPos> = poses
            .filter(|pose| {
                let found = self.joint_fault(pose);
                fault = fault.or(found);
                found.is_none()
            })
            .collect();
        match fault {
            Some(fault) if allowed.is_empty() => Err(fault),
            _ => Ok(allowed),
        }
    }

    /// Whether the pen may draw between the pole and a point: its joints are allowed at both ends.
    fn check_radius(&self, pole: Point, to: Point) -> Result<(), OutOfReach> {
        if (to - pole).hypot2() <= AT_POLE * AT_POLE {
            return self.check_point(pole);
        }
        self.poses(to, &self.start()).map_err(|fault| OutOfReach { point: to, fault })?;
        let at_pole = self.poses_at_pole(to, &self.start());
        at_pole.map(|_| ()).map_err(|fault| OutOfReach { point: pole, fault })
    }

    fn check_line(&self, line: &Line) -> Result<(), OutOfReach> {
        self.check_point(line.p0)?;
        self.check_point(line.p1)?;
        let along = line.p1 - line.p0;
        let foot = self.mechanism().base().map(|base| (base - line.p0).dot(along) / along.hypot2());
        if let Some(t) = foot
            && t > 0.0
            && t < 1.0
        {
            self.check_point(at(line, t))?;
        }
        self.check_clearance(line)?;
        if self.parts().joints.iter().all(|joint| *joint == JointRange::FREE) {
            return Ok(());
        }
        let mut inner = self.mechanism().joint_extrema_on_line(line);
        inner.retain(|t| *t > 0.0 && *t < 1.0 && self.pose_near(at(line, *t), &self.start()).is_ok());
        for t in &inner {
            self.check_point(at(line, *t))?;
        }
        if self.mechanism().full_rotation().is_none() {
            return Ok(());
        }
        inner.extend(foot.filter(|t| *t > 0.0 && *t < 1.0));
        inner.push(1.0);
        inner.sort_unstable_by(f64::total_cmp);
        let mut from = self.turns(line, 0.0, &self.start());
        for t in inner {
            let to = self.turns(line, t, &from.pose);
            self.check_between(line, from, to)?;
            from = to;
        }
        Ok(())
    }

    /// Steps along a line by the clearance of each pose, at least by [`CHORD_TOLERANCE`]: there the
    /// boundary of the reach is nearer than that.
    fn check_clearance(&self, line: &Line) -> Result<(), OutOfReach> {
        if self.mechanism().base().is_some() || self.mechanism().is_linear() {
            return Ok(());
        }
        let (mechanism, least) = (self.mechanism(), self.parts().min_manipulability);
        let length = (line.p1 - line.p0).hypot2().sqrt();
        let out = |point, fault| Err(OutOfReach { point, fault });
        let (mut t, mut last) = (0.0, None::<JointPos>);
        loop {
            let point = at(line, t);
            let q = match self.pose_near(point, &last.unwrap_or(self.start())) {
                Ok(q) => q,
                Err(unreachable) => return out(point, unreachable.into()),
            };
            let clearance = mechanism.clearance_mm(&q, least);
            if clearance == f64::INFINITY {
                return Ok(());
            }
            let manipulability = mechanism.manipulability(&q);
            if manipulability < least {
                return out(point, Fault::Singular { manipulability, min: least });
            }
            let turned = |k: usize, last: JointPos| {
                mechanism.joint_kinds()[k] == JointKind::Revolute && (q[k] - last[k]).abs() > LARGEST_STEP
            };
            if last.is_some_and(|last| turned(0, last) || turned(1, last)) {
                return out(point, Fault::BetweenBases);
            }
            if t >= 1.0 || length == 0.0 {
                return Ok(());
            }
            t = (t + clearance.max(CHORD_TOLERANCE) / length).min(1.0);
            last = Some(q);
        }
    }

    /// Checks the joint limits between two points of a line between which the joints are monotone. Both
    /// points have an allowed pose. If the same turn about the base is allowed at both, all poses
    /// between are allowed; if not, the line may cross the gap that a joint range of less than a full
    /// rotation leaves.
    fn check_between(&self, line: &Line, from: Turns, to: Turns) -> Result<(), OutOfReach> {
        if from.allowed & to.allowed != 0 || to.t - from.t < SMALLEST_GAP {
            return Ok(());
        }
        let t = 0.5 * (from.t + to.t);
        self.check_point(at(line, t))?;
        let middle = self.turns(line, t, &from.pose);
        self.check_between(line, from, middle)?;
        self.check_between(line, middle, to)
    }

    /// The pose at a parameter of a line, continued from `near`, and the allowed turns.
    fn turns(&self, line: &Line, t: f64, near: &JointPos) -> Turns {
        let pose = self.pose_near(at(line, t), near).unwrap_or(*near);
        let rotation = self.mechanism().full_rotation().unwrap_or_default();
        let allowed = (0..=2 * MOST_TURNS)
            .filter(|bit| self.joint_fault(&(pose + rotation * f64::from(bit - MOST_TURNS))).is_none())
            .map(|bit| 1 << bit)
            .sum();
        Turns { t, pose, allowed }
    }
}

/// Points within this distance of the pole are at the pole, mm: rounding errors of placement.
const AT_POLE: f64 = 1e-6;

/// The full rotations about the base that are tried on either side of a pose.
const MOST_TURNS: i32 = 4;

/// A joint that turns by more than this within the clearance of a pose has jumped, rad.
const LARGEST_STEP: f64 = 3.0;

/// Gaps between allowed turns are looked for down to this share of a line.
const SMALLEST_GAP: f64 = 1e-9;

/// A pose on a line, and the full rotations by which it may be turned within the joint limits.
#[derive(Clone, Copy)]
struct Turns {
    /// The line's parameter.
    t: f64,
    pose: JointPos,
    /// Bit k: k - [`MOST_TURNS`] rotations.
    allowed: u32,
}

/// The point of a line at the parameter `t`.
fn at(line: &Line, t: f64) -> Point {
    line.p0 + t * (line.p1 - line.p0)
}
