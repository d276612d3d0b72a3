//! A plan as it is drawn, as an SVG that moves by itself (SMIL), over and over.

use std::io::{self, Write};

use drawing::{Point, Rect};

use crate::overlay::{AHEAD, LINK, RAIL};
use crate::palette::{Colour, colour_on_white, hex};
use crate::scene::{
    INK_MM, OUTLINE_MM, REACH_FILL, REACH_LINE, SHEET_LINE, START, Scene, escaped, link_mm, rectangle,
};
use crate::svg::{polyline, view_box};
use plan::file::text::Text;

/// The plan takes this share of a turn; then the finished drawing is shown.
const MOVING: f64 = 0.88;

/// The motion of a plan. Samples of all parts are taken at the same times, evenly spread from the
/// plan's start to its end.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Animation {
    /// How long a turn takes, s.
    pub turn_s: f64,
    /// Ends of guides at each sample, one list for each guide.
    pub rails: Vec<Vec<[Point; 2]>>,
    /// The same for links and beams.
    pub links: Vec<Vec<[Point; 2]>>,
    /// Places of bearings and carriages.
    pub pivots: Vec<Vec<Point>>,
    /// Places of the pen.
    pub pen: Vec<Point>,
    /// Ink in the order of time.
    pub strokes: Vec<AnimatedStroke>,
}

/// A stroke and when it is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct AnimatedStroke {
    /// The pen's number.
    pub pen: u16,
    /// Its points, mm.
    pub points: Vec<Point>,
    /// Shares of the plan's time, increasing, with the share of the stroke's length that is drawn then: 0
    /// at first, 1 at last.
    pub progress: Vec<[f64; 2]>,
}

/// Writes the animation. Sheet, reach and title are the scene's.
///
/// # Errors
/// Whatever the writer says.
pub fn svg<W: Write + ?Sized>(scene: &Scene, animation: &Animation, out: &mut W) -> io::Result<()> {
    let mut text = Text::new(out);
    let width = link_mm(scene);
    let bounds = bounds(scene, animation, width);
    text.str("<svg xmlns=\"http://www.w3.org/2000/svg\"");
    view_box(&mut text, bounds);
    text.str(" fill=\"none\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n<title>");
    escaped(&mut text, &scene.title);
    text.str("</title>\n<rect");
    rectangle(&mut text, bounds);
    text.str(" fill=\"#ffffff\"/>\n");
    text.str("<path fill-rule=\"evenodd\" fill=\"").str(&hex(REACH_FILL)).str("\" stroke=\"");
    text.str(&hex(REACH_LINE)).str("\" stroke-width=\"").fixed(OUTLINE_MM).str("\" d=\"");
    for outline in scene.reach.iter().filter(|outline| !outline.is_empty()) {
        polyline(&mut text, outline)?;
        text.byte(b'Z');
    }
    text.str("\"/>\n<rect fill=\"#ffffff\"");
    rectangle(&mut text, scene.sheet.abs());
    text.str(" stroke=\"").str(&hex(SHEET_LINE)).str("\" stroke-width=\"").fixed(OUTLINE_MM).str("\"/>\n");
    strokes(&mut text, scene, animation)?;
    machine(&mut text, animation, width);
    text.str("</svg>\n");
    text.finish()
}

/// Sheet, ink and all places of the machine, with a margin.
fn bounds(scene: &Scene, animation: &Animation, width: f64) -> Rect {
    let ends = animation.rails.iter().chain(&animation.links).flatten().flatten();
    let places = animation.pivots.iter().flatten().chain(&animation.pen);
    let ink = animation.strokes.iter().flat_map(|stroke| &stroke.points);
    let bounds =
        ends.chain(places).chain(ink).fold(scene.sheet.abs(), |bounds, point| bounds.union_pt(*point));
    bounds.inflate(1.5 * width, 1.5 * width)
}

/// All ink in light grey, and over it each stroke as a dash that grows to its length.
fn strokes<W: Write + ?Sized>(
    text: &mut Text<'_, W>,
    scene: &Scene,
    animation: &Animation,
) -> io::Result<()> {
    text.str("<g stroke=\"").str(&hex(AHEAD)).str("\" stroke-width=\"").fixed(1.6 * INK_MM).str("\">\n");
    for stroke in &animation.strokes {
        text.str("<path d=\"");
        polyline(text, &stroke.points)?;
        text.str("\"/>\n");
    }
    text.str("</g>\n<g stroke-linecap=\"butt\" stroke-width=\"").fixed(2.4 * INK_MM);
    text.str("\" stroke-dasharray=\"1 1\">\n");
    for stroke in &animation.strokes {
        text.str("<path stroke=\"").str(&hex(colour_on_white(stroke.pen, &scene.colors)));
        text.str("\" pathLength=\"1\" stroke-dashoffset=\"1\" d=\"");
        polyline(text, &stroke.points)?;
        text.str("\"><animate attributeName=\"stroke-dashoffset\" values=\"1");
        for [_, length] in &stroke.progress {
            text.byte(b';').fixed(1.0 - length);
        }
        text.str(";0\" keyTimes=\"0");
        for [time, _] in &stroke.progress {
            text.byte(b';').float((MOVING * time * 1e5).round() / 1e5);
        }
        text.str(";1\"");
        turn(text, animation);
        text.str("</path>\n").flush_if_full()?;
    }
    text.str("</g>\n");
    Ok(())
}

fn machine<W: Write + ?Sized>(text: &mut Text<'_, W>, animation: &Animation, width: f64) {
    text.str("<g opacity=\"0.850\">\n");
    for rail in &animation.rails {
        beam(text, animation, rail, (RAIL, 0.5 * width));
    }
    for link in &animation.links {
        beam(text, animation, link, (LINK, width));
    }
    for pivot in &animation.pivots {
        disc(text, animation, pivot, (LINK, 0.8 * width, 0.3 * width));
    }
    disc(text, animation, &animation.pen, (START, 0.5 * width, 0.3 * width));
    text.str("</g>\n");
}

/// An attribute's name, and its value at a sample.
type Attribute<T> = (&'static str, fn(&T) -> f64);

fn beam<W: Write + ?Sized>(
    text: &mut Text<'_, W>,
    animation: &Animation,
    ends: &[[Point; 2]],
    (color, width): (Colour, f64),
) {
    text.str("<line stroke=\"").str(&hex(color)).str("\" stroke-width=\"").fixed(width).byte(b'"');
    let values: [Attribute<[Point; 2]>; 4] = [
        ("x1", |ends| ends[0].x),
        ("y1", |ends| -ends[0].y),
        ("x2", |ends| ends[1].x),
        ("y2", |ends| -ends[1].y),
    ];
    attributes(text, animation, ends, &values);
    text.str("</line>\n");
}

fn disc<W: Write + ?Sized>(
    text: &mut Text<'_, W>,
    animation: &Animation,
    places: &[Point],
    (color, radius, width): (Colour, f64, f64),
) {
    text.str("<circle fill=\"#ffffff\" stroke=\"").str(&hex(color)).str("\" stroke-width=\"").fixed(width);
    text.str("\" r=\"").fixed(radius).byte(b'"');
    let values: [Attribute<Point>; 2] = [("cx", |place| place.x), ("cy", |place| -place.y)];
    attributes(text, animation, places, &values);
    text.str("</circle>\n");
}

/// The attributes at the first sample, the end of the tag, and animations of those that change.
fn attributes<W: Write + ?Sized, T>(
    text: &mut Text<'_, W>,
    animation: &Animation,
    samples: &[T],
    values: &[Attribute<T>],
) {
    let tenths = |value: f64| (value * 10.0).round() / 10.0;
    let lists = values
        .iter()
        .map(|(name, value)| (name, samples.iter().map(|s| tenths(value(s))).collect::<Vec<_>>()));
    let lists: Vec<_> = lists.collect();
    for (name, list) in &lists {
        text.byte(b' ').str(name).str("=\"").float(list.first().copied().unwrap_or_default()).byte(b'"');
    }
    text.byte(b'>');
    for (name, list) in lists.iter().filter(|(_, list)| list.iter().any(|value| *value != list[0])) {
        text.str("<animate attributeName=\"").str(name).str("\" values=\"");
        for value in list {
            text.float(*value).byte(b';');
        }
        // The finished drawing: the last pose stays. Samples are as far apart there.
        let still = ((list.len() - 1) as f64 * (1.0 / MOVING - 1.0)).round() as usize;
        let last = list[list.len() - 1];
        for index in 0..still.max(1) {
            text.float(last).str(if index + 1 < still { ";" } else { "" });
        }
        text.byte(b'"');
        turn(text, animation);
    }
}

/// The end of an animation's tag.
fn turn<W: Write + ?Sized>(text: &mut Text<'_, W>, animation: &Animation) {
    text.str(" dur=\"").fixed(animation.turn_s).str("s\" repeatCount=\"indefinite\"/>");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Overlay, PenColors};

    #[test]
    fn parts_that_move_are_animated_and_ink_grows() {
        let scene = Scene {
            title: "a < b".to_owned(),
            sheet: Rect::new(0.0, 0.0, 100.0, 50.0),
            reach: Vec::new(),
            shades: None,
            reference: Vec::new(),
            ink: Vec::new(),
            colors: PenColors::new(),
            travel: Vec::new(),
            start: None,
            overlay: Overlay::default(),
        };
        let (a, b, c) = (Point::new(0.0, 0.0), Point::new(10.0, 0.0), Point::new(10.0, 20.0));
        let animation = Animation {
            turn_s: 10.0,
            rails: vec![vec![[a, b], [a, b], [a, b]]],
            links: vec![vec![[a, b], [a, b], [a, c]]],
            pivots: Vec::new(),
            pen: vec![b, b, c],
            strokes: vec![AnimatedStroke {
                pen: 1,
                points: vec![b, c],
                progress: vec![[0.5, 0.0], [1.0, 1.0]],
            }],
        };
        let mut bytes = Vec::new();
        svg(&scene, &animation, &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.contains("<title>a &lt; b</title>"));
        // Of the rail nothing moves, of the link one end and one coordinate, of the pen one.
        assert_eq!(text.matches("attributeName=\"y2\"").count(), 1);
        assert_eq!(text.matches("attributeName=\"cy\"").count(), 1);
        assert_eq!(text.matches("<animate ").count(), 3);
        assert!(text.contains("values=\"1;1.000;0.000;0\" keyTimes=\"0;0.44;0.88;1\""), "{text}");
        assert!(text.contains("values=\"0;0;-20;-20\""), "{text}");
    }
}
