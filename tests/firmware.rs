//! Each firmware format, executed by a model of that firmware including its known defects. The verifier
//! measures the ink against the drawing; where no deviation is allowed, the ticks are compared with
//! those of the plan.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use assert_cmd::cargo::cargo_bin;
use backends::{Device, EmulatorOptions, Ink};
use compiler::machine_file::{MachineFile, PRESETS};
use drawing::{Affine, Drawing, Rect};
use kinematics::{
    Cartesian, JointKind, JointPos, JointRange, Machine, MachineParts, Mechanism, Motor, MotorPos, PenLimits,
    Polar,
};
use plan::{Header, Limits, Row, TickTable};
use serde_json::Value;
use verify::{Certificate, Verifier};

/// The default of `--tolerance`, mm.
const TOLERANCE: f64 = 0.1;
/// Resolution of the machines defined here, in ticks per mm or degree.
const FINE: f64 = 1000.0;

type Point = [f64; 2];
type Lines = Vec<(u16, Vec<Point>)>;

fn top() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn preset(name: &str) -> Machine {
    let preset = PRESETS.iter().find(|preset| preset.name == name).expect(name);
    MachineFile::parse(preset.toml).and_then(|file| file.machine()).expect("a valid preset")
}

/// Runs `convert` and returns its output.
fn convert(file: &str, machine: &str, format: &str, options: &[&str]) -> String {
    let mut command = Command::new(cargo_bin!("plotplan"));
    command.current_dir(top()).args(["convert", file, "--machine", machine, "--format", format]);
    // The bed of the H-bot is 250 mm wide, and its firmware accepts only smaller coordinates.
    let place = if machine == "hbot" { &["--scale", "0.6", "--place", "10mm,10mm"][..] } else { &["--fit"] };
    command.args(place);
    let output = command.args(options).output().expect("the program runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{file} {machine} {format}: {said}");
    String::from_utf8(output.stdout).expect("text")
}

fn plan(file: &str, machine: &str, options: &[&str]) -> TickTable {
    let csv = convert(file, machine, "csv", options);
    plan::file::read(csv.as_bytes()).expect("a plan").table
}

/// The drawing, placed as in the plan.
fn placed(file: &str, plan: &TickTable) -> Drawing {
    let bytes = std::fs::read(top().join(file)).expect("a drawing");
    let document = hpgl::read(&bytes, &hpgl::Options::default());
    let mut drawing = document.pages[0].drawing.clone();
    drawing.transform(Affine::new(plan.header.placement));
    drawing
}

/// The drawing with pen 1 only, for formats without pen numbers.
fn with_one_pen(mut drawing: Drawing) -> Drawing {
    drawing.strokes.change_pens(|_| Some(drawing::Pen(1)));
    drawing
}

/// A machine with a fine resolution: x and y in mm, or angle in degrees and radius in mm.
fn ruler(mechanism: impl Mechanism + 'static) -> Machine {
    let angle = mechanism.joint_kinds()[0] == JointKind::Revolute;
    let motor = |name: &str, counts: f64| Motor {
        name: name.into(),
        ticks_per_unit: counts,
        offset_ticks: 0.0,
        max_speed_ticks_s: 1e9,
        max_acceleration_ticks_s2: 1e12,
        max_jerk_ticks_s3: None,
        backlash_ticks: 0.0,
    };
    let first = if angle { FINE.to_degrees() } else { FINE };
    Machine::new(MachineParts {
        name: "ruler".into(),
        mechanism: std::sync::Arc::new(mechanism),
        joints: [JointRange::FREE; 2],
        min_manipulability: 0.0,
        coupling: [[1.0, 0.0], [0.0, 1.0]],
        motors: [motor("a", first), motor("b", FINE)],
        pen: PenLimits {
            max_speed_mm_s: 1e9,
            max_travel_speed_mm_s: f64::INFINITY,
            lift_time_s: 0.0,
            drop_time_s: 0.0,
        },
        pen_servo: None,
        pen_offsets_mm: BTreeMap::new(),
        homing: None,
        sheet: Rect::new(0.0, 0.0, 1.0, 1.0),
        start: JointPos::new(0.5, 100.0),
        period_s: 0.01,
    })
    .expect("a valid machine")
}

/// Measures ink against a drawing. Ink is in motor positions of `machine` times `scale`; limits are not
/// checked.
fn measure(machine: &Machine, drawing: &Drawing, ink: &Lines, scale: f64) -> Certificate {
    let limits = Limits { speed: 1e15, acceleration: 1e18, jerk: None };
    let header = Header {
        machine: machine.name().into(),
        motors: machine.motors().clone().map(|motor| plan::Motor { name: motor.name, limits }),
        placement: [1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        period_us: 1_000_000,
        rows: 0,
        lift_overlap_us: 0,
        rounding: plan::Rounding::Path,
        pen_colors: BTreeMap::new(),
        duration_us: 0,
    };
    let mut verifier = Verifier::new(machine, drawing, &header, TOLERANCE);
    let mut t_us = 0;
    let mut row = |pen: u16, place: Point| {
        let ticks = place.map(|value| (value * scale).round() as i64);
        verifier.row(Row { t_us, pen, ticks }, None);
        t_us += 1_000_000;
    };
    row(0, ink[0].1[0]);
    for (pen, places) in ink {
        row(0, places[0]);
        row(*pen, places[0]);
        for place in &places[1..] {
            row(*pen, *place);
        }
        row(0, places[places.len() - 1]);
    }
    verifier.finish()
}

/// Fails if the deviation exceeds `most` mm in either direction.
fn within(what: &str, certificate: &Certificate, drawing: &Drawing, most: f64) {
    within_length(what, certificate, drawing, most, 1.3);
}

/// As `within`, for motors that move one after the other: the ink is at most `stairs` times as long as
/// the drawing.
fn within_length(what: &str, certificate: &Certificate, drawing: &Drawing, most: f64, stairs: f64) {
    let off = certificate.after_rounding;
    assert!(off.max_mm() <= most, "{what}: {off:?}, allowed is {most} mm");
    let pens: Vec<u16> = drawing.pens().into_iter().map(|pen| pen.0).collect();
    let mut drawn = certificate.pens.clone();
    drawn.sort_unstable();
    assert_eq!(drawn, pens, "{what}: pens");
    // The length limits double drawing.
    assert!(certificate.ink_mm < stairs * drawing.length() + 5.0, "{what}: {} mm of ink", certificate.ink_mm);
}

const DRAWINGS: [&str; 4] = [
    "examples/house.hpgl",
    "tests/drawings/arcs.hpgl",
    "tests/drawings/pens.hpgl",
    "tests/drawings/dots.hpgl",
];
const ONE_STROKE: &str = "examples/zot.hpgl";

/// Firmware of report 1: each motor moves to each setpoint independently.
struct CoaxialFirmware {
    at: Point,
    down: bool,
    pen: u16,
    ink: Ink,
    /// The motor that arrives first; `None` if both arrive together.
    first: Option<usize>,
}

impl CoaxialFirmware {
    fn go(&mut self, to: Point) {
        if let Some(first) = self.first {
            let mut corner = self.at;
            corner[first] = to[first];
            self.ink.go(corner);
        }
        self.ink.go(to);
        self.at = to;
    }

    fn set(&mut self, down: bool) {
        self.down = down;
        self.ink.pen(if down { self.pen } else { 0 }, self.at);
    }

    /// Executes a file: each line is a list of quoted strings.
    fn follow(&mut self, file: &str, point: &dyn Fn(&str) -> Point) {
        for line in file.lines() {
            let inner = line.strip_prefix("['").and_then(|rest| rest.strip_suffix("']")).expect(line);
            let words: Vec<&str> = inner.split("', '").collect();
            let mut head = words[0].split(';');
            let mnemonic = head.next().expect("a mnemonic");
            let count = head.next().expect("a count");
            let points: Vec<Point> = words[1..].iter().map(|word| point(word)).collect();
            match mnemonic {
                "IN" => {}
                // Ignored by the firmware; the operator changes the pen.
                "SP" => self.pen = count.parse().expect("a pen"),
                "PU" => {
                    assert_eq!((count.parse(), points.len()), (Ok(1), 1), "{line}");
                    self.go(points[0]);
                    self.set(false);
                }
                "PD" => {
                    assert_eq!(count.parse(), Ok(points.len()), "{line}");
                    self.go(points[0]);
                    self.set(true);
                    // Off-by-one error of the firmware: it never moves to the last point.
                    for to in &points[1..points.len() - 1] {
                        self.go(*to);
                    }
                }
                other => panic!("unknown command {other}"),
            }
        }
    }
}

fn coaxial_ink(file: &str, start: Point, first: Option<usize>, point: &dyn Fn(&str) -> Point) -> Lines {
    let mut firmware = CoaxialFirmware { at: start, down: true, pen: 1, ink: Ink::default(), first };
    firmware.follow(file, point);
    assert!(!firmware.down, "the pen stays down");
    firmware.ink.lines()
}

#[test]
fn coaxial_commands_ink() {
    let machine = preset("coaxial");
    for file in DRAWINGS {
        let plan = plan(file, "coaxial", &[]);
        let drawing = placed(file, &plan);
        let commands = convert(file, "coaxial", "coaxial-commands", &[]);
        let point = |word: &str| {
            let (a, b) = word.split_once('x').expect("ticks of both arms");
            [a, b].map(|ticks| ticks.parse::<i64>().expect("whole ticks") as f64)
        };
        let start = plan.rows[0].ticks.map(|ticks| ticks as f64);
        for first in [None, Some(0), Some(1)] {
            let ink = coaxial_ink(&commands, start, first, &point);
            let certificate = measure(&machine, &drawing, &ink, 1.0);
            // Half a tick of both motors, and a whole tick of the slower one where they do not arrive
            // together.
            let apart = if first.is_some() { 0.51 } else { 0.02 };
            let what = format!("{file}, {first:?}");
            within_length(&what, &certificate, &drawing, TOLERANCE + 0.4536 + apart, 2.5);
        }
    }
}

#[test]
fn coaxial_commands_in_inches_ink() {
    let machine = ruler(Cartesian);
    let sheet = preset("coaxial").sheet();
    for file in DRAWINGS {
        let plan = plan(file, "coaxial", &[]);
        let drawing = placed(file, &plan);
        let commands = convert(file, "coaxial", "coaxial-commands-inches", &[]);
        let point = |word: &str| {
            let inner = word.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')).expect(word);
            let (x, y) = inner.split_once(", ").expect("two numbers");
            let inches = [x, y].map(|number| number.parse::<f64>().expect("inches"));
            // From the upper left corner of the sheet, y down.
            [sheet.x0 + 25.4 * inches[0], sheet.y1 - 25.4 * inches[1]]
        };
        let ink = coaxial_ink(&commands, [0.0, 0.0], None, &point);
        within(file, &measure(&machine, &drawing, &ink, FINE), &drawing, TOLERANCE + 0.003);
    }
}

/// Firmware of report 2: y first, counts truncated, each motor moves independently.
fn single_belt_ink(file: &str, first: Option<usize>) -> Lines {
    let mut ink = Ink::default();
    // After homing it moves to the centre.
    let mut at = [3100.0, 3100.0];
    for line in file.lines() {
        match line {
            "P" => ink.pen(1, at),
            "p" => ink.pen(0, at),
            _ => {
                assert!(line.len() < 20, "{line} does not fit into its buffer");
                let (y, x) = line.split_once(',').expect("two numbers");
                let number = |text: &str| {
                    let (whole, tenth) = text.split_once('.').expect("a point");
                    assert!(
                        !whole.is_empty() && tenth.len() == 1,
                        "its parser takes {line} for something else"
                    );
                    text.parse::<f64>().expect("a number")
                };
                let (x, y) = (number(x), number(y));
                assert!((0.0..250.0).contains(&x) && (0.0..250.0).contains(&y), "{line} is dropped");
                let to = [(6200.0 * (x + y) / 500.0).trunc(), (6200.0 * (y - x) / 500.0).trunc() + 3100.0];
                if let Some(first) = first {
                    let mut corner = at;
                    corner[first] = to[first];
                    ink.go(corner);
                }
                ink.go(to);
                at = to;
            }
        }
    }
    ink.lines()
}

#[test]
fn xy_serial_ink() {
    let machine = preset("hbot");
    for file in DRAWINGS {
        let plan = plan(file, "hbot", &[]);
        let drawing = with_one_pen(placed(file, &plan));
        let lines = convert(file, "hbot", "xy-serial", &[]);
        for first in [None, Some(0), Some(1)] {
            let certificate = measure(&machine, &drawing, &single_belt_ink(&lines, first), 1.0);
            // Positions rounded to 0.1 mm, counts truncated; between positions 0.28 mm apart the motors may
            // move one after the other.
            let apart = if first.is_some() { 0.2 } else { 0.0 };
            let floor = 0.05 * std::f64::consts::SQRT_2 + 0.0806;
            let what = format!("{file}, {first:?}");
            within_length(&what, &certificate, &drawing, TOLERANCE + floor + apart, 2.0);
        }
    }
}

/// Radii and angles of the table or arrays of report 4.
fn polar_points(text: &str) -> Vec<Point> {
    if let Some(table) = text.strip_prefix("r,theta,dist\n") {
        let row = |line: &str| {
            let mut fields = line.split(',').map(|field| field.parse::<f64>().unwrap_or(0.0));
            [fields.next().expect("r"), fields.next().expect("theta")]
        };
        return table.lines().map(row).collect();
    }
    let array = |name: &str| -> Vec<f64> {
        let begin = text.find(&format!("float {name}[] = {{")).expect(name);
        let body = text[begin..].split('{').nth(1).and_then(|rest| rest.split('}').next()).expect("numbers");
        body.split(',').map(|number| number.trim().parse().expect("a number")).collect()
    };
    array("radii").into_iter().zip(array("angles")).map(|(r, theta)| [r, theta]).collect()
}

/// The robot measures its angle clockwise from the left, the machine here counterclockwise from the right.
fn polar_ink(points: impl Iterator<Item = Point>) -> Lines {
    vec![(1, points.map(|[r, theta]| [180.0 - theta, r]).collect())]
}

#[test]
fn polar_csv_and_c_arrays_ink() {
    let machine = ruler(Polar::default());
    let plan = plan(ONE_STROKE, "polar", &[]);
    let drawing = placed(ONE_STROKE, &plan);
    let table = polar_points(&convert(ONE_STROKE, "polar", "polar-csv", &[]));
    let arrays = polar_points(&convert(ONE_STROKE, "polar", "c-arrays", &[]));
    assert_eq!(arrays[arrays.len() - 1], arrays[arrays.len() - 2], "the last point is never sent");
    // With corrected interpolation (20 steps between points): the path of the table, rounded to half a
    // microsecond of servo pulse.
    let smooth = |points: &[Point]| measure(&machine, &drawing, &polar_ink(points.iter().copied()), FINE);
    within("table", &smooth(&table), &drawing, TOLERANCE + 0.05 + 0.01);
    within("arrays", &smooth(&arrays), &drawing, TOLERANCE + 0.05 + 0.03);
    // As printed: (j / 20) is 0 in integer arithmetic, so it holds each point except the last, and
    // Servo.write rounds to degrees.
    let held = arrays[..arrays.len() - 1].iter().map(|[r, theta]| [*r, theta.trunc()]);
    let certificate = measure(&machine, &drawing, &polar_ink(held), FINE);
    let degree = 138.0_f64 * 1.0_f64.to_radians();
    within("as written", &certificate, &drawing, TOLERANCE + 0.05 + 0.03 + degree + 0.1);
}

fn emulator(backend: &str) -> Box<dyn Device> {
    let backend = backends::find(backend).expect("a backend");
    backend.emulator(&EmulatorOptions::default()).expect("an emulator")
}

/// Sends lines to an emulator one by one, and waits until all motion is done.
fn feed(device: &mut dyn Device, text: &str, end: char) -> Ink {
    let mut now_us = 0;
    for line in text.split(['\n', '\r']).filter(|line| !line.is_empty()) {
        device.answers();
        device.receive(format!("{line}{end}").as_bytes(), now_us);
        if line.starts_with("M0") {
            // It pauses after all earlier motion; then the pen is changed.
            while let Some(next_us) = device.wake_us() {
                now_us = next_us.max(now_us + 1);
                device.advance(now_us);
            }
            device.receive(b"~", now_us);
        }
        // One line in flight: wait for the answer.
        loop {
            let answers = device.answers().concat();
            let answer = String::from_utf8_lossy(&answers).trim().to_lowercase();
            assert!(!answer.contains("err"), "`{line}` is answered {answer}");
            if answer.contains("ok") {
                break;
            }
            now_us = device.wake_us().expect("it does something").max(now_us + 1);
            device.advance(now_us);
        }
    }
    while let Some(next_us) = device.wake_us() {
        now_us = next_us.max(now_us + 1);
        device.advance(now_us);
    }
    assert_eq!(device.lost_bytes(), 0);
    assert!(!device.pen_is_down());
    device.ink().clone()
}

/// The ink of the plan in ticks, as one pen.
fn planned(plan: &TickTable) -> Lines {
    let rows: Vec<Row> = plan.rows.iter().map(|row| Row { pen: row.pen.min(1), ..*row }).collect();
    Ink::of_rows(&rows).lines()
}

#[test]
fn ebb_step_count_is_exact() {
    let mut steps = 0;
    for machine in ["corexy", "hbot", "cartesian"] {
        for file in DRAWINGS {
            for period in ["10ms", "7ms", "4130us"] {
                let plan = plan(file, machine, &["--period", period]);
                let start = plan.rows[0].ticks.map(|ticks| ticks as f64);
                for (format, options) in [("ebb", &[][..]), ("ebb-sm", &[]), ("ebb", &["--pen-by", "servo"])]
                {
                    let options = [&["--period", period], options].concat();
                    let text = convert(file, machine, format, &options);
                    let ink = feed(&mut *emulator("ebb"), &text, '\r');
                    let lines: Lines = ink
                        .lines()
                        .into_iter()
                        .map(|(pen, places)| {
                            (pen, places.into_iter().map(|[a, b]| [a + start[0], b + start[1]]).collect())
                        })
                        .collect();
                    assert_eq!(lines, planned(&plan), "{file} {machine} {format} {period}");
                }
                steps +=
                    plan.rows.windows(2).map(|pair| pair[1].ticks[0].abs_diff(pair[0].ticks[0])).sum::<u64>();
            }
        }
    }
    assert!(steps > 1_000_000, "{steps} steps are not much of a test");
}

#[test]
fn ebb_step_times() {
    let plan = plan(DRAWINGS[0], "cartesian", &["--period", "4130us"]);
    let text = convert(DRAWINGS[0], "cartesian", "ebb", &["--period", "4130us"]);
    let mut said_us = 0;
    for line in text.split('\r').filter(|line| !line.is_empty()) {
        let numbers: Vec<i64> = line.split(',').skip(1).map(|word| word.parse().expect("a number")).collect();
        said_us += match line.split(',').next() {
            Some("LT") => numbers[0] * 40,
            Some("SM") => numbers[0] * 1000,
            Some("SP") => numbers[1] * 1000,
            _ => 0,
        };
    }
    // Before the plan starts, the pen goes up for half a second.
    let off = said_us - 500_000 - plan.header.duration_us as i64;
    assert!(off.abs() <= 2000, "{off} us");
}

/// Translates the other G-code flavours to that of grbl.
fn as_grbl(text: &str) -> String {
    let line = |line: &str| -> Option<String> {
        let line = line.split(';').next().unwrap_or_default().trim();
        let last = line.rsplit(['S', '=']).next().unwrap_or_default();
        if line.is_empty() || line == "M400" {
            None
        } else if line.starts_with("M280 P0 S") || line.starts_with("SET_SERVO SERVO=pen ANGLE=") {
            Some(format!("M3 S{last}"))
        } else if line == "PAUSE" {
            Some("M0".to_owned())
        } else if let Some(ms) = line.strip_prefix("G4 P") {
            let value: f64 = ms.parse().expect("a time");
            Some(format!("G4 P{}", if value > 5.0 { value / 1000.0 } else { value }))
        } else {
            Some(line.to_owned())
        }
    };
    text.lines().filter_map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn gcode_ink_with_arcs() {
    let ruler = ruler(Cartesian);
    for file in DRAWINGS {
        let plan = plan(file, "cartesian", &[]);
        let drawing = with_one_pen(placed(file, &plan));
        for format in ["gcode-grbl", "gcode-fluidnc", "gcode-marlin", "gcode-klipper"] {
            for pen in [&[][..], &["--pen-by", "z"], &["--pen-by", "servo", "--pen-positions", "10,70"]] {
                let text = convert(file, "cartesian", format, pen);
                assert_eq!(
                    text.contains("G3 X"),
                    file.contains("arcs") || file.contains("house"),
                    "{file}: arcs"
                );
                assert!(text.lines().all(|line| line.len() < 80), "{file}: grbl takes 79 characters");
                let ink = feed(&mut *emulator("gcode-grbl"), &as_grbl(&text), '\n').lines();
                // Rounding to 3 decimals, and chord errors of arcs and ellipses.
                let certificate = measure(&ruler, &drawing, &ink, FINE);
                within(&format!("{file} {format} {pen:?}"), &certificate, &drawing, 0.015 + 0.011);
            }
        }
    }
}

#[test]
fn gcode_timed_ink_and_duration() {
    let ruler = ruler(Cartesian);
    for machine in ["cartesian", "coaxial", "polar"] {
        let file = DRAWINGS[0];
        let plan = plan(file, machine, &[]);
        let drawing = with_one_pen(placed(file, &plan));
        let text = convert(file, machine, "gcode-timed", &[]);
        let ink = feed(&mut *emulator("gcode-grbl"), &text, '\n').lines();
        within(machine, &measure(&ruler, &drawing, &ink, FINE), &drawing, TOLERANCE + 0.01);
        let mut seconds = 0.0;
        for line in text.lines() {
            let last = |letter: char| {
                line.rsplit(letter).next().and_then(|number| number.parse::<f64>().ok()).expect(line)
            };
            if line.starts_with("G93") {
                seconds += 60.0 / last('F');
            } else if line.starts_with("G4") {
                seconds += last('P');
            }
        }
        let planned = plan.header.duration_us as f64 * 1e-6;
        // Moves of less than a micrometre are dropped, and so is their duration.
        assert!((seconds - planned).abs() < 0.02 * planned, "{machine}: {seconds} s instead of {planned} s");
    }
}

#[test]
fn klipper_step_times() {
    for (file, machine) in [(DRAWINGS[0], "corexy"), (DRAWINGS[1], "coaxial"), (DRAWINGS[3], "hbot")] {
        let plan = plan(file, machine, &[]);
        let text = convert(file, machine, "klipper-steps", &[]);
        // Clock, motor and direction of each step; clock and state of each pen event.
        let mut steps: [Vec<(u64, i64)>; 2] = [Vec::new(), Vec::new()];
        let mut pens: Vec<(u64, bool)> = Vec::new();
        let (mut clock, mut direction) = ([0_u64; 2], [0_i64; 2]);
        for line in text.lines().filter(|line| !line.starts_with('#')) {
            let words: BTreeMap<&str, i64> = line
                .split(' ')
                .skip(1)
                .map(|word| word.split_once('=').expect(line))
                .map(|(key, value)| (key, value.parse().expect(line)))
                .collect();
            let oid = words["oid"] as usize;
            match line.split(' ').next() {
                Some("reset_step_clock") => {
                    // The low 32 bits of a monotonic clock.
                    let low = words["clock"] as u64;
                    clock[oid] += low.wrapping_sub(clock[oid]) & 0xFFFF_FFFF;
                }
                Some("set_next_step_dir") => direction[oid] = if words["dir"] == 1 { 1 } else { -1 },
                Some("queue_step") => {
                    let (interval, count, add) = (words["interval"], words["count"], words["add"]);
                    assert!((1..1 << 31).contains(&interval) && (1..1 << 16).contains(&count), "{line}");
                    assert!((-32768..32768).contains(&add), "{line}");
                    let mut interval = interval;
                    for _ in 0..count {
                        clock[oid] += interval as u64;
                        steps[oid].push((clock[oid], direction[oid]));
                        interval += add;
                    }
                }
                Some("queue_digital_out") => pens.push((words["clock"] as u64, words["on_ticks"] == 1)),
                other => panic!("unknown command {other:?}"),
            }
        }
        for (motor, steps) in steps.iter().enumerate() {
            let mut at = plan.rows[0].ticks[motor];
            let mut done = steps.iter().peekable();
            for pair in plan.rows.windows(2) {
                let (from, to) = (pair[0].t_us * 16, pair[1].t_us * 16);
                let way = pair[1].ticks[motor] - pair[0].ticks[motor];
                for k in 0..way.abs() {
                    let (clock, direction) = *done.next().expect("a step");
                    assert_eq!(direction, way.signum(), "{file}: direction");
                    // The motor crosses the midpoint between two ticks.
                    let ideal = from as f64 + (k as f64 + 0.5) / way.abs() as f64 * (to - from) as f64;
                    assert!((clock as f64 - ideal).abs() <= 1.0, "{file}: {clock} instead of {ideal}");
                    at += direction;
                }
                assert_eq!(at, pair[1].ticks[motor], "{file}: motor {motor} at {to}");
            }
            assert!(done.next().is_none(), "{file}: steps too many");
        }
        let mut down = false;
        let changes = plan.rows.iter().filter(|row| {
            let changes = (row.pen != 0) != down;
            down = row.pen != 0;
            changes
        });
        let expected: Vec<(u64, bool)> =
            changes.map(|row| ((row.t_us * 16) & 0xFFFF_FFFF, row.pen != 0)).collect();
        assert_eq!(pens, expected, "{file}: pen");
    }
}

/// Ink of samples (pen, pen position).
fn sampled(samples: impl Iterator<Item = (u16, Point)>) -> Lines {
    let mut ink = Ink::default();
    let mut before = 0;
    for (pen, at) in samples {
        if before != 0 {
            ink.go(at);
        }
        ink.pen(pen, at);
        before = pen;
    }
    ink.lines()
}

#[test]
fn joint_trajectory_quintic_ink() {
    let ruler = ruler(Cartesian);
    for name in ["coaxial", "polar", "corexy"] {
        let machine = preset(name);
        let plan = plan(DRAWINGS[0], name, &[]);
        let drawing = with_one_pen(placed(DRAWINGS[0], &plan));
        let text = convert(DRAWINGS[0], name, "joint-trajectory", &[]);
        let document: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(document["joint_names"][2], "pen");
        let points = document["points"].as_array().expect("points");
        assert_eq!(points.len(), plan.rows.len());
        let unit = machine
            .mechanism()
            .joint_kinds()
            .map(|kind| if kind == JointKind::Revolute { 1.0 } else { 1000.0 });
        let value = |point: &Value, what: &str, joint: usize| point[what][joint].as_f64().expect("a number");
        let time = |point: &Value| {
            let time = &point["time_from_start"];
            time["sec"].as_f64().expect("s") + 1e-9 * time["nanosec"].as_f64().expect("ns")
        };
        let mut samples = Vec::new();
        for (index, pair) in points.windows(2).enumerate() {
            let (from, to) = (&pair[0], &pair[1]);
            assert!((time(from) * 1e6 - plan.rows[index].t_us as f64).abs() < 0.01);
            let t = time(to) - time(from);
            let pen = u16::from(value(from, "positions", 2) > 0.5);
            for k in 0..4 {
                let s = f64::from(k) / 4.0;
                let joints = [0, 1].map(|joint| {
                    let of = |point: &Value, what: &str| value(point, what, joint) * unit[joint];
                    let (p0, v0, a0) = (
                        of(from, "positions"),
                        of(from, "velocities") * t,
                        of(from, "accelerations") * t * t,
                    );
                    let (p1, v1, a1) =
                        (of(to, "positions"), of(to, "velocities") * t, of(to, "accelerations") * t * t);
                    // Quintic with these boundary values.
                    let c3 = 10.0 * (p1 - p0) - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1;
                    let c4 = -15.0 * (p1 - p0) + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1;
                    let c5 = 6.0 * (p1 - p0) - 3.0 * (v0 + v1) - 0.5 * (a0 - a1);
                    p0 + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5))))
                });
                let at = machine.mechanism().forward(&JointPos::from(joints));
                samples.push((pen, [at.x, at.y]));
            }
        }
        let ink = sampled(samples.into_iter());
        // The quintics oscillate around the rows, beyond the tolerance.
        let c = measure(&ruler, &drawing, &ink, FINE);
        println!("{name} {:?} {:?}", c.after_rounding, c.failures);
        within(name, &measure(&ruler, &drawing, &ink, FINE), &drawing, TOLERANCE + 0.02);
    }
}

#[test]
fn halstreamer_and_pvt_ink() {
    let ruler = ruler(Cartesian);
    for name in ["coaxial", "hbot", "polar"] {
        let machine = preset(name);
        let at = |ticks: Point| {
            let p = machine.forward_from_motors(&MotorPos::from(ticks));
            [p.x, p.y]
        };
        for period in ["1ms", "10ms"] {
            let options = ["--period", period];
            let plan = plan(DRAWINGS[0], name, &options);
            let drawing = with_one_pen(placed(DRAWINGS[0], &plan));
            let columns = convert(DRAWINGS[0], name, "halstreamer", &options);
            assert_eq!(columns.lines().count() as u64, plan.header.duration_us / plan.header.period_us + 1);
            let samples = columns.lines().map(|line| {
                let numbers: Vec<f64> = line.split(' ').map(|word| word.parse().expect("a number")).collect();
                (numbers[2] as u16, at([numbers[0], numbers[1]]))
            });
            let ink = sampled(samples);
            let what = format!("{name} {period}");
            within(&what, &measure(&ruler, &drawing, &ink, FINE), &drawing, TOLERANCE + 0.01);

            let rows = convert(DRAWINGS[0], name, "pvt", &options);
            let rows: Vec<Vec<f64>> = rows
                .lines()
                .skip(1)
                .map(|line| line.split(',').map(|word| word.parse().expect("a number")).collect())
                .collect();
            let samples = rows.windows(2).flat_map(|pair| {
                let (from, to) = (&pair[0], &pair[1]);
                let t = to[0] - from[0];
                (0..4).map(move |k| {
                    let s = f64::from(k) / 4.0;
                    // Cubic with these positions and velocities.
                    let motor = |m: usize| {
                        let (p0, v0, p1, v1) =
                            (from[2 + 2 * m], from[3 + 2 * m] * t, to[2 + 2 * m], to[3 + 2 * m] * t);
                        let (s2, s3) = (s * s, s * s * s);
                        (2.0 * s3 - 3.0 * s2 + 1.0) * p0
                            + (s3 - 2.0 * s2 + s) * v0
                            + (3.0 * s2 - 2.0 * s3) * p1
                            + (s3 - s2) * v1
                    };
                    (u16::from(from[1] > 0.0), [motor(0), motor(1)])
                })
            });
            let ink = sampled(samples.map(|(pen, ticks)| (pen, at(ticks))));
            within(&what, &measure(&ruler, &drawing, &ink, FINE), &drawing, TOLERANCE + 0.01);
        }
    }
}

/// Runs `convert`, which must fail, and returns the error message.
fn refusal(arguments: &[&str]) -> String {
    let output = Command::new(cargo_bin!("plotplan"))
        .current_dir(top())
        .arg("convert")
        .args(arguments)
        .output()
        .expect("the program runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
    assert!(output.stdout.is_empty(), "{arguments:?} writes something");
    said
}

#[test]
fn unrepresentable_plans_and_losses_are_reported() {
    let house = DRAWINGS[0];
    let said = [
        vec![house, "--fit", "-m", "corexy", "-f", "xy-serial"],
        vec![house, "--fit", "-m", "corexy", "-f", "coaxial-commands"],
        vec![house, "--fit", "-m", "coaxial", "-f", "polar-csv"],
        vec![house, "--fit", "-m", "polar", "-f", "c-arrays"],
        vec![house, "-m", "hbot", "--fit", "--strict", "-f", "xy-serial"],
        vec![house, "--fit", "-m", "cartesian", "--period", "37us", "-f", "ebb-sm"],
    ]
    .map(|arguments| {
        let line = refusal(&arguments);
        let line = line.lines().filter(|line| line.starts_with("error") || line.starts_with("warning"));
        format!("{}\n{}\n", arguments.join(" "), line.collect::<Vec<_>>().join("\n"))
    });
    insta::assert_snapshot!(said.join("\n"));
}

#[test]
fn formats_page_lists_every_format() {
    let text = std::fs::read_to_string(top().join("docs/formats.md")).expect("docs/formats.md");
    let help =
        Command::new(cargo_bin!("plotplan")).args(["convert", "-h"]).output().expect("the program runs");
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    let (_, values) = help.split_once("[possible values: ticks").expect("the formats");
    let values = values.split(']').next().expect("an end");
    let formats: Vec<&str> = values.split([',', ' ', '\n']).filter(|word| !word.is_empty()).collect();
    assert!(formats.len() > 15, "{formats:?}");
    for format in formats {
        assert!(text.contains(&format!("`{format}`")), "docs/formats.md does not list {format}");
    }
}

/// Both durations that `convert` reports; the settings are those of the file.
#[test]
fn grbl_keeps_to_the_plan() {
    const FILES: [&str; 8] = [
        "examples/zot.hpgl",
        "examples/house.hpgl",
        "examples/rings.svg",
        "examples/rosette.hpgl",
        "examples/spirograph.hpgl",
        "examples/surface.hpgl",
        "tests/drawings/spiral.hpgl",
        "tests/drawings/labels.hpgl",
    ];
    let check = |machine: &str| {
        for file in FILES {
            let text = convert(file, machine, "gcode-grbl", &[]);
            let (times, settings) = text.split_once('\n').expect("lines");
            let settings = settings.lines().take(2).collect::<Vec<_>>().join(" ");
            assert!(settings.starts_with("; $1=255 $11=") && settings.contains(" $121="), "{settings}");
            let share = times.split(['(', '%']).nth(1).and_then(|share| share.trim().parse::<f64>().ok());
            let share = share.expect(times);
            assert!(share.abs() <= 2.0, "{file}, {machine}: {times}");
            let chords = text.lines().take(4).any(|line| line.ends_with("mm of the plan's path"));
            assert_eq!(chords, file.contains("rosette"), "{file}, {machine}");
        }
    };
    std::thread::scope(|scope| {
        for machine in ["cartesian", "corexy", "coaxial"] {
            scope.spawn(move || check(machine));
        }
    });
}

/// Chords of the plan's path take what it leaves of the tolerance.
#[test]
fn gcode_ink_along_the_plan_is_within_the_tolerance() {
    let file = "examples/rosette.hpgl";
    let plan = plan(file, "cartesian", &[]);
    let text = convert(file, "cartesian", "gcode-grbl", &[]);
    assert!(text.lines().take(4).any(|line| line.contains("of 17 strokes: chords within")));
    let ink = feed(&mut *emulator("gcode-grbl"), &text, '\n').lines();
    let drawing = placed(file, &plan);
    let certificate = measure(&ruler(Cartesian), &with_one_pen(drawing.clone()), &ink, FINE);
    // Three decimals.
    within(file, &certificate, &with_one_pen(drawing), TOLERANCE + 0.001);
}
