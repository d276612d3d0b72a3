//! From a drawing to a certified plan: each room's work, one after the other.

use drawing::{Affine, Drawing, Pen, Point, Segment};
use kinematics::{JointPos, Machine};
use plan::{Header, Limits, Motor};
use planner::placement::{self, PlacementOptions};
use planner::{PlanError, Settings, TimingLaw, Trajectory};
use verify::Certificate;

/// In which order strokes are drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// Reordered, reversed and joined to spend the least time with the pen up, within what the options allow; where the
    /// plan starts and parks is filled in.
    Optimize(ordering::Options),
    /// As in the file.
    File,
}

impl Order {
    /// What the command line calls it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Optimize(_) => "optimize",
            Self::File => "file",
        }
    }
}

/// What kind of plan is wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Largest distance between the drawing and the pen's continuous path, mm.
    pub tolerance_mm: f64,
    /// Time between rows, microseconds.
    pub period_us: u64,
    /// In which order strokes are drawn.
    pub order: Order,
    /// Where the drawing goes.
    pub wish: PlacementOptions,
    /// Speeds of single pens, mm/s, where they are to be slower than the machine's pen may be.
    pub pen_speeds: Vec<(Pen, f64)>,
    /// For how much of the time that a lift takes the motors may already travel, s.
    pub lift_overlap_s: f64,
    /// How speed goes along the strokes.
    pub law: TimingLaw,
    /// Whether the motors' limits may be broken, as some laws do: the certificate says so, and the plan is written.
    pub allow_over_limit: bool,
}

/// A step of the work, for whoever shows progress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Looking for the place and checking reach.
    Placing,
    /// Finding an order.
    Ordering,
    /// Planning motion.
    Planning,
    /// Replaying the plan; so many rows of so many are done.
    Verifying(u64, u64),
}

/// A plan with all that is known about it.
#[derive(Clone, Debug)]
pub struct Compiled<'a> {
    /// The plan.
    pub trajectory: Trajectory<'a>,
    /// What is true of all its rows.
    pub header: Header,
    /// From drawing mm to machine mm.
    pub placement: Affine,
    /// The drawing where it lies on the machine, in the file's order; machine mm.
    pub placed: Drawing,
    /// How far ink reaches beyond the sheet, mm.
    pub beyond_sheet_mm: f64,
    /// What ordering brought, where it was asked for.
    pub ordering: Option<ordering::Report>,
    /// How many strokes are drawn, after ordering joined those that touch.
    pub strokes: usize,
    /// What the verifier found.
    pub certificate: Certificate,
}

impl Compiled<'_> {
    /// The drawing in the order in which it is drawn; machine mm.
    pub fn ordered(&self) -> &Drawing {
        self.trajectory.drawing()
    }

    /// Whether the plan may be written: its certificate holds, or only such limits are broken as may be.
    pub fn may_be_written(&self, allow_over_limit: bool) -> bool {
        let only_limits = || self.certificate.failures.iter().all(|failure| failure.violation.is_limit());
        self.certificate.holds || (allow_over_limit && only_limits())
    }
}

/// Travel costs what it takes the motors.
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

/// Rows between two calls that tell of progress.
const PROGRESS_ROWS: u64 = 100_000;

/// Places the drawing, orders its strokes, plans and verifies. `progress` is told of every step.
///
/// # Errors
/// When the drawing has no ink, cannot be placed, or leaves what the machine can draw.
pub fn compile<'a>(
    drawing: &Drawing,
    machine: &'a Machine,
    request: &Request,
    progress: &dyn Fn(Step),
) -> Result<Compiled<'a>, PlanError> {
    progress(Step::Placing);
    let placement = placement::place(machine, drawing, &request.wish)?;
    let mut placed = drawing.clone();
    placed.transform(placement);
    planner::check_reach(machine, &placed)?;
    let beyond_sheet_mm = placement::beyond_sheet_mm(machine, &placed);

    let (ordered, ordering) = match &request.order {
        Order::File => (placed.clone(), None),
        Order::Optimize(options) => {
            progress(Step::Ordering);
            let start = machine.geometry().forward(&machine.start());
            let options = ordering::Options { start: Some(start), park: Some(start), ..options.clone() };
            let (ordered, report) = ordering::optimize(placed.clone(), &TravelTime(machine), &options);
            (ordered, Some(report))
        }
    };
    let strokes = ordered.strokes.len();

    progress(Step::Planning);
    let settings = Settings {
        pen_speeds_mm_s: request.pen_speeds.clone(),
        timing_law: request.law,
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
    // Against the drawing in the file's order, so that what ordering lost or changed would show. Where ordering can be
    // seen to have changed nothing but order and direction, against what it gave: where strokes crowd, ink that
    // follows them from end to end is measured much faster.
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

/// Whether two drawings consist of exactly the same pieces, in whatever order and direction, with the same pens.
fn same_ink(one: &Drawing, other: &Drawing) -> bool {
    pieces_of(one) == pieces_of(other)
}

/// Pen, ends (the smaller first) and middle of every piece, to a nanometre, sorted: the middle tells curves between the
/// same ends apart, and a curve that was turned round may have moved by a rounding error. A dot is a piece of its own.
fn pieces_of(drawing: &Drawing) -> Vec<(u16, [[i64; 2]; 3])> {
    let nanometres = |p: Point| [p.x, p.y].map(|mm| (mm * 1e6).round() as i64);
    let mut pieces = Vec::new();
    for stroke in &drawing.strokes {
        let mut add = |a: Point, b: Point, middle: Point| {
            let (a, b) = (nanometres(a), nanometres(b));
            pieces.push((stroke.pen.0, [a.min(b), a.max(b), nanometres(middle)]));
        };
        if stroke.is_dot() {
            add(stroke.start(), stroke.start(), stroke.start());
        }
        for (ends, segment) in stroke.vertices().windows(2).zip(stroke.segments()) {
            if let Segment::Arc(arc) = segment
                && (arc.sweep_rad.abs() - std::f64::consts::TAU).abs() < 1e-9
            {
                // A whole turn may begin anywhere.
                add(arc.center + arc.a, arc.center - arc.a, arc.center + arc.b);
                continue;
            }
            add(ends[0], ends[1], segment.eval(0.5));
        }
    }
    pieces.sort_unstable();
    pieces
}

#[cfg(test)]
mod tests {
    use drawing::{EllipticArc, Pen, Span, Stroke};

    use super::*;

    fn drawing(points: &[&[(f64, f64)]]) -> Drawing {
        let stroke = |points: &&[(f64, f64)]| {
            let points = points.iter().map(|&(x, y)| Point::new(x, y)).collect();
            Stroke::polyline(Pen(1), points, Span::default()).unwrap()
        };
        Drawing { strokes: points.iter().map(stroke).collect() }
    }

    #[test]
    fn order_direction_and_joining_do_not_change_the_ink() {
        let one = drawing(&[&[(0.0, 0.0), (1.0, 0.0)], &[(1.0, 0.0), (1.0, 2.0)], &[(5.0, 5.0)]]);
        let other = drawing(&[&[(5.0, 5.0)], &[(1.0, 2.0), (1.0, 0.0), (0.0, 0.0)]]);
        assert!(same_ink(&one, &other));
    }

    #[test]
    fn a_whole_circle_may_begin_anywhere() {
        let circle = |radius: f64, start: f64| {
            let arc = EllipticArc::circular(Point::new(5.0, 5.0), radius, start, std::f64::consts::TAU);
            let mut stroke = Stroke::new(Pen(1), arc.eval(0.0), Span::default());
            stroke.arc(arc);
            Drawing { strokes: vec![stroke] }
        };
        assert!(same_ink(&circle(2.0, 0.0), &circle(2.0, 1.0)));
        assert!(!same_ink(&circle(2.0, 0.0), &circle(2.1, 0.0)));
    }

    #[test]
    fn what_is_lost_moved_or_bent_changes_it() {
        let one = drawing(&[&[(0.0, 0.0), (1.0, 0.0)], &[(5.0, 5.0)]]);
        assert!(!same_ink(&one, &drawing(&[&[(0.0, 0.0), (1.0, 0.0)]])));
        assert!(!same_ink(&one, &drawing(&[&[(0.0, 0.0), (1.0, 1e-5)], &[(5.0, 5.0)]])));
        let half = |sweep: f64| {
            let arc = EllipticArc::circular(Point::ZERO, 1.0, 0.0, sweep);
            let mut stroke = Stroke::new(Pen(1), Point::new(1.0, 0.0), Span::default());
            stroke.arc(arc);
            Drawing { strokes: vec![stroke] }
        };
        assert!(!same_ink(&half(std::f64::consts::PI), &half(-std::f64::consts::PI)));
        let mut turned = half(2.0);
        turned.strokes[0].reverse();
        assert!(same_ink(&half(2.0), &turned));
    }
}
