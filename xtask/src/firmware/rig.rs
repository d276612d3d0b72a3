//! The emulated machine as a process, and `plotplan send` to its serial port.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, bail, ensure};

use super::Bench;
use super::trace::Trace;

/// Clock of the chip, cycles per microsecond.
pub(super) const CYCLES_PER_US: f64 = 16.0;
/// Vectors of an `ATmega328P`.
const VECTORS: &[(&str, &str)] =
    &[("5", "encoders"), ("4", "encoders"), ("8", "millisecond"), ("11", "steps"), ("18", "receive")];
/// Of open(2) on Linux.
const O_NONBLOCK: i32 = 0o4000;
/// An answer takes a few milliseconds, and more on a busy machine.
const ANSWER_LIMIT: Duration = Duration::from_secs(20);
/// A sender that takes longer hangs.
const SEND_LIMIT: Duration = Duration::from_secs(600);

/// What the rig printed at its end.
#[derive(Debug)]
pub(super) struct Summary(serde_json::Value);

impl Summary {
    pub(super) fn number(&self, key: &str) -> f64 {
        self.0[key].as_f64().unwrap_or(f64::NAN)
    }

    pub(super) fn pair(&self, key: &str) -> [f64; 2] {
        [0, 1].map(|index: usize| self.0[key][index].as_f64().unwrap_or(f64::NAN))
    }

    /// Load of each interrupt, and the longest time without any.
    pub(super) fn load(&self) -> String {
        let cycles = self.number("cycles");
        let mut parts = BTreeMap::new();
        for (vector, name) in VECTORS {
            let value = &self.0["vectors"][vector];
            if let (Some(calls), Some(sum), Some(longest)) =
                (value[0].as_f64(), value[1].as_f64(), value[2].as_f64())
            {
                parts.insert(
                    *name,
                    format!(
                        "{name} {:.2} % ({:.0} cycles, {longest} most)",
                        100.0 * sum / cycles,
                        sum / calls
                    ),
                );
            }
        }
        let list: Vec<String> = parts.into_values().collect();
        format!(
            "interrupts: {}; blocked {:.1} us at most; stack {} bytes; {:.1} x real time",
            list.join(", "),
            self.number("blocked_longest") / CYCLES_PER_US,
            self.number("stack"),
            self.number("speed")
        )
    }
}

/// A running rig.
#[derive(Debug)]
pub(super) struct Rig {
    child: Child,
    link: PathBuf,
    trace: PathBuf,
}

impl Rig {
    /// Powers the machine up.
    pub(super) fn start(bench: &Bench, image: &str, options: &[&str]) -> Result<Self> {
        let (link, trace) = (bench.file("tty"), bench.file("trace"));
        let image = bench.image(image);
        let mut child = Command::new(bench.firmware.join("build/rig"))
            .arg("--link")
            .arg(&link)
            .arg("--trace")
            .arg(&trace)
            .args(options)
            .args(["--hang", &address_of(&image, "__stop_program")?])
            .arg(&image)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .context("cannot start the rig")?;
        let stderr = child.stderr.take().context("no standard error")?;
        let mut lines = BufReader::new(stderr).lines();
        loop {
            let line = lines.next().context("the rig ended")??;
            if line == "rig: ready" {
                break;
            }
        }
        // The rest is read so that the rig never waits.
        std::thread::spawn(move || lines.for_each(drop));
        Ok(Self { child, link, trace })
    }

    /// Runs `plotplan send` to its end.
    pub(super) fn send(&self, bench: &Bench, plan: &Path, options: &[&str]) -> Result<Output> {
        let child = self.start_send(bench, plan, options)?;
        wait(child)
    }

    /// Starts `plotplan send`.
    pub(super) fn start_send(&self, bench: &Bench, plan: &Path, options: &[&str]) -> Result<Child> {
        Command::new(&bench.plotplan)
            .args(["send", "--protocol", "ticks", "--port"])
            .arg(&self.link)
            .arg(plan)
            .args(options)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .context("cannot run plotplan send")
    }

    /// Sends a plan that must be executed completely.
    pub(super) fn draw(&self, bench: &Bench, plan: &Path) -> Result<()> {
        let output = self.send(bench, plan, &[])?;
        ensure!(output.status.success(), "send: {}", String::from_utf8_lossy(&output.stderr).trim());
        Ok(())
    }

    /// Sends a line with its checksum and returns the answer without its own.
    pub(super) fn ask(&self, text: &str) -> Result<String> {
        ask_at(&self.link, text)
    }

    /// Asks until the answer is as wanted.
    pub(super) fn ask_until(&self, text: &str, wanted: impl Fn(&str) -> bool) -> Result<String> {
        let start = Instant::now();
        loop {
            let answer = self.ask(text)?;
            if wanted(&answer) {
                return Ok(answer);
            }
            ensure!(start.elapsed() < Duration::from_secs(90), "{text}: still {answer}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Lets the motion end and switches off.
    pub(super) fn finish(mut self) -> Result<(Summary, Trace)> {
        drop(self.child.stdin.take());
        let mut text = String::new();
        self.child.stdout.take().context("no output")?.read_to_string(&mut text)?;
        ensure!(self.child.wait()?.success(), "the rig failed");
        let line = text.lines().rfind(|line| line.starts_with('{')).context("the rig printed no summary")?;
        Ok((Summary(serde_json::from_str(line)?), Trace::read(&self.trace)?))
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        // Not there any more after `finish`.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends a line with its checksum and returns the answer without its own.
pub(super) fn ask_at(port: &Path, text: &str) -> Result<String> {
    let mut port = std::fs::OpenOptions::new().read(true).write(true).custom_flags(O_NONBLOCK).open(port)?;
    let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
    port.write_all(format!("{text}*{sum}\n").as_bytes())?;
    // Answers to a sender that has ended may still come.
    let kind = match text {
        "where" => "at ",
        "status" | "friction" => text,
        _ => "",
    };
    let start = Instant::now();
    let (mut line, mut byte) = (Vec::new(), [0]);
    while start.elapsed() < ANSWER_LIMIT {
        match port.read(&mut byte) {
            Ok(1) if byte[0] == b'\n' => {
                let answer = String::from_utf8_lossy(&line).into_owned();
                if answer.starts_with(kind) {
                    return Ok(answer.split('*').next().unwrap_or_default().to_owned());
                }
                line.clear();
            }
            Ok(1) => line.push(byte[0]),
            Err(error) if error.kind() != std::io::ErrorKind::WouldBlock => return Err(error.into()),
            _ => std::thread::sleep(Duration::from_millis(2)),
        }
    }
    bail!("no answer to {text}")
}

/// Waits for a sender; kills one that hangs.
pub(super) fn wait(mut child: Child) -> Result<Output> {
    let start = Instant::now();
    while child.try_wait()?.is_none() {
        if start.elapsed() > SEND_LIMIT {
            child.kill()?;
            bail!("send does not end");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    Ok(child.wait_with_output()?)
}

/// Sends a signal to a process.
pub(super) fn signal(child: &Child, name: &str) -> Result<()> {
    let status = Command::new("kill").arg(format!("-{name}")).arg(child.id().to_string()).status()?;
    ensure!(status.success(), "kill: {status}");
    Ok(())
}

/// The address of a symbol of an image, hexadecimal.
fn address_of(image: &Path, symbol: &str) -> Result<String> {
    let output = Command::new("avr-nm").arg(image).output()?;
    let text = String::from_utf8_lossy(&output.stdout);
    let line = text.lines().find(|line| line.ends_with(&format!(" {symbol}")));
    Ok(line.and_then(|line| line.split(' ').next()).with_context(|| format!("no {symbol}"))?.to_owned())
}
