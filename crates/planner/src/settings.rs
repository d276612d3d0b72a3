//! Planning settings, and how the tolerance is divided between the causes of deviation.

use drawing::{Drawing, Pen, Point};
use kinematics::{JointPos, Machine, MotorPos};
use plan::Rounding;

use crate::{
    error::PlanError,
    path::{Aim, CornerBlend, PathBudget},
    time_parametrization::Easing,
};

/// Planning settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Largest distance between the drawing's ink and the pen's continuous path, in both
    /// directions, mm.
    pub tolerance_mm: f64,
    /// Time between rows, microseconds.
    pub period_us: u64,
    /// Speeds of single pens, mm/s, where they are lower than the machine's limit.
    pub pen_speeds_mm_s: Vec<(Pen, f64)>,
    /// How much of the time that a pen lift takes overlaps with the travel after it, s.
    pub lift_overlap_s: f64,
    /// The timing law along strokes. Travel is always time-optimal.
    pub timing_law: TimingLaw,
    /// How rows take whole ticks.
    pub rounding: Rounding,
    /// Whether path and speed of splines are optimized together; otherwise they are the smoothest
    /// splines within the tolerance, which takes a third of the time to compute.
    pub joint_fit: bool,
}

/// The timing law along strokes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum TimingLaw {
    /// Time-optimal under the motors' limits, with corners blended within the tolerance.
    #[default]
    TimeOptimal,
    /// Time-optimal from vertex to vertex, with a stop at each vertex.
    Trapezoid,
    /// The same duration for every piece between two vertices, whatever the motors' limits are.
    FixedDuration {
        /// Position along the piece against time.
        easing: Easing,
        /// The duration, s; rounded to whole periods, at least one.
        segment_time_s: f64,
    },
}

impl Settings {
    /// Time-optimal motion without lift overlap, every pen at the machine's limit, rounded along the
    /// path.
    pub fn new(tolerance_mm: f64, period_us: u64) -> Self {
        Self {
            tolerance_mm,
            period_us,
            pen_speeds_mm_s: Vec::new(),
            lift_overlap_s: 0.0,
            timing_law: TimingLaw::TimeOptimal,
            rounding: Rounding::Path,
            joint_fit: true,
        }
    }

    /// The speed limit of a pen over the paper, mm/s.
    pub(crate) fn speed_of(&self, machine: &Machine, pen: Pen) -> f64 {
        let own = self.pen_speeds_mm_s.iter().filter(|(which, _)| *which == pen).map(|(_, speed)| *speed);
        own.fold(machine.pen().max_speed_mm_s, f64::min)
    }
}

/// The largest share of the tolerance that linear motion between rows may use.
const ROW_SHARE: f64 = 0.4;

/// The share of the path's tolerance for removing vertices; the rest is for blending corners.
const SIMPLIFY_SHARE: f64 = 0.3;

/// The share kept in reserve for what the bounds do not cover.
const RESERVE: f64 = 0.02;

/// The most segments of a drawing whose strokes become splines where no jerk limits apply.
///
/// A spline costs about twice the time of a plan on blended corners. CONFETI4.plt of the corpus
/// (49,000 lines) took 26 s of CPU with splines and 8.6 s without, and became 0.3 % shorter. Under
/// jerk limits splines save computing time and have no such limit.
const MAX_SPLINE_SEGMENTS: usize = 25_000;

/// How the tolerance is divided.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToleranceBudget {
    /// For linear motion between rows, mm.
    pub(crate) row_mm: f64,
    /// For the path itself.
    pub(crate) path: PathBudget,
    /// For a spline in place of the path, mm; `None` if all strokes keep blended corners.
    pub(crate) spline_mm: Option<f64>,
    /// What that spline aims at.
    pub(crate) aim: Aim,
    /// The largest acceleration of the pen that the motors can produce, mm/s².
    pub(crate) acceleration_mm_s2: f64,
}

impl ToleranceBudget {
    /// Linear motion over a period `T` deviates by at most `T² A / 8`, where `A` is the largest
    /// acceleration of the pen that the motors can produce, sampled at the sheet's center and
    /// corners. Rows get 1.5 times that, at most [`ROW_SHARE`] of the tolerance; the path gets the
    /// rest.
    pub(crate) fn of(machine: &Machine, settings: &Settings, drawing: &Drawing) -> Self {
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
                machine.mechanism().pen_velocity(pose, &machine.joint_rates(&rates)).hypot2().sqrt()
            };
            of(MotorPos::new(a, b)).max(of(MotorPos::new(a, -b)))
        };
        let poses = places.iter().filter_map(|place| machine.pose_near(*place, &machine.start()).ok());
        let acceleration = poses.map(|pose| pen_acceleration(&pose)).fold(0.0, f64::max);
        let tolerance = (1.0 - RESERVE) * settings.tolerance_mm;
        let (needed, share) = (1.5 * period * period * acceleration / 8.0, ROW_SHARE * tolerance);
        let row = needed.min(share);
        let path = tolerance - row;
        let simplify = SIMPLIFY_SHARE * path;
        let zone = if needed > share { row } else { f64::INFINITY };
        let jerk = machine.motors().iter().any(|motor| motor.max_jerk_ticks_s3.is_some());
        let corner = if jerk { CornerBlend::Spline } else { CornerBlend::Parabola };
        Self {
            row_mm: row,
            spline_mm: (jerk || has_at_most(drawing, MAX_SPLINE_SEGMENTS)).then_some(path),
            aim: if settings.joint_fit { aim(machine) } else { Aim::Smoothest },
            acceleration_mm_s2: acceleration,
            path: PathBudget {
                chord_mm: 0.5 * path,
                simplify_mm: simplify,
                blend_mm: path - simplify,
                corner,
                row_mm: zone,
            },
        }
    }
}

fn has_at_most(drawing: &Drawing, segments: usize) -> bool {
    let mut count = 0;
    drawing.strokes.iter().all(|stroke| {
        count += stroke.segment_count();
        count <= segments
    })
}

/// What splines aim at.
fn aim(machine: &Machine) -> Aim {
    let has_jerk = machine.motors().iter().any(|motor| motor.max_jerk_ticks_s3.is_some());
    if has_jerk { Aim::FastestUnderJerk } else { Aim::Fastest }
}

/// Checks that every setting is in its valid range.
pub(crate) fn check(settings: &Settings) -> Result<(), PlanError> {
    let require = |holds: bool, what: &'static str| holds.then_some(()).ok_or(PlanError::Setting { what });
    require((1e-4..=10.0).contains(&settings.tolerance_mm), "the tolerance must be from 0.0001 mm to 10 mm")?;
    require((1..=10_000_000).contains(&settings.period_us), "the period must be between 1 us and 10 s")?;
    let speeds = settings.pen_speeds_mm_s.iter().all(|(_, speed)| *speed > 0.0 && speed.is_finite());
    require(speeds, "a pen's speed must be a positive number of mm/s")?;
    require(
        (0.0..=3600.0).contains(&settings.lift_overlap_s),
        "the overlap of lifts must be between 0 and an hour",
    )?;
    let TimingLaw::FixedDuration { segment_time_s, .. } = settings.timing_law else { return Ok(()) };
    require(
        (1e-6..=3600.0).contains(&segment_time_s),
        "the time of a segment must be between 1 us and an hour",
    )
}

#[cfg(test)]
mod tests {
    use test_support::machines::{corexy, with_jerk};
    use test_support::polyline;

    use super::*;

    #[test]
    fn splines_in_large_drawings_only_under_jerk_limits() {
        let zigzag = |lines: usize| Drawing {
            strokes: vec![polyline((0..=lines).map(|k| (10.0 + k as f64 * 0.005, (k % 2) as f64)))].into(),
        };
        let settings = Settings::new(0.1, 10_000);
        let has_splines = |machine: &Machine, lines| {
            ToleranceBudget::of(machine, &settings, &zigzag(lines)).spline_mm.is_some()
        };
        assert!(has_splines(&corexy(), MAX_SPLINE_SEGMENTS));
        assert!(!has_splines(&corexy(), MAX_SPLINE_SEGMENTS + 1));
        assert!(has_splines(&with_jerk(&corexy(), 0.02), MAX_SPLINE_SEGMENTS + 1));
    }
}
