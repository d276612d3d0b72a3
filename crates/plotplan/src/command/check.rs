//! `plotplan check`: what a file says, and what would not plot.

use std::fmt::Write as _;

use compiler::import::Severity;
use compiler::pipeline;
use compiler::report::text::{length, pluralize};

use crate::cli::Check;
use crate::failure::Failure;
use crate::input::Inputs;
use crate::machines;
use crate::{input, output, terminal};

pub(crate) fn run(arguments: &Check) -> Result<(), Failure> {
    let machine = arguments
        .machine
        .as_deref()
        .map(|name| machines::machine_with_paper(name, &arguments.reading))
        .transpose()?;
    let inputs = Inputs::read(std::slice::from_ref(&arguments.file))?;
    let input = inputs.first();
    let mut drawn = input::drawing(input, &arguments.reading)?;
    if machine.is_none() {
        drawn.crop(arguments.reading.layout.crop);
    }
    let document = &drawn.document;
    let mut refused = false;
    let mut text = format!("{}: {}\n", input.name, document.size);
    for (number, page) in document.pages.iter().enumerate() {
        let drawing = &page.drawing;
        if document.pages.len() > 1 {
            let _ = write!(text, "page {}: ", number + 1);
        }
        match drawing.bounding_box() {
            Some(bounds) => {
                let _ = writeln!(
                    text,
                    "{}, {} of ink from {:.2}, {:.2} to {:.2}, {:.2} mm, pens {}",
                    pluralize(drawing.strokes.len(), "stroke"),
                    length(drawing.length()),
                    bounds.x0,
                    bounds.y0,
                    bounds.x1,
                    bounds.y1,
                    drawing.pens().iter().map(|pen| pen.0.to_string()).collect::<Vec<_>>().join(", ")
                );
            }
            None => text.push_str("no ink\n"),
        }
    }
    if document.pages.iter().all(|page| page.drawing.is_empty()) {
        terminal::error("the file draws nothing");
        refused = true;
    }
    if let Some(machine) = &machine {
        let drawing = drawn.drawing();
        let request = super::request(
            &arguments.planning,
            arguments.reading.layout.crop,
            drawn.page(),
            &machine.machine,
        );
        match pipeline::place(drawing, &machine.machine, &request.placement, request.crop) {
            Ok(placed) => {
                let _ = writeln!(text, "{} can draw it", machine.machine.name());
                let beyond = placed.beyond_sheet_mm;
                if beyond > 1e-6 {
                    terminal::warning(&format!("ink reaches {beyond:.2} mm beyond the sheet"));
                    if arguments.reading.strict {
                        terminal::error(input::STRICT);
                        refused = true;
                    }
                }
            }
            Err(error) => {
                match super::convert::explain(&inputs, drawing, &machine.machine, &request, error) {
                    Failure::Refused => refused = true,
                    other => return Err(other),
                }
            }
        }
    }
    output::write("-", |out| out.write_all(text.as_bytes()))?;
    let loses_ink = document.has(Severity::Error);
    if refused || loses_ink { Err(Failure::Refused) } else { Ok(()) }
}
