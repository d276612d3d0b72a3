//! Benchmarks: figures beside those of peers, by CPU time.

mod inputs;
mod large;
mod place;
mod plan;
mod read;
mod rounding;
mod simulate;
mod throughput;
mod workload;

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context as _, Result};
use compiler::pipeline::{Order, Request};
use planner::{PlacementOptions, TimingLaw};

pub(crate) use read::once as read_once;

/// `bench plan`; true if all goals were met.
pub(crate) fn plan(python: &str) -> Result<bool> {
    if cfg!(debug_assertions) {
        return released(&["plan".as_ref(), python.as_ref()]);
    }
    plan::run(python)
}

/// `bench simulate`; true if all goals were met.
pub(crate) fn simulate() -> Result<bool> {
    if cfg!(debug_assertions) {
        return released(&["simulate".as_ref()]);
    }
    simulate::run()
}

/// `bench large`; true if all goals were met.
pub(crate) fn large(program: Option<&Path>) -> Result<bool> {
    large::run(program)
}

/// `bench place`; true if all goals were met.
pub(crate) fn place() -> Result<bool> {
    if cfg!(debug_assertions) {
        return released(&["place".as_ref()]);
    }
    place::run()
}

/// `bench throughput`, beside another program; true if all goals were met.
pub(crate) fn throughput(other: Option<&Path>) -> Result<bool> {
    if cfg!(debug_assertions) {
        let other = other.map(std::path::absolute).transpose()?;
        let arguments = other.iter().map(AsRef::as_ref);
        return released(&std::iter::once("throughput".as_ref()).chain(arguments).collect::<Vec<&OsStr>>());
    }
    throughput::run(other)
}

/// `bench rounding`; true if all goals were met.
pub(crate) fn rounding(folder: Option<&Path>) -> Result<bool> {
    if cfg!(debug_assertions) {
        let folder = folder.map(std::path::absolute).transpose()?;
        let arguments = folder.iter().map(AsRef::as_ref);
        return released(&std::iter::once("rounding".as_ref()).chain(arguments).collect::<Vec<&OsStr>>());
    }
    rounding::run(folder)
}

/// `bench read`; true if all goals were met.
pub(crate) fn read(generator: Option<&Path>) -> Result<bool> {
    if cfg!(debug_assertions) {
        let generator = generator.map(std::path::absolute).transpose()?;
        let arguments = generator.iter().map(AsRef::as_ref);
        return released(&std::iter::once("read".as_ref()).chain(arguments).collect::<Vec<&OsStr>>());
    }
    read::run(generator)
}

/// A release build of this program, asked for the same.
fn released(arguments: &[&OsStr]) -> Result<bool> {
    let mut again = Command::new(env!("CARGO"));
    again.args(["run", "--quiet", "--release", "--package", "xtask", "--", "bench"]).args(arguments);
    Ok(again.current_dir(crate::top()).status().context("cargo run --release")?.success())
}

/// The settings of the program's own defaults.
fn request() -> Request {
    Request {
        tolerance_mm: 0.1,
        period_us: 10_000,
        order: Order::Optimize(ordering::Options::default()),
        placement: PlacementOptions::default(),
        search: None,
        crop: None,
        pen_speeds: Vec::new(),
        pen_colors: BTreeMap::new(),
        lift_overlap_s: 0.0,
        timing_law: TimingLaw::TimeOptimal,
        rounding: planner::Rounding::Path,
        joint_fit: true,
        allow_over_limit: false,
    }
}

/// What `work` gives, and the CPU time that it takes, s: the least of three rounds, because other programs on this
/// computer should not count, each of as many runs as the clock needs to see them.
fn fastest<T>(mut work: impl FnMut() -> T) -> (T, f64) {
    const ROUND: f64 = 0.3;
    let mut result = work();
    let mut least = f64::INFINITY;
    for _ in 0..3 {
        let clock = Clock::start();
        let mut runs = 0.0;
        while runs == 0.0 || clock.seconds() < ROUND {
            result = work();
            runs += 1.0;
        }
        least = least.min(clock.seconds() / runs);
    }
    (result, least)
}

/// CPU time of this thread where the system tells it, otherwise time.
struct Clock {
    cpu: Option<f64>,
    wall: Instant,
}

impl Clock {
    fn start() -> Self {
        Self { cpu: Self::cpu(), wall: Instant::now() }
    }

    fn seconds(&self) -> f64 {
        match (self.cpu, Self::cpu()) {
            (Some(before), Some(now)) => now - before,
            _ => self.wall.elapsed().as_secs_f64(),
        }
    }

    /// Linux: nanoseconds on a CPU.
    fn cpu() -> Option<f64> {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        Some(text.split(' ').next()?.parse::<f64>().ok()? * 1e-9)
    }
}

/// Pseudo-random numbers (xorshift, Marsaglia 2003), the same in every run.
struct Random(u64);

impl Random {
    /// A number from 0 to `below`.
    fn up_to(&mut self, below: f64) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        below * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}
