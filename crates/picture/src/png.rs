//! The same picture as [`scene::svg`](crate::scene::svg) in pixels, without its words.
//!
//! Rasterised by tiny-skia in single precision: the same on one platform, and to the eye on all.

use drawing::{Point, Rect};
use tiny_skia::{Color, FillRule, LineCap, LineJoin, Paint, PathBuilder, Pixmap, StrokeDash, Transform};

use crate::palette::{Colour, colour_on_white};
use crate::scene::{
    DASH_MM, INK_MM, InkLine, OUTLINE_MM, REACH_FILL, REACH_LINE, REFERENCE, REFERENCE_MM, SHEET_LINE, START,
    Scene, TRAVEL, TRAVEL_MM, shade,
};

/// A picture's longer side has at most this many pixels, lest it need gigabytes.
pub const LARGEST_PX: u32 = 8192;

/// Chords of arcs and curves are this close to them, pixels: below what a pixel shows.
const CHORD_PX: f64 = 0.25;

/// Why a picture could not be made.
#[derive(Debug, thiserror::Error)]
#[error("the picture cannot be encoded as PNG: {0}")]
pub struct PngError(String);

/// The picture as the bytes of a PNG file, `longer_px` pixels along its longer side (16 to [`LARGEST_PX`]).
///
/// # Errors
/// Where there is no memory for the picture, or the encoder fails.
pub fn encode(scene: &Scene, longer_px: u32) -> Result<Vec<u8>, PngError> {
    let bounds = scene.bounds();
    let longer_px = f64::from(longer_px.clamp(16, LARGEST_PX));
    let scale = longer_px / bounds.width().max(bounds.height());
    let pixels = |length: f64| (length * scale).ceil().clamp(1.0, longer_px) as u32;
    let pixmap = Pixmap::new(pixels(bounds.width()), pixels(bounds.height()));
    let mut pixmap = pixmap.ok_or_else(|| PngError("it is too large".to_owned()))?;
    pixmap.fill(Color::WHITE);
    let mut canvas = Canvas { pixmap, bounds, scale };

    let mut reach = PathBuilder::new();
    for outline in &scene.reach {
        canvas.add(&mut reach, outline, true);
    }
    if let Some(reach) = reach.finish() {
        let fill = paint(REACH_FILL);
        canvas.pixmap.fill_path(&reach, &fill, FillRule::EvenOdd, Transform::identity(), None);
    }
    for (cell, level) in scene.shades.iter().flat_map(|shades| &shades.cells) {
        canvas.fill(*cell, shade(*level));
    }
    for outline in &scene.reach {
        canvas.line(outline, true, REACH_LINE, OUTLINE_MM, None);
    }
    let sheet = scene.sheet;
    let corners = [(sheet.x0, sheet.y0), (sheet.x1, sheet.y0), (sheet.x1, sheet.y1), (sheet.x0, sheet.y1)];
    canvas.line(&corners.map(Point::from), true, SHEET_LINE, OUTLINE_MM, None);
    for travel in &scene.travel {
        canvas.line(travel, false, TRAVEL, TRAVEL_MM, Some(DASH_MM));
    }
    for line in &scene.reference {
        canvas.line(line, false, REFERENCE, REFERENCE_MM, None);
    }
    for pen in scene.pens() {
        for ink in scene.ink.iter().filter(|ink| ink.pen == pen) {
            let colour = colour_on_white(pen, &scene.colors);
            match &ink.line {
                InkLine::Points(points) => canvas.line(points, false, colour, INK_MM, None),
                InkLine::Stroke(stroke) => {
                    canvas.line(&stroke.flatten(CHORD_PX / scale), false, colour, INK_MM, None);
                }
            }
        }
    }
    if let Some(start) = scene.start {
        let arm = bounds.width().max(bounds.height()) / 120.0;
        for direction in [(arm, arm), (arm, -arm)] {
            canvas.line(&[start - direction, start + direction], false, START, OUTLINE_MM, None);
        }
    }
    canvas.pixmap.encode_png().map_err(|error| PngError(error.to_string()))
}

struct Canvas {
    pixmap: Pixmap,
    bounds: Rect,
    scale: f64,
}

impl Canvas {
    fn add(&self, path: &mut PathBuilder, points: &[Point], closed: bool) {
        let at = |point: &Point| {
            let x = (point.x - self.bounds.x0) * self.scale;
            let y = (self.bounds.y1 - point.y) * self.scale;
            (x as f32, y as f32)
        };
        let [first, others @ ..] = points else { return };
        let (x, y) = at(first);
        path.move_to(x, y);
        for other in others {
            let (x, y) = at(other);
            path.line_to(x, y);
        }
        if others.is_empty() {
            path.line_to(x, y);
        }
        if closed {
            path.close();
        }
    }

    fn fill(&mut self, rect: Rect, colour: Colour) {
        let x = ((rect.x0 - self.bounds.x0) * self.scale) as f32;
        let y = ((self.bounds.y1 - rect.y1) * self.scale) as f32;
        let [width, height] = [rect.width(), rect.height()].map(|side| (side * self.scale) as f32);
        if let Some(rect) = tiny_skia::Rect::from_xywh(x, y, width, height) {
            // Without antialiasing no seam shows between neighbours.
            let paint = Paint { anti_alias: false, ..paint(colour) };
            self.pixmap.fill_rect(rect, &paint, Transform::identity(), None);
        }
    }

    /// Lines never get so thin that they fade: a pixel is the least.
    fn line(&mut self, points: &[Point], closed: bool, colour: Colour, width_mm: f64, dash_mm: Option<f64>) {
        let mut path = PathBuilder::new();
        self.add(&mut path, points, closed);
        let Some(path) = path.finish() else { return };
        let dash_px = dash_mm.map(|dash| (dash * self.scale).max(3.0) as f32);
        let stroke = tiny_skia::Stroke {
            width: (width_mm * self.scale).max(1.0) as f32,
            line_cap: LineCap::Round,
            line_join: LineJoin::Round,
            dash: dash_px.and_then(|dash| StrokeDash::new(vec![dash, dash], 0.0)),
            ..tiny_skia::Stroke::default()
        };
        self.pixmap.stroke_path(&path, &paint(colour), &stroke, Transform::identity(), None);
    }
}

fn paint([red, green, blue]: Colour) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(red, green, blue, 255);
    paint
}
