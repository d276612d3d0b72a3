//! G-code for firmwares that do the kinematics themselves: the drawing as Cartesian paths in machine mm.
//!
//! Two ways: [`commands`] says the drawing (lines, arcs as `G2` and `G3`, the speed of each stroke as the plan has it on
//! average) and leaves acceleration to the firmware's own planner; [`timed`] says each row of the plan with the time it
//! takes (`G93`, inverse time). A firmware plans again in either case: times are wishes.
//!
//! Before every stroke stands a comment `; s N`: a sender may go on there, at the command with that number.

use std::f64::consts::PI;
use std::io::Write;

use drawing::{Drawing, EllipticArc, Point, Segment};

use crate::WriteError;
use crate::command::{Command, Instant};
use plan::file::text::Text;

/// Whose G-code it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flavour {
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pen {
    /// A servo: spindle speed for grbl and FluidNC, degrees for the others.
    Servo {
        /// Position with the pen up.
        up: u16,
        /// Position with the pen down.
        down: u16,
    },
    /// The Z axis, mm.
    Z {
        /// Height with the pen up.
        up: i16,
        /// Height with the pen down.
        down: i16,
    },
}

/// How to say things.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Whose G-code it is.
    pub flavour: Flavour,
    /// What moves the pen.
    pub pen: Pen,
    /// How long the pen takes to go up and to come down, s.
    pub pen_s: [f64; 2],
    /// Speed of travel with the pen up, mm/s.
    pub travel_mm_s: f64,
    /// Chords of what is neither a line nor an arc of a circle stay so close to it, mm.
    pub chord_mm: f64,
}

/// An arc is cut so that no part turns further than this: firmwares are at a loss with whole circles, and lose digits.
const MOST_TURN: f64 = PI / 2.0;
/// Arcs beyond this radius, mm, are chords: `I` and `J` would lose too many digits.
const LARGEST_RADIUS_MM: f64 = 10_000.0;

struct Program<'a> {
    options: &'a Options,
    commands: Vec<Command>,
    here: Option<Point>,
    /// The last feed that was said; firmwares remember it.
    feed: f64,
}

impl Program<'_> {
    fn say(&mut self, text: String, lasts_s: f64) {
        let row = self.commands.len() as u64 + 1;
        self.commands.push(Command { text, row, lasts_us: (lasts_s * 1e6).round() as u64 });
    }

    fn start(&mut self) {
        // Millimetres, absolute; arcs in the plane of the paper.
        for text in ["G21", "G90", "G17"] {
            self.say(text.to_owned(), 0.0);
        }
        if self.options.flavour != Flavour::Klipper {
            self.say("G94".to_owned(), 0.0);
        }
        self.pen(false);
    }

    fn pen(&mut self, down: bool) {
        let Options { flavour, pen, pen_s, .. } = *self.options;
        let wait_s = pen_s[usize::from(down)];
        match pen {
            Pen::Z { up, down: low } => {
                let text = if down { format!("G1 Z{low} F1000") } else { format!("G0 Z{up}") };
                self.feed = f64::NAN;
                self.say(text, wait_s);
            }
            Pen::Servo { up, down: low } => {
                let angle = if down { low } else { up };
                match flavour {
                    Flavour::Grbl | Flavour::FluidNc => self.say(format!("M3 S{angle}"), 0.0),
                    Flavour::Marlin => {
                        // A servo does not wait for the motion before it.
                        self.say("M400".to_owned(), 0.0);
                        self.say(format!("M280 P0 S{angle}"), 0.0);
                    }
                    Flavour::Klipper => {
                        self.say("M400".to_owned(), 0.0);
                        self.say(format!("SET_SERVO SERVO=pen ANGLE={angle}"), 0.0);
                    }
                }
                let dwell = match flavour {
                    Flavour::Grbl | Flavour::FluidNc => format!("G4 P{}", decimal(wait_s, 3)),
                    Flavour::Marlin | Flavour::Klipper => format!("G4 P{}", decimal(wait_s * 1000.0, 0)),
                };
                self.say(dwell, wait_s);
            }
        }
    }

    fn change_pen(&mut self, pen: u16) {
        let text = if self.options.flavour == Flavour::Klipper { "PAUSE" } else { "M0" };
        self.say(format!("{text} ; put in pen {pen}"), 0.0);
    }

    fn travel(&mut self, to: Point) {
        let far = self.here.map_or(0.0, |from| from.distance(to));
        self.say(format!("G0 {}", xy(to)), far / self.options.travel_mm_s);
        self.here = Some(to);
    }

    fn line(&mut self, to: Point, mm_s: f64) {
        let far = self.here.map_or(0.0, |from| from.distance(to));
        let feed = self.feed(mm_s);
        self.say(format!("G1 {}{feed}", xy(to)), far / mm_s);
        self.here = Some(to);
    }

    /// An arc of a circle from where it is to `to`.
    fn arc(&mut self, arc: &EllipticArc, to: Point, clockwise: bool, length: f64, mm_s: f64) {
        let Some(from) = self.here else { return };
        let center = arc.center - from;
        let feed = self.feed(mm_s);
        let verb = if clockwise { "G2" } else { "G3" };
        let text = format!("{verb} {} I{} J{}{feed}", xy(to), decimal(center.x, 4), decimal(center.y, 4));
        self.say(text, length / mm_s);
        self.here = Some(to);
    }

    /// The feed in mm a minute where it is not the one said before.
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
        for point in points {
            if !same(self.here, point) {
                self.line(point, mm_s);
            }
        }
    }
}

/// Whether two places are the same in the digits that are written.
fn same(here: Option<Point>, to: Point) -> bool {
    here.is_some_and(|here| xy(here) == xy(to))
}

fn xy(p: Point) -> String {
    format!("X{} Y{}", decimal(p.x, 3), decimal(p.y, 3))
}

/// With so many decimals at the most, no zeros at the end, and no negative 0.
fn decimal(number: f64, decimals: usize) -> String {
    let text = format!("{number:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// The commands that draw `drawing` (machine mm, in its order), then travel to `park`. `speeds_mm_s` has the speed of each
/// stroke.
pub fn commands(drawing: &Drawing, speeds_mm_s: &[f64], park: Point, options: &Options) -> Vec<Command> {
    let mut program = Program { options, commands: Vec::new(), here: None, feed: f64::NAN };
    program.start();
    let mut pen = drawing.strokes.first().map(|stroke| stroke.pen);
    for (stroke, speed) in drawing.strokes.iter().zip(speeds_mm_s) {
        if pen != Some(stroke.pen) {
            pen = Some(stroke.pen);
            program.change_pen(stroke.pen.0);
        }
        program.travel(stroke.start());
        program.pen(true);
        for segment in stroke.segments() {
            program.segment(&segment, *speed);
        }
        program.pen(false);
    }
    program.travel(park);
    program.commands
}

/// The commands that say each row of a plan, in the time it has: with `G93`, or with a feed for each row.
pub fn timed(instants: impl IntoIterator<Item = Instant>, options: &Options, inverse: bool) -> Vec<Command> {
    let mut program = Program { options, commands: Vec::new(), here: None, feed: f64::NAN };
    program.start();
    let mut before: Option<Instant> = None;
    let mut down = false;
    let mut selected = 0;
    let mut said_us = 0;
    let mut last = 0;
    for (index, instant) in (0_u64..).zip(instants) {
        last = index;
        let first = program.commands.len();
        if let Some(previous) = before {
            let pen = previous.row.pen;
            if (pen != 0) != down {
                if pen != 0 && selected != 0 && pen != selected {
                    program.change_pen(pen);
                }
                selected = if pen == 0 { selected } else { pen };
                down = pen != 0;
                program.pen(down);
                for command in &mut program.commands[first..] {
                    command.row = index - 1;
                }
                let rests = previous.row.ticks == instant.row.ticks;
                said_us = if rests { instant.row.t_us } else { previous.row.t_us };
            }
            let first = program.commands.len();
            if !same(program.here, instant.at) {
                let lasts_s = (instant.row.t_us - said_us) as f64 * 1e-6;
                said_us = instant.row.t_us;
                if inverse {
                    program
                        .say(format!("G93 G1 {} F{}", xy(instant.at), decimal(60.0 / lasts_s, 3)), lasts_s);
                    program.here = Some(instant.at);
                } else {
                    let from = program.here.unwrap_or(instant.at);
                    program.line(instant.at, from.distance(instant.at).max(1e-3) / lasts_s.max(1e-6));
                }
            }
            for command in &mut program.commands[first..] {
                command.row = index;
            }
        } else {
            program.travel(instant.at);
            for command in &mut program.commands {
                command.row = 0;
            }
        }
        before = Some(instant);
    }
    let done = program.commands.len();
    if down {
        program.pen(false);
    }
    if inverse {
        program.say("G94".to_owned(), 0.0);
    }
    // What follows the last row leads to no other.
    for command in &mut program.commands[done..] {
        command.row = last;
    }
    program.commands
}

/// Writes commands, with `; s N` before every travel.
///
/// # Errors
/// Whatever the writer says.
pub fn write<W: Write + ?Sized>(commands: &[Command], out: &mut W) -> Result<(), WriteError> {
    let mut text = Text::new(out);
    for (index, command) in commands.iter().enumerate() {
        if command.text.starts_with("G0 X") {
            text.str("; s ").int(index).byte(b'\n');
        }
        text.str(&command.text).byte(b'\n').flush_if_full()?;
    }
    Ok(text.finish()?)
}
