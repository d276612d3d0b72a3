//! `plotplan verify` judges a plan by the machine. Limits, name and period that the plan itself states
//! hide nothing.

use std::fs;
use std::path::Path;
use std::process::Command;

use assert_cmd::cargo::cargo_bin;
use compiler::machine_file::PRESETS;
use serde_json::Value;
use tempfile::TempDir;

const SQUARE: &str = "IN;SP1;PU400,400;PD2400,400,2400,2400,400,2400,400,400;PU;";

struct Output {
    code: i32,
    stdout: String,
    stderr: String,
}

/// Runs the program in a directory; the arguments contain no spaces.
fn run(dir: &Path, arguments: &str) -> Output {
    let mut command = Command::new(cargo_bin!("plotplan"));
    let output = command.args(arguments.split(' ')).current_dir(dir).output().expect("the program runs");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    Output {
        code: output.status.code().expect("an exit code"),
        stdout: text(output.stdout),
        stderr: text(output.stderr),
    }
}

fn succeed(dir: &Path, arguments: &str) -> Output {
    let output = run(dir, arguments);
    assert_eq!(output.code, 0, "{arguments}: {}{}", output.stdout, output.stderr);
    output
}

/// The corexy preset with other belt limits.
fn corexy(speed: &str, acceleration: &str) -> String {
    let preset = PRESETS.iter().find(|preset| preset.name == "corexy").expect("a preset");
    let file = preset.toml.replace("100mm/s\"", &format!("{speed}\"")).replace("500mm/s2", acceleration);
    assert_ne!(file, preset.toml);
    file
}

/// A directory with the drawing, and a machine ten times as fast as the preset and of the same name.
fn workspace() -> TempDir {
    let dir = TempDir::new().expect("a directory");
    let write = |name: &str, text: &str| fs::write(dir.path().join(name), text).expect("a file");
    write("square.hpgl", SQUARE);
    // The pen limit of 60 mm/s would hide the motors' speed.
    write("fast.toml", &corexy("1000mm/s", "50000mm/s2").replace("60mm/s", "600mm/s"));
    write("slow.toml", &corexy("10mm/s", "50mm/s2"));
    dir
}

fn edit(dir: &Path, name: &str, from: &str, to: &str) {
    let text = fs::read_to_string(dir.join(name)).expect("a file");
    assert!(text.contains(from), "{from} in {name}");
    fs::write(dir.join(name), text.replace(from, to)).expect("a file");
}

#[test]
fn plan_too_fast_for_the_given_machine_fails() {
    let dir = workspace();
    for format in ["ticks", "csv", "json"] {
        succeed(dir.path(), &format!("convert square.hpgl --machine corexy --format {format} -o plan"));
        succeed(dir.path(), "verify plan --drawing square.hpgl --machine corexy");
        let output = run(dir.path(), "verify plan --drawing square.hpgl --machine slow.toml");
        assert_eq!(output.code, 1, "{format}: {}", output.stdout);
        assert!(output.stdout.contains("motor A: speed"), "{format}: {}", output.stdout);
        assert!(output.stdout.contains("motor A: acceleration"), "{format}: {}", output.stdout);
        assert!(output.stderr.contains("motor A: speed limit of"), "{format}: {}", output.stderr);
    }
}

/// Without `--machine`, tick lines and CSV are judged by the preset of their name.
#[test]
fn plan_too_fast_for_the_preset_of_its_name_fails() {
    let dir = workspace();
    for format in ["ticks", "csv"] {
        succeed(dir.path(), &format!("convert square.hpgl --machine fast.toml --format {format} -o plan"));
        succeed(dir.path(), "verify plan --drawing square.hpgl --machine fast.toml");
        let output = run(dir.path(), "verify plan --drawing square.hpgl");
        assert_eq!(output.code, 1, "{format}: {}", output.stdout);
        assert!(output.stdout.contains("motor A: speed"), "{format}: {}", output.stdout);
    }
}

#[test]
fn edited_limits_do_not_hide_a_plan_that_is_too_fast() {
    let dir = workspace();
    succeed(dir.path(), "convert square.hpgl --machine corexy --format csv -o plan.csv");
    let limits = |motor: &str| {
        let text = fs::read_to_string(dir.path().join("plan.csv")).expect("a file");
        let key = format!("# limits {motor}: ");
        text.lines().find_map(|line| Some(line.strip_prefix(&key)?.to_owned())).expect("limits")
    };
    for motor in ["A", "B"] {
        let stated = limits(motor);
        let (from, to) = (format!("limits {motor}: {stated}"), format!("limits {motor}: 9e9 9e9"));
        edit(dir.path(), "plan.csv", &from, &to);
    }
    let output = run(dir.path(), "verify plan.csv --drawing square.hpgl --machine slow.toml");
    assert_eq!(output.code, 1, "{}", output.stdout);
    assert!(output.stdout.contains("motor B: acceleration"), "{}", output.stdout);
    assert!(
        output.stderr.contains("motor B: speed limit of 9000000000 ticks/s in the plan"),
        "{}",
        output.stderr
    );
    // For its own machine the plan still holds.
    let output = succeed(dir.path(), "verify plan.csv --drawing square.hpgl");
    assert!(output.stderr.contains("motor A: acceleration limit of"), "{}", output.stderr);
}

/// A longer period would soften the stops at rows that are omitted.
#[test]
fn edited_period_fails() {
    let dir = workspace();
    succeed(dir.path(), "convert square.hpgl --machine corexy --format csv -o plan.csv");
    edit(dir.path(), "plan.csv", "# period_us: 10000", "# period_us: 10000000");
    let output = run(dir.path(), "verify plan.csv --drawing square.hpgl");
    assert_eq!(output.code, 1, "{}", output.stdout);
    assert!(output.stdout.contains("less than the stated period of 10000000 us"), "{}", output.stdout);
}

/// Without `--machine`, a plan document is judged by its own machine.
#[test]
fn plan_document_is_judged_by_its_own_machine() {
    let dir = workspace();
    succeed(dir.path(), "convert square.hpgl --machine fast.toml --format json -o plan.json");
    let output = succeed(dir.path(), "verify plan.json --drawing square.hpgl --report json");
    let report: Value = serde_json::from_str(&output.stdout).expect("JSON");
    assert_eq!(report["mismatches"], Value::Array(Vec::new()));
    assert_eq!(run(dir.path(), "verify plan.json --drawing square.hpgl --machine corexy").code, 1);
}

#[test]
fn other_machine_name_and_other_drawing_are_reported() {
    let dir = workspace();
    succeed(dir.path(), "convert square.hpgl --machine corexy --format json -o plan.json");
    fs::write(dir.path().join("copy.hpgl"), format!("{SQUARE}\n")).expect("a file");
    fs::write(dir.path().join("renamed.toml"), {
        let preset = PRESETS.iter().find(|preset| preset.name == "corexy").expect("a preset");
        preset.toml.replace("name = \"corexy\"", "name = \"mine\"")
    })
    .expect("a file");
    let output =
        succeed(dir.path(), "verify plan.json --drawing copy.hpgl --machine renamed.toml --report json");
    let report: Value = serde_json::from_str(&output.stdout).expect("JSON");
    let mismatches: Vec<&str> =
        report["mismatches"].as_array().expect("an array").iter().filter_map(Value::as_str).collect();
    let [name, drawing] = mismatches[..] else { panic!("{mismatches:?}") };
    assert_eq!(name, "the plan was made for machine corexy, not for mine");
    assert!(
        drawing.starts_with("copy.hpgl is not the drawing that the plan was made from: SHA-256 "),
        "{drawing}"
    );
    let output = succeed(dir.path(), "verify plan.json --drawing copy.hpgl");
    assert!(output.stderr.contains("copy.hpgl is not the drawing"), "{}", output.stderr);
    let output = succeed(dir.path(), "verify plan.json --drawing square.hpgl");
    assert_eq!(output.stderr, "");
}
