//! `cargo xtask firmware`: builds the firmware, tests its layers on the host, and lets the real
//! `plotplan send` draw on an emulated `ATmega328P`.

mod arduino;
mod arm;
mod dc;
mod micropython;
mod rig;
mod steppers;
mod trace;

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, bail, ensure};

/// Debian packages, each with a file by which it is recognized.
const PACKAGES: &[(&str, &str)] = &[
    ("make", "/usr/bin/make"),
    ("gcc-avr", "/usr/bin/avr-gcc"),
    ("avr-libc", "/usr/lib/avr/include/avr/io.h"),
    ("libelf-dev", "/usr/include/libelf.h"),
    ("arduino-core-avr", "/usr/share/arduino/hardware/arduino/avr/cores/arduino/Arduino.h"),
    ("libsimavr-dev", "/usr/include/simavr/sim_avr.h"),
    ("gcc-arm-none-eabi", "/usr/bin/arm-none-eabi-gcc"),
    ("libnewlib-arm-none-eabi", "/usr/include/newlib/stdio.h"),
    ("qemu-system-arm", "/usr/bin/qemu-system-arm"),
];

/// What is tested, with what, and the results so far.
struct Bench {
    folder: tempfile::TempDir,
    firmware: PathBuf,
    plotplan: PathBuf,
    /// Only checks whose name contains one of these run.
    filters: Vec<String>,
    passed: usize,
    failed: usize,
}

impl Bench {
    /// Runs a check; it returns what it measured, or why it failed.
    fn check(&mut self, name: &str, check: impl FnOnce(&Self) -> Result<String>) {
        if !self.filters.is_empty() && !self.filters.iter().any(|filter| name.contains(filter.as_str())) {
            return;
        }
        match check(self) {
            Ok(measured) => {
                self.passed += 1;
                println!("ok    {name}: {measured}");
            }
            Err(error) => {
                self.failed += 1;
                println!("FAIL  {name}: {error:#}");
            }
        }
    }

    fn image(&self, name: &str) -> PathBuf {
        self.firmware.join(format!("build/{name}.elf"))
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The plan of an HPGL file on the coaxial arm, as tick lines.
    fn plan(&self, drawing: &Path, options: &[&str]) -> Result<PathBuf> {
        let stem = drawing.file_stem().and_then(|stem| stem.to_str()).context("a drawing without a name")?;
        let plan = self.file(&format!("{stem}.ticks"));
        let mut convert = Command::new(&self.plotplan);
        convert.arg("convert").arg(drawing).args(["--machine", "coaxial"]).args(options);
        let output = convert.arg("-o").arg(&plan).output().context("cannot run plotplan")?;
        ensure!(output.status.success(), "plotplan convert: {}", String::from_utf8_lossy(&output.stderr));
        Ok(plan)
    }

    fn example(&self, name: &str) -> PathBuf {
        self.firmware.join("../examples").join(name)
    }
}

/// Builds and tests; whether everything passed. The last line is `N passed, 0 failed`.
pub(crate) fn run(filters: &[&str]) -> Result<bool> {
    install()?;
    let firmware = crate::top().join("firmware");
    let mut bench = Bench {
        folder: tempfile::tempdir().context("no temporary folder")?,
        firmware,
        plotplan: program()?,
        filters: filters.iter().map(|&filter| filter.to_owned()).collect(),
        passed: 0,
        failed: 0,
    };
    bench.check("headers of all presets compile", headers);
    bench.check("images keep their budgets, without heap and floating point", |bench| {
        make(bench, &["all", "rig"])
    });
    bench.check("portable layers on the host, sanitizers", |bench| make(bench, &["test"]));
    ensure!(
        bench.image("../rig").with_extension("").is_file() || make(&bench, &["all", "rig"]).is_ok(),
        "no rig"
    );
    bench.check("Arduino examples compile", arduino::examples);
    steppers::run(&mut bench);
    dc::run(&mut bench);
    bench.check("ARM: portable layers on an emulated Cortex-M3", arm::unit_tests);
    bench.check("ARM: zot on an emulated micro:bit, every step", arm::microbit);
    bench.check("MicroPython: protocol, loop and zot on simulated motors", micropython::tests);
    println!("{} passed, {} failed", bench.passed, bench.failed);
    Ok(bench.failed == 0)
}

/// The program that sends: the one that the variable PLOTPLAN names, otherwise built here.
fn program() -> Result<PathBuf> {
    if let Some(program) = std::env::var_os("PLOTPLAN") {
        return Path::new(&program).canonicalize().context("PLOTPLAN");
    }
    execute(Command::new("cargo").args(["build", "--quiet", "--locked", "-p", "plotplan"]))?;
    let target =
        std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| crate::top().join("target"), PathBuf::from);
    target.join("debug/plotplan").canonicalize().context("plotplan was not built")
}

/// Installs the packages that are missing.
fn install() -> Result<()> {
    let missing = |(_, file): &&(&str, &str)| !Path::new(file).exists();
    let names: Vec<&str> = PACKAGES.iter().filter(missing).map(|(name, _)| *name).collect();
    if names.is_empty() {
        return Ok(());
    }
    execute(Command::new("apt-get").args(["update", "-qq"]))
        .context("the firmware's tests need Debian packages")?;
    execute(Command::new("apt-get").args(["install", "-y", "-qq"]).args(&names))?;
    if let Some((name, file)) = PACKAGES.iter().find(missing) {
        bail!("{name} is installed, but {file} is missing");
    }
    Ok(())
}

fn execute(command: &mut Command) -> Result<()> {
    let status =
        command.current_dir(crate::top()).status().with_context(|| format!("cannot run {command:?}"))?;
    ensure!(status.success(), "{command:?}: {status}");
    Ok(())
}

/// Runs make; the lines that name numbers.
fn make(bench: &Bench, targets: &[&str]) -> Result<String> {
    let output = Command::new("make").arg("-C").arg(&bench.firmware).args(targets).output()?;
    let text = String::from_utf8_lossy(&output.stdout);
    ensure!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    let told =
        |line: &&str| line.contains(" bytes, RAM") || line.contains("counts RMS") || line.contains("passed");
    let lines: Vec<&str> = text.lines().filter(told).map(str::trim).collect();
    Ok(if lines.is_empty() { "up to date".to_owned() } else { format!("\n      {}", lines.join("\n      ")) })
}

/// Writes the header of every preset and drive and compiles it.
fn headers(bench: &Bench) -> Result<String> {
    let mut count = 0;
    for machine in ["coaxial", "corexy", "hbot", "polar", "cartesian"] {
        for drive in ["step", "dc", "servo"] {
            let output = Command::new(&bench.plotplan)
                .args(["machine", "show", machine, "--firmware-config", drive])
                .output()?;
            ensure!(output.status.success(), "{machine}: {}", String::from_utf8_lossy(&output.stderr));
            let header = bench.file(&format!("{machine}_{drive}.h"));
            std::fs::write(&header, output.stdout)?;
            let compiled = Command::new("avr-gcc")
                .args(["-std=gnu11", "-mmcu=atmega328p", "-Wall", "-Wextra", "-Werror", "-Os", "-c", "-o"])
                .arg(bench.file("header.o"))
                .arg(format!("-DMACHINE_HEADER=\"{}\"", header.display()))
                .arg("-I")
                .arg(bench.firmware.join("src"))
                .arg(bench.firmware.join("app/main.c"))
                .output()?;
            ensure!(compiled.status.success(), "{machine}: {}", String::from_utf8_lossy(&compiled.stderr));
            count += 1;
        }
    }
    Ok(format!("{count} headers"))
}
