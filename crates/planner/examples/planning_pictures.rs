//! The pictures of docs/planning.md: `cargo run -p plotplan-planner --example planning_pictures --
//! docs/pictures`.

use std::fmt::Write as _;
use std::path::Path;

use drawing::{Drawing, EllipticArc, Pen, Point, Rect, Segment, Span, Stroke};
use kinematics::{Cartesian, JointPos, JointRange, Machine, MachineParts, Motor, PenLimits, TwoLink};
use planner::unstable::{CornerBlend, PathBudget, Section, sections};
use planner::unstable::{GridInterval, JointPath, PathGeometry, SpeedCap, profile};
use planner::{Settings, plan};

type Failure = Box<dyn std::error::Error>;

const LINE: &str = "#1f4e9c";
const OTHER: &str = "#c8551b";
const LIMIT: &str = "#b8b8b8";

fn main() -> Result<(), Failure> {
    let folder = std::env::args().nth(1).ok_or("usage: planning_pictures FOLDER")?;
    let write = |name: &str, picture: String| std::fs::write(Path::new(&folder).join(name), picture);
    write("planning-corner.svg", corner())?;
    write("planning-speed.svg", speed()?)?;
    write("planning-phase.svg", phase()?)?;
    Ok(())
}

/// A picture with a map from world coordinates (y up) to its frame, in px.
struct Picture {
    body: String,
    /// The positions of the world's (x0, y0) and (x1, y1).
    frame: Rect,
    world: Rect,
}

impl Picture {
    const SIZE: (f64, f64) = (640.0, 360.0);

    fn new(frame: Rect, world: Rect) -> Self {
        Self { body: String::new(), frame, world }
    }

    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let u = (x - self.world.x0) / self.world.width();
        let v = (y - self.world.y0) / self.world.height();
        (self.frame.x0 + u * self.frame.width(), self.frame.y1 - v * self.frame.height())
    }

    fn line(&mut self, points: impl IntoIterator<Item = (f64, f64)>, style: &str) {
        let mut d = String::new();
        for (index, (x, y)) in points.into_iter().enumerate() {
            let (x, y) = self.at(x, y);
            // Writing to a string cannot fail, here and below.
            let _ = write!(d, "{}{x:.1} {y:.1}", if index == 0 { "M" } else { "L" });
        }
        let _ = writeln!(self.body, "<path d=\"{d}\" fill=\"none\" {style}/>");
    }

    fn text(&mut self, x: f64, y: f64, color: &str, anchor: &str, text: &str) {
        let _ = writeln!(
            self.body,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"{color}\" text-anchor=\"{anchor}\">{text}</text>"
        );
    }

    /// The frame with a label below, a label above, and numbers along both axes.
    fn axes(&mut self, below: &str, above: &str, steps: (f64, f64)) {
        let (frame, world) = (self.frame, self.world);
        let ticks = |from: f64, to: f64, step: f64| {
            (0..=((to - from) / step + 1e-9) as u32).map(move |k| from + f64::from(k) * step)
        };
        for x in ticks(world.x0, world.x1, steps.0) {
            self.line([(x, world.y0), (x, world.y1)], "stroke=\"#eeeeee\"");
            let (px, _) = self.at(x, world.y0);
            self.text(px, frame.y1 + 16.0, "#444444", "middle", &number(x));
        }
        for y in ticks(world.y0, world.y1, steps.1) {
            self.line([(world.x0, y), (world.x1, y)], "stroke=\"#eeeeee\"");
            let (_, py) = self.at(world.x0, y);
            self.text(frame.x0 - 6.0, py + 4.0, "#444444", "end", &number(y));
        }
        self.text(frame.center().x, frame.y1 + 34.0, "#444444", "middle", below);
        self.text(frame.x0, frame.y0 - 8.0, "#444444", "start", above);
    }

    fn finish(self) -> String {
        let (w, h) = Self::SIZE;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"{w}\" height=\"{h}\" fill=\"white\"/>\n{}</svg>\n",
            self.body
        )
    }
}

fn number(x: f64) -> String {
    let rounded = (x * 100.0).round() / 100.0;
    format!("{}", if rounded == 0.0 { 0.0 } else { rounded })
}

fn stroke_of(color: &str, width: f64) -> String {
    format!("stroke=\"{color}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"")
}

/// A right angle and a smaller angle, as drawn and as planned.
fn corner() -> String {
    let points = [(0.0, 0.0), (1.35, 0.0), (1.35, 0.9), (2.75, 1.25)].map(Point::from);
    let stroke = polyline(&points);
    let deviation = 0.1;
    let budget = PathBudget {
        chord_mm: 0.01,
        simplify_mm: 0.0,
        blend_mm: deviation,
        corner: CornerBlend::Parabola,
        row_mm: f64::INFINITY,
    };
    let mut picture = Picture::new(Rect::new(20.0, 20.0, 620.0, 340.0), Rect::new(-0.1, -0.2, 2.9, 1.4));
    // The tolerance band, as a wide line with round joints.
    let broad = 2.0 * deviation * 200.0;
    let drawn = || points.iter().map(|p| (p.x, p.y));
    picture.line(
        drawn(),
        &format!(
            "stroke=\"#e8eef8\" stroke-width=\"{broad}\" stroke-linejoin=\"round\" stroke-linecap=\"round\""
        ),
    );
    picture.line(drawn(), &format!("{} stroke-dasharray=\"6 4\"", stroke_of("#555555", 1.5)));
    for section in sections(&stroke, &budget) {
        for piece in &section {
            let color = if matches!(piece.curve, Segment::Line(_)) { LINE } else { OTHER };
            let along = (0..=32).map(|k| piece.curve.eval(f64::from(k) / 32.0));
            picture.line(along.map(|p| (p.x, p.y)), &stroke_of(color, 2.5));
        }
    }
    picture.text(40.0, 40.0, "#555555", "start", "dashed: the drawing, and all that is within 0.1 mm of it");
    picture.text(40.0, 58.0, LINE, "start", "what stays straight");
    picture.text(40.0, 76.0, OTHER, "start", "parabolas, each 0.1 mm from its vertex");
    picture.finish()
}

/// Speed along a path of corners and an arc, and the largest speed the motors allow at each point.
fn speed() -> Result<String, Failure> {
    let machine = corexy()?;
    let mut stroke =
        polyline(&[(50.0, 50.0), (56.0, 50.0), (56.0, 54.0), (59.0, 51.0), (62.0, 51.0)].map(Point::from));
    let down = -std::f64::consts::FRAC_PI_2;
    stroke.arc(EllipticArc::circular(Point::new(62.0, 53.5), 2.5, down, std::f64::consts::PI));
    let budget = PathBudget {
        chord_mm: 0.01,
        simplify_mm: 0.0,
        blend_mm: 0.05,
        corner: CornerBlend::Parabola,
        row_mm: f64::INFINITY,
    };
    let cap =
        SpeedCap { pen_mm_s: machine.pen().max_speed_mm_s, row_deviation_mm: f64::INFINITY, period_s: 1e-3 };
    let (mut limit, mut driven) = (Vec::new(), Vec::new());
    let mut way = 0.0;
    for section in sections(&stroke, &budget) {
        let pose =
            machine.pose_near(section[0].curve.start(), &machine.start()).map_err(|_| "out of reach")?;
        let path = JointPath::from_section(&machine, section, pose, 0.05)?;
        let PathGeometry::Drawn(_, section) = &path.geometry else { return Err("strokes are drawn".into()) };
        let mut at = way;
        for interval in &path.intervals {
            for (j, share) in [0.0, 0.5, 1.0].into_iter().enumerate() {
                let pen = pen_speed(section, interval.piece, interval.start + share * interval.length);
                limit.push((at + share * pen * interval.length, pen * most(&machine, interval, j)));
            }
            at +=
                interval.length * pen_speed(section, interval.piece, interval.start + 0.5 * interval.length);
        }
        for phase in profile(&machine, &path, &cap).phases {
            let mut from = way;
            let mut last = phase.start;
            for k in 0..=8 {
                let t = phase.duration_s * f64::from(k) / 8.0;
                let s = phase.start + t * (phase.speed + 0.5 * phase.acceleration * t);
                from += (s - last) * pen_speed(section, phase.piece, 0.5 * (s + last));
                last = s;
                driven.push((
                    from,
                    pen_speed(section, phase.piece, s) * (phase.speed + phase.acceleration * t),
                ));
            }
            way = from;
        }
    }
    let top = 160.0;
    let mut picture =
        Picture::new(Rect::new(60.0, 40.0, 620.0, 310.0), Rect::new(0.0, 0.0, (way / 5.0).ceil() * 5.0, top));
    picture.axes("way along the path, mm", "speed of the pen, mm/s", (5.0, 20.0));
    picture.line(limit.into_iter().map(|(s, v)| (s, v.min(top))), &stroke_of(LIMIT, 3.0));
    picture.line(driven, &stroke_of(LINE, 1.8));
    picture.text(620.0, 18.0, "#888888", "end", "grey: what both motors allow at each place");
    picture.text(620.0, 34.0, LINE, "end", "what is driven, from rest to rest");
    Ok(picture.finish())
}

/// |dp/ds| at `s` on a piece.
fn pen_speed(section: &Section, piece: usize, s: f64) -> f64 {
    let piece = &section[piece];
    piece.rate * piece.curve.derivatives(s * piece.rate).0.hypot()
}

/// The largest ds/dt at a sample of an interval: under the motors' speed limits, and for which some
/// d²s/dt² is feasible for both motors.
fn most(machine: &Machine, interval: &GridInterval, sample: usize) -> f64 {
    let [a, b] = machine.motors();
    let (first, second) = (interval.first[sample], interval.second[sample]);
    let speed = (a.max_speed_ticks_s / first[0].abs()).min(b.max_speed_ticks_s / first[1].abs());
    let capacity =
        a.max_acceleration_ticks_s2 * first[1].abs() + b.max_acceleration_ticks_s2 * first[0].abs();
    speed.min((capacity / (first[0] * second[1] - first[1] * second[0]).abs()).sqrt())
}

/// Speed against acceleration of both motors of an arm, row by row.
fn phase() -> Result<String, Failure> {
    let machine = arm()?;
    let mut points = Vec::new();
    for k in 0..=240 {
        let angle = f64::from(k) * std::f64::consts::TAU / 240.0;
        let r = 40.0 * libm::cos(2.5 * 2.0 * angle);
        points.push(Point::new(90.0 + r * libm::cos(2.0 * angle), 210.0 + r * libm::sin(2.0 * angle)));
    }
    let mut strokes = vec![polyline(&points)];
    strokes.push(polyline(&[(60.0, 140.0), (120.0, 140.0), (120.0, 160.0), (60.0, 150.0)].map(Point::from)));
    let settings = Settings::new(0.1, 4000);
    let trajectory = plan(&machine, Drawing::from(strokes), &settings)?;
    let period = settings.period_us as f64 * 1e-6;
    let rows: Vec<[f64; 2]> = trajectory.rows().filter(|row| row.row.pen > 0).map(|row| row.exact).collect();
    let mut picture = Picture::new(Rect::new(60.0, 40.0, 620.0, 310.0), Rect::new(-1.2, -1.2, 1.2, 1.2));
    picture.axes("speed, share of the motor's limit", "acceleration, share of the motor's limit", (0.4, 0.4));
    let limit = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)];
    picture.line(limit, &stroke_of("#888888", 1.5));
    for (k, (motor, color)) in machine.motors().iter().zip([LINE, OTHER]).enumerate() {
        let mut dots = String::new();
        for w in rows.windows(3) {
            let speed = (w[2][k] - w[0][k]) / (2.0 * period) / motor.max_speed_ticks_s;
            let acceleration =
                (w[2][k] - 2.0 * w[1][k] + w[0][k]) / (period * period) / motor.max_acceleration_ticks_s2;
            let (x, y) = picture.at(speed, acceleration);
            let _ = write!(dots, "M{x:.1} {y:.1}h0");
        }
        let _ = writeln!(
            picture.body,
            "<path d=\"{dots}\" stroke=\"{color}\" stroke-width=\"2.6\" stroke-linecap=\"round\" stroke-opacity=\"0.6\"/>"
        );
        picture.text(620.0 - 70.0 * k as f64, 30.0, color, "end", &motor.name);
    }
    Ok(picture.finish())
}

fn polyline(points: &[Point]) -> Stroke {
    let mut stroke = Stroke::new(Pen(1), points[0], Span::default());
    for point in &points[1..] {
        stroke.line_to(*point);
    }
    stroke
}

fn motor(name: &str, counts: f64, offset: f64, speed: f64, acceleration: f64) -> Motor {
    let (max_speed, max_acceleration) = (counts * speed, counts * acceleration);
    Motor {
        name: name.into(),
        ticks_per_unit: counts,
        offset_ticks: offset,
        max_speed_ticks_s: max_speed,
        max_acceleration_ticks_s2: max_acceleration,
        max_jerk_ticks_s3: None,
        backlash_ticks: 0.0,
    }
}

/// A CoreXY of 80 ticks/mm, belts of 141.42 mm/s and 1414.2 mm/s².
fn corexy() -> Result<Machine, Failure> {
    let joint = JointRange { min: 0.0, max: 200.0 };
    Ok(Machine::new(MachineParts {
        name: "CoreXY".into(),
        mechanism: std::sync::Arc::new(Cartesian),
        joints: [joint; 2],
        min_manipulability: 0.0,
        coupling: [[1.0, 1.0], [1.0, -1.0]],
        motors: ["a", "b"].map(|name| motor(name, 80.0, 0.0, 141.42, 1414.2)),
        pen: PenLimits {
            max_speed_mm_s: 1000.0,
            max_travel_speed_mm_s: f64::INFINITY,
            lift_time_s: 0.1,
            drop_time_s: 0.1,
        },
        pen_servo: None,
        pen_offsets_mm: std::collections::BTreeMap::new(),
        homing: None,
        sheet: Rect::new(0.0, 0.0, 200.0, 200.0),
        start: JointPos::ZERO,
        period_s: 0.01,
    })?)
}

/// An arm with two links, 1 rad/s and 5 rad/s².
fn arm() -> Result<Machine, Failure> {
    let counts = 3200.0 / std::f64::consts::TAU;
    Ok(Machine::new(MachineParts {
        name: "arm".into(),
        mechanism: std::sync::Arc::new(TwoLink { l1_mm: 206.0, l2_mm: 256.0, elbow_left: true }),
        joints: [JointRange::FREE; 2],
        min_manipulability: 0.1,
        coupling: [[1.0, 0.0], [0.0, 1.0]],
        motors: ["arm1", "arm2"].map(|name| motor(name, counts, 0.0, 1.0, 5.0)),
        pen: PenLimits {
            max_speed_mm_s: 1000.0,
            max_travel_speed_mm_s: f64::INFINITY,
            lift_time_s: 0.1,
            drop_time_s: 0.1,
        },
        pen_servo: None,
        pen_offsets_mm: std::collections::BTreeMap::new(),
        homing: None,
        sheet: Rect::new(12.7, 76.2, 228.6, 355.6),
        start: JointPos::new(std::f64::consts::FRAC_PI_2, std::f64::consts::PI),
        period_s: 0.01,
    })?)
}
