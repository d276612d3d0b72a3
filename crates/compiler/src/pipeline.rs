//! From a drawing to a certified plan: placement, ordering, planning, verification.
//!
//! Start reading at [`compile`].

use drawing::{Affine, Drawing, Pen, Point};
use kinematics::{JointPos, Machine};
use plan::{Header, Limits, Motor};
use planner::PlacementOptions;
use planner::{PlanError, Settings, TimingLaw, Trajectory};
use verify::Certificate;

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
    /// Drawing speeds of single pens, mm/s; the machine's own limit still holds.
    pub pen_speeds: Vec<(Pen, f64)>,
    /// Part of the lift time during which the motors may already travel, s.
    pub lift_overlap_s: f64,
    /// The time law along strokes.
    pub timing_law: TimingLaw,
    /// Whether a plan that exceeds the motors' limits may be written; its certificate reports it.
    pub allow_over_limit: bool,
}

/// A step of the work, for progress displays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Looking for the place and checking reach.
    Placing,
    /// Finding an order.
    Ordering,
    /// Planning motion.
    Planning,
    /// Replaying the plan: rows done, rows in all.
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
const PROGRESS_ROWS: u64 = 100_000;

/// A drawing where it lies on the machine.
#[derive(Clone, Debug)]
pub struct Placed {
    /// From drawing mm to machine mm.
    pub placement: Affine,
    /// The drawing in machine mm.
    pub drawing: Drawing,
    /// How far ink reaches beyond the sheet, mm; 0 if it does not.
    pub beyond_sheet_mm: f64,
}

/// Places a drawing on a machine and checks that the machine reaches all of it.
///
/// # Errors
/// When the drawing has no ink, cannot be placed, or leaves the machine's reach.
pub fn place(drawing: &Drawing, machine: &Machine, options: &PlacementOptions) -> Result<Placed, PlanError> {
    let placement = planner::place(machine, drawing, options)?;
    let mut drawing = drawing.clone();
    drawing.transform(placement);
    planner::check_reach(machine, &drawing)?;
    let beyond_sheet_mm = planner::beyond_sheet_mm(machine, &drawing);
    Ok(Placed { placement, drawing, beyond_sheet_mm })
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
    let Placed { placement, drawing: placed, beyond_sheet_mm } = place(drawing, machine, &request.placement)?;

    let (ordered, ordering) = match &request.order {
        Order::File => (placed.clone(), None),
        Order::Optimize(options) => {
            progress(Step::Ordering);
            let start = machine.mechanism().forward(&machine.start());
            let options = ordering::Options { start: Some(start), park: Some(start), ..options.clone() };
            let (ordered, report) = ordering::optimize(placed.clone(), &TravelTime(machine), &options);
            (ordered, Some(report))
        }
    };
    let strokes = ordered.strokes.len();

    progress(Step::Planning);
    let settings = Settings {
        pen_speeds_mm_s: request.pen_speeds.clone(),
        timing_law: request.timing_law,
        lift_overlap_s: request.lift_overlap_s,
        ..Settings::new(request.tolerance_mm, request.period_us)
    };
    let trajectory = planner::plan(machine, ordered, &settings)?;
    let ordered = trajectory.drawing();

    let header = Header {
        machine: machine.name().to_owned(),
        motors: machine.motors().clone().map(|motor| Motor {
            name: motor.name,
            limits: Limits {
                speed: motor.max_speed_ticks_s,
                acceleration: motor.max_acceleration_ticks_s2,
                jerk: motor.max_jerk_ticks_s3,
            },
        }),
        placement: placement.as_coeffs(),
        period_us: request.period_us,
        lift_overlap_us: (request.lift_overlap_s * 1e6).round() as u64,
        rows: trajectory.row_count(),
        duration_us: trajectory.duration_us(),
    };
    // Against the drawing in the file's order, so that anything ordering lost or changed shows. Where
    // ordering provably changed only order and direction, against its result: where strokes crowd,
    // ink that follows them from end to end is measured much faster.
    let drawn = if same_ink(&placed, ordered) { ordered } else { &placed };
    let certificate = verify::certify(machine, drawn, &header, request.tolerance_mm, || {
        trajectory.rows().enumerate().map(|(done, row)| {
            if (done as u64).is_multiple_of(PROGRESS_ROWS) {
                progress(Step::Verifying(done as u64, header.rows));
            }
            (row.row, Some(row.exact))
        })
    });
    Ok(Compiled { trajectory, header, placement, placed, beyond_sheet_mm, ordering, strokes, certificate })
}
