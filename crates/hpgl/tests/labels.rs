//! Labels, symbols and user characters: where they stand, how large they are, where the pen goes
//! after them. The shapes of letters are the font's business.

use drawing::Rect;
use hpgl::{Document, Options, read};

fn document(file: &[u8]) -> Document {
    read(file, &Options::default())
}

/// Bounds of all ink, plotter units.
fn bounds(file: &[u8]) -> Rect {
    document(file).pages[0]
        .drawing
        .bounding_box()
        .expect("ink")
        .scale_from_origin(1.0 / hpgl::PLOTTER_UNIT_MM)
}

/// Where the pen is at the end, plotter units: a dot there is the last stroke.
fn end(file: &str) -> (f64, f64) {
    let file = format!("{file};PD;PU;");
    let document = document(file.as_bytes());
    let last = document.pages[0].drawing.strokes.iter().last().expect("a dot");
    assert!(last.is_dot());
    let round = |mm: f64| (mm / hpgl::PLOTTER_UNIT_MM * 1e6).round() / 1e6;
    (round(last.start().x), round(last.start().y))
}

#[track_caller]
fn close(actual: Rect, expected: (f64, f64, f64, f64)) {
    let expected = Rect::new(expected.0, expected.1, expected.2, expected.3);
    let same = (actual.x0 - expected.x0).abs() < 0.01
        && (actual.y0 - expected.y0).abs() < 0.01
        && (actual.x1 - expected.x1).abs() < 0.01
        && (actual.y1 - expected.y1).abs() < 0.01;
    assert!(same, "{actual:?} against {expected:?}");
}

#[test]
fn label_size_and_advance() {
    // 1 cm wide, 2 cm high: 400 by 800; a cell is one and a half widths.
    close(bounds(b"IN;SP1;SI1,2;PA1000,1000;LBA\x03"), (1000.0, 1000.0, 1400.0, 1800.0));
    assert_eq!(end("IN;SP1;SI1,2;PA1000,1000;LBAII\x03"), (1000.0 + 3.0 * 600.0, 1000.0));
    // By default those of the 7475A on A4.
    assert_eq!(end("IN;SP1;LBhi\x03"), (2.0 * 1.5 * 75.16, 0.0));
    // Percent of P2 - P1.
    close(bounds(b"IN;SP1;IP0,0,4000,8000;SR10,10;PA0,0;LBA\x03"), (0.0, 0.0, 400.0, 800.0));
    // Negative sizes mirror.
    close(bounds(b"IN;SP1;SI-1,2;PA1000,1000;LBA\x03"), (600.0, 1000.0, 1000.0, 1800.0));
    close(bounds(b"IN;SP1;SI1,-2;PA1000,1000;LBA\x03"), (1000.0, 200.0, 1400.0, 1000.0));
    assert_eq!(end("IN;SP1;SI-1,2;PA1000,1000;LBA\x03"), (400.0, 1000.0));
    assert_eq!(end("IN;SP1;SI1,2;ES.5;PA0,0;LBAA\x03"), (1800.0, 0.0));
    // Proportional spacing: narrow letters are narrower.
    let (x, _) = end("IN;SP1;SI1,2;SD2,1;SS;PA0,0;LBiii\x03");
    assert!(x < 1100.0, "{x} instead of 1800 in cells of one width");
}

#[test]
fn label_direction_and_slant() {
    close(bounds(b"IN;SP1;SI1,2;DI0,1;PA1000,1000;LBA\x03"), (200.0, 1000.0, 1000.0, 1400.0));
    assert_eq!(end("IN;SP1;SI1,2;DI-1,0;PA1000,1000;LBA\x03"), (400.0, 1000.0));
    // Relative to P1 and P2: their diagonal.
    assert_eq!(end("IN;SP1;IP0,0,3000,4000;SI1,2;DR1,1;PA0,0;LBA\x03"), (360.0, 480.0));
    assert_eq!(end("IN;SP1;SI1,2;DI0,0;PA0,0;LBA\x03"), (600.0, 0.0));
    // The top of a letter leans, its foot stays.
    let slanted = bounds(b"IN;SP1;SI1,2;SL1;PA0,0;LBI\x03");
    assert!((slanted.x0 - 200.0).abs() < 0.01 && (slanted.x1 - 1000.0).abs() < 0.01);
}

#[test]
fn label_origins() {
    let of = |origin: i32| bounds(format!("IN;SP1;SI1,2;LO{origin};PA0,0;LBAA\x03").as_bytes());
    // Two letters are 600 + 400 wide and 800 high.
    close(of(1), (0.0, 0.0, 1000.0, 800.0));
    close(of(2), (0.0, -400.0, 1000.0, 400.0));
    close(of(3), (0.0, -800.0, 1000.0, 0.0));
    close(of(4), (-500.0, 0.0, 500.0, 800.0));
    close(of(5), (-500.0, -400.0, 500.0, 400.0));
    close(of(9), (-1000.0, -800.0, 0.0, 0.0));
    // Half a character away.
    close(of(11), (200.0, 400.0, 1200.0, 1200.0));
    close(of(12), (200.0, -400.0, 1200.0, 400.0));
    close(of(15), (-500.0, -400.0, 500.0, 400.0));
    close(of(19), (-1200.0, -1200.0, -200.0, -400.0));
    close(of(21), (0.0, 0.0, 1000.0, 800.0));
    assert_eq!(document(b"IN;SP1;LO10;LBA\x03").diagnostics[0].code.name(), "H0203");
    // Every line is justified by itself.
    close(bounds(b"IN;SP1;SI1,2;LO4;PA0,0;LBAA\r\nA\x03"), (-500.0, -1600.0, 500.0, 800.0));
}

#[test]
fn label_control_characters() {
    let size = "IN;SP1;SI1,2;PA1000,5000;";
    assert_eq!(end(&format!("{size}LBAB\r\x03")), (1000.0, 5000.0));
    assert_eq!(end(&format!("{size}LBAB\r\n\x03")), (1000.0, 3400.0));
    assert_eq!(end(&format!("{size}LBAB\n\x03")), (2200.0, 3400.0));
    assert_eq!(end(&format!("{size}LBAB\x08\x03")), (1600.0, 5000.0));
    assert_eq!(end(&format!("{size}LBA\tB\x03")), (1000.0 + 9.0 * 600.0, 5000.0));
    assert_eq!(end(&format!("{size}CP2,-1")), (2200.0, 3400.0));
    // The margin follows the lines, not the spaces.
    assert_eq!(end(&format!("{size}CP2,-1;LBA\r\x03")), (1000.0, 3400.0));
    assert_eq!(end(&format!("{size}LBABC\x03;CP")), (1000.0, 3400.0));
    // A move sets a new one.
    assert_eq!(end(&format!("{size}LBABC\x03;PR10,10;LBA\r\x03")), (2810.0, 5010.0));
    assert_eq!(end(&format!("{size}ES0,.5;CP0,-1")), (1000.0, 2600.0));
    // Downwards, each character under the one before.
    assert_eq!(end(&format!("{size}DV1;LBAB\x03")), (1000.0, 1800.0));
    assert_eq!(end(&format!("{size}DV1;LBAB\r\n\x03")), (400.0, 5000.0));
    assert_eq!(end(&format!("{size}DV2;LBAB\x03")), (-200.0, 5000.0));
    assert_eq!(end(&format!("{size}BLAB\x03")), (1000.0, 5000.0));
    assert_eq!(end(&format!("{size}BLAB\x03PB")), (2200.0, 5000.0));
}

#[test]
fn label_pen_and_line_pattern() {
    // A label is drawn with the pen up or down, solid, and leaves the pen as it was.
    let document = document(b"IN;SP3;LT2,1,1;PU0,0;LBI\x03PA100,100;PD;PU;");
    let strokes = &document.pages[0].drawing.strokes;
    assert_eq!(strokes.len(), 2);
    assert!(strokes.iter().all(|stroke| stroke.pen.0 == 3));
}

#[test]
fn character_sets() {
    // The same word in four ways of writing it.
    let same = |file: &[u8]| {
        let document = document(file);
        assert_eq!(document.diagnostics, []);
        document.pages[0].drawing.strokes.iter().map(|stroke| stroke.vertices().to_vec()).collect::<Vec<_>>()
    };
    let word = same(b"IN;SP1;LBGr\xfc\xdfe\x03");
    assert_eq!(word, same("IN;SP1;LBGrüße\x03".as_bytes()));
    assert_eq!(word, same(b"IN;SP1;SD1,277;LBGr\xcf\xdee\x03"));
    assert_eq!(word, same(b"IN;SP1;SD1,405;LBGr\x81\xe1e\x03"));
    assert_eq!(word, same(b"IN;SP1;CA33;LBGr\x0e}~\x0fe\x03"));
    assert_eq!(word, same(b"IN;SP1;CA33;SA;LBGr}~e\x03"));
    let document = document(b"IN;SP1;LBa\xe6\xbc\xa2b\x03");
    let diagnostic = &document.diagnostics[0];
    assert_eq!(diagnostic.code.name(), "H0220");
    assert_eq!((diagnostic.span.start, diagnostic.span.end), (10, 13));
    assert_eq!(crate::document(b"IN;SP1;CS77;LBa\x03").diagnostics[0].code.name(), "H0224");
}

#[test]
fn symbol_mode_positions() {
    let document = document(b"IN;SP1;SI1,2;SM+;PA1000,1000;PD2000,1000;SM;PD3000,1000;PU;");
    let strokes = document.pages[0].drawing.strokes.to_vec();
    // Two bars at each of two points, and the line in two strokes.
    assert_eq!(strokes.len(), 6);
    let symbol = strokes[0].bounding_box().union(strokes[1].bounding_box());
    assert!((symbol.center().x - 25.0).abs() < 1e-9 && (symbol.center().y - 25.0).abs() < 1e-9);
    assert_eq!(strokes[5].start().x, 50.0);
}

#[test]
fn user_character_grid() {
    // A width is 4 units, a height 8.
    close(bounds(b"IN;SP1;SI1,2;PA100,100;UC99,4,0,0,8,-4,0,0,-8;"), (100.0, 100.0, 500.0, 900.0));
    assert_eq!(end("IN;SP1;SI1,2;PA100,100;UC99,4,0"), (700.0, 100.0));
    // The pen begins up, and goes up between.
    let document = document(b"IN;SP1;SI1,2;PA0,0;UC1,0,99,1,0,-99,1,0,99,1,0;");
    assert_eq!(document.pages[0].drawing.strokes.len(), 2);
}
