//! The Arduino library: its examples compiled as the IDE does it, with Debian's arduino-core-avr.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, bail, ensure};

use super::{Bench, execute};

const CORE: &str = "/usr/share/arduino/hardware/arduino/avr";
/// The core is written for avr-gcc 7, whose float.h has `DECIMAL_DIG` in C++; Debian's has version 5.
const FLAGS: &[&str] = &[
    "-mmcu=atmega328p",
    "-DF_CPU=16000000L",
    "-DARDUINO=10819",
    "-DARDUINO_ARCH_AVR",
    "-DDECIMAL_DIG=__DECIMAL_DIG__",
    "-Os",
    "-w",
];
/// Example, machine and drive of its header.
const EXAMPLES: &[(&str, &str, &str)] =
    &[("CoaxialArm", "coaxial", "dc"), ("StepperTable", "cartesian", "step"), ("HBotDC", "hbot", "dc")];

/// Compiles the core, the library and each sketch; the headers are those that `machine show` writes.
pub(super) fn examples(bench: &Bench) -> Result<String> {
    let folder = bench.file("arduino");
    std::fs::create_dir_all(&folder)?;
    let library = archive(bench, "plotplan.a", &bench.firmware.join("src"), &["c"])?;
    let core = archive(bench, "core.a", &Path::new(CORE).join("cores/arduino"), &["c", "cpp"])?;
    let mut sizes = Vec::new();
    for (example, machine, drive) in EXAMPLES {
        let sketch = bench.firmware.join("examples").join(example);
        let header = std::fs::read(sketch.join("machine.h")).context("machine.h of the example")?;
        let shown = ["machine", "show", machine, "--firmware-config", drive];
        let written = Command::new(&bench.plotplan).args(shown).output()?;
        ensure!(
            header == written.stdout,
            "{example}/machine.h is not what plotplan {} writes",
            shown.join(" ")
        );
        let source = sketch.join(format!("{example}.ino"));
        let object = compile(bench, &source, &["-include".as_ref(), "Arduino.h".as_ref()])?;
        let elf = folder.join("sketch.elf");
        let mut link = Command::new("avr-gcc");
        link.args(FLAGS).arg("-Wl,--gc-sections").arg("-o").arg(&elf).args([&object, &library, &core]);
        let linked = link.output()?;
        ensure!(linked.status.success(), "{example}: {}", String::from_utf8_lossy(&linked.stderr));
        let [flash, ram] = size(&elf)?;
        sizes.push(format!("{example} {flash} bytes, RAM {ram}"));
    }
    Ok(sizes.join("; "))
}

fn compile(bench: &Bench, source: &Path, more: &[&OsStr]) -> Result<PathBuf> {
    let is_c = source.extension().is_some_and(|extension| extension == "c");
    let stem = source.file_stem().context("a source without a name")?.to_string_lossy().into_owned();
    let object = bench.file("arduino").join(format!("{stem}.o"));
    let mut compiler = Command::new(if is_c { "avr-gcc" } else { "avr-g++" });
    compiler
        .args(FLAGS)
        .args(["-ffunction-sections", "-fdata-sections", "-fno-exceptions"])
        .arg(if is_c { "-std=gnu11" } else { "-std=gnu++11" })
        .arg(format!("-I{CORE}/cores/arduino"))
        .arg(format!("-I{CORE}/variants/standard"))
        .arg("-I")
        .arg(bench.firmware.join("src"))
        .args(more)
        .args(["-x", if is_c { "c" } else { "c++" }, "-c"])
        .arg(source)
        .arg("-o")
        .arg(&object);
    let output = compiler.output()?;
    ensure!(output.status.success(), "{}: {}", source.display(), String::from_utf8_lossy(&output.stderr));
    Ok(object)
}

fn archive(bench: &Bench, name: &str, sources: &Path, extensions: &[&str]) -> Result<PathBuf> {
    let mut files =
        std::fs::read_dir(sources)?.map(|entry| Ok(entry?.path())).collect::<Result<Vec<PathBuf>>>()?;
    files.sort();
    let known = |file: &PathBuf| {
        file.extension().and_then(OsStr::to_str).is_some_and(|extension| extensions.contains(&extension))
    };
    let objects = files.into_iter().filter(known).map(|file| compile(bench, &file, &[]));
    let objects = objects.collect::<Result<Vec<_>>>()?;
    let path = bench.file("arduino").join(name);
    execute(Command::new("avr-gcc-ar").arg("rcs").arg(&path).args(objects))?;
    Ok(path)
}

/// Flash and RAM, bytes.
fn size(elf: &Path) -> Result<[u32; 2]> {
    let output = Command::new("avr-size").arg(elf).output()?;
    let text = String::from_utf8_lossy(&output.stdout);
    let numbers = text.lines().nth(1).unwrap_or_default().split_whitespace();
    let numbers: Vec<u32> = numbers.filter_map(|word| word.parse().ok()).collect();
    let [code, data, bss, ..] = numbers[..] else { bail!("avr-size: {text}") };
    Ok([code + data, data + bss])
}
