//! `plotplan jog --commands` on the emulated controllers.
#![cfg(unix)]

use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::process::{Child, Command, Output, Stdio};

use compiler::machine_file::{MachineFile, PRESETS};
use drawing::{Point, Vec2};
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
                let nudged = pen + floor_mm * Vec2::new(cos, sin);
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

/// The ink of an emulated machine, mm: one line for each of its lines.
fn ink_mm(table: &str, protocol: &str, machine: &Machine) -> Vec<Vec<Point>> {
    let start = machine.motor_positions(&machine.start());
    let mut lines: Vec<Vec<Point>> = Vec::new();
    for row in table.lines().skip(1) {
        let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().expect("a number")).collect();
        let at = if protocol == "gcode" {
            Point::new(cells[2], cells[3])
        } else {
            let origin = if protocol == "ebb" { start } else { MotorPos::ZERO };
            machine.forward_from_motors(&MotorPos([cells[2] + origin[0], cells[3] + origin[1]]))
        };
        if lines.len() <= cells[0] as usize {
            lines.push(Vec::new());
        }
        lines.last_mut().expect("a line").push(at);
    }
    lines
}

/// The distance of a point from a chain of lines, mm.
fn distance_mm(point: Point, chain: &[Point]) -> f64 {
    let from_line = |pair: &[Point]| {
        let way = pair[1] - pair[0];
        let t = ((point - pair[0]).dot(way) / way.hypot2()).clamp(0.0, 1.0);
        point.distance(pair[0] + t * way)
    };
    chain.windows(2).map(from_line).fold(f64::INFINITY, f64::min)
}

#[test]
fn strokes_of_the_mouse_are_drawn_on_every_controller_that_reports_its_position() {
    for (protocol, name) in
        [("ticks", "coaxial"), ("gcode", "cartesian"), ("ebb", "axidraw"), ("ticks", "five-bar")]
    {
        let dir = TestDir::new();
        let device = Emulated::start(&dir, protocol, name, "");
        let script = "press 40 40\ndrag 60 40\ndrag 60 55\ndrag 45 60\nrelease\npress 70 70\ndrag 80 70\nrelease\nwhere\n";
        let output = jog(&dir, protocol, name, script, "");
        assert!(output.status.success(), "{protocol} {name}: {}{}", stdout(&output), stderr(&output));
        let machine = machine(name);
        let sheet = machine.sheet();
        let at = |x: f64, y: f64| Point::new(sheet.x0 + x, sheet.y0 + y);
        let chains = [
            vec![at(40.0, 40.0), at(60.0, 40.0), at(60.0, 55.0), at(45.0, 60.0)],
            vec![at(70.0, 70.0), at(80.0, 70.0)],
        ];
        let lines = ink_mm(&device.ink(&dir), protocol, &machine);
        assert_eq!(lines.len(), 2, "{protocol} {name}: {lines:?}");
        for (ink, chain) in lines.iter().zip(&chains) {
            let near = machine.pose_near(chain[0], &machine.start()).expect("in reach");
            let most_mm = 0.1 + 2.0 * machine.quantization_error(&near);
            let off = ink.iter().map(|point| distance_mm(*point, chain)).fold(0.0, f64::max);
            let missed = chain.iter().map(|point| distance_mm(*point, ink)).fold(0.0, f64::max);
            assert!(off <= most_mm && missed <= most_mm, "{protocol} {name}: {off} and {missed} mm");
        }
    }
}

#[test]
fn strokes_of_the_mouse_end_at_the_edge_of_the_reach() {
    let dir = TestDir::new();
    let device = Emulated::start(&dir, "gcode", "cartesian", "");
    let script = "press 40 40\ndrag 40 60\ndrag 4000 60\ndrag 80 60\ndrag 80 50\nrelease\nwhere\n";
    let output = jog(&dir, "gcode", "cartesian", script, "");
    assert_eq!(output.status.code(), Some(1), "{}{}", stdout(&output), stderr(&output));
    assert_eq!(stdout(&output).matches("refused: ").count(), 1, "{}", stdout(&output));
    let machine = machine("cartesian");
    let lines = ink_mm(&device.ink(&dir), "gcode", &machine);
    let lengths: Vec<f64> =
        lines.iter().map(|line| line.windows(2).map(|pair| pair[0].distance(pair[1])).sum()).collect();
    assert_eq!(lengths.len(), 2, "{lines:?}");
    assert!((lengths[0] - 20.0).abs() < 0.1 && (lengths[1] - 10.0).abs() < 0.1, "{lengths:?}");
}

#[test]
fn jog_takes_up_backlash() {
    let dir = TestDir::new();
    let preset = PRESETS.iter().find(|preset| preset.name == "corexy").expect("a preset").toml;
    let toml = preset.replace("counts =", "backlash = 48\ncounts =");
    fs::write(dir.path().join("loose.toml"), &toml).expect("a file");
    let loose = MachineFile::parse(&toml).and_then(|file| file.machine()).expect("a machine");
    assert!(loose.has_backlash(), "{toml}");
    let device = Emulated::start(&dir, "ticks", "loose.toml", "");
    let script = "press 40 40\ndrag 60 40\ndrag 60 55\ndrag 40 40\nrelease\npress 70 70\ndrag 50 70\nrelease\n\
                  goto 20 20\ngoto 30 30\ngoto 25 30\n";
    let output = jog(&dir, "ticks", "loose.toml", script, "");
    assert!(output.status.success(), "{}{}", stdout(&output), stderr(&output));
    let sheet = loose.sheet();
    for (line, to) in stdout(&output).lines().rev().zip([[25.0, 30.0], [30.0, 30.0], [20.0, 20.0]]) {
        let at = place(line);
        let off = libm::hypot(at[0] - sheet.x0 - to[0], at[1] - sheet.y0 - to[1]);
        assert!(off < 0.05, "{line}: {off} mm off");
    }
    let at = |x: f64, y: f64| Point::new(sheet.x0 + x, sheet.y0 + y);
    let chains = [
        vec![at(40.0, 40.0), at(60.0, 40.0), at(60.0, 55.0), at(40.0, 40.0)],
        vec![at(70.0, 70.0), at(50.0, 70.0)],
    ];
    // The emulated motors have the play of the machine file: its ink is where they lead the pen.
    let lines = ink_mm(&device.ink(&dir), "ticks", &loose);
    assert_eq!(lines.len(), 2, "{lines:?}");
    let most_mm = 0.1 + 2.0 * loose.quantization_error(&loose.start());
    for (ink, chain) in lines.iter().zip(&chains) {
        let off = ink.iter().map(|point| distance_mm(*point, chain)).fold(0.0, f64::max);
        let missed = chain.iter().map(|point| distance_mm(*point, ink)).fold(0.0, f64::max);
        assert!(off <= most_mm && missed <= most_mm, "{off} and {missed} mm, {most_mm} allowed");
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
    assert!(touches.starts_with("x_mm,y_mm,arm1,arm2,approach1,approach2\n0,0,"), "{touches}");
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

/// Runs a shell script in a pseudo-terminal of 80 by 24 cells and types keys into it, each after a sign is on the screen
/// (a word: cells that stay as they are are not sent again). Returns everything that the terminal received.
fn in_terminal(dir: &TestDir, script: &str, keys: &[(&str, &str)]) -> String {
    let script = format!("stty cols 80 rows 24; {script}");
    let mut child = Command::new("script")
        .args(["-qefc", &script, "typescript"])
        .current_dir(dir.path())
        .env("TERM", "xterm-256color")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("script(1) of util-linux runs");
    let mut input = child.stdin.take().expect("its input");
    let mut output = child.stdout.take().expect("its output");
    let mut seen = Vec::new();
    for (sign, typed) in keys {
        let from = seen.len();
        while !String::from_utf8_lossy(&seen[from..]).contains(sign) {
            let mut some = [0; 4096];
            let count = output.read(&mut some).expect("the terminal's bytes");
            assert!(count > 0, "{sign} never came: {}", String::from_utf8_lossy(&seen));
            seen.extend_from_slice(&some[..count]);
        }
        input.write_all(typed.as_bytes()).expect("keys");
    }
    output.read_to_end(&mut seen).expect("the rest");
    child.wait().expect("it ends");
    String::from_utf8_lossy(&seen).into_owned()
}

/// What the terminal was sent last of two sequences that switch something on and off.
fn is_on(terminal: &str, on: &str, off: &str) -> Option<bool> {
    let last = [on, off].map(|sequence| terminal.rfind(sequence));
    last.iter().any(Option::is_some).then(|| last[0] > last[1])
}

#[test]
fn terminal_is_restored_after_a_panic_in_the_screen() {
    let dir = TestDir::new();
    let device = Emulated::start(&dir, "ticks", "coaxial", "");
    let command = format!(
        "stty -a > before; PLOTPLAN_TEST_PANIC=1 {BINARY} jog --protocol ticks --port tty -m coaxial; echo code $?; \
         stty -a > after"
    );
    // With the mouse captured, too.
    let terminal = in_terminal(&dir, &command, &[("quit", "m"), ("button", "!")]);
    assert!(terminal.contains("PLOTPLAN_TEST_PANIC is set"), "{terminal}");
    assert!(!terminal.contains("code 0"), "{terminal}");
    let [before, after] = ["before", "after"].map(|name| fs::read_to_string(dir.path().join(name)).unwrap());
    let is_set = |flag: &str| after.split_whitespace().any(|word| word == flag);
    assert!(is_set("icanon") && is_set("echo") && is_set("isig"), "{after}");
    assert_eq!(before, after);
    // Main screen, cursor, no mouse.
    assert_eq!(is_on(&terminal, "\x1b[?1049h", "\x1b[?1049l"), Some(false), "{terminal:?}");
    assert_eq!(is_on(&terminal, "\x1b[?25h", "\x1b[?25l"), Some(true), "{terminal:?}");
    assert_eq!(is_on(&terminal, "\x1b[?1000h", "\x1b[?1000l"), Some(false), "{terminal:?}");
    let message = terminal.rfind("PLOTPLAN_TEST_PANIC is set").expect("a message");
    assert!(
        message > terminal.rfind("\x1b[?1049l").expect("main screen"),
        "the message is on the other screen"
    );
    drop(device);
}

#[test]
fn mouse_draws_in_a_terminal() {
    let dir = TestDir::new();
    let device = Emulated::start(&dir, "gcode", "cartesian", "");
    let command = format!("{BINARY} jog --protocol gcode --port tty -m cartesian; echo code $?");
    // Cells from 1; 0 is the left button, 32 more while it moves, `m` its release.
    let stroke = "\x1b[<0;30;8M\x1b[<32;34;8M\x1b[<32;40;8M\x1b[<32;40;12M\x1b[<0;40;12m";
    let terminal = in_terminal(&dir, &command, &[("quit", "m"), ("button", stroke), ("up", "q")]);
    assert!(terminal.contains("code 0"), "{terminal}");
    let lines = ink_mm(&device.ink(&dir), "gcode", &machine("cartesian"));
    assert_eq!(lines.len(), 1, "{lines:?}");
    // The map has 78 columns and 16 rows inside its border; it shows the sheet with a margin of 2 mm.
    let sheet = machine("cartesian").sheet().inflate(2.0, 2.0);
    let column_mm = f64::max(sheet.width() / 78.0, sheet.height() / 32.0);
    let (from, to) = (lines[0][0], *lines[0].last().expect("points"));
    let length: f64 = lines[0].windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    // 10 columns to the right, 4 rows of twice the height down; the corner may be blended within half a column.
    let off = (to - from) - Vec2::new(10.0 * column_mm, -8.0 * column_mm);
    assert!(off.hypot() < 0.1, "{from:?} to {to:?}, columns of {column_mm} mm");
    assert!((length - 18.0 * column_mm).abs() < 2.0 * column_mm, "{length} mm in columns of {column_mm} mm");
}
