//! Row by row: what the table says about time, pen and poses, and the two paths it draws.

use drawing::{Drawing, Point};
use kinematics::{JointPos, Machine, MotorPos};
use plan::{Header, MOTORS, Row};

use crate::{
    Certificate, Deviation, Location, PenMotion, TickFloor, Violation,
    failure::Failures,
    limits::{Excess, MotorCheck},
    target::Target,
    trace::{At, Trace},
};

/// An arm's path between two rows is followed by chords within this share of the tolerance; the rest is added.
const BULGE: f64 = 1.0 / 200.0;
/// Chords between two rows, at most; what is left of the bulge is added all the same.
const MOST_CHORDS: f64 = 10_000.0;
/// The tick floor is evaluated again whenever the pen has drawn so far, mm.
const FLOOR_STEP: f64 = 0.5;
/// What computing a distance may cost, mm and as a share.
const ROUNDING: (f64, f64) = (1e-9, 1e-6);

/// Where the motors hold the pen.
#[derive(Clone, Copy, Debug)]
struct Pose {
    joints: JointPos,
    point: Point,
}

#[derive(Clone, Copy, Debug)]
struct Previous {
    row: Row,
    index: u64,
    ticks: Pose,
    exact: Option<Pose>,
}

/// Time that the pen needs for its own movement.
#[derive(Clone, Copy, Debug)]
struct PenEvent {
    motion: PenMotion,
    pen: u16,
    until_us: u64,
}

/// Replays a plan row by row; see the crate's documentation.
#[derive(Clone, Debug)]
pub struct Verifier<'a> {
    machine: &'a Machine,
    tolerance: f64,
    park: [i64; MOTORS],
    /// How far half a tick on every motor may carry each joint out of its range.
    joint_slack: JointPos,
    target: Target,
    motors: [MotorCheck; MOTORS],
    failures: Failures,
    rows: u64,
    previous: Option<Previous>,
    event: Option<PenEvent>,
    /// For how much of a lift's time the header lets the motors travel.
    lift_overlap_us: u64,
    pens: Vec<u16>,
    follows: bool,
    after: Trace,
    before: Option<Trace>,
    largest_rounding: f64,
    floor: Floor,
    travel_mm: f64,
    pen_downs: u64,
}

/// A row, and the motor positions it was rounded from where they are known.
pub type ExactRow = (Row, Option<[f64; MOTORS]>);

/// Certifies a whole table, whose rows can be had more than once: measured fast at first, and once more in full if it
/// does not hold, so that no good plan is refused.
///
/// Arguments are those of [`Verifier::new`]; `rows` begins anew at each call.
pub fn certify<I: Iterator<Item = ExactRow>>(
    machine: &Machine,
    drawing: &Drawing,
    header: &Header,
    tolerance_mm: f64,
    mut rows: impl FnMut() -> I,
) -> Certificate {
    let mut measure = |follows: bool| {
        let mut verifier = Verifier::with(machine, drawing, header, tolerance_mm, follows);
        rows().for_each(|(row, exact)| verifier.row(row, exact));
        verifier.finish()
    };
    let certificate = measure(true);
    if certificate.holds { certificate } else { measure(false) }
}

impl<'a> Verifier<'a> {
    /// A verifier for one plan of `drawing` (as placed, machine mm) on `machine`. `header` gives the period and the
    /// motors' limits; `tolerance_mm` is what the plan claims to keep.
    pub fn new(machine: &'a Machine, drawing: &Drawing, header: &Header, tolerance_mm: f64) -> Self {
        Self::with(machine, drawing, header, tolerance_mm, false)
    }

    /// The same; if it `follows`, crowded drawings are measured faster, and what fails may yet be good.
    fn with(
        machine: &'a Machine,
        drawing: &Drawing,
        header: &Header,
        tolerance_mm: f64,
        follows: bool,
    ) -> Self {
        // Lengths follow the tolerance; without a sensible one the plan is still measured, and cannot hold.
        let scale = if tolerance_mm > 1e-6 { tolerance_mm.min(1e3) } else { 1e-6 };
        let target = Target::new(drawing, scale);
        let start = machine.motor_positions(&machine.start());
        let mut failures = Failures::default();
        for &stroke in &target.broken {
            let source = target.sources.get(stroke).copied();
            let location = Location { stroke: Some(stroke), source, ..Location::default() };
            failures.note(Violation::NotFinite, 0, 0.0, location);
        }
        let half_tick =
            [MotorPos::new(0.5, 0.0), MotorPos::new(0.0, 0.5)].map(|tick| machine.joint_rates(&tick));
        Self {
            machine,
            tolerance: tolerance_mm,
            park: [start[0].round() as i64, start[1].round() as i64],
            joint_slack: half_tick[0].abs() + half_tick[1].abs(),
            motors: header.motors.clone().map(|motor| MotorCheck::new(motor, header.period_us)),
            failures,
            rows: 0,
            previous: None,
            event: None,
            lift_overlap_us: header.lift_overlap_us,
            pens: Vec::new(),
            follows,
            after: Trace::new(&target, scale, machine.quantization_error(&machine.start()), follows),
            before: None,
            target,
            largest_rounding: 0.0,
            floor: Floor::default(),
            travel_mm: 0.0,
            pen_downs: 0,
        }
    }

    /// Lets the plan end at `ticks` instead of the machine's start pose.
    pub fn allow_park(&mut self, ticks: [i64; MOTORS]) {
        self.park = ticks;
    }

    /// The next row, and the motor positions it was rounded from where the caller has them. They should come with every
    /// row or with none: the path before rounding is measured only as long as all rows have them.
    pub fn row(&mut self, row: Row, exact: Option<[f64; MOTORS]>) {
        let index = self.rows;
        self.rows += 1;
        let here = Location { row: Some(index), t_us: Some(row.t_us), ..Location::default() };
        match &self.previous {
            None if row.t_us != 0 => {
                self.failures.note(Violation::TimeStart { t_us: row.t_us }, 0, 0.0, here);
            }
            Some(previous) if row.t_us <= previous.row.t_us => {
                let before_us = previous.row.t_us;
                self.failures.note(Violation::Time { before_us, t_us: row.t_us }, 0, 0.0, here);
                return;
            }
            _ => {}
        }
        let previous = self.previous;
        let ticks = match previous {
            Some(previous) if previous.row.ticks == row.ticks => previous.ticks,
            _ => self.pose(row.ticks.map(|ticks| ticks as f64)),
        };
        let exact_pose = exact.map(|exact| self.pose(exact));
        let finite = |pose: &Pose| pose.point.is_finite() && pose.joints.is_finite();
        if !finite(&ticks) || exact_pose.as_ref().is_some_and(|pose| !finite(pose)) {
            self.failures.note(Violation::NotFinite, 0, 0.0, here);
            return;
        }
        self.check_joints(&ticks, here);
        self.check_rounding(row, exact, here);
        let current = Previous { row, index, ticks, exact: exact_pose };
        match previous {
            None => self.first(&current, here),
            Some(previous) => {
                if exact.is_none() {
                    self.before = None;
                }
                self.step(&previous, &current);
            }
        }
        self.pen(previous.map_or(0, |previous| previous.row.pen), &current);
        self.previous = Some(current);
    }

    fn pose(&self, ticks: [f64; MOTORS]) -> Pose {
        let joints = self.machine.joint_positions(&MotorPos::new(ticks[0], ticks[1]));
        Pose { joints, point: self.machine.mechanism().forward(&joints) }
    }

    fn check_joints(&mut self, pose: &Pose, here: Location) {
        let joints = &self.machine.parts().joints;
        let mut forgiven = pose.joints;
        for index in 0..MOTORS {
            let (value, slack) = (pose.joints[index], self.joint_slack[index]);
            let inside = value.clamp(joints[index].min, joints[index].max);
            forgiven[index] = value + (inside - value).clamp(-slack, slack);
        }
        if let Some(fault) = self.machine.joint_fault_between(&forgiven) {
            let location = Location { point_mm: Some(pose.point), ..here };
            self.failures.note(Violation::Joint { fault }, 0, 0.0, location);
        }
    }

    fn check_rounding(&mut self, row: Row, exact: Option<[f64; MOTORS]>, here: Location) {
        let Some(exact) = exact else { return };
        for (index, motor) in self.motors.iter().enumerate() {
            let by = (row.ticks[index] as f64 - exact[index]).abs();
            self.largest_rounding = self.largest_rounding.max(by);
            if by > 0.5 + 1e-6 {
                self.failures.note(
                    Violation::Drift { motor: motor.name().to_owned(), by_ticks: by },
                    index,
                    by,
                    here,
                );
            }
        }
    }

    fn first(&mut self, current: &Previous, here: Location) {
        let start = self.machine.motor_positions(&self.machine.start());
        let expected = [start[0].round() as i64, start[1].round() as i64];
        let Row { pen, ticks: found, .. } = current.row;
        if found != expected {
            let location = Location { point_mm: Some(current.ticks.point), ..here };
            self.failures.note(Violation::StartPose { found, expected }, 0, 0.0, location);
        }
        if pen != 0 {
            self.failures.note(Violation::PenAtStart { pen }, 0, 0.0, here);
        }
        if current.exact.is_some() {
            self.before = Some(Trace::new(&self.target, self.after.tolerance(), 0.0, self.follows));
        }
    }

    /// The motion from one row to the next.
    fn step(&mut self, previous: &Previous, current: &Previous) {
        let (before, row) = (previous.row, current.row);
        let dt_us = row.t_us - before.t_us;
        let here = Location {
            row: Some(previous.index),
            t_us: Some(before.t_us),
            point_mm: Some(previous.ticks.point),
            ..Location::default()
        };
        let mut moves = false;
        for motor in 0..MOTORS {
            let difference = row.ticks[motor].saturating_sub(before.ticks[motor]);
            moves |= difference != 0;
            let (fast, sudden) = self.motors[motor].step(dt_us, difference);
            if let Some(excess) = fast {
                let limit = self.motors[motor].limits().speed;
                let violation = Violation::Speed {
                    motor: self.motors[motor].name().to_owned(),
                    speed_ticks_s: excess.value,
                    allowed_ticks_s: excess.allowed,
                    limit_ticks_s: limit,
                };
                self.failures.note(violation, motor, excess.share(), here);
            }
            if let Some(excess) = sudden {
                let violation = if previous.index == 0 {
                    Violation::RestAtStart {
                        motor: self.motors[motor].name().to_owned(),
                        share: excess.share(),
                    }
                } else {
                    self.acceleration(motor, excess)
                };
                self.failures.note(violation, motor, excess.share(), here);
            }
            if let Some(excess) = self.motors[motor].jerk(dt_us, difference) {
                self.failures.note(self.jerk(motor, excess), motor, excess.share(), here);
            }
        }
        if let Some(event) = self.event.filter(|event| moves && before.t_us < event.until_us) {
            let early_us = event.until_us - before.t_us;
            let violation = Violation::MovesDuringPen { motion: event.motion, pen: event.pen, early_us };
            self.failures.note(violation, 0, early_us as f64, here);
        }
        if before.pen == 0 {
            if moves {
                let (from, to) = (previous.ticks.point, current.ticks.point);
                self.travel_mm += libm::hypot(to.x - from.x, to.y - from.y);
            }
            return;
        }
        let at = At { row: previous.index, t_us: before.t_us };
        if moves {
            self.draw_floor(&current.ticks);
            draw(&mut self.after, &self.target, self.machine, &previous.ticks, &current.ticks, at);
        }
        if let (Some(trace), Some(from), Some(to)) = (&mut self.before, &previous.exact, &current.exact) {
            draw(trace, &self.target, self.machine, from, to, at);
        }
    }

    fn acceleration(&self, motor: usize, excess: Excess) -> Violation {
        Violation::Acceleration {
            motor: self.motors[motor].name().to_owned(),
            acceleration_ticks_s2: excess.value,
            allowed_ticks_s2: excess.allowed,
            limit_ticks_s2: self.motors[motor].limits().acceleration,
        }
    }

    fn jerk(&self, motor: usize, excess: Excess) -> Violation {
        Violation::Jerk {
            motor: self.motors[motor].name().to_owned(),
            jerk_ticks_s3: excess.value,
            allowed_ticks_s3: excess.allowed,
            limit_ticks_s3: self.motors[motor].limits().jerk.unwrap_or_default(),
        }
    }

    fn draw_floor(&mut self, pose: &Pose) {
        if self.floor.follow(self.machine, pose) {
            self.after.widen(self.floor.worst_mm);
        }
    }

    /// The pen that holds from this row on.
    fn pen(&mut self, before: u16, current: &Previous) {
        let (pen, t_us) = (current.row.pen, current.row.t_us);
        if pen == before {
            return;
        }
        let lift = self.machine.pen();
        let (motion, time_s) = match (before, pen) {
            (_, 0) => (PenMotion::Lift, lift.lift_time_s),
            (0, _) => (PenMotion::Drop, lift.drop_time_s),
            _ => (PenMotion::Change, lift.lift_time_s + lift.drop_time_s),
        };
        // A planner may have cut the time to whole microseconds; 150000 must not become 150001 by a rounding error.
        let time_us = (time_s * 1e6 + 1e-3).floor() as u64;
        let overlap_us = if motion == PenMotion::Lift { self.lift_overlap_us } else { 0 };
        let until_us = t_us.saturating_add(time_us.saturating_sub(overlap_us));
        self.event = Some(PenEvent { motion, pen: if pen == 0 { before } else { pen }, until_us });
        self.lift();
        if pen == 0 {
            return;
        }
        self.pen_downs += 1;
        if !self.pens.contains(&pen) {
            self.pens.push(pen);
        }
        self.floor.begin(self.machine, &current.ticks);
        self.after.widen(self.floor.worst_mm);
        let at = At { row: current.index, t_us };
        let Some(target) = self.target.pen(pen) else {
            let location = Location {
                row: Some(at.row),
                t_us: Some(t_us),
                point_mm: Some(current.ticks.point),
                ..Location::default()
            };
            self.failures.note(Violation::ForeignPen { pen }, usize::from(pen), 0.0, location);
            return;
        };
        self.after.down(target, current.ticks.point, at);
        if let (Some(trace), Some(exact)) = (&mut self.before, &current.exact) {
            trace.down(target, exact.point, at);
        }
    }

    fn lift(&mut self) {
        self.after.up(&self.target);
        if let Some(trace) = &mut self.before {
            trace.up(&self.target);
        }
    }

    /// What the rows add up to, the last one having been handed in.
    pub fn finish(mut self) -> Certificate {
        self.lift();
        match self.previous {
            None => self.failures.note(Violation::Empty, 0, 0.0, Location::default()),
            Some(last) => self.last(&last),
        }
        let tick_floor = self.floor.result();
        let allowed = |mm: f64| mm * (1.0 + ROUNDING.1) + ROUNDING.0;
        let before_allowed = self.tolerance;
        let after_allowed = self.tolerance + tick_floor.worst_mm;
        let before_rounding = self.before.take().map(|trace| {
            let deviation =
                deviation(&trace, &self.target, &mut self.failures, before_allowed, &allowed, false);
            (deviation, trace)
        });
        let after_rounding =
            deviation(&self.after, &self.target, &mut self.failures, after_allowed, &allowed, true);
        let ink = before_rounding.as_ref().map_or(&self.after, |(_, trace)| trace);
        let (ink_mm, dots) = (ink.length, ink.dots);
        let failures = self.failures.into_vec();
        Certificate {
            holds: failures.is_empty(),
            failures,
            tolerance_mm: self.tolerance,
            largest_rounding_ticks: before_rounding.as_ref().map(|_| self.largest_rounding),
            before_rounding: before_rounding.map(|(deviation, _)| deviation),
            after_rounding,
            tick_floor,
            pens: self.pens,
            motors: self.motors.map(MotorCheck::peak),
            rows: self.rows,
            duration_us: self.previous.map_or(0, |last| last.row.t_us),
            ink_mm,
            travel_mm: self.travel_mm,
            pen_downs: self.pen_downs,
            dots,
        }
    }

    fn last(&mut self, last: &Previous) {
        let here = Location {
            row: Some(last.index),
            t_us: Some(last.row.t_us),
            point_mm: Some(last.ticks.point),
            ..Location::default()
        };
        for motor in 0..MOTORS {
            if let Some(excess) = self.motors[motor].stop() {
                let name = self.motors[motor].name().to_owned();
                let violation = Violation::RestAtEnd { motor: name, share: excess.share() };
                self.failures.note(violation, motor, excess.share(), here);
            }
            if let Some(excess) = self.motors[motor].jerk_of_stop() {
                self.failures.note(self.jerk(motor, excess), motor, excess.share(), here);
            }
        }
        let Row { pen, ticks: found, .. } = last.row;
        if pen != 0 {
            self.failures.note(Violation::PenAtEnd { pen }, 0, 0.0, here);
        }
        if found != self.park {
            self.failures.note(Violation::ParkPose { found, expected: self.park }, 0, 0.0, here);
        }
    }
}

/// Follows the pen while every motor moves evenly from one pose to the other.
///
/// The joints then move evenly too. Over the whole step the path's second derivative is `B = bend(from, to)` long at the
/// most; over one of `n` equal parts it is `B / n²`, and the path leaves that part's chord by `B / (8 n²)` at the most.
fn draw(trace: &mut Trace, target: &Target, machine: &Machine, from: &Pose, to: &Pose, at: At) {
    let geometry = machine.mechanism();
    let bulge = geometry.second_derivative_bound(&from.joints, &to.joints) / 8.0;
    let allowed = trace.tolerance() * BULGE;
    if bulge <= allowed {
        trace.to(target, to.point, bulge, at);
        return;
    }
    let parts = (bulge / allowed).sqrt().ceil().min(MOST_CHORDS);
    let error = bulge / (parts * parts);
    for part in 1..parts as usize {
        let joints = from.joints + (to.joints - from.joints) * (part as f64 / parts);
        trace.to(target, geometry.forward(&joints), error, at);
    }
    trace.to(target, to.point, error, at);
}

/// Measures one path in full and notes what is beyond the allowed distance.
fn deviation(
    trace: &Trace,
    target: &Target,
    failures: &mut Failures,
    allowed_mm: f64,
    forgive: &impl Fn(f64) -> f64,
    rounded: bool,
) -> Deviation {
    let limit = forgive(allowed_mm);
    if let Some((pen, distance_mm, location)) = trace.worst_ink(target) {
        // Not a number is not within the limit either.
        let within = distance_mm <= limit;
        if !within {
            let violation = Violation::Deviates { pen, rounded, distance_mm, allowed_mm };
            failures.note(violation, usize::from(rounded), 0.0, location);
        }
    }
    let (drawing_to_ink, uncovered) = trace.drawing_to_ink(target, limit);
    for part in uncovered {
        let violation = Violation::Uncovered {
            pen: part.pen,
            rounded,
            distance_mm: part.mm,
            is_lower_bound: part.is_lower_bound,
            allowed_mm,
            uncovered_mm: part.length,
            strokes: part.strokes,
        };
        failures.note(violation, 2 * usize::from(part.pen) + usize::from(rounded), 0.0, part.location);
    }
    Deviation { ink_to_drawing: trace.ink_to_drawing(), drawing_to_ink }
}

/// The tick floor along the ink, evaluated every half millimetre.
#[derive(Clone, Debug, Default)]
struct Floor {
    at: Option<Point>,
    worst_mm: f64,
    squares: f64,
    weight: f64,
}

impl Floor {
    /// The pen goes down here.
    fn begin(&mut self, machine: &Machine, pose: &Pose) {
        // A dot counts for something, but next to nothing beside ink that has a length.
        self.add(machine, pose, 1e-6);
    }

    /// The pen has drawn up to here; whether the floor was evaluated.
    fn follow(&mut self, machine: &Machine, pose: &Pose) -> bool {
        let Some(point) = self.at else { return false };
        let gone = libm::hypot(pose.point.x - point.x, pose.point.y - point.y);
        if gone < FLOOR_STEP {
            return false;
        }
        self.add(machine, pose, gone);
        true
    }

    fn add(&mut self, machine: &Machine, pose: &Pose, weight: f64) {
        let worst = machine.quantization_error(&pose.joints);
        let square: f64 = [MotorPos::new(1.0, 0.0), MotorPos::new(0.0, 1.0)]
            .map(|tick| machine.mechanism().pen_velocity(&pose.joints, &machine.joint_rates(&tick)).hypot2())
            .iter()
            .sum();
        self.at = Some(pose.point);
        self.worst_mm = self.worst_mm.max(worst);
        self.squares += weight * square / 12.0;
        self.weight += weight;
    }

    fn result(&self) -> TickFloor {
        let mean = if self.weight > 0.0 { self.squares / self.weight } else { 0.0 };
        TickFloor { worst_mm: self.worst_mm, rms_mm: mean.sqrt() }
    }
}
