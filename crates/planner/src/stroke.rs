//! Planning of one stroke: the pose it starts from, and the motion along it.

use drawing::{Point, Stroke};
use kinematics::{JointPos, Machine, OutOfReach, Unreachable};

use crate::{
    joint_path::{JointPath, PathGeometry},
    path::{PathBudget, Piece, Section, sections, vertex_to_vertex},
    settings::{Settings, TimingLaw, ToleranceBudget},
    time_parametrization::{Profile, SpeedCap, fixed_duration, profile},
};

/// Motion along a joint path from rest to rest. It takes a whole number of periods, so that stops
/// and pen events coincide with rows: motors move linearly between rows, which would cut the corner
/// at a stop between two rows.
#[derive(Clone, Debug)]
pub(crate) struct PathMotion {
    pub(crate) geometry: PathGeometry,
    pub(crate) profile: Profile,
    /// The pose at its end.
    pub(crate) end: JointPos,
    pub(crate) periods: u64,
}

/// The motion along a stroke, from one of the poses it can start from.
#[derive(Clone, Debug)]
pub(crate) struct PlannedStroke {
    pub(crate) start: JointPos,
    /// Empty for a dot.
    pub(crate) motions: Vec<PathMotion>,
}

impl PlannedStroke {
    pub(crate) fn end(&self) -> JointPos {
        self.motions.last().map_or(self.start, |last| last.end)
    }
}

/// What the strokes of a plan have in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StrokePlanner<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) settings: &'a Settings,
    pub(crate) budget: ToleranceBudget,
}

impl StrokePlanner<'_> {
    /// Plans a stroke from the first pose, in order of distance from `near`, from which all of it
    /// is reachable: a stroke around the base may hit a joint limit from one turn but not from
    /// another. `candidate` is the result for a predicted pose; it is used if the prediction was
    /// right.
    pub(crate) fn plan(
        &self,
        stroke: &Stroke,
        near: &JointPos,
        candidate: Option<Result<PlannedStroke, OutOfReach>>,
    ) -> Result<PlannedStroke, OutOfReach> {
        let start = stroke.start();
        self.machine.check_point(start)?;
        let poses = self.machine.poses(start, near).map_err(|fault| OutOfReach { point: start, fault })?;
        let mut first_error = None;
        if let (Some(Ok(planned)), Some(pose)) = (candidate, poses.first())
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

    /// Predicts the poses in which a stroke starts and ends if the machine arrives near `near`.
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
    /// Blends deviate from the drawing by up to the tolerance. Where the drawing follows the
    /// boundary of the reach, a blend may leave the reach: such a stroke is planned again without
    /// blends, with a stop at every corner.
    pub(crate) fn plan_from(&self, stroke: &Stroke, pose: JointPos) -> Result<PlannedStroke, OutOfReach> {
        let exact = PathBudget { simplify_mm: 0.0, blend_mm: 0.0, ..self.budget.path };
        match self.settings.timing_law {
            TimingLaw::TimeOptimal => self
                .plan_sections(stroke, pose, sections(stroke, &self.budget.path))
                .or_else(|_| self.plan_sections(stroke, pose, sections(stroke, &exact))),
            TimingLaw::Trapezoid | TimingLaw::FixedDuration { .. } => {
                self.plan_sections(stroke, pose, vertex_to_vertex(stroke, &exact))
            }
        }
    }

    fn plan_sections(
        &self,
        stroke: &Stroke,
        start: JointPos,
        sections: Vec<Section>,
    ) -> Result<PlannedStroke, OutOfReach> {
        let mut planned = PlannedStroke { start, motions: Vec::with_capacity(sections.len()) };
        let speed = self.settings.speed_of(self.machine, stroke.pen);
        for section in sections {
            let end = section.last().map_or(stroke.start(), |piece| piece.curve.end());
            let path =
                JointPath::from_section(self.machine, section, planned.end(), self.settings.tolerance_mm)?;
            let end = self.end_pose(&path, end)?;
            planned.motions.push(self.parametrize(path, end, speed));
        }
        Ok(planned)
    }

    /// The pose at the end of a path, with angles unwrapped along its intervals.
    fn end_pose(&self, path: &JointPath, end: Point) -> Result<JointPos, OutOfReach> {
        let out_of_reach = |fault: Unreachable| OutOfReach { point: end, fault: fault.into() };
        let mut near = path.geometry.start();
        for interval in &path.intervals {
            near = path
                .geometry
                .pose(self.machine, interval.piece, interval.start, &near)
                .map_err(out_of_reach)?;
        }
        self.machine.pose_near(end, &near).map_err(out_of_reach)
    }

    /// Computes the velocity profile along a path.
    fn parametrize(&self, path: JointPath, end: JointPos, pen_mm_s: f64) -> PathMotion {
        let period = self.period();
        if let (TimingLaw::FixedDuration { easing, segment_time_s }, PathGeometry::Drawn(_, section)) =
            (self.settings.timing_law, &path.geometry)
        {
            let periods = (segment_time_s / period).round().max(1.0) as u64;
            let length = section.iter().map(Piece::length).sum();
            let profile = fixed_duration(easing, length, periods as f64 * period);
            return PathMotion { geometry: path.geometry, profile, end, periods };
        }
        let cap = SpeedCap { pen_mm_s, row_deviation_mm: self.budget.row_mm, period_s: period };
        let profile = profile(self.machine, &path, &cap);
        let periods = whole_periods(profile.duration_s, period).max(1);
        PathMotion { geometry: path.geometry, profile, end, periods }
    }

    /// The motion with the pen up between two poses; `None` if they are equal.
    pub(crate) fn travel(&self, from: JointPos, to: JointPos) -> Option<PathMotion> {
        let path = JointPath::travel(self.machine, from, to)?;
        Some(self.parametrize(path, to, self.machine.pen().max_travel_speed_mm_s))
    }

    /// Time between rows, s.
    pub(crate) fn period(&self) -> f64 {
        self.settings.period_us as f64 * 1e-6
    }
}

/// The number of periods that cover `duration`. An excess below 1e-9 periods is rounding error and
/// does not add a period.
pub(crate) fn whole_periods(duration: f64, period: f64) -> u64 {
    (duration / period - 1e-9).ceil().max(0.0) as u64
}
