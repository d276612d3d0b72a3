//! `plotplan jog`: moves a machine by hand, from a full screen or by the commands of a script.
//!
//! A jog is a travel of one row that is sent as `send` sends a resumed plan: from where the machine reports to
//! be, within its limits, pen up. So it works with every controller that reports its position.

mod canvas;
mod command;
mod screen;
mod sketch;

use std::fs;
use std::io::{BufRead as _, Write as _};

use anyhow::{Context as _, anyhow};
use backends::homing::HomingRun;
use backends::{
    Backend, EncodeOptions, InkFrame, Outcome, PlanSource, Program, ProgramError, ReportedPosition, RowIter,
    SessionOptions,
};
use drawing::{Line, Point, Segment, Vec2};
use kinematics::{JointPos, Machine, MotorPos, Play};
use plan::{Header, Rounding, Row};
use serialport::FlowControl;

use self::command::JogCommand;
use self::sketch::{Sketch, Stylus};
use super::homing;
use crate::cli::Jog;
use crate::failure::Failure;
use crate::port::Settings;
use crate::wire::Wire;
use crate::{machines, output};

/// A travel is given at least this time, microseconds; the controller's limits make it longer.
const LEAST_US: u64 = 1_000_000;
/// Poses along a travel that are checked against the limits of the joints.
const SAMPLES: u32 = 64;
/// Lines of a script are drawn within this, mm.
const SCRIPT_TOLERANCE_MM: f64 = 0.1;

pub(crate) fn run(arguments: &Jog) -> Result<(), Failure> {
    let backend = arguments.protocol.0;
    if let Some(what) = arguments.pen.wrong_positions() {
        return Err(Failure::Usage(anyhow!(what)));
    }
    if backend.status().is_none() {
        let name = backend.protocol().map_or("", |(name, _)| name);
        return Err(Failure::Usage(anyhow!("{name} controllers do not report their position: jog needs it")));
    }
    let machine = machines::machine(&arguments.machine)?.machine;
    let settings = Settings { path: arguments.port.clone(), baud: arguments.baud, flow: FlowControl::None };
    let script = arguments.commands.as_deref().map(script).transpose()?;
    let mut wire = Wire::open(settings, arguments.log.as_deref())?;
    homing::ensure(arguments.datum, false, backend, &machine, &mut wire)?;
    let ticks = start_ticks(&machine);
    let mut jogger = Jogger {
        backend,
        machine: &machine,
        wire,
        encode: arguments.pen.encode_options(),
        ticks,
        play: Play::new(&machine, ticks.map(|ticks| ticks as f64)),
        ways: [0; 2],
        aim: None,
        is_down: false,
        step_mm: 1.0,
        corner: None,
        touches: 0,
        touches_file: arguments.touches.clone(),
    };
    jogger.locate()?;
    match script {
        Some(lines) => jogger.follow(&lines),
        None => screen::run(&mut jogger),
    }
}

/// The lines of a script; of standard input as they come.
fn script(name: &str) -> Result<Vec<String>, Failure> {
    let lines: std::io::Result<Vec<String>> = if name == "-" {
        std::io::stdin().lock().lines().collect()
    } else {
        fs::read_to_string(name).map(|text| text.lines().map(str::to_owned).collect())
    };
    lines.with_context(|| format!("cannot read {name}")).map_err(Failure::Io)
}

fn start_ticks(machine: &Machine) -> [i64; 2] {
    machine.motor_positions(&machine.start()).0.map(|ticks| ticks.round() as i64)
}

/// Why a command was not done.
#[derive(Debug)]
enum JogError {
    /// The machine stays where it is.
    Refused(String),
    /// The machine, the port or a file fails.
    Failed(Failure),
}

impl From<Failure> for JogError {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

/// A machine that is moved by hand.
struct Jogger<'a> {
    backend: &'static dyn Backend,
    machine: &'a Machine,
    wire: Wire,
    encode: EncodeOptions,
    /// Where its motors are.
    ticks: [i64; 2],
    /// Where the mechanism is, in the motors' ticks.
    play: Play,
    /// The way in which each motor moved last, 1 or -1; 0 if it was not moved from here.
    ways: [i64; 2],
    /// Where the pen was sent, mm: rounding to ticks must not add up over many steps.
    aim: Option<Point>,
    is_down: bool,
    step_mm: f64,
    /// The corner of the sheet that it was sent to last.
    corner: Option<usize>,
    touches: usize,
    touches_file: Option<String>,
}

impl Jogger<'_> {
    fn follow(&mut self, lines: &[String]) -> Result<(), Failure> {
        let mut refused = None;
        let mut sketch = Sketch::default();
        for (number, line) in (1..).zip(lines) {
            let command =
                command::parse(line).map_err(|what| Failure::Usage(anyhow!("line {number}: {what}")))?;
            let Some(command) = command else { continue };
            if command == JogCommand::Quit {
                break;
            }
            let done = match command {
                JogCommand::Stylus(stylus) => self.follow_stylus(stylus, &mut sketch),
                command => self.obey(command, &mut || false),
            };
            let said = match done {
                Ok(said) => said,
                Err(JogError::Refused(what)) => {
                    refused = refused.or(Some(number));
                    format!("refused: {what}")
                }
                Err(JogError::Failed(failure)) => return Err(failure),
            };
            output::write("-", |out| writeln!(out, "{}: {said}", line.trim()))?;
        }
        match refused {
            None => Ok(()),
            Some(number) => Err(Failure::Drawing(anyhow!("line {number}: the machine was not moved"))),
        }
    }

    /// What a script does instead of the mouse: places on the sheet, one at a time.
    fn follow_stylus(&mut self, stylus: Stylus, sketch: &mut Sketch) -> Result<String, JogError> {
        let sheet = self.machine.sheet();
        sketch.add(stylus.moved(Vec2::new(sheet.x0, sheet.y0)), self.machine);
        if stylus == Stylus::Release {
            while let Some(step) = sketch.next() {
                self.draw(&step, SCRIPT_TOLERANCE_MM, &mut || false)?;
            }
        }
        match sketch.take_complaint() {
            Some(what) => Err(JogError::Refused(what)),
            None => Ok(self.place()),
        }
    }

    /// Where the pen is, mm.
    fn pen(&self) -> Point {
        self.machine.forward_from_motors(&MotorPos(self.play.loads()))
    }

    fn pose(&self) -> JointPos {
        self.machine.joint_positions(&MotorPos(self.play.loads()))
    }

    /// The motors are there, and nothing is known about their play.
    fn stand_at(&mut self, ticks: [i64; 2]) {
        self.ticks = ticks;
        self.play = Play::new(self.machine, ticks.map(|ticks| ticks as f64));
        self.ways = [0; 2];
    }

    /// The motors went there.
    fn went_to(&mut self, ticks: [i64; 2]) {
        let from = self.ticks;
        for (motor, way) in self.ways.iter_mut().enumerate() {
            let now = (ticks[motor] - from[motor]).signum();
            *way = if now == 0 { *way } else { now };
        }
        self.ticks = ticks;
        self.play.follow(ticks.map(|ticks| ticks as f64));
    }

    /// Where everything is, in words.
    fn place(&self) -> String {
        let (pen, [a, b]) = (self.pen(), self.ticks);
        let [first, second] = self.machine.motors();
        let down = if self.is_down { "down" } else { "up" };
        format!(
            "{:.2}, {:.2} mm; {} {a}, {} {b} ticks; pen {down}",
            pen.x + 0.0,
            pen.y + 0.0,
            first.name,
            second.name
        )
    }

    /// Does what was asked; `stops` is called while the machine moves and may end the motion.
    fn obey(&mut self, command: JogCommand, stops: &mut dyn FnMut() -> bool) -> Result<String, JogError> {
        match command {
            JogCommand::Step(mm) => self.step_mm = mm,
            JogCommand::Move(x, y) => {
                let from = self.aim.unwrap_or_else(|| self.pen());
                self.go_to(from + self.step_mm * Vec2::new(x, y), stops)?;
            }
            JogCommand::By(x, y) => {
                let from = self.aim.unwrap_or_else(|| self.pen());
                self.go_to(from + Vec2::new(x, y), stops)?;
            }
            JogCommand::Motor(motor, ticks) => {
                let mut to = self.ticks;
                to[motor] += ticks;
                self.aim = None;
                self.drive(to, stops)?;
            }
            JogCommand::Goto(x, y) => {
                let sheet = self.machine.sheet();
                self.go_to(Point::new(sheet.x0 + x, sheet.y0 + y), stops)?;
            }
            JogCommand::Corner(corner) => {
                self.go_to(self.corner_at(corner), stops)?;
                self.corner = Some(corner);
            }
            JogCommand::Pen(down) => self.set_pen(down, stops)?,
            JogCommand::Home => self.home()?,
            JogCommand::Where => self.locate()?,
            JogCommand::Touch(place) => return self.touch(place),
            JogCommand::Stylus(_) | JogCommand::Quit => {}
        }
        Ok(self.place())
    }

    /// A corner of the sheet, machine mm.
    fn corner_at(&self, corner: usize) -> Point {
        let sheet = self.machine.sheet();
        compiler::calibrate::corners([sheet.width(), sheet.height()])[corner] + Vec2::new(sheet.x0, sheet.y0)
    }

    /// Moves the pen in a straight line, as far as the machine reaches.
    fn go_to(&mut self, to: Point, stops: &mut dyn FnMut() -> bool) -> Result<(), JogError> {
        let refuse = |what: String| JogError::Refused(format!("{:.2}, {:.2} mm: {what}", to.x, to.y));
        self.machine.check_point(to).map_err(|error| JogError::Refused(error.to_string()))?;
        let pose = self.machine.pose_near(to, &self.pose()).map_err(|error| refuse(error.to_string()))?;
        if let Some(fault) = self.machine.joint_fault(&pose) {
            return Err(refuse(fault.to_string()));
        }
        // From a place where the pen cannot draw, such as a stretched arm, the way out is free.
        let here = self.pen();
        if self.machine.check_point(here).is_ok() {
            let line = Segment::Line(Line::new(here, to));
            self.machine.check_segment(&line).map_err(|error| JogError::Refused(error.to_string()))?;
        }
        let ticks = self.machine.motor_positions(&pose).0;
        self.drive(self.beyond_play(ticks), stops)?;
        self.aim = Some(to);
        Ok(())
    }

    /// Where the motors must be for the mechanism to be there: half of their backlash ahead in the direction in
    /// which it moves.
    fn beyond_play(&self, to: [f64; 2]) -> [i64; 2] {
        let loads = self.play.loads();
        [0, 1].map(|motor| {
            let (way, play) = (to[motor] - loads[motor], self.machine.motors()[motor].backlash_ticks);
            if play > 0.0 && way.abs() <= 0.5 {
                return self.ticks[motor];
            }
            (to[motor] + (0.5 * play).copysign(way)).round() as i64
        })
    }

    /// The first fault on the way of the motors to these positions.
    fn check_way(&self, to: [i64; 2]) -> Result<(), String> {
        let ends = [self.ticks, to].map(|ticks| MotorPos(ticks.map(|ticks| ticks as f64)));
        let is_in_reach = self.machine.check_point(self.pen()).is_ok();
        let mut play = self.play;
        for k in 1..=SAMPLES {
            let motors = ends[0] + f64::from(k) / f64::from(SAMPLES) * (ends[1] - ends[0]);
            play.follow(motors.0);
            let pose = self.machine.joint_positions(&MotorPos(play.loads()));
            if let Some(fault) = self.machine.joint_fault_between(&pose) {
                return Err(fault.to_string());
            }
            let pen = self.machine.mechanism().forward(&pose);
            if !pen.is_finite() {
                return Err("the mechanism cannot be assembled there".to_owned());
            }
            if is_in_reach || k == SAMPLES {
                self.machine.check_point(pen).map_err(|error| error.to_string())?;
            }
        }
        Ok(())
    }

    /// Sends the motors there, pen up.
    fn drive(&mut self, to: [i64; 2], stops: &mut dyn FnMut() -> bool) -> Result<(), JogError> {
        if to == self.ticks {
            return Ok(());
        }
        self.check_way(to).map_err(JogError::Refused)?;
        let ways = [0, 1].map(|motor: usize| {
            (to[motor] - self.ticks[motor]).abs() as f64 / self.machine.motors()[motor].max_speed_ticks_s
        });
        let time_us = LEAST_US.max((2e6 * ways[0].max(ways[1])) as u64);
        let start = start_ticks(self.machine);
        let rows = [Row { t_us: 0, pen: 0, ticks: start }, Row { t_us: time_us, pen: 0, ticks: to }];
        let program = self.program(&rows)?;
        let program = if program.table().is_some() {
            let reported = self.reported(self.ticks);
            program.from_row(1, Some(reported)).map_err(|error| Failure::Drawing(error.into()))?
        } else {
            // The firmware plans the way from where it is.
            self.program(&rows[1..])?
        };
        self.is_down = false;
        self.execute(program, stops)?;
        self.went_to(to);
        Ok(())
    }

    fn program(&self, rows: &[Row]) -> Result<Program, Failure> {
        self.encoded(rows, |source| self.backend.program(source, &self.encode))
    }

    /// The program of these rows; times count from the first one.
    fn encoded(
        &self,
        rows: &[Row],
        encode: impl FnOnce(&PlanSource<'_>) -> Result<Program, ProgramError>,
    ) -> Result<Program, Failure> {
        let rows: Vec<Row> = rows.iter().map(|row| Row { t_us: row.t_us - rows[0].t_us, ..*row }).collect();
        let header = header(self.machine, &rows);
        let each = || -> RowIter<'_> {
            Box::new(rows.iter().map(|row| (*row, row.ticks.map(|ticks| ticks as f64))))
        };
        let source = PlanSource::new(&header, &each).on_machine(self.machine);
        encode(&source).map_err(|error| Failure::Drawing(error.into()))
    }

    /// The position that the controller reports at these ticks, where its reports count ticks.
    fn reported(&self, ticks: [i64; 2]) -> [i64; 2] {
        match self.backend.ink_frame() {
            InkFrame::TicksFromStart => {
                let start = start_ticks(self.machine);
                [ticks[0] - start[0], ticks[1] - start[1]]
            }
            _ => ticks,
        }
    }

    fn execute(&mut self, program: Program, stops: &mut dyn FnMut() -> bool) -> Result<(), JogError> {
        let Some(mut session) = self.backend.session(program, &SessionOptions::default()) else {
            return Err(Failure::Usage(anyhow!("{} cannot be sent", self.backend.name())).into());
        };
        match self.wire.run_watched(&mut *session, stops) {
            Outcome::Done => Ok(()),
            Outcome::Stopped { .. } if self.wire.is_interrupted() => Err(Failure::Interrupted.into()),
            Outcome::Stopped { .. } => {
                self.locate()?;
                Err(JogError::Refused("stopped".to_owned()))
            }
            Outcome::Failed { why, .. } => Err(Failure::Io(anyhow!(why)).into()),
        }
    }

    fn set_pen(&mut self, down: bool, stops: &mut dyn FnMut() -> bool) -> Result<(), JogError> {
        let lift = self.machine.pen();
        let wait_s = if down { lift.drop_time_s } else { lift.lift_time_s };
        let pen = u16::from(down);
        let wait_us = ((wait_s * 1e6) as u64).max(1000);
        let rows = [Row { t_us: 0, pen, ticks: self.ticks }, Row { t_us: wait_us, pen, ticks: self.ticks }];
        let program = self.encoded(&rows, |source| self.backend.pen_program(source, &self.encode, down))?;
        self.execute(program, stops)?;
        self.is_down = down;
        Ok(())
    }

    fn home(&mut self) -> Result<(), JogError> {
        let homing = self.machine.parts().homing.as_ref();
        let Some((homing, steps)) = homing.zip(self.backend.homing(self.machine)) else {
            let why = match homing {
                Some(homing) if homing.needs_stop() => "this protocol cannot home to a mechanical stop",
                _ => "this machine has no switches to home by",
            };
            return Err(JogError::Refused(why.to_owned()));
        };
        self.wire.home(HomingRun::new(steps, homing))?;
        self.aim = None;
        self.locate().map_err(JogError::Failed)
    }

    /// Asks the machine where it is.
    fn locate(&mut self) -> Result<(), Failure> {
        let Some(status) = self.backend.status() else { return Ok(()) };
        let position = match self.wire.ask_position(status)? {
            ReportedPosition::At(position) => position,
            // It received nothing since it was homed: it stands in its start pose.
            ReportedPosition::Unknown => self.reported(start_ticks(self.machine)),
            ReportedPosition::Alarm(what) => return Err(Failure::Io(anyhow!(what))),
            ReportedPosition::Silent => {
                return Err(Failure::Io(anyhow!("the machine does not answer the query for its position")));
            }
        };
        let start = start_ticks(self.machine);
        let ticks = match self.backend.ink_frame() {
            InkFrame::Millimetres(_) => {
                let at = Point::new(position[0] as f64 * 1e-3, position[1] as f64 * 1e-3);
                let pose = self.machine.pose_near(at, &self.pose()).map_err(|error| {
                    Failure::Io(anyhow!("the machine reports {:.3}, {:.3} mm: {error}", at.x, at.y))
                })?;
                self.machine.motor_positions(&pose).0.map(|ticks| ticks.round() as i64)
            }
            InkFrame::TicksFromStart => [position[0] + start[0], position[1] + start[1]],
            _ => position,
        };
        if ticks != self.ticks {
            self.aim = None;
            self.stand_at(ticks);
        }
        Ok(())
    }

    /// Records a touch: the pen rests on this place of the sheet, or on the corner it was sent to last.
    fn touch(&mut self, place: Option<(f64, f64)>) -> Result<String, JogError> {
        let Some(file) = self.touches_file.clone() else {
            return Err(JogError::Refused(
                "there is no file for touches: give --touches FILE.csv".to_owned(),
            ));
        };
        let sheet = self.machine.sheet();
        let (x, y) = match (place, self.corner) {
            (Some(place), _) => place,
            (None, Some(corner)) => {
                let at = compiler::calibrate::corners([sheet.width(), sheet.height()])[corner];
                (at.x, at.y)
            }
            (None, None) => {
                return Err(JogError::Refused(
                    "touch which place? Go to a corner first, or give x and y".to_owned(),
                ));
            }
        };
        // The motors may have been turned by hand.
        self.locate()?;
        let is_new = !fs::exists(&file).unwrap_or(false);
        let opened = fs::OpenOptions::new().create(true).append(true).open(&file);
        let [a, b] = self.ticks;
        let [from_a, from_b] = self.ways.map(|way| ["-", "", "+"][(way + 1) as usize]);
        let written = opened.and_then(|mut out| {
            if is_new {
                let [first, second] = self.machine.motors();
                writeln!(out, "x_mm,y_mm,{},{},approach1,approach2", first.name, second.name)?;
            }
            writeln!(out, "{x},{y},{a},{b},{from_a},{from_b}")
        });
        written.map_err(|error| Failure::writing(error, &file))?;
        self.touches += 1;
        Ok(format!("touch {} at {x}, {y} mm of the sheet: {a}, {b} ticks", self.touches))
    }

    /// How far the pen is from the edges of what it reaches, mm: left, right, down, up; at most 999.
    fn margins(&self) -> [f64; 4] {
        let here = self.pen();
        [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)].map(|(x, y)| {
            let mut low = 0.0;
            let mut high = 999.0;
            let fits = |mm: f64| {
                let to = here + mm * Vec2::new(x, y);
                self.machine.check_point(to).is_ok()
                    && self.machine.check_segment(&Segment::Line(Line::new(here, to))).is_ok()
            };
            if fits(high) {
                return high;
            }
            while high - low > 0.05 {
                let middle = 0.5 * (low + high);
                if fits(middle) { low = middle } else { high = middle }
            }
            low
        })
    }
}

/// The header of a plan of these rows.
fn header(machine: &Machine, rows: &[Row]) -> Header {
    Header {
        machine: machine.name().to_owned(),
        motors: compiler::pipeline::header_motors(machine),
        placement: [1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        period_us: (machine.parts().period_s * 1e6).round() as u64,
        lift_overlap_us: 0,
        rounding: Rounding::Nearest,
        pen_colors: std::collections::BTreeMap::new(),
        rows: rows.len() as u64,
        duration_us: rows.last().map_or(0, |row| row.t_us),
    }
}
