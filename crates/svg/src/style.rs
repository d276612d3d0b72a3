//! The properties of an element: presentation attributes, style sheets, `style`, inheritance.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::rc::Rc;

use drawing::FillRule;
use roxmltree::Node;
use svgtypes::{LengthListParser, PaintFallback};

use crate::attributes;
use crate::colors;
use crate::css::{self, Declaration, Sheet};
use crate::units::{self, Axis, Basis};

/// What paints a stroke or an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Paint<'a> {
    None,
    Color([u8; 3]),
    /// A gradient or pattern by its id, and the fallback.
    Server(&'a str, Option<[u8; 3]>),
    ContextFill,
    ContextStroke,
}

/// Which part of a text lies at its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

impl Anchor {
    /// The share of a text's width that lies before its point.
    pub(crate) fn share(self) -> f64 {
        match self {
            Self::Start => 0.0,
            Self::Middle => 0.5,
            Self::End => 1.0,
        }
    }
}

/// Where the point of a text lies across its line, in font sizes above the base line.
pub(crate) const MIDDLE_EM: f64 = 0.35;
pub(crate) const HANGING_EM: f64 = 0.7;

/// Variables that are looked up for one value.
const VARIABLE_CHAIN: usize = 10;
/// Sizes and places that CSS may give.
const GEOMETRY: &[&str] = &["x", "y", "cx", "cy", "r", "rx", "ry", "width", "height", "d"];
/// Values that are compared with; CSS ignores their case.
const KEYWORDS: &[&str] = &[
    "none", "inherit", "initial", "unset", "revert", "visible", "hidden", "collapse", "auto", "inline",
    "block", "butt", "round", "square", "evenodd", "nonzero", "start", "middle", "end", "normal", "bold",
    "bolder", "lighter", "italic", "oblique", "central", "hanging", "baseline", "sub", "super", "medium",
    "small", "large", "smaller", "larger",
];

/// Computed properties.
#[expect(clippy::struct_excessive_bools, reason = "each is a property of its own")]
#[derive(Clone, Debug)]
pub(crate) struct Style<'a> {
    // Inherited.
    pub(crate) fill: Paint<'a>,
    pub(crate) fill_opacity: f64,
    pub(crate) fill_rule: FillRule,
    pub(crate) clip_rule: FillRule,
    pub(crate) stroke: Paint<'a>,
    pub(crate) stroke_opacity: f64,
    pub(crate) stroke_width: f64,
    /// Whether ends have caps, so that a path of no length is a dot.
    pub(crate) capped: bool,
    /// As written; empty for solid.
    pub(crate) dashes: &'a str,
    pub(crate) dash_offset: f64,
    pub(crate) markers: [Option<&'a str>; 3],
    pub(crate) visible: bool,
    pub(crate) color: [u8; 3],
    pub(crate) font_size: f64,
    pub(crate) font_family: &'a str,
    pub(crate) font_weight: u16,
    pub(crate) italic: bool,
    pub(crate) anchor: Anchor,
    pub(crate) letter_spacing: f64,
    pub(crate) word_spacing: f64,
    pub(crate) baseline_em: f64,
    pub(crate) keeps_space: bool,
    /// Custom properties (`--name`) and their values.
    variables: Rc<BTreeMap<&'a str, &'a str>>,
    // Of the element alone.
    /// Whether dashes are pixels of the page, whatever the transform.
    pub(crate) non_scaling: bool,
    pub(crate) displayed: bool,
    pub(crate) opacity: f64,
    pub(crate) clip_path: Option<&'a str>,
    /// Whether the clip path is a shape of CSS.
    pub(crate) clip_shape: bool,
    pub(crate) mask: bool,
    pub(crate) filter: bool,
    pub(crate) overflow_visible: bool,
    pub(crate) transform: Option<&'a str>,
    pub(crate) transform_origin: Option<&'a str>,
    /// Whether the transform's origin lies in the element's bounding box instead of the viewport.
    pub(crate) fill_box: bool,
    /// Sizes and places that CSS gives, instead of the attributes of the same names.
    geometry: Vec<(&'static str, &'a str)>,
    /// Baseline shift, user units.
    pub(crate) baseline_shift: f64,
}

impl Default for Style<'_> {
    fn default() -> Self {
        Self {
            fill: Paint::Color([0; 3]),
            fill_opacity: 1.0,
            fill_rule: FillRule::NonZero,
            clip_rule: FillRule::NonZero,
            stroke: Paint::None,
            stroke_opacity: 1.0,
            stroke_width: 1.0,
            capped: false,
            dashes: "",
            dash_offset: 0.0,
            markers: [None; 3],
            visible: true,
            color: [0; 3],
            font_size: 16.0,
            font_family: "",
            font_weight: 400,
            italic: false,
            anchor: Anchor::Start,
            letter_spacing: 0.0,
            word_spacing: 0.0,
            baseline_em: 0.0,
            keeps_space: false,
            variables: Rc::default(),
            non_scaling: false,
            displayed: true,
            opacity: 1.0,
            clip_path: None,
            clip_shape: false,
            mask: false,
            filter: false,
            overflow_visible: false,
            transform: None,
            transform_origin: None,
            fill_box: false,
            geometry: Vec::new(),
            baseline_shift: 0.0,
        }
    }
}

/// A property whose value was not understood.
pub(crate) type Misunderstood<'a> = (&'a str, &'a str);

impl<'a> Style<'a> {
    /// The style of a child before its own properties.
    fn inherited(&self) -> Self {
        Self {
            non_scaling: false,
            displayed: true,
            opacity: 1.0,
            clip_path: None,
            clip_shape: false,
            mask: false,
            filter: false,
            overflow_visible: false,
            transform: None,
            transform_origin: None,
            fill_box: false,
            geometry: Vec::new(),
            baseline_shift: 0.0,
            ..self.clone()
        }
    }

    /// The style of `node` below an element of this style.
    pub(crate) fn of_child(
        &self,
        node: Node<'a, '_>,
        sheet: &'a Sheet,
        basis: Basis,
        mut misunderstood: impl FnMut(Misunderstood<'a>),
    ) -> Self {
        let mut style = self.inherited();
        let ruled = sheet.matching(node);
        let own = node.attribute("style").unwrap_or("");
        let mut all: Vec<Declaration<'a>> = Vec::new();
        for attribute in node.attributes() {
            let (name, value) = (attribute.name(), attribute.value());
            match attribute.namespace() {
                None => all.push(Declaration { name, value, important: false }),
                Some("http://www.w3.org/XML/1998/namespace") if name == "space" => {
                    style.keeps_space = value == "preserve";
                }
                Some(_) => {}
            }
        }
        let attributes = all.len();
        all.extend(ruled.iter().filter(|d| !d.important));
        all.extend(css::declarations(own).filter(|d| !d.important));
        all.extend(ruled.iter().filter(|d| d.important));
        all.extend(css::declarations(own).filter(|d| d.important));
        for d in all[attributes..].iter().filter(|d| d.name.starts_with("--")) {
            Rc::make_mut(&mut style.variables).insert(d.name, d.value);
        }
        // Other lengths and paints refer to these two.
        for d in &mut all {
            d.value = style.resolved(d.value);
            let size = match d.name {
                "font-size" => d.value,
                "font" => Shorthand::of(d.value).map_or("", |font| font.size),
                "color" => {
                    style.color = colors::parse(d.value).map_or(style.color, |(rgb, _)| rgb);
                    continue;
                }
                _ => continue,
            };
            style.font_size = font_size(size, self.font_size).unwrap_or(style.font_size);
        }
        let basis = Basis { font_size: style.font_size, ..basis };
        for (index, d) in all.into_iter().enumerate() {
            let is_understood = if index < attributes {
                style.set(d.name, d.value, self, basis)
            } else {
                style.set_by_css(d.name, d.value, self, basis)
            };
            if is_understood.is_none() {
                misunderstood((d.name, d.value));
            }
        }
        style
    }

    /// The value that variables, colour schemes and keywords in capitals stand for.
    fn resolved(&self, mut value: &'a str) -> &'a str {
        for _ in 0..VARIABLE_CHAIN {
            let call = |name: &str| value.strip_prefix(name)?.strip_suffix(')');
            if let Some(inside) = call("var(") {
                let (name, fallback) = inside.split_once(',').map_or((inside, None), |(n, f)| (n, Some(f)));
                let known = self.variables.get(name.trim()).copied();
                match known.or(fallback) {
                    Some(found) => value = found.trim(),
                    None => return value,
                }
            } else if let Some(inside) = call("light-dark(") {
                value = css::split(inside, b',').next().unwrap_or("").trim();
            } else {
                break;
            }
        }
        let is_word = || value.bytes().all(|byte| byte.is_ascii_alphabetic() || byte == b'-');
        if value.bytes().next().is_some_and(|byte| byte.is_ascii_alphabetic())
            && is_word()
            && value.bytes().any(|byte| byte.is_ascii_uppercase())
        {
            return KEYWORDS.iter().find(|known| known.eq_ignore_ascii_case(value)).unwrap_or(&value);
        }
        value
    }

    /// What CSS gives for a size or a place of the element.
    pub(crate) fn geometry(&self, name: &str) -> Option<&'a str> {
        self.geometry.iter().rev().find(|(known, _)| *known == name).map(|(_, value)| *value)
    }

    /// Sets one property of CSS, whose name may be written in capitals.
    fn set_by_css(&mut self, name: &str, value: &'a str, parent: &Self, basis: Basis) -> Option<()> {
        let name = if name.bytes().any(|byte| byte.is_ascii_uppercase()) {
            Cow::Owned(name.to_ascii_lowercase())
        } else {
            Cow::Borrowed(name)
        };
        if let Some(known) = GEOMETRY.iter().find(|known| **known == name) {
            self.geometry.push((known, value));
            return Some(());
        }
        if matches!(&*name, "translate" | "rotate" | "scale" | "zoom" | "offset-path") {
            return (value == "none").then_some(());
        }
        self.set(&name, value, parent, basis)
    }

    /// Sets one property; `None` if its value is not understood.
    fn set(&mut self, name: &str, value: &'a str, parent: &Self, basis: Basis) -> Option<()> {
        match value {
            "inherit" => self.copy(name, parent),
            "initial" => self.copy(name, &Self::default()),
            "unset" | "revert" | "revert-layer" => self.copy(name, &parent.inherited()),
            _ => return self.set_value(name, value, parent, basis),
        }
        Some(())
    }

    fn set_value(&mut self, name: &str, value: &'a str, parent: &Self, basis: Basis) -> Option<()> {
        let length = |axis| Some(basis.user(units::parse(value)?, axis));
        match name {
            "fill" => self.fill = self.paint(value)?,
            "stroke" => self.stroke = self.paint(value)?,
            "stroke-width" => self.stroke_width = length(Axis::Diagonal)?,
            "stroke-dasharray" => self.dashes = if value == "none" { "" } else { value },
            "stroke-dashoffset" => self.dash_offset = length(Axis::Diagonal)?,
            "stroke-linecap" => self.capped = value != "butt",
            "fill-rule" => self.fill_rule = rule(value),
            "clip-rule" => self.clip_rule = rule(value),
            "fill-opacity" => self.fill_opacity = opacity(value)?,
            "stroke-opacity" => self.stroke_opacity = opacity(value)?,
            "opacity" => self.opacity = opacity(value)?,
            "visibility" => self.visible = value == "visible",
            "display" => self.displayed = value != "none",
            "overflow" => self.overflow_visible = matches!(value, "visible" | "auto"),
            "marker" => self.markers = [attributes::url(value); 3],
            "marker-start" => self.markers[0] = attributes::url(value),
            "marker-mid" => self.markers[1] = attributes::url(value),
            "marker-end" => self.markers[2] = attributes::url(value),
            "clip-path" => {
                self.clip_path = attributes::url(value);
                self.clip_shape = self.clip_path.is_none() && value != "none";
            }
            "mask" => self.mask = attributes::url(value).is_some(),
            "filter" => self.filter = value != "none",
            "transform" => self.transform = Some(value),
            "transform-origin" => self.transform_origin = Some(value),
            "transform-box" => self.fill_box = value != "view-box",
            "vector-effect" => self.non_scaling = value.contains("non-scaling-stroke"),
            _ => return self.set_text(name, value, parent, basis),
        }
        Some(())
    }

    /// Sets one property of text.
    fn set_text(&mut self, name: &str, value: &'a str, parent: &Self, basis: Basis) -> Option<()> {
        let spacing = || match value {
            "normal" => Some(0.0),
            _ => Some(basis.user(units::parse(value)?, Axis::X)),
        };
        match name {
            "font" => {
                let Some(font) = Shorthand::of(value) else { return Some(()) };
                (self.italic, self.font_weight, self.font_family) = (false, 400, font.families);
                for word in font.before.split_whitespace() {
                    self.italic |= is_italic(word);
                    self.font_weight = weight(word, parent.font_weight).unwrap_or(self.font_weight);
                }
            }
            "font-family" => self.font_family = value,
            "font-weight" => self.font_weight = weight(value, parent.font_weight)?,
            "font-style" => self.italic = is_italic(value),
            "text-anchor" => {
                self.anchor = match value {
                    "middle" => Anchor::Middle,
                    "end" => Anchor::End,
                    _ => Anchor::Start,
                }
            }
            "letter-spacing" => self.letter_spacing = spacing()?,
            "word-spacing" => self.word_spacing = spacing()?,
            "white-space" => self.keeps_space = value.starts_with("pre"),
            "dominant-baseline" | "alignment-baseline" => {
                self.baseline_em = match value {
                    "middle" | "central" => MIDDLE_EM,
                    "hanging" | "text-before-edge" | "before-edge" | "text-top" => HANGING_EM,
                    _ => 0.0,
                }
            }
            "baseline-shift" => {
                self.baseline_shift = match value {
                    "sub" => -0.2 * parent.font_size,
                    "super" => 0.4 * parent.font_size,
                    "baseline" => 0.0,
                    _ => {
                        let basis = Basis { height: parent.font_size, ..basis };
                        basis.user(units::parse(value)?, Axis::Y)
                    }
                }
            }
            // These change the ink and are not supported.
            "text-decoration" | "text-decoration-line" | "text-transform" => {
                return value.starts_with("none").then_some(());
            }
            "writing-mode" => return matches!(value, "lr" | "lr-tb" | "horizontal-tb").then_some(()),
            "direction" => return (value == "ltr").then_some(()),
            _ => {}
        }
        Some(())
    }

    /// Takes one property from another style.
    fn copy(&mut self, name: &str, from: &Self) {
        match name {
            "fill" => self.fill = from.fill,
            "stroke" => self.stroke = from.stroke,
            "color" => self.color = from.color,
            "stroke-width" => self.stroke_width = from.stroke_width,
            "stroke-dasharray" => self.dashes = from.dashes,
            "stroke-dashoffset" => self.dash_offset = from.dash_offset,
            "stroke-linecap" => self.capped = from.capped,
            "fill-rule" => self.fill_rule = from.fill_rule,
            "clip-rule" => self.clip_rule = from.clip_rule,
            "fill-opacity" => self.fill_opacity = from.fill_opacity,
            "stroke-opacity" => self.stroke_opacity = from.stroke_opacity,
            "opacity" => self.opacity = from.opacity,
            "visibility" => self.visible = from.visible,
            "display" => self.displayed = from.displayed,
            "overflow" => self.overflow_visible = from.overflow_visible,
            "marker" => self.markers = from.markers,
            "marker-start" => self.markers[0] = from.markers[0],
            "marker-mid" => self.markers[1] = from.markers[1],
            "marker-end" => self.markers[2] = from.markers[2],
            "clip-path" => (self.clip_path, self.clip_shape) = (from.clip_path, from.clip_shape),
            "mask" => self.mask = from.mask,
            "filter" => self.filter = from.filter,
            "transform" => self.transform = from.transform,
            "transform-origin" => self.transform_origin = from.transform_origin,
            "transform-box" => self.fill_box = from.fill_box,
            "vector-effect" => self.non_scaling = from.non_scaling,
            "font" => {
                (self.font_size, self.font_family) = (from.font_size, from.font_family);
                (self.font_weight, self.italic) = (from.font_weight, from.italic);
            }
            "font-size" => self.font_size = from.font_size,
            "font-family" => self.font_family = from.font_family,
            "font-weight" => self.font_weight = from.font_weight,
            "font-style" => self.italic = from.italic,
            "text-anchor" => self.anchor = from.anchor,
            "letter-spacing" => self.letter_spacing = from.letter_spacing,
            "word-spacing" => self.word_spacing = from.word_spacing,
            "white-space" => self.keeps_space = from.keeps_space,
            "dominant-baseline" | "alignment-baseline" => self.baseline_em = from.baseline_em,
            "baseline-shift" => self.baseline_shift = from.baseline_shift,
            _ => {}
        }
    }

    fn paint(&self, value: &'a str) -> Option<Paint<'a>> {
        let value = value.trim();
        let color = |value: &str| {
            let (rgb, is_opaque) = colors::parse(value)?;
            Some(if is_opaque { Paint::Color(rgb) } else { Paint::None })
        };
        if value.eq_ignore_ascii_case("currentcolor") {
            return Some(Paint::Color(self.color));
        }
        Some(match svgtypes::Paint::from_str(value).ok() {
            Some(svgtypes::Paint::None) => Paint::None,
            Some(svgtypes::Paint::CurrentColor) => Paint::Color(self.color),
            Some(svgtypes::Paint::FuncIRI(id, fallback)) => Paint::Server(
                id,
                match fallback {
                    Some(PaintFallback::Color(color)) => Some([color.red, color.green, color.blue]),
                    Some(PaintFallback::CurrentColor) => Some(self.color),
                    Some(PaintFallback::None) | None => None,
                },
            ),
            Some(svgtypes::Paint::ContextFill) => Paint::ContextFill,
            Some(svgtypes::Paint::ContextStroke) => Paint::ContextStroke,
            Some(svgtypes::Paint::Color(_) | svgtypes::Paint::Inherit) | None => return color(value),
        })
    }

    /// The lengths of dashes and gaps in user units, an even number of them; nothing for a solid
    /// line.
    pub(crate) fn dash_lengths(&self, basis: Basis) -> Option<Vec<f64>> {
        let lengths: Result<Vec<_>, _> = LengthListParser::from(self.dashes).collect();
        let lengths = lengths.ok()?.into_iter().map(|length| basis.user(length, Axis::Diagonal));
        let mut lengths: Vec<f64> = lengths.collect();
        let valid = lengths.iter().all(|&length| length.is_finite() && length >= 0.0);
        if !valid || lengths.iter().sum::<f64>() <= 0.0 {
            return None;
        }
        if lengths.len() % 2 == 1 {
            lengths.extend_from_within(..);
        }
        Some(lengths)
    }
}

/// The parts of a `font` shorthand.
struct Shorthand<'a> {
    /// Style, variant, weight and stretch.
    before: &'a str,
    size: &'a str,
    families: &'a str,
}

impl<'a> Shorthand<'a> {
    /// `None` for fonts of the system (`caption`) and values without a size.
    fn of(value: &'a str) -> Option<Self> {
        let mut rest = value.trim();
        loop {
            let (word, after) = rest.split_once(char::is_whitespace)?;
            let (size, height) = word.split_once('/').unwrap_or((word, ""));
            // A bare number is a weight.
            if size.parse::<u16>().is_err() && font_size(size, 1.0).is_some() {
                let before = &value.trim()[..value.trim().len() - rest.len()];
                let mut families = after.trim_start();
                // The height of lines, with blanks around the slash.
                if word.ends_with('/') && height.is_empty() {
                    families = families.split_once(char::is_whitespace)?.1;
                } else if let Some(after) = families.strip_prefix('/') {
                    families = after.trim_start().split_once(char::is_whitespace)?.1;
                }
                return Some(Self { before, size, families: families.trim() });
            }
            rest = after.trim_start();
        }
    }
}

fn is_italic(value: &str) -> bool {
    value.starts_with("italic") || value.starts_with("oblique")
}

fn weight(value: &str, parent: u16) -> Option<u16> {
    match value {
        "normal" => Some(400),
        "bold" => Some(700),
        "bolder" => Some(if parent < 600 { 700 } else { 900 }),
        "lighter" => Some(if parent < 600 { 100 } else { 400 }),
        number => number.parse().ok().filter(|weight| (1..=1000).contains(weight)),
    }
}

fn rule(value: &str) -> FillRule {
    if value == "evenodd" { FillRule::EvenOdd } else { FillRule::NonZero }
}

fn opacity(value: &str) -> Option<f64> {
    match value.trim().strip_suffix('%') {
        Some(percent) => Some(percent.trim().parse::<f64>().ok()? / 100.0),
        None => value.trim().parse().ok(),
    }
}

fn font_size(value: &str, parent: f64) -> Option<f64> {
    let size = match value {
        "inherit" | "unset" => parent,
        "initial" | "medium" => 16.0,
        "xx-small" => 9.0,
        "x-small" => 10.0,
        "small" => 13.0,
        "large" => 18.0,
        "x-large" => 24.0,
        "xx-large" => 32.0,
        "smaller" => parent / 1.2,
        "larger" => parent * 1.2,
        _ => Basis { width: parent, height: parent, font_size: parent }.user(units::parse(value)?, Axis::Y),
    };
    (size >= 0.0).then_some(size)
}
