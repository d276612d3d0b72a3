//! `plotplan check`: what a file says, and what would not plot.

use std::fmt::Write as _;

use compiler::pipeline::{self, Target};
use compiler::report::text::{length, pluralize};
use compiler::report::{Code, DrawingReport, MachineReport};
use drawing::Figures;
use kinematics::Machine;

use super::convert::{self, clean};
use crate::cli::Check;
use crate::failure::Failure;
use crate::input::{Inputs, LoadedDrawing};
use crate::machines;
use crate::{input, output, session, terminal};

pub(crate) fn run(arguments: &Check) -> Result<(), Failure> {
    let machine = arguments
        .machine
        .as_deref()
        .map(|name| machines::machine_with_paper(name, &arguments.reading))
        .transpose()?;
    let inputs = Inputs::read(std::slice::from_ref(&arguments.file))?;
    let input = inputs.first();
    let mut drawn = input::drawing(input, &arguments.reading)?;
    let target = clean::target(machine.as_ref().map(|loaded| &loaded.machine), &arguments.reading)?;
    if matches!(target, Target::Plane) {
        drawn.crop(arguments.reading.layout.crop);
    }
    let document = &drawn.document;
    let figures: Vec<Figures> = document.pages.iter().map(|page| page.drawing.figures()).collect();
    session::report(|report| report.drawing = Some(DrawingReport::with_figures(document, &figures)));
    let mut text = format!("{}: {}\n", input.path, document.size);
    for (number, (page, figures)) in document.pages.iter().zip(&figures).enumerate() {
        if document.pages.len() > 1 {
            let _ = write!(text, "page {}: ", number + 1);
        }
        match figures.bounds {
            Some(bounds) => {
                let _ = writeln!(
                    text,
                    "{}, {} of ink from {:.2}, {:.2} to {:.2}, {:.2} mm, pens {}",
                    pluralize(page.drawing.strokes.len(), "stroke"),
                    length(figures.length_mm),
                    bounds.x0,
                    bounds.y0,
                    bounds.x1,
                    bounds.y1,
                    figures.pens.keys().map(|pen| pen.0.to_string()).collect::<Vec<_>>().join(", ")
                );
            }
            None => text.push_str("no ink\n"),
        }
    }
    let verdict = if let Some(machine) = &machine {
        placed(arguments, &inputs, &drawn, &machine.machine, &mut text)
    } else {
        let planning = &arguments.planning;
        clean::on_sheet(&inputs, &drawn, planning, &arguments.reading, target).map(|on| text.push_str(&on))
    };
    output::report(&text)?;
    verdict
}

/// Whether the machine can draw it, as it would be placed.
fn placed(
    arguments: &Check,
    inputs: &Inputs,
    drawn: &LoadedDrawing,
    machine: &Machine,
    text: &mut String,
) -> Result<(), Failure> {
    input::use_page(inputs, drawn, &arguments.reading)?;
    let drawing = drawn.drawing();
    let crop = arguments.reading.layout.crop;
    let request = super::request(&arguments.planning, crop, drawn.page(), machine);
    let placed = pipeline::place(drawing, machine, &request.placement, request.crop);
    session::report(|report| {
        report.machine = Some(MachineReport {
            can_draw: Some(placed.is_ok()),
            beyond_sheet_mm: placed.as_ref().ok().map(|placed| placed.beyond_sheet_mm),
            ..MachineReport::of(machine)
        });
    });
    let placed = placed.map_err(|error| convert::explain(inputs, drawing, machine, &request, error))?;
    let _ = writeln!(text, "{} can draw it", machine.name());
    let beyond = placed.beyond_sheet_mm;
    if beyond > 1e-6 {
        terminal::warning(Code::BeyondSheet, &format!("ink reaches {beyond:.2} mm beyond the sheet"));
    }
    input::refuse_warnings(arguments.reading.strict)
}
