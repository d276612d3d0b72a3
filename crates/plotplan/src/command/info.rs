//! `plotplan info`: what a file is and was read for, lengths, pens, bounds, and with a machine the time a drawing takes.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use backends::gcode;
use compiler::import::{Diagnostic, Fact};
use compiler::pipeline::Target;
use compiler::replay;
use compiler::report::text::{self, duration, length, pluralize};
use compiler::report::{CertificateReport, DrawingReport, PlanReport, ProgramReport, Summary};
use drawing::{Figures, Rect};
use kinematics::Machine;

use super::convert::{self, clean};
use crate::cli::Info;
use crate::failure::Failure;
use crate::input::{self, Input, Inputs, LoadedDrawing};
use crate::machines;
use crate::{options, output, session};

/// Lengths are measured along the plan's own ink: any tolerance does.
const TOLERANCE_MM: f64 = 1.0;

pub(crate) fn run(arguments: &Info) -> Result<(), Failure> {
    let inputs = Inputs::read(std::slice::from_ref(&arguments.file))?;
    let input = inputs.first();
    if let Some(text) = std::str::from_utf8(&input.bytes).ok().filter(|text| gcode::is_ours(text)) {
        return output::report(&of_program(input, text));
    }
    if plan::file::is_plan(&input.bytes) {
        output::report(&of_plan(input, arguments.machine.as_deref())?)
    } else {
        of_drawing(&inputs, arguments)
    }
}

fn of_drawing(inputs: &Inputs, arguments: &Info) -> Result<(), Failure> {
    let input = inputs.first();
    let machine = arguments
        .machine
        .as_deref()
        .map(|name| machines::machine_with_paper(name, &arguments.reading))
        .transpose()?;
    let mut drawn = input::drawing(input, &arguments.reading)?;
    let target = clean::target(machine.as_ref().map(|loaded| &loaded.machine), &arguments.reading)?;
    if matches!(target, Target::Plane) {
        drawn.crop(arguments.reading.layout.crop);
    }
    let document = &drawn.document;
    let figures: Vec<Figures> = document.pages.iter().map(|page| page.drawing.figures()).collect();
    session::report(|report| report.drawing = Some(DrawingReport::with_figures(document, &figures)));
    let mut text = format!("drawing  {}\n", input.path);
    for Fact { key, value } in &document.facts {
        let _ = writeln!(text, "{key:<8} {}", value.replace('\n', "\n         "));
    }
    for (number, (page, figures)) in document.pages.iter().zip(&figures).enumerate() {
        if document.pages.len() > 1 {
            let _ = writeln!(text, "page     {}", number + 1);
        }
        let Some(bounds) = figures.bounds else {
            text.push_str("ink      none\n");
            continue;
        };
        let dots = pluralize(figures.dots, "dot");
        let _ = writeln!(text, "strokes  {} ({dots})", page.drawing.strokes.len());
        let _ = writeln!(text, "ink      {}", length(figures.length_mm));
        let _ = writeln!(
            text,
            "bounds   {:.2}, {:.2} to {:.2}, {:.2} mm ({:.2} x {:.2})",
            bounds.x0,
            bounds.y0,
            bounds.x1,
            bounds.y1,
            bounds.width(),
            bounds.height()
        );
        for (pen, &(count, ink_mm)) in &figures.pens {
            let settings = page.pens.get(pen).cloned().unwrap_or_default();
            let mut own = String::new();
            if let Some(speed) = settings.speed_mm_s {
                let _ = write!(own, ", {speed:.0} mm/s");
            }
            if let Some(width) = settings.width_mm {
                let _ = write!(own, ", {width:.2} mm wide");
            }
            if let Some([red, green, blue]) = settings.color {
                let _ = write!(own, ", #{red:02x}{green:02x}{blue:02x}");
            }
            if let Some(name) = settings.name {
                let _ = write!(own, ", {name:?}");
            }
            let _ =
                writeln!(text, "pen {:<4} {}, {}{own}", pen.0, pluralize(count, "stroke"), length(ink_mm));
        }
    }
    text.push_str(&findings(&document.diagnostics));
    let planned = match machine {
        Some(machine) => planned(arguments, inputs, &drawn, &machine.machine),
        None => clean::on_sheet(inputs, &drawn, &arguments.planning, &arguments.reading, target),
    };
    text.push_str(planned.as_deref().unwrap_or_default());
    output::report(&text)?;
    planned.map(|_| ())
}

/// The summary of the plan that `convert` would write.
fn planned(
    arguments: &Info,
    inputs: &Inputs,
    drawn: &LoadedDrawing,
    machine: &Machine,
) -> Result<String, Failure> {
    input::use_page(inputs, drawn, &arguments.reading)?;
    let crop = arguments.reading.layout.crop;
    let request = super::request(&arguments.planning, crop, drawn.page(), machine);
    let compiled = convert::compile(inputs, drawn.drawing(), machine, &request)?;
    session::report(|report| {
        report.summary = Some(Summary::of(&compiled));
        report.certificate = Some(CertificateReport::of(&compiled.certificate));
    });
    Ok(format!("\n{}{}", text::summary(machine, &compiled), text::certificate(&compiled.certificate)))
}

/// What the reader reported, one line a code.
fn findings(diagnostics: &[Diagnostic]) -> String {
    let mut kinds: BTreeMap<&str, (&Diagnostic, u64)> = BTreeMap::new();
    for diagnostic in diagnostics {
        kinds.entry(diagnostic.code).or_insert((diagnostic, 0)).1 += diagnostic.count;
    }
    let line = |(code, (diagnostic, count)): (&&str, &(&Diagnostic, u64))| {
        format!("{:<8} {count} x {code} {}\n", diagnostic.severity.to_string(), diagnostic.title)
    };
    kinds.iter().map(line).collect()
}

/// A G-code program of ours.
fn of_program(input: &Input, program: &str) -> String {
    let found = gcode::summary(program);
    let mut text = format!("program  {} (G-code)\n", input.path);
    let _ = writeln!(text, "lines    {}", found.lines);
    let _ = writeln!(
        text,
        "time     {} at the feeds of the file, and dwells of {}; accelerations and travel add to it",
        duration(found.drawing_s),
        duration(found.dwell_s)
    );
    let _ = writeln!(text, "ink      {}", length(found.drawn_mm));
    let _ = writeln!(text, "travel   {}", length(found.travel_mm));
    if let Some(bounds) = found.bounds {
        let (width, height) = (bounds.width(), bounds.height());
        let Rect { x0, y0, x1, y1 } = bounds;
        let _ = writeln!(text, "bounds   {x0:.2}, {y0:.2} to {x1:.2}, {y1:.2} mm ({width:.2} x {height:.2})");
    }
    for pause in &found.pauses {
        let _ = writeln!(text, "pause    {pause}");
    }
    let report = ProgramReport {
        lines: found.lines,
        ink_mm: found.drawn_mm,
        travel_mm: found.travel_mm,
        drawing_s: found.drawing_s,
        dwell_s: found.dwell_s,
        bounds_mm: found.bounds.map(|bounds| [bounds.x0, bounds.y0, bounds.x1, bounds.y1]),
        pauses: found.pauses.len(),
    };
    session::report(|all| all.program_file = Some(report.rounded()));
    text
}

fn of_plan(input: &Input, machine: Option<&str>) -> Result<String, Failure> {
    options::refuse_on_plan()?;
    let (plan, machine) = super::verify::plan_on_its_machine(input, machine)?;
    let header = &plan.table.header;
    let mut text = format!("plan     {}\n", input.path);
    let _ = writeln!(text, "machine  {}", header.machine);
    let _ = writeln!(text, "time     {}", duration(header.duration_us as f64 * 1e-6));
    let _ = writeln!(text, "rows     {} every {} us", header.rows, header.period_us);
    for motor in &header.motors {
        let limits = &motor.limits;
        let _ = writeln!(
            text,
            "motor    {}: at most {:.1} ticks/s, {:.1} ticks/s2",
            motor.name, limits.speed, limits.acceleration
        );
    }
    let certificate = replay::certify(&plan, &machine.machine, None, TOLERANCE_MM);
    session::report(|report| report.plan = Some(PlanReport::of(header, &certificate)));
    let _ = writeln!(text, "ink      {}", length(certificate.ink_mm));
    let _ = writeln!(text, "travel   {}", length(certificate.travel_mm));
    let pens: Vec<String> = certificate.pens.iter().map(ToString::to_string).collect();
    let downs = pluralize(certificate.pen_downs as usize, "pen down");
    let _ = writeln!(text, "pens     {}, {downs}", pens.join(", "));
    Ok(text)
}
