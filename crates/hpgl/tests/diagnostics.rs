//! What people read.

use std::fmt::Write as _;

#[test]
fn diagnostics_of_damaged_file() {
    let file = b"\xef\xbb\xbfIN;PD400,0,7;QQ1,2;LBno end;SC0,0,0,1;RO45;PD99999999999,0;AA1;EP;DT\0;\
        SP0;PD1,1;SP1;IW5,5,5,5;PD1000,,0;IW;PM1;PG;PD4\n5,6;PM0;EA1,1;";
    let document = hpgl::read(file, &hpgl::Options::default());
    let mut text = String::new();
    for diagnostic in &document.diagnostics {
        let place = diagnostic.pen_position;
        writeln!(
            text,
            "{diagnostic}\n    command {}, pen at {:.2}, {:.2} mm",
            diagnostic.command, place.x, place.y
        )
        .unwrap();
        if let Some(help) = &diagnostic.help {
            writeln!(text, "    help: {help}").unwrap();
        }
    }
    insta::assert_snapshot!(text);
}

#[test]
fn diagnostic_code_table() {
    let mut text = String::new();
    for code in hpgl::Code::all() {
        writeln!(text, "{code} {}: {}\n  {}", code.severity(), code.title(), code.explanation()).unwrap();
    }
    insta::assert_snapshot!(text);
}
