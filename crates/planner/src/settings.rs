//! How a plan is to be made, and how its tolerance is shared out.

use drawing::{Pen, Point};
use kinematics::{JointPos, Machine, MotorPos};

use crate::{
    PlanError,
    path::{PathBudget, CornerBlend},
    time_parametrization::Easing,
};

/// How a plan is made.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Largest distance between the drawing's ink and the pen's continuous path, both ways, mm.
    pub tolerance: f64,
    /// Time between rows, microseconds.
    pub period_us: u64,
    /// Where the plan ends, pen up and at rest; the machine's start pose if nothing is said.
    pub park: Option<JointPos>,
    /// Speeds of single pens, mm/s, where they are to be slower than the machine's pen may be.
    pub pen_speeds: Vec<(Pen, f64)>,
    /// For how much of the time that a lift takes the motors may already travel, s.
    pub lift_overlap: f64,
    /// How the pen speeds up and slows down over the paper. Travel is always as fast as the motors can.
    pub law: Law,
}

/// How speed goes along the strokes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Law {
    /// As fast as the motors can, corners rounded within the tolerance.
    #[default]
    TimeOptimal,
    /// As fast as the motors can from vertex to vertex, with a rest at each.
    Trapezoid,
    /// The same time for every piece between two vertices, whatever the motors can.
    FixedDuration {
        /// How the way goes with time.
        easing: Easing,
        /// The time, s; rounded to whole periods, one at least.
        segment_time_s: f64,
    },
}

impl Settings {
    /// Time-optimal, parked at the start pose, all pens as fast as the machine's pen may be.
    pub fn new(tolerance: f64, period_us: u64) -> Self {
        Self {
            tolerance,
            period_us,
            park: None,
            pen_speeds: Vec::new(),
            lift_overlap: 0.0,
            law: Law::TimeOptimal,
        }
    }

    /// How fast a pen may go over the paper, mm/s.
    pub(crate) fn speed_of(&self, machine: &Machine, pen: Pen) -> f64 {
        let own = self.pen_speeds.iter().filter(|(which, _)| *which == pen).map(|(_, speed)| *speed);
        own.fold(machine.pen().max_speed_mm_s, f64::min)
    }
}

/// The largest share of the tolerance that linear motion between rows may use.
const ROW_SHARE: f64 = 0.4;

/// The share of the tolerance within which straight pieces may stand for several, where there are corners to blend.
const SIMPLIFY_SHARE: f64 = 0.3;

/// The share that is kept for what the bounds leave out.
const RESERVE: f64 = 0.02;

/// How the tolerance is shared out, mm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToleranceBudget {
    /// To linear motion between rows.
    pub(crate) row: f64,
    /// To the path itself.
    pub(crate) path: PathBudget,
}

impl ToleranceBudget {
    /// Rows need no more than the largest acceleration can bend the pen's way over a period: by `T² A / 8`. What is
    /// left goes to the corners.
    pub(crate) fn of(machine: &Machine, settings: &Settings) -> Self {
        let period = settings.period_us as f64 * 1e-6;
        let sheet = machine.sheet();
        let places = [
            sheet.center(),
            Point::new(sheet.x0, sheet.y0),
            Point::new(sheet.x1, sheet.y0),
            Point::new(sheet.x1, sheet.y1),
            Point::new(sheet.x0, sheet.y1),
        ];
        let [a, b] = machine.motors().each_ref().map(|motor| motor.max_acceleration_ticks_s2);
        let pen_acceleration = |pose: &JointPos| {
            let of = |rates: MotorPos| {
                machine.geometry().pen_velocity(pose, &machine.joint_rates(&rates)).hypot2().sqrt()
            };
            of(MotorPos::new(a, b)).max(of(MotorPos::new(a, -b)))
        };
        let poses = places.iter().filter_map(|place| machine.pose_near(*place, &machine.start()).ok());
        let acceleration = poses.map(|pose| pen_acceleration(&pose)).fold(0.0, f64::max);
        let tolerance = (1.0 - RESERVE) * settings.tolerance;
        let (needed, share) = (1.5 * period * period * acceleration / 8.0, ROW_SHARE * tolerance);
        let row = needed.min(share);
        let path = tolerance - row;
        let simplify = SIMPLIFY_SHARE * path;
        let marked = if needed > share { row } else { f64::INFINITY };
        let jerk = machine.motors().iter().any(|motor| motor.max_jerk_ticks_s3.is_some());
        let corner = if jerk { CornerBlend::Spline } else { CornerBlend::Parabola };
        Self {
            row,
            path: PathBudget { chord: 0.5 * path, simplify, blend: path - simplify, corner, row: marked },
        }
    }
}

/// Whether the settings make sense.
pub(crate) fn check(settings: &Settings) -> Result<(), PlanError> {
    let setting =
        |holds: bool, what: &str| holds.then_some(()).ok_or(PlanError::Setting { what: what.into() });
    setting(
        settings.tolerance >= 1e-4 && settings.tolerance.is_finite(),
        "the tolerance must be at least 0.0001 mm",
    )?;
    setting((1..=10_000_000).contains(&settings.period_us), "the period must be between 1 us and 10 s")?;
    let speeds = settings.pen_speeds.iter().all(|(_, speed)| *speed > 0.0 && speed.is_finite());
    setting(speeds, "a pen's speed must be a positive number of mm/s")?;
    setting(
        (0.0..=3600.0).contains(&settings.lift_overlap),
        "the overlap of lifts must be between 0 and an hour",
    )?;
    let Law::FixedDuration { segment_time_s, .. } = settings.law else { return Ok(()) };
    setting((1e-6..=3600.0).contains(&segment_time_s), "the time of a segment must be between 1 us and an hour")
}
