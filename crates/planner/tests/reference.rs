//! Optimality of the time parametrization, bounded from both sides on the same path.
//!
//! **From above**, a convex program on a fine grid (Verscheure et al. 2009), solved by an
//! interior-point method: with b = (ds/dt)² at the grid points and linear between them it minimizes
//! `Σ 2 Δs / (√b_i + √b_{i+1})` under the motors' speed and acceleration limits at the start,
//! middle and end of every interval. The grid is refined until the result converges.
//!
//! **From below**, what every motion along the path satisfies on any grid. The acceleration of
//! motor k is `(m' √b)' √b`, so `|½ d(m'² b)/ds| <= a |m'|`: between two points the square of a
//! motor's speed changes by at most `2 a ∫|m'| ds`, and at each point b is at most what some
//! acceleration allows both motors. Two passes give the largest b that satisfies this at all grid
//! points; between them a motor is at best as fast as on a trapezoidal profile. No profile is
//! faster than the sum.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver as _, NonnegativeConeT, SecondOrderConeT, SolverStatus,
    SupportedConeT,
};
use drawing::{EllipticArc, Pen, Point, Span, Stroke};
use kinematics::{JointPos, Machine, MotorPos};
use planner::unstable::{CornerBlend, PathBudget, Piece, sections};
use planner::unstable::{JointPath, PathGeometry, SpeedCap, profile};
use proptest::prelude::*;
use test_support::machines;

/// Corners blended within 0.05 mm, and nothing else: the rows' share of the tolerance does not
/// matter here.
const BUDGET: PathBudget = PathBudget {
    chord_mm: 0.01,
    simplify_mm: 0.0,
    blend_mm: 0.05,
    corner: CornerBlend::Parabola,
    row_mm: f64::INFINITY,
};

/// Largest relative excess of a profile's duration over the lower bound.
const EXCESS: f64 = 5e-4;

/// The path and the motors at one point, from one side.
#[derive(Clone, Copy)]
struct PathPoint {
    ticks: MotorPos,
    first: MotorPos,
    second: MotorPos,
    pen_speed: f64,
}

/// An interval of the reference's grid.
struct Interval {
    length: f64,
    /// At its start, middle and end.
    points: [PathPoint; 3],
    /// ∫|m'| ds over it, ticks.
    way: MotorPos,
    /// ∫|p'| ds over it, mm.
    pen_way: f64,
}

fn point(machine: &Machine, piece: &Piece, s: f64, near: &mut JointPos) -> PathPoint {
    let t = (s * piece.rate).min(1.0);
    *near = machine.pose_near(piece.curve.eval(t), near).expect("it was lifted");
    let (velocity, acceleration) = piece.curve.derivatives(t);
    let (velocity, acceleration) = (piece.rate * velocity, piece.rate * piece.rate * acceleration);
    let (first, second) = machine.motor_derivatives(near, velocity, acceleration);
    // A motor that stands still moves by rounding errors.
    let largest = first.max_abs();
    let first = MotorPos([0, 1].map(|k| if first[k].abs() < 1e-9 * largest { 0.0 } else { first[k] }));
    PathPoint { ticks: machine.motor_positions(near), first, second, pen_speed: velocity.hypot2().sqrt() }
}

/// Every interval of the path in `parts` parts, none longer than the path's length / (50 `parts`).
fn grid(machine: &Machine, path: &JointPath, parts: usize) -> Vec<Interval> {
    let PathGeometry::Drawn(start, section) = &path.geometry else { unreachable!("strokes are drawn") };
    let longest = path.intervals.iter().map(|interval| interval.length).sum::<f64>() / (50 * parts) as f64;
    let mut near = *start;
    let mut grid = Vec::new();
    for interval in &path.intervals {
        let piece = &section[interval.piece];
        let count = parts.max((interval.length / longest).ceil() as usize);
        let length = interval.length / count as f64;
        for k in 0..count {
            let from = interval.start + k as f64 * length;
            let mut at = |share: f64| point(machine, piece, from + share * length, &mut near);
            let points = [0.0, 0.5, 1.0].map(&mut at);
            let way = MotorPos([0, 1].map(|motor| {
                let [start, _, end] = points;
                if start.first[motor] * end.first[motor] >= 0.0 {
                    return (end.ticks[motor] - start.ticks[motor]).abs();
                }
                // The motor reverses: find out where.
                let (mut low, mut high) = (0.0, 1.0);
                for _ in 0..50 {
                    let middle = 0.5 * (low + high);
                    let before = at(middle).first[motor] * start.first[motor] > 0.0;
                    (low, high) = if before { (middle, high) } else { (low, middle) };
                }
                let turn = at(low).ticks[motor];
                (turn - start.ticks[motor]).abs() + (end.ticks[motor] - turn).abs()
            }));
            // Simpson's rule.
            let [a, middle, b] = points.each_ref().map(|point| point.pen_speed);
            let pen_way = length * (a + 4.0 * middle + b) / 6.0;
            grid.push(Interval { length, points, way, pen_way });
        }
    }
    grid
}

/// The largest b under the motors' and the pen's speed limits.
fn by_speed(machine: &Machine, point: &PathPoint, pen: f64) -> f64 {
    let motors = machine.motors().iter().enumerate();
    let speeds = motors.map(|(k, motor)| motor.max_speed_ticks_s / point.first[k].abs());
    let speed = speeds.fold(pen / point.pen_speed, f64::min);
    speed * speed
}

/// The largest b for which some u satisfies `|m' u + m'' b| <= a` for both motors.
fn by_acceleration(machine: &Machine, point: &PathPoint) -> f64 {
    let [a, b] = machine.motors().each_ref().map(|motor| motor.max_acceleration_ticks_s2);
    let (first, second) = (point.first, point.second);
    (a * first[1].abs() + b * first[0].abs()) / (first[0] * second[1] - first[1] * second[0]).abs()
}

/// A lower bound on the duration of any motion along the path, s.
fn lower_bound(machine: &Machine, grid: &[Interval], pen: f64) -> f64 {
    let at_most = |point: &PathPoint| by_speed(machine, point, pen).min(by_acceleration(machine, point));
    let mut b = vec![0.0; grid.len() + 1];
    for k in 1..grid.len() {
        b[k] = at_most(&grid[k - 1].points[2]).min(at_most(&grid[k].points[0]));
    }
    let motors = machine.motors();
    // The bound on b at one end of an interval that follows from b at the other.
    let reached = |interval: &Interval, from: &PathPoint, to: &PathPoint, b: f64| {
        let by = |k: usize| {
            let squared_speed = from.first[k] * from.first[k] * b
                + 2.0 * motors[k].max_acceleration_ticks_s2 * interval.way[k];
            squared_speed / (to.first[k] * to.first[k])
        };
        by(0).min(by(1))
    };
    for _ in 0..4 {
        for (k, interval) in grid.iter().enumerate() {
            b[k + 1] = b[k + 1].min(reached(interval, &interval.points[0], &interval.points[2], b[k]));
        }
        for (k, interval) in grid.iter().enumerate().rev() {
            b[k] = b[k].min(reached(interval, &interval.points[2], &interval.points[0], b[k + 1]));
        }
    }
    let time = |(k, interval): (usize, &Interval)| {
        let by = |motor: usize| {
            let (v, a) = (motors[motor].max_speed_ticks_s, motors[motor].max_acceleration_ticks_s2);
            let start = interval.points[0].first[motor].abs() * b[k].sqrt();
            let end = interval.points[2].first[motor].abs() * b[k + 1].sqrt();
            let way = interval.way[motor];
            let peak = v.min((0.5 * (start * start + end * end) + a * way).sqrt()).max(start).max(end);
            let ramps = (2.0 * peak * peak - start * start - end * end) / (2.0 * a);
            let cruise = if peak > 0.0 { (way - ramps).max(0.0) / peak } else { 0.0 };
            (2.0 * peak - start - end) / a + cruise
        };
        by(0).max(by(1)).max(interval.pen_way / pen)
    };
    grid.iter().enumerate().map(time).sum()
}

/// The shortest duration on the grid, s.
fn convex_program(machine: &Machine, grid: &[Interval], pen: f64) -> f64 {
    let count = grid.len();
    let fastest = |interval: &Interval| {
        by_speed(machine, &interval.points[0], pen).min(by_speed(machine, &interval.points[2], pen))
    };
    // All b relative to the largest possible b, which improves the conditioning.
    let unit = grid.iter().map(fastest).fold(0.0, f64::max);
    // Unknowns: b at the inner grid points, c <= √b there, and d >= 1 / (c + c of the next point)
    // for every interval.
    let inner = count - 1;
    let (c0, d0) = (inner, 2 * inner);
    let mut rows = Rows::default();
    let b = |node: usize| (1..count).contains(&node).then(|| node - 1);
    let c = |node: usize| b(node).map(|index| c0 + index);
    for (k, interval) in grid.iter().enumerate() {
        for (j, share) in [0.0, 0.5, 1.0].into_iter().enumerate() {
            for (motor, limits) in machine.motors().iter().enumerate() {
                let point = &interval.points[j];
                let rate = point.first[motor] / (2.0 * interval.length);
                let turn = point.second[motor];
                let scale = unit / limits.max_acceleration_ticks_s2;
                let (from, to) = (scale * ((1.0 - share) * turn - rate), scale * (share * turn + rate));
                for sign in [1.0, -1.0] {
                    rows.push(&[(b(k), sign * from), (b(k + 1), sign * to)], 1.0);
                }
            }
        }
        if k > 0 {
            let most = fastest(interval).min(by_speed(machine, &grid[k - 1].points[2], pen)) / unit;
            rows.push(&[(b(k), 1.0)], most);
            rows.push(&[(b(k), -1.0)], 0.0);
        }
    }
    let linear = rows.count();
    for node in 1..count {
        // |(2 c, b - 1)| <= b + 1, which is c² <= b.
        rows.push(&[(b(node), -1.0)], 1.0);
        rows.push(&[(c(node), -2.0)], 0.0);
        rows.push(&[(b(node), -1.0)], -1.0);
    }
    for k in 0..count {
        // |(2, d - e)| <= d + e with e = c + c of the next node, which is d e >= 1.
        let d = Some(d0 + k);
        rows.push(&[(d, -1.0), (c(k), -1.0), (c(k + 1), -1.0)], 0.0);
        rows.push(&[], 2.0);
        rows.push(&[(d, -1.0), (c(k), 1.0), (c(k + 1), 1.0)], 0.0);
    }
    let unknowns = d0 + count;
    let mut cost = vec![0.0; unknowns];
    let total: f64 = grid.iter().map(|interval| interval.length).sum();
    for (k, interval) in grid.iter().enumerate() {
        cost[d0 + k] = interval.length / total;
    }
    let mut cones: Vec<SupportedConeT<f64>> = vec![NonnegativeConeT(linear)];
    cones.extend(std::iter::repeat_n(SecondOrderConeT(3), inner + count));
    let (matrix, right) = rows.into_matrix(unknowns);
    let settings = DefaultSettingsBuilder::default().verbose(false).max_iter(500).build().expect("settings");
    let mut solver =
        DefaultSolver::new(&CscMatrix::zeros((unknowns, unknowns)), &cost, &matrix, &right, &cones, settings)
            .expect("a program");
    solver.solve();
    let status = solver.solution.status;
    assert!(matches!(status, SolverStatus::Solved | SolverStatus::AlmostSolved), "{status:?}");
    // Not the solver's objective, which contains its d, but the duration for its b.
    let speed = |node: usize| b(node).map_or(0.0, |index| (unit * solver.solution.x[index].max(0.0)).sqrt());
    grid.iter().enumerate().map(|(k, interval)| 2.0 * interval.length / (speed(k) + speed(k + 1))).sum()
}

/// Rows of `A x + s = right`.
#[derive(Default)]
struct Rows {
    entries: (Vec<usize>, Vec<usize>, Vec<f64>),
    right: Vec<f64>,
}

impl Rows {
    fn push(&mut self, entries: &[(Option<usize>, f64)], right: f64) {
        for (column, value) in entries {
            if let Some(column) = column {
                self.entries.0.push(self.right.len());
                self.entries.1.push(*column);
                self.entries.2.push(*value);
            }
        }
        self.right.push(right);
    }

    fn count(&self) -> usize {
        self.right.len()
    }

    fn into_matrix(self, columns: usize) -> (CscMatrix<f64>, Vec<f64>) {
        let (rows, cols, values) = self.entries;
        (CscMatrix::new_from_triplets(self.right.len(), columns, rows, cols, values), self.right)
    }
}

/// The joint paths of a stroke, one per section.
fn lifted(machine: &Machine, stroke: &Stroke) -> Vec<JointPath> {
    let mut near = machine.start();
    let mut paths = Vec::new();
    for section in sections(stroke, &BUDGET) {
        let (start, end) = (section[0].curve.start(), section[section.len() - 1].curve.end());
        let pose = machine.pose_near(start, &near).expect("within reach");
        paths.push(JointPath::from_section(machine, section, pose, 0.1).expect("within reach"));
        near = machine.pose_near(end, &pose).expect("within reach");
    }
    paths
}

/// Duration of the planner's profiles over all sections, s.
fn planner_duration(machine: &Machine, paths: &[JointPath], pen: f64) -> f64 {
    let cap = SpeedCap { pen_mm_s: pen, row_deviation_mm: f64::INFINITY, period_s: 1e-3 };
    paths.iter().map(|path| profile(machine, path, &cap).duration_s).sum()
}

fn below(machine: &Machine, paths: &[JointPath], pen: f64, parts: usize) -> f64 {
    paths.iter().map(|path| lower_bound(machine, &grid(machine, path, parts), pen)).sum()
}

fn polyline(points: &[(f64, f64)]) -> Stroke {
    let points = points.iter().map(|&(x, y)| Point::new(x, y)).collect();
    Stroke::polyline(Pen(1), points, Span::default()).expect("there are points")
}

/// Three corners, about (60, 90).
fn corners() -> Stroke {
    polyline(&[(40.0, 80.0), (75.0, 82.0), (72.0, 104.0), (50.0, 90.0), (45.0, 110.0)])
}

/// A line that runs into a circle.
fn line_and_circle() -> Stroke {
    let mut stroke = polyline(&[(40.0, 80.0), (60.0, 80.0)]);
    let down = -std::f64::consts::FRAC_PI_2;
    stroke.arc(EllipticArc::circular(Point::new(60.0, 90.0), 10.0, down, 5.0));
    stroke
}

/// A dense wave: short pieces shared by neighboring blends.
fn wave() -> Stroke {
    let point = |k: u32| {
        let x = f64::from(k) * 0.5;
        (40.0 + x, 90.0 + 6.0 * libm::sin(0.6 * x))
    };
    polyline(&(0..60).map(point).collect::<Vec<_>>())
}

/// Sharp corners back and forth, as in hatching.
fn zigzag() -> Stroke {
    let point = |k: u32| (40.0 + 0.35 * f64::from(k), if k.is_multiple_of(2) { 90.0 } else { 93.0 });
    polyline(&(0..16).map(point).collect::<Vec<_>>())
}

#[test]
fn profile_durations_near_optimum() {
    type Case = (&'static str, fn() -> Stroke);
    let shapes: [Case; 4] =
        [("corners", corners), ("line and circle", line_and_circle), ("wave", wave), ("zigzag", zigzag)];
    let machines = [("arm", machines::arm()), ("corexy", machines::corexy()), ("polar", machines::polar())];
    let mut wrong = Vec::new();
    println!(
        "{:<8} {:<16} {:>6} {:>9} {:>9} {:>9}  ours/below",
        "machine", "path", "pen", "below", "best", "ours"
    );
    for (name, machine) in &machines {
        for (shape, stroke) in shapes {
            for pen in [60.0, 1000.0] {
                let paths = lifted(machine, &stroke());
                let program = |parts: usize| -> f64 {
                    paths.iter().map(|path| convex_program(machine, &grid(machine, path, parts), pen)).sum()
                };
                // The error of a grid with one acceleration per interval is proportional to the
                // interval length.
                let (mut parts, mut coarse, mut fine) = (4, program(2), program(4));
                while (coarse - fine).abs() > 1e-3 * fine && parts < 16 {
                    parts *= 2;
                    (coarse, fine) = (fine, program(parts));
                }
                let best = fine - (coarse - fine);
                let below = below(machine, &paths, pen, 64);
                let ours = planner_duration(machine, &paths, pen);
                let excess = ours / below;
                println!("{name:<8} {shape:<16} {pen:>6} {below:>9.5} {best:>9.5} {ours:>9.5}  {excess:.6}");
                let case = format!("{name}, {shape}, pen at {pen}: {below} <= {best} <= {ours}");
                if below > ours * (1.0 + 1e-8) {
                    wrong.push(format!("impossible: {case}"));
                }
                if (below / best - 1.0).abs() > 2e-3 {
                    wrong.push(format!("the reference is off: {case}"));
                }
                if excess > 1.0 + EXCESS {
                    wrong.push(format!("slow by {excess}: {case}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A straight interval that starts slower than its cap and ends at it was driven as one even ramp
/// instead of a ramp and constant speed. Slow zones divide lines in this way.
#[test]
fn straight_interval_that_ends_at_its_cap_is_ramp_and_constant_speed() {
    let machine = machines::corexy();
    let stroke = polyline(&[(40.0, 80.0), (140.0, 80.0)]);
    let section = &sections(&stroke, &BUDGET)[0];
    let piece = section[0];
    let half = |t0: f64, t1: f64| Piece { curve: piece.curve.part(t0, t1), rate: 2.0 * piece.rate, ..piece };
    let duration = |section: Vec<Piece>| {
        let pose = machine.pose_near(section[0].curve.start(), &machine.start()).expect("within reach");
        let path = JointPath::from_section(&machine, section, pose, 0.1).expect("within reach");
        planner_duration(&machine, &[path], 30.0)
    };
    let (whole, halves) = (duration(vec![piece]), duration(vec![half(0.0, 0.5), half(0.5, 1.0)]));
    // Rest to rest at v = 30 mm/s with a = 30000/92 mm/s²: d/v + v/a.
    let exact = 100.0 / 30.0 + 30.0 / (30000.0 / 92.0);
    assert!((whole - exact).abs() < 1e-9, "{whole} s instead of {exact} s");
    assert!((halves - exact).abs() < 1e-9, "{halves} s instead of {exact} s");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Random polylines: never faster than the lower bound, and close to it.
    #[test]
    fn profile_durations_near_lower_bound(
        machine in prop_oneof![Just(machines::arm()), Just(machines::corexy()), Just(machines::polar())],
        turns in proptest::collection::vec((-2.5..2.5f64, 0.2..6.0f64), 2..10),
    ) {
        let (mut at, mut angle) = (Point::new(55.0, 95.0), 0.0);
        let mut points = vec![(at.x, at.y)];
        for (turn, step) in turns {
            angle += turn;
            at.x = (at.x + step * libm::cos(angle)).clamp(40.0, 75.0);
            at.y = (at.y + step * libm::sin(angle)).clamp(78.0, 110.0);
            points.push((at.x, at.y));
        }
        let paths = lifted(&machine, &polyline(&points));
        let (ours, below) = (planner_duration(&machine, &paths, 1000.0), below(&machine, &paths, 1000.0, 64));
        prop_assert!(below <= ours * (1.0 + 1e-8), "{} s is less than {} s, which is impossible", ours, below);
        prop_assert!(ours <= (1.0 + 4.0 * EXCESS) * below, "{} s could perhaps be {} s", ours, below);
    }
}
