//! HP pen plotters and their relatives: machines whose own language is HP-GL.
//!
//! A target on the level of the drawing: [`encode`] writes it in the instructions, limits and units of one
//! plotter ([`plotter`], a data file each). The plotter plans its motion itself. The same program is sent by
//! a session that asks for the room in the buffer (`session`), and `emulator` is an HP 7475A.

mod check;
mod emulator;
mod encode;
pub mod plotter;
mod program;
mod query;
mod session;
mod state;

use std::sync::Arc;

pub use encode::{PlotterLimit, encode};
use plotter::Handshake;

use crate::backend::{
    Backend, EmulatorOptions, EncodeOptions, InkFrame, PenNumbers, PlanSource, SessionOptions,
};
use crate::device::Device;
use crate::error::Unrepresentable;
use crate::program::{Program, ProgramError};
use crate::session::Session;
use crate::transmission::open_loop::OpenLoop;

/// Nominal size of a plotter unit, mm: plans are drawn with it.
const UNIT_MM: f64 = 0.025;

/// HP-GL to a plotter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HpGlPlotter;

impl Backend for HpGlPlotter {
    fn name(&self) -> &'static str {
        "hpgl"
    }

    fn protocol(&self) -> Option<(&'static str, &'static str)> {
        Some(("hpgl", "HP-GL to an HP pen plotter or a relative of it"))
    }

    fn emulator_help(&self) -> Option<&'static str> {
        Some("An HP 7475A with A4 paper and its buffer of 1024 bytes")
    }

    fn row_name(&self) -> &'static str {
        "stroke"
    }

    fn homes_itself(&self) -> bool {
        true
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Sent
    }

    fn needs_machine(&self) -> bool {
        true
    }

    fn program(&self, plan: &PlanSource<'_>, _options: &EncodeOptions) -> Result<Program, ProgramError> {
        let speed_mm_s = plan.machine(self.name())?.pen().max_speed_mm_s;
        let lines = program::of_plan(plan.setpoints(self.name())?, UNIT_MM, speed_mm_s);
        if let Some(line) = lines.iter().find(|line| line.position.is_some_and(is_beyond_16_bits)) {
            let [x, y] = line.position.unwrap_or_default().map(|units| units as f64 * UNIT_MM);
            let range = "coordinates up to 819 mm";
            return Err(Unrepresentable::Range { row: line.row, x, y, format: self.name(), range }.into());
        }
        Ok(Program::of_lines(lines, Arc::new(program::HpGl)))
    }

    fn parse_program(&self, file: &[u8]) -> Option<Program> {
        let lines = program::parse(file);
        Some(Program::of_lines(lines, Arc::new(program::HpGl)))
    }

    fn fault(&self, program: &Program, options: &SessionOptions) -> Option<String> {
        check::instruction_fault(program, options.plotter.as_deref()?)
    }

    fn session(&self, program: Program, options: &SessionOptions) -> Option<Box<dyn Session>> {
        let plotter = options.plotter.as_deref();
        if plotter.is_some_and(|plotter| !plotter.has(Handshake::Polling)) {
            return Some(Box::new(OpenLoop::new(program, "", None)));
        }
        Some(Box::new(session::PlotterSession::new(program, plotter, options.handshake)))
    }

    fn emulator(&self, _options: &EmulatorOptions) -> Option<Box<dyn Device>> {
        Some(Box::new(emulator::Emulator::new()))
    }

    fn ink_frame(&self) -> InkFrame {
        InkFrame::PlotterUnits
    }
}

fn is_beyond_16_bits(position: [i64; 2]) -> bool {
    position.iter().any(|units| units.abs() > 32_767)
}
