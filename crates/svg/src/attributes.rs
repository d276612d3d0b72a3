//! Names, references, places and transforms of elements.

use drawing::Affine;
use roxmltree::Node;
use svgtypes::{TransformListParser, TransformListToken};

use crate::diagnostics::Place;

const SVG: &str = "http://www.w3.org/2000/svg";
const XLINK: &str = "http://www.w3.org/1999/xlink";
pub(crate) const INKSCAPE: &str = "http://www.inkscape.org/namespaces/inkscape";

/// The name of an element of SVG (or of no namespace, for files that forget it); nothing for
/// foreign elements.
pub(crate) fn name<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    let tag = node.tag_name();
    (node.is_element() && tag.namespace().is_none_or(|namespace| namespace == SVG || namespace == "unknown"))
        .then(|| tag.name())
}

/// What `href` or `xlink:href` names.
pub(crate) fn href<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    node.attribute("href").or_else(|| node.attribute((XLINK, "href"))).map(str::trim)
}

/// Where an element is.
pub(crate) fn place(node: Node<'_, '_>) -> Place {
    let name = node.tag_name().name();
    let element = node.attribute("id").map_or(name.to_owned(), |id| format!("{name}#{id}"));
    Place { range: node.range(), element }
}

/// The id of `url(#id)`.
pub(crate) fn url(value: &str) -> Option<&str> {
    let inside = value.trim().strip_prefix("url(")?.split(')').next()?;
    inside.trim().trim_matches(['"', '\'']).trim().strip_prefix('#')
}

/// The map that a list of transforms stands for; `None` if it is malformed.
///
/// The units `px` and `deg` of CSS are allowed.
pub(crate) fn transform(text: &str) -> Option<Affine> {
    if text.trim() == "none" {
        return Some(Affine::IDENTITY);
    }
    if text.contains("px") || text.contains("deg") {
        return transform(&text.replace("px", "").replace("deg", ""));
    }
    let mut map = Affine::IDENTITY;
    for token in TransformListParser::from(text) {
        map *= match token.ok()? {
            TransformListToken::Matrix { a, b, c, d, e, f } => Affine::new([a, b, c, d, e, f]),
            TransformListToken::Translate { tx, ty } => Affine::translate((tx, ty)),
            TransformListToken::Scale { sx, sy } => Affine::scale_non_uniform(sx, sy),
            TransformListToken::Rotate { angle } => rotation(angle),
            TransformListToken::SkewX { angle } => {
                Affine::new([1.0, 0.0, libm::tan(angle.to_radians()), 1.0, 0.0, 0.0])
            }
            TransformListToken::SkewY { angle } => {
                Affine::new([1.0, libm::tan(angle.to_radians()), 0.0, 1.0, 0.0, 0.0])
            }
        };
    }
    Some(map)
}

/// A rotation by degrees; exact for multiples of a right angle.
pub(crate) fn rotation(degrees: f64) -> Affine {
    let (sin, cos) = sin_cos(degrees);
    Affine::new([cos, sin, -sin, cos, 0.0, 0.0])
}

/// Sine and cosine of degrees; exact for multiples of a right angle.
pub(crate) fn sin_cos(degrees: f64) -> (f64, f64) {
    match libm::fmod(degrees, 360.0) {
        0.0 => (0.0, 1.0),
        90.0 | -270.0 => (1.0, 0.0),
        180.0 | -180.0 => (0.0, -1.0),
        270.0 | -90.0 => (-1.0, 0.0),
        degrees => libm::sincos(degrees.to_radians()),
    }
}

#[cfg(test)]
mod tests {
    use drawing::Point;

    use super::*;

    #[test]
    fn transforms_apply_from_right_to_left() {
        let map = transform("translate(10,20) rotate(90) scale(2)").unwrap();
        assert_eq!(map * Point::new(1.0, 0.0), Point::new(10.0, 22.0));
        let about = transform("rotate(180 5 5)").unwrap();
        assert_eq!(about * Point::new(5.0, 4.0), Point::new(5.0, 6.0));
        assert_eq!(
            transform("translate(3px, 4px) rotate(90deg)").unwrap() * Point::ZERO,
            Point::new(3.0, 4.0)
        );
        assert!(transform("rotate(").is_none());
    }

    #[test]
    fn references_are_unquoted() {
        assert_eq!(url("url(#a)"), Some("a"));
        assert_eq!(url(" url( '#a b' ) "), Some("a b"));
        assert_eq!(url("none"), None);
    }
}
