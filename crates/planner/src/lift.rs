//! Lifting the pen's path into joint space, adaptively, with bounds that hold between the nodes too.

use drawing::{Point, Segment, Vec2};
use kinematics::{Fault, Joints, Machine, OutOfReach};
use nalgebra::Vector2;

/// A path in joint space that can be followed without stopping: what a time law is laid upon.
///
/// The parameter `s` is the pen's arc length in mm (drawn paths) or the share of the way from 0 to 1 (travel). The path
/// is exact: positions come from the pen's own curve through the inverse kinematics, not from interpolation between
/// the cells' ends.
#[derive(Clone, Debug)]
pub struct JointPath {
    course: Course,
    /// The cells, in order, without gaps; at least one.
    pub cells: Vec<Cell>,
}

#[derive(Clone, Debug)]
enum Course {
    /// The pen follows these pieces.
    Drawn(Vec<Segment>),
    /// The joints go straight from one pose to the other; the pen is up.
    Travel(Joints, Joints),
}

/// A stretch of a joint path with bounds that hold everywhere on it.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Its length in the parameter `s`.
    pub length: f64,
    /// Bound on the size of each motor's first derivative by `s`, ticks per unit of `s`.
    pub first: Vector2<f64>,
    /// Bound on the size of each motor's second derivative by `s`.
    pub second: Vector2<f64>,
    /// Bound on how much the pen's path bends against linear joint motion, 1/mm: rows `h` mm apart on this cell leave
    /// the drawn curve by `h² bend / 8` at the most.
    pub bend: f64,
    /// Joints at the cell's start: the inverse is unwrapped to the turn nearest to it.
    pose: Joints,
    /// Index of the piece and the range of its own parameter.
    piece: usize,
    t0: f64,
    t1: f64,
    /// dt/ds at both ends.
    rate0: f64,
    rate1: f64,
}

/// Joints may change by no more than this over a cell, rad: no peak of a derivative can hide between its samples.
const LARGEST_TURN: f64 = 0.15;

/// How much the derivatives may vary over a cell, as a share of the largest.
const LARGEST_VARIATION: f64 = 0.05;

/// How far the interpolated rate dt/ds may be off in the middle of a cell, as a share of itself.
const LARGEST_MISMATCH: f64 = 1e-3;

/// Cells are not cut shorter than this, mm.
const SHORTEST: f64 = 1e-5;

/// The path and its derivatives at one place.
#[derive(Clone, Copy)]
struct Sample {
    t: f64,
    point: Point,
    pose: Joints,
    /// ds/dt
    speed: f64,
    first: Vector2<f64>,
    second: Vector2<f64>,
    /// Of the drawn curve, 1/mm.
    curvature: f64,
    /// See [`Cell::bend`].
    bend: f64,
}

impl JointPath {
    /// The straight way in joint space, along which all motors start and stop together. Nothing if there is no way to go.
    pub fn travel(machine: &Machine, from: Joints, to: Joints) -> Option<Self> {
        let change = machine.motor_rates(&(to - from));
        (change.amax() > 0.0).then(|| Self {
            course: Course::Travel(from, to),
            cells: vec![Cell {
                length: 1.0,
                first: change.abs(),
                second: Vector2::zeros(),
                bend: 0.0,
                pose: from,
                piece: 0,
                t0: 0.0,
                t1: 1.0,
                rate0: 1.0,
                rate1: 1.0,
            }],
        })
    }

    /// Lifts a smooth section of the drawing, beginning at `pose`, which must hold the pen at its first point.
    ///
    /// Cells are bisected until (1) linear joint motion over a cell would stay within `tolerance` mm of the curve, by
    /// the proved bound of [`kinematics::Geometry::bend`] plus the curve's own chord error; (2) no joint turns by more
    /// than 0.15 rad over it; (3) the motors' derivatives vary by no more than a twentieth over it, where they matter.
    ///
    /// # Errors
    /// When a point of it is out of reach, outside the joint limits or nearly singular.
    pub fn lift(
        machine: &Machine,
        section: Vec<Segment>,
        pose: Joints,
        tolerance: f64,
    ) -> Result<Self, OutOfReach> {
        let mut lifter = Lifter { machine, tolerance, cells: Vec::new() };
        let mut near = pose;
        for (index, piece) in section.iter().enumerate() {
            machine.check_segment(piece)?;
            near = lifter.piece(index, piece, near)?;
        }
        Ok(Self { course: Course::Drawn(section), cells: lifter.cells })
    }

    /// The joints `s` into the cell with the given index, exactly on the path.
    pub fn pose(&self, machine: &Machine, cell: usize, s: f64) -> Joints {
        let at = &self.cells[cell];
        match &self.course {
            Course::Travel(from, to) => {
                if s >= at.length {
                    *to
                } else {
                    from + s * (to - from)
                }
            }
            Course::Drawn(pieces) => {
                let point = pieces[at.piece].eval(at.parameter(s));
                // Reach was checked for the whole piece when it was lifted.
                machine.pose_near(point, &at.pose).unwrap_or(at.pose)
            }
        }
    }

    /// The joints at the path's end.
    pub fn end(&self, machine: &Machine) -> Joints {
        let last = self.cells.len() - 1;
        self.pose(machine, last, self.cells[last].length)
    }

    /// Length in units of `s`.
    pub fn length(&self) -> f64 {
        self.cells.iter().map(|cell| cell.length).sum()
    }
}

impl Cell {
    /// The piece's own parameter `s` mm into the cell: the cubic Hermite interpolant of t(s) with the exact rates
    /// dt/ds at both ends. The point it gives is on the curve whatever its error, which is of fourth order in the
    /// cell's length; for lines and circles it is the identity.
    fn parameter(&self, s: f64) -> f64 {
        let u = (s / self.length).clamp(0.0, 1.0);
        let rise = self.t1 - self.t0;
        let (m0, m1) = (self.rate0 * self.length, self.rate1 * self.length);
        let t = self.t0 + u * (m0 + u * (3.0 * rise - 2.0 * m0 - m1 + u * (m0 + m1 - 2.0 * rise)));
        t.clamp(self.t0, self.t1)
    }
}

struct Lifter<'a> {
    machine: &'a Machine,
    tolerance: f64,
    cells: Vec<Cell>,
}

impl Lifter<'_> {
    /// Lifts one piece and gives the pose at its end.
    fn piece(&mut self, index: usize, piece: &Segment, near: Joints) -> Result<Joints, OutOfReach> {
        // Curves begin with a few cells, so that the three samples of a cell cannot miss a whole wave.
        let parts = match piece {
            Segment::Line(_) => 1,
            Segment::Arc(arc) => (arc.sweep.abs() / 0.5).ceil().clamp(1.0, 1e6) as usize,
            Segment::Cubic(_) => 8,
        };
        let mut from = self.sample(piece, 0.0, near)?;
        for part in 1..=parts {
            let to = self.sample(piece, part as f64 / parts as f64, from.pose)?;
            self.cell(index, piece, from, to)?;
            from = to;
        }
        Ok(from.pose)
    }

    /// Adds the cells between two samples, bisecting as long as one cell would not do.
    fn cell(&mut self, index: usize, piece: &Segment, from: Sample, to: Sample) -> Result<(), OutOfReach> {
        // An explicit stack keeps the order and bounds the memory.
        let mut pending = vec![(from, to)];
        while let Some((a, b)) = pending.pop() {
            let middle = self.sample(piece, 0.5 * (a.t + b.t), a.pose)?;
            let length = arc_length(piece, &a, &middle, &b);
            let mismatch = rate_mismatch(piece, length, &a, &middle, &b);
            if length > SHORTEST && (mismatch > LARGEST_MISMATCH || !self.is_fine(length, &a, &middle, &b)) {
                pending.push((middle, b));
                pending.push((a, middle));
                continue;
            }
            // Only at a singular pose can a joint still jump over so short a way.
            if self.turned(&a, &b) > 1.0 {
                let min = self.machine.parts().min_dexterity;
                return Err(OutOfReach { point: b.point, fault: Fault::Singular { dexterity: 0.0, min } });
            }
            let variation = [middle.first - a.first, b.first - middle.first];
            let change = [middle.second - a.second, b.second - middle.second];
            // Between samples the derivatives can exceed the largest sample only around an extremum, by less than an
            // eighth of the change between neighbouring samples for anything near a parabola.
            let first = largest([a.first, middle.first, b.first]) + 0.25 * largest(variation);
            let second = largest([a.second, middle.second, b.second]) + 0.25 * largest(change);
            // Where t(s) is interpolated, the pen runs faster than meant by a share that rises from 0 at the ends to
            // about `mismatch` between them: a rate of change of 4 mismatch / length on the average, twice that at most.
            self.cells.push(Cell {
                length,
                first: first * (1.0 + 2.0 * mismatch),
                second: second * (1.0 + 4.0 * mismatch) + first * (8.0 * mismatch / length),
                bend: 1.05 * a.bend.max(middle.bend).max(b.bend),
                pose: a.pose,
                piece: index,
                t0: a.t,
                t1: b.t,
                rate0: 1.0 / a.speed,
                rate1: 1.0 / b.speed,
            });
        }
        Ok(())
    }

    /// The most that a joint turns from one sample to the other, rad.
    fn turned(&self, a: &Sample, b: &Sample) -> f64 {
        let angles = self.machine.geometry().joint_is_angle();
        let of = |k: usize| if angles[k] { (b.pose[k] - a.pose[k]).abs() } else { 0.0 };
        of(0).max(of(1))
    }

    fn is_fine(&self, length: f64, a: &Sample, middle: &Sample, b: &Sample) -> bool {
        if self.turned(a, b) > LARGEST_TURN {
            return false;
        }
        let geometry = self.machine.geometry();
        let curvature = a.curvature.max(middle.curvature).max(b.curvature);
        if (geometry.bend(&a.pose, &b.pose) + length * length * curvature) / 8.0 > self.tolerance {
            return false;
        }
        // Variation matters as a share of what limits the pen: speeds over the motors' limits, accelerations at the
        // largest speed that could be reached here.
        let motors = self.machine.motors();
        let samples = [a, middle, b];
        let over = |value: &dyn Fn(&Sample, usize) -> f64, limit: &dyn Fn(usize) -> f64| {
            let mut most = 0.0_f64;
            let mut spread = 0.0_f64;
            for k in 0..2 {
                let values = samples.map(|sample| value(sample, k) / limit(k));
                let (low, high) = values
                    .iter()
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
                most = most.max(high.abs()).max(low.abs());
                spread = spread.max(high - low);
            }
            (spread, most)
        };
        let (spread, slowness) = over(&|s, k| s.first[k], &|k| motors[k].max_speed);
        if spread > LARGEST_VARIATION * slowness {
            return false;
        }
        let fastest = self.machine.pen().max_speed.min(1.0 / slowness);
        let (spread, most) = over(&|s, k| s.second[k], &|k| motors[k].max_acceleration);
        spread <= LARGEST_VARIATION * most || spread * fastest * fastest <= LARGEST_VARIATION
    }

    fn sample(&self, piece: &Segment, t: f64, near: Joints) -> Result<Sample, OutOfReach> {
        let point = piece.eval(t);
        let out = |fault| OutOfReach { point, fault };
        let pose = self.machine.pose_near(point, &near).map_err(|unreachable| out(unreachable.into()))?;
        if let Some(fault) = self.machine.joint_fault_between(&pose) {
            return Err(out(fault));
        }
        let (velocity, acceleration) = piece.derivatives(t);
        let speed = velocity.hypot2().sqrt();
        let tangent = velocity / speed;
        // By arc length: p' = T, p'' = (a - (a.T) T) / speed².
        let curvature = (acceleration - acceleration.dot(tangent) * tangent) / (speed * speed);
        let curvature = if matches!(piece, Segment::Line(_)) { Vec2::ZERO } else { curvature };
        let (rates, _) = self.machine.geometry().path_derivatives(&pose, tangent, curvature);
        let (first, second) = self.machine.motor_derivatives(&pose, tangent, curvature);
        let turn = curvature.hypot2().sqrt();
        let bend = turn + self.machine.geometry().bend(&pose, &(pose + rates));
        Ok(Sample { t, point, pose, speed, first, second, curvature: turn, bend })
    }
}

/// Arc length between two samples: exact for lines and circles, Simpson's rule otherwise.
fn arc_length(piece: &Segment, a: &Sample, middle: &Sample, b: &Sample) -> f64 {
    match piece {
        Segment::Line(_) => {
            let along = b.point - a.point;
            libm::hypot(along.x, along.y)
        }
        _ => (b.t - a.t) * (a.speed + 4.0 * middle.speed + b.speed) / 6.0,
    }
}

/// How far the rate dt/ds of [`Cell::parameter`] is off in the middle of the cell, as a share of the true rate there.
///
/// The middle of the Hermite interpolant has the slope 3/2 (t1 - t0) / length - (rate0 + rate1) / 4.
fn rate_mismatch(piece: &Segment, length: f64, a: &Sample, middle: &Sample, b: &Sample) -> f64 {
    if matches!(piece, Segment::Line(_)) {
        return 0.0;
    }
    let slope = 1.5 * (b.t - a.t) / length - 0.25 * (1.0 / a.speed + 1.0 / b.speed);
    (slope * middle.speed - 1.0).abs()
}

/// The largest size of each component.
fn largest<const N: usize>(vectors: [Vector2<f64>; N]) -> Vector2<f64> {
    vectors.iter().fold(Vector2::zeros(), |most, v| most.sup(&v.abs()))
}
