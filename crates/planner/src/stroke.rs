//! Planning of one stroke: the pose it starts from, and the motion along it.

use drawing::{Point, Stroke};
use kinematics::{Fault, JointPos, Machine, MotorPos, OutOfReach, Unreachable};

use crate::{
    backlash,
    error::PlanError,
    joint_path::{JointPath, PathGeometry},
    path::{
        Aim, Limits, PathBudget, Piece, Section, bound_speed, fitted, sections, shortest_length,
        vertex_to_vertex,
    },
    settings::{Settings, TimingLaw, ToleranceBudget},
    time_parametrization::{Profile, SpeedCap, fixed_duration, profile, without_jerk},
    travel::waypoints,
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
    /// Whether its corners are blended one by one: no spline is faster.
    pub(crate) has_blends: bool,
}

/// Joint paths, and the pose at the end of each.
type Lifted = Vec<(JointPath, JointPos)>;

/// A spline is not tried where it could save at most this share of a stroke's time.
const LEAST_GAIN: f64 = 5e-3;

/// Ratios of durations without jerk limits that decide between two ways to draw a stroke.
const CLEARLY_FASTER: f64 = 0.92;
const CLEARLY_SLOWER: f64 = 1.08;

impl PlannedStroke {
    /// Periods, and seconds where those are equal.
    fn duration_key(&self) -> (u64, f64) {
        let periods = self.motions.iter().map(|motion| motion.periods).sum();
        (periods, self.duration_s())
    }

    /// Without rounding to periods.
    fn duration_s(&self) -> f64 {
        self.motions.iter().map(|motion| motion.profile.duration_s).sum()
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
        let poses = self.start_poses(stroke, near).map_err(|fault| OutOfReach { point: start, fault })?;
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
        let fault = Fault::Singular { manipulability: 0.0, min: self.machine.parts().min_manipulability };
        Err(first_error.unwrap_or(OutOfReach { point: start, fault }))
    }

    /// The poses a stroke can start from, in order of distance from `near`. At a pole it starts in the
    /// direction of its first line.
    fn start_poses(&self, stroke: &Stroke, near: &JointPos) -> Result<Vec<JointPos>, Fault> {
        let start = stroke.start();
        match stroke.segments().next() {
            Some(first) if self.machine.mechanism().pole() == Some(start) => {
                self.machine.poses_at_pole(first.end(), near)
            }
            _ => self.machine.poses(start, near),
        }
    }

    /// Predicts the poses in which a stroke starts and ends if the machine arrives near `near`.
    pub(crate) fn predict_poses(&self, stroke: &Stroke, near: &JointPos) -> Option<(JointPos, JointPos)> {
        let pose = *self.start_poses(stroke, near).ok()?.first()?;
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
            TimingLaw::TimeOptimal => {
                let blended = self
                    .lift(stroke, pose, sections(stroke, &self.budget.path))
                    .or_else(|_| self.lift(stroke, pose, sections(stroke, &exact)))?;
                let is_line = blended.len() < 2 && blended.iter().all(|(path, _)| path.is_line());
                let planned = if is_line {
                    self.planned(stroke, pose, blended)
                } else {
                    self.faster(stroke, pose, blended)
                };
                Ok(planned)
            }
            TimingLaw::Trapezoid | TimingLaw::FixedDuration { .. } => {
                let paths = self.lift(stroke, pose, vertex_to_vertex(stroke, &exact))?;
                Ok(self.planned(stroke, pose, paths))
            }
        }
    }

    /// The joint paths of some sections, and the pose at the end of each.
    fn lift(&self, stroke: &Stroke, start: JointPos, sections: Vec<Section>) -> Result<Lifted, OutOfReach> {
        let mut lifted = Vec::with_capacity(sections.len());
        let mut pose = start;
        for section in sections {
            let end = section.last().map_or(stroke.start(), |piece| piece.curve.end());
            let path = JointPath::from_section(self.machine, section, pose, self.settings.tolerance_mm)?;
            pose = self.end_pose(&path, end)?;
            lifted.push((path, pose));
        }
        Ok(lifted)
    }

    /// The stroke as one spline; `None` where there is none within the tolerance and the reach.
    fn spline(&self, stroke: &Stroke, start: JointPos) -> Option<Lifted> {
        [false, true]
            .into_iter()
            .find_map(|cautious| self.spline_by(stroke, start, self.budget.aim, cautious))
    }

    fn spline_by(&self, stroke: &Stroke, start: JointPos, aim: Aim, cautious: bool) -> Option<Lifted> {
        let limits = Limits::new(self.machine, self.settings.speed_of(self.machine, stroke.pen));
        let mut section = fitted(stroke, &limits, self.budget.spline_mm?, aim, cautious)?;
        let row = self.budget.path.row_mm;
        if row.is_finite() {
            section =
                bound_speed(section, row, self.settings.speed_of(self.machine, stroke.pen) * self.period())?;
        }
        self.lift(stroke, start, vec![section]).ok()
    }

    /// The motion along the spline or along the blended corners, whichever is faster.
    fn faster(&self, stroke: &Stroke, start: JointPos, blended: Lifted) -> PlannedStroke {
        if self.has_jerk() {
            return self.faster_under_jerk(stroke, start, blended);
        }
        let blends = PlannedStroke { has_blends: true, ..self.planned(stroke, start, blended) };
        if self.gains_nothing(stroke, blends.duration_s()) {
            return blends;
        }
        match self.spline(stroke, start).map(|spline| self.planned(stroke, start, spline)) {
            Some(spline) if spline.duration_key() < blends.duration_key() => spline,
            _ => blends,
        }
    }

    /// The same under jerk limits, where profiles take longer to compute: the durations without
    /// these limits decide, unless they are nearly the same, or rows limit the speed near corners.
    fn faster_under_jerk(&self, stroke: &Stroke, start: JointPos, blended: Lifted) -> PlannedStroke {
        let blends = |blended| PlannedStroke { has_blends: true, ..self.planned(stroke, start, blended) };
        // On some strokes the steps of the joint fit end far from its optimum, and the smoothest path is faster.
        let smoothest = (self.budget.aim != Aim::Smoothest)
            .then(|| self.spline_by(stroke, start, Aim::Smoothest, false))
            .flatten();
        let mut splines = self.spline(stroke, start).into_iter().chain(smoothest);
        let Some(spline) = splines.next() else { return blends(blended) };
        let other = splines.next();
        let faster =
            |a: PlannedStroke, b: PlannedStroke| if b.duration_key() < a.duration_key() { b } else { a };
        let along = |spline: Lifted, other: Option<Lifted>| {
            let spline = self.planned(stroke, start, spline);
            match other {
                Some(other) => faster(spline, self.planned(stroke, start, other)),
                None => spline,
            }
        };
        if !self.budget.path.row_mm.is_finite() {
            let cap = self.cap(self.settings.speed_of(self.machine, stroke.pen));
            let rough = |paths: &Lifted| {
                paths.iter().map(|(path, _)| without_jerk(self.machine, path, &cap).duration_s).sum::<f64>()
            };
            let least = rough(&spline).min(other.as_ref().map_or(f64::INFINITY, rough));
            let ratio = least / rough(&blended);
            if ratio < CLEARLY_FASTER {
                return along(spline, other);
            }
            if ratio > CLEARLY_SLOWER {
                return blends(blended);
            }
        }
        faster(blends(blended), along(spline, other))
    }

    fn has_jerk(&self) -> bool {
        self.machine.motors().iter().any(|motor| motor.max_jerk_ticks_s3.is_some())
    }

    /// Whether a stroke drawn in `duration_s` is about as fast as a line of its length would be: on
    /// long gentle curves the pen's own limit is reached with any path.
    fn gains_nothing(&self, stroke: &Stroke, duration_s: f64) -> bool {
        let Some(tolerance) = self.budget.spline_mm else { return true };
        let speed = self.settings.speed_of(self.machine, stroke.pen);
        let acceleration = self.budget.acceleration_mm_s2;
        let length = shortest_length(stroke, tolerance);
        // From rest to rest.
        let least = if length * acceleration > speed * speed {
            length / speed + speed / acceleration
        } else {
            2.0 * (length / acceleration).sqrt()
        };
        duration_s <= (1.0 + LEAST_GAIN) * least
    }

    /// The fastest motion along the paths of a stroke.
    fn planned(&self, stroke: &Stroke, start: JointPos, paths: Lifted) -> PlannedStroke {
        let speed = self.settings.speed_of(self.machine, stroke.pen);
        let parts = paths.into_iter().flat_map(|(path, end)| {
            // The pen stops where a motor takes up its backlash.
            backlash::between_reversals(self.machine, path, end)
        });
        let motions = parts.map(|(path, end)| self.parametrize(path, end, speed)).collect();
        PlannedStroke { start, motions, has_blends: false }
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
        let cap = self.cap(pen_mm_s);
        let profile = profile(self.machine, &path, &cap);
        let periods = whole_periods(profile.duration_s, period).max(1);
        PathMotion { geometry: path.geometry, profile, end, periods }
    }

    fn cap(&self, pen_mm_s: f64) -> SpeedCap {
        SpeedCap { pen_mm_s, row_deviation_mm: self.budget.row_mm, period_s: self.period() }
    }

    /// The motions with the pen up between two poses; none if they are equal, more than one where the
    /// direct way would pass a singular pose.
    ///
    /// # Errors
    /// When there is no way.
    pub(crate) fn travel(&self, from: JointPos, to: JointPos) -> Result<Vec<PathMotion>, PlanError> {
        let poses = waypoints(self.machine, from, to).ok_or_else(|| {
            let [from, to] = [from, to].map(|pose| self.machine.mechanism().forward(&pose));
            PlanError::NoTravel { from, to }
        })?;
        let mut motions = Vec::with_capacity(poses.len());
        let mut from = from;
        for to in poses {
            let path = JointPath::travel(self.machine, from, to);
            motions.extend(
                path.map(|path| self.parametrize(path, to, self.machine.pen().max_travel_speed_mm_s)),
            );
            from = to;
        }
        Ok(motions)
    }

    /// The motion of the motors across their play, by `change` ticks.
    pub(crate) fn crossing(&self, change: MotorPos) -> PathMotion {
        let path = backlash::crossing(self.machine, change);
        let end = self.machine.joint_rates(&change);
        self.parametrize(path, end, f64::INFINITY)
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
