//! A whole plan: drawn sections, travel, pen lifts and drops one after the other, sampled into rows of ticks.
//!
//! Strokes are planned a few thousand pieces at a time, on as many threads as there are, and forgotten when their rows are
//! given: memory follows the longest stroke. A stroke depends on those before it only by the turn in which the machine
//! arrives, so the rows are the same at any number of threads.

use std::borrow::Cow;
use std::collections::VecDeque;

use drawing::{Drawing, Stroke};
use kinematics::{JointPos, Machine, OutOfReach};
use plan::Row;
use rayon::prelude::*;

use crate::{
    PlanError, Settings,
    joint_path::PathGeometry,
    settings::{self, ToleranceBudget},
    stroke::{PlannedStroke, PathMotion, StrokePlanner, whole_periods},
    time_parametrization::LimitingConstraints,
};

/// How much geometry is planned at once, in curves of the drawing.
const BATCH: usize = 4096;

/// A plan whose motion has no more phases than this is cached, so that its rows can be had again without planning anew.
const CACHED_PHASES: usize = 1 << 19;

/// One step of a plan.
#[derive(Clone, Debug)]
enum Motion {
    /// Motion along a joint path, from rest to rest.
    Path(PathMotion),
    /// The pen changes to this state (0 is up) and the motors stand still for so many periods.
    Pen { pen: u16, periods: u64 },
}

impl Motion {
    fn periods(&self) -> u64 {
        match self {
            Self::Path(PathMotion { periods, .. }) | Self::Pen { periods, .. } => *periods,
        }
    }

    fn rows(&self) -> u64 {
        match self {
            Self::Path(PathMotion { periods, .. }) => *periods,
            Self::Pen { periods, .. } => u64::from(*periods > 0),
        }
    }
}

/// A plan: what to do, and when.
#[derive(Clone, Debug)]
pub struct Trajectory<'a> {
    machine: &'a Machine,
    drawing: Drawing,
    settings: Settings,
    budget: ToleranceBudget,
    /// All of it, where it is small.
    cached: Option<Vec<Motion>>,
    periods: u64,
    rows: u64,
    times: Times,
    limiting: LimitingConstraints,
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
    drawing: Drawing,
    settings: &Settings,
) -> Result<Trajectory<'a>, PlanError> {
    settings::check(settings)?;
    if drawing.is_empty() {
        return Err(PlanError::NoInk);
    }
    let budget = ToleranceBudget::of(machine, settings);
    let trajectory = Trajectory {
        machine,
        drawing,
        settings: settings.clone(),
        budget,
        cached: None,
        periods: 0,
        rows: 1,
        times: Times::default(),
        limiting: LimitingConstraints::default(),
    };
    let period = settings.period_us as f64 * 1e-6;
    let (mut periods, mut rows, mut times, mut limiting) = (0, 1, Times::default(), LimitingConstraints::default());
    let (mut cached, mut phases) = (Some(Vec::new()), 0);
    let mut motions = trajectory.motions();
    while let Some(motion) = motions.next_motion()? {
        let time = motion.periods() as f64 * period;
        match &motion {
            Motion::Pen { .. } => times.lifting += time,
            Motion::Path(PathMotion { geometry: PathGeometry::Travel(..), .. }) => times.travel += time,
            Motion::Path(PathMotion { profile, .. }) => {
                times.drawing += time;
                limiting.add(&profile.limiting, time / profile.duration);
                phases += profile.phases.len();
            }
        }
        periods += motion.periods();
        rows += motion.rows();
        if phases > CACHED_PHASES {
            cached = None;
        }
        if let Some(cached) = &mut cached {
            cached.push(motion);
        }
    }
    Ok(Trajectory { cached, periods, rows, times, limiting, ..trajectory })
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

impl Trajectory<'_> {
    /// The drawing that is drawn, machine mm.
    pub fn drawing(&self) -> &Drawing {
        &self.drawing
    }

    /// How the time is spent.
    pub fn times(&self) -> Times {
        self.times
    }

    /// For how long of the drawing time each limit was what cached it from being shorter, s.
    pub fn limiting(&self) -> LimitingConstraints {
        self.limiting
    }

    /// How long the plan takes, microseconds.
    pub fn duration_us(&self) -> u64 {
        self.periods * self.settings.period_us
    }

    /// How many rows [`Self::rows`] gives.
    pub fn row_count(&self) -> u64 {
        self.rows
    }

    /// The rows, one period apart; while the motors stand still for the pen only the first row is given.
    pub fn rows(&self) -> Rows<'_> {
        let source = match &self.cached {
            Some(cached) => Source::Cached(cached.iter()),
            None => Source::Planned(self.motions()),
        };
        Rows {
            machine: self.machine,
            period_us: self.settings.period_us,
            source,
            motion: None,
            cursor: Cursor::default(),
            t_us: 0,
            pen: 0,
            pose: self.machine.start(),
            finished: false,
        }
    }

    fn motions(&self) -> Motions<'_> {
        let planner = StrokePlanner { machine: self.machine, settings: &self.settings, budget: self.budget };
        Motions {
            planner,
            strokes: &self.drawing.strokes,
            next: 0,
            batch: VecDeque::new(),
            guess: self.machine.start(),
            here: self.machine.start(),
            queue: VecDeque::new(),
            is_down: false,
            parked: false,
        }
    }
}

/// The motions of a plan, in order, planned as they are asked for.
#[derive(Clone, Debug)]
struct Motions<'a> {
    planner: StrokePlanner<'a>,
    strokes: &'a [Stroke],
    /// The stroke whose motions come next.
    next: usize,
    /// What was planned of the strokes from `next` on.
    batch: VecDeque<Option<Result<PlannedStroke, OutOfReach>>>,
    /// Where the machine will be when the batch is drawn, as far as one knows.
    guess: JointPos,
    /// Where it is after all motions so far.
    here: JointPos,
    queue: VecDeque<Motion>,
    /// Whether the pen has still to be lifted after all motions so far.
    is_down: bool,
    parked: bool,
}

impl Motions<'_> {
    /// The next motion, or the reason why there is none where one should be.
    fn next_motion(&mut self) -> Result<Option<Motion>, PlanError> {
        while self.queue.is_empty() {
            if self.next < self.strokes.len() {
                self.stroke()?;
            } else if self.parked {
                return Ok(None);
            } else {
                self.parked = true;
                let park = self.planner.settings.park.unwrap_or(self.planner.machine.start());
                self.travel(park);
            }
        }
        Ok(self.queue.pop_front())
    }

    /// Travels to the next stroke, lowers the pen, draws it and lifts the pen.
    fn stroke(&mut self) -> Result<(), PlanError> {
        if self.batch.is_empty() {
            self.plan_batch();
        }
        let (index, stroke) = (self.next, &self.strokes[self.next]);
        self.next += 1;
        let ready = self.batch.pop_front().flatten();
        let planned = self.planner.plan(stroke, &self.here, ready).map_err(|source| PlanError::OutOfReach {
            stroke: index,
            pen: stroke.pen,
            span: stroke.source(),
            source,
        })?;
        self.travel(planned.start);
        if index == 0 && self.queue.is_empty() {
            // The first stroke begins where the plan does: the plan still begins with the pen up.
            self.queue.push_back(Motion::Pen { pen: 0, periods: 1 });
        }
        let pen = self.planner.machine.pen();
        // A dot is nothing but its dwell: without any there would be no ink in the plan.
        let dwell =
            whole_periods(pen.drop_time_s, self.planner.period()).max(u64::from(planned.motions.is_empty()));
        self.queue.push_back(Motion::Pen { pen: stroke.pen.0, periods: dwell });
        self.here = planned.end();
        self.queue.extend(planned.motions.into_iter().map(Motion::Path));
        self.is_down = true;
        Ok(())
    }

    /// Lifts the pen if it is down, and travels. Of the lift's time so much may be travelled as the settings allow, where
    /// the way takes as long: the lift ends before the next drop begins.
    fn travel(&mut self, to: JointPos) {
        let way = self.planner.travel(self.here, to);
        if std::mem::take(&mut self.is_down) {
            let whole = whole_periods(self.planner.machine.pen().lift_time_s, self.planner.period());
            let overlap = (self.planner.settings.lift_overlap / self.planner.period() + 1e-9).floor() as u64;
            let overlap = overlap.min(way.as_ref().map_or(0, |way| way.periods));
            self.queue.push_back(Motion::Pen { pen: 0, periods: whole.saturating_sub(overlap) });
        }
        self.queue.extend(way.map(Motion::Path));
        self.here = to;
    }

    /// Plans the next strokes side by side, each from the pose in which the machine will probably come to it.
    fn plan_batch(&mut self) {
        let mut starts = Vec::new();
        let mut size = 0;
        for stroke in &self.strokes[self.next..] {
            let guess = self.planner.predict_poses(stroke, &self.guess);
            if let Some((_, end)) = guess {
                self.guess = end;
            }
            starts.push((stroke, guess.map(|(start, _)| start)));
            size += stroke.segment_count() + 1;
            if size >= BATCH {
                break;
            }
        }
        let planner = self.planner;
        let plan = |(stroke, start): (&Stroke, Option<JointPos>)| {
            start.map(|start| planner.plan_from(stroke, start))
        };
        self.batch = starts.into_par_iter().map(plan).collect::<Vec<_>>().into();
    }
}

/// Where rows have their motions from.
#[derive(Clone, Debug)]
enum Source<'a> {
    Cached(std::slice::Iter<'a, Motion>),
    Planned(Motions<'a>),
}

impl<'a> Source<'a> {
    fn next_motion(&mut self) -> Option<Cow<'a, Motion>> {
        match self {
            Self::Cached(motions) => motions.next().map(Cow::Borrowed),
            // Whether every stroke can be drawn was seen when the plan was made.
            Self::Planned(motions) => motions.next_motion().ok().flatten().map(Cow::Owned),
        }
    }
}

/// Iterator over the rows of a trajectory.
#[derive(Clone, Debug)]
pub struct Rows<'a> {
    machine: &'a Machine,
    period_us: u64,
    source: Source<'a>,
    /// The motion at hand.
    motion: Option<Cow<'a, Motion>>,
    cursor: Cursor,
    t_us: u64,
    pen: u16,
    /// Where the joints are.
    pose: JointPos,
    finished: bool,
}

impl Iterator for Rows<'_> {
    type Item = ExactRow;

    fn next(&mut self) -> Option<ExactRow> {
        loop {
            if self.motion.is_none() {
                self.motion = self.source.next_motion();
                self.cursor = Cursor::default();
            }
            match self.motion.as_deref() {
                None => {
                    let last = !self.finished;
                    self.finished = true;
                    return last.then(|| self.emit());
                }
                Some(Motion::Pen { pen, periods }) => {
                    self.pen = *pen;
                    let row = (*periods > 0).then(|| self.emit());
                    self.t_us += periods * self.period_us;
                    self.motion = None;
                    if row.is_some() {
                        return row;
                    }
                }
                Some(Motion::Path(movement)) if self.cursor.period == movement.periods => {
                    self.pose = movement.end;
                    self.motion = None;
                }
                Some(Motion::Path(movement)) => {
                    self.pose = self.cursor.pose(self.machine, movement, &self.pose);
                    let row = self.emit();
                    self.cursor.period += 1;
                    self.t_us += self.period_us;
                    return Some(row);
                }
            }
        }
    }
}

/// How far a move has gone.
#[derive(Clone, Copy, Debug, Default)]
struct Cursor {
    /// How many of its periods have gone by.
    period: u64,
    /// Phase of the profile that was last looked at, and the profile's own time at its start.
    phase: usize,
    phase_start: f64,
}

impl Cursor {
    /// The pose now; `near` is the one before.
    fn pose(&mut self, machine: &Machine, movement: &PathMotion, near: &JointPos) -> JointPos {
        let PathMotion { geometry, profile, periods, .. } = movement;
        // The profile is stretched to a whole number of periods, which only slows it down.
        let time = profile.duration * (self.period as f64 / *periods as f64);
        while self.phase + 1 < profile.phases.len()
            && time > self.phase_start + profile.phases[self.phase].duration
        {
            self.phase_start += profile.phases[self.phase].duration;
            self.phase += 1;
        }
        let phase = &profile.phases[self.phase];
        let s = phase.position_at((time - self.phase_start).max(0.0));
        // Between rows no joint turns by half a turn, so the last row's pose says which turn this one is in.
        geometry.pose(machine, phase.piece, s, near)
    }
}

impl Rows<'_> {
    fn emit(&self) -> ExactRow {
        let exact = self.machine.motor_positions(&self.pose);
        let ticks = [exact[0].round() as i64, exact[1].round() as i64];
        ExactRow { row: Row { t_us: self.t_us, pen: self.pen, ticks }, exact: [exact[0], exact[1]] }
    }
}

#[cfg(test)]
#[path = "../tests/machines/mod.rs"]
mod machines;

#[cfg(test)]
mod tests {
    use drawing::{Pen, Point, Span};

    use super::{machines, *};

    /// Enough strokes for several batches: spirals about the base, so that turns differ from stroke to stroke, and ticks.
    fn crowd() -> Drawing {
        let spiral = |k: u32| {
            let point = |j: u32| {
                let (sin, cos) = libm::sincos(0.1 * f64::from(j) + 0.7 * f64::from(k));
                let r = 150.0 + 0.1 * f64::from(k) + 0.02 * f64::from(j);
                Point::new(r * cos, r * sin)
            };
            Stroke::polyline(Pen(1), (0..90).map(point).collect(), Span::default()).expect("there are points")
        };
        Drawing { strokes: (0..100).map(spiral).collect() }
    }

    #[test]
    fn rows_are_the_same_at_any_number_of_threads_and_planned_anew() {
        let machine = machines::arm();
        let in_pool = |threads: usize| -> Vec<ExactRow> {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| {
                let mut trajectory = plan(&machine, crowd(), &Settings::new(0.1, 10_000)).expect("a plan");
                let cached: Vec<ExactRow> = trajectory.rows().collect();
                assert_eq!(cached.len() as u64, trajectory.row_count());
                assert!(trajectory.cached.take().is_some());
                assert!(trajectory.rows().eq(cached.iter().copied()));
                cached
            })
        };
        let alone = in_pool(1);
        assert!(alone.len() > 1000);
        assert_eq!(alone, in_pool(2));
        assert_eq!(alone, in_pool(5));
    }
}
