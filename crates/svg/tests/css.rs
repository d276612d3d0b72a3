//! Style sheets, properties and conditions, one test per kind, on small files of our own.

use drawing::Point;
use svg::{Document, Options, StrokeFont, StrokeGlyph};

/// A page of 100 mm with user units of 1 mm; `root` is more attributes of the root.
fn read_with(root: &str, content: &str, options: &Options<'_>) -> Document {
    let file = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='100mm' height='100mm' viewBox='0 0 100 100' \
         {root}>{content}</svg>"
    );
    svg::read(file.as_bytes(), options)
}

fn read(content: &str) -> Document {
    read_with("stroke='black' fill='none'", content, &Options::default())
}

/// Length of the ink, and the codes of the findings.
fn ink(document: &Document) -> (f64, Vec<&'static str>) {
    let length = (document.drawing.length() * 1e9).round() / 1e9;
    (length, document.diagnostics.iter().map(|found| found.code.name()).collect())
}

/// Checks lengths of drawings that must not be reported about.
fn check(cases: &[(&str, f64)]) {
    for (content, expected) in cases {
        assert_eq!(ink(&read(content)), (*expected, vec![]), "{content}");
    }
}

#[test]
fn media_rules_are_those_of_a_screen() {
    let path = "<path d='M0 0H10'/>";
    check(&[
        (&format!("<style>@media print{{path{{stroke:none}}}}</style>{path}"), 10.0),
        (&format!("<style media='print'>path{{stroke:none}}</style>{path}"), 10.0),
        (&format!("<style>@media (prefers-color-scheme:dark){{path{{stroke:none}}}}</style>{path}"), 10.0),
        (&format!("<style>@media screen{{path{{d:path('M0 0H7')}}}}</style>{path}"), 7.0),
        (&format!("<style>@font-face{{font-family:x}}@charset 'x';</style>{path}"), 10.0),
    ]);
    let wide = read(&format!("<style>@media (min-width:9px){{path{{stroke:none}}}}</style>{path}"));
    assert_eq!(ink(&wide), (10.0, vec!["S0113"]));
    let less = read(&format!("<style type='text/less'>path{{stroke:none}}</style>{path}"));
    assert_eq!(ink(&less), (10.0, vec!["S0113"]));
}

#[test]
fn names_and_keywords_have_no_case() {
    check(&[
        ("<g stroke='none'><path style='STROKE:Red;Fill:NONE' d='M0 0H10'/></g>", 10.0),
        ("<g visibility='hidden'><path visibility='Visible' d='M0 0H10'/></g>", 10.0),
        ("<g stroke='none'><path stroke='CURRENTCOLOR' d='M0 0H10'/></g>", 10.0),
    ]);
}

#[test]
fn css_wide_keywords_are_understood() {
    check(&[
        ("<g stroke-dasharray='1'><path style='stroke-dasharray:initial' d='M0 0H10'/></g>", 10.0),
        ("<g stroke-dasharray='1'><path style='stroke-dasharray:unset' d='M0 0H10'/></g>", 5.0),
        ("<path style='stroke:revert' d='M0 0H10'/>", 10.0),
        ("<path opacity='0' style='opacity:unset' d='M0 0H10'/>", 10.0),
    ]);
}

#[test]
fn variables_and_colour_schemes_are_resolved() {
    check(&[
        (
            "<style>:root{--ink:red;--w:var(--ink)}</style><g stroke='none'><path stroke='var(--w)' d='M0 0H10'/></g>",
            10.0,
        ),
        ("<g stroke='none'><path style='stroke:var(--none, blue)' d='M0 0H10'/></g>", 10.0),
        ("<g stroke='none'><path style='stroke:light-dark(rgb(0, 0, 0), white)' d='M0 0H10'/></g>", 10.0),
    ]);
    let unknown = read("<g stroke='none'><path d='M0 0H1' stroke='var(--x)'/></g>");
    assert_eq!(ink(&unknown), (0.0, vec!["S0110", "S0221"]));
    let endless = read("<style>path{--a:var(--b);--b:var(--a);stroke:var(--a)}</style><path d='M0 0H1'/>");
    assert_eq!(ink(&endless), (1.0, vec!["S0110"]));
}

#[test]
fn transparent_colours_do_not_hide_children() {
    check(&[("<g stroke='transparent'><path stroke='black' d='M0 0H10'/></g>", 10.0)]);
}

#[test]
fn sizes_and_places_come_from_css_too() {
    check(&[
        ("<style>rect{width:10px;height:5px;x:1px}</style><rect width='1' height='1'/>", 30.0),
        ("<path style='d:path(\"M0 0H30\")' d='M0 0H10'/>", 30.0),
        ("<svg style='width:50px;height:50px' viewBox='0 0 10 10'><path d='M1 1H9'/></svg>", 40.0),
    ]);
    let document = svg::read(
        b"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 96 96' style='width:50mm;height:50mm'/>",
        &Options::default(),
    );
    assert_eq!((document.page_mm, document.diagnostics.len()), ([50.0; 2], 0));
    let responsive = read_with("style='width:100%;height:auto'", "", &Options::default());
    assert_eq!(responsive.page_mm, [100.0; 2]);
}

#[test]
fn transform_origin_is_a_point_of_the_box() {
    let start = |style: &str| {
        let document = read(&format!("<path d='M40 40H60V50' style='{style};transform:rotate(180deg)'/>"));
        let start = document.drawing.strokes.to_vec()[0].start();
        [start.x, 100.0 - start.y].map(f64::round)
    };
    assert_eq!(start("transform-origin:center"), [60.0, 60.0]);
    assert_eq!(start("transform-origin:top center"), [60.0, -40.0]);
    assert_eq!(start("transform-origin:10px 20px"), [-20.0, 0.0]);
    assert_eq!(start("transform-box:fill-box;transform-origin:center"), [60.0, 50.0]);
    assert_eq!(start("transform-box:fill-box;transform-origin:100% 0"), [80.0, 40.0]);
    let group = "<g style='transform-box:fill-box;transform-origin:center;transform:scale(2)'>\
                 <path d='M10 10H20'/><path d='M10 20H20'/></g>";
    let bounds = read(group).drawing.bounding_box().unwrap();
    assert_eq!([bounds.x0, bounds.x1, 100.0 - bounds.y0, 100.0 - bounds.y1], [5.0, 25.0, 25.0, 5.0]);
}

#[test]
fn conditions_hold_outside_switch_too() {
    let document = read(
        "<path systemLanguage='de' d='M0 0H1'/><g requiredExtensions='x'><path d='M0 0H2'/></g>\
         <path systemLanguage='de,en-GB' d='M0 0H4'/>",
    );
    assert_eq!(ink(&document), (4.0, vec!["S0211"]));
}

#[test]
fn dashes_of_non_scaling_strokes_are_pixels() {
    // 3.7795 px are 1 mm.
    let dashes = "stroke-dasharray='3.779527559 11.338582677'";
    let path = format!(
        "<g transform='scale(10)'><path vector-effect='non-scaling-stroke' d='M0 1H9.9' {dashes}/></g>"
    );
    let document = read(&path);
    assert_eq!(document.drawing.strokes.len(), 25);
    assert!((document.drawing.length() - 25.0).abs() < 1e-6);
}

#[test]
fn unsupported_properties_are_reported() {
    for style in [
        "clip-path:inset(10px)",
        "rotate:20deg",
        "translate:5px",
        "writing-mode:tb",
        "text-decoration:underline",
        "transform:translate(50%,0)",
    ] {
        let document = read(&format!("<path d='M0 0H10' style='{style}'/>"));
        assert_eq!((document.drawing.length(), document.diagnostics.len()), (10.0, 1), "{style}");
    }
    check(&[(
        "<path d='M0 0H10' style='text-decoration:none solid rgb(0, 0, 0);writing-mode:lr-tb;direction:ltr;\
         clip-path:none;rotate:none'/>",
        10.0,
    )]);
}

/// Letters as wide and high as the font, each one line from the lower-left corner up.
#[derive(Debug)]
struct Bars;

impl StrokeFont for Bars {
    fn cap_height(&self) -> f64 {
        7.0
    }

    fn glyph(&self, _: char) -> Option<StrokeGlyph> {
        Some(StrokeGlyph {
            advance: 10.0,
            strokes: vec![vec![Point::ZERO, Point::new(0.0, 7.0), Point::new(5.0, 7.0)]],
        })
    }
}

/// The lower ends of the letters, mm.
fn letters(content: &str) -> Vec<[f64; 2]> {
    let options = Options { font: Some(&Bars), ..Options::default() };
    let document = read_with("", content, &options);
    let round = |mm: f64| (mm * 1e6).round() / 1e6;
    document.drawing.strokes.iter().map(|s| [round(s.start().x), round(100.0 - s.start().y)]).collect()
}

#[test]
fn font_shorthand_sets_size_weight_and_family() {
    for font in [
        "20px x",
        "bold 20px/1.2 x, y",
        "italic small-caps 700 20px / 30px x",
        "20px/ 1 'x y'",
        "normal normal 20px x",
    ] {
        let text = format!("<text x='10' y='50' style=\"font:{font}\">ab</text>");
        assert_eq!(letters(&text), [[10.0, 50.0], [30.0, 50.0]], "{font}");
    }
    let system = "<text x='10' y='50' style='font:caption'>ab</text>";
    assert_eq!(letters(system), [[10.0, 50.0], [26.0, 50.0]]);
}

#[test]
fn text_is_fitted_to_its_length() {
    let fitted = |more: &str| letters(&format!("<text y='50' font-size='10' {more}>abc</text>"));
    assert_eq!(fitted("x='10' textLength='50'"), [[10.0, 50.0], [30.0, 50.0], [50.0, 50.0]]);
    assert_eq!(
        fitted("x='60' textLength='60' lengthAdjust='spacingAndGlyphs' text-anchor='end'"),
        [[0.0, 50.0], [20.0, 50.0], [40.0, 50.0]]
    );
    assert_eq!(
        fitted("x='60' textLength='50' text-anchor='middle'"),
        [[35.0, 50.0], [55.0, 50.0], [75.0, 50.0]]
    );
}

#[test]
fn text_path_has_its_own_data() {
    let text = "<text font-size='10'><textPath path='M10 50H90'>ab</textPath></text>";
    assert_eq!(letters(text), [[10.0, 50.0], [20.0, 50.0]]);
    let nothing = read("<text><textPath>ab</textPath></text>");
    assert_eq!(ink(&nothing), (0.0, vec!["S0114"]));
}
