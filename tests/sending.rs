//! `plotplan send` and an emulated controller over a pseudo-terminal: every protocol with every fault,
//! stopped and resumed. The ink equals that of the plan, drawn once.
#![cfg(unix)]

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::Duration;

use assert_cmd::cargo::cargo_bin;
use backends::Ink;
use compiler::machine_file::{MachineFile, PRESETS};
use kinematics::{Machine, MotorPos};
use plan::TickTable;
use tempfile::TempDir;

/// A corner, a circle, a dot.
const DRAWING: &str = "IN;SP1;PU400,400;PD800,400,800,600;PU600,1000;CI120;PU300,900;PD;PU;";
const MACHINE: &str = "hbot";
const PROTOCOLS: [&str; 4] = ["ticks", "xy-serial", "gcode", "ebb"];
/// Speed-up of the emulators.
const SPEEDUP: &str = "10";

type Lines = Vec<(u16, Vec<[f64; 2]>)>;

/// A temporary folder with a drawing and its plan.
struct Desk {
    folder: TempDir,
}

impl Desk {
    fn new(drawing: &str) -> Self {
        let desk = Self { folder: TempDir::new().expect("a temporary folder") };
        std::fs::write(desk.path("drawing.hpgl"), drawing).expect("a file can be written");
        desk.good(&["convert", "drawing.hpgl", "-m", MACHINE, "-o", "plan.ticks"]);
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(cargo_bin!("plotplan"));
        command.current_dir(self.folder.path()).args(arguments);
        command
    }

    fn good(&self, arguments: &[&str]) -> Output {
        let output = self.command(arguments).output().expect("the program runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "plotplan {}: {said}", arguments.join(" "));
        output
    }

    fn plan(&self) -> TickTable {
        plan::file::read(&std::fs::read(self.path("plan.ticks")).expect("a plan")).expect("a plan").table
    }

    /// Starts an emulator with the port `name`.
    fn device(&self, protocol: &str, name: &str, options: &[&str]) -> Machinery {
        let ink = format!("{name}.csv");
        let svg = format!("{name}.svg");
        let mut command = self.command(&["emulate", "--protocol", protocol, "--link", name, "-m", MACHINE]);
        command.args(["--ink", &ink, "--svg", &svg]).args(options).stdout(Stdio::piped());
        let mut child = command.spawn().expect("the program runs");
        // It prints the name of the port when it can be opened.
        let mut line = String::new();
        let out = child.stdout.take().expect("its output");
        BufReader::new(out).read_line(&mut line).expect("a line");
        assert_eq!(line.trim_end(), name);
        Machinery { child, ink: self.path(&ink), svg: self.path(&svg) }
    }

    fn send(&self, protocol: &str, port: &str, options: &[&str]) -> Command {
        let mut command = self.command(&["send", "plan.ticks", "--protocol", protocol, "--port", port]);
        command.args(options);
        command
    }
}

/// A running emulator.
struct Machinery {
    child: Child,
    ink: PathBuf,
    svg: PathBuf,
}

fn interrupt(child: &Child) {
    let done = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(done.success());
}

impl Drop for Machinery {
    fn drop(&mut self) {
        // After a failed test: the emulator would keep the output of the test open.
        let _ = self.child.kill();
    }
}

impl Machinery {
    /// Stops the emulator and returns its ink.
    fn ink(mut self) -> Lines {
        interrupt(&self.child);
        assert!(self.child.wait().expect("it ends").success());
        read_ink(&self.ink)
    }
}

fn read_ink(path: &Path) -> Lines {
    let text = std::fs::read_to_string(path).expect("a table of ink");
    let mut lines: Lines = Vec::new();
    for row in text.lines().skip(1) {
        let fields: Vec<&str> = row.split(',').collect();
        let line: usize = fields[0].parse().expect("a number");
        if lines.len() == line {
            lines.push((fields[1].parse().expect("a pen"), Vec::new()));
        }
        lines[line].1.push([2, 3].map(|column: usize| fields[column].parse().expect("a place")));
    }
    lines
}

fn machine() -> Machine {
    let preset = PRESETS.iter().find(|preset| preset.name == MACHINE).expect(MACHINE);
    MachineFile::parse(preset.toml).and_then(|file| file.machine()).expect("a sound preset")
}

/// The expected ink in units of the controller.
fn wanted(protocol: &str, plan: &TickTable) -> Lines {
    let machine = machine();
    let start = plan.rows[0].ticks;
    let place = |ticks: [i64; 2]| {
        let at = machine.forward_from_motors(&MotorPos::from(ticks.map(|ticks| ticks as f64)));
        let rounded = |unit: f64| [at.x, at.y].map(|mm| (mm * unit).round() / unit);
        match protocol {
            "xy-serial" => rounded(10.0),
            "gcode" => rounded(1000.0),
            "ebb" => [0, 1].map(|motor| (ticks[motor] - start[motor]) as f64),
            _ => ticks.map(|ticks| ticks as f64),
        }
    };
    let mut ink = Ink::default();
    for pair in plan.rows.windows(2) {
        ink.pen(pair[0].pen, place(pair[0].ticks));
        ink.go(place(pair[1].ticks));
    }
    ink.lines()
}

#[test]
fn faults_in_every_protocol_leave_ink_unchanged() {
    let desk = Desk::new(DRAWING);
    let plan = desk.plan();
    // Times are those of the emulator, which runs ten times faster than real time.
    let faults = [
        "none",
        "lost-answer=40",
        "late-answer=40:12s",
        "garbled-answer=40",
        "full-buffer=2500ms:5s",
        "unplugged=3s:4s",
    ];
    thread::scope(|scope| {
        for protocol in PROTOCOLS {
            for (number, fault) in faults.into_iter().enumerate() {
                let (desk, plan) = (&desk, &plan);
                scope.spawn(move || {
                    let name = format!("tty-{protocol}-{number}");
                    // Enough time to open the port before it disappears.
                    let speedup = if fault.starts_with("unplugged") { "2" } else { SPEEDUP };
                    let mut options = vec!["--speedup", speedup];
                    if fault != "none" {
                        options.extend(["--fault", fault]);
                    }
                    let device = desk.device(protocol, &name, &options);
                    let output = desk.send(protocol, &name, &[]).output().expect("the program runs");
                    let said = String::from_utf8_lossy(&output.stderr).into_owned();
                    assert!(output.status.success(), "{protocol} {fault}: {said}");
                    let svg = device.svg.clone();
                    assert_eq!(device.ink(), wanted(protocol, plan), "{protocol} {fault}");
                    let picture = std::fs::read_to_string(svg).expect("a picture");
                    assert!(picture.contains("<path") || picture.contains("<polyline"), "{protocol} {fault}");
                });
            }
        }
    });
}

#[test]
fn resume_after_ctrl_c() {
    let desk = Desk::new(DRAWING);
    let plan = desk.plan();
    thread::scope(|scope| {
        for protocol in PROTOCOLS {
            for after_ms in [300, 900, 1500] {
                let (desk, plan) = (&desk, &plan);
                scope.spawn(move || {
                    let what = format!("{protocol} stopped after {after_ms} ms");
                    let name = format!("tty-{protocol}-{after_ms}");
                    let device = desk.device(protocol, &name, &["--speedup", "2"]);
                    let log = format!("{name}.log");
                    let mut sender = desk.send(protocol, &name, &["--log", &log]);
                    let sender = sender.stderr(Stdio::piped()).spawn().expect("the program runs");
                    // It can be stopped after its first line of output.
                    while std::fs::read(desk.path(&log)).map_or(0, |log| log.len()) == 0 {
                        thread::sleep(Duration::from_millis(10));
                    }
                    thread::sleep(Duration::from_millis(after_ms));
                    interrupt(&sender);
                    let output = sender.wait_with_output().expect("it ends");
                    let said = String::from_utf8_lossy(&output.stderr).into_owned();
                    assert_eq!(output.status.code(), Some(130), "{what}: {said}");
                    let command = said.lines().last().expect("a command").trim();
                    let words: Vec<&str> = command.split(' ').skip(1).collect();
                    assert_eq!(words[words.len() - 2], "--from", "{what}: {said}");
                    desk.good(&words);
                    assert_eq!(device.ink(), wanted(protocol, plan), "{what}: {said}");
                });
            }
        }
    });
}

#[test]
fn lost_port_times_out() {
    let desk = Desk::new(DRAWING);
    let device = desk.device("ticks", "tty", &["--fault", "unplugged=2s:60min"]);
    let output =
        desk.send("ticks", "tty", &["--reconnect", "500ms", "--log", "wire.log"]).output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("tty was lost") && said.contains("--from"), "{said}");
    let log = std::fs::read_to_string(desk.path("wire.log")).expect("a log");
    assert!(
        log.contains("> 0:begin 1 ") && log.contains("< ok 1*") && log.contains("! the port was lost"),
        "{log}"
    );
    drop(device.ink());
}

#[test]
fn resume_from_reported_position_after_lost_port() {
    let desk = Desk::new(DRAWING);
    let plan = desk.plan();
    thread::scope(|scope| {
        for protocol in ["ticks", "gcode", "ebb"] {
            for at in ["1500ms", "2s", "2500ms"] {
                let (desk, plan) = (&desk, &plan);
                scope.spawn(move || {
                    let what = format!("{protocol} unplugged at {at}");
                    let name = format!("tty-{protocol}-{at}");
                    // Disconnected for a second, while it executes its buffer.
                    let device = desk.device(protocol, &name, &["--fault", &format!("unplugged={at}:1s")]);
                    let output =
                        desk.send(protocol, &name, &["--reconnect", "100ms"]).output().expect("runs");
                    let said = String::from_utf8_lossy(&output.stderr).into_owned();
                    assert_eq!(output.status.code(), Some(3), "{what}: {said}");
                    thread::sleep(Duration::from_secs(2));
                    let words: Vec<&str> =
                        said.lines().last().expect("a command").trim().split(' ').skip(1).collect();
                    desk.good(&words);
                    assert_eq!(device.ink(), wanted(protocol, plan), "{what}: {said}");
                });
            }
        }
    });
}

#[test]
fn send_reads_plans_and_firmware_formats() {
    let desk = Desk::new(DRAWING);
    desk.good(&["convert", "drawing.hpgl", "-m", MACHINE, "-f", "csv", "-o", "plan.csv"]);
    desk.good(&["convert", "drawing.hpgl", "-m", MACHINE, "-f", "json", "-o", "plan.json"]);
    desk.good(&["convert", "drawing.hpgl", "-m", MACHINE, "-f", "gcode-timed", "-o", "plan.gcode"]);
    desk.good(&["convert", "drawing.hpgl", "-m", MACHINE, "-f", "xy-serial", "-o", "plan.xy"]);
    desk.good(&["convert", "drawing.hpgl", "-m", MACHINE, "-f", "gcode-grbl", "-o", "arcs.gcode"]);
    let sent = |file: &str, protocol: &str| {
        let port = format!("tty-{file}-{protocol}");
        let device = desk.device(protocol, &port, &["--speedup", SPEEDUP]);
        desk.good(&["send", file, "--protocol", protocol, "--port", &port]);
        device.ink()
    };
    let plan = desk.plan();
    for (file, protocol) in [("plan.csv", "ticks"), ("plan.json", "ebb"), ("plan.json", "gcode")] {
        assert_eq!(sent(file, protocol), wanted(protocol, &plan), "{file} {protocol}");
    }
    // Computed from positions before rounding to ticks: they differ by half a tick of both motors.
    for (file, protocol) in [("plan.gcode", "gcode"), ("plan.xy", "xy-serial")] {
        let (drawn, plan) = (sent(file, protocol), wanted(protocol, &plan));
        assert_eq!(drawn.len(), plan.len(), "{file}");
        let ends = |lines: &Lines| {
            lines.iter().flat_map(|(_, line)| [line[0], line[line.len() - 1]]).collect::<Vec<_>>()
        };
        for (drawn, planned) in ends(&drawn).into_iter().zip(ends(&plan)) {
            let off = libm::hypot(drawn[0] - planned[0], drawn[1] - planned[1]);
            assert!(off < 0.0807 + 0.071, "{file}: {drawn:?} instead of {planned:?}");
        }
    }
    let arcs = sent("arcs.gcode", "gcode");
    let circle = &arcs[1].1;
    assert!(circle.iter().all(|[x, y]| (libm::hypot(x - 15.0, y - 25.0) - 3.0).abs() < 0.001), "{circle:?}");
}

#[test]
fn pen_changes_are_named_and_await_the_operator() {
    let desk = Desk::new("IN;SP1;PU100,100;PD300,100;PU;SP2;PU100,200;PD300,200;PU;");
    let plan = desk.plan();
    let device = desk.device("gcode", "tty", &["--speedup", SPEEDUP]);
    let mut sender = desk.send("gcode", "tty", &[]);
    let mut sender = sender.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program runs");
    std::io::Write::write_all(&mut sender.stdin.take().expect("its input"), b"\n\n").expect("it takes Enter");
    let output = sender.wait_with_output().expect("it ends");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{stderr}");
    for pen in ["put in pen 1", "put in pen 2"] {
        assert!(stderr.contains(&format!("the machine waits for a pen change: {pen}")), "{stderr}");
    }
    let wanted: Lines = wanted("gcode", &plan).into_iter().map(|(_, line)| (1, line)).collect();
    assert_eq!(device.ink(), wanted);
}

/// Reads lines until one contains `text`.
fn await_line(reader: &mut impl std::io::BufRead, text: &str) {
    let mut seen = String::new();
    while !seen.lines().last().is_some_and(|line| line.contains(text)) {
        assert!(reader.read_line(&mut seen).expect("text") > 0, "no {text} in {seen}");
    }
}

#[test]
fn pause_key_pauses_at_the_next_pen_up() {
    let desk = Desk::new(DRAWING);
    let plan = desk.plan();
    thread::scope(|scope| {
        for protocol in PROTOCOLS {
            let (desk, plan) = (&desk, &plan);
            scope.spawn(move || {
                let name = format!("tty-pause-{protocol}");
                let device = desk.device(protocol, &name, &["--speedup", "2"]);
                let mut sender = desk.send(protocol, &name, &[]);
                let mut sender =
                    sender.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program runs");
                let mut keys = sender.stdin.take().expect("its input");
                let mut stderr = BufReader::new(sender.stderr.take().expect("its messages"));
                std::io::Write::write_all(&mut keys, b"p").expect("a key");
                await_line(&mut stderr, "paused with the pen up");
                std::io::Write::write_all(&mut keys, b"p").expect("a key");
                await_line(&mut stderr, "sent ");
                assert!(sender.wait().expect("it ends").success(), "{protocol}");
                assert_eq!(device.ink(), wanted(protocol, plan), "{protocol}");
            });
        }
    });
}

#[test]
fn servo_and_z_pens_through_send() {
    let desk = Desk::new(DRAWING);
    let plan = desk.plan();
    let settings: [(&str, &[&str]); 5] = [
        ("ebb", &["--pen-by", "servo"]),
        ("ebb", &["--pen-positions", "20000,9000"]),
        ("ebb", &["--stepper-moves"]),
        ("gcode", &["--pen-by", "z"]),
        ("gcode", &["--pen-by", "servo", "--pen-positions", "10,70"]),
    ];
    thread::scope(|scope| {
        for (number, (protocol, options)) in settings.into_iter().enumerate() {
            let (desk, plan) = (&desk, &plan);
            scope.spawn(move || {
                let name = format!("tty-pen-{number}");
                let device = desk.device(protocol, &name, &["--speedup", SPEEDUP]);
                let output = desk.send(protocol, &name, options).output().expect("the program runs");
                let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
                assert!(output.status.success(), "{protocol} {options:?}: {stderr}");
                assert_eq!(device.ink(), wanted(protocol, plan), "{protocol} {options:?}");
            });
        }
    });
}

#[test]
fn small_receive_buffers_and_announced_room() {
    let desk = Desk::new(DRAWING);
    let plan = desk.plan();
    for (name, options) in
        [("tty-64", &["--buffer", "64"][..]), ("tty-room", &["--buffer", "64", "--announce-room"])]
    {
        let options = [&["--speedup", SPEEDUP], options].concat();
        let device = desk.device("ticks", name, &options);
        desk.good(&["send", "plan.ticks", "--protocol", "ticks", "--port", name]);
        assert_eq!(device.ink(), wanted("ticks", &plan), "{options:?}");
    }
}

#[test]
fn ports_are_serial_devices() {
    let desk = Desk::new("IN;SP1;PU100,100;PD104,100;PU;");
    std::fs::write(desk.path("notes.txt"), "keep this").expect("a file can be written");
    for port in ["notes.txt", "/dev/null", ".", "nosuch", "tcp:localhost", "tcp:127.0.0.1:1"] {
        let output = desk.send("raw", port, &[]).output().expect("the program runs");
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(3), "{port}: {stderr}");
        assert!(stderr.contains(&format!("cannot open {port}")), "{stderr}");
    }
    assert_eq!(std::fs::read(desk.path("notes.txt")).expect("a file"), b"keep this");
}

/// A port at whose other end nobody reads or answers.
fn silent_port() -> (serialport::TTYPort, String) {
    let (ours, theirs) = serialport::TTYPort::pair().expect("a pseudo-terminal");
    let name = serialport::SerialPort::name(&theirs).expect("a name");
    std::mem::forget(theirs);
    (ours, name)
}

/// Sends a signal and gives how long the process takes to end, and what it printed.
fn end_with(signal: &str, child: Child) -> (Duration, Output) {
    #[allow(clippy::disallowed_methods, reason = "it is about time")]
    let begun = std::time::Instant::now();
    let done = Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill runs");
    assert!(done.success());
    let output = child.wait_with_output().expect("it ends");
    (begun.elapsed(), output)
}

#[test]
fn signals_end_commands_within_half_a_second() {
    let desk = Desk::new(DRAWING);
    std::fs::write(desk.path("lines.txt"), "a line of 26 characters...\n".repeat(40_000)).expect("a file");
    for protocol in ["ticks", "xy-serial", "gcode", "ebb", "raw"] {
        for signal in ["-INT", "-TERM"] {
            // Nobody answers; with raw the port takes no more bytes.
            let (_ours, name) = silent_port();
            let file = if protocol == "raw" { "lines.txt" } else { "plan.ticks" };
            let mut sender = desk.command(&["send", file, "--protocol", protocol, "--port", &name]);
            let sender = sender.stderr(Stdio::piped()).spawn().expect("the program runs");
            thread::sleep(Duration::from_millis(700));
            let (took, output) = end_with(signal, sender);
            let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(130), "{protocol} {signal}: {stderr}");
            assert!(took < Duration::from_millis(500), "{protocol} {signal}: {took:?}");
            assert!(stderr.contains("acknowledged nothing"), "{protocol} {signal}: {stderr}");
            assert!(!stderr.contains("with the pen up"), "{protocol} {signal}: {stderr}");
        }
    }
    let mut device = desk.device("ticks", "tty", &[]);
    let done = Command::new("kill").args(["-TERM", &device.child.id().to_string()]).status();
    assert!(done.expect("kill runs").success());
    thread::sleep(Duration::from_millis(450));
    assert!(device.child.try_wait().expect("a child").is_some_and(|status| status.success()));
}

#[test]
fn tcp_port() {
    use std::io::{Read as _, Write as _};

    let desk = Desk::new("IN;SP1;PU100,100;PD300,100;PU;");
    let plan = desk.plan();
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = format!("tcp:{}", listener.local_addr().expect("an address"));
    let start = plan.rows[0].ticks;
    let server = thread::spawn(move || {
        let options = backends::EmulatorOptions { start: Some(start), ..Default::default() };
        let mut device = backends::find("ticks").expect("ticks").emulator(&options).expect("an emulator");
        let (mut stream, _) = listener.accept().expect("a sender");
        stream.set_read_timeout(Some(Duration::from_millis(2))).expect("a timeout");
        #[allow(clippy::disallowed_methods, reason = "it runs in time")]
        let begun = std::time::Instant::now();
        let mut buffer = [0; 256];
        loop {
            let received = match stream.read(&mut buffer) {
                Ok(0) => return device.ink().lines(),
                Ok(count) => count,
                Err(_) => 0,
            };
            let now_us = begun.elapsed().as_micros() as u64 * 10;
            device.receive(&buffer[..received], now_us);
            let _ = stream.write_all(&device.answers().concat());
        }
    });
    desk.good(&["send", "plan.ticks", "--protocol", "ticks", "--port", &port]);
    // The lines are acknowledged before the last ones are executed; the server sees the end of the connection.
    let drawn = server.join().expect("the server ends");
    let wanted = wanted("ticks", &plan);
    assert_eq!(drawn.first().map(|line| line.1[0]), wanted.first().map(|line| line.1[0]));
}

#[test]
fn old_command_words_are_accepted() {
    let desk = Desk::new("IN;SP1;PU100,100;PD104,100;PU;");
    let arguments = ["device", "--protocol", "ticks", "--haste", "0", "--rest", "1s"];
    let output = desk.command(&arguments).output().expect("the program runs");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("--speedup must be a positive number"), "{stderr}");
}

#[test]
fn raw_and_paced_protocols() {
    let desk = Desk::new("IN;SP1;PU100,100;PD300,100;PU;");
    let plan = desk.plan();
    // As fast as the emulator reads; its pseudo-terminal blocks the sender.
    let device = desk.device("ticks", "tty-raw", &["--speedup", SPEEDUP]);
    desk.good(&["send", "plan.ticks", "--protocol", "raw", "--port", "tty-raw"]);
    thread::sleep(Duration::from_secs(1));
    assert_eq!(device.ink(), wanted("ticks", &plan), "raw");
    // Paced: sending takes as long as the plan.
    let device = desk.device("ticks", "tty-paced", &[]);
    #[allow(clippy::disallowed_methods, reason = "it is about time")]
    let begun = std::time::Instant::now();
    desk.good(&["send", "plan.ticks", "--protocol", "paced", "--port", "tty-paced", "--lead", "100ms"]);
    let took_us = begun.elapsed().as_micros() as u64;
    assert!(took_us >= plan.header.duration_us, "{took_us} us of {}", plan.header.duration_us);
    thread::sleep(Duration::from_millis(300));
    assert_eq!(device.ink(), wanted("ticks", &plan), "paced");
}

#[test]
fn dry_run_output() {
    let desk = Desk::new("IN;SP1;PU100,100;PD104,100;PU;");
    let mut shown = String::new();
    for protocol in PROTOCOLS.into_iter().chain(["paced", "raw"]) {
        let output = desk.good(&["send", "plan.ticks", "--protocol", protocol, "--dry-run"]);
        let lines = String::from_utf8(output.stdout).expect("text");
        let lines: Vec<&str> = lines.lines().collect();
        let (head, tail) = (lines[..6].join("\n"), lines[lines.len() - 2..].join("\n"));
        shown.extend([format!("{protocol}: {} lines\n{head}\n...\n{tail}\n\n", lines.len())]);
    }
    insta::assert_snapshot!(shown);
    let output = desk
        .command(&["send", "plan.ticks", "--protocol", "ticks", "--port", "nosuch"])
        .output()
        .expect("runs");
    assert_eq!(output.status.code(), Some(3));
    let output = desk.command(&["send", "plan.ticks", "--protocol", "ticks", "--dry-run", "--from", "9999"]);
    let mut output = output;
    assert_eq!(output.output().expect("runs").status.code(), Some(2));
}

/// The strokes of a file for the plotter, in plotter units.
fn plotter_strokes(file: &Path) -> Lines {
    let options = hpgl::Options { plotter_unit_mm: 1.0, ..hpgl::Options::default() };
    let document = hpgl::read(&std::fs::read(file).expect("a file"), &options);
    let strokes = document.pages[0].drawing.strokes.iter();
    strokes
        .map(|stroke| (stroke.pen.0, stroke.points().map(|p| [p.x.round(), p.y.round()]).collect()))
        .collect()
}

/// Two pens, a closed figure, a dot; A4 in an HP 7475A.
const FOR_PLOTTER: &str = "IN;SP1;PU400,400;PD4000,400,4000,3000,400,3000,400,400;PU;SP2;PU600,900;PD3000,900;PU5000,900;PD;PU5000,2000;PD5000,2500,7000,2500,7000,5000;PU;";

fn plotter_desk() -> Desk {
    let desk = Desk::new(FOR_PLOTTER);
    desk.good(&[
        "convert",
        "drawing.hpgl",
        "-f",
        "hpgl",
        "--plotter",
        "hp7475a",
        "--paper",
        "A4",
        "-o",
        "a.plt",
    ]);
    assert_eq!(plotter_strokes(&desk.path("a.plt")).len(), 4);
    desk
}

#[test]
fn pen_plotter_with_faults() {
    let desk = plotter_desk();
    let wanted = plotter_strokes(&desk.path("a.plt"));
    let faults = [
        "lost-answer=9",
        "late-answer=8:20s",
        "garbled-answer=9",
        "full-buffer=9s:20s",
        "held=10s:200s",
        "unplugged=12s:20s",
    ];
    thread::scope(|scope| {
        for (k, fault) in faults.into_iter().enumerate() {
            let (desk, wanted) = (&desk, &wanted);
            scope.spawn(move || {
                let name = format!("tty-{k}");
                let device = desk.device("hpgl", &name, &["--speedup", SPEEDUP, "--fault", fault]);
                let sent = desk.good(&["send", "a.plt", "--protocol", "hpgl", "--port", &name]);
                let said = String::from_utf8_lossy(&sent.stderr).into_owned();
                assert!(said.contains("m of ink drawn"), "{fault}: {said}");
                assert_eq!(device.ink(), *wanted, "{fault}: {said}");
            });
        }
    });
}

#[test]
fn pen_plotter_stopped_at_a_stroke_and_resumed() {
    let desk = plotter_desk();
    let wanted = plotter_strokes(&desk.path("a.plt"));
    for flow in ["none", "software"] {
        let name = format!("tty-{flow}");
        let device = desk.device("hpgl", &name, &["--speedup", "4"]);
        let mut sender = desk.command(&["send", "a.plt", "--protocol", "hpgl", "--port", &name]);
        sender.args(["--flow", flow]);
        let sender = sender.stderr(Stdio::piped()).spawn().expect("the program runs");
        thread::sleep(Duration::from_millis(2500));
        interrupt(&sender);
        let output = sender.wait_with_output().expect("it ends");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(130), "{flow}: {said}");
        assert!(said.contains("stopped at stroke"), "{flow}: {said}");
        let command = said.lines().last().expect("a command").trim();
        let words: Vec<&str> = command.split(' ').skip(1).collect();
        assert_eq!(words[words.len() - 2], "--from", "{flow}: {said}");
        desk.good(&words);
        assert_eq!(device.ink(), wanted, "{flow}: {said}");
    }
}

#[test]
fn pen_plotter_refusals() {
    let desk = plotter_desk();
    let refused = |arguments: &[&str], wanted: &str| {
        let output = desk.command(arguments).output().expect("the program runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && said.contains(wanted), "{arguments:?}: {said}");
    };
    let to =
        |plotter, paper| ["convert", "drawing.hpgl", "-f", "hpgl", "--plotter", plotter, "--paper", paper];
    refused(&to("hp7470a", "a3"), "hp7470a has no paper `a3`; it takes a4, a");
    refused(&to("hp7471", "a4"), "unknown");
    refused(&["send", "plan.svg", "--protocol", "hpgl", "--dry-run"], "cannot read plan.svg");
    desk.good(&["convert", "drawing.hpgl", "-f", "svg", "-o", "plan.svg"]);
    refused(
        &["send", "plan.svg", "--protocol", "hpgl", "--dry-run"],
        "plan.svg is SVG; a plotter takes HP-GL",
    );
    // Before the port is opened: there is none of that name.
    std::fs::write(desk.path("lo.plt"), "IN;SP1;LO5;PU0,0;PD400,0;PU;").expect("a file");
    refused(
        &["send", "lo.plt", "--protocol", "hpgl", "--port", "none", "--plotter", "hp7475a"],
        "HP 7475A does not know the instruction LO",
    );
    refused(
        &["send", "lo.plt", "--protocol", "hpgl", "--port", "none", "--plotter", "hp7550a"],
        "cannot open none",
    );
    std::fs::write(desk.path("far.hpgl"), "IN;SP1;PU0,0;PD16000,0;PU;").expect("a file");
    refused(
        &["convert", "far.hpgl", "-f", "hpgl", "--plotter", "hp7475a", "--paper", "a4"],
        "--fit scales it to the paper",
    );
    let _device = desk.device("hpgl", "tty", &["--speedup", SPEEDUP]);
    refused(
        &["send", "far.hpgl", "--protocol", "hpgl", "--port", "tty"],
        "it reports the limits (OH) 0,0 to 11040,7721",
    );
    std::fs::write(desk.path("plain.plt"), "IN;SP1;PU0,0;PD400,0;PU;").expect("a file");
    refused(
        &["send", "plain.plt", "--protocol", "hpgl", "--port", "tty", "--plotter", "hp7550a"],
        "calls itself 7475A",
    );
    // Limits from a file.
    let own = plotter_file("[0, 0, 5000, 5000]");
    std::fs::write(desk.path("own.toml"), &own).expect("a file");
    let command = ["convert", "drawing.hpgl", "-f", "hpgl", "--plotter", "own.toml"];
    refused(&command, "own.toml draws from 0, 0 to 125.00, 125.00 mm on sheet");
    desk.good(&[&command[..], &["--fit", "-o", "own.plt"]].concat());
    std::fs::write(desk.path("own.toml"), own.replace("pens", "pencils")).expect("a file");
    refused(&command, "unknown field `pencils`");
}

fn plotter_file(hard_clip: &str) -> String {
    format!(
        "title = \"own\"\nunit_mm = 0.025\npens = 2\nbuffer_bytes = 100\nhandshakes = [\"polling\"]\nmax_speed_cm_s = 10\n\n[[paper]]\nname = \"sheet\"\nhard_clip = {hard_clip}\n"
    )
}
