//! Whole ticks along the path: limits, distances from exact positions, and nearer ink.

use drawing::{Affine, Drawing, EllipticArc, Line, Pen, Point, Span, Stroke, distance_to_line};
use kinematics::{Machine, MotorPos};
use planner::{Easing, ExactRow, PlacementOptions, Rounding, Scale, Settings, TimingLaw, place, plan};
use proptest::prelude::*;
use test_support::{machines, polyline};

fn machine() -> impl Strategy<Value = Machine> {
    let plain = prop_oneof![Just(machines::arm()), Just(machines::corexy()), Just(machines::polar())];
    let build_up = prop_oneof![Just(None), (0.002..0.1f64).prop_map(Some)];
    (plain, build_up).prop_map(|(machine, build_up)| match build_up {
        Some(build_up) => machines::with_jerk(&machine, build_up),
        None => machine,
    })
}

/// Strokes in the unit square: polylines of few or many points, arcs, dots, two pens.
fn drawing() -> impl Strategy<Value = Drawing> {
    let point = || (0.0..1.0f64, 0.0..1.0f64);
    let walk = (point(), prop::collection::vec((-0.02..0.02f64, -0.02..0.02f64), 1..30)).prop_map(
        |((mut x, mut y), steps)| {
            let mut points = vec![(x, y)];
            for (dx, dy) in steps {
                (x, y) = ((x + dx).clamp(0.0, 1.0), (y + dy).clamp(0.0, 1.0));
                points.push((x, y));
            }
            polyline(points)
        },
    );
    let arc = ((0.3..0.7f64, 0.3..0.7f64), 0.001..0.3f64, -7.0..7.0f64).prop_map(|((x, y), r, sweep)| {
        let arc = EllipticArc::circular(Point::new(x, y), r, 0.3, sweep);
        let mut stroke = Stroke::new(Pen(2), arc.eval(0.0), Span::default());
        stroke.arc(arc);
        stroke
    });
    let stroke = prop_oneof![prop::collection::vec(point(), 1..6).prop_map(polyline), walk, arc];
    prop::collection::vec(stroke, 1..5).prop_map(Drawing::from)
}

fn law() -> impl Strategy<Value = TimingLaw> {
    let eased = |easing| TimingLaw::FixedDuration { easing, segment_time_s: 0.2 };
    prop_oneof![
        3 => Just(TimingLaw::TimeOptimal),
        1 => Just(TimingLaw::Trapezoid),
        1 => Just(eased(Easing::Linear)),
        1 => Just(eased(Easing::QuadraticInOut)),
    ]
}

fn fitted(machine: &Machine, drawing: &Drawing) -> Drawing {
    let options = PlacementOptions { scale: Scale::Fit, ..PlacementOptions::default() };
    let mut placed = drawing.clone();
    placed.transform(place(machine, drawing, &options).expect("it fits"));
    placed
}

fn rows(machine: &Machine, drawing: &Drawing, settings: &Settings, rounding: Rounding) -> Vec<ExactRow> {
    let settings = Settings { rounding, ..settings.clone() };
    plan(machine, drawing.clone(), &settings).expect("it fits").rows().collect()
}

/// Whole ticks one period apart, at rest before and after.
fn filled(rows: &[ExactRow], period_us: u64) -> Vec<[i64; 2]> {
    let mut all = vec![rows[0].row.ticks; 3];
    for pair in rows.windows(2) {
        let periods = (pair[1].row.t_us - pair[0].row.t_us) / period_us;
        all.extend((1..periods).map(|_| pair[0].row.ticks));
        all.push(pair[1].row.ticks);
    }
    all.extend([rows[rows.len() - 1].row.ticks; 3]);
    all
}

/// Largest excess of first, second and third differences over their bounds at the same place.
fn check_differences(machine: &Machine, period_us: u64, nearest: &[[i64; 2]], ticks: &[[i64; 2]]) {
    let period = period_us as f64 * 1e-6;
    for (motor, limits) in machine.motors().iter().enumerate() {
        let third = limits.max_jerk_ticks_s3.unwrap_or(f64::INFINITY) * period * period * period;
        let bounds = [
            limits.max_speed_ticks_s * period + 1.0,
            limits.max_acceleration_ticks_s2 * period * period + 2.0,
            third + 4.0,
        ];
        let column = |rows: &[[i64; 2]]| rows.iter().map(|row| row[motor]).collect::<Vec<_>>();
        let (mut here, mut safe) = (column(ticks), column(nearest));
        for (order, bound) in bounds.into_iter().enumerate() {
            let differences = |of: &[i64]| of.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>();
            (here, safe) = (differences(&here), differences(&safe));
            // A law of fixed duration may exceed the limits; then the nearest ticks do, too.
            for (index, difference) in here.iter().enumerate() {
                let near = &safe[index.saturating_sub(3)..(index + 4).min(safe.len())];
                let needed = near.iter().map(|d| d.abs()).max().unwrap_or(0) as f64;
                let most = (bound * (1.0 + 1e-9)).max(needed);
                assert!(
                    difference.abs() as f64 <= most,
                    "motor {motor}, difference {order} at {index}: {difference} of {most}"
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn ticks_along_the_path_keep_bounds_of_differences(
        machine in machine(), drawing in drawing(), law in law(),
        tolerance_mm in prop_oneof![Just(0.1), 0.005..1.0f64],
        period_us in prop_oneof![Just(10_000u64), 500..60_000u64],
        lift_overlap_s in prop_oneof![Just(0.0), Just(0.06), 0.0..0.2f64],
    ) {
        let placed = fitted(&machine, &drawing);
        let settings = Settings {
            timing_law: law,
            lift_overlap_s,
            ..Settings::new(tolerance_mm, period_us)
        };
        let nearest = rows(&machine, &placed, &settings, Rounding::Nearest);
        let along = rows(&machine, &placed, &settings, Rounding::Path);
        prop_assert_eq!(nearest.len(), along.len());
        for (near, row) in nearest.iter().zip(&along) {
            prop_assert_eq!((near.row.t_us, near.row.pen, near.exact), (row.row.t_us, row.row.pen, row.exact));
            for motor in 0..2 {
                prop_assert_eq!(near.row.ticks[motor], near.exact[motor].round() as i64);
                prop_assert!((row.row.ticks[motor] as f64 - row.exact[motor]).abs() <= 1.5);
            }
        }
        prop_assert_eq!(nearest[0].row, along[0].row);
        prop_assert_eq!(nearest[nearest.len() - 1].row, along[along.len() - 1].row);
        // While the pen moves the motors rest, wherever the nearest ticks do.
        for (near, pair) in nearest.windows(2).zip(along.windows(2)) {
            if near[1].row.t_us - near[0].row.t_us > period_us {
                prop_assert_eq!(pair[0].row.ticks, pair[1].row.ticks);
            }
        }
        check_differences(&machine, period_us, &filled(&nearest, period_us), &filled(&along, period_us));
    }
}

/// A spiral, a zigzag and a circle.
fn figures() -> Drawing {
    let spiral = (0..200).map(|k| {
        let (sin, cos) = libm::sincos(0.1 * f64::from(k));
        let r = 0.002 * f64::from(k);
        (0.5 + r * cos, 0.5 + r * sin)
    });
    let zigzag = (0..20).map(|k| (0.05 * f64::from(k), 0.02 * f64::from(k % 2)));
    let circle = EllipticArc::circular(Point::new(0.5, 0.5), 0.45, 0.0, 6.3)
        .transformed(Affine::new([1.0, 0.0, 0.0, 0.8, 0.0, 0.1]));
    let mut arc = Stroke::new(Pen(1), circle.eval(0.0), Span::default());
    arc.arc(circle);
    Drawing::from(vec![polyline(spiral), polyline(zigzag), arc])
}

/// Root mean square of the distance of the ink from the path through the exact positions: four points
/// a row against the chords of the exact path around it.
fn rms_mm(machine: &Machine, rows: &[ExactRow]) -> f64 {
    let pen = |motors: [f64; 2]| machine.forward_from_motors(&MotorPos::new(motors[0], motors[1]));
    let exact: Vec<Point> = rows.iter().map(|row| pen(row.exact)).collect();
    let (mut squares, mut weight) = (0.0, 0.0);
    for (index, pair) in rows.windows(2).enumerate().filter(|(_, pair)| pair[0].row.pen != 0) {
        let [from, to] = [pair[0].row.ticks, pair[1].row.ticks].map(|ticks| ticks.map(|t| t as f64));
        let length = pen(from).distance(pen(to));
        let near = &exact[index.saturating_sub(20)..(index + 22).min(exact.len())];
        for k in 0..4 {
            let share = 0.125 + 0.25 * f64::from(k);
            let p = pen([0, 1].map(|motor: usize| from[motor] + share * (to[motor] - from[motor])));
            let chords = near.windows(2).map(|chord| distance_to_line(p, Line::new(chord[0], chord[1])));
            let off = chords.fold(f64::INFINITY, f64::min);
            squares += length * off * off;
            weight += length;
        }
    }
    (squares / weight).sqrt()
}

#[test]
fn ink_along_the_path_is_nearer_on_every_machine() {
    let jerk = machines::with_jerk(&machines::arm(), 0.05);
    let cases = [
        (machines::arm(), 0.1, 10_000, 0.75),
        (machines::arm(), 0.1, 20_000, 0.65),
        (machines::arm(), 0.1, 2_000, 0.75),
        (jerk, 0.1, 10_000, 0.75),
        (machines::polar(), 0.1, 20_000, 0.7),
        (machines::corexy(), 0.005, 10_000, 0.8),
    ];
    for (machine, tolerance, period_us, most) in cases {
        let placed = fitted(&machine, &figures());
        let settings = Settings::new(tolerance, period_us);
        let [nearest, along] = [Rounding::Nearest, Rounding::Path]
            .map(|rounding| rms_mm(&machine, &rows(&machine, &placed, &settings, rounding)));
        let name = machine.name();
        assert!(along <= most * nearest, "{name}, {period_us} us: {along} mm of {nearest} mm");
    }
}

#[test]
fn rows_do_not_depend_on_threads_or_cache() {
    let machine = machines::arm();
    let strokes: Vec<Stroke> = (0..40).flat_map(|_| figures().strokes).collect();
    let placed = fitted(&machine, &Drawing::from(strokes));
    let settings = Settings::new(0.1, 10_000);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let mut trajectory = plan(&machine, placed.clone(), &settings).expect("it fits");
            let cached: Vec<ExactRow> = trajectory.rows().collect();
            assert_eq!(cached.len() as u64, trajectory.row_count());
            assert!(cached.iter().copied().eq(trajectory.rows()), "with known choices");
            trajectory.drop_cache();
            assert!(cached.iter().copied().eq(trajectory.rows()), "planned and searched again");
            cached
        })
    };
    assert_eq!(with(1), with(3));
}

/// The pen goes down where the plan starts: the motors rest there until it is down.
#[test]
fn stroke_from_start_pose_waits_for_the_pen() {
    let machine = machines::corexy();
    let start = machine.mechanism().forward(&machine.start());
    let stroke = Stroke::polyline(
        Pen(1),
        vec![start, start + (20.3, 7.7), start + (3.1, 18.4), start],
        Span::default(),
    );
    let drawing = Drawing::from(vec![stroke.expect("points")]);
    let along = rows(&machine, &drawing, &Settings::new(0.1, 10_000), Rounding::Path);
    let down = along.iter().position(|row| row.row.pen != 0).expect("ink");
    assert_eq!(along[down].row.ticks, along[down + 1].row.ticks);
    assert_eq!(along[0].row.ticks, along[down].row.ticks);
}

/// Pen events rest on one pair of ticks, the one nearest to the path if the limits leave room for it.
#[test]
fn rests_take_the_nearest_ticks_in_the_plane() {
    let machine = machines::arm();
    let placed = fitted(&machine, &figures());
    let along = rows(&machine, &placed, &Settings::new(0.1, 10_000), Rounding::Path);
    let pen = |motors: [f64; 2]| machine.forward_from_motors(&MotorPos::new(motors[0], motors[1]));
    let (mut moved, mut rests) = (0, 0);
    for pair in along.windows(2).filter(|pair| pair[1].row.t_us - pair[0].row.t_us > 10_000) {
        assert_eq!(pair[0].row.ticks, pair[1].row.ticks);
        let ExactRow { row, exact } = pair[0];
        let away = |ticks: [i64; 2]| pen(ticks.map(|t| t as f64)).distance(pen(exact));
        let nearest = exact.map(|position| position.round() as i64);
        rests += 1;
        moved += i32::from(row.ticks != nearest);
        assert!(away(row.ticks) <= away(nearest) + 1e-3);
    }
    assert!(rests >= 6 && moved >= 1, "{moved} of {rests}");
}
