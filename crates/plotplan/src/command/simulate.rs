//! `plotplan simulate`: predicted ink of a plan, or the step response of a motor.

use std::io::Write;
use std::path::Path;

use anyhow::Context as _;
use compiler::machine_file::MachineFile;
use compiler::report::simulation::{SimulationReport, StepReport};
use compiler::report::{Code, ErrorReport};
use compiler::view::{Prediction, View};
use compiler::{layout, replay, scene, simulate};
use drawing::{Affine, Drawing, Point};
use kinematics::{Machine, MotorPos};
use plan::{Header, Row};
use simulation::{Drive, Sample, SetpointKind, StepResponse};
use verify::Mismatch;

use super::page::{self, Planned};
use crate::cli::{Setpoints, Simulate};
use crate::failure::Failure;
use crate::input::{self, Input, Inputs};
use crate::machines::{self, LoadedMachine};
use crate::{output, session, terminal};

/// A picture's longer side, pixels.
const PIXELS: u32 = 1600;
/// Chords of a plan's own ink deviate by at most this, mm.
const OWN_INK_MM: f64 = 0.001;

/// A plan in memory with its machine and drawing.
pub(super) struct LoadedPlan {
    pub(super) file: MachineFile,
    pub(super) machine: Machine,
    pub(super) rows: Vec<Row>,
    pub(super) period_us: u64,
    /// Machine mm, in the order drawn.
    pub(super) drawing: Drawing,
    pub(super) name: String,
    /// The plan's header.
    header: Header,
    /// Where the plan was made here: its drawing and exact positions.
    planned: Option<(Inputs, Planned)>,
}

impl LoadedPlan {
    pub(super) fn plan(&self) -> simulate::Plan<'_> {
        simulate::Plan {
            machine: &self.machine,
            rows: &self.rows,
            period_us: self.period_us,
            drawing: &self.drawing,
        }
    }

    /// The view of the plan, without a prediction.
    fn view(&self) -> View<'_> {
        match &self.planned {
            Some((inputs, planned)) => planned.view(inputs, &self.machine, &self.rows, &self.drawing),
            None => page::of_rows(&self.name, &self.machine, &self.header, &self.rows),
        }
    }
}

pub(crate) fn run(arguments: &Simulate) -> Result<(), Failure> {
    let kind = kind_of_output(arguments)?;
    if let Some(step) = arguments.step {
        return step_response(arguments, step, kind.as_deref());
    }
    let loaded = load(arguments)?;
    let mut drive = drive(&loaded.file, &loaded.machine)?;
    match arguments.setpoints {
        None => {}
        Some(Setpoints::Vertices) => drive.setpoints = SetpointKind::Vertices,
        Some(Setpoints::Held) => drive.setpoints = SetpointKind::Held,
        Some(Setpoints::Interpolated) => drive.setpoints = SetpointKind::Interpolated,
    }
    let mut samples = Vec::new();
    let keeps = matches!(kind.as_deref(), Some("csv" | "html"));
    let simulated = simulate::simulate(&loaded.plan(), &drive, |sample| {
        if keeps {
            samples.push(*sample);
        }
    })
    .with_context(|| format!("{} cannot be simulated", loaded.name))
    .map_err(Failure::Drawing)?;
    let report = SimulationReport::of(&loaded.machine, &drive, &simulated, arguments.within);
    if let (Some(kind), Some(to)) = (kind.as_deref(), &arguments.output) {
        if kind == "csv" {
            output::write(to, |out| motion(out, &loaded.machine, &samples))?;
        } else if kind == "html" {
            let prediction = Prediction::of(&report, &samples);
            let view = View { prediction: Some(prediction), ..loaded.view() };
            page::write(to, &view.html())?;
        } else {
            let title = format!("{} on {}: predicted ink", loaded.name, loaded.machine.name());
            let scene = scene::of_ink(&title, simulated.lines, &loaded.drawing, &loaded.machine);
            write_picture(to, kind, &scene)?;
        }
    }
    for motor in report.motors.iter().filter(|motor| motor.stable == Some(false)) {
        terminal::warning(Code::UnstableLoop, &format!("the loop of motor {} is unstable", motor.name));
    }
    let text = report.text();
    let (holds, ink) = (report.holds, report.ink.clone());
    session::report(|all| {
        all.ink = Some(ink);
        all.simulation = Some(report);
    });
    output::report(&text)?;
    if !holds {
        // The text names the distances; there is no need for another message.
        session::failed(ErrorReport {
            code: Code::InkError,
            message: "predicted ink is further from the drawing than --within".to_owned(),
            help: None,
            place: None,
        });
        return Err(Failure::Refused);
    }
    input::refuse_warnings(arguments.reading.strict)
}

/// The extension of the output, if there is one.
fn kind_of_output(arguments: &Simulate) -> Result<Option<String>, Failure> {
    let Some(to) = &arguments.output else { return Ok(None) };
    let kind = Path::new(to).extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let known: &[&str] =
        if arguments.step.is_some() { &["svg", "csv"] } else { &["svg", "png", "csv", "html"] };
    match kind {
        Some(kind) if known.contains(&kind.as_str()) => Ok(Some(kind)),
        _ => {
            let names: Vec<String> = known.iter().map(|kind| format!("NAME.{kind}")).collect();
            Err(Failure::Usage(anyhow::anyhow!("{to}: an output is {}", names.join(" or "))))
        }
    }
}

/// The drive of a machine.
pub(super) fn drive(file: &MachineFile, machine: &Machine) -> Result<Drive, Failure> {
    let drive = file.drive(machine).context("the drive cannot be used").map_err(Failure::Usage)?;
    drive.ok_or_else(|| {
        let what = format!(
            "machine {} has no [drive] table: motors and feedback loop are not known (docs/machine-files.md)",
            machine.name()
        );
        Failure::Usage(anyhow::anyhow!(what))
    })
}

fn load(arguments: &Simulate) -> Result<LoadedPlan, Failure> {
    let file = arguments.file.as_deref().unwrap_or("-");
    if file == "-" && arguments.drawing.iter().any(|drawing| drawing == "-") {
        return Err(Failure::Usage(anyhow::anyhow!("plan and drawing cannot both be standard input")));
    }
    let input = input::read(file)?;
    if plan::file::is_plan(&input.bytes) {
        return load_plan(arguments, &input);
    }
    if !arguments.drawing.is_empty() {
        let what = format!("--drawing has no effect: {} is a drawing itself", input.name);
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    }
    let Some(name) = &arguments.machine else {
        let what = "which machine draws it? Give --machine NAME or --machine FILE.toml";
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    };
    let loaded = machines::machine_with_paper(name, &arguments.reading)?;
    load_drawing(&Inputs::of(input), loaded, &arguments.reading, &arguments.planning)
}

/// Plans a drawing for a simulation.
pub(super) fn load_drawing(
    inputs: &Inputs,
    LoadedMachine { file, machine }: LoadedMachine,
    reading: &crate::cli::Reading,
    planning: &crate::cli::Planning,
) -> Result<LoadedPlan, Failure> {
    let drawn = input::drawings(inputs, reading)?;
    let request = super::request(planning, reading.layout.crop, drawn.page(), &machine);
    let period_us = request.period_us;
    let mut planned = page::planned(inputs, drawn.page(), &machine, request)?;
    Ok(LoadedPlan {
        file,
        rows: std::mem::take(&mut planned.rows),
        period_us,
        drawing: std::mem::take(&mut planned.drawn),
        name: inputs.name(),
        machine,
        header: planned.header.clone(),
        planned: Some((inputs.clone(), planned)),
    })
}

fn load_plan(arguments: &Simulate, input: &Input) -> Result<LoadedPlan, Failure> {
    let (plan, LoadedMachine { file, machine }) = super::verify::plan(input, arguments.machine.as_deref())?;
    let header = &plan.table.header;
    for mismatch in verify::mismatches(&machine, header) {
        if matches!(mismatch, Mismatch::Limit { .. }) {
            terminal::warning(Code::PlanMismatch, &mismatch.to_string());
        } else {
            return Err(Failure::Usage(anyhow::Error::new(mismatch).context(input.name.clone())));
        }
    }
    let drawing = if arguments.drawing.is_empty() {
        let ink = replay::Motion::of(&plan.table.rows, &machine, OWN_INK_MM).drawing();
        replay::on_carriage(ink, &machine)
    } else {
        let inputs = Inputs::read(&arguments.drawing)?;
        let mut drawing = input::drawings(&inputs, &arguments.reading)?.drawing().clone();
        drawing.transform(Affine::new(header.placement));
        let kept = layout::cropped(drawing, arguments.reading.layout.crop, machine.sheet());
        replay::on_carriage(kept, &machine)
    };
    let (name, period_us) = (input.name.clone(), header.period_us);
    let header = header.clone();
    Ok(LoadedPlan { file, machine, period_us, drawing, name, rows: plan.table.rows, header, planned: None })
}

/// Writes a picture as PNG or SVG.
pub(super) fn write_picture(to: &str, kind: &str, scene: &picture::Scene) -> Result<(), Failure> {
    if kind == "png" {
        let bytes = picture::png::encode(scene, PIXELS).map_err(|error| Failure::Drawing(error.into()))?;
        output::write(to, |out| out.write_all(&bytes))
    } else {
        output::write(to, |out| picture::scene::svg(scene, out))
    }
}

/// The motion as CSV.
fn motion(out: &mut dyn Write, machine: &Machine, samples: &[Sample]) -> std::io::Result<()> {
    let [a, b] = machine.motors().each_ref().map(|motor| &motor.name);
    writeln!(out, "t_us,pen,{a}_planned,{b}_planned,{a},{b},{a}_command,{b}_command,x_mm,y_mm")?;
    for sample in samples {
        let [p, q] = sample.planned;
        let [x, y] = sample.ticks;
        let [u, v] = sample.commands;
        let at: Point = machine.forward_from_motors(&MotorPos(sample.ticks));
        writeln!(
            out,
            "{},{},{p:.3},{q:.3},{x:.3},{y:.3},{u:.4},{v:.4},{:.4},{:.4}",
            sample.t_us, sample.pen, at.x, at.y
        )?;
    }
    Ok(())
}

fn step_response(arguments: &Simulate, step: f64, kind: Option<&str>) -> Result<(), Failure> {
    let LoadedMachine { file, machine } = match (&arguments.file, &arguments.machine) {
        (None, Some(name)) => machines::machine(name)?,
        (None, None) => {
            return Err(Failure::Usage(anyhow::anyhow!(
                "--step needs --machine NAME or --machine FILE.toml"
            )));
        }
        (Some(file), machine) => super::verify::plan(&input::read(file)?, machine.as_deref())?.1,
    };
    let drive = drive(&file, &machine)?;
    let motors = machine.motors();
    let index = match &arguments.motor {
        None => 0,
        Some(name) => motors.iter().position(|motor| motor.name == *name).ok_or_else(|| {
            let what = format!(
                "--motor: there is no motor {name}; {} has {} and {}",
                machine.name(),
                motors[0].name,
                motors[1].name
            );
            Failure::Usage(anyhow::anyhow!(what))
        })?,
    };
    if !(drive.period_s..=600.0).contains(&arguments.duration) {
        let what = "--duration must be from the period of the loop to 600 s";
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    }
    let response = simulation::step_response(&drive, index, step, arguments.duration);
    if let (Some(kind), Some(to)) = (kind, &arguments.output) {
        output::write(to, |out| match kind {
            "csv" => step_csv(out, &response),
            _ => simulate::step_svg(&response, step, out),
        })?;
    }
    let report = StepReport::of(&motors[index].name, step, &response);
    let text = report.text();
    session::report(|all| all.step = Some(report));
    output::report(&text)
}

/// A step response as `tune --from-step` reads it.
fn step_csv(out: &mut dyn Write, response: &StepResponse) -> std::io::Result<()> {
    writeln!(out, "time_s,position_ticks,duty_percent")?;
    for point in &response.points {
        writeln!(out, "{:.4},{},{:.4}", point.t_s, point.position, point.command)?;
    }
    Ok(())
}
