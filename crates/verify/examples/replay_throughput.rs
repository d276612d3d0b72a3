//! Rows a second through the verifier:
//! `cargo run --release -p plotplan-verify --example replay_throughput [-- PART-OF-A-NAME]`.
//!
//! The plans follow the drawing at a constant speed and ignore motor limits.

#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a benchmark reads the clock and prints"
)]

use std::time::Instant;

use drawing::{Affine, Drawing, Pen, Point, Rect, Span, Stroke, Vec2};
use kinematics::{Cartesian, JointPos, Machine, MachineParts, Motor, TwoLink};
use plan::Row;
use verify::{Timing, Verifier};

/// 100 ticks/mm on both axes.
fn cartesian() -> Option<Machine> {
    let motors = ["x", "y"].map(|name| Motor::new(name, 100.0, 1e4, 1e5));
    let sheet = Rect::new(0.0, 0.0, 200.0, 200.0);
    let parts = MachineParts::new("cartesian", Cartesian, motors, sheet);
    Machine::new(MachineParts { start: JointPos::ZERO, ..parts }).ok()
}

/// The coaxial arm (report 1), with 3200 `factor` ticks a turn.
fn arm(factor: f64, start: JointPos) -> Option<Machine> {
    let ticks_per_rad = factor * 3200.0 / std::f64::consts::TAU;
    let links = TwoLink { l1_mm: 206.0, l2_mm: 256.0, elbow_left: true };
    let motors = [
        Motor::new("arm1", ticks_per_rad, 533.3, 2666.7),
        Motor { offset_ticks: 800.0, ..Motor::new("arm2", -ticks_per_rad, 533.3, 2666.7) },
    ];
    let sheet = Rect::new(0.0, 0.0, 200.0, 200.0);
    Machine::new(MachineParts { start, ..MachineParts::new("arm", links, motors, sheet) }).ok()
}

/// Lines across a sheet of 160 mm; waves with the given number of vertices each.
fn sheet(lines: u32, vertices: u32, wave: f64) -> Drawing {
    let strokes = (0..lines).filter_map(|line| {
        let y = 20.0 + 160.0 * f64::from(line) / f64::from(lines);
        let points = (0..=vertices).map(|k| {
            let u = f64::from(if line % 2 == 0 { k } else { vertices - k }) / f64::from(vertices);
            Point::new(20.0 + 160.0 * u, y + wave * libm::sin(300.0 * u))
        });
        Stroke::polyline(Pen(1), points.collect(), Span::default())
    });
    Drawing { strokes: strokes.collect() }
}

/// Rows along the strokes, `step` mm apart.
fn rows(machine: &Machine, drawing: &Drawing, step: f64, period_us: u64) -> Vec<(Row, [f64; 2])> {
    let mut rows = Vec::new();
    let mut near = machine.start();
    let mut push = |pen: u16, point: Point| {
        if let Ok(pose) = machine.pose_near(point, &near) {
            near = pose;
            let exact = machine.motor_positions(&pose);
            let row = Row {
                t_us: period_us * rows.len() as u64,
                pen,
                ticks: [exact[0].round() as i64, exact[1].round() as i64],
            };
            rows.push((row, [exact[0], exact[1]]));
        }
    };
    push(0, machine.mechanism().forward(&machine.start()));
    for stroke in &drawing.strokes {
        push(0, stroke.start());
        let mut left = 0.0;
        for pair in stroke.vertices().windows(2) {
            let along: Vec2 = pair[1] - pair[0];
            let length = along.hypot2().sqrt();
            while left < length {
                push(1, pair[0] + along * (left / length));
                left += step;
            }
            left -= length;
        }
        push(0, stroke.end());
    }
    rows
}

fn measure(name: &str, machine: &Machine, drawing: &Drawing, step: f64, period_us: u64, exact: bool) {
    if std::env::args().nth(1).is_some_and(|only| !name.contains(&only)) {
        return;
    }
    let rows = rows(machine, drawing, step, period_us);
    let timing = Timing { period_us, lift_overlap_us: 0, rounding: plan::Rounding::Nearest };
    let began = Instant::now();
    let mut verifier = Verifier::new(machine, drawing, timing, 0.1);
    let built = began.elapsed();
    for (row, position) in &rows {
        verifier.row(*row, exact.then_some(*position));
    }
    let certificate = verifier.finish();
    let seconds = began.elapsed().as_secs_f64();
    println!(
        "{name:34} {:>8} rows {:>7.2} Mrows/s  build {:>6.1} ms  before {:.4} after {:.4} mm",
        rows.len(),
        rows.len() as f64 / seconds * 1e-6,
        built.as_secs_f64() * 1e3,
        certificate.before_rounding.unwrap_or_default().max_mm(),
        certificate.after_rounding.max_mm(),
    );
}

fn main() {
    let lines = sheet(400, 1, 0.0);
    let waves = sheet(325, 400, 0.5);
    let open = sheet(80, 400, 0.5);
    let dense = sheet(130, 10_000, 0.5);
    let Some(cartesian) = cartesian() else { return };
    for (name, drawing) in [
        ("lines 0.4 mm apart", &lines),
        ("waves 2 mm apart", &open),
        ("waves 0.5 mm apart", &waves),
        ("1.3 M vertices", &dense),
    ] {
        measure(&format!("cartesian, 10 ms, {name}"), &cartesian, drawing, 0.5, 10_000, true);
        measure(&format!("cartesian, 1 ms, {name}"), &cartesian, drawing, 0.05, 1_000, true);
    }
    measure("cartesian, 1 ms, ticks only, waves", &cartesian, &waves, 0.05, 1_000, false);
    // Into the reach of the arm.
    let mut waves = waves;
    waves.transform(Affine::translate((0.0, 150.0)));
    if let Some(arm) = arm(100.0, JointPos::new(1.0, 0.5)) {
        measure("arm, 10 ms, waves", &arm, &waves, 0.5, 10_000, true);
        measure("arm, 1 ms, waves", &arm, &waves, 0.05, 1_000, true);
    }
    let up = std::f64::consts::FRAC_PI_2;
    let Some(coarse) = arm(1.0, JointPos::new(up, up)) else { return };
    measure("coarse arm, 10 ms, waves", &coarse, &waves, 0.5, 10_000, true);
    measure("coarse arm, 1 ms, waves", &coarse, &waves, 0.05, 1_000, true);
}
