//! From a drawing to a certified plan: placement, ordering, planning, verification.
//!
//! Start reading at [`compile`].

use std::collections::{BTreeMap, BTreeSet};

use drawing::{Affine, Drawing, Pen, Point, Rect, Vec2};
use kinematics::{Fault, JointPos, Machine};
use plan::{Header, Limits, MOTORS, Motor, Rounding};
use planner::{PlacementOptions, PlanError, Settings, Surface, TimingLaw, Trajectory};
use verify::Certificate;

use crate::best_place::{BestPlace, Search, best_place};
use crate::layout::{Crop, cropped};
use crate::replay::{on_carriage, on_paper};
use crate::restart;
use crate::same_ink::same_ink;

/// The order in which strokes are drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// Reordered, reversed and joined for the least time with the pen up, within the options. The
    /// pipeline fills in the start and the parking position.
    Optimize(ordering::Options),
    /// As in the file.
    File,
}

impl Order {
    /// Its name on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Optimize(_) => "optimize",
            Self::File => "file",
        }
    }
}

/// The settings of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Largest distance between the drawing and the pen's continuous path, mm.
    pub tolerance_mm: f64,
    /// Time between rows, microseconds.
    pub period_us: u64,
    /// The order in which strokes are drawn.
    pub order: Order,
    /// Placement of the drawing on the machine.
    pub placement: PlacementOptions,
    /// The search for the best position, and turn, at the scale and reflection of `placement`.
    pub search: Option<Search>,
    /// What is kept of the placed drawing; all if `None`.
    pub crop: Option<Crop>,
    /// Drawing speeds of single pens, mm/s; the machine's own limit still holds.
    pub pen_speeds: Vec<(Pen, f64)>,
    /// Red, green and blue of pens, for the plan's header.
    pub pen_colors: BTreeMap<u16, [u8; 3]>,
    /// Part of the lift time during which the motors may already travel, s.
    pub lift_overlap_s: f64,
    /// The time law along strokes.
    pub timing_law: TimingLaw,
    /// How rows take whole ticks.
    pub rounding: Rounding,
    /// Whether path and speed of splines are optimized together, see [`planner::Settings`].
    pub joint_fit: bool,
    /// Whether a plan that exceeds the motors' limits may be written; its certificate reports it.
    pub allow_over_limit: bool,
}

/// A step of the work, for progress displays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Looking for the place and checking reach.
    Placing,
    /// Finding an order: per mille of the search done, and 1000.
    Ordering(u64, u64),
    /// Planning motion: strokes planned, strokes in all.
    Planning(usize, usize),
    /// Comparing the drawing with the ordered one and replaying the plan: work done and in all, in rows.
    Verifying(u64, u64),
}

/// A plan with its report.
#[derive(Clone, Debug)]
pub struct Compiled<'a> {
    /// The plan.
    pub trajectory: Trajectory<'a>,
    /// The header of its table.
    pub header: Header,
    /// From drawing mm to machine mm.
    pub placement: Affine,
    /// The best placement, if one was searched for.
    pub best_place: Option<BestPlace>,
    /// The placed drawing in the file's order; machine mm.
    pub placed: Drawing,
    /// How far ink reaches beyond the sheet, mm.
    pub beyond_sheet_mm: f64,
    /// What ordering gained; `None` for the file's order.
    pub ordering: Option<ordering::Report>,
    /// Strokes drawn, after ordering joined those that touch.
    pub strokes: usize,
    /// The verifier's result.
    pub certificate: Certificate,
}

impl Compiled<'_> {
    /// The placed drawing in the order drawn; machine mm.
    pub fn ordered(&self) -> &Drawing {
        self.trajectory.drawing()
    }

    /// Whether the plan may be written: its certificate holds, or `allow_over_limit` covers all that
    /// failed.
    pub fn may_be_written(&self, allow_over_limit: bool) -> bool {
        let only_limits = || self.certificate.failures.iter().all(|failure| failure.violation.is_limit());
        self.certificate.holds || (allow_over_limit && only_limits())
    }
}

/// The cost of travel between strokes: its time.
struct TravelTime<'a>(&'a Machine);

impl ordering::Cost for TravelTime<'_> {
    fn to_cost_space(&self, point: Point) -> ordering::CostPoint {
        let pose = planner::travel_pose(self.0, point).unwrap_or(self.0.start());
        [pose[0], pose[1]]
    }

    fn between_cost_points(&self, a: ordering::CostPoint, b: ordering::CostPoint) -> f64 {
        planner::travel_time(self.0, &JointPos::from(a), &JointPos::from(b))
    }
}

/// Rows between two reports of progress.
const PROGRESS_ROWS: u64 = 20_000;

/// Reading a stroke for a comparison, or for the verifier's index, takes about the time of this number of
/// rows.
const STROKE_ROWS: u64 = 2;

/// A drawing where it lies on the machine.
#[derive(Clone, Debug)]
pub struct Placed {
    /// From drawing mm to machine mm.
    pub placement: Affine,
    /// The drawing in machine mm. Strokes of pens with an offset are where the mechanism goes, not where
    /// the ink is ([`crate::replay::on_paper`]).
    pub drawing: Drawing,
    /// How far ink reaches beyond the sheet, mm; 0 if it does not.
    pub beyond_sheet_mm: f64,
}

/// Places a drawing on a machine, crops it and checks that the machine reaches what is left.
///
/// # Errors
/// When the drawing has no ink, cannot be placed, leaves the machine's reach, or when the crop leaves
/// nothing of it.
pub fn place(
    drawing: &Drawing,
    machine: &Machine,
    options: &PlacementOptions,
    crop: Option<Crop>,
) -> Result<Placed, PlanError> {
    let mut placed = place_on(drawing, machine, options, crop)?;
    placed.drawing = on_carriage(placed.drawing, machine);
    planner::check_reach(machine, &placed.drawing)?;
    Ok(placed)
}

/// Places and crops a drawing on any surface. A drawing that stays where it is keeps its bits.
fn place_on(
    drawing: &Drawing,
    surface: &dyn Surface,
    options: &PlacementOptions,
    crop: Option<Crop>,
) -> Result<Placed, PlanError> {
    let placement = planner::place(surface, drawing, options)?;
    let mut drawing = drawing.clone();
    if placement != Affine::IDENTITY {
        drawing.transform(placement);
    }
    let drawing = cropped(drawing, crop, surface.sheet());
    if drawing.is_empty() {
        return Err(PlanError::NoPlacement { why: "no ink lies within the crop window" });
    }
    let beyond_sheet_mm = planner::beyond_sheet_mm(surface, &drawing);
    Ok(Placed { placement, drawing, beyond_sheet_mm })
}

/// Plans the strokes in their order. A closed stroke that meets a joint limit starts elsewhere, where
/// that helps.
fn plan<'a>(
    machine: &'a Machine,
    mut drawing: Drawing,
    settings: &Settings,
    progress: &dyn Fn(Step),
) -> Result<Trajectory<'a>, PlanError> {
    let planned = |drawing: Drawing| {
        planner::plan_with_progress(machine, drawing, settings, &|done, all| {
            progress(Step::Planning(done, all));
        })
    };
    if machine.mechanism().full_rotation().is_none() {
        return planned(drawing);
    }
    let mut restarted = BTreeSet::new();
    loop {
        let planned = planned(drawing.clone());
        let Err(PlanError::OutOfReach { stroke, source, .. }) = &planned else { return planned };
        if !matches!(source.fault, Fault::JointLimit { .. }) || !restarted.insert(*stroke) {
            return planned;
        }
        let other = drawing.strokes.get(*stroke).and_then(|stroke| restart::restarted(machine, &stroke));
        let Some(other) = other else { return planned };
        let mut number = 0;
        drawing.strokes.update(|changed| {
            if number == *stroke {
                changed.clone_from(&other);
            }
            number += 1;
        });
    }
}

/// What a drawing is arranged for.
#[derive(Clone, Copy, Debug)]
pub enum Target<'a> {
    /// A machine: its sheet, its reach, and its travel times.
    Machine(&'a Machine),
    /// A sheet of this width and height, mm.
    Sheet([f64; 2]),
    /// A plane without edges.
    Plane,
}

impl Target<'_> {
    /// The sheet in the target's own frame, mm; with infinite edges for a plane.
    pub fn sheet(&self) -> Rect {
        match *self {
            Self::Machine(machine) => machine.sheet(),
            Self::Sheet([width, height]) => Rect::new(0.0, 0.0, width, height),
            Self::Plane => Rect::new(0.0, 0.0, f64::INFINITY, f64::INFINITY),
        }
    }
}

/// A drawing arranged for a target without planning any motion.
#[derive(Clone, Debug)]
pub struct Arranged {
    /// The placed, cropped and ordered drawing; mm from the lower-left corner of the sheet.
    pub drawing: Drawing,
    /// How far ink reaches beyond the sheet, mm; 0 if it does not, or on a plane.
    pub beyond_sheet_mm: f64,
    /// The effect of ordering; `None` for the file's order.
    pub ordering: Option<ordering::Report>,
}

/// Places, crops and orders a drawing: for a machine as [`compile`] does, otherwise by the length of
/// travel between strokes: where the pen starts is not known.
///
/// # Errors
/// Those of [`place`]; on a plane, options that need a sheet.
pub fn arrange(
    drawing: &Drawing,
    target: Target<'_>,
    placement: &PlacementOptions,
    crop: Option<Crop>,
    order: &Order,
) -> Result<Arranged, PlanError> {
    let sheet = target.sheet();
    let placed = match target {
        Target::Machine(machine) => place(drawing, machine, placement, crop)?,
        Target::Sheet(_) => place_on(drawing, &sheet, placement, crop)?,
        Target::Plane => {
            let needs_sheet = !matches!(placement.scale, planner::Scale::Explicit { .. });
            if needs_sheet || crop == Some(Crop::Sheet) {
                return Err(PlanError::Setting { what: "fit, align and crop to the sheet need a sheet" });
            }
            let placed = place_on(drawing, &sheet, placement, crop)?;
            Placed { beyond_sheet_mm: 0.0, ..placed }
        }
    };
    let corner = Vec2::new(sheet.x0, sheet.y0);
    let by_distance = |a: Point, b: Point| ordering::distance(a, b);
    let (mut drawing, ordering) = match (order, target) {
        (Order::File, _) => (placed.drawing, None),
        (Order::Optimize(options), Target::Machine(machine)) => {
            let (ordered, report) = by_travel_time(placed.drawing, machine, options, &|_| {});
            (ordered, Some(report))
        }
        (Order::Optimize(options), _) => {
            let (ordered, report) = ordering::optimize(placed.drawing, &by_distance, options);
            (ordered, Some(report))
        }
    };
    if let Target::Machine(machine) = target {
        drawing = on_paper(drawing, machine);
    }
    if corner != Vec2::ZERO {
        drawing.transform(Affine::translate(-corner));
    }
    Ok(Arranged { drawing, beyond_sheet_mm: placed.beyond_sheet_mm, ordering })
}

/// Orders strokes by the time of travel, from the machine's start position and back.
fn by_travel_time(
    drawing: Drawing,
    machine: &Machine,
    options: &ordering::Options,
    progress: &dyn Fn(f64),
) -> (Drawing, ordering::Report) {
    let start = machine.mechanism().forward(&machine.start());
    let options = ordering::Options { start: Some(start), park: Some(start), ..options.clone() };
    ordering::optimize_with_progress(drawing, &TravelTime(machine), &options, progress)
}

/// Places the drawing, orders its strokes, plans and verifies. `progress` is called at every step.
///
/// # Errors
/// Those of [`place`], and settings that the planner refuses.
pub fn compile<'a>(
    drawing: &Drawing,
    machine: &'a Machine,
    request: &Request,
    progress: &dyn Fn(Step),
) -> Result<Compiled<'a>, PlanError> {
    progress(Step::Placing);
    let duration = |placed: Drawing| duration_of(placed, machine, request);
    let search = |search| best_place(drawing, machine, &request.placement, search, &duration);
    let best_place = request.search.map(search).transpose()?;
    let options = best_place.map_or(request.placement, |best| best.options);
    let Placed { placement, drawing: placed, beyond_sheet_mm } =
        place(drawing, machine, &options, request.crop)?;

    let (ordered, ordering) = match &request.order {
        Order::File => (placed.clone(), None),
        Order::Optimize(options) => {
            progress(Step::Ordering(0, 1000));
            let (ordered, report) = by_travel_time(placed.clone(), machine, options, &|share| {
                progress(Step::Ordering((1000.0 * share) as u64, 1000));
            });
            (ordered, Some(report))
        }
    };
    let strokes = ordered.strokes.len();

    let Planned { mut trajectory, mut header, mut certificate } =
        planned(&placed, ordered, placement, machine, request, progress)?;
    if request.rounding == Rounding::Path && !certificate.holds {
        // Along the path the rows are proved, the motion between them is measured. Where the ticks are
        // nearly as coarse as the drawing it may cut a corner; with the nearest ticks it does not.
        let nearest = Request { rounding: Rounding::Nearest, ..request.clone() };
        let other = planned(&placed, trajectory.drawing().clone(), placement, machine, &nearest, progress)?;
        if other.certificate.holds {
            Planned { trajectory, header, certificate } = other;
        }
    }
    Ok(Compiled {
        trajectory,
        header,
        placement,
        best_place,
        placed,
        beyond_sheet_mm,
        ordering,
        strokes,
        certificate,
    })
}

/// The duration of the plan of a placed drawing, s; `None` if it cannot be planned.
fn duration_of(placed: Drawing, machine: &Machine, request: &Request) -> Option<f64> {
    let placed = cropped(placed, request.crop, machine.sheet());
    let ordered = match &request.order {
        Order::File => placed,
        Order::Optimize(options) => by_travel_time(placed, machine, options, &|_| {}).0,
    };
    let trajectory = plan(machine, ordered, &planner_settings(request), &|_| {}).ok()?;
    Some(trajectory.duration_us() as f64 * 1e-6)
}

/// The motors of a machine with their limits, as the header of a plan states them.
pub fn header_motors(machine: &Machine) -> [Motor; MOTORS] {
    machine.motors().clone().map(|motor| Motor {
        name: motor.name,
        limits: Limits {
            speed: motor.max_speed_ticks_s,
            acceleration: motor.max_acceleration_ticks_s2,
            jerk: motor.max_jerk_ticks_s3,
        },
    })
}

/// The planner's settings of a request.
fn planner_settings(request: &Request) -> Settings {
    Settings {
        pen_speeds_mm_s: request.pen_speeds.clone(),
        timing_law: request.timing_law,
        joint_fit: request.joint_fit,
        lift_overlap_s: request.lift_overlap_s,
        rounding: request.rounding,
        ..Settings::new(request.tolerance_mm, request.period_us)
    }
}

/// A plan and its certificate.
struct Planned<'a> {
    trajectory: Trajectory<'a>,
    header: Header,
    certificate: Certificate,
}

/// The header of a plan's table.
fn header_of(trajectory: &Trajectory<'_>, placement: Affine, machine: &Machine, request: &Request) -> Header {
    Header {
        machine: machine.name().to_owned(),
        motors: header_motors(machine),
        placement: placement.as_coeffs(),
        period_us: request.period_us,
        lift_overlap_us: (request.lift_overlap_s * 1e6).round() as u64,
        rounding: request.rounding,
        pen_colors: request.pen_colors.clone(),
        rows: trajectory.row_count(),
        duration_us: trajectory.duration_us(),
    }
}

/// A plan that is only shown: it has no certificate, and is not to be drawn.
#[derive(Clone, Debug)]
pub struct Draft<'a> {
    /// The plan.
    pub trajectory: Trajectory<'a>,
    /// The header of its table.
    pub header: Header,
    /// How far ink reaches beyond the sheet, mm.
    pub beyond_sheet_mm: f64,
}

/// Places the drawing and plans it in the file's order, without a search and without verification.
///
/// # Errors
/// As [`compile`].
pub fn draft<'a>(drawing: &Drawing, machine: &'a Machine, request: &Request) -> Result<Draft<'a>, PlanError> {
    let Placed { placement, drawing: placed, beyond_sheet_mm } =
        place(drawing, machine, &request.placement, request.crop)?;
    let trajectory = plan(machine, placed, &planner_settings(request), &|_| {})?;
    let header = header_of(&trajectory, placement, machine, request);
    Ok(Draft { trajectory, header, beyond_sheet_mm })
}

/// Plans an ordered drawing, and certifies the plan against the placed one.
fn planned<'a>(
    placed: &Drawing,
    ordered: Drawing,
    placement: Affine,
    machine: &'a Machine,
    request: &Request,
    progress: &dyn Fn(Step),
) -> Result<Planned<'a>, PlanError> {
    progress(Step::Planning(0, ordered.strokes.len()));
    let trajectory = plan(machine, ordered, &planner_settings(request), progress)?;
    let ordered = trajectory.drawing();
    let header = header_of(&trajectory, placement, machine, request);
    // Against the drawing in the file's order, so that anything ordering lost or changed shows. Where
    // ordering provably changed only order and direction, against its result: where strokes crowd,
    // ink that follows them from end to end is measured much faster.
    let compared = (placed.strokes.len() + ordered.strokes.len()) as u64;
    let report = |strokes: u64, rows: u64| {
        let all = STROKE_ROWS * (compared + ordered.strokes.len() as u64) + header.rows;
        progress(Step::Verifying((STROKE_ROWS * strokes + rows).min(all), all));
    };
    let is_same = same_ink(placed, ordered, &|strokes| report(strokes as u64, 0));
    let drawn = if is_same { ordered } else { placed };
    let rows = || {
        trajectory.rows().enumerate().map(|(done, row)| {
            if (done as u64).is_multiple_of(PROGRESS_ROWS) {
                report(compared + ordered.strokes.len() as u64, done as u64);
            }
            (row.row, Some(row.exact))
        })
    };
    let indexed = |strokes| report(compared + strokes as u64, 0);
    let certificate =
        verify::certify_with_progress(machine, drawn, &header, request.tolerance_mm, rows, &indexed);
    Ok(Planned { trajectory, header, certificate })
}
