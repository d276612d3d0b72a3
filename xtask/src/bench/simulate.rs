//! `cargo xtask bench simulate`: speed of simulations and of a search of gains, on examples/zot.hpgl
//! and the coaxial arm.

use anyhow::{Context as _, Result};
use compiler::machine_file::{MachineFile, PRESETS};
use compiler::pipeline;
use compiler::simulate::{Plan, simulate};
use compiler::{import, tune};
use drawing::Drawing;
use kinematics::Machine;
use plan::Row;

use super::{Clock, fastest, request};

/// Times real time that a simulation should reach, on one core.
const TIMES_REAL: f64 = 200.0;
/// CPU time that a search may take, s.
const TUNE_S: f64 = 20.0;

/// Rows and drawing of zot.hpgl on this machine.
fn planned(machine: &Machine) -> Result<(Vec<Row>, Drawing)> {
    let bytes = std::fs::read(crate::top().join("examples/zot.hpgl")).context("examples/zot.hpgl")?;
    let document = import::read(&bytes, &import::Options::default())?;
    let compiled = pipeline::compile(&document.pages[0].drawing, machine, &request(), &|_| {})?;
    let rows = compiled.trajectory.rows().map(|row| row.row).collect();
    Ok((rows, compiled.ordered().clone()))
}

/// Prints both figures; true if both goals were met.
pub(super) fn run() -> Result<bool> {
    let file = MachineFile::parse(PRESETS[0].toml)?;
    let machine = file.machine()?;
    let mut drive = file.drive(&machine)?.context("the preset has a drive")?;
    let finer = tune::finer_machine(&machine)?;
    let (rows, drawing) = planned(&machine)?;
    let (finer_rows, finer_drawing) = planned(&finer)?;
    let plan = Plan { machine: &machine, rows: &rows, period_us: 10_000, drawing: &drawing };
    let fine = Plan { machine: &finer, rows: &finer_rows, period_us: 10_000, drawing: &finer_drawing };

    let clock = Clock::start();
    let tuned = tune::tune(&plan, &fine, &drive)?;
    let tune_s = clock.seconds();

    drive = tuned.drive;
    let (simulated, simulate_s) = fastest(|| simulate(&plan, &drive, |_| {}));
    let times = simulated?.outcome.duration_s / simulate_s;
    println!("simulate, with the comparison of the ink: {times:.0} times real time (goal {TIMES_REAL})");
    println!("tune: {tune_s:.2} s of CPU for {} simulations (goal at most {TUNE_S})", tuned.simulations);
    Ok(times >= TIMES_REAL && tune_s <= TUNE_S)
}
