//! The properties of an element: presentation attributes, style sheets, `style`, inheritance.

use std::str::FromStr as _;

use drawing::FillRule;
use roxmltree::Node;
use svgtypes::{Color, LengthListParser, PaintFallback};

use crate::attributes;
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
    // Of the element alone.
    pub(crate) displayed: bool,
    pub(crate) opacity: f64,
    pub(crate) clip_path: Option<&'a str>,
    pub(crate) mask: bool,
    pub(crate) filter: bool,
    pub(crate) overflow_visible: bool,
    pub(crate) transform: Option<&'a str>,
    pub(crate) transform_origin: Option<&'a str>,
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
            displayed: true,
            opacity: 1.0,
            clip_path: None,
            mask: false,
            filter: false,
            overflow_visible: false,
            transform: None,
            transform_origin: None,
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
            displayed: true,
            opacity: 1.0,
            clip_path: None,
            mask: false,
            filter: false,
            overflow_visible: false,
            transform: None,
            transform_origin: None,
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
        all.extend(ruled.iter().filter(|d| !d.important));
        all.extend(css::declarations(own).filter(|d| !d.important));
        all.extend(ruled.iter().filter(|d| d.important));
        all.extend(css::declarations(own).filter(|d| d.important));
        // Other lengths and paints refer to these two.
        for d in &all {
            match d.name {
                "font-size" => {
                    style.font_size = font_size(d.value, self.font_size).unwrap_or(style.font_size);
                }
                "color" => style.color = color(d.value).map_or(style.color, |(rgb, _)| rgb),
                _ => {}
            }
        }
        let basis = Basis { font_size: style.font_size, ..basis };
        for d in all {
            if style.set(d.name, d.value, self, basis).is_none() {
                misunderstood((d.name, d.value));
            }
        }
        style
    }

    /// Sets one property; `None` if its value is not understood.
    fn set(&mut self, name: &str, value: &'a str, parent: &Self, basis: Basis) -> Option<()> {
        let length = |axis| Some(basis.user(units::parse(value)?, axis));
        match name {
            "fill" => (self.fill, self.fill_opacity) = self.paint(value, parent.fill, self.fill_opacity)?,
            "stroke" => {
                (self.stroke, self.stroke_opacity) = self.paint(value, parent.stroke, self.stroke_opacity)?;
            }
            "stroke-width" if value != "inherit" => self.stroke_width = length(Axis::Diagonal)?,
            "stroke-dasharray" => match value {
                "inherit" => self.dashes = parent.dashes,
                "none" => self.dashes = "",
                _ => self.dashes = value,
            },
            "stroke-dashoffset" if value != "inherit" => self.dash_offset = length(Axis::Diagonal)?,
            "stroke-linecap" => {
                self.capped = if value == "inherit" { parent.capped } else { value != "butt" }
            }
            "fill-rule" => self.fill_rule = rule(value, parent.fill_rule),
            "clip-rule" => self.clip_rule = rule(value, parent.clip_rule),
            "fill-opacity" => self.fill_opacity = opacity(value, parent.fill_opacity)?,
            "stroke-opacity" => self.stroke_opacity = opacity(value, parent.stroke_opacity)?,
            "opacity" => self.opacity = opacity(value, parent.opacity)?,
            "visibility" => {
                self.visible = if value == "inherit" { parent.visible } else { value == "visible" };
            }
            "display" => self.displayed = if value == "inherit" { parent.displayed } else { value != "none" },
            "overflow" => self.overflow_visible = matches!(value, "visible" | "auto"),
            "marker" => self.markers = [marker(value, parent.markers[0]); 3],
            "marker-start" => self.markers[0] = marker(value, parent.markers[0]),
            "marker-mid" => self.markers[1] = marker(value, parent.markers[1]),
            "marker-end" => self.markers[2] = marker(value, parent.markers[2]),
            "clip-path" => self.clip_path = attributes::url(value),
            "mask" => self.mask = attributes::url(value).is_some(),
            "filter" => self.filter = !matches!(value, "none" | "inherit"),
            "transform" => self.transform = Some(value),
            "transform-origin" => self.transform_origin = Some(value),
            _ => return self.set_text(name, value, parent, basis),
        }
        Some(())
    }

    /// Sets one property of text.
    fn set_text(&mut self, name: &str, value: &'a str, parent: &Self, basis: Basis) -> Option<()> {
        let spacing = |inherited| match value {
            "inherit" => Some(inherited),
            "normal" => Some(0.0),
            _ => Some(basis.user(units::parse(value)?, Axis::X)),
        };
        match name {
            "font-family" if value != "inherit" => self.font_family = value,
            "font-weight" => {
                self.font_weight = match value {
                    "inherit" => parent.font_weight,
                    "normal" => 400,
                    "bold" => 700,
                    "bolder" => {
                        if parent.font_weight < 600 {
                            700
                        } else {
                            900
                        }
                    }
                    "lighter" => {
                        if parent.font_weight < 600 {
                            100
                        } else {
                            400
                        }
                    }
                    number => number.parse().ok().filter(|weight| (1..=1000).contains(weight))?,
                }
            }
            "font-style" => {
                self.italic = match value {
                    "inherit" => parent.italic,
                    other => other.starts_with("italic") || other.starts_with("oblique"),
                }
            }
            "text-anchor" => {
                self.anchor = match value {
                    "middle" => Anchor::Middle,
                    "end" => Anchor::End,
                    "inherit" => parent.anchor,
                    _ => Anchor::Start,
                }
            }
            "letter-spacing" => self.letter_spacing = spacing(parent.letter_spacing)?,
            "word-spacing" => self.word_spacing = spacing(parent.word_spacing)?,
            "white-space" => self.keeps_space = value.starts_with("pre"),
            "dominant-baseline" | "alignment-baseline" => {
                self.baseline_em = match value {
                    "middle" | "central" => MIDDLE_EM,
                    "hanging" | "text-before-edge" | "before-edge" | "text-top" => HANGING_EM,
                    "inherit" => parent.baseline_em,
                    _ => 0.0,
                }
            }
            "baseline-shift" => {
                self.baseline_shift = match value {
                    "sub" => -0.2 * parent.font_size,
                    "super" => 0.4 * parent.font_size,
                    "baseline" | "inherit" => 0.0,
                    _ => {
                        let basis = Basis { height: parent.font_size, ..basis };
                        basis.user(units::parse(value)?, Axis::Y)
                    }
                }
            }
            _ => {}
        }
        Some(())
    }

    /// A paint, and the opacity that it implies.
    fn paint(&self, value: &'a str, inherited: Paint<'a>, opacity: f64) -> Option<(Paint<'a>, f64)> {
        let value = value.trim();
        // Colours of a profile follow the fallback in RGB.
        let value = value.split("icc-color").next().unwrap_or(value).trim();
        let paint = match value {
            "inherit" => inherited,
            "currentcolor" => Paint::Color(self.color),
            _ => match svgtypes::Paint::from_str(value).ok() {
                Some(svgtypes::Paint::None) => Paint::None,
                Some(svgtypes::Paint::Inherit) => inherited,
                Some(svgtypes::Paint::CurrentColor) => Paint::Color(self.color),
                Some(svgtypes::Paint::Color(color)) => {
                    let opacity = if color.alpha == 0 { 0.0 } else { opacity };
                    return Some((Paint::Color([color.red, color.green, color.blue]), opacity));
                }
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
                None => return None,
            },
        };
        Some((paint, opacity))
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

fn rule(value: &str, inherited: FillRule) -> FillRule {
    match value {
        "evenodd" => FillRule::EvenOdd,
        "inherit" => inherited,
        _ => FillRule::NonZero,
    }
}

fn opacity(value: &str, inherited: f64) -> Option<f64> {
    if value == "inherit" {
        return Some(inherited);
    }
    match value.trim().strip_suffix('%') {
        Some(percent) => Some(percent.trim().parse::<f64>().ok()? / 100.0),
        None => value.trim().parse().ok(),
    }
}

fn marker<'a>(value: &'a str, inherited: Option<&'a str>) -> Option<&'a str> {
    if value == "inherit" { inherited } else { attributes::url(value) }
}

fn font_size(value: &str, parent: f64) -> Option<f64> {
    let size = match value {
        "inherit" => parent,
        "xx-small" => 9.0,
        "x-small" => 10.0,
        "small" => 13.0,
        "medium" => 16.0,
        "large" => 18.0,
        "x-large" => 24.0,
        "xx-large" => 32.0,
        "smaller" => parent / 1.2,
        "larger" => parent * 1.2,
        _ => Basis { width: parent, height: parent, font_size: parent }.user(units::parse(value)?, Axis::Y),
    };
    (size >= 0.0).then_some(size)
}

/// Red, green, blue and whether it is opaque at all.
pub(crate) fn color(value: &str) -> Option<([u8; 3], bool)> {
    let color = Color::from_str(value.split("icc-color").next()?.trim()).ok()?;
    Some(([color.red, color.green, color.blue], color.alpha > 0))
}
