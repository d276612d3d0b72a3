//! `plotplan preview`: a picture of a drawing or a plan on its machine.

use std::path::Path;

use compiler::pipeline::{self, Order};
use compiler::{layout, scene};
use picture::Scene;

use super::convert::clean;
use crate::cli::Preview;
use crate::failure::Failure;
use crate::input::{self, Input, Inputs};
use crate::machines;
use crate::output;

/// A picture's longer side, pixels.
const PIXELS: u32 = 1600;

pub(crate) fn run(arguments: &Preview) -> Result<(), Failure> {
    let kind = Path::new(&arguments.output).extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let png = match kind.as_deref() {
        Some("svg") => false,
        Some("png") => true,
        _ => {
            let what = format!("{}: a picture is NAME.svg or NAME.png", arguments.output);
            return Err(Failure::Usage(anyhow::anyhow!(what)));
        }
    };
    let inputs = Inputs::read(&arguments.files)?;
    let scene = match inputs.single().filter(|input| plan::file::is_plan(&input.bytes)) {
        Some(input) => of_plan(input, arguments.machine.as_deref())?,
        None => of_drawing(&inputs, arguments)?,
    };
    if png {
        let bytes = picture::png::encode(&scene, PIXELS).map_err(|error| Failure::Drawing(error.into()))?;
        output::write(&arguments.output, |out| out.write_all(&bytes))
    } else {
        output::write(&arguments.output, |out| picture::scene::svg(&scene, out))
    }
}

fn of_drawing(inputs: &Inputs, arguments: &Preview) -> Result<Scene, Failure> {
    let machine = arguments
        .machine
        .as_deref()
        .map(|name| machines::machine_with_paper(name, &arguments.reading))
        .transpose()?;
    let drawn = input::drawings(inputs, &arguments.reading)?;
    let colors = scene::pen_colors(drawn.page());
    let crop = arguments.reading.layout.crop;
    let name = inputs.name();
    let Some(machine) = machine else {
        let target = clean::target(None, &arguments.reading)?;
        // Without any ink there is nothing to place: an empty picture.
        if drawn.drawing().is_empty() {
            return Ok(scene::of_drawing(&name, drawn.drawing(), clean::page_rect(target), colors));
        }
        let placement = super::placement(&arguments.planning.placement);
        let arranged = pipeline::arrange(drawn.drawing(), target, &placement, crop, &Order::File)
            .map_err(|error| super::convert::refusal(inputs, error))?;
        return Ok(scene::of_drawing(&name, &arranged.drawing, clean::page_rect(target), colors));
    };
    let machine = &machine.machine;
    let mut drawing = drawn.drawing().clone();
    let request = super::request(&arguments.planning, crop, drawn.page(), machine);
    let map = planner::place(machine, &drawing, &request.placement)
        .map_err(|error| super::convert::explain(inputs, &drawing, machine, &request, error))?;
    drawing.transform(map);
    let drawing = layout::cropped(drawing, crop, machine.sheet());
    Ok(scene::of_placed(&format!("{name} on {}", machine.name()), &drawing, machine, colors))
}

fn of_plan(input: &Input, machine: Option<&str>) -> Result<Scene, Failure> {
    let (plan, machine) = super::verify::plan(input, machine)?;
    let machine = &machine.machine;
    let title = format!("{} on {}", input.name, machine.name());
    Ok(scene::of_plan(&title, &plan.table.rows, machine, plan.table.header.pen_colors))
}
