//! What holds for any bytes at all.

use hpgl::{EmitOptions, Encoding, Options, emit, interpret, parse, read};
use proptest::prelude::*;

/// Bytes that look like the language often enough to get deep into it.
fn almost_hpgl() -> impl Strategy<Value = Vec<u8>> {
    let names: Vec<String> = hpgl::known_commands().map(|name| name.to_string()).collect();
    let word = prop_oneof![
        8 => proptest::sample::select(names).prop_map(String::into_bytes),
        8 => (-20000..20000i32).prop_map(|n| n.to_string().into_bytes()),
        2 => (-2000.0..2000.0f64).prop_map(|n| format!("{n:.3}").into_bytes()),
        1 => Just(b"1e300".to_vec()),
        1 => Just(b"99999999999".to_vec()),
        6 => Just(b",".to_vec()),
        4 => Just(b";".to_vec()),
        1 => Just(b"\n".to_vec()),
        1 => Just(vec![3]),
        1 => Just(b"\"".to_vec()),
        1 => Just(b"\x1b%0B".to_vec()),
        1 => Just(b"\x1b%0A".to_vec()),
        1 => Just(b"\x1bE".to_vec()),
        1 => Just(b"\x1b.I81;;17:".to_vec()),
        1 => Just(b"\x1b%-12345X".to_vec()),
        1 => Just(b"@PJL ENTER LANGUAGE=HPGL2\n".to_vec()),
        1 => Just(b"\x1b*b3W".to_vec()),
        1 => proptest::collection::vec(any::<u8>(), 0..6),
    ];
    proptest::collection::vec(word, 0..60).prop_map(|words| words.concat())
}

fn any_file() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![4 => almost_hpgl(), 1 => proptest::collection::vec(any::<u8>(), 0..300)]
}

fn check(bytes: &[u8]) -> hpgl::Document {
    let options = Options::default();
    let document = read(bytes, &options);
    assert_eq!(document, interpret(&parse(bytes, &options), &options));
    assert!(!document.pages.is_empty());
    for stroke in document.pages.iter().flat_map(|page| &page.drawing.strokes) {
        assert!(stroke.pen.0 > 0);
        assert!(stroke.source().start < stroke.source().end && stroke.source().end <= bytes.len());
        assert!(stroke.vertices().iter().all(|p| p.x.is_finite() && p.y.is_finite()));
    }
    for diagnostic in &document.diagnostics {
        assert!(diagnostic.span.start <= diagnostic.span.end && diagnostic.span.end <= bytes.len());
        assert!(diagnostic.pen_position.x.is_finite() && diagnostic.pen_position.y.is_finite());
        assert!(diagnostic.count > 0);
    }
    for pair in document.diagnostics.windows(2) {
        assert!(pair[0].span.start <= pair[1].span.start);
    }
    document
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if cfg!(debug_assertions) { 500 } else { 20_000 }))]

    #[test]
    fn reading_any_bytes(bytes in any_file()) {
        check(&bytes);
    }

    #[test]
    fn reading_every_prefix(bytes in almost_hpgl()) {
        for end in 0..bytes.len().min(120) {
            check(&bytes[..end]);
        }
    }

    /// What is emitted reads back as what was emitted: the second time round nothing changes any
    /// more.
    #[test]
    fn emit_fixed_point(bytes in almost_hpgl()) {
        for encoding in [Encoding::Decimal, Encoding::Base64, Encoding::Base32] {
        let options = EmitOptions { encoding, ..EmitOptions::default() };
        for page in read(&bytes, &Options::default()).pages {
            let first = emit(&page.drawing, &options);
            let again = check(&first);
            prop_assert_eq!(&again.diagnostics, &[]);
            prop_assert_eq!(again.pages.len(), 1);
            let drawing = &again.pages[0].drawing;
            prop_assert_eq!(drawing.strokes.len(), page.drawing.strokes.len());
            prop_assert_eq!(drawing.pens(), page.drawing.pens());
            let second = emit(drawing, &options);
            prop_assert_eq!(String::from_utf8_lossy(&first), String::from_utf8_lossy(&second));
            let third = check(&second);
            prop_assert_eq!(drawing, &third.pages[0].drawing);
        }
        }
    }
}

#[test]
fn single_command_of_file_length() {
    let mut file = b"IN;SP1;PA0,0;PD".to_vec();
    for k in 0..100_000 {
        file.extend_from_slice(format!("{},{},", k % 1000, k / 1000).as_bytes());
    }
    let document = check(&file);
    assert_eq!(document.pages[0].drawing.strokes.len(), 1);
    // The first point is where the pen is already.
    assert_eq!(document.pages[0].drawing.strokes.to_vec()[0].segment_count(), 99_999);
    assert_eq!(document.summary.commands, 4);
}

/// Inputs that tempt a reader to look at the rest of the file again and again. Each is read in a
/// second or so in an unoptimised build where time follows length; where it follows its square, 4
/// MB take hours.
#[test]
fn linear_time() {
    let repeated = |unit: &[u8]| unit.repeat(2_000_000 / unit.len());
    for unit in [
        &b"LBhello;"[..],
        b"DT#LBa;DT!LBb;",
        b"LBa;PU1,1;",
        b"CO\"a;",
        b"BP1,\"a;",
        b"\x1bE",
        b"\x1bEIN;",
        b"\x1b.M",
        b"\x1b%0A\x1b%0B",
        b"PE\xc3\xbf",
        b"PEPE",
        b"ab",
        b"a b",
        b"\0",
        b"1\n",
        b"PD1\n2",
        b"1,",
        b"PM0;PM1;",
        b"@PJL \n",
    ] {
        let mut file = repeated(unit);
        check(&file);
        file.push(3);
        read(&file, &Options::default());
    }
}
