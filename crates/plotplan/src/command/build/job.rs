//! One output of a project: its command line, what it depends on, and the child process that makes it.

use std::collections::BTreeMap;
use std::io::{Read as _, Seek as _};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::Context as _;
use clap::{CommandFactory as _, FromArgMatches as _};
use compiler::import::sha256;

use super::lock::Made;
use super::project::{Entry, ProjectError};
use crate::cli::{self, Command as Cli, Convert, Format, PageChoice};
use crate::failure::Failure;
use crate::{machines, options, session};

/// How often a process is asked whether it has ended.
const POLL: Duration = Duration::from_millis(5);

/// An output and how it is made.
#[derive(Clone, Debug)]
pub(super) struct Job {
    /// The file, relative to the project.
    pub(super) output: String,
    /// Its format.
    format: Format,
    drawings: Vec<String>,
    /// Options of `convert` but the output.
    options: Vec<String>,
    machine: Option<String>,
    /// Other files that it depends on.
    others: Vec<String>,
}

/// What a child process printed.
pub(super) struct Output {
    /// The output's bytes.
    pub(super) bytes: Vec<u8>,
    /// The report of the run.
    pub(super) report: serde_json::Value,
    /// Warnings and errors.
    pub(super) messages: String,
    /// Whether it succeeded.
    pub(super) is_ok: bool,
}

/// The jobs of the project's plans.
pub(super) fn of(entries: &[Entry]) -> Result<Vec<Job>, ProjectError> {
    let mut jobs = Vec::new();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for entry in entries {
        let at = |message: String| ProjectError { line: entry.line, message };
        for (drawings, file) in files(entry).map_err(at)? {
            let job = job(entry, drawings, file).map_err(at)?;
            if let Some(line) = seen.insert(job.output.clone(), entry.line) {
                return Err(at(format!("{} is also the output of the [[plan]] in line {line}", job.output)));
            }
            jobs.push(job);
        }
    }
    Ok(jobs)
}

/// Drawings and name of each output of a plan.
fn files(entry: &Entry) -> Result<Vec<(Vec<String>, String)>, String> {
    let is_pattern = |file: &String| file.contains(['*', '?']);
    let Some(pattern) = entry.drawings.iter().find(|file| is_pattern(file)) else {
        let of = |output: &String| (entry.drawings.clone(), output.replace("%f", &stem(&entry.drawings[0])));
        return Ok(entry.outputs.iter().map(of).collect());
    };
    if entry.drawings.len() > 1 {
        return Err(format!("`{pattern}` stands for several drawings; give it alone"));
    }
    if let Some(output) = entry.outputs.iter().find(|output| !output.contains("%f")) {
        return Err(format!(
            "`{pattern}` may be several drawings: write `%f` for the drawing's name into {output}"
        ));
    }
    let found = glob::glob(pattern).map_err(|error| format!("`{pattern}`: {error}"))?;
    // In the order of their names, by glob's own promise.
    let found: Result<Vec<_>, _> = found.collect();
    let found = found.map_err(|error| format!("`{pattern}`: {error}"))?;
    let mut all = Vec::new();
    for path in found.iter().filter(|path| path.is_file()) {
        let Some(file) = path.to_str() else { continue };
        let file = file.replace('\\', "/");
        all.extend(
            entry.outputs.iter().map(|output| (vec![file.clone()], output.replace("%f", &stem(&file)))),
        );
    }
    if all.is_empty() { Err(format!("no drawing matches `{pattern}`")) } else { Ok(all) }
}

/// The name of a file without folder and extension.
fn stem(file: &str) -> String {
    Path::new(file).file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

fn job(entry: &Entry, drawings: Vec<String>, output: String) -> Result<Job, String> {
    let mut arguments = vec!["plotplan".to_owned(), "convert".to_owned()];
    arguments.extend(entry.options.iter().cloned());
    arguments.extend(["--output".to_owned(), output.clone(), "--".to_owned()]);
    arguments.extend(drawings.iter().cloned());
    let convert = parse(&arguments)?;
    let format = convert.format()?;
    let several = if convert.reading.page == Some(PageChoice::All) {
        Some("page")
    } else {
        convert.split.map(|_| "split")
    };
    if let Some(key) = several {
        return Err(format!(
            "`{key}` writes several files; give a [[plan]] for each (`page = 2`, `only_pens = 1`)"
        ));
    }
    if output == "-" || output.ends_with(['/', '\\']) || Path::new(&output).is_dir() {
        return Err(format!("`{output}` is not a file to write"));
    }
    if format.needs_machine() && convert.machine.is_none() {
        return Err(format!("which machine is {output} for? Give `machine`, here or in [options]"));
    }
    let mut others = convert.reading.font.clone();
    let plotters = [convert.target.map(|(name, _)| name), convert.reading.plotter];
    others.extend(plotters.into_iter().flatten().filter(|name| Path::new(name).is_file()));
    let options = entry.options.clone();
    Ok(Job { output, format, drawings, options, machine: convert.machine, others })
}

/// The arguments of `convert`, if they are right.
fn parse(arguments: &[String]) -> Result<Convert, String> {
    let first_line = |error: clap::Error| {
        let text = error.to_string();
        text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned()
    };
    let matches = cli::Arguments::command().try_get_matches_from(arguments).map_err(first_line)?;
    if let Some(what) = options::without_effect(&matches) {
        return Err(what);
    }
    let mut parsed = cli::Arguments::from_arg_matches(&matches).map_err(first_line)?;
    parsed.settle();
    match parsed.command {
        Cli::Convert(convert) => Ok(convert),
        _ => Err("not a plan".to_owned()),
    }
}

impl Job {
    /// The command line that makes the output alone, for a shell.
    pub(super) fn command_line(&self) -> String {
        let mut words = vec!["plotplan".to_owned(), "convert".to_owned()];
        words.extend(self.options.iter().map(|option| quoted(option)));
        words.extend(["-o".to_owned(), quoted(&self.output)]);
        if self.drawings.iter().any(|file| file.starts_with('-')) {
            words.push("--".to_owned());
        }
        words.extend(self.drawings.iter().map(|file| quoted(file)));
        words.join(" ")
    }

    /// What the output would be made from now; its own hash is left empty.
    pub(super) fn inputs(&self) -> Result<Made, Failure> {
        let machine = self.machine.as_deref().map(machines::machine_toml).transpose()?;
        let mut files = BTreeMap::new();
        for file in self.drawings.iter().chain(&self.others) {
            let bytes = crate::input::read_file(Path::new(file));
            let bytes = bytes.with_context(|| format!("cannot read {file}")).map_err(Failure::Io)?;
            files.insert(file.clone(), sha256(&bytes));
        }
        Ok(Made {
            sha256: String::new(),
            program: concat!("plotplan ", env!("PLOTPLAN_VERSION")).to_owned(),
            options: self.options.clone(),
            machine: machine.map(|toml| sha256(toml.as_bytes())),
            files,
        })
    }

    /// The machine, as given.
    pub(super) fn machine(&self) -> Option<&str> {
        self.machine.as_deref()
    }

    /// Files that are read, for `--watch`.
    pub(super) fn files(&self) -> impl Iterator<Item = &str> {
        self.drawings.iter().chain(&self.others).chain(&self.machine).map(String::as_str)
    }

    /// Makes the output in a process of its own, so that a plan is what the command line of
    /// [`Self::command_line`] writes. Ends it when `stop` is set.
    pub(super) fn make(&self, stop: &AtomicBool) -> Result<Output, Failure> {
        let failed = |what: &'static str| {
            move |error: std::io::Error| Failure::Io(anyhow::Error::new(error).context(what))
        };
        let program = std::env::current_exe().map_err(failed("cannot find the program itself"))?;
        let [mut out, mut messages] = [(); 2].map(|()| tempfile::tempfile());
        let (Ok(out), Ok(messages)) = (&mut out, &mut messages) else {
            return Err(Failure::Io(anyhow::anyhow!("cannot make a temporary file")));
        };
        let copy = |file: &std::fs::File| {
            file.try_clone().map(Stdio::from).map_err(failed("cannot make a temporary file"))
        };
        let mut command = Command::new(program);
        command.arg("convert").args(&self.options);
        if !self.options.iter().any(|option| option.starts_with("--format=")) {
            command.arg("--format").arg(self.format.name());
        }
        command.args(session::style().as_arguments());
        command.args(["--report=json", "--color=never", "--output=-", "--"]).args(&self.drawings);
        command.stdin(Stdio::null()).stdout(copy(out)?).stderr(copy(messages)?);
        let mut child = command.spawn().map_err(failed("cannot start a process"))?;
        let status = loop {
            if let Some(status) = child.try_wait().map_err(failed("cannot wait for a process"))? {
                break status;
            }
            if stop.load(Ordering::Relaxed) {
                let _ = child.kill();
                let _ = child.wait();
                return Err(Failure::Interrupted);
            }
            std::thread::sleep(POLL);
        };
        let mut bytes = Vec::new();
        let mut text = String::new();
        out.rewind()
            .and_then(|()| out.read_to_end(&mut bytes))
            .map_err(failed("cannot read a temporary file"))?;
        messages
            .rewind()
            .and_then(|()| messages.read_to_string(&mut text))
            .map_err(failed("cannot read a temporary file"))?;
        // The report is the last line of standard error.
        let body = text.trim_end();
        let (before, last) = body.rsplit_once('\n').map_or(("", body), |(before, last)| (before, last));
        let report: serde_json::Value = serde_json::from_str(last).unwrap_or_default();
        let messages = if report.is_null() { body.to_owned() } else { before.to_owned() };
        Ok(Output { bytes, report, messages, is_ok: status.success() })
    }
}

/// A word of a command line for a POSIX shell.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_=+./,:%@".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}
