//! Basic shapes: `rect`, `circle`, `ellipse`, `line`, `polyline`, `polygon`, `path`.

use drawing::{EllipticArc, Line, Point, Segment, Vec2};
use roxmltree::Node;
use svgtypes::PointsParser;

use crate::path::{self, Subpath};
use crate::style::Style;
use crate::units::{self, Axis, Basis};

/// The outline of a shape, user units.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shape {
    pub(crate) subpaths: Vec<Subpath>,
    /// Whether its data have an error.
    pub(crate) damaged: bool,
    /// Whether it can have markers.
    pub(crate) has_vertices: bool,
}

/// Whether an element of that name is a shape.
pub(crate) fn is_shape(name: &str) -> bool {
    matches!(name, "path" | "rect" | "circle" | "ellipse" | "line" | "polyline" | "polygon")
}

/// The outline of a shape of that style; empty where it has no extent.
pub(crate) fn outline<'a>(name: &str, node: Node<'a, '_>, style: &Style<'a>, basis: Basis) -> Shape {
    let maybe = |attribute: &str, axis| {
        let value = style.geometry(attribute).or_else(|| node.attribute(attribute));
        value.and_then(units::parse).map(|length| basis.user(length, axis))
    };
    let number = |attribute: &str, axis| maybe(attribute, axis).unwrap_or(0.0);
    match name {
        "path" => {
            let (subpaths, right) = path::parse(data(node, style));
            Shape { subpaths, damaged: !right, has_vertices: true }
        }
        "polyline" | "polygon" => {
            let text = node.attribute("points").unwrap_or("").trim();
            let points: Vec<Point> = PointsParser::from(text).map(Point::from).collect();
            let single = points.len() < 2;
            let subpaths = if single { None } else { Subpath::polyline(&points, name == "polygon") };
            // The parser stops silently; every point has two numbers.
            let numbers = text.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty());
            let damaged = (single && !text.is_empty()) || points.len() < numbers.count() / 2;
            Shape { subpaths: subpaths.into_iter().collect(), damaged, has_vertices: true }
        }
        "line" => {
            let from = Point::new(number("x1", Axis::X), number("y1", Axis::Y));
            let to = Point::new(number("x2", Axis::X), number("y2", Axis::Y));
            let subpaths = Subpath::polyline(&[from, to], false);
            Shape { subpaths: subpaths.into_iter().collect(), damaged: false, has_vertices: true }
        }
        "rect" => {
            let [x, y] = [number("x", Axis::X), number("y", Axis::Y)];
            let [width, height] = [number("width", Axis::X), number("height", Axis::Y)];
            let (rx, ry) = (maybe("rx", Axis::X), maybe("ry", Axis::Y));
            let radius = |one: Option<f64>, other: Option<f64>, half: f64| {
                one.filter(|r| *r >= 0.0).or(other).unwrap_or(0.0).clamp(0.0, half.max(0.0))
            };
            let radii = Vec2::new(radius(rx, ry, width / 2.0), radius(ry, rx, height / 2.0));
            closed(rectangle(Point::new(x, y), Vec2::new(width, height), radii))
        }
        "circle" => {
            let r = number("r", Axis::Diagonal);
            closed(ellipse(number("cx", Axis::X), number("cy", Axis::Y), r, r))
        }
        "ellipse" => {
            let (rx, ry) = (maybe("rx", Axis::X), maybe("ry", Axis::Y));
            let (rx, ry) = (rx.or(ry).unwrap_or(0.0), ry.or(rx).unwrap_or(0.0));
            closed(ellipse(number("cx", Axis::X), number("cy", Axis::Y), rx, ry))
        }
        _ => Shape::default(),
    }
}

/// The data of a path, as its attribute or as CSS gives them (`path("M0 0")`).
fn data<'n>(node: Node<'n, '_>, style: &Style<'n>) -> &'n str {
    let given = style.geometry("d").and_then(|value| {
        let inside = value.strip_prefix("path(")?.strip_suffix(')')?.trim();
        Some(inside.trim_matches(['"', '\'']))
    });
    given.or_else(|| node.attribute("d")).unwrap_or("")
}

fn closed(subpath: Option<Subpath>) -> Shape {
    Shape { subpaths: subpath.into_iter().collect(), damaged: false, has_vertices: false }
}

/// A whole ellipse as one arc, from its rightmost point on.
fn ellipse(cx: f64, cy: f64, rx: f64, ry: f64) -> Option<Subpath> {
    let arc = EllipticArc {
        center: Point::new(cx, cy),
        a: Vec2::new(rx, 0.0),
        b: Vec2::new(0.0, ry),
        start_rad: 0.0,
        sweep_rad: std::f64::consts::TAU,
    };
    let start = Point::new(cx + rx, cy);
    (rx > 0.0 && ry > 0.0).then(|| Subpath { start, segments: vec![Segment::Arc(arc)], closed: true })
}

/// A rectangle with rounded corners where the radii are not 0.
fn rectangle(corner: Point, size: Vec2, radii: Vec2) -> Option<Subpath> {
    if !(size.x > 0.0 && size.y > 0.0) {
        return None;
    }
    let (x0, y0, x1, y1) = (corner.x, corner.y, corner.x + size.x, corner.y + size.y);
    if radii.x <= 0.0 || radii.y <= 0.0 {
        let corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(Point::from);
        return Subpath::polyline(&corners, true);
    }
    let (rx, ry) = (radii.x, radii.y);
    let quarter = std::f64::consts::FRAC_PI_2;
    let start = Point::new(x0 + rx, y0);
    let mut segments = Vec::new();
    let mut at = start;
    let mut go = |to: Point, center: Point, angle: f64, end: Point| {
        if to != at {
            segments.push(Segment::Line(Line::new(at, to)));
        }
        let (a, b) = (Vec2::new(rx, 0.0), Vec2::new(0.0, ry));
        segments.push(Segment::Arc(EllipticArc { center, a, b, start_rad: angle, sweep_rad: quarter }));
        at = end;
    };
    go(Point::new(x1 - rx, y0), Point::new(x1 - rx, y0 + ry), -quarter, Point::new(x1, y0 + ry));
    go(Point::new(x1, y1 - ry), Point::new(x1 - rx, y1 - ry), 0.0, Point::new(x1 - rx, y1));
    go(Point::new(x0 + rx, y1), Point::new(x0 + rx, y1 - ry), quarter, Point::new(x0, y1 - ry));
    go(Point::new(x0, y0 + ry), Point::new(x0 + rx, y0 + ry), 2.0 * quarter, start);
    Some(Subpath { start, segments, closed: true })
}
