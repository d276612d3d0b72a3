//! Scenes for pictures: a drawing or a plan on its machine.

use drawing::{Drawing, Point, Rect};
use kinematics::{Machine, reach_outlines};
use picture::{BEYOND, ColoredLine, Ink, InkLine, Key, KeyColors, LEVELS, Overlay, PenColors, Scene, Shades};
use plan::Row;

use crate::import::Page;
use crate::replay::{Motion, Polyline};
use crate::view::label;

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
    let lines = beyond_reach(drawing, machine);
    let key = (!lines.is_empty()).then(|| Key {
        title: label("what the machine cannot draw"),
        colors: KeyColors::Kinds(vec![(BEYOND, label("out of reach"))]),
    });
    let overlay = Overlay { lines, key, ..Overlay::default() };
    Scene { colors, overlay, ..scene(title, machine.sheet(), reach_outlines(machine), drawing, start) }
}

/// The parts of a drawing that the machine cannot draw, in steps of 0.5 mm.
pub fn beyond_reach(drawing: &Drawing, machine: &Machine) -> Vec<ColoredLine> {
    const STEP_MM: f64 = 0.5;
    let is_beyond = |point: Point| machine.check_point(point).is_err();
    let mut lines = Vec::new();
    for stroke in &drawing.strokes {
        let is_inside = !is_beyond(stroke.start())
            && stroke.segments().all(|segment| machine.check_segment(&segment).is_ok());
        if is_inside {
            continue;
        }
        let mut line: Vec<Point> = Vec::new();
        let points = stroke.flatten(CHORD_MM);
        let mut add = |point: Point| {
            if is_beyond(point) {
                line.push(point);
            } else if !line.is_empty() {
                lines.push(ColoredLine { color: BEYOND, points: std::mem::take(&mut line) });
            }
        };
        add(points[0]);
        for pair in points.windows(2) {
            let steps = (drawing::distance(pair[0], pair[1]) / STEP_MM).ceil().clamp(1.0, 1e5);
            (1..=steps as u32).for_each(|step| add(pair[0].lerp(pair[1], f64::from(step) / steps)));
        }
        if !line.is_empty() {
            lines.push(ColoredLine { color: BEYOND, points: line });
        }
    }
    lines
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
        overlay: Overlay::default(),
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
        overlay: Overlay::default(),
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
        overlay: Overlay::default(),
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
        overlay: Overlay::default(),
    }
}
