//! `viewBox` and `preserveAspectRatio`.

use drawing::{Affine, Rect};
use roxmltree::Node;
use svgtypes::{Align, AspectRatio, ViewBox};

/// The view box of an element; `None` if it is missing or invalid.
pub(crate) fn view_box(node: Node<'_, '_>) -> Option<ViewBox> {
    node.attribute("viewBox")?.trim().parse().ok()
}

/// The element's `preserveAspectRatio`.
pub(crate) fn aspect_ratio(node: Node<'_, '_>) -> AspectRatio {
    let text = node.attribute("preserveAspectRatio").unwrap_or("").trim();
    text.strip_prefix("defer").unwrap_or(text).trim().parse().unwrap_or_default()
}

/// The map from the view box onto a viewport of that size at the origin.
pub(crate) fn onto(view: ViewBox, ratio: AspectRatio, width: f64, height: f64) -> Affine {
    let (sx, sy) = (width / view.w, height / view.h);
    if ratio.align == Align::None {
        return Affine::scale_non_uniform(sx, sy) * Affine::translate((-view.x, -view.y));
    }
    let scale = if ratio.slice { sx.max(sy) } else { sx.min(sy) };
    let (fx, fy) = match ratio.align {
        Align::None | Align::XMinYMin => (0.0, 0.0),
        Align::XMidYMin => (0.5, 0.0),
        Align::XMaxYMin => (1.0, 0.0),
        Align::XMinYMid => (0.0, 0.5),
        Align::XMidYMid => (0.5, 0.5),
        Align::XMaxYMid => (1.0, 0.5),
        Align::XMinYMax => (0.0, 1.0),
        Align::XMidYMax => (0.5, 1.0),
        Align::XMaxYMax => (1.0, 1.0),
    };
    let shift = (fx * (width - scale * view.w), fy * (height - scale * view.h));
    Affine::translate(shift) * Affine::scale(scale) * Affine::translate((-view.x, -view.y))
}

/// The part of the view that shows in the viewport, in units of the view box.
pub(crate) fn visible(map: Affine, width: f64, height: f64) -> Option<Rect> {
    let rect = Rect::new(0.0, 0.0, width, height);
    (map.determinant() != 0.0).then(|| map.inverse().transform_rect_bbox(rect))
}
