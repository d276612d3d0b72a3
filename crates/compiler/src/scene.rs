//! Scenes for pictures: a drawing or a plan on its machine.

use drawing::{Drawing, Point, Rect};
use kinematics::{Machine, reach_outlines};
use picture::{Ink, InkLine, LEVELS, PenColors, Scene, Shades};
use plan::Row;

use crate::import::Page;
use crate::replay::{Motion, Polyline};

/// Chords of the motion between two rows of a plan deviate from it by at most this, mm.
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
        reference: Vec::new(),
        ink: ink
            .into_iter()
            .map(|Polyline { pen, points }| Ink { pen, line: InkLine::Points(points) })
            .collect(),
        shades: None,
        colors,
        travel: travel.into_iter().map(|line| line.points).collect(),
        start: Some(start_point(machine)),
    }
}

/// A machine without a drawing: reach, sheet, start pose, and its quantization error as shades.
pub fn of_machine(machine: &Machine) -> Scene {
    Scene {
        title: format!("{}: reach, sheet and start pose", machine.name()),
        sheet: machine.sheet(),
        reach: reach_outlines(machine),
        shades: tick_floor(machine),
        ink: Vec::new(),
        reference: Vec::new(),
        colors: PenColors::new(),
        travel: Vec::new(),
        start: Some(start_point(machine)),
    }
}

/// Predicted ink over the drawing that it should be, both in machine mm.
pub fn of_ink(title: &str, lines: Vec<(u16, Vec<Point>)>, drawing: &Drawing, machine: &Machine) -> Scene {
    Scene {
        title: title.to_owned(),
        sheet: machine.sheet(),
        reach: reach_outlines(machine),
        shades: None,
        reference: drawing.strokes.iter().map(|stroke| stroke.flatten(CHORD_MM)).collect(),
        ink: lines.into_iter().map(|(pen, points)| Ink { pen, line: InkLine::Points(points) }).collect(),
        colors: PenColors::new(),
        travel: Vec::new(),
        start: Some(start_point(machine)),
    }
}

/// Cells of the shades along the longer side of the workspace.
const CELLS: f64 = 80.0;

/// The quantization error (half a tick on both motors) where the machine can draw, mm. `None` if it can
/// draw nowhere.
fn tick_floor(machine: &Machine) -> Option<Shades> {
    let outlines = reach_outlines(machine);
    let sheet = machine.sheet();
    // Not far beyond the sheet: the picture shows that only.
    let near = sheet.inflate(0.5 * sheet.width(), 0.5 * sheet.height());
    let reach = outlines.iter().flatten().fold(sheet, |bounds, point| bounds.union_pt(*point));
    let area = reach.intersect(near);
    let side = area.width().max(area.height()) / CELLS;
    let [columns, rows] = [area.width(), area.height()].map(|length| (length / side).round().max(1.0) as u32);
    let mut cells = Vec::new();
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let corner = Point::new(area.x0 + side * f64::from(column), area.y0 + side * f64::from(row));
        let cell = Rect::from_points(corner, corner + (side, side));
        let pose = machine.check_point(cell.center()).ok();
        let pose = pose.and_then(|()| machine.pose_near(cell.center(), &machine.start()).ok());
        cells.extend(pose.map(|pose| (cell, machine.quantization_error(&pose))));
    }
    let values = || cells.iter().map(|(_, floor_mm)| *floor_mm);
    let [low, high] = [values().reduce(f64::min)?, values().reduce(f64::max)?];
    let per_level = (high - low).max(1e-9) / LEVELS as f64;
    let level = |floor_mm: f64| (((floor_mm - low) / per_level) as usize).min(LEVELS - 1);
    Some(Shades {
        title: "tick floor (half a tick on both motors), mm".to_owned(),
        range: [low, high],
        cells: cells.iter().map(|(cell, floor_mm)| (*cell, level(*floor_mm))).collect(),
    })
}

fn start_point(machine: &Machine) -> Point {
    machine.mechanism().forward(&machine.start())
}

fn scene(title: &str, sheet: Rect, reach: Vec<Vec<Point>>, drawing: &Drawing, start: Option<Point>) -> Scene {
    let ink = drawing
        .strokes
        .iter()
        .map(|stroke| Ink { pen: stroke.pen.0, line: InkLine::Stroke(stroke.clone()) })
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
    Scene {
        title: title.to_owned(),
        sheet,
        reach,
        shades: None,
        reference: Vec::new(),
        ink,
        colors: PenColors::new(),
        travel,
        start,
    }
}
