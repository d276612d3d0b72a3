//! Orders benchmark drawings and prints the travel:
//! `bench_order [--effort N] [--merge] [--time] FILE.hpgl …`. With `--time` the cost is the time of
//! a small CoreXY machine.
//!
//! Reads the output of the benchmark's generator only: `SP`, `PUx,y` and `PDx,y,…` in plotter units
//! of 0.025 mm.

#![allow(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a benchmark prints, and reads the clock"
)]

use drawing::{Drawing, Pen, Point, Span, Stroke};
use ordering::{Cost, Options, distance, optimize};

fn read(text: &str) -> Drawing {
    let mut strokes = Vec::new();
    let mut at = Vec::new();
    for command in text.split(';').map(str::trim) {
        let (name, rest) = command.split_at(command.len().min(2));
        let numbers: Vec<f64> = rest.split(',').filter_map(|number| number.parse().ok()).collect();
        let points = numbers.chunks_exact(2).map(|p| Point::new(p[0] * 0.025, p[1] * 0.025));
        match name {
            "PU" => at = points.collect(),
            "PD" => {
                let stroke = Stroke::polyline(Pen(1), at.drain(..).chain(points).collect(), Span::default());
                strokes.extend(stroke);
            }
            _ => {}
        }
    }
    Drawing::from(strokes)
}

/// Travel time, s, of two coupled motors at 200 mm/s and 2000 mm/s² each, plus 0.3 s for lift and
/// drop.
fn corexy_time(a: Point, b: Point) -> f64 {
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let (speed, acceleration) = (200.0, 2000.0);
    let trapezoid = |way: f64| {
        if way * acceleration < speed * speed {
            2.0 * (way / acceleration).sqrt()
        } else {
            way / speed + speed / acceleration
        }
    };
    0.3 + trapezoid((dx + dy).abs().max((dx - dy).abs()))
}

fn main() {
    let mut options = Options { merge: false, ..Options::default() };
    let mut cost: &dyn Cost = &distance;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--effort" => options.effort = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(2),
            "--merge" => options.merge = true,
            "--time" => cost = &corexy_time,
            file => {
                let drawing = read(&std::fs::read_to_string(file).unwrap_or_default());
                let begin = std::time::Instant::now();
                let (_, report) = optimize(drawing, cost, &options);
                println!(
                    "{file}: {} -> {} strokes, travel {:.1} -> {:.1} mm, cost {:.1} -> {:.1}, {:.2} s",
                    report.strokes_before,
                    report.strokes_after,
                    report.travel_mm_before,
                    report.travel_mm_after,
                    report.travel_cost_before,
                    report.travel_cost_after,
                    begin.elapsed().as_secs_f64()
                );
            }
        }
    }
}
