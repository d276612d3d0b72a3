//! Benchmarks of stroke ordering: travel on generated drawings compared with references, and plan
//! durations on real drawings.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result};

/// Generated drawings: target travel, travel of vpype `--two-opt` and of LKH where known, mm.
const REFERENCES: [(&str, f64, Option<f64>, Option<f64>); 9] = [
    ("text_1k", 5000.0, Some(5475.0), Some(4954.5)),
    ("hatch_1k", 1370.0, Some(1392.0), Some(1317.8)),
    ("flow_1k", 4790.0, Some(5294.0), Some(4672.8)),
    ("text_10k", 17_000.0, Some(18_144.0), None),
    ("hatch_10k", 4900.0, Some(5059.0), None),
    ("flow_10k", 15_950.0, Some(17_355.0), None),
    ("text_100k", 51_500.0, None, None),
    ("hatch_100k", 19_000.0, None, None),
    ("flow_100k", 53_000.0, None, None),
];

/// Runs the generator (a Python script that needs numpy) and orders its drawings; true if every
/// target is met.
pub(crate) fn bench(generator: &Path) -> Result<bool> {
    let work = tempfile::tempdir()?;
    let generator =
        generator.canonicalize().with_context(|| format!("no generator {}", generator.display()))?;
    let made = Command::new("python3")
        .arg(&generator)
        .current_dir(work.path())
        .output()
        .context("cannot run python3")?;
    anyhow::ensure!(
        made.status.success(),
        "the generator failed:\n{}",
        String::from_utf8_lossy(&made.stderr)
    );
    let binary = crate::programs::build("release")?;
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let mut met = true;
    for (name, target, vpype, lkh) in REFERENCES {
        let run = Command::new(&cargo)
            .args([
                "run",
                "--quiet",
                "--release",
                "--package",
                "plotplan-ordering",
                "--example",
                "bench_order",
                "--",
            ])
            .arg(work.path().join(format!("{name}.hpgl")))
            .current_dir(crate::top())
            .output()
            .context("cannot run cargo")?;
        anyhow::ensure!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let output = String::from_utf8_lossy(&run.stdout).trim().to_owned();
        let shown = |known: Option<f64>| known.map_or("-".into(), |mm| format!("{mm}"));
        println!("{output}\n    target {target}, vpype --two-opt {}, LKH {}", shown(vpype), shown(lkh));
        // vpype takes minutes for 100,000 strokes.
        if !name.ends_with("100k")
            && let Some((mm, seconds)) = self::vpype(&binary, &work.path().join(format!("{name}.hpgl")))
        {
            println!("    vpype --two-opt on this machine: {mm:.1} mm in {seconds:.1} s");
        }
        met &= travel_of(&output).is_some_and(|mm| mm <= target);
    }
    Ok(met)
}

/// The travel (mm) and the run time (s) of vpype; `None` if it is not installed. vpype reports
/// lengths in CSS pixels.
fn vpype(plotplan: &Path, drawing: &Path) -> Option<(f64, f64)> {
    let svg = drawing.with_extension("svg");
    let made =
        Command::new(plotplan).arg("convert").arg(drawing).args(["--format", "svg", "-o"]).arg(&svg).output();
    if !made.ok()?.status.success() {
        return None;
    }
    let started = std::time::Instant::now();
    let run =
        Command::new("vpype").arg("read").arg(&svg).args(["linesort", "--two-opt", "stat"]).output().ok()?;
    let seconds = started.elapsed().as_secs_f64();
    let output = String::from_utf8_lossy(&run.stdout);
    let pixels = output.lines().rev().find_map(|line| line.trim().strip_prefix("Pen-up length:"))?;
    Some((pixels.trim().parse::<f64>().ok()? * 25.4 / 96.0, seconds))
}

/// The last number followed by "mm" in the output of the example.
fn travel_of(output: &str) -> Option<f64> {
    let words: Vec<&str> = output.split_whitespace().collect();
    let before_unit = words.windows(2).filter(|pair| pair[1].starts_with("mm"));
    before_unit.filter_map(|pair| pair[0].parse().ok()).next_back()
}

/// Plans every drawing below a folder in file order and in optimized order, on two machines, and
/// prints a table of durations; true if no plan takes more than 0.5 s longer.
pub(crate) fn real(folder: &Path) -> Result<bool> {
    let binary = crate::programs::build("release")?;
    let mut drawings: Vec<PathBuf> = Vec::new();
    crate::corpus::find(folder, &mut drawings)?;
    drawings.sort();
    let mut never_worse = true;
    let mut sums = [[0.0; 2]; 2];
    for drawing in &drawings {
        let mut row = String::new();
        for (machine, sum) in ["coaxial", "corexy"].into_iter().zip(&mut sums) {
            let times = ["file", "optimize"].map(|order| duration(&binary, drawing, machine, order));
            let [Some(before), Some(after)] = times else { continue };
            never_worse &= after <= before + 0.5;
            (sum[0], sum[1]) = (sum[0] + before, sum[1] + after);
            let _ = write!(row, " | {before:.0} | {after:.0} | {:.1} %", 100.0 * (1.0 - after / before));
        }
        if !row.is_empty() {
            let name = drawing.file_name().unwrap_or_default().to_string_lossy();
            println!("| {name}{row} |");
        }
    }
    for (machine, [before, after]) in ["coaxial", "corexy"].into_iter().zip(sums) {
        println!(
            "all on {machine}: {before:.0} s in file order, {after:.0} s in optimized order, {:.1} % less",
            100.0 * (1.0 - after / before)
        );
    }
    Ok(never_worse)
}

/// The duration of the plan, s; `None` if the drawing cannot be planned.
fn duration(binary: &Path, drawing: &Path, machine: &str, order: &str) -> Option<f64> {
    let run = Command::new(binary)
        .arg("convert")
        .arg(drawing)
        .args(["--fit", "--machine", machine, "--order", order, "--format", "csv", "--report", "json", "-o"])
        .arg(if cfg!(windows) { "NUL" } else { "/dev/null" })
        .output()
        .ok()?;
    let stderr = String::from_utf8_lossy(&run.stderr);
    let report: serde_json::Value = serde_json::from_str(stderr.lines().last()?).ok()?;
    report["summary"]["duration_s"].as_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn travel_is_the_last_length() {
        assert_eq!(travel_of("text_1k: 891 strokes, 12930.1 mm -> 4986.2 mm in 0.7 s"), Some(4986.2));
        assert_eq!(travel_of("nothing"), None);
    }
}
