//! Drawing times against the fastest motion anywhere within the tolerance.
//!
//! The optima are those of a direct transcription with path and speed free (pieces of even jerk, the
//! pen within 0.1 mm of each line, limits of both motors; casadi and ipopt, local optima, so upper
//! bounds), in s: without jerk limits, and with a build-up of the acceleration in 20 and 100 ms.

use drawing::{Drawing, Pen, Point, Span, Stroke};
use kinematics::{Cartesian, JointPos, JointRange, Machine, MachineParts, Motor, PenLimits};
use planner::{Settings, plan};
use test_support::machines;

/// A CoreXY table: 500 mm/s² and 100 mm/s a motor, pen 60 mm/s.
fn machine() -> Machine {
    let motors = ["a", "b"].map(|name| Motor::new(name, 92.0, 100.0, 500.0));
    let sheet = drawing::Rect::new(0.0, 0.0, 200.0, 200.0);
    Machine::new(MachineParts {
        joints: [JointRange { min: 0.0, max: 200.0 }; 2],
        coupling: [[1.0, 1.0], [1.0, -1.0]],
        pen: PenLimits {
            max_speed_mm_s: 60.0,
            max_travel_speed_mm_s: f64::INFINITY,
            lift_time_s: 0.1,
            drop_time_s: 0.1,
        },
        start: JointPos::ZERO,
        ..MachineParts::new("table", Cartesian, motors, sheet)
    })
    .expect("a machine")
}

fn drawing_time(machine: &Machine, points: &[(f64, f64)]) -> f64 {
    let points = points.iter().map(|(x, y)| Point::new(100.0 + x, 100.0 + y)).collect();
    let stroke = Stroke::polyline(Pen(1), points, Span::default()).expect("there are points");
    let trajectory = plan(machine, Drawing { strokes: vec![stroke] }, &Settings::new(0.1, 1000));
    trajectory.expect("a plan").times().drawing_s
}

fn circle(radius: f64, chords: u32) -> Vec<(f64, f64)> {
    let point = |k: u32| libm::sincos(std::f64::consts::TAU * f64::from(k) / f64::from(chords));
    (0..=chords).map(point).map(|(sin, cos)| (radius * cos, radius * sin)).collect()
}

#[test]
fn drawing_times_are_near_the_optimum_within_tolerance() {
    let zigzag = (0..9).map(|k| (1.5 * f64::from(k), if k % 2 == 0 { 0.0 } else { 6.75_f64.sqrt() }));
    let strokes = [
        ("right angle of 20 mm", vec![(0.0, 0.0), (20.0, 0.0), (20.0, 20.0)], [0.8987, 0.9195, 1.0142]),
        ("zigzag of 3 mm", zigzag.collect(), [1.2126, 1.2463, 1.5992]),
        ("circle of 36 chords", circle(3.0, 36), [0.6033, 0.6276, 0.7637]),
    ];
    let fast = machine();
    let jerky = [0.02, 0.1].map(|build_up| machines::with_jerk(&fast, build_up));
    let mut wrong = Vec::new();
    for (name, points, optima) in strokes {
        for (machine, (optimum, most)) in
            [&fast, &jerky[0], &jerky[1]].into_iter().zip(optima.into_iter().zip([1.02, 1.03, 1.16]))
        {
            let ratio = drawing_time(machine, &points) / optimum;
            println!("{name:<22} {optimum:.4} {ratio:.4}");
            if !(0.99..most).contains(&ratio) {
                wrong.push(format!("{name}: {ratio:.4} of {optimum} s"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A blend bends at every vertex: with noise of 0.05 mm this circle took 1.9 to 2.5 s.
#[test]
fn noise_within_tolerance_does_not_slow_the_pen() {
    let mut seed = 1_u32;
    let mut noise = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        0.16 * (f64::from(seed >> 8) / f64::from(1 << 24) - 0.5)
    };
    let noisy: Vec<(f64, f64)> = circle(6.0, 150)
        .into_iter()
        .map(|(x, y)| {
            let factor = 1.0 + noise() / 6.0;
            (factor * x, factor * y)
        })
        .collect();
    let machine = machine();
    let (time, clean) = (drawing_time(&machine, &noisy), drawing_time(&machine, &circle(6.0, 150)));
    assert!(time < 1.15 * clean, "{time} s, {clean} s without noise");
}
