//! Arbitrary bytes: emitted HPGL reads back without diagnostics, and emits the same bytes again.
#![no_main]

use hpgl::{EmitOptions, Encoding, Options, emit, read};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let options = Options::default();
    for page in read(bytes, &options).pages {
        if page.drawing.strokes.len() > 10_000 {
            continue;
        }
        for encoding in [Encoding::Decimal, Encoding::Base64, Encoding::Base32] {
            let writing = EmitOptions { encoding, ..EmitOptions::default() };
            let first = emit(&page.drawing, &writing);
            let again = read(&first, &options);
            assert_eq!(again.diagnostics, []);
            assert_eq!(again.pages.len(), 1);
            assert_eq!(emit(&again.pages[0].drawing, &writing), first);
        }
    }
});
