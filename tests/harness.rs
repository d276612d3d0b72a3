//! The program in a folder of its own, and drawings for it.
#![allow(dead_code, reason = "each test binary uses its part")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use assert_cmd::cargo::cargo_bin;
use tempfile::TempDir;

/// A line with a corner, a circle, a line of a second pen, a dot: 30 mm x 25 mm, within reach of every preset.
pub(crate) const TINY: &str = "IN;SP1;\nPU400,400;PD1200,400,1200,1000;\nPU800,800;CI200;\nSP2;PU200,1000;PD200,600;\nPU300,900;PD;PU;\nSP0;\n";
/// A line of 0.5 m.
pub(crate) const LARGE: &str = "IN;SP1;PU400,400;PD1200,400;PU;PA20000,0;PD;PA400,400;PU;SP0;";
/// Three pens from left to right, the first line twice; the third pen is slow.
pub(crate) const PENS: &str = "IN;SP1;PU400,400;PD1200,400;PU400,400;PD1200,400;SP2;PU400,800;PD1200,800;SP3;VS2;PU400,1200;PD1200,1200;PU;SP0;";
pub(crate) const PRESETS: [&str; 5] = ["coaxial", "corexy", "hbot", "polar", "cartesian"];

/// A temporary working folder of the program.
pub(crate) struct TestDir {
    folder: TempDir,
}

impl TestDir {
    pub(crate) fn new() -> Self {
        let dir = Self { folder: TempDir::new().expect("a temporary folder") };
        dir.write("tiny.hpgl", TINY);
        dir.write("large.hpgl", LARGE);
        dir
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        fs::write(self.path().join(name), text).expect("a file can be written");
    }

    pub(crate) fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path().join(name)).expect(name)
    }

    pub(crate) fn text(&self, name: &str) -> String {
        String::from_utf8(self.bytes(name)).expect("text")
    }

    pub(crate) fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.path()).expect("the folder can be read");
        let mut names: Vec<String> = entries
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    pub(crate) fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(cargo_bin!("plotplan"));
        command.current_dir(self.path()).args(arguments.split_whitespace());
        // Width and colour must not depend on the terminal.
        command.env("COLUMNS", "100").env_remove("CLICOLOR_FORCE").env_remove("NO_COLOR");
        command
    }

    pub(crate) fn run(&self, arguments: &str) -> CommandOutput {
        self.run_with(arguments, "")
    }

    pub(crate) fn run_with(&self, arguments: &str, input: &str) -> CommandOutput {
        let mut command = assert_cmd::Command::from_std(self.command(arguments));
        CommandOutput::of(command.write_stdin(input).output().expect("the program runs"))
    }

    /// Runs the program and returns its output; fails if it does.
    pub(crate) fn succeed(&self, arguments: &str) -> CommandOutput {
        let said = self.run(arguments);
        assert_eq!(said.code, 0, "plotplan {arguments}\n{}", said.err);
        said
    }

    /// Output and exit code of each command, for a snapshot.
    pub(crate) fn transcript(&self, arguments: &[&str]) -> String {
        let of = |arguments: &&str| {
            let CommandOutput { code, out, err } = self.run(arguments);
            format!("$ plotplan {arguments}\n{}{err}[{code}]\n", String::from_utf8_lossy(&out))
        };
        arguments.iter().map(of).collect::<Vec<_>>().join("\n")
    }
}

pub(crate) struct CommandOutput {
    pub(crate) code: i32,
    pub(crate) out: Vec<u8>,
    pub(crate) err: String,
}

impl CommandOutput {
    pub(crate) fn of(output: Output) -> Self {
        Self {
            code: output.status.code().expect("it ends by itself"),
            out: output.stdout,
            err: String::from_utf8(output.stderr).expect("text"),
        }
    }

    pub(crate) fn text(&self) -> &str {
        std::str::from_utf8(&self.out).expect("text")
    }
}

/// The rows of a CSV plan as numbers.
pub(crate) fn rows(csv: &str) -> Vec<Vec<i64>> {
    let numbers = |line: &str| line.split(',').map(|field| field.parse().ok()).collect::<Option<Vec<i64>>>();
    csv.lines().filter_map(numbers).collect()
}
