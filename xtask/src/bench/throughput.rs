//! `cargo xtask bench throughput`: CPU time of whole conversions of drawings of more than a megabyte, by step, beside
//! that of commit 5e26b6c.

use std::cell::RefCell;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, Result};
use compiler::import;
use compiler::machine_file::{MachineFile, PRESETS};
use compiler::pipeline::{self, Request, Step};
use planner::{PlacementOptions, Scale};

use super::{Random, request};
use crate::programs::{cpu_seconds, cpu_time};

/// A drawing on a machine.
struct Case {
    name: &'static str,
    machine: &'static str,
    make: fn() -> String,
    /// Whether it is scaled to the sheet.
    fit: bool,
    /// CPU time of `convert` by the program of commit 5e26b6c, measured with [`compare`] on the computer of
    /// docs/planning.md, s.
    before_s: f64,
    /// CPU time that a conversion may take there, s.
    goal_s: f64,
}

const CASES: [Case; 2] = [
    Case { name: "arcs", machine: "corexy", make: small_arcs, fit: false, before_s: 33.0, goal_s: 12.0 },
    Case { name: "streets", machine: "coaxial", make: street_map, fit: true, before_s: 8.3, goal_s: 4.0 },
];

/// Largest share of the verification.
const VERIFICATION: f64 = 0.2;

/// HP-GL units in a millimetre.
const UNITS_MM: f64 = 40.0;

/// Prints the table; true if all goals were met. `other` is another program that converts the same.
pub(super) fn run(other: Option<&Path>) -> Result<bool> {
    let mut met = true;
    for case in CASES {
        let text = (case.make)();
        let steps = steps(&case, &text)?;
        let all: f64 = steps.iter().map(|(_, seconds)| seconds).sum();
        println!("\n{} on {}, {:.2} MB", case.name, case.machine, text.len() as f64 * 1e-6);
        for (step, seconds) in &steps {
            println!("  {step:<12} {seconds:>7.2} s  {:>3.0} %", 100.0 * seconds / all);
        }
        let verification =
            steps.iter().find(|(step, _)| *step == "verifying").map_or(0.0, |step| step.1 / all);
        let before = other.map_or(Ok(case.before_s), |program| compare(program, &case, &text))?;
        let holds = all <= case.goal_s && verification <= VERIFICATION;
        met &= holds;
        println!(
            "  all          {all:>7.2} s of CPU; 5e26b6c {before:.2} s; goals: {} s, verification {:.0} %{}",
            case.goal_s,
            100.0 * VERIFICATION,
            if holds { "" } else { "   MISSED" }
        );
    }
    Ok(met)
}

/// CPU time of each step of a conversion to rows in memory, in the order in which they begin.
fn steps(case: &Case, text: &str) -> Result<Vec<(&'static str, f64)>> {
    let preset = PRESETS.iter().find(|preset| preset.name == case.machine).context("a preset")?;
    let machine = MachineFile::parse(preset.toml)?.machine()?;
    let placement = if case.fit {
        PlacementOptions { scale: Scale::Fit, ..PlacementOptions::default() }
    } else {
        PlacementOptions::default()
    };
    let request = Request { placement, ..request() };
    let begun = RefCell::new(vec![("reading", process_cpu_s()?)]);
    let begin = |step: &'static str| {
        let mut begun = begun.borrow_mut();
        if begun.last().is_none_or(|(last, _)| *last != step) {
            begun.push((step, process_cpu_s().unwrap_or(f64::NAN)));
        }
    };
    let document = import::read(text.as_bytes(), &import::Options::default())?;
    let compiled = pipeline::compile(&document.pages[0].drawing, &machine, &request, &|step| {
        begin(match step {
            Step::Placing => "placing",
            Step::Ordering(..) => "ordering",
            Step::Planning(..) => "planning",
            Step::Verifying(..) => "verifying",
        });
    })?;
    begin("writing");
    let times = compiled.trajectory.times();
    let rows = compiled.trajectory.rows().map(|row| row.row);
    plan::file::csv::write(&compiled.header, rows, &mut std::io::sink())?;
    begin("end");
    println!(
        "\n{}: {} strokes, {:.1} m of ink, {:.0} s, {} rows, certificate {}",
        case.name,
        compiled.strokes,
        document.pages[0].drawing.length() * 1e-3,
        times.drawing_s + times.travel_s,
        compiled.trajectory.row_count(),
        if compiled.certificate.holds { "holds" } else { "does not hold" },
    );
    let begun = begun.into_inner();
    Ok(begun.windows(2).map(|pair| (pair[0].0, pair[1].1 - pair[0].1)).collect())
}

/// CPU time of all threads of this process, s, to 10 ms.
fn process_cpu_s() -> Result<f64> {
    Ok(cpu_time(std::process::id()).context("CPU time needs Linux")?.as_secs_f64())
}

/// CPU time of `convert` by another program, s.
fn compare(program: &Path, case: &Case, text: &str) -> Result<f64> {
    let folder = tempfile::tempdir()?;
    let drawing = folder.path().join("drawing.hpgl");
    std::fs::write(&drawing, text)?;
    let mut command = Command::new(program);
    command.arg("convert").arg(&drawing).args(["--machine", case.machine, "--format", "csv", "--quiet"]);
    if case.fit {
        command.arg("--fit");
    }
    cpu_seconds(command.arg("--output").arg(folder.path().join("plan.csv")))
}

/// 32,612 arcs of 2.2 mm in the mean, about 1.6 MB: rows of small arcs like the scales of a fish.
fn small_arcs() -> String {
    const ARCS: u32 = 32_612;
    const PER_ROW: u32 = 140;
    let mut random = Random(15);
    let mut text = "IN;SP1;\n".to_owned();
    for index in 0..ARCS {
        let (column, row) = (f64::from(index % PER_ROW), f64::from(index / PER_ROW));
        let radius = (0.4 + random.up_to(0.8)) * UNITS_MM;
        let (x, y) = ((3.0 + 1.35 * column) * UNITS_MM, (3.0 + 0.75 * row) * UNITS_MM);
        let start = random.up_to(TAU);
        let sweep = 60.0 + random.up_to(200.0);
        let (from_x, from_y) = (x + radius * start.cos(), y + radius * start.sin());
        writeln!(text, "PU{from_x:.2},{from_y:.2};PD;AA{x:.2},{y:.2},{sweep:.3};").expect("text in memory");
    }
    text + "PU;SP0;\n"
}

/// Streets of a town, 1.25 MB: winding polylines of 2 to 60 points, a third of them closed (houses).
fn street_map() -> String {
    const BYTES: usize = 1_250_000;
    const SIDE: f64 = 10_000.0;
    let mut random = Random(16);
    let mut text = "IN;SP1;\n".to_owned();
    while text.len() < BYTES {
        let (mut x, mut y) = (random.up_to(SIDE), random.up_to(SIDE));
        let mut heading = random.up_to(TAU);
        let is_house = random.up_to(3.0) < 1.0;
        let (count, step) =
            if is_house { (4, 20.0 + random.up_to(60.0)) } else { (2 + random.up_to(58.0) as u32, 60.0) };
        write!(text, "PU{x:.0},{y:.0};PD").expect("text in memory");
        for point in 0..count {
            heading += if is_house { FRAC_PI_2 } else { random.up_to(0.6) - 0.3 };
            let length = if is_house { step } else { random.up_to(step) + 5.0 };
            x = (x + length * heading.cos()).clamp(0.0, SIDE);
            y = (y + length * heading.sin()).clamp(0.0, SIDE);
            write!(text, "{}{x:.0},{y:.0}", if point == 0 { "" } else { "," }).expect("text in memory");
        }
        text += ";\n";
    }
    text + "PU;SP0;\n"
}
