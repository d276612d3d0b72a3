//! Runs the program over every drawing below a folder: `check`, and `convert --fit` on two machines, or with
//! limits of jerk on three.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};
use compiler::machine_file::PRESETS;

use crate::programs::{build, cpu_time};

/// Limit of one run's CPU time. The slowest drawings take 7 s beside one other run, and up to 10.4 s where
/// more programs share the cores.
const LIMIT: Duration = Duration::from_secs(20);

/// Additional time for each kilometre of ink: a plan of six kilometres takes two days to draw. It has
/// 1.9 million rows a kilometre, and the choice of ticks along the path takes 3 to 5 us a row.
const LIMIT_A_KILOMETRE: Duration = Duration::from_secs(30);

/// A run may wait this many times longer than it may compute.
const WAIT: u32 = 4;
const MACHINES: [&str; 2] = ["coaxial", "polar"];
const JERK_MACHINES: [&str; 3] = ["coaxial", "polar", "corexy"];
/// Time in which the machines of `--jerk` build up their acceleration, s.
const BUILD_UP_S: f64 = 0.05;
/// With limits of jerk a plan takes this many times longer at most.
const JERK_LIMIT: u32 = 4;

/// What every drawing is run with.
struct Runs {
    binary: PathBuf,
    /// Names for the table, and what `--machine` gets.
    machines: Vec<(&'static str, PathBuf)>,
    /// On a plan: a whole number of times of [`LIMIT`] and [`LIMIT_A_KILOMETRE`].
    limit: u32,
}

impl Runs {
    fn new(jerk: bool, work: &Path) -> Result<Self> {
        let binary = build("quick")?;
        if !jerk {
            let machines = MACHINES.map(|name| (name, PathBuf::from(name))).into();
            return Ok(Self { binary, machines, limit: 1 });
        }
        let mut machines = Vec::new();
        for name in JERK_MACHINES {
            let preset = PRESETS.iter().find(|preset| preset.name == name).context("a preset")?;
            let file = work.join(format!("{name}.toml"));
            std::fs::write(&file, with_jerk(preset.toml)?)?;
            machines.push((name, file));
        }
        Ok(Self { binary, machines, limit: JERK_LIMIT })
    }
}

/// A machine file with a limit of jerk for every motor.
fn with_jerk(machine: &str) -> Result<String> {
    let mut text = String::new();
    let mut motors = 0;
    for line in machine.lines() {
        writeln!(text, "{line}")?;
        let Some(value) = line.strip_prefix("max_acceleration = \"") else { continue };
        let end = value.find(|c: char| !(c.is_ascii_digit() || c == '.')).context("a unit")?;
        let unit = value[end..].split("/s2").next().context("an acceleration")?;
        writeln!(text, "max_jerk = \"{}{unit}/s3\"", value[..end].parse::<f64>()? / BUILD_UP_S)?;
        motors += 1;
    }
    anyhow::ensure!(motors == 2, "{motors} accelerations in\n{machine}");
    Ok(text)
}
const ENDINGS: [&str; 5] = ["hpgl", "plt", "hpg", "hp", "pcl"];

/// The result of one run of the binary.
#[derive(Debug)]
struct Run {
    /// `None` if it was stopped at the time limit.
    exit: Option<i32>,
    /// CPU time where the system reports it, otherwise the time it took, s.
    seconds: f64,
    stderr: String,
    stdout: String,
    /// Whether it left an output file.
    wrote: bool,
}

/// Prints a table and a summary; true if no run failed.
pub(crate) fn run(folder: &Path, jerk: bool) -> Result<bool> {
    let mut drawings = Vec::new();
    find(folder, &mut drawings)?;
    drawings.sort();
    anyhow::ensure!(!drawings.is_empty(), "no drawings below {}", folder.display());
    let work = tempfile::tempdir()?;
    let runs = Runs::new(jerk, work.path())?;
    let queue = Mutex::new(drawings.iter().enumerate());
    let results = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for worker in 0..2 {
            let (runs, queue, results) = (&runs, &queue, &results);
            let output = work.path().join(format!("{worker}.csv"));
            scope.spawn(move || {
                while let Some((index, drawing)) = next(queue) {
                    let row = one(runs, folder, drawing, &output);
                    if let Ok(mut results) = results.lock() {
                        results.push((index, row));
                    }
                }
            });
        }
    });
    let mut rows = results.into_inner().unwrap_or_default();
    rows.sort_by_key(|(index, _)| *index);
    let machines: Vec<&str> = runs.machines.iter().map(|(name, _)| *name).collect();
    println!("{:<72} {:>8}  check  result on {}", "file", "bytes", machines.join(" / "));
    let mut failed = 0;
    for (_, row) in rows {
        let (text, holds) = row?;
        println!("{text}");
        failed += usize::from(!holds);
    }
    println!("{} passed, {failed} failed", drawings.len() - failed);
    Ok(failed == 0)
}

fn next<T>(queue: &Mutex<impl Iterator<Item = T>>) -> Option<T> {
    queue.lock().ok()?.next()
}

pub(crate) fn find(folder: &Path, to: &mut Vec<PathBuf>) -> Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))? {
        let path = entry?.path();
        if path.is_dir() {
            find(&path, to)?;
        } else if path
            .extension()
            .is_some_and(|e| ENDINGS.contains(&e.to_string_lossy().to_ascii_lowercase().as_str()))
        {
            to.push(path);
        }
    }
    Ok(())
}

/// One row of the table, and whether all runs passed.
fn one(runs: &Runs, folder: &Path, drawing: &Path, output: &Path) -> Result<(String, bool)> {
    let binary = &runs.binary;
    let check = start(binary, &["check".as_ref(), drawing.as_os_str()], output, LIMIT)?;
    let limit = runs.limit * (LIMIT + LIMIT_A_KILOMETRE.mul_f64(kilometres(&check.stdout)));
    let mut faults: Vec<String> = judge_check(&check).into_iter().collect();
    let mut results = Vec::new();
    for (name, machine) in &runs.machines {
        let arguments: [&std::ffi::OsStr; 11] = [
            "convert".as_ref(),
            drawing.as_os_str(),
            "--machine".as_ref(),
            machine.as_os_str(),
            "--fit".as_ref(),
            "--format".as_ref(),
            "csv".as_ref(),
            "--report".as_ref(),
            "json".as_ref(),
            "-o".as_ref(),
            output.as_os_str(),
        ];
        let run = start(binary, &arguments, output, limit)?;
        match judge_convert(&run) {
            Ok(result) => results.push(format!("{result} ({:.1} s)", run.seconds)),
            Err(fault) => {
                faults.push(format!("on {name}: {fault}"));
                results.push("FAILED".into());
            }
        }
    }
    let name = drawing.strip_prefix(folder).unwrap_or(drawing).display().to_string();
    let bytes = std::fs::metadata(drawing)?.len();
    let exit = check.exit.map_or("-".into(), |exit| exit.to_string());
    let mut text = format!("{name:<72} {bytes:>8}  {exit:>5}  {}", results.join(" / "));
    for fault in &faults {
        let _ = write!(text, "\n    FAILED {fault}");
    }
    Ok((text, faults.is_empty()))
}

/// The length of ink in the output of `check`, km: "... 6764.26 m of ink ...".
fn kilometres(output: &str) -> f64 {
    let words: Vec<&str> = output.split_whitespace().collect();
    let ink = words.windows(4).find(|four| four[1..] == ["m", "of", "ink"]);
    ink.and_then(|four| four[0].parse::<f64>().ok()).map_or(0.0, |metres| metres / 1000.0)
}

/// Runs the binary and stops it after `limit`.
fn start(binary: &Path, arguments: &[&std::ffi::OsStr], output: &Path, limit: Duration) -> Result<Run> {
    let _ = std::fs::remove_file(output);
    let (stderr, stdout) = (output.with_extension("stderr"), output.with_extension("stdout"));
    let began = Instant::now();
    let mut child = Command::new(binary)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(std::fs::File::create(&stdout)?)
        .stderr(std::fs::File::create(&stderr)?)
        .spawn()
        .context("cannot start the binary")?;
    let mut used = Duration::ZERO;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break Some(status);
        }
        used = cpu_time(child.id()).unwrap_or_else(|| began.elapsed());
        if used > limit || began.elapsed() > limit * WAIT {
            child.kill()?;
            child.wait()?;
            break None;
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    Ok(Run {
        // A signal has no exit code: -1, which is not a code either.
        exit: status.map(|status| status.code().unwrap_or(-1)),
        stderr: String::from_utf8_lossy(&std::fs::read(&stderr)?).into_owned(),
        stdout: String::from_utf8_lossy(&std::fs::read(&stdout)?).into_owned(),
        wrote: output.exists(),
        seconds: used.as_secs_f64(),
    })
}

/// A fault that no run may have, whatever its arguments.
fn broken(run: &Run) -> Option<String> {
    if run.stderr.contains("panicked at") {
        return Some("it panicked".into());
    }
    match run.exit {
        None => Some(format!("not finished after {:.0} s", run.seconds)),
        Some(0 | 1) => None,
        Some(code) => Some(format!("exit {code}")),
    }
}

fn judge_check(run: &Run) -> Option<String> {
    broken(run).map(|fault| format!("check: {fault}"))
}

/// "planned", or the reason for a refusal; an error if it did neither.
fn judge_convert(run: &Run) -> Result<String, String> {
    if let Some(fault) = broken(run) {
        return Err(fault);
    }
    if run.exit == Some(1) {
        if run.wrote {
            return Err("refused, but there is an output file".into());
        }
        let reason = run.stderr.lines().rev().find(|line| line.starts_with("error"));
        let reason = reason.ok_or("refused without an error message")?;
        return Ok(format!("refused: {}", reason.chars().take(60).collect::<String>()));
    }
    let report =
        run.stderr.lines().last().and_then(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let report = report.ok_or("the last line of standard error is no JSON object")?;
    match (&report["certificate"]["holds"], run.wrote) {
        (serde_json::Value::Bool(true), true) => {
            Ok(format!("planned {:.0} s", report["summary"]["duration_s"].as_f64().unwrap_or(f64::NAN)))
        }
        (serde_json::Value::Bool(true), false) => Err("planned, but there is no output file".into()),
        _ => Err("a plan that failed verification".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(exit: Option<i32>, stderr: &str, wrote: bool) -> Run {
        Run { exit, stderr: stderr.into(), stdout: String::new(), wrote, seconds: 0.1 }
    }

    #[test]
    fn plans_need_a_certificate_that_holds_and_a_file() {
        let good = "warning: x\n{\"certificate\":{\"holds\":true},\"summary\":{\"duration_s\":12.0}}";
        assert_eq!(judge_convert(&run(Some(0), good, true)).unwrap(), "planned 12 s");
        assert!(judge_convert(&run(Some(0), good, false)).is_err());
        assert!(judge_convert(&run(Some(0), "{\"certificate\":{\"holds\":false}}", true)).is_err());
        assert!(judge_convert(&run(Some(0), "done", true)).is_err());
    }

    #[test]
    fn kilometres_of_ink_in_check_output() {
        assert_eq!(kilometres("x: 3 commands\n5 strokes, 6764.26 m of ink from"), 6.764_26);
        assert_eq!(kilometres("5 strokes, 12.5 mm of ink from"), 0.0);
    }

    #[test]
    fn refusals_need_an_error_message_and_no_file() {
        assert!(judge_convert(&run(Some(1), "error: the drawing has no ink", false)).is_ok());
        assert!(judge_convert(&run(Some(1), "error: the drawing has no ink", true)).is_err());
        assert!(judge_convert(&run(Some(1), "", false)).is_err());
    }

    #[test]
    fn panics_timeouts_and_other_exit_codes_fail() {
        assert!(judge_check(&run(Some(101), "thread 'main' panicked at x", false)).is_some());
        assert!(judge_check(&run(None, "", false)).is_some());
        assert!(judge_check(&run(Some(-1), "", false)).is_some());
        assert!(judge_check(&run(Some(2), "", false)).is_some());
        assert!(judge_check(&run(Some(1), "", false)).is_none());
    }
}
