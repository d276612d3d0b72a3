//! Drawing times against the fastest motion anywhere within the tolerance.
//!
//! `optima.tsv` is the output of `cargo xtask bound`: direct transcriptions with path and speed free
//! (pieces of constant acceleration or jerk, the pen within 0.1 mm of each line at nodes and half way
//! between them, limits of both motors), local optima found by ipopt.

#![expect(clippy::print_stdout, reason = "the table of docs/planning.md is printed")]

use drawing::{Drawing, Pen, Point, Span, Stroke};
use kinematics::Machine;
use planner::{Settings, plan};
use test_support::band::{Setup, TOLERANCE_MM, setups, strokes};
use test_support::machines;

const OPTIMA: &str = include_str!("optima.tsv");

fn drawing_time(machine: &Machine, origin: Point, points: &[(f64, f64)]) -> f64 {
    let points = points.iter().map(|(x, y)| Point::new(origin.x + x, origin.y + y)).collect();
    let stroke = Stroke::polyline(Pen(1), points, Span::default()).expect("there are points");
    let trajectory = plan(machine, Drawing::from(vec![stroke]), &Settings::new(TOLERANCE_MM, 1000));
    trajectory.expect("a plan").times().drawing_s
}

/// The optimum of a stroke in the table, s.
fn optimum(machine: &str, stroke: &str, build_up_ms: u32) -> Option<f64> {
    let build_up = build_up_ms.to_string();
    OPTIMA.lines().find_map(|line| {
        let fields: Vec<&str> = line.split('\t').collect();
        (fields[..3] == [machine, stroke, &build_up]).then(|| fields[3].parse().expect("a duration"))
    })
}

/// Strokes of a machine for which the table has an optimum, at least.
const LEAST_STROKES: usize = 31;

/// Ratios of drawing times to the optima with this build-up of the acceleration: at most `median` and
/// `worst` for each machine.
fn hold(build_up_ms: u32, [median, worst]: [f64; 2]) {
    let mut wrong = Vec::new();
    for Setup { name, machine, origin } in setups() {
        let machine = match build_up_ms {
            0 => machine,
            ms => machines::with_jerk(&machine, 1e-3 * f64::from(ms)),
        };
        let mut ratios = Vec::new();
        for (stroke, points) in strokes() {
            let Some(optimum) = optimum(name, stroke, build_up_ms) else { continue };
            let time = drawing_time(&machine, origin, &points);
            let ratio = time / optimum;
            // The table of docs/planning.md: `cargo test --test band -- --nocapture`.
            println!("{name}\t{build_up_ms}\t{stroke}\t{time:.3}\t{optimum}\t{ratio:.4}");
            if !(0.99..worst).contains(&ratio) {
                wrong.push(format!("{name}, {stroke}: {ratio:.4} of {optimum} s"));
            }
            ratios.push(ratio);
        }
        assert!(ratios.len() >= LEAST_STROKES, "the table has {} strokes of {name}", ratios.len());
        ratios.sort_by(f64::total_cmp);
        println!("{name}\t{build_up_ms}\tmedian {:.4}", ratios[ratios.len() / 2]);
        if ratios[ratios.len() / 2] > median {
            wrong.push(format!("{name}: median {:.4}", ratios[ratios.len() / 2]));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn drawing_times_without_jerk_limits_are_near_the_optimum_within_tolerance() {
    // Measured: 1.011 and 1.045.
    hold(0, [1.015, 1.05]);
}

#[test]
fn drawing_times_with_20_ms_of_build_up_are_near_the_optimum_within_tolerance() {
    // Measured: 1.017 and 1.060.
    hold(20, [1.02, 1.065]);
}

#[test]
fn drawing_times_with_100_ms_of_build_up_are_near_the_optimum_within_tolerance() {
    // Measured: 1.053 and 1.107.
    hold(100, [1.055, 1.115]);
}

fn circle(radius: f64, chords: u32) -> Vec<(f64, f64)> {
    let point = |k: u32| libm::sincos(std::f64::consts::TAU * f64::from(k) / f64::from(chords));
    (0..=chords).map(point).map(|(sin, cos)| (radius * cos, radius * sin)).collect()
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
    let [Setup { machine, origin, .. }, _] = setups();
    let (time, clean) =
        (drawing_time(&machine, origin, &noisy), drawing_time(&machine, origin, &circle(6.0, 150)));
    assert!(time < 1.15 * clean, "{time} s, {clean} s without noise");
}
