//! `cargo xtask bench large [PROGRAM]`: CPU time and peak memory of whole plans of 1, 10 and 100 MB of text.
//!
//! Takes more than half an hour of CPU.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context as _, Result};

use super::{inputs, read};

const SIZES: [usize; 3] = [1_000_000, 10_000_000, 100_000_000];
/// Of CPU time, from the smallest size to each other one.
const GROWTH: f64 = 1.05;
const MEMORY_BYTES: f64 = 2e9;

/// Plans each size with `program`, by default the released one, and prints a table; true if every goal is
/// met.
pub(super) fn run(program: Option<&Path>) -> Result<bool> {
    let program = program.map_or_else(released, |program| Ok(std::path::absolute(program)?))?;
    let work = tempfile::tempdir()?;
    let mut first: Option<f64> = None;
    let mut met = true;
    println!("{:<10} {:>9} {:>9} {:>11}", "text", "CPU s", "exponent", "memory MB");
    for size in SIZES {
        let file = work.path().join("text.plt");
        std::fs::write(&file, inputs::text_of(size))?;
        let (seconds, memory) = plan(&program, &file, &work.path().join("text.tick"))?;
        let least = *first.get_or_insert(seconds);
        let exponent = (seconds / least).ln() / (size as f64 / SIZES[0] as f64).ln();
        let missed = exponent > GROWTH || memory > MEMORY_BYTES;
        met &= !missed;
        print!("{:<10} {seconds:>9.1} ", format!("{} MB", size / 1_000_000));
        if size == SIZES[0] {
            print!("{:>9}", "-");
        } else {
            print!("{exponent:>9.3}");
        }
        println!(" {:>11.0}{}", 1e-6 * memory, if missed { "   MISSED" } else { "" });
        std::io::stdout().flush()?;
    }
    Ok(met)
}

/// The released program, built.
fn released() -> Result<PathBuf> {
    let built = Command::new(env!("CARGO"))
        .args(["build", "--quiet", "--release", "--package", "plotplan"])
        .current_dir(crate::top())
        .status()
        .context("cannot run cargo")?;
    anyhow::ensure!(built.success(), "plotplan does not build");
    Ok(crate::top().join("target/release/plotplan"))
}

/// CPU time, s, and peak memory, bytes, of one plan.
fn plan(program: &Path, file: &Path, output: &Path) -> Result<(f64, f64)> {
    let before = read::children().context("this system does not report CPU time")?;
    let mut child = Command::new(program)
        .arg("convert")
        .arg(file)
        .args(["--machine", "corexy", "--fit", "-o"])
        .arg(output)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .with_context(|| format!("cannot run {}", program.display()))?;
    // The peak is that of the last look: the largest lists are dropped long before the end.
    let mut peak = 0.0;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        peak = read::peak_bytes(&format!("/proc/{}/status", child.id())).unwrap_or(peak);
        std::thread::sleep(Duration::from_millis(20));
    };
    anyhow::ensure!(status.success(), "the plan of {} fails", file.display());
    std::fs::remove_file(output)?;
    Ok((read::children().unwrap_or(before) - before, peak))
}
