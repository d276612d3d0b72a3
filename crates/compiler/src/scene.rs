//! Scenes for pictures: a drawing or a plan on its machine.

use drawing::{Drawing, Point, Rect};
use kinematics::{Machine, reach_outlines};
use picture::{Ink, PenColors, Scene};
use plan::Row;

use crate::import::Page;
use crate::replay::{Motion, Polyline};

/// Chords of curves in a picture deviate by at most this, mm.
const CHORD_MM: f64 = 0.02;

/// A drawing without a machine, on a sheet; without a sheet, on the bounding box of its ink.
pub fn of_drawing(title: &str, drawing: &Drawing, sheet: Option<Rect>, colors: PenColors) -> Scene {
    let sheet = sheet.or_else(|| drawing.bounding_box()).unwrap_or(Rect::ZERO);
    Scene { colors, ..scene(title, sheet, Vec::new(), drawing, None) }
}

/// A placed drawing on its machine, in the file's order, with straight travel.
pub fn of_placed(title: &str, drawing: &Drawing, machine: &Machine, colors: PenColors) -> Scene {
    let start = Some(start_point(machine));
    Scene { colors, ..scene(title, machine.sheet(), reach_outlines(machine), drawing, start) }
}

/// The colours that a file gives its pens.
pub fn pen_colors(page: &Page) -> PenColors {
    page.pens.iter().filter_map(|(pen, settings)| Some((pen.0, settings.color?))).collect()
}

/// The rows of a plan on its machine.
pub fn of_plan(title: &str, rows: &[Row], machine: &Machine, colors: PenColors) -> Scene {
    let Motion { ink, travel } = Motion::of(rows, machine, CHORD_MM);
    Scene {
        title: title.to_owned(),
        sheet: machine.sheet(),
        reach: reach_outlines(machine),
        ink: ink.into_iter().map(|Polyline { pen, points }| Ink { pen, points }).collect(),
        colors,
        travel: travel.into_iter().map(|line| line.points).collect(),
        start: Some(start_point(machine)),
    }
}

fn start_point(machine: &Machine) -> Point {
    machine.mechanism().forward(&machine.start())
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
    Scene { title: title.to_owned(), sheet, reach, ink, colors: PenColors::new(), travel, start }
}
