//! Campaigns behind docs/trust.md: each is one entry of [`CAMPAIGNS`], runs with a seed, and prints what it
//! measured. `cargo xtask nightly` runs all of them with a new seed.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context as _, Result, bail, ensure};

use crate::programs::{execute, has, output_of, text_of};

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
        let start = Instant::now();
        let result = (campaign.run)(scale);
        let seconds = start.elapsed().as_secs_f64();
        failed |= result.is_err();
        let outcome = result.map_or_else(|error| format!("FAILED: {error:#}"), |()| "ok".to_owned());
        writeln!(report, "{:10} {seconds:7.0} s  {outcome}", campaign.name)?;
    }
    println!("\nseed {}, {} % of the full campaigns\n{report}", scale.seed, scale.percent);
    Ok(!failed)
}

/// All campaigns with a seed of their own: the seconds since 1970, unless one is given.
pub(crate) fn nightly(arguments: &[&str]) -> Result<bool> {
    let seed = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH)?.as_secs().to_string();
    let mut all = vec!["--seed", &seed];
    all.extend(arguments);
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
fn small_disk(_scale: Scale) -> Result<()> {
    let program = release()?;
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

/// The release build of the program.
fn release() -> Result<PathBuf> {
    execute(Command::new("cargo").args(["build", "--release", "--locked", "-p", "plotplan"]))?;
    Ok(crate::top().join("target/release/plotplan"))
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

/// Targets of [`same_bytes`], each with what runs its programs.
const BYTES_TARGETS: [(&str, &[&str]); 3] = [
    ("x86_64-unknown-linux-musl", &[]),
    ("aarch64-unknown-linux-musl", &["qemu-aarch64"]),
    ("wasm32-wasip1", &["node", "--no-warnings", "xtask/src/wasi.mjs"]),
];

/// Plans by `crates/compiler/examples/digests.rs` on every target; prints the SHA-256 of their rows.
fn same_bytes(_scale: Scale) -> Result<()> {
    let top = crate::top();
    let mut digests: BTreeMap<&str, String> = BTreeMap::new();
    for (target, runner) in BYTES_TARGETS {
        execute(Command::new("rustup").args(["target", "add", target]))?;
        let mut build = Command::new("cargo");
        build.args(["build", "--release", "--locked", "-p", "plotplan-compiler", "--example", "digests"]);
        build.args(["--target", target]);
        // Pure Rust: the linker of Rust is enough, without a C compiler for the target.
        build.env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_LINKER", "rust-lld");
        execute(&mut build)?;
        let extension = if target.starts_with("wasm") { ".wasm" } else { "" };
        let program = format!("target/{target}/release/examples/digests{extension}");
        let mut words: Vec<&str> = runner.to_vec();
        words.push(&program);
        let mut command = Command::new(words[0]);
        command.args(&words[1..]).arg(BYTES_MACHINES).args(BYTES_DRAWINGS).current_dir(&top);
        let start = Instant::now();
        digests.insert(target, text_of(&mut command)?);
        println!("{target}: {:.1} s", start.elapsed().as_secs_f64());
    }
    let first = &digests[BYTES_TARGETS[0].0];
    let plans = first.lines().filter(|line| !line.ends_with("refused")).count();
    for (target, text) in &digests {
        for (a, b) in first.lines().zip(text.lines()) {
            ensure!(a == b, "{target}:\n{a}\n{b}");
        }
        ensure!(text == first, "{target}: {} lines", text.lines().count());
    }
    println!("{plans} plans of {} have the same bytes on {} targets", first.lines().count(), digests.len());
    ensure!(plans >= 60, "{plans} plans");
    Ok(())
}

/// Files whose mutants are tested, and the tests that must kill them.
const MUTATED: &[(&str, &[&str])] = &[
    ("plotplan-kinematics", &["crates/kinematics/src/**/*.rs"]),
    ("plotplan-verify", &["crates/verify/src/**/*.rs"]),
    ("plotplan-planner", &["crates/planner/src/time_parametrization/**/*.rs"]),
];

/// Tests one share of the mutants of each crate by that crate's own tests: a sixtieth at 100 %, another one
/// with each seed. All of them take a day.
fn mutants(scale: Scale) -> Result<()> {
    const SHARES: u64 = 60;
    ensure!(has_mutants(), "cargo install cargo-mutants --locked");
    let shards = (SHARES * 100 / scale.percent.max(1)).max(1);
    let out = crate::top().join("target/mutants");
    let mut survivors = 0;
    for (package, files) in MUTATED {
        let mut command = Command::new("cargo");
        command.args(["mutants", "--package", package, "--profile", "test", "--jobs", "1", "--no-times"]);
        command.args(["--shard", &format!("{}/{shards}", scale.seed % shards)]);
        command
            .args(["--timeout", "300", "--baseline", "skip", "--colors", "never", "--output"])
            .arg(out.join(package));
        for file in *files {
            command.args(["--file", file]);
        }
        println!("$ {command:?}");
        let status = command.current_dir(crate::top()).status().context("cargo mutants")?;
        // 2: some survived, 3: some timed out. Anything else is a failure of the tool.
        ensure!(matches!(status.code(), Some(0 | 2 | 3)), "{package}: {status}");
        let missed = out.join(package).join("mutants.out/missed.txt");
        for line in std::fs::read_to_string(&missed).unwrap_or_default().lines() {
            println!("survived: {line}");
            survivors += 1;
        }
    }
    println!("{survivors} survivors, to be killed by a test or explained in docs/trust.md");
    Ok(())
}

fn has_mutants() -> bool {
    Command::new("cargo").args(["mutants", "--version"]).output().is_ok_and(|output| output.status.success())
}

/// Fuzzes every target for its share of two CPU-hours, one after the other.
fn fuzz(scale: Scale) -> Result<()> {
    let targets = crate::ci::FUZZ_TARGETS;
    let seconds = scale.of(7200) / targets.len() as u64;
    for target in targets {
        crate::ci::fuzz_target(target, seconds.try_into()?, Some(scale.seed))?;
    }
    Ok(())
}

/// What the campaigns need besides Rust: printed by `cargo xtask trust --needs`.
pub(crate) fn needs() -> Result<bool> {
    for (program, why) in [("qemu-aarch64", "bytes"), ("node", "bytes"), ("setpriv", "files")] {
        println!("{program:14} {} ({why})", if has(program) { "found" } else { "missing" });
    }
    println!("{:14} {} (mutants)", "cargo-mutants", if has_mutants() { "found" } else { "missing" });
    let nightly = output_of(Command::new("cargo").args(["+nightly", "fuzz", "--version"])).is_ok();
    println!("{:14} {} (fuzz)", "cargo-fuzz", if nightly { "found" } else { "missing" });
    if !cfg!(target_os = "linux") {
        bail!("the campaigns are for Linux");
    }
    Ok(true)
}
