//! The drawings of docs/mechanisms.md: `cargo run -p plotplan-kinematics --example mechanism_drawings --
//! docs/pictures`. Each mechanism in one pose, from its linkage, with its frame, joints and lengths.

use std::fmt::Write as _;
use std::path::Path;

use drawing::{Point, Rect, Vec2};
use kinematics::{Cartesian, FiveBar, JointPos, Mechanism, PartKind, Polar, Polargraph, TwoLink};

type Failure = Box<dyn std::error::Error>;

/// Width of a drawing, px.
const WIDTH: f64 = 460.0;
/// Size of the text, px.
const TEXT: f64 = 15.0;
/// Length of the frame's axes, px.
const AXIS: f64 = 62.0;

/// What is written beside the linkage.
enum Note {
    /// A name at a point of the linkage, moved by px (right, up).
    At(usize, [f64; 2], &'static str),
    /// A name beside the middle of the way between two points.
    Between(usize, usize, [f64; 2], &'static str),
    /// The same, with a dashed line along the way.
    Way(usize, usize, [f64; 2], &'static str),
    /// The angle of the way between two points against +x: an arc of this radius, px.
    Angle(usize, usize, f64, &'static str),
}

/// A mechanism in a pose, in a window of its plane.
struct Sketch {
    name: &'static str,
    mechanism: Box<dyn Mechanism>,
    pen: Point,
    window: Rect,
    notes: Vec<Note>,
}

fn main() -> Result<(), Failure> {
    let folder = std::env::args().nth(1).ok_or("usage: mechanism_drawings FOLDER")?;
    for sketch in sketches() {
        let name = format!("drawing-{}.svg", sketch.name);
        std::fs::write(Path::new(&folder).join(name), picture(&sketch)?)?;
    }
    Ok(())
}

fn sketches() -> impl Iterator<Item = Sketch> {
    open_chains().into_iter().chain(closed_chains())
}

fn open_chains() -> Vec<Sketch> {
    use Note::{Angle, At, Between, Way};
    let at = Point::new;
    vec![
        Sketch {
            name: "cartesian",
            mechanism: Box::new(Cartesian),
            pen: at(130.0, 70.0),
            window: Rect::new(-25.0, -25.0, 215.0, 125.0),
            notes: vec![
                At(10, [12.0, 8.0], "p = (x, y)"),
                Way(6, 9, [0.0, 8.0], "x"),
                Way(9, 10, [10.0, 0.0], "y"),
            ],
        },
        Sketch {
            name: "two-link",
            mechanism: Box::new(TwoLink { l1_mm: 100.0, l2_mm: 125.0, elbow_left: true }),
            pen: at(100.0, 165.0),
            window: Rect::new(-75.0, -25.0, 185.0, 185.0),
            notes: vec![
                At(0, [-20.0, -22.0], "O"),
                At(1, [-30.0, 10.0], "elbow"),
                At(2, [12.0, 6.0], "p"),
                Between(0, 1, [-26.0, 0.0], "L1"),
                Between(1, 2, [-6.0, 12.0], "L2"),
                Angle(0, 1, 34.0, "θ"),
                Angle(1, 2, 48.0, "ψ"),
            ],
        },
        Sketch {
            name: "polar",
            mechanism: Box::new(Polar { rack_offset_mm: 30.0 }),
            pen: at(60.0, 130.0),
            window: Rect::new(-130.0, -25.0, 150.0, 155.0),
            notes: vec![
                At(0, [-20.0, -20.0], "O"),
                At(2, [12.0, 4.0], "p"),
                Way(0, 1, [-10.0, -14.0], "d"),
                Between(1, 2, [-14.0, 6.0], "r"),
                Angle(1, 2, 44.0, "φ"),
            ],
        },
    ]
}

fn closed_chains() -> Vec<Sketch> {
    use Note::{Angle, At, Between};
    let at = Point::new;
    vec![
        Sketch {
            name: "five-bar",
            mechanism: Box::new(FiveBar {
                bases: [at(-80.0, 0.0), at(80.0, 0.0)],
                proximal_mm: [100.0; 2],
                distal_mm: [140.0; 2],
                elbow_left: [true, false],
                pen_left: true,
            }),
            pen: at(25.0, 160.0),
            window: Rect::new(-170.0, -25.0, 185.0, 180.0),
            notes: vec![
                At(0, [-28.0, -24.0], "base1"),
                At(1, [0.0, -24.0], "base2"),
                At(2, [-26.0, 4.0], "E1"),
                At(3, [10.0, 2.0], "E2"),
                At(4, [12.0, 6.0], "p"),
                Between(0, 2, [-24.0, -10.0], "P1"),
                Between(1, 3, [10.0, -10.0], "P2"),
                Between(2, 4, [-14.0, 10.0], "D1"),
                Between(3, 4, [10.0, 6.0], "D2"),
                Angle(0, 2, 26.0, "θ1"),
                Angle(1, 3, 34.0, "θ2"),
            ],
        },
        Sketch {
            name: "polargraph",
            mechanism: Box::new(Polargraph { anchors: [at(0.0, 0.0), at(650.0, 0.0)] }),
            pen: at(240.0, -260.0),
            window: Rect::new(-70.0, -330.0, 720.0, 150.0),
            notes: vec![
                At(0, [-34.0, -20.0], "left"),
                At(1, [-14.0, -24.0], "right"),
                At(2, [-6.0, -22.0], "p"),
                Between(0, 2, [-54.0, -8.0], "l left"),
                Between(1, 2, [6.0, -12.0], "l right"),
            ],
        },
    ]
}

/// The drawing as SVG.
fn picture(sketch: &Sketch) -> Result<String, Failure> {
    let Sketch { mechanism, window, .. } = sketch;
    let scale = WIDTH / window.width();
    let height = window.height() * scale;
    let px = |point: Point| ((point.x - window.x0) * scale, (window.y1 - point.y) * scale);
    let q: JointPos = mechanism.inverse(sketch.pen)?;
    let linkage = mechanism.linkage(window.inflate(-20.0, -20.0));
    let points = linkage.points(&q);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH:.0} {height:.0}\" \
         font-family=\"sans-serif\" font-size=\"{TEXT}\">\n\
         <title>{}: linkage, frame and joints</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        sketch.name
    );
    frame(&mut text, px(Point::ZERO))?;
    for part in &linkage.parts {
        let ((x0, y0), (x1, y1)) = (px(points[part.from]), px(points[part.to]));
        match part.kind {
            PartKind::Pivot => {
                writeln!(
                    text,
                    "<circle cx=\"{x0:.1}\" cy=\"{y0:.1}\" r=\"6\" fill=\"white\" stroke=\"#333333\" stroke-width=\"2\"/>"
                )?;
            }
            kind => {
                let (color, width) = if kind == PartKind::Rail { ("#9aa5b1", 3) } else { ("#33658a", 5) };
                writeln!(
                    text,
                    "<path d=\"M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}\" stroke=\"{color}\" stroke-width=\"{width}\" stroke-linecap=\"round\"/>"
                )?;
            }
        }
    }
    let (x, y) = px(points[linkage.pen]);
    writeln!(text, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"#b00020\"/>")?;
    for note in &sketch.notes {
        let (place, [right, up], name) = match *note {
            Note::At(point, by, name) => (px(points[point]), by, name),
            Note::Between(a, b, by, name) => (px(points[a].midpoint(points[b])), by, name),
            Note::Way(a, b, by, name) => {
                let ((x0, y0), (x1, y1)) = (px(points[a]), px(points[b]));
                writeln!(
                    text,
                    "<path d=\"M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}\" stroke=\"#c8551b\" stroke-width=\"1.2\" \
                     stroke-dasharray=\"4 3\"/>"
                )?;
                (px(points[a].midpoint(points[b])), by, name)
            }
            Note::Angle(from, to, radius, name) => {
                arc(&mut text, px(points[from]), points[to] - points[from], radius)?;
                let middle = 0.5 * libm::atan2(points[to].y - points[from].y, points[to].x - points[from].x);
                let (sin, cos) = libm::sincos(middle);
                (px(points[from]), [(radius + 8.0) * cos, (radius + 8.0) * sin - 0.3 * TEXT], name)
            }
        };
        let (x, y) = (place.0 + right, place.1 - up);
        writeln!(text, "<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"#222222\">{name}</text>")?;
    }
    text.push_str("</svg>\n");
    Ok(text)
}

/// The machine frame: x to the right, y up.
fn frame(text: &mut String, (x, y): (f64, f64)) -> Result<(), Failure> {
    for ([dx, dy], name, [nx, ny]) in
        [([AXIS, 0.0], "x", [AXIS + 8.0, 5.0]), ([0.0, -AXIS], "y", [-4.0, -AXIS - 8.0])]
    {
        let (tip_x, tip_y) = (x + dx, y + dy);
        let along = Vec2::new(dx, dy) / AXIS;
        let (back, side) = (9.0 * along, 4.0 * Vec2::new(-along.y, along.x));
        writeln!(
            text,
            "<path d=\"M{x:.1} {y:.1}L{tip_x:.1} {tip_y:.1}M{:.1} {:.1}L{tip_x:.1} {tip_y:.1}L{:.1} {:.1}\" fill=\"none\" \
             stroke=\"#2a7a2a\" stroke-width=\"1.5\"/>\n<text x=\"{:.1}\" y=\"{:.1}\" fill=\"#2a7a2a\">{name}</text>",
            tip_x - back.x + side.x,
            tip_y - back.y + side.y,
            tip_x - back.x - side.x,
            tip_y - back.y - side.y,
            x + nx,
            y + ny
        )?;
    }
    Ok(())
}

/// The arc from +x to a direction, counterclockwise, and the line that it is measured from.
fn arc(text: &mut String, (x, y): (f64, f64), to: Vec2, radius: f64) -> Result<(), Failure> {
    let angle = libm::atan2(to.y, to.x);
    let (sin, cos) = libm::sincos(angle);
    let sweep = u8::from(angle < 0.0);
    writeln!(
        text,
        "<path d=\"M{x:.1} {y:.1}h{:.1}M{:.1} {y:.1}A{radius} {radius} 0 0 {sweep} {:.1} {:.1}\" fill=\"none\" \
         stroke=\"#c8551b\" stroke-width=\"1.2\" stroke-dasharray=\"4 3\"/>",
        radius + 12.0,
        x + radius,
        x + radius * cos,
        y - radius * sin
    )?;
    Ok(())
}
