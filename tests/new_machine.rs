//! `machine new`, and what `machine list` reports about the user's own machines.

use std::fs;
use std::io::Write as _;
use std::process::{Command, Stdio};

use compiler::machine_file::{MachineFile, PRESETS};
use test_support::{Program, TestDir, stderr};

const BINARY: &str = env!("CARGO_BIN_EXE_plotplan");
const PROGRAM: Program = Program::new(BINARY);

#[test]
fn machine_new_writes_a_commented_file_that_machine_check_accepts() {
    let dir = TestDir::new();
    for kind in ["cartesian", "two-link", "polar", "five-bar", "polargraph"] {
        PROGRAM.succeed(&dir, &format!("machine new {kind} -o {kind}.toml --defaults"));
        let checked = PROGRAM.stdout_of(&dir, &format!("machine check {kind}.toml -o {kind}.svg"));
        assert!(checked.contains("all of it can be drawn on"), "{checked}");
        let toml = fs::read_to_string(dir.path().join(format!("{kind}.toml"))).unwrap();
        assert!(toml.contains("# assumed: check it"), "{toml}");
        // It draws.
        fs::write(dir.path().join("a.plt"), "IN;SP1;PU400,400;PD800,400,800,800;PU;").unwrap();
        PROGRAM.succeed(&dir, &format!("convert a.plt -m {kind}.toml -o a.ticks"));
    }
    let again = PROGRAM.fail(&dir, "machine new polar -o polar.toml --defaults", 2);
    assert!(again.contains("polar.toml exists"), "{again}");
}

#[test]
fn answers_of_options_and_of_questions_are_in_the_file() {
    let dir = TestDir::new();
    let mut command = Command::new(BINARY);
    command.current_dir(dir.path()).args(["machine", "new", "-o", "arm.toml", "--set", "l1=206mm"]);
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    // Kind, l2, elbow (default), motor2, counts; defaults for the rest.
    let answers = "two-link\n256mm\n\nelbow\n6400/rev\n\n\n\n\n\n";
    child.stdin.take().expect("its input").write_all(answers.as_bytes()).unwrap();
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success(), "{}", stderr(&output));
    let toml = fs::read_to_string(dir.path().join("arm.toml")).unwrap();
    for line in
        ["name = \"arm\"", "l1 = \"206mm\"", "l2 = \"256mm\"", "counts = \"6400/rev\"", "[[1, 0], [-1, 1]]"]
    {
        assert!(toml.contains(line), "{line}: {toml}");
    }
    MachineFile::parse(&toml).and_then(|file| file.machine()).expect("a machine");
    for (line, said) in [
        ("machine new two-link -o b.toml --defaults --set l3=1mm", "l3 is not asked"),
        ("machine new two-link -o b.toml --defaults --set l1=5", "no unit"),
        ("machine new --defaults -o b.toml", "which kind"),
        ("machine new tripod --defaults -o b.toml", "none of cartesian"),
        ("machine new two-link -o b.toml --defaults --set l1", "KEY=VALUE"),
    ] {
        let text = PROGRAM.fail(&dir, line, 2);
        assert!(text.contains(said), "{line}: {text}");
    }
    assert!(!dir.path().join("b.toml").exists());
}

#[test]
fn machine_list_marks_broken_files_and_those_that_hide_a_preset() {
    let dir = TestDir::new();
    let folder = dir.path().join("config/plotplan/machines");
    fs::create_dir_all(&folder).unwrap();
    let toml = PRESETS[0].toml;
    fs::write(folder.join("coaxial.toml"), toml).unwrap();
    fs::write(folder.join("broken.toml"), toml.replacen("l1 =", "l9 =", 1)).unwrap();
    fs::write(folder.join("good.toml"), toml).unwrap();
    let list = PROGRAM.stdout_of(&dir, "machine list");
    let line = |name: &str| list.lines().find(|line| line.starts_with(name)).expect("a line").to_owned();
    assert!(line("broken").contains("CANNOT BE USED") && line("broken").contains("l9"), "{list}");
    assert!(line("coaxial").contains("hides the preset of this name"), "{list}");
    assert!(!line("good").contains("CANNOT") && !line("good").contains("hides"), "{list}");
    assert_eq!(list.matches("\ncoaxial").count() + usize::from(list.starts_with("coaxial")), 1, "{list}");
}
