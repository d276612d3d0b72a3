//! The summary of a plan.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::round;
use super::text;
use crate::best_place::{BestFor, BestPlace};
use crate::pipeline::Compiled;

/// The summary of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
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
    /// Drawing time by what limited the speed, s. The keys: `the pen's speed`, `rows in turns` (the time
    /// between rows), and for each motor `speed of M`, `acceleration of M`, `jerk of M`, and
    /// `acceleration of M in corners and curves`: there the limit is used up by the change of
    /// direction, so that the pen cannot go faster even at constant speed.
    pub limited_by_s: BTreeMap<String, f64>,
    /// Strokes of more than one line whose corners are blended one by one, because no spline within the
    /// tolerance and the reach is faster.
    pub blended_strokes: usize,
    /// Share of the duration with the pen up.
    pub pen_up_share: f64,
    /// Coefficients `a b c d e f` of the map from drawing mm to machine mm: `x' = a x + c y + e`,
    /// `y' = b x + d y + f`.
    pub placement: [f64; 6],
    /// The best placement, if one was searched for (`--place best`).
    pub best_place: Option<BestPlaceReport>,
    /// Pen changes in the order drawn.
    pub pen_changes: usize,
    /// What ordering gained; `null` for the file's order.
    pub ordering: Option<Ordering>,
}

/// The result of the search for the best placement.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct BestPlaceReport {
    /// `time` or `accuracy`.
    pub best_for: &'static str,
    /// The drawing's origin from the sheet's lower left corner, mm (`--place`).
    pub place_mm: [f64; 2],
    /// Counterclockwise rotation, degrees (`--rotate`).
    pub rotate_deg: f64,
    /// Duration of the plan, s; `null` for `accuracy`.
    pub duration_s: Option<f64>,
    /// The same of the drawing in the middle of the sheet without a turn; `null` for `accuracy` and where
    /// the machine cannot draw it there.
    pub centered_duration_s: Option<f64>,
    /// The largest quantization error along the ink (half a tick of both motors), mm; `null` for `time`.
    pub quantization_error_mm: Option<f64>,
    /// The same in the middle of the sheet; `null` likewise.
    pub centered_quantization_error_mm: Option<f64>,
    /// Placements that were compared.
    pub compared: usize,
}

impl BestPlaceReport {
    pub(super) fn of(best: &BestPlace) -> Self {
        let origin = match best.options.scale {
            planner::Scale::Explicit { origin_mm, .. } => origin_mm,
            _ => drawing::Vec2::ZERO,
        };
        let of = |aim: BestFor, figure: Option<f64>| figure.filter(|_| best.aim == aim);
        Self {
            best_for: best.aim.name(),
            place_mm: [round::mm(origin.x), round::mm(origin.y)],
            rotate_deg: round::mm(best.options.rotate_rad.to_degrees()),
            duration_s: of(BestFor::Time, Some(best.figure)).map(round::s),
            centered_duration_s: of(BestFor::Time, best.centered).map(round::s),
            quantization_error_mm: of(BestFor::Accuracy, Some(best.figure)).map(round::mm),
            centered_quantization_error_mm: of(BestFor::Accuracy, best.centered).map(round::mm),
            compared: best.compared,
        }
    }
}

/// What ordering gained.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
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
    /// Travel with lifts and drops in the file's order, s; `null` without a machine, where the order is
    /// found by length.
    pub travel_s_before: Option<f64>,
    /// Travel with lifts and drops in the order drawn, s; `null` likewise.
    pub travel_s_after: Option<f64>,
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
            ink_mm: round::mm(certificate.ink_mm),
            travel_mm: round::mm(certificate.travel_mm),
            beyond_sheet_mm: round::mm(compiled.beyond_sheet_mm),
            rows: compiled.header.rows,
            duration_s: round::s(duration_s),
            drawing_s: round::s(times.drawing_s),
            travel_s: round::s(times.travel_s),
            lifting_s: round::s(times.lifting_s),
            limited_by_s: text::limited_by(compiled)
                .into_iter()
                .map(|(what, s)| (what, round::s(s)))
                .collect(),
            blended_strokes: compiled.trajectory.blended_strokes(),
            pen_up_share: round::share((times.travel_s + times.lifting_s) / duration_s),
            placement: compiled.placement.as_coeffs().map(round::coefficient),
            best_place: compiled.best_place.as_ref().map(BestPlaceReport::of),
            pen_changes: text::pen_changes(compiled.ordered()),
            ordering: compiled.ordering.as_ref().map(|report| Ordering::of(report, true)),
        }
    }
}

impl Ordering {
    /// `by_time`: the cost is a time, s; otherwise a length, mm.
    pub(super) fn of(report: &ordering::Report, by_time: bool) -> Self {
        Self {
            strokes_before: report.strokes_before,
            strokes_after: report.strokes_after,
            merged: report.merged,
            duplicates_removed: report.duplicates_removed,
            travel_mm_before: round::mm(report.travel_mm_before),
            travel_mm_after: round::mm(report.travel_mm_after),
            travel_s_before: by_time.then(|| round::s(report.travel_cost_before)),
            travel_s_after: by_time.then(|| round::s(report.travel_cost_after)),
        }
    }
}
