//! Formats of firmwares: what they write for a small plan, and that docs/formats.md shows it.

use backends::{Setpoint, Unrepresentable, WriteError, ebb, gcode};
use drawing::{Drawing, EllipticArc, Pen, Point, Span, Stroke};
use plan::Row;

/// Up to a stroke, along it, back: 50 ticks a mm, where seed 4's robot can go, too.
fn setpoints() -> Vec<Setpoint> {
    let rows = [
        (0, 0, [0, 5000]),
        (10_000, 0, [3, 4990]),
        (20_000, 0, [10, 4970]),
        (30_000, 1, [13, 4960]),
        (180_000, 1, [13, 4960]),
        (190_000, 1, [20, 4965]),
        (200_000, 1, [34, 4972]),
        (210_000, 0, [41, 4974]),
        (360_000, 0, [41, 4974]),
        (370_000, 0, [0, 5000]),
    ];
    rows.map(|(t_us, pen, ticks)| {
        let exact = ticks.map(|ticks: i64| ticks as f64 + 0.25);
        let at = Point::new(exact[0] / 50.0, exact[1] / 50.0);
        Setpoint { row: Row { t_us, pen, ticks }, exact, joints: [exact[0] / 1000.0, at.y], at }
    })
    .to_vec()
}

fn options(flavour: gcode::Flavour) -> gcode::Options {
    gcode::Options {
        flavour,
        pen: gcode::Pen::Servo { up: 40, down: 90 },
        pen_s: [0.15, 0.15],
        travel_mm_s: 80.0,
        chord_mm: 0.01,
    }
}

/// A line and an arc.
fn drawing() -> Drawing {
    let mut stroke = Stroke::new(Pen(1), Point::new(0.0, 0.0), Span::default());
    stroke.line_to(Point::new(20.0, 0.0));
    stroke.arc(EllipticArc::circular(Point::new(10.0, 0.0), 10.0, 0.0, 1.5 * std::f64::consts::PI));
    Drawing { strokes: vec![stroke] }
}

/// What each format writes, by its name.
fn written() -> Vec<(&'static str, String)> {
    let rows = || setpoints().into_iter().map(|setpoint| setpoint.row);
    let text = |write: &dyn Fn(&mut Vec<u8>) -> Result<(), WriteError>| {
        let mut bytes = Vec::new();
        write(&mut bytes).expect("a sound plan can be written");
        String::from_utf8(bytes).expect("text").replace('\r', "\r\n")
    };
    let arcs = |flavour| {
        let commands = gcode::commands(&drawing(), &[25.0], Point::ZERO, &options(flavour));
        text(&|out| gcode::write(&commands, out))
    };
    let corner = Point::new(0.0, 100.0);
    let timed = gcode::timed(setpoints(), &options(gcode::Flavour::Grbl), true);
    vec![
        ("coaxial-commands", text(&|out| backends::coaxial_commands::write(setpoints(), out))),
        (
            "coaxial-commands-inches",
            text(&|out| backends::coaxial_commands::write_inches(setpoints(), corner, out)),
        ),
        ("xy-serial", text(&|out| backends::xy_serial::write(setpoints(), out))),
        ("polar-csv", text(&|out| backends::polar_csv::write(setpoints(), out))),
        ("c-arrays", text(&|out| backends::c_arrays::write(setpoints(), out))),
        ("ebb", text(&|out| ebb::write(rows(), ebb::Moves::Timed, ebb::Pen::Toggle, out))),
        ("ebb-sm", text(&|out| ebb::write(rows(), ebb::Moves::Stepper, ebb::Pen::Toggle, out))),
        ("gcode-grbl", arcs(gcode::Flavour::Grbl)),
        ("gcode-fluidnc", arcs(gcode::Flavour::FluidNc)),
        ("gcode-marlin", arcs(gcode::Flavour::Marlin)),
        ("gcode-klipper", arcs(gcode::Flavour::Klipper)),
        ("gcode-timed", text(&|out| gcode::write(&timed, out))),
        ("klipper-steps", text(&|out| backends::klipper_steps::write(rows(), out))),
        (
            "joint-trajectory",
            text(&|out| backends::joint_trajectory::write(&setpoints(), ["theta", "r"], [true, false], out)),
        ),
        ("halstreamer", text(&|out| backends::halstreamer::write(setpoints(), 10_000, out))),
        ("pvt", text(&|out| backends::pvt::write(&setpoints(), ["a", "b"], out))),
    ]
}

#[test]
fn a_small_plan_in_the_words_of_every_firmware() {
    let all: Vec<String> = written()
        .into_iter()
        .map(|(name, text)| format!("== {name}\n{}", text.replace("\r\n", "\n")))
        .collect();
    insta::assert_snapshot!(all.join("\n"));
}

#[test]
fn the_documentation_shows_lines_that_are_written() {
    let specification = include_str!("../../../docs/formats.md");
    for (name, text) in written() {
        let row = specification.lines().find(|line| line.starts_with(&format!("| `{name}`")));
        let row = row.unwrap_or_else(|| panic!("docs/formats.md says nothing of {name}"));
        let example = row.trim_end_matches(['|', ' ']).rsplit(" | ").next().unwrap_or_default();
        let example = example.trim().trim_matches('`');
        assert!(
            text.lines().any(|line| line == example),
            "docs/formats.md: {name} does not write `{example}`:\n{text}"
        );
    }
}

#[test]
fn what_a_firmware_cannot_do_is_an_error() {
    let mut out = Vec::new();
    let far =
        setpoints().into_iter().map(|setpoint| Setpoint { at: Point::new(setpoint.at.x, 250.0), ..setpoint });
    let refused = backends::xy_serial::write(far, &mut out);
    assert!(
        matches!(refused, Err(WriteError::Unrepresentable(Unrepresentable::Range { row: 3, .. }))),
        "{refused:?}"
    );
    let near = setpoints().into_iter().map(|setpoint| Setpoint { at: Point::new(1.0, 20.0), ..setpoint });
    assert!(matches!(
        backends::c_arrays::write(near, &mut out),
        Err(WriteError::Unrepresentable(Unrepresentable::Range { .. }))
    ));
    let twice: Vec<Setpoint> = {
        let mut twice = setpoints();
        let later = setpoints().into_iter().skip(1);
        twice.extend(later.map(|i| Setpoint { row: Row { t_us: i.row.t_us + 370_000, ..i.row }, ..i }));
        twice
    };
    let refused = backends::polar_csv::write(twice, &mut out);
    assert!(
        matches!(refused, Err(WriteError::Unrepresentable(Unrepresentable::NoPenLift { strokes: 2, .. }))),
        "{refused:?}"
    );
    let fast = [(0, [0, 0]), (10_000, [250, 0])].map(|(t_us, ticks)| Row { t_us, pen: 0, ticks });
    let refused = ebb::write(fast, ebb::Moves::Timed, ebb::Pen::Toggle, &mut out);
    assert!(
        matches!(refused, Err(WriteError::Unrepresentable(Unrepresentable::TooFast { steps: 250, .. }))),
        "{refused:?}"
    );
    let refused = backends::halstreamer::write(setpoints(), 7000, &mut out);
    assert!(
        matches!(refused, Err(WriteError::Unrepresentable(Unrepresentable::Uneven { row: 1, .. }))),
        "{refused:?}"
    );
    assert!(out.is_empty(), "nothing is written of what is refused");
}
