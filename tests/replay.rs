//! Independent replay of plans. The CSV reader (`independent.rs`) and the forward kinematics are written
//! from the equations of the machine reports (docs/references.md) and of the machine files in
//! tests/machines/, so that the test shares no code with the planner, the machine model or the
//! verifier. For the drawings of the repository and for random ones it checks the deviation in both
//! directions, the limits of speed, acceleration and jerk, the joint ranges, start and end, and the
//! pen times.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use assert_cmd::cargo::cargo_bin;
use tempfile::TempDir;
use test_support::Random;

mod independent;

use independent::TOLERANCE;
use independent::{
    Differences, Ink, Limits, Machine, NO_JERK_LIMIT, Plan, Point, check_plan, strokes, within,
};

/// Coaxial arm (report 1): x = L1 cos th1 + L2 cos(th1 - th2), y likewise; counts 3200/360 th1 and
/// 3200/360 (th2 - th1 + 90).
fn coaxial_angles([arm1, arm2]: [f64; 2]) -> [f64; 2] {
    let th1 = arm1 * 360.0 / 3200.0;
    [th1, arm2 * 360.0 / 3200.0 + th1 - 90.0]
}

fn coaxial(ticks: [f64; 2]) -> Point {
    let [th1, th2] = coaxial_angles(ticks);
    let (sin1, cos1) = libm::sincos(th1.to_radians());
    let (sin12, cos12) = libm::sincos((th1 - th2).to_radians());
    [206.0 * cos1 + 256.0 * cos12, 206.0 * sin1 + 256.0 * sin12]
}

/// CoreXY worktable (report 3): A = X + Y, B = X - Y, times the encoder ratio.
fn corexy([a, b]: [f64; 2]) -> Point {
    let enc_ratio = 171.79 * 24.0 / (14.26 * std::f64::consts::PI);
    [0.5 * (a + b) / enc_ratio, 0.5 * (a - b) / enc_ratio]
}

/// H-bot plotter (report 2), equations (1) and (2).
fn hbot([l, r]: [f64; 2]) -> Point {
    [(l - r + 3100.0) * 250.0 / 6200.0, (l + r - 3100.0) * 250.0 / 6200.0]
}

/// Polar robot (report 4): 544 to 2400 us are theta = 0 to 180 degrees, 44 mm are a turn of the
/// pinion; theta = atan(x / y) + 90.
fn polar([us, degrees]: [f64; 2]) -> Point {
    let theta = (us - 544.0) * 180.0 / (2400.0 - 544.0);
    let r = 138.0 + degrees * 44.0 / 360.0;
    let (sin, cos) = libm::sincos((theta - 90.0).to_radians());
    [r * sin, r * cos]
}

/// Two links with absolute angles in degrees.
fn links([l1, l2]: [f64; 2], [theta, psi]: [f64; 2]) -> Point {
    let (sin1, cos1) = libm::sincos(theta.to_radians());
    let (sin2, cos2) = libm::sincos(psi.to_radians());
    [l1 * cos1 + l2 * cos2, l1 * sin1 + l2 * sin2]
}

/// tests/machines/corexy-jerk.toml: A = x + y, B = x - y, 80 ticks/mm.
fn corexy_jerk([a, b]: [f64; 2]) -> Point {
    [(a + b) / 160.0, (a - b) / 160.0]
}

/// tests/machines/right-elbow.toml: theta and psi, 4096 ticks a turn.
fn right_elbow_angles(ticks: [f64; 2]) -> [f64; 2] {
    ticks.map(|ticks| ticks * 360.0 / 4096.0)
}

fn right_elbow(ticks: [f64; 2]) -> Point {
    links([150.0, 120.0], right_elbow_angles(ticks))
}

/// tests/machines/belt-ratio.toml: -3000 ticks a turn of theta, -5000 a turn of (theta + psi) / 2.
fn belt_ratio_angles([shoulder, elbow]: [f64; 2]) -> [f64; 2] {
    let theta = (shoulder - 250.0) * 360.0 / -3000.0;
    let mean = (elbow + 100.0) * 360.0 / -5000.0;
    [theta, 2.0 * mean - theta]
}

fn belt_ratio(ticks: [f64; 2]) -> Point {
    links([180.0, 140.0], belt_ratio_angles(ticks))
}

/// Machines of tests/machines/, for what no preset has: jerk limits, an elbow on the right, a belt
/// ratio other than 1, negative counts.
const FILES: [Machine; 3] = [
    Machine {
        name: "corexy-jerk",
        file: Some("corexy-jerk.toml"),
        limits: Some([[8e3, 8e4, 1.6e6]; 2]),
        motors: ["A", "B"],
        forward: &corexy_jerk,
        start: [0, 0],
        backlash: [0.0; 2],
        pen_us: 100_000,
        period_us: 10_000,
        every_period: true,
        sheet: [0.0, 0.0, 200.0, 200.0],
        allowed: &|ticks| corexy_jerk(ticks).iter().all(|x| within(*x, 0.0, 200.0, 0.007)),
    },
    Machine {
        name: "right-elbow",
        file: Some("right-elbow.toml"),
        limits: Some([[60.0 * 4096.0 / 360.0, 300.0 * 4096.0 / 360.0, NO_JERK_LIMIT]; 2]),
        motors: ["first", "second"],
        forward: &right_elbow,
        start: [512, 1536],
        backlash: [0.0; 2],
        pen_us: 100_000,
        period_us: 10_000,
        every_period: true,
        sheet: [60.0, 60.0, 180.0, 160.0],
        // The elbow is on the right if the second link is folded counterclockwise.
        allowed: &|ticks| {
            let [theta, psi] = right_elbow_angles(ticks);
            within(psi - theta, 0.0, 180.0, 0.09)
        },
    },
    Machine {
        name: "belt-ratio",
        file: Some("belt-ratio.toml"),
        limits: Some([
            [60.0 * 3000.0 / 360.0, 300.0 * 3000.0 / 360.0, NO_JERK_LIMIT],
            [60.0 * 5000.0 / 360.0, 300.0 * 5000.0 / 360.0, NO_JERK_LIMIT],
        ]),
        motors: ["shoulder", "elbow"],
        forward: &belt_ratio,
        start: [-750, -1100],
        backlash: [0.0; 2],
        pen_us: 100_000,
        period_us: 10_000,
        every_period: true,
        sheet: [-60.0, 140.0, 60.0, 260.0],
        // The elbow is on the left if the second link is folded clockwise.
        allowed: &|ticks| {
            let [theta, psi] = belt_ratio_angles(ticks);
            within(theta - psi, 0.0, 180.0, 0.2)
        },
    },
];

/// The presets that come from machine reports.
const PRESETS: [Machine; 4] = [
    Machine {
        name: "coaxial",
        file: None,
        limits: None,
        motors: ["arm1", "arm2"],
        forward: &coaxial,
        start: [800, 0],
        backlash: [0.0; 2],
        pen_us: 150_000,
        period_us: 10_000,
        every_period: true,
        sheet: [12.7, 76.2, 12.7 + 215.9, 76.2 + 279.4],
        // The elbow stays on its side: the fold is 0 to 180 degrees; a tick of each motor is
        // 0.1125.
        allowed: &|ticks| within(coaxial_angles(ticks)[1], 0.0, 180.0, 0.12),
    },
    Machine {
        name: "corexy",
        file: None,
        limits: None,
        motors: ["A", "B"],
        forward: &corexy,
        start: [0, 0],
        backlash: [0.0; 2],
        pen_us: 150_000,
        period_us: 10_000,
        every_period: true,
        sheet: [0.0, 0.0, 200.0, 200.0],
        allowed: &|ticks| corexy(ticks).iter().all(|x| within(*x, 0.0, 200.0, 0.006)),
    },
    Machine {
        name: "hbot",
        file: None,
        limits: None,
        motors: ["L", "R"],
        forward: &hbot,
        start: [0, 3100],
        backlash: [0.0; 2],
        pen_us: 100_000,
        period_us: 10_000,
        every_period: true,
        sheet: [0.0, 0.0, 250.0, 250.0],
        allowed: &|ticks| hbot(ticks).iter().all(|x| within(*x, 0.0, 250.0, 0.041)),
    },
    Machine {
        name: "polar",
        file: None,
        limits: None,
        motors: ["theta", "r"],
        forward: &polar,
        start: [1472, 0],
        backlash: [0.0; 2],
        pen_us: 150_000,
        period_us: 20_000,
        every_period: true,
        sheet: [-138.0, 0.0, 138.0, 138.0],
        allowed: &|[us, degrees]| {
            within(us, 544.0, 2400.0, 0.5) && within(degrees, (48.0 - 138.0) * 360.0 / 44.0, 0.0, 0.5)
        },
    },
];

fn plotplan(arguments: &[&str]) -> Option<String> {
    let output = Command::new(cargo_bin!("plotplan")).args(arguments).output().expect("the program runs");
    match output.status.code() {
        Some(0) => Some(String::from_utf8(output.stdout).expect("text")),
        Some(1) => None,
        _ => panic!("plotplan {arguments:?}\n{}", String::from_utf8_lossy(&output.stderr)),
    }
}

/// Converts with `options` and checks the plan; returns whether the machine can draw the drawing
/// so.
fn replay(machine: &Machine, file: &Path, drawing: &Ink, drawing_error: f64, options: &[&str]) -> bool {
    let name = file.to_str().expect("a UTF-8 path");
    let machine_file = machine.file.map(|file| top().join("tests/machines").join(file));
    let named = machine_file.as_ref().map_or(machine.name, |file| file.to_str().expect("a UTF-8 path"));
    let mut arguments = vec![name, "--machine", named];
    arguments.extend(options);
    if plotplan(&[&["check"], &arguments[..]].concat()).is_none() {
        return false;
    }
    let what = format!("{} on {} {}", name, machine.name, options.join(" "));
    let csv = plotplan(&[&["convert"], &arguments[..], &["--format", "csv"]].concat());
    let plan = Plan::parse(&csv.unwrap_or_else(|| panic!("{what}: no plan")), machine);
    check_plan(&plan, machine, drawing, drawing_error, TOLERANCE)
        .unwrap_or_else(|error| panic!("{what}: {error}"));
    if options.contains(&"--fit") {
        let lines = drawing.values().flatten().flatten().map(|p| plan.place(*p));
        let [x0, y0, x1, y1] = machine.sheet;
        let mut on_sheet = lines.map(|[x, y]| within(x, x0, x1, 0.05) && within(y, y0, y1, 0.05));
        assert!(on_sheet.all(|on_sheet| on_sheet), "{what}: off the sheet");
    }
    true
}

/// The top directory of the repository.
fn top() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The drawings of examples/ and tests/drawings/, sorted by name.
fn bundled() -> Vec<PathBuf> {
    let top = top();
    let mut files: Vec<PathBuf> = ["examples", "tests/drawings"]
        .iter()
        .flat_map(|folder| fs::read_dir(top.join(folder)).expect("the folder"))
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "hpgl" || extension == "plt"))
        .collect();
    files.sort();
    files
}

/// Larger drawings are replayed on one machine each, in turn: all of them on all machines take too
/// long.
const LARGE_BYTES: u64 = 20_000;

fn bundled_drawings(on: usize) {
    let files = bundled();
    assert!(!files.is_empty());
    let machine = &PRESETS[on];
    for (index, file) in files.iter().enumerate() {
        if fs::metadata(file).expect("its size").len() > LARGE_BYTES && index % PRESETS.len() != on {
            continue;
        }
        let plain = plotplan(&["convert", file.to_str().expect("a plain path"), "--format", "hpgl"]);
        let drawing = strokes(&plain.expect("a drawing"));
        // Integer plotter units, and curves as chords with an error of a quarter of a unit.
        let error = 0.0125 * std::f64::consts::SQRT_2 + 0.025 / 4.0;
        assert!(replay(machine, file, &drawing, error, &["--fit"]), "{} does not fit", file.display());
        replay(machine, file, &drawing, error, &[]);
    }
}

/// Polylines of `count` vertices in total, in plotter units, within 190 x 190 mm: random steps of up to
/// `reach`, a new polyline of the other pen after every `vertices`.
fn scribble(seed: u64, reach: i32, vertices: usize, count: usize) -> String {
    let mut random = Random(seed);
    let mut hpgl = "IN;".to_owned();
    let mut at = [4000, 4000];
    for vertex in 0..count {
        if vertex % vertices == 0 {
            hpgl.extend([format!(";PU;SP{};PU{},{};PD", 1 + (vertex / vertices) % 2, at[0], at[1])]);
        } else {
            let comma = if vertex % vertices == 1 { "" } else { "," };
            hpgl.extend([format!("{comma}{},{}", at[0], at[1])]);
        }
        at = at.map(|x: i32| (x + random.below(2 * reach as u64 + 1) as i32 - reach).clamp(200, 7800));
    }
    hpgl + ";PU;SP0;"
}

fn random_drawings(machine: &Machine) {
    let folder = TempDir::new().expect("a folder");
    let count = if machine.file.is_none() { 2000 } else { 500 };
    for (seed, reach, vertices) in [(1, 200, 2000), (2, 60, 400), (3, 8, 2000), (4, 400, 10)] {
        let hpgl = scribble(seed, reach, vertices, count);
        let file = folder.path().join(format!("scribble{seed}.hpgl"));
        fs::write(&file, &hpgl).expect("a file can be written");
        let drawing = strokes(&hpgl);
        assert!(replay(machine, &file, &drawing, 0.0, &["--fit"]), "scribble {seed} on {}", machine.name);
        // At life size a scribble fits the presets, except polar.
        if machine.file.is_none() {
            let life_size = replay(machine, &file, &drawing, 0.0, &[]);
            assert!(life_size || machine.name == "polar", "scribble {seed} on {}", machine.name);
        }
    }
}

/// A module for each preset: bundled drawings and random drawings.
macro_rules! on_each_preset {
    ($($name:ident $on:literal)*) => { $(
        mod $name {
            #[test]
            fn bundled_drawings() {
                super::bundled_drawings($on);
            }

            #[test]
            fn random_drawings() {
                super::random_drawings(&super::PRESETS[$on]);
            }
        }
    )* };
}

on_each_preset! { coaxial_arm 0 corexy_table 1 hbot_table 2 polar_robot 3 }

/// With jerk limits, from the drawing to the rows.
#[test]
fn random_drawings_on_a_corexy_with_jerk_limits() {
    random_drawings(&FILES[0]);
}

#[test]
fn random_drawings_on_an_arm_with_a_right_elbow() {
    random_drawings(&FILES[1]);
}

#[test]
fn random_drawings_on_an_arm_with_belt_ratio_2_and_negative_counts() {
    random_drawings(&FILES[2]);
}

/// The checks of this file find a step, a second and a third difference that is one tick too large.
#[test]
fn differences_beyond_the_limits_are_found() {
    let limits = [1e4, 1e5, 1e7]; // 100 + 1, 10 + 2 and 10 + 4 ticks at 10 ms
    let first_error = |limits: Limits, steps: &[i32]| {
        let mut differences = Differences::default();
        steps.iter().position(|step| differences.step(f64::from(*step), limits, 10_000).is_err())
    };
    assert_eq!(first_error(limits, &[6, 18, 24, 24, 18, 6, 0]), None);
    assert_eq!(first_error(limits, &[6, 19]), Some(1));
    assert_eq!(first_error([1e4, 1e9, 1e7], &[14, 43]), Some(1));
    assert_eq!(first_error([1e4, 1e9, 1e12], &[101, 102]), Some(1));
}
