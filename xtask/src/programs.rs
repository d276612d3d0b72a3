//! Programs that tasks call.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context as _, Result, ensure};

/// Whether a program runs.
pub(crate) fn has(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

/// Runs a command in the top folder, which prints for itself.
pub(crate) fn execute(command: &mut Command) -> Result<()> {
    let line = shown(command);
    println!("$ {line}");
    let status = command.current_dir(crate::top()).status().with_context(|| format!("cannot run {line}"))?;
    ensure!(status.success(), "{line}: {status}");
    Ok(())
}

/// The standard output of a command that must succeed.
pub(crate) fn output_of(command: &mut Command) -> Result<Vec<u8>> {
    let line = shown(command);
    let output = command.output().with_context(|| format!("cannot run {line}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{line}: {}\n{said}", output.status);
    Ok(output.stdout)
}

/// The standard output as text.
pub(crate) fn text_of(command: &mut Command) -> Result<String> {
    Ok(String::from_utf8(output_of(command)?)?)
}

fn shown(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
}

/// Runs a command that must succeed; its processor time, s.
pub(crate) fn cpu_seconds(command: &mut Command) -> Result<f64> {
    let output = timed(command).output().context("bash")?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{}: {}\n{said}", shown(command), output.status);
    cpu_seconds_in(&said).context("no processor time")
}

/// A shell that runs the command and prints its processor time to standard error.
pub(crate) fn timed(command: &Command) -> Command {
    let mut timed = Command::new("bash");
    timed.args(["-c", "TIMEFORMAT='cpu: %U %S'; time \"$@\"", "bash"]);
    timed.arg(command.get_program()).args(command.get_args());
    timed
}

/// The processor time that the shell of [`timed`] printed, s.
pub(crate) fn cpu_seconds_in(said: &str) -> Option<f64> {
    let times = said.lines().rev().find_map(|line| line.strip_prefix("cpu: "))?;
    Some(times.split(' ').filter_map(|time| time.parse::<f64>().ok()).sum())
}

/// Writes a file and the folders that it lies in.
pub(crate) fn write(path: &Path, contents: impl AsRef<[u8]>) -> Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).with_context(|| format!("{}", folder.display()))?;
    }
    std::fs::write(path, contents).with_context(|| format!("{}", path.display()))
}

/// The commands of the program and of `machine`, as its help lists them.
pub(crate) fn commands(program: &Path) -> Result<Vec<String>> {
    let listed = |words: &[&str]| -> Result<Vec<String>> {
        let help = text_of(Command::new(program).args(words).arg("--help"))?;
        let list = help.split("Commands:\n").nth(1).unwrap_or_default();
        let names = list.lines().take_while(|line| !line.is_empty()).filter_map(|line| {
            // A name stands two columns in, its description further.
            line.strip_prefix("  ").filter(|line| !line.starts_with(' '))?.split_whitespace().next()
        });
        Ok(names.filter(|name| *name != "help").map(str::to_owned).collect())
    };
    let mut commands = Vec::new();
    for name in listed(&[])? {
        let inner = if name == "machine" { listed(&["machine"])? } else { Vec::new() };
        commands.push(name.clone());
        commands.extend(inner.into_iter().map(|inner| format!("{name} {inner}")));
    }
    ensure!(commands.len() > 10, "the help lists {} commands", commands.len());
    Ok(commands)
}

/// The version of all crates, from the workspace's manifest.
pub(crate) fn version() -> Result<String> {
    let manifest = std::fs::read_to_string(crate::top().join("Cargo.toml")).context("Cargo.toml")?;
    let table: toml::Table = manifest.parse()?;
    let version = table["workspace"]["package"]["version"].as_str().context("a version")?;
    Ok(version.to_owned())
}

/// Builds the program, and returns its path. The profile `quick` is `release` without optimization at link
/// time.
pub(crate) fn build(profile: &str) -> Result<PathBuf> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let built = Command::new(cargo)
        .args(["build", "--profile", profile, "--locked", "--quiet", "--package", "plotplan"])
        .args(["--message-format", "json"])
        .current_dir(crate::top())
        .stderr(Stdio::inherit())
        .output()
        .context("cannot run cargo")?;
    ensure!(built.status.success(), "the build failed");
    // Cargo's messages name the binary, for any target folder.
    let executable = String::from_utf8_lossy(&built.stdout)
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter(|message| message["target"]["name"] == "plotplan")
        .find_map(|message| message["executable"].as_str().map(PathBuf::from));
    executable.context("cargo did not report the path of the binary")
}

/// CPU time that a process has used. `None` where there is no `/proc`.
pub(crate) fn cpu_time(process: u32) -> Option<Duration> {
    fields_of_stat(process, 14)
}

/// CPU time of the programs that have ended, of this process and of theirs.
pub(crate) fn cpu_time_of_children() -> Option<Duration> {
    fields_of_stat(std::process::id(), 16)
}

/// By Linux's `/proc/PID/stat`: fields 14 and 15, user and system time in hundredths of a second, or 16 and 17,
/// those of the children waited for (`proc_pid_stat(5)`; `USER_HZ` is 100 on all its architectures).
fn fields_of_stat(process: u32, first: usize) -> Option<Duration> {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name of the program, field 2, is in parentheses and may contain blanks.
    let fields: Vec<&str> = stat.rsplit_once(") ")?.1.split(' ').collect();
    let hundredths = |field: usize| fields.get(field - 3)?.parse::<u64>().ok();
    Some(Duration::from_millis(10 * (hundredths(first)? + hundredths(first + 1)?)))
}
