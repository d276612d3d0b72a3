//! `cargo xtask bench place`: what the search for the best place gains on the examples, on the coaxial
//! arm.

use anyhow::{Context as _, Result};
use compiler::best_place::{BestFor, BestPlace, Search};
use compiler::import;
use compiler::machine_file::{MachineFile, PRESETS};
use compiler::pipeline::{self, Request};
use kinematics::Machine;

use super::{Clock, request};

/// Least gains of the duration and of the quantization error, per cent: on most drawings one of both is
/// to be reached.
const LEAST_GAINS: [f64; 2] = [5.0, 25.0];
/// CPU time that the search may take on house.hpgl, s.
const HOUSE_S: f64 = 20.0;

/// Prints the table; true if all goals were met.
pub(super) fn run() -> Result<bool> {
    let machine = MachineFile::parse(PRESETS[0].toml)?.machine()?;
    println!("{:<18} {:^30} {:^30}  CPU", "", "duration, s", "largest quantization error, mm");
    let (mut reached, mut all, mut house_s) = (0, 0, 0.0);
    let mut examples: Vec<_> =
        std::fs::read_dir(crate::top().join("examples"))?.collect::<std::io::Result<Vec<_>>>()?;
    examples.sort_by_key(std::fs::DirEntry::file_name);
    for path in examples.into_iter().map(|entry| entry.path()).filter(|path| path.is_file()) {
        let name = path.file_name().context("a file")?.to_string_lossy().into_owned();
        let clock = Clock::start();
        let found = [BestFor::Time, BestFor::Accuracy].map(|aim| search(&machine, &path, aim));
        let seconds = clock.seconds();
        let mut columns = Vec::new();
        let mut gains = Vec::new();
        for found in found {
            let found = found?;
            let centered = found.centered.unwrap_or(f64::INFINITY);
            let gain = 100.0 * (1.0 - found.figure / centered);
            gains.push(gain);
            columns.push(format!("{centered:>9.3} -> {:>8.3} ({gain:>4.1} %)", found.figure));
        }
        println!("{name:<18} {}  {seconds:.1} s", columns.join("  "));
        all += 1;
        reached += usize::from(gains.iter().zip(LEAST_GAINS).any(|(gain, least)| *gain >= least));
        if name == "house.hpgl" {
            house_s = seconds;
        }
    }
    println!("{reached} of {all} gain {} % of time or {} % of error", LEAST_GAINS[0], LEAST_GAINS[1]);
    Ok(2 * reached > all && house_s <= HOUSE_S)
}

fn search(machine: &Machine, path: &std::path::Path, aim: BestFor) -> Result<BestPlace> {
    let document = import::read(&std::fs::read(path)?, &import::Options::default())?;
    let request = Request { search: Some(Search { aim, turns: true }), ..request() };
    let compiled = pipeline::compile(&document.pages[0].drawing, machine, &request, &|_| {})?;
    compiled.best_place.context("a search")
}
