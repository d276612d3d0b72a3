//! `cargo xtask bench read`: reading speed and memory, compared with hp2xx (where installed) and
//! with an upper bound.
//!
//! The upper bound ("ceiling") is a pass over the bytes that only turns digits into a list of
//! integers (for encoded polylines, digits of base 64 or 32 into steps). hp2xx reads and writes
//! SVG.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context as _, Result};

use super::{fastest, inputs};

/// Speed (MB/s) or times the speed of hp2xx that a class of inputs should reach.
#[derive(Clone, Copy)]
enum Wanted {
    Speed(f64),
    TimesPeer(f64),
}

/// The inputs, the goals of each, and the peak memory that reading may take, as a multiple of their
/// size.
const CLASSES: [(&str, &[Wanted], f64); 8] = [
    ("text", &[Wanted::Speed(200.0)], 3.0),
    ("flow", &[Wanted::Speed(200.0)], 3.0),
    ("hatch", &[Wanted::Speed(200.0)], 3.0),
    ("pe", &[Wanted::Speed(70.0)], 3.0),
    ("pe7", &[Wanted::Speed(70.0)], 3.0),
    ("arcs", &[Wanted::Speed(60.0), Wanted::TimesPeer(5.0)], 4.0),
    ("labels", &[Wanted::Speed(15.0), Wanted::TimesPeer(5.0)], 8.0),
    ("bare", &[], 3.0),
];
const GROWTH: f64 = 1.05;
/// hp2xx draws chords of 5 degrees: on the benchmark's arcs, 0.0076 mm off on average. Ours are
/// flattened finer than that.
const CHORD_MM: f64 = 0.005;

/// One class of inputs, measured.
struct Figures {
    /// CPU time of reading 1 MB and 10 MB, s.
    small: f64,
    large: f64,
    /// Reading and flattening 10 MB, s.
    flattened: f64,
    ceiling: f64,
    peer: Option<f64>,
    /// Largest resident memory of a program that reads 10 MB, as a multiple of that.
    memory: Option<f64>,
    bytes: [f64; 2],
}

/// Measures and prints a table; true if every goal is met. `generator` is a Python script that
/// makes the inputs; without it they are made here.
pub(super) fn run(generator: Option<&Path>) -> Result<bool> {
    let work = tempfile::tempdir()?;
    let folder = work.path();
    match generator {
        Some(script) => generate(script, folder)?,
        None => inputs::write(folder)?,
    }
    println!(
        "{:<8} {:>9} {:>9} {:>9} {:>9} {:>8} {:>8} {:>9}",
        "10 MB of", "ours MB/s", "ceiling", "hp2xx", "times", "of ceil.", "exponent", "memory"
    );
    let mut met = true;
    for (class, wanted, most_memory) in CLASSES {
        let figures = measure(folder, class)?;
        let speed = |seconds: f64| 1e-6 * figures.bytes[1] / seconds;
        let exponent = (figures.large / figures.small).ln() / (figures.bytes[1] / figures.bytes[0]).ln();
        let show =
            |number: Option<f64>, digits: usize| number.map_or("-".into(), |n| format!("{n:.digits$}"));
        let times = figures.peer.map(|peer| peer / figures.flattened);
        let mut missed = Vec::new();
        for wanted in wanted {
            match *wanted {
                Wanted::Speed(wanted) if speed(figures.large) < wanted => {
                    missed.push(format!("{wanted} MB/s"));
                }
                Wanted::TimesPeer(wanted) if times.is_some_and(|times| times < wanted) => {
                    missed.push(format!("{wanted} times hp2xx"));
                }
                _ => {}
            }
        }
        if exponent > GROWTH {
            missed.push(format!("exponent {GROWTH}"));
        }
        if figures.memory.is_some_and(|memory| memory > most_memory) {
            missed.push(format!("memory {most_memory} times the input"));
        }
        met &= missed.is_empty();
        let verdict =
            if missed.is_empty() { String::new() } else { format!("   MISSED {}", missed.join(", ")) };
        println!(
            "{class:<8} {:>9.1} {:>9.1} {:>9} {:>9} {:>8.2} {:>8.3} {:>9}{verdict}",
            speed(figures.large),
            speed(figures.ceiling),
            show(figures.peer.map(speed), 1),
            show(times, 1),
            figures.ceiling / figures.large,
            exponent,
            show(figures.memory, 2),
        );
    }
    Ok(met)
}

fn generate(script: &Path, folder: &Path) -> Result<()> {
    let script = script.canonicalize().with_context(|| format!("no generator {}", script.display()))?;
    let made = Command::new("python3").arg(script).args(["--sizes", "1m,10m", "-o"]).arg(folder).output();
    let made = made.context("cannot run python3")?;
    anyhow::ensure!(
        made.status.success(),
        "the generator failed:\n{}",
        String::from_utf8_lossy(&made.stderr)
    );
    Ok(())
}

fn measure(folder: &Path, class: &str) -> Result<Figures> {
    let [small, large] = ["1m", "10m"].map(|size| folder.join(format!("{class}-{size}.plt")));
    let read =
        |path: &PathBuf| std::fs::read(path).with_context(|| format!("cannot read {}", path.display()));
    let inputs = [read(&small)?, read(&large)?];
    let options = hpgl::Options::default();
    let [one, ten] = [0, 1].map(|k| fastest(|| hpgl::read(&inputs[k], &options)).1);
    let flattened = if matches!(class, "arcs" | "labels") {
        fastest(|| {
            let document = hpgl::read(&inputs[1], &options);
            let strokes = document.pages.iter().flat_map(|page| &page.drawing.strokes);
            strokes.map(|stroke| stroke.flatten(CHORD_MM).len()).sum::<usize>()
        })
        .1
    } else {
        ten
    };
    let ceiling = match class {
        "pe" => fastest(|| steps(&inputs[1], 6)).1,
        "pe7" => fastest(|| steps(&inputs[1], 5)).1,
        _ => fastest(|| integers(&inputs[1])).1,
    };
    let memory = memory(&large)?.map(|peak| peak / inputs[1].len() as f64);
    let bytes = [inputs[0].len() as f64, inputs[1].len() as f64];
    let peer = hp2xx(&large, folder)?;
    Ok(Figures { small: one, large: ten, flattened, ceiling, peer, memory, bytes })
}

/// Every run of digits as a number.
fn integers(bytes: &[u8]) -> Vec<u32> {
    let mut numbers = Vec::new();
    let (mut number, mut inside) = (0_u32, false);
    for &byte in bytes {
        let digit = byte.wrapping_sub(b'0');
        if digit < 10 {
            number = number.wrapping_mul(10).wrapping_add(u32::from(digit));
            inside = true;
        } else if inside {
            numbers.push(number);
            (number, inside) = (0, false);
        }
    }
    numbers
}

/// Every number of base 64 (6 bits) or 32 (5 bits), .
fn steps(bytes: &[u8], bits: u32) -> Vec<u32> {
    let (last_digit, base) = if bits == 6 { (191, 64) } else { (95, 32) };
    let mut numbers = Vec::new();
    let (mut number, mut shift) = (0_u32, 0);
    for &byte in bytes {
        let last = byte.wrapping_sub(last_digit);
        if last < base {
            numbers.push(number | u32::from(last) << (shift % 32));
            (number, shift) = (0, 0);
        } else if byte.wrapping_sub(63) < base {
            number |= u32::from(byte - 63) << (shift % 32);
            shift += bits;
        }
    }
    numbers
}

/// CPU time of hp2xx on a file, s; `None` if it is not installed or the system does not report CPU
/// time.
fn hp2xx(file: &Path, folder: &Path) -> Result<Option<f64>> {
    let Some(before) = children() else { return Ok(None) };
    let run = Command::new("hp2xx")
        .args(["-q", "-m", "svg", "-f"])
        .args([folder.join("hp2xx.svg").as_os_str(), file.as_os_str()])
        .current_dir(folder)
        .stdin(Stdio::null())
        .output();
    let Ok(run) = run else { return Ok(None) };
    anyhow::ensure!(run.status.success(), "hp2xx fails on {}", file.display());
    Ok(children().map(|after| after - before))
}

/// Linux: CPU time of all children that have ended, s (their user and system time in hundredths).
pub(super) fn children() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name in parentheses may hold blanks; cutime and cstime are the 14th and 15th words after
    // it.
    let words: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    Some((words.get(13)?.parse::<f64>().ok()? + words.get(14)?.parse::<f64>().ok()?) / 100.0)
}

/// Largest resident memory of a program that does nothing but read that file into a drawing, bytes.
fn memory(file: &Path) -> Result<Option<f64>> {
    let run = Command::new(std::env::current_exe()?).args(["bench", "read-once"]).arg(file).output()?;
    anyhow::ensure!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    Ok(String::from_utf8_lossy(&run.stdout).trim().parse().ok())
}

/// Reads one file into a drawing and prints its peak resident memory, bytes, where the system
/// reports it.
pub(crate) fn once(file: &Path) -> Result<bool> {
    let bytes = std::fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
    let document = hpgl::read(&bytes, &hpgl::Options::default());
    if let Some(peak) = peak_bytes("/proc/self/status") {
        println!("{peak}");
    }
    Ok(!document.pages.is_empty())
}

/// Linux: the largest resident memory in the status of a process, bytes.
pub(super) fn peak_bytes(status: &str) -> Option<f64> {
    let status = std::fs::read_to_string(status).ok()?;
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB"));
    Some(1024.0 * peak?.parse::<f64>().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ceilings_see_every_number() {
        assert_eq!(integers(b"PU12,345;PD6,7;"), [12, 345, 6, 7]);
        // 800 in two digits: 32 + 12 * 64, and 0 + 25 * 32.
        assert_eq!(steps(&[63 + 32, 191 + 12, 191], 6), [800, 0]);
        assert_eq!(steps(&[63, 95 + 25], 5), [800]);
    }
}
