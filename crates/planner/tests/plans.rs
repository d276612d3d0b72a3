//! Properties of whole plans: limits and tolerance hold in the emitted rows for any drawing and
//! machine. These tests use the same kinematics as the planner; `tests/replay.rs` at the top level
//! checks plans with independent forward kinematics.
#![allow(clippy::unreadable_literal, reason = "inputs as a failing property gave them")]

use drawing::{Affine, Drawing, EllipticArc, Pen, Point, Rect, Segment, Span, Stroke, Vec2};
use kinematics::{JointPos, Machine, MotorPos};
use planner::{Easing, ExactRow, PlanError, Settings, TimingLaw, plan};
use planner::{PlacementOptions, Scale, place};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;
use test_support::machines;

fn machine() -> impl Strategy<Value = Machine> {
    let plain = prop_oneof![Just(machines::arm()), Just(machines::corexy()), Just(machines::polar())];
    let build_up = prop_oneof![2 => Just(None), 1 => (0.002..0.1f64).prop_map(Some)];
    (plain, build_up).prop_map(|(machine, build_up)| match build_up {
        Some(build_up) => machines::with_jerk(&machine, build_up),
        None => machine,
    })
}

fn polyline(points: Vec<Point>) -> Stroke {
    Stroke::polyline(Pen(1), points, Span::default()).expect("there are points")
}

/// Strokes in the unit square: polylines, circles and ellipses, cubics, dots.
fn stroke() -> impl Strategy<Value = Stroke> {
    let point = || (0.0..1.0f64, 0.0..1.0f64).prop_map(|(x, y)| Point::new(x, y));
    let fine = (point(), 0.0..6.2f64, proptest::collection::vec(-0.4..0.4f64, 1..40)).prop_map(
        |(start, turn, turns)| {
            let (mut at, mut angle) = (start, turn);
            let mut points = vec![start];
            for bend in turns {
                angle += bend;
                at = Point::new(
                    (at.x + 0.004 * libm::cos(angle)).clamp(0.0, 1.0),
                    (at.y + 0.004 * libm::sin(angle)).clamp(0.0, 1.0),
                );
                points.push(at);
            }
            polyline(points)
        },
    );
    prop_oneof![
        proptest::collection::vec(point(), 1..8).prop_map(polyline),
        fine,
        (point(), 0.001..0.3f64, -7.0..7.0f64, -6.2..6.2f64).prop_map(|(c, r, start, sweep)| {
            let c = Point::new(c.x.clamp(r, 1.0 - r), c.y.clamp(r, 1.0 - r));
            let arc = EllipticArc::circular(c, r, start, sweep)
                .transformed(Affine::new([1.0, 0.0, 0.0, 0.4, 0.0, 0.0]));
            let mut stroke = Stroke::new(Pen(2), arc.eval(0.0), Span::default());
            stroke.arc(arc);
            stroke
        }),
        (point(), point(), point(), point()).prop_map(|(a, b, c, d)| {
            let mut stroke = Stroke::new(Pen(3), a, Span::default());
            stroke.cubic_to(b, c, d);
            stroke
        }),
    ]
}

fn drawing() -> impl Strategy<Value = Drawing> {
    proptest::collection::vec(stroke(), 1..4).prop_map(Drawing::from)
}

fn fitted(machine: &Machine, drawing: &Drawing) -> Drawing {
    let options = PlacementOptions { scale: Scale::Fit, ..PlacementOptions::default() };
    let mut placed = drawing.clone();
    placed.transform(place(machine, drawing, &options).expect("it fits"));
    placed
}

/// Rows with pauses filled in, so that all are one period apart.
fn filled(rows: &[ExactRow], period_us: u64) -> Vec<[f64; 2]> {
    let mut all = vec![rows[0].exact; 3]; // at rest before the first row
    for pair in rows.windows(2) {
        let periods = (pair[1].row.t_us - pair[0].row.t_us) / period_us;
        assert_eq!((pair[1].row.t_us - pair[0].row.t_us) % period_us, 0);
        if periods > 1 {
            assert_eq!(pair[0].row.ticks, pair[1].row.ticks, "rows are only thinned where nothing moves");
        }
        for _ in 1..periods {
            all.push(pair[0].exact);
        }
        all.push(pair[1].exact);
    }
    all.extend([rows[rows.len() - 1].exact; 3]);
    all
}

fn distance(p: Point, a: Point, b: Point) -> f64 {
    let (d, v) = (b - a, p - a);
    let t = if d.hypot2() > 0.0 { (v.dot(d) / d.hypot2()).clamp(0.0, 1.0) } else { 0.0 };
    (v - t * d).hypot2().sqrt()
}

fn to_polyline(p: Point, line: &[Point]) -> f64 {
    if line.len() == 1 {
        return distance(p, line[0], line[0]);
    }
    line.windows(2).map(|w| distance(p, w[0], w[1])).fold(f64::INFINITY, f64::min)
}

/// Checks |first difference| <= v T, |second difference| <= a T² and |third difference| <= j T³ in
/// exact positions one period apart.
fn differences_within_limits(machine: &Machine, all: &[[f64; 2]], period: f64) -> Result<(), TestCaseError> {
    // With jerk limits, accelerations are enforced at grid points, and between them as far as
    // samples show.
    let slack = if machine.motors()[0].max_jerk_ticks_s3.is_some() { 1e-4 } else { 1e-6 };
    for (k, motor) in machine.motors().iter().enumerate() {
        for w in all.windows(3) {
            let speed = (w[1][k] - w[0][k]).abs() / period;
            let acceleration = (w[2][k] - 2.0 * w[1][k] + w[0][k]).abs() / (period * period);
            prop_assert!(
                speed <= motor.max_speed_ticks_s * (1.0 + 1e-6) + 1e-6 / period,
                "speed {} of {}",
                speed,
                motor.max_speed_ticks_s
            );
            prop_assert!(
                acceleration <= motor.max_acceleration_ticks_s2 * (1.0 + slack) + 1e-6 / (period * period),
                "acceleration {} of {}",
                acceleration,
                motor.max_acceleration_ticks_s2
            );
        }
    }

    for (k, motor) in machine.motors().iter().enumerate() {
        let Some(limit) = motor.max_jerk_ticks_s3 else { continue };
        for w in all.windows(4) {
            let jerk = (w[3][k] - 3.0 * w[2][k] + 3.0 * w[1][k] - w[0][k]).abs() / (period * period * period);
            prop_assert!(
                jerk <= limit * (1.0 + 1e-3) + 1e-6 / (period * period * period),
                "jerk {} of {}",
                jerk,
                limit
            );
        }
    }
    Ok(())
}

/// Checks |first difference| <= v T, |second difference| <= a T² and |third difference| <= j T³ in
/// the exact positions of every row, and that the pen's continuous path is within the tolerance of
/// the drawing, in both directions.
fn stays_within(
    machine: &Machine,
    drawing: &Drawing,
    tolerance: f64,
    period_us: u64,
) -> Result<(), TestCaseError> {
    let placed = fitted(machine, drawing);
    let settings = Settings::new(tolerance, period_us);
    let trajectory = plan(machine, placed.clone(), &settings).expect("it fits");
    let rows: Vec<ExactRow> = trajectory.rows().collect();
    let period = period_us as f64 * 1e-6;

    let (first, last) = (rows.first().expect("rows").row, rows.last().expect("rows").row);
    let start = machine.motor_positions(&machine.start());
    prop_assert_eq!(first.ticks, [start[0].round() as i64, start[1].round() as i64]);
    prop_assert_eq!(last.ticks, first.ticks);
    prop_assert_eq!((first.t_us, first.pen, last.pen), (0, 0, 0));
    prop_assert_eq!(last.t_us, trajectory.duration_us());
    prop_assert_eq!(rows.len() as u64, trajectory.row_count());
    prop_assert!(rows.windows(2).all(|w| w[1].row.t_us > w[0].row.t_us));

    differences_within_limits(machine, &filled(&rows, period_us), period)?;

    // Ink by stroke: from a pen-down row to the next pen-up row.
    let mut strokes = placed.strokes.iter();
    let mut ink: Vec<Point> = Vec::new();
    for pair in rows.windows(2) {
        let at = |row: &ExactRow, other: &ExactRow, u: f64| {
            let (a, b) = (MotorPos::from(row.exact), MotorPos::from(other.exact));
            machine.forward_from_motors(&(a + u * (b - a)))
        };
        if pair[0].row.pen > 0 {
            ink.extend((0..=4).map(|k| at(&pair[0], &pair[1], f64::from(k) / 4.0)));
        } else if !ink.is_empty() {
            let stroke = strokes.next().expect("a stroke for the ink");
            let line = stroke.flatten(tolerance / 100.0);
            for p in &ink {
                let off = to_polyline(*p, &line);
                prop_assert!(off <= tolerance * 1.011, "ink {} strays by {}", p, off);
            }
            for segment in stroke.segments() {
                for k in 0..=10 {
                    let p: Point = Segment::eval(&segment, f64::from(k) / 10.0);
                    let off = to_polyline(p, &ink);
                    prop_assert!(off <= tolerance * 1.001, "{} is missed by {}", p, off);
                }
            }
            ink.clear();
        }
    }
    prop_assert!(strokes.next().is_none(), "every stroke is drawn");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// For any drawing, machine, tolerance and period.
    #[test]
    fn limits_and_tolerance_of_random_plans(
        machine in machine(), drawing in drawing(),
        tolerance in prop_oneof![Just(0.1), 0.005..1.0f64],
        period_us in prop_oneof![Just(10_000u64), 500..60_000u64],
    ) {
        stays_within(&machine, &drawing, tolerance, period_us)?;
    }
}

/// As `--fit` places drawings: blended corners took 1.5 times as long.
#[test]
fn stroke_at_the_edge_of_the_reach_is_a_spline() {
    let machine = machines::corexy();
    let sheet = machine.sheet();
    let radius = 0.5 * sheet.height();
    let point = |k: u32| libm::sincos(std::f64::consts::TAU * f64::from(k) / 90.0);
    let drawing_s = |radius: f64| {
        let at = |(sin, cos): (f64, f64)| sheet.center() + radius * Vec2::new(cos, sin);
        let drawing = Drawing::from(vec![polyline((0..=90).map(|k| at(point(k))).collect())]);
        plan(&machine, drawing, &Settings::new(0.1, 10_000)).expect("it fits").times().drawing_s
    };
    let (at_edge, inside) = (drawing_s(radius), drawing_s(radius - 1.0));
    assert!(at_edge < 1.03 * inside, "{at_edge} s, {inside} s a millimetre inside");
}

/// A polyline with short and long pieces, an arc and a dot.
fn mixed_drawing() -> Drawing {
    let point = |x: f64, y: f64| Point::new(x, y);
    let mut arc = polyline(vec![point(0.2, 0.2), point(0.5, 0.2)]);
    arc.arc(EllipticArc::circular(point(0.5, 0.4), 0.2, -std::f64::consts::FRAC_PI_2, 4.0));
    let zigzag = (0..12).map(|k| point(0.05 * f64::from(k), 0.7 + 0.01 * f64::from(k % 2))).collect();
    Drawing::from(vec![arc, polyline(zigzag), polyline(vec![point(0.9, 0.9)])])
}

/// Third differences of the exact positions over whole plans, travel included, on every machine.
#[test]
fn jerk_limits_hold_in_third_differences_of_rows() {
    for plain in [machines::arm(), machines::corexy(), machines::polar()] {
        for build_up in [0.005, 0.05] {
            let machine = machines::with_jerk(&plain, build_up);
            let placed = fitted(&machine, &mixed_drawing());
            let trajectory = plan(&machine, placed, &Settings::new(0.1, 2000)).expect("it fits");
            let rows: Vec<ExactRow> = trajectory.rows().collect();
            differences_within_limits(&machine, &filled(&rows, 2000), 0.002).expect("limits hold");
            // The same plan without jerk limits violates them.
            let placed = fitted(&plain, &mixed_drawing());
            let trajectory = plan(&plain, placed, &Settings::new(0.1, 2000)).expect("it fits");
            let rows: Vec<ExactRow> = trajectory.rows().collect();
            assert!(differences_within_limits(&machine, &filled(&rows, 2000), 0.002).is_err());
        }
    }
}

/// A polar machine whose motors take 0.26 s to reach their largest acceleration.
fn slow_jerk(jerk: bool) -> Machine {
    let mut parts = machines::polar().parts().clone();
    for (motor, [speed, acceleration, largest_jerk]) in
        parts.motors.iter_mut().zip([[133.7, 1459.1, 5650.3], [1625.7, 17745.8, 68718.3]])
    {
        motor.max_speed_ticks_s = speed;
        motor.max_acceleration_ticks_s2 = acceleration;
        motor.max_jerk_ticks_s3 = jerk.then_some(largest_jerk);
    }
    parts.motors[1].ticks_per_unit = 57.11;
    parts.motors[1].offset_ticks = -138.0 * 57.11;
    parts.pen.max_speed_mm_s = 5.688;
    Machine::new(parts).expect("valid limits")
}

/// A spiral of short chords with noise, as digitized.
fn noisy_spiral() -> Drawing {
    let mut state = 7_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let point = |k: u32| {
        let angle = 0.09 * f64::from(k);
        let r = 4.0 + 0.02 * f64::from(k);
        let (sin, cos) = libm::sincos(angle);
        Point::new(r * cos + 0.4 * noise(), 90.0 + r * sin + 0.4 * noise())
    };
    Drawing::from(vec![polyline((0..400).map(point).collect())])
}

/// Polygons as controllable sets once accepted a profile of 6e6 s here, whose last phase started at
/// nearly 0, or found none and slowed the whole stroke down 32 times.
#[test]
fn noisy_stroke_under_jerk_is_at_most_1_25_times_as_long() {
    let settings = Settings::new(0.48182, 500);
    let (with, without) = (slow_jerk(true), slow_jerk(false));
    let [with, without] =
        [&with, &without].map(|machine| plan(machine, noisy_spiral(), &settings).expect("within reach"));
    let (with, without) = (with.times().drawing_s, without.times().drawing_s);
    assert!(with <= 1.25 * without, "{with} s with jerk limits, {without} s without");
}

fn settings() -> Settings {
    Settings::new(0.1, 10_000)
}

fn line(points: &[(f64, f64)]) -> Drawing {
    let points = points.iter().map(|&(x, y)| Point::new(x, y)).collect();
    Drawing::from(vec![Stroke::polyline(Pen(1), points, Span { start: 7, end: 19 }).expect("points")])
}

#[test]
fn straight_corexy_line_is_time_optimal_trapezoid() {
    let machine = machines::corexy();
    let mut parts = machine.parts().clone();
    parts.pen.max_speed_mm_s = 1e9;
    let machine = Machine::new(parts).unwrap();
    // Along x both motors turn by 92 ticks/mm: v = 4000/92 mm/s, a = 30000/92 mm/s², T = d/v + v/a.
    let trajectory = plan(&machine, line(&[(10.0, 10.0), (110.0, 10.0)]), &settings()).unwrap();
    let (v, a) = (4000.0 / 92.0, 30000.0 / 92.0);
    let exact = 100.0 / v + v / a;
    assert!(trajectory.times().drawing_s >= exact && trajectory.times().drawing_s < exact + 0.011);
}

#[test]
fn motors_rest_during_lift_and_drop() {
    let machine = machines::arm();
    let trajectory = plan(&machine, line(&[(50.0, 200.0), (60.0, 210.0)]), &settings()).unwrap();
    let rows: Vec<ExactRow> = trajectory.rows().collect();
    let down = rows.iter().position(|row| row.row.pen == 1).unwrap();
    assert_eq!(rows[down + 1].row.t_us - rows[down].row.t_us, 150_000);
    assert_eq!(rows[down + 1].row.ticks, rows[down].row.ticks);
    let up = down + rows[down..].iter().position(|row| row.row.pen == 0).unwrap();
    assert_eq!(rows[up + 1].row.t_us - rows[up].row.t_us, 120_000);
    assert_eq!(rows[up + 1].row.ticks, rows[up].row.ticks);
}

#[test]
fn travel_overlap_with_lift() {
    let machine = machines::corexy();
    // The second stroke starts where the first one ends: there is no travel to overlap with.
    let strokes =
        [line(&[(50.0, 20.0), (60.0, 20.0)]), line(&[(60.0, 20.0), (60.0, 30.0)]), line(&[(90.0, 30.0)])];
    let drawing = Drawing { strokes: strokes.into_iter().flat_map(|drawing| drawing.strokes).collect() };
    let overlapping = Settings { lift_overlap_s: 0.06, ..settings() };
    let waits = |settings: &Settings| -> Vec<u64> {
        let rows: Vec<ExactRow> = plan(&machine, drawing.clone(), settings).unwrap().rows().collect();
        let lifted = rows.windows(2).enumerate().filter(|(_, w)| w[0].row.pen > 0 && w[1].row.pen == 0);
        let wait = |(index, _): (usize, &[ExactRow])| {
            let here = rows[index + 1].row;
            let moves = rows[index + 1..].iter().find(|row| row.row.ticks != here.ticks || row.row.pen != 0);
            moves.unwrap_or(&rows[rows.len() - 1]).row.t_us - here.t_us
        };
        lifted.map(wait).collect()
    };
    // The last row in which the motors rest is the one before they have moved.
    assert_eq!(waits(&settings()), [120_000, 130_000, 130_000]);
    assert_eq!(waits(&overlapping), [120_000, 70_000, 70_000]);
}

#[test]
fn dot_is_dwell_with_pen_down() {
    let machine = machines::corexy();
    let trajectory = plan(&machine, line(&[(50.0, 20.0)]), &settings()).unwrap();
    let down: Vec<ExactRow> = trajectory.rows().filter(|row| row.row.pen == 1).collect();
    assert_eq!(down.len(), 1);
    assert_eq!(down[0].row.ticks, [70 * 92, 30 * 92]);
}

#[test]
fn out_of_reach_error_names_stroke_and_point() {
    let machine = machines::polar();
    let error = plan(&machine, line(&[(-60.0, 20.0), (60.0, 20.0)]), &settings()).unwrap_err();
    let PlanError::OutOfReach { stroke, span, source, .. } = error else { panic!("{error}") };
    assert_eq!((stroke, span.start), (0, 7));
    assert_eq!(source.point, Point::new(0.0, 20.0));
}

#[test]
fn pen_speed_below_machine_limit() {
    let machine = machines::corexy();
    let drawing = line(&[(10.0, 10.0), (110.0, 10.0)]);
    let slow = Settings { pen_speeds_mm_s: vec![(Pen(1), 5.0), (Pen(2), 1.0)], ..settings() };
    let seconds = plan(&machine, drawing.clone(), &slow).unwrap().times().drawing_s;
    assert!((20.0..20.2).contains(&seconds), "{seconds}");
}

/// Found by the property below: rows 42 ms apart cut a corner of 175 degrees by more than the
/// tolerance, because the pen left the line before it too fast.
#[test]
fn sharp_corner_at_long_period_within_tolerance() {
    let machine = machines::arm();
    let drawing = line(&[(0.692, 0.39), (0.175, 0.913), (0.912, 0.372), (0.479, 0.98), (0.0, 0.987)]);
    let placed = fitted(&machine, &drawing);
    let settings = Settings { period_us: 42_493, ..settings() };
    let trajectory = plan(&machine, placed.clone(), &settings).unwrap();
    let rows: Vec<ExactRow> = trajectory.rows().collect();
    let drawn =
        rows.windows(2).filter(|pair| pair[0].row.pen > 0).flat_map(|pair| [pair[0].exact, pair[1].exact]);
    let ink: Vec<Point> = drawn.map(|exact| machine.forward_from_motors(&MotorPos::from(exact))).collect();
    for vertex in placed.strokes.to_vec()[0].vertices().iter() {
        assert!(to_polyline(*vertex, &ink) <= 0.1, "{vertex} is missed by {}", to_polyline(*vertex, &ink));
    }
}

#[test]
fn empty_drawing_is_an_error() {
    let machine = machines::corexy();
    assert_eq!(plan(&machine, Drawing::default(), &settings()).unwrap_err(), PlanError::NoInk);
}

#[test]
fn default_placement_origin_at_sheet_corner() {
    let machine = machines::arm();
    let map = place(&machine, &line(&[(0.0, 0.0), (10.0, 10.0)]), &PlacementOptions::default()).unwrap();
    assert_eq!(map.as_coeffs(), [1.0, 0.0, 0.0, 1.0, 12.7, 76.2]);
}

#[test]
fn quarter_turn_keeps_lower_left_corner() {
    let machine = machines::corexy();
    let drawing = line(&[(10.0, 20.0), (40.0, 60.0)]);
    let options = PlacementOptions { rotate_rad: std::f64::consts::FRAC_PI_2, ..PlacementOptions::default() };
    let mut placed = drawing.clone();
    placed.transform(place(&machine, &drawing, &options).unwrap());
    assert_eq!(placed.bounding_box().unwrap(), Rect::new(10.0, 20.0, 50.0, 50.0));
}

#[test]
fn fit_fills_sheet() {
    let machine = machines::corexy();
    let placed = fitted(&machine, &line(&[(3.0, 5.0), (23.0, 5.0), (23.0, 15.0)]));
    let ink = placed.bounding_box().unwrap();
    assert!(
        (ink.width() - 200.0).abs() < 1e-6 && (ink.center() - Point::new(100.0, 100.0)).hypot2() < 1e-9,
        "{ink}"
    );
}

/// The best placement of a full square on the half ring, with side a: its lower edge is tangent to
/// the inner circle, or its lower corners are on the base line beside it. Above the hole: (a/2)² +
/// (48 + a)² = 138² gives a = 83.53 mm. Beside the hole, from x to x + a with x = 48 at y = 0: (48
/// + a)² + a² = 138² gives a = 70.58 mm. So the best is 83.53 mm.
#[test]
fn fit_largest_square_in_half_ring() {
    let machine = machines::polar();
    let square = line(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)]);
    let side = fitted(&machine, &square).bounding_box().unwrap().width();
    assert!(side > 83.53 * 0.9995 && side <= 83.53, "{side}");
}

/// An arch can enclose the hole, which a filled rectangle of its size cannot.
#[test]
fn fit_arch_around_hole() {
    let machine = machines::polar();
    let mut arch = Stroke::new(Pen(1), Point::new(10.0, 0.0), Span::default());
    arch.arc(EllipticArc::circular(Point::ZERO, 10.0, 0.0, std::f64::consts::PI));
    let drawing = Drawing::from(vec![arch]);
    let width = fitted(&machine, &drawing).bounding_box().unwrap().width();
    assert!(width > 275.0 && width <= 276.0 + 1e-6, "{width}");
}

#[test]
fn fixed_duration_of_every_piece() {
    let machine = machines::corexy();
    let drawing = line(&[(10.0, 10.0), (60.0, 10.0), (60.0, 20.0), (10.0, 10.0)]);
    for easing in [Easing::Linear, Easing::SineOut, Easing::QuadraticInOut] {
        let law = TimingLaw::FixedDuration { easing, segment_time_s: 0.504 };
        let trajectory =
            plan(&machine, drawing.clone(), &Settings { timing_law: law, ..settings() }).unwrap();
        assert!((trajectory.times().drawing_s - 3.0 * 0.5).abs() < 1e-9);
        // At half of the duration: x, sin(pi / 4) and one half.
        let down = trajectory.rows().position(|row| row.row.pen == 1).unwrap();
        let share = match easing {
            Easing::SineOut => std::f64::consts::FRAC_1_SQRT_2,
            Easing::Linear | Easing::QuadraticInOut => 0.5,
        };
        let middle = trajectory.rows().nth(down + 1 + 25).unwrap();
        let at = machine.forward_from_motors(&MotorPos::from(middle.exact));
        assert!((at.x - (10.0 + 50.0 * share)).abs() < 1e-9, "{easing:?} at {at}");
    }
}

#[test]
fn trapezoid_law_stops_at_every_vertex() {
    let machine = machines::corexy();
    let drawing = line(&[(10.0, 10.0), (60.0, 10.0), (60.0, 20.0)]);
    let exact = plan(&machine, drawing.clone(), &Settings { timing_law: TimingLaw::Trapezoid, ..settings() })
        .unwrap();
    let corner = machine.motor_positions(&JointPos::new(60.0, 10.0));
    assert!(exact.rows().any(|row| row.exact == corner.0));
    assert!(exact.times().drawing_s > plan(&machine, drawing, &settings()).unwrap().times().drawing_s);
}

#[test]
fn travel_within_pen_travel_speed() {
    for plain in [machines::arm(), machines::polar(), machines::corexy()] {
        for machine in [plain.clone(), machines::with_jerk(&plain, 0.05)] {
            let mut parts = machine.parts().clone();
            parts.pen.max_travel_speed_mm_s = 20.0;
            let slow = Machine::new(parts).unwrap();
            let drawing = line(&[(40.0, 100.0)]);
            let times = [&machine, &slow].map(|machine| {
                let trajectory = plan(machine, drawing.clone(), &settings()).unwrap();
                let points: Vec<Point> = trajectory
                    .rows()
                    .map(|row| machine.forward_from_motors(&MotorPos::from(row.exact)))
                    .collect();
                let steps = points.windows(2).map(|w| (w[1] - w[0]).hypot2().sqrt());
                (trajectory.times().travel_s, steps.fold(0.0, f64::max) / 0.01)
            });
            let [(fast, most), (time, speed)] = times;
            assert!(most > 25.0 && time > fast, "{most} mm/s, {fast} s and {time} s");
            assert!(speed <= 20.0 * (1.0 + 1e-9) && speed > 18.0, "{} mm/s on {}", speed, machine.name());
        }
    }
}

/// Between the three points of an interval where the jerk-limited profile enforces the speed limit
/// it exceeded it by 1.4e-5.
#[test]
fn speed_limit_at_peak_inside_interval() {
    let machine = machines::with_jerk(&machines::corexy(), 30_000.0 / 442_285.862_718_370_57);
    let bend = [
        (0.946543, 0.0),
        (0.944207, 0.003247),
        (0.941138, 0.005813),
        (0.937411, 0.007264),
        (0.933416, 0.007465),
        (0.929425, 0.007724),
        (0.9256, 0.008897),
        (0.92213, 0.010887),
        (0.91832, 0.012105),
        (0.915227, 0.014641),
        (0.913187, 0.018081),
        (0.91009, 0.020613),
        (0.906437, 0.022243),
        (0.903509, 0.024968),
        (0.90062, 0.027735),
        (0.897216, 0.029836),
        (0.893813, 0.031937),
        (0.890746, 0.034506),
        (0.888434, 0.03777),
        (0.886015, 0.040955),
        (0.88369, 0.04421),
        (0.881662, 0.047658),
        (0.880804, 0.051565),
        (0.879945, 0.055472),
        (0.880519, 0.05943),
        (0.880269, 0.063423),
        (0.880297, 0.067423),
        (0.87985, 0.071398),
        (0.88047, 0.075349),
        (0.879945, 0.079315),
        (0.87942, 0.08328),
        (0.880074, 0.087226),
        (0.880893, 0.091142),
        (0.8817, 0.095059),
        (0.882011, 0.099047),
        (0.881026, 0.102924),
        (0.878731, 0.1062),
        (0.876346, 0.109412),
        (0.874396, 0.112904),
    ];
    stays_within(&machine, &line(&bend), 0.8413946210764377, 518).unwrap();
}

/// Where the motors' third derivatives change sign in the middle of an interval, its three samples
/// do not show it: a motor exceeded its acceleration by 3.2e-5.
#[test]
fn acceleration_limit_at_third_derivative_sign_change() {
    let mut wave = Stroke::new(Pen(3), Point::new(0.37586856120206713, 0.06763253810793711), Span::default());
    wave.cubic_to(
        Point::new(0.0, 0.6696081783981291),
        Point::new(0.3119276732440084, 0.0),
        Point::new(0.6413192308250398, 0.5426544145923854),
    );
    let mut drawing = line(&[
        (0.4447405292633061, 0.5867403842862763),
        (0.2755009983174739, 0.7289397020419149),
        (0.8508999714365112, 0.7678251801293041),
        (0.18878948916778976, 0.12650123846418412),
        (0.623355155615679, 0.13684045152294722),
        (0.14104777601956275, 0.962928399790584),
    ]);
    drawing.strokes.push(&wave);
    stays_within(&machines::arm(), &drawing, 0.1, 10_000).unwrap();
}

/// On an ellipse on the polar machine, accelerations have a maximum between five points of an
/// interval: they exceeded the limit by 5.6e-4.
#[test]
fn acceleration_limit_between_points_of_jerk_interval() {
    let machine = machines::with_jerk(&machines::polar(), 6000.0 / 88_539.931_381_337_32);
    let arc = EllipticArc {
        center: Point::new(0.5748581417638099, 0.15942215694678485),
        a: Vec2::new(0.2356550461267668, 0.0),
        b: Vec2::new(0.0, 0.09426201845070672),
        start_rad: -2.47424881794882,
        sweep_rad: -5.537629441915333,
    };
    let mut round = Stroke::new(Pen(2), arc.eval(0.0), Span::default());
    round.arc(arc);
    let line = line(&[(0.4725620466060484, 0.7459843816909811), (0.4567922844151536, 0.7432798298902897)]);
    let drawing = Drawing { strokes: std::iter::once(round).chain(line.strokes).collect() };
    stays_within(&machine, &drawing, 0.1, 878).unwrap();
}

/// Strokes for several batches: spirals about the base, so that turns differ from stroke to stroke.
fn spirals() -> Drawing {
    let spiral = |k: u32| {
        let point = |j: u32| {
            let (sin, cos) = libm::sincos(0.1 * f64::from(j) + 0.7 * f64::from(k));
            let r = 150.0 + 0.1 * f64::from(k) + 0.02 * f64::from(j);
            Point::new(r * cos, r * sin)
        };
        polyline((0..90).map(point).collect())
    };
    Drawing { strokes: (0..100).map(spiral).collect() }
}

#[test]
fn rows_do_not_depend_on_threads_or_cache() {
    let machine = machines::arm();
    let in_pool = |threads: usize| -> Vec<ExactRow> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let mut trajectory = plan(&machine, spirals(), &settings()).expect("a plan");
            let cached: Vec<ExactRow> = trajectory.rows().collect();
            assert_eq!(cached.len() as u64, trajectory.row_count());
            assert!(trajectory.drop_cache());
            assert!(trajectory.rows().eq(cached.iter().copied()));
            cached
        })
    };
    let one = in_pool(1);
    assert!(one.len() > 1000);
    assert_eq!(one, in_pool(2));
    assert_eq!(one, in_pool(5));
}
