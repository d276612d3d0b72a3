//! From the tree to ink: every element with its style, transform and clips.

use std::collections::BTreeMap;
use std::rc::Rc;

use drawing::{Affine, Drawing, Pen, Rect, Span, Vec2};
use roxmltree::Node;

use crate::attributes::{self, INKSCAPE};
use crate::clip::Region;
use crate::codes;
use crate::css::Sheet;
use crate::diagnostics::{Code, Findings};
use crate::limits;
use crate::output::{Ink, Output, Refused};
use crate::path::{self, Subpath};
use crate::pens::{self, Layer};
use crate::shapes;
use crate::style::{Paint, Style};
use crate::units::{self, Axis, Basis};
use crate::{Options, PenSettings};

mod page;
mod paint;
mod references;
mod regions;

pub(crate) use page::read;

/// An element of the tree.
pub(crate) type Element<'a> = Node<'a, 'a>;

/// What a document comes to.
#[derive(Debug, Default)]
pub(crate) struct Result {
    pub(crate) drawing: Drawing,
    pub(crate) page_mm: [f64; 2],
    pub(crate) pens: BTreeMap<Pen, PenSettings>,
}

/// What surrounds an element.
#[derive(Clone, Debug)]
pub(crate) struct Scope<'a> {
    pub(crate) style: Rc<Style<'a>>,
    /// From user units to mm on the page, y up.
    pub(crate) map: Affine,
    /// Size of the nearest viewport, user units.
    viewport: [f64; 2],
    pub(crate) clips: Rc<Vec<Rc<Region>>>,
    layer: Option<usize>,
    depth: usize,
    /// Elements that are drawn by reference here, outermost first.
    references: Rc<Vec<usize>>,
    /// Fill and stroke of the element that a marker belongs to.
    pub(crate) context: Option<[Paint<'a>; 2]>,
}

impl Scope<'_> {
    /// What relative lengths refer to.
    pub(crate) fn basis(&self) -> Basis {
        let [width, height] = self.viewport;
        Basis { width, height, font_size: self.style.font_size }
    }
}

/// What takes shapes and letters that are measured instead of drawn. Nothing is reported then.
#[derive(Debug)]
pub(crate) enum Sink {
    /// Their bounding box.
    Bounds(Option<Rect>),
    /// The outlines of letters.
    Outlines(Vec<Subpath>),
}

impl Sink {
    pub(crate) fn take(&mut self, subpaths: &[Subpath], map: Affine) {
        let placed: Vec<Subpath> = subpaths.iter().map(|subpath| subpath.transformed(map)).collect();
        match self {
            Self::Bounds(bounds) => {
                let both = bounds.iter().copied().chain(path::bounds(&placed));
                *bounds = both.reduce(|one, other| one.union(other));
            }
            Self::Outlines(all) => all.extend(placed),
        }
    }
}

/// Goes through a document.
#[derive(Debug)]
pub(crate) struct Walker<'a, 'f> {
    sheet: &'a Sheet,
    ids: BTreeMap<&'a str, Element<'a>>,
    pub(crate) options: &'f Options<'f>,
    findings: &'f mut Findings,
    pub(crate) output: Output,
    elements_left: u64,
    bytes_left: u64,
    /// Whether the file has layers of Inkscape; otherwise groups at the top with an id are layers.
    has_layers: bool,
    stopped: bool,
    /// Where shapes and letters go instead of being drawn, while something is measured.
    pub(crate) sink: Option<Sink>,
    /// Size of a pixel, mm.
    px_mm: f64,
    regions: BTreeMap<regions::Key, Rc<Region>>,
    /// Styles of elements that are drawn by reference, by the element.
    styles: BTreeMap<usize, Rc<Style<'a>>>,
}

impl<'a> Walker<'a, '_> {
    /// Reports a finding at an element; `message` and help are computed at the first place only.
    pub(crate) fn report(
        &mut self,
        code: Code,
        subject: &str,
        node: Element<'_>,
        message: impl FnOnce() -> (String, Option<String>),
    ) {
        if self.sink.is_none() {
            self.findings.report(code, subject, || attributes::place(node), message);
        }
    }

    /// Reports a finding without help.
    pub(crate) fn note(&mut self, code: Code, subject: &str, node: Element<'_>, message: &str) {
        self.report(code, subject, node, || (message.to_owned(), None));
    }

    /// Reports the limit of all work, and ends it.
    fn stop(&mut self, node: Element<'_>, message: &str) {
        self.stopped = true;
        self.note(codes::TOO_COMPLEX, "", node, message);
    }

    /// Draws the children of an element.
    fn children(&mut self, node: Element<'a>, scope: &Scope<'a>) {
        for child in node.children().filter(Node::is_element) {
            if self.stopped {
                return;
            }
            self.element(child, scope);
        }
    }

    /// Counts an element, and refuses it where there are too many or they are too deep.
    fn may_enter(&mut self, node: Element<'a>, scope: &Scope<'a>) -> bool {
        if self.stopped {
            return false;
        }
        if self.elements_left == 0 {
            self.stop(node, "references multiply the drawing to millions of elements");
            return false;
        }
        self.elements_left -= 1;
        if !self.may_read(node, node.attributes().map(|attribute| attribute.value().len()).sum()) {
            return false;
        }
        if scope.depth >= limits::DEPTH {
            self.note(codes::TOO_COMPLEX, "depth", node, "elements are nested more than 200 deep");
            return false;
        }
        true
    }

    /// Counts bytes of attributes and text, and stops where references multiply them.
    pub(crate) fn may_read(&mut self, node: Element<'a>, bytes: usize) -> bool {
        self.bytes_left = self.bytes_left.saturating_sub(bytes as u64);
        if self.bytes_left == 0 && !self.stopped {
            self.stop(node, "references multiply the drawing to hundreds of megabytes");
        }
        !self.stopped
    }

    /// Draws an element.
    pub(crate) fn element(&mut self, node: Element<'a>, scope: &Scope<'a>) {
        let Some(name) = attributes::name(node) else { return };
        if !self.may_enter(node, scope) {
            return;
        }
        match name {
            "defs" | "symbol" | "clipPath" | "mask" | "filter" | "marker" | "linearGradient"
            | "radialGradient" | "meshgradient" | "pattern" | "hatch" | "solidcolor" | "style" | "title"
            | "desc" | "metadata" | "view" | "cursor" | "font" | "font-face" | "color-profile" | "stop" => {
                return;
            }
            "script" | "animate" | "animateTransform" | "animateMotion" | "animateColor" | "set" => {
                self.report(codes::ANIMATION, name, node, || (format!("{name} is not run"), None));
                return;
            }
            _ => {}
        }
        if !is_chosen(node) {
            let message = "elements for another language or an extension are not drawn";
            self.note(codes::HIDDEN, "condition", node, message);
            return;
        }
        if let Some(inner) = self.enter(node, scope) {
            self.content(name, node, inner);
        }
    }

    /// Draws what an element holds, in its own scope.
    fn content(&mut self, name: &'a str, node: Element<'a>, inner: Scope<'a>) {
        match name {
            "g" | "a" if self.sink.is_some() => self.children(node, &inner),
            "g" | "a" => {
                let Some(inner) = self.layer(node, inner) else { return };
                self.children(node, &inner);
            }
            "svg" => self.nested(node, &inner, None),
            "use" => self.reference(node, &inner),
            "switch" => {
                if let Some(child) = node.children().find(|child| is_chosen(*child)) {
                    self.element(child, &inner);
                }
            }
            "text" => crate::text::draw(self, node, &inner),
            "image" => self.report(codes::IMAGE, name, node, || {
                ("an image is not drawn".into(), Some("trace it to paths in an editor".into()))
            }),
            "foreignObject" => self.note(codes::FOREIGN_OBJECT, name, node, "foreignObject is not drawn"),
            "flowRoot" => {
                self.report(codes::TEXT_NOT_DRAWN, name, node, || {
                    let help = "convert it to text or to paths in Inkscape".into();
                    ("flowed text (flowRoot) is not drawn".into(), Some(help))
                });
            }
            _ if shapes::is_shape(name) => self.shape(name, node, inner),
            _ => self.report(codes::UNKNOWN_ELEMENT, name, node, || {
                (format!("the element {name} is not known"), None)
            }),
        }
    }

    /// The scope inside an element: its style, transform and clip path; `None` if it is hidden.
    fn enter(&mut self, node: Element<'a>, scope: &Scope<'a>) -> Option<Scope<'a>> {
        let style = self.style(node, &scope.style, scope.basis());
        if !style.displayed || style.opacity <= 0.0 {
            let why = if style.displayed { "opacity 0" } else { "display:none" };
            self.report(codes::HIDDEN, "", node, || (format!("hidden elements are not drawn ({why})"), None));
            return None;
        }
        for (is_used, code, what) in
            [(style.mask, codes::MASK, "a mask"), (style.filter, codes::FILTER, "a filter")]
        {
            if is_used {
                self.report(code, "", node, || (format!("{what} is not applied"), None));
            }
        }
        if style.clip_shape {
            let message = "a clip path that is a shape of CSS is not applied";
            self.note(codes::CLIP_NOT_APPLIED, "css", node, message);
        }
        let mut inner = scope.clone();
        inner.depth += 1;
        inner.style = Rc::new(style);
        self.transform(node, &mut inner);
        let name = attributes::name(node).unwrap_or_default();
        // Bounding boxes are those of the geometry, without clips.
        if !shapes::is_shape(name) && self.sink.is_none() {
            let bounds =
                if self.is_clipped_by_bounds(node, &inner) { self.bounds(name, node, &inner) } else { None };
            self.clip(node, &mut inner, || bounds);
        }
        Some(inner)
    }

    /// The bounding box of what an element holds, in its user units.
    fn bounds(&mut self, name: &'a str, node: Element<'a>, scope: &Scope<'a>) -> Option<Rect> {
        let inner = Scope { map: Affine::IDENTITY, clips: Rc::default(), ..scope.clone() };
        // A box may be asked for while something is measured.
        let outer = self.sink.replace(Sink::Bounds(None));
        self.content(name, node, inner);
        match std::mem::replace(&mut self.sink, outer) {
            Some(Sink::Bounds(bounds)) => bounds,
            _ => None,
        }
    }

    /// The style of an element below one of style `parent`.
    pub(crate) fn style(&mut self, node: Element<'a>, parent: &Style<'a>, basis: Basis) -> Style<'a> {
        let mut misunderstood = Vec::new();
        let style = parent.of_child(node, self.sheet, basis, |what| misunderstood.push(what));
        for (name, value) in misunderstood {
            self.report(codes::BAD_VALUE, name, node, || {
                let value: String = value.chars().take(40).collect();
                (format!("{name}: the value \"{value}\" is not understood"), None)
            });
        }
        style
    }

    /// Applies the element's transform to the scope.
    fn transform(&mut self, node: Element<'a>, scope: &mut Scope<'a>) {
        let Some(text) = scope.style.transform else { return };
        let Some(mut map) = attributes::transform(text) else {
            self.report(codes::BAD_VALUE, "transform", node, || {
                let text: String = text.chars().take(60).collect();
                (format!("the transform \"{text}\" is not understood"), None)
            });
            return;
        };
        let name = attributes::name(node).unwrap_or_default();
        let frame = match scope.style.fill_box.then(|| self.bounds(name, node, scope)).flatten() {
            Some(bounds) => bounds,
            None => Rect::new(0.0, 0.0, scope.viewport[0], scope.viewport[1]),
        };
        if scope.style.transform_origin.is_some() || scope.style.fill_box {
            let words = scope.style.transform_origin.unwrap_or("0 0");
            if let Some(origin) = origin(words, scope.basis(), frame) {
                map = Affine::translate(origin) * map * Affine::translate(-origin);
            } else {
                let message = "the transform-origin is not understood";
                self.note(codes::BAD_VALUE, "transform-origin", node, message);
            }
        }
        scope.map *= map;
    }

    /// The scope inside a group, which may be a layer; nothing for a layer of documentation.
    fn layer(&mut self, node: Element<'a>, mut scope: Scope<'a>) -> Option<Scope<'a>> {
        let label = node.attribute((INKSCAPE, "label"));
        let id = node.attribute("id").map(pens::unescaped);
        let is_layer = if self.has_layers {
            node.attribute((INKSCAPE, "groupmode")) == Some("layer")
        } else {
            id.is_some() && node.parent_element().is_some_and(|parent| parent.parent_element().is_none())
        };
        if !is_layer {
            return Some(scope);
        }
        let layer = Layer::new(&label.map(str::to_owned).or(id).unwrap_or_default());
        if layer.is_documentation() {
            self.report(codes::LAYER_SKIPPED, &layer.name, node, || {
                (format!("the layer \"{}\" is documentation and not drawn", layer.name), None)
            });
            return None;
        }
        scope.layer = Some(self.output.keys.layer(layer));
        Some(scope)
    }

    /// Draws a shape.
    fn shape(&mut self, name: &'a str, node: Element<'a>, mut scope: Scope<'a>) {
        let shape = shapes::outline(name, node, &scope.style, scope.basis());
        if shape.damaged {
            let attribute = if name == "path" { "d" } else { "points" };
            self.report(codes::BAD_PATH, "", node, || {
                let help = Some("what stands before the error is drawn".into());
                (format!("the attribute {attribute} of {name} has an error"), help)
            });
        }
        if shape.subpaths.is_empty() {
            return;
        }
        if let Some(sink) = &mut self.sink {
            sink.take(&shape.subpaths, scope.map);
            return;
        }
        self.clip(node, &mut scope, || path::bounds(&shape.subpaths));
        if !scope.style.visible {
            self.note(codes::HIDDEN, "", node, "hidden elements are not drawn (visibility)");
            return;
        }
        self.paint_shape(name, node, &scope, &shape);
    }

    /// With what something of that colour is drawn for an element.
    pub(crate) fn ink(&mut self, node: Element<'a>, scope: &Scope<'a>, color: [u8; 3]) -> Ink {
        let range = node.range();
        Ink {
            key: self.output.keys.key(scope.layer, color),
            clips: Rc::clone(&scope.clips),
            span: Span { start: range.start, end: range.end },
            dots: scope.style.capped,
        }
    }

    /// Draws subpaths in user units.
    pub(crate) fn draw(&mut self, node: Element<'a>, scope: &Scope<'a>, subpaths: &[Subpath], ink: &Ink) {
        for subpath in subpaths {
            let pieces = subpath.segments.iter().map(|segment| segment.transformed(scope.map)).collect();
            if let Err(refused) = self.output.run(pieces, subpath.closed, ink) {
                self.refused(node, refused);
            }
        }
    }

    /// Reports why something could not be drawn.
    pub(crate) fn refused(&mut self, node: Element<'a>, refused: Refused) {
        match refused {
            Refused::OutOfRange => {
                let message = "a point lies more than 25 km from the page: the path is left out";
                self.note(codes::OUT_OF_RANGE, "", node, message);
            }
            Refused::TooMany => self.stop(node, "the drawing has too many pieces or clips too much"),
            Refused::TooFine => {
                self.note(codes::HATCH_TOO_FINE, "", node, "the hatch is too fine for an area of this size");
            }
        }
    }
}

/// The point that `transform-origin` names, user units.
fn origin(words: &str, basis: Basis, frame: Rect) -> Option<Vec2> {
    let mut words: Vec<&str> = words.split_whitespace().take(2).collect();
    if words.len() == 1 {
        words.push("center");
    }
    if matches!(words[0], "top" | "bottom") || matches!(words[1], "left" | "right") {
        words.swap(0, 1);
    }
    let basis = Basis { width: frame.width(), height: frame.height(), ..basis };
    let place = |word: &str, axis, start: f64, size: f64| {
        Some(match word {
            "left" | "top" => start,
            "center" => start + 0.5 * size,
            "right" | "bottom" => start + size,
            word => start + basis.user(units::parse(word)?, axis),
        })
    };
    let x = place(words[0], Axis::X, frame.x0, frame.width())?;
    Some(Vec2::new(x, place(words[1], Axis::Y, frame.y0, frame.height())?))
}

/// Whether an element is drawn: no extensions required, and English or no language.
fn is_chosen(child: Element<'_>) -> bool {
    let no_extension = child.attribute("requiredExtensions").is_none_or(str::is_empty);
    let language = child.attribute("systemLanguage").is_none_or(|languages| {
        languages.split(',').any(|language| language.trim() == "en" || language.trim().starts_with("en-"))
    });
    attributes::name(child).is_some() && no_extension && language
}
