//! Which points, and which whole segments, a machine can draw.

use drawing::{Line, Point, Segment};

use crate::{Machine, Unreachable};

/// Why the pen cannot draw at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// Beyond the arm's length; by so many mm.
    TooFar(f64),
    /// Nearer to the base than the arm folds; by so many mm.
    TooNear(f64),
    /// A joint would leave its range.
    JointLimit {
        /// The joint's name.
        joint: &'static str,
        /// Whether the values are angles (rad) rather than lengths (mm).
        angle: bool,
        /// The value it would take.
        value: f64,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// Too near to a pose in which the pen cannot move in every direction: a stretched or folded arm, the pole.
    Singular {
        /// How far from singular the pose is, see [`crate::Geometry::manipulability`].
        manipulability: f64,
        /// The least the machine allows.
        min: f64,
    },
}

impl From<Unreachable> for Fault {
    fn from(unreachable: Unreachable) -> Self {
        match unreachable {
            Unreachable::TooFar(by) => Self::TooFar(by),
            Unreachable::TooNear(by) => Self::TooNear(by),
        }
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::TooFar(by) => write!(f, "it is {by:.2} mm beyond the machine's reach"),
            Self::TooNear(by) => write!(f, "it is {by:.2} mm too near to the machine's base"),
            Self::JointLimit { joint, angle, value, min, max } => {
                let (scale, unit) = if angle { (180.0 / std::f64::consts::PI, "deg") } else { (1.0, "mm") };
                let (value, min, max) = (value * scale, min * scale, max * scale);
                write!(
                    f,
                    "joint {joint} would be at {value:.2} {unit}, and may be from {min:.2} to {max:.2} {unit}"
                )
            }
            Self::Singular { manipulability, min } => write!(
                f,
                "the pose there is too nearly singular: an arm stretched or folded, a rail at its pole (dexterity {manipulability:.3}, at least {min:.3} is needed)"
            ),
        }
    }
}

/// A place that a machine cannot draw at.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the point {:.2}, {:.2} mm cannot be drawn: {fault}", point.x, point.y)]
pub struct OutOfReach {
    /// The point, machine mm.
    pub point: Point,
    /// Why.
    pub fault: Fault,
}

/// Curves are checked as chords that stay this close to them, mm; far below any machine's tick.
pub(crate) const CHORD_TOLERANCE: f64 = 1e-3;

impl Machine {
    /// Whether the pen may draw at `p`: reachable, inside the joint limits, not too near to a singular pose.
    ///
    /// # Errors
    /// When it may not.
    pub fn check_point(&self, p: Point) -> Result<(), OutOfReach> {
        let pose = self.pose_near(p, &self.start()).map_err(Fault::from);
        // Whether the pose is nearly singular is the same after any number of turns; the joint limits are not.
        let fault = match pose {
            Err(fault) => Some(fault),
            Ok(q) => {
                let limit = self.joint_fault(&q).and_then(|_| self.poses(p, &self.start()).err());
                let (manipulability, min) =
                    (self.geometry().manipulability(&q), self.parts().min_manipulability);
                limit.or_else(|| (manipulability < min).then_some(Fault::Singular { manipulability, min }))
            }
        };
        fault.map_or(Ok(()), |fault| Err(OutOfReach { point: p, fault }))
    }

    /// Whether the pen may draw the whole segment, not only its ends.
    ///
    /// On a straight line every condition is extreme at an end or at the foot of the perpendicular from the base: the
    /// distance from the base (which alone decides the elbow's fold, so dexterity and reach) is convex along it, a
    /// coordinate and the polar angle are monotone. The angles of an arm's links are not, so where those are limited
    /// the line is also sampled every millimetre. Curves are taken as chords within 1e-3 mm.
    ///
    /// # Errors
    /// With the first offending point that was found.
    pub fn check_segment(&self, segment: &Segment) -> Result<(), OutOfReach> {
        match segment {
            Segment::Line(line) => self.check_line(line),
            curve => {
                let mut from = curve.start();
                let mut result = Ok(());
                curve.flatten(CHORD_TOLERANCE, |to| {
                    if result.is_ok() {
                        result = self.check_line(&Line::new(from, to));
                    }
                    from = to;
                });
                result
            }
        }
    }

    fn check_line(&self, line: &Line) -> Result<(), OutOfReach> {
        self.check_point(line.p0)?;
        self.check_point(line.p1)?;
        let along = line.p1 - line.p0;
        if let Some(base) = self.geometry().base() {
            let t = (base - line.p0).dot(along) / along.hypot2();
            if t > 0.0 && t < 1.0 {
                self.check_point(line.p0 + t * along)?;
            }
        }
        let free = self.parts().joints.iter().all(|j| j.min == f64::NEG_INFINITY && j.max == f64::INFINITY);
        if !free && matches!(self.geometry(), crate::Geometry::TwoLink(_)) {
            let samples = along.hypot2().sqrt().ceil().min(1e5) as usize;
            for k in 1..samples {
                self.check_point(line.p0 + (k as f64 / samples as f64) * along)?;
            }
        }
        Ok(())
    }
}
