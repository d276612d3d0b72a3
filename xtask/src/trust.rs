//! Campaigns behind docs/trust.md: each is one entry of [`CAMPAIGNS`], runs with a seed, and prints what it
//! measured. `cargo xtask nightly` runs all of them with a new seed.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context as _, Result, bail, ensure};

use crate::fuzz::{Fuzzers, Run, TARGETS};
use crate::programs::{cpu_time_of_children, execute, has};

/// What a campaign is given.
#[derive(Clone, Copy, Debug)]
struct Scale {
    seed: u64,
    /// In per cent of the full campaign.
    percent: u64,
}

impl Scale {
    fn of(self, full: u64) -> u64 {
        (full * self.percent / 100).max(1)
    }

    /// Whether the campaigns only have to run: then no program is built as a release is, which takes longer than
    /// all campaigns together.
    fn is_short(self) -> bool {
        self.percent < 10
    }

    /// The program for a target: as released, or as the tests have it.
    fn program(self, target: &str) -> Result<PathBuf> {
        if !self.is_short() {
            crate::web::build()?;
            return crate::dist::build(target);
        }
        let mut command = Command::new("cargo");
        command.args(["build", "--profile", "test", "--locked"]);
        // The system's own program is what `cargo test --workspace` builds, with the same features.
        let folder = if target == crate::dist::NATIVE {
            command.args(["--workspace", "--bin", "plotplan"]);
            crate::top().join("target")
        } else {
            crate::dist::add(target)?;
            command.args(["-p", "plotplan", "--target", target]);
            crate::top().join("target").join(target)
        };
        execute(crate::dist::with_linker(&mut command))?;
        Ok(std::path::absolute(folder.join("debug/plotplan"))?)
    }
}

struct Campaign {
    name: &'static str,
    about: &'static str,
    run: fn(Scale) -> Result<()>,
}

const CAMPAIGNS: &[Campaign] = &[
    Campaign {
        name: "machines",
        about: "2,000 random machines with random drawings, laws, roundings and jerk limits, replayed independently",
        run: |scale| {
            let count = scale.of(2000);
            tests("campaigns", "random_machines_draw", scale, &[("PLOTPLAN_CAMPAIGN", count)])
        },
    },
    Campaign {
        name: "plans",
        about: "10,000 damaged plans: every harmful one refused by verify",
        run: |scale| {
            let count = scale.of(10_000);
            tests("campaigns", "damaged_plans", scale, &[("PLOTPLAN_CAMPAIGN_PLANS", count)])
        },
    },
    Campaign {
        name: "files",
        about: "200 kills at random times, full disk, read-only folder, hostile inputs under ulimit",
        run: |scale| tests("trust", "", scale, &[("PLOTPLAN_KILLS", scale.of(200))]),
    },
    Campaign {
        name: "disk",
        about: "a small tmpfs that fills up while plans are written (Linux, root)",
        run: small_disk,
    },
    Campaign {
        name: "bytes",
        about: "60 plans with the same bytes on x86-64, aarch64 (qemu) and wasm32 (Node.js)",
        run: same_bytes,
    },
    Campaign {
        name: "mutants",
        about: "cargo-mutants on kinematics, verify and the time law: a random share of the mutants",
        run: mutants,
    },
    Campaign { name: "fuzz", about: "2 CPU-hours over all fuzz targets", run: fuzz },
];

/// The list of campaigns, for the help.
pub(crate) fn list() -> String {
    let lines = CAMPAIGNS.iter().map(|campaign| format!("    {:10} {}", campaign.name, campaign.about));
    lines.collect::<Vec<_>>().join("\n")
}

/// Runs the named campaigns, or all of them. `--seed N` and `--percent P` may stand among the names.
pub(crate) fn run(arguments: &[&str]) -> Result<bool> {
    let mut scale = Scale { seed: 20_261_126, percent: 100 };
    let mut names = Vec::new();
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        let mut number =
            || rest.next().and_then(|text| text.parse().ok()).context("a number after an option");
        match *argument {
            "--seed" => scale.seed = number()?,
            "--percent" => scale.percent = number()?,
            name => names.push(name),
        }
    }
    for name in &names {
        ensure!(CAMPAIGNS.iter().any(|campaign| campaign.name == *name), "no campaign {name}:\n{}", list());
    }
    let mut report = String::new();
    let mut failed = false;
    for campaign in CAMPAIGNS.iter().filter(|campaign| names.is_empty() || names.contains(&campaign.name)) {
        println!("\n== {}: {}", campaign.name, campaign.about);
        let (start, cpu) = (Instant::now(), cpu_time_of_children());
        let result = (campaign.run)(scale);
        let seconds = start.elapsed().as_secs_f64();
        let cpu = cpu_time_of_children()
            .zip(cpu)
            .map_or(f64::NAN, |(end, start)| end.saturating_sub(start).as_secs_f64());
        failed |= result.is_err();
        let outcome = result.map_or_else(|error| format!("FAILED: {error:#}"), |()| "ok".to_owned());
        writeln!(report, "{:10} {seconds:7.0} s, {cpu:7.0} s of processor time  {outcome}", campaign.name)?;
    }
    println!("\nseed {}, {} % of the full campaigns\n{report}", scale.seed, scale.percent);
    if let Some(cpu) = cpu_time_of_children() {
        println!("{:.0} s of processor time, builds included", cpu.as_secs_f64());
    }
    Ok(!failed)
}

/// All campaigns with a seed of their own: the seconds since 1970, unless one is given. `--short` is one per
/// cent of each with programs that are quick to build, to see that all of them run.
pub(crate) fn nightly(arguments: &[&str]) -> Result<bool> {
    let seed = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH)?.as_secs().to_string();
    let mut all = vec!["--seed", &seed];
    for argument in arguments {
        all.extend(if *argument == "--short" {
            &["--percent", "1"][..]
        } else {
            std::slice::from_ref(argument)
        });
    }
    println!("a finding becomes a test named after it; its seed, case and files are printed");
    run(&all)
}

/// Runs tests of the program with settings in the environment.
fn tests(binary: &str, filter: &str, scale: Scale, settings: &[(&str, u64)]) -> Result<()> {
    let mut command = Command::new("cargo");
    command.args(["test", "--workspace", "--locked", "--test", binary, "--", "--nocapture", filter]);
    command.env("PLOTPLAN_SEED", scale.seed.to_string());
    for (name, value) in settings {
        command.env(name, value.to_string());
    }
    execute(&mut command)
}

/// Writes plans to a file system of 64 kB until it is full, three times with each format.
fn small_disk(scale: Scale) -> Result<()> {
    let program = std::path::absolute(scale.program(crate::dist::NATIVE)?)?;
    let folder = tempfile::tempdir()?;
    let mount = |command: &str, words: &[&str]| {
        execute(Command::new(command).args(words).arg(folder.path())).context("tmpfs needs root")
    };
    mount("mount", &["-t", "tmpfs", "-o", "size=64k", "tmpfs"])?;
    let result = fill(&program, folder.path());
    mount("umount", &[])?;
    result
}

fn fill(program: &Path, folder: &Path) -> Result<()> {
    let drawing = crate::top().join("examples/house.hpgl");
    for format in ["ticks", "csv", "json", "gcode-timed"] {
        let to = folder.join(format!("plan.{format}"));
        std::fs::write(&to, "as before")?;
        let mut command = Command::new(program);
        command.arg("convert").arg(&drawing).args(["-m", "coaxial", "--fit", "-f", format, "-o"]).arg(&to);
        let output = command.output()?;
        let said = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.code() == Some(3), "{format}: {}: {said}", output.status);
        ensure!(said.contains("No space left on device"), "{format}: {said}");
        ensure!(std::fs::read(&to)? == b"as before", "{format}: the old file changed");
        let names = std::fs::read_dir(folder)?.count();
        ensure!(names == 1, "{format}: {names} files");
        std::fs::remove_file(&to)?;
        println!("{format}: refused, the old file as before, nothing left");
    }
    Ok(())
}

/// Machines and drawings of [`same_bytes`]: 10 x 6 plans.
const BYTES_MACHINES: &str =
    "coaxial corexy hbot polar cartesian serial-arm scara brachiograph five-bar polargraph";
const BYTES_DRAWINGS: [&str; 6] = [
    "examples/house.hpgl",
    "examples/zot.hpgl",
    "examples/rings.svg",
    "tests/drawings/arcs.hpgl",
    "tests/drawings/pens.hpgl",
    "tests/drawings/labels.hpgl",
];

/// Plans by the programs of a release, for x86-64, for aarch64 under qemu, and by the studio's WebAssembly
/// module in Node.js: their tick lines must be the same. In a short campaign of one drawing.
fn same_bytes(scale: Scale) -> Result<()> {
    let programs = [
        ("x86-64", Vec::new(), scale.program(crate::dist::NATIVE)?),
        ("aarch64", vec!["qemu-aarch64"], scale.program("aarch64-unknown-linux-musl")?),
    ];
    if scale.is_short() {
        crate::web::build()?;
    }
    let drawings = &BYTES_DRAWINGS[..if scale.is_short() { 1 } else { BYTES_DRAWINGS.len() }];
    let mut names = Vec::new();
    let mut plans: BTreeMap<&str, Plans> = BTreeMap::new();
    let folder = tempfile::tempdir()?;
    for drawing in drawings {
        let name = drawing.rsplit('/').next().context("a name")?;
        std::fs::copy(crate::top().join(drawing), folder.path().join(name))?;
        names.push(name);
    }
    for (processor, runner, program) in &programs {
        let start = Instant::now();
        plans.insert(processor, made_by(runner, &std::path::absolute(program)?, folder.path(), &names)?);
        println!("{processor}: {:.1} s", start.elapsed().as_secs_f64());
    }
    let start = Instant::now();
    let mut node = Command::new("node");
    node.args(["xtask/src/plans.mjs", "target/studio"]).arg(folder.path()).arg(BYTES_MACHINES).args(&names);
    execute(&mut node)?;
    println!("wasm32: {:.1} s", start.elapsed().as_secs_f64());
    plans.insert("wasm32", written(folder.path(), &names)?);
    compared(&plans)
}

/// Tick lines by drawing and machine; `None`: refused.
type Plans = BTreeMap<String, Option<Vec<u8>>>;

/// The plans that a program makes, `runner` being what executes it.
fn made_by(runner: &[&str], program: &Path, folder: &Path, drawings: &[&str]) -> Result<Plans> {
    for (number, drawing) in drawings.iter().enumerate() {
        for machine in BYTES_MACHINES.split(' ') {
            let mut command = match runner {
                [first, rest @ ..] => {
                    let mut command = Command::new(first);
                    command.args(rest).arg(program);
                    command
                }
                [] => Command::new(program),
            };
            command.args(["convert", drawing, "-m", machine, "--fit", "--format", "ticks", "--quiet", "-o"]);
            command.arg(format!("{number}-{machine}.ticks"));
            let output = command.current_dir(folder).output().context("the program")?;
            let said = String::from_utf8_lossy(&output.stderr);
            ensure!(matches!(output.status.code(), Some(0 | 1)), "{machine} {drawing}: {said}");
        }
    }
    written(folder, drawings)
}

/// The plans in a folder, which are removed.
fn written(folder: &Path, drawings: &[&str]) -> Result<Plans> {
    let mut plans = Plans::new();
    for (number, drawing) in drawings.iter().enumerate() {
        for machine in BYTES_MACHINES.split(' ') {
            let file = folder.join(format!("{number}-{machine}.ticks"));
            let bytes = file.exists().then(|| std::fs::read(&file)).transpose()?;
            if bytes.is_some() {
                std::fs::remove_file(&file)?;
            }
            plans.insert(format!("{drawing} on {machine}"), bytes);
        }
    }
    Ok(plans)
}

fn compared(plans: &BTreeMap<&str, Plans>) -> Result<()> {
    let (name, first) = plans.first_key_value().context("no plans")?;
    let mut different = Vec::new();
    for (processor, others) in plans {
        for (plan, bytes) in first {
            if others[plan] != *bytes {
                different.push(format!("{plan}: {processor} differs from {name}"));
            }
        }
    }
    let planned = first.values().flatten().count();
    let refused: Vec<&str> =
        first.iter().filter(|(_, bytes)| bytes.is_none()).map(|(plan, _)| plan.as_str()).collect();
    println!("{planned} plans, {} bytes; refused: {refused:?}", first.values().flatten().flatten().count());
    ensure!(different.is_empty(), "{}", different.join("\n"));
    ensure!(planned == first.len(), "{planned} plans");
    println!("the same bytes on {} processors", plans.len());
    Ok(())
}

/// Packages whose tests must kill the mutants of files.
const MUTATED: &[(&str, &str)] = &[
    ("plotplan-kinematics", "crates/kinematics/src/**/*.rs"),
    ("plotplan-verify", "crates/verify/src/**/*.rs"),
    ("plotplan-planner", "crates/planner/src/time_parametrization/**/*.rs"),
];

/// Tests one share of the mutants, each by the tests of its own crate: a sixtieth at 100 %, another one with
/// each seed. All of them take a day. One run for all crates, so that what they depend on is built once;
/// little optimization, because a mutant is built for each of a few seconds of tests.
///
/// cargo-mutants works on a copy of the repository. What the copies depend on is built once in
/// `target/mutants/build`, whatever number of nights it serves.
fn mutants(scale: Scale) -> Result<()> {
    const SHARES: u64 = 60;
    /// So that a share of the 5,800 mutants has at least two.
    const MOST_SHARES: u64 = 2000;
    ensure!(has_mutants(), "cargo install cargo-mutants --locked");
    let shards = (SHARES * 100 / scale.percent.max(1)).clamp(1, MOST_SHARES);
    let out = std::path::absolute(crate::top().join("target/mutants"))?;
    let mut command = Command::new("cargo");
    command.args(["mutants", "--profile", "test", "--jobs", "1", "--no-times", "--colors", "never"]);
    command.args(["--shard", &format!("{}/{shards}", scale.seed % shards), "--sharding", "round-robin"]);
    command.args(["--timeout", "300", "--baseline", "skip", "--output"]).arg(&out);
    command.envs([("CARGO_INCREMENTAL", "1"), ("CARGO_PROFILE_TEST_DEBUG", "0")]);
    command.envs([("CARGO_PROFILE_TEST_OPT_LEVEL", "1"), ("CARGO_PROFILE_DEV_DEBUG", "0")]);
    command.env("CARGO_TARGET_DIR", out.join("build"));
    for (package, files) in MUTATED {
        command.args(["--package", package, "--file", files]);
    }
    println!("$ {command:?}");
    let status = command.current_dir(crate::top()).status().context("cargo mutants")?;
    // 2: some survived, 3: some timed out. Anything else is a failure of the tool.
    ensure!(matches!(status.code(), Some(0 | 2 | 3)), "{status}");
    let lines = |name: &str| {
        let text = std::fs::read_to_string(out.join("mutants.out").join(name)).unwrap_or_default();
        text.lines().map(str::to_owned).collect::<Vec<_>>()
    };
    let survivors = lines("missed.txt");
    for line in &survivors {
        println!("survived: {line}");
    }
    println!(
        "{} killed, {} timed out, {} do not build, {} survived, to be killed by a test or explained in docs/trust.md",
        lines("caught.txt").len(),
        lines("timeout.txt").len(),
        lines("unviable.txt").len(),
        survivors.len()
    );
    Ok(())
}

fn has_mutants() -> bool {
    Command::new("cargo").args(["mutants", "--version"]).output().is_ok_and(|output| output.status.success())
}

/// Fuzzes every target for its share of two CPU-hours, one after the other, in rounds of at most three
/// minutes, so that each has had its turn when the campaign is stopped.
fn fuzz(scale: Scale) -> Result<()> {
    const ROUND_S: f64 = 180.0;
    let fuzzers = Fuzzers::build()?;
    let share_s = scale.of(7200) as f64 / TARGETS.len() as f64;
    let mut used = vec![Run { executions: 0, cpu_s: 0.0 }; TARGETS.len()];
    for round in 0.. {
        if used.iter().all(|run| run.cpu_s >= share_s) {
            break;
        }
        for (target, used) in TARGETS.iter().zip(&mut used) {
            let rest_s = share_s - used.cpu_s;
            if rest_s <= 0.0 {
                continue;
            }
            let seconds = rest_s.clamp(1.0, ROUND_S).ceil() as u64;
            let run = fuzzers.run(target, seconds, Some(scale.seed.wrapping_add(round)))?;
            used.executions += run.executions;
            used.cpu_s += run.cpu_s;
            println!("{target:10} {:10} executions, {:.0} s of processor time", used.executions, used.cpu_s);
        }
    }
    let [executions, cpu_s] = used
        .iter()
        .fold([0.0, 0.0], |[executions, cpu_s], run| [executions + run.executions as f64, cpu_s + run.cpu_s]);
    println!("{executions} executions in {cpu_s:.0} s of processor time: no finding");
    Ok(())
}

/// What the campaigns need besides Rust: printed by `cargo xtask trust --needs`.
pub(crate) fn needs() -> Result<bool> {
    for (program, why) in [("qemu-aarch64", "bytes"), ("node", "bytes"), ("setpriv", "files")] {
        println!("{program:14} {} ({why})", if has(program) { "found" } else { "missing" });
    }
    println!("{:14} {} (mutants)", "cargo-mutants", if has_mutants() { "found" } else { "missing" });
    if !cfg!(target_os = "linux") {
        bail!("the campaigns are for Linux");
    }
    Ok(true)
}
