//! Projects (`plotplan.toml`) and differences between plans, in the program.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use test_support::{Program, TestDir, stderr, stdout};

const PATH: &str = env!("CARGO_BIN_EXE_plotplan");
const PLOTPLAN: Program = Program::new(PATH);

struct Project(TestDir);

impl Project {
    fn new(file: &str) -> Self {
        let project = Self(TestDir::new());
        project.0.write("plotplan.toml", file);
        project.0.write("a.hpgl", "IN;SP1;PU0,0;PD4000,0,4000,2000;PU;SP0;");
        project.0.write("b.hpgl", "IN;SP1;PU1000,1000;CI400;PU;SP0;");
        project
    }

    /// Runs, demands the exit code, and returns standard output and standard error.
    #[track_caller]
    fn exits(&self, code: i32, arguments: &str) -> (String, String) {
        let output = PLOTPLAN.run(&self.0, arguments);
        let (out, err) = (stdout(&output), stderr(&output));
        assert_eq!(output.status.code(), Some(code), "{arguments}\n{out}\n{err}");
        (out, err)
    }

    fn files(&self, folder: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path().join(folder)).expect("a folder");
        let mut names: Vec<String> = entries
            .map(|entry| entry.expect("an entry").file_name().into_string().expect("a name"))
            .collect();
        names.sort();
        names
    }
}

const TWO: &str = "[options]\nmachine = \"corexy\"\n\n[[plan]]\ndrawing = \"a.hpgl\"\noutput = [\"out/a.ticks\", \"out/a.svg\"]\n\n\
                   [[plan]]\ndrawing = \"b.hpgl\"\noutput = \"out/b.csv\"\n";

#[test]
fn build_makes_what_is_out_of_date_and_says_why() {
    let project = Project::new(TWO);
    let (_, said) = project.exits(0, "build");
    assert!(said.ends_with("3 built\n"), "{said}");
    assert_eq!(project.files("out"), ["a.svg", "a.ticks", "b.csv"]);
    // The same bytes as by hand.
    project.exits(0, "convert a.hpgl -m corexy -o by-hand.ticks");
    assert_eq!(project.0.text("out/a.ticks"), project.0.text("by-hand.ticks"));
    assert_eq!(project.exits(0, "build").1, "3 up to date\n");

    project.0.write("b.hpgl", "IN;SP1;PU1000,1000;CI500;PU;SP0;");
    let (_, said) = project.exits(0, "build");
    assert!(
        said.contains("out/b.csv") && said.contains("(b.hpgl changed)") && !said.contains("a.ticks"),
        "{said}"
    );

    project.0.write(
        "plotplan.toml",
        TWO.replacen("output", "tolerance = \"0.2mm\"\noutput", 1).replacen(", \"out/a.svg\"", "", 1),
    );
    let (_, said) = project.exits(0, "build");
    assert!(said.contains("out/a.ticks") && said.contains("(with --tolerance=0.2mm)"), "{said}");
    assert!(said.contains("out/a.svg: no longer in plotplan.toml; the file stays"), "{said}");

    std::fs::remove_file(project.0.path().join("out/b.csv")).unwrap();
    project.0.write("out/a.ticks", "mine");
    let (_, said) = project.exits(0, "build");
    assert!(said.contains("(new)") && said.contains("(the output was changed by hand)"), "{said}");
    assert!(project.exits(0, "build --force").1.ends_with("2 built\n"));
}

#[test]
fn machine_file_of_a_project_is_an_input() {
    let project =
        Project::new("[[plan]]\ndrawing = \"a.hpgl\"\nmachine = \"mine.toml\"\noutput = \"a.ticks\"\n");
    let (machine, _) = project.exits(0, "machine show corexy");
    project.0.write("mine.toml", &machine);
    project.exits(0, "build");
    assert_eq!(project.exits(0, "build").1, "1 up to date\n");
    project.0.write("mine.toml", format!("{machine}\n# changed\n"));
    assert!(project.exits(0, "build").1.contains("(the machine changed)"));
}

#[test]
fn check_makes_nothing_and_says_what_changed() {
    let project = Project::new(TWO);
    project.exits(0, "build");
    assert_eq!(project.exits(0, "build --check").1, "3 up to date\n");
    let before = project.0.text("out/a.ticks");
    project.0.write("a.hpgl", "IN;SP1;PU0,0;PD4000,0,4000,2000;PU0,3000;PD400,3000;PU;SP0;");
    std::fs::remove_file(project.0.path().join("out/b.csv")).unwrap();
    let (_, said) = project.exits(1, "build --check");
    assert!(said.contains("out/a.ticks: 1 stroke differ") && said.contains("1 added"), "{said}");
    assert!(said.contains("(a.hpgl changed)") && said.contains("out/b.csv: is not there"), "{said}");
    assert!(said.contains("error: 3 outputs are not what plotplan.toml makes: `plotplan build`"), "{said}");
    assert_eq!(project.0.text("out/a.ticks"), before);
    assert!(!project.0.path().join("out/b.csv").exists());

    let (_, report) = project.exits(1, "build --check --report json");
    let report: serde_json::Value = serde_json::from_str(report.lines().last().unwrap()).unwrap();
    assert_eq!(report["error"]["code"], "build");
    assert_eq!(report["built"][0]["state"], "differs");
    assert_eq!(report["built"][0]["changes"]["strokes"]["added"], 1);
}

#[test]
fn failed_output_names_its_drawing_and_the_others_are_made() {
    let project = Project::new(TWO);
    project.0.write("a.hpgl", "IN;SP1;PU0,0;PD400000,0;PU;");
    let (_, said) = project.exits(1, "build");
    assert!(said.contains("a.hpgl:1:") && said.contains("out/a.ticks: not made"), "{said}");
    assert!(
        said.contains("1 built, 2 failed") && said.contains("error: 2 outputs could not be made\n"),
        "{said}"
    );
    assert_eq!(project.files("out"), ["b.csv"]);
    std::fs::remove_file(project.0.path().join("out/b.csv")).expect("it was written");
    std::fs::remove_file(project.0.path().join("a.hpgl")).expect("it was written");
    let (_, said) = project.exits(1, "build");
    assert!(said.contains("cannot read a.hpgl") && said.contains("1 built, 2 failed"), "{said}");
    project.0.write("a.hpgl", "IN;SP1;PU0,0;PD400,0;PU;");
    assert!(project.exits(0, "build").1.ends_with("2 built, 1 up to date\n"));
}

#[test]
fn check_counts_failed_and_different_outputs_apart() {
    let project = Project::new(TWO);
    project.exits(0, "build");
    project.0.write("a.hpgl", "IN;SP1;PU0,0;PD400000,0;PU;");
    project.0.write("b.hpgl", "IN;SP1;PU1000,1000;CI500;PU;SP0;");
    let (_, said) = project.exits(1, "build --check");
    assert!(
        said.contains("error: 2 outputs could not be made; 1 output is not what plotplan.toml makes:"),
        "{said}"
    );
}

#[test]
fn report_of_a_build_has_findings_errors_and_places() {
    let project = Project::new(TWO);
    project.0.write("a.hpgl", "IN;SP1;PU0,0;PD400000,0;PU;");
    project.0.write("b.hpgl", "IN;SP1;QA;PU1000,1000;CI400;PU;SP0;");
    let (_, said) = project.exits(1, "build --report json");
    let report: serde_json::Value = serde_json::from_str(said.lines().last().unwrap()).unwrap();
    let built = &report["built"];
    assert_eq!(
        [&built[0]["state"], &built[0]["error"]["code"], &built[0]["error"]["place"]["file"]],
        ["failed", "out-of-reach", "a.hpgl"],
        "{built}"
    );
    assert_eq!([&built[2]["state"], &built[2]["error"]], [&"built".into(), &serde_json::Value::Null]);
    let found = report["diagnostics"].as_array().unwrap();
    assert!(found.iter().any(|finding| finding["file"] == "b.hpgl" && finding["byte"] == 7), "{found:?}");
    assert_eq!(report["error"]["place"]["file"], "a.hpgl");

    // A file that is missing is found before any process starts.
    std::fs::remove_file(project.0.path().join("a.hpgl")).unwrap();
    let (_, said) = project.exits(1, "build --report json");
    let report: serde_json::Value = serde_json::from_str(said.lines().last().unwrap()).unwrap();
    assert_eq!(report["built"][0]["error"]["code"], "io", "{said}");
}

#[test]
fn quiet_build_prints_errors_only() {
    let project = Project::new(TWO);
    project.0.write("b.hpgl", "IN;SP1;QA;PU1000,1000;CI400;PU;SP0;");
    assert!(project.exits(0, "build").1.contains("warning"));
    assert_eq!(project.exits(0, "build --force --quiet").1, "");
    assert_eq!(project.exits(0, "build --check --quiet").1, "");
    let lines = project.exits(0, "build --force --message-format json").1;
    assert!(lines.contains("{\"file\":\"b.hpgl\""), "{lines}");
}

#[test]
fn listed_command_lines_make_the_same_files() {
    let project = Project::new(TWO);
    project.0.write("b.hpgl", "IN;SP1;PU1000,1000;CI400;PU;SP0;");
    let list = project.exits(0, "build --list").0;
    assert_eq!(list.lines().count(), 3);
    std::fs::create_dir(project.0.path().join("out")).unwrap();
    for line in list.lines() {
        assert!(line.starts_with("plotplan convert "), "{line}");
        project.exits(0, line.trim_start_matches("plotplan "));
    }
    assert_eq!(project.exits(0, "build --check").1, "3 up to date\n");
}

#[test]
fn patterns_stand_for_drawings() {
    let project =
        Project::new("[[plan]]\ndrawing = \"*.hpgl\"\nmachine = \"corexy\"\noutput = \"out/%f.ticks\"\n");
    assert!(project.exits(0, "build").1.ends_with("2 built\n"));
    assert_eq!(project.files("out"), ["a.ticks", "b.ticks"]);
    project.exits(0, "build out/a.ticks");
    let (_, said) = project.exits(2, "build out/c.ticks");
    assert!(said.contains("out/c.ticks is no output of plotplan.toml; did you mean"), "{said}");
}

#[test]
fn project_errors_are_usage_errors_with_their_line() {
    let plan = "[[plan]]\ndrawing = \"a.hpgl\"\nmachine = \"corexy\"\n";
    for (file, expected) in [
        (format!("{plan}output = \"a.ticks\"\nperiod = \"10 parsecs\"\n"), "plotplan.toml:1: invalid value"),
        (format!("{plan}output = \"a.ticks\"\ngap = \"1mm\"\n"), "--gap has no effect"),
        (format!("{plan}output = \"a.svg\"\nformat = \"ticks\"\n"), "contradicts the extension of a.svg"),
        (format!("{plan}output = \"a.ticks\"\npage = \"all\"\n"), "`page` writes several files"),
        (format!("{plan}output = \"-\"\n"), "`-` is not a file to write"),
        (
            format!("{plan}output = \"a.ticks\"\n{plan}output = \"a.ticks\"\n"),
            "also the output of the [[plan]] in line 1",
        ),
        (
            "[[plan]]\ndrawing = \"a.hpgl\"\noutput = \"a.ticks\"\n".to_owned(),
            "which machine is a.ticks for?",
        ),
        (plan.replace("a.hpgl", "*.svg") + "output = \"%f.ticks\"\n", "no drawing matches `*.svg`"),
        (plan.replace("a.hpgl", "*.hpgl") + "output = \"x.ticks\"\n", "write `%f`"),
        (format!("{plan}output = \"a.hpgl\"\n"), "a.hpgl is the input a.hpgl"),
    ] {
        let project = Project::new(&file);
        let (_, said) = project.exits(if file.contains("output = \"a.hpgl\"") { 1 } else { 2 }, "build");
        assert!(said.contains(expected), "{file}\n{said}");
        assert!(project.0.text("a.hpgl").starts_with("IN;SP1;PU0,0;"), "an input was replaced");
    }
    assert!(PLOTPLAN.refuse(&TestDir::new(), "build", 2).contains("plotplan init"));
}

#[test]
fn init_writes_a_project_that_builds() {
    let project = Project::new("");
    std::fs::remove_file(project.0.path().join("plotplan.toml")).unwrap();
    project.exits(0, "init --machine corexy");
    assert!(project.exits(0, "build").1.ends_with("2 built\n"));
    let (_, said) = project.exits(2, "init");
    assert!(said.contains("exists already"), "{said}");
    let other = project.0.path().join("elsewhere");
    std::fs::create_dir(&other).unwrap();
    project.exits(0, "init elsewhere");
    // There is no drawing yet.
    let (_, said) = project.exits(1, "build --project elsewhere");
    assert!(said.contains("cannot read drawing.hpgl"), "{said}");
}

#[cfg(unix)]
#[test]
#[expect(clippy::disallowed_methods, reason = "the limits of this test are times")]
fn watch_builds_again_and_ends_within_half_a_second_of_a_signal() {
    let project = Project::new(TWO);
    let mut child = Command::new(PATH)
        .current_dir(project.0.path())
        .args(["build", "--watch"])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let until = |what: &dyn Fn() -> bool| {
        let start = Instant::now();
        while !what() {
            assert!(start.elapsed() < Duration::from_secs(60), "nothing happened");
            std::thread::sleep(Duration::from_millis(20));
        }
    };
    until(&|| project.0.path().join("out/b.csv").exists() && project.0.path().join("plotplan.lock").exists());
    let before = project.0.text("out/b.csv");
    project.0.write("b.hpgl", "IN;SP1;PU1000,1000;CI700;PU;SP0;");
    until(&|| project.0.text("out/b.csv") != before);
    let start = Instant::now();
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(130));
    // The limit is 0.5 s on a quiet machine.
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
    assert!(!project.files(".").iter().any(|name| name.starts_with(".plotplan-")));
}

#[test]
fn diff_names_strokes_quantities_and_causes() {
    let project = Project::new(TWO);
    let json = |to: &str, more: &str| {
        project.exits(0, &format!("convert a.hpgl -m coaxial -f json -o {to} --fit {more}"));
    };
    json("old.json", "");
    json("new.json", "--tolerance 0.3mm");
    let (said, _) = project.exits(0, "diff old.json new.json");
    assert!(
        said.contains("strokes  1 the same\n") && said.contains("settings.tolerance_mm: 0.1 -> 0.3\n"),
        "{said}"
    );
    assert!(!said.contains("machine."), "{said}");
    // Of the certificates: how close the ink is, and how close the motors are to their limits.
    for name in ["stray    ", "missed   "] {
        let line = said.lines().find(|line| line.starts_with(name)).unwrap_or_default();
        assert!(line.contains(" mm -> "), "{name}: {said}");
    }
    let (report, _) = project.exits(0, "diff old.json new.json --json");
    for key in ["speed_share", "acceleration_share"] {
        assert!(report.contains(&format!("{{\"key\":\"{key}\",\"old\":0.")), "{report}");
    }
    assert_eq!(project.exits(0, "diff old.json old.json --exit-code").0, "no difference\n");

    // A plan is its drawing; a plan document states more than tick lines.
    project.exits(0, "convert a.hpgl -m coaxial -o old.ticks --fit");
    for pair in ["a.hpgl old.ticks", "old.ticks old.json", "old.json old.ticks"] {
        let (said, _) = project.exits(0, &format!("diff {pair}"));
        assert!(
            (said == "no difference\n" || said.contains("1 the same")) && !said.contains("(gone)"),
            "{said}"
        );
    }
    // The placement is rounded to what it means.
    project.exits(0, "convert a.hpgl -m coaxial -o other.ticks --fit --rotate 90");
    let (said, _) = project.exits(0, "diff old.ticks other.ticks");
    let placement = said.lines().find(|line| line.starts_with("placement: ")).unwrap_or_default();
    let digits =
        |word: &str| word.split_once('.').map_or(0, |(_, after)| after.trim_end_matches([',', ']']).len());
    assert!(!placement.is_empty() && placement.split(' ').all(|word| digits(word) <= 6), "{said}");

    let (machine, _) = project.exits(0, "machine show coaxial");
    project.0.write("fast.toml", machine.replace("60deg/s", "90deg/s"));
    project.0.write("same.toml", &machine);
    let (said, _) = project.exits(1, "diff same.toml fast.toml --exit-code");
    assert_eq!(
        said,
        "machine.motor.0.max_speed: 60deg/s -> 90deg/s\nmachine.motor.1.max_speed: 60deg/s -> 90deg/s\n"
    );
    let (said, _) = project.exits(0, "diff old.ticks fast.toml");
    assert!(said.contains("motor.0.speed_ticks_s: 533.3 -> 800.0"), "{said}");
    project.exits(2, "diff a.hpgl fast.toml");
    project.exits(2, "diff a.hpgl plotplan.toml");
    project.exits(3, "diff a.hpgl missing.hpgl");
}

#[test]
fn diff_finds_one_vertex_that_moved() {
    let project = Project::new(TWO);
    let drawing = |y: i32| {
        let points: Vec<String> =
            (1..200).map(|k| format!("{},{}", 20 * k, if k == 77 { y } else { 40 * (k % 9) })).collect();
        format!("IN;SP1;PU0,0;PD{};PU;", points.join(","))
    };
    project.0.write("old.hpgl", drawing(200));
    project.0.write("new.hpgl", drawing(240));
    let (said, _) = project.exits(1, "diff old.hpgl new.hpgl --exit-code");
    assert!(said.starts_with("strokes  0 the same, 1 gone, 1 added\n"), "{said}");
}

#[test]
fn diff_pictures_and_report() {
    let project = Project::new(TWO);
    for (name, head) in [("d.svg", "<svg"), ("d.html", "<!DOCTYPE html>"), ("d.png", "\u{fffd}PNG")] {
        project.exits(0, &format!("diff a.hpgl b.hpgl -o {name}"));
        let bytes = project.0.bytes(name);
        assert!(String::from_utf8_lossy(&bytes).starts_with(head), "{name}");
    }
    let svg = project.0.text("d.svg");
    assert!(svg.contains(">gone</text>") && svg.contains(">added</text>") && !svg.contains(">pen "), "{svg}");
    project.exits(2, "diff a.hpgl b.hpgl -o d.gif");
    let (_, said) = project.exits(2, "diff a.hpgl b.hpgl -o a.svg.hpgl");
    assert!(said.contains("NAME.svg"), "{said}");
    let (out, _) = project.exits(1, "diff a.hpgl b.hpgl --json --exit-code");
    let report: serde_json::Value = serde_json::from_str(out.lines().last().unwrap()).unwrap();
    assert_eq!(report["diff"]["strokes"]["gone"], 1);
    assert_eq!(report["diff"]["strokes"]["added"], 1);
    assert_eq!(report["error"]["code"], "differs");
}
