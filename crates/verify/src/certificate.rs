//! What a replay found, as plain data.

use crate::Failure;

/// What one plan does to one drawing on one machine, measured by replay.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// Whether nothing failed.
    pub holds: bool,
    /// What failed: each kind once (each motor's limits apart), with the worst or the first place and how often.
    pub failures: Vec<Failure>,
    /// The tolerance that was claimed, mm.
    pub tolerance_mm: f64,
    /// Between the drawing and the path through the exact motor positions; nothing when not every row came with them.
    pub before_rounding: Option<Deviation>,
    /// Between the drawing and the path through the whole ticks of the table.
    pub after_rounding: Deviation,
    /// What whole ticks cost on this machine along this ink, whoever plans.
    pub tick_floor: TickFloor,
    /// Largest distance of a row's ticks from the exact motor positions it came with, ticks: at most 1/2 if rounding
    /// never drifts. Nothing when not every row came with them.
    pub largest_rounding_ticks: Option<f64>,
    /// The pens that drew, each once, in the order of their first use.
    pub pens: Vec<u16>,
    /// Peaks of each motor, in the order of the columns.
    pub motors: [MotorPeak; plan::MOTORS],
    /// How many rows there were.
    pub rows: u64,
    /// Time of the last row, microseconds.
    pub duration_us: u64,
    /// Length drawn, mm: along the exact path where it is known, otherwise along the ticks (which is a little longer).
    pub ink_mm: f64,
    /// Length travelled with the pen up, mm, measured as straight from row to row.
    pub travel_mm: f64,
    /// How often the pen was put down.
    pub pen_downs: u64,
    /// How often it was put down and lifted without moving.
    pub dots: u64,
}

/// The two one-sided (directed) Hausdorff distances between ink and drawing, pen by pen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// How far the ink strays: from each point of the ink to the nearest stroke of the same pen.
    pub ink_to_drawing: DeviationStats,
    /// How much is missed: from each point of the drawing to the nearest ink of the same pen.
    pub drawing_to_ink: DeviationStats,
}

impl Deviation {
    /// The larger of the two, mm: the Hausdorff distance.
    pub fn max_mm(&self) -> f64 {
        self.ink_to_drawing.max_mm.max(self.drawing_to_ink.max_mm)
    }
}

/// How a distance is spread along a length. Both figures are bounds from above.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviationStats {
    /// Largest distance, mm. Never understated; overstated by a hundredth of the tolerance at most for the ink, and for
    /// the drawing by an eighth (by two thousandths where the ink's straight parts are no shorter than that).
    pub max_mm: f64,
    /// 99 % of the length is at most so far, mm; overstated by 1/64 of itself at most. Dots have no length and count
    /// for the maximum alone.
    pub p99_mm: f64,
    /// Whether the largest distance is only known to be more than `max_mm`: strokes that no ink came near.
    pub is_lower_bound: bool,
    /// By how much more than `max_mm` the distance could be between the points that were looked at, mm. 0 except for
    /// drawings of such a length that they can only be sampled sparsely.
    pub sampling_error_mm: f64,
}

/// The pen's error that comes from motors standing on whole ticks alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TickFloor {
    /// Half a tick on both motors, the worse way, at the worst pose of the ink, mm.
    pub worst_mm: f64,
    /// Root mean square over the ink: uniform rounding errors have the variance 1/12 tick², so it is
    /// `sqrt(sum_i |J_i|^2 / 12)` with `J_i` the pen's movement for one tick of motor `i`, mm.
    pub rms_mm: f64,
}

/// The hardest one motor is driven, in finite differences of the table's whole ticks.
///
/// With steps of one period `T` the limits are `|first difference| <= v T + 1 tick` and
/// `|second difference| <= a T^2 + 2 ticks`: the whole ticks are each half a tick off at most. A share is the
/// difference divided by that bound, so that 1 is the most a good plan can show.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorPeak {
    /// The motor's name.
    pub name: String,
    /// Largest first difference over time, ticks/s; includes the rounding of both its ticks.
    pub speed_ticks_s: f64,
    /// Largest second difference over time squared, ticks/s²; includes the rounding of its three ticks.
    pub acceleration_ticks_s2: f64,
    /// The limit the plan states, ticks/s.
    pub speed_limit_ticks_s: f64,
    /// The limit the plan states, ticks/s².
    pub acceleration_limit_ticks_s2: f64,
    /// Largest share of the speed limit with its rounding allowance.
    pub speed_share: f64,
    /// Largest share of the acceleration limit with its rounding allowance.
    pub acceleration_share: f64,
    /// 99.9 % of the row steps in which this motor moves have a smaller share of the speed limit; overstated
    /// by 1/64 of itself at most.
    pub speed_share_p999: f64,
    /// 99.9 % of the rows about which this motor moves have a smaller share of the acceleration limit;
    /// overstated by 1/64 of itself at most.
    pub acceleration_share_p999: f64,
    /// The same for jerk, where the plan states a limit for it.
    pub jerk: Option<JerkPeak>,
}

/// What one motor was seen to do to its jerk: with steps of one period `T` the limit is `|third difference| <= j T^3 + 4 ticks`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JerkPeak {
    /// Largest third difference over time cubed, ticks/s³; includes the rounding of its four ticks.
    pub jerk_ticks_s3: f64,
    /// The limit the plan states, ticks/s³.
    pub limit_ticks_s3: f64,
    /// Largest share of the limit with its rounding allowance.
    pub share: f64,
    /// 99.9 % of the rows about which this motor moves have a smaller share; overstated by 1/64 of itself at most.
    pub share_p999: f64,
}
