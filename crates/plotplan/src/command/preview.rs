//! `plotplan preview`: a picture of a drawing or a plan on its machine.

use std::io::IsTerminal as _;
use std::path::Path;

use compiler::pipeline::{self, Order};
use compiler::view::{ColorBy, View};
use compiler::{layout, scene};
use picture::Scene;

use super::convert::clean;
use super::page;
use crate::cli::{PictureFormat, Preview};
use crate::failure::Failure;
use crate::input::{self, Input, Inputs};
use crate::machines;
use crate::{options, output, session, terminal};

/// A picture's longer side, pixels.
const PIXELS: u32 = 1600;

pub(crate) fn run(arguments: &Preview) -> Result<(), Failure> {
    let format = format(&arguments.output, arguments.format)?;
    let inputs = Inputs::read(&arguments.files)?;
    let plan = inputs.single().filter(|input| plan::file::is_plan(&input.bytes));
    let machine = arguments.machine.as_deref();
    let moves = arguments.color_by.is_some() || arguments.at.is_some() || arguments.animate.is_some();
    if format == PictureFormat::Html || moves {
        let make = |view: &View<'_>| of_view(view, arguments, format);
        return match plan {
            Some(input) => page::of_plan(input, machine, make),
            None => page::of_drawing(&inputs, arguments, make),
        };
    }
    let scene = match plan {
        Some(input) => of_plan(input, machine)?,
        None => of_drawing(&inputs, arguments)?,
    };
    write(&scene, &arguments.output, format)
}

/// Writes what needs a plan: a page, an animation, ink by a quantity, the machine in a pose.
fn of_view(view: &View<'_>, arguments: &Preview, format: PictureFormat) -> Result<(), Failure> {
    let to = &arguments.output;
    let usage = |what: &'static str| Failure::Usage(anyhow::anyhow!(what));
    if format == PictureFormat::Html {
        return page::write(to, &view.html());
    }
    if let Some(turn_s) = arguments.animate {
        if format != PictureFormat::Svg {
            return Err(usage("--animate makes NAME.svg"));
        }
        if !(1.0..=600.0).contains(&turn_s) {
            return Err(usage("--animate takes from 1s to 600s"));
        }
        let (scene, animation) = view.animation(turn_s);
        return output::write(to, |out| picture::animation::svg(&scene, &animation, out));
    }
    let color = arguments.color_by.map_or(ColorBy::Pen, ColorBy::from);
    write(&view.scene(color, arguments.at).map_err(usage)?, to, format)
}

/// A picture of a machine without a drawing.
pub(super) fn machine(name: &str, output: &str, asked: Option<PictureFormat>) -> Result<(), Failure> {
    let format = format(output, asked)?;
    if format == PictureFormat::Html {
        let what = "a machine alone does not move: its picture is NAME.svg or NAME.png";
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    }
    session::report(|report| report.inputs.push(name.to_owned()));
    write(&scene::of_machine(&machines::machine(name)?.machine), output, format)
}

/// The format asked for, by name or by the extension of the output.
fn format(output: &str, asked: Option<PictureFormat>) -> Result<PictureFormat, Failure> {
    let extension = Path::new(output).extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let by_extension = match extension.as_deref() {
        Some("svg") => Some(PictureFormat::Svg),
        Some("png") => Some(PictureFormat::Png),
        Some("html" | "htm") => Some(PictureFormat::Html),
        _ => None,
    };
    let wrong = |what: String| Err(Failure::Usage(anyhow::anyhow!(what)));
    match (asked, by_extension) {
        (Some(asked), Some(by_extension)) if asked != by_extension => {
            wrong(format!("--format contradicts the extension of {output}"))
        }
        (Some(format), _) | (None, Some(format)) => Ok(format),
        (None, None) if output == "-" && std::io::stdout().is_terminal() => Ok(PictureFormat::Text),
        (None, None) if output == "-" => Ok(PictureFormat::Svg),
        (None, None) => {
            wrong(format!("{output}: a picture is NAME.svg, NAME.png or NAME.html; or give --format"))
        }
    }
}

fn write(scene: &Scene, output: &str, format: PictureFormat) -> Result<(), Failure> {
    match format {
        PictureFormat::Svg | PictureFormat::Html => {
            output::write(output, |out| picture::scene::svg(scene, out))
        }
        PictureFormat::Png => {
            let bytes =
                picture::png::encode(scene, PIXELS).map_err(|error| Failure::Drawing(error.into()))?;
            output::write(output, |out| out.write_all(&bytes))
        }
        PictureFormat::Text => {
            let (columns, lines) = terminal::size();
            let text = picture::braille::encode(scene, columns, lines.saturating_sub(2));
            let text = text.map_err(|error| Failure::Drawing(error.into()))?;
            output::write(output, |out| out.write_all(text.as_bytes()))
        }
    }
}

fn of_drawing(inputs: &Inputs, arguments: &Preview) -> Result<Scene, Failure> {
    let machine = arguments
        .machine
        .as_deref()
        .map(|name| machines::machine_with_paper(name, &arguments.reading))
        .transpose()?;
    let drawn = input::drawings(inputs, &arguments.reading)?;
    input::use_page(inputs, &drawn, &arguments.reading)?;
    let colors = scene::pen_colors(drawn.page());
    let crop = arguments.reading.layout.crop;
    let name = inputs.name();
    let Some(machine) = machine else {
        let target = clean::target(None, &arguments.reading)?;
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
    options::refuse_on_plan()?;
    let (plan, machine) = super::verify::plan_on_its_machine(input, machine)?;
    let machine = &machine.machine;
    let title = format!("{} on {}", input.name, machine.name());
    Ok(scene::of_plan(&title, &plan.table.rows, machine, plan.table.header.pen_colors))
}
