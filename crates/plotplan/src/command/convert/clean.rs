//! Drawings as output: clean HP-GL and SVG.

use std::fmt::Write as _;

use backends::pen_plotter::plotter::Sheet;
use backends::pen_plotter::{self, PlotterLimit};
use compiler::import::Page;
use compiler::paper;
use compiler::pipeline::{self, Arranged, Order, Target};
use compiler::report::text::{length, pluralize};
use compiler::report::{ArrangedReport, Code, OutputReport};
use compiler::scene;
use drawing::Rect;
use kinematics::Machine;

use super::{Job, Written};
use crate::cli::{Format, Planning, Reading};
use crate::command;
use crate::failure::Failure;
use crate::input::{self, Inputs, LoadedDrawing};
use crate::{output, session, terminal};

/// Places, crops and orders the drawing of a page, and writes it.
pub(super) fn write(job: &Job<'_>, inputs: &Inputs, page: &Page, to: &str) -> Result<Written, Failure> {
    let arguments = job.arguments;
    let machine = job.machine.map(|loaded| &loaded.machine);
    let device = sheet(job)?;
    let target = match &device {
        Some(sheet) => Target::Sheet([sheet.area_mm().width(), sheet.area_mm().height()]),
        None => target(machine, &arguments.reading)?,
    };
    let order = super::order(&arguments.planning, job.format);
    let placement = command::placement(&arguments.planning.placement);
    let crop = arguments.reading.layout.crop;
    let arranged = pipeline::arrange(&page.drawing, target, &placement, crop, &order);
    let arranged = arranged.map_err(|error| match machine {
        Some(machine) => {
            let request = command::request(&arguments.planning, crop, page, machine);
            super::explain(inputs, &page.drawing, machine, &request, error)
        }
        None => super::refusal(inputs, error),
    })?;
    let instructions = device.map(|sheet| for_plotter(inputs, &arranged, &sheet)).transpose()?;
    warn_beyond(&arranged, arguments.reading.strict)?;
    output::write(to, |out| match (job.format, &instructions) {
        (_, Some(text)) => out.write_all(text.as_bytes()),
        (Format::Svg, None) => {
            let style = picture::svg::Style { page: page_rect(target), colors: scene::pen_colors(page) };
            picture::svg::write(&arranged.drawing, &style, out)
        }
        (_, None) => {
            let mut options = hpgl::EmitOptions::default();
            if arguments.hpgl2 {
                options.encoding = hpgl::Encoding::Base64;
                let colors = page.pens.iter().filter_map(|(pen, settings)| Some((*pen, settings.color?)));
                options.colors = colors.collect();
            }
            out.write_all(&hpgl::emit(&arranged.drawing, &options))
        }
    })?;
    session::report(|report| {
        report.outputs.push(OutputReport {
            file: to.to_owned(),
            drawing: Some(ArrangedReport::of(&arranged, machine.is_some())),
            summary: None,
            certificate: None,
        });
    });
    let said =
        arranged.ordering.as_ref().map_or_else(String::new, |report| text_report(report, machine.is_some()));
    let strokes = pluralize(arranged.drawing.strokes.len(), "stroke");
    let line = format!("{strokes}, {} of ink", length(arranged.drawing.length()));
    Ok(Written { said, line })
}

/// The sheet in the plotter that the drawing is written for.
fn sheet<'a>(job: &Job<'a>) -> Result<Option<Sheet<'a>>, Failure> {
    let paper = job.arguments.target.as_ref().and_then(|(_, paper)| paper.as_deref());
    let sheet = job.plotter.map(|plotter| Sheet::named(plotter, paper)).transpose();
    sheet.map_err(|error| Failure::Usage(error.into()))
}

/// The drawing in the plotter's instructions, one a line.
fn for_plotter(inputs: &Inputs, arranged: &Arranged, sheet: &Sheet<'_>) -> Result<String, Failure> {
    let lines = pen_plotter::encode(&arranged.drawing, sheet).map_err(|error| {
        let help = match error {
            PlotterLimit::OffPaper { .. } => {
                "; --fit scales it to the paper, --align center moves it there, --crop sheet cuts it; --made-for reads a file of the same plotter as it was made"
            }
            _ => "; --pen-map or --only-pens choose others",
        };
        Failure::Drawing(anyhow::anyhow!("{}: {error}{help}", inputs.name()))
    })?;
    Ok(lines.iter().flat_map(|line| [line.text.as_str(), "\n"]).collect())
}

/// What drawings without a plan are arranged for.
pub(in crate::command) fn target<'a>(
    machine: Option<&'a Machine>,
    reading: &Reading,
) -> Result<Target<'a>, Failure> {
    if let Some(machine) = machine {
        return Ok(Target::Machine(machine));
    }
    match reading.paper.as_ref().filter(|_| reading.plotter.is_none()) {
        None => Ok(Target::Plane),
        Some(paper) => paper::size_mm(paper)
            .map(Target::Sheet)
            .map_err(|what| Failure::Usage(anyhow::anyhow!("--paper: {what}"))),
    }
}

/// The sheet as a page with its lower-left corner at the origin, if it has edges.
pub(in crate::command) fn page_rect(target: Target<'_>) -> Option<Rect> {
    let size = target.sheet().size();
    (size.width.is_finite() && size.height.is_finite()).then(|| Rect::from_origin_size((0.0, 0.0), size))
}

/// For `check` and `info` without a machine: where the drawing lies on the sheet of `--paper`, if there
/// is one. Stops if the drawing cannot be used.
pub(in crate::command) fn on_sheet(
    inputs: &Inputs,
    drawn: &LoadedDrawing,
    planning: &Planning,
    reading: &Reading,
    target: Target<'_>,
) -> Result<String, Failure> {
    if matches!(target, Target::Plane) {
        input::refuse_unusable(&inputs.path(), &drawn.document)?;
        return Ok(String::new());
    }
    input::use_page(inputs, drawn, reading)?;
    let placement = command::placement(&planning.placement);
    let arranged = pipeline::arrange(drawn.drawing(), target, &placement, reading.layout.crop, &Order::File);
    let arranged = arranged.map_err(|error| super::refusal(inputs, error))?;
    let size = target.sheet().size();
    let mut text = format!("sheet    {} x {} mm: ", size.width, size.height);
    match arranged.drawing.bounding_box() {
        None => text.push_str("no ink on it\n"),
        Some(ink) => {
            let _ = writeln!(
                text,
                "ink from {:.2}, {:.2} to {:.2}, {:.2} mm{}",
                ink.x0,
                ink.y0,
                ink.x1,
                ink.y1,
                if arranged.beyond_sheet_mm > 1e-6 { "" } else { ", all of it on the sheet" }
            );
        }
    }
    warn_beyond(&arranged, reading.strict)?;
    Ok(text)
}

fn warn_beyond(arranged: &Arranged, strict: bool) -> Result<(), Failure> {
    if arranged.beyond_sheet_mm <= 1e-6 {
        return Ok(());
    }
    let what = format!(
        "ink reaches {:.2} mm beyond the sheet; --fit keeps it on the sheet, --crop sheet cuts it off",
        arranged.beyond_sheet_mm
    );
    terminal::warning(Code::BeyondSheet, &what);
    input::refuse_warnings(strict)
}

fn text_report(report: &ordering::Report, by_time: bool) -> String {
    let mut text = format!("strokes  {} of {}\n", report.strokes_after, report.strokes_before);
    let _ = writeln!(
        text,
        "travel   {}, in the file's order {}",
        length(report.travel_mm_after),
        length(report.travel_mm_before)
    );
    if by_time {
        let (after, before) = (report.travel_cost_after, report.travel_cost_before);
        let _ = writeln!(text, "         {after:.1} s, in the file's order {before:.1} s");
    }
    text
}
