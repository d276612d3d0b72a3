//! Fuzzing: `fuzz/fuzz_targets`, built once with the project's own compiler, each run from the project's own
//! files. `cargo fuzz` builds the same targets with nightly Rust and the address sanitizer; without unsafe
//! code of our own, panics, overflows, endless loops and memory are what is looked for, and coverage is all
//! that needs instrumentation.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Context as _, Result, bail, ensure};

use crate::programs::{cpu_seconds_in, execute, text_of, timed};

/// One file of `fuzz/fuzz_targets` each.
pub(crate) const TARGETS: &[&str] = &["read", "emit", "svg", "recognize", "plans", "machines", "answers"];

/// Coverage of edges and of compared values, as libFuzzer wants it; the flags of `cargo fuzz`.
const INSTRUMENTATION: &str = "--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
     -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
     -Cllvm-args=-sanitizer-coverage-trace-compares";

/// The targets, ready to run.
pub(crate) struct Fuzzers {
    folder: PathBuf,
}

/// What a run of a target did.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    pub(crate) executions: u64,
    /// Processor time of the run, s.
    pub(crate) cpu_s: f64,
}

impl Fuzzers {
    /// Builds all targets.
    pub(crate) fn build() -> Result<Self> {
        let about = text_of(Command::new("rustc").arg("-vV"))?;
        let host = about.lines().find_map(|line| line.strip_prefix("host: ")).context("rustc -vV")?;
        let mut command = Command::new("cargo");
        command.args(["build", "--manifest-path", "fuzz/Cargo.toml", "--release", "--bins", "--locked"]);
        // With a target, the flags are not those of build scripts and macros.
        execute(command.args(["--target", host]).env("RUSTFLAGS", INSTRUMENTATION))?;
        Ok(Self { folder: crate::top().join("fuzz/target").join(host).join("release") })
    }

    /// Runs one target from the project's own files and what earlier runs found. Fails with its finding.
    pub(crate) fn run(&self, target: &str, seconds: u64, seed: Option<u64>) -> Result<Run> {
        let corpus = crate::top().join("fuzz/corpus").join(target);
        let found = crate::top().join("fuzz/artifacts").join(target);
        for folder in [&corpus, &found] {
            std::fs::create_dir_all(folder).with_context(|| format!("{}", folder.display()))?;
        }
        let (folders, extensions, dictionary): (&[_], &[_], _) = match target {
            "svg" => (&["examples"], &["svg"], Some("svg.dict")),
            "recognize" => (&["examples", "tests/drawings"], &["hpgl", "pcl", "svg"], Some("svg.dict")),
            "plans" => (&["fuzz/seeds"], &["csv", "ticks"], None),
            "machines" => (&["crates/compiler/machines", "tests/machines"], &["toml"], None),
            "answers" => (&["fuzz/seeds"], &["answers"], None),
            _ => (&["examples", "tests/drawings"], &["hpgl", "pcl"], Some("hpgl.dict")),
        };
        for folder in folders {
            copy_files(&crate::top().join(folder), &corpus, extensions)?;
        }
        let mut command = Command::new(self.folder.join(target));
        command.arg(&corpus).arg(format!("-artifact_prefix={}/", found.display()));
        command.args(["-max_len=4096", "-timeout=20", "-print_final_stats=1"]);
        command.arg(format!("-max_total_time={seconds}"));
        command.args(dictionary.map(|file| format!("-dict=fuzz/{file}")));
        command.args(seed.map(|seed| format!("-seed={}", seed as u32)));
        let output = timed(&command).current_dir(crate::top()).output().with_context(|| target.to_owned())?;
        let said = String::from_utf8_lossy(&output.stderr);
        if !output.status.success() {
            let end: Vec<&str> = said.lines().rev().take(60).collect();
            let end: Vec<&str> = end.into_iter().rev().collect();
            bail!("{target}: {}: the input is in fuzz/artifacts/{target}\n{}", output.status, end.join("\n"));
        }
        let number = |label: &str| said.lines().rev().find_map(|line| line.strip_prefix(label));
        let executions = number("stat::number_of_executed_units:").context("no number of executions")?;
        Ok(Run {
            executions: executions.trim().parse()?,
            cpu_s: cpu_seconds_in(&said).context("no processor time")?,
        })
    }

    /// Runs all targets, one on each core.
    pub(crate) fn run_all(&self, seconds: u64) -> Result<()> {
        let next = AtomicUsize::new(0);
        let failures = Mutex::new(Vec::new());
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        std::thread::scope(|scope| {
            for _ in 0..cores {
                scope.spawn(|| {
                    while let Some(target) = TARGETS.get(next.fetch_add(1, Ordering::Relaxed)) {
                        match self.run(target, seconds, None) {
                            Ok(Run { executions, cpu_s }) => {
                                println!(
                                    "{target:10} {executions:8} executions, {cpu_s:.1} s of processor time"
                                );
                            }
                            Err(error) => failures.lock().expect("no panic").push(format!("{error:#}")),
                        }
                    }
                });
            }
        });
        let failures = failures.into_inner().expect("no panic");
        ensure!(failures.is_empty(), "{}", failures.join("\n"));
        Ok(())
    }
}

fn copy_files(from: &Path, to: &Path, extensions: &[&str]) -> Result<()> {
    let mut copied = 0;
    for entry in std::fs::read_dir(from).with_context(|| format!("{}", from.display()))? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| extensions.iter().any(|known| e == *known)) {
            let name = path.file_name().context("a file without a name")?;
            std::fs::copy(&path, to.join(name)).with_context(|| format!("{}", path.display()))?;
            copied += 1;
        }
    }
    ensure!(copied > 0, "no files of {extensions:?} in {}", from.display());
    Ok(())
}
