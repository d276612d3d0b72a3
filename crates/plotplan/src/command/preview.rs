//! `plotplan preview`: a picture of a drawing or a plan on its machine.

use std::path::Path;

use compiler::scene;
use picture::Scene;

use crate::cli::Preview;
use crate::failure::Failure;
use crate::input::{self, Input};
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
    let input = input::read(&arguments.file)?;
    let scene = if plan::file::is_plan(&input.bytes) {
        of_plan(&input, arguments.machine.as_deref())?
    } else {
        of_drawing(&input, arguments)?
    };
    if png {
        let bytes = picture::png::encode(&scene, PIXELS).map_err(|error| Failure::Drawing(error.into()))?;
        output::write(&arguments.output, |out| out.write_all(&bytes))
    } else {
        output::write(&arguments.output, |out| picture::scene::svg(&scene, out))
    }
}

fn of_drawing(input: &Input, arguments: &Preview) -> Result<Scene, Failure> {
    let machine = arguments
        .machine
        .as_deref()
        .map(|name| machines::machine_with_paper(name, &arguments.reading))
        .transpose()?;
    let drawn = input::drawing(input, &arguments.reading)?;
    let Some(machine) = machine else {
        return Ok(scene::of_drawing(&input.name, drawn.drawing()));
    };
    let machine = &machine.machine;
    let mut drawing = drawn.drawing().clone();
    let request = super::request(&arguments.planning, drawn.page(), machine);
    let map = planner::place(machine, &drawing, &request.placement)
        .map_err(|error| super::convert::explain(input, &drawing, machine, &request, error))?;
    drawing.transform(map);
    Ok(scene::of_placed(&format!("{} on {}", input.name, machine.name()), &drawing, machine))
}

fn of_plan(input: &Input, machine: Option<&str>) -> Result<Scene, Failure> {
    let (plan, machine) = super::verify::plan(input, machine)?;
    let machine = &machine.machine;
    Ok(scene::of_plan(&format!("{} on {}", input.name, machine.name()), &plan.table.rows, machine))
}
