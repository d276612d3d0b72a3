//! One stroke: where the machine can draw it, and how it moves along it.

use drawing::{Point, Stroke};
use kinematics::{JointPos, Machine, OutOfReach, Unreachable};

use crate::{
    Settings,
    joint_path::{PathGeometry, JointPath},
    path::{PathBudget, Section, sections, vertex_to_vertex},
    settings::{Law, ToleranceBudget},
    time_parametrization::{Profile, SpeedCap, fixed_duration, profile},
};

/// Motion along a joint path from rest to rest. It takes a whole number of periods, so that stops and pen events fall on
/// rows: between rows motors move linearly, and a stop between two rows would be cut.
#[derive(Clone, Debug)]
pub(crate) struct PathMotion {
    pub(crate) geometry: PathGeometry,
    pub(crate) profile: Profile,
    /// The pose at its end.
    pub(crate) end: JointPos,
    pub(crate) periods: u64,
}

/// A stroke as drawn from one of its poses.
#[derive(Clone, Debug)]
pub(crate) struct PlannedStroke {
    pub(crate) start: JointPos,
    /// None for a dot.
    pub(crate) motions: Vec<PathMotion>,
}

impl PlannedStroke {
    pub(crate) fn end(&self) -> JointPos {
        self.motions.last().map_or(self.start, |last| last.end)
    }
}

/// What all strokes of a plan are planned with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StrokePlanner<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) settings: &'a Settings,
    pub(crate) budget: ToleranceBudget,
}

impl StrokePlanner<'_> {
    /// Plans a stroke from the pose nearest to `near` from which all of it can be drawn: a stroke around the base may run
    /// into a joint limit from one turn and not from another. `ready` is what was found for a pose before.
    pub(crate) fn plan(
        &self,
        stroke: &Stroke,
        near: &JointPos,
        ready: Option<Result<PlannedStroke, OutOfReach>>,
    ) -> Result<PlannedStroke, OutOfReach> {
        let start = stroke.start();
        self.machine.check_point(start)?;
        let poses = self.machine.poses(start, near).map_err(|fault| OutOfReach { point: start, fault })?;
        let mut first_error = None;
        if let (Some(Ok(planned)), Some(pose)) = (ready, poses.first())
            && planned.start == *pose
        {
            return Ok(planned);
        }
        for pose in poses {
            match self.plan_from(stroke, pose) {
                Ok(planned) => return Ok(planned),
                Err(error) => first_error = first_error.or(Some(error)),
            }
        }
        let fault =
            kinematics::Fault::Singular { manipulability: 0.0, min: self.machine.parts().min_manipulability };
        Err(first_error.unwrap_or(OutOfReach { point: start, fault }))
    }

    /// The pose near `near` in which a stroke would most likely begin, and one in which it would end.
    pub(crate) fn predict_poses(&self, stroke: &Stroke, near: &JointPos) -> Option<(JointPos, JointPos)> {
        let pose = *self.machine.poses(stroke.start(), near).ok()?.first()?;
        let mut end = pose;
        for vertex in stroke.vertices().iter() {
            end = self.machine.pose_near(*vertex, &end).ok()?;
        }
        Some((pose, end))
    }

    /// Plans a stroke from a pose.
    ///
    /// Blends leave the drawing by as much as the tolerance allows. Where the drawing itself runs along the edge of the
    /// reach they may leave that too: such a stroke is followed to the letter, with a rest at every corner.
    pub(crate) fn plan_from(&self, stroke: &Stroke, pose: JointPos) -> Result<PlannedStroke, OutOfReach> {
        let exact = PathBudget { simplify: 0.0, blend: 0.0, ..self.budget.path };
        match self.settings.law {
            Law::TimeOptimal => {
                let sections = |budget: &PathBudget| sections(stroke, budget);
                self.plan_sections(stroke, pose, sections(&self.budget.path))
                    .or_else(|_| self.plan_sections(stroke, pose, sections(&exact)))
            }
            Law::Trapezoid | Law::FixedDuration { .. } => self.plan_sections(stroke, pose, vertex_to_vertex(stroke, &exact)),
        }
    }

    fn plan_sections(&self, stroke: &Stroke, start: JointPos, sections: Vec<Section>) -> Result<PlannedStroke, OutOfReach> {
        let mut planned = PlannedStroke { start, motions: Vec::with_capacity(sections.len()) };
        let speed = self.settings.speed_of(self.machine, stroke.pen);
        for section in sections {
            let end = section.last().map_or(stroke.start(), |piece| piece.curve.end());
            let path = JointPath::lift(self.machine, section, planned.end(), self.settings.tolerance)?;
            let end = self.end_pose(&path, end)?;
            planned.motions.push(self.parametrize(path, end, speed));
        }
        Ok(planned)
    }

    /// The pose at the end of a drawn path, unwrapped along its intervals.
    fn end_pose(&self, path: &JointPath, end: Point) -> Result<JointPos, OutOfReach> {
        let along = path.intervals.iter().fold(path.geometry.start(), |near, interval| {
            path.geometry.pose(self.machine, interval.piece, interval.start, &near)
        });
        let fault = |unreachable: Unreachable| OutOfReach { point: end, fault: unreachable.into() };
        self.machine.pose_near(end, &along).map_err(fault)
    }

    /// Lays the time law upon a path.
    fn parametrize(&self, path: JointPath, end: JointPos, pen: f64) -> PathMotion {
        let period = self.period();
        if let (Law::FixedDuration { easing, segment_time_s }, PathGeometry::Drawn(_, section)) =
            (self.settings.law, &path.geometry)
        {
            let periods = (segment_time_s / period).round().max(1.0) as u64;
            let length = section.iter().map(crate::path::Piece::length).sum();
            let profile = fixed_duration(easing, length, periods as f64 * period);
            return PathMotion { geometry: path.geometry, profile, end, periods };
        }
        let cap = SpeedCap { pen, row_deviation: self.budget.row, period };
        let profile = profile(self.machine, &path, &cap);
        let periods = whole_periods(profile.duration, period).max(1);
        PathMotion { geometry: path.geometry, profile, end, periods }
    }

    /// The way with the pen up from pose to pose; nothing where there is none.
    pub(crate) fn travel(&self, from: JointPos, to: JointPos) -> Option<PathMotion> {
        let path = JointPath::travel(self.machine, from, to)?;
        Some(self.parametrize(path, to, self.machine.pen().max_travel_speed_mm_s))
    }

    /// Time between rows, s.
    pub(crate) fn period(&self) -> f64 {
        self.settings.period_us as f64 * 1e-6
    }
}

/// Whole periods that hold `duration`; a hair over a whole number is rounding, not another period.
pub(crate) fn whole_periods(duration: f64, period: f64) -> u64 {
    (duration / period - 1e-9).ceil().max(0.0) as u64
}
