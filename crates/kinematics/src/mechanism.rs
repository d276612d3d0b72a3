//! Mechanisms: from joints to the pen and back.
//!
//! A mechanism is one file here that implements [`Mechanism`], and one line in [`KINDS`] if machine
//! files are to know it. Nothing outside its file depends on which mechanism it is.

mod cartesian;
mod five_bar;
mod parameters;
mod polar;
mod polargraph;
mod two_link;

use std::fmt::Debug;

use drawing::{Line, Point, Rect, Vec2};

pub use cartesian::Cartesian;
pub use five_bar::FiveBar;
pub use parameters::{Kind, ParameterError, Parameters};
pub use polar::Polar;
pub use polargraph::Polargraph;
pub use two_link::TwoLink;

use crate::{JointPos, Linkage, MachineError};

/// The mechanisms that machine files can name.
pub const KINDS: &[Kind] = &[
    Kind::of::<Cartesian>(),
    Kind::of::<TwoLink>(),
    Kind::of::<Polar>(),
    Kind::of::<FiveBar>(),
    Kind::of::<Polargraph>(),
];

/// Why a point has no pose.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unreachable {
    /// Further from the base than the arm is long; by this many mm.
    #[error("{0:.2} mm beyond the machine's reach")]
    TooFar(f64),
    /// Nearer to the base than the arm can fold; by this many mm.
    #[error("{0:.2} mm too near to the machine's base")]
    TooNear(f64),
    /// The pen would be on the other side of the elbows: another assembly mode.
    #[error("the pen would be on the other side of the line between the elbows")]
    OtherAssembly,
    /// A cord would not pull: beside or above the anchors, by this many mm.
    #[error("{0:.2} mm beyond the anchors, where a cord is slack")]
    Slack(f64),
}

/// What a joint does, and so the unit of its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// It turns: rad.
    Revolute,
    /// It slides: mm.
    Prismatic,
}

/// A planar mechanism of two joints that moves a pen: its kinematics as pure functions.
///
/// The inverse has one branch, which is part of the mechanism itself (an arm's elbow is on its left
/// or on its right), so that it cannot flip while the pen is down.
///
/// The kinds of [`KINDS`] are built in; a program can plan for a mechanism of its
/// own by implementing this trait. Every plan rests on the bounds promised here: the property suite
/// in `tests/mechanisms.rs` tests each of them.
pub trait Mechanism: Debug + Send + Sync {
    /// The name of the kind of mechanism, as machine files give it.
    fn kind(&self) -> &'static str;

    /// The joints' names, as machine files and messages use them.
    fn joint_names(&self) -> [&'static str; 2];

    /// What each joint does.
    fn joint_kinds(&self) -> [JointKind; 2];

    /// Checks the mechanism's own dimensions.
    ///
    /// # Errors
    /// When a length is not a positive finite number.
    fn validate(&self) -> Result<(), MachineError> {
        Ok(())
    }

    /// Forward kinematics: the position of the pen, mm.
    fn forward(&self, q: &JointPos) -> Point;

    /// Inverse kinematics: the joints that hold the pen at `p`. Angles are principal values; see
    /// [`Self::full_rotation`].
    ///
    /// # Errors
    /// When no pose reaches the point.
    fn inverse(&self, p: Point) -> Result<JointPos, Unreachable>;

    /// The columns of the Jacobian of [`Self::forward`]: the pen's velocity per unit velocity of
    /// each joint.
    fn jacobian(&self, q: &JointPos) -> [Vec2; 2];

    /// The pen's velocity at pose `q` while the joints move at `rates`: the Jacobian times `rates`.
    fn pen_velocity(&self, q: &JointPos, rates: &JointPos) -> Vec2 {
        let [first, second] = self.jacobian(q);
        first * rates[0] + second * rates[1]
    }

    /// First and second derivatives of the joints along a path on which the pen, at pose `q`, has
    /// the derivatives `first` (mm) and `second` (mm) with respect to the path's parameter. Infinite
    /// or NaN at a singular pose.
    fn path_derivatives(&self, q: &JointPos, first: Vec2, second: Vec2) -> (JointPos, JointPos);

    /// Third derivative of the joints along such a path, on which the pen also has the derivative
    /// `third` (mm).
    fn path_third_derivative(&self, q: &JointPos, first: Vec2, second: Vec2, third: Vec2) -> JointPos;

    /// An upper bound on |d²p/du²|, mm, while the joints move linearly from `from` (u = 0) to `to`
    /// (u = 1).
    ///
    /// A function whose second derivative is bounded by `B` leaves the chord between its ends by at
    /// most `u (1 - u) B / 2`, so by at most `B / 8`: this proves that linear motion of the motors
    /// stays near a straight line. `to` may also be `from` plus joint velocities: then the result
    /// bounds |d²p/dt²| at constant velocity, over the unit of time that begins at `from`.
    fn second_derivative_bound(&self, from: &JointPos, to: &JointPos) -> f64;

    /// Normalised distance from a singular pose: 0 when singular, at most 1.
    fn manipulability(&self, q: &JointPos) -> f64;

    /// The smallest [`Self::manipulability`] at which a machine draws, where its description gives
    /// none.
    fn default_min_manipulability(&self) -> f64;

    /// The change of the joints over one full rotation of the mechanism about its base, after which
    /// the pose is the same; `None` where it cannot rotate. The first joint is one that changes.
    fn full_rotation(&self) -> Option<JointPos>;

    /// The centre from which the distance of a point decides whether it can be reached, if there is
    /// one: the base of an arm.
    fn base(&self) -> Option<Point>;

    /// A point that the pen can hold in every direction of the first joint, with the second one at 0,
    /// if there is one. Only lines that end there can be drawn near it: the first joint rests on them.
    fn pole(&self) -> Option<Point> {
        None
    }

    /// The middle of the mechanism: [`Self::base`], or between its bases.
    fn center(&self) -> Point {
        self.base().unwrap_or(Point::ZERO)
    }

    /// A box around the reach for pictures, mm: for one without an end, around its useful part. `None`
    /// where only joint limits bound the reach.
    fn reach_box(&self) -> Option<Rect> {
        None
    }

    /// A distance from the pen, mm, within which every point can be reached without a jump of the
    /// joints, at a [`Self::manipulability`] of at least `least`. At most 0 where the pose has less.
    /// Infinite where [`Self::base`] (or nothing) decides that.
    fn clearance_mm(&self, _q: &JointPos, _least: f64) -> f64 {
        f64::INFINITY
    }

    /// Whether no pose is singular, or of another branch, while the joints move linearly from one pose
    /// to the other; `false` also where that cannot be decided.
    fn stays_regular(&self, _from: &JointPos, _to: &JointPos) -> bool {
        true
    }

    /// Whether the pen's position is an affine function of the joints, so that its derivatives along
    /// a path are proportional to the joints'.
    fn is_linear(&self) -> bool;

    /// Its points and parts, so that it can be drawn in any pose. The sheet, machine mm, gives parts
    /// a length that the kinematics do not know, such as that of a gantry.
    fn linkage(&self, sheet: Rect) -> Linkage;

    /// The mechanism as a two-link arm, if it is one: its links have masses in simulations.
    fn as_two_link(&self) -> Option<&TwoLink> {
        None
    }

    /// Where a joint may have an extreme value while the pen follows a straight line, as parameters of
    /// the line; values outside (0, 1) and points out of reach are ignored. The line's ends and the
    /// foot of the perpendicular from [`Self::base`] need not be among them. Between neighbours of all
    /// these points every joint is monotone.
    fn joint_extrema_on_line(&self, _line: &Line) -> Vec<f64> {
        Vec::new()
    }
}

/// The unit vector in direction `angle` (rad) and the one a quarter turn ahead of it.
fn frame(angle: f64) -> (Vec2, Vec2) {
    let (sin, cos) = libm::sincos(angle);
    (Vec2::new(cos, sin), Vec2::new(-sin, cos))
}
