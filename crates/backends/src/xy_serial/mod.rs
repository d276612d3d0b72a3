//! The single-belt plotter's serial lines, its acknowledgements, an emulated plotter.

mod emulator;
mod encode;

use std::io::Write;
use std::sync::Arc;

use kinematics::Machine;

use crate::backend::{
    Backend, EmulatorOptions, EncodeOptions, InkFrame, PenNumbers, PlanSource, SessionOptions,
};
use crate::device::Device;
use crate::program::{LineLanguage, Program, ProgramError};
use crate::session::Session;
use crate::transmission::stop_and_wait::{Acknowledgement, StopAndWait};
use crate::{Line, Unrepresentable, WriteError};

/// Where the plotter goes by itself after homing.
const MIDDLE: &str = "125.0,125.0";
const TO_MIDDLE_US: u64 = 10_000_000;
/// Where in the program the sender sends it there.
const MIDDLE_LINE: usize = 1;

/// The plotter answers positions from within 1 mm (it rounds 0.2 down to 0): before the pen moves there is a pause for
/// the rest of the way. It keeps no time.
const ACKNOWLEDGEMENT: Acknowledgement = Acknowledgement {
    text: "1",
    extra_at: Some(MIDDLE_LINE),
    slowness: 3,
    is_pen: |line| line.text.eq_ignore_ascii_case("p"),
    pen_pause_us: 150_000,
};

/// The backend.
#[derive(Clone, Copy, Debug)]
pub(crate) struct XySerial;

impl Backend for XySerial {
    fn name(&self) -> &'static str {
        encode::NAME
    }

    fn format_help(&self) -> Option<&'static str> {
        Some("Serial lines of the single-belt plotter")
    }

    fn protocol(&self) -> Option<(&'static str, &'static str)> {
        Some((encode::NAME, "The single-belt plotter's lines, answered by 1"))
    }

    fn emulator_help(&self) -> Option<&'static str> {
        Some("The single-belt plotter")
    }

    fn check(&self, machine: &Machine) -> Result<(), Unrepresentable> {
        let coupling = machine.coupling().rows();
        let is = |rows: [[f64; 2]; 2]| (0..2).all(|i| (0..2).all(|j| coupling[i][j] == rows[i][j]));
        if machine.mechanism().kind() == "cartesian" && is([[1.0, 1.0], [-1.0, 1.0]]) {
            return Ok(());
        }
        let machine = machine.name().to_owned();
        Err(Unrepresentable::OtherMachine { wanted: "a single-belt table, such as hbot", machine })
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Dropped
    }

    fn needs_machine(&self) -> bool {
        true
    }

    fn homes_itself(&self) -> bool {
        true
    }

    fn write(
        &self,
        plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        out: &mut dyn Write,
    ) -> Result<(), WriteError> {
        encode::write(plan.setpoints(self.name())?, out)
    }

    fn program(&self, plan: &PlanSource<'_>, _options: &EncodeOptions) -> Result<Program, ProgramError> {
        let lines = encode::lines(plan.setpoints(self.name())?)?;
        Ok(Program::of_lines(lines, Arc::new(Language)))
    }

    fn parse_program(&self, file: &[u8]) -> Option<Program> {
        let text = String::from_utf8_lossy(file);
        let lines = text.lines().map(|line| line.split(';').next().unwrap_or_default().trim());
        let lines = (1..).zip(lines.filter(|line| !line.is_empty()));
        let lines = lines.map(|(row, text)| Line { text: text.to_owned(), row, ..Line::default() });
        Some(Program::of_lines(lines.collect(), Arc::new(Language)))
    }

    /// A plotter that has just homed goes to the middle by itself and answers `1` there without having been asked. So the
    /// session begins by sending it there: that is answered once, whether it was on its way, there already, or elsewhere;
    /// if its own arrival came a moment earlier, the second answer follows at once and is waited for.
    fn session(&self, mut program: Program, _options: &SessionOptions) -> Option<Box<dyn Session>> {
        if let Some(first) = program.lines.first() {
            let (text, row) = (MIDDLE.to_owned(), first.row);
            let middle = Line { text, row, duration_us: TO_MIDDLE_US, ..Line::default() };
            program.lines.insert(MIDDLE_LINE, middle);
        }
        Some(Box::new(StopAndWait::new(program, ACKNOWLEDGEMENT)))
    }

    fn emulator(&self, options: &EmulatorOptions) -> Option<Box<dyn Device>> {
        Some(Box::new(emulator::XyPlotter::new(options.homed, options.answers_within_mm)))
    }

    fn ink_frame(&self) -> InkFrame {
        InkFrame::Millimetres(1)
    }
}

/// Positions are absolute and pen states are states, so a program can be resumed by its last ones.
#[derive(Clone, Copy, Debug)]
struct Language;

impl LineLanguage for Language {
    fn lift(&self) -> Vec<String> {
        vec!["p".to_owned()]
    }

    fn resume(&self, done: &[Line]) -> Vec<Line> {
        let is_pen = |line: &&Line| line.text.eq_ignore_ascii_case("p");
        let point = done.iter().rev().find(|line| !is_pen(line)).map(|line| line.text.clone());
        let is_down = done.iter().rev().find(is_pen).is_some_and(|line| line.text == "P");
        let lines = self.lift().into_iter().chain(point).chain(is_down.then(|| "P".to_owned()));
        lines.map(|text| Line { text, ..Line::default() }).collect()
    }
}
