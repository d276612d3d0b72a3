//! Points of the language by HP's manuals: one test a point. docs/hpgl-support.md gives the sources.

mod common;

use common::{check, codes, document, ink};

#[test]
fn open_comment_ends_at_semicolon() {
    // With and without a blank before the quote that is never closed.
    check(b"IN;SP1;CO\"a PD9,9;PD400,0;", &["1: 0,0 400,0"], &["H0112"]);
    check(b"IN;SP1;CO \"a PD9,9;PD400,0;", &["1: 0,0 400,0"], &["H0112"]);
}

#[test]
fn vendor_commands_are_skipped_whole() {
    // Roland's and engravers' own commands: `!RO90` must not turn, `!DR` is no label direction.
    check(
        b"!DR 0;\nIN;SP1;PU0,0;PD1000,0;PU;!RO90;PU0,500;PD1000,500;PU;",
        &["1: 0,0 1000,0", "1: 0,500 1000,500"],
        &["H0120"],
    );
    check(b"IN;SP1;!PZ-20,40;!mc1PD400,0;", &["1: 0,0 400,0"], &["H0120"]);
    // A stray `!` before a file is no command.
    check(b"!IN;SP1;PD400,0;", &["1: 0,0 400,0"], &["H0102"]);
}

#[test]
fn change_of_a_pens_colour_is_reported() {
    let twice = document(b"IN;PC1,255,0,0;SP1;PD400,0;PC1,0,0,255;PD400,400;SP2;PD0,0;SP1;PD0,9;");
    assert_eq!(codes(&twice), ["H0231"]);
    assert!(codes(&document(b"IN;PC1,9,0,0;PC1,0,0,255;SP1;PD400,0;PC2,1,2,3;PD400,400;")).is_empty());
}

#[test]
fn white_pens_are_reported() {
    let white = document(b"IN;NP8;PC3,255,255,255;SP1;PU0,0;PD1000,0;SP3;PU0,200;FT1;RR800,400;PU;SP0;");
    assert_eq!(codes(&white), ["H0229"]);
    assert_eq!(white.diagnostics[0].message, "pen 3 is white (PC), but its ink is drawn");
    let two = document(b"IN;PC3,255,255,255;PC4,255,255,255;SP3;PD9,0;SP4;PD0,9;");
    assert_eq!(two.diagnostics[0].message, "pens 3, 4 are white (PC), but their ink is drawn");
    // In the range that CR sets; not once the pen has another colour, or its default one.
    assert_eq!(codes(&document(b"IN;CR0,1,0,1,0,1;PC3,1,1,1;SP3;PD400,0;")), ["H0229"]);
    check(b"IN;PC1,255,255,255;PC1,255,0,0;SP1;PD400,0;", &["1: 0,0 400,0"], &[]);
    check(b"IN;PC1,255,255,255;PC1;SP1;PD400,0;", &["1: 0,0 400,0"], &[]);
    check(b"PC1,255,255,255;IN;SP1;PD400,0;", &["1: 0,0 400,0"], &[]);
    check(b"IN;PC1,255,255,255;SP1;PU400,0;", &[], &[]);
}

#[test]
fn scale_before_input_points() {
    check(b"IN;SP1;SC0,1000,0,1000;IP0,0,4000,4000;PU0,0;PD1000,1000;PU;SP0;", &["1: 0,0 4000,4000"], &[]);
    // Nothing is drawn, or not in user units.
    check(b"IN;SP1;SC0,1,0,1;PU1,1;SC;PU0,0;PD400,0;", &["1: 0,0 400,0"], &[]);
    // Drawn before the IP: P1 and P2 are assumed.
    let assumed = document(b"IN;SP1;SC0,1,0,1;PU0,0;PD1,1;IP0,0,4000,4000;");
    assert_eq!(codes(&assumed), ["H0226"]);
    assert_eq!(assumed.diagnostics[0].span.start, 7);
}

#[test]
fn pcl_plot_size_scales_to_frame() {
    let square = "IN;SP1;PU0,0;PD2000,0,2000,2000;PU;\x1b%0A\x1bE";
    let file = |sizes: &str| format!("\x1bE{sizes}\x1b%0B{square}").into_bytes();
    // A frame of 4 inches for a plot of 8.
    check(&file("\x1b*c2880x2880Y\x1b*c8K\x1b*c8L"), &["1: 0,0 1000,0 1000,1000"], &[]);
    check(&file("\x1b*c8k8l2880x2880Y"), &["1: 0,0 1000,0 1000,1000"], &[]);
    // In width only; 0 and a reset make it the size of the frame again.
    check(&file("\x1b*c2880x2880Y\x1b*c16K"), &["1: 0,0 500,0 500,2000"], &[]);
    check(&file("\x1b*c2880x2880Y\x1b*c8k8L\x1b*c0k0L"), &["1: 0,0 2000,0 2000,2000"], &[]);
    check(&file("\x1b*c2880x2880Y\x1b*c8k8L\x1bE"), &["1: 0,0 2000,0 2000,2000"], &[]);
    // P1 and P2 are the corners of the frame.
    check(
        b"\x1bE\x1b*c2880x2880Y\x1b*c8k8L\x1b%0BIN;SP1;SC0,1,0,1;PU0,0;PD1,1;\x1b%0A",
        &["1: 0,0 4064,4064"],
        &[],
    );
}

#[test]
fn label_terminator_prints_in_hpgl_only() {
    let label = |before: &str, text: &str| {
        let file = format!("{before}PU0,0;{text}SP0;");
        ink(&document(file.as_bytes()))
    };
    // A printing terminator of HP-GL is drawn, too (7470A).
    assert_eq!(label("IN;SP1;DT#;", "LBab#"), label("IN;SP1;", "LBab#\x03"));
    // Not in HP-GL/2, whose mode 0 prints it; nor once DT; restores the usual one.
    assert_eq!(label("BP;IN;SP1;DT#;", "LBab#"), label("BP;IN;SP1;", "LBab\x03"));
    assert_eq!(label("IN;SP1;DT#;", "LBab#PW.3;"), label("IN;SP1;", "LBab\x03PW.3;"));
    assert_eq!(label("BP;IN;SP1;DT#,0;", "LBab#"), label("BP;IN;SP1;", "LBab#\x03"));
    assert_eq!(label("IN;SP1;DT#;DT;", "LBab\x03"), label("IN;SP1;", "LBab\x03"));
    // Control characters do what they do: LF moves to the next line.
    assert_eq!(label("IN;SP1;DT\n;", "LBa\nLBb\n"), label("IN;SP1;", "LBa\n\x03LBb\x03"));
}

#[test]
fn page_size_order() {
    // The first length lies along x: a portrait page.
    check(
        b"\x1b%-1BBP;IN;PS10160,16256;SP1;PU0,0;PD0,16000,10000,16000,10000,0,0,0;PU;PG;",
        &["1: 0,0 0,16000 10000,16000 10000,0 0,0"],
        &[],
    );
    check(b"BP;IN;PS2000,4000;SP1;SC0,1,0,1;PU0,0;PD1,1;", &["1: 0,0 2000,4000"], &[]);
    // The longer one, where ink fits on such a page only.
    check(b"BP;IN;PS2000,4000;SP1;PU0,0;PD4000,2000;", &["1: 0,0 4000,2000"], &[]);
    // It fits on neither: the page that keeps more of it.
    check(b"BP;IN;PS2000,4000;SP1;PU0,0;PD0,6000;", &["1: 0,0 0,4000"], &["H0225"]);
    check(b"BP;IN;PS2000,4000;SP1;PU0,0;PD6000,0;", &["1: 0,0 4000,0"], &["H0225"]);
}

#[test]
fn national_character_sets() {
    let label = |set: u8, text: &str| ink(&document(format!("IN;SP1;CS{set};LB{text}\x03").as_bytes()));
    let latin = |text: &str| ink(&document(format!("IN;SP1;LB{text}\x03").as_bytes()));
    for (set, bytes, characters) in [
        (0, "#$@[\\]^`{|}~", "#$@[\\]^`{|}~"),
        (6, "#$@[\\]^`{|}", "#$@[¥]^`{|}"),
        (9, "#$@[\\]^`{|}", "#¤@[\\]^`{|}"),
        (30, "$@[\\]{|}", "¤@ÄÖÅäöå"),
        (31, "$@[\\]^`{|}~", "¤ÉÄÖÅÜéäöåü"),
        (32, "[\\]{|}", "ÆØÅæøå"),
        (33, "@[\\]{|}~", "§ÄÖÜäöüß"),
        (34, "#@[\\]`{|}~", "£à°ç§`éùè¨"),
        (35, "#$@", "£$@"),
        (36, "#@[\\]`{|}~", "£§°çéùàòèì"),
        (37, "#@[\\]{|}", "£§¡Ñ¿°ñç"),
        (38, "@[\\]{|}~", "§ÃÇÕãçõ°"),
        (39, "#[\\]{|}~", "§ÆØÅæøå|"),
    ] {
        assert_eq!(label(set, bytes), latin(characters), "CS{set}");
    }
    // Sets that cannot be drawn are reported by name.
    let katakana = document(b"IN;SP1;CS8;LBa\x03");
    assert_eq!(
        katakana.diagnostics[0].message,
        "character set 8 (Katakana) is not built in; ISO 8859-1 is taken"
    );
}

#[test]
fn hp_character_sets_put_accents_on_the_character_before() {
    let label = |set: u8, text: &str| {
        let document = document(format!("IN;SP1;CS{set};LB{text}\x03").as_bytes());
        assert_eq!(document.diagnostics, [], "CS{set} {text}");
        ink(&document)
    };
    let latin = |text: &str| ink(&document(format!("IN;SP1;LB{text}\x03").as_bytes()));
    for (set, bytes, characters) in [
        (1, "\\^{|}e`n~'", "√↑π⊢→èñ'"),
        (2, "#\\e'e`e^u}U{A|~a[", "£çéèêüÜÅ'a["),
        (3, "#[\\]^A{A|a}a~", "£ØÆøæÄÅäå"),
        (4, "#\\e'N|n~a", "¿¡éÑña"),
    ] {
        assert_eq!(label(set, bytes), latin(characters), "CS{set}");
    }
    // Marks without a letter of their own: the line under `ab` ends below the pen, which moves on by
    // two characters only.
    let plain = latin("ab!");
    let underlined = label(2, "a_b_!");
    assert_eq!(underlined.len(), plain.len() + 2);
    assert_eq!(underlined.last(), plain.last());
    // A tilde over two letters, one stroke more.
    assert_eq!(label(4, "ll}").len(), latin("ll").len() + 1);
    // Centred labels count letters, not marks.
    let centred = |text: &str| ink(&document(format!("IN;SP1;LO5;CS2;LB{text}\x03").as_bytes()));
    assert_eq!(centred("cafe'"), centred("caf\u{e9}"));
}
