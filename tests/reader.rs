//! The C reader of docs/tick-lines.md, compiled for the chip that the page names, and run on the host
//! at the other end of `plotplan send`.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use assert_cmd::cargo::cargo_bin;
use test_support::TestDir;

const DRAWING: &str = "IN;SP1;PU400,400;PD800,400,800,600;PU600,1000;CI120;SP2;PU300,900;PD;PU;";

fn top() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A folder with the C code of the page and a program around it.
fn folder(program: &str) -> TestDir {
    let page = fs::read_to_string(top().join("docs/tick-lines.md")).expect("the page");
    let blocks: Vec<&str> =
        page.split("```c\n").skip(1).map(|block| block.split_once("```").expect("an end").0).collect();
    assert_eq!(blocks.len(), 2);
    let dir = TestDir::new();
    dir.write("reader.c", blocks.concat());
    dir.write(program, fs::read_to_string(top().join("tests/reader").join(program)).expect("a program"));
    dir
}

/// Runs a compiler in the folder; its output.
fn compile(dir: &TestDir, compiler: &str, arguments: &str) -> String {
    let mut command = Command::new(compiler);
    let output = command.current_dir(dir.path()).args(arguments.split(' ')).output();
    let output = output.unwrap_or_else(|error| panic!("{compiler}: {error}"));
    let printed = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{compiler} {arguments}\n{printed}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Whether a program is installed; without it the test ends. `cargo xtask ci` installs the programs
/// and sets the variable that makes their absence a failure.
#[expect(clippy::disallowed_methods, reason = "the environment decides whether a compiler must be there")]
fn is_installed(program: &str) -> bool {
    let found = Command::new(program).arg("--version").stdout(Stdio::null()).status().is_ok();
    let required = std::env::var("PLOTPLAN_REQUIRE_COMPILERS").is_ok();
    assert!(found || !required, "{program} is not installed");
    found
}

#[test]
fn reader_links_for_an_arduino_uno() {
    if !is_installed("avr-gcc") {
        return;
    }
    let dir = folder("avr.c");
    compile(
        &dir,
        "avr-gcc",
        "-mmcu=atmega328p -DF_CPU=16000000UL -std=c99 -Os -Wall -Wextra -Werror -o avr.elf avr.c",
    );
    let sizes = compile(&dir, "avr-size", "avr.elf");
    let sizes: Vec<u32> = sizes
        .lines()
        .nth(1)
        .expect("a line of sizes")
        .split_whitespace()
        .filter_map(|n| n.parse().ok())
        .collect();
    let [text, data, bss, ..] = sizes[..] else { panic!("{sizes:?}") };
    // The chip has 32 kB of flash and 2 kB of memory; the page states about 2 kB.
    assert!(text + data < 3_000, "{text} + {data} bytes of flash");
    assert!(data + bss < 512, "{data} + {bss} bytes of memory");
}

/// Sends the plan to the reader, of which every n-th line is lost; the moves that it executed.
fn send(every: &str) -> (Vec<[i64; 4]>, Vec<[i64; 4]>, String) {
    let dir = folder("host.c");
    compile(&dir, "cc", "-std=c99 -O1 -Wall -Wextra -Werror -o host host.c");
    dir.write("drawing.hpgl", DRAWING);
    let plotplan = |arguments: &str| {
        let mut command = Command::new(cargo_bin!("plotplan"));
        let output =
            command.current_dir(dir.path()).args(arguments.split(' ')).output().expect("the program runs");
        let printed = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "plotplan {arguments}\n{printed}");
        printed
    };
    plotplan("convert drawing.hpgl --machine corexy --period 20ms -o plan.ticks");
    let mut reader = Command::new(dir.path().join("host"))
        .current_dir(dir.path())
        .args(["moves.csv", every])
        .stdout(Stdio::piped())
        .spawn()
        .expect("the reader runs");
    let mut port = String::new();
    BufReader::new(reader.stdout.take().expect("its output")).read_line(&mut port).expect("a line");
    let printed = plotplan(&format!("send plan.ticks --protocol ticks --port {}", port.trim_end()));
    assert!(reader.wait().expect("it ends").success());
    let plan = plan::file::read(dir.text("plan.ticks").as_bytes()).expect("a plan").table;
    let expected = plan.rows.windows(2).map(|pair| {
        let [a, b] = pair[1].ticks;
        [i64::from(pair[0].pen), a, b, (pair[1].t_us - pair[0].t_us) as i64]
    });
    let moves = dir.text("moves.csv");
    let moves = moves.lines().map(|line| {
        let numbers: Vec<i64> = line.split(',').map(|number| number.parse().expect("a number")).collect();
        [numbers[0], numbers[1], numbers[2], numbers[3]]
    });
    (moves.collect(), expected.collect(), printed)
}

#[test]
fn reader_receives_a_plan_from_send() {
    if !is_installed("cc") {
        return;
    }
    let (moves, expected, printed) = send("0");
    assert_eq!(moves, expected);
    assert!(!printed.contains("retransmitted"), "{printed}");
}

#[test]
fn reader_executes_lost_lines_once() {
    if !is_installed("cc") {
        return;
    }
    let (moves, expected, printed) = send("17");
    assert_eq!(moves, expected);
    assert!(printed.contains("retransmitted"), "{printed}");
}
