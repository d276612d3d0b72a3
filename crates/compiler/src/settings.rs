//! The settings of a plan as its plan document records them: all that is needed to make it again.

use std::collections::BTreeMap;

use planner::{Easing, Mirror, PlacementOptions, Scale, TimingLaw};
use serde::Serialize;

use crate::import;
use crate::layout::Layout;
use crate::pipeline::{Order, Request};

/// How a plan was made. With the document's machine and the drawing of its `source.sha256`,
/// `plotplan convert` with `command_line` makes the same plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Program and version.
    pub program: String,
    /// The options of `plotplan convert` that shape the plan, as given.
    pub command_line: Vec<String>,
    /// Page of the drawing, from 1.
    pub page: usize,
    /// Options of the drawing's reader.
    #[serde(flatten)]
    pub reading: import::Options,
    /// What is drawn of the drawing: pens, copies, crop.
    #[serde(skip_serializing_if = "Layout::is_default")]
    pub layout: Layout,
    /// Largest distance between the drawing and the continuous path, mm.
    pub tolerance_mm: f64,
    /// Time between rows, microseconds.
    pub period_us: u64,
    /// `optimize` or `file`.
    pub order: &'static str,
    /// How strokes were ordered; `null` for the file's order.
    pub ordering: Option<OrderingSettings>,
    /// The placement asked for.
    pub placement: PlacementSettings,
    /// Drawing speeds of single pens, mm/s.
    pub pen_speeds_mm_s: BTreeMap<u16, f64>,
    /// Part of the lift time during which the motors may already travel, s.
    pub lift_overlap_s: f64,
    /// The time law's name.
    pub law: &'static str,
    /// Time of one segment under a law of fixed durations, s.
    pub segment_time_s: Option<f64>,
    /// How rows take whole ticks: `path` or `nearest`.
    pub rounding: &'static str,
    /// Whether path and speed of splines were optimized together.
    pub joint_fit: bool,
    /// Whether the motors' limits may be exceeded.
    pub allow_over_limit: bool,
}

/// How strokes were ordered.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OrderingSettings {
    /// Ordering effort, 0 to 3.
    pub effort: u8,
    /// Whether duplicate strokes were removed.
    pub dedupe: bool,
    /// Whether strokes kept their direction.
    pub keep_direction: bool,
    /// The order of the pens, where given.
    pub pen_order: Option<Vec<u16>>,
}

/// The placement asked for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlacementSettings {
    /// `explicit`, `aligned`, `fit` or `shrink`.
    pub kind: &'static str,
    /// Reflection before the rotation: `x` or `y`.
    pub mirror: Option<&'static str>,
    /// Counterclockwise rotation, rad.
    pub rotate_rad: f64,
    /// The scale; `null` under `fit` and `shrink`.
    pub scale: Option<f64>,
    /// The drawing's origin from the sheet's lower left corner, mm, where `explicit`.
    pub origin_mm: Option<[f64; 2]>,
    /// Position between the left (bottom) edge, 0, and the right (top) edge, 1, where `aligned`.
    pub align: Option<[f64; 2]>,
    /// Margin of the sheet, mm.
    pub margin_mm: f64,
}

impl Settings {
    /// The settings of a request. `command_line` holds the options that led to it.
    pub fn of(
        request: &Request,
        page: usize,
        reading: &import::Options,
        layout: &Layout,
        command_line: Vec<String>,
    ) -> Self {
        let (law, segment_time_s) = match request.timing_law {
            TimingLaw::TimeOptimal => ("time-optimal", None),
            TimingLaw::Trapezoid => ("trapezoid", None),
            TimingLaw::FixedDuration { easing, segment_time_s } => (
                match easing {
                    Easing::Linear => "linear",
                    Easing::SineOut => "sine",
                    Easing::QuadraticInOut => "quadratic",
                },
                Some(segment_time_s),
            ),
        };
        let ordering = match &request.order {
            Order::File => None,
            Order::Optimize(options) => Some(OrderingSettings {
                effort: options.effort,
                dedupe: options.dedupe,
                keep_direction: options.keep_direction,
                pen_order: options.pen_order.as_ref().map(|pens| pens.iter().map(|pen| pen.0).collect()),
            }),
        };
        Self {
            program: concat!("plotplan ", env!("CARGO_PKG_VERSION")).to_owned(),
            command_line,
            page,
            reading: reading.clone(),
            layout: layout.clone(),
            tolerance_mm: request.tolerance_mm,
            period_us: request.period_us,
            order: request.order.name(),
            ordering,
            placement: PlacementSettings::of(&request.placement),
            pen_speeds_mm_s: request.pen_speeds.iter().map(|(pen, speed)| (pen.0, *speed)).collect(),
            lift_overlap_s: request.lift_overlap_s,
            law,
            segment_time_s,
            rounding: request.rounding.name(),
            joint_fit: request.joint_fit,
            allow_over_limit: request.allow_over_limit,
        }
    }
}

impl PlacementSettings {
    fn of(options: &PlacementOptions) -> Self {
        let (kind, scale, origin_mm, align) = match options.scale {
            Scale::Explicit { factor, origin_mm: o } => ("explicit", Some(factor), Some([o.x, o.y]), None),
            Scale::Aligned { factor, align } => ("aligned", Some(factor), None, Some([align.x, align.y])),
            Scale::Fit => ("fit", None, None, None),
            Scale::Shrink => ("shrink", None, None, None),
        };
        let mirror = options.mirror.map(|mirror| match mirror {
            Mirror::X => "x",
            Mirror::Y => "y",
        });
        let PlacementOptions { rotate_rad, margin_mm, .. } = *options;
        Self { kind, mirror, rotate_rad, scale, origin_mm, align, margin_mm }
    }
}
