//! What real files do to the language: one small file a habit, and the ink that it must give.
//!
//! Expected geometry rests on the HP-GL/2 rules as GhostPDL's interpreter and hp2xx show them on
//! probe files; where the two differ, the comment says which one is followed and why.

mod common;

use common::{check, codes, document, ink};
use hpgl::{Generation, Options, Point, ProfileReason, Severity, Wrappers, read};

/// The same corner in different notations.
#[track_caller]
fn corner(bytes: &[u8], diagnostics: &[&str]) {
    check(bytes, &["1: 0,0 400,0 400,400"], diagnostics);
}

#[test]
fn separators_and_terminators() {
    corner(b"IN;SP1;PA0,0;PD400,0,400,400;PU;SP0;", &[]);
    corner(b"INSP1PA0,0PD400,0,400,400PUSP0", &[]);
    corner(b"IN SP1 PA 0,0 PD 400,0 400,400 PU SP0", &[]);
    corner(b"IN;SP 1;PA 0 0;PD 400 0 400 400;PU;SP0;", &[]);
    corner(b"IN;SP1;PA0+0PD400-0+400+400;PU;SP0;", &[]);
    corner(b"IN\r\nSP1\r\nPA0,0\r\nPD400,0,\r\n400,400\r\nPU\r\nSP0\r\n", &[]);
    corner(b"IN;;SP1;;PA0,0;;PD400,0,400,400;;PU;;", &[]);
    corner(b"IN;SP1;PA0,0;PD400,0:PD400,400;PU;SP0;", &[]);
    corner(b"IN;\r\nPA;SP1\r\n;PU0,0\r\n;PD400,0\r\n;PD400,400\r\n;PU;", &[]);
    corner(b"IN;SP1;PA\t0,\t0;PD\t400\t0\t400\t400;PU;", &[]);
    check(b"IN;SP1;PA500,500;PD100-100-200+300;PU;SP0;", &["1: 500,500 100,-100 -200,300"], &[]);
    // A trailing comma is a separator before nothing.
    corner(b"IN;SP1;PA0,0;PD400,0,400,400,;PU;", &[]);
}

#[test]
fn any_case() {
    corner(b"in;sp1;pa0,0;pd400,0,400,400;pu;sp0;", &[]);
    corner(b"In;Sp1;Pa0,0;pD400,0,400,400;Pu;Sp0;", &[]);
    corner(b"insp1pupa0,0pdpa400,0,400,400pu", &[]);
}

#[test]
fn line_ends_inside_numbers() {
    // Interpreters skip line ends inside numbers: files wrapped at a fixed width.
    corner(b"IN;SP1;PA0,0;PD40\n0,0,400,40\r\n0;PU;", &["H0109"]);
    // One pair a line, as written by hand: joined numbers would make an odd count.
    corner(b"IN;SP1;PA0,0;PD400,0\n400,400;PU;", &["H0109"]);
    // Joined or not, the count is even; every line end stands between pairs.
    check(b"IN;SP1;PA0,0;PD400,0\n400,400\n0,400;PU;", &["1: 0,0 400,0 400,400 0,400"], &["H0109"]);
    // No digits on both sides: nothing to ask.
    corner(b"IN;SP1;PA0,0;PD400\n,0\n,400,\n400\n;PU;", &[]);
}

#[test]
fn decimals_exponents_and_large_numbers() {
    check(b"IN;SP1;PA0.5,0.25;PD400.75,.5,400.,400.49;PU;SP0;", &["1: 0.5,0.25 400.75,0.5 400,400.49"], &[]);
    corner(b"IN;SP1;PA0,0;PD4e2,0,4E2,4e+2;PU;SP0;", &[]);
    corner(b"IN;SP1;PA0,0;PD40000e-2,0,4.00E2,400;PU;SP0;", &[]);
    // The E of a command is none of an exponent.
    check(b"IN;SP1;PA0,0;PD400,0EA500,300PU", &["1: 0,0 400,0", "1: 400,0 500,0 500,300 400,300 400,0"], &[]);
    check(b"IN;SP1;PA0,0;PD40000,0,40000,40000;PU;", &["1: 0,0 40000,0 40000,40000"], &[]);
    // GhostPDL drops the command; only the pair that has the number is dropped here.
    check(b"IN;SP1;PA0,0;PD99999999999,0;PD400,400;PU;", &["1: 0,0 400,400"], &["H0108"]);
    check(b"IN;SP1;PA0,0;PD400,0,1e300,7,400,400;PU;", &["1: 0,0 400,0 400,400"], &["H0108"]);
    let digits = format!("IN;SP1;PA0,0;PD400.{},0,400,400;", "0".repeat(300));
    corner(digits.as_bytes(), &[]);
    let digits = format!("IN;SP1;PA0,0;PD{},0,400,400;", "9".repeat(300));
    check(digits.as_bytes(), &["1: 0,0 400,400"], &["H0108"]);
    // Another command with such a number has no effect: the scale is not taken away.
    check(
        b"IN;SP1;IP0,0,100,100;SC0,10,0,10;SC0,99999999999,0,1;PA0,0;PD1,1;",
        &["1: 0,0 10,10"],
        &["H0108"],
    );
}

#[test]
fn empty_parameters_and_odd_coordinates() {
    check(b"IN;SP1;PA0,0;PD400,,400;PD400,0;PU;", &["1: 0,0 400,400 400,0"], &["H0107"]);
    corner(b"IN;SP1;PA0,0;PD,400,0;PD400,400;PU;SP0;", &["H0107"]);
    // hp2xx gives the whole file up.
    check(b"IN;SP1;PA0,0;PD400,0,400;PU;SP0;", &["1: 0,0 400,0"], &["H0206"]);
    corner(b"IN;SP1;PA0,0;PD400,0,400;PD400,400;PU;SP0;", &["H0206"]);
    corner(b"IN;SP1;PA0,0;PD400,0,-,400,400;PU;", &["H0102"]);
}

#[test]
fn stray_bytes() {
    corner(b"\xef\xbb\xbfIN;SP1;PA0,0;PD400,0,400,400;PU;SP0;", &["H0103"]);
    corner(b"!IN;SP1;PA0,0;PD400,0,400,400;PU;@", &["H0102"]);
    corner(b"IN;\x00\x00SP1;PA0,0;\x00PD400,\x000,4\x0000,400;PU;SP0;\x00\x00", &["H0103", "H0103"]);
    corner(b"IN;\x03SP1;PA0,0;PD400,0,400,400;\x03PU;SP0;\x1a", &["H0103"]);
    corner(b"\x03IN;SP1;PA0,0;PD400,0,400,400;", &["H0103"]);
    // UTF-16 is ASCII with a NUL after each byte.
    let wide: Vec<u8> = b"IN;SP1;PA0,0;PD400,0,400,400;PU;".iter().flat_map(|&b| [b, 0]).collect();
    assert_eq!(ink(&document(&wide)), ["1: 0,0 400,0 400,400"]);
}

#[test]
fn unknown_names_and_prose() {
    corner(b"IN;SP1;PA0,0;ZQ1,2,3;PD400,0;XX;PD400,400;PU;SP0;", &["H0101", "H0101"]);
    corner(b"IN;SP1;PA0,0;Z;PD400,0;PD400,400;PU;SP0;", &["H0101"]);
    corner(b"IN;SP1;PA0,0;ZPD400,0;ZQPD400,400;PU;", &["H0101", "H0101"]);
    corner(b"IN;SP1;PA0,0;ZQ1,2PD400,0,400,400;PU;", &["H0101"]);
    check(b"IN;SP1;P A0,0;P D400,0;PU;SP0;", &["1: 0,0 400,0"], &["H0106", "H0106"]);
    // `XT` would draw a tick, `AR` and `ER` would miss their parameters.
    corner(
        b"IN;SP1;PA0,0;PD400,0,400,400;PU;\r\n%%EOF garbage text here\x04\xff\xff",
        &["H0102", "H0101", "H0105"],
    );
    assert_eq!(
        ink(&document(b"IN;SP1;PA0,0;PD400,0,400,400;PU;THIS TEXT IS NOT A PLOT")),
        ["1: 0,0 400,0 400,400"]
    );
    corner(b"INPU;SP1;PU0,0;PD400,0,400,400;", &[]);
    corner(b"IN;SP1;1,2,3;PA0,0;PD400,0,400,400;", &["H0104"]);
}

#[test]
fn device_control() {
    corner(b"\x1b.(\x1b.I81;;17:\x1b.N;19:IN;SP1;PA0,0;\x1b.MPD400,0,400,400;PU;SP0;\x1b.)", &["H0113"]);
    corner(b"\x1b.(;\x1b.@;3:IN;SP1;PA0,0;PD400,0,400,400;PU;\x1b.Z", &[]);
    // hp2xx gives the whole file up.
    corner(b"IN;SP1;PA0,0;PD400,\x1b.B0,400,400;PU;SP0;", &[]);
    corner(b"IN;SP1;PA0,0;PD40\x1b.B0,0,400,40\x1b.M1;2:0;PU;SP0;", &[]);
}

#[test]
fn wrappers() {
    corner(b"\x1bE\x1b&l1O\x1b%0BIN;SP1;PA0,0;PD400,0,400,400;PU;\x1b%0A\x1bE", &[]);
    corner(b"\x1b%-1BBP;IN;SP1;PA0,0;PD400,0,400,400;PU;PG;", &[]);
    corner(
        b"\x1b%-12345X@PJL JOB\r\n@PJL ENTER LANGUAGE=HPGL2\r\nBP;IN;SP1;PA0,0;PD400,0,400,400;PU;PG;\
          \x1b%-12345X@PJL EOJ\r\n",
        &[],
    );
    // Binary data are skipped by their count, whatever they look like.
    corner(
        b"\x1bE\x1b*r1A\x1b*b26WIN;SP1;PA0,0;PD7,7,8,8;PU;\x1b%0B\x1b%0BIN;SP1;PA0,0;PD400,0,400,400;PU;\
          \x1b%1A\x1b*b3m4w\x1b%0B3W\x1b%0\x1bE",
        &["H0116"],
    );
    // A reset before plain HP-GL that nothing enters.
    corner(b"\x1bEIN;SP1;PA0,0;PD400,0,400,400;PU;", &[]);
    corner(b"\x1b%-12345X\x1bEIN;SP1;PA0,0;PD400,0,400,400;PU;\x1b%-12345X", &[]);
    corner(b"\x1bEHello\x1b%0BIN;SP1;PA0,0;PD400,0,400,400;PU;\x1b%0A", &["H0115"]);
    // Out and in again within a coordinate list.
    corner(b"IN;SP1;PA0,0;PD400,0\x1b%0A\x1b%0BPD400,400;PU;", &[]);
}

#[test]
fn unterminated_text_recovery() {
    let hidden = |text: &[u8]| {
        let document = document(text);
        assert!(
            document.pages[0].drawing.bounding_box().is_some_and(|b| b.x1 >= 10.0 && b.x1 < 100.0),
            "{:?}",
            text.escape_ascii().to_string()
        );
        codes(&document).contains(&"H0110") || codes(&document).contains(&"H0112")
    };
    assert!(!hidden(b"IN;SP1;PA0,0;LBhi\x03PD400,0;PU;SP0;"));
    assert!(!hidden(b"IN;SP1;DT#;PA0,0;LBhi#PD400,0;PU;DT;SP0;"));
    assert!(!hidden(b"IN;SP1;DT#,1;PA0,0;LBhi#PD400,0;PU;SP0;"));
    assert!(!hidden(b"IN;SP1;PA0,0;LBGr\xfc\xdfe \xe9\x03PD400,0;PU;SP0;"));
    assert!(!hidden(b"IN;SP1;PA0,0;LBa;b, PUmp\x03PD400,0;PU;SP0;"));
    assert!(!hidden(b"IN;CO \"a;PD9999,9999;\";SP1;PA0,0;PD400,0;PU;SP0;"));
    assert!(!hidden(b"BP1,\"a;PD9999,9999;\";SP1;PA0,0;PD400,0;PU;SP0;"));
    // IN and DF bring the usual terminator back.
    // Mode 0 prints the terminator too.
    let strokes = |file: &[u8]| read(file, &Options::default()).pages[0].drawing.strokes.len();
    assert_eq!(strokes(b"IN;SP1;DT#,0;LBi#PU;"), strokes(b"IN;SP1;LBi#\x03PU;"));
    assert_eq!(strokes(b"IN;SP1;DT#,1;LBi#PU;"), strokes(b"IN;SP1;LBi\x03PU;"));
    assert_eq!(strokes(b"IN;SP1;DT#,0;DT;LBi#\x03PU;"), strokes(b"IN;SP1;LBi#\x03PU;"));
    assert!(!hidden(b"DT#;IN;SP1;PA0,0;LB#1\x03PD400,0;PU;SP0;"));
    assert!(hidden(b"IN;SP1;PA0,0;LBhello;PD400,0;PU;SP0;"));
    assert!(hidden(b"IN;SP1;PA0,0;PD400,0;PU;PA500,500;LBhello"));
    assert!(hidden(b"IN;SP1;PA0,0;LBhello\r\nPD400,0;PU;SP0;"));
    assert!(hidden(b"IN;SP1;PA0,0;LBhello;PU10,10;PD400,0;PU;LBterminated\x03"));
    assert!(hidden(b"IN;SP1;PA0,0;LBhello\x1b%0A\x1b%0BPD400,0;"));
    assert!(hidden(b"IN;SP1;CO \"a;PA0,0;PD400,0;PU;SP0;"));
}

#[test]
fn pens() {
    corner(b"SP1;PA0,0;PD400,0,400,400;PU;SP0;", &[]);
    corner(b"IN;PA0,0;PD400,0,400,400;PU;", &["H0201"]);
    check(b"IN;SP1;PD400,0;SP0;PD400,400;PU;", &["1: 0,0 400,0"], &["H0202"]);
    check(b"IN;SP1;PD400,0;SP;PD400,400;PU;", &["1: 0,0 400,0"], &["H0202"]);
    // A drawing made with a pen put into the holder by hand is drawn.
    corner(b"IN; SP0; PA0,0;PD400,0,400,400;PU;", &["H0222"]);
    // A new pen is a new stroke, even where the old one is still down.
    check(b"IN;SP1;PD400,0;SP2;PD400,400;PU;", &["1: 0,0 400,0", "2: 400,0 400,400"], &[]);
    check(b"IN;SP1;PD400,0;SP1;PD400,400;PU;", &["1: 0,0 400,0 400,400"], &[]);
}

#[test]
fn pen_moves() {
    corner(b"IN;SP1;PU0,0;PD;PA400,0,400,400;PU;SP0;", &[]);
    corner(b"IN;SP1;PA0,0;PR;PD400,0,0,400;PU;PA;SP0;", &[]);
    corner(b"IN;SP1;PDPR400,0PA400,400PU", &[]);
    check(b"IN;SP1;PU0,0,400,0,400,400;PD800,800;PU;", &["1: 400,400 800,800"], &[]);
    // Only a lift ends a stroke; points that repeat add nothing.
    corner(b"IN;SP1;PD;PD400,0;PD;PA400,0;PD400,0,400,400,400,400;PU;PU;", &[]);
    check(b"IN;SP1;PD400,0;PU;PD400,400;", &["1: 0,0 400,0", "1: 400,0 400,400"], &[]);
}

#[test]
fn dots() {
    check(b"IN;SP1;PU400,400;PD;PU;", &["1: 400,400"], &[]);
    check(b"IN;SP1;PU400,400;PD400,400;PU;", &["1: 400,400"], &[]);
    check(b"IN;SP1;PU400,400;PD;", &["1: 400,400"], &[]);
    check(b"IN;SP1;PU1,1;PD;PU2,2;PD;PU;", &["1: 1,1", "1: 2,2"], &[]);
    check(b"IN;SP1;PA100,100;CI0;", &["1: 100,100"], &[]);
    // The pen comes down, then draws: no dot by itself.
    check(b"IN;SP1;PU4,4;PD;PA8,4;PU;", &["1: 4,4 8,4"], &[]);
}

#[test]
fn empty_drawings() {
    check(b"", &[], &[]);
    check(b"IN;", &[], &[]);
    assert_eq!(read(b"", &Options::default()).pages.len(), 1);
}

#[test]
fn arcs() {
    check(b"IN;SP1;PA400,0;PD;AA0,0,90;PU;", &["1: 400,0 ~0,400"], &[]);
    check(b"IN;SP1;PA400,0;PD;AR-400,0,90;PU;", &["1: 400,0 ~0,400"], &[]);
    check(b"IN;SP1;PA400,0;PU;AA0,0,90;PD0,0;PU;", &["1: 0,400 0,0"], &[]);
    // A coarse chord angle is meant to be seen; the usual one is not.
    check(b"IN;SP1;PA400,0;PD;AA0,0,90,45;PU;", &["1: 400,0 282.8427,282.8427 0,400"], &[]);
    check(b"IN;SP1;PA400,0;PD;AA0,0,90,5;PU;", &["1: 400,0 ~0,400"], &[]);
    // Radius 4000, 10 off the chord: 2 acos(1 - 10/4000) = 8.1 degrees, so that 90 degrees take
    // twelve chords.
    let chords = ink(&document(b"IN;SP1;CT1;PA4000,0;PD;AA0,0,90,10;PU;"));
    assert_eq!(chords[0].split(' ').count(), 1 + 1 + 12);
    // Turns beyond the first retrace it; the pen still ends where it should.
    check(b"IN;SP1;PA400,0;PD;AA0,0,3690;PA0,0;PU;", &["1: 400,0 ~0,400 0,0"], &["H0227"]);
    let ellipse = document(b"IN;SP1;IP0,0,2000,1000;SC-1,1,-1,1;PA1,0;PD;AA0,0,90;PU;");
    assert_eq!(ink(&ellipse), ["1: 2000,500 ~1000,1000"]);
    // Mirrored: counterclockwise in user units is clockwise on the page.
    let mirrored = document(b"IN;SP1;IP0,0,1000,1000;SC1,-1,-1,1;PA1,0;PD;AA0,0,90;PU;");
    assert_eq!(ink(&mirrored), ["1: 0,500 ~500,1000"]);
    check(b"IN;SP1;PA400,0;PD;AA0,0;PA400,100;PU;", &["1: 400,0 400,100"], &["H0204"]);
}

#[test]
fn arcs_through_points() {
    let half = std::f64::consts::PI * 200.0 * hpgl::PLOTTER_UNIT_MM;
    for file in [&b"IN;SP1;PA0,0;PD;AT200,200,400,0;PU;"[..], b"IN;SP1;PA0,0;PD;RT200,200,400,0;PU;"] {
        let document = document(file);
        assert_eq!(ink(&document), ["1: 0,0 ~400,0"]);
        assert!((document.pages[0].drawing.length() - half).abs() < 1e-9);
        let top = document.pages[0].drawing.bounding_box().unwrap().y1;
        assert!((top - 5.0).abs() < 1e-9, "over the upper side");
    }
    // All on a line, in between: a line. Beyond the end: there and back. First equal to last: a
    // circle.
    check(b"IN;SP1;PA0,0;PD;AT200,0,400,0;PU;", &["1: 0,0 400,0"], &["H0215"]);
    check(b"IN;SP1;PA0,0;PD;AT600,0,400,0;PU;", &["1: 0,0 600,0 400,0"], &["H0215"]);
    check(b"IN;SP1;PA0,0;PD;AT0,0,400,0;PU;", &["1: 0,0 400,0"], &["H0215"]);
    check(b"IN;SP1;PA7,7;PD;AT7,7,7,7;PU;", &["1: 7,7"], &["H0215"]);
    let circle = document(b"IN;SP1;PA0,0;PD;AT400,0,0,0;PU;");
    assert!((circle.pages[0].drawing.length() - 2.0 * half).abs() < 1e-9);
    // A vendor's RT with one number is not an arc.
    check(b"IN;\nRT10;\nSP1;PA0,0;PD400,0;", &["1: 0,0 400,0"], &["H0204"]);
}

#[test]
fn circles() {
    check(b"IN;SP1;PA1000,1000;CI400;PU;", &["1: 1400,1000 ~1400,1000"], &[]);
    let triangle = "1: 1400,1000 800,1346.4102 800,653.5898 1400,1000";
    check(b"IN;SP1;PA1000,1000;CI400,120;PU;", &[triangle], &[]);
    // A negative radius begins at the left; the pen comes back to the centre, as it was.
    check(
        b"IN;SP1;PA1000,1000;CI-400,180;PD2000,1000;PU;",
        &["1: 600,1000 1400,1000 600,1000", "1: 1000,1000 2000,1000"],
        &[],
    );
}

#[test]
fn curves() {
    check(b"IN;SP1;PA0,0;PD;BZ0,400,400,400,400,0;PU;", &["1: 0,0 ~400,0"], &[]);
    check(b"IN;SP1;PA100,100;PD;BR0,400,400,400,400,0;PU;", &["1: 100,100 ~500,100"], &[]);
    let curve = document(b"IN;SP1;PA0,0;PD;BZ0,400,400,400,400,0,1,1;PU;");
    assert_eq!(codes(&curve), ["H0206"]);
    // The middle of that cubic is at 3/4 of the height of its control points.
    assert!((curve.pages[0].drawing.bounding_box().unwrap().y1 - 7.5).abs() < 1e-9);
}

#[test]
fn rectangles_and_wedges_keep_pen_position() {
    check(
        b"IN;SP1;PA100,100;EA500,300;PD0,0;",
        &["1: 100,100 500,100 500,300 100,300 100,100", "1: 100,100 0,0"],
        &[],
    );
    check(b"IN;SP1;PA600,100;ER200,200;", &["1: 600,100 800,100 800,300 600,300 600,100"], &[]);
    check(b"IN;SP1;PA500,500;EW300,0,90;", &["1: 500,500 800,500 ~500,800 500,500"], &[]);
    check(b"IN;SP1;PA500,500;EW-300,0,90;", &["1: 500,500 200,500 ~500,200 500,500"], &[]);
    check(b"IN;SP1;PA500,500;EW300,0,360;", &["1: 800,500 ~800,500"], &[]);
    // The last shape can be drawn again.
    check(b"IN;SP1;PA0,0;ER10,20;EP;", &["1: 0,0 10,0 10,20 0,20 0,0", "1: 0,0 10,0 10,20 0,20 0,0"], &[]);
}

#[test]
fn scales() {
    check(
        b"IN;IP0,0,4000,2000;SC0,100,0,100;SP1;PA0,0;PD100,0,100,100,0,0;PU;",
        &["1: 0,0 4000,0 4000,2000 0,0"],
        &[],
    );
    check(
        b"IN;IP0,0,4000,2000;SC100,0,100,0;SP1;PA0,0;PD100,0,100,50,0,0;PU;",
        &["1: 4000,2000 0,2000 0,1000 4000,2000"],
        &[],
    );
    check(
        b"IN;IP0,0,4000,2000;SC0,100,0,100,1;SP1;PA0,0;PD100,0,100,100,0,0;PU;",
        &["1: 1000,0 3000,0 3000,2000 1000,0"],
        &[],
    );
    check(
        b"IN;IP0,0,4000,2000;SC0,100,0,100,1,0,0;SP1;PA0,0;PD100,0,100,100,0,0;PU;",
        &["1: 0,0 2000,0 2000,2000 0,0"],
        &[],
    );
    check(
        b"IN;IP100,100,4000,2000;SC0,10,0,20,2;SP1;PA0,0;PD100,0,100,100,0,0;PU;",
        &["1: 100,100 1100,100 1100,2100 100,100"],
        &[],
    );
    // P2 follows P1, which keeps the size.
    check(b"IN;IP0,0,1000,1000;IP500,500;SC0,10,0,10;SP1;PA0,0;PD10,10;PU;", &["1: 500,500 1500,1500"], &[]);
    // The pen stays on the paper when the scale changes under it.
    check(
        b"IN;IP0,0,1000,1000;SP1;PU300,400;SC0,10,0,10;PD10,10;SC;PD0,0;",
        &["1: 300,400 1000,1000 0,0"],
        &[],
    );
    check(b"IN;SP1;SC0,0,0,1;PD400,0;", &["1: 0,0 400,0"], &["H0208"]);
    check(b"IN;SP1;SC0,1;PD400,0;", &["1: 0,0 400,0"], &["H0203"]);
    check(b"IN;SP1;IP0,0,0,1000;SC0,1,0,1;PD1,1;", &["1: 0,0 1,1000"], &["H0209"]);
    // A scale that no paper holds.
    check(b"IN;SP1;IP0,0,9,9;SC0,1e-9,0,1e-9;PD1,1;SC;PD400,0;", &["1: 0,0 400,0"], &["H0207"]);
    // From P1 at the upper left, y down: what drafting programs write.
    check(
        b"BP;IN;PS11056,7977;RO90;IP0,0,1016,-1016;IR0,100;SC0,300,0,300;SP1;PA0,0;PD300,0,300,300;PU;",
        &["1: 0,0 0,1016 1016,1016"],
        &[],
    );
}

#[test]
fn rotation_keeps_page_in_positive_quadrant() {
    check(b"IN;SP1;PS4000,2000;RO90;PA0,0;PD400,0,400,200;PU;", &["1: 4000,0 4000,400 3800,400"], &[]);
    check(b"IN;SP1;PS4000,2000;RO180;PA0,0;PD400,200;PU;", &["1: 4000,2000 3600,1800"], &[]);
    check(b"IN;SP1;PS4000,2000;RO270;PA0,0;PD400,200;PU;", &["1: 0,2000 200,1600"], &[]);
    check(b"IN;SP1;PS4000,2000;RO45;PA0,0;PD400,200;PU;", &["1: 0,0 400,200"], &["H0203"]);
    // The pen stays on the paper.
    check(b"IN;SP1;PS4000,2000;PA100,200;RO90;PD0,0;PU;", &["1: 100,200 4000,0"], &[]);
}

#[test]
fn windows() {
    check(
        b"IN;SP1;IW100,100,300,300;PA0,200;PD400,200;PU0,0;PD400,400;PU;",
        &["1: 100,200 300,200", "1: 100,100 300,300"],
        &["H0210"],
    );
    check(b"IN;SP1;IW100,100,300,300;IW;PA0,200;PD400,200;PU;", &["1: 0,200 400,200"], &[]);
    // Out and in again is two strokes.
    check(
        b"IN;SP1;IW0,0,300,300;PA100,100;PD500,100,500,200,100,200;PU;",
        &["1: 100,100 300,100", "1: 300,200 100,200"],
        &["H0210"],
    );
    // The page that PS sets clips, a default one does not.
    check(b"IN;SP1;PS4000,2000;PD4000,0,5000,0;", &["1: 0,0 4000,0"], &["H0225"]);
    check(b"IN;SP1;PD40000,0;", &["1: 0,0 40000,0"], &[]);
    // A page whose longer side lies along x, where ink fits on that only: real CAD files rely on it.
    check(b"IN;SP1;PS2000,4000;PD4000,2000;", &["1: 0,0 4000,2000"], &[]);
    check(b"IN;SP1;PS2000,4000;RO90;PD2000,4000;", &["1: 0,0 0,2000"], &[]);
    check(b"IN;SP1;IW5,5,5,9;PD400,0;IW;PD400,400;", &["1: 400,0 400,400"], &["H0211", "H0210"]);
    // A window in user units moves with the scaling points.
    check(
        b"IN;SP1;IP0,0,100,100;SC0,10,0,10;IW0,0,5,10;IP0,0,1000,1000;PA0,0;PD10,0;",
        &["1: 0,0 500,0"],
        &["H0210"],
    );
    // Arcs are cut exactly and stay arcs.
    check(b"IN;SP1;IW-500,0,500,500;PA400,0;CI0;PA0,0;CI400;", &["1: 400,0", "1: 400,0 ~-400,0"], &["H0210"]);
}

#[test]
fn paper_size_code() {
    check(b"IN;DF;PS4;SP1;PD400,0;", &["1: 0,0 400,0"], &["H0213"]);
    // One length: a page open to its other side.
    check(b"BP;IN;PS10668;SP1;PD400,20000;", &["1: 0,0 400,20000"], &[]);
}

#[test]
fn encoded_polylines() {
    corner(b"IN;SP1;PA0,0;PE_\xcb\xbf\xbf_\xcb;PU;SP0;", &[]);
    check(b"IN;SP1;PA0,0;PE7?x_He?x;PU;SP0;", &["1: 0,0 400,0 300,400"], &[]);
    check(b"IN;SP1;PA0,0;PE<=G\xc2G\xc2=g\xceG\xc2;PU;SP0;", &["1: 100,100 500,100"], &[]);
    // Fractional bits divide: hp2xx multiplies.
    check(b"IN;SP1;PA0,0;PE>\xc7?G\xc2\xcf\xbf?G\xc2;PU;SP0;", &["1: 0,0 400,0.5 400,400.5"], &[]);
    check(b"IN;SP1;PA0,0;PE_\xcb\xbfPU;SP0;", &["1: 0,0 400,0"], &["H0117"]);
    check(b"IN;SP1;PA0,0;PE_\xcb\xbfPD400,400;", &["1: 0,0 400,0 400,400"], &["H0117"]);
    check(
        b"IN;SP1;PA0,0;PE:\xc5_\xcb\xbf<\xd3\xd3\xbf_\xcb;PU;SP0;",
        &["3: 0,0 400,0", "3: 410,10 410,410"],
        &[],
    );
    // An editor took the file for Latin-1 and saved it as UTF-8.
    let text: String = b"IN;SP1;PA0,0;PE_\xcb\xbf\xbf_\xcb;PU;SP0;".iter().map(|&b| char::from(b)).collect();
    corner(text.as_bytes(), &["H0119"]);
    check(b"IN;SP1;PA0,0;PE_\xcb\xbf_\xcb;PU;", &["1: 0,0 400,0"], &["H0118"]);
    // The pen state that PE leaves, and the mode that it found.
    check(b"IN;SP1;PR;PE_\xcb\xbf;PA400,400;", &["1: 0,0 400,0 400,400"], &[]);
    check(b"IN;SP1;PR;PE<_\xcb\xbf;PR9,9;PD1,1;", &["1: 409,9 410,10"], &[]);
}

#[test]
fn polygons() {
    check(
        b"IN;SP1;PA0,0;PM0;PD400,0,400,400,0,400;PM1;PU100,100;PD300,100,300,300,100,300;PM2;EP;PU;",
        &["1: 0,0 400,0 400,400 0,400 0,0", "1: 100,100 300,100 300,300 100,300 100,100"],
        &[],
    );
    // Nothing is drawn by the definition, and the pen is put back.
    check(b"IN;SP1;PU5,5;PM0;PD400,0,400,400;PM2;PD6,6;", &["1: 5,5 6,6"], &[]);
    // Edges with the pen up bound the area but are not drawn.
    check(
        b"IN;SP1;PA0,0;PM0;PD400,0;PU400,400;PD0,400;PM2;EP;",
        &["1: 0,0 400,0", "1: 400,400 0,400 0,0"],
        &[],
    );
    check(b"IN;SP1;PA0,0;PM0;CI400,90;PM2;EP;", &["1: 400,0 0,400 -400,0 0,-400 400,0"], &[]);
    // A plotter's pen comes down at the corner where the outline begins anyway.
    check(b"IN;SP1;PA1,1;PD;PM0;PA5,1,5,5;PM2;EP;", &["1: 1,1 5,1 5,5 1,1"], &[]);
    check(b"IN;SP1;EP;PM2;", &[], &["H0218", "H0203"]);
    check(b"IN;SP1;PM0;PD400,0;", &[], &["H0217"]);
}

#[test]
fn pages() {
    let document = document(b"IN;SP1;PD400,0;PG;PU;PD0,400;PG;AF;");
    assert_eq!(document.pages.len(), 2);
    assert_eq!(codes(&document), ["H0214"]);
    assert!(document.diagnostics.iter().all(|diagnostic| diagnostic.severity == Severity::Note));
    assert_eq!(ink(&document), ["1: 0,0 400,0"]);
}

#[test]
fn diagnostic_counts() {
    let mut file = b"IN;SP1;".to_vec();
    for _ in 0..1000 {
        file.extend_from_slice(b"QQ1,2;PD1,2,3;ZZ;");
    }
    let document = document(&file);
    assert_eq!(codes(&document), ["H0101", "H0206", "H0101"]);
    assert!(document.diagnostics.iter().all(|diagnostic| diagnostic.count == 1000));
    assert_eq!(document.summary.commands, 2 + 3000);
}

#[test]
fn diagnostic_positions() {
    let document = document(b"IN;SP1;PA400,800;QQ1;");
    let diagnostic = &document.diagnostics[0];
    assert_eq!((diagnostic.span.start, diagnostic.span.end), (17, 19));
    assert_eq!(diagnostic.command, 4);
    assert_eq!((diagnostic.pen_position.x, diagnostic.pen_position.y), (10.0, 20.0));
}

#[test]
fn stroke_source_spans() {
    let file = b"IN;SP1;PU0,0;PD400,0;PA400,400;PU;";
    let document = document(file);
    let source = document.pages[0].drawing.strokes.to_vec()[0].source();
    assert_eq!(&file[source.start..source.end], b"PD400,0;PA400,400;");
}

#[test]
fn pen_settings() {
    let document = document(b"IN;SP1;VS20;PW.5;PD400,0;VS10,2;FS3,2;SP2;PD400,400;SP3;PD0,0;");
    let pens = &document.pages[0].pens;
    assert_eq!(pens.len(), 3);
    let of = |pen| pens[&hpgl::Pen(pen)];
    assert_eq!((of(1).speed_mm_s, of(1).width_mm, of(1).force), (Some(200.0), Some(0.5), None));
    assert_eq!((of(2).speed_mm_s, of(2).force), (Some(100.0), Some(3.0)));
    assert_eq!(of(3).speed_mm_s, Some(200.0));
    // The lowest speed set while the pen drew.
    let slow = crate::document(b"IN;SP1;VS5;VS20;PD400,0;VS10;PD400,400;VS30;PU;");
    assert_eq!(slow.pages[0].pens[&hpgl::Pen(1)].speed_mm_s, Some(100.0));
    // Percent of the diagonal, 25 mm.
    let wide = crate::document(b"IN;SP1;IP0,0,600,800;WU1;PW2;PD400,0;");
    assert_eq!(wide.pages[0].pens[&hpgl::Pen(1)].width_mm, Some(0.5));
}

#[test]
fn plotter_profile_selection() {
    // No IP: the scaling points of the 7475A on A4, on A3 where PS names it, the corners of the
    // page in HP-GL/2.
    let scaled =
        |setup: &str, rest: &str| document(format!("{setup}IN;{rest}SP1;SC0,1,0,1;PA0,0;PD1,1;").as_bytes());
    assert_eq!(ink(&scaled("", "")), ["1: 603,521 10603,7721"]);
    assert_eq!(codes(&scaled("", "")), ["H0226"]);
    assert_eq!(ink(&scaled("", "PS0;")), ["1: 170,602 15370,10602"]);
    assert_eq!(ink(&scaled("", "PS4;")), ["1: 603,521 10603,7721"]);
    assert_eq!(ink(&scaled("\x1b%0B", "")), ["1: 0,0 11040,7721"]);
    assert_eq!(ink(&scaled("BP;", "PS4000,2000;")), ["1: 0,0 4000,2000"]);
    assert_eq!(codes(&scaled("BP;", "PS4000,2000;")), [""; 0]);
    // A plotter named in the options stays.
    let options = Options::for_plotter("hp7475a", Some("a3")).expect("built in");
    let document = read(b"IN;PS4;SP1;SC0,1,0,1;PA0,0;PD1,1;", &options);
    let end = document.pages[0].drawing.strokes.to_vec()[0].end();
    assert!((end.x - 15370.0 * hpgl::PLOTTER_UNIT_7475A_MM).abs() < 1e-9);
}

#[test]
fn plotter_profile_in_summary() {
    let summary = |file: &[u8]| read(file, &Options::default()).summary;
    let plain = summary(b"IN;SP1;PU0,0;PD400,0;");
    assert_eq!(plain.generation(), Generation::HpGl);
    assert_eq!(plain.wrappers, Wrappers::default());
    assert_eq!(plain.profile.reason, ProfileReason::Assumed);
    assert_eq!(plain.profile.scaling_points, (Point::new(603.0, 521.0), Point::new(10603.0, 7721.0)));
    assert_eq!(plain.profile.unit_mm, 0.025);

    assert_eq!(summary(b"IN;PS0;SP1;PD1,2;").profile.reason, ProfileReason::PaperCode);
    assert_eq!(summary(b"IN;PS0;SP1;PD1,2;").profile.hard_clip.x1, 16158.0);
    // The reset at the end of a job does not hide what the job was read for.
    let job =
        b"\x1b%-12345X@PJL ENTER LANGUAGE=HPGL2\n\x1b%-1BBPINPS4000,2000SP1PD1,2PG;\x1b%0A\x1bE\x1b%-12345X";
    let job = summary(job);
    assert_eq!(job.generation(), Generation::HpGl2);
    assert_eq!(job.wrappers, Wrappers { device_control: false, pcl: true, job_control: true });
    assert_eq!(job.profile.reason, ProfileReason::PageSize);
    assert_eq!(job.profile.scaling_points.1, Point::new(4000.0, 2000.0));
    assert_eq!(summary(b"BP;IN;SP1;PD1,2;").profile.reason, ProfileReason::HpGl2);
    assert_eq!(
        summary(b"\x1bE\x1b*c7200x3600Y\x1b%0BIN;SP1;PD1,2;\x1b%0A\x1bE").profile.reason,
        ProfileReason::PictureFrame
    );
    assert!(summary(b"\x1b.I81;;17:IN;SP1;PD1,2;").wrappers.device_control);
    let named = Options::for_plotter("hp7550a", None).unwrap();
    assert_eq!(read(b"IN;SP1;PD1,2;", &named).summary.profile.reason, ProfileReason::Options);
}

/// Each of these once was, or could be, a hang, a crash or ink at infinity: it must be reported,
/// and the rest of the file drawn.
#[test]
fn absurd_numbers_are_reported() {
    for (file, code) in [
        (&b"IN;SP1;PU0,0;PD99999999999,0;"[..], "H0108"),
        (b"IN;SP1;PU0,0;PD1e400,0;", "H0108"),
        (b"IN;SP1;PU0,0;PD1000000000,0;PR1000000000,0;", "H0207"),
        (b"IN;SP1;SC0,1e-300,0,1;PU0,0;PD1,1;SC;", "H0207"),
        (b"IN;SP1;SC1,1,0,1;", "H0208"),
        (b"IN;SP1;SC0,0,0,0,2;", "H0208"),
        (b"IN;SP1;IP0,0,0,0;SC0,1,0,1;SC;IP;", "H0209"),
        (b"IN;SP1;IW1,1,1,1;PD100,100;PU;IW;", "H0211"),
        (b"IN;SP1;PU100,0;PD;AA0,0,1000000000;PU;", "H0227"),
        (b"IN;SP1;PU100,0;PD;AA0,0,90,0.0000001;PU;", "H0227"),
        (b"IN;SP1;CT1;PU100,0;CI1000,0.0000000001;", "H0227"),
        (b"IN;SP1;EW100,0,90,1e-30;", "H0227"),
        (b"IN;SP1;PU1000000000,0;CI1000000000;", "H0207"),
        (b"IN;SP1;LT2,0.0000001,1;PU0,0;PD10000,0;PU;LT;", "H0223"),
        (b"IN;SP1;FT3,0.00001;RA10000,10000;", "H0223"),
        (b"IN;SP1;SI1e9,1e9;LBx\x03SI;", "H0207"),
        (b"IN;SP1;PS0,0;", "H0203"),
    ] {
        let name = String::from_utf8_lossy(file);
        let document = read(&[file, b"PA;PU7000,7000;PD7400,7000;PU;"].concat(), &Options::default());
        let codes: Vec<&str> = document.diagnostics.iter().map(|d| d.code.name()).collect();
        assert!(codes.contains(&code), "{name}: {codes:?}");
        let last =
            document.pages[0].drawing.strokes.iter().last().map(|stroke| (stroke.start(), stroke.end()));
        assert_eq!(last, Some((Point::new(175.0, 175.0), Point::new(185.0, 175.0))), "{name}");
    }
}

/// `AutoCAD`'s driver numbers its colours from 0 on; much of a file's ink was missing without this.
#[test]
fn coloured_pen_zero_is_drawn() {
    let palette = b"BPIN;NP8;PC0,0,255,255;SP0;PU0,0;PD400,0;SP1;PU0,40;PD400,40;PU;";
    check(palette, &["2: 0,0 400,0", "1: 0,40 400,40"], &["H0228"]);
    let late = b"BPIN;SP0;PU0,0;PD400,0;PC0,0,0,255;SP1;PU0,40;PD400,40;PU;";
    check(late, &["2: 0,0 400,0", "1: 0,40 400,40"], &["H0228"]);
    // White on white is none.
    let white = b"BPIN;PC0,255,255,255;SP0;PU0,0;PD400,0;SP1;PU0,40;PD400,40;PU;";
    check(white, &["1: 0,40 400,40"], &["H0202"]);
}

/// The pen of a named plotter cannot leave its hard clip limits; an assumed plotter cuts nothing.
#[test]
fn named_plotter_cuts_at_its_limits() {
    let file = b"IN;SP1;PU11000,100;PD11140,100;PU0,7621;PD0,7821;";
    let a4 = Options::for_plotter("hp7475a", None).expect("built in");
    let unit = a4.plotter_unit_mm;
    let cut = read(file, &a4);
    let lengths: Vec<f64> =
        cut.pages[0].drawing.strokes.iter().map(|stroke| stroke.length() / unit).collect();
    assert!((lengths[0] - 40.0).abs() < 1e-6 && (lengths[1] - 100.0).abs() < 1e-6, "{lengths:?}");
    assert!(cut.diagnostics.iter().any(|found| found.code.name() == "H0230"), "{:?}", cut.diagnostics);
    let whole = read(file, &Options::default());
    assert!((whole.pages[0].drawing.length() / 0.025 - 340.0).abs() < 1e-6);
    // IW is within the limits: a window beyond them lets no more ink through.
    let window = read(b"IN;IW10000,0,12000,500;SP1;PU9000,100;PD12000,100;", &a4);
    assert!((window.pages[0].drawing.length() / unit - 1040.0).abs() < 1e-6);
    // The limits turn with RO.
    let turned = read(b"IN;RO90;IP;SP1;PU100,11000;PD100,11140;PU7621,0;PD7821,0;", &a4);
    assert!((turned.pages[0].drawing.length() / unit - 140.0).abs() < 1e-6);
}

#[test]
fn pen_colours_of_pc_are_kept() {
    let file = b"BP;IN;NP8;CR0,100,0,100,0,100;PC2,100,0,50;PC3,100,100,100;SP1;PD1,1;SP2;PD2,2;SP3;PD3,3;";
    let page = &read(file, &Options::default()).pages[0];
    let color = |pen: u16| page.pens[&hpgl::Pen(pen)].color;
    assert_eq!([color(1), color(2), color(3)], [None, Some([255, 0, 128]), None]);
}
