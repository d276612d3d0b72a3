//! The command line: output, exit codes and files of every command.

use std::fs;
use std::io::Read as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use assert_cmd::cargo::cargo_bin;
use tempfile::TempDir;

/// A line with a corner, a circle, a line of a second pen, a dot: 30 mm x 25 mm, within reach of every preset.
const TINY: &str = "IN;SP1;\nPU400,400;PD1200,400,1200,1000;\nPU800,800;CI200;\nSP2;PU200,1000;PD200,600;\nPU300,900;PD;PU;\nSP0;\n";
/// A line of 0.5 m.
const LARGE: &str = "IN;SP1;PU400,400;PD1200,400;PU;PA20000,0;PD;PA400,400;PU;SP0;";
const TWO_PAGES: &str = "IN;SP1;PU40,40;PD400,40;PU;PG;SP3;PU40,40;PD40,400,800,400;PU;PG;";
const QUIRKS: &str = "IN;SP1;PU400,400;QQ7;PD800,400;XY1,2;PD400,800,9;PU;LBhello";
/// Three pens from left to right, the first line twice; the third pen is slow.
const PENS: &str = "IN;SP1;PU400,400;PD1200,400;PU400,400;PD1200,400;SP2;PU400,800;PD1200,800;SP3;VS2;PU400,1200;PD1200,1200;PU;SP0;";
/// Two layers of two colours, a hidden one, a filled square, a picture, text.
const LAYERS: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"
  width="60mm" height="40mm" viewBox="0 0 60 40" fill="none">
  <g inkscape:groupmode="layer" inkscape:label="4 blue">
    <circle cx="30" cy="20" r="10" stroke="#00f"/>
    <rect id="square" x="5" y="5" width="4" height="4" fill="red"/>
  </g>
  <g inkscape:groupmode="layer" inkscape:label="outline" stroke="#f00">
    <path d="M10 10H50V30"/>
    <image id="photo" href="photo.png" width="9" height="9"/>
    <text x="30" y="38" font-family="Helvetica" font-size="5" text-anchor="middle" fill="#f00" stroke="none">Hi</text>
  </g>
  <g inkscape:groupmode="layer" inkscape:label="hidden" display="none"><path d="M0 0H60" stroke="#0f0"/></g>
</svg>
"##;
const PRESETS: [&str; 5] = ["coaxial", "corexy", "hbot", "polar", "cartesian"];

/// A temporary working folder of the program.
struct TestDir {
    folder: TempDir,
}

impl TestDir {
    fn new() -> Self {
        let dir = Self { folder: TempDir::new().expect("a temporary folder") };
        dir.write("tiny.hpgl", TINY);
        dir.write("large.hpgl", LARGE);
        dir
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path().join(name), text).expect("a file can be written");
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path().join(name)).expect(name)
    }

    fn text(&self, name: &str) -> String {
        String::from_utf8(self.bytes(name)).expect("text")
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.path()).expect("the folder can be read");
        let mut names: Vec<String> = entries
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(cargo_bin!("plotplan"));
        command.current_dir(self.path()).args(arguments.split_whitespace());
        // Width and colour must not depend on the terminal.
        command.env("COLUMNS", "100").env_remove("CLICOLOR_FORCE").env_remove("NO_COLOR");
        command
    }

    fn run(&self, arguments: &str) -> CommandOutput {
        self.run_with(arguments, "")
    }

    fn run_with(&self, arguments: &str, input: &str) -> CommandOutput {
        let mut command = assert_cmd::Command::from_std(self.command(arguments));
        CommandOutput::of(command.write_stdin(input).output().expect("the program runs"))
    }

    /// Runs the program and returns its output; fails if it does.
    fn succeed(&self, arguments: &str) -> CommandOutput {
        let said = self.run(arguments);
        assert_eq!(said.code, 0, "plotplan {arguments}\n{}", said.err);
        said
    }

    /// Output and exit code of each command, for a snapshot.
    fn transcript(&self, arguments: &[&str]) -> String {
        let of = |arguments: &&str| {
            let CommandOutput { code, out, err } = self.run(arguments);
            format!("$ plotplan {arguments}\n{}{err}[{code}]\n", String::from_utf8_lossy(&out))
        };
        arguments.iter().map(of).collect::<Vec<_>>().join("\n")
    }
}

struct CommandOutput {
    code: i32,
    out: Vec<u8>,
    err: String,
}

impl CommandOutput {
    fn of(output: Output) -> Self {
        Self {
            code: output.status.code().expect("it ends by itself"),
            out: output.stdout,
            err: String::from_utf8(output.stderr).expect("text"),
        }
    }

    fn text(&self) -> &str {
        std::str::from_utf8(&self.out).expect("text")
    }
}

#[test]
fn usage_errors_exit_2() {
    let dir = TestDir::new();
    dir.write("sped.toml", &dir.succeed("machine show coaxial").text().replacen("max_speed", "max_sped", 1));
    dir.write("singular.toml", &dir.succeed("machine show corexy").text().replacen("[1, -1]", "[2, 2]", 1));
    let said = dir.transcript(&[
        "convert tiny.hpgl",
        "convert tiny.hpgl --machine coxial",
        "convert tiny.hpgl --machine typewriter",
        "convert tiny.hpgl --machine sped.toml",
        "convert tiny.hpgl --machine singular.toml",
        "convert tiny.hpgl --machine coaxial --tolerance 3parsec",
        "convert tiny.hpgl --machine coaxial --tolerance 0",
        "convert tiny.hpgl --machine coaxial --period 10",
        "convert tiny.hpgl --machine coaxial --period 0ms",
        "convert tiny.hpgl --machine coaxial --place 1in",
        "convert tiny.hpgl --machine coaxial --scale -1",
        "convert tiny.hpgl --machine coaxial --rotate nan",
        "convert tiny.hpgl --machine coaxial --fit --scale 2",
        "convert tiny.hpgl --machine coaxial --format gcode",
        "convert",
        "convert tiny.hpgl --machine coaxial --effort 9",
        "convert tiny.hpgl --machine coaxial --pen-order one",
        "check tiny.hpgl --page 2",
        "check tiny.hpgl --plotter hp7475",
        "check tiny.hpgl --plotter hp7475a --paper a9",
        "check tiny.hpgl --paper a4",
        "verify - --drawing -",
        "preview tiny.hpgl --output tiny.gif",
        "machine show coxial",
        "explain H9999",
    ]);
    insta::assert_snapshot!(said);
}

#[test]
fn io_errors_exit_3() {
    let dir = TestDir::new();
    let before = dir.names();
    for arguments in [
        "convert nosuch.hpgl --machine coaxial",
        "check nosuch.hpgl",
        "info nosuch.hpgl",
        "verify nosuch.csv",
        "verify tiny.csv --drawing nosuch.hpgl",
        "preview nosuch.hpgl --output x.svg",
        "convert tiny.hpgl --machine nosuch.toml",
        "machine check nosuch.toml",
        "convert tiny.hpgl --machine coaxial --output nosuch/x.ticks",
        "convert tiny.hpgl --format svg --output nosuch/x.svg",
        "preview tiny.hpgl --output nosuch/x.png",
    ] {
        if arguments.contains("tiny.csv") {
            dir.succeed("convert tiny.hpgl --machine cartesian --format csv --output tiny.csv");
        }
        let said = dir.run(arguments);
        assert_eq!(said.code, 3, "plotplan {arguments}\n{}", said.err);
        assert!(said.err.starts_with("error: cannot ") && said.err.contains("nosuch"), "{}", said.err);
        assert!(!said.err.contains(".plotplan-"), "names a temporary file: {}", said.err);
        assert!(said.out.is_empty());
        let _ = fs::remove_file(dir.path().join("tiny.csv"));
        assert_eq!(dir.names(), before, "plotplan {arguments} leaves something behind");
    }
}

#[test]
fn unplannable_drawings_exit_1() {
    let dir = TestDir::new();
    dir.write("empty.hpgl", "");
    dir.write("letter.txt", "Dear plotter, please draw a house.\n");
    dir.write("quirk.hpgl", "IN;SP1;PU400,400;QQ7;PD800,400;PU;");
    dir.write("plan.csv", dir.succeed("convert tiny.hpgl -m cartesian -f csv").text());
    let said = dir.transcript(&[
        "convert empty.hpgl --machine coaxial",
        "convert letter.txt --machine coaxial",
        "convert plan.csv --machine coaxial",
        "convert large.hpgl --machine coaxial",
        "convert large.hpgl --machine polar",
        "convert large.hpgl --machine corexy --rotate 45",
        "convert quirk.hpgl --machine coaxial --strict",
        "convert tiny.hpgl --machine coaxial --place -11mm,0 --strict",
        "verify tiny.hpgl",
    ]);
    insta::assert_snapshot!(said);
}

#[test]
fn failed_plan_keeps_output_file() {
    let dir = TestDir::new();
    dir.write("plan.ticks", "as it was");
    let before = dir.names();
    let said = dir.run("convert large.hpgl --machine coaxial --output plan.ticks");
    assert_eq!(said.code, 1);
    assert_eq!(dir.text("plan.ticks"), "as it was");
    assert_eq!(dir.names(), before);
    assert_eq!(dir.run("convert large.hpgl --machine coaxial --output new.ticks").code, 1);
    assert_eq!(dir.names(), before, "no file is written for a plan that was refused");
    let said = dir.succeed("convert large.hpgl --machine coaxial --fit --output plan.ticks");
    assert!(said.out.is_empty(), "the plan is in the file, not on standard output");
    assert!(dir.text("plan.ticks").starts_with("; plotplan: 1\n"));
    assert_eq!(dir.names(), before);
}

#[cfg(unix)]
#[test]
fn symlink_output_is_preserved() {
    let dir = TestDir::new();
    dir.write("plan.ticks", "");
    std::os::unix::fs::symlink("plan.ticks", dir.path().join("link")).expect("a link can be made");
    dir.succeed("convert tiny.hpgl --machine coaxial --output link");
    assert!(dir.path().join("link").is_symlink());
    assert!(dir.text("plan.ticks").starts_with("; plotplan: 1\n"));
    // A device is written to directly.
    dir.succeed("convert tiny.hpgl --machine coaxial --output /dev/null");
    assert!(!Path::new("/dev/null").is_file());
}

#[test]
fn strict_treats_warnings_as_errors() {
    let dir = TestDir::new();
    dir.write("quirk.hpgl", "IN;SP1;PU400,400;QQ7;PD800,400;PU;");
    for command in
        ["convert quirk.hpgl --machine cartesian", "convert quirk.hpgl --format svg", "check quirk.hpgl"]
    {
        let said = dir.succeed(command);
        assert!(said.err.contains("warning"), "{}", said.err);
        let said = dir.run(&format!("{command} --strict"));
        assert_eq!(said.code, 1, "plotplan {command} --strict");
        assert!(said.out.is_empty(), "plotplan {command} --strict");
    }
    dir.succeed("convert tiny.hpgl --machine cartesian --strict");
    // Ink outside the sheet is a warning about the machine, not the file.
    let beside = "check tiny.hpgl --machine coaxial --place -11mm,0";
    assert!(dir.succeed(beside).err.contains("ink reaches 6.00 mm beyond the sheet"));
    let said = dir.run(&format!("{beside} --strict"));
    assert_eq!(said.code, 1);
    assert!(said.err.ends_with("error: stopping because of warnings (--strict)\n"), "{}", said.err);
}

#[test]
fn plan_document_settings_make_the_same_plan_again() {
    let dir = TestDir::new();
    let options = "--law=sine --segment-time=900ms --overlap-lifts --effort=0 --dedupe --pen-order=2,1 \
                   --scale=0.5 --place=20mm,1cm --tolerance=0.2mm --period=20ms --allow-over-limit";
    let convert = |options: &str, output: &str| {
        dir.succeed(&format!("convert tiny.hpgl --machine corexy --format json -o {output} {options}"));
        let bytes = fs::read(dir.path().join(output)).expect("a plan document");
        serde_json::from_slice::<serde_json::Value>(&bytes).expect("JSON")
    };
    let first = convert(options, "first.json");
    let settings = &first["settings"];
    let given: Vec<&str> = settings["command_line"]
        .as_array()
        .expect("options")
        .iter()
        .map(|o| o.as_str().expect("text"))
        .collect();
    let again = convert(&given.join(" "), "again.json");
    assert_eq!(first, again, "the document's own options make the same document");
    for (key, value) in [
        ("law", serde_json::json!("sine")),
        ("segment_time_s", serde_json::json!(0.9)),
        ("tolerance_mm", serde_json::json!(0.2)),
        ("period_us", serde_json::json!(20_000)),
        ("allow_over_limit", serde_json::json!(true)),
        ("program", serde_json::json!(concat!("plotplan ", env!("CARGO_PKG_VERSION")))),
    ] {
        assert_eq!(settings[key], value, "{key}");
    }
    assert_eq!(settings["ordering"]["pen_order"], serde_json::json!([2, 1]));
    assert_eq!(settings["placement"]["origin_mm"], serde_json::json!([20.0, 10.0]));
    assert!(settings["lift_overlap_s"].as_f64() > Some(0.0));
}

#[test]
fn json_report_is_last_line_of_stderr() {
    let dir = TestDir::new();
    for machine in PRESETS {
        let said = dir.succeed(&format!("convert tiny.hpgl --machine {machine} --format csv --report json"));
        let last = said.err.lines().last().expect("a line");
        let report: serde_json::Value = serde_json::from_str(last).expect("one JSON object");
        assert_eq!(report["certificate"]["holds"], true, "{machine}");
        assert_eq!(report["certificate"]["pens"], serde_json::json!([1, 2]), "{machine}");
        assert_eq!(report["certificate"]["dots"], 1, "{machine}");
        assert_eq!(report["summary"]["strokes"], 4, "{machine}");
        // 20 mm + 15 mm, the circle, 10 mm; blends may shorten the path.
        let ink = report["summary"]["ink_mm"].as_f64().expect("a number");
        let drawn = 45.0 + 10.0 * std::f64::consts::PI;
        assert!(ink > drawn - 1.0 && ink < drawn + 0.1, "{machine}: {ink} of {drawn} mm");
        let rows = said.text().lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit())).count();
        assert_eq!(report["summary"]["rows"], rows, "{machine}");
    }
}

#[test]
fn dash_is_stdin_and_stdout() {
    let dir = TestDir::new();
    let from_file = dir.succeed("convert tiny.hpgl --machine hbot");
    let piped = dir.run_with("convert - --machine hbot --output -", TINY);
    assert_eq!((piped.code, &piped.err), (0, &from_file.err));
    assert_eq!(piped.out, from_file.out);
    let plan = piped.text();
    for reader in ["verify - --drawing tiny.hpgl", "info -", "preview - --output plan.svg"] {
        let said = dir.run_with(reader, plan);
        assert_eq!(said.code, 0, "plotplan {reader}\n{}", said.err);
    }
    assert_eq!(dir.run_with("check -", TINY).code, 0);
    assert!(dir.text("plan.svg").contains("<svg"));
}

#[test]
fn plans_are_deterministic() {
    let dir = TestDir::new();
    for format in ["ticks", "csv", "json", "hpgl", "svg"] {
        let machine = if ["hpgl", "svg"].contains(&format) { "" } else { "--machine polar" };
        let command = format!("convert tiny.hpgl {machine} --format {format}");
        let (first, second) = (dir.succeed(&command), dir.succeed(&format!("{command} --output out")));
        assert_eq!(first.out, dir.bytes("out"), "{format}");
        assert_eq!(first.err, second.err, "{format}");
        // The path of the input file is not part of the plan.
        let absolute = dir.path().join("tiny.hpgl").display().to_string();
        assert_eq!(dir.succeed(&command.replace("tiny.hpgl", &absolute)).out, first.out, "{format}");
    }
}

#[test]
fn closed_stdout_exits_quietly() {
    let dir = TestDir::new();
    // More than the buffer of a pipe, so that a write fails.
    let command = "convert tiny.hpgl --machine cartesian --fit --period 1ms";
    assert!(dir.succeed(command).out.len() > 200_000);
    let mut program = dir.command(command);
    let mut child = program.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program runs");
    let mut out = child.stdout.take().expect("a pipe");
    let mut some = [0; 100];
    out.read_exact(&mut some).expect("the plan's beginning");
    assert!(some.starts_with(b"; plotplan: 1\n"));
    drop(out);
    let CommandOutput { code, err, .. } = CommandOutput::of(child.wait_with_output().expect("it ends"));
    assert_eq!((code, err.as_str()), (0, ""));
}

#[test]
fn drawing_formats_need_no_machine() {
    let dir = TestDir::new();
    dir.succeed("convert tiny.hpgl --format hpgl --output clean.hpgl");
    let clean = dir.text("clean.hpgl");
    insta::assert_snapshot!("tiny_as_hpgl", clean);
    let again = dir.succeed("convert clean.hpgl --format hpgl");
    assert_eq!(again.text(), clean, "what was written plainly is written the same again");
    let svg = dir.succeed("convert tiny.hpgl --format svg");
    insta::assert_snapshot!("tiny_as_svg", svg.text());
}

#[test]
fn shown_machine_file_gives_same_plan() {
    let dir = TestDir::new();
    for machine in PRESETS {
        let shown = dir.succeed(&format!("machine show {machine}"));
        dir.write("mine.toml", shown.text());
        assert_eq!(dir.succeed("machine show mine.toml").out, shown.out, "{machine}");
        for format in ["csv", "json"] {
            let plan = |name: &str| {
                dir.succeed(&format!("convert tiny.hpgl --machine {name} --format {format}")).out
            };
            assert_eq!(plan("mine.toml"), plan(machine), "{machine}, {format}");
        }
    }
}

#[test]
fn machine_list_and_check() {
    let dir = TestDir::new();
    let checks = PRESETS.map(|machine| format!("machine check {machine}"));
    let mut commands = vec!["machine list"];
    commands.extend(checks.iter().map(String::as_str));
    let said = dir.transcript(&commands);
    insta::assert_snapshot!(said);
}

#[test]
fn verify_needs_file_of_custom_machine() {
    let dir = TestDir::new();
    let mine = dir.succeed("machine show coaxial").text().replacen("\"coaxial\"", "\"mine\"", 1);
    dir.write("mine.toml", &mine.replacen("\"206mm\"", "\"200mm\"", 1));
    for format in ["ticks", "csv", "json"] {
        dir.succeed(&format!("convert tiny.hpgl --machine mine.toml --format {format} --output plan"));
        let alone = dir.run("verify plan --drawing tiny.hpgl");
        if format == "json" {
            assert_eq!(alone.code, 0, "a plan document has its machine in it\n{}", alone.err);
        } else {
            assert_eq!(alone.code, 2, "{}", alone.err);
            assert!(alone.err.contains("there is no machine called mine"), "{}", alone.err);
        }
        dir.succeed("verify plan --drawing tiny.hpgl --machine mine.toml");
        // The same ticks draw something else on another arm.
        assert_eq!(dir.run("verify plan --drawing tiny.hpgl --machine coaxial").code, 1);
    }
}

#[test]
fn verify_reads_every_plan_format() {
    let dir = TestDir::new();
    dir.write("other.hpgl", &TINY.replacen("PD200,600", "PD200,640", 1));
    for machine in PRESETS {
        for format in ["ticks", "csv", "json"] {
            dir.succeed(&format!("convert tiny.hpgl --machine {machine} --format {format} --output plan"));
            let said = dir.succeed("verify plan --drawing tiny.hpgl");
            assert!(said.text().starts_with("certificate holds (tolerance 0.1 mm)\n"), "{}", said.text());
            let said = dir.succeed("verify plan --drawing tiny.hpgl --report json");
            let report: serde_json::Value = serde_json::from_str(said.text()).expect("one JSON object");
            assert_eq!(report["certificate"]["holds"], true);
            // This plan does not cover a line that is 1 mm longer.
            let said = dir.run("verify plan --drawing other.hpgl");
            assert_eq!(said.code, 1, "{machine}, {format}");
            assert!(said.text().contains("FAILED"), "{}", said.text());
        }
    }
}

#[test]
fn verify_without_drawing_checks_motion() {
    let dir = TestDir::new();
    dir.succeed("convert tiny.hpgl --machine polar --format csv --output plan.csv");
    let said = dir.succeed("verify plan.csv");
    assert!(said.err.starts_with("warning: without --drawing"), "{}", said.err);
    assert!(said.text().starts_with("motion holds\n"), "{}", said.text());
    let said = dir.succeed("verify plan.csv --report json");
    let report: serde_json::Value = serde_json::from_str(said.text()).expect("one JSON object");
    assert_eq!(report["certificate"]["after_rounding"], serde_json::Value::Null);
    let info = dir.succeed("info plan.csv");
    assert!(info.text().contains("pens     [1, 2], down 4 times\n"), "{}", info.text());
}

/// The rows of a CSV plan as numbers.
fn rows(csv: &str) -> Vec<Vec<i64>> {
    let numbers = |line: &str| line.split(',').map(|field| field.parse().ok()).collect::<Option<Vec<i64>>>();
    csv.lines().filter_map(numbers).collect()
}

/// A CSV plan with `by` added to one number.
fn tampered(csv: &str, row: usize, column: usize, by: i64) -> String {
    let mut rows = rows(csv);
    rows[row][column] += by;
    let head: Vec<&str> = csv.lines().take_while(|line| !line.starts_with("0,")).collect();
    let row_text = |row: &Vec<i64>| row.iter().map(i64::to_string).collect::<Vec<_>>().join(",");
    let body: Vec<String> = rows.iter().map(row_text).collect();
    format!("{}\n{}\n", head.join("\n"), body.join("\n"))
}

#[test]
fn tampered_plan_fails_verification() {
    let dir = TestDir::new();
    for machine in PRESETS {
        let plan = dir.succeed(&format!("convert tiny.hpgl --machine {machine} --format csv"));
        let csv = plan.text();
        let all = rows(csv);
        assert_eq!(tampered(csv, 0, 2, 0), csv);
        let draws = all.iter().position(|row| row[1] == 1).expect("a row with the pen down");
        let draws =
            (draws..all.len() - 1).find(|row| all[*row][2..] != all[*row + 1][2..]).expect("it moves");
        let travels = all.iter().position(|row| row[2..] != all[0][2..]).expect("it moves");
        for (what, changed) in [
            ("a tick row, drawing", tampered(csv, draws, 2, 40)),
            ("a tick row of the other motor", tampered(csv, draws, 3, -40)),
            ("a tick row, travelling", tampered(csv, travels, 2, 40)),
            ("the start", tampered(csv, 0, 2, 1)),
            ("the end", tampered(csv, all.len() - 1, 3, 2)),
            ("a pen", tampered(csv, draws, 1, 1)),
            ("a pen that is up", tampered(csv, travels, 1, 1)),
        ] {
            dir.write("plan.csv", &changed);
            let said = dir.run("verify plan.csv --drawing tiny.hpgl");
            assert_eq!(said.code, 1, "{machine}: {what} was changed\n{}", said.text());
            assert!(said.text().contains("FAILED: "), "{machine}: {what} was changed\n{}", said.text());
        }
    }
}

#[test]
fn truncated_plan_is_rejected() {
    let dir = TestDir::new();
    for format in ["ticks", "csv", "json"] {
        let plan = dir.succeed(&format!("convert tiny.hpgl --machine corexy --format {format}"));
        let text = plan.text();
        let without_last_line = text.trim_end().rfind('\n').map_or(text.len() / 2, |at| at + 1);
        for end in [without_last_line, text.len() / 2] {
            dir.write("plan", &text[..end]);
            let said = dir.run("verify plan --drawing tiny.hpgl");
            assert_eq!(said.code, 1, "{format} up to byte {end} of {}", text.len());
            assert!(said.err.contains("plan is not a plan that can be used"), "{}", said.err);
        }
    }
}

#[test]
fn preview_of_drawings_and_plans() {
    let dir = TestDir::new();
    // A picture also shows ink outside the reach.
    dir.succeed("preview large.hpgl --machine hbot --output large.svg");
    dir.succeed("convert tiny.hpgl --machine coaxial --output plan.ticks");
    for source in
        ["tiny.hpgl", "tiny.hpgl --machine polar --fit", "tiny.hpgl --machine coaxial", "plan.ticks"]
    {
        dir.succeed(&format!("preview {source} --output x.svg"));
        let svg = dir.text("x.svg");
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"), "{source}: {svg}");
        for part in ["<g id=\"pen1\"", "<g id=\"pen2\"", "id=\"sheet\""] {
            assert!(svg.contains(part), "{source}: no {part}");
        }
        assert_eq!(svg.contains("id=\"start\""), source != "tiny.hpgl", "{source}");
        dir.succeed(&format!("preview {source} --output x.PNG"));
        let png = dir.bytes("x.PNG");
        assert!(png.starts_with(b"\x89PNG\r\n\x1a\n"), "{source}");
        let side = |at: usize| u32::from_be_bytes([png[at], png[at + 1], png[at + 2], png[at + 3]]);
        assert_eq!(side(16).max(side(20)), 1600, "{source}");
    }
}

#[test]
fn check_and_info_reports() {
    let dir = TestDir::new();
    dir.write("quirk.hpgl", QUIRKS);
    dir.write("two-pages.hpgl", TWO_PAGES);
    dir.write("nothing.hpgl", "IN;SP1;PU100,100;SP0;");
    dir.write("lost.hpgl", "IN;SP1;PU0,0;PD400,0,99999999999,0,400,400;PU;");
    let job =
        "\x1b%-12345X@PJL ENTER LANGUAGE=HPGL2\n\x1b%-1BBPINPS8400,5940SP1PW.5PU0,0PD400,0PG;\x1b%0A\x1bE";
    dir.write("job.hpgl", job);
    let said = dir.transcript(&[
        "check tiny.hpgl",
        "check tiny.hpgl --machine polar",
        "check large.hpgl --machine polar",
        "check large.hpgl --machine polar --fit",
        "check quirk.hpgl",
        "check two-pages.hpgl",
        "check nothing.hpgl",
        "check lost.hpgl --message-format short",
        "info job.hpgl",
        "info quirk.hpgl --message-format short",
        "info tiny.hpgl --plotter hp7475a --paper a3",
        "info tiny.hpgl",
        "info two-pages.hpgl",
    ]);
    insta::assert_snapshot!(said);
}

#[test]
fn svg_is_checked_hatched_and_planned() {
    let dir = TestDir::new();
    dir.write("layers.svg", LAYERS);
    let said = dir.transcript(&[
        "check layers.svg",
        "check layers.svg --message-format short --hatch 0.5mm,45",
        "info layers.svg --pens colors --message-format json",
        "info layers.svg",
        "check layers.svg --plotter hp7475a",
        "check tiny.hpgl --pens one",
        "check layers.svg --hatch 0mm",
        "explain S0201",
    ]);
    insta::assert_snapshot!(said);
    let plan =
        dir.command("convert layers.svg --machine cartesian --format csv --output layers.csv").output();
    assert_eq!(plan.expect("the program runs").status.code(), Some(0));
    assert!(!dir.text("layers.csv").is_empty());
}

#[test]
fn page_selection() {
    let dir = TestDir::new();
    dir.write("two-pages.hpgl", TWO_PAGES);
    for (page, pen) in [("", 1), (" --page 1", 1), (" --page 2", 3)] {
        let said = dir.succeed(&format!("convert two-pages.hpgl --machine cartesian --format csv{page}"));
        assert!(said.err.contains("two-pages.hpgl has 2 pages"), "{}", said.err);
        assert!(rows(said.text()).iter().all(|row| row[1] == 0 || row[1] == pen), "{page}");
        dir.write("plan.csv", said.text());
        assert_eq!(dir.run(&format!("verify plan.csv --drawing two-pages.hpgl{page}")).code, 0, "{page}");
        let other = if pen == 1 { 2 } else { 1 };
        assert_eq!(dir.run(&format!("verify plan.csv --drawing two-pages.hpgl --page {other}")).code, 1);
    }
    for page in [0, 3] {
        let said = dir.run(&format!("convert two-pages.hpgl --machine cartesian --page {page}"));
        let expected = format!("error: two-pages.hpgl has 2 pages, not page {page}\n");
        assert!(said.code == 2 && said.err.ends_with(&expected), "{}", said.err);
    }
}

#[test]
fn json_diagnostics() {
    let dir = TestDir::new();
    dir.write("quirk.hpgl", QUIRKS);
    let said = dir
        .transcript(&["check quirk.hpgl --message-format short", "check quirk.hpgl --message-format json"]);
    insta::assert_snapshot!(said);
    let said = dir.succeed("convert quirk.hpgl --machine cartesian --message-format json --report json");
    for line in said.err.lines() {
        serde_json::from_str::<serde_json::Value>(line).expect(line);
    }
}

#[test]
fn hpgl_output_in_both_encodings() {
    let dir = TestDir::new();
    let plain = dir.succeed("convert tiny.hpgl --format hpgl");
    dir.succeed("convert tiny.hpgl --format hpgl --hpgl2 --output encoded.hpgl");
    assert!(dir.bytes("encoded.hpgl").windows(2).any(|two| two == b"PE"));
    assert_eq!(dir.succeed("convert encoded.hpgl --format hpgl").text(), plain.text());
}

#[test]
fn help_man_pages_and_completions() {
    let dir = TestDir::new();
    let said =
        dir.transcript(&["--help", "convert --help", "machine --help", "explain H0101", "explain plotters"]);
    insta::assert_snapshot!(said);
    for command in [
        "check",
        "info",
        "verify",
        "preview",
        "send",
        "emulate",
        "machine list",
        "machine show",
        "machine check",
        "explain",
        "man",
    ] {
        assert!(dir.succeed(&format!("{command} --help")).text().contains("Usage: plotplan"), "{command}");
    }
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let said = dir.succeed(&format!("completions {shell}"));
        assert!(said.text().contains("plotplan") && said.text().contains("tolerance"), "{shell}");
        assert_eq!(said.err, "");
    }
    let man = dir.succeed("man");
    assert!(man.text().contains(".TH plotplan 1") && man.text().contains("convert"), "{}", man.text());
    let version = dir.succeed("--version");
    // Includes the commit if built in a checkout.
    let commit = version.text().strip_prefix(concat!("plotplan ", env!("CARGO_PKG_VERSION"))).map(str::trim);
    let commit = commit.expect("name and version").trim_matches(['(', ')']);
    assert!(commit.bytes().all(|byte| byte.is_ascii_hexdigit()), "{}", version.text());
    let page = dir.succeed("man send");
    assert!(
        page.text().contains(".TH plotplan-send 1") && page.text().contains("protocol"),
        "{}",
        page.text()
    );
    assert_eq!(dir.run("man nosuch").code, 2);
}

#[test]
fn machine_files_in_config_folder_by_name() {
    let dir = TestDir::new();
    let folder = dir.path().join("plotplan/machines");
    fs::create_dir_all(&folder).expect("a folder");
    let mine = dir.succeed("machine show corexy").text().replacen("name = \"corexy\"", "name = \"mine\"", 1);
    fs::write(folder.join("mine.toml"), &mine).expect("a file can be written");
    let run = |arguments: &str| {
        let mut command = dir.command(arguments);
        CommandOutput::of(command.env("XDG_CONFIG_HOME", dir.path()).output().expect("the program runs"))
    };
    assert!(run("machine list").text().lines().any(|line| line.starts_with("mine ")));
    assert_eq!(run("machine show mine").text(), mine);
    let said = run("convert tiny.hpgl --machine mine --output mine.ticks");
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(dir.text("mine.ticks").contains("; machine: mine\n"));
    // A plan of that machine refers to it by name.
    assert_eq!(run("verify mine.ticks --drawing tiny.hpgl").code, 0);
    let said = run("convert tiny.hpgl --machine mime");
    assert!(said.code == 2 && said.err.contains("did you mean mine?"), "{}", said.err);
    assert_eq!(dir.run("machine show mine").code, 2);
}

#[test]
fn point_list_import() {
    let dir = TestDir::new();
    dir.write("points.txt", "// report 4\n<70.05, 82.46>, <74.10, 83.20>,\n<74.1, 83.2>, <74.10, 90.00>\n");
    let svg = dir.succeed("convert points.txt --format svg");
    assert!(svg.text().contains("74.1"), "{}", svg.text());
    dir.succeed("convert points.txt --machine polar --output points.ticks");
    dir.succeed("verify points.ticks --drawing points.txt");
    let said = dir.succeed("info points.txt");
    assert!(said.text().contains("points <x, y>, mm") && said.text().contains("10.9 mm"), "{}", said.text());
    dir.succeed("preview points.txt --machine polar --output points.svg");
    dir.succeed("check points.txt --machine polar");
}

/// The six coefficients of the placement in a CSV plan.
fn placement(csv: &str) -> Vec<f64> {
    let line = csv.lines().find_map(|line| line.strip_prefix("# placement: ")).expect("a placement");
    line.split(' ').map(|number| number.parse().expect("a number")).collect()
}

#[test]
fn placement_options() {
    let dir = TestDir::new();
    let placed = |wish: &str| {
        placement(dir.succeed(&format!("convert tiny.hpgl --machine coaxial --format csv {wish}")).text())
    };
    // The lower left corner of the sheet is at (12.7, 76.2).
    for (wish, expected) in [
        ("", [1.0, 0.0, 0.0, 1.0, 12.7, 76.2]),
        ("--place 1in,25", [1.0, 0.0, 0.0, 1.0, 38.1, 101.2]),
        ("--place -5mm,2cm", [1.0, 0.0, 0.0, 1.0, 7.7, 96.2]),
        ("--scale 2", [2.0, 0.0, 0.0, 2.0, 12.7, 76.2]),
        ("--scale 2 --place 10,10", [2.0, 0.0, 0.0, 2.0, 22.7, 86.2]),
        // The bounding box (5, 10) to (30, 25) becomes 15 wide and 25 high; its lower left corner stays.
        ("--rotate 90", [0.0, 1.0, -1.0, 0.0, 12.7 + 30.0, 76.2 + 5.0]),
        ("--rotate 90 --scale 2", [0.0, 2.0, -2.0, 0.0, 12.7 + 60.0, 76.2 + 10.0]),
        ("--rotate 180", [-1.0, 0.0, 0.0, -1.0, 12.7 + 35.0, 76.2 + 35.0]),
    ] {
        let found = placed(wish);
        let near = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-9);
        assert!(found.len() == 6 && near, "{wish}: {found:?}, not {expected:?}");
    }
    // 25 mm scaled to 215.9 mm: the width of the sheet, centred vertically.
    let fit = placed("--fit");
    let expected = [8.636, 0.0, 0.0, 8.636, 12.7 - 5.0 * 8.636, 76.2 + 279.4 / 2.0 - 17.5 * 8.636];
    assert!(fit.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 0.01), "{fit:?}");
}

/// A plan starts and ends with the pen up, even if ink starts there.
#[test]
fn ink_at_start_pose() {
    let dir = TestDir::new();
    dir.write("there.hpgl", "IN;SP1;PU0,0;PD400,0,400,400,0,0;PU;");
    let said = dir.succeed("convert there.hpgl --machine cartesian --format csv");
    let all = rows(said.text());
    assert_eq!(all[0], [0, 0, 0, 0]);
    assert_eq!(all[all.len() - 1][1..], [0, 0, 0]);
    assert!(all.iter().any(|row| row[1] == 1));
}

#[test]
fn settings_in_plan_document() {
    let dir = TestDir::new();
    let plan =
        |options: &str| dir.succeed(&format!("convert tiny.hpgl --machine corexy --format csv {options}"));
    // Period: that of the machine, or of the option; longer only while the motors stand still.
    for (options, period) in [("", 10_000), ("--period 2ms", 2_000), ("--period 250us", 250)] {
        let said = plan(options);
        for pair in rows(said.text()).windows(2) {
            let step = pair[1][0] - pair[0][0];
            let still = pair[0][2..] == pair[1][2..];
            assert!(step == period || still && step > period, "{options}: {pair:?}");
        }
    }
    // File order: pen 1 first, strokes from their first points.
    let said = plan("--order file");
    let downs = pen_downs(said.text());
    // CI starts at the rightmost point of the circle.
    assert_eq!(downs, [(1, 10.0, 10.0), (1, 25.0, 20.0), (2, 5.0, 25.0), (2, 7.5, 22.5)]);
}

/// Positions of all pen-downs in a CSV plan of `corexy`, rounded to 0.25 mm: 92.03 ticks per mm of x + y
/// and x - y.
fn pen_downs(csv: &str) -> Vec<(i64, f64, f64)> {
    let all = rows(csv);
    let downs = all.windows(2).filter(|pair| pair[0][1] == 0 && pair[1][1] != 0).map(|pair| {
        let [a, b] = [pair[1][2], pair[1][3]].map(|ticks| ticks as f64 / 92.032);
        let quarters = |mm: f64| (4.0 * mm).round() / 4.0;
        (pair[1][1], quarters(0.5 * (a + b)), quarters(0.5 * (a - b)))
    });
    downs.collect()
}

#[test]
fn ordering_options() {
    let dir = TestDir::new();
    dir.write("pens.hpgl", PENS);
    let run = |options: &str| {
        let said =
            dir.succeed(&format!("convert pens.hpgl --machine corexy --format csv --report json {options}"));
        let report: serde_json::Value =
            serde_json::from_str(said.err.lines().last().expect("a line")).expect("one JSON object");
        let seconds = |what: &str| report["summary"][what].as_f64().expect("a number");
        (pen_downs(said.text()), [seconds("ink_mm"), seconds("drawing_s"), seconds("travel_mm")])
    };
    let in_file = [(1, 10.0, 10.0), (1, 10.0, 10.0), (2, 10.0, 20.0), (3, 10.0, 30.0)];
    let (file, [ink, drawing, travel]) = run("--order file");
    assert_eq!(file, in_file);
    assert!((ink - 80.0).abs() < 0.1, "{ink}");
    let (kept, _) = run("--keep-direction");
    assert!(kept.iter().all(|(_, x, _)| *x == 10.0), "no stroke from its other end: {kept:?}");
    // Every second line from right to left.
    let (optimized, [all, _, shorter]) = run("");
    let pens = |downs: &[(i64, f64, f64)]| downs.iter().map(|(pen, ..)| *pen).collect::<Vec<_>>();
    assert_eq!(pens(&optimized), [1, 2, 3]);
    assert!(shorter < travel - 30.0, "{shorter} mm of travel, {travel} in the file's order");
    assert!((all - 80.0).abs() < 0.2, "what is drawn twice is drawn twice: {all} mm");
    let (deduped, [once, ..]) = run("--dedupe");
    assert_eq!(pens(&deduped), [1, 2, 3]);
    assert!((once - 60.0).abs() < 0.1, "{once}");
    assert_eq!(pens(&run("--pen-order 3,1").0), [3, 1, 2]);
    // 20 mm at 2 cm/s, the others at the limit of the machine, 60 mm/s.
    let (_, [_, slow, _]) = run("--order file --speed file");
    assert!((slow - drawing - (20.0 / 20.0 - 20.0 / 60.0)).abs() < 0.15, "{slow} s, {drawing} s");
    for effort in 0..=3 {
        let (_, [_, _, travel_mm]) = run(&format!("--effort {effort}"));
        assert!(
            travel_mm <= travel,
            "effort {effort}: {travel_mm} mm of travel, {travel} in the file's order"
        );
    }
}

/// Complete plans with a long period. A change of the time parametrization changes all of them.
#[test]
fn plans_for_every_machine() {
    let dir = TestDir::new();
    for machine in PRESETS {
        let command = format!("convert tiny.hpgl --machine {machine} --period 100ms --report json");
        let said = dir.succeed(&format!("{command} --format csv --output plan.csv"));
        let report = said.err.lines().last().expect("a report on the last line");
        let plan = format!("{}\n\n{}", plan_summary(report), dir.text("plan.csv"));
        insta::assert_snapshot!(format!("plan_{machine}"), plan);
        dir.succeed("preview plan.csv --output plan.svg");
        assert_picture(&format!("plan_{machine}.svg"), &dir.bytes("plan.svg"));
    }
    let said = dir.succeed("convert tiny.hpgl --machine corexy --period 100ms --report json");
    let report = said.err.lines().last().expect("a report on the last line");
    insta::assert_snapshot!("plan_corexy_ticks", format!("{}\n\n{}", plan_summary(report), said.text()));
}

/// What a reviewer of a changed plan compares first: duration, rows, peaks and deviation, in a line.
fn plan_summary(report: &str) -> String {
    let report: serde_json::Value = serde_json::from_str(report).expect("one JSON object");
    let (summary, certificate) = (&report["summary"], &report["certificate"]);
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let motors = certificate["motors"].as_array().expect("two motors").iter();
    let peaks = motors.map(|motor| {
        let (speed, acceleration) = (number(&motor["speed_share"]), number(&motor["acceleration_share"]));
        format!("{} {:.3} v, {:.3} a", motor["name"].as_str().expect("a name"), speed, acceleration)
    });
    let worst = |rounding: &str| {
        let deviation = &certificate[rounding];
        let max = |way: &str| number(&deviation[way]["max_mm"]);
        max("ink_to_drawing").max(max("drawing_to_ink"))
    };
    format!(
        "{:.3} s in {} rows; shares of the limits: {}; deviation {:.4} mm, in whole ticks {:.4} mm",
        number(&summary["duration_s"]),
        summary["rows"],
        peaks.collect::<Vec<_>>().join("; "),
        worst("before_rounding"),
        worst("after_rounding")
    )
}

/// Compares a picture with the one in tests/pictures, which a reviewer looks at. It is written anew
/// where snapshots are (`INSTA_UPDATE=always`).
#[expect(clippy::disallowed_methods, reason = "insta reads the same variable")]
fn assert_picture(name: &str, picture: &[u8]) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/pictures").join(name);
    if std::env::var("INSTA_UPDATE").is_ok_and(|update| update == "always") {
        fs::write(&file, picture).expect("the picture can be written");
    }
    let expected = fs::read(&file).unwrap_or_default();
    assert!(
        expected == picture,
        "{} differs: look at it, then accept it with INSTA_UPDATE=always",
        file.display()
    );
}
