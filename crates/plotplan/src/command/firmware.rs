//! The formats of firmwares: what each can carry of a plan, and what is lost is said.

use backends::{Instant, WriteError, ebb, gcode};
use compiler::pipeline::Compiled;
use drawing::{Pen, Point};
use kinematics::{JointKind, Machine, MotorPos};
use planner::ExactRow;

use crate::cli::{Convert, Format, PenBy, PenLift};
use crate::failure::Failure;
use crate::{input, output, terminal};

/// Chords of curves that G-code has no word for stay so close to them, mm.
const CHORD_MM: f64 = 0.01;

/// Whether this module writes the format.
pub(crate) fn is_for(format: Format) -> bool {
    !matches!(format, Format::Ticks | Format::Csv | Format::Json | Format::Hpgl | Format::Svg)
}

/// Writes the plan in a firmware's format, and says what that cannot carry.
pub(crate) fn write(arguments: &Convert, machine: &Machine, compiled: &Compiled<'_>) -> Result<(), Failure> {
    let format = arguments.format;
    suits(format, machine)?;
    let losses = losses(format, compiled);
    for loss in &losses {
        terminal::warning(loss);
    }
    if arguments.reading.strict && !losses.is_empty() {
        terminal::error(input::STRICT);
        return Err(Failure::Refused);
    }
    // Once to nowhere: what does not fit into the format shows before anything is written.
    put(arguments, machine, compiled, &mut std::io::sink()).map_err(|error| match error {
        WriteError::Io(error) => Failure::writing(error, &arguments.output),
        other => Failure::Drawing(anyhow::Error::new(other).context("this format cannot say this plan")),
    })?;
    output::write(&arguments.output, |out| {
        put(arguments, machine, compiled, out).map_err(|error| match error {
            WriteError::Io(error) => error,
            other => std::io::Error::other(other),
        })
    })
}

/// The instants of a plan: rows with what firmware formats want to know beside them.
pub(crate) fn instant(machine: &Machine, row: plan::Row, exact: [f64; 2]) -> Instant {
    let joints = machine.joint_positions(&MotorPos::from(exact));
    Instant { row, exact, joints: joints.into(), at: machine.mechanism().forward(&joints) }
}

fn put(
    arguments: &Convert,
    machine: &Machine,
    compiled: &Compiled<'_>,
    out: &mut dyn std::io::Write,
) -> Result<(), WriteError> {
    let rows = || compiled.trajectory.rows().map(|row| row.row);
    let instants = || compiled.trajectory.rows().map(|ExactRow { row, exact }| instant(machine, row, exact));
    let names = machine.motors().each_ref().map(|motor| motor.name.as_str());
    match arguments.format {
        Format::CoaxialCommands => backends::coaxial_commands::write(instants(), out),
        Format::CoaxialCommandsInches => {
            let sheet = machine.sheet();
            backends::coaxial_commands::write_inches(instants(), Point::new(sheet.x0, sheet.y1), out)
        }
        Format::XySerial => backends::xy_serial::write(instants(), out),
        Format::PolarCsv => backends::polar_csv::write(instants(), out),
        Format::CArrays => backends::c_arrays::write(instants(), out),
        Format::Ebb => ebb::write(rows(), ebb::Moves::Timed, ebb_pen(arguments.pen), out),
        Format::EbbSm => ebb::write(rows(), ebb::Moves::Stepper, ebb_pen(arguments.pen), out),
        Format::GcodeTimed => {
            let options = gcode_options(gcode::Flavour::Grbl, machine, arguments.pen);
            gcode::write(&gcode::timed(instants(), &options, true), out)
        }
        Format::KlipperSteps => backends::klipper_steps::write(rows(), out),
        Format::JointTrajectory => {
            let instants: Vec<Instant> = instants().collect();
            let geometry = machine.mechanism();
            backends::joint_trajectory::write(
                &instants,
                geometry.joint_names(),
                geometry.joint_kinds().map(|kind| kind == JointKind::Revolute),
                out,
            )
        }
        Format::Halstreamer => backends::halstreamer::write(instants(), compiled.header.period_us, out),
        Format::Pvt => backends::pvt::write(&instants().collect::<Vec<_>>(), names, out),
        other => {
            let options = gcode_options(flavour(other), machine, arguments.pen);
            let speeds = stroke_speeds(machine, compiled);
            let park = machine.mechanism().forward(&machine.start());
            gcode::write(&gcode::commands(compiled.ordered(), &speeds, park, &options), out)
        }
    }
}

fn flavour(format: Format) -> gcode::Flavour {
    match format {
        Format::GcodeFluidnc => gcode::Flavour::FluidNc,
        Format::GcodeMarlin => gcode::Flavour::Marlin,
        Format::GcodeKlipper => gcode::Flavour::Klipper,
        _ => gcode::Flavour::Grbl,
    }
}

/// How the EiBotBoard is told to move the pen.
pub(crate) fn ebb_pen(pen: PenLift) -> ebb::Pen {
    if pen.pen_by.is_none() && pen.pen_positions.is_none() {
        return ebb::Pen::Toggle;
    }
    // The output that the board's own pen servo hangs on, and positions in the middle of what servos take.
    let (up, down) = pen.pen_positions.unwrap_or((16_000, 12_000));
    ebb::Pen::Servo { up: up.max(0) as u16, down: down.max(0) as u16, pin: 4 }
}

/// How G-code is said on this machine.
pub(crate) fn gcode_options(flavour: gcode::Flavour, machine: &Machine, pen: PenLift) -> gcode::Options {
    let lift = machine.pen();
    let by = if pen.pen_by == Some(PenBy::Z) {
        let (up, down) = pen.pen_positions.unwrap_or((5, 0));
        gcode::Pen::Z { up, down }
    } else {
        let (up, down) = pen.pen_positions.unwrap_or((40, 90));
        gcode::Pen::Servo { up: up.max(0) as u16, down: down.max(0) as u16 }
    };
    gcode::Options {
        flavour,
        pen: by,
        pen_s: [lift.lift_time_s, lift.drop_time_s],
        travel_mm_s: lift.max_speed_mm_s,
        chord_mm: CHORD_MM,
    }
}

/// The mean speed of each stroke in the plan, mm/s: its length over the time that the pen is down and moves.
fn stroke_speeds(machine: &Machine, compiled: &Compiled<'_>) -> Vec<f64> {
    let mut times: Vec<u64> = Vec::new();
    let mut before: Option<plan::Row> = None;
    let mut pen = 0;
    for ExactRow { row, .. } in compiled.trajectory.rows() {
        if let Some(last) = before
            && last.pen != 0
        {
            if last.pen != pen {
                times.push(0);
            }
            if let Some(time) = times.last_mut().filter(|_| last.ticks != row.ticks) {
                *time += row.t_us - last.t_us;
            }
        }
        pen = before.map_or(0, |last| last.pen);
        before = Some(row);
    }
    let most = machine.pen().max_speed_mm_s;
    let strokes = compiled.ordered().strokes.iter().enumerate();
    strokes
        .map(|(index, stroke)| {
            let seconds = times.get(index).map_or(0.0, |us| *us as f64 * 1e-6);
            if seconds > 0.0 { (stroke.length() / seconds).clamp(0.1, most) } else { most }
        })
        .collect()
}

/// Whether the format is one for machines of this shape.
fn suits(format: Format, machine: &Machine) -> Result<(), Failure> {
    let kind = machine.mechanism().kind();
    let coupling = machine.coupling().rows();
    let is = |rows: [[f64; 2]; 2]| (0..2).all(|i| (0..2).all(|j| coupling[i][j] == rows[i][j]));
    let (holds, wants) = match format {
        Format::CoaxialCommands | Format::CoaxialCommandsInches => {
            (kind == "two-link", "an arm with two links, such as coaxial")
        }
        Format::XySerial => {
            (kind == "cartesian" && is([[1.0, 1.0], [-1.0, 1.0]]), "a single-belt table such as hbot")
        }
        Format::PolarCsv | Format::CArrays => (kind == "polar", "a turning rail with a rack, such as polar"),
        _ => (true, ""),
    };
    if holds {
        return Ok(());
    }
    let what = format!("this format is for {wants}; {} is something else", machine.name());
    Err(Failure::Drawing(anyhow::anyhow!(what)))
}

/// What the format cannot carry of this plan, in sentences.
fn losses(format: Format, compiled: &Compiled<'_>) -> Vec<String> {
    let mut losses = Vec::new();
    let pens = compiled.ordered().pens();
    let pauses = matches!(
        format,
        Format::GcodeGrbl
            | Format::GcodeFluidnc
            | Format::GcodeMarlin
            | Format::GcodeKlipper
            | Format::GcodeTimed
    );
    let names_pens = matches!(format, Format::Pvt | Format::CoaxialCommands | Format::CoaxialCommandsInches);
    if pens.len() > 1 && !names_pens {
        let numbers: Vec<String> = pens.iter().map(|Pen(number)| number.to_string()).collect();
        let what = if pauses {
            "this format pauses where the pen is to be changed"
        } else {
            "this format knows no pens, all strokes are drawn with the same one"
        };
        losses.push(format!("the drawing has pens {}: {what}", numbers.join(", ")));
    }
    let period_us = compiled.header.period_us;
    if format == Format::Halstreamer && period_us != 1000 {
        losses.push(format!(
            "a line is one period of the streamer's thread, here {period_us} us; --period 1ms suits the usual servo thread"
        ));
    }
    if matches!(format, Format::Ebb | Format::EbbSm) && period_us < 4000 {
        losses.push(format!(
            "the board takes a command every 4 ms at the best, and rows are {period_us} us apart; plan with a longer --period"
        ));
    }
    losses
}
