//! Strokes, fills and markers of shapes.

use std::borrow::Cow;
use std::rc::Rc;

use drawing::{Affine, FillRule};

use super::{Element, Scope, Walker};
use crate::attributes;
use crate::codes;
use crate::path::Subpath;
use crate::shapes::Shape;
use crate::style::Paint;
use crate::{dashes, markers};

/// References from gradient to gradient followed for the first colour.
const GRADIENT_CHAIN: usize = 10;

impl<'a> Walker<'a, '_> {
    /// Draws what a shape's fill and stroke ask for.
    pub(super) fn paint_shape(&mut self, name: &'a str, node: Element<'a>, scope: &Scope<'a>, shape: &Shape) {
        let style = Rc::clone(&scope.style);
        let has_area = shape.subpaths.iter().any(|subpath| {
            subpath.segments.len() > 1
                || subpath.segments.iter().any(|s| !matches!(s, drawing::Segment::Line(_)))
        });
        let fill = if has_area && name != "line" {
            self.color_of(style.fill, style.fill_opacity, node, scope)
        } else {
            None
        };
        let mut stroke = self.color_of(style.stroke, style.stroke_opacity, node, scope);
        let is_invisible = stroke.is_none() && fill.is_none();
        if stroke.is_some() && style.stroke_width <= 0.0 {
            self.note(codes::ZERO_WIDTH, "", node, "a stroke of width 0 is invisible and not drawn");
            stroke = None;
        }
        if let Some(color) = fill {
            self.fill(node, scope, shape, color, stroke.is_some());
        } else if is_invisible {
            self.note(codes::NO_PAINT, "", node, "a shape has neither stroke nor fill and is not drawn");
        }
        if let Some(color) = stroke {
            self.stroke(node, scope, shape, color);
        }
        if shape.has_vertices && style.markers.iter().any(Option::is_some) {
            markers::draw(self, node, scope, &shape.subpaths);
        }
    }

    fn fill(
        &mut self,
        node: Element<'a>,
        scope: &Scope<'a>,
        shape: &Shape,
        color: [u8; 3],
        is_stroked: bool,
    ) {
        self.hatch(node, scope, &shape.subpaths, scope.style.fill_rule, color);
        if self.options.outline_fills && !is_stroked {
            let ink = self.ink(node, scope, color);
            self.draw(node, scope, &shape.subpaths, &ink);
        } else if self.options.hatch.is_none() && is_stroked {
            let message = "a shape has a fill and a stroke: only the stroke is drawn";
            self.note(codes::FILL_OF_STROKE, "", node, message);
        } else if self.options.hatch.is_none() {
            self.report(codes::FILL_NOT_DRAWN, "", node, || {
                let help = "hatch fills, draw their outlines, or give the shape a stroke".into();
                ("a shape has a fill and no stroke: it is not drawn".into(), Some(help))
            });
        }
    }

    /// Hatches the inside of subpaths, if fills are hatched at all.
    pub(crate) fn hatch(
        &mut self,
        node: Element<'a>,
        scope: &Scope<'a>,
        subpaths: &[Subpath],
        rule: FillRule,
        color: [u8; 3],
    ) {
        let Some(hatch) = self.options.hatch.filter(|hatch| hatch.spacing_mm > 0.0) else { return };
        let outlines: Vec<Subpath> = subpaths.iter().map(|subpath| subpath.transformed(scope.map)).collect();
        let ink = self.ink(node, scope, color);
        if let Err(refused) = self.output.hatch(&outlines, rule, hatch, &ink) {
            self.refused(node, refused);
        }
    }

    fn stroke(&mut self, node: Element<'a>, scope: &Scope<'a>, shape: &Shape, color: [u8; 3]) {
        let ink = self.ink(node, scope, color);
        let basis = scope.basis();
        let pattern = if scope.style.dashes.is_empty() { None } else { scope.style.dash_lengths(basis) };
        let Some(mut lengths) = pattern else {
            self.draw(node, scope, &shape.subpaths, &ink);
            return;
        };
        let mut offset = scope.style.dash_offset;
        let (mut subpaths, mut map) = (Cow::Borrowed(&shape.subpaths), scope.map);
        if scope.style.non_scaling {
            // Pixels of the page, whatever the transform.
            subpaths = Cow::Owned(shape.subpaths.iter().map(|subpath| subpath.transformed(map)).collect());
            for length in &mut lengths {
                *length *= self.px_mm;
            }
            offset *= self.px_mm;
            map = Affine::IDENTITY;
        }
        let path_length = node.attribute("pathLength").and_then(|text| text.trim().parse::<f64>().ok());
        if let Some(path_length) = path_length.filter(|length| *length > 0.0) {
            let segments = subpaths.iter().flat_map(|subpath| &subpath.segments);
            let scale = segments.map(drawing::Segment::length).sum::<f64>() / path_length;
            for length in &mut lengths {
                *length *= scale;
            }
            offset *= scale;
        }
        for (subpath, solid) in subpaths.iter().zip(&shape.subpaths) {
            let Some(dashes) = dashes::cut(subpath, &lengths, offset, &mut self.output.dashes_left) else {
                let message = "the dashes of a stroke are too fine: it is drawn solid";
                self.note(codes::TOO_MANY_DASHES, "", node, message);
                self.draw(node, scope, std::slice::from_ref(solid), &ink);
                continue;
            };
            for dash in dashes {
                let pieces = dash.iter().map(|segment| segment.transformed(map)).collect();
                if let Err(refused) = self.output.run(pieces, false, &ink) {
                    self.refused(node, refused);
                    return;
                }
            }
        }
    }

    /// The colour of a paint; `None` if it paints nothing.
    pub(crate) fn color_of(
        &mut self,
        paint: Paint<'a>,
        opacity: f64,
        node: Element<'a>,
        scope: &Scope<'a>,
    ) -> Option<[u8; 3]> {
        if opacity <= 0.0 {
            return None;
        }
        let [context_fill, context_stroke] = scope.context.unwrap_or([Paint::None; 2]);
        let paint = match paint {
            Paint::ContextFill => context_fill,
            Paint::ContextStroke => context_stroke,
            paint => paint,
        };
        match paint {
            Paint::None | Paint::ContextFill | Paint::ContextStroke => None,
            Paint::Color(color) => Some(color),
            Paint::Server(id, fallback) => {
                let Some(&server) = self.ids.get(id) else {
                    self.report(codes::BAD_REFERENCE, id, node, || {
                        (format!("there is no gradient or pattern #{id}"), None)
                    });
                    return fallback;
                };
                let kind = server.tag_name().name();
                self.report(codes::PAINT_SERVER, kind, node, || {
                    (format!("a {kind} is taken as one plain colour"), None)
                });
                Some(self.first_color(server).or(fallback).unwrap_or([0; 3]))
            }
        }
    }

    /// The first colour of a gradient.
    fn first_color(&self, mut server: Element<'a>) -> Option<[u8; 3]> {
        for _ in 0..GRADIENT_CHAIN {
            let stop = server.descendants().find(|node| attributes::name(*node) == Some("stop"));
            if let Some(stop) = stop {
                let style = stop.attribute("style").unwrap_or("");
                let own = crate::css::declarations(style).find(|d| d.name == "stop-color").map(|d| d.value);
                let color = own.or_else(|| stop.attribute("stop-color")).and_then(crate::colors::parse);
                return Some(color.map_or([0; 3], |(color, _)| color));
            }
            server = *self.ids.get(attributes::href(server)?.strip_prefix('#')?)?;
        }
        None
    }
}
