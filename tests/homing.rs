//! `[homing]`: refused from an unknown state, homed by switches or by a confirmed pose, switches that fail.
#![cfg(unix)]

use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, Command, Output, Stdio};

use compiler::machine_file::PRESETS;
use test_support::{Program, TestDir, stderr, stdout};

const BINARY: &str = env!("CARGO_BIN_EXE_plotplan");
const PROGRAM: Program = Program::new(BINARY);

/// Report 3: left to its switch, 5 mm back, down to its switch, 5 mm back: that is 0, 0.
const SWITCHES: &str = r#"
[homing]
moves = [
    { joint = "x", towards = "left", speed = "-100mm/s", back_off = "5mm" },
    { joint = "y", towards = "bottom", speed = "-100mm/s", back_off = "5mm", slow_speed = "20mm/s" },
]
"#;
const POSE: &str = "\n[homing]\npose = \"move the pen to the lower left corner\"\n";

/// A folder with a machine that homes so, and a plan for it.
fn desk(preset: &str, homing: &str) -> TestDir {
    let dir = TestDir::new();
    let toml = PRESETS.iter().find(|other| other.name == preset).expect("a preset").toml;
    fs::write(dir.path().join("mine.toml"), format!("{toml}{homing}")).expect("a file");
    fs::write(dir.path().join("a.plt"), "IN;SP1;PU400,400;PD800,400,800,600;PU;").expect("a file");
    PROGRAM.succeed(&dir, "convert a.plt -m mine.toml -o a.ticks");
    dir
}

/// An emulated controller on the port `tty`.
struct Emulated(Child);

impl Emulated {
    fn start(dir: &TestDir, protocol: &str, options: &str) -> Self {
        let mut command = Command::new(BINARY);
        command.current_dir(dir.path()).args(["emulate", "--protocol", protocol, "--link", "tty"]);
        command
            .args(["-m", "mine.toml", "--speedup", "20", "--ink", "ink.csv"])
            .args(options.split_whitespace());
        let mut child = command.stdout(Stdio::piped()).spawn().expect("the program runs");
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("its output")).read_line(&mut line).expect("a line");
        Self(child)
    }

    /// Stops it and returns the number of rows of ink.
    fn ink(mut self, dir: &TestDir) -> usize {
        let id = self.0.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill runs").success());
        assert!(self.0.wait().expect("it ends").success());
        fs::read_to_string(dir.path().join("ink.csv")).expect("a table").lines().skip(1).count()
    }
}

impl Drop for Emulated {
    fn drop(&mut self) {
        let _ = self.0.kill();
    }
}

fn send(dir: &TestDir, protocol: &str, options: &str) -> Output {
    PROGRAM.run(dir, &format!("send a.ticks --protocol {protocol} --port tty -m mine.toml {options}"))
}

fn said(output: &Output) -> String {
    format!("{}{}", stdout(output), stderr(output))
}

#[test]
fn send_refuses_to_draw_from_an_unknown_state_and_homes_when_asked() {
    for protocol in ["ticks", "gcode"] {
        let dir = desk("cartesian", SWITCHES);
        let device = Emulated::start(&dir, protocol, "");
        let refused = send(&dir, protocol, "");
        assert_eq!(refused.status.code(), Some(2), "{protocol}: {}", said(&refused));
        let text = stderr(&refused);
        assert!(text.contains("--home") && text.contains("--assume-homed"), "{protocol}: {text}");
        let homed = send(&dir, protocol, "--home");
        assert!(homed.status.success(), "{protocol}: {}", said(&homed));
        assert!(stderr(&homed).contains("the machine is homed"), "{protocol}: {}", said(&homed));
        // Now it knows, and a second plan needs no homing.
        let again = send(&dir, protocol, "");
        assert!(again.status.success(), "{protocol}: {}", said(&again));
        assert!(device.ink(&dir) > 3, "{protocol}");
    }
}

#[test]
fn assumed_homing_is_what_the_user_answers_for() {
    // A reader without switches takes the place of the first line for its own.
    let dir = desk("cartesian", POSE);
    let device = Emulated::start(&dir, "ticks", "");
    assert_eq!(send(&dir, "ticks", "").status.code(), Some(2));
    let sent = send(&dir, "ticks", "--assume-homed");
    assert!(sent.status.success(), "{}", said(&sent));
    assert!(device.ink(&dir) > 3);
}

#[test]
fn pose_is_confirmed_by_the_operator() {
    // An EBB has no switches and cannot report a datum.
    let dir = desk("axidraw", POSE);
    let device = Emulated::start(&dir, "ebb", "");
    let refused = send(&dir, "ebb", "");
    assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
    assert!(stderr(&refused).contains("move the pen to the lower left corner"), "{}", said(&refused));
    let confirm = |keys: &str| {
        let mut command = Command::new(BINARY);
        command.current_dir(dir.path());
        command.args("send a.ticks --protocol ebb --port tty -m mine.toml --home".split(' '));
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program runs");
        child.stdin.take().expect("its input").write_all(keys.as_bytes()).expect("keys");
        child.wait_with_output().expect("it ends")
    };
    let silent = confirm("");
    assert_eq!(silent.status.code(), Some(2), "{}", said(&silent));
    let confirmed = confirm("\n");
    assert!(confirmed.status.success(), "{}", said(&confirmed));
    assert!(device.ink(&dir) > 3);
}

#[test]
fn broken_and_stuck_switches_end_homing_with_their_cause() {
    for (protocol, fault, cause) in [
        ("ticks", "switch-broken=0", "a switch did not close"),
        ("ticks", "switch-stuck=1", "did not open"),
        ("gcode", "switch-broken=1", "a switch did not close"),
        ("gcode", "switch-stuck=0", "did not open"),
    ] {
        let dir = desk("cartesian", SWITCHES);
        let device = Emulated::start(&dir, protocol, &format!("--fault {fault}"));
        let failed = send(&dir, protocol, "--home");
        assert_eq!(failed.status.code(), Some(3), "{protocol} {fault}: {}", said(&failed));
        assert!(stderr(&failed).contains(cause), "{protocol} {fault}: {}", said(&failed));
        // The datum stays unknown.
        assert_eq!(send(&dir, protocol, "").status.code(), Some(2), "{protocol} {fault}");
        assert_eq!(device.ink(&dir), 0, "{protocol} {fault}");
    }
}

#[test]
fn switch_hit_while_drawing_stops_and_makes_the_datum_invalid() {
    for protocol in ["ticks", "gcode"] {
        let dir = desk("cartesian", SWITCHES);
        // A drawing of many seconds; the switch closes in the middle of it.
        let long = "IN;SP1;PU400,400;PD8000,400,8000,8000,400,8000,400,400,8000,8000;PU;";
        fs::write(dir.path().join("long.plt"), long).expect("a file");
        PROGRAM.succeed(&dir, "convert long.plt -m mine.toml -o a.ticks");
        let device = Emulated::start(&dir, protocol, "--homed --fault limit=12s");
        let stopped = send(&dir, protocol, "");
        assert!(!stopped.status.success(), "{protocol}: {}", said(&stopped));
        let unknown = send(&dir, protocol, "");
        assert_eq!(unknown.status.code(), Some(2), "{protocol}: {}", said(&unknown));
        let homed = send(&dir, protocol, "--home");
        assert!(homed.status.success(), "{protocol}: {}", said(&homed));
        drop(device);
    }
}

#[test]
fn files_of_g_code_begin_with_homing_where_the_machine_has_switches() {
    let dir = desk("cartesian", SWITCHES);
    let head = |format: &str| {
        let text = PROGRAM.stdout_of(&dir, &format!("convert a.plt -m mine.toml --format {format} -o -"));
        text.lines().filter(|line| !line.starts_with(';')).take(2).collect::<Vec<_>>().join("|")
    };
    assert_eq!(head("gcode-grbl"), "$H|G10 L20 P1 X0 Y0");
    assert_eq!(head("gcode-timed"), "$H|G10 L20 P1 X0 Y0");
    assert_eq!(head("gcode-marlin"), "G28 X Y|G92 X0 Y0");
    assert_eq!(head("gcode-klipper"), "G28 X Y|G92 X0 Y0");
    let plain = PROGRAM.stdout_of(&dir, "convert a.plt -m cartesian --format gcode-marlin -o -");
    assert!(!plain.contains("G28"), "{plain}");
}

#[test]
fn firmware_header_moves_coupled_motors_together() {
    let dir = desk("corexy", SWITCHES.replace("back_off", "travel = \"200mm\", back_off").as_str());
    let header = PROGRAM.stdout_of(&dir, "machine show mine.toml --firmware-config dc");
    // A = X + Y, B = X - Y at 92.03 counts/mm: left is both motors backwards, down is A backwards, B forwards.
    // 100 mm/s are 109 us a count; 5 mm are 461 counts; 1.5 times 200 mm are 27,610, rounded up.
    assert!(header.contains("{true, 0, {-1, -1}, 109, 1087, 461, 27610, 0}"), "{header}");
    assert!(header.contains("{true, 1, {-1, 1}, 109, 543, 461, 27610, 0}"), "{header}");
    assert!(header.contains("/* .must_home */ true"), "{header}");
    let plain = PROGRAM.stdout_of(&dir, "machine show corexy --firmware-config dc");
    assert!(plain.contains("/* .must_home */ false"), "{plain}");
}

#[test]
fn mechanical_stops_home_and_fail_with_their_cause() {
    let stop = SWITCHES.replace("\"left\"", "\"stop\"");
    let dir = desk("cartesian", &stop);
    let checked = PROGRAM.run(&dir, "machine check mine.toml");
    assert!(!said(&checked).contains("stop"), "{}", said(&checked));
    for protocol in ["ticks", "gcode"] {
        let device = Emulated::start(&dir, protocol, "");
        let refused = send(&dir, protocol, "");
        assert_eq!(refused.status.code(), Some(2), "{protocol}: {}", said(&refused));
        let homed = send(&dir, protocol, "--home");
        assert!(homed.status.success(), "{protocol}: {}", said(&homed));
        assert!(device.ink(&dir) > 0, "{protocol}");
    }
    for (fault, cause) in [
        ("switch-broken=0", "no stop was felt within the travel"),
        ("switch-stuck=0", "did not come away from it"),
    ] {
        let device = Emulated::start(&dir, "ticks", &format!("--fault {fault}"));
        let failed = send(&dir, "ticks", "--home");
        assert_eq!(failed.status.code(), Some(3), "{fault}: {}", said(&failed));
        assert!(stderr(&failed).contains(cause), "{fault}: {}", said(&failed));
        assert_eq!(send(&dir, "ticks", "").status.code(), Some(2), "{fault}");
        assert_eq!(device.ink(&dir), 0, "{fault}");
    }
}

#[test]
fn firmware_header_of_mechanical_stops() {
    let stop = SWITCHES.replace("\"left\"", "\"stop\"").replace("back_off", "travel = \"200mm\", back_off");
    let dir = desk("cartesian", &stop);
    let header =
        |drive: &str| PROGRAM.stdout_of(&dir, &format!("machine show mine.toml --firmware-config {drive}"));
    // 80 ticks/mm at 100 mm/s are 125 us a tick; 5 mm are 400 ticks. A stepper makes 205 mm, 16,400 ticks, in any case.
    let step = header("step");
    assert!(step.contains("{true, PLOTPLAN_STOP, {-1, 0}, 125, 1250, 400, 16400, 0}"), "{step}");
    assert!(step.contains("{true, 0, {0, -1}, 125, 625, 400, 24000, 0}"), "{step}");
    assert!(step.contains("/* .limits_used, .stop_used */ true, false"), "{step}");
    // 8 % of stiction, 8000 ticks/s of 106.67 for each percent, and 10 %: 93 %, 744 of 800.
    let dc = header("dc");
    assert!(dc.contains("{true, PLOTPLAN_STOP, {-1, 0}, 125, 1250, 400, 24000, 744}"), "{dc}");
    let servo = PROGRAM.fail(&dir, "machine show mine.toml --firmware-config servo", 2);
    assert!(servo.contains("RC servo"), "{servo}");
    let both = stop.replace("\"bottom\"", "\"stop\"").replace("back_off = \"5mm\"", "back_off = \"0.5mm\"");
    let dir = desk("cartesian", &both);
    let step = PROGRAM.stdout_of(&dir, "machine show mine.toml --firmware-config step");
    assert!(step.contains("/* .limits_used, .stop_used */ false, false"), "{step}");
    let short = PROGRAM.fail(&dir, "machine show mine.toml --firmware-config dc", 2);
    assert!(short.contains("back_off"), "{short}");
}

#[test]
fn impossible_homing_is_an_error_that_names_the_key() {
    let dir = TestDir::new();
    let toml = PRESETS.iter().find(|other| other.name == "corexy").expect("a preset").toml;
    let mv = |rest: &str| format!("[homing]\nmoves = [{{ towards = \"left\", {rest} }}]\n");
    let mut all = String::new();
    for homing in [
        "[homing]\n".to_owned(),
        "[homing]\npose = \"left\"\nmoves = []\n".to_owned(),
        "[homing]\nmoves = []\n".to_owned(),
        mv("joint = \"z\", speed = \"-50mm/s\", back_off = \"5mm\""),
        mv("joint = \"x\", motor = \"A\", speed = \"-50mm/s\", back_off = \"5mm\""),
        mv("joint = \"x\", speed = \"-50deg/s\", back_off = \"5mm\", travel = \"200mm\""),
        mv("joint = \"x\", speed = \"0mm/s\", back_off = \"5mm\", travel = \"200mm\""),
        mv("motor = \"A\", speed = \"-50mm/s\", back_off = \"5mm\""),
        mv("joint = \"x\", speed = \"-50mm/s\", back_of = \"5mm\", travel = \"200mm\""),
    ] {
        fs::write(dir.path().join("wrong.toml"), format!("{toml}\n{homing}")).expect("a file");
        let output = PROGRAM.run(&dir, "machine check wrong.toml");
        assert_eq!(output.status.code(), Some(2), "{homing}: {}", said(&output));
        let _ = writeln!(all, "{homing}--\n{}", stderr(&output));
    }
    insta::assert_snapshot!(all);
}

#[test]
fn calibrated_files_say_so() {
    let dir = desk("cartesian", &SWITCHES.replace("[homing]", "[homing]\ncalibrated = true"));
    let device = Emulated::start(&dir, "ticks", "--homed");
    let sent = send(&dir, "ticks", "");
    assert!(stderr(&sent).contains("the machine is calibrated"), "{}", said(&sent));
    drop(device);
}
