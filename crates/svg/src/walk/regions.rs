//! Clip paths as regions on the page.

use std::rc::Rc;

use drawing::{Affine, Point, Rect};
use roxmltree::Node;

use super::{Element, Scope, Sink, Walker};
use crate::attributes;
use crate::clip::{Area, Region};
use crate::codes;
use crate::limits;
use crate::output::Refused;
use crate::path::{self, Subpath};
use crate::shapes;
use crate::style::Style;
use crate::units::{self, Axis, Basis};

/// A clip path, and the map and bounding box that it was built for.
pub(super) type Key = (usize, [u64; 6], [u64; 4]);

/// Regions kept for elements that share a clip path.
const CACHE: usize = 4096;

impl<'a> Walker<'a, '_> {
    /// Applies the element's clip path to its scope. `bounds` gives its bounding box in user units,
    /// where it is known.
    pub(super) fn clip(
        &mut self,
        node: Element<'a>,
        scope: &mut Scope<'a>,
        bounds: impl FnOnce() -> Option<Rect>,
    ) {
        let Some(id) = scope.style.clip_path else { return };
        let Some(clip_path) = self.clip_path(node, id, scope) else { return };
        let bounds = if in_bounding_box(clip_path) { bounds() } else { None };
        if let Some(region) = self.region(node, clip_path, scope, bounds) {
            Rc::make_mut(&mut scope.clips).push(region);
        }
    }

    /// Whether the element has a clip path in units of its bounding box.
    pub(super) fn is_clipped_by_bounds(&mut self, node: Element<'a>, scope: &Scope<'a>) -> bool {
        let Some(id) = scope.style.clip_path else { return false };
        self.clip_path(node, id, scope).is_some_and(in_bounding_box)
    }

    /// The outlines of a text's letters, mm.
    fn text_outlines(&mut self, node: Element<'a>, scope: &Scope<'a>) -> Vec<Subpath> {
        let style = self.style(node, &scope.style, scope.basis());
        if !style.displayed || !self.may_enter(node, scope) {
            return Vec::new();
        }
        let mut inner = scope.clone();
        inner.depth += 1;
        inner.style = Rc::new(style);
        self.transform(node, &mut inner);
        // The region of a text's clip path may be asked for while something is measured.
        let outer = self.sink.replace(Sink::Outlines(Vec::new()));
        crate::text::draw(self, node, &inner);
        match std::mem::replace(&mut self.sink, outer) {
            Some(Sink::Outlines(outlines)) => outlines,
            _ => Vec::new(),
        }
    }

    /// Clips a scope to a rectangle in user units.
    pub(crate) fn clip_to(&mut self, scope: &mut Scope<'a>, rect: Rect) {
        let corners = [(rect.x0, rect.y0), (rect.x1, rect.y0), (rect.x1, rect.y1), (rect.x0, rect.y1)];
        let corners = corners.map(|corner| scope.map * Point::from(corner));
        let subpath = Subpath::polyline(&corners, true);
        let area = subpath.and_then(|subpath| Area::new(&[subpath], drawing::FillRule::NonZero));
        let region = Region::new(area.into_iter().collect(), None);
        Rc::make_mut(&mut scope.clips).push(Rc::new(region));
    }

    fn clip_path(&mut self, node: Element<'a>, id: &'a str, scope: &Scope<'a>) -> Option<Element<'a>> {
        let target = self.target(node, &format!("#{id}"), scope)?;
        (attributes::name(target) == Some("clipPath")).then_some(target)
    }

    /// The region of a clip path for an element with that scope; nothing (and a finding) if it
    /// cannot be applied.
    fn region(
        &mut self,
        node: Element<'a>,
        clip_path: Element<'a>,
        scope: &Scope<'a>,
        bounds: Option<Rect>,
    ) -> Option<Rc<Region>> {
        let frame = if in_bounding_box(clip_path) {
            let Some(bounds) = bounds else {
                let message = "a clip path in units of the bounding box of nothing is not applied";
                self.note(codes::CLIP_NOT_APPLIED, "", node, message);
                return None;
            };
            Affine::new([bounds.width(), 0.0, 0.0, bounds.height(), bounds.x0, bounds.y0])
        } else {
            Affine::IDENTITY
        };
        let map = scope.map * frame;
        let rect = bounds.map_or([0.0; 4], |b| [b.x0, b.y0, b.x1, b.y1]);
        let key = (clip_path.id().get_usize(), map.as_coeffs().map(f64::to_bits), rect.map(f64::to_bits));
        if let Some(region) = self.regions.get(&key) {
            return Some(Rc::clone(region));
        }
        let mut inner = Self::referring(scope, clip_path);
        if !self.may_enter(clip_path, &inner) {
            return None;
        }
        inner.map = map;
        inner.style = self.style_by_ancestors(clip_path);
        self.transform(clip_path, &mut inner);
        let (mut areas, mut within) = (Vec::new(), None);
        if let Some(id) = inner.style.clip_path
            && let Some(other) = self.clip_path(clip_path, id, &inner)
        {
            within = self.region(node, other, &inner, bounds);
        }
        for child in clip_path.children().filter(Node::is_element) {
            if attributes::name(child) == Some("text") {
                if self.options.outlines.is_none() {
                    self.report(codes::CLIP_NOT_APPLIED, "text", node, || {
                        let help = "draw text as outlines, or convert it to paths in an editor".into();
                        ("a clip path made of text is not applied".into(), Some(help))
                    });
                    return None;
                }
                let outlines = self.text_outlines(child, &inner);
                let edges = outlines.iter().map(|outline| outline.segments.len() as u64).sum();
                self.output.clip_edges_left = self.output.clip_edges_left.saturating_sub(edges);
                areas.extend(Area::new(&outlines, drawing::FillRule::NonZero));
                continue;
            }
            areas.extend(self.area(child, &inner));
        }
        let region = Rc::new(Region::new(areas, within));
        if self.regions.len() < CACHE {
            self.regions.insert(key, Rc::clone(&region));
        }
        Some(region)
    }

    /// The area of a child of a clip path: a shape, or a `use` of one.
    fn area(&mut self, child: Element<'a>, scope: &Scope<'a>) -> Option<Area> {
        let name = attributes::name(child)?;
        if !self.may_enter(child, scope) {
            return None;
        }
        let style = self.style(child, &scope.style, scope.basis());
        if !style.displayed {
            return None;
        }
        let mut inner = scope.clone();
        inner.depth += 1;
        inner.style = Rc::new(style);
        self.transform(child, &mut inner);
        if name == "use" {
            let target = self.target(child, attributes::href(child)?, &inner)?;
            let length = |name, axis| {
                let length = child.attribute(name).and_then(units::parse);
                length.map_or(0.0, |length| inner.basis().user(length, axis))
            };
            let shift = Affine::translate((length("x", Axis::X), length("y", Axis::Y)));
            let mut referring = Self::referring(&inner, target);
            referring.map *= shift;
            return self.area(target, &referring);
        }
        if !shapes::is_shape(name) || !inner.style.visible {
            return None;
        }
        let shape = shapes::outline(name, child, &inner.style, inner.basis());
        let outlines: Vec<Subpath> =
            shape.subpaths.iter().map(|subpath| subpath.transformed(inner.map)).collect();
        let is_far = |p: Point| !(p.x.abs() < limits::COORDINATE_MM && p.y.abs() < limits::COORDINATE_MM);
        if outlines.iter().flat_map(|outline| &outline.segments).any(|s| {
            let bounds = s.bounding_box();
            is_far(bounds.origin()) || is_far(Point::new(bounds.x1, bounds.y1))
        }) {
            self.refused(child, Refused::OutOfRange);
            return None;
        }
        let edges = outlines.iter().map(|outline| outline.segments.len() as u64).sum();
        self.output.clip_edges_left = self.output.clip_edges_left.saturating_sub(edges);
        if self.output.clip_edges_left == 0 {
            self.refused(child, Refused::TooMany);
            return None;
        }
        let mut area = Area::new(&outlines, inner.style.clip_rule)?;
        if let Some(id) = inner.style.clip_path
            && let Some(other) = self.clip_path(child, id, &inner)
        {
            area.within = self.region(child, other, &inner, path::bounds(&shape.subpaths));
        }
        Some(area)
    }

    /// The style of an element where it stands in the file, as markers and clip paths have it.
    pub(crate) fn style_by_ancestors(&mut self, node: Element<'a>) -> Rc<Style<'a>> {
        let id = node.id().get_usize();
        if let Some(style) = self.styles.get(&id) {
            return Rc::clone(style);
        }
        let mut chain: Vec<Element<'a>> = node.ancestors().filter(Node::is_element).collect();
        chain.reverse();
        let mut style = Style::default();
        for node in chain {
            let basis = Basis { width: 0.0, height: 0.0, font_size: style.font_size };
            style = self.style(node, &style, basis);
        }
        let style = Rc::new(style);
        self.styles.insert(id, Rc::clone(&style));
        style
    }
}

fn in_bounding_box(clip_path: Element<'_>) -> bool {
    clip_path.attribute("clipPathUnits") == Some("objectBoundingBox")
}
