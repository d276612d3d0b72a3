//! `use`, `symbol` and nested `svg`.

use std::rc::Rc;

use drawing::Affine;

use super::{Element, Scope, Walker};
use crate::attributes;
use crate::codes;
use crate::units::{self, Axis};
use crate::viewport;

impl<'a> Walker<'a, '_> {
    /// The element that a reference names, unless it contains the reference itself.
    pub(crate) fn target(&mut self, node: Element<'a>, href: &str, scope: &Scope<'a>) -> Option<Element<'a>> {
        let found = href.strip_prefix('#').and_then(|id| self.ids.get(id)).copied();
        let Some(target) = found else {
            self.report(codes::BAD_REFERENCE, href, node, || {
                let href: String = href.chars().take(60).collect();
                let help = (!href.starts_with('#')).then(|| "other files are not read".to_owned());
                (format!("there is no element {href}"), help)
            });
            return None;
        };
        let id = target.id().get_usize();
        if node.ancestors().any(|above| above == target) || scope.references.contains(&id) {
            self.note(codes::RECURSION, href, node, "the element refers to itself: it is not drawn again");
            return None;
        }
        Some(target)
    }

    /// The scope inside a reference to `target`.
    pub(super) fn referring(scope: &Scope<'a>, target: Element<'a>) -> Scope<'a> {
        let mut references = scope.references.to_vec();
        references.push(target.id().get_usize());
        Scope { references: Rc::new(references), depth: scope.depth + 1, ..scope.clone() }
    }

    /// The scope of what is referred to but for its map and style; nothing where nothing more may
    /// be drawn.
    pub(crate) fn content_scope(&mut self, scope: &Scope<'a>, target: Element<'a>) -> Option<Scope<'a>> {
        let inner = Self::referring(scope, target);
        self.may_enter(target, &inner).then_some(inner)
    }

    /// Draws what a `use` element refers to.
    pub(super) fn reference(&mut self, node: Element<'a>, scope: &Scope<'a>) {
        let Some(href) = attributes::href(node) else { return };
        let Some(target) = self.target(node, href, scope) else { return };
        let mut inner = Self::referring(scope, target);
        let basis = scope.basis();
        let length = |name, axis| {
            let value = scope.style.geometry(name).or_else(|| node.attribute(name));
            value.and_then(units::parse).map(|length| basis.user(length, axis))
        };
        let (x, y) = (length("x", Axis::X).unwrap_or(0.0), length("y", Axis::Y).unwrap_or(0.0));
        inner.map *= Affine::translate((x, y));
        let size = [length("width", Axis::X), length("height", Axis::Y)];
        match attributes::name(target) {
            Some("symbol" | "svg") => {
                if self.may_enter(target, &inner)
                    && let Some(inner) = self.enter(target, &inner)
                {
                    self.nested(target, &inner, Some(size));
                }
            }
            _ => self.element(target, &inner),
        }
    }

    /// Draws the content of a nested `svg` or a `symbol` in its viewport. `size` is that of the
    /// reference.
    pub(super) fn nested(&mut self, node: Element<'a>, scope: &Scope<'a>, size: Option<[Option<f64>; 2]>) {
        let basis = scope.basis();
        let length = |name, axis| {
            let value = scope.style.geometry(name).or_else(|| node.attribute(name));
            value.and_then(units::parse).map(|length| basis.user(length, axis))
        };
        let [wide, high] = size.unwrap_or_default();
        let width = wide.or_else(|| length("width", Axis::X)).unwrap_or(basis.width);
        let height = high.or_else(|| length("height", Axis::Y)).unwrap_or(basis.height);
        if !(width > 0.0 && height > 0.0) {
            return;
        }
        let (x, y) = (length("x", Axis::X).unwrap_or(0.0), length("y", Axis::Y).unwrap_or(0.0));
        let mut inner = scope.clone();
        inner.map *= Affine::translate((x, y));
        let view = viewport::view_box(node);
        let content = view.map_or(Affine::IDENTITY, |view| {
            viewport::onto(view, viewport::aspect_ratio(node), width, height)
        });
        inner.map *= content;
        inner.viewport = view.map_or([width, height], |view| [view.w, view.h]);
        // A symbol without a viewBox and a size fills the whole viewport; nothing is cut then.
        let is_bounded = view.is_some() || size.is_none() || wide.is_some() || high.is_some();
        if is_bounded
            && !scope.style.overflow_visible
            && let Some(visible) = viewport::visible(content, width, height)
        {
            self.clip_to(&mut inner, visible);
        }
        self.children(node, &inner);
    }
}
