//! Arbitrary bytes: parse and interpret never panic, and `read` equals `interpret(parse)`.
#![no_main]

use hpgl::{Options, interpret, parse, read};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let options = Options::default();
    let document = read(bytes, &options);
    assert_eq!(document, interpret(&parse(bytes, &options), &options));
    assert!(!document.pages.is_empty());
    for stroke in document.pages.iter().flat_map(|page| &page.drawing.strokes) {
        assert!(stroke.pen.0 > 0);
        assert!(stroke.source().end <= bytes.len());
        assert!(stroke.vertices().iter().all(|point| point.x.is_finite() && point.y.is_finite()));
    }
});
