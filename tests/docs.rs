//! Every command line of README.md and docs/ runs: those in code blocks with files of the names that the
//! pages use, those in running text by their help. `send` prints instead of sending (`--dry-run`);
//! `emulate` and `build --watch`, which wait, are started and ended.
#![cfg(unix)]

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use test_support::{Program, TestDir, stderr};

const PATH: &str = env!("CARGO_BIN_EXE_plotplan");
const PROGRAM: Program = Program::new(PATH);

fn top() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// README.md and the pages of docs/, with their names.
fn pages() -> Vec<(String, String)> {
    let mut paths: Vec<PathBuf> = fs::read_dir(top().join("docs"))
        .expect("docs")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "md"))
        .collect();
    paths.push(top().join("README.md"));
    paths.sort();
    let name = |path: &Path| path.file_name().expect("a name").to_string_lossy().into_owned();
    paths.iter().map(|path| (name(path), fs::read_to_string(path).expect("a page"))).collect()
}

/// The command lines of code blocks, without prompt and comment.
fn commands(page: &str) -> Vec<String> {
    let mut commands = Vec::new();
    let mut fenced = false;
    for line in page.lines() {
        if line.starts_with("```") {
            fenced = !fenced;
            continue;
        }
        let line = if fenced { Some(line) } else { line.strip_prefix("    ") };
        let Some(line) = line.map(|line| line.strip_prefix("$ ").unwrap_or(line)) else { continue };
        let line = line
            .strip_prefix("cargo run --release -- ")
            .map_or(line.to_owned(), |rest| format!("plotplan {rest}"));
        if !line.starts_with("plotplan ") {
            continue;
        }
        let line = line.split("  #").next().unwrap_or_default();
        commands.extend(line.split("; ").map(|command| command.trim().to_owned()));
    }
    commands
}

/// The commands in running text: `plotplan` and what follows, between backquotes.
fn mentions(page: &str) -> Vec<String> {
    let parts = page.split('`').skip(1).step_by(2);
    parts.filter_map(|part| part.strip_prefix("plotplan ")).map(str::to_owned).collect()
}

/// A folder with the files that the pages name.
fn folder() -> TestDir {
    let dir = TestDir::new();
    for name in ["house.hpgl", "zot.hpgl"] {
        fs::copy(top().join("examples").join(name), dir.path().join(name)).expect(name);
    }
    fs::copy(top().join("examples/rings.svg"), dir.path().join("drawing.svg")).expect("drawing.svg");
    fs::create_dir_all(dir.path().join("examples")).expect("a folder");
    fs::create_dir_all(dir.path().join("docs/pictures")).expect("a folder");
    for name in ["house.hpgl", "zot.hpgl", "rings.svg"] {
        fs::copy(top().join("examples").join(name), dir.path().join("examples").join(name)).expect(name);
    }
    dir.write("drawing.hpgl", "IN;SP1;PU4000,4000;PD4800,4000,4800,4800;CI200;PU;");
    dir.write(
        "square.hpgl",
        "IN;SP1;PU800,800;PD2400,800,2400,2400,800,2400,800,800;PU1600,1600;CI400;PU;SP0;",
    );
    for name in ["mine.toml", "arm.toml"] {
        dir.write(name, PROGRAM.stdout_of(&dir, "machine show coaxial"));
    }
    for name in ["plan.ticks", "plan.csv", "plan.json", "old.json", "house.ticks"] {
        PROGRAM.succeed(&dir, &format!("convert drawing.hpgl -m coaxial -o {name} -q"));
    }
    PROGRAM.succeed(&dir, "convert drawing.hpgl -m coaxial --tolerance 0.2mm -o new.json -q");
    PROGRAM
        .succeed(&dir, "convert drawing.hpgl -f hpgl --plotter hp7475a --paper A4 --fit -o drawing.plt -q");
    // Touches of the corners, and of places within: the ticks of dots.
    dir.write("dots.hpgl", "IN;SP1;PU0,0;PD;PU8636,0;PD;PU8636,11176;PD;PU0,11176;PD;PU;");
    let csv = PROGRAM.stdout_of(&dir, "convert dots.hpgl -m coaxial --order file -f csv -q");
    let mut corners: Vec<&str> = Vec::new();
    for line in csv.lines().filter(|line| line.split(',').nth(1) == Some("1")) {
        let ticks = line.splitn(3, ',').nth(2).expect("ticks");
        if corners.last() != Some(&ticks) {
            corners.push(ticks);
        }
    }
    assert_eq!(corners.len(), 4, "{csv}");
    dir.write("ticks.csv", format!("arm1,arm2\n{}\n", corners.join("\n")));
    let places = ["0,0", "215.9,0", "215.9,279.4", "0,279.4"];
    let touches: Vec<String> =
        places.iter().zip(&corners).map(|(place, ticks)| format!("{place},{ticks}")).collect();
    dir.write("touches.csv", format!("x_mm,y_mm,arm1,arm2\n{}\n", touches.join("\n")));
    dir.write("record.csv", record());
    dir
}

/// A record of a motor for `tune --from-step`: a ramp of the duty from rest, runs at two duties, and rest.
/// 100 ticks/s per % of duty, a time constant of 0.1 s, 8 % of stiction and 6 % of friction.
fn record() -> String {
    let mut text = "time,position,duty\n".to_owned();
    let (mut position, mut speed) = (0.0, 0.0);
    for k in 0..400 {
        let time = 0.01 * f64::from(k);
        let duty = match k {
            0..100 => 0.2 * f64::from(k),
            100..200 => 60.0,
            200..300 => 30.0,
            _ => 0.0,
        };
        writeln!(text, "{time:.2},{position:.0},{duty:.1}").expect("text");
        for _ in 0..10 {
            let moves = speed > 0.0 || duty > 8.0;
            let drive = if moves { 100.0 * (duty - 6.0) } else { 0.0 };
            speed = f64::max(speed + 0.001 * (drive - speed) / 0.1, 0.0);
            position += 0.001 * speed;
        }
    }
    text
}

/// Runs a command that ends by itself; what it prints goes to the file that the line names.
fn run(dir: &TestDir, page: &str, line: &str) {
    let (line, file) = line.split_once(" > ").map_or((line, None), |(line, file)| (line, Some(file.trim())));
    // What reads from a pipe is not ours.
    let line = line.split(" | ").next().unwrap_or_default();
    let mut words: Vec<&str> = line.split_whitespace().skip(1).collect();
    if words.starts_with(&["machine", "new"]) {
        // It replaces no file, and the pages go on with a machine that is there.
        let _ = fs::remove_file(dir.path().join("new.toml"));
        words
            .iter_mut()
            .filter(|word| word.strip_suffix(".toml").is_some())
            .for_each(|word| *word = "new.toml");
        // Questions are for a person.
        if !words.contains(&"--defaults") {
            words.push("--defaults");
        }
    }
    if ["studio", "jog"].contains(&words[0]) {
        // They wait for a browser and for a machine.
        words.push("--help");
    }
    if words.first() == Some(&"send") {
        if let Some(at) = words.iter().position(|word| *word == "--port") {
            words.drain(at..at + 2);
        }
        words.push("--dry-run");
    }
    let output = PROGRAM.run(dir, &words.join(" "));
    // Verdicts: the example differs, its ink is too far off, an output is out of date.
    let may_differ = ["diff", "simulate", "build"].contains(&words[0]);
    let code = output.status.code();
    assert!(
        code == Some(0) || may_differ && code == Some(1),
        "{page}: {line}: {code:?}\n{}",
        stderr(&output)
    );
    if let Some(file) = file {
        dir.write(file, output.stdout);
    }
}

/// Starts a command that waits, and ends it after a moment: its options are accepted.
fn start(dir: &TestDir, page: &str, line: &str) {
    let words: Vec<&str> = line.trim_end_matches('&').split_whitespace().skip(1).collect();
    let mut command = Command::new(PATH);
    command.current_dir(dir.path()).args(&words).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().expect("the program starts");
    std::thread::sleep(Duration::from_millis(700));
    let ended = child.try_wait().expect("a state");
    assert!(ended.is_none_or(|status| status.success()), "{page}: {line}: {ended:?}");
    let _ = child.kill();
    child.wait().expect("it ends");
    let _ = fs::remove_file(dir.path().join("tty"));
}

#[test]
fn every_command_line_of_the_documentation_runs() {
    let dir = folder();
    let mut count = 0;
    for (page, text) in pages() {
        for line in commands(&text) {
            count += 1;
            if line.contains(" emulate ") || line.contains("--watch") {
                start(&dir, &page, &line);
            } else {
                run(&dir, &page, &line);
            }
        }
    }
    assert!(count > 50, "{count} commands");
}

#[test]
fn every_command_that_the_documentation_mentions_exists() {
    let dir = TestDir::new();
    let mut seen = BTreeSet::new();
    for (page, text) in pages() {
        for mention in mentions(&text) {
            let is_name = |word: &&str| {
                word.chars().all(|c| c.is_ascii_lowercase() || c == '-') && !word.starts_with('-')
            };
            let mut words: Vec<&str> = mention.split_whitespace().take_while(is_name).collect();
            words.truncate(if words.first() == Some(&"machine") { 2 } else { 1 });
            let options = mention.split_whitespace().filter(|word| word.starts_with("--"));
            if words.is_empty() {
                continue;
            }
            let help = PROGRAM.run(&dir, &format!("{} --help", words.join(" ")));
            assert!(help.status.success(), "{page}: plotplan {mention}");
            let text = String::from_utf8_lossy(&help.stdout).into_owned();
            for option in options {
                let name = option.split('=').next().unwrap_or(option);
                assert!(text.contains(name), "{page}: plotplan {mention}: no option {name}");
            }
            seen.insert(words.join(" "));
        }
    }
    assert!(seen.len() > 10, "{seen:?}");
}
