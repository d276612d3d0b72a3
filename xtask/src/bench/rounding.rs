//! `cargo xtask bench rounding`: ink of plans whose rows take whole ticks along the path, beside that
//! of the nearest ticks, by a replay of its own; CPU time of the choice.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use compiler::machine_file::{MachineFile, PRESETS};
use drawing::Point;
use kinematics::{Machine, MotorPos};
use planner::{ExactRow, PlacementOptions, Rounding, Scale, Settings, Trajectory, place, plan};

use super::fastest;

/// Chords that stand for the motion between two rows, and for the exact path there.
const CHORDS: u32 = 8;
/// A distance is looked for within this number of rows either way.
const WINDOW: f64 = 60.0;
/// CPU time that the choice may take, us a row of ink.
const ROW_US: f64 = 5.0;
/// Largest means over the drawings, as shares of the nearest ticks' figures.
const MEANS: [f64; 5] = [0.65, 0.65, 0.67, 0.74, 0.37];
/// No figure of a drawing may be larger than this share of the nearest ticks' figure.
const WORST: f64 = 1.05;

/// A preset, a period, and a tolerance that does not hide its quantization error.
const MACHINES: [(&str, u64, f64); 7] = [
    ("coaxial", 10_000, 0.1),
    ("coaxial", 20_000, 0.1),
    ("coaxial", 2_000, 0.1),
    ("polar", 20_000, 0.1),
    ("polar", 10_000, 0.1),
    ("corexy", 10_000, 0.005),
    ("hbot", 10_000, 0.005),
];

/// How far the ink is from the exact path, mm.
#[derive(Clone, Copy, Debug)]
struct Figures {
    rms: f64,
    p99: f64,
    /// The farthest ink.
    stray: f64,
    /// The farthest part of the path from all ink.
    missed: f64,
    /// How much longer the ink is than the path, as a share.
    excess: f64,
}

impl Figures {
    fn array(&self) -> [f64; 5] {
        [self.rms, self.p99, self.stray, self.missed, self.excess]
    }
}

/// Prints all figures; true if the goals were met. `folder` has more drawings.
pub(super) fn run(folder: Option<&Path>) -> Result<bool> {
    let examples = crate::top().join("examples");
    let mut drawings: Vec<PathBuf> = ["zot", "house", "surface", "rosette", "spirograph"]
        .map(|name| examples.join(name).with_extension("hpgl"))
        .into();
    if let Some(folder) = folder {
        let mut more: Vec<_> = std::fs::read_dir(folder)?
            .map(|entry| entry.map(|entry| entry.path()))
            .collect::<Result<_, _>>()?;
        more.retain(|path| path.extension().is_some_and(|extension| extension == "hpgl"));
        more.sort();
        drawings.extend(more);
    }
    let mut met = true;
    for (name, period_us, tolerance) in MACHINES {
        let preset = PRESETS.iter().find(|preset| preset.name == name).context("a preset")?;
        let machine = MachineFile::parse(preset.toml)?.machine()?;
        println!("\n{name}, {} ms, tolerance {tolerance} mm", period_us as f64 / 1e3);
        println!(
            "  {:24} {:>7} | nearest, mm: RMS, 99 %, stray, missed, longer | shares | us a row",
            "drawing", "rows"
        );
        let means = compare(&machine, period_us, tolerance, &drawings, &mut met)?;
        if (name, period_us) == ("coaxial", 10_000) {
            met &= means.iter().zip(MEANS).all(|(mean, most)| *mean <= most);
            println!("  goals: means at most {MEANS:.2?}, {ROW_US} us a row, each share at most {WORST}");
        }
    }
    Ok(met)
}

/// Compares both roundings of every drawing; returns the mean shares.
fn compare(
    machine: &Machine,
    period_us: u64,
    tolerance: f64,
    drawings: &[PathBuf],
    met: &mut bool,
) -> Result<[f64; 5]> {
    let (mut sums, mut count) = ([0.0; 5], 0.0);
    for path in drawings {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
        let mut drawing = hpgl::read(&bytes, &hpgl::Options::default()).pages.swap_remove(0).drawing;
        let options = PlacementOptions { scale: Scale::Fit, ..PlacementOptions::default() };
        drawing.transform(place(machine, &drawing, &options)?);
        let planned = |rounding| {
            let settings = Settings { rounding, ..Settings::new(tolerance, period_us) };
            plan(machine, drawing.clone(), &settings)
        };
        let (nearest, along) = (planned(Rounding::Nearest)?, planned(Rounding::Path)?);
        let [before, after] = [&nearest, &along].map(|plan| figures(machine, plan));
        let inked = nearest.rows().filter(|row| row.row.pen != 0).count();
        let mut searched = along.clone();
        let (_, plain) = fastest(|| nearest.rows().count());
        let (_, chosen) = fastest(|| {
            searched.forget_choices();
            searched.rows().count()
        });
        let row_us = (chosen - plain) * 1e6 / inked as f64;
        let (was, is) = (before.array(), after.array());
        let shares: [f64; 5] = std::array::from_fn(|index| is[index] / was[index]);
        println!(
            "  {name:24} {inked:7} | {:.4} {:.4} {:.4} {:.4} {:5.2} % | {shares:.2?} | {row_us:.1}",
            was[0],
            was[1],
            was[2],
            was[3],
            100.0 * was[4]
        );
        *met &= row_us <= ROW_US && shares[..4].iter().all(|share| *share <= WORST);
        sums = std::array::from_fn(|index| sums[index] + shares[index]);
        count += 1.0;
    }
    let means = sums.map(|sum| sum / count);
    println!("  mean {means:.3?}");
    Ok(means)
}

/// A line with its position in rows at each vertex.
type Timed = Vec<(Point, f64)>;

/// Replays a plan: its ink against the path through its exact positions, stroke by stroke.
fn figures(machine: &Machine, plan: &Trajectory<'_>) -> Figures {
    let rows: Vec<ExactRow> = plan.rows().collect();
    let mut distances: Vec<(f64, f64)> = Vec::new();
    let (mut missed, mut ink_mm, mut path_mm) = (0.0_f64, 0.0, 0.0);
    let mut start = 0;
    while start + 1 < rows.len() {
        let pen = rows[start].row.pen;
        let count = rows[start..].iter().take_while(|row| row.row.pen == pen).count();
        if pen != 0 {
            let stroke = &rows[start..(start + count + 1).min(rows.len())];
            let ink = followed(
                machine,
                &stroke.iter().map(|row| row.row.ticks.map(|t| t as f64)).collect::<Vec<_>>(),
                false,
            );
            let path = followed(machine, &stroke.iter().map(|row| row.exact).collect::<Vec<_>>(), true);
            ink_mm += weights(&ink).iter().sum::<f64>();
            path_mm += weights(&path).iter().sum::<f64>();
            distances.extend(away(&ink, &path).into_iter().zip(weights(&ink)));
            missed = away(&path, &ink).into_iter().fold(missed, f64::max);
        }
        start += count;
    }
    distances.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = distances.iter().map(|(_, weight)| weight).sum();
    let squares: f64 = distances.iter().map(|(distance, weight)| weight * distance * distance).sum();
    let mut below = 0.0;
    let p99 = distances.iter().find(|(_, weight)| {
        below += weight;
        below >= 0.99 * all
    });
    Figures {
        rms: (squares / all).sqrt(),
        p99: p99.map_or(0.0, |(distance, _)| *distance),
        stray: distances.last().map_or(0.0, |(distance, _)| *distance),
        missed,
        excess: ink_mm / path_mm - 1.0,
    }
}

/// The pen's path through motor positions: linear between them, or smooth (Catmull-Rom).
fn followed(machine: &Machine, motors: &[[f64; 2]], smooth: bool) -> Timed {
    let pen = |motors: [f64; 2]| machine.forward_from_motors(&MotorPos::new(motors[0], motors[1]));
    let mut line = vec![(pen(motors[0]), 0.0)];
    for row in 0..motors.len() - 1 {
        let at = |index: usize| motors[index.min(motors.len() - 1)];
        let (before, from, to, after) = (at(row.saturating_sub(1)), at(row), at(row + 1), at(row + 2));
        if from == to {
            continue;
        }
        for k in 1..=CHORDS {
            let t = f64::from(k) / f64::from(CHORDS);
            let position = |motor: usize| {
                let step = to[motor] - from[motor];
                if !smooth {
                    return from[motor] + t * step;
                }
                let (a, b) = (0.5 * (to[motor] - before[motor]), 0.5 * (after[motor] - from[motor]));
                from[motor] + t * (a + t * (3.0 * step - 2.0 * a - b + t * (a + b - 2.0 * step)))
            };
            line.push((pen([position(0), position(1)]), row as f64 + t));
        }
    }
    line
}

/// Half of the length of both chords at each vertex.
fn weights(line: &Timed) -> Vec<f64> {
    let mut weights = vec![0.0; line.len()];
    for index in 1..line.len() {
        let half = 0.5 * line[index].0.distance(line[index - 1].0);
        weights[index - 1] += half;
        weights[index] += half;
    }
    weights
}

/// The distance of each vertex from another line.
fn away(from: &Timed, line: &Timed) -> Vec<f64> {
    let mut first = 0;
    let nearest = |&(point, row): &(Point, f64)| {
        while first + 1 < line.len() && line[first + 1].1 < row - WINDOW {
            first += 1;
        }
        let chords = line[first..].windows(2).take_while(|chord| chord[0].1 <= row + WINDOW);
        let distances =
            chords.map(|chord| drawing::distance_to_line(point, drawing::Line::new(chord[0].0, chord[1].0)));
        distances.fold(f64::INFINITY, f64::min).min(point.distance(line[first].0))
    };
    from.iter().map(nearest).collect()
}
