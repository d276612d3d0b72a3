//! G-code for grbl, grblHAL, FluidNC, Marlin and Klipper, which do the kinematics themselves; sessions with grbl and its
//! kin; an emulated grbl.

mod emulator;
mod encode;
mod grbl_feeds;
mod grbl_time;
mod homing;
mod program;
mod status;
mod summary;

use std::io::Write;

use kinematics::Machine;

use crate::backend::{
    Backend, EmulatorOptions, EncodeOptions, InkFrame, Loss, PenActuator, PenNumbers, PlanSource,
    SessionOptions,
};
use crate::device::Device;
use crate::homing::HomingSteps;
use crate::program::{Program, ProgramError};
use crate::session::Session;
use crate::status::StatusProtocol;
use crate::transmission::character_counting::CharacterCounting;
use crate::{Line, WriteError};

pub(crate) use encode::Flavour;
pub use grbl_time::{GrblSettings, duration_s as grbl_duration_s};
pub use summary::{GcodeSummary, is_ours, summary};

/// Chords of curves that G-code cannot express deviate by no more than this, mm.
const CHORD_MM: f64 = 0.01;
/// grbl's receive buffer, less one byte.
const WINDOW_BYTES: usize = 127;

/// Micrometres as millimetres.
fn millimetres(micrometres: i64) -> String {
    let sign = if micrometres < 0 { "-" } else { "" };
    let size = micrometres.unsigned_abs();
    format!("{sign}{}.{:03}", size / 1000, size % 1000)
}

/// How G-code is written for the plan's machine.
fn options(
    flavour: Flavour,
    format: &'static str,
    plan: &PlanSource<'_>,
    options: EncodeOptions,
) -> Result<encode::Options, crate::Unrepresentable> {
    let machine = plan.machine(format)?;
    let lift = machine.pen();
    let pen = if options.pen_actuator == Some(PenActuator::Z) {
        let (up, down) = options.pen_positions.unwrap_or((5.0, 0.0));
        encode::Pen::Z { up, down }
    } else if let (Some(servo), None) = (machine.parts().pen_servo, options.pen_positions) {
        encode::Pen::Pulses(servo)
    } else {
        let (up, down) = options.pen_positions.unwrap_or((40.0, 90.0));
        encode::Pen::Servo { up: up.max(0.0) as u16, down: down.max(0.0) as u16 }
    };
    Ok(encode::Options {
        flavour,
        pen,
        pen_s: [lift.lift_time_s, lift.drop_time_s],
        // Without a travel speed of its own the pen travels as fast as the motors can, which is at least the drawing speed.
        travel_mm_s: if lift.max_travel_speed_mm_s.is_finite() {
            lift.max_travel_speed_mm_s
        } else {
            lift.max_speed_mm_s
        },
        travel_limit_mm_s: lift.max_travel_speed_mm_s,
        chord_mm: CHORD_MM,
    })
}

/// Lines and arcs of the drawing, with the mean speed of each stroke; the firmware plans accelerations.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Paths(pub(crate) Flavour);

impl Paths {
    /// Feeds with which grbl keeps to the plan; `None` for other firmwares, whose planners are not modelled.
    fn feeds(
        self,
        plan: &PlanSource<'_>,
        encode: EncodeOptions,
    ) -> Result<Option<grbl_feeds::Feeds>, crate::Unrepresentable> {
        if self.0 != Flavour::Grbl {
            return Ok(None);
        }
        let options = options(self.0, self.name(), plan, encode)?;
        let (machine, drawing) = (plan.machine(self.name())?, plan.drawing(self.name())?);
        let times_s = encode::stroke_times_s(drawing.strokes.len(), plan.rows());
        let park = machine.mechanism().forward(&machine.start());
        let plan_s = plan.header().duration_us as f64 * 1e-6;
        let job = grbl_feeds::Job {
            machine,
            drawing,
            times_s: &times_s,
            park,
            options: &options,
            spare_mm: encode.spare_mm,
            plan_s,
        };
        // The machine is known: `machine` is above.
        Ok(Some(grbl_feeds::find(&job, || plan.setpoints(self.name()).into_iter().flatten())))
    }
}

impl Backend for Paths {
    fn name(&self) -> &'static str {
        match self.0 {
            Flavour::Grbl => "gcode-grbl",
            Flavour::FluidNc => "gcode-fluidnc",
            Flavour::Marlin => "gcode-marlin",
            Flavour::Klipper => "gcode-klipper",
        }
    }

    fn format_help(&self) -> Option<&'static str> {
        Some(match self.0 {
            Flavour::Grbl => "G-code for grbl, with arcs",
            Flavour::FluidNc => "G-code for FluidNC, with arcs",
            Flavour::Marlin => "G-code for Marlin, with arcs",
            Flavour::Klipper => "G-code for Klipper, with arcs",
        })
    }

    fn protocol(&self) -> Option<(&'static str, &'static str)> {
        (self.0 == Flavour::Grbl).then_some(("gcode", "G-code for grbl, grblHAL and FluidNC"))
    }

    fn emulator_help(&self) -> Option<&'static str> {
        (self.0 == Flavour::Grbl).then_some("A grbl with its buffer of 128 bytes")
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Pause
    }

    fn file_caveat(&self, machine: &Machine) -> Option<Loss> {
        machine.has_backlash().then(|| {
            Loss::Caveat(format!(
                "the firmware plans the motion along these paths, so the backlash of the machine file is not \
                 compensated; gcode-timed and `send --protocol gcode` are{}",
                if self.0 == Flavour::Marlin { ", and Marlin has its own compensation (M425)" } else { "" }
            ))
        })
    }

    fn needs_machine(&self) -> bool {
        true
    }

    fn write(
        &self,
        plan: &PlanSource<'_>,
        encode: &EncodeOptions,
        out: &mut dyn Write,
    ) -> Result<(), WriteError> {
        let options = options(self.0, self.name(), plan, *encode)?;
        let (machine, drawing) = (plan.machine(self.name())?, plan.drawing(self.name())?);
        let park = machine.mechanism().forward(&machine.start());
        let feeds = self.feeds(plan, *encode)?;
        let mut lines = homing::lines(self.0, machine);
        if let Some(feeds) = feeds {
            writeln!(out, "; {}", feeds.times_line())?;
            for settings in feeds.settings() {
                writeln!(out, "; {settings}")?;
            }
            if let Some(chords) = feeds.chords_line() {
                writeln!(out, "; {chords}")?;
            }
            let routes = feeds.routes();
            lines.extend(encode::paths(drawing, &routes, &feeds.speeds_mm_s, park, &options, true));
        } else {
            let times_s = encode::stroke_times_s(drawing.strokes.len(), plan.rows());
            let speeds_mm_s = encode::stroke_speeds_mm_s(drawing, &times_s, machine.pen().max_speed_mm_s);
            let routes = vec![encode::Route::Drawn; drawing.strokes.len()];
            lines.extend(encode::paths(drawing, &routes, &speeds_mm_s, park, &options, true));
        }
        encode::write(&lines, out)
    }

    fn remarks(&self, plan: &PlanSource<'_>, encode: &EncodeOptions) -> Vec<String> {
        let Ok(Some(feeds)) = self.feeds(plan, *encode) else { return Vec::new() };
        let settings = format!("with these settings: {}", feeds.settings().join(" "));
        [Some(feeds.times_line()), Some(settings), feeds.chords_line()].into_iter().flatten().collect()
    }

    fn program(&self, plan: &PlanSource<'_>, encode: &EncodeOptions) -> Result<Program, ProgramError> {
        let options = options(self.0, self.name(), plan, *encode)?;
        Ok(program::program(encode::timed(plan.setpoints(self.name())?, &options, false)))
    }

    fn pen_program(
        &self,
        plan: &PlanSource<'_>,
        encode: &EncodeOptions,
        down: bool,
    ) -> Result<Program, ProgramError> {
        let options = options(self.0, self.name(), plan, *encode)?;
        let lines = encode::pen(&options, down);
        Ok(program::pen_only(lines, &encode::pen(&options, false)))
    }

    fn continuing_program(
        &self,
        plan: &PlanSource<'_>,
        encode: &EncodeOptions,
        _start: [i64; 2],
    ) -> Result<Program, ProgramError> {
        let options = options(self.0, self.name(), plan, *encode)?;
        let lines = encode::continued(plan.setpoints(self.name())?, &options);
        Ok(program::continuing(lines, &encode::pen(&options, false)))
    }

    fn parse_program(&self, file: &[u8]) -> Option<Program> {
        let text = String::from_utf8_lossy(file);
        Some(program::parse(&text))
    }

    fn session(&self, program: Program, options: &SessionOptions) -> Option<Box<dyn Session>> {
        let window = options.window.unwrap_or(WINDOW_BYTES);
        Some(Box::new(CharacterCounting::new(program, self.status()?, window)))
    }

    fn status(&self) -> Option<Box<dyn StatusProtocol>> {
        Some(Box::new(status::GrblStatus::default()))
    }

    fn homing(&self, machine: &Machine) -> Option<HomingSteps> {
        homing::steps(machine)
    }

    fn knows_datum(&self) -> bool {
        true
    }

    fn emulator(&self, options: &EmulatorOptions) -> Option<Box<dyn Device>> {
        (self.0 == Flavour::Grbl).then(|| Box::new(emulator::Grbl::new(options)) as Box<dyn Device>)
    }

    fn ink_frame(&self) -> InkFrame {
        InkFrame::Millimetres(3)
    }
}

/// Each row of the plan with its duration (`G93`).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Timed;

impl Backend for Timed {
    fn name(&self) -> &'static str {
        "gcode-timed"
    }

    fn format_help(&self) -> Option<&'static str> {
        Some("G-code of the plan's rows with their times (G93), for grbl, FluidNC and LinuxCNC")
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Pause
    }

    fn needs_machine(&self) -> bool {
        true
    }

    fn write(
        &self,
        plan: &PlanSource<'_>,
        encode: &EncodeOptions,
        out: &mut dyn Write,
    ) -> Result<(), WriteError> {
        let options = options(Flavour::Grbl, self.name(), plan, *encode)?;
        let mut lines: Vec<Line> = homing::lines(Flavour::Grbl, plan.machine(self.name())?);
        lines.extend(encode::timed(plan.setpoints(self.name())?, &options, true));
        encode::write(&lines, out)
    }
}
