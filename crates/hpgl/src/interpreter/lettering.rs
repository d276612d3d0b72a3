//! Labels that a drawing holds as text until their strokes are asked for.

use std::sync::Arc;

use drawing::{Affine, Lettering, Point, Vec2};

use super::Interpreter;
use super::characters::{CELL, Shape};
use super::tracer::same;
use crate::fonts::{self, BODY_WIDTH, CAP_HEIGHT, Glyph};
use crate::units::SANE_PLU;

/// A unit of the font must be longer than this on paper, mm: then no two points of a glyph are the
/// same, and a label has as many strokes as its glyphs.
const LEAST_UNIT_MM: f64 = 1e-6;

/// The advance from character to character.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spacing {
    /// Quarter turns clockwise from the base line to the way that characters follow each other.
    pub(super) path: u8,
    /// Space added to a cell, in parts of it: along and across the line.
    pub(super) extra: Vec2,
    /// Each character is as wide as its glyph.
    pub(super) proportional: bool,
}

impl Spacing {
    /// The advance of a character along the base line, in widths.
    pub(super) fn advance(&self, glyph: Option<Glyph>) -> f64 {
        let cell = match glyph {
            Some(glyph) if self.proportional => glyph.advance / BODY_WIDTH,
            _ => CELL.x,
        };
        cell + CELL.x * self.extra.x
    }

    /// From one character to the next: along the text path.
    pub(super) fn step(&self, glyph: Option<Glyph>, shape: &Shape) -> Vec2 {
        let line = CELL.y * (1.0 + self.extra.y);
        match self.path {
            1 => shape.step(0.0, -line),
            2 => shape.step(-self.advance(glyph), 0.0),
            3 => shape.step(0.0, line),
            _ => shape.step(self.advance(glyph), 0.0),
        }
    }

    /// How far a glyph is moved in its cell, units of the font. In cells of one width glyphs stand in
    /// the middle of their body; slanted rows and narrow letters stay apart.
    pub(super) fn shift(&self, glyph: Glyph) -> f64 {
        if self.proportional { 0.0 } else { 0.5 * (BODY_WIDTH - glyph.advance) }
    }
}

/// How labels are lettered, as far as it seldom changes in a file. The rest is part of the text
/// ([`Label::write`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Style {
    plu_to_mm: Affine,
    spacing: Spacing,
}

impl Lettering for Style {
    fn draw(&self, text: &[u8], to: &mut dyn FnMut(&[Point])) {
        let Some((label, characters)) = Label::read(text) else { return };
        let Label { mut origin, shape } = label;
        let mut points: Vec<Point> = Vec::new();
        for glyph in characters.chars().filter_map(Glyph::of) {
            let shift = (self.spacing.shift(glyph), 0.0);
            for stroke in glyph.strokes() {
                points.clear();
                for point in stroke {
                    let at = self.plu_to_mm * place(&shape, origin, point, shift);
                    if !points.last().is_some_and(|&last| same(last, at)) {
                        points.push(at);
                    }
                }
                to(&points);
            }
            origin += self.spacing.step(Some(glyph), &shape);
        }
    }
}

/// Where a point of a glyph lies, plotter units; `shift` in units of the font.
pub(super) fn place(shape: &Shape, origin: Point, (x, y): (f64, f64), shift: (f64, f64)) -> Point {
    shape.at(origin, (x + shift.0) / BODY_WIDTH, (y + shift.1) / CAP_HEIGHT)
}

/// Where a label begins, plotter units, and the shape of its characters.
struct Label {
    origin: Point,
    shape: Shape,
}

impl Label {
    const NUMBERS: usize = 8;

    /// The text for a [`Style`]: these numbers, then the characters as UTF-8.
    fn write(&self, text: &mut Vec<u8>) {
        let Shape { right, up, lean } = self.shape;
        let Point { x, y } = self.origin;
        for number in [x, y, right.x, right.y, up.x, up.y, lean.x, lean.y] {
            text.extend(number.to_le_bytes());
        }
    }

    fn read(text: &[u8]) -> Option<(Self, &str)> {
        let (numbers, characters) = text.split_at_checked(8 * Self::NUMBERS)?;
        let number = |k: usize| f64::from_le_bytes(std::array::from_fn(|byte| numbers[8 * k + byte]));
        let vector = |k: usize| Vec2::new(number(k), number(k + 1));
        let shape = Shape { right: vector(2), up: vector(4), lean: vector(6) };
        Some((Self { origin: vector(0).to_point(), shape }, std::str::from_utf8(characters).ok()?))
    }
}

impl Interpreter {
    pub(super) fn spacing(&self) -> Spacing {
        let characters = &self.characters;
        let font = if characters.alternate_selected { characters.alternate } else { characters.standard };
        Spacing { path: characters.path, extra: characters.extra, proportional: font.proportional }
    }

    /// Draws a line of text as one label, and leaves the pen where the next character goes. False,
    /// and nothing is drawn, if it has other characters than those of the font, or might not be drawn
    /// as it is: outside the clip, out of range, or without extent.
    pub(super) fn hold_label(&mut self, line: impl Iterator<Item = char>, shape: &Shape) -> bool {
        let spacing = self.spacing();
        let mut text = std::mem::take(&mut self.label_text);
        text.clear();
        Label { origin: self.position, shape: *shape }.write(&mut text);
        let held = self.measured(line, shape, spacing, &mut text);
        if let Some((strokes, end)) = held {
            let style = Style { plu_to_mm: self.frame.plu_to_mm(), spacing };
            let lettering = match &self.lettering {
                Some((last, lettering)) if *last == style => Arc::clone(lettering),
                _ => {
                    let lettering: Arc<dyn Lettering> = Arc::new(style);
                    self.lettering = Some((style, Arc::clone(&lettering)));
                    lettering
                }
            };
            self.tracer.label(&lettering, &text, strokes);
            self.set_pen_position(end);
        }
        self.label_text = text;
        held.is_some()
    }

    /// Appends the characters of a line of text. Gives the number of its strokes and the position
    /// after it.
    fn measured(
        &self,
        line: impl Iterator<Item = char>,
        shape: &Shape,
        spacing: Spacing,
        text: &mut Vec<u8>,
    ) -> Option<(u32, Point)> {
        let map = self.frame.plu_to_mm();
        let linear = |v: Vec2| (map * v.to_point()) - (map * Point::ZERO);
        let (right, up) = (linear(shape.right) / BODY_WIDTH, linear(shape.up + shape.lean) / CAP_HEIGHT);
        // The smallest singular value is at least |det| over the Frobenius norm.
        let least = right.cross(up).abs() / (right.hypot2() + up.hypot2()).sqrt();
        if least.is_nan() || least < LEAST_UNIT_MM {
            return None;
        }
        let mut at = self.position;
        let (mut low, mut high) = (at, at);
        let (mut strokes, mut reach) = (0, 0.0_f64);
        for character in line {
            let measured = fonts::measured(character).filter(|_| character >= ' ')?;
            text.extend_from_slice(character.encode_utf8(&mut [0; 4]).as_bytes());
            strokes += measured.strokes;
            reach = reach.max(measured.reach);
            let step = spacing.step(Some(measured.glyph), shape);
            (low, high) = (
                Point::new(low.x.min(at.x), low.y.min(at.y)),
                Point::new(high.x.max(at.x), high.y.max(at.y)),
            );
            at += step;
        }
        let reach_x = reach * (shape.right.x.abs() + shape.up.x.abs() + shape.lean.x.abs());
        let reach_y = reach * (shape.right.y.abs() + shape.up.y.abs() + shape.lean.y.abs());
        let corners = [
            Point::new(low.x - reach_x, low.y - reach_y),
            Point::new(high.x + reach_x, low.y - reach_y),
            Point::new(high.x + reach_x, high.y + reach_y),
            Point::new(low.x - reach_x, high.y + reach_y),
        ];
        let fits = |corner: Point| {
            corner.x.abs() < SANE_PLU && corner.y.abs() < SANE_PLU && self.tracer.keeps(map * corner)
        };
        corners.into_iter().all(fits).then_some((strokes, at))
    }
}
