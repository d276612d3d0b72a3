//! The EiBotBoard (EBB): `LT` and `SM` moves, its serial protocol, an emulated board.

mod emulator;
mod encode;
mod status;

use std::io::Write;
use std::sync::Arc;

use plan::{Header, TickTable};

use crate::backend::{
    Backend, EmulatorOptions, EncodeOptions, InkFrame, PenNumbers, PlanSource, SessionOptions,
};
use crate::device::Device;
use crate::program::{LineLanguage, Program, ProgramError, RowEncoder};
use crate::session::Session;
use crate::status::StatusProtocol;
use crate::transmission::character_counting::CharacterCounting;
use crate::{Line, Unrepresentable, WriteError};

/// How long the board lifts the pen when a session fails or stops, milliseconds.
const LIFT_MS: u64 = 500;
/// The board's unit of servo pulses is 1/12 us.
const UNITS_PER_US: f64 = 12.0;
/// The board executes a command every 4 ms at best.
const SHORTEST_PERIOD_US: u64 = 4000;

/// By the commands that the board's firmware knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ebb {
    /// `LT`: firmware 2.7 and later.
    Timed,
    /// `SM`: every firmware; times in whole milliseconds.
    Stepper,
}

impl Ebb {
    fn encoder(self, plan: &PlanSource<'_>, options: EncodeOptions) -> EbbEncoder {
        let moves = if self == Self::Stepper || options.legacy_moves {
            encode::Moves::Stepper
        } else {
            encode::Moves::Timed
        };
        let servo = plan.machine(self.name()).ok().and_then(|machine| machine.parts().pen_servo);
        let of_machine = servo.map(|servo| servo.pulses_us.map(|us| (us * UNITS_PER_US).round()).into());
        let positions: Option<(f64, f64)> = options.pen_positions.or(of_machine);
        let pen = if options.pen_actuator.is_none() && positions.is_none() {
            encode::Pen::Toggle
        } else {
            // The output of the board's own pen servo, and positions well inside what servos take.
            let (up, down) = positions.unwrap_or((16_000.0, 12_000.0));
            encode::Pen::Servo { up: up.max(0.0) as u16, down: down.max(0.0) as u16, pin: 4 }
        };
        EbbEncoder { moves, pen, continues: false }
    }
}

impl Backend for Ebb {
    fn name(&self) -> &'static str {
        match self {
            Self::Timed => "ebb",
            Self::Stepper => "ebb-sm",
        }
    }

    fn format_help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Timed => "EiBotBoard, firmware 2.7 and later",
            Self::Stepper => "EiBotBoard, older firmware",
        })
    }

    fn protocol(&self) -> Option<(&'static str, &'static str)> {
        (*self == Self::Timed).then_some(("ebb", "EiBotBoard"))
    }

    fn emulator_help(&self) -> Option<&'static str> {
        (*self == Self::Timed).then_some("An EiBotBoard")
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Dropped
    }

    fn caveat(&self, header: &Header) -> Option<String> {
        let period_us = header.period_us;
        (period_us < SHORTEST_PERIOD_US).then(|| {
            format!(
                "the board executes a command every 4 ms at best, and rows are {period_us} us apart; plan with a longer --period"
            )
        })
    }

    fn program(&self, plan: &PlanSource<'_>, options: &EncodeOptions) -> Result<Program, ProgramError> {
        Program::of_table(plan.table(), Arc::new(self.encoder(plan, *options)))
    }

    fn write(
        &self,
        plan: &PlanSource<'_>,
        options: &EncodeOptions,
        out: &mut dyn Write,
    ) -> Result<(), WriteError> {
        let EbbEncoder { moves, pen, .. } = self.encoder(plan, *options);
        encode::write(plan.rows(), moves, pen, out)
    }

    fn pen_program(
        &self,
        plan: &PlanSource<'_>,
        options: &EncodeOptions,
        down: bool,
    ) -> Result<Program, ProgramError> {
        let pen = self.encoder(plan, *options).pen;
        let ms = plan.header().duration_us / 1000;
        let line = Line { text: pen.line(down, ms), duration_us: ms * 1000, ..Line::default() };
        Ok(Program::of_lines(vec![line], Arc::new(PenOnly { lift: pen.line(false, LIFT_MS) })))
    }

    fn continuing_program(
        &self,
        plan: &PlanSource<'_>,
        options: &EncodeOptions,
        start: [i64; 2],
    ) -> Result<Program, ProgramError> {
        let encoder = EbbEncoder { continues: true, ..self.encoder(plan, *options) };
        Program::continuing(plan.table(), Arc::new(encoder), start)
    }

    fn session(&self, program: Program, _options: &SessionOptions) -> Option<Box<dyn Session>> {
        // The board's answers to queries cannot be told from those to lines: one line at a time.
        Some(Box::new(CharacterCounting::new(program, self.status()?, 0)))
    }

    fn status(&self) -> Option<Box<dyn StatusProtocol>> {
        Some(Box::new(status::EbbStatus::default()))
    }

    fn emulator(&self, options: &EmulatorOptions) -> Option<Box<dyn Device>> {
        Some(Box::new(emulator::Ebb::new(options.play)))
    }

    fn ink_frame(&self) -> InkFrame {
        InkFrame::TicksFromStart
    }
}

/// The line of a pen move.
#[derive(Clone, Debug)]
struct PenOnly {
    lift: String,
}

impl LineLanguage for PenOnly {
    fn lift(&self) -> Vec<String> {
        vec![self.lift.clone()]
    }

    fn resume(&self, _done: &[Line]) -> Vec<Line> {
        Vec::new()
    }
}

/// Rows as the board's lines. Its counters count from the plan's start.
#[derive(Clone, Copy, Debug)]
struct EbbEncoder {
    moves: encode::Moves,
    pen: encode::Pen,
    /// Whether the rows go on from where the board stands, with the pen as it is.
    continues: bool,
}

impl RowEncoder for EbbEncoder {
    fn lines(&self, table: &TickTable, start: [i64; 2], resumed: bool) -> Result<Vec<Line>, Unrepresentable> {
        let mut lines = encode::lines(table.rows.iter().copied(), self.moves, self.pen, self.continues)?;
        if resumed {
            // `EM` would clear the counters.
            lines.retain(|line| !line.text.starts_with("EM"));
        }
        for line in &mut lines {
            line.position = Some(self.reported_position(table.rows[line.row as usize].ticks, start));
        }
        Ok(lines)
    }

    fn lift(&self, _done: &[Line]) -> Vec<Line> {
        let text = self.pen.line(false, LIFT_MS);
        vec![Line { text, duration_us: LIFT_MS * 1000, ..Line::default() }]
    }

    fn reported_position(&self, ticks: [i64; 2], start: [i64; 2]) -> [i64; 2] {
        [0, 1].map(|motor| ticks[motor] - start[motor])
    }

    fn ticks_at(&self, position: [i64; 2], start: [i64; 2]) -> [i64; 2] {
        [0, 1].map(|motor| position[motor] + start[motor])
    }
}
