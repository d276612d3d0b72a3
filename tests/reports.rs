//! Reports for programs: one type for all commands, on success and on failure; and the options that
//! shape messages.

use std::process::{Command, Output};

use assert_cmd::cargo::cargo_bin;
use compiler::report::{Code, EXIT_CODES};
use serde_json::Value;
use test_support::TestDir;

const SQUARE: &str = "IN;SP1;PU400,400;PD1200,400,1200,1200,400,1200,400,400;PU;";
/// Two kinds of unknown commands, one of them with eight names.
const JUNK: &str = "IN;SP1;PU0,0;PD400,0;QA;QB;QC;QE;QF;QG;QH;QI;QI;PD800,9,9;PU;";

fn folder() -> TestDir {
    let dir = TestDir::new();
    dir.write("a.hpgl", SQUARE);
    dir.write("junk.hpgl", JUNK);
    dir.write("far.hpgl", "IN;SP1;PU0,0;PD40000,0;PU;");
    dir.write("empty.hpgl", "IN;");
    dir.write("pages.hpgl", "IN;SP1;PU0,0;PD400,0;PU;PG;SP1;PU0,0;PD0,400;PU;PG;");
    dir.write("a.pdf", "%PDF-1.4\n");
    dir.write("m.toml", "name = \"m\"\n[geometry]\nkind = \"polarr\"\n");
    std::fs::create_dir_all(dir.path().join("sub")).expect("a folder");
    dir.write("sub/b.hpgl", JUNK);
    for (machine, plan) in [("corexy", "p.ticks"), ("corexy", "p.csv"), ("coaxial", "arm.csv")] {
        let output = run(&dir, &format!("convert a.hpgl --machine {machine} -o {plan}"));
        assert!(output.status.success());
    }
    dir
}

fn command(dir: &TestDir, arguments: &str) -> Command {
    let mut command = Command::new(cargo_bin!("plotplan"));
    command.current_dir(dir.path()).args(arguments.split_whitespace());
    command.env("COLUMNS", "200").env("XDG_CONFIG_HOME", dir.path().join("config"));
    command.env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
    command
}

fn run(dir: &TestDir, arguments: &str) -> Output {
    command(dir, arguments).output().expect("the program runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The report of a command, and its exit code.
fn report(dir: &TestDir, arguments: &str, on_stdout: bool) -> (Value, i32) {
    let output = run(dir, &format!("{arguments} --report json"));
    let stream = text(if on_stdout { &output.stdout } else { &output.stderr });
    let line = stream.lines().last().unwrap_or_else(|| panic!("plotplan {arguments}: no report"));
    let report = serde_json::from_str(line).unwrap_or_else(|error| panic!("{arguments}: {error}: {line}"));
    if on_stdout {
        assert_eq!(stream.lines().count(), 1, "plotplan {arguments}: {stream}");
    }
    (report, output.status.code().expect("an exit code"))
}

#[test]
fn every_command_reports_with_the_same_keys() {
    let dir = folder();
    let schema: Value = serde_json::from_slice(&run(&dir, "schema").stdout).expect("a schema");
    let keys: Vec<&String> = schema["properties"].as_object().expect("keys").keys().collect();
    for (arguments, on_stdout, part) in [
        ("convert a.hpgl -m corexy -o out.ticks", false, "summary"),
        ("convert a.hpgl -m corexy", false, "certificate"),
        ("convert a.hpgl -f svg", false, "command"),
        ("check a.hpgl", true, "drawing"),
        ("check a.hpgl -m polar", true, "machine"),
        ("info a.hpgl", true, "drawing"),
        ("info a.hpgl -m hbot", true, "summary"),
        ("info p.ticks", true, "plan"),
        ("verify p.csv --drawing a.hpgl", true, "certificate"),
        ("verify p.csv", true, "mismatches"),
        ("preview a.hpgl -o a.svg", false, "inputs"),
        ("machine check coaxial", true, "machine"),
        ("machine list", true, "machines"),
        ("machine show corexy", false, "command"),
        ("send p.ticks --protocol ticks --dry-run", false, "command"),
        ("explain H0101", false, "command"),
    ] {
        let (report, code) = report(&dir, arguments, on_stdout);
        assert_eq!((code, &report["exit_code"]), (0, &Value::from(0)), "{arguments}");
        assert_eq!(report.as_object().expect("an object").keys().collect::<Vec<_>>(), keys, "{arguments}");
        assert_eq!(report["schema_version"], 1);
        assert!(arguments.starts_with(report["command"].as_str().expect("text")), "{arguments}");
        assert!(!report[part].is_null(), "{arguments}: {report}");
        assert!(report["error"].is_null(), "{arguments}: {report}");
    }
}

#[test]
fn failures_report_code_message_place_and_exit_code() {
    let dir = folder();
    for (arguments, on_stdout, exit, code) in [
        ("convert a.hpgl", false, 2, "usage"),
        ("convert a.hpgl -m corexy --scale 0", false, 2, "usage"),
        ("convert a.hpgl -m corexy --segment-time 1s", false, 2, "usage"),
        ("convert a.hpgl -m m.toml", false, 2, "machine-file"),
        ("machine check m.toml", true, 2, "machine-file"),
        ("convert a.pdf -m corexy", false, 1, "foreign"),
        ("check a.pdf", true, 1, "foreign"),
        ("check p.ticks", true, 1, "foreign"),
        ("verify a.hpgl", true, 1, "not-a-plan"),
        ("convert empty.hpgl -m corexy", false, 1, "no-ink"),
        ("check empty.hpgl", true, 1, "no-ink"),
        ("info empty.hpgl", true, 1, "no-ink"),
        ("preview empty.hpgl -o x.svg", false, 1, "no-ink"),
        ("convert far.hpgl -m corexy", false, 1, "out-of-reach"),
        ("check far.hpgl -m corexy", true, 1, "out-of-reach"),
        ("verify arm.csv --drawing junk.hpgl", true, 1, "verification"),
        ("convert pages.hpgl -m corexy --strict", false, 1, "strict"),
        ("convert a.hpgl -m corexy --law linear --segment-time 1ms", false, 1, "over-limit"),
        ("convert a.hpgl -m polar -f xy-serial", false, 1, "format"),
        ("convert nosuch.hpgl -m corexy", false, 3, "io"),
        ("check nosuch.hpgl", true, 3, "io"),
        ("send p.ticks --protocol ticks --port a.hpgl", false, 3, "io"),
    ] {
        let (report, found) = report(&dir, arguments, on_stdout);
        assert_eq!(found, exit, "{arguments}: {report}");
        assert_eq!(report["exit_code"], exit, "{arguments}");
        let error = &report["error"];
        assert_eq!(error["code"], code, "{arguments}: {report}");
        assert!(error["message"].as_str().is_some_and(|message| message.len() > 8), "{arguments}: {report}");
        let kind = Code::ALL.iter().find(|known| known.name() == code).expect("a documented code");
        if kind.exit_code() != 0 {
            assert_eq!(i32::from(kind.exit_code()), exit, "{code}");
        }
    }
    let (out, _) = report(&dir, "convert far.hpgl -m corexy", false);
    let place = &out["error"]["place"];
    assert_eq!((&place["stroke"], &place["pen"], &place["byte"]), (&1.into(), &1.into(), &13.into()));
    assert!(place["point_mm"].is_array() && out["error"]["help"].is_string());
    let (wrong, _) = report(&dir, "convert a.hpgl -m m.toml", false);
    assert_eq!(wrong["error"]["place"]["file"], "m.toml");
    assert_eq!(wrong["error"]["place"]["line"], 3);
}

#[test]
fn paths_are_those_given() {
    let dir = folder();
    let (report, _) = report(&dir, "check sub/b.hpgl", true);
    assert_eq!(report["inputs"], serde_json::json!(["sub/b.hpgl"]));
    assert!(report["diagnostics"].as_array().expect("a list").iter().all(|d| d["file"] == "sub/b.hpgl"));
    let messages = text(&run(&dir, "check sub/b.hpgl").stderr);
    assert!(messages.contains("--> sub/b.hpgl:1:"), "{messages}");
}

/// Decimals of a number as written.
fn decimals(number: &serde_json::Number) -> usize {
    number.to_string().split_once('.').map_or(0, |(_, rest)| rest.len())
}

fn numbers(value: &Value, visit: &mut impl FnMut(&serde_json::Number)) {
    match value {
        Value::Number(number) => visit(number),
        Value::Array(list) => list.iter().for_each(|value| numbers(value, visit)),
        Value::Object(object) => object.values().for_each(|value| numbers(value, visit)),
        _ => {}
    }
}

#[test]
fn numbers_are_rounded_and_shares_agree_with_their_limits() {
    let dir = folder();
    for (arguments, on_stdout) in
        [("convert a.hpgl -m coaxial -o x.ticks", false), ("verify arm.csv --drawing a.hpgl", true)]
    {
        let (report, _) = report(&dir, arguments, on_stdout);
        numbers(&report, &mut |number| {
            let text = number.to_string();
            assert!(decimals(number) <= 9 && !text.contains('e'), "{arguments}: {text}");
        });
        for motor in report["certificate"]["motors"].as_array().expect("motors") {
            for what in ["speed", "acceleration"] {
                let number = |key: String| motor[key].as_f64().expect("a number");
                let share = number(format!("{what}_share"));
                let whole = number(format!("whole_tick_{what}"));
                let allowed = number(format!("whole_tick_{what}_allowed"));
                let (value, limit) = match motor[what].as_f64() {
                    Some(value) => (value, number(format!("{what}_limit"))),
                    None => (whole, allowed),
                };
                assert_eq!(motor[what].is_null(), arguments.starts_with("verify"), "{motor}");
                assert!((share - value / limit).abs() < 1e-4, "{arguments}: {motor}");
                assert!(share <= 1.0 && share > 0.1 && whole <= allowed, "{arguments}: {motor}");
            }
        }
    }
}

#[test]
fn diagnostics_are_capped_at_five_of_a_kind() {
    let dir = folder();
    let shown = |options: &str| text(&run(&dir, &format!("check junk.hpgl {options}")).stderr);
    let capped = shown("");
    assert_eq!(capped.matches("[H0101]").count(), 5, "{capped}");
    assert!(
        capped.contains("3 more diagnostics of the kind H0101 are not shown (--all shows them)"),
        "{capped}"
    );
    assert_eq!(capped.matches("[H0206]").count(), 1, "other kinds are shown: {capped}");
    assert_eq!(shown("--all").matches("[H0101]").count(), 8);
    assert_eq!(shown("--message-format short").matches("[H0101]").count(), 5);
    let (report, _) = report(&dir, "check junk.hpgl", true);
    let list = report["diagnostics"].as_array().expect("a list");
    assert_eq!(list.iter().filter(|d| d["code"] == "H0101").count(), 8, "a report is complete");
}

#[test]
fn quiet_prints_errors_only() {
    let dir = folder();
    for arguments in [
        "convert a.hpgl -m corexy -o q.ticks -q",
        "check junk.hpgl --quiet",
        "--quiet verify p.csv",
        "convert pages.hpgl -m corexy -o q.ticks -q",
    ] {
        let output = run(&dir, arguments);
        assert!(output.status.success(), "{arguments}");
        assert_eq!(text(&output.stderr), "", "{arguments}");
    }
    let output = run(&dir, "convert far.hpgl -m corexy -q");
    assert!(text(&output.stderr).starts_with("error: the drawing leaves the reach"));
    let output = run(&dir, "convert a.hpgl -m corexy -o q.ticks -q --report json");
    assert_eq!(text(&output.stderr).lines().count(), 1, "the report alone");
}

#[test]
fn color_follows_option_and_environment() {
    let dir = folder();
    let is_coloured = |arguments: &str, variable: Option<&str>| {
        let mut command = command(&dir, arguments);
        if let Some(name) = variable {
            command.env(name, "1");
        }
        let output = command.output().expect("the program runs");
        text(&output.stderr).contains('\u{1b}')
    };
    // Standard error is no terminal here.
    assert!(!is_coloured("check junk.hpgl", None));
    assert!(is_coloured("check junk.hpgl --color always", None));
    assert!(is_coloured("check junk.hpgl --color always", Some("NO_COLOR")));
    assert!(!is_coloured("check junk.hpgl --color auto", Some("NO_COLOR")));
    assert!(!is_coloured("check junk.hpgl --color never", Some("CLICOLOR_FORCE")));
    // Errors of the command line as well.
    assert!(is_coloured("check --color always --nosuch", None));
    assert!(!is_coloured("check --color=never --nosuch", Some("CLICOLOR_FORCE")));
}

#[test]
fn json_messages_leave_no_text() {
    let dir = folder();
    for arguments in [
        "check junk.hpgl",
        "convert pages.hpgl -m corexy -o x.ticks -q",
        "convert far.hpgl -m corexy",
        "convert nosuch.hpgl -m corexy",
        "verify p.csv",
    ] {
        let output = run(&dir, &format!("{arguments} --message-format json"));
        let stderr = text(&output.stderr);
        assert!(!stderr.is_empty() || arguments.ends_with("-q"), "{arguments}");
        for line in stderr.lines() {
            let message: Value =
                serde_json::from_str(line).unwrap_or_else(|error| panic!("{arguments}: {error}: {line}"));
            assert!(message["severity"].is_string() && message["code"].is_string(), "{line}");
        }
    }
}

#[test]
fn help_lists_the_exit_codes() {
    let dir = folder();
    let help = text(&run(&dir, "--help").stdout);
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reports.md"))
        .expect("docs/reports.md");
    for exit in EXIT_CODES {
        assert!(help.contains(&format!("{:<4} {}:", exit.code, exit.name)), "{help}");
        assert!(page.contains(&format!("| {} | {} |", exit.code, exit.name)), "{page}");
    }
    assert!(text(&run(&dir, "schema --markdown").stdout) == page, "docs/reports.md is not up to date");
}

/// Pages that the program prints are committed as it prints them. `INSTA_UPDATE=always` writes them anew, as
/// for snapshots.
#[test]
#[expect(clippy::disallowed_methods, reason = "insta reads the same variable")]
fn generated_pages_are_up_to_date() {
    let dir = folder();
    let docs = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
    for (arguments, page) in
        [("schema machine --markdown", "machine-keys.md"), ("explain formats", "format-table.md")]
    {
        let printed = text(&run(&dir, arguments).stdout);
        if std::env::var("INSTA_UPDATE").is_ok_and(|update| update == "always") {
            std::fs::write(docs.join(page), &printed).expect("a page");
        }
        let committed = std::fs::read_to_string(docs.join(page)).unwrap_or_default();
        assert!(committed == printed, "docs/{page} differs: plotplan {arguments} > docs/{page}");
    }
}
