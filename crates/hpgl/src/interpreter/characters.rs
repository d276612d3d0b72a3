//! How characters look and where they go: `SI SR DI DR SL ES LO DV CS CA SS SA SD AD`.

use drawing::{Point, Vec2};

use super::Interpreter;
use crate::codes;
use crate::fonts::CharacterSet;

/// Character size where none is set: width and height of a capital, cm. The 7475A's on A4 paper;
/// HP-GL/2's stick font of 9 characters an inch and 11.5 points agrees within 0.5 %.
const DEFAULT_SIZE_CM: (f64, f64) = (0.1879, 0.269);
/// `SR` without parameters: percent of P2 - P1.
const DEFAULT_SIZE_PERCENT: (f64, f64) = (0.75, 1.5);
/// A character's cell, in widths and heights of a capital.
pub(super) const CELL: Vec2 = Vec2::new(1.5, 2.0);

/// How large characters are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Size {
    /// Width and height, cm.
    Absolute(f64, f64),
    /// Percent of P2 - P1 along x and y.
    Relative(f64, f64),
}

/// Where the base line goes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Direction {
    /// Run and rise in plotter units.
    Absolute(f64, f64),
    /// Run and rise in percent of P2 - P1.
    Relative(f64, f64),
}

/// One of the two fonts that labels can change between.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Font {
    pub(super) set: CharacterSet,
    /// Each character as wide as it is, instead of all in cells of one width.
    pub(super) proportional: bool,
}

/// The state of the character group.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Characters {
    size: Size,
    direction: Direction,
    /// Tangent of the slant.
    pub(super) slant: f64,
    /// Space added to a cell, in parts of it: along and across the line.
    pub(super) extra: Vec2,
    /// Label origin, 1 to 9, 11 to 19, 21.
    pub(super) origin: u8,
    /// Quarter turns clockwise from the base line to the way that characters follow each other.
    pub(super) path: u8,
    /// Line feeds go the other way.
    pub(super) reverse_feed: bool,
    pub(super) standard: Font,
    pub(super) alternate: Font,
    pub(super) alternate_selected: bool,
}

impl Default for Characters {
    fn default() -> Self {
        Self {
            size: Size::Absolute(DEFAULT_SIZE_CM.0, DEFAULT_SIZE_CM.1),
            direction: Direction::Absolute(1.0, 0.0),
            slant: 0.0,
            extra: Vec2::ZERO,
            origin: 1,
            path: 0,
            reverse_feed: false,
            standard: Font::default(),
            alternate: Font::default(),
            alternate_selected: false,
        }
    }
}

/// The shape of characters on the page, in plotter units of the turned frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shape {
    /// One character width along the base line.
    pub(super) right: Vec2,
    /// One capital height, at right angles to it.
    pub(super) up: Vec2,
    /// How far a point one capital height above the base line leans along it.
    pub(super) lean: Vec2,
}

impl Shape {
    /// The offset of a point given in widths and heights.
    pub(super) fn at(&self, origin: Point, x: f64, y: f64) -> Point {
        origin + x * self.right + y * (self.up + self.lean)
    }

    /// The step of that many widths and heights; slant moves no cells.
    pub(super) fn step(&self, x: f64, y: f64) -> Vec2 {
        x * self.right + y * self.up
    }
}

impl Interpreter {
    pub(super) fn shape(&self) -> Shape {
        let characters = &self.characters;
        let (p1, p2) = self.frame.points();
        let extent = p2 - p1;
        let unit = self.frame.unit_mm();
        let (width, height) = match characters.size {
            Size::Absolute(width, height) => (width * 10.0 / unit, height * 10.0 / unit),
            Size::Relative(width, height) => {
                (width / 100.0 * extent.x.abs(), height / 100.0 * extent.y.abs())
            }
        };
        let direction = match characters.direction {
            Direction::Absolute(run, rise) => Vec2::new(run, rise),
            Direction::Relative(run, rise) => Vec2::new(run * extent.x, rise * extent.y),
        };
        let along = direction / direction.hypot2().sqrt();
        let across = Vec2::new(-along.y, along.x);
        Shape { right: width * along, up: height * across, lean: characters.slant * height * along }
    }

    pub(super) fn size_absolute(&mut self, p: &[f64]) {
        self.characters.size = match *p {
            [] => Size::Absolute(DEFAULT_SIZE_CM.0, DEFAULT_SIZE_CM.1),
            [width, height, ..] if width != 0.0 && height != 0.0 => Size::Absolute(width, height),
            _ => return self.bad_parameters("a width and a height in cm"),
        };
    }

    pub(super) fn size_relative(&mut self, p: &[f64]) {
        self.characters.size = match *p {
            [] => Size::Relative(DEFAULT_SIZE_PERCENT.0, DEFAULT_SIZE_PERCENT.1),
            [width, height, ..] if width != 0.0 && height != 0.0 => Size::Relative(width, height),
            _ => return self.bad_parameters("a width and a height in percent"),
        };
    }

    pub(super) fn direction_absolute(&mut self, p: &[f64]) {
        self.set_direction(p, Direction::Absolute);
    }

    pub(super) fn direction_relative(&mut self, p: &[f64]) {
        self.set_direction(p, Direction::Relative);
    }

    fn set_direction(&mut self, p: &[f64], direction: impl FnOnce(f64, f64) -> Direction) {
        self.characters.direction = match *p {
            [] => direction(1.0, 0.0),
            [run, rise, ..] if run != 0.0 || rise != 0.0 => direction(run, rise),
            _ => return self.bad_parameters("a run and a rise, not both 0"),
        };
        self.margin = self.position;
    }

    pub(super) fn slant(&mut self, p: &[f64]) {
        self.characters.slant = p.first().copied().unwrap_or(0.0);
    }

    pub(super) fn extra_space(&mut self, p: &[f64]) {
        self.characters.extra =
            Vec2::new(p.first().copied().unwrap_or(0.0), p.get(1).copied().unwrap_or(0.0));
    }

    pub(super) fn label_origin(&mut self, p: &[f64]) {
        match p.first().copied().unwrap_or(1.0).trunc() {
            origin if (1.0..=9.0).contains(&origin) || (11.0..=19.0).contains(&origin) || origin == 21.0 => {
                self.characters.origin = origin as u8;
                self.margin = self.position;
            }
            _ => self.bad_parameters("a label origin: 1 to 9, 11 to 19 or 21"),
        }
    }

    pub(super) fn text_path(&mut self, p: &[f64]) {
        match p.first().copied().unwrap_or(0.0).trunc() {
            path if (0.0..=3.0).contains(&path) => {
                self.characters.path = path as u8;
                self.characters.reverse_feed = p.get(1) == Some(&1.0);
                self.margin = self.position;
            }
            _ => self.bad_parameters("a text path from 0 to 3"),
        }
    }

    /// `CS` and `CA`: character sets of HP-GL plotters.
    pub(super) fn character_set(&mut self, p: &[f64], alternate: bool) {
        let number = p.first().copied().unwrap_or(0.0);
        let set = CharacterSet::of_plotter(number);
        let name = CharacterSet::name_of_plotter_set(number);
        self.set_character_set(set, number, name, alternate);
    }

    fn set_character_set(
        &mut self,
        set: Option<CharacterSet>,
        number: f64,
        name: Option<&str>,
        alternate: bool,
    ) {
        let font = if alternate { &mut self.characters.alternate } else { &mut self.characters.standard };
        font.set = set.unwrap_or_default();
        if set.is_none() {
            self.report(codes::UNKNOWN_CHARACTER_SET, || {
                let name = name.map(|name| format!(" ({name})")).unwrap_or_default();
                format!("character set {number}{name} is not built in; ISO 8859-1 is taken")
            });
        }
    }

    /// `SD` and `AD`: pairs of a kind and its value. Kind 1 is the symbol set, 2 the spacing, 4 the
    /// height in points.
    pub(super) fn font_definition(&mut self, p: &[f64], alternate: bool) {
        for pair in p.chunks_exact(2) {
            let font = if alternate { &mut self.characters.alternate } else { &mut self.characters.standard };
            match pair[0] as i32 {
                1 => {
                    let set = CharacterSet::of_symbol_set(pair[1]);
                    self.set_character_set(set, pair[1], None, alternate);
                }
                2 => font.proportional = pair[1] == 1.0,
                _ => {}
            }
        }
    }

    pub(super) fn select_font(&mut self, alternate: bool) {
        self.characters.alternate_selected = alternate;
    }
}
