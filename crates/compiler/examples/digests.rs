//! SHA-256 of the tick lines of drawings on presets: `digests "MACHINE MACHINE ..." DRAWING ...`. The same
//! program on another processor prints the same lines; `cargo xtask trust bytes` compares them.
#![expect(clippy::print_stdout, reason = "an example prints its result")]

use std::collections::BTreeMap;
use std::error::Error;

use compiler::import;
use compiler::machine_file::{MachineFile, PRESETS};
use compiler::pipeline::{Order, Request, compile};
use planner::{PlacementOptions, Rounding, Scale, TimingLaw};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let machines = arguments.next().ok_or("names of presets")?;
    for path in arguments {
        let bytes = std::fs::read(&path)?;
        for machine in machines.split_whitespace() {
            let digest = digest(&bytes, machine).unwrap_or_else(|_| "refused".to_owned());
            println!("{machine} {path} {digest}");
        }
    }
    Ok(())
}

/// The digest of a plan of the drawing, at the largest size that fits.
fn digest(bytes: &[u8], machine: &str) -> Result<String, Box<dyn Error>> {
    let document = import::read(bytes, &import::Options::default())?;
    let preset = PRESETS.iter().find(|preset| preset.name == machine).ok_or("no preset of this name")?;
    let machine = MachineFile::parse(preset.toml)?.machine()?;
    let request = Request {
        tolerance_mm: 0.1,
        period_us: 10_000,
        order: Order::Optimize(ordering::Options::default()),
        placement: PlacementOptions { scale: Scale::Fit, ..PlacementOptions::default() },
        search: None,
        crop: None,
        pen_speeds: Vec::new(),
        pen_colors: BTreeMap::new(),
        lift_overlap_s: 0.0,
        timing_law: TimingLaw::TimeOptimal,
        rounding: Rounding::Path,
        joint_fit: true,
        allow_over_limit: false,
    };
    let compiled = compile(&document.pages[0].drawing, &machine, &request, &|_step| {})?;
    let mut lines = Vec::new();
    let rows = compiled.trajectory.rows().map(|row| row.row);
    plan::file::tick_lines::write(&compiled.header, rows, &mut lines)?;
    Ok(import::sha256(&lines))
}
