//! The outermost `svg` element: style sheets, size, pixels per inch, layers.

use std::collections::BTreeMap;
use std::rc::Rc;

use drawing::{Affine, Drawing};
use roxmltree::{Document, Node};

use super::{Element, Result, Scope, Walker};
use crate::Options;
use crate::attributes::{self, INKSCAPE};
use crate::codes;
use crate::css::Sheet;
use crate::diagnostics::Findings;
use crate::limits;
use crate::output::Output;
use crate::style::Style;
use crate::units;
use crate::units::{Basis, CSS_DPI, MM_PER_INCH};
use crate::viewport;

/// Pixels per inch in files of Illustrator.
const ILLUSTRATOR_DPI: f64 = 72.0;

/// Reads a whole document.
pub(crate) fn read(tree: &Document<'_>, options: &Options<'_>, findings: &mut Findings) -> Result {
    let root = tree.root_element();
    if attributes::name(root) != Some("svg") {
        let name = root.tag_name().name();
        let message = || (format!("the root element is {name}, not svg"), None);
        findings.report(codes::NO_SVG, "", || attributes::place(root), message);
        return Result::default();
    }
    let mut sheet = Sheet::new();
    for node in root.descendants().filter(|node| attributes::name(*node) == Some("style")) {
        let text: String = node.children().filter_map(|child| child.text()).collect();
        let language = node.attribute("type").unwrap_or("").trim().to_ascii_lowercase();
        if matches!(language.split(';').next(), Some("" | "text/css")) {
            sheet.add(&text, node.attribute("media").unwrap_or(""));
        } else {
            sheet.skipped.push(format!("type=\"{language}\""));
        }
        for skipped in std::mem::take(&mut sheet.skipped) {
            let message = || (format!("the style rule \"{skipped}\" is not supported"), None);
            findings.report(codes::CSS_SKIPPED, &skipped, || attributes::place(node), message);
        }
    }
    let mut ids = BTreeMap::new();
    let mut has_layers = false;
    for node in root.descendants().filter(Node::is_element) {
        if let Some(id) = node.attribute("id") {
            ids.entry(id).or_insert(node);
        }
        has_layers |= node.attribute((INKSCAPE, "groupmode")) == Some("layer");
    }
    let mut walker = Walker {
        sheet: &sheet,
        ids,
        options,
        findings,
        output: Output::default(),
        elements_left: limits::ELEMENTS,
        bytes_left: limits::ATTRIBUTE_BYTES,
        has_layers,
        stopped: false,
        sink: None,
        px_mm: MM_PER_INCH / CSS_DPI,
        regions: BTreeMap::new(),
        styles: BTreeMap::new(),
    };
    let page_mm = walker.page(root);
    if sheet.is_exhausted() {
        let message = "the style sheets take too long to match: some of their rules have no effect";
        walker.note(codes::TOO_COMPLEX, "css", root, message);
    }
    let Output { mut strokes, keys, .. } = walker.output;
    let pens = keys.number(options.pens, &mut strokes);
    let mut drawing = Drawing::from(strokes);
    let page_mm = page_mm.unwrap_or_else(|| {
        // No size at all: the page reaches from the origin to the ink's last corner.
        let bounds = drawing.bounding_box().unwrap_or_default();
        let size = [bounds.x1.max(0.0), (-bounds.y0).max(0.0)];
        drawing.transform(Affine::translate((0.0, size[1])));
        size
    });
    Result { drawing, page_mm, pens }
}

/// Mm of a length that does not depend on anything else.
fn absolute_mm(length: svgtypes::Length, px_mm: f64) -> Option<f64> {
    use svgtypes::LengthUnit;
    let factor = match length.unit {
        LengthUnit::None | LengthUnit::Px => px_mm,
        LengthUnit::Mm => 1.0,
        LengthUnit::Cm => 10.0,
        LengthUnit::In => MM_PER_INCH,
        LengthUnit::Pt => MM_PER_INCH / 72.0,
        LengthUnit::Pc => MM_PER_INCH / 6.0,
        LengthUnit::Em | LengthUnit::Ex => 16.0 * px_mm,
        LengthUnit::Percent => return None,
    };
    Some(length.number * factor).filter(|mm| mm.is_finite() && *mm > 0.0)
}

impl<'a> Walker<'a, '_> {
    /// Draws the root element; gives the page's size if the file has one, mm.
    fn page(&mut self, root: Element<'a>) -> Option<[f64; 2]> {
        let px_mm = MM_PER_INCH / self.dpi(root);
        // CSS on a web page often gives the width of its container: only lengths count.
        let basis = Basis { width: 0.0, height: 0.0, font_size: 16.0 };
        let style = Style::default().of_child(root, self.sheet, basis, |_| {});
        let length = |text: &str| absolute_mm(units::parse(text)?, px_mm);
        let size = ["width", "height"].map(|name| {
            style.geometry(name).and_then(length).or_else(|| root.attribute(name).and_then(length))
        });
        self.px_mm = px_mm;
        let view = viewport::view_box(root);
        if size.iter().any(Option::is_none) {
            let message = match (size, view.is_some()) {
                ([None, None], true) => "neither width nor height is given: the viewBox is taken in pixels",
                (_, true) => "only one of width and height is given: the viewBox gives the other one",
                (_, false) => "size and viewBox are not given: lengths are pixels",
            };
            self.note(codes::SIZE_ASSUMED, "", root, message);
        }
        let size = match (size, view) {
            ([Some(width), Some(height)], _) => Some([width, height]),
            ([Some(width), None], Some(view)) => Some([width, width * view.h / view.w]),
            ([None, Some(height)], Some(view)) => Some([height * view.w / view.h, height]),
            ([None, None], Some(view)) => Some([view.w * px_mm, view.h * px_mm]),
            (_, None) => None,
        };
        let [width, height] = size.unwrap_or([0.0; 2]);
        let content = match view {
            Some(view) => viewport::onto(view, viewport::aspect_ratio(root), width, height),
            None => Affine::scale(px_mm),
        };
        let viewport = match view {
            Some(view) => [view.w, view.h],
            None => [width / px_mm, height / px_mm],
        };
        let flip = Affine::new([1.0, 0.0, 0.0, -1.0, 0.0, height]);
        let outside = Scope {
            style: Rc::new(Style::default()),
            map: flip * content,
            viewport,
            clips: Rc::default(),
            layer: None,
            depth: 0,
            references: Rc::default(),
            context: None,
        };
        if let Some(scope) = self.enter(root, &outside) {
            self.children(root, &scope);
        }
        size
    }

    /// Pixels per inch, with a note where they are not CSS's or once were not.
    fn dpi(&mut self, root: Element<'a>) -> f64 {
        if let Some(dpi) = self.options.dpi.filter(|dpi| *dpi > 0.0 && dpi.is_finite()) {
            return dpi;
        }
        let units =
            ["width", "height"].map(|name| root.attribute(name).and_then(units::parse).map(|l| l.unit));
        let has_pixels = units.iter().any(|unit| matches!(unit, None | Some(svgtypes::LengthUnit::Px)));
        let bare = units.iter().all(|unit| unit.is_none_or(|unit| unit == svgtypes::LengthUnit::None));
        let mut comments = root.document().root().children().filter(Node::is_comment);
        if comments.any(|comment| comment.text().is_some_and(|text| text.contains("Adobe Illustrator"))) {
            let dpi = if bare { ILLUSTRATOR_DPI } else { CSS_DPI };
            if bare || has_pixels {
                self.report(codes::DPI, "", root, || {
                    let message = format!("a file of Illustrator: its pixels are taken at {dpi} per inch");
                    let help = (!bare).then(|| "Illustrator's pixels are points, 72 per inch".to_owned());
                    (message, help)
                });
            }
            return dpi;
        }
        let version = root.attribute((INKSCAPE, "version")).unwrap_or("");
        let minor = version.strip_prefix("0.").map(|minor| minor.chars().take_while(char::is_ascii_digit));
        let minor = minor.and_then(|digits| digits.collect::<String>().parse::<u32>().ok());
        if minor.is_some_and(|minor| minor < 92) && root.attribute("viewBox").is_none() {
            self.report(codes::DPI, "", root, || {
                let message = "a file of Inkscape before 0.92: its pixels are taken at 96 per inch";
                let help = "Inkscape counted 90 pixels per inch then, and 96 since";
                (message.into(), Some(help.into()))
            });
        }
        CSS_DPI
    }
}
