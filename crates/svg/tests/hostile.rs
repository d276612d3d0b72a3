//! Hostile files end in an error, within bounds of time and memory.

use std::fmt::Write as _;

use svg::Options;

const HEAD: &str =
    "<svg xmlns='http://www.w3.org/2000/svg' width='10mm' height='10mm' viewBox='0 0 10 10' stroke='red'>";

fn codes(text: &str) -> Vec<&'static str> {
    let document = svg::read(text.as_bytes(), &Options::default());
    document.diagnostics.iter().map(|found| found.code.name()).collect()
}

#[test]
fn entities_that_multiply_are_refused() {
    let mut text =
        String::from("<!DOCTYPE svg [<!ENTITY a0 'aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa'>");
    for level in 1..9 {
        let before = format!("&a{};", level - 1).repeat(20);
        write!(text, "<!ENTITY a{level} '{before}'>").unwrap();
    }
    write!(text, "]>{HEAD}<text>&a8;</text></svg>").unwrap();
    assert_eq!(codes(&text), ["S0103"]);
}

#[test]
fn one_large_entity_used_often_is_refused() {
    let text = format!(
        "<!DOCTYPE svg [<!ENTITY a '{}'>]>{HEAD}<text>{}</text></svg>",
        "x".repeat(100_000),
        "&a;".repeat(10_000)
    );
    assert_eq!(codes(&text), ["S0103"]);
}

#[test]
fn entities_that_contain_themselves_are_refused() {
    let text = format!("<!DOCTYPE svg [<!ENTITY a '&b;'><!ENTITY b '&a;'>]>{HEAD}<text>&a;</text></svg>");
    assert_eq!(codes(&text), ["S0103"]);
}

#[test]
fn entities_of_illustrator_are_expanded() {
    let text = "<!DOCTYPE svg [<!ENTITY ns 'http://www.w3.org/2000/svg'>]>\
        <svg xmlns='&ns;' width='10mm' height='10mm' viewBox='0 0 10 10'><path stroke='red' d='M0 0H1'/></svg>";
    assert!(codes(text).is_empty());
}

#[test]
fn deep_nesting_is_refused() {
    let text = format!("{HEAD}{}{}</svg>", "<g>".repeat(100_000), "</g>".repeat(100_000));
    assert_eq!(codes(&text), ["S0103"]);
}

#[test]
fn references_that_multiply_end() {
    let mut text = format!("{HEAD}<defs><path id='u0' d='M0 0H1'/>");
    for level in 1..40 {
        let below = format!("<use href='#u{}'/>", level - 1).repeat(10);
        write!(text, "<g id='u{level}'>{below}</g>").unwrap();
    }
    text += "</defs><use href='#u39'/></svg>";
    assert_eq!(codes(&text), ["S0103"]);
}

#[test]
fn references_in_a_circle_are_reported() {
    let text =
        format!("{HEAD}<g id='a'><use href='#b'/></g><defs><g id='b'><use href='#a'/></g></defs></svg>");
    assert_eq!(codes(&text), ["S0115"]);
    let clip = format!(
        "{HEAD}<clipPath id='c'><path clip-path='url(#c)' d='M0 0H5V5Z'/></clipPath><path clip-path='url(#c)' d='M0 1H9'/></svg>"
    );
    assert_eq!(codes(&clip), ["S0115"]);
    let marker = format!(
        "{HEAD}<marker id='m'><path marker-start='url(#m)' d='M0 0H1'/></marker><path marker-start='url(#m)' d='M0 0H1'/></svg>"
    );
    assert_eq!(codes(&marker), ["S0115"]);
}

#[test]
fn endless_dashes_are_drawn_solid() {
    let text = format!("{HEAD}<path stroke-dasharray='1e-9' d='M0 0H10'/></svg>");
    let document = svg::read(text.as_bytes(), &Options::default());
    assert_eq!(document.drawing.length(), 10.0);
    assert_eq!(document.diagnostics[0].code.name(), "S0215");
}

#[test]
fn endless_hatches_are_refused() {
    let text = format!("{HEAD}<rect fill='red' stroke='none' width='10' height='10'/></svg>");
    let hatch = svg::Hatch { spacing_mm: 1e-9, angle_rad: 0.0 };
    let document = svg::read(text.as_bytes(), &Options { hatch: Some(hatch), ..Options::default() });
    assert_eq!(document.diagnostics[0].code.name(), "S0216");
}

#[test]
fn selectors_that_match_slowly_end() {
    let selector = "g ".repeat(150);
    let text = format!(
        "{HEAD}<style>x {selector} path {{stroke:none}}</style>{}<path d='M0 0H1'/>{}</svg>",
        "<g>".repeat(150),
        "</g>".repeat(150)
    );
    assert_eq!(codes(&text), ["S0103"]);
}

#[test]
fn coordinates_beyond_all_paper_are_reported() {
    let text = format!(
        "{HEAD}<path d='M0 0L1e300 1e300'/><path d='M0 0H1' transform='scale(1e308) scale(1e308)'/></svg>"
    );
    assert_eq!(codes(&text), ["S0217"]);
}

#[test]
fn clip_path_of_thousands_of_shapes_ends() {
    // Every line crosses hundreds of squares.
    let mut squares = String::new();
    for k in 0..20_000 {
        let (x, y) = (f64::from(k % 141) * 0.7, f64::from(k / 141) * 0.7);
        write!(squares, "<rect x='{x}' y='{y}' width='.5' height='.5'/>").expect("a string takes all text");
    }
    let mut points = String::new();
    for k in 0..4000 {
        let (x, y) = (f64::from(k * 7919 % 1000) / 10.0, f64::from(k * 2503 % 997) / 10.0);
        write!(points, "{x} {y} ").expect("a string takes all text");
    }
    let text = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 100 100'><clipPath id='c'>{squares}</clipPath>\
         <path clip-path='url(#c)' stroke='black' fill='none' d='M{points}'/></svg>"
    );
    let document = svg::read(text.as_bytes(), &Options::default());
    // Half a pixel is 0.132 mm.
    let strokes = &document.drawing.strokes;
    assert!(strokes.len() > 50_000, "{} {:?}", strokes.len(), document.diagnostics);
    for bounds in strokes.iter().map(|stroke| stroke.bounding_box()) {
        assert!(bounds.width().max(bounds.height()) < 0.1324, "{bounds:?}");
    }
}
