//! A whole plan: drawn sections, travel, pen lifts and drops one after the other, sampled into rows of ticks.

use drawing::{Drawing, Pen, Stroke};
use kinematics::{Joints, Machine, OutOfReach};
use nalgebra::Vector2;
use plan::Row;

use crate::{
    PlanError,
    lift::JointPath,
    path::sections,
    time_law::{Profile, SpeedCap, profile},
};

/// How a plan is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Largest distance between the drawing's ink and the pen's continuous path, both ways, mm.
    pub tolerance: f64,
    /// Time between rows, microseconds.
    pub period_us: u64,
    /// Where the plan ends, pen up and at rest; the machine's start pose if nothing is said.
    pub park: Option<Joints>,
}

/// The share of the tolerance that linear motion between rows may use. Only curves with cusps need the rest (the path
/// is exact elsewhere), and a row may straddle two cells with different bounds.
const ROW_SHARE: f64 = 0.5;

/// The share of the tolerance for the chords of curves with cusps.
const CHORD_SHARE: f64 = 0.25;

/// One step of a plan. Every leg takes a whole number of periods, so that corners and pen events fall on rows: between
/// rows motors move linearly, and a corner between two rows would be cut.
#[derive(Clone, Debug)]
enum Leg {
    /// Motion along a joint path, from rest to rest.
    Move { path: JointPath, profile: Profile, periods: u64 },
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
    let planner =
        Planner { machine, settings, legs: Vec::new(), here: machine.start(), times: Times::default() };
    planner.run(drawing)
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
            span: stroke.source,
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
    setting((1..=10_000_000).contains(&settings.period_us), "the period must be between 1 us and 10 s")
}

struct Planner<'a, 'b> {
    machine: &'a Machine,
    settings: &'b Settings,
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
                span: stroke.source,
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
                    for path in paths {
                        self.here = path.end(self.machine);
                        self.times.drawing += self.movement(path, self.machine.pen().max_speed);
                    }
                    self.pen(Pen(0), self.machine.pen().lift_time, false);
                    return Ok(());
                }
                Err(error) => first_error = first_error.or(Some(error)),
            }
        }
        first_error.map_or(Ok(()), Err)
    }

    fn lift(&self, stroke: &Stroke, pose: Joints) -> Result<Vec<JointPath>, OutOfReach> {
        let tolerance = self.settings.tolerance;
        let mut paths = Vec::new();
        let mut pose = pose;
        for section in sections(stroke, CHORD_SHARE * tolerance) {
            let path = JointPath::lift(self.machine, section, pose, tolerance)?;
            pose = path.end(self.machine);
            paths.push(path);
        }
        Ok(paths)
    }

    fn travel(&mut self, to: Joints) {
        if let Some(path) = JointPath::travel(self.machine, self.here, to) {
            self.times.travel += self.movement(path, f64::INFINITY);
        }
        self.here = to;
    }

    /// Lays the time law upon a path and gives the time it takes, s.
    fn movement(&mut self, path: JointPath, speed: f64) -> f64 {
        let period = self.settings.period_us as f64 * 1e-6;
        let cap = SpeedCap { speed, row_deviation: ROW_SHARE * self.settings.tolerance, period };
        let profile = profile(self.machine, &path, &cap);
        let periods = whole_periods(profile.duration, period).max(1);
        self.legs.push(Leg::Move { path, profile, periods });
        periods as f64 * period
    }

    fn pen(&mut self, pen: Pen, dwell: f64, dot: bool) {
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
                    return Some(self.emit(self.resting_pose()));
                }
                Some(Leg::Pen { pen, periods }) => {
                    self.pen = *pen;
                    let row = (*periods > 0).then(|| self.emit(self.resting_pose()));
                    self.t_us += periods * trajectory.period_us;
                    self.leg += 1;
                    if row.is_some() {
                        return row;
                    }
                }
                Some(Leg::Move { path, profile, periods }) => {
                    if self.period == *periods {
                        self.leg += 1;
                        (self.period, self.phase, self.phase_start) = (0, 0, 0.0);
                        continue;
                    }
                    // The profile is stretched to a whole number of periods, which only slows it down.
                    let time = profile.duration * (self.period as f64 / *periods as f64);
                    let pose = self.pose_at(path, profile, time);
                    let row = self.emit(pose);
                    self.period += 1;
                    self.t_us += trajectory.period_us;
                    return Some(row);
                }
            }
        }
    }
}

impl Rows<'_> {
    /// Where the joints are between two moves: at the end of the last one.
    fn resting_pose(&self) -> Joints {
        let trajectory = self.trajectory;
        let last = trajectory.legs[..self.leg].iter().rev().find_map(|leg| match leg {
            Leg::Move { path, .. } => Some(path.end(trajectory.machine)),
            Leg::Pen { .. } => None,
        });
        last.unwrap_or(trajectory.start)
    }

    fn pose_at(&mut self, path: &JointPath, profile: &Profile, time: f64) -> Joints {
        while self.phase + 1 < profile.phases.len()
            && time > self.phase_start + profile.phases[self.phase].duration
        {
            self.phase_start += profile.phases[self.phase].duration;
            self.phase += 1;
        }
        let phase = &profile.phases[self.phase];
        let since = (time - self.phase_start).max(0.0);
        let s = phase.start + since * (phase.speed + 0.5 * phase.acceleration * since);
        path.pose(self.trajectory.machine, phase.cell, s)
    }

    fn emit(&self, pose: Joints) -> ExactRow {
        let exact: Vector2<f64> = self.trajectory.machine.ticks(&pose);
        let ticks = [exact.x.round() as i64, exact.y.round() as i64];
        ExactRow { row: Row { t_us: self.t_us, pen: self.pen, ticks }, exact: [exact.x, exact.y] }
    }
}
