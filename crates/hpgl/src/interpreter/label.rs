//! Text as ink: `LB BL PB CP SM UC`.

use drawing::{Point, Span, Vec2};

use super::Interpreter;
use super::characters::{CELL, Shape};
use super::lettering;
use crate::codes;
use crate::fonts::{BODY_WIDTH, Glyph, Mark, compose};

/// The grid that `UC` draws on: units in a character's width and height. A cell has 6 by 16 of
/// them.
const GRID: Vec2 = Vec2::new(4.0, 8.0);
/// Pen control of `UC`: numbers from here on put the pen down, below the negative of it they lift
/// it.
const PEN_CONTROL: f64 = 99.0;
/// Cells from one tabulator to the next.
const TABULATOR: f64 = 8.0;

/// Space between a character and a mark above it, units of the font.
const MARK_GAP: f64 = 3.0;
/// Height of small letters, units of the font.
const SMALL_LETTER: f64 = 14.0;

/// A character of a label and where it stands in the file.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Letter {
    character: char,
    span: Span,
}

impl Interpreter {
    /// `LB`: text from the pen on. The pen is left where the next character would go.
    pub(super) fn label(&mut self, text: &[u8], start: usize) {
        if !self.leaves_polygons_alone() {
            return;
        }
        if self.label_end != Some(self.position) {
            // The pen has moved since the last label: its new position is the margin.
            self.margin = self.position;
        }
        self.ink();
        self.tracer.finish();
        let shape = self.shape();
        let letters = self.letters(text, start);
        // Each piece between carriage returns has its own justification.
        for (index, line) in letters.split(|letter| letter.character == '\r').enumerate() {
            if index > 0 {
                self.set_pen_position(self.margin);
            }
            self.line_of_text(line, &shape);
        }
        self.label_end = Some(self.position);
    }

    /// The characters that bytes stand for in the font at work. Labels that are UTF-8 are read as
    /// such.
    fn letters(&mut self, text: &[u8], start: usize) -> Vec<Letter> {
        if !text.is_ascii()
            && let Ok(text) = std::str::from_utf8(text)
        {
            let letter = |(at, character): (usize, char)| Letter {
                character,
                span: Span { start: start + at, end: start + at + character.len_utf8() },
            };
            return composed(text.char_indices().map(letter).collect());
        }
        let mut letters = Vec::with_capacity(text.len());
        for (at, &byte) in text.iter().enumerate() {
            let span = Span { start: start + at, end: start + at + 1 };
            let characters = &mut self.characters;
            match byte {
                // Shift out, shift in.
                14 => characters.alternate_selected = true,
                15 => characters.alternate_selected = false,
                0..=31 => letters.push(Letter { character: char::from(byte), span }),
                _ => {
                    let font = if characters.alternate_selected {
                        characters.alternate
                    } else {
                        characters.standard
                    };
                    letters.push(Letter { character: font.set.character(byte), span });
                }
            }
        }
        composed(letters)
    }

    /// The advance of a character along the base line, in widths.
    fn advance(&self, character: char) -> f64 {
        self.spacing().advance(Glyph::of(character))
    }

    /// From one character to the next: along the text path.
    fn advance_step(&self, character: char, shape: &Shape) -> Vec2 {
        self.spacing().step(Glyph::of(character), shape)
    }

    /// From one line to the next: a quarter turn clockwise from the text path.
    fn feed_step(&self, shape: &Shape) -> Vec2 {
        let line = CELL.y * (1.0 + self.characters.extra.y);
        let cell = CELL.x * (1.0 + self.characters.extra.x);
        let step = match self.characters.path {
            1 => shape.step(-cell, 0.0),
            2 => shape.step(0.0, line),
            3 => shape.step(cell, 0.0),
            _ => shape.step(0.0, -line),
        };
        if self.characters.reverse_feed { -step } else { step }
    }

    /// Where a line of text begins so that it is justified about the pen.
    ///
    /// Origins 1 to 9 count up the left side, the middle and the right side of the text from its
    /// base; 11 to 19 are the same half a character away from it.
    fn justification(&self, line: &[Letter], shape: &Shape) -> Vec2 {
        let origin = match self.characters.origin {
            21 => 1,
            origin => origin,
        };
        let cell = f64::from((origin % 10).clamp(1, 9) - 1);
        let (column, row) = ((cell / 3.0).floor(), cell % 3.0);
        let printing =
            || line.iter().filter(|letter| letter.character >= ' ' && Mark::of(letter.character).is_none());
        let last = printing().next_back().map_or(' ', |letter| letter.character);
        let (width, height) = match self.characters.path {
            0 | 2 => {
                let advances: f64 = printing().map(|letter| self.advance(letter.character)).sum();
                // The gap after the last character is not part of the text.
                ((advances - (self.advance(last) - 1.0)).max(0.0), 1.0)
            }
            _ => {
                let pitch = CELL.y * (1.0 + self.characters.extra.y);
                (1.0, (printing().count() as f64 * pitch - (pitch - 1.0)).max(0.0))
            }
        };
        // The text's box lies right of its first character's origin, or left of or below it, as the
        // path goes.
        let (left, bottom) = match self.characters.path {
            2 => (1.0 - width, 0.0),
            1 => (0.0, 1.0 - height),
            _ => (0.0, 0.0),
        };
        let offset = if origin > 10 { 0.5 } else { 0.0 };
        let x = -left - column / 2.0 * width + (1.0 - column) * offset;
        let y = -bottom - row / 2.0 * height + (1.0 - row) * offset;
        // Nothing to move for the usual origin, whatever the path.
        if origin == 1 { Vec2::ZERO } else { shape.step(x, y) }
    }

    fn line_of_text(&mut self, line: &[Letter], shape: &Shape) {
        let shift = self.justification(line, shape);
        self.set_pen_position(self.position + shift);
        if self.hold_label(line.iter().map(|letter| letter.character), shape) {
            return;
        }
        let mut before = ' ';
        for letter in line {
            match letter.character {
                '\n' => {
                    let feed = self.feed_step(shape);
                    self.margin += feed;
                    self.set_pen_position(self.position + feed);
                }
                '\u{8}' => {
                    let step = self.advance_step(' ', shape);
                    self.set_pen_position(self.position - step);
                }
                '\t' => self.tabulate(shape),
                // Other control characters print nothing and do not advance.
                '\0'..='\u{1f}' => {}
                character => {
                    if let Some(mark) = Mark::of(character) {
                        self.mark(mark, before, shape);
                        continue;
                    }
                    self.letter(*letter, shape);
                    before = character;
                    let step = self.advance_step(character, shape);
                    self.set_pen_position(self.position + step);
                }
            }
        }
    }

    /// On to the next tabulator, counted from the margin.
    fn tabulate(&mut self, shape: &Shape) {
        let step = self.advance_step(' ', shape);
        let come = (self.position - self.margin).dot(step) / step.hypot2();
        let next = ((come / TABULATOR + 1e-6).floor() + 1.0) * TABULATOR;
        if next.is_finite() {
            self.set_pen_position(self.position + (next - come) * step);
        }
    }

    fn letter(&mut self, letter: Letter, shape: &Shape) {
        let character = letter.character;
        let Some(glyph) = Glyph::of(character) else {
            self.report_at(codes::UNKNOWN_CHARACTER, letter.span, || {
                format!(
                    "the character `{}` ({:#x}) is not in the font",
                    character.escape_debug(),
                    u32::from(character)
                )
            });
            return;
        };
        self.glyph(glyph, shape, self.position, self.spacing().shift(glyph), 0.0);
    }

    /// Draws a mark on the character before the pen, which stays where it is.
    fn mark(&mut self, mark: Mark, before: char, shape: &Shape) {
        let Some(glyph) = Glyph::of(mark.sign) else { return };
        let step = self.advance_step(before, shape);
        let origin = self.position - step;
        let shift_x = 0.5 * (BODY_WIDTH - glyph.advance);
        // A mark over two characters stands in the middle of them.
        let origin = origin - 0.5 * f64::from(mark.width - 1) * step;
        let shift_y = if mark.above {
            // As high as small letters at least: a mark after a blank stands there too.
            let top = Glyph::of(before).map_or(0.0, |glyph| glyph.vertical_extent().1).max(SMALL_LETTER);
            top + MARK_GAP - glyph.vertical_extent().0
        } else {
            0.0
        };
        self.glyph(glyph, shape, origin, shift_x, shift_y);
    }

    /// Draws a glyph with its origin at a position, offset in units of the font.
    fn glyph(&mut self, glyph: Glyph, shape: &Shape, origin: Point, shift_x: f64, shift_y: f64) {
        let dashes = self.tracer.swap_dashes(None);
        for stroke in glyph.strokes() {
            let mut from = None;
            for point in stroke {
                let at = lettering::place(shape, origin, point, (shift_x, shift_y));
                if !self.is_sane(at) {
                    break;
                }
                let at = self.frame.mm_of_plu(at);
                match from {
                    None => self.tracer.lower(at),
                    Some(from) => self.tracer.line(from, at),
                }
                from = Some(at);
            }
            self.tracer.finish();
        }
        self.tracer.swap_dashes(dashes);
    }

    /// `BL`: keeps a label for `PB`.
    pub(super) fn buffer_label(&mut self, text: &[u8], start: usize) {
        self.label_buffer = (text.to_vec(), start);
    }

    /// `PB`: prints what `BL` kept.
    pub(super) fn print_buffer(&mut self) {
        let (text, start) = self.label_buffer.clone();
        self.label(&text, start);
    }

    /// `CP`: moves by cells and lines; without numbers, to the margin and one line on.
    pub(super) fn character_plot(&mut self, p: &[f64]) {
        if !self.leaves_polygons_alone() {
            return;
        }
        if self.label_end != Some(self.position) {
            self.margin = self.position;
        }
        let shape = self.shape();
        let (feed, advance) = (self.feed_step(&shape), self.advance_step(' ', &shape));
        let to = match *p {
            [] => {
                self.margin += feed;
                self.margin
            }
            [spaces, ref lines @ ..] => {
                // Lines count upwards: a positive number goes back.
                let lines = -lines.first().copied().unwrap_or(0.0) * feed;
                self.margin += lines;
                self.position + spaces * advance + lines
            }
        };
        self.tracer.finish();
        if self.is_sane(to) {
            self.set_pen_position(to);
        }
        self.label_end = Some(self.position);
    }

    /// `SM`: a symbol at every point from now on; none ends it.
    pub(super) fn symbol_mode(&mut self, text: &[u8], start: usize) {
        let letter = self.letters(text, start).into_iter().next();
        self.symbol = letter.and_then(|letter| {
            let glyph = Glyph::of(Mark::of(letter.character).map_or(letter.character, |mark| mark.sign));
            if glyph.is_none() {
                let character = letter.character;
                self.report_at(codes::UNKNOWN_CHARACTER, letter.span, || {
                    format!("the symbol `{}` is not in the font", character.escape_debug())
                });
            }
            glyph
        });
    }

    /// Draws the symbol, its middle on the pen.
    pub(super) fn draw_symbol(&mut self, glyph: Glyph) {
        let shape = self.shape();
        self.ink();
        self.tracer.finish();
        let (x, y) = glyph.middle();
        self.glyph(glyph, &shape, self.position, -x, -y);
    }

    /// `UC`: a character of the user's, as steps on a grid in its cell, with pen control between
    /// them. The pen begins up, and is left one cell on.
    pub(super) fn user_character(&mut self, p: &[f64]) {
        if !self.leaves_polygons_alone() {
            return;
        }
        if self.label_end != Some(self.position) {
            self.margin = self.position;
        }
        let shape = self.shape();
        let origin = self.position;
        self.ink();
        self.tracer.finish();
        let dashes = self.tracer.swap_dashes(None);
        let (mut x, mut y, mut down) = (0.0, 0.0, false);
        let mut rest = p;
        while let [first, more @ ..] = rest {
            if first.abs() >= PEN_CONTROL {
                down = *first > 0.0;
                self.tracer.finish();
                rest = more;
                continue;
            }
            let [dy, more @ ..] = more else {
                self.report(codes::ODD_COORDINATES, || {
                    "`UC` ends with an x without y, which is skipped".into()
                });
                break;
            };
            let from = shape.at(origin, x / GRID.x, y / GRID.y);
            (x, y) = (x + first, y + dy);
            let to = shape.at(origin, x / GRID.x, y / GRID.y);
            if down && self.is_sane(from) && self.is_sane(to) {
                self.tracer.line(self.frame.mm_of_plu(from), self.frame.mm_of_plu(to));
            }
            rest = more;
        }
        self.tracer.finish();
        self.tracer.swap_dashes(dashes);
        let step = self.advance_step(' ', &shape);
        if self.is_sane(origin + step) {
            self.set_pen_position(origin + step);
        }
        self.label_end = Some(self.position);
    }
}

/// Letters and the marks after them as the letters that the font has for both.
fn composed(letters: Vec<Letter>) -> Vec<Letter> {
    if letters.iter().all(|letter| Mark::of(letter.character).is_none()) {
        return letters;
    }
    let mut result: Vec<Letter> = Vec::with_capacity(letters.len());
    for letter in letters {
        let with_mark = result.last().and_then(|last| compose(last.character, letter.character));
        if let Some((last, character)) = result.last_mut().zip(with_mark) {
            *last = Letter { character, span: Span { start: last.span.start, end: letter.span.end } };
        } else {
            result.push(letter);
        }
    }
    result
}
