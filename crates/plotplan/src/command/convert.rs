//! `plotplan convert`: drawings into plans, or into clean drawings.

mod batch;
pub(super) mod clean;
mod names;

use std::collections::BTreeSet;

use backends::pen_plotter::plotter::Plotter;
use backends::{Backend, EncodeOptions, Loss, PlanSource, RowIter, WriteError};
use compiler::import::Page;
use compiler::layout::Layout;
use compiler::pipeline::{self, Compiled, Order, Request};
use compiler::report::{CertificateReport, Code, ErrorReport, OutputReport, Place, Summary, text};
use compiler::settings::Settings;
use drawing::{Drawing, Pen, Vec2};
use kinematics::Machine;
use planner::{ExactRow, PlacementOptions, PlanError, Scale};

use self::names::{Names, Part};
use crate::cli::{Convert, Format, PageChoice, Planning};
use crate::failure::Failure;
use crate::input::{self, Inputs};
use crate::machines::{self, LoadedMachine};
use crate::terminal::{self, Progress};
use crate::{output, session};

/// What every output of one command has in common.
struct Job<'a> {
    arguments: &'a Convert,
    format: Format,
    /// The options that shape the plan, as given.
    command_line: &'a [String],
    /// Always there for formats of plans.
    machine: Option<&'a LoadedMachine>,
    /// The plotter that a drawing is written for.
    plotter: Option<&'a Plotter>,
}

/// What was written.
struct Written {
    /// The report for standard error.
    said: String,
    /// The same in a few words.
    line: String,
}

pub(crate) fn run(arguments: &Convert, command_line: &[String]) -> Result<(), Failure> {
    // What is wrong with the machine shows before a long read.
    let format = arguments.format().map_err(|what| Failure::Usage(anyhow::anyhow!(what)))?;
    if let Some(what) = arguments.pen.wrong_positions() {
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    }
    let machine = match (format, &arguments.machine) {
        (Format::Hpgl | Format::Svg, None) => None,
        (_, Some(name)) => Some(machines::machine_with_paper(name, &arguments.reading)?),
        (_, None) => {
            let what = "which machine is the plan for? Give --machine NAME (see `plotplan machine list`) or --machine FILE.toml";
            return Err(Failure::Usage(anyhow::anyhow!(what)));
        }
    };
    let plotter = super::send::plotter(arguments.target.as_ref().map(|(name, _)| &**name))?;
    let job = Job { arguments, format, command_line, machine: machine.as_ref(), plotter: plotter.as_ref() };
    let names = Names::of(arguments, format);
    if names.is_one_per_drawing() && arguments.files.len() > 1 {
        return batch::run(&job, &names);
    }
    if let Some(folder) = names.folder().filter(|_| names.is_one_per_drawing()) {
        std::fs::create_dir_all(folder)
            .map_err(|error| Failure::writing(error, &folder.display().to_string()))?;
    }
    let inputs = Inputs::read(&arguments.files)?;
    for (_, written) in convert_parts(&job, &inputs, &names)? {
        terminal::report(&written.said);
    }
    Ok(())
}

/// Converts a drawing, or each of its pages and pens: the outputs in order. If one of several fails
/// the others are written.
fn convert_parts(job: &Job<'_>, inputs: &Inputs, names: &Names) -> Result<Vec<(String, Written)>, Failure> {
    let arguments = job.arguments;
    let drawn = input::drawings(inputs, &arguments.reading)?;
    input::use_page(inputs, &drawn, &arguments.reading)?;
    let pages = drawn.document.pages.len();
    let numbers = match arguments.reading.page() {
        PageChoice::All => 1..=pages,
        PageChoice::Number(page) => page..=page,
    };
    let name = inputs.name();
    let mut parts = Vec::new();
    for number in numbers {
        let page = if inputs.single().is_some() { &drawn.document.pages[number - 1] } else { drawn.page() };
        if arguments.split.is_none() {
            parts.push((Part { drawing: &name, page: number, pen: None }, page.clone()));
            continue;
        }
        for pen in page.drawing.pens() {
            let mut page = page.clone();
            page.drawing.strokes.change_pens(|other| (other == pen).then_some(pen));
            page.pens.retain(|other, _| *other == pen);
            parts.push((Part { drawing: &name, page: number, pen: Some(pen.0) }, page));
        }
    }
    let outputs: BTreeSet<String> = parts.iter().map(|(part, _)| names.file(*part)).collect();
    if outputs.len() < parts.len() {
        return Err(Failure::Usage(anyhow::anyhow!(names.lacks())));
    }
    let is_only = parts.len() == 1;
    let mut written = Vec::new();
    let mut failed = false;
    for (part, mut page) in parts {
        if arguments.planning.dedupe && order(&arguments.planning, job.format) == Order::File {
            page.drawing = ordering::without_duplicates(page.drawing);
        }
        let to = names.file(part);
        let result = match (job.format, job.machine) {
            (Format::Hpgl | Format::Svg, _) | (_, None) => clean::write(job, inputs, &page, &to),
            (_, Some(machine)) => plan(job, inputs, part, &page, machine, &to),
        };
        match result {
            Ok(report) => written.push((to, report)),
            Err(failure) if is_only => return Err(failure),
            Err(failure) => {
                failure.describe(&to);
                failed = true;
            }
        }
    }
    if failed {
        let message = format!("not all outputs of {name} were written");
        session::failed(ErrorReport { code: Code::Drawing, message, help: None, place: None });
        return Err(Failure::Refused);
    }
    Ok(written)
}

/// The order in which strokes are drawn: in drawings the file's, unless another one is asked for, since
/// other programs read them.
fn order(planning: &Planning, format: Format) -> Order {
    match (planning.order, format) {
        (None, Format::Hpgl | Format::Svg) => Order::File,
        _ => super::order(planning),
    }
}

fn plan(
    job: &Job<'_>,
    inputs: &Inputs,
    part: Part<'_>,
    page: &Page,
    machine: &LoadedMachine,
    to: &str,
) -> Result<Written, Failure> {
    let Job { arguments, format, .. } = *job;
    let crop = arguments.reading.layout.crop;
    let request = super::request(&arguments.planning, crop, page, &machine.machine);
    let compiled = compile(inputs, &page.drawing, &machine.machine, &request)?;
    if compiled.beyond_sheet_mm > 1e-6 {
        let what = format!(
            "ink reaches {:.2} mm beyond the sheet (the machine can draw there); --fit keeps it on the sheet",
            compiled.beyond_sheet_mm
        );
        terminal::warning(Code::BeyondSheet, &what);
        input::refuse_warnings(arguments.reading.strict)?;
    }
    let summary = Summary::of(&compiled);
    let certificate = CertificateReport::of(&compiled.certificate);
    session::report(|report| {
        report.outputs.push(OutputReport {
            file: to.to_owned(),
            drawing: None,
            summary: Some(summary.clone()),
            certificate: Some(certificate.clone()),
        });
    });
    let said =
        format!("{}{}", text::summary(&machine.machine, &compiled), text::certificate(&compiled.certificate));
    if !compiled.may_be_written(request.allow_over_limit) {
        if compiled.may_be_written(true) {
            let what = "the plan breaks the motors' limits and is not written; a longer --segment-time may keep them, --allow-over-limit writes it as it is";
            terminal::error(Code::OverLimit, what);
        } else {
            let what =
                "the plan does not hold its certificate and is not written; please report this drawing";
            terminal::error(Code::Verification, what);
        }
        terminal::report(&said);
        return Err(Failure::Refused);
    }
    if !compiled.certificate.holds {
        terminal::warning(Code::OverLimit, "the plan breaks the motors' limits, which was allowed");
    }
    let time = text::duration(compiled.header.duration_us as f64 * 1e-6);
    let ink = text::length(compiled.certificate.ink_mm);
    let written = Written { said, line: format!("{time}, {ink} of ink") };
    if let Format::Backend(backend) = format {
        let remarks = write_encoded(arguments, backend, &machine.machine, &compiled, to)?;
        return Ok(Written { said: written.said + &remarks, ..written });
    }
    let reading = &arguments.reading;
    let (layout, command_line) = of_part(job, part);
    let settings = Settings::of(&request, part.page, &reading.options(None), &layout, command_line);
    let rows = || compiled.trajectory.rows().map(|row| row.row);
    output::write(to, |out| {
        let written = match format {
            Format::Csv => plan::file::csv::write(&compiled.header, rows(), out),
            Format::Json => {
                let document = plan::file::json::Document {
                    source: plan::file::json::Source { name: inputs.name(), sha256: inputs.sha256() },
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
    Ok(written)
}

/// The layout and the options of `convert` that make the plan of this part alone.
fn of_part(job: &Job<'_>, part: Part<'_>) -> (Layout, Vec<String>) {
    let mut layout = job.arguments.reading.layout.to_layout();
    let mut command_line = job.command_line.to_vec();
    if job.arguments.reading.page() == PageChoice::All {
        command_line.retain(|option| !option.starts_with("--page="));
        command_line.push(format!("--page={}", part.page));
    }
    if let Some(pen) = part.pen {
        // The file's numbers of the pens that become this one.
        let of_file = (1..=u16::MAX).filter(|from| layout.mapped(Pen(*from)) == Pen(pen));
        let is_kept = |from: &u16| layout.only_pens.as_ref().is_none_or(|only| only.contains(from));
        let only: Vec<u16> = of_file.filter(is_kept).collect();
        let list = only.iter().map(u16::to_string).collect::<Vec<_>>().join(",");
        command_line.retain(|option| !option.starts_with("--split=") && !option.starts_with("--only-pens="));
        command_line.push(format!("--only-pens={list}"));
        layout.only_pens = Some(only);
    }
    (layout, command_line)
}

/// Writes the plan in a firmware's format, and warns of what the format cannot carry. Returns lines for
/// the report.
fn write_encoded(
    arguments: &Convert,
    backend: &dyn Backend,
    machine: &Machine,
    compiled: &Compiled<'_>,
    to: &str,
) -> Result<String, Failure> {
    backend.check(machine).map_err(|error| Failure::Drawing(error.into()))?;
    let pens: Vec<u16> = compiled.ordered().pens().into_iter().map(|pen| pen.0).collect();
    let losses: Vec<Loss> =
        backend.losses(&compiled.header, &pens).into_iter().chain(backend.file_caveat(machine)).collect();
    for loss in &losses {
        terminal::warning(Code::FormatLoss, &loss.to_string());
    }
    input::refuse_warnings(arguments.reading.strict)?;
    let rows = || -> RowIter<'_> {
        Box::new(compiled.trajectory.rows().map(|ExactRow { row, exact }| (row, exact)))
    };
    let source = PlanSource::new(&compiled.header, &rows).on_machine(machine).of_drawing(compiled.ordered());
    let encode =
        EncodeOptions { spare_mm: compiled.certificate.spare_mm(), ..arguments.pen.encode_options() };
    let mut refused = None;
    let written = output::write(to, |out| {
        backend.write(&source, &encode, out).map_err(|error| match error {
            WriteError::Io(error) => error,
            other => {
                let kind = std::io::Error::other("not representable");
                refused = Some(other);
                kind
            }
        })
    });
    if let Some(error) = refused {
        let error = anyhow::Error::new(error).context("this format cannot represent the plan");
        return Err(Failure::Drawing(error));
    }
    written?;
    let remarks = backend.remarks(&source, &encode);
    Ok(remarks.into_iter().map(|remark| remark + "\n").collect())
}

/// Compiles with progress, and explains where it cannot be done.
pub(super) fn compile<'a>(
    inputs: &Inputs,
    drawing: &Drawing,
    machine: &'a Machine,
    request: &Request,
) -> Result<Compiled<'a>, Failure> {
    let progress = Progress::new();
    let compiled = pipeline::compile(drawing, machine, request, &|step| progress.step(step));
    progress.finish();
    compiled.map_err(|error| explain(inputs, drawing, machine, request, error))
}

/// The failure of a drawing that cannot be planned, for all reasons but a place on the drawing.
pub(super) fn refusal(inputs: &Inputs, error: PlanError) -> Failure {
    match error {
        PlanError::Setting { .. } => Failure::Usage(error.into()),
        other => Failure::Drawing(
            anyhow::Error::new(other).context(format!("{} cannot be planned", inputs.path())),
        ),
    }
}

/// Says why a drawing cannot be planned, where, and what would help.
pub(super) fn explain(
    inputs: &Inputs,
    drawing: &Drawing,
    machine: &Machine,
    request: &Request,
    error: PlanError,
) -> Failure {
    let PlanError::OutOfReach { stroke, pen, span, source } = &error else {
        return refusal(inputs, error);
    };
    let (input, span) = inputs.locate(*span);
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
    let place = Place::of_stroke(&input.path, span, *stroke, pen.0, source.point);
    terminal::error_in_file(input, span, Code::OutOfReach, &title, &place_text, &help, place);
    Failure::Refused
}

/// A placement that is known to work, or the options that change it.
fn what_fits(drawing: &Drawing, machine: &Machine, request: &Request) -> String {
    /// Planning to the end costs time: beyond this many strokes a placement is checked for reach only.
    const PLANNED_STROKES: usize = 2_000;
    let works = |scale: Scale| {
        let placement = PlacementOptions { scale, ..request.placement };
        let placed = pipeline::place(drawing, machine, &placement, request.crop).ok()?;
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
