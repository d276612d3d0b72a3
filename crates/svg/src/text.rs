//! Text in a font of strokes: place, size, anchor, rotation and spacing are the file's.

use std::rc::Rc;

use drawing::{Affine, FillRule, Point, Segment, Vec2};
use svgtypes::LengthListParser;

use crate::attributes;
use crate::codes;
use crate::dashes::Lengths;
use crate::path::Subpath;
use crate::shapes;
use crate::style::Style;
use crate::units::{self, Axis, Basis};
use crate::walk::{Element, Scope, Walker};
use crate::{FaceQuery, Options, OutlineGlyph};

/// Height of capitals in font sizes, as common fonts have it.
const CAP_HEIGHT_EM: f64 = 0.7;
/// Width of the place of a character that no font has, font sizes.
const MISSING_EM: f64 = 0.6;

/// A character with what is given for it alone.
#[derive(Debug)]
struct Letter<'a> {
    character: char,
    style: Rc<Style<'a>>,
    place: [Option<f64>; 2],
    shift: [f64; 2],
    rotation_deg: f64,
}

/// The lists of positions of an element, from its first character on.
#[derive(Debug)]
struct Lists {
    first: usize,
    /// `x`, `y`, `dx`, `dy`, `rotate`.
    values: [Vec<f64>; 5],
}

/// The characters of a text element.
#[derive(Debug, Default)]
struct Letters<'a> {
    list: Vec<Letter<'a>>,
    lists: Vec<Lists>,
}

/// A character in the font that it is drawn in.
struct Glyph {
    /// Distance to the next character, in font sizes.
    advance_em: f64,
    /// Height of capitals in units of a stroke font; `None` for outlines, whose unit is the font size.
    cap_height: Option<f64>,
    /// In units of the font, y up.
    subpaths: Vec<Subpath>,
}

/// The face that a style asks for.
fn face<'a>(style: &Style<'a>) -> FaceQuery<'a> {
    FaceQuery { families: style.font_family, weight: style.font_weight, italic: style.italic }
}

/// A letter from the outline fonts, else from the stroke font; `None` if both lack it.
fn glyph(options: &Options<'_>, letter: &Letter<'_>) -> Option<Glyph> {
    let outline = options.outlines.and_then(|fonts| fonts.glyph(face(&letter.style), letter.character));
    if let Some(OutlineGlyph { advance, contours }) = outline {
        let contour = |segments: Vec<Segment>| {
            let start = segments.first()?.start();
            Some(Subpath { start, segments, closed: true })
        };
        let subpaths = contours.into_iter().filter_map(contour).collect();
        return Some(Glyph { advance_em: advance, cap_height: None, subpaths });
    }
    let font = options.font?;
    let cap_height = font.cap_height();
    let glyph = font.glyph(letter.character)?;
    let subpaths = glyph.strokes.iter().filter_map(|points| Subpath::polyline(points, false)).collect();
    let advance_em = glyph.advance * (CAP_HEIGHT_EM / cap_height);
    Some(Glyph { advance_em, cap_height: Some(cap_height), subpaths })
}

/// Distance from a letter to the next, user units.
fn advance(options: &Options<'_>, letter: &Letter<'_>) -> f64 {
    glyph(options, letter).map_or(MISSING_EM, |glyph| glyph.advance_em) * letter.style.font_size
}

/// What kerning adds to the advance of a letter before the next one, user units. Letters of two styles
/// do not form a pair.
fn kerning(options: &Options<'_>, letter: &Letter<'_>, next: Option<&Letter<'_>>) -> f64 {
    let (Some(fonts), Some(next)) = (options.outlines, next) else { return 0.0 };
    if !Rc::ptr_eq(&letter.style, &next.style) {
        return 0.0;
    }
    fonts.kerning(face(&letter.style), [letter.character, next.character]) * letter.style.font_size
}

/// Reports the font that the stroke font stands for; false where there is no font at all.
fn report_font<'a>(walker: &mut Walker<'a, '_>, node: Element<'a>, style: &Style<'a>) -> bool {
    let family = style.font_family.split(',').next().unwrap_or("").trim().trim_matches(['"', '\'']);
    let family = if family.is_empty() { "default" } else { family };
    if let Some(found) = walker.options.outlines.and_then(|fonts| fonts.family(face(style))) {
        if !found.eq_ignore_ascii_case(family) {
            walker.report(codes::TEXT_FONT, family, node, || {
                let help = "name another font file, or install the font".into();
                (format!("text in the font {family} is drawn with the outlines of {found}"), Some(help))
            });
        }
        return true;
    }
    if walker.options.font.is_none() {
        walker.note(codes::TEXT_NOT_DRAWN, "text", node, "text is not drawn: no font is given");
        return false;
    }
    walker.report(codes::TEXT_FONT, family, node, || {
        let help = "convert the text to paths in an editor for its own letter shapes".into();
        (format!("text in the font {family} is drawn in the stroke font"), Some(help))
    });
    true
}

/// Draws a text element.
pub(crate) fn draw<'a>(walker: &mut Walker<'a, '_>, node: Element<'a>, scope: &Scope<'a>) {
    let mut letters = Letters::default();
    collect(walker, node, scope, &mut letters);
    while letters.list.last().is_some_and(|last| last.character == ' ' && !last.style.keeps_space) {
        letters.list.pop();
    }
    let Some(first) = letters.list.first() else { return };
    if report_font(walker, node, &first.style) {
        lay_out(walker, node, scope, &letters.list);
    }
}

/// Gathers the characters of an element and of the `tspan`s in it.
fn collect<'a>(walker: &mut Walker<'a, '_>, node: Element<'a>, scope: &Scope<'a>, letters: &mut Letters<'a>) {
    let basis = scope.basis();
    let list = |name: &str, axis| -> Vec<f64> {
        let text = node.attribute(name).unwrap_or("").trim();
        LengthListParser::from(text).map_while(Result::ok).map(|l| basis.user(l, axis)).collect()
    };
    let values = [
        list("x", Axis::X),
        list("y", Axis::Y),
        list("dx", Axis::X),
        list("dy", Axis::Y),
        list("rotate", Axis::X),
    ];
    letters.lists.push(Lists { first: letters.list.len(), values });
    for child in node.children() {
        if let Some(text) = child.text().filter(|_| child.is_text()) {
            if walker.may_read(node, text.len()) {
                letters.add(text, &scope.style);
            }
            continue;
        }
        match attributes::name(child) {
            Some("tspan" | "a" | "tref") if child.is_element() => {
                let mut inner = scope.clone();
                inner.style = Rc::new(walker.style(child, &scope.style, basis));
                if inner.style.displayed {
                    collect(walker, child, &inner, letters);
                }
            }
            Some("textPath") => {
                let mut inner = scope.clone();
                inner.style = Rc::new(walker.style(child, &scope.style, basis));
                if inner.style.displayed {
                    along_path(walker, child, &inner);
                }
            }
            _ => {}
        }
    }
    letters.lists.pop();
}

impl<'a> Letters<'a> {
    fn add(&mut self, text: &str, style: &Rc<Style<'a>>) {
        for character in text.chars() {
            let character = if character.is_ascii_whitespace() { ' ' } else { character };
            // Blanks collapse, also over the borders of elements.
            if character == ' '
                && !style.keeps_space
                && self.list.last().is_none_or(|last| last.character == ' ')
            {
                continue;
            }
            let index = self.list.len();
            // The innermost list that has a value for this character counts.
            let given = |which: usize| {
                let mut lists = self.lists.iter().rev();
                lists.find_map(|lists| lists.values[which].get(index - lists.first).copied())
            };
            // The last rotation of a list goes on.
            let rotation = self.lists.iter().rev().find_map(|lists| {
                let values = &lists.values[4];
                values.get(index - lists.first).or(values.last()).copied()
            });
            let letter = Letter {
                character,
                style: Rc::clone(style),
                place: [given(0), given(1)],
                shift: [given(2).unwrap_or(0.0), given(3).unwrap_or(0.0)],
                rotation_deg: rotation.unwrap_or(0.0),
            };
            self.list.push(letter);
        }
    }
}

/// Places characters and draws them: chunks between absolute positions are anchored as a whole.
fn lay_out<'a>(walker: &mut Walker<'a, '_>, node: Element<'a>, scope: &Scope<'a>, letters: &[Letter<'a>]) {
    let mut at = Point::ZERO;
    let mut rest = letters;
    let wanted = node.attribute("textLength").and_then(units::parse);
    let wanted = wanted.map(|length| scope.basis().user(length, Axis::X)).filter(|length| *length >= 0.0);
    while !rest.is_empty() {
        let is_placed = |letter: &Letter<'_>| letter.place.iter().any(Option::is_some);
        let length = rest[1..].iter().position(is_placed).map_or(rest.len(), |next| next + 1);
        let (mut chunk, after) = rest.split_at(length);
        rest = after;
        // A blank before the next chunk is the end of a line.
        if let [before @ .., last] = chunk
            && !rest.is_empty()
            && last.character == ' '
            && !last.style.keeps_space
        {
            chunk = before;
        }
        let Some(first) = chunk.first() else { continue };
        at = Point::new(first.place[0].unwrap_or(at.x), first.place[1].unwrap_or(at.y));
        let origin = at;
        let mut places = Vec::with_capacity(chunk.len());
        for (index, letter) in chunk.iter().enumerate() {
            at += (letter.shift[0], letter.shift[1]);
            places.push(at);
            let blank = if letter.character == ' ' { letter.style.word_spacing } else { 0.0 };
            let kerning = kerning(walker.options, letter, chunk.get(index + 1));
            at.x += advance(walker.options, letter) + kerning + letter.style.letter_spacing + blank;
        }
        // Only the whole text is fitted to its length: that of several chunks does not say which.
        let fitted = if chunk.len() == letters.len() { wanted } else { None };
        let mut stretched = scope.clone();
        if let Some(wanted) = fitted {
            let has = at.x - origin.x;
            if node.attribute("lengthAdjust") == Some("spacingAndGlyphs") && has > 0.0 {
                let about = Affine::translate((origin.x, 0.0));
                let stretch = Affine::scale_non_uniform(wanted / has, 1.0);
                stretched.map = scope.map * about * stretch * about.inverse();
            } else if chunk.len() > 1 {
                let each = (wanted - has) / (chunk.len() - 1) as f64;
                for (index, place) in places.iter_mut().enumerate() {
                    place.x += each * index as f64;
                }
                at.x = origin.x + wanted;
            }
        }
        let back = first.style.anchor.share() * (at.x - origin.x);
        for (letter, place) in chunk.iter().zip(places) {
            draw_letter(walker, node, &stretched, letter, Point::new(place.x - back, place.y));
        }
        at.x -= back;
    }
}

/// Draws the characters of a `textPath` along its path, each at the middle of its width.
fn along_path<'a>(walker: &mut Walker<'a, '_>, node: Element<'a>, scope: &Scope<'a>) {
    let data = node.attribute("path").filter(|data| !data.trim().is_empty());
    let target = match (data, attributes::href(node)) {
        (Some(_), _) => None,
        (None, Some(href)) => match walker.target(node, href, scope) {
            Some(target) => Some(target),
            None => return,
        },
        (None, None) => {
            walker.note(codes::BAD_REFERENCE, "textPath", node, "a textPath names no path");
            return;
        }
    };
    let mut letters = Letters::default();
    collect(walker, node, scope, &mut letters);
    let Some(first) = letters.list.first() else { return };
    let is_known = target.is_none_or(|target| walker.content_scope(scope, target).is_some());
    if !report_font(walker, node, &first.style) || !is_known {
        return;
    }
    let basis = scope.basis();
    let subpaths = match (data, target) {
        (Some(data), _) => crate::path::parse(data).0,
        (None, Some(target)) => {
            let name = attributes::name(target).unwrap_or("");
            shapes::outline(name, target, &Style::default(), basis).subpaths
        }
        (None, None) => Vec::new(),
    };
    let map = target.and_then(|target| target.attribute("transform")).and_then(attributes::transform);
    let map = map.unwrap_or_default();
    let pieces = subpaths.iter().flat_map(|subpath| &subpath.segments);
    let mut total = 0.0;
    let mut way: Vec<(f64, Lengths)> = Vec::new();
    for piece in pieces {
        let lengths = Lengths::of(piece.transformed(map));
        way.push((total, lengths));
        total += way.last().map_or(0.0, |(_, lengths)| lengths.total);
    }
    let options = *walker.options;
    let advance = |letter: &Letter<'_>| advance(&options, letter);
    let spacing = |letter: &Letter<'_>| {
        letter.style.letter_spacing + if letter.character == ' ' { letter.style.word_spacing } else { 0.0 }
    };
    let offset = Basis { width: total, ..basis };
    let offset =
        node.attribute("startOffset").and_then(units::parse).map_or(0.0, |l| offset.user(l, Axis::X));
    let width: f64 = letters.list.iter().map(|letter| advance(letter) + spacing(letter)).sum();
    let mut at = offset - first.style.anchor.share() * width;
    for letter in &letters.list {
        let (half, middle) = (0.5 * advance(letter), at + 0.5 * advance(letter));
        at += advance(letter) + spacing(letter);
        if !(0.0..=total).contains(&middle) {
            continue;
        }
        let index = way.partition_point(|(start, _)| *start <= middle).max(1) - 1;
        let Some((start, lengths)) = way.get(index) else { return };
        let t = lengths.parameter(middle - start);
        let direction = lengths.segment.derivatives(t).0;
        let degrees = libm::atan2(direction.y, direction.x).to_degrees();
        let (sin, cos) = attributes::sin_cos(degrees);
        let place = lengths.segment.eval(t) - half * Vec2::new(cos, sin);
        let turned = Letter { rotation_deg: degrees, style: Rc::clone(&letter.style), ..*letter };
        draw_letter(walker, node, scope, &turned, place);
    }
}

fn draw_letter<'a>(
    walker: &mut Walker<'a, '_>,
    node: Element<'a>,
    scope: &Scope<'a>,
    letter: &Letter<'a>,
    place: Point,
) {
    let style = &letter.style;
    if letter.character == ' ' || !style.visible {
        return;
    }
    let Some(glyph) = glyph(walker.options, letter) else {
        let character = letter.character;
        walker.report(codes::UNKNOWN_CHARACTER, &character.to_string(), node, || {
            (format!("no font has the character {character:?}"), None)
        });
        return;
    };
    let placed = |scale: f64| {
        let raise = style.baseline_shift - style.baseline_em * style.font_size;
        scope.map
            * Affine::translate(place.to_vec2())
            * attributes::rotation(letter.rotation_deg)
            * Affine::translate((0.0, -raise))
            * Affine::scale_non_uniform(scale, -scale)
    };
    let scale = glyph.cap_height.map_or(style.font_size, |cap| CAP_HEIGHT_EM * style.font_size / cap);
    if let Some(sink) = &mut walker.sink {
        sink.take(&glyph.subpaths, placed(scale));
        return;
    }
    let fill = walker.color_of(style.fill, style.fill_opacity, node, scope);
    let color = fill.or_else(|| walker.color_of(style.stroke, style.stroke_opacity, node, scope));
    let Some(color) = color else {
        walker.note(codes::NO_PAINT, "", node, "a shape has neither stroke nor fill and is not drawn");
        return;
    };
    let mut inner = scope.clone();
    inner.map = placed(scale);
    if glyph.cap_height.is_none() && fill.is_some() {
        walker.hatch(node, &inner, &glyph.subpaths, FillRule::NonZero, color);
    }
    let ink = walker.ink(node, &inner, color);
    walker.draw(node, &inner, &glyph.subpaths, &ink);
}
