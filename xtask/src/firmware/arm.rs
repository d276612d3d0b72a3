//! 32-bit ARM under QEMU: the portable layers on a Cortex-M3, and the image of the micro:bit (Cortex-M0), to which
//! `plotplan send` sends zot. QEMU traces the writes to the pins, so every step is counted; it does not count
//! cycles, so the times of steps say nothing.

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use anyhow::{Context as _, Result, ensure};

use super::rig::ask_at;
use super::trace::{Steps, Trace, compare_order};
use super::{Bench, make};

/// Registers of the chip's pins, and the bits of `port_microbit.h`.
const OUTPUT_SET: u64 = 0x508;
const OUTPUT_CLEAR: u64 = 0x50c;
/// Step pin and direction pin of each motor.
const PINS: [[u32; 2]; 2] = [[3, 2], [23, 22]];

pub(super) fn unit_tests(bench: &Bench) -> Result<String> {
    make(bench, &["test-arm"])
}

pub(super) fn microbit(bench: &Bench) -> Result<String> {
    let size = make(bench, &["microbit", "MACHINE=app/steps.h"])?;
    let plan = bench.plan(&bench.example("zot.hpgl"), &[])?;
    let steps = Steps::read(&plan)?;
    let log = bench.file("gpio");
    let board = Board::start(&bench.firmware.join("build/microbit.elf"), &log)?;
    let sent = Command::new(&bench.plotplan)
        .args(["send", "--protocol", "ticks", "--port", &board.port])
        .arg(&plan)
        .stdin(Stdio::null())
        .output()?;
    ensure!(sent.status.success(), "send: {}", String::from_utf8_lossy(&sent.stderr).trim());
    let [a, b] = steps.end;
    let start = std::time::Instant::now();
    let end = format!("at {a} {b} 0");
    loop {
        let place = ask_at(Path::new(&board.port), "where")?;
        if place == end {
            break;
        }
        ensure!(start.elapsed().as_secs() < 60, "where: {place} instead of {end}");
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    drop(board);
    let count = compare_order(&steps, &steps_of(&log)?)?;
    Ok(format!("{count} steps, none lost or gained, `{end}`{size}"))
}

/// The steps in a trace of writes to pins, without times.
fn steps_of(log: &Path) -> Result<Trace> {
    let text = std::fs::read_to_string(log)?;
    let mut trace = Trace::default();
    let mut outputs = 0_u64;
    for line in text.lines().filter(|line| line.contains("nrf51_gpio_write")) {
        let number = |name: &str| {
            let word = line.split(name).nth(1)?.split_whitespace().next()?;
            u64::from_str_radix(word.trim_start_matches("0x"), 16).ok()
        };
        let (Some(offset), Some(value)) = (number("offset "), number("value ")) else { continue };
        match offset {
            OUTPUT_CLEAR => outputs &= !value,
            OUTPUT_SET => {
                for (motor, [step, direction]) in PINS.into_iter().enumerate() {
                    if value & !outputs & 1 << step != 0 {
                        let backwards = outputs & 1 << direction != 0;
                        trace.motors[motor].push((0.0, if backwards { -1 } else { 1 }));
                    }
                }
                outputs |= value;
            }
            _ => {}
        }
    }
    Ok(trace)
}

/// An emulated micro:bit.
struct Board {
    qemu: Child,
    port: String,
}

impl Board {
    fn start(image: &Path, log: &Path) -> Result<Self> {
        let mut qemu = Command::new("qemu-system-arm")
            .args(["-M", "microbit", "-display", "none", "-monitor", "none", "-serial", "pty"])
            .args(["-d", "trace:nrf51_gpio_write", "-D"])
            .arg(log)
            .arg("-kernel")
            .arg(image)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .context("cannot run qemu-system-arm")?;
        let output = qemu.stdout.take().context("no output")?;
        let mut board = Self { qemu, port: String::new() };
        for line in BufReader::new(output).lines() {
            let line = line?;
            if let Some(port) = line.split_whitespace().find(|word| word.starts_with("/dev/pts/")) {
                port.clone_into(&mut board.port);
                return Ok(board);
            }
        }
        anyhow::bail!("QEMU names no serial port")
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // Gone already if it failed.
        let _ = self.qemu.kill();
        let _ = self.qemu.wait();
    }
}
