//! Arbitrary bytes, bare and inside an `svg` element: reading never panics, and gives finite
//! strokes with pens.
#![no_main]

use libfuzzer_sys::fuzz_target;
use svg::{Hatch, Options, Pens, Point, StrokeFont, StrokeGlyph, read};

/// Every letter is one diagonal stroke.
#[derive(Debug)]
struct Diagonals;

impl StrokeFont for Diagonals {
    fn cap_height(&self) -> f64 {
        20.0
    }

    fn glyph(&self, character: char) -> Option<StrokeGlyph> {
        let strokes = vec![vec![Point::new(0.0, 0.0), Point::new(10.0, 20.0)]];
        character.is_ascii().then_some(StrokeGlyph { advance: 12.0, strokes })
    }
}

fuzz_target!(|bytes: &[u8]| {
    let hatch = Some(Hatch { spacing_mm: 1.0, angle_rad: 0.7 });
    let pens = if bytes.len() % 2 == 0 { Pens::Layers } else { Pens::Colors };
    for options in [
        Options { font: Some(&Diagonals), hatch, pens, ..Options::default() },
        Options { outline_fills: true, dpi: Some(72.0), ..Options::default() },
    ] {
        let wrapped = [
            b"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 100 100' stroke='red'>".as_slice(),
            bytes,
            b"</svg>",
        ]
        .concat();
        for file in [bytes, &wrapped] {
            let document = read(file, &options);
            for stroke in &document.drawing.strokes {
                assert!(stroke.pen.0 > 0);
                assert!(document.pens.contains_key(&stroke.pen));
                assert!(stroke.vertices().iter().all(|point| point.x.is_finite() && point.y.is_finite()));
                assert!(stroke.length().is_finite());
            }
            for found in &document.diagnostics {
                assert!(found.line > 0 && found.column > 0 && found.count > 0);
            }
        }
    }
});
