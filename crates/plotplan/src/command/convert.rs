//! `plotplan convert`: a drawing into a plan, or into a clean drawing.

use annotate_snippets::Level;
use backends::{Backend, PlanSource, RowIter, WriteError};
use compiler::import;
use compiler::pipeline::{self, Compiled, Order, Request};
use compiler::report::{CertificateReport, Summary, text};
use compiler::settings::Settings;
use drawing::{Drawing, Vec2};
use kinematics::Machine;
use planner::{ExactRow, PlacementOptions, PlanError, Scale};
use serde_json::json;

use crate::cli::{Convert, Format, ReportForm};
use crate::failure::Failure;
use crate::input::{self, Input, LoadedDrawing};
use crate::machines::{self, LoadedMachine};
use crate::output;
use crate::terminal::{self, Progress};

pub(crate) fn run(arguments: &Convert, command_line: &[String]) -> Result<(), Failure> {
    // What is wrong with the machine shows before a long read.
    let format = arguments.format().map_err(|what| Failure::Usage(anyhow::anyhow!(what)))?;
    let machine = match (format, &arguments.machine) {
        (Format::Hpgl | Format::Svg, _) => None,
        (_, Some(name)) => Some(machines::machine_with_paper(name, &arguments.reading)?),
        (_, None) => {
            let what = "which machine is the plan for? Give --machine NAME (see `plotplan machine list`) or --machine FILE.toml";
            return Err(Failure::Usage(anyhow::anyhow!(what)));
        }
    };
    let input = input::read(&arguments.file)?;
    let drawn = input::drawing(&input, &arguments.reading)?;
    if drawn.document.pages.len() > 1 {
        let (page, pages) = (arguments.reading.page, drawn.document.pages.len());
        terminal::warning(&format!(
            "{} has {pages} pages; this is page {page}, --page takes another",
            input.name
        ));
    }
    match machine {
        Some(machine) => plan(arguments, format, command_line, &input, &drawn, &machine),
        None => write_drawing(arguments, format, drawn.drawing()),
    }
}

fn write_drawing(arguments: &Convert, format: Format, drawing: &Drawing) -> Result<(), Failure> {
    let encoding =
        if arguments.hpgl2 { hpgl::Encoding::Base64 } else { hpgl::EmitOptions::default().encoding };
    let options = hpgl::EmitOptions { encoding, ..hpgl::EmitOptions::default() };
    output::write(&arguments.output, |out| match format {
        Format::Svg => picture::svg::write(drawing, out),
        _ => out.write_all(&hpgl::emit(drawing, &options)),
    })
}

fn plan(
    arguments: &Convert,
    format: Format,
    command_line: &[String],
    input: &Input,
    drawn: &LoadedDrawing,
    machine: &LoadedMachine,
) -> Result<(), Failure> {
    let page = drawn.page();
    let request = super::request(&arguments.planning, page, &machine.machine);
    let compiled = compile(input, &page.drawing, &machine.machine, &request)?;
    if compiled.beyond_sheet_mm > 1e-6 {
        terminal::warning(&format!(
            "ink reaches {:.2} mm beyond the sheet (the machine can draw there); --fit keeps it on the sheet",
            compiled.beyond_sheet_mm
        ));
        if arguments.reading.strict {
            terminal::error(input::STRICT);
            return Err(Failure::Refused);
        }
    }
    let summary = Summary::of(&compiled);
    let certificate = CertificateReport::of(&compiled.certificate);
    let said = match arguments.report {
        ReportForm::Text => {
            let text = text::summary(&machine.machine, &compiled);
            format!("{text}{}", text::certificate(&compiled.certificate))
        }
        ReportForm::Json => format!("{}\n", json!({ "summary": summary, "certificate": certificate })),
    };
    if !compiled.may_be_written(request.allow_over_limit) {
        terminal::error(if compiled.may_be_written(true) {
            "the plan breaks the motors' limits and is not written; a longer --segment-time may keep them, --allow-over-limit writes it as it is"
        } else {
            "the plan does not hold its certificate and is not written; please report this drawing"
        });
        terminal::say(&said);
        return Err(Failure::Refused);
    }
    if !compiled.certificate.holds {
        terminal::warning("the plan breaks the motors' limits, which was allowed");
    }
    if let Format::Backend(backend) = format {
        write_encoded(arguments, backend, &machine.machine, &compiled)?;
        terminal::say(&said);
        return Ok(());
    }
    let reading = &arguments.reading;
    let settings = Settings::of(&request, reading.page, &reading.options(), command_line.to_vec());
    let rows = || compiled.trajectory.rows().map(|row| row.row);
    output::write(&arguments.output, |out| {
        let written = match format {
            Format::Csv => plan::file::csv::write(&compiled.header, rows(), out),
            Format::Json => {
                let document = plan::file::json::Document {
                    source: plan::file::json::Source {
                        name: input.name.clone(),
                        sha256: import::sha256(&input.bytes),
                    },
                    machine: serde_json::to_value(&machine.file)?,
                    settings: serde_json::to_value(&settings)?,
                    summary: serde_json::to_value(&summary)?,
                    certificate: serde_json::to_value(&certificate)?,
                };
                plan::file::json::write(&document, &compiled.header, rows, out)
            }
            _ => return Err(std::io::Error::other("a format of a drawing")),
        };
        written.map_err(|error| match error {
            plan::file::WriteError::Io(error) => error,
            other => std::io::Error::other(other),
        })
    })?;
    terminal::say(&said);
    Ok(())
}

/// Writes the plan in a firmware's format, and warns of what the format cannot carry.
fn write_encoded(
    arguments: &Convert,
    backend: &dyn Backend,
    machine: &Machine,
    compiled: &Compiled<'_>,
) -> Result<(), Failure> {
    backend.check(machine).map_err(|error| Failure::Drawing(error.into()))?;
    let pens: Vec<u16> = compiled.ordered().pens().into_iter().map(|pen| pen.0).collect();
    let losses = backend.losses(&compiled.header, &pens);
    for loss in &losses {
        terminal::warning(&loss.to_string());
    }
    if arguments.reading.strict && !losses.is_empty() {
        terminal::error(input::STRICT);
        return Err(Failure::Refused);
    }
    let rows = || -> RowIter<'_> {
        Box::new(compiled.trajectory.rows().map(|ExactRow { row, exact }| (row, exact)))
    };
    let source = PlanSource::new(&compiled.header, &rows).on_machine(machine).of_drawing(compiled.ordered());
    let mut refused = None;
    let written = output::write(&arguments.output, |out| {
        backend.write(&source, &arguments.pen.encode_options(), out).map_err(|error| match error {
            WriteError::Io(error) => error,
            other => {
                let kind = std::io::Error::other("not representable");
                refused = Some(other);
                kind
            }
        })
    });
    match refused {
        Some(error) => {
            Err(Failure::Drawing(anyhow::Error::new(error).context("this format cannot represent the plan")))
        }
        None => written,
    }
}

/// Compiles with progress, and explains where it cannot be done.
pub(super) fn compile<'a>(
    input: &Input,
    drawing: &Drawing,
    machine: &'a Machine,
    request: &Request,
) -> Result<Compiled<'a>, Failure> {
    let progress = Progress::new();
    let compiled = pipeline::compile(drawing, machine, request, &|step| progress.step(step));
    progress.finish();
    compiled.map_err(|error| explain(input, drawing, machine, request, error))
}

/// Says why a drawing cannot be planned, where, and what would help.
pub(super) fn explain(
    input: &Input,
    drawing: &Drawing,
    machine: &Machine,
    request: &Request,
    error: PlanError,
) -> Failure {
    let PlanError::OutOfReach { stroke, pen, span, source } = &error else {
        return match error {
            PlanError::Setting { .. } => Failure::Usage(error.into()),
            other => Failure::Drawing(
                anyhow::Error::new(other).context(format!("{} cannot be planned", input.name)),
            ),
        };
    };
    let place_text = format!(
        "byte {}, stroke {} of {} in the file's order, pen {}; positions are in the machine's frame, the sheet is {:.2}, {:.2} to {:.2}, {:.2} mm",
        span.start,
        stroke + 1,
        drawing.strokes.len(),
        pen.0,
        machine.sheet().x0,
        machine.sheet().y0,
        machine.sheet().x1,
        machine.sheet().y1,
    );
    let help = what_fits(drawing, machine, request);
    let title = format!("the drawing leaves the reach of {}: {source}", machine.name());
    terminal::at_place(input, *span, Level::ERROR, None, &title, &place_text, Some(&help));
    Failure::Refused
}

/// A placement that is known to work, or the options that change it.
fn what_fits(drawing: &Drawing, machine: &Machine, request: &Request) -> String {
    /// Planning to the end costs time: beyond this many strokes a placement is checked for reach only.
    const PLANNED_STROKES: usize = 2_000;
    let works = |scale: Scale| {
        let placement = PlacementOptions { scale, ..request.placement };
        let placed = pipeline::place(drawing, machine, &placement).ok()?;
        let planned = Request { placement, order: Order::File, ..request.clone() };
        let holds = drawing.strokes.len() > PLANNED_STROKES
            || pipeline::compile(drawing, machine, &planned, &|_| {}).is_ok();
        (holds && placed.beyond_sheet_mm <= 1e-6).then(|| placed.placement.as_coeffs())
    };
    let factor = match request.placement.scale {
        Scale::Explicit { factor, .. } | Scale::Aligned { factor, .. } => factor,
        Scale::Fit | Scale::Shrink => 1.0,
    };
    let center = Scale::Aligned { factor, align: Vec2::new(0.5, 0.5) };
    if let Some([.., e, f]) = works(center) {
        let sheet = machine.sheet();
        return format!(
            "--align center puts it on the sheet at this size (as --place {:.2},{:.2} does); --fit also scales it",
            e - sheet.x0,
            f - sheet.y0
        );
    }
    if let Some([a, b, ..]) = works(Scale::Fit) {
        return format!(
            "--fit makes it fit, scaled by {:.4}; or choose --scale, --rotate and --place",
            libm::hypot(a, b)
        );
    }
    "neither --align center nor --fit makes it fit; --scale, --rotate, --mirror and --place change where it lies".to_owned()
}
