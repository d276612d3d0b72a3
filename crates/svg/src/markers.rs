//! Markers at the vertices of paths.

use drawing::{Affine, Point, Rect, Segment, Vec2};
use roxmltree::Node;

use crate::attributes;
use crate::path::Subpath;
use crate::units::{self, Axis};
use crate::viewport;
use crate::walk::{Element, Scope, Walker};

/// A vertex, and the directions of the path before and after it.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    place: Point,
    before: Option<Vec2>,
    after: Option<Vec2>,
}

impl Vertex {
    /// The direction that `orient="auto"` takes, degrees.
    fn degrees(self) -> f64 {
        let unit = |v: Vec2| v / v.hypot2().sqrt();
        let direction = match (self.before, self.after) {
            (Some(before), Some(after)) => {
                let sum = unit(before) + unit(after);
                if sum.hypot2() < 1e-18 { after } else { sum }
            }
            (Some(one), None) | (None, Some(one)) => one,
            (None, None) => Vec2::new(1.0, 0.0),
        };
        libm::atan2(direction.y, direction.x).to_degrees()
    }
}

/// The directions at both ends of a piece; nothing where it has no length.
fn directions(segment: &Segment) -> Option<(Vec2, Vec2)> {
    let ends = match segment {
        Segment::Line(line) => (line.p1 - line.p0, line.p1 - line.p0),
        Segment::Arc(_) => (segment.derivatives(0.0).0, segment.derivatives(1.0).0),
        Segment::Cubic(c) => {
            // Where control points coincide with an end, the next one gives the direction.
            let first = |ways: [Vec2; 3]| ways.into_iter().find(|way| way.hypot2() > 0.0).unwrap_or_default();
            (first([c.p1 - c.p0, c.p2 - c.p0, c.p3 - c.p0]), first([c.p3 - c.p2, c.p3 - c.p1, c.p3 - c.p0]))
        }
    };
    (ends.0.hypot2() > 0.0 && ends.1.hypot2() > 0.0).then_some(ends)
}

/// All vertices of subpaths.
fn vertices(subpaths: &[Subpath]) -> Vec<Vertex> {
    let mut vertices = Vec::new();
    for subpath in subpaths {
        let first = vertices.len();
        let mut at = Vertex { place: subpath.start, before: None, after: None };
        for segment in &subpath.segments {
            let ways = directions(segment);
            at.after = ways.map(|ways| ways.0);
            vertices.push(at);
            at = Vertex { place: segment.end(), before: ways.map(|ways| ways.1).or(at.before), after: None };
        }
        vertices.push(at);
        if subpath.closed && vertices.len() - first > 1 {
            let last = vertices.len() - 1;
            vertices[first].before = vertices[last].before;
            vertices[last].after = vertices[first].after;
        }
    }
    vertices
}

/// Draws the markers of a path.
pub(crate) fn draw<'a>(
    walker: &mut Walker<'a, '_>,
    node: Element<'a>,
    scope: &Scope<'a>,
    subpaths: &[Subpath],
) {
    let vertices = vertices(subpaths);
    let [start, mid, end] = scope.style.markers;
    let mut look_up = |id: Option<&'a str>| Some((id?, walker.target(node, &format!("#{}", id?), scope)?));
    let found = [look_up(start), look_up(mid), look_up(end)];
    let last = vertices.len().saturating_sub(1);
    for (index, vertex) in vertices.iter().enumerate() {
        // A path of one vertex has both ends there.
        let which = [index == 0, index > 0 && index < last, index == last];
        for (position, _) in which.into_iter().enumerate().filter(|(_, is_here)| *is_here) {
            let Some((_, marker)) = found[position] else { continue };
            if attributes::name(marker) == Some("marker") {
                draw_one(walker, marker, scope, *vertex, position == 0);
            }
        }
    }
}

fn draw_one<'a>(
    walker: &mut Walker<'a, '_>,
    marker: Element<'a>,
    scope: &Scope<'a>,
    vertex: Vertex,
    is_start: bool,
) {
    let style = walker.style_by_ancestors(marker);
    let basis = scope.basis();
    let length = |name: &str, axis, default: f64| {
        let text = marker.attribute(name).unwrap_or("");
        units::parse(text).map_or(default, |length| basis.user(length, axis))
    };
    let (width, height) = (length("markerWidth", Axis::X, 3.0), length("markerHeight", Axis::Y, 3.0));
    if !(width > 0.0 && height > 0.0) {
        return;
    }
    let degrees = match marker.attribute("orient").map(str::trim) {
        Some("auto") => vertex.degrees(),
        Some("auto-start-reverse") => vertex.degrees() + if is_start { 180.0 } else { 0.0 },
        Some(angle) => angle.trim_end_matches("deg").parse().unwrap_or(0.0),
        None => 0.0,
    };
    let is_in_user_units = marker.attribute("markerUnits") == Some("userSpaceOnUse");
    let scale = if is_in_user_units { 1.0 } else { scope.style.stroke_width };
    let view = viewport::view_box(marker);
    let content = view
        .map_or(Affine::IDENTITY, |view| viewport::onto(view, viewport::aspect_ratio(marker), width, height));
    let reference = content * reference(marker, view, width, height);
    let Some(mut inner) = walker.content_scope(scope, marker) else { return };
    inner.map = scope.map
        * Affine::translate(vertex.place.to_vec2())
        * attributes::rotation(degrees)
        * Affine::scale(scale)
        * Affine::translate(-reference.to_vec2())
        * content;
    inner.context = Some([scope.style.fill, scope.style.stroke]);
    let overflow_visible = style.overflow_visible;
    inner.style = style;
    if !overflow_visible {
        let visible = viewport::visible(content, width, height);
        walker.clip_to(&mut inner, visible.unwrap_or(Rect::ZERO));
    }
    for child in marker.children().filter(Node::is_element) {
        walker.element(child, &inner);
    }
}

/// `refX` and `refY`, in units of the marker's content.
fn reference(marker: Element<'_>, view: Option<svgtypes::ViewBox>, width: f64, height: f64) -> Point {
    let frame = view.unwrap_or(svgtypes::ViewBox::new(0.0, 0.0, width, height));
    let one = |name: &str, from: f64, size: f64| match marker.attribute(name).map(str::trim) {
        Some("left" | "top") => from,
        Some("center") => from + 0.5 * size,
        Some("right" | "bottom") => from + size,
        Some(text) => units::parse(text).map_or(0.0, |length| match length.unit {
            svgtypes::LengthUnit::Percent => from + length.number / 100.0 * size,
            _ => units::absolute(length).unwrap_or(length.number),
        }),
        None => 0.0,
    };
    Point::new(one("refX", frame.x, frame.w), one("refY", frame.y, frame.h))
}
