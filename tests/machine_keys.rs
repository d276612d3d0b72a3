//! Keys of machine files, from the file to what is written: the pen's servo, offsets of pens, backlash.

use std::fmt::Write as _;
use std::fs;

use compiler::machine_file::PRESETS;
use test_support::{Program, TestDir, stderr, stdout};

const PROGRAM: Program = Program::new(env!("CARGO_BIN_EXE_plotplan"));

/// A preset with a line replaced, as a file.
fn machine(dir: &TestDir, file: &str, preset: &str, from: &str, to: &str) {
    let toml = PRESETS.iter().find(|other| other.name == preset).expect("a preset").toml;
    assert!(toml.contains(from), "{from}");
    fs::write(dir.path().join(file), toml.replacen(from, to, 1)).expect("a file");
}

const PULSES: &str = "[pen]\nservo = { up = \"1200us\", down = \"1.5ms\" }";
const ANGLES: &str = "[pen]\nservo = { up = \"70deg\", down = \"40deg\", pulses = [\"610us\", \"2360us\"], range = \"189.5deg\" }";

#[test]
fn pen_servo_of_the_machine_file_reaches_every_format_with_a_servo() {
    let dir = TestDir::new();
    fs::write(dir.path().join("a.plt"), "IN;SP1;PU1000,1000;PD2000,1000;PU;").unwrap();
    machine(&dir, "pulses.toml", "axidraw", "[pen]", PULSES);
    machine(&dir, "angles.toml", "axidraw", "[pen]", ANGLES);
    let converted = |file: &str, format: &str| {
        PROGRAM.stdout_of(&dir, &format!("convert a.plt -m {file}.toml --format {format} -o - --fit"))
    };
    for (format, up, down) in [
        ("ebb", "S2,14400,4,0,", "S2,18000,4,0,"),
        ("ebb-sm", "S2,14400,4,0,", "S2,18000,4,0,"),
        ("gcode-klipper", "SET_SERVO SERVO=pen WIDTH=0.001200\n", "SET_SERVO SERVO=pen WIDTH=0.001500\n"),
        ("gcode-marlin", "M280 P0 S1200\n", "M280 P0 S1500\n"),
        ("gcode-grbl", "M3 S1200\n", "M3 S1500\n"),
        ("gcode-fluidnc", "M3 S1200\n", "M3 S1500\n"),
        ("gcode-timed", "M3 S1200\n", "M3 S1500\n"),
    ] {
        let text = converted("pulses", format);
        assert!(text.contains(up) && text.contains(down), "{format}: {text}");
    }
    // p = 610 + 1750 a / 189.5
    for (format, up, down) in [
        ("ebb", "S2,15077,4,0,", "S2,11753,4,0,"),
        ("gcode-klipper", "WIDTH=0.001256\n", "WIDTH=0.000979\n"),
        ("gcode-marlin", "M280 P0 S1256\n", "M280 P0 S979\n"),
        ("gcode-grbl", "M3 S70\n", "M3 S40\n"),
    ] {
        let text = converted("angles", format);
        assert!(text.contains(up) && text.contains(down), "{format}: {text}");
    }
    // What the command line states goes before.
    let line = "convert a.plt -m pulses.toml --format gcode-grbl --pen-positions 10,20 -o - --fit";
    assert!(PROGRAM.stdout_of(&dir, line).contains("M3 S20\n"));

    machine(&dir, "arm.toml", "coaxial", "[pen]", PULSES);
    let header = PROGRAM.stdout_of(&dir, "machine show arm.toml --firmware-config servo");
    assert!(header.contains("{PEN_SERVO, 1200, 1500}"), "{header}");
    let module = PROGRAM.stdout_of(&dir, "machine show arm.toml --firmware-config micropython");
    assert!(module.contains("PEN_UP_US = 1200\nPEN_DOWN_US = 1500\n"), "{module}");
    let checked = PROGRAM.stdout_of(&dir, "machine check angles.toml");
    assert!(checked.contains("pen servo: 1256.4 us up, 979.4 us down"), "{checked}");
}

#[test]
fn impossible_pens_and_backlash_are_errors_that_name_the_key() {
    let dir = TestDir::new();
    let mut said = String::new();
    for (from, to) in [
        ("[pen]", "[pen]\nservo = { up = \"1200us\" }"),
        ("[pen]", "[pen]\nservo = { up = \"40deg\", down = \"1500us\" }"),
        ("[pen]", "[pen]\nservo = { up = \"9ms\", down = \"1500us\" }"),
        (
            "[pen]",
            "[pen]\nservo = { up = \"200deg\", down = \"40deg\", pulses = [\"610us\", \"2360us\"], range = \"189.5deg\" }",
        ),
        (
            "[pen]",
            "[pen]\nservo = { up = \"40deg\", down = \"1500us\", pulses = [\"610us\", \"2360us\"], range = \"189.5deg\" }",
        ),
        ("[pen]", "[pen]\nservo = { up = \"40deg\", down = \"30deg\", range = \"189.5deg\" }"),
        ("[pen]", "[pen]\nservo = { up = 1200, down = 1500 }"),
        ("[pen]", "[pen]\noffset = { 2 = [\"20mm\", \"0mm\"] }"),
        ("[pen]", "[pen]\noffset = { red = [\"20mm\", \"0mm\"] }"),
        ("offset = 0\n", "offset = 0\nbacklash = -3\n"),
        ("offset = 0\n", "offset = 0\nbacklash = \"3mm\"\n"),
    ] {
        machine(&dir, "wrong.toml", "coaxial", from, to);
        let output = PROGRAM.run(&dir, "machine check wrong.toml");
        assert!(!output.status.success(), "{to}: {}", stdout(&output));
        let _ = writeln!(said, "{to}\n--\n{}", stderr(&output));
    }
    insta::assert_snapshot!(said);
}

#[test]
fn pen_with_an_offset_is_drawn_where_the_drawing_has_it() {
    let dir = TestDir::new();
    let drawing = "IN;SP1;PU2000,2000;PD4000,2000;PU;SP2;PU2000,3000;PD4000,3000;PU;SP0;";
    fs::write(dir.path().join("a.plt"), drawing).unwrap();
    machine(&dir, "two.toml", "cartesian", "[pen]", "[pen]\noffset = { 2 = [\"20mm\", \"-5mm\"] }");
    PROGRAM.succeed(&dir, "convert a.plt -m two.toml --order file -o a.csv");
    let csv = fs::read_to_string(dir.path().join("a.csv")).unwrap();
    // Ticks with each pen down: 80 a mm; 2000 units are 50 mm.
    let span = |pen: &str| {
        let rows = csv.lines().filter(|line| line.split(',').nth(1) == Some(pen));
        let ticks: Vec<[i64; 2]> = rows
            .map(|row| {
                let mut values = row.split(',').skip(2).map(|value| value.parse().expect("ticks"));
                [values.next().expect("x"), values.next().expect("y")]
            })
            .collect();
        [
            ticks.iter().map(|at| at[0]).min().unwrap(),
            ticks.iter().map(|at| at[0]).max().unwrap(),
            ticks[0][1],
        ]
    };
    let [left, right, y] = span("1");
    let [left_2, right_2, y_2] = span("2");
    assert_eq!([left_2 - left, right_2 - right, y_2 - y], [-1600, -1600, 2000 + 400]);
    // Verified against the drawing, and shown where the ink is.
    PROGRAM.succeed(&dir, "verify a.csv --drawing a.plt --machine two.toml");
    PROGRAM.succeed(&dir, "preview a.csv --machine two.toml -o a.svg");
    machine(&dir, "one.toml", "cartesian", "[pen]", "[pen]");
    let plain = PROGRAM.run(&dir, "verify a.csv --drawing a.plt --machine one.toml");
    assert!(!plain.status.success(), "ink is 20 mm off without the offset");
    // Where pen 2 is right of the sheet's edge, the mechanism still reaches it.
    fs::write(dir.path().join("edge.plt"), "IN;SP2;PU11900,2000;PD12000,3000;PU;SP0;").unwrap();
    PROGRAM.succeed(&dir, "convert edge.plt -m two.toml -o edge.csv");
    // And the other way round: left of 20 mm it cannot.
    fs::write(dir.path().join("left.plt"), "IN;SP2;PU100,2000;PD400,3000;PU;SP0;").unwrap();
    PROGRAM.fail(&dir, "convert left.plt -m two.toml -o left.csv", 1);
}

#[test]
fn backlash_of_the_machine_file_is_planned_and_verified() {
    let dir = TestDir::new();
    fs::write(dir.path().join("a.plt"), "IN;SP1;PU2000,2000;CI500;PU;").unwrap();
    let toml = PRESETS.iter().find(|other| other.name == "cartesian").expect("a preset").toml;
    let with = toml.replace("max_acceleration =", "backlash = 30\nmax_acceleration =");
    fs::write(dir.path().join("loose.toml"), with).unwrap();
    let checked = PROGRAM.stdout_of(&dir, "machine check loose.toml");
    assert_eq!(checked.matches("backlash of 30 ticks").count(), 2, "{checked}");
    PROGRAM.succeed(&dir, "convert a.plt -m loose.toml -o a.json");
    PROGRAM.succeed(&dir, "verify a.json --drawing a.plt");
    // The same rows on the machine without backlash, and rows without lead on the one with it.
    PROGRAM.fail(&dir, "verify a.json --drawing a.plt --machine cartesian", 1);
    PROGRAM.succeed(&dir, "convert a.plt -m cartesian -o b.csv");
    PROGRAM.fail(&dir, "verify b.csv --drawing a.plt --machine loose.toml", 1);
    // Without a drawing the plan is compared with its own ink.
    PROGRAM.succeed(&dir, "verify a.json");
    // Where the firmware plans the motion there is no compensation.
    for (format, warns) in [("gcode-grbl", true), ("gcode-marlin", true), ("gcode-timed", false)] {
        let converted = PROGRAM.run(&dir, &format!("convert a.plt -m loose.toml --format {format} -o -"));
        assert!(converted.status.success(), "{format}: {}", stderr(&converted));
        assert_eq!(stderr(&converted).contains("backlash"), warns, "{format}: {}", stderr(&converted));
    }
    let without = PROGRAM.run(&dir, "convert a.plt -m cartesian --format gcode-grbl -o -");
    assert!(!stderr(&without).contains("backlash"), "{}", stderr(&without));
}

/// A circle of 12.5 mm.
#[test]
fn heat_maps_show_the_ink_of_a_machine_with_backlash() {
    let dir = TestDir::new();
    // In the middle of the table, as large as it is drawn.
    fs::write(dir.path().join("a.plt"), "IN;SP1;PU6000,6000;CI500;PU;").unwrap();
    let toml = PRESETS.iter().find(|other| other.name == "cartesian").expect("a preset").toml;
    // 4 mm: the motors are 2 mm ahead.
    let with = toml.replace("max_acceleration =", "backlash = 320\nmax_acceleration =");
    fs::write(dir.path().join("loose.toml"), with).unwrap();
    PROGRAM.succeed(&dir, "convert a.plt -m loose.toml -o a.json");
    let svg = PROGRAM.stdout_of(&dir, "preview a.json --color-by order --format svg -o -");
    let mut points = 0;
    for line in svg.lines().filter(|line| line.contains("class=\"colored\"")) {
        let list = line.split(" d=\"M").nth(1).and_then(|rest| rest.split('"').next()).expect("a path");
        let numbers: Vec<f64> =
            list.split([' ', 'L']).map(|number| number.parse().expect("a number")).collect();
        for pair in numbers.chunks_exact(2) {
            points += 1;
            // y points down in a picture.
            let radius = libm::hypot(pair[0] - 150.0, pair[1] + 150.0);
            assert!((radius - 12.5).abs() < 0.15, "{pair:?} is {radius} mm from the middle");
        }
    }
    assert!(points > 50, "{points} points: {}", &svg[..svg.len().min(3000)]);
}

#[test]
fn every_preset_writes_every_plan_file() {
    let dir = TestDir::new();
    fs::write(dir.path().join("a.plt"), "IN;SP1;PU400,400;PD800,400;PU;").unwrap();
    for preset in PRESETS {
        for file in ["a.ticks", "a.csv", "a.json"] {
            PROGRAM.succeed(&dir, &format!("convert a.plt -m {} --fit -o {file}", preset.name));
        }
    }
}
