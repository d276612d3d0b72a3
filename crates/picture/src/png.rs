//! The same picture as [`scene::svg`](crate::scene::svg) in pixels. Of its words only the key to
//! colours is there, in strokes.
//!
//! Rasterised by tiny-skia in single precision: the same on one platform, and to the eye on all.

use drawing::{Point, Rect};
use tiny_skia::{Color, FillRule, LineCap, LineJoin, Paint, PathBuilder, Pixmap, StrokeDash, Transform};

use crate::overlay::{AHEAD, Key, KeyColors, LINK, Label, MachinePose, RAIL};
use crate::palette::{Colour, colour_on_white};
use crate::scene::{
    DASH_MM, INK_MM, InkLine, KEY_START, KEY_WIDTH, OUTLINE_MM, REACH_FILL, REACH_LINE, REFERENCE,
    REFERENCE_MM, SHEET_LINE, START, Scene, TRAVEL, TRAVEL_MM, key_lines, link_mm, shade,
};

/// A picture's longer side has at most this many pixels, lest it need gigabytes.
pub const LARGEST_PX: u32 = 8192;

/// Chords of arcs and curves are this close to them, pixels: below what a pixel shows.
const CHORD_PX: f64 = 0.25;
/// The colour of words.
const WORDS: Colour = [0x33, 0x33, 0x33];

/// Why a picture could not be made.
#[derive(Debug, thiserror::Error)]
#[error("the picture cannot be encoded as PNG: {0}")]
pub struct PngError(String);

/// The picture as the bytes of a PNG file, `longer_px` pixels along its longer side (16 to [`LARGEST_PX`]).
///
/// # Errors
/// Where there is no memory for the picture, or the encoder fails.
pub fn encode(scene: &Scene, longer_px: u32) -> Result<Vec<u8>, PngError> {
    let mut bounds = scene.bounds();
    let letter_mm = bounds.width().max(bounds.height()) / 60.0;
    let key_top = Point::new(bounds.x0 + letter_mm, bounds.y0);
    if let Some(key) = &scene.overlay.key {
        bounds.y0 -= (key_lines(key) as f64 + 0.5) * KEY_LINE * letter_mm;
    }
    let longer_px = f64::from(longer_px.clamp(16, LARGEST_PX));
    let scale = longer_px / bounds.width().max(bounds.height());
    let mut canvas = Canvas::new(bounds, scale)?;
    canvas.draw(scene);
    if let Some(key) = &scene.overlay.key {
        canvas.key(key, key_top, letter_mm);
    }
    canvas.pixmap.encode_png().map_err(|error| PngError(error.to_string()))
}

/// The distance of the key's lines, in heights of its letters.
const KEY_LINE: f64 = 1.6;

pub(crate) struct Canvas {
    pub(crate) pixmap: Pixmap,
    bounds: Rect,
    scale: f64,
}

impl Canvas {
    /// A white canvas for this part of the plane, mm, with `scale` pixels per mm.
    pub(crate) fn new(bounds: Rect, scale: f64) -> Result<Self, PngError> {
        let pixels = |length: f64| (length * scale - 1e-9).ceil().clamp(1.0, f64::from(LARGEST_PX)) as u32;
        let pixmap = Pixmap::new(pixels(bounds.width()), pixels(bounds.height()));
        let mut pixmap = pixmap.ok_or_else(|| PngError("it is too large".to_owned()))?;
        pixmap.fill(Color::WHITE);
        Ok(Self { pixmap, bounds, scale })
    }

    fn draw(&mut self, scene: &Scene) {
        self.workspace(scene);
        for travel in &scene.travel {
            self.line(travel, false, TRAVEL, TRAVEL_MM, Some(DASH_MM));
        }
        for line in &scene.reference {
            self.line(line, false, REFERENCE, REFERENCE_MM, None);
        }
        for line in &scene.overlay.ahead {
            self.line(line, false, AHEAD, INK_MM, None);
        }
        self.ink(scene, |pen| colour_on_white(pen, &scene.colors));
        for line in &scene.overlay.lines {
            self.line(&line.points, false, line.color, INK_MM, None);
        }
        if let Some(machine) = &scene.overlay.machine {
            self.machine(machine, scene);
        }
        if let Some(start) = scene.start {
            let arm = self.bounds.width().max(self.bounds.height()) / 120.0;
            for direction in [(arm, arm), (arm, -arm)] {
                self.line(&[start - direction, start + direction], false, START, OUTLINE_MM, None);
            }
        }
    }

    /// Reach, shades and sheet.
    fn workspace(&mut self, scene: &Scene) {
        let mut reach = PathBuilder::new();
        for outline in &scene.reach {
            self.add(&mut reach, outline, true);
        }
        if let Some(reach) = reach.finish() {
            let fill = paint(REACH_FILL);
            self.pixmap.fill_path(&reach, &fill, FillRule::EvenOdd, Transform::identity(), None);
        }
        for (cell, level) in scene.shades.iter().flat_map(|shades| &shades.cells) {
            self.fill(*cell, shade(*level));
        }
        for outline in &scene.reach {
            self.line(outline, true, REACH_LINE, OUTLINE_MM, None);
        }
        self.sheet(scene.sheet, SHEET_LINE);
    }

    pub(crate) fn sheet(&mut self, sheet: Rect, color: Colour) {
        let corners =
            [(sheet.x0, sheet.y0), (sheet.x1, sheet.y0), (sheet.x1, sheet.y1), (sheet.x0, sheet.y1)];
        self.line(&corners.map(Point::from), true, color, OUTLINE_MM, None);
    }

    /// Ink, one pen after the other.
    pub(crate) fn ink(&mut self, scene: &Scene, color: impl Fn(u16) -> Colour) {
        for pen in scene.pens() {
            for ink in scene.ink.iter().filter(|ink| ink.pen == pen) {
                match &ink.line {
                    InkLine::Points(points) => self.line(points, false, color(pen), INK_MM, None),
                    InkLine::Stroke(stroke) => {
                        self.line(&stroke.flatten(CHORD_PX / self.scale), false, color(pen), INK_MM, None);
                    }
                }
            }
        }
    }

    fn machine(&mut self, machine: &MachinePose, scene: &Scene) {
        let width = link_mm(scene);
        for ends in &machine.rails {
            self.line(ends, false, RAIL, 0.5 * width, None);
        }
        for ends in &machine.links {
            self.line(ends, false, LINK, width, None);
        }
        let pen = machine.is_down.map_or([0xFF; 3], |pen| colour_on_white(pen, &scene.colors));
        let pivots = machine.pivots.iter().map(|at| (*at, 1.6 * width, [0xFF; 3], LINK));
        for (at, size, inside, outside) in pivots.chain([(machine.pen, 1.2 * width, pen, START)]) {
            // A line of no length with round ends is a disc.
            self.line(&[at], false, outside, size + 0.3 * width, None);
            self.line(&[at], false, inside, size - 0.3 * width, None);
        }
    }

    fn key(&mut self, key: &Key, top: Point, size: f64) {
        let line = |index: usize| top - (0.0, KEY_LINE * size * (index + 1) as f64);
        self.label(&key.title, line(0), size);
        match &key.colors {
            KeyColors::Kinds(kinds) => {
                for (index, (color, meaning)) in kinds.iter().enumerate() {
                    let at = line(1 + index);
                    let middle = at + (0.0, 0.4 * size);
                    self.line(&[middle, middle + (1.2 * size, 0.0)], false, *color, 0.3 * size, None);
                    self.label(meaning, at + (2.0 * size, 0.0), size);
                }
            }
            KeyColors::Scale { colors, ends } => {
                let start = line(1) + (KEY_START * size, 0.0);
                let width = KEY_WIDTH * size / colors.len() as f64;
                for (index, color) in colors.iter().enumerate() {
                    let corner = start + (width * index as f64, 0.0);
                    self.fill(Rect::from_points(corner, corner + (1.05 * width, 0.8 * size)), *color);
                }
                self.label(&ends[0], line(1), size);
                self.label(&ends[1], start + (KEY_WIDTH * size + 0.7 * size, 0.0), size);
            }
        }
    }

    fn label(&mut self, label: &Label, at: Point, size: f64) {
        for stroke in &label.strokes {
            let points: Vec<Point> = stroke.iter().map(|point| at + size * point.to_vec2()).collect();
            self.line(&points, false, WORDS, 0.09 * size, None);
        }
    }

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
    pub(crate) fn line(
        &mut self,
        points: &[Point],
        closed: bool,
        colour: Colour,
        width_mm: f64,
        dash_mm: Option<f64>,
    ) {
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
