//! Both sides in one picture: what stays, what is gone, what is new.

use std::fmt::Write as _;

use drawing::{Point, Rect};
use picture::{Ink, InkLine, PenColors, Scene};

use super::Diff;
use crate::replay::Polyline;

/// Classes of strokes, drawn as pens of these numbers and colours. The colours differ in lightness,
/// too, and for people who do not tell red from green (Okabe and Ito's palette).
const CLASSES: [(u16, &str, [u8; 3]); 4] = [
    (1, "same", [0xB0, 0xB0, 0xB0]),
    (2, "gone", [0xD5, 0x5E, 0x00]),
    (3, "added", [0x00, 0x72, 0xB2]),
    (4, "other pen", [0xCC, 0x79, 0xA7]),
];

/// The strokes of both sides: grey where they are the same; those that are gone or that moved away in
/// orange; those that are new or moved here in blue; those with another pen in purple.
pub fn scene(diff: &Diff) -> Scene {
    let mut ink = Vec::new();
    let mut add = |class: usize, line: &Polyline| {
        ink.push(Ink { pen: CLASSES[class].0, line: InkLine::Points(line.points.clone()) });
    };
    if let Some(strokes) = &diff.strokes {
        let (old, new) = (&diff.old.strokes, &diff.new.strokes);
        strokes.same.iter().for_each(|pair| add(0, &new[pair.new]));
        strokes
            .gone
            .iter()
            .chain(strokes.moved.iter().map(|pair| &pair.old))
            .for_each(|index| add(1, &old[*index]));
        strokes
            .added
            .iter()
            .chain(strokes.moved.iter().map(|pair| &pair.new))
            .for_each(|index| add(2, &new[*index]));
        strokes.repenned.iter().for_each(|pair| add(3, &new[pair.new]));
    }
    let points = || diff.old.strokes.iter().chain(&diff.new.strokes).flat_map(|line| &line.points);
    let first = points().next().copied().unwrap_or(Point::ZERO);
    let bounds = points().fold(Rect::from_points(first, first), |bounds, point| bounds.union_pt(*point));
    let colors: PenColors = CLASSES.iter().map(|(pen, _, color)| (*pen, *color)).collect();
    let pen_names = CLASSES.iter().map(|(pen, name, _)| (*pen, (*name).to_owned())).collect();
    Scene {
        title: format!("{} -> {}", diff.old.name, diff.new.name),
        sheet: bounds,
        reach: Vec::new(),
        shades: None,
        reference: Vec::new(),
        ink,
        colors,
        travel: Vec::new(),
        start: None,
        overlay: picture::Overlay { pen_names, ..picture::Overlay::default() },
    }
}

/// A page with the picture and a switch for each class of strokes; no scripts, nothing is loaded.
/// `svg` is the picture of [`scene`], `text` the differences in words.
pub fn html(diff: &Diff, svg: &str, text: &str) -> String {
    let mut page = String::from(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n",
    );
    let title = escaped(&format!("{} and {}", diff.old.name, diff.new.name));
    let _ = writeln!(page, "<title>{title}</title>\n<style>\n{STYLE}");
    for (pen, name, _) in CLASSES {
        let id = name.replace(' ', "-");
        let _ = writeln!(page, "body:has(#{id}:not(:checked)) #pen{pen} {{ display: none }}");
    }
    let _ = writeln!(page, "</style>\n</head>\n<body>\n<h1>{title}</h1>\n<p>");
    for (_, name, [red, green, blue]) in CLASSES {
        let id = name.replace(' ', "-");
        let _ = writeln!(
            page,
            "<label><input type=\"checkbox\" id=\"{id}\" checked> <i style=\"background:#{red:02x}{green:02x}{blue:02x}\"></i> {name}</label>"
        );
    }
    let _ = write!(page, "</p>\n{svg}<pre>{}</pre>\n</body>\n</html>\n", escaped(text));
    page
}

const STYLE: &str = "\
:root { color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif }
body { margin: 0 auto; padding: 1rem; max-width: 75rem }
h1 { font-size: 1.25rem }
label { margin-right: 1.5rem; white-space: nowrap }
i { display: inline-block; width: 1.5rem; height: .3rem; vertical-align: middle }
svg { width: 100%; height: auto; max-height: 80vh; background: #fff }
pre { overflow-x: auto; font-size: .9rem }";

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
