//! Reports: the result of a command, as types that serialize, and as [`text`].
//!
//! Lengths are mm, times s, speeds ticks/s; a share is a fraction of its limit.

pub mod text;

use std::collections::BTreeMap;

use serde::Serialize;
use verify::{Certificate, Deviation, DeviationStats, MotorPeak};

use crate::pipeline::Compiled;

/// The summary of a plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Strokes of the drawing.
    pub strokes: usize,
    /// Strokes drawn, after ordering joined those that touch.
    pub strokes_drawn: usize,
    /// Pen downs without motion.
    pub dots: u64,
    /// The pens that draw, in the order of their first use.
    pub pens: Vec<u16>,
    /// Length drawn, mm.
    pub ink_mm: f64,
    /// Length travelled with the pen up, mm.
    pub travel_mm: f64,
    /// How far ink reaches beyond the sheet, mm; 0 if it does not.
    pub beyond_sheet_mm: f64,
    /// Rows of the plan.
    pub rows: u64,
    /// Duration of the plan, s.
    pub duration_s: f64,
    /// Time with the pen down and moving, s.
    pub drawing_s: f64,
    /// Time of travel, s.
    pub travel_s: f64,
    /// Time of pen lifts and drops, s.
    pub lifting_s: f64,
    /// Drawing time by what limited the speed, s.
    pub limited_by_s: BTreeMap<String, f64>,
    /// Share of the duration with the pen up.
    pub pen_up_share: f64,
    /// Coefficients `a b c d e f` of the map from drawing mm to machine mm.
    pub placement: [f64; 6],
    /// Pen changes in the order drawn.
    pub pen_changes: usize,
    /// What ordering gained; `null` for the file's order.
    pub ordering: Option<Ordering>,
}

/// What ordering gained.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ordering {
    /// Strokes before joining and removing duplicates.
    pub strokes_before: usize,
    /// Strokes after it.
    pub strokes_after: usize,
    /// Strokes joined to another one.
    pub merged: usize,
    /// Duplicate strokes removed.
    pub duplicates_removed: usize,
    /// Travel in the file's order, mm.
    pub travel_mm_before: f64,
    /// Travel in the order drawn, mm.
    pub travel_mm_after: f64,
    /// Travel with lifts and drops in the file's order, s.
    pub travel_s_before: f64,
    /// Travel with lifts and drops in the order drawn, s.
    pub travel_s_after: f64,
}

impl Summary {
    /// The summary of a compiled plan.
    pub fn of(compiled: &Compiled<'_>) -> Self {
        let times = compiled.trajectory.times();
        let certificate = &compiled.certificate;
        let duration_s = compiled.header.duration_us as f64 * 1e-6;
        Self {
            strokes: compiled.placed.strokes.len(),
            strokes_drawn: compiled.strokes,
            dots: certificate.dots,
            pens: certificate.pens.clone(),
            ink_mm: certificate.ink_mm,
            travel_mm: certificate.travel_mm,
            beyond_sheet_mm: compiled.beyond_sheet_mm,
            rows: compiled.header.rows,
            duration_s,
            drawing_s: times.drawing_s,
            travel_s: times.travel_s,
            lifting_s: times.lifting_s,
            limited_by_s: text::limited_by(compiled).into_iter().collect(),
            pen_up_share: (times.travel_s + times.lifting_s) / duration_s,
            placement: compiled.placement.as_coeffs(),
            pen_changes: text::pen_changes(compiled.ordered()),
            ordering: compiled.ordering.as_ref().map(|report| Ordering {
                strokes_before: report.strokes_before,
                strokes_after: report.strokes_after,
                merged: report.merged,
                duplicates_removed: report.duplicates_removed,
                travel_mm_before: report.travel_mm_before,
                travel_mm_after: report.travel_mm_after,
                travel_s_before: report.travel_cost_before,
                travel_s_after: report.travel_cost_after,
            }),
        }
    }
}

/// A certificate: what the replay of a plan measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
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
    /// Largest distance of a row from its exact position, ticks.
    pub largest_rounding_ticks: Option<f64>,
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
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeviationReport {
    /// From the ink to the drawing.
    pub ink_to_drawing: Distances,
    /// From the drawing to the ink.
    pub drawing_to_ink: Distances,
}

/// A distance along a length.
#[derive(Clone, Debug, PartialEq, Serialize)]
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
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TickFloor {
    /// At the worst pose, mm.
    pub worst_mm: f64,
    /// Root mean square, mm.
    pub rms_mm: f64,
}

/// The peaks of one motor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MotorReport {
    /// The motor's name.
    pub name: String,
    /// Largest first difference of whole ticks, ticks/s.
    pub speed: f64,
    /// The speed limit, ticks/s.
    pub speed_limit: f64,
    /// Largest share of the speed limit with its rounding allowance.
    pub speed_share: f64,
    /// The share that 99.9 % of the rows keep.
    pub speed_share_p999: f64,
    /// Largest second difference of whole ticks, ticks/s².
    pub acceleration: f64,
    /// The acceleration limit, ticks/s².
    pub acceleration_limit: f64,
    /// Largest share of the acceleration limit with its rounding allowance.
    pub acceleration_share: f64,
    /// The share that 99.9 % of the rows keep.
    pub acceleration_share_p999: f64,
    /// The same for jerk; `null` where the plan has no jerk limit.
    pub jerk: Option<JerkReport>,
}

/// The jerk peak of one motor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JerkReport {
    /// Largest third difference of whole ticks, ticks/s³.
    pub jerk: f64,
    /// The limit, ticks/s³.
    pub limit: f64,
    /// Largest share of the limit with its rounding allowance.
    pub share: f64,
    /// The share that 99.9 % of the rows keep.
    pub share_p999: f64,
}

impl CertificateReport {
    /// The report of a certificate of a plan that was compared with its drawing.
    pub fn of(certificate: &Certificate) -> Self {
        Self {
            holds: certificate.holds,
            failures: certificate.failures.iter().map(ToString::to_string).collect(),
            tolerance_mm: certificate.tolerance_mm,
            before_rounding: certificate.before_rounding.as_ref().map(DeviationReport::of),
            after_rounding: Some(DeviationReport::of(&certificate.after_rounding)),
            tick_floor: TickFloor {
                worst_mm: certificate.quantization_error.worst_mm,
                rms_mm: certificate.quantization_error.rms_mm,
            },
            largest_rounding_ticks: certificate.largest_rounding_ticks,
            pens: certificate.pens.clone(),
            motors: certificate.motors.iter().map(MotorReport::of).collect(),
            rows: certificate.rows,
            duration_s: certificate.duration_us as f64 * 1e-6,
            ink_mm: certificate.ink_mm,
            travel_mm: certificate.travel_mm,
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
            max_mm: stats.max_mm,
            p99_mm: stats.p99_mm,
            more: stats.is_lower_bound,
            unseen_mm: stats.sampling_error_mm,
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
            speed: peak.speed_ticks_s,
            speed_limit: peak.speed_limit_ticks_s,
            speed_share: peak.speed_share,
            speed_share_p999: peak.speed_share_p999,
            acceleration: peak.acceleration_ticks_s2,
            acceleration_limit: peak.acceleration_limit_ticks_s2,
            acceleration_share: peak.acceleration_share,
            acceleration_share_p999: peak.acceleration_share_p999,
            jerk: peak.jerk.map(|peak| JerkReport {
                jerk: peak.jerk_ticks_s3,
                limit: peak.limit_ticks_s3,
                share: peak.share,
                share_p999: peak.share_p999,
            }),
        }
    }
}
