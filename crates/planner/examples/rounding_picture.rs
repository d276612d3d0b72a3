//! The picture of docs/rounding.md: `cargo run -p plotplan-planner --example rounding_picture --
//! docs/pictures`. A line and a curve on the coaxial arm, enlarged, before and after.

use std::fmt::Write as _;
use std::path::Path;

use drawing::{Drawing, Pen, Point, Rect, Span, Stroke};
use kinematics::{Machine, MotorPos};
use planner::{ExactRow, Rounding, Settings, plan};
use test_support::machines;

type Failure = Box<dyn std::error::Error>;

/// Side of a panel, px and mm.
const SIDE: f64 = 330.0;
const WORLD_MM: f64 = 7.0;

fn main() -> Result<(), Failure> {
    let folder = std::env::args().nth(1).ok_or("usage: rounding_picture FOLDER")?;
    std::fs::write(Path::new(&folder).join("rounding.svg"), picture()?)?;
    Ok(())
}

fn picture() -> Result<String, Failure> {
    let machine = machines::arm();
    let from = Point::new(60.0, 230.0);
    // A line, and a quarter of a small circle at its end.
    let mut stroke = Stroke::new(Pen(1), from, Span::default());
    stroke.line_to(from + (40.0, 14.0));
    stroke.cubic_to(from + (43.3, 15.2), from + (44.0, 18.0), from + (42.8, 21.3));
    let drawing = Drawing::from(vec![stroke]);
    let window = Rect::from_center_size(from + (41.2, 16.2), (WORLD_MM, WORLD_MM));
    let (width, height) = (2.0 * SIDE + 40.0, SIDE + 50.0);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n\
         <clipPath id=\"panel\"><rect width=\"{SIDE}\" height=\"{SIDE}\"/></clipPath>\n"
    );
    for (index, (rounding, title, color)) in
        [(Rounding::Nearest, "nearest ticks", "#c8551b"), (Rounding::Path, "along the path", "#1f4e9c")]
            .into_iter()
            .enumerate()
    {
        let settings = Settings { rounding, ..Settings::new(0.1, 10_000) };
        let rows: Vec<ExactRow> = plan(&machine, drawing.clone(), &settings)?.rows().collect();
        let x = 10.0 + (SIDE + 20.0) * index as f64;
        writeln!(
            text,
            "<text x=\"{x}\" y=\"20\">{title}</text>\n<g transform=\"translate({x} 30)\" clip-path=\"url(#panel)\">"
        )?;
        panel(&mut text, &machine, &rows, window, color)?;
        writeln!(text, "<rect width=\"{SIDE}\" height=\"{SIDE}\" fill=\"none\" stroke=\"#888888\"/>\n</g>")?;
    }
    let scale = SIDE / WORLD_MM;
    writeln!(
        text,
        "<path d=\"M10 {y}h{scale:.1}\" stroke=\"#444444\" stroke-width=\"2\"/>\n\
         <text x=\"{end:.1}\" y=\"{label}\">1 mm; grey: exact path, dots: positions of whole ticks</text>\n</svg>",
        y = SIDE + 41.0,
        end = 18.0 + scale,
        label = SIDE + 46.0
    )?;
    Ok(text)
}

/// Lattice, exact path and ink in a window.
fn panel(
    text: &mut String,
    machine: &Machine,
    rows: &[ExactRow],
    window: Rect,
    color: &str,
) -> Result<(), Failure> {
    let pen = |motors: [f64; 2]| machine.forward_from_motors(&MotorPos::new(motors[0], motors[1]));
    let px = |p: Point| {
        let scale = SIDE / WORLD_MM;
        (scale * (p.x - window.x0), scale * (window.y1 - p.y))
    };
    let line = |points: &mut dyn Iterator<Item = Point>, style: &str| {
        let mut d = String::new();
        for p in points {
            let (x, y) = px(p);
            let _ = write!(d, "{}{x:.1} {y:.1}", if d.is_empty() { "M" } else { "L" });
        }
        format!("<path d=\"{d}\" fill=\"none\" {style}/>\n")
    };
    let inside = window.inflate(1.0, 1.0);
    let inked: Vec<&ExactRow> =
        rows.iter().filter(|row| row.row.pen != 0 && inside.contains(pen(row.exact))).collect();
    let first = inked.first().ok_or("ink in the window")?;
    for a in -25..=25 {
        for b in -25..=25 {
            let p = pen([(first.row.ticks[0] + a) as f64, (first.row.ticks[1] + b) as f64]);
            if window.contains(p) {
                let (x, y) = px(p);
                writeln!(text, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1.5\" fill=\"#999999\"/>")?;
            }
        }
    }
    text.push_str(&line(
        &mut inked.iter().map(|row| pen(row.exact)),
        "stroke=\"#c9c9c9\" stroke-width=\"6\" stroke-linecap=\"round\"",
    ));
    let ticks = |row: &ExactRow| pen(row.row.ticks.map(|ticks| ticks as f64));
    text.push_str(&line(
        &mut inked.iter().map(|row| ticks(row)),
        &format!("stroke=\"{color}\" stroke-width=\"2\" stroke-linejoin=\"round\""),
    ));
    Ok(())
}
