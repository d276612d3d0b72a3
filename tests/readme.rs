//! README.md says what the program says: its console blocks are run, its picture drawn, its links followed.

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

/// Commands of the README's console blocks, each with the output that stands below it.
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

/// What a command of the README says, in the top folder. Whatever it writes goes into `folder`, and is read from there.
fn say(command: &str, folder: &Path) -> String {
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
    let said = program.assert().success();
    let output = said.get_output();
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
        let said = say(&command, folder.path());
        assert_eq!(said, expected, "`{command}` now says\n{said}");
        if let Some((_, picture)) = command.split_once(" --output ") {
            let drawn = fs::read(folder.path().join(picture.replace('/', "-"))).expect("a picture");
            assert!(drawn == fs::read(top().join(picture)).expect(picture), "run `{command}` again");
            pictures += 1;
        }
    }
    assert_eq!(pictures, 1);
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
