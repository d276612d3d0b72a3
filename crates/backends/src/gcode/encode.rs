//! G-code for firmwares that do the kinematics themselves: the drawing as Cartesian paths in machine mm.
//!
//! [`paths`] writes the drawing (lines, arcs as `G2` and `G3`, the mean speed of each stroke in the plan) and leaves
//! acceleration to the firmware's own planner; [`timed`] writes each row of the plan with its duration (`G93`, inverse
//! time). The firmware plans velocities again in either case.
//!
//! A comment `; s N` precedes every stroke: a sender may resume there, at the line with that number.

use std::f64::consts::PI;
use std::io::Write;

use drawing::{Drawing, EllipticArc, Point, Segment, Stroke};
use kinematics::PenServo;

use crate::WriteError;
use crate::setpoint::at_rest;
use crate::{Line, Setpoint};
use plan::Row;
use plan::file::text::Text;

/// A dialect of G-code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Flavour {
    /// grbl 1.1 and grblHAL.
    Grbl,
    /// FluidNC.
    FluidNc,
    /// Marlin 2, with `ARC_SUPPORT`.
    Marlin,
    /// Klipper, with `[gcode_arcs]` and, for a servo, `[servo pen]`.
    Klipper,
}

/// What moves the pen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pen {
    /// A servo: spindle speed for grbl and FluidNC, degrees for the others.
    Servo {
        /// Position with the pen up.
        up: u16,
        /// Position with the pen down.
        down: u16,
    },
    /// A servo whose pulses the machine file states.
    Pulses(PenServo),
    /// The Z axis, mm.
    Z {
        /// Height with the pen up.
        up: f64,
        /// Height with the pen down.
        down: f64,
    },
}

/// How lines are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Options {
    /// The dialect.
    pub(super) flavour: Flavour,
    /// What moves the pen.
    pub(super) pen: Pen,
    /// Lift time and drop time, s.
    pub(super) pen_s: [f64; 2],
    /// Speed of travel with the pen up, mm/s.
    pub(super) travel_mm_s: f64,
    /// The machine's own limit of that speed, infinite if it has none, mm/s.
    pub(super) travel_limit_mm_s: f64,
    /// Chord error of curves that are neither lines nor circular arcs, mm.
    pub(super) chord_mm: f64,
}

/// No part of a split arc turns further than this: firmwares reject full circles, and lose digits on long arcs.
const MOST_TURN: f64 = PI / 2.0;
/// Arcs with a larger radius, mm, become chords: `I` and `J` would lose too many digits.
const LARGEST_RADIUS_MM: f64 = 10_000.0;

struct Program<'a> {
    options: &'a Options,
    lines: Vec<Line>,
    here: Option<Point>,
    /// The last feed that was written: it is modal.
    feed: f64,
}

impl Program<'_> {
    fn push(&mut self, text: String, duration_s: f64) {
        let row = self.lines.len() as u64 + 1;
        self.lines.push(Line {
            text,
            row,
            duration_us: (duration_s * 1e6).round() as u64,
            ..Line::default()
        });
    }

    fn start(&mut self) {
        self.modes();
        self.pen(false);
    }

    /// Millimetres, absolute; arcs in the plane of the paper.
    fn modes(&mut self) {
        for text in ["G21", "G90", "G17"] {
            self.push(text.to_owned(), 0.0);
        }
        if self.options.flavour != Flavour::Klipper {
            self.push("G94".to_owned(), 0.0);
        }
    }

    fn pen(&mut self, down: bool) {
        let Options { flavour, pen, pen_s, .. } = *self.options;
        let wait_s = pen_s[usize::from(down)];
        match pen {
            Pen::Z { up, down: low } => {
                let text = if down { format!("G1 Z{low} F1000") } else { format!("G0 Z{up}") };
                self.feed = f64::NAN;
                self.push(text, wait_s);
            }
            Pen::Servo { .. } | Pen::Pulses(_) => {
                let position = servo_position(flavour, pen, down);
                match flavour {
                    Flavour::Grbl | Flavour::FluidNc => self.push(format!("M3 S{position}"), 0.0),
                    Flavour::Marlin => {
                        // `M280` does not wait for queued motion.
                        self.push("M400".to_owned(), 0.0);
                        self.push(format!("M280 P0 S{position}"), 0.0);
                    }
                    Flavour::Klipper => {
                        self.push("M400".to_owned(), 0.0);
                        self.push(format!("SET_SERVO SERVO=pen {position}"), 0.0);
                    }
                }
                let dwell = match flavour {
                    Flavour::Grbl | Flavour::FluidNc => format!("G4 P{}", decimal(wait_s, 3)),
                    Flavour::Marlin | Flavour::Klipper => format!("G4 P{}", decimal(wait_s * 1000.0, 0)),
                };
                self.push(dwell, wait_s);
            }
        }
    }

    /// Pauses for a pen, at the park position once there is ink on the paper.
    fn change_pen(&mut self, pen: u16, park: Option<Point>) {
        if let Some(park) = park {
            self.travel(park);
        }
        let text = if self.options.flavour == Flavour::Klipper { "PAUSE" } else { "M0" };
        self.push(format!("{text} ; put in pen {pen}"), 0.0);
    }

    fn travel(&mut self, to: Point) {
        let far = self.here.map_or(0.0, |from| from.distance(to));
        self.push(format!("G0 {}", xy(to)), far / self.options.travel_mm_s);
        self.here = Some(to);
    }

    fn line(&mut self, to: Point, mm_s: f64) {
        let far = self.here.map_or(0.0, |from| from.distance(to));
        let feed = self.feed(mm_s);
        self.push(format!("G1 {}{feed}", xy(to)), far / mm_s);
        self.here = Some(to);
    }

    /// An arc of a circle from where it is to `to`.
    fn arc(&mut self, arc: &EllipticArc, to: Point, clockwise: bool, length: f64, mm_s: f64) {
        let Some(from) = self.here else { return };
        let center = arc.center - from;
        let feed = self.feed(mm_s);
        let verb = if clockwise { "G2" } else { "G3" };
        let text = format!("{verb} {} I{} J{}{feed}", xy(to), decimal(center.x, 4), decimal(center.y, 4));
        self.push(text, length / mm_s);
        self.here = Some(to);
    }

    /// The feed in mm/min where it differs from the last one written.
    fn feed(&mut self, mm_s: f64) -> String {
        let feed = (mm_s * 60.0 * 10.0).round() / 10.0;
        if feed == self.feed {
            return String::new();
        }
        self.feed = feed;
        format!(" F{}", decimal(feed, 1))
    }

    fn segment(&mut self, segment: &Segment, mm_s: f64) {
        if let Segment::Arc(arc) = segment
            && let Some(radius) = arc.circle_radius().filter(|radius| *radius < LARGEST_RADIUS_MM)
        {
            let parts = (arc.sweep_rad.abs() / MOST_TURN).ceil().max(1.0);
            // Mirrored, the half-diameters turn the other way.
            let clockwise = arc.a.cross(arc.b) * arc.sweep_rad < 0.0;
            for part in 1..=parts as u64 {
                let to = arc.eval(part as f64 / parts);
                if same(self.here, to) {
                    continue;
                }
                self.arc(arc, to, clockwise, radius * arc.sweep_rad.abs() / parts, mm_s);
            }
            return;
        }
        let mut points = Vec::new();
        segment.flatten(self.options.chord_mm, |point| points.push(point));
        self.chords(&points, mm_s);
    }

    fn chords(&mut self, points: &[Point], mm_s: f64) {
        for point in points {
            if !same(self.here, *point) {
                self.line(*point, mm_s);
            }
        }
    }

    /// A stroke, from its start.
    fn route(&mut self, stroke: &Stroke, route: Route<'_>, mm_s: f64) {
        match route {
            Route::Drawn => stroke.segments().for_each(|segment| self.segment(&segment, mm_s)),
            Route::Chords(points) => self.chords(points, mm_s),
        }
    }
}

/// The position of a servo as the firmware takes it. Firmwares have their own ideas of how pulses
/// depend on angles, so pulses are sent where they take them: Klipper as `WIDTH` in s, Marlin as `S`
/// of at least 544 us. `S` of grbl has the unit that `$30` and `$31` give it: degrees if the machine file
/// has degrees, otherwise microseconds.
fn servo_position(flavour: Flavour, pen: Pen, down: bool) -> String {
    let which = usize::from(down);
    match (flavour, pen) {
        (Flavour::Klipper, Pen::Pulses(servo)) => format!("WIDTH={:.6}", servo.pulses_us[which] * 1e-6),
        (Flavour::Klipper, Pen::Servo { up, down: low }) => format!("ANGLE={}", [up, low][which]),
        (_, Pen::Servo { up, down: low }) => [up, low][which].to_string(),
        (Flavour::Marlin, Pen::Pulses(servo)) => decimal(servo.pulses_us[which], 0),
        (_, Pen::Pulses(servo)) => decimal(servo.angles_deg.unwrap_or(servo.pulses_us)[which], 3),
        (_, Pen::Z { .. }) => String::new(),
    }
}

/// Whether two places are the same in the digits that are written.
fn same(here: Option<Point>, to: Point) -> bool {
    here.is_some_and(|here| xy(here) == xy(to))
}

pub(super) fn xy(p: Point) -> String {
    format!("X{} Y{}", decimal(p.x, 3), decimal(p.y, 3))
}

/// With at most `decimals` decimals, without trailing zeros or a negative 0.
pub(super) fn decimal(number: f64, decimals: usize) -> String {
    let text = format!("{number:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// The lines that move the pen.
pub(super) fn pen(options: &Options, down: bool) -> Vec<Line> {
    let mut program = Program { options, lines: Vec::new(), here: None, feed: f64::NAN };
    program.pen(down);
    program.lines
}

/// What is written of a stroke.
#[derive(Clone, Copy, Debug)]
pub(super) enum Route<'a> {
    /// Its own lines, arcs and curves.
    Drawn,
    /// Chords of the path that the plan has for it, from the first point to the last.
    Chords(&'a [Point]),
}

impl Route<'_> {
    fn start(self, stroke: &Stroke) -> Point {
        match self {
            Route::Drawn => stroke.start(),
            Route::Chords(points) => points.first().copied().unwrap_or_else(|| stroke.start()),
        }
    }
}

/// The lines that draw `drawing` (machine mm, in its order), then travel to `park`. `routes` and `speeds_mm_s` belong to
/// its strokes. Without `pauses` it draws with one pen.
pub(super) fn paths(
    drawing: &Drawing,
    routes: &[Route<'_>],
    speeds_mm_s: &[f64],
    park: Point,
    options: &Options,
    pauses: bool,
) -> Vec<Line> {
    let mut program = Program { options, lines: Vec::new(), here: None, feed: f64::NAN };
    program.start();
    let mut pen = drawing.strokes.iter().next().map(|stroke| stroke.pen).filter(|_| pauses);
    if let Some(first) = pen.filter(|first| drawing.strokes.iter().any(|stroke| stroke.pen != *first)) {
        program.change_pen(first.0, None);
    }
    for ((stroke, route), speed) in drawing.strokes.iter().zip(routes).zip(speeds_mm_s) {
        if pauses && pen != Some(stroke.pen) {
            pen = Some(stroke.pen);
            program.change_pen(stroke.pen.0, Some(park));
        }
        program.travel(route.start(&stroke));
        program.pen(true);
        program.route(&stroke, *route, *speed);
        program.pen(false);
    }
    program.travel(park);
    program.lines
}

/// The lines of one stroke, from the travel to its start.
pub(super) fn stroke(stroke: &Stroke, route: Route<'_>, options: &Options) -> Vec<Line> {
    let mut program = Program { options, lines: Vec::new(), here: None, feed: f64::NAN };
    program.travel(route.start(stroke));
    program.route(stroke, route, 1.0);
    program.lines
}

/// The lines for each row of a plan in its time: with `G93`, or with a feed for each row.
pub(super) fn timed(
    setpoints: impl IntoIterator<Item = Setpoint>,
    options: &Options,
    inverse: bool,
) -> Vec<Line> {
    let mut program = Program { options, lines: Vec::new(), here: None, feed: f64::NAN };
    program.start();
    let setpoints: Vec<Setpoint> = setpoints.into_iter().collect();
    // Plans start at the park position.
    let park = setpoints.first().map_or(Point::ZERO, |first| first.at);
    let pens = || setpoints.iter().map(|setpoint| setpoint.row.pen).filter(|pen| *pen != 0);
    if let Some(first) = pens().next().filter(|first| pens().any(|pen| pen != *first)) {
        program.change_pen(first, None);
    }
    let mut before: Option<Setpoint> = None;
    let mut down = false;
    let mut selected = 0;
    let mut sent_us = 0;
    let mut last = 0;
    for (index, setpoint) in (0_u64..).zip(setpoints.iter().copied()) {
        last = index;
        let first = program.lines.len();
        if let Some(previous) = before {
            let pen = previous.row.pen;
            if (pen != 0) != down {
                if pen != 0 && selected != 0 && pen != selected {
                    program.change_pen(pen, Some(park));
                    program.travel(previous.at);
                }
                selected = if pen == 0 { selected } else { pen };
                down = pen != 0;
                program.pen(down);
                for line in &mut program.lines[first..] {
                    line.row = index - 1;
                }
                let rests = previous.row.ticks == setpoint.row.ticks;
                sent_us = if rests { setpoint.row.t_us } else { previous.row.t_us };
            }
            let first = program.lines.len();
            if !same(program.here, setpoint.at) {
                let duration_s = (setpoint.row.t_us - sent_us) as f64 * 1e-6;
                sent_us = setpoint.row.t_us;
                if inverse {
                    program.push(
                        format!("G93 G1 {} F{}", xy(setpoint.at), decimal(60.0 / duration_s, 3)),
                        duration_s,
                    );
                    program.here = Some(setpoint.at);
                } else {
                    let from = program.here.unwrap_or(setpoint.at);
                    program.line(setpoint.at, from.distance(setpoint.at).max(1e-3) / duration_s.max(1e-6));
                }
            }
            for line in &mut program.lines[first..] {
                line.row = index;
            }
        } else {
            program.travel(setpoint.at);
            for line in &mut program.lines {
                line.row = 0;
            }
        }
        before = Some(setpoint);
    }
    let done = program.lines.len();
    if down {
        program.pen(false);
    }
    if inverse {
        program.push("G94".to_owned(), 0.0);
    }
    // Lines after the last row belong to it.
    for line in &mut program.lines[done..] {
        line.row = last;
    }
    program.lines
}

/// The lines for rows that go on from where the machine stands, each with a feed; the pen stays as it is.
pub(super) fn continued(setpoints: impl IntoIterator<Item = Setpoint>, options: &Options) -> Vec<Line> {
    let mut program = Program { options, lines: Vec::new(), here: None, feed: f64::NAN };
    program.modes();
    let mut sent_us = 0;
    for (index, setpoint) in (0_u64..).zip(setpoints) {
        let first = program.lines.len();
        match program.here {
            None => program.here = Some(setpoint.at),
            Some(from) if !same(program.here, setpoint.at) => {
                let duration_s = (setpoint.row.t_us - sent_us) as f64 * 1e-6;
                sent_us = setpoint.row.t_us;
                program.line(setpoint.at, from.distance(setpoint.at).max(1e-3) / duration_s.max(1e-6));
            }
            Some(_) => {}
        }
        for line in &mut program.lines[first..] {
            line.row = index;
        }
    }
    program.lines
}

/// Writes lines, with `; s N` before every travel.
///
/// # Errors
/// An error of the writer.
pub(super) fn write<W: Write + ?Sized>(lines: &[Line], out: &mut W) -> Result<(), WriteError> {
    let mut text = Text::new(out);
    for (index, line) in lines.iter().enumerate() {
        if line.text.starts_with("G0 X") {
            text.str("; s ").int(index).byte(b'\n');
        }
        text.str(&line.text).byte(b'\n').flush_if_full()?;
    }
    Ok(text.finish()?)
}

/// The time of each stroke in a plan, s: that during which the pen is down and moves. `rows` are those of a plan
/// of as many strokes.
pub(super) fn stroke_times_s(strokes: usize, rows: impl Iterator<Item = Row>) -> Vec<f64> {
    let mut times_us: Vec<u64> = Vec::new();
    let mut before: Option<Row> = None;
    let mut pen = 0;
    for row in rows {
        if let Some(last) = before
            && last.pen != 0
        {
            if last.pen != pen {
                times_us.push(0);
            }
            if let Some(time_us) = times_us.last_mut().filter(|_| last.ticks != row.ticks) {
                *time_us += row.t_us - last.t_us;
            }
        }
        pen = before.map_or(0, |last| last.pen);
        before = Some(row);
    }
    (0..strokes).map(|index| times_us.get(index).map_or(0.0, |us| *us as f64 * 1e-6)).collect()
}

/// The path of each stroke in a plan: where the pen is at each row that moves it down. `setpoints` are those of a plan
/// of as many strokes.
pub(super) fn stroke_paths(strokes: usize, setpoints: impl Iterator<Item = Setpoint>) -> Vec<Vec<Setpoint>> {
    let mut paths: Vec<Vec<Setpoint>> = Vec::new();
    let mut before: Option<Setpoint> = None;
    let mut pen = 0;
    for setpoint in setpoints {
        if let Some(last) = before
            && last.row.pen != 0
        {
            if last.row.pen != pen {
                paths.push(vec![last]);
            }
            if let Some(path) = paths.last_mut().filter(|_| !at_rest(&last, &setpoint)) {
                path.push(setpoint);
            }
        }
        pen = before.map_or(0, |last| last.row.pen);
        before = Some(setpoint);
    }
    paths.resize_with(strokes, Vec::new);
    paths
}

/// The mean speed of each stroke in these times, mm/s, at most `max_mm_s`.
pub(super) fn stroke_speeds_mm_s(drawing: &Drawing, times_s: &[f64], max_mm_s: f64) -> Vec<f64> {
    let speed = |(stroke, seconds): (Stroke, &f64)| {
        if *seconds > 0.0 { (stroke.length() / seconds).clamp(0.1, max_mm_s) } else { max_mm_s }
    };
    drawing.strokes.iter().zip(times_s).map(speed).collect()
}
