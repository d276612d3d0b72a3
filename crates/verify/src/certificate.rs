//! The results of a replay, as plain data.

use crate::Failure;

/// The results for one plan of one drawing on one machine, measured by replay.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// Whether there are no failures.
    pub holds: bool,
    /// The failures: each kind once (limits once a motor), with its worst or first location and its
    /// count.
    pub failures: Vec<Failure>,
    /// The tolerance that was verified, mm.
    pub tolerance_mm: f64,
    /// Between the drawing and the path through the exact motor positions. `None` unless every row
    /// came with exact positions.
    pub before_rounding: Option<Deviation>,
    /// Between the drawing and the path through the whole ticks of the table.
    pub after_rounding: Deviation,
    /// The quantization error of this machine along this ink, independent of the planner.
    pub quantization_error: QuantizationError,
    /// How the rows take whole ticks, as the plan states it.
    pub rounding: plan::Rounding,
    /// Largest distance of a row's ticks from its exact motor positions: at most
    /// [`plan::Rounding::farthest_ticks`] if rounding does not drift. `None` unless every row came
    /// with exact positions.
    pub largest_rounding_ticks: Option<f64>,
    /// Largest distance of the pen, while it is down, from its exact position at the same row, mm:
    /// mostly early or late along the path. `None` as above.
    pub largest_shift_mm: Option<f64>,
    /// The pens that drew, each once, in the order of first use.
    pub pens: Vec<u16>,
    /// Peaks of each motor, in the order of the columns.
    pub motors: [MotorPeak; plan::MOTORS],
    /// Number of rows.
    pub rows: u64,
    /// Time of the last row, us.
    pub duration_us: u64,
    /// Length of the ink, mm: of the exact path if it is known, otherwise of the path of the ticks,
    /// which is slightly longer.
    pub ink_mm: f64,
    /// Length of pen-up motion, mm, as straight lines from row to row.
    pub travel_mm: f64,
    /// Number of times the pen was lowered.
    pub pen_downs: u64,
    /// Number of times it was lowered and lifted without moving.
    pub dots: u64,
}

impl Certificate {
    /// What the path through the exact motor positions leaves of the tolerance, mm; through the whole ticks if only
    /// those are known.
    pub fn spare_mm(&self) -> f64 {
        let deviation = self.before_rounding.as_ref().unwrap_or(&self.after_rounding);
        (self.tolerance_mm - deviation.max_mm()).max(0.0)
    }
}

/// The two directed Hausdorff distances between ink and drawing, pen by pen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// From each point of the ink to the nearest stroke of the same pen.
    pub ink_to_drawing: DeviationStats,
    /// From each point of the drawing to the nearest ink of the same pen.
    pub drawing_to_ink: DeviationStats,
}

impl Deviation {
    /// The larger of the two, mm: the Hausdorff distance.
    pub fn max_mm(&self) -> f64 {
        self.ink_to_drawing.max_mm.max(self.drawing_to_ink.max_mm)
    }
}

/// Statistics of a distance along a length. Both figures are upper bounds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviationStats {
    /// Largest distance, mm. Never understated. Overstated by at most 1/100 of the tolerance for
    /// the ink, and by at most 1/8 for the drawing (1/500 where straight parts of the ink are
    /// longer than that).
    pub max_mm: f64,
    /// 99 % of the length has at most this distance, mm. For the drawing overstated by at most 1/64 of itself
    /// and 3/8 of the tolerance. For the ink at most 1/12 and 1/50 of the tolerance above the percentile that
    /// results if each run of ink, at most a step between two rows, has its largest distance throughout. Dots
    /// have no length and count for the maximum only.
    pub p99_mm: f64,
    /// Whether `max_mm` is only a lower bound, because no ink came near a part of the drawing.
    pub is_lower_bound: bool,
    /// Amount by which the distance between two sampled points may exceed `max_mm`, mm. 0 except
    /// for drawings that are too long to be sampled densely.
    pub sampling_error_mm: f64,
}

/// The pen error caused by rounding motor positions to whole ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct QuantizationError {
    /// Half a tick on both motors in the worse direction, at the worst pose of the ink, mm.
    pub worst_mm: f64,
    /// Root mean square along the ink, mm. Uniform rounding errors have the variance 1/12 tick², so
    /// it is `sqrt(sum_i |J_i|² / 12)`, where `J_i` is the movement of the pen for one tick of
    /// motor `i`.
    pub rms_mm: f64,
}

/// The peaks of one motor.
///
/// With steps of one period `T` the bounds on whole ticks are `|first difference| <= v T + 1 tick` and
/// `|second difference| <= a T² + 2 ticks`, because each tick is off by half a tick at most. Exact
/// positions are bounded by the limits themselves. A share is a difference divided by its bound, that
/// of the exact motion where all rows came with exact positions: a good plan reaches at most 1.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorPeak {
    /// Name of the motor.
    pub name: String,
    /// Peak speed of the exact motion, ticks/s. `None` unless every row came with exact positions.
    pub speed_ticks_s: Option<f64>,
    /// Peak acceleration of the exact motion, ticks/s². `None` as above.
    pub acceleration_ticks_s2: Option<f64>,
    /// First difference of whole ticks over time that is closest to its bound, ticks/s; includes the
    /// rounding of two ticks.
    pub whole_tick_speed_ticks_s: f64,
    /// Its bound: the limit plus the rounding allowance, ticks/s.
    pub whole_tick_speed_allowed_ticks_s: f64,
    /// Second difference of whole ticks over time² that is closest to its bound, ticks/s²; includes the
    /// rounding of three ticks.
    pub whole_tick_acceleration_ticks_s2: f64,
    /// Its bound: the limit plus the rounding allowance, ticks/s².
    pub whole_tick_acceleration_allowed_ticks_s2: f64,
    /// The speed limit of the machine, ticks/s.
    pub speed_limit_ticks_s: f64,
    /// The acceleration limit of the machine, ticks/s².
    pub acceleration_limit_ticks_s2: f64,
    /// Largest share of the speed bound.
    pub speed_share: f64,
    /// Largest share of the acceleration bound.
    pub acceleration_share: f64,
    /// 99.9th percentile of the share of the speed bound, over the steps in which the motor moves;
    /// overstated by at most 1/64 of itself.
    pub speed_share_p999: f64,
    /// 99.9th percentile of the share of the acceleration bound, over the rows at which the motor
    /// moves; overstated by at most 1/64 of itself.
    pub acceleration_share_p999: f64,
    /// The same for jerk; `None` if the machine has no jerk limit.
    pub jerk: Option<JerkPeak>,
}

/// The peak jerk of one motor, as in [`MotorPeak`]. With steps of one period `T` the bound on whole
/// ticks is `|third difference| <= j T³ + 4 ticks`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JerkPeak {
    /// Peak jerk of the exact motion, ticks/s³. `None` unless every row came with exact positions.
    pub jerk_ticks_s3: Option<f64>,
    /// Third difference of whole ticks over time³ that is closest to its bound, ticks/s³; includes the
    /// rounding of four ticks.
    pub whole_tick_jerk_ticks_s3: f64,
    /// Its bound: the limit plus the rounding allowance, ticks/s³.
    pub whole_tick_jerk_allowed_ticks_s3: f64,
    /// The jerk limit of the machine, ticks/s³.
    pub limit_ticks_s3: f64,
    /// Largest share of the bound.
    pub share: f64,
    /// 99.9th percentile of the share, over the rows at which the motor moves; overstated by at
    /// most 1/64 of itself.
    pub share_p999: f64,
}
