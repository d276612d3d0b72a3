//! Row by row: what the table says about time, pen and poses, and the two paths that it draws.

use drawing::{Drawing, Point};
use kinematics::{JointPos, Machine, MotorPos, Play};
use plan::{Header, MOTORS, Rounding, Row};

use crate::{
    Certificate, Deviation, Location, PenMotion, Violation,
    failure::Failures,
    jerk::JerkCheck,
    limits::{Excess, MotorCheck},
    quantization::Quantization,
    run::At,
    target::Target,
    trace::Trace,
};

/// Chord error with which the pen's path between two rows is followed, as a share of the tolerance.
/// It is added to what is measured.
const CHORD_ERROR: f64 = 1.0 / 200.0;
/// Largest number of chords between two rows. A larger chord error is still added.
const MOST_CHORDS: f64 = 10_000.0;
/// Allowance for rounding in a computed distance: mm, and as a share.
const ROUNDING: (f64, f64) = (1e-9, 1e-6);

/// Motor positions as joint positions and pen position.
#[derive(Clone, Copy, Debug)]
struct Pose {
    joints: JointPos,
    point: Point,
}

/// Poses between two rows, in the order of time.
type Corners = [Option<Pose>; MOTORS];

#[derive(Clone, Copy, Debug)]
struct Previous {
    row: Row,
    index: u64,
    ticks: Pose,
    exact: Option<Pose>,
    /// Where the pen is when a motor has taken up its backlash on the way to this row: by ticks, and by
    /// exact positions.
    corners: [Corners; 2],
    /// Exact motor positions, where known.
    exact_ticks: Option<[f64; MOTORS]>,
}

/// Limit checks of one motor's exact positions.
#[derive(Clone, Debug)]
struct ExactCheck {
    motor: MotorCheck,
    jerk: Option<JerkCheck>,
}

impl ExactCheck {
    fn new(motor: &kinematics::Motor, period_us: u64) -> Self {
        Self {
            motor: MotorCheck::exact(motor.clone(), period_us),
            jerk: motor.max_jerk_ticks_s3.map(|limit| JerkCheck::exact(limit, period_us)),
        }
    }

    fn step(&mut self, dt_us: u64, difference: f64) {
        self.motor.step(dt_us, difference);
        if let Some(jerk) = &mut self.jerk {
            jerk.step(dt_us, difference);
        }
    }

    fn stop(&mut self) {
        self.motor.stop();
        if let Some(jerk) = &mut self.jerk {
            jerk.stop();
        }
    }
}

/// A movement of the pen itself.
#[derive(Clone, Copy, Debug)]
struct PenEvent {
    motion: PenMotion,
    pen: u16,
    until_us: u64,
}

/// What a verifier takes from a plan's header. All limits are those of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// Time between two rows while a motor moves, us.
    pub period_us: u64,
    /// Part of the lift time in which the motors may already travel, us.
    pub lift_overlap_us: u64,
    /// How far rows may be from exact positions.
    pub rounding: Rounding,
}

impl From<&Header> for Timing {
    fn from(header: &Header) -> Self {
        let Header { period_us, lift_overlap_us, rounding, .. } = *header;
        Self { period_us, lift_overlap_us, rounding }
    }
}

/// Replays a plan row by row; see the documentation of the crate.
#[derive(Clone, Debug)]
pub struct Verifier<'a> {
    machine: &'a Machine,
    tolerance: f64,
    timing: Timing,
    /// Ticks of the start pose, where a plan starts and ends.
    start: [i64; MOTORS],
    /// Joint displacement of half a tick on every motor: allowed beyond the joint limits.
    joint_slack: JointPos,
    target: Target,
    motors: [MotorCheck; MOTORS],
    /// For motors with a jerk limit.
    jerk: [Option<JerkCheck>; MOTORS],
    /// Of the exact positions, while all rows came with them.
    exact: Option<[ExactCheck; MOTORS]>,
    failures: Failures,
    rows: u64,
    previous: Option<Previous>,
    /// The loads of motors with backlash, by ticks and by exact positions; `None` without backlash, and
    /// before the first row.
    plays: [Option<Play>; 2],
    event: Option<PenEvent>,
    pens: Vec<u16>,
    follows: bool,
    /// The path of the whole ticks.
    after: Trace,
    /// The path of the exact motor positions.
    before: Option<Trace>,
    largest_rounding: f64,
    largest_shift_mm: f64,
    quantization: Quantization,
    travel_mm: f64,
    pen_downs: u64,
}

/// A row, and the motor positions it was rounded from if they are known.
pub type ExactRow = (Row, Option<[f64; MOTORS]>);

/// Certifies a whole table whose rows can be generated twice.
///
/// The first measurement is fast and may fail a good plan where many strokes are close; if it
/// fails, the table is measured again in full. Arguments are those of [`Verifier::new`]; `rows`
/// starts from the beginning at each call.
pub fn certify<I: Iterator<Item = ExactRow>>(
    machine: &Machine,
    drawing: &Drawing,
    timing: impl Into<Timing>,
    tolerance_mm: f64,
    rows: impl FnMut() -> I,
) -> Certificate {
    certify_with_progress(machine, drawing, timing, tolerance_mm, rows, &|_| {})
}

/// As [`certify`]; before the rows are asked for, `indexed` is called now and then with the number of
/// strokes of the drawing that have been read.
pub fn certify_with_progress<I: Iterator<Item = ExactRow>>(
    machine: &Machine,
    drawing: &Drawing,
    timing: impl Into<Timing>,
    tolerance_mm: f64,
    mut rows: impl FnMut() -> I,
    indexed: &dyn Fn(usize),
) -> Certificate {
    let timing = timing.into();
    let mut measure = |follows: bool| {
        let mut verifier = Verifier::with(machine, drawing, timing, tolerance_mm, follows, indexed);
        rows().for_each(|(row, exact)| verifier.row(row, exact));
        verifier.finish()
    };
    let certificate = measure(true);
    if certificate.holds { certificate } else { measure(false) }
}

impl<'a> Verifier<'a> {
    /// A verifier for one plan of `drawing` (as placed, machine mm) on `machine`.
    ///
    /// The limits of motors, joints and pen are those of `machine`. `timing` is taken from the
    /// plan, and checked against its rows. `tolerance_mm` is the deviation that the plan may have.
    pub fn new(
        machine: &'a Machine,
        drawing: &Drawing,
        timing: impl Into<Timing>,
        tolerance_mm: f64,
    ) -> Self {
        Self::with(machine, drawing, timing.into(), tolerance_mm, false, &|_| {})
    }

    /// With `follows`, crowded drawings are measured faster, and a failure may be wrong.
    fn with(
        machine: &'a Machine,
        drawing: &Drawing,
        timing: Timing,
        tolerance_mm: f64,
        follows: bool,
        indexed: &dyn Fn(usize),
    ) -> Self {
        // Resolutions depend on the tolerance. A plan with an unusable one is still measured, but
        // cannot hold.
        let scale = if tolerance_mm > 1e-6 { tolerance_mm.min(1e3) } else { 1e-6 };
        let target = Target::new(drawing, scale, indexed);
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
            timing,
            start: [start[0].round() as i64, start[1].round() as i64],
            joint_slack: half_tick[0].abs() + half_tick[1].abs(),
            motors: machine.motors().clone().map(|motor| MotorCheck::new(motor, timing.period_us)),
            jerk: machine
                .motors()
                .each_ref()
                .map(|motor| motor.max_jerk_ticks_s3.map(|limit| JerkCheck::new(limit, timing.period_us))),
            exact: Some(machine.motors().each_ref().map(|motor| ExactCheck::new(motor, timing.period_us))),
            failures,
            rows: 0,
            previous: None,
            plays: [None; 2],
            event: None,
            pens: Vec::new(),
            follows,
            after: Trace::new(&target, scale, machine.quantization_error(&machine.start()), follows),
            before: None,
            target,
            largest_rounding: 0.0,
            largest_shift_mm: 0.0,
            quantization: Quantization::default(),
            travel_mm: 0.0,
            pen_downs: 0,
        }
    }

    /// Adds the next row, and the motor positions that it was rounded from if they are known.
    ///
    /// The path before rounding is measured only if all rows come with exact positions.
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
        let (ticks, by_ticks) = match previous {
            Some(previous) if previous.row.ticks == row.ticks => (previous.ticks, Corners::default()),
            _ => self.load(0, row.ticks.map(|ticks| ticks as f64)),
        };
        let of_exact = exact.map(|exact| self.load(1, exact));
        let exact_pose = of_exact.map(|(pose, _)| pose);
        let corners = [by_ticks, of_exact.map_or_else(Corners::default, |(_, corners)| corners)];
        let finite = |pose: &Pose| pose.point.is_finite() && pose.joints.is_finite();
        if !finite(&ticks) || exact_pose.as_ref().is_some_and(|pose| !finite(pose)) {
            self.failures.note(Violation::NotFinite, 0, 0.0, here);
            return;
        }
        self.check_joints(&ticks, here);
        self.check_rounding(row, exact, here);
        if let (Some(exact), true) = (&exact_pose, row.pen != 0) {
            let shift = ticks.point - exact.point;
            self.largest_shift_mm = self.largest_shift_mm.max(shift.hypot2().sqrt());
        }
        let current = Previous { row, index, ticks, exact: exact_pose, corners, exact_ticks: exact };
        if exact.is_none() {
            self.exact = None;
        }
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

    /// The pose at the next motor positions, and those on the way: of the motors, or of their loads where
    /// there is backlash.
    fn load(&mut self, which: usize, motors: [f64; MOTORS]) -> (Pose, Corners) {
        if !self.machine.has_backlash() {
            return (self.pose(motors), Corners::default());
        }
        let play = self.plays[which].get_or_insert_with(|| Play::new(self.machine, motors));
        let corners = play.follow(motors);
        let loads = play.loads();
        (self.pose(loads), corners.map(|corner| corner.map(|loads| self.pose(loads))))
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
        for (motor, (ticks, exact)) in row.ticks.into_iter().zip(exact).enumerate() {
            let by_ticks = (ticks as f64 - exact).abs();
            self.largest_rounding = self.largest_rounding.max(by_ticks);
            let allowed_ticks = self.timing.rounding.farthest_ticks();
            if by_ticks > allowed_ticks + 1e-6 {
                let violation = Violation::Drift { motor: self.motor_name(motor), by_ticks, allowed_ticks };
                self.failures.note(violation, motor, by_ticks, here);
            }
        }
    }

    fn first(&mut self, current: &Previous, here: Location) {
        let Row { pen, ticks: found, .. } = current.row;
        if found != self.start {
            let location = Location { point_mm: Some(current.ticks.point), ..here };
            let violation = Violation::StartPose { found, expected: self.start };
            self.failures.note(violation, 0, 0.0, location);
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
            self.check_limits(motor, dt_us, difference as f64, here);
            if let (Some(exact), Some(from), Some(to)) =
                (&mut self.exact, previous.exact_ticks, current.exact_ticks)
            {
                exact[motor].step(dt_us, to[motor] - from[motor]);
            }
        }
        if moves && dt_us < self.timing.period_us {
            let violation = Violation::Period { dt_us, period_us: self.timing.period_us };
            self.failures.note(violation, 0, 1.0 / dt_us as f64, here);
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
            self.update_quantization(&current.ticks);
            let [corners, _] = &current.corners;
            draw_via(
                &mut self.after,
                &self.target,
                self.machine,
                [&previous.ticks, &current.ticks],
                corners,
                at,
            );
        }
        if let (Some(trace), Some(from), Some(to)) = (&mut self.before, &previous.exact, &current.exact) {
            draw_via(trace, &self.target, self.machine, [from, to], &current.corners[1], at);
        }
    }

    /// One motor's step against its limits.
    fn check_limits(&mut self, motor: usize, dt_us: u64, difference: f64, here: Location) {
        let (fast, sudden) = self.motors[motor].step(dt_us, difference);
        if let Some(excess) = fast {
            let violation = Violation::Speed {
                motor: self.motor_name(motor),
                speed_ticks_s: excess.value,
                allowed_ticks_s: excess.allowed,
                limit_ticks_s: self.machine.motors()[motor].max_speed_ticks_s,
            };
            self.failures.note(violation, motor, excess.share(), here);
        }
        if let Some(excess) = sudden {
            let violation = if here.row == Some(0) {
                Violation::RestAtStart { motor: self.motor_name(motor), share: excess.share() }
            } else {
                Violation::Acceleration {
                    motor: self.motor_name(motor),
                    acceleration_ticks_s2: excess.value,
                    allowed_ticks_s2: excess.allowed,
                    limit_ticks_s2: self.machine.motors()[motor].max_acceleration_ticks_s2,
                }
            };
            self.failures.note(violation, motor, excess.share(), here);
        }
        let excess = self.jerk[motor].as_mut().and_then(|jerk| jerk.step(dt_us, difference));
        self.note_jerk(motor, excess, here);
    }

    fn note_jerk(&mut self, motor: usize, excess: Option<Excess>, here: Location) {
        let (Some(excess), Some(jerk)) = (excess, &self.jerk[motor]) else { return };
        let violation = Violation::Jerk {
            motor: self.motor_name(motor),
            jerk_ticks_s3: excess.value,
            allowed_ticks_s3: excess.allowed,
            limit_ticks_s3: jerk.limit(),
        };
        self.failures.note(violation, motor, excess.share(), here);
    }

    fn motor_name(&self, motor: usize) -> String {
        self.machine.motors()[motor].name.clone()
    }

    fn update_quantization(&mut self, pose: &Pose) {
        if self.quantization.follow(self.machine, &pose.joints, pose.point) {
            self.after.widen(self.quantization.worst_mm());
        }
    }

    /// Handles a change of the pen at this row.
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
        // Whole microseconds, rounded down: a rounding error must not make 150001 of 150000.
        let time_us = (time_s * 1e6 + 1e-3).floor() as u64;
        let overlap_us = if motion == PenMotion::Lift { self.timing.lift_overlap_us } else { 0 };
        let until_us = t_us.saturating_add(time_us.saturating_sub(overlap_us));
        self.event = Some(PenEvent { motion, pen: if pen == 0 { before } else { pen }, until_us });
        self.end_strokes();
        if pen == 0 {
            return;
        }
        self.pen_downs += 1;
        if !self.pens.contains(&pen) {
            self.pens.push(pen);
        }
        self.quantization.begin(self.machine, &current.ticks.joints, current.ticks.point);
        self.after.widen(self.quantization.worst_mm());
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

    fn end_strokes(&mut self) {
        self.after.up(&self.target);
        if let Some(trace) = &mut self.before {
            trace.up(&self.target);
        }
    }

    /// The certificate, after the last row.
    pub fn finish(mut self) -> Certificate {
        self.end_strokes();
        match self.previous {
            None => self.failures.note(Violation::Empty, 0, 0.0, Location::default()),
            Some(last) => self.last(&last),
        }
        let quantization_error = self.quantization.result();
        let allowed = |mm: f64| mm * (1.0 + ROUNDING.1) + ROUNDING.0;
        let before_allowed = self.tolerance;
        let after_allowed = self.tolerance + quantization_error.worst_mm;
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
        let (jerk, exact) = (self.jerk, self.exact);
        let mut index = 0..MOTORS;
        let motors = self.motors.map(|motor| {
            let index = index.next().unwrap_or_default();
            let exact = exact.as_ref().map(|exact| &exact[index]);
            let peak = |jerk: &JerkCheck| jerk.peak(exact.and_then(|exact| exact.jerk.as_ref()));
            motor.peak(exact.map(|exact| &exact.motor), jerk[index].as_ref().map(peak))
        });
        Certificate {
            holds: failures.is_empty(),
            failures,
            tolerance_mm: self.tolerance,
            rounding: self.timing.rounding,
            largest_rounding_ticks: before_rounding.as_ref().map(|_| self.largest_rounding),
            largest_shift_mm: before_rounding.as_ref().map(|_| self.largest_shift_mm),
            before_rounding: before_rounding.map(|(deviation, _)| deviation),
            after_rounding,
            quantization_error,
            pens: self.pens,
            motors,
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
                let violation = Violation::RestAtEnd { motor: self.motor_name(motor), share: excess.share() };
                self.failures.note(violation, motor, excess.share(), here);
            }
            let excess = self.jerk[motor].as_mut().and_then(JerkCheck::stop);
            self.note_jerk(motor, excess, here);
            if let Some(exact) = &mut self.exact {
                exact[motor].stop();
            }
        }
        let Row { pen, ticks: found, .. } = last.row;
        if pen != 0 {
            self.failures.note(Violation::PenAtEnd { pen }, 0, 0.0, here);
        }
        if found != self.start {
            self.failures.note(Violation::ParkPose { found, expected: self.start }, 0, 0.0, here);
        }
    }
}

/// Follows the pen from one pose to the other by way of the corners, linearly in between.
fn draw_via(
    trace: &mut Trace,
    target: &Target,
    machine: &Machine,
    [from, to]: [&Pose; 2],
    corners: &Corners,
    at: At,
) {
    let mut from = from;
    for corner in corners.iter().flatten() {
        draw(trace, target, machine, from, corner, at);
        from = corner;
    }
    draw(trace, target, machine, from, to, at);
}

/// Follows the pen while both motors move linearly from one pose to the other.
///
/// The joints then move linearly too. Over the whole step the second derivative of the path is at
/// most `B = second_derivative_bound(from, to)`; over one of `n` equal parts it is `B / n²`, so the
/// chord error of that part is at most `B / (8 n²)`.
fn draw(trace: &mut Trace, target: &Target, machine: &Machine, from: &Pose, to: &Pose, at: At) {
    let geometry = machine.mechanism();
    let chord_error = geometry.second_derivative_bound(&from.joints, &to.joints) / 8.0;
    let allowed = trace.tolerance() * CHORD_ERROR;
    if chord_error <= allowed {
        trace.to(target, to.point, chord_error, at);
        return;
    }
    let parts = (chord_error / allowed).sqrt().ceil().min(MOST_CHORDS);
    let error = chord_error / (parts * parts);
    for part in 1..parts as usize {
        let joints = from.joints + (to.joints - from.joints) * (part as f64 / parts);
        trace.to(target, geometry.forward(&joints), error, at);
    }
    trace.to(target, to.point, error, at);
}

/// The deviation of one path; notes failures beyond the allowed distance.
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
        // NaN is not within the limit.
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
