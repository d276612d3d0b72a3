//! `plotplan preview`: a picture of a drawing or a plan on its machine.

use std::path::Path;

use drawing::{Drawing, Point, Rect};
use picture::{Ink, Scene};

use super::motion::Motion;
use crate::cli::Preview;
use crate::failure::Failure;
use crate::input::{self, Input};
use crate::output;

/// Chords of curves in a picture stay so close to them, mm.
const CHORD_MM: f64 = 0.02;
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
    let machine = arguments.machine.as_deref().map(input::machine).transpose()?;
    let drawn = input::drawing(input, &arguments.reading)?;
    let mut drawing = drawn.drawing().clone();
    let Some(machine) = machine else {
        // No machine: the sheet is what the ink covers.
        let sheet = drawing.bounding_box().unwrap_or(Rect::ZERO);
        return Ok(scene(&input.name, sheet, Vec::new(), &drawing, None));
    };
    let machine = &machine.machine;
    let request = super::request(&arguments.planning, drawn.page(), machine);
    let map = planner::placement::place(machine, &drawing, &request.wish)
        .map_err(|error| super::convert::explain(input, &drawing, machine, &request, error))?;
    drawing.transform(map);
    let start = machine.geometry().forward(&machine.start());
    let title = format!("{} on {}", input.name, machine.name());
    Ok(scene(&title, machine.sheet(), kinematics::reach_outlines(machine), &drawing, Some(start)))
}

fn scene(title: &str, sheet: Rect, reach: Vec<Vec<Point>>, drawing: &Drawing, start: Option<Point>) -> Scene {
    let ink = drawing
        .strokes
        .iter()
        .map(|stroke| Ink { pen: stroke.pen.0, points: stroke.flatten(CHORD_MM) })
        .collect();
    let mut here = start;
    let mut travel = Vec::new();
    for stroke in &drawing.strokes {
        if let Some(from) = here {
            travel.push(vec![from, stroke.start()]);
        }
        here = Some(stroke.end());
    }
    if let (Some(from), Some(to)) = (here, start) {
        travel.push(vec![from, to]);
    }
    Scene { title: title.to_owned(), sheet, reach, ink, travel, start }
}

fn of_plan(input: &Input, machine: Option<&str>) -> Result<Scene, Failure> {
    let (plan, machine) = super::verify::plan(input, machine)?;
    let machine = &machine.machine;
    let Motion { ink, travel } = Motion::of(&plan.table.rows, machine, CHORD_MM);
    let start = machine.geometry().forward(&machine.start());
    let title = format!("{} on {}", input.name, machine.name());
    Ok(Scene {
        title,
        sheet: machine.sheet(),
        reach: kinematics::reach_outlines(machine),
        ink,
        travel,
        start: Some(start),
    })
}
