//! Fills, line patterns and ticks: what is drawn by rules rather than by coordinates.

use hpgl::{Document, Options, read};
use proptest::prelude::*;

fn document(file: &str) -> Document {
    read(file.as_bytes(), &Options::default())
}

/// Strokes of the first page as `x,y x,y`, in plotter units.
fn ink(file: &str) -> Vec<String> {
    let plu = |mm: f64| ((mm / hpgl::PLOTTER_UNIT_MM * 1e4).round() / 1e4 + 0.0).to_string();
    let strokes = &document(file).pages[0].drawing.strokes;
    strokes
        .iter()
        .map(|stroke| {
            let points: Vec<String> =
                stroke.vertices().iter().map(|p| format!("{},{}", plu(p.x), plu(p.y))).collect();
            points.join(" ")
        })
        .collect()
}

fn codes(file: &str) -> Vec<&'static str> {
    document(file).diagnostics.iter().map(|diagnostic| diagnostic.code.name()).collect()
}

#[test]
fn hatch_lines_alternate_on_anchor_grid() {
    assert_eq!(ink("IN;SP1;FT3,100;PA0,0;RA400,250;"), ["0,0 400,0", "400,100 0,100", "0,200 400,200"]);
    assert_eq!(ink("IN;SP1;AC0,50;FT3,100;PA0,0;RA400,200;"), ["0,50 400,50", "400,150 0,150"]);
    // A line right on an edge belongs to one of the two areas that meet there.
    assert_eq!(ink("IN;SP1;FT3,100,90;PA0,0;RA150,400;"), ["100,400 100,0"]);
    assert_eq!(ink("IN;SP1;FT3,100,90;PA-50,0;RA100,400;"), ["100,400 100,0", "0,0 0,400"]);
    // Cross-hatching is the same again, a quarter turned.
    assert_eq!(
        ink("IN;SP1;FT4,100;PA0,0;RA200,200;"),
        ["0,0 200,0", "200,100 0,100", "200,0 200,200", "100,200 100,0"]
    );
}

#[test]
fn hatch_respects_holes() {
    let polygon = "PA0,0;PM0;PD400,0,400,400,0,400;PM1;PU100,100;PD300,100,300,300,100,300;PM2;";
    assert_eq!(
        ink(&format!("IN;SP1;AC0,50;FT3,150;{polygon}FP;")),
        ["0,50 400,50", "400,200 300,200", "100,200 0,200", "0,350 400,350"]
    );
    // Both outlines turn the same way: no hole by winding.
    assert_eq!(
        ink(&format!("IN;SP1;AC0,50;FT3,150;{polygon}FP1;")),
        ["0,50 400,50", "400,200 0,200", "0,350 400,350"]
    );
}

#[test]
fn hatch_spacing_units() {
    assert_eq!(
        ink("IN;SP1;IP0,0,1000,1000;SC0,10,0,10;FT3,2;PA0,0;RA10,5;"),
        ["0,0 1000,0", "1000,200 0,200", "0,400 1000,400"]
    );
    // None given: one percent of the diagonal, here 10.
    assert_eq!(ink("IN;SP1;IP0,0,600,800;FT3;PA0,0;RA30,25;"), ["0,0 30,0", "30,10 0,10", "0,20 30,20"]);
    // The values stay with their type.
    assert_eq!(ink("IN;SP1;FT3,100;FT1;FT3;PA0,0;RA10,150;"), ["0,0 10,0", "10,100 0,100"]);
}

#[test]
fn solid_fill_spacing_is_pen_thickness() {
    // 0.5 mm is 20 plotter units.
    assert_eq!(ink("IN;SP1;PT.5;PA0,0;RA100,50;"), ["0,0 100,0", "100,20 0,20", "0,40 100,40"]);
    assert_eq!(ink("IN;SP1;PT.5;FT2;PA0,0;RA100,30;"), ["0,0 100,0", "0,20 100,20"]);
    // 0.3 mm by default.
    assert_eq!(ink("IN;SP1;PA0,0;RA100,20;"), ["0,0 100,0", "100,12 0,12"]);
}

#[test]
fn raster_fill_becomes_reported_hatch() {
    assert!(!ink("IN;SP1;FT11,1;PA0,0;RA400,400;").is_empty());
    assert_eq!(codes("IN;SP1;FT11,1;PA0,0;RA400,400;"), ["H0221"]);
    assert!(ink("IN;SP1;FT10,0;PA0,0;RA400,400;").is_empty());
}

#[test]
fn fill_clipped_at_window() {
    assert_eq!(
        ink("IN;SP1;IW0,0,50,50;FT3,40;PA0,0;RA100,100;EP;"),
        ["0,0 50,0", "50,40 0,40", "0,0 50,0", "0,50 0,0"]
    );
}

#[test]
fn hatch_budget() {
    let file = "IN;SP1;FT3,.001;PA0,0;RA1000000,1000000;PD5,5;";
    assert_eq!(codes(file), ["H0223"]);
    assert_eq!(ink(file), ["0,0 5,5"]);
    let many = format!("IN;SP1;FT3,.01;PA0,0;{}", "RA9000,9000;".repeat(1000));
    assert_eq!(codes(&many), ["H0223"]);
    assert_eq!(codes("IN;SP1;LT2,.00001,1;PD1000000,0;"), ["H0223"]);
}

#[test]
fn line_patterns() {
    // 10 mm are 400 plotter units; half of them ink.
    assert_eq!(ink("IN;SP1;LT2,10,1;PA0,0;PD1000,0;"), ["0,0 200,0", "400,0 600,0", "800,0 1000,0"]);
    // The pattern continues round corners, and over lifts.
    assert_eq!(
        ink("IN;SP1;LT2,10,1;PA0,0;PD500,0,500,500;"),
        ["0,0 200,0", "400,0 500,0 500,100", "500,300 500,500"]
    );
    assert_eq!(ink("IN;SP1;LT2,10,1;PD300,0;PU0,9;PD300,9;"), ["0,0 200,0", "100,9 300,9"]);
    // A percentage is one of the diagonal: 10 % of 1000.
    assert_eq!(ink("IN;SP1;IP0,0,600,800;LT2,10;PD100,0;"), ["0,0 50,0"]);
    // Dots in the pattern are dots.
    assert_eq!(ink("IN;SP1;LT1,10,1;PA0,0;PD500,0;"), ["0,0", "400,0"]);
    assert_eq!(ink("IN;SP1;LT0;PA0,0;PD500,0;"), ["0,0", "500,0"]);
    // Adaptive patterns fit each piece: 900 take two of 450.
    assert_eq!(
        ink("IN;SP1;LT-3,10,1;PA0,0;PD900,0;"),
        ["0,0 157.5,0", "292.5,0 450,0 607.5,0", "742.5,0 900,0"]
    );
    // Solid again, and back.
    assert_eq!(ink("IN;SP1;LT2,10,1;LT;PD300,0;"), ["0,0 300,0"]);
    assert_eq!(ink("IN;SP1;LT2,10,1;LT;LT99;PD300,0;"), ["0,0 200,0"]);
    // The user's own.
    assert_eq!(ink("IN;SP1;UL4,1,3;LT4,10,1;PD500,0;"), ["0,0 100,0", "400,0 500,0"]);
    assert_eq!(ink("IN;SP1;UL4,1,3;UL;LT4,10,1;PD300,0;"), ["0,0 300,0"]);
}

#[test]
fn shape_line_pattern_is_independent() {
    assert_eq!(
        ink("IN;SP1;LT2,10,1;PD300,0;ER200,100;PD600,0;"),
        ["0,0 200,0", "300,0 500,0", "400,100 300,100 300,0", "400,0 600,0"]
    );
}

#[test]
fn ticks() {
    let points = "IP0,0,1000,2000;";
    assert_eq!(
        ink(&format!("IN;SP1;{points}TL10,5;PA100,200;XT;YT;")),
        ["100,100 100,400", "50,200 200,200"]
    );
    assert_eq!(ink(&format!("IN;SP1;{points}TL10;PA100,200;XT;")), ["100,200 100,400"]);
    assert_eq!(ink(&format!("IN;SP1;{points}PA100,200;XT;")), ["100,190 100,210"]);
    // The pen continues where it was; a line pattern does not touch ticks.
    assert_eq!(
        ink(&format!("IN;SP1;{points}LT2,10,1;PA0,0;PD100,0;XT;PD300,0;")),
        ["0,0 100,0", "100,-10 100,10", "100,0 200,0"]
    );
}

proptest! {
    /// Ink of a hatch times its spacing is about the area, whatever the polygon; no line leaves it.
    #[test]
    fn hatches_cover_the_area(
        corners in proptest::collection::vec((0..4000i32, 0..4000i32), 3..12),
        angle in 0..180i32,
    ) {
        let list: Vec<String> = corners.iter().map(|(x, y)| format!("{x},{y}")).collect();
        let file = format!("IN;SP1;FT3,4,{angle};PU{};PM0;PD{};PM2;FP;", list[0], list[1..].join(","));
        let strokes = document(&file).pages[0].drawing.strokes.clone();
        let ink: f64 = strokes.iter().map(|stroke| stroke.length() / hpgl::PLOTTER_UNIT_MM).sum();
        // The area by parity, counted on a grid of points.
        let step = 20;
        let mut inside = 0;
        for y in (step / 2..4000).step_by(step) {
            for x in (step / 2..4000).step_by(step) {
                if covers(&corners, f64::from(x as i32) + 0.31, f64::from(y as i32) + 0.17) {
                    inside += 1;
                }
            }
        }
        let area = f64::from(inside) * (step * step) as f64;
        prop_assert!((ink * 4.0 - area).abs() < 0.03 * area + 150_000.0, "{} against {}", ink * 4.0, area);
        for stroke in strokes.iter().step_by(7) {
            let middle = stroke.start().midpoint(stroke.end());
            if stroke.length() > 0.5 {
                prop_assert!(covers(
                    &corners,
                    middle.x / hpgl::PLOTTER_UNIT_MM,
                    middle.y / hpgl::PLOTTER_UNIT_MM
                ));
            }
        }
    }
}

fn covers(corners: &[(i32, i32)], x: f64, y: f64) -> bool {
    let mut inside = false;
    for k in 0..corners.len() {
        let (x0, y0) = corners[k];
        let (x1, y1) = corners[(k + 1) % corners.len()];
        let (x0, y0, x1, y1) = (f64::from(x0), f64::from(y0), f64::from(x1), f64::from(y1));
        if (y0 <= y) != (y1 <= y) && x < x0 + (x1 - x0) * (y - y0) / (y1 - y0) {
            inside = !inside;
        }
    }
    inside
}

/// HP's manual of PCL 5 (LT) lists the commands after which the rest of a pattern is forgotten;
/// lifting the pen is none of them.
#[test]
fn line_pattern_restart_commands() {
    for (between, anew) in [
        ("PU;", false),
        ("EA400,400;", false),
        ("SP1;", true),
        ("AC;", true),
        ("LA1,2;", true),
        ("TR1;", true),
        ("RF;", true),
        ("PW.5;", true),
        ("WU;", true),
        ("UL;", true),
        ("IP;", true),
    ] {
        // 10 mm a pattern, half of it ink; the first line ends 2.5 mm into its second stroke.
        let file = format!("IN;SP1;LT2,10,1;PU0,0;PD500,0;{between}PU0,4000;PD400,4000;PU;");
        let document = read(file.as_bytes(), &Options::default());
        let upper = document.pages[0].drawing.strokes.iter().find(|stroke| stroke.start().y == 100.0);
        let end = upper.map(|stroke| stroke.end().x);
        assert_eq!(end, Some(if anew { 5.0 } else { 2.5 }), "{between}");
    }
}
