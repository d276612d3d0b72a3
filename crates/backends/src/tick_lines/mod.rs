//! Tick lines: with numbers and checksums for readers that answer, as they are for those that do not; an emulated reader.

mod emulator;
mod framing;

use std::io::Write;
use std::sync::Arc;

use kinematics::Machine;
use plan::TickTable;
use plan::file::tick_lines;

use crate::backend::{Backend, EmulatorOptions, EncodeOptions, PenNumbers, PlanSource, SessionOptions};
use crate::device::Device;
use crate::homing::HomingSteps;
use crate::program::{Program, ProgramError, RowEncoder};
use crate::session::Session;
use crate::status::StatusProtocol;
use crate::transmission::open_loop::OpenLoop;
use crate::transmission::sliding_window::SlidingWindow;
use crate::{Line, Unrepresentable, WriteError};

/// How long the pen has to lift when a session fails, microseconds.
const LIFT_US: u64 = 300_000;

/// A reader that answers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Answered;

/// Lines as they are, paced by the port's flow control.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Raw;

/// Lines on schedule, for readers without answers or flow control.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Paced;

fn program(plan: &PlanSource<'_>) -> Result<Program, ProgramError> {
    Program::of_table(plan.table(), Arc::new(TickLineEncoder))
}

fn invalid(error: &plan::file::WriteError) -> Unrepresentable {
    Unrepresentable::InvalidPlan { what: error.to_string() }
}

impl Backend for Answered {
    fn name(&self) -> &'static str {
        "ticks"
    }

    fn format_help(&self) -> Option<&'static str> {
        Some("Tick lines, for any serial sender")
    }

    fn protocol(&self) -> Option<(&'static str, &'static str)> {
        Some((self.name(), "Tick lines with numbers and checksums, answered"))
    }

    fn emulator_help(&self) -> Option<&'static str> {
        Some("A reader of tick lines, with or without numbers")
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Sent
    }

    fn write(
        &self,
        plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        out: &mut dyn Write,
    ) -> Result<(), WriteError> {
        tick_lines::write(plan.header(), plan.rows(), out).map_err(|error| match error {
            plan::file::WriteError::Io(error) => WriteError::Io(error),
            other => invalid(&other).into(),
        })
    }

    fn program(&self, plan: &PlanSource<'_>, _options: &EncodeOptions) -> Result<Program, ProgramError> {
        program(plan)
    }

    fn pen_program(
        &self,
        plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        _down: bool,
    ) -> Result<Program, ProgramError> {
        // The rows have the pen.
        program(plan)
    }

    fn continuing_program(
        &self,
        plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        start: [i64; 2],
    ) -> Result<Program, ProgramError> {
        Program::continuing(plan.table(), Arc::new(TickLineEncoder), start)
    }

    fn session(&self, program: Program, options: &SessionOptions) -> Option<Box<dyn Session>> {
        let machine = program.table().map(|table| table.header.machine.clone()).unwrap_or_default();
        let framing = Box::new(framing::TickLineFraming::for_machine(&machine));
        Some(Box::new(SlidingWindow::new(program, framing, options.window)))
    }

    fn status(&self) -> Option<Box<dyn StatusProtocol>> {
        Some(Box::new(framing::TickLineStatus))
    }

    fn homing(&self, machine: &Machine) -> Option<HomingSteps> {
        let homing = machine.parts().homing.as_ref()?;
        (!homing.moves().is_empty()).then(|| framing::homing(homing.needs_stop()))
    }

    fn knows_datum(&self) -> bool {
        true
    }

    fn emulator(&self, options: &EmulatorOptions) -> Option<Box<dyn Device>> {
        Some(Box::new(emulator::TickLineReader::new(options)))
    }
}

impl Backend for Raw {
    fn name(&self) -> &'static str {
        "raw"
    }

    fn protocol(&self) -> Option<(&'static str, &'static str)> {
        Some((self.name(), "Lines as they are, paced by the port's flow control"))
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Sent
    }

    fn program(&self, plan: &PlanSource<'_>, _options: &EncodeOptions) -> Result<Program, ProgramError> {
        program(plan)
    }

    fn parse_program(&self, file: &[u8]) -> Option<Program> {
        let text = String::from_utf8_lossy(file);
        Some(Program::opaque(&text))
    }

    fn session(&self, program: Program, _options: &SessionOptions) -> Option<Box<dyn Session>> {
        let line_end = if program.table().is_some() { "\n" } else { "" };
        Some(Box::new(OpenLoop::new(program, line_end, None)))
    }
}

impl Backend for Paced {
    fn name(&self) -> &'static str {
        "paced"
    }

    fn protocol(&self) -> Option<(&'static str, &'static str)> {
        Some((self.name(), "Tick lines at their time, without answers or flow control"))
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Sent
    }

    fn program(&self, plan: &PlanSource<'_>, _options: &EncodeOptions) -> Result<Program, ProgramError> {
        program(plan)
    }

    fn session(&self, program: Program, options: &SessionOptions) -> Option<Box<dyn Session>> {
        Some(Box::new(OpenLoop::new(program, "\n", Some(options.lead_us))))
    }

    fn lead_us(&self, wanted_us: u64) -> u64 {
        wanted_us
    }
}

/// Rows as tick lines without comments, as [`tick_lines`] writes them.
#[derive(Clone, Copy, Debug)]
struct TickLineEncoder;

impl RowEncoder for TickLineEncoder {
    fn lines(
        &self,
        table: &TickTable,
        _start: [i64; 2],
        _resumed: bool,
    ) -> Result<Vec<Line>, Unrepresentable> {
        let mut bytes = Vec::new();
        tick_lines::write(&table.header, table.rows.iter().copied(), &mut bytes)
            .map_err(|error| invalid(&error))?;
        let text = String::from_utf8_lossy(&bytes);
        let mut row = 0;
        let mut lines = Vec::new();
        for text in text.lines().filter(|line| !line.starts_with(';')) {
            let mut line = Line { text: text.to_owned(), row: row as u64, ..Line::default() };
            if text.starts_with("m ") {
                row += 1;
                line.row = row as u64;
                line.duration_us = table.rows[row].t_us - table.rows[row - 1].t_us;
                line.position = Some(table.rows[row].ticks);
            }
            lines.push(line);
        }
        Ok(lines)
    }

    fn lift(&self, done: &[Line]) -> Vec<Line> {
        if done.last().is_some_and(|line| line.text.starts_with("end ")) {
            return Vec::new();
        }
        let moved = done.iter().rev().find(|line| line.position.is_some());
        let lift = moved.filter(|line| !line.text.starts_with("m 0 ")).and_then(|line| {
            let position = line.position?;
            let text = format!("m 0 {LIFT_US} {} {}", position[0], position[1]);
            Some(Line { text, duration_us: LIFT_US, position: Some(position), ..Line::default() })
        });
        lift.into_iter().collect()
    }
}
