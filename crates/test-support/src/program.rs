//! The program under test, run on command lines.

use std::process::{Command, Output};

use crate::TestDir;

/// A program, by the path of its binary.
#[derive(Clone, Copy, Debug)]
pub struct Program(&'static str);

impl Program {
    /// The program at a path: `env!("CARGO_BIN_EXE_plotplan")`.
    pub const fn new(path: &'static str) -> Self {
        Self(path)
    }

    /// Runs it in a directory, without machines of the user's own and in wide lines. Arguments are
    /// divided at blanks.
    pub fn run(&self, dir: &TestDir, arguments: &str) -> Output {
        let mut command = Command::new(self.0);
        command.current_dir(dir.path()).args(arguments.split_whitespace());
        command.env("COLUMNS", "200").env("XDG_CONFIG_HOME", dir.path().join("config"));
        command.output().expect("the program runs")
    }

    /// Runs it with exit code 0.
    #[track_caller]
    pub fn succeed(&self, dir: &TestDir, arguments: &str) -> Output {
        let output = self.run(dir, arguments);
        assert!(output.status.success(), "plotplan {arguments}\n{}", stderr(&output));
        output
    }

    /// The standard output of a run with exit code 0.
    #[track_caller]
    pub fn stdout_of(&self, dir: &TestDir, arguments: &str) -> String {
        stdout(&self.succeed(dir, arguments))
    }

    /// The standard error of a run with this exit code.
    #[track_caller]
    pub fn fail(&self, dir: &TestDir, arguments: &str, code: i32) -> String {
        let output = self.run(dir, arguments);
        assert_eq!(output.status.code(), Some(code), "plotplan {arguments}\n{}", stderr(&output));
        stderr(&output)
    }

    /// The standard error of a run with this exit code that writes nothing to standard output.
    #[track_caller]
    pub fn refuse(&self, dir: &TestDir, arguments: &str, code: i32) -> String {
        let output = self.run(dir, arguments);
        assert_eq!(output.status.code(), Some(code), "plotplan {arguments}\n{}", stderr(&output));
        assert!(output.stdout.is_empty(), "plotplan {arguments} writes to standard output");
        stderr(&output)
    }
}

/// What was written to standard output.
pub fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// What was written to standard error.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
