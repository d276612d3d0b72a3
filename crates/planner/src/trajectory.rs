//! A whole plan: drawn sections, travel, pen lifts and drops one after the other, sampled into rows of ticks.

use drawing::{Drawing, Pen, Point, Stroke};
use kinematics::{Joints, Machine, OutOfReach, Unreachable};
use nalgebra::Vector2;
use plan::Row;

use crate::{
    PlanError,
    lift::{Course, JointPath},
    path::{Budget, sections},
    time_law::{Profile, SpeedCap, profile},
};

/// How a plan is made.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Largest distance between the drawing's ink and the pen's continuous path, both ways, mm.
    pub tolerance: f64,
    /// Time between rows, microseconds.
    pub period_us: u64,
    /// Where the plan ends, pen up and at rest; the machine's start pose if nothing is said.
    pub park: Option<Joints>,
    /// Speeds of single pens, mm/s, where they are to be slower than the machine's pen may be.
    pub pen_speeds: Vec<(Pen, f64)>,
}

/// The largest share of the tolerance that linear motion between rows may use.
const ROW_SHARE: f64 = 0.4;

/// The share of the tolerance within which straight pieces may stand for several, where there are corners to blend.
const SIMPLIFY_SHARE: f64 = 0.3;

/// The share that is kept for what the bounds leave out.
const RESERVE: f64 = 0.02;

/// One step of a plan. Every leg takes a whole number of periods, so that stops and pen events fall on rows: between rows
/// motors move linearly, and a stop between two rows would be cut.
#[derive(Clone, Debug)]
enum Leg {
    /// Motion along a joint path, from rest to rest.
    Move { course: Course, profile: Profile, end: Joints, periods: u64 },
    /// The pen changes to this state (0 is up) and the motors stand still for so many periods.
    Pen { pen: u16, periods: u64 },
}

/// A plan in continuous terms: what to do, and when. Memory follows the drawing's geometry, not the plot's time.
#[derive(Clone, Debug)]
pub struct Trajectory<'a> {
    machine: &'a Machine,
    period_us: u64,
    start: Joints,
    legs: Vec<Leg>,
    times: Times,
}

/// How the time of a plan is spent, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Times {
    /// The pen is down and moves (or makes a dot).
    pub drawing: f64,
    /// The pen is up and moves.
    pub travel: f64,
    /// The pen is on its way up or down.
    pub lifting: f64,
}

/// A row of the plan with the positions its ticks were rounded from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactRow {
    /// The row.
    pub row: Row,
    /// Exact positions of the motors in ticks, before rounding.
    pub exact: [f64; 2],
}

/// Plans a drawing, given in machine mm, in the order of its strokes.
///
/// # Errors
/// When there is no ink, a setting makes no sense, or a stroke leaves what the machine can draw.
pub fn plan<'a>(
    machine: &'a Machine,
    drawing: &Drawing,
    settings: &Settings,
) -> Result<Trajectory<'a>, PlanError> {
    check(settings)?;
    if drawing.is_empty() {
        return Err(PlanError::NoInk);
    }
    let budget = Shares::of(machine, settings);
    let (legs, times) = (Vec::new(), Times::default());
    Planner { machine, settings, budget, legs, here: machine.start(), times }.run(drawing)
}

/// How the tolerance is shared out, mm.
struct Shares {
    /// To linear motion between rows.
    row: f64,
    /// To the path itself.
    path: Budget,
}

impl Shares {
    /// Rows need no more than the largest acceleration can bend the pen's way over a period: by `T² A / 8`. What is
    /// left goes to the corners.
    fn of(machine: &Machine, settings: &Settings) -> Self {
        let period = settings.period_us as f64 * 1e-6;
        let sheet = machine.sheet();
        let places = [
            sheet.center(),
            Point::new(sheet.x0, sheet.y0),
            Point::new(sheet.x1, sheet.y0),
            Point::new(sheet.x1, sheet.y1),
            Point::new(sheet.x0, sheet.y1),
        ];
        let [a, b] = machine.motors().each_ref().map(|motor| motor.max_acceleration);
        let pen_acceleration = |pose: &Joints| {
            let jacobian = machine.geometry().jacobian(pose);
            let of = |rates: Vector2<f64>| (jacobian * machine.joint_rates(&rates)).norm();
            of(Vector2::new(a, b)).max(of(Vector2::new(a, -b)))
        };
        let poses = places.iter().filter_map(|place| machine.pose_near(*place, &machine.start()).ok());
        let acceleration = poses.map(|pose| pen_acceleration(&pose)).fold(0.0, f64::max);
        let tolerance = (1.0 - RESERVE) * settings.tolerance;
        let (needed, share) = (1.5 * period * period * acceleration / 8.0, ROW_SHARE * tolerance);
        let row = needed.min(share);
        let path = tolerance - row;
        let simplify = SIMPLIFY_SHARE * path;
        let marked = if needed > share { row } else { f64::INFINITY };
        Self { row, path: Budget { chord: 0.5 * path, simplify, blend: path - simplify, row: marked } }
    }
}

/// Looks for strokes that the machine cannot draw, in the drawing's order; gives the first.
///
/// # Errors
/// With the first stroke that leaves what the machine can draw.
pub fn check_reach(machine: &Machine, drawing: &Drawing) -> Result<(), PlanError> {
    for (index, stroke) in drawing.strokes.iter().enumerate() {
        let inside = machine
            .check_point(stroke.start())
            .and_then(|()| stroke.segments().try_for_each(|segment| machine.check_segment(&segment)));
        inside.map_err(|source| PlanError::OutOfReach {
            stroke: index,
            pen: stroke.pen,
            span: stroke.source(),
            source,
        })?;
    }
    Ok(())
}

fn check(settings: &Settings) -> Result<(), PlanError> {
    let setting =
        |holds: bool, what: &str| holds.then_some(()).ok_or(PlanError::Setting { what: what.into() });
    setting(
        settings.tolerance >= 1e-4 && settings.tolerance.is_finite(),
        "the tolerance must be at least 0.0001 mm",
    )?;
    setting((1..=10_000_000).contains(&settings.period_us), "the period must be between 1 us and 10 s")?;
    let speeds = settings.pen_speeds.iter().all(|(_, speed)| *speed > 0.0 && speed.is_finite());
    setting(speeds, "a pen's speed must be a positive number of mm/s")
}

struct Planner<'a, 'b> {
    machine: &'a Machine,
    settings: &'b Settings,
    budget: Shares,
    legs: Vec<Leg>,
    here: Joints,
    times: Times,
}

impl<'a> Planner<'a, '_> {
    fn run(mut self, drawing: &Drawing) -> Result<Trajectory<'a>, PlanError> {
        for (index, stroke) in drawing.strokes.iter().enumerate() {
            self.stroke(stroke).map_err(|source| PlanError::OutOfReach {
                stroke: index,
                pen: stroke.pen,
                span: stroke.source(),
                source,
            })?;
        }
        self.travel(self.settings.park.unwrap_or(self.machine.start()));
        let Self { machine, settings, legs, times, .. } = self;
        Ok(Trajectory { machine, period_us: settings.period_us, start: machine.start(), legs, times })
    }

    /// Travels to the stroke, lowers the pen, draws it and lifts the pen.
    fn stroke(&mut self, stroke: &Stroke) -> Result<(), OutOfReach> {
        let start = stroke.start();
        self.machine.check_point(start)?;
        let poses =
            self.machine.poses(start, &self.here).map_err(|fault| OutOfReach { point: start, fault })?;
        // A stroke around the base may run into a joint limit from one turn and not from another.
        let mut first_error = None;
        for pose in poses {
            match self.lift(stroke, pose) {
                Ok(paths) => {
                    self.travel(pose);
                    self.pen(stroke.pen, self.machine.pen().drop_time, paths.is_empty());
                    let speed = self.speed_of(stroke.pen);
                    for (path, end) in paths {
                        self.times.drawing += self.movement(path, end, speed);
                        self.here = end;
                    }
                    self.pen(Pen(0), self.machine.pen().lift_time, false);
                    return Ok(());
                }
                Err(error) => first_error = first_error.or(Some(error)),
            }
        }
        first_error.map_or(Ok(()), Err)
    }

    /// How fast a pen may go over the paper, mm/s.
    fn speed_of(&self, pen: Pen) -> f64 {
        let own = self.settings.pen_speeds.iter().filter(|(which, _)| *which == pen).map(|(_, speed)| *speed);
        own.fold(self.machine.pen().max_speed, f64::min)
    }

    /// The stroke's sections as joint paths, each with the pose at its end.
    ///
    /// Blends leave the drawing by as much as the tolerance allows. Where the drawing itself runs along the edge of the
    /// reach they may leave that too: such a stroke is followed to the letter, with a rest at every corner.
    fn lift(&self, stroke: &Stroke, pose: Joints) -> Result<Vec<(JointPath, Joints)>, OutOfReach> {
        let exact = Budget { simplify: 0.0, blend: 0.0, ..self.budget.path };
        self.lift_within(stroke, pose, &self.budget.path).or_else(|_| self.lift_within(stroke, pose, &exact))
    }

    fn lift_within(
        &self,
        stroke: &Stroke,
        pose: Joints,
        budget: &Budget,
    ) -> Result<Vec<(JointPath, Joints)>, OutOfReach> {
        let mut paths = Vec::new();
        let mut pose = pose;
        for section in sections(stroke, budget) {
            let end = section.last().map_or(stroke.start(), |piece| piece.curve.end());
            let path = JointPath::lift(self.machine, section, pose, self.settings.tolerance)?;
            pose = self.end_pose(&path, end)?;
            paths.push((path, pose));
        }
        Ok(paths)
    }

    /// The pose at the end of a drawn path, unwrapped along its cells.
    fn end_pose(&self, path: &JointPath, end: Point) -> Result<Joints, OutOfReach> {
        let along = path.cells.iter().fold(path.course.start(), |near, cell| {
            path.course.pose(self.machine, cell.piece, cell.start, &near)
        });
        let fault = |unreachable: Unreachable| OutOfReach { point: end, fault: unreachable.into() };
        self.machine.pose_near(end, &along).map_err(fault)
    }

    fn travel(&mut self, to: Joints) {
        if let Some(path) = JointPath::travel(self.machine, self.here, to) {
            self.times.travel += self.movement(path, to, f64::INFINITY);
        }
        self.here = to;
    }

    /// Lays the time law upon a path and gives the time it takes, s.
    fn movement(&mut self, path: JointPath, end: Joints, pen: f64) -> f64 {
        let period = self.settings.period_us as f64 * 1e-6;
        let cap = SpeedCap { pen, row_deviation: self.budget.row, period };
        let profile = profile(self.machine, &path, &cap);
        let periods = whole_periods(profile.duration, period).max(1);
        self.legs.push(Leg::Move { course: path.course, profile, end, periods });
        periods as f64 * period
    }

    fn pen(&mut self, pen: Pen, dwell: f64, dot: bool) {
        if self.legs.is_empty() {
            // The first stroke begins where the plan does: the plan still begins with the pen up.
            self.legs.push(Leg::Pen { pen: 0, periods: 1 });
        }
        let period = self.settings.period_us as f64 * 1e-6;
        // A dot is nothing but its dwell: without any there would be no ink in the plan.
        let periods = whole_periods(dwell, period).max(u64::from(dot));
        self.legs.push(Leg::Pen { pen: pen.0, periods });
        self.times.lifting += periods as f64 * period;
    }
}

/// Whole periods that hold `duration`; a hair over a whole number is rounding, not another period.
fn whole_periods(duration: f64, period: f64) -> u64 {
    (duration / period - 1e-9).ceil().max(0.0) as u64
}

impl Trajectory<'_> {
    /// How the time is spent.
    pub fn times(&self) -> Times {
        self.times
    }

    /// How long the plan takes, microseconds.
    pub fn duration_us(&self) -> u64 {
        self.legs.iter().map(|leg| leg.periods() * self.period_us).sum()
    }

    /// How many rows [`Self::rows`] gives.
    pub fn row_count(&self) -> u64 {
        let of = |leg: &Leg| match leg {
            Leg::Move { periods, .. } => *periods,
            Leg::Pen { periods, .. } => u64::from(*periods > 0),
        };
        self.legs.iter().map(of).sum::<u64>() + 1
    }

    /// The rows, one period apart; while the motors stand still for the pen only the first row is given.
    pub fn rows(&self) -> Rows<'_> {
        Rows {
            trajectory: self,
            leg: 0,
            period: 0,
            t_us: 0,
            pen: 0,
            pose: self.start,
            phase: 0,
            phase_start: 0.0,
            finished: false,
        }
    }
}

impl Leg {
    fn periods(&self) -> u64 {
        match self {
            Self::Move { periods, .. } | Self::Pen { periods, .. } => *periods,
        }
    }
}

/// Iterator over the rows of a trajectory.
#[derive(Clone, Debug)]
pub struct Rows<'a> {
    trajectory: &'a Trajectory<'a>,
    leg: usize,
    /// How many periods of the leg have gone by.
    period: u64,
    t_us: u64,
    pen: u16,
    /// Where the joints are.
    pose: Joints,
    /// Phase of the profile that was last looked at, and the profile's own time at its start.
    phase: usize,
    phase_start: f64,
    finished: bool,
}

impl Iterator for Rows<'_> {
    type Item = ExactRow;

    fn next(&mut self) -> Option<ExactRow> {
        let trajectory = self.trajectory;
        loop {
            match trajectory.legs.get(self.leg) {
                None if self.finished => return None,
                None => {
                    self.finished = true;
                    return Some(self.emit());
                }
                Some(Leg::Pen { pen, periods }) => {
                    self.pen = *pen;
                    let row = (*periods > 0).then(|| self.emit());
                    self.t_us += periods * trajectory.period_us;
                    self.leg += 1;
                    if row.is_some() {
                        return row;
                    }
                }
                Some(Leg::Move { course, profile, end, periods }) => {
                    if self.period == *periods {
                        self.leg += 1;
                        (self.period, self.phase, self.phase_start) = (0, 0, 0.0);
                        self.pose = *end;
                        continue;
                    }
                    // The profile is stretched to a whole number of periods, which only slows it down.
                    let time = profile.duration * (self.period as f64 / *periods as f64);
                    self.pose = self.pose_at(course, profile, time);
                    let row = self.emit();
                    self.period += 1;
                    self.t_us += trajectory.period_us;
                    return Some(row);
                }
            }
        }
    }
}

impl Rows<'_> {
    fn pose_at(&mut self, course: &Course, profile: &Profile, time: f64) -> Joints {
        while self.phase + 1 < profile.phases.len()
            && time > self.phase_start + profile.phases[self.phase].duration
        {
            self.phase_start += profile.phases[self.phase].duration;
            self.phase += 1;
        }
        let phase = &profile.phases[self.phase];
        let since = (time - self.phase_start).max(0.0);
        let s = phase.start + since * (phase.speed + 0.5 * phase.acceleration * since);
        // Between rows no joint turns by half a turn, so the last row's pose says which turn this one is in.
        course.pose(self.trajectory.machine, phase.piece, s, &self.pose)
    }

    fn emit(&self) -> ExactRow {
        let exact = self.trajectory.machine.ticks(&self.pose);
        let ticks = [exact.x.round() as i64, exact.y.round() as i64];
        ExactRow { row: Row { t_us: self.t_us, pen: self.pen, ticks }, exact: [exact.x, exact.y] }
    }
}
