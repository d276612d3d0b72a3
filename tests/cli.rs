//! The command line: output, exit codes and files of every command.

mod harness;

use std::fs;
use std::io::Read as _;
use std::path::Path;
use std::process::Stdio;

use harness::{CommandOutput, PRESETS, TINY, TestDir, rows};

const TWO_PAGES: &str = "IN;SP1;PU40,40;PD400,40;PU;PG;SP3;PU40,40;PD40,400,800,400;PU;PG;";
const QUIRKS: &str = "IN;SP1;PU400,400;QQ7;PD800,400;XY1,2;PD400,800,9;PU;LBhello";
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
fn machine_list_and_check() {
    let dir = TestDir::new();
    let checks = PRESETS.map(|machine| format!("machine check {machine}"));
    let mut commands = vec!["machine list"];
    commands.extend(checks.iter().map(String::as_str));
    let said = dir.transcript(&commands);
    insta::assert_snapshot!(said);
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
    for machine in ["coaxial", "corexy"] {
        let command = format!("convert tiny.hpgl --machine {machine} --period 100ms --report json");
        let said = dir.succeed(&format!("{command} --rounding nearest --format csv --output plan.csv"));
        let report = said.err.lines().last().expect("a report on the last line");
        let plan = format!("{}\n\n{}", plan_summary(report), dir.text("plan.csv"));
        insta::assert_snapshot!(format!("plan_{machine}_nearest"), plan);
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
