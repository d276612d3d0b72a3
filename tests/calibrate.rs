//! `plotplan calibrate` on an arm that is not as its file says. The touches come from the equations of the
//! arm, written out here.

use std::fmt::Write as _;
use std::fs;

use compiler::machine_file::{MachineFile, PRESETS};
use kinematics::MotorPos;
use test_support::{Program, TestDir, stderr, stdout};

const PROGRAM: Program = Program::new(env!("CARGO_BIN_EXE_plotplan"));
const LETTER: [(f64, f64); 4] = [(0.0, 0.0), (215.9, 0.0), (215.9, 279.4), (0.0, 279.4)];
const TICKS_PER_RAD: f64 = 3200.0 / std::f64::consts::TAU;

/// Ticks of the hidden arm with the pen on a place of the sheet, which is turned by 2 degrees.
fn ticks((x, y): (f64, f64), left: bool) -> [f64; 2] {
    let (l1, l2) = (207.1, 254.8);
    let (sin, cos) = libm::sincos(2.0_f64.to_radians());
    let (x, y) = (20.0 + x * cos - y * sin, 85.0 + x * sin + y * cos);
    let c = (x * x + y * y - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
    let s = (1.0 - c * c).sqrt() * if left { -1.0 } else { 1.0 };
    let theta = libm::atan2(y, x) - libm::atan2(l2 * s, l1 + l2 * c);
    let psi = theta + libm::atan2(s, c);
    [(TICKS_PER_RAD * theta + 40.0).round(), (-TICKS_PER_RAD * psi + 760.0).round()]
}

fn rows(places: impl IntoIterator<Item = (f64, f64)>, left: bool) -> String {
    let row = |place| {
        let [a, b] = ticks(place, left);
        format!("{a},{b}\n")
    };
    places.into_iter().map(row).collect::<Vec<_>>().concat()
}

fn write(dir: &TestDir, name: &str, text: &str) {
    fs::write(dir.path().join(name), text).expect("a file");
}

#[test]
fn corners_make_a_machine_file_that_draws_where_it_should() {
    let dir = TestDir::new();
    write(&dir, "ticks.csv", &(rows(LETTER, true) + &rows(LETTER, false)));
    let output = PROGRAM.run(&dir, "calibrate coaxial ticks.csv --corners letter -o arm.toml");
    assert!(output.status.success(), "{}", stderr(&output));
    let report = stdout(&output);
    assert!(report.contains("expected page error") && report.contains("touch  8 at"), "{report}");
    let toml = fs::read_to_string(dir.path().join("arm.toml")).expect("a file");
    let machine = MachineFile::parse(&toml).and_then(|file| file.machine()).expect("a machine");
    for place in [(0.0, 0.0), (100.0, 50.0), (215.9, 279.4), (60.0, 200.0)] {
        let pen = machine.forward_from_motors(&MotorPos(ticks(place, true)));
        let sheet = machine.sheet();
        let off = libm::hypot(pen.x - sheet.x0 - place.0, pen.y - sheet.y0 - place.1);
        assert!(off < 0.6, "{off} mm at {place:?}");
    }
    // Comments and order stay.
    let lines = |text: &str| -> Vec<String> {
        text.lines().map(|line| line.split('=').next().unwrap_or("").trim().to_owned()).collect()
    };
    assert_eq!(lines(&toml), lines(PRESETS[0].toml));
    let comments = |text: &str| text.matches('#').count();
    assert_eq!(comments(&toml), comments(PRESETS[0].toml));
    // The numbers that the firmware starts with.
    let start = machine.motor_positions(&machine.start());
    assert!((start - MotorPos::new(800.0, 0.0)).norm() < 0.05, "{start:?}");
}

#[test]
fn wrong_readings_are_refused_and_named() {
    let dir = TestDir::new();
    let reversed: String =
        LETTER.map(|place| ticks(place, true)).map(|[a, b]| format!("{a},{}\n", -b)).concat();
    write(&dir, "sign.csv", &reversed);
    write(&dir, "order.csv", &rows([1, 0, 2, 3].map(|corner| LETTER[corner]), true));
    write(&dir, "elbow.csv", &rows(LETTER, false));
    write(&dir, "two.csv", "x_mm,y_mm,arm1,arm2\n0,0,100,200\n215.9,0,300,400\n");
    for (arguments, expected) in [
        ("sign.csv --corners letter", "motor arm2 counts the other way"),
        ("order.csv --corners letter", "in the order lower right, lower left, upper right, upper left"),
        ("elbow.csv --corners letter", "all touches were made with the elbow on the right"),
        ("two.csv", "4 equations do not determine 4 unknowns: a touch at"),
    ] {
        let output = PROGRAM.run(&dir, &format!("calibrate coaxial {arguments} -o new.toml"));
        assert_eq!(output.status.code(), Some(1), "{arguments}");
        assert!(stderr(&output).contains(expected), "{arguments}: {}", stderr(&output));
        assert!(!dir.path().join("new.toml").exists(), "{arguments}");
    }
}

/// The pattern is drawn by the nominal machine; the marks are measured where the hidden one put them.
#[test]
fn pattern_measured_with_a_ruler() {
    let dir = TestDir::new();
    let output = PROGRAM.run(&dir, "calibrate coaxial --pattern -o pattern.hpgl");
    assert!(output.status.success(), "{}", stderr(&output));
    let output = PROGRAM.run(&dir, "check pattern.hpgl --machine coaxial");
    assert!(output.status.success(), "{}", stderr(&output));
    let pattern = fs::read_to_string(dir.path().join("pattern.hpgl")).expect("a file");
    let preset = MachineFile::parse(PRESETS[0].toml).and_then(|file| file.machine()).expect("a machine");
    // The hidden arm is 0.8 degrees off at the start, the sheet where it should be.
    let mut drawn = String::from("mark,x_mm,y_mm\n");
    let mut marks = Vec::new();
    for (index, line) in
        pattern.lines().filter(|line| line.starts_with("PU") && line.contains("LB")).enumerate()
    {
        let numbers: Vec<f64> =
            line.split(|c: char| !c.is_ascii_digit()).filter_map(|word| word.parse().ok()).collect();
        let (x, y) = (0.025 * 0.5 * (numbers[0] + numbers[2]), 0.025 * numbers[1]);
        let sheet = preset.sheet();
        let pose =
            preset.pose_near((x + sheet.x0, y + sheet.y0).into(), &preset.start()).expect("within reach");
        let ticks = MotorPos(preset.motor_positions(&pose).0.map(f64::round));
        let pen = preset.forward_from_motors(&(ticks - MotorPos::new(7.0, -7.0)));
        writeln!(drawn, "{},{:.1},{:.1}", index + 1, pen.x - sheet.x0, pen.y - sheet.y0).expect("a string");
        marks.push(pen);
    }
    assert!(marks.len() >= 20, "{}", marks.len());
    write(&dir, "drawn.csv", &drawn);
    let output = PROGRAM.run(&dir, "calibrate coaxial --drawn drawn.csv --free pose -o arm.toml");
    assert!(output.status.success(), "{}", stderr(&output));
    let toml = fs::read_to_string(dir.path().join("arm.toml")).expect("a file");
    let machine = MachineFile::parse(&toml).and_then(|file| file.machine()).expect("a machine");
    let offsets = machine.motors().each_ref().map(|motor| motor.offset_ticks);
    assert!((offsets[0] - 7.0).abs() < 0.5 && (offsets[1] - 793.0).abs() < 0.5, "{offsets:?}");
    let distance = |a: usize, b: usize| {
        let between = marks[a - 1] - marks[b - 1];
        format!("{a},{b},{:.2}\n", libm::hypot(between.x, between.y))
    };
    let pairs: String = (2..=20).map(|mark| distance(1, mark) + &distance(mark, 21)).collect();
    write(&dir, "distances.csv", &pairs);
    let output = PROGRAM.run(&dir, "calibrate coaxial --distances distances.csv");
    assert!(output.status.success(), "{}", stderr(&output));
}
