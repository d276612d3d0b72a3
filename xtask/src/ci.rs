//! Every check that a change must pass: `cargo xtask ci`, which `.ci/run` calls.

use std::process::Command;
use std::time::Instant;

use anyhow::{Context as _, Result, ensure};

/// One check: name, description and function. The function returns an error if the check fails.
struct Step {
    name: &'static str,
    about: &'static str,
    check: fn() -> Result<()>,
    /// Whether `cargo xtask ci` without arguments includes the step.
    by_default: bool,
}

const fn step(name: &'static str, about: &'static str, check: fn() -> Result<()>) -> Step {
    Step { name, about, check, by_default: true }
}

const fn on_request(name: &'static str, about: &'static str, check: fn() -> Result<()>) -> Step {
    Step { name, about, check, by_default: false }
}

/// All steps, in the order in which they run.
const STEPS: &[Step] = &[
    step("fmt", "formatting", || cargo("fmt --all --check")),
    step("tidy", "dependency rules and file checks", tidy),
    step("clippy", "lints", || cargo("clippy --workspace --all-targets --locked -- -D warnings")),
    step("doc", "documentation builds without warnings", doc),
    step("test", "the test command of the README; installs gcc-avr and avr-libc if missing", test),
    step("web", "the studio builds for WebAssembly", || crate::web::build().map(|_| ())),
    step("windows", "the program compiles for Windows", || check("x86_64-pc-windows-gnu", "plotplan")),
    step("macos", "the program compiles for macOS", || check("aarch64-apple-darwin", "plotplan")),
    step("package", "every crate can be packaged", || {
        cargo("package --workspace --exclude xtask --no-verify --locked --allow-dirty --quiet")
    }),
    step("corpus", "every drawing of ../shared/corpus, where it exists", corpus),
    step("web-test", "animated previews in a browser; installs Node.js, npm packages and Chromium", web_test),
    step("fuzz", "8 s of fuzzing for each target", fuzz),
    on_request("firmware", "the firmware on an emulated ATmega328P; installs Debian packages", firmware),
    on_request("verify-package", "every crate builds from its package", || {
        cargo("package --workspace --exclude xtask --locked --allow-dirty")
    }),
    on_request("typos", "spelling; needs typos-cli", || run("typos", "")),
    on_request("deny", "licences, bans and sources; needs cargo-deny", || {
        cargo("deny --workspace check bans licenses sources")
    }),
];

/// Default seed of the property tests: a failure in CI reproduces locally. The nightly workflow sets
/// other seeds.
const PROPTEST_SEED: &str = "20261122";

/// Seconds for each fuzz target (`fuzz/fuzz_targets`).
const FUZZ_SECONDS: u64 = 8;

/// Runs the named steps, or the default ones, up to the first failure; prints the time of each.
pub(crate) fn run_steps(names: &[&str]) -> Result<bool> {
    for name in names {
        ensure!(STEPS.iter().any(|step| step.name == *name), "no step {name}; steps are:\n{}", list());
    }
    let mut times = Vec::new();
    for step in STEPS {
        if !(names.contains(&step.name) || names.is_empty() && step.by_default) {
            continue;
        }
        println!("\n== {}: {}", step.name, step.about);
        let start = Instant::now();
        let result = (step.check)();
        times.push((step.name, start.elapsed().as_secs_f64()));
        if let Err(error) = result {
            summarize(&times);
            eprintln!("\nFAILED: {}: {error:#}", step.name);
            return Ok(false);
        }
    }
    summarize(&times);
    Ok(true)
}

/// Names and descriptions of all steps.
pub(crate) fn list() -> String {
    let line = |step: &Step| {
        let note = if step.by_default { "" } else { " (only if named)" };
        format!("    {:14} {}{note}", step.name, step.about)
    };
    STEPS.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn summarize(times: &[(&str, f64)]) {
    println!();
    for (name, seconds) in times {
        println!("{name:8} {seconds:6.0} s");
    }
    println!("{:8} {:6.0} s", "total", times.iter().map(|(_, seconds)| seconds).sum::<f64>());
}

/// Runs `cargo` with arguments separated by blanks, at the top of the repository.
fn cargo(arguments: &str) -> Result<()> {
    run("cargo", arguments)
}

fn run(program: &str, arguments: &str) -> Result<()> {
    execute(Command::new(program).args(arguments.split_whitespace()))
}

fn execute(command: &mut Command) -> Result<()> {
    let arguments: Vec<_> = command.get_args().map(|argument| argument.to_string_lossy()).collect();
    let line = format!("{} {}", command.get_program().to_string_lossy(), arguments.join(" "));
    println!("$ {line}");
    command.current_dir(crate::top()).env("INSTA_UPDATE", "no");
    // Everything is built once: without the data of incremental builds that takes a sixth less CPU time.
    command.env("CARGO_INCREMENTAL", "0");
    // Debuggers do not run here: a build without their data is a tenth shorter.
    for profile in ["DEV", "TEST"] {
        command.env(format!("CARGO_PROFILE_{profile}_DEBUG"), "0");
    }
    if std::env::var_os("PROPTEST_RNG_SEED").is_none() {
        command.env("PROPTEST_RNG_SEED", PROPTEST_SEED);
    }
    let status = command.status().with_context(|| format!("cannot run {line}"))?;
    ensure!(status.success(), "{line}: {status}");
    Ok(())
}

/// Whether a command runs and succeeds; its output is discarded.
fn succeeds(program: &str, arguments: &str) -> bool {
    Command::new(program)
        .args(arguments.split_whitespace())
        .current_dir(crate::top())
        .output()
        .is_ok_and(|output| output.status.success())
}

/// All tests. Those of the C reader in docs/tick-lines.md need compilers, which apt installs: their
/// absence is a failure here, and a skipped test elsewhere.
fn test() -> Result<()> {
    if cfg!(target_os = "linux") {
        if !succeeds("avr-gcc", "--version") {
            let as_root = if succeeds("sudo", "--version") { "sudo " } else { "" };
            let install = format!("{as_root}apt-get install --yes --no-install-recommends gcc-avr avr-libc");
            let (program, arguments) = install.split_once(' ').unwrap_or_default();
            run(program, arguments).context("the tests need gcc-avr and avr-libc")?;
        }
        // Tests of ports, terminals and emulated chips wait most of their time: others run meanwhile.
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let mut command = Command::new("cargo");
        command.args(["test", "--workspace", "--locked"]);
        command.env("RUST_TEST_THREADS", (3 * cores).to_string());
        return execute(command.env("PLOTPLAN_REQUIRE_COMPILERS", "1"));
    }
    cargo("test --workspace --locked")
}

fn tidy() -> Result<()> {
    ensure!(crate::tidy::run()?, "see the complaints above");
    Ok(())
}

fn firmware() -> Result<()> {
    ensure!(crate::firmware::run(&[])?, "see the checks above");
    Ok(())
}

fn doc() -> Result<()> {
    execute(
        Command::new("cargo")
            .args(["doc", "--workspace", "--no-deps", "--locked"])
            .env("RUSTDOCFLAGS", "-D warnings"),
    )
}

/// Type-checks a package for another target. No linker or C compiler for the target is needed.
fn check(target: &str, package: &str) -> Result<()> {
    add_target(target)?;
    cargo(&format!("check --locked --target {target} -p {package}"))
}

/// Installs the standard library of a target if it is missing.
pub(crate) fn add_target(target: &str) -> Result<()> {
    let installed = Command::new("rustup")
        .args(["target", "list", "--installed"])
        .current_dir(crate::top())
        .output()
        .context("cannot run rustup, which installs the standard library of other targets")?;
    if !String::from_utf8_lossy(&installed.stdout).lines().any(|line| line == target) {
        run("rustup", &format!("target add {target}"))?;
    }
    Ok(())
}

fn corpus() -> Result<()> {
    let folder = crate::top().join("../shared/corpus");
    if !folder.is_dir() {
        println!("no corpus at ../shared/corpus: nothing to check");
        return Ok(());
    }
    ensure!(crate::corpus::run(&folder, false)?, "see the drawings above");
    Ok(())
}

fn web_test() -> Result<()> {
    ensure!(crate::web_test::run(None, false)?, "see the tests above");
    Ok(())
}

/// Fuzzes every target from the project's own files.
fn fuzz() -> Result<()> {
    crate::fuzz::Fuzzers::build()?.run_all(FUZZ_SECONDS)
}
