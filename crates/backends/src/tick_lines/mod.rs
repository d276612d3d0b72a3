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

/// The lines as they are.
fn program(plan: &PlanSource<'_>) -> Result<Program, ProgramError> {
    Program::of_table(plan.table(), Arc::new(TickLineEncoder { checks_end: false }))
}

/// With a check of the end, which a reader that answers can report.
fn checked_program(plan: &PlanSource<'_>) -> Result<Program, ProgramError> {
    Program::of_table(plan.table(), Arc::new(TickLineEncoder { checks_end: true }))
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
        checked_program(plan)
    }

    fn pen_program(
        &self,
        plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        _down: bool,
    ) -> Result<Program, ProgramError> {
        // The rows have the pen.
        checked_program(plan)
    }

    fn continuing_program(
        &self,
        plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        start: [i64; 2],
    ) -> Result<Program, ProgramError> {
        Program::continuing(plan.table(), Arc::new(TickLineEncoder { checks_end: true }), start)
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
struct TickLineEncoder {
    /// Whether a sync line with the plan's last position comes before `end`, which has none: a last row that was damaged
    /// without a wrong checksum is reported.
    checks_end: bool,
}

/// `s MOVES DURATION T1 T2` for `end 0 MOVES DURATION`, after the line `before`; `None` if that is a sync line, or if the
/// pen stays down.
fn end_check(end: &str, before: &Line) -> Option<Line> {
    let counts = end.strip_prefix("end 0 ")?;
    let [a, b] = before.position?;
    Some(Line { text: format!("s {counts} {a} {b}"), row: before.row, ..Line::default() })
}

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
            } else if self.checks_end {
                lines.extend(lines.last().and_then(|before| end_check(text, before)));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::Outcome;

    const PLAN: &str = "; plotplan: 1\n; machine: coaxial\n; motors: arm1 arm2\n; limits arm1 speed: 533.3\n\
        ; limits arm1 acceleration: 2666.7\n; limits arm2 speed: 533.3\n; limits arm2 acceleration: 2666.7\n\
        ; placement a b: 1 0\n; placement c d: 0 1\n; placement e f: 0 0\n; period_us: 10000\n\
        begin 1 2 20000\ns 0 0 800 0\nm 0 10000 801 -1\nm 0 10000 803 -4\nend 0 2 20000\n";

    fn program(checks_end: bool) -> Program {
        let plan = tick_lines::read(PLAN.as_bytes()).unwrap();
        Program::of_table(plan, Arc::new(TickLineEncoder { checks_end })).unwrap()
    }

    #[test]
    fn sync_line_before_the_end_has_the_last_position() {
        let lines = |checks_end| -> Vec<String> {
            program(checks_end).lines.into_iter().skip(3).map(|line| line.text).collect()
        };
        assert_eq!(lines(true), ["m 0 10000 803 -4", "s 2 20000 803 -4", "end 0 2 20000"]);
        assert_eq!(lines(false), ["m 0 10000 803 -4", "end 0 2 20000"]);
    }

    /// Sends the plan over a wire that replaces `from` by `to`.
    fn outcome(from: &str, to: &str, checks_end: bool) -> Outcome {
        let framing = Box::new(framing::TickLineFraming::for_machine("coaxial"));
        let mut session = SlidingWindow::new(program(checks_end), framing, None);
        let mut reader = emulator::TickLineReader::new(&EmulatorOptions::default());
        for now_us in (0..10_000_000).step_by(1000) {
            let sent = String::from_utf8(session.transmit(now_us)).unwrap();
            reader.receive(sent.replace(from, to).as_bytes(), now_us);
            reader.advance(now_us);
            for answer in reader.answers() {
                session.receive(&answer, now_us);
            }
            if let Some(outcome) = session.outcome() {
                return outcome.clone();
            }
        }
        panic!("the session does not end");
    }

    #[test]
    fn damaged_last_row_is_reported() {
        // The same bit in two bytes of the last row: the checksum is right.
        let (sound, damaged) = ("10000 803 -4*", "10000 802 -5*");
        assert_eq!(framing::framed("803 -4")[6..], framing::framed("802 -5")[6..]);
        assert!(matches!(outcome(sound, sound, true), Outcome::Done));
        let Outcome::Failed { why, .. } = outcome(sound, damaged, true) else {
            panic!("it was not reported")
        };
        assert!(why.contains("the motors are not there"), "{why}");
        assert!(matches!(outcome(sound, damaged, false), Outcome::Done));
    }
}
