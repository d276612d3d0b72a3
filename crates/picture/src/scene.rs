//! A picture of a drawing or a plan on its machine: sheet, reach, ink by pen, travel, start.

use std::io::{self, Write};

use drawing::{Point, Rect, Stroke};

use crate::overlay::{AHEAD, Key, KeyColors, LINK, MachinePose, Overlay, RAIL};
use crate::palette::{Colour, PenColors, colour_on_white, hex};
use crate::svg::{path, point, polyline, view_box};
use plan::file::text::Text;

pub(crate) const REACH_FILL: Colour = [0xEE, 0xF3, 0xF8];
pub(crate) const REACH_LINE: Colour = [0xA9, 0xB9, 0xC9];
pub(crate) const SHEET_LINE: Colour = [0x55, 0x55, 0x55];
pub(crate) const TRAVEL: Colour = [0x8C, 0x8C, 0x8C];
pub(crate) const REFERENCE: Colour = [0x9C, 0xC8, 0xF0];
pub(crate) const START: Colour = [0xB0, 0x00, 0x20];
/// Shades from the smallest to the largest value: light to dark orange.
const SHADES: [Colour; 2] = [[0xFF, 0xF4, 0xE0], [0xC8, 0x64, 0x00]];

/// Widths and lengths in mm, for a page of any size: ink is as wide as a pen's, the rest is thinner.
pub(crate) const INK_MM: f64 = 0.3;
pub(crate) const REFERENCE_MM: f64 = 0.8;
pub(crate) const OUTLINE_MM: f64 = 0.25;
pub(crate) const TRAVEL_MM: f64 = 0.12;
pub(crate) const DASH_MM: f64 = 1.0;

/// What a picture shows, in mm of the machine's frame, y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// What the picture is of.
    pub title: String,
    /// The sheet of paper.
    pub sheet: Rect,
    /// Closed outlines of where the pen can go; what is inside an odd number of them can be reached.
    pub reach: Vec<Vec<Point>>,
    /// A quantity over the workspace, below everything else.
    pub shades: Option<Shades>,
    /// What the ink should be, for comparison: drawn wider and lighter below the ink.
    pub reference: Vec<Vec<Point>>,
    /// What is drawn, in its order.
    pub ink: Vec<Ink>,
    /// The pens' own colours.
    pub colors: PenColors,
    /// The ways with the pen up.
    pub travel: Vec<Vec<Point>>,
    /// Where the pen starts.
    pub start: Option<Point>,
    /// Colours of its own, and the machine.
    pub overlay: Overlay,
}

/// One connected line of ink.
#[derive(Clone, Debug, PartialEq)]
pub struct Ink {
    /// The pen's number, 1 and up.
    pub pen: u16,
    /// Its path.
    pub line: InkLine,
}

/// The path of ink.
#[derive(Clone, Debug, PartialEq)]
pub enum InkLine {
    /// A polyline, mm; a single point is a dot.
    Points(Vec<Point>),
    /// A stroke, whose arcs and curves stay what they are.
    Stroke(Stroke),
}

/// A quantity over the workspace as cells of equal value.
#[derive(Clone, Debug, PartialEq)]
pub struct Shades {
    /// What it is, with its unit: `tick floor, mm`.
    pub title: String,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Each cell with its level, from 0 (smallest) to [`LEVELS`] - 1.
    pub cells: Vec<(Rect, usize)>,
}

/// Levels of shades.
pub const LEVELS: usize = 8;

/// The colour of a level of shade.
pub(crate) fn shade(level: usize) -> Colour {
    let share = level.min(LEVELS - 1) as f64 / (LEVELS - 1) as f64;
    let [light, dark] = SHADES;
    let mix = |channel: usize| {
        let [a, b] = [light[channel], dark[channel]].map(f64::from);
        (a + share * (b - a)).round() as u8
    };
    [mix(0), mix(1), mix(2)]
}

impl Scene {
    /// The pens that draw, each once, in the order of their numbers.
    pub fn pens(&self) -> Vec<u16> {
        let mut pens: Vec<u16> = self.ink.iter().map(|ink| ink.pen).collect();
        pens.sort_unstable();
        pens.dedup();
        pens
    }

    /// The smallest upright rectangle that holds sheet, ink, travel and start, mm, and a margin; points that are not finite
    /// aside. The reach of an arm may go far beyond: what of it lies outside is not shown.
    pub fn bounds(&self) -> Rect {
        let ink = self.ink.iter().flat_map(|ink| match &ink.line {
            InkLine::Points(points) => points.clone(),
            InkLine::Stroke(stroke) => {
                let bounds = stroke.bounding_box();
                vec![Point::new(bounds.x0, bounds.y0), Point::new(bounds.x1, bounds.y1)]
            }
        });
        let Overlay { ahead, lines, machine, .. } = &self.overlay;
        let lines = lines.iter().map(|line| &line.points).chain(ahead);
        let others =
            self.travel.iter().chain(&self.reference).chain(lines).flatten().chain(&self.start).copied();
        let others = others.chain(machine.iter().flat_map(MachinePose::points));
        let points = ink.chain(others).filter(|point| point.is_finite());
        let bounds = points.fold(self.sheet.abs(), |bounds, point| bounds.union_pt(point));
        let cells = self.shades.iter().flat_map(|shades| &shades.cells);
        let bounds = cells.fold(bounds, |bounds, (cell, _)| bounds.union(*cell));
        let margin = 1.0 + 0.02 * bounds.width().max(bounds.height());
        bounds.inflate(margin, margin)
    }
}

/// Writes the picture as SVG: one unit is one mm, y is the machine's negated, and a legend stands below.
///
/// # Errors
/// Whatever the writer says.
pub fn svg<W: Write + ?Sized>(scene: &Scene, out: &mut W) -> io::Result<()> {
    let mut text = Text::new(out);
    let bounds = scene.bounds();
    let legend = Legend::of(scene, bounds);
    text.str("<svg xmlns=\"http://www.w3.org/2000/svg\"");
    let page = Rect { y0: bounds.y0 - legend.height_mm(), ..bounds };
    view_box(&mut text, page);
    text.str(" fill=\"none\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n<title>");
    escaped(&mut text, &scene.title);
    text.str("</title>\n<rect");
    rectangle(&mut text, page);
    text.str(" fill=\"#ffffff\"/>\n");

    text.str("<path id=\"reach\" fill-rule=\"evenodd\" fill=\"").str(&hex(REACH_FILL));
    text.str("\" stroke=\"").str(&hex(REACH_LINE)).str("\" stroke-width=\"").fixed(OUTLINE_MM).str("\" d=\"");
    for outline in scene.reach.iter().filter(|outline| !outline.is_empty()) {
        polyline(&mut text, outline)?;
        text.byte(b'Z');
    }
    text.str("\"/>\n");
    if let Some(shades) = &scene.shades {
        write_shades(&mut text, shades)?;
    }
    text.str("<rect id=\"sheet\"");
    rectangle(&mut text, scene.sheet.abs());
    text.str(" stroke=\"").str(&hex(SHEET_LINE)).str("\" stroke-width=\"").fixed(OUTLINE_MM).str("\"/>\n");

    text.str("<path id=\"travel\" stroke=\"").str(&hex(TRAVEL)).str("\" stroke-width=\"").fixed(TRAVEL_MM);
    text.str("\" stroke-dasharray=\"").fixed(DASH_MM).str("\" d=\"");
    for travel in &scene.travel {
        polyline(&mut text, travel)?;
    }
    text.str("\"/>\n");
    if !scene.reference.is_empty() {
        text.str("<path id=\"reference\" stroke=\"").str(&hex(REFERENCE)).str("\" stroke-width=\"");
        text.fixed(REFERENCE_MM).str("\" d=\"");
        for line in &scene.reference {
            polyline(&mut text, line)?;
        }
        text.str("\"/>\n");
    }
    write_lines(&mut text, "ahead", AHEAD, scene.overlay.ahead.iter())?;
    for pen in scene.pens() {
        text.str("<g id=\"pen").int(pen).str("\" stroke=\"").str(&hex(colour_on_white(pen, &scene.colors)));
        text.str("\" stroke-width=\"").fixed(INK_MM).str("\">\n");
        for ink in scene.ink.iter().filter(|ink| ink.pen == pen) {
            text.str("<path d=\"");
            match &ink.line {
                InkLine::Points(points) => polyline(&mut text, points)?,
                InkLine::Stroke(stroke) => path(&mut text, stroke)?,
            }
            text.str("\"/>\n").flush_if_full()?;
        }
        text.str("</g>\n");
    }
    for color in colors_of(&scene.overlay) {
        let lines = scene.overlay.lines.iter().filter(|line| line.color == color);
        write_lines(&mut text, "colored", color, lines.map(|line| &line.points))?;
    }
    if let Some(machine) = &scene.overlay.machine {
        write_machine(&mut text, machine, scene);
    }
    if let Some(start) = scene.start {
        text.str("<path id=\"start\" stroke=\"").str(&hex(START)).str("\" stroke-width=\"").fixed(OUTLINE_MM);
        text.str("\" d=\"");
        cross(&mut text, start, 0.5 * legend.size_mm);
        text.str("\"/>\n");
    }
    legend.write(&mut text, scene, bounds);
    text.str("</svg>\n");
    text.finish()
}

/// The colours of lines, each once, in the order of their first use.
pub(crate) fn colors_of(overlay: &Overlay) -> Vec<Colour> {
    let mut colors = Vec::new();
    for line in &overlay.lines {
        if !colors.contains(&line.color) {
            colors.push(line.color);
        }
    }
    colors
}

/// Lines of one colour as one path. Writes no element for an empty list.
fn write_lines<'a, W: Write + ?Sized>(
    text: &mut Text<'_, W>,
    class: &str,
    color: Colour,
    lines: impl Iterator<Item = &'a Vec<Point>>,
) -> io::Result<()> {
    let mut lines = lines.peekable();
    if lines.peek().is_none() {
        return Ok(());
    }
    text.str("<path class=\"").str(class).str("\" stroke=\"").str(&hex(color));
    text.str("\" stroke-width=\"").fixed(INK_MM).str("\" d=\"");
    for line in lines {
        polyline(text, line)?;
    }
    text.str("\"/>\n");
    Ok(())
}

/// The width of a machine's links, mm: a share of the sheet.
pub(crate) fn link_mm(scene: &Scene) -> f64 {
    scene.sheet.width().abs().max(scene.sheet.height().abs()) / 75.0
}

fn write_machine<W: Write + ?Sized>(text: &mut Text<'_, W>, machine: &MachinePose, scene: &Scene) {
    let width = link_mm(scene);
    text.str("<g id=\"machine\" opacity=\"0.800\">\n");
    let rails = machine.rails.iter().map(|ends| (ends, RAIL, 0.5 * width));
    for (ends, color, width) in rails.chain(machine.links.iter().map(|ends| (ends, LINK, width))) {
        text.str("<path stroke=\"").str(&hex(color)).str("\" stroke-width=\"").fixed(width).str("\" d=\"M");
        point(text, ends[0]);
        text.byte(b'L');
        point(text, ends[1]);
        text.str("\"/>\n");
    }
    let pen = machine.is_down.map_or([0xFF; 3], |pen| colour_on_white(pen, &scene.colors));
    let pivots = machine.pivots.iter().map(|at| (*at, 0.8 * width, [0xFF; 3], LINK));
    for (at, radius, fill, line) in pivots.chain([(machine.pen, 0.6 * width, pen, START)]) {
        text.str("<circle cx=\"").fixed(at.x).str("\" cy=\"").fixed(-at.y).str("\" r=\"").fixed(radius);
        text.str("\" fill=\"").str(&hex(fill)).str("\" stroke=\"").str(&hex(line)).str("\" stroke-width=\"");
        text.fixed(0.3 * width).str("\"/>\n");
    }
    text.str("</g>\n");
}

/// The cells, one path a level.
fn write_shades<W: Write + ?Sized>(text: &mut Text<'_, W>, shades: &Shades) -> io::Result<()> {
    text.str("<g id=\"shades\">\n");
    for level in 0..LEVELS {
        text.str("<path fill=\"").str(&hex(shade(level))).str("\" d=\"");
        for (cell, _) in shades.cells.iter().filter(|(_, its)| *its == level) {
            text.byte(b'M');
            point(text, Point::new(cell.x0, cell.y1));
            text.byte(b'h').fixed(cell.width()).byte(b'v').fixed(cell.height());
            text.byte(b'h').fixed(-cell.width()).byte(b'Z');
            text.flush_if_full()?;
        }
        text.str("\"/>\n");
    }
    text.str("</g>\n");
    Ok(())
}

/// Text below the picture: the title, the sheet's size, and the pens with their colours.
struct Legend {
    size_mm: f64,
    pens_a_line: usize,
    lines: usize,
}

impl Legend {
    fn of(scene: &Scene, bounds: Rect) -> Self {
        let size_mm = bounds.width().max(bounds.height()) / 60.0;
        // A pen's entry is six letters wide with its line of colour.
        let pens_a_line = (bounds.width() / (6.0 * size_mm)).floor().max(1.0) as usize;
        let shades = usize::from(scene.shades.is_some());
        let pens = scene.pens().len().div_ceil(pens_a_line);
        let key = scene.overlay.key.as_ref().map_or(0, key_lines);
        Self { size_mm, pens_a_line, lines: 2 + shades + pens + key }
    }

    fn height_mm(&self) -> f64 {
        (self.lines as f64 + 0.5) * 1.4 * self.size_mm
    }

    fn write<W: Write + ?Sized>(&self, text: &mut Text<'_, W>, scene: &Scene, bounds: Rect) {
        let line = |index: usize| bounds.y0 - 1.4 * self.size_mm * index as f64;
        text.str("<g id=\"legend\" fill=\"#333333\" font-family=\"sans-serif\" font-size=\"")
            .fixed(self.size_mm);
        text.str("\">\n");
        let left = bounds.x0 + self.size_mm;
        label(text, Point::new(left, line(1)));
        escaped(text, &scene.title);
        text.str("</text>\n");
        label(text, Point::new(left, line(2)));
        let tenths = |length: f64| (length * 10.0).round() / 10.0;
        text.str("sheet ").float(tenths(scene.sheet.width().abs())).str(" x ");
        text.float(tenths(scene.sheet.height().abs())).str(" mm</text>\n");
        if let Some(shades) = &scene.shades {
            self.write_shades(text, shades, Point::new(left, line(3)));
        }
        for (index, pen) in scene.pens().into_iter().enumerate() {
            let at = Point::new(
                left + 6.0 * self.size_mm * (index % self.pens_a_line) as f64,
                line(3 + index / self.pens_a_line),
            );
            text.str("<path stroke=\"")
                .str(&hex(colour_on_white(pen, &scene.colors)))
                .str("\" stroke-width=\"");
            text.fixed(0.3 * self.size_mm).str("\" d=\"M");
            point(text, at + (0.0, 0.3 * self.size_mm));
            text.byte(b'h').fixed(1.2 * self.size_mm).str("\"/>\n");
            label(text, at + (1.7 * self.size_mm, 0.0));
            match scene.overlay.pen_names.get(&pen) {
                Some(name) => escaped(text, name),
                None => {
                    text.str("pen ").int(pen);
                }
            }
            text.str("</text>\n");
        }
        if let Some(key) = &scene.overlay.key {
            let first = self.lines - key_lines(key) + 1;
            self.write_key(text, key, |index| Point::new(left, line(first + index)));
        }
        text.str("</g>\n");
    }

    /// The key: its title, then a line for each colour, or one with the scale.
    fn write_key<W: Write + ?Sized>(&self, text: &mut Text<'_, W>, key: &Key, line: impl Fn(usize) -> Point) {
        let size = self.size_mm;
        write_words(text, line(0), &key.title.text);
        match &key.colors {
            KeyColors::Kinds(kinds) => {
                for (index, (color, meaning)) in kinds.iter().enumerate() {
                    let at = line(1 + index);
                    text.str("<path stroke=\"").str(&hex(*color)).str("\" stroke-width=\"").fixed(0.3 * size);
                    text.str("\" d=\"M");
                    point(text, at + (0.0, 0.3 * size));
                    text.byte(b'h').fixed(1.2 * size).str("\"/>\n");
                    write_words(text, at + (1.7 * size, 0.0), &meaning.text);
                }
            }
            KeyColors::Scale { colors, ends } => {
                let start = line(1) + (KEY_START * size, 0.0);
                let width = KEY_WIDTH * size / colors.len() as f64;
                for (index, color) in colors.iter().enumerate() {
                    text.str("<rect fill=\"").str(&hex(*color)).str("\"");
                    let corner = start + (width * index as f64, 0.0);
                    // A little wider, so that no gap shows between neighbours.
                    rectangle(text, Rect::from_points(corner, corner + (1.05 * width, 0.8 * size)));
                    text.str("/>\n");
                }
                write_words(text, line(1), &ends[0].text);
                write_words(text, start + (KEY_WIDTH * size + 0.7 * size, 0.0), &ends[1].text);
            }
        }
    }

    /// The levels as a row of squares, between the smallest and the largest value.
    fn write_shades<W: Write + ?Sized>(&self, text: &mut Text<'_, W>, shades: &Shades, at: Point) {
        for level in 0..LEVELS {
            text.str("<rect fill=\"").str(&hex(shade(level))).str("\"");
            let corner = at + (self.size_mm * level as f64, 0.0);
            rectangle(text, Rect::from_points(corner, corner + (self.size_mm, self.size_mm)));
            text.str("/>\n");
        }
        label(text, at + (self.size_mm * (LEVELS as f64 + 0.7), 0.0));
        escaped(text, &shades.title);
        let [low, high] = shades.range.map(|value| (value * 1e4).round() / 1e4);
        text.str(": ").float(low).str(" (light) to ").float(high).str(" (dark)</text>\n");
    }
}

/// Where the scale of a key begins, and its width, in heights of letters.
pub(crate) const KEY_START: f64 = 6.0;
pub(crate) const KEY_WIDTH: f64 = 16.0;

/// Lines of text of a key.
pub(crate) fn key_lines(key: &Key) -> usize {
    match &key.colors {
        KeyColors::Kinds(kinds) => 1 + kinds.len(),
        KeyColors::Scale { .. } => 2,
    }
}

fn write_words<W: Write + ?Sized>(text: &mut Text<'_, W>, at: Point, words: &str) {
    label(text, at);
    escaped(text, words);
    text.str("</text>\n");
}

fn label<W: Write + ?Sized>(text: &mut Text<'_, W>, at: Point) {
    text.str("<text x=\"").fixed(at.x).str("\" y=\"").fixed(-at.y).str("\">");
}

pub(crate) fn rectangle<W: Write + ?Sized>(text: &mut Text<'_, W>, rect: Rect) {
    text.str(" x=\"").fixed(rect.x0).str("\" y=\"").fixed(-rect.y1);
    text.str("\" width=\"").fixed(rect.width()).str("\" height=\"").fixed(rect.height()).byte(b'"');
}

fn cross<W: Write + ?Sized>(text: &mut Text<'_, W>, at: Point, arm_mm: f64) {
    for direction in [(arm_mm, arm_mm), (arm_mm, -arm_mm)] {
        text.byte(b'M');
        point(text, at - direction);
        text.byte(b'L');
        point(text, at + direction);
    }
}

/// Text for XML. Characters that XML cannot hold are left out.
pub(crate) fn escaped<W: Write + ?Sized>(text: &mut Text<'_, W>, words: &str) {
    for letter in words.chars() {
        match letter {
            '&' => text.str("&amp;"),
            '<' => text.str("&lt;"),
            '>' => text.str("&gt;"),
            '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => text,
            _ => text.str(letter.encode_utf8(&mut [0; 4])),
        };
    }
}
