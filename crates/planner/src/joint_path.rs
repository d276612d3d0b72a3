//! Lifting the pen's path into joint space, adaptively, with what a time law must know.

use drawing::{Point, Segment, Vec2};
use kinematics::{Fault, Geometry, JointPos, Machine, MotorPos, OutOfReach, Unreachable};

use crate::path::{Piece, Section};

/// A path in joint space that can be followed without stopping: what a time law is laid upon.
///
/// The parameter `s` runs over the pen's pieces (mm) or over the share of the way from 0 to 1 (travel). The path is exact:
/// positions come from the pen's own curve through the inverse kinematics, not from interpolation between nodes.
#[derive(Clone, Debug)]
pub struct JointPath {
    /// Where the path goes.
    pub geometry: PathGeometry,
    /// The intervals, in order, without gaps; at least one.
    pub intervals: Vec<GridInterval>,
}

/// Where a joint path goes.
#[derive(Clone, Debug)]
pub enum PathGeometry {
    /// The pen follows these pieces, beginning in this pose.
    Drawn(JointPos, Section),
    /// The joints go straight from one pose to the other; the pen is up.
    Travel(JointPos, JointPos),
}

/// A stretch of a joint path between two nodes.
#[derive(Clone, Copy, Debug)]
pub struct GridInterval {
    /// Its length in the parameter `s`.
    pub length: f64,
    /// Index of the piece it lies on, and where on it the interval begins, in `s`.
    pub piece: usize,
    /// See `piece`.
    pub start: f64,
    /// The motors' derivatives by `s` at its start, middle and end, ticks per unit. The two sides of a node differ where
    /// pieces meet, so each interval has its own.
    pub first: [MotorPos; 3],
    /// Second derivatives, likewise.
    pub second: [MotorPos; 3],
    /// Largest |dp/ds| of the pen.
    pub pen_speed: f64,
    /// Bound on how much the pen's path bends against linear joint motion, for a unit of (ds/dt)², 1/mm: rows `T` apart
    /// at even speed leave the curve by `(ds/dt)² T² second_derivative_bound / 8` at the most.
    pub second_derivative_bound: f64,
    /// Whether rows also leave the curve by how the pen speeds up: by `|d²s/dt²| T² pen_speed / 8` more.
    pub near_corner: bool,
    /// By how much the derivatives may exceed a straight line between the three samples, as a share of the limits: 0
    /// where they are linear in `s` (lines and parabolas on machines whose kinematics are linear).
    pub interpolation_error: f64,
}

/// No joint turns by more over a interval, rad: no peak of a derivative can hide between its samples.
const LARGEST_TURN: f64 = 0.15;

/// How far the derivatives in the middle of a interval may be from the mean of its ends, as a share of what limits speed.
const LARGEST_MIDPOINT_ERROR: f64 = 0.02;

/// Cells are not cut shorter than this, mm.
const SHORTEST: f64 = 1e-5;

/// The path's derivatives at one place.
#[derive(Clone, Copy)]
pub(crate) struct PathDerivatives {
    /// Of the motors.
    pub(crate) first: MotorPos,
    /// Likewise.
    pub(crate) second: MotorPos,
    /// See [`GridInterval::pen_speed`].
    pub(crate) pen_speed: f64,
    /// Curvature times speed², 1/mm.
    normal_second_derivative: f64,
    /// See [`GridInterval::second_derivative_bound`].
    pub(crate) second_derivative_bound: f64,
}

/// The path and its derivatives at one place.
#[derive(Clone, Copy)]
struct Sample {
    /// Position on the piece, in `s`.
    s: f64,
    point: Point,
    pose: JointPos,
    derivatives: PathDerivatives,
}

impl JointPath {
    /// The straight way in joint space, along which all motors start and stop together. Nothing if there is no way to go.
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
                second_derivative_bound: 0.0,
                near_corner: false,
                interpolation_error: 0.0,
            }],
        })
    }

    /// Lifts a smooth section of the drawing, beginning at `pose`, which must hold the pen at its first point.
    ///
    /// Cells are bisected until (1) linear joint motion over a interval would stay within `tolerance` mm of the curve, by
    /// the proved bound of [`kinematics::Geometry::second_derivative_bound`] plus the curve's own chord error; (2) no joint turns by more
    /// than 0.15 rad over it; (3) the motors' derivatives in its middle are within a fiftieth of the mean of its ends,
    /// as a share of what limits the pen.
    ///
    /// # Errors
    /// When a point of it is out of reach, outside the joint limits or nearly singular.
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

impl GridInterval {
    /// The interval, cut in two so many times over.
    pub(crate) fn subdivide(
        &self,
        machine: &Machine,
        geometry: &PathGeometry,
        times: u32,
        to: &mut Vec<Self>,
    ) {
        match if times > 0 { self.halves(machine, geometry) } else { None } {
            Some(halves) => halves.iter().for_each(|half| half.subdivide(machine, geometry, times - 1, to)),
            None => to.push(*self),
        }
    }

    /// Two intervals in place of this one, with derivatives taken anew; nothing for travel, where there is nothing to gain,
    /// and for intervals too short to be cut.
    fn halves(&self, machine: &Machine, geometry: &PathGeometry) -> Option<[Self; 2]> {
        let PathGeometry::Drawn(_, section) = geometry else { return None };
        if self.length <= 2.0 * SHORTEST {
            return None;
        }
        let piece = &section[self.piece];
        let at = |share: f64| {
            let t = ((self.start + share * self.length) * piece.rate).min(1.0);
            // Derivatives are the same at every turn about the base.
            let pose = machine.geometry().inverse(piece.curve.eval(t)).ok()?;
            let (first, second) = motor_derivatives(machine, piece, t, &pose);
            Some((first, second))
        };
        let known = |k: usize| (self.first[k], self.second[k]);
        let places = [known(0), at(0.25)?, known(1), at(0.75)?, known(2)];
        let parts = [0, 2].map(|from| {
            let places = [places[from], places[from + 1], places[from + 2]];
            (places.map(|place| place.0), places.map(|place| place.1))
        });
        // Of both halves, for where one of them has its second_derivative_bound change sign it shows none in its middle.
        let midpoint_errors =
            parts.map(|(first, second)| midpoint_error(machine, self.pen_speed, &first, &second));
        let interpolation_error = 0.5 * midpoint_errors[0].max(midpoint_errors[1]);
        let half = |which: usize| {
            let (first, second) = parts[which];
            Self {
                length: 0.5 * self.length,
                start: self.start + 0.5 * which as f64 * self.length,
                interpolation_error,
                first,
                second,
                // What holds for all of the interval holds for its halves.
                ..*self
            }
        };
        Some([half(0), half(1)])
    }

    /// Whether the motors move in proportion to the parameter, so that any even acceleration on it is even in the motors.
    pub(crate) fn is_straight(&self) -> bool {
        self.second.iter().all(|second| *second == MotorPos::ZERO)
    }
}

impl PathGeometry {
    /// The joints at `s` on a piece, exactly on the path; angles are unwrapped to the turn nearest to `near`.
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

/// How many intervals a curve begins with: enough that the three samples of a interval cannot miss a wave, and that a time law
/// with one acceleration a interval comes near to the best.
fn initial_interval_count(piece: &Piece) -> usize {
    match &piece.curve {
        Segment::Line(_) => 1,
        Segment::Arc(arc) => (arc.sweep_rad.abs() / 0.2).ceil().clamp(2.0, 1e6) as usize,
        Segment::Cubic(cubic) => {
            // The angle between the end tangents tells how much a blend turns; other cubics may wave between.
            let (u, v) = (cubic.p1 - cubic.p0, cubic.p3 - cubic.p2);
            let turn = libm::atan2(u.cross(v).abs(), u.dot(v));
            (turn / 0.2).ceil().clamp(2.0, 8.0) as usize
        }
    }
}

impl Builder<'_> {
    /// Lifts one piece and gives the pose at its end.
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

    /// Adds the intervals between two samples, bisecting as long as one interval would not do.
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
                && (midpoint_error > LARGEST_MIDPOINT_ERROR
                    || !self.is_within_limits(length, &a, &middle, &b))
            {
                pending.push((middle, b));
                pending.push((a, middle));
                continue;
            }
            // Only at a singular pose can a joint still jump over so short a way.
            if self.joint_change(&a, &b) > 1.0 {
                let min = self.machine.parts().min_manipulability;
                return Err(OutOfReach {
                    point: b.point,
                    fault: Fault::Singular { manipulability: 0.0, min },
                });
            }
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
                second_derivative_bound: most(|rates| rates.second_derivative_bound),
                near_corner: piece.near_corner,
                interpolation_error: self.interpolation_error(piece, &a, &middle, &b)?,
            });
        }
        Ok(())
    }

    /// By how much the derivatives leave the straight lines between the three samples, looked at half way.
    fn interpolation_error(
        &self,
        piece: &Piece,
        a: &Sample,
        middle: &Sample,
        b: &Sample,
    ) -> Result<f64, OutOfReach> {
        let even = matches!(self.machine.geometry(), Geometry::Cartesian(_));
        if even && piece.curve.third_derivative(0.0) == Vec2::ZERO {
            return Ok(0.0);
        }
        let mut interpolation_error = 0.0_f64;
        for (from, to) in [(a, middle), (middle, b)] {
            let half_way = self.sample(piece, 0.5 * (from.s + to.s), from.pose)?.derivatives;
            let first = [from.derivatives.first, half_way.first, to.derivatives.first];
            let second = [from.derivatives.second, half_way.second, to.derivatives.second];
            interpolation_error = interpolation_error.max(midpoint_error(
                self.machine,
                from.derivatives.pen_speed.max(to.derivatives.pen_speed),
                &first,
                &second,
            ));
        }
        Ok(1.2 * interpolation_error)
    }

    /// The most that a joint turns from one sample to the other, rad.
    fn joint_change(&self, a: &Sample, b: &Sample) -> f64 {
        let angles = self.machine.geometry().joint_is_angle();
        let of = |k: usize| if angles[k] { (b.pose[k] - a.pose[k]).abs() } else { 0.0 };
        of(0).max(of(1))
    }

    /// Whether the interval is short enough for linear joint motion.
    fn is_within_limits(&self, length: f64, a: &Sample, middle: &Sample, b: &Sample) -> bool {
        let turning = a
            .derivatives
            .normal_second_derivative
            .max(middle.derivatives.normal_second_derivative)
            .max(b.derivatives.normal_second_derivative);
        let deviation = (self.machine.geometry().second_derivative_bound(&a.pose, &b.pose)
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

/// A bound on |dp/ds| of the pen while the joints go straight from one pose to the other in s from 0 to 1, mm; 0 where no
/// machine asks for it.
///
/// The way in `n` parts: `|dp/ds|` changes by `B` at the most over all of it, so by `B / n` between a part's ends, where B
/// bounds the second derivative.
pub(crate) fn travel_speed(machine: &Machine, from: JointPos, to: JointPos) -> f64 {
    const PARTS: u32 = 16;
    if machine.pen().max_travel_speed_mm_s == f64::INFINITY {
        return 0.0;
    }
    let geometry = machine.geometry();
    let change = to - from;
    let speed = |k: u32| {
        let pose = from + f64::from(k) / f64::from(PARTS) * change;
        geometry.pen_velocity(&pose, &change).hypot2().sqrt()
    };
    let fastest = (0..=PARTS).map(speed).fold(0.0, f64::max);
    fastest + 0.5 * geometry.second_derivative_bound(&from, &to) / f64::from(PARTS)
}

/// First and second derivatives of the motors by `s`, at a piece's own parameter `t`, where the pose is `pose`.
fn motor_derivatives(machine: &Machine, piece: &Piece, t: f64, pose: &JointPos) -> (MotorPos, MotorPos) {
    let (velocity, acceleration) = piece.curve.derivatives(t);
    machine.motor_derivatives(pose, piece.rate * velocity, piece.rate * piece.rate * acceleration)
}

/// Third derivatives, likewise.
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
        let normal_second_derivative = velocity.cross(acceleration).abs() / pen_speed;
        let geometry = machine.geometry();
        let (rates, _) = geometry.path_derivatives(pose, velocity, acceleration);
        let (first, second) = machine.motor_derivatives(pose, velocity, acceleration);
        // Along a straight line an uneven parameter bends nothing; on a turn all of p'' may.
        let bending =
            if matches!(piece.curve, Segment::Line(_)) { 0.0 } else { acceleration.hypot2().sqrt() };
        let second_derivative_bound = bending + geometry.second_derivative_bound(pose, &(*pose + rates));
        Self { first, second, pen_speed, normal_second_derivative, second_derivative_bound }
    }
}

/// How far the motors' derivatives in the middle are from the mean of the ends, as a share of what limits the pen:
/// speeds over the motors' limits, accelerations over theirs at the largest speed that could be reached here.
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
