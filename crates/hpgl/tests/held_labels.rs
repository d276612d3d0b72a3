//! Labels that a drawing holds as text have the strokes of labels drawn letter by letter, bit for bit.

use drawing::Point;
use hpgl::{Options, read};
use proptest::prelude::*;

/// A control character that prints nothing: a label with it is drawn letter by letter.
const NOTHING: char = '\u{1}';

/// The points of all strokes, as bits.
fn points(commands: &str) -> Vec<Vec<[u64; 2]>> {
    let document = read(commands.as_bytes(), &Options::default());
    let bits = |point: Point| [point.x.to_bits(), point.y.to_bits()];
    let strokes = document.pages.iter().flat_map(|page| &page.drawing.strokes);
    strokes.map(|stroke| stroke.points().map(bits).collect()).collect()
}

fn setting() -> impl Strategy<Value = String> {
    let number = -3.0..3.0_f64;
    prop_oneof![
        (0.05..0.8_f64, 0.05..0.8_f64).prop_map(|(w, h)| format!("SI{w:.3},{h:.3};")),
        (number.clone(), number.clone()).prop_map(|(run, rise)| format!("DI{run:.2},{rise:.2};")),
        number.clone().prop_map(|slant| format!("SL{slant:.2};")),
        (-0.5..1.0_f64, -0.5..1.0_f64).prop_map(|(x, y)| format!("ES{x:.2},{y:.2};")),
        (0..4).prop_map(|path| format!("DV{path};")),
        (1..20).prop_map(|origin| format!("LO{origin};")),
        Just("SD2,1;".to_owned()),
        Just("SC0,1000,0,700;".to_owned()),
        (0..4).prop_map(|quarter| format!("RO{};", 90 * quarter)),
        Just("IW2000,2000,7000,6000;".to_owned()),
        Just("LT2;".to_owned()),
    ]
}

proptest! {
    #[test]
    fn held_label_has_the_strokes_of_its_letters(
        settings in prop::collection::vec(setting(), 0..5),
        (x, y) in (0..10_000, 0..7500),
        text in "[ -~äöüÅñ°€Ω]{0,12}",
        next in "[ -~]{0,5}",
    ) {
        let draw = |end: &str| {
            format!("IN;SP1;{}PA{x},{y};LB{text}{end}\u{3}PD{y},{x};PU;LB{next}{end}\u{3}", settings.concat())
        };
        prop_assert_eq!(points(&draw("")), points(&draw(&NOTHING.to_string())));
    }
}

#[test]
fn label_without_extent_is_drawn() {
    for settings in ["SI1e-9,1e-9;", "SI0.2,1e-12;", "SC0,1,0,1e30;SI0.1,0.1;"] {
        let draw = |end: &str| format!("IN;SP1;{settings}PA1000,1000;LBPlan{end}\u{3}");
        assert_eq!(points(&draw("")), points(&draw(&NOTHING.to_string())), "{settings}");
    }
}
