//! Pens: numbers of layers and colours.

use std::collections::{BTreeMap, BTreeSet};

use drawing::{Pen, Stroke};

use crate::{PenSettings, Pens};

/// A layer by its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Layer {
    pub(crate) name: String,
    /// The number that its name begins with, 1 and up.
    number: Option<u16>,
}

impl Layer {
    /// The layer of a name. A `!` before it (`AxiDraw`'s pause) does not count, nor does `pen`
    /// (Inkscape's export of HP-GL takes the number after it).
    pub(crate) fn new(name: &str) -> Self {
        let text = name.trim_start_matches(['!', ' ']);
        let is_pen = text.get(..3).is_some_and(|pen| pen.eq_ignore_ascii_case("pen"));
        let text = if is_pen { text[3..].trim_start() } else { text };
        let digits: String = text.chars().take_while(char::is_ascii_digit).collect();
        Self { name: name.to_owned(), number: digits.parse().ok().filter(|&number| number > 0) }
    }

    /// Whether it is documentation, which is not drawn.
    pub(crate) fn is_documentation(&self) -> bool {
        self.name.trim_start().starts_with('%')
    }
}

/// What Illustrator writes for characters that ids must not have: `_x31_` is 1.
pub(crate) fn unescaped(id: &str) -> String {
    let mut text = String::new();
    let mut rest = id;
    while let Some((before, after)) = rest.split_once("_x") {
        text.push_str(before);
        let code = after
            .split_once('_')
            .and_then(|(hex, after)| Some((char::from_u32(u32::from_str_radix(hex, 16).ok()?)?, after)));
        if let Some((character, after)) = code {
            text.push(character);
            rest = after;
        } else {
            text.push_str("_x");
            rest = after;
        }
    }
    text + rest
}

/// What shares a pen.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Group {
    Layer(usize),
    Color([u8; 3]),
    All,
}

/// What a stroke is numbered by, until all strokes are known: its layer and its colour.
#[derive(Debug, Default)]
pub(crate) struct Keys {
    layers: Vec<Layer>,
    list: Vec<(Option<usize>, [u8; 3])>,
    numbers: BTreeMap<(Option<usize>, [u8; 3]), u16>,
}

impl Keys {
    /// The number of a layer, for [`Keys::key`].
    pub(crate) fn layer(&mut self, layer: Layer) -> usize {
        let found = self.layers.iter().position(|known| *known == layer);
        found.unwrap_or_else(|| {
            self.layers.push(layer);
            self.layers.len() - 1
        })
    }

    /// What stands for the pen of such a stroke until [`Keys::number`].
    pub(crate) fn key(&mut self, layer: Option<usize>, color: [u8; 3]) -> Pen {
        let next = self.list.len().min(usize::from(u16::MAX)) as u16;
        let list = &mut self.list;
        Pen(*self.numbers.entry((layer, color)).or_insert_with(|| {
            list.push((layer, color));
            next
        }))
    }

    /// Gives every stroke its pen.
    pub(crate) fn number(self, pens: Pens, strokes: &mut [Stroke]) -> BTreeMap<Pen, PenSettings> {
        let used: BTreeSet<u16> = strokes.iter().map(|stroke| stroke.pen.0).collect();
        let mut order: Vec<u16> = Vec::new();
        let mut seen = BTreeSet::new();
        order.extend(strokes.iter().map(|stroke| stroke.pen.0).filter(|&key| seen.insert(key)));
        let layers: BTreeSet<usize> =
            used.iter().filter_map(|&key| self.list.get(usize::from(key))?.0).collect();
        let numbered = layers.iter().any(|&layer| self.layers[layer].number.is_some());
        let by_layer = pens == Pens::Layers && (layers.len() > 1 || numbered);
        let only = (layers.len() == 1).then(|| layers.first()).flatten();

        let taken: BTreeSet<u16> = if by_layer {
            layers.iter().filter_map(|&layer| self.layers[layer].number).collect()
        } else {
            BTreeSet::new()
        };
        let mut free = (1..=u16::MAX).filter(|number| !taken.contains(number));
        let mut groups: BTreeMap<Group, Pen> = BTreeMap::new();
        let mut settings: BTreeMap<Pen, PenSettings> = BTreeMap::new();
        let mut pen_of: BTreeMap<u16, Pen> = BTreeMap::new();
        for key in order {
            let (layer, color) = self.list.get(usize::from(key)).copied().unwrap_or_default();
            let own = layer.filter(|_| by_layer);
            let number = own.and_then(|layer| self.layers[layer].number);
            let group = match (pens, own) {
                (Pens::One, _) => Group::All,
                (_, Some(layer)) => Group::Layer(layer),
                _ => Group::Color(color),
            };
            let pen = match number {
                Some(number) => Pen(number),
                None => *groups.entry(group).or_insert_with(|| Pen(free.next().unwrap_or(u16::MAX))),
            };
            pen_of.insert(key, pen);
            settings.entry(pen).or_insert_with(|| PenSettings {
                // Strokes outside of all layers have no name, though they may be the only others.
                name: own
                    .or_else(|| layer.filter(|layer| only == Some(layer)))
                    .map(|layer| self.layers[layer].name.clone()),
                color: Some(color),
            });
        }
        for stroke in strokes {
            stroke.pen = pen_of.get(&stroke.pen.0).copied().unwrap_or(Pen(1));
        }
        settings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_layer_names() {
        let number = |name: &str| Layer::new(name).number;
        assert_eq!(number("3 red"), Some(3));
        assert_eq!(number("!12-blue"), Some(12));
        assert_eq!(number("Pen 4 speed 10"), Some(4));
        assert_eq!(number("pencil 4"), None);
        assert_eq!(number("0 none"), None);
        assert_eq!(number("red 3"), None);
        assert_eq!(number("999999"), None);
        assert!(Layer::new(" %guides").is_documentation());
    }

    #[test]
    fn ids_of_illustrator_are_unescaped() {
        assert_eq!(unescaped("_x31__red"), "1_red");
        assert_eq!(unescaped("Layer_1"), "Layer_1");
        assert_eq!(unescaped("_x_y_xz"), "_x_y_xz");
    }
}
