//! README.md is up to date: console blocks print the shown output, the picture is current, and links
//! resolve.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::cargo::cargo_bin;
use tempfile::TempDir;

fn top() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn readme() -> String {
    fs::read_to_string(top().join("README.md")).expect("README.md")
}

/// Commands of the console blocks of the README, each with the output shown below it.
fn commands(readme: &str) -> Vec<(String, String)> {
    let mut commands: Vec<(String, String)> = Vec::new();
    for block in readme.split("```console\n").skip(1) {
        let (block, _) = block.split_once("```").expect("a block has an end");
        for line in block.lines() {
            match (line.strip_prefix("$ "), commands.last_mut()) {
                (Some(command), _) => commands.push((command.to_owned(), String::new())),
                (None, Some((_, output))) => output.extend([line, "\n"]),
                (None, None) => panic!("output without a command: {line}"),
            }
        }
    }
    commands
}

/// Runs a command of the README in the top folder and returns its output. Files that it writes, or reads
/// back, are in `folder`.
fn run(command: &str, folder: &Path) -> String {
    let written = |name: &str| folder.join(name.replace('/', "-"));
    if let Some((count, file)) = command.strip_prefix("head -").and_then(|rest| rest.split_once(' ')) {
        let text = fs::read_to_string(written(file)).expect("written before");
        return text.lines().take(count.parse().expect("a count")).flat_map(|line| [line, "\n"]).collect();
    }
    let arguments = command.strip_prefix("cargo run --release -- ").expect("a command that can be tested");
    let (arguments, redirected) =
        arguments.split_once(" > ").map_or((arguments, None), |(arguments, file)| (arguments, Some(file)));
    let mut program = assert_cmd::Command::new(cargo_bin!("plotplan"));
    program.current_dir(top());
    let mut output_is_next = false;
    for argument in arguments.split(' ') {
        if output_is_next || written(argument).exists() {
            program.arg(written(argument));
        } else {
            program.arg(argument);
        }
        output_is_next = argument == "--output";
    }
    let printed = program.assert().success();
    let output = printed.get_output();
    let mut text = String::from_utf8_lossy(&output.stderr).into_owned();
    match redirected {
        Some(file) => fs::write(written(file), &output.stdout).expect("a file can be written"),
        None => text += &String::from_utf8_lossy(&output.stdout),
    }
    text
}

#[test]
fn readme_commands_print_the_shown_output() {
    let folder = TempDir::new().expect("a folder");
    let mut pictures = 0;
    for (command, expected) in commands(&readme()) {
        let printed = run(&command, folder.path());
        assert_eq!(printed, expected, "`{command}` prints\n{printed}");
        if let Some((_, picture)) = command.split_once(" --output ") {
            let drawn = fs::read(folder.path().join(picture.replace('/', "-"))).expect("a picture");
            assert!(drawn == fs::read(top().join(picture)).expect(picture), "run `{command}` again");
            pictures += 1;
        }
    }
    assert_eq!(pictures, 2);
}

#[test]
fn readme_links_exist() {
    let readme = readme();
    let links: Vec<&str> = readme.split("](").skip(1).filter_map(|rest| rest.split(')').next()).collect();
    assert!(links.len() > 5);
    for link in links.into_iter().filter(|link| !link.contains("://")) {
        assert!(top().join(link).exists(), "README.md links to {link}");
    }
}
