//! The firmware in MicroPython, run by MicroPython itself under Node.js.

use std::process::Command;

use anyhow::{Context as _, Result, ensure};

use super::Bench;

/// MicroPython as a module for Node.js, from npm.
const PACKAGE: &str = "@micropython/micropython-webassembly-pyscript@1.27.0";

/// Runs its tests with the configuration that plotplan writes.
pub(super) fn tests(bench: &Bench) -> Result<String> {
    let folder = crate::top().join("target/micropython");
    std::fs::create_dir_all(&folder).context("no folder for MicroPython")?;
    if !folder.join("node_modules/@micropython").is_dir() {
        let npm = Command::new("npm")
            .args(["install", "--silent", "--no-save", "--no-audit", "--no-fund", PACKAGE])
            .current_dir(&folder)
            .status()
            .context("cannot run npm: install Node.js 20 (Debian: nodejs npm)")?;
        ensure!(npm.success(), "npm install {PACKAGE}: {npm}");
    }
    let config = Command::new(&bench.plotplan)
        .args(["machine", "show", "coaxial", "--firmware-config", "micropython"])
        .output()?;
    ensure!(config.status.success(), "{}", String::from_utf8_lossy(&config.stderr));
    // Node looks for modules beside the script.
    let board = folder.join("firmware");
    let _ = std::fs::remove_dir_all(&board);
    for part in ["plotplan", "tests"] {
        let from = bench.firmware.join("micropython").join(part);
        std::fs::create_dir_all(board.join(part))?;
        for entry in std::fs::read_dir(&from).with_context(|| from.display().to_string())? {
            let entry = entry?;
            if entry.file_type()?.is_file() {
                std::fs::copy(entry.path(), board.join(part).join(entry.file_name()))?;
            }
        }
    }
    std::fs::write(board.join("tests/config.py"), config.stdout)?;
    let plan = bench.plan(&bench.example("zot.hpgl"), &[])?;
    let output = Command::new("node")
        .arg(board.join("tests/run.mjs"))
        .arg(plan)
        .output()
        .context("cannot run node: install Node.js 20 (Debian: nodejs)")?;
    let text = String::from_utf8_lossy(&output.stdout);
    ensure!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    let measured = text.lines().filter(|line| line.contains("mm RMS") || line.contains(" passed, "));
    Ok(measured.map(str::trim).collect::<Vec<_>>().join("; "))
}
