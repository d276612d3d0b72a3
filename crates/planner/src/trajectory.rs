//! A whole plan: strokes, travel, pen lifts and drops in sequence, sampled into rows of ticks.
//!
//! Strokes are planned in batches of some thousand pieces, on all threads, and dropped once their
//! rows are emitted: memory is proportional to the longest stroke. A stroke depends on its
//! predecessors only through the turn about the base in which the machine arrives, so the rows do
//! not depend on the number of threads.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::sync::OnceLock;

use drawing::{Drawing, Line, Segment, Stroke};
use kinematics::{JointPos, Machine, MotorPos, OutOfReach};
use plan::{Rounding, Row};
use rayon::prelude::*;

use crate::{
    backlash,
    error::PlanError,
    joint_path::PathGeometry,
    rounding::{AlongPath, Choices},
    settings::{self, Settings, TimingLaw, ToleranceBudget},
    stroke::{PathMotion, PlannedStroke, StrokePlanner, whole_periods},
    time_parametrization::LimitingConstraints,
};

/// The size of a batch, in segments of the drawing.
const BATCH: usize = 4096;

/// A plan with at most this number of phases is cached, so that its rows can be generated again
/// without planning again.
const CACHED_PHASES: usize = 1 << 21;

/// The largest number of rows of a plan: 11 days at a period of 1 ms.
const MAX_ROWS: u64 = 1_000_000_000;

/// One step of a plan.
#[derive(Clone, Debug)]
enum Motion {
    /// Motion along a joint path, from rest to rest.
    Path(PathMotion),
    /// The pen changes to this state (0 is up) and the motors rest for `periods`.
    Pen { pen: u16, periods: u64 },
    /// The motors take up their backlash, and their lead over the mechanism becomes `to`, ticks.
    TakeUp { crossing: PathMotion, from: MotorPos, to: MotorPos },
}

impl Motion {
    fn periods(&self) -> u64 {
        match self {
            Self::Path(PathMotion { periods, .. })
            | Self::Pen { periods, .. }
            | Self::TakeUp { crossing: PathMotion { periods, .. }, .. } => *periods,
        }
    }

    fn rows(&self) -> u64 {
        match self {
            Self::Path(PathMotion { periods, .. })
            | Self::TakeUp { crossing: PathMotion { periods, .. }, .. } => *periods,
            Self::Pen { periods, .. } => u64::from(*periods > 0),
        }
    }
}

/// A plan: the motion of the motors and of the pen against time.
#[derive(Clone, Debug)]
pub struct Trajectory<'a> {
    machine: &'a Machine,
    drawing: Drawing,
    settings: Settings,
    budget: ToleranceBudget,
    /// All of its motions, if it is small.
    cached: Option<Vec<Motion>>,
    /// The ticks chosen along the path, once all rows have been generated.
    choices: OnceLock<Choices>,
    periods: u64,
    rows: u64,
    times: Times,
    limiting: LimitingConstraints,
    blended_strokes: usize,
}

/// How the duration of a plan is divided, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Times {
    /// The pen is down and moves (or makes a dot), or a motor takes up its backlash.
    pub drawing_s: f64,
    /// The same with the pen up.
    pub travel_s: f64,
    /// The pen is being lifted or lowered.
    pub lifting_s: f64,
}

/// A row of the plan with the positions its ticks were rounded from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactRow {
    /// The row.
    pub row: Row,
    /// Exact positions of the motors in ticks, before rounding.
    pub exact: [f64; 2],
}

/// Plans a drawing, given in machine mm, in the order of its strokes. The plan starts and ends at
/// the machine's start pose, at rest, with the pen up.
///
/// # Errors
/// [`PlanError::Setting`] if a setting is outside its valid range, [`PlanError::NoInk`] for an
/// empty drawing, [`PlanError::OutOfReach`] with the first stroke that leaves the machine's reach.
pub fn plan<'a>(
    machine: &'a Machine,
    drawing: Drawing,
    settings: &Settings,
) -> Result<Trajectory<'a>, PlanError> {
    plan_with_progress(machine, drawing, settings, &|_, _| {})
}

/// The strokes, divided where they go through a pole of the machine. The pen is lifted there while the
/// mechanism turns; on the lines to and from the pole its first joint rests.
fn divided_at_pole(machine: &Machine, mut drawing: Drawing) -> Drawing {
    if machine.mechanism().pole().is_none() {
        return drawing;
    }
    let strokes = std::mem::take(&mut drawing.strokes);
    for stroke in strokes {
        let on_pole = |segment: &Segment| match segment {
            Segment::Line(line) => machine.pole_on(line),
            _ => None,
        };
        if stroke.segments().all(|segment| on_pole(&segment).is_none()) {
            drawing.strokes.push(&stroke);
            continue;
        }
        let at_pole = |point| machine.pole_on(&Line::new(point, point)).is_some();
        let mut part = Stroke::new(stroke.pen, stroke.start(), stroke.source());
        for segment in stroke.segments() {
            let Some(pole) = on_pole(&segment) else {
                part.push(segment);
                continue;
            };
            if !at_pole(part.end()) {
                part.line_to(pole);
            }
            let after = Stroke::new(stroke.pen, pole, stroke.source());
            let before = std::mem::replace(&mut part, after);
            drawing.strokes.extend((!before.is_dot()).then_some(before));
            if !at_pole(segment.end()) {
                part.line_to(segment.end());
            }
        }
        drawing.strokes.extend((!part.is_dot()).then_some(part));
    }
    drawing
}

/// As [`plan()`]; `progress` is called with the strokes planned and all strokes, after each batch.
///
/// # Errors
/// Those of [`plan()`].
pub fn plan_with_progress<'a>(
    machine: &'a Machine,
    drawing: Drawing,
    settings: &Settings,
    progress: &dyn Fn(usize, usize),
) -> Result<Trajectory<'a>, PlanError> {
    settings::check(settings)?;
    if machine.has_backlash() && matches!(settings.timing_law, TimingLaw::FixedDuration { .. }) {
        let what = "backlash cannot be taken up in segments of a fixed duration: plan with another law";
        return Err(PlanError::Setting { what });
    }
    if drawing.is_empty() {
        return Err(PlanError::NoInk);
    }
    let drawing = divided_at_pole(machine, drawing);
    let trajectory = Trajectory {
        machine,
        budget: ToleranceBudget::of(machine, settings, &drawing),
        drawing,
        settings: settings.clone(),
        cached: None,
        choices: OnceLock::new(),
        periods: 0,
        rows: 1,
        times: Times::default(),
        limiting: LimitingConstraints::default(),
        blended_strokes: 0,
    };
    let period = settings.period_us as f64 * 1e-6;
    let (mut periods, mut rows, mut times, mut limiting) =
        (0, 1, Times::default(), LimitingConstraints::default());
    let (mut cached, mut phases) = (Some(Vec::new()), 0);
    let mut motions = trajectory.motions();
    let mut is_down = false;
    let mut reported = 0;
    while let Some(motion) = motions.next_motion()? {
        // Batches are planned ahead of the motion that is taken.
        let planned = motions.next;
        if planned != reported {
            reported = planned;
            progress(planned, trajectory.drawing.strokes.len());
        }
        let time = motion.periods() as f64 * period;
        match &motion {
            Motion::Pen { pen, .. } => {
                is_down = *pen != 0;
                times.lifting_s += time;
            }
            Motion::TakeUp { .. } if is_down => times.drawing_s += time,
            Motion::TakeUp { .. } | Motion::Path(PathMotion { geometry: PathGeometry::Travel(..), .. }) => {
                times.travel_s += time;
            }
            Motion::Path(PathMotion { profile, .. }) => {
                times.drawing_s += time;
                limiting.add(&profile.limiting, time / profile.duration_s);
                phases += profile.phases.len();
            }
        }
        periods = u64::saturating_add(periods, motion.periods());
        rows = u64::saturating_add(rows, motion.rows());
        if rows > MAX_ROWS {
            return Err(PlanError::TooManyRows { rows, max: MAX_ROWS });
        }
        if phases > CACHED_PHASES {
            cached = None;
        }
        if let Some(cached) = &mut cached {
            cached.push(motion);
        }
    }
    let blended_strokes = motions.blended_strokes;
    Ok(Trajectory { cached, periods, rows, times, limiting, blended_strokes, ..trajectory })
}

/// Checks that the machine can reach every stroke, in the drawing's order.
///
/// # Errors
/// [`PlanError::OutOfReach`] with the first stroke that leaves the machine's reach.
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

impl Trajectory<'_> {
    /// The drawing that is drawn, machine mm.
    pub fn drawing(&self) -> &Drawing {
        &self.drawing
    }

    /// How the duration is divided.
    pub fn times(&self) -> Times {
        self.times
    }

    /// For how long of the drawing time each constraint was active.
    pub fn limiting(&self) -> LimitingConstraints {
        self.limiting
    }

    /// The number of strokes of more than one line whose corners are blended one by one, because no
    /// spline within the tolerance and the reach is faster.
    pub fn blended_strokes(&self) -> usize {
        self.blended_strokes
    }

    /// The duration, microseconds.
    pub fn duration_us(&self) -> u64 {
        self.periods * self.settings.period_us
    }

    /// The number of rows that [`Self::rows`] returns.
    pub fn row_count(&self) -> u64 {
        self.rows
    }

    /// The rows, one period apart. While the motors rest for a pen event only the first row is
    /// emitted. Every call returns the same rows.
    pub fn rows(&self) -> Rows<'_> {
        let source = match &self.cached {
            Some(cached) => Source::Cached(cached.iter()),
            None => Source::Planned(Box::new(self.motions())),
        };
        let samples = Samples {
            machine: self.machine,
            period_us: self.settings.period_us,
            source,
            motion: None,
            cursor: Cursor::default(),
            t_us: 0,
            pen: 0,
            pose: self.machine.start(),
            lead: MotorPos::ZERO,
            finished: false,
        };
        let ticks = match (self.settings.rounding, self.choices.get()) {
            (Rounding::Nearest, _) => Ticks::Nearest,
            // Ticks beside the path would make motors reverse.
            (Rounding::Path, _) if self.machine.has_backlash() => Ticks::Nearest,
            (Rounding::Path, Some(choices)) => Ticks::Known { choices, next: 0 },
            (Rounding::Path, None) => Ticks::Searched {
                along_path: Box::new(AlongPath::new(self.machine, self.settings.period_us)),
                found: Choices::of(self.rows),
            },
        };
        Rows { samples, ticks, trajectory: self }
    }

    /// Drops the cached motions and choices, so that the rows are planned and rounded again, as in a
    /// large plan. Returns whether there were any motions.
    #[cfg(feature = "unstable")]
    pub fn drop_cache(&mut self) -> bool {
        self.forget_choices();
        self.cached.take().is_some()
    }

    /// Forgets the ticks that were chosen, so that the next rows are searched again.
    #[cfg(feature = "unstable")]
    pub fn forget_choices(&mut self) {
        self.choices.take();
    }

    fn motions(&self) -> Motions<'_> {
        let planner = StrokePlanner { machine: self.machine, settings: &self.settings, budget: self.budget };
        Motions {
            planner,
            strokes: self.drawing.strokes.iter(),
            count: self.drawing.strokes.len(),
            next: 0,
            batch: VecDeque::new(),
            predicted: self.machine.start(),
            pose: self.machine.start(),
            queue: VecDeque::new(),
            lead: MotorPos::ZERO,
            is_down: false,
            finished: false,
            blended_strokes: 0,
        }
    }
}

/// The motions of a plan, in order, planned on demand.
#[derive(Clone, Debug)]
struct Motions<'a> {
    planner: StrokePlanner<'a>,
    /// The strokes after the batch.
    strokes: drawing::Iter<'a>,
    /// The number of all strokes.
    count: usize,
    /// The stroke to plan next.
    next: usize,
    /// The strokes from `next` on, with results from predicted poses.
    batch: VecDeque<(Stroke, Option<Result<PlannedStroke, OutOfReach>>)>,
    /// The predicted pose after the batch.
    predicted: JointPos,
    /// The pose after all queued motions.
    pose: JointPos,
    queue: VecDeque<Motion>,
    /// How far the motors are ahead of the mechanism after all queued motions, ticks.
    lead: MotorPos,
    /// Whether the pen is down after all queued motions.
    is_down: bool,
    /// Whether the travel back to the start pose is queued.
    finished: bool,
    /// The number of strokes so far that keep blends.
    blended_strokes: usize,
}

impl Motions<'_> {
    /// The next motion; `None` at the end of the plan.
    fn next_motion(&mut self) -> Result<Option<Motion>, PlanError> {
        while self.queue.is_empty() {
            if self.next < self.count {
                self.stroke()?;
            } else if self.finished {
                return Ok(None);
            } else {
                self.finished = true;
                self.travel(self.planner.machine.start())?;
                self.take_up(MotorPos::ZERO);
            }
        }
        Ok(self.queue.pop_front())
    }

    /// Travels to the next stroke, lowers the pen and draws it.
    fn stroke(&mut self) -> Result<(), PlanError> {
        if self.batch.is_empty() {
            self.plan_batch();
        }
        let index = self.next;
        self.next += 1;
        let Some((stroke, candidate)) = self.batch.pop_front() else { return Ok(()) };
        let planned = self.planner.plan(&stroke, &self.pose, candidate).map_err(|source| {
            PlanError::OutOfReach { stroke: index, pen: stroke.pen, span: stroke.source(), source }
        })?;
        self.blended_strokes += usize::from(planned.has_blends);
        self.travel(planned.start)?;
        if index == 0 && self.queue.is_empty() {
            // The first stroke starts at the start pose: the plan still starts with the pen up.
            self.queue.push_back(Motion::Pen { pen: 0, periods: 1 });
        }
        let pen = self.planner.machine.pen();
        // A dot consists of its dwell: without one the plan would have no ink.
        let dwell =
            whole_periods(pen.drop_time_s, self.planner.period()).max(u64::from(planned.motions.is_empty()));
        self.queue.push_back(Motion::Pen { pen: stroke.pen.0, periods: dwell });
        self.follow(planned.motions);
        self.is_down = true;
        Ok(())
    }

    /// Queues motions from the present pose, each after the motors have taken up their backlash.
    fn follow(&mut self, motions: Vec<PathMotion>) {
        for motion in motions {
            self.take_up_towards(&motion.end);
            self.pose = motion.end;
            self.queue.push_back(Motion::Path(motion));
        }
    }

    /// Brings the motors that will move to their side of the play.
    fn take_up_towards(&mut self, end: &JointPos) {
        let machine = self.planner.machine;
        let directions = backlash::directions(machine, &self.pose, end);
        let lead = [0, 1].map(|motor| match directions[motor] {
            0.0 => self.lead[motor],
            direction => 0.5 * direction * machine.motors()[motor].backlash_ticks,
        });
        self.take_up(MotorPos(lead));
    }

    fn take_up(&mut self, lead: MotorPos) {
        if lead != self.lead {
            let crossing = self.planner.crossing(lead - self.lead);
            self.queue.push_back(Motion::TakeUp { crossing, from: self.lead, to: lead });
            self.lead = lead;
        }
    }

    /// Lifts the pen if it is down, and travels. Travel overlaps with the lift by the time that the
    /// settings allow, at most by its own duration: the lift ends before the next drop begins.
    ///
    /// # Errors
    /// See [`StrokePlanner::travel`].
    fn travel(&mut self, to: JointPos) -> Result<(), PlanError> {
        let travel = self.planner.travel(self.pose, to)?;
        if std::mem::take(&mut self.is_down) {
            let whole = whole_periods(self.planner.machine.pen().lift_time_s, self.planner.period());
            let overlap =
                (self.planner.settings.lift_overlap_s / self.planner.period() + 1e-9).floor() as u64;
            let overlap = overlap.min(travel.iter().map(|travel| travel.periods).sum());
            self.queue.push_back(Motion::Pen { pen: 0, periods: whole.saturating_sub(overlap) });
        }
        self.follow(travel);
        self.pose = to;
        Ok(())
    }

    /// Plans the next strokes in parallel, each from the pose in which the machine is predicted to
    /// arrive.
    fn plan_batch(&mut self) {
        let mut starts = Vec::new();
        let mut size = 0;
        for stroke in self.strokes.by_ref() {
            let predicted = self.planner.predict_poses(&stroke, &self.predicted);
            if let Some((_, end)) = predicted {
                self.predicted = end;
            }
            size += stroke.segment_count() + 1;
            starts.push((stroke, predicted.map(|(start, _)| start)));
            if size >= BATCH {
                break;
            }
        }
        let planner = self.planner;
        let plan = |(stroke, start): (Stroke, Option<JointPos>)| {
            let planned = start.map(|start| planner.plan_from(&stroke, start));
            (stroke, planned)
        };
        self.batch = starts.into_par_iter().map(plan).collect::<Vec<_>>().into();
    }
}

/// Where [`Rows`] takes its motions from.
#[derive(Clone, Debug)]
enum Source<'a> {
    Cached(std::slice::Iter<'a, Motion>),
    Planned(Box<Motions<'a>>),
}

impl<'a> Source<'a> {
    fn next_motion(&mut self) -> Option<Cow<'a, Motion>> {
        match self {
            Self::Cached(motions) => motions.next().map(Cow::Borrowed),
            Self::Planned(motions) => {
                let motion = motions.next_motion();
                motion.expect("planning is deterministic, and `plan` planned every stroke").map(Cow::Owned)
            }
        }
    }
}

/// Where [`Rows`] takes the ticks of a row from.
#[derive(Clone, Debug)]
enum Ticks<'a> {
    Nearest,
    /// A search, and what it has found since the first row.
    Searched {
        along_path: Box<AlongPath<'a>>,
        found: Option<Choices>,
    },
    /// An earlier search.
    Known {
        choices: &'a Choices,
        next: usize,
    },
}

/// Iterator over the rows of a trajectory.
#[derive(Clone, Debug)]
pub struct Rows<'a> {
    samples: Samples<'a>,
    ticks: Ticks<'a>,
    trajectory: &'a Trajectory<'a>,
}

impl Iterator for Rows<'_> {
    type Item = ExactRow;

    fn next(&mut self) -> Option<ExactRow> {
        match &mut self.ticks {
            Ticks::Nearest => self.samples.next().map(|sample| sample.row),
            Ticks::Known { choices, next } => {
                let mut row = self.samples.next()?.row;
                row.row.ticks = choices.chosen(*next, row.row.ticks);
                *next += 1;
                Some(row)
            }
            Ticks::Searched { along_path, found } => {
                let row = along_path.next(&mut self.samples);
                match (&row, &mut *found) {
                    (Some(row), Some(found)) => found.push(row.exact.map(to_ticks), row.row.ticks),
                    (None, Some(all)) if all.are_complete(self.trajectory.rows) => {
                        let _ = self.trajectory.choices.set(std::mem::take(all));
                        *found = None;
                    }
                    _ => {}
                }
                row
            }
        }
    }
}

/// A row rounded to the nearest ticks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) row: ExactRow,
    pub(crate) pose: JointPos,
    /// Whether the path may change its direction here: a motion starts.
    pub(crate) may_turn: bool,
}

/// Iterator over the rows of a trajectory as they are sampled.
#[derive(Clone, Debug)]
struct Samples<'a> {
    machine: &'a Machine,
    period_us: u64,
    source: Source<'a>,
    /// The current motion.
    motion: Option<Cow<'a, Motion>>,
    cursor: Cursor,
    t_us: u64,
    pen: u16,
    pose: JointPos,
    /// How far the motors are ahead of the pose, ticks.
    lead: MotorPos,
    finished: bool,
}

impl Iterator for Samples<'_> {
    type Item = Sample;

    fn next(&mut self) -> Option<Sample> {
        loop {
            if self.motion.is_none() {
                self.motion = self.source.next_motion();
                self.cursor = Cursor::default();
            }
            match self.motion.as_deref() {
                None => {
                    let last = !self.finished;
                    self.finished = true;
                    return last.then(|| self.sample(true));
                }
                Some(Motion::Pen { pen, periods }) => {
                    self.pen = *pen;
                    let sample = (*periods > 0).then(|| self.sample(true));
                    self.t_us += periods * self.period_us;
                    self.motion = None;
                    if sample.is_some() {
                        return sample;
                    }
                }
                Some(Motion::TakeUp { crossing, to, .. }) if self.cursor.period == crossing.periods => {
                    self.lead = *to;
                    self.motion = None;
                }
                Some(Motion::TakeUp { crossing, from, .. }) => {
                    let change = self.cursor.pose(self.machine, crossing, &JointPos::ZERO);
                    self.lead = *from + self.machine.motor_rates(&change);
                    let sample = self.sample(true);
                    self.cursor.period += 1;
                    self.t_us += self.period_us;
                    return Some(sample);
                }
                Some(Motion::Path(motion)) if self.cursor.period == motion.periods => {
                    self.pose = motion.end;
                    self.motion = None;
                }
                Some(Motion::Path(motion)) => {
                    self.pose = self.cursor.pose(self.machine, motion, &self.pose);
                    let sample = self.sample(self.cursor.period == 0);
                    self.cursor.period += 1;
                    self.t_us += self.period_us;
                    return Some(sample);
                }
            }
        }
    }
}

/// Position within a motion.
#[derive(Clone, Copy, Debug, Default)]
struct Cursor {
    /// The number of its periods that have elapsed.
    period: u64,
    /// The current phase of the profile, and the profile's time at the start of that phase.
    phase: usize,
    phase_start: f64,
}

impl Cursor {
    /// The current pose; `near` is the pose of the row before.
    fn pose(&mut self, machine: &Machine, motion: &PathMotion, near: &JointPos) -> JointPos {
        let PathMotion { geometry, profile, periods, .. } = motion;
        // The profile is stretched to a whole number of periods, which only slows it down.
        let time = profile.duration_s * (self.period as f64 / *periods as f64);
        while self.phase + 1 < profile.phases.len()
            && time > self.phase_start + profile.phases[self.phase].duration_s
        {
            self.phase_start += profile.phases[self.phase].duration_s;
            self.phase += 1;
        }
        let phase = &profile.phases[self.phase];
        let s = phase.position_at((time - self.phase_start).max(0.0));
        // No joint turns by half a turn between rows, so unwrapping to the last row's pose is
        // unique.
        let pose = geometry.pose(machine, phase.piece, s, near);
        pose.expect("the reach of the whole path was checked when it was planned")
    }
}

impl Samples<'_> {
    fn sample(&self, may_turn: bool) -> Sample {
        let exact = self.machine.motor_positions(&self.pose) + self.lead;
        let exact = [exact[0], exact[1]];
        let row = Row { t_us: self.t_us, pen: self.pen, ticks: exact.map(to_ticks) };
        Sample { row: ExactRow { row, exact }, pose: self.pose, may_turn }
    }
}

/// Rounds a motor position to ticks.
///
/// # Panics
/// If it is NaN or beyond the range of `i64`, which a cast would turn into 0 or the nearest bound.
fn to_ticks(position: f64) -> i64 {
    let rounded = position.round();
    assert!(rounded.abs() < 9.2e18, "motor position {position} is not a number of ticks");
    rounded as i64
}

#[cfg(test)]
mod tests {
    use super::to_ticks;

    #[test]
    fn ticks_are_rounded_half_away_from_zero() {
        assert_eq!([0.4, 0.5, -0.5, -1.4].map(to_ticks), [0, 1, -1, -1]);
    }

    #[test]
    #[should_panic(expected = "is not a number of ticks")]
    fn nan_position_is_not_a_tick() {
        to_ticks(f64::NAN);
    }
}
