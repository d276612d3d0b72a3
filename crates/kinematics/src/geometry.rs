//! The geometries: from joints to the pen and back.

mod cartesian;
mod polar;
mod two_link;

use drawing::{Point, Vec2};

pub use cartesian::Cartesian;
pub use polar::Polar;
pub use two_link::TwoLink;

use crate::JointPos;

/// Why a point has no pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unreachable {
    /// Further from the base than the arm is long; by so many mm.
    TooFar(f64),
    /// Nearer to the base than the arm can fold; by so many mm.
    TooNear(f64),
}

/// Shape of a machine: a closed set, one file each, behind one set of functions.
///
/// All functions are pure; an inverse takes the branch from the geometry itself (the elbow's side is part of it), so
/// that it cannot flip while the pen is down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Geometry {
    /// Joints are x and y, mm.
    Cartesian(Cartesian),
    /// Joints are the absolute angles of two links, rad.
    TwoLink(TwoLink),
    /// Joints are angle (rad) and radius (mm).
    Polar(Polar),
}

macro_rules! each {
    ($self:expr, $geometry:ident => $call:expr) => {
        match $self {
            Geometry::Cartesian($geometry) => $call,
            Geometry::TwoLink($geometry) => $call,
            Geometry::Polar($geometry) => $call,
        }
    };
}

impl Geometry {
    /// Forward kinematics: where the pen is, mm.
    pub fn forward(&self, q: &JointPos) -> Point {
        each!(self, g => g.forward(q))
    }

    /// Inverse kinematics: the joints that hold the pen at `p`, angles in (-pi, pi] as they come; see [`Self::full_rotation`].
    ///
    /// # Errors
    /// When no pose reaches the point.
    pub fn inverse(&self, p: Point) -> Result<JointPos, Unreachable> {
        each!(self, g => g.inverse(p))
    }

    /// The Jacobian of [`Self::forward`]: columns are the pen's velocity per unit of each joint's.
    pub fn jacobian(&self, q: &JointPos) -> [Vec2; 2] {
        each!(self, g => g.jacobian(q))
    }

    /// The pen's velocity at pose `q` while the joints move at `rates`: the Jacobian times them.
    pub fn pen_velocity(&self, q: &JointPos, rates: &JointPos) -> Vec2 {
        let [first, second] = self.jacobian(q);
        first * rates[0] + second * rates[1]
    }

    /// First and second derivative of the joints along a path on which the pen, at pose `q`, has the derivatives
    /// `first` (mm) and `second` (mm) by the path's parameter. Infinite or not a number at a singular pose.
    pub fn path_derivatives(&self, q: &JointPos, first: Vec2, second: Vec2) -> (JointPos, JointPos) {
        each!(self, g => g.path_derivatives(q, first, second))
    }

    /// Third derivative of the joints along such a path, on which the pen also has the derivative `third` (mm).
    pub fn path_third_derivative(&self, q: &JointPos, first: Vec2, second: Vec2, third: Vec2) -> JointPos {
        each!(self, g => g.path_third_derivative(q, first, second, third))
    }

    /// How much the pen's path bends while the joints move evenly from `from` to `to`: a bound on the length of
    /// d²p/du², u from 0 to 1, mm.
    ///
    /// A function whose second derivative is bounded by `B` leaves the chord between its ends by `u (1 - u) B / 2`, so
    /// by `B / 8` at the most: this is what proves that linear motion of the motors stays on a straight line. `from`
    /// and `to` may also be (a pose, the pose plus joint speeds): then the bound is that of d²p/dt² at even speed.
    pub fn second_derivative_bound(&self, from: &JointPos, to: &JointPos) -> f64 {
        each!(self, g => g.second_derivative_bound(from, to))
    }

    /// How far from a singular pose: 0 there, at most 1.
    pub fn manipulability(&self, q: &JointPos) -> f64 {
        each!(self, g => g.manipulability(q))
    }

    /// The joints' change over one whole turn of the machine about its base, where that is a thing: the pose is the same.
    pub fn full_rotation(&self) -> Option<JointPos> {
        let turn = std::f64::consts::TAU;
        match self {
            Self::Cartesian(_) => None,
            Self::TwoLink(_) => Some(JointPos::new(turn, turn)),
            Self::Polar(_) => Some(JointPos::new(turn, 0.0)),
        }
    }

    /// The joints' names, as machine files and messages use them.
    pub fn joint_names(&self) -> [&'static str; 2] {
        match self {
            Self::Cartesian(_) => ["x", "y"],
            Self::TwoLink(_) => ["theta", "psi"],
            Self::Polar(_) => ["phi", "r"],
        }
    }

    /// Whether each joint is an angle (rad) rather than a length (mm).
    pub fn joint_is_angle(&self) -> [bool; 2] {
        match self {
            Self::Cartesian(_) => [false, false],
            Self::TwoLink(_) => [true, true],
            Self::Polar(_) => [true, false],
        }
    }

    /// The centre about which distance decides reach, if there is one: the base of an arm.
    pub fn base(&self) -> Option<Point> {
        match self {
            Self::Cartesian(_) => None,
            Self::TwoLink(_) | Self::Polar(_) => Some(Point::ZERO),
        }
    }
}

/// The unit vector in direction `angle` (rad) and the one a quarter turn ahead of it.
fn frame(angle: f64) -> (Vec2, Vec2) {
    let (sin, cos) = libm::sincos(angle);
    (Vec2::new(cos, sin), Vec2::new(-sin, cos))
}
