//! `plotplan jog --commands` on the emulated controllers.
#![cfg(unix)]

use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Output, Stdio};

use compiler::machine_file::{MachineFile, PRESETS};
use kinematics::{Machine, MotorPos};
use test_support::{Program, TestDir, stderr, stdout};

const BINARY: &str = env!("CARGO_BIN_EXE_plotplan");
const PROGRAM: Program = Program::new(BINARY);

struct Emulated(Child);

impl Emulated {
    fn start(dir: &TestDir, protocol: &str, machine: &str, options: &str) -> Self {
        let mut command = Command::new(BINARY);
        command.current_dir(dir.path()).args(["emulate", "--protocol", protocol, "--link", "tty"]);
        command.args(["-m", machine, "--speedup", "20", "--ink", "ink.csv"]).args(options.split_whitespace());
        let mut child = command.stdout(Stdio::piped()).spawn().expect("the program runs");
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("its output")).read_line(&mut line).expect("a line");
        Self(child)
    }

    /// Stops it and returns its ink.
    fn ink(mut self, dir: &TestDir) -> String {
        let id = self.0.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill runs").success());
        assert!(self.0.wait().expect("it ends").success());
        fs::read_to_string(dir.path().join("ink.csv")).expect("a table")
    }
}

impl Drop for Emulated {
    fn drop(&mut self) {
        let _ = self.0.kill();
    }
}

fn machine(name: &str) -> Machine {
    let preset = PRESETS.iter().find(|preset| preset.name == name).expect("a preset");
    MachineFile::parse(preset.toml).and_then(|file| file.machine()).expect("a machine")
}

fn jog(dir: &TestDir, protocol: &str, machine: &str, script: &str, options: &str) -> Output {
    fs::write(dir.path().join("script"), script).expect("a file");
    PROGRAM
        .run(dir, &format!("jog --protocol {protocol} --port tty -m {machine} --commands script {options}"))
}

/// The place in a line such as `left 10: 12.70, 76.20 mm; ...`.
fn place(line: &str) -> [f64; 2] {
    let text = line.split_once(": ").expect("a place").1.split(" mm").next().expect("mm");
    let (x, y) = text.split_once(", ").expect("two lengths");
    [x.parse().expect("x"), y.parse().expect("y")]
}

fn ticks(line: &str) -> MotorPos {
    let text = line.split("mm; ").nth(1).expect("ticks");
    let numbers: Vec<f64> = text.split([' ', ',']).filter_map(|word| word.parse().ok()).collect();
    MotorPos::new(numbers[0], numbers[1])
}

#[test]
fn jogging_moves_the_pen_by_steps_on_every_controller_that_reports_its_position() {
    for (protocol, name) in [
        ("ticks", "coaxial"),
        ("ticks", "polar"),
        ("gcode", "cartesian"),
        ("ebb", "axidraw"),
        ("ticks", "five-bar"),
    ] {
        let dir = TestDir::new();
        let device = Emulated::start(&dir, protocol, name, "");
        let script = "goto 40 40\nright 10mm\nstep 0.1\nup\nup\nup # three steps of 0.1\nmotor 1 5\nwhere\n";
        let output = jog(&dir, protocol, name, script, "");
        assert!(output.status.success(), "{protocol} {name}: {}{}", stdout(&output), stderr(&output));
        let text = stdout(&output);
        let lines: Vec<&str> = text.lines().collect();
        let machine = machine(name);
        let sheet = machine.sheet();
        let near = |line: &str, [x, y]: [f64; 2]| {
            let at = place(line);
            let off = libm::hypot(at[0] - sheet.x0 - x, at[1] - sheet.y0 - y);
            let tick_mm = machine.quantization_error(&machine.joint_positions(&ticks(line)));
            assert!(off <= tick_mm + 0.011, "{protocol} {name}: {line}: {off} mm off");
        };
        near(lines[0], [40.0, 40.0]);
        near(lines[1], [50.0, 40.0]);
        // Rounding to ticks does not add up.
        near(lines[5], [50.0, 40.3]);
        let turned = ticks(lines[6]) - ticks(lines[5]);
        assert_eq!((turned[0], turned[1]), (5.0, 0.0), "{protocol} {name}");
        // What the machine reports is where it was sent.
        let off = ticks(lines[7]) - ticks(lines[6]);
        assert!(off.max_abs() <= 2.0, "{protocol} {name}: {text}");
        drop(device);
    }
}

#[test]
fn jog_never_leaves_the_reach() {
    for (protocol, name) in
        [("ticks", "coaxial"), ("gcode", "cartesian"), ("ebb", "axidraw"), ("ticks", "polar")]
    {
        let dir = TestDir::new();
        let device = Emulated::start(&dir, protocol, name, "");
        let machine = machine(name);
        // Into each direction until it is refused, and far beyond it.
        let mut script = "goto 60 60\n".to_owned();
        for direction in ["left", "right", "up", "down"] {
            script += "goto 60 60\n";
            for _ in 0..12 {
                let _ = writeln!(script, "{direction} 50");
            }
            let _ = writeln!(script, "{direction} 5000");
        }
        script += "motor 1 1000000\nmotor 2 -1000000\nwhere\n";
        let output = jog(&dir, protocol, name, &script, "");
        assert_eq!(
            output.status.code(),
            Some(1),
            "{protocol} {name}: {}{}",
            stdout(&output),
            stderr(&output)
        );
        let text = stdout(&output);
        let mut refused = 0;
        for line in text.lines() {
            if line.contains("refused: ") {
                refused += 1;
                continue;
            }
            let pen = machine.forward_from_motors(&ticks(line));
            let floor_mm = machine.quantization_error(&machine.joint_positions(&ticks(line)));
            // Whole ticks may lie beyond the edge by their rounding.
            let inside = (0..16).any(|k| {
                let (sin, cos) = libm::sincos(f64::from(k) * std::f64::consts::TAU / 16.0);
                let nudged = pen + floor_mm * drawing::Vec2::new(cos, sin);
                machine.check_point(nudged).is_ok()
            });
            assert!(inside || machine.check_point(pen).is_ok(), "{protocol} {name}: {line}");
        }
        assert!(refused >= 6, "{protocol} {name}: {text}");
        drop(device);
    }
}

#[test]
fn pen_goes_down_and_up_and_travels_up() {
    for (protocol, name) in [("ticks", "coaxial"), ("gcode", "cartesian"), ("ebb", "axidraw")] {
        let dir = TestDir::new();
        let device = Emulated::start(&dir, protocol, name, "");
        let output =
            jog(&dir, protocol, name, "goto 50 50\npen up\npen down\npen up\npen down\nright 20\n", "");
        assert!(output.status.success(), "{protocol}: {}{}", stdout(&output), stderr(&output));
        let text = stdout(&output);
        let downs = text.lines().filter(|line| line.ends_with("pen down")).count();
        assert_eq!(downs, 2, "{text}");
        let ink = device.ink(&dir);
        // Two dots: no ink between them and the end of the way.
        let mut places: Vec<&str> =
            ink.lines().skip(1).map(|row| row.splitn(3, ',').nth(2).expect("x,y")).collect();
        places.dedup();
        assert_eq!(places.len(), 1, "{protocol}: {ink}");
    }
}

#[test]
fn touches_are_a_file_that_calibrate_takes() {
    let dir = TestDir::new();
    let device = Emulated::start(&dir, "ticks", "coaxial", "");
    let script = "corner ll\ntouch\ncorner lr\ntouch\ncorner ur\ntouch\ncorner ul\ntouch\ngoto 100 100\ntouch 100 100\n";
    let output = jog(&dir, "ticks", "coaxial", script, "--touches touches.csv");
    assert!(output.status.success(), "{}{}", stdout(&output), stderr(&output));
    let touches = fs::read_to_string(dir.path().join("touches.csv")).expect("a file");
    assert_eq!(touches.lines().count(), 6, "{touches}");
    assert!(touches.starts_with("x_mm,y_mm,arm1,arm2\n0,0,"), "{touches}");
    let calibrated = PROGRAM.run(&dir, "calibrate coaxial touches.csv -o arm.toml");
    assert!(calibrated.status.success(), "{}", stderr(&calibrated));
    let without = jog(&dir, "ticks", "coaxial", "corner ll\ntouch\n", "");
    assert!(stdout(&without).contains("--touches"), "{}", stdout(&without));
    drop(device);
}

#[test]
fn wrong_scripts_and_protocols_without_positions_are_refused() {
    let dir = TestDir::new();
    let device = Emulated::start(&dir, "ticks", "coaxial", "");
    let wrong = jog(&dir, "ticks", "coaxial", "goto 50 50\njump\n", "");
    assert_eq!(wrong.status.code(), Some(2), "{}", stderr(&wrong));
    assert!(stderr(&wrong).contains("line 2") && stderr(&wrong).contains("`jump`"), "{}", stderr(&wrong));
    let blind = jog(&dir, "xy-serial", "hbot", "where\n", "");
    assert!(stderr(&blind).contains("do not report their position"), "{}", stderr(&blind));
    // Without a terminal there is no full screen.
    let screen = PROGRAM.run(&dir, "jog --protocol ticks --port tty -m coaxial");
    assert!(!screen.status.success());
    drop(device);
}

#[test]
fn jog_homes_and_refuses_an_unknown_state() {
    let dir = TestDir::new();
    let toml = PRESETS.iter().find(|preset| preset.name == "cartesian").expect("a preset").toml;
    let homing = "\n[homing]\nmoves = [{ joint = \"x\", towards = \"left\", speed = \"-100mm/s\", back_off = \"5mm\" }]\n";
    fs::write(dir.path().join("mine.toml"), format!("{toml}{homing}")).expect("a file");
    for protocol in ["ticks", "gcode"] {
        let device = Emulated::start(&dir, protocol, "mine.toml", "");
        assert_eq!(jog(&dir, protocol, "mine.toml", "where\n", "").status.code(), Some(2));
        let homed = jog(&dir, protocol, "mine.toml", "goto 10 10\nhome\nwhere\n", "--home");
        assert!(homed.status.success(), "{protocol}: {}{}", stdout(&homed), stderr(&homed));
        assert_eq!(place(stdout(&homed).lines().last().expect("a line")), [0.0, 0.0], "{protocol}");
        drop(device);
    }
}
