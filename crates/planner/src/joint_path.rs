//! Joint paths: inverse kinematics along a section, on an adaptive grid, with the derivatives that
//! time parametrization needs.

use drawing::{Point, Segment};
use kinematics::{Fault, JointKind, JointPos, Machine, MotorPos, OutOfReach, Unreachable};

use crate::path::{Piece, Section};
use crate::time_parametrization::hermite;

/// A path in joint space that can be followed without stopping.
///
/// The parameter `s` is that of the pen's pieces, in mm, or runs from 0 to 1 (travel). The path is
/// exact: positions come from the pen's curve through inverse kinematics, not from interpolation
/// between grid points.
#[derive(Clone, Debug)]
pub struct JointPath {
    /// The geometry of the path.
    pub geometry: PathGeometry,
    /// The grid intervals, in order, without gaps; at least one.
    pub intervals: Vec<GridInterval>,
}

/// The geometry of a joint path.
#[derive(Clone, Debug)]
pub enum PathGeometry {
    /// The pen follows these pieces, starting in this pose.
    Drawn(JointPos, Section),
    /// The joints move linearly from one pose to the other, with the pen up.
    Travel(JointPos, JointPos),
}

/// A part of a joint path between two grid points.
#[derive(Clone, Copy, Debug)]
pub struct GridInterval {
    /// Its length in the parameter `s`.
    pub length: f64,
    /// Index of the piece it lies on.
    pub piece: usize,
    /// Where on the piece the interval starts, in `s`.
    pub start: f64,
    /// The motors' derivatives with respect to `s` at its start, middle and end, ticks per unit.
    /// They may differ between the two sides of a grid point where pieces meet, so each interval
    /// has its own.
    pub first: [MotorPos; 3],
    /// Second derivatives, likewise.
    pub second: [MotorPos; 3],
    /// Largest |dp/ds| of the pen.
    pub pen_speed: f64,
    /// |dp/ds|² at its start, middle and end, and its derivative.
    pub square_pen_speeds: [[f64; 2]; 3],
    /// Bound on the second derivative of the pen's path relative to linear joint motion, 1/mm: with
    /// rows `T` apart, motion at constant speed leaves the path by at most `(ds/dt)² T²
    /// second_derivative_bound / 8`.
    pub second_derivative_bound: f64,
    /// Whether acceleration along the path adds to that deviation: by `|d²s/dt²| T² pen_speed / 8`.
    pub near_corner: bool,
    /// Bound on the error of linear interpolation of the derivatives between the three samples, as
    /// a share of the limits; 0 where they are linear in `s` (lines and parabolas on linear
    /// kinematics).
    pub interpolation_error: f64,
    /// The same for polynomials of degree 5 with the derivatives of these samples; 0 on linear
    /// kinematics except for arcs.
    pub polynomial_error: f64,
}

/// Largest rotation of a joint over an interval, rad, so that no extremum of a derivative lies
/// hidden between samples.
const LARGEST_TURN: f64 = 0.15;

/// Largest deviation of the derivatives in the middle of an interval from the mean of its ends, as
/// a share of the constraint that limits the speed.
const LARGEST_MIDPOINT_ERROR: f64 = 0.02;

/// The same on linear kinematics without jerk limits, where the derivatives are polynomials: only so
/// that the time parametrization finds their extrema.
const LARGEST_POLYNOMIAL_CHANGE: f64 = 0.25;

/// Largest [`GridInterval::polynomial_error`] for the time parametrization.
const LARGEST_POLYNOMIAL_ERROR: f64 = 1e-4;

/// Shortest interval, mm.
const SHORTEST: f64 = 1e-5;

/// The path's derivatives at one point.
#[derive(Clone, Copy)]
pub(crate) struct PathDerivatives {
    /// Of the motors, first.
    pub(crate) first: MotorPos,
    /// Of the motors, second.
    pub(crate) second: MotorPos,
    /// See [`GridInterval::pen_speed`].
    pub(crate) pen_speed: f64,
    /// Its square, and the derivative of that.
    square_pen_speed: [f64; 2],
    /// The component of p'' normal to the path, `|p' x p''| / |p'|` = curvature times |p'|², 1/mm.
    normal_second_derivative: f64,
    /// See [`GridInterval::second_derivative_bound`].
    pub(crate) second_derivative_bound: f64,
}

/// The path and its derivatives at one point.
#[derive(Clone, Copy)]
struct Sample {
    /// Position on the piece, in `s`.
    s: f64,
    point: Point,
    pose: JointPos,
    derivatives: PathDerivatives,
}

impl JointPath {
    /// The linear path in joint space, along which all motors start and stop together. Returns
    /// `None` if the poses are equal.
    pub fn travel(machine: &Machine, from: JointPos, to: JointPos) -> Option<Self> {
        let change = machine.motor_rates(&(to - from));
        let pen_speed = travel_speed(machine, from, to);
        (change.max_abs() > 0.0).then(|| Self {
            geometry: PathGeometry::Travel(from, to),
            intervals: vec![GridInterval {
                length: 1.0,
                piece: 0,
                start: 0.0,
                first: [change; 3],
                second: [MotorPos::ZERO; 3],
                pen_speed,
                square_pen_speeds: [[pen_speed * pen_speed, 0.0]; 3],
                second_derivative_bound: 0.0,
                near_corner: false,
                interpolation_error: 0.0,
                polynomial_error: 0.0,
            }],
        })
    }

    /// The joint path of a smooth section, starting at `pose`, which must hold the pen at the
    /// section's first point.
    ///
    /// Intervals are bisected until
    /// 1. linear joint motion over an interval stays within `tolerance` mm of the curve, by
    ///    [`kinematics::Mechanism::second_derivative_bound`] plus the curve's own chord error;
    /// 2. no joint rotates by more than 0.15 rad over it;
    /// 3. the motors' derivatives in its middle are within 2 % of the mean of its ends, as a share
    ///    of the constraint that limits the pen.
    ///
    /// # Errors If a point is out of reach, outside the joint limits or nearly singular.
    pub fn from_section(
        machine: &Machine,
        section: Section,
        pose: JointPos,
        tolerance: f64,
    ) -> Result<Self, OutOfReach> {
        let mut builder = Builder { machine, tolerance, intervals: Vec::with_capacity(section.len()) };
        let mut near = pose;
        for (index, piece) in section.iter().enumerate() {
            machine.check_segment(&piece.curve)?;
            near = builder.add_piece(index, piece, near)?;
        }
        Ok(Self { geometry: PathGeometry::Drawn(pose, section), intervals: builder.intervals })
    }
}

impl JointPath {
    /// Whether it is one line of the pen.
    pub(crate) fn is_line(&self) -> bool {
        match &self.geometry {
            PathGeometry::Drawn(_, section) => {
                matches!(section[..], [Piece { curve: Segment::Line(_), .. }])
            }
            PathGeometry::Travel(..) => false,
        }
    }
}

impl GridInterval {
    /// Appends the interval, bisected until polynomials of degree 5 are accurate enough.
    pub(crate) fn refine(&self, machine: &Machine, geometry: &PathGeometry, to: &mut Vec<Self>) {
        let wanted = self.polynomial_error > LARGEST_POLYNOMIAL_ERROR;
        match if wanted { self.halves(machine, geometry) } else { None } {
            Some(halves) => halves.iter().for_each(|half| half.refine(machine, geometry, to)),
            None => to.push(*self),
        }
    }

    /// Two intervals in place of this one, with derivatives evaluated again; `None` for travel,
    /// where nothing is gained, and for intervals that are too short.
    fn halves(&self, machine: &Machine, geometry: &PathGeometry) -> Option<[Self; 2]> {
        if self.length <= 2.0 * SHORTEST {
            return None;
        }
        let halves = self.divided(machine, geometry, 0.5)?;
        // Of order 6, so it decreases by 64.
        Some(halves.map(|half| Self { polynomial_error: self.polynomial_error / 32.0, ..half }))
    }

    /// The intervals before and after this share of it, with derivatives evaluated again; `None` for
    /// travel.
    pub(crate) fn divided(
        &self,
        machine: &Machine,
        geometry: &PathGeometry,
        share: f64,
    ) -> Option<[Self; 2]> {
        let PathGeometry::Drawn(_, section) = geometry else { return None };
        let piece = &section[self.piece];
        let at = |share: f64| {
            let t = ((self.start + share * self.length) * piece.rate).min(1.0);
            // Derivatives do not depend on the turn about the base.
            let pose = machine.mechanism().inverse(piece.curve.eval(t)).ok()?;
            let of = PathDerivatives::of(machine, piece, t, &pose);
            Some((of.first, of.second, of.square_pen_speed))
        };
        let known = |k: usize| (self.first[k], self.second[k], self.square_pen_speeds[k]);
        let middle = if share == 0.5 { known(1) } else { at(share)? };
        let places = [known(0), at(0.5 * share)?, middle, at(0.5 + 0.5 * share)?, known(2)];
        let part = |which: usize, length: f64| {
            let places = [places[2 * which], places[2 * which + 1], places[2 * which + 2]];
            Self {
                length,
                start: if which == 0 { self.start } else { self.start + share * self.length },
                first: places.map(|place| place.0),
                second: places.map(|place| place.1),
                square_pen_speeds: places.map(|place| place.2),
                // Bounds over the interval hold for its parts.
                ..*self
            }
        };
        Some([part(0, share * self.length), part(1, (1.0 - share) * self.length)])
    }
}

impl PathGeometry {
    /// The joints at `s` on a piece, exactly on the path, unwrapped to the turn nearest to `near`.
    ///
    /// # Errors If the point is out of reach; [`JointPath::from_section`] has excluded that.
    pub fn pose(
        &self,
        machine: &Machine,
        piece: usize,
        s: f64,
        near: &JointPos,
    ) -> Result<JointPos, Unreachable> {
        match self {
            Self::Travel(from, to) => Ok(if s >= 1.0 { *to } else { *from + s * (*to - *from) }),
            Self::Drawn(_, pieces) => {
                let piece = &pieces[piece];
                let point = piece.curve.eval((s * piece.rate).min(1.0));
                machine.pose_near(point, near)
            }
        }
    }

    /// The joints at the start.
    pub fn start(&self) -> JointPos {
        match self {
            Self::Travel(from, _) => *from,
            Self::Drawn(pose, _) => *pose,
        }
    }
}

struct Builder<'a> {
    machine: &'a Machine,
    tolerance: f64,
    intervals: Vec<GridInterval>,
}

/// The number of intervals a curve starts with: enough that the three samples of an interval cannot
/// miss an oscillation, and that one acceleration per interval is nearly optimal.
fn initial_interval_count(piece: &Piece) -> usize {
    match &piece.curve {
        Segment::Line(_) => 1,
        // The spans of a spline are short where it bends.
        Segment::Cubic(_) if piece.row_bound.is_some() => 1,
        Segment::Arc(arc) => (arc.sweep_rad.abs() / 0.2).ceil().clamp(2.0, 1e6) as usize,
        Segment::Cubic(cubic) => {
            // The angle between the end tangents is how much a blend turns; other cubics may
            // oscillate between.
            let (u, v) = (cubic.p1 - cubic.p0, cubic.p3 - cubic.p2);
            let turn = libm::atan2(u.cross(v).abs(), u.dot(v));
            (turn / 0.2).ceil().clamp(2.0, 8.0) as usize
        }
    }
}

impl Builder<'_> {
    /// Adds the intervals of one piece and returns the pose at its end.
    fn add_piece(&mut self, index: usize, piece: &Piece, near: JointPos) -> Result<JointPos, OutOfReach> {
        let parts = initial_interval_count(piece);
        let length = piece.length();
        let mut from = self.sample(piece, 0.0, near)?;
        for part in 1..=parts {
            let to = self.sample(piece, length * (part as f64 / parts as f64), from.pose)?;
            self.add_interval(index, piece, from, to)?;
            from = to;
        }
        Ok(from.pose)
    }

    /// Adds the intervals between two samples, bisecting as necessary.
    fn add_interval(
        &mut self,
        index: usize,
        piece: &Piece,
        from: Sample,
        to: Sample,
    ) -> Result<(), OutOfReach> {
        // An explicit stack keeps the order and bounds the memory.
        let mut pending = vec![(from, to)];
        while let Some((a, b)) = pending.pop() {
            let middle = self.sample(piece, 0.5 * (a.s + b.s), a.pose)?;
            let length = b.s - a.s;
            let first = [a.derivatives.first, middle.derivatives.first, b.derivatives.first];
            let second = [a.derivatives.second, middle.derivatives.second, b.derivatives.second];
            let midpoint_error = midpoint_error(
                self.machine,
                a.derivatives.pen_speed.max(b.derivatives.pen_speed),
                &first,
                &second,
            );
            if length > SHORTEST
                && (midpoint_error > self.largest_midpoint_error(piece)
                    || !self.is_within_limits(length, &a, &middle, &b))
            {
                pending.push((middle, b));
                pending.push((a, middle));
                continue;
            }
            // Only near a singular pose can a joint move this far over so short a distance.
            if self.joint_change(&a, &b) > 1.0 {
                let min = self.machine.parts().min_manipulability;
                return Err(OutOfReach {
                    point: b.point,
                    fault: Fault::Singular { manipulability: 0.0, min },
                });
            }
            let (interpolation_error, polynomial_error) = if self.is_polynomial(piece) {
                // Of a parabola between the samples: a quarter of that between the ends.
                (0.3 * midpoint_error, 0.0)
            } else {
                self.errors(piece, &a, &middle, &b)?
            };
            let samples = [&a.derivatives, &middle.derivatives, &b.derivatives];
            let most =
                |of: fn(&PathDerivatives) -> f64| samples.iter().map(|rates| of(rates)).fold(0.0, f64::max);
            self.intervals.push(GridInterval {
                length,
                piece: index,
                start: a.s,
                first,
                second,
                pen_speed: most(|rates| rates.pen_speed),
                square_pen_speeds: samples.map(|rates| rates.square_pen_speed),
                second_derivative_bound: most(|rates| rates.second_derivative_bound),
                near_corner: piece.near_corner,
                interpolation_error,
                polynomial_error,
            });
        }
        Ok(())
    }

    /// Whether the motors' derivatives are polynomials.
    fn is_polynomial(&self, piece: &Piece) -> bool {
        self.machine.mechanism().is_linear() && !matches!(piece.curve, Segment::Arc(_))
    }

    fn largest_midpoint_error(&self, piece: &Piece) -> f64 {
        let jerk = self.machine.motors().iter().any(|motor| motor.max_jerk_ticks_s3.is_some());
        if self.is_polynomial(piece) && !jerk { LARGEST_POLYNOMIAL_CHANGE } else { LARGEST_MIDPOINT_ERROR }
    }

    /// Bounds on the errors of linear interpolation between the three samples and of polynomials
    /// through them, from samples in between.
    fn errors(
        &self,
        piece: &Piece,
        a: &Sample,
        middle: &Sample,
        b: &Sample,
    ) -> Result<(f64, f64), OutOfReach> {
        let (mut interpolation_error, mut polynomial_error) = (0.0_f64, 0.0_f64);
        let samples = [&a.derivatives, &middle.derivatives, &b.derivatives];
        let (first, second) = (samples.map(|of| of.first), samples.map(|of| of.second));
        let length = b.s - a.s;
        for (share, [from, to]) in [(0.25, [a, middle]), (0.75, [middle, b])] {
            let half_way = self.sample(piece, 0.5 * (from.s + to.s), from.pose)?.derivatives;
            let pen_speed = from.derivatives.pen_speed.max(to.derivatives.pen_speed);
            let (first_there, second_there) = (
                [from.derivatives.first, half_way.first, to.derivatives.first],
                [from.derivatives.second, half_way.second, to.derivatives.second],
            );
            interpolation_error =
                interpolation_error.max(midpoint_error(self.machine, pen_speed, &first_there, &second_there));
            // As if the polynomial's values were the mean of two ends.
            let predicted = [0, 1].map(|k| {
                let c = hermite(length, first.map(|m| m[k]), second.map(|m| m[k]));
                let value = c.iter().rev().fold(0.0, |sum, c| sum * share + c);
                let slope = (1..6).rev().fold(0.0, |sum, j| sum * share + j as f64 * c[j]);
                (value, slope / length)
            });
            let of = |pick: fn(&(f64, f64)) -> f64| MotorPos::new(pick(&predicted[0]), pick(&predicted[1]));
            let (value, slope) = (of(|p| p.0), of(|p| p.1));
            let error = midpoint_error(
                self.machine,
                pen_speed,
                &[value, half_way.first, value],
                &[slope, half_way.second, slope],
            );
            polynomial_error = polynomial_error.max(error);
        }
        // Twice: the acceleration along the path may be that of a motor at its other limit.
        Ok((1.2 * interpolation_error, 2.0 * polynomial_error))
    }

    /// The largest rotation of a joint between two samples, rad.
    fn joint_change(&self, a: &Sample, b: &Sample) -> f64 {
        let kinds = self.machine.mechanism().joint_kinds();
        let of = |k: usize| if kinds[k] == JointKind::Revolute { (b.pose[k] - a.pose[k]).abs() } else { 0.0 };
        of(0).max(of(1))
    }

    /// Whether the interval is short enough for linear joint motion.
    fn is_within_limits(&self, length: f64, a: &Sample, middle: &Sample, b: &Sample) -> bool {
        let turning = a
            .derivatives
            .normal_second_derivative
            .max(middle.derivatives.normal_second_derivative)
            .max(b.derivatives.normal_second_derivative);
        let deviation = (self.machine.mechanism().second_derivative_bound(&a.pose, &b.pose)
            + length * length * turning)
            / 8.0;
        self.joint_change(a, b) <= LARGEST_TURN && deviation <= self.tolerance
    }

    fn sample(&self, piece: &Piece, s: f64, near: JointPos) -> Result<Sample, OutOfReach> {
        let t = s * piece.rate;
        let point = piece.curve.eval(t);
        let out = |fault| OutOfReach { point, fault };
        let pose = self.machine.pose_near(point, &near).map_err(|unreachable| out(unreachable.into()))?;
        if let Some(fault) = self.machine.joint_fault_between(&pose) {
            return Err(out(fault));
        }
        Ok(Sample { s, point, pose, derivatives: PathDerivatives::of(self.machine, piece, t, &pose) })
    }
}

/// A bound on |dp/ds| of the pen while the joints move linearly from one pose to the other in s
/// from 0 to 1, mm; 0 if the machine has no limit on it.
///
/// With `n` equal parts and `B` a bound on the second derivative, `|dp/ds|` changes by at most `B /
/// n` between the ends of a part, so it exceeds the larger end by at most half of that.
#[inline]
pub(crate) fn travel_speed(machine: &Machine, from: JointPos, to: JointPos) -> f64 {
    if machine.pen().max_travel_speed_mm_s == f64::INFINITY { 0.0 } else { fastest_pen(machine, from, to) }
}

/// [`travel_speed`] where there is a limit.
fn fastest_pen(machine: &Machine, from: JointPos, to: JointPos) -> f64 {
    const PARTS: u32 = 16;
    let geometry = machine.mechanism();
    let change = to - from;
    let speed = |k: u32| {
        let pose = from + f64::from(k) / f64::from(PARTS) * change;
        geometry.pen_velocity(&pose, &change).hypot2().sqrt()
    };
    let fastest = (0..=PARTS).map(speed).fold(0.0, f64::max);
    let bound = geometry.second_derivative_bound(&from, &to);
    if bound.is_finite() {
        return fastest + 0.5 * bound / f64::from(PARTS);
    }
    // Bounds that hold over a part only, where one over the whole way does not exist.
    let part = |k: u32| {
        let pose = |k: u32| from + f64::from(k) / f64::from(PARTS) * change;
        geometry.second_derivative_bound(&pose(k), &pose(k + 1))
    };
    fastest + 0.5 * (0..PARTS).map(part).fold(0.0, f64::max) * f64::from(PARTS)
}

/// Third derivatives of the motors with respect to `s`, at the piece's own parameter `t`.
pub(crate) fn third_derivative(machine: &Machine, piece: &Piece, t: f64, pose: &JointPos) -> MotorPos {
    let rate = piece.rate;
    let (first, second) = piece.curve.derivatives(t);
    let third = rate * rate * rate * piece.curve.third_derivative(t);
    machine.motor_third_derivative(pose, rate * first, rate * rate * second, third)
}

impl PathDerivatives {
    /// At the curve's own parameter `t`, where the pose is `pose`.
    pub(crate) fn of(machine: &Machine, piece: &Piece, t: f64, pose: &JointPos) -> Self {
        let (velocity, acceleration) = piece.curve.derivatives(t);
        let (velocity, acceleration) = (piece.rate * velocity, piece.rate * piece.rate * acceleration);
        let pen_speed = velocity.hypot2().sqrt();
        let normal_second_derivative =
            if pen_speed > 0.0 { velocity.cross(acceleration).abs() / pen_speed } else { 0.0 };
        let geometry = machine.mechanism();
        let (rates, _) = geometry.path_derivatives(pose, velocity, acceleration);
        let (first, second) = machine.motor_derivatives(pose, velocity, acceleration);
        // A nonuniform parameter does not bend a straight line; on a curve take all of p'' as a
        // bound.
        let bending = match (&piece.curve, piece.row_bound) {
            (Segment::Line(_), _) => 0.0,
            // Where the path turns back the pen passes its tip with the acceleration of the motors.
            (_, Some(bound)) if pen_speed > 1e-6 => normal_second_derivative.max(bound),
            (_, Some(bound)) => acceleration.hypot2().sqrt().max(bound),
            (_, None) => acceleration.hypot2().sqrt(),
        };
        let second_derivative_bound = bending + geometry.second_derivative_bound(pose, &(*pose + rates));
        let square_pen_speed = [velocity.hypot2(), 2.0 * velocity.dot(acceleration)];
        Self { first, second, pen_speed, square_pen_speed, normal_second_derivative, second_derivative_bound }
    }
}

/// The deviation of the motors' derivatives in the middle from the mean of the ends, as a share of
/// the constraint that limits the pen: speeds relative to the motors' limits, accelerations
/// relative to theirs at the largest speed attainable here.
fn midpoint_error(machine: &Machine, pen_speed: f64, first: &[MotorPos; 3], second: &[MotorPos; 3]) -> f64 {
    let off = |x: [f64; 3]| (x[1] - 0.5 * (x[0] + x[2])).abs();
    let most = |x: [f64; 3]| x[0].abs().max(x[1].abs()).max(x[2].abs());
    let (mut slowness, mut slowness_off) = (0.0_f64, 0.0_f64);
    let (mut turning, mut turning_off) = (0.0_f64, 0.0_f64);
    for (k, motor) in machine.motors().iter().enumerate() {
        let rates = first.map(|first| first[k] / motor.max_speed_ticks_s);
        let turns = second.map(|second| second[k] / motor.max_acceleration_ticks_s2);
        (slowness, slowness_off) = (slowness.max(most(rates)), slowness_off.max(off(rates)));
        (turning, turning_off) = (turning.max(most(turns)), turning_off.max(off(turns)));
    }
    if slowness == 0.0 {
        return 0.0;
    }
    let fastest = (machine.pen().max_speed_mm_s / pen_speed).min(1.0 / slowness);
    let square_speed = (fastest * fastest).min(1.0 / turning);
    slowness_off / slowness + turning_off * square_speed
}
