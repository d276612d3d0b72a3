//! The certificate of a plan.

use schemars::JsonSchema;
use serde::Serialize;
use verify::{Certificate, Deviation, DeviationStats, MotorPeak};

use super::round;

/// A certificate: what the replay of a plan measured.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CertificateReport {
    /// Whether nothing failed.
    pub holds: bool,
    /// What failed, in sentences.
    pub failures: Vec<String>,
    /// The tolerance claimed, mm.
    pub tolerance_mm: f64,
    /// Distances of the exact path; `null` where exact positions are not known.
    pub before_rounding: Option<DeviationReport>,
    /// Distances of the path through whole ticks; `null` where no drawing was given.
    pub after_rounding: Option<DeviationReport>,
    /// The quantization error of this machine along this ink.
    pub tick_floor: TickFloor,
    /// How rows take whole ticks: `path` or `nearest`.
    pub rounding: &'static str,
    /// Largest distance of a row from its exact position, ticks; `null` where that is not known.
    pub largest_rounding_ticks: Option<f64>,
    /// Largest distance of the pen, while it is down, from its exact position at the same row, mm: mostly
    /// early or late along the path. `null` where that is not known.
    pub largest_shift_mm: Option<f64>,
    /// The pens that draw, in the order of their first use.
    pub pens: Vec<u16>,
    /// Peaks of each motor.
    pub motors: Vec<MotorReport>,
    /// Rows of the plan.
    pub rows: u64,
    /// Duration of the plan, s.
    pub duration_s: f64,
    /// Length drawn, mm.
    pub ink_mm: f64,
    /// Length travelled with the pen up, mm.
    pub travel_mm: f64,
    /// Times that the pen goes down.
    pub pen_downs: u64,
    /// Pen downs without motion.
    pub dots: u64,
}

/// The two one-sided distances between ink and drawing.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DeviationReport {
    /// From the ink to the drawing.
    pub ink_to_drawing: Distances,
    /// From the drawing to the ink.
    pub drawing_to_ink: Distances,
}

/// A distance along a length.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Distances {
    /// Largest distance, mm.
    pub max_mm: f64,
    /// Distance within which 99 % of the length lies, mm.
    pub p99_mm: f64,
    /// Whether `max_mm` is a lower bound only.
    pub more: bool,
    /// Distance that sampling may have missed, mm.
    pub unseen_mm: f64,
}

/// The quantization error of a machine along a plan's ink: half a tick on both motors.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct TickFloor {
    /// At the worst pose, mm.
    pub worst_mm: f64,
    /// Root mean square, mm.
    pub rms_mm: f64,
}

/// The peaks of one motor. `convert` knows the exact motion: a share is its peak divided by the limit.
/// `verify` knows whole ticks only: a share is then a difference of whole ticks divided by what is
/// allowed, the limit plus the rounding of the ticks. Above 1 the limit is exceeded.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MotorReport {
    /// The motor's name.
    pub name: String,
    /// Peak speed of the exact motion, ticks/s; `null` where it is not known.
    pub speed: Option<f64>,
    /// The speed limit, ticks/s.
    pub speed_limit: f64,
    /// `speed / speed_limit`, or `whole_tick_speed / whole_tick_speed_allowed` where the exact motion is
    /// not known.
    pub speed_share: f64,
    /// The share that 99.9 % of the rows keep.
    pub speed_share_p999: f64,
    /// The first difference of whole ticks that is closest to what is allowed, ticks/s.
    pub whole_tick_speed: f64,
    /// The speed limit plus the rounding of two ticks, ticks/s.
    pub whole_tick_speed_allowed: f64,
    /// Peak acceleration of the exact motion, ticks/s²; `null` where it is not known.
    pub acceleration: Option<f64>,
    /// The acceleration limit, ticks/s².
    pub acceleration_limit: f64,
    /// `acceleration / acceleration_limit`, or `whole_tick_acceleration /
    /// whole_tick_acceleration_allowed` where the exact motion is not known.
    pub acceleration_share: f64,
    /// The share that 99.9 % of the rows keep.
    pub acceleration_share_p999: f64,
    /// The second difference of whole ticks that is closest to what is allowed, ticks/s².
    pub whole_tick_acceleration: f64,
    /// The acceleration limit plus the rounding of three ticks, ticks/s².
    pub whole_tick_acceleration_allowed: f64,
    /// The same for jerk; `null` where the plan has no jerk limit.
    pub jerk: Option<JerkReport>,
}

/// The jerk peak of one motor.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct JerkReport {
    /// Peak jerk of the exact motion, ticks/s³; `null` where it is not known.
    pub jerk: Option<f64>,
    /// The limit, ticks/s³.
    pub limit: f64,
    /// `jerk / limit`, or `whole_tick_jerk / whole_tick_jerk_allowed` where the exact motion is not known.
    pub share: f64,
    /// The share that 99.9 % of the rows keep.
    pub share_p999: f64,
    /// The third difference of whole ticks that is closest to what is allowed, ticks/s³.
    pub whole_tick_jerk: f64,
    /// The jerk limit plus the rounding of four ticks, ticks/s³.
    pub whole_tick_jerk_allowed: f64,
}

impl CertificateReport {
    /// The report of a certificate of a plan that was compared with its drawing.
    pub fn of(certificate: &Certificate) -> Self {
        Self {
            holds: certificate.holds,
            failures: certificate.failures.iter().map(ToString::to_string).collect(),
            tolerance_mm: round::mm(certificate.tolerance_mm),
            before_rounding: certificate.before_rounding.as_ref().map(DeviationReport::of),
            after_rounding: Some(DeviationReport::of(&certificate.after_rounding)),
            tick_floor: TickFloor {
                worst_mm: round::mm(certificate.quantization_error.worst_mm),
                rms_mm: round::mm(certificate.quantization_error.rms_mm),
            },
            rounding: certificate.rounding.name(),
            largest_rounding_ticks: certificate.largest_rounding_ticks.map(round::ticks),
            largest_shift_mm: certificate.largest_shift_mm.map(round::mm),
            pens: certificate.pens.clone(),
            motors: certificate.motors.iter().map(MotorReport::of).collect(),
            rows: certificate.rows,
            duration_s: round::s(certificate.duration_us as f64 * 1e-6),
            ink_mm: round::mm(certificate.ink_mm),
            travel_mm: round::mm(certificate.travel_mm),
            pen_downs: certificate.pen_downs,
            dots: certificate.dots,
        }
    }

    /// The report of a certificate of a plan without a drawing to compare it with.
    pub fn of_motion(certificate: &Certificate) -> Self {
        Self { after_rounding: None, ..Self::of(certificate) }
    }
}

impl DeviationReport {
    fn of(deviation: &Deviation) -> Self {
        let distances = |stats: &DeviationStats| Distances {
            max_mm: round::mm(stats.max_mm),
            p99_mm: round::mm(stats.p99_mm),
            more: stats.is_lower_bound,
            unseen_mm: round::mm(stats.sampling_error_mm),
        };
        Self {
            ink_to_drawing: distances(&deviation.ink_to_drawing),
            drawing_to_ink: distances(&deviation.drawing_to_ink),
        }
    }
}

impl MotorReport {
    fn of(peak: &MotorPeak) -> Self {
        Self {
            name: peak.name.clone(),
            speed: peak.speed_ticks_s.map(round::ticks),
            speed_limit: round::ticks(peak.speed_limit_ticks_s),
            speed_share: round::share(peak.speed_share),
            whole_tick_speed: round::ticks(peak.whole_tick_speed_ticks_s),
            whole_tick_speed_allowed: round::ticks(peak.whole_tick_speed_allowed_ticks_s),
            speed_share_p999: round::share(peak.speed_share_p999),
            acceleration: peak.acceleration_ticks_s2.map(round::ticks),
            acceleration_limit: round::ticks(peak.acceleration_limit_ticks_s2),
            acceleration_share: round::share(peak.acceleration_share),
            whole_tick_acceleration: round::ticks(peak.whole_tick_acceleration_ticks_s2),
            whole_tick_acceleration_allowed: round::ticks(peak.whole_tick_acceleration_allowed_ticks_s2),
            acceleration_share_p999: round::share(peak.acceleration_share_p999),
            jerk: peak.jerk.map(|peak| JerkReport {
                jerk: peak.jerk_ticks_s3.map(round::ticks),
                limit: round::ticks(peak.limit_ticks_s3),
                share: round::share(peak.share),
                share_p999: round::share(peak.share_p999),
                whole_tick_jerk: round::ticks(peak.whole_tick_jerk_ticks_s3),
                whole_tick_jerk_allowed: round::ticks(peak.whole_tick_jerk_allowed_ticks_s3),
            }),
        }
    }
}
