//! What a picture shows beside its ink: lines in colours of their own, the machine in a pose, and a
//! key to the colours.

use std::collections::BTreeMap;

use drawing::Point;

use crate::palette::Colour;

/// The colour of ink that the machine cannot draw.
pub const BEYOND: Colour = [0xD0, 0x00, 0x20];
/// The colour of ink that is still to come.
pub(crate) const AHEAD: Colour = [0xCC, 0xD1, 0xD6];
pub(crate) const RAIL: Colour = [0x8F, 0x9A, 0xA5];
pub(crate) const LINK: Colour = [0x44, 0x50, 0x5C];

/// Additions to a picture; none by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlay {
    /// Ink still to come, under the ink.
    pub ahead: Vec<Vec<Point>>,
    /// Lines over the ink.
    pub lines: Vec<ColoredLine>,
    /// The machine over all of it.
    pub machine: Option<MachinePose>,
    /// What the colours mean.
    pub key: Option<Key>,
    /// Names of pens in the legend, in the place of their numbers.
    pub pen_names: BTreeMap<u16, String>,
}

/// A line in a colour of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct ColoredLine {
    /// Its colour.
    pub color: Colour,
    /// Its points, mm.
    pub points: Vec<Point>,
}

/// A machine in a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct MachinePose {
    /// Guides, from point to point.
    pub rails: Vec<[Point; 2]>,
    /// Links and beams.
    pub links: Vec<[Point; 2]>,
    /// Bearings and carriages.
    pub pivots: Vec<Point>,
    /// The pen.
    pub pen: Point,
    /// The number of the pen that is down.
    pub is_down: Option<u16>,
}

impl MachinePose {
    /// All of its points.
    pub fn points(&self) -> impl Iterator<Item = Point> + '_ {
        let ends = self.rails.iter().chain(&self.links).flatten();
        ends.chain(&self.pivots).copied().chain([self.pen])
    }
}

/// What colours mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// What they show, with its unit.
    pub title: Label,
    /// The colours.
    pub colors: KeyColors,
}

/// The colours of a key.
#[derive(Clone, Debug, PartialEq)]
pub enum KeyColors {
    /// Each colour with its meaning.
    Kinds(Vec<(Colour, Label)>),
    /// From the smallest to the largest value.
    Scale {
        /// The colours in their order.
        colors: Vec<Colour>,
        /// The smallest and the largest value.
        ends: [Label; 2],
    },
}

/// A text, also as strokes: pictures in pixels have no fonts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Label {
    /// The text.
    pub text: String,
    /// Its strokes; letters are 1 high, and the text begins at the origin.
    pub strokes: Vec<Vec<Point>>,
}
