//! Arbitrary bytes, bare and behind the first bytes of known formats: every file is either read as
//! the format that it was recognized as, or named as a foreign one; nothing panics.
#![no_main]

use compiler::import::{self, ImportError, Options};
use libfuzzer_sys::fuzz_target;

const BEGINNINGS: [&[u8]; 8] = [
    b"",
    b"%PDF-1.4\n",
    b"<?xml version='1.0'?>\n<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 9 9'>",
    b"\x1b%0BIN;",
    b"  0\nSECTION\n",
    b"%FSLAX24Y24*%\n",
    b"G21\nG90\n",
    b"/* points */ <1.5, 2.5>",
];

fuzz_target!(|bytes: &[u8]| {
    for beginning in BEGINNINGS {
        let file = [beginning, bytes].concat();
        let format = import::format(&file);
        match import::read(&file, &Options::default()) {
            Ok(document) => {
                assert_eq!(document.format, format);
                assert!(!document.pages.is_empty());
                for stroke in document.pages.iter().flat_map(|page| &page.drawing.strokes) {
                    assert!(stroke.length().is_finite());
                }
            }
            Err(ImportError::Foreign { what, help }) => assert!(!what.is_empty() && !help.is_empty()),
            Err(other) => panic!("options that were not given are refused: {other}"),
        }
    }
});
