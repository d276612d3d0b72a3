//! `plotplan build` and `plotplan init`: the plans of a folder, by `plotplan.toml`.

mod init;
mod job;
mod lock;
pub(crate) mod project;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};
use std::time::{Duration, SystemTime};

use anyhow::Context as _;
use compiler::diff::Diff;
use compiler::import;
use compiler::report::{BuiltOutput, BuiltState, Code, DiffReport, ErrorReport, Finding, text};
use serde::Deserialize as _;

pub(crate) use self::init::run as init;
use self::job::{Job, Output};
use self::lock::{Lock, Made};
use super::diff;
use crate::cli::Build;
use crate::failure::Failure;
use crate::input::Input;
use crate::{output, session, terminal};

/// How often `--watch` looks for changes.
const WATCH: Duration = Duration::from_millis(300);

pub(crate) fn run(arguments: &Build) -> Result<(), Failure> {
    enter(&arguments.project)?;
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))
        .map_err(|error| Failure::Io(anyhow::Error::new(error).context("cannot catch Ctrl-C")))?;
    if !arguments.watch {
        let jobs = jobs(arguments)?;
        if arguments.list {
            return output::write("-", |out| {
                jobs.iter().try_for_each(|job| writeln!(out, "{}", job.command_line()))
            });
        }
        return build(arguments, &jobs, &stop);
    }
    loop {
        let mut seen = vec![stamp(Path::new(project::NAME))];
        match jobs(arguments) {
            Ok(jobs) => {
                let files: Vec<String> = jobs.iter().flat_map(Job::files).map(str::to_owned).collect();
                seen = stamps(&files);
                match build(arguments, &jobs, &stop) {
                    Err(Failure::Interrupted) => return Err(Failure::Interrupted),
                    Err(failure) => drop(failure.describe(project::NAME)),
                    Ok(()) => {}
                }
                terminal::say("waiting for changes; Ctrl-C ends\n");
                wait(&stop, || stamps(&files) != seen)?;
            }
            Err(failure) => {
                failure.describe(project::NAME);
                wait(&stop, || stamps(&[]) != seen)?;
            }
        }
    }
}

/// Waits until something changes.
fn wait(stop: &AtomicBool, is_changed: impl Fn() -> bool) -> Result<(), Failure> {
    while !is_changed() {
        if stop.load(Ordering::Relaxed) {
            return Err(Failure::Interrupted);
        }
        std::thread::sleep(WATCH);
    }
    // A program that writes the file may need a moment.
    std::thread::sleep(WATCH);
    Ok(())
}

/// When a file was changed, and its size.
fn stamp(path: &Path) -> Option<(SystemTime, u64)> {
    let metadata = std::fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

/// The project file's stamp, then those of files.
fn stamps(files: &[String]) -> Vec<Option<(SystemTime, u64)>> {
    std::iter::once(stamp(Path::new(project::NAME)))
        .chain(files.iter().map(|file| stamp(Path::new(file))))
        .collect()
}

/// Goes to the project's folder: files are relative to it.
fn enter(given: &str) -> Result<(), Failure> {
    let given = Path::new(given);
    let folder = if given.is_dir() { given } else { given.parent().unwrap_or(Path::new("")) };
    let is_named = given.is_dir() || given.file_name().is_some_and(|name| name == project::NAME);
    if !is_named || !folder.join(project::NAME).is_file() {
        let what = format!(
            "{} is no project: `plotplan init` writes a {} for a folder",
            given.display(),
            project::NAME
        );
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    }
    if folder.as_os_str().is_empty() {
        return Ok(());
    }
    std::env::set_current_dir(folder)
        .with_context(|| format!("cannot go to {}", folder.display()))
        .map_err(Failure::Io)
}

/// The jobs of the project, or those of the outputs asked for.
fn jobs(arguments: &Build) -> Result<Vec<Job>, Failure> {
    let text = std::fs::read_to_string(project::NAME)
        .with_context(|| format!("cannot read {}", project::NAME))
        .map_err(Failure::Io)?;
    crate::input::remember(Path::new(project::NAME));
    let usage = |error: project::ProjectError| Failure::Usage(error.into());
    let mut jobs = job::of(&project::parse(&text).map_err(usage)?).map_err(usage)?;
    if let Some(unknown) = arguments.outputs.iter().find(|name| !jobs.iter().any(|job| job.output == **name))
    {
        let near = compiler::machine_file::nearest(unknown, jobs.iter().map(|job| job.output.as_str()));
        let hint = near.map_or_else(String::new, |near| format!("; did you mean {near}?"));
        return Err(Failure::Usage(anyhow::anyhow!("{unknown} is no output of {}{hint}", project::NAME)));
    }
    if !arguments.outputs.is_empty() {
        jobs.retain(|job| arguments.outputs.contains(&job.output));
    }
    Ok(jobs)
}

/// What to do with a job.
struct Task<'a> {
    job: &'a Job,
    made: Made,
    reason: Option<String>,
}

/// Makes what is out of date, or with `--check` compares all outputs with what would be made.
fn build(arguments: &Build, jobs: &[Job], stop: &AtomicBool) -> Result<(), Failure> {
    let lock_path = Path::new(lock::NAME);
    let mut lock = Lock::read(lock_path);
    let mut tasks = Vec::new();
    let mut counts: BTreeMap<BuiltState, usize> = BTreeMap::new();
    for job in jobs {
        let made = match job.inputs() {
            Ok(made) => made,
            Err(failure) => {
                let error = failure.describe(&job.output);
                *counts.entry(BuiltState::Failed).or_default() += 1;
                session::report(|report| report.built.push(BuiltOutput::failed(&job.output, error)));
                continue;
            }
        };
        let found = std::fs::read(&job.output).ok().map(|bytes| import::sha256(&bytes));
        let reason = lock.out_of_date(job, &made, found.as_deref());
        tasks.push(Task { job, made, reason });
    }
    let is_wanted = |task: &&Task<'_>| arguments.check || arguments.force || task.reason.is_some();
    let wanted: Vec<&Task<'_>> = tasks.iter().filter(is_wanted).collect();
    counts.insert(BuiltState::UpToDate, tasks.len() - wanted.len());
    for task in tasks.iter().filter(|task| !is_wanted(task)) {
        session::report(|report| report.built.push(BuiltOutput::up_to_date(&task.job.output)));
    }
    let result = each(&wanted, arguments.jobs, stop, |task, made| {
        let built = succeeded(task, made).and_then(|made| match made {
            Ok(made) if arguments.check => Ok(compare(task, &made)),
            Ok(made) => put(task, &made, &mut lock),
            Err(error) => Ok(BuiltOutput::failed(&task.job.output, Some(error))),
        });
        let built = built.unwrap_or_else(|failure| {
            let error = failure.describe(&task.job.output);
            BuiltOutput::failed(&task.job.output, error)
        });
        *counts.entry(built.state).or_default() += 1;
        session::report(|report| report.built.push(built));
    });
    if !arguments.check {
        forget_old(&mut lock, arguments, jobs);
        lock.write(lock_path)?;
    }
    result?;
    verdict(&counts)
}

/// Forgets outputs that the project no longer has; the files stay.
fn forget_old(lock: &mut Lock, arguments: &Build, jobs: &[Job]) {
    if !arguments.outputs.is_empty() {
        return;
    }
    lock.output.retain(|output, _| {
        let is_kept = jobs.iter().any(|job| job.output == *output);
        if !is_kept && Path::new(output).exists() {
            terminal::say(&format!("{output}: no longer in {}; the file stays\n", project::NAME));
        }
        is_kept
    });
}

/// The summary, and the failure if there is one.
fn verdict(counts: &BTreeMap<BuiltState, usize>) -> Result<(), Failure> {
    let of = |state: BuiltState| counts.get(&state).copied().unwrap_or(0);
    let (failed, differ) = (of(BuiltState::Failed), of(BuiltState::Differs));
    let words = [
        (of(BuiltState::Built), "built"),
        (of(BuiltState::UpToDate), "up to date"),
        (differ, "different"),
        (failed, "failed"),
    ];
    let shown: Vec<String> =
        words.iter().filter(|(count, _)| *count > 0).map(|(count, word)| format!("{count} {word}")).collect();
    terminal::say(&format!(
        "{}\n",
        if shown.is_empty() { "nothing to do".to_owned() } else { shown.join(", ") }
    ));
    if failed + differ == 0 {
        return Ok(());
    }
    let outputs = |count: usize| if count == 1 { "1 output".to_owned() } else { format!("{count} outputs") };
    let mut parts = Vec::new();
    if failed > 0 {
        parts.push(format!("{} could not be made", outputs(failed)));
    }
    if differ > 0 {
        let be = if differ == 1 { "is" } else { "are" };
        let what = format!("{} {be} not what {} makes", outputs(differ), project::NAME);
        parts.push(format!("{what}: `plotplan build` writes {}", if differ == 1 { "it" } else { "them" }));
    }
    terminal::error(Code::Build, &parts.join("; "));
    Err(Failure::Refused)
}

/// Makes the outputs on all cores, and hands each over in the order of the tasks.
fn each(
    tasks: &[&Task<'_>],
    workers: Option<usize>,
    stop: &AtomicBool,
    mut done: impl FnMut(&Task<'_>, Result<Output, Failure>),
) -> Result<(), Failure> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let workers = workers.unwrap_or(cores).clamp(1, tasks.len().max(1));
    let next = AtomicUsize::new(0);
    let progress = terminal::Counter::new(tasks.len());
    let (sender, receiver) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..workers {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                while let Some(task) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if stop.load(Ordering::Relaxed) || sender.send((*task, task.job.make(stop))).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        let mut waiting = BTreeMap::new();
        let mut printed = 0;
        for (task, made) in receiver {
            let index = tasks.iter().position(|other| std::ptr::eq(*other, task)).unwrap_or(0);
            waiting.insert(index, made);
            while let Some(made) = waiting.remove(&printed) {
                if !matches!(made, Err(Failure::Interrupted)) {
                    progress.suspend(|| done(tasks[printed], made));
                }
                printed += 1;
                progress.step();
            }
        }
    });
    progress.finish();
    if stop.load(Ordering::Relaxed) { Err(Failure::Interrupted) } else { Ok(()) }
}

/// What a process made, or why it failed; its messages and findings are passed on.
fn succeeded(task: &Task<'_>, made: Result<Output, Failure>) -> Result<Result<Output, ErrorReport>, Failure> {
    let made = made?;
    if !made.messages.is_empty() {
        terminal::always(&format!("{}\n", made.messages));
    }
    let findings = Vec::<Finding>::deserialize(&made.report["diagnostics"]).unwrap_or_default();
    findings.into_iter().for_each(session::found);
    if made.is_ok {
        return Ok(Ok(made));
    }
    // The process has printed it already.
    terminal::always(&format!("{}: not made\n", task.job.output));
    let error = ErrorReport::deserialize(&made.report["error"]).unwrap_or_else(|_| ErrorReport {
        code: Code::Build,
        message: "the process ended early".to_owned(),
        help: None,
        place: None,
    });
    session::failed(ErrorReport { code: Code::Build, ..error.clone() });
    Ok(Err(error))
}

/// Writes an output.
fn put(task: &Task<'_>, made: &Output, lock: &mut Lock) -> Result<BuiltOutput, Failure> {
    let file = &task.job.output;
    if let Some(folder) = Path::new(file).parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder)
            .map_err(|error| Failure::writing(error, &folder.display().to_string()))?;
    }
    output::write(file, |out| out.write_all(&made.bytes))?;
    let reason = task.reason.clone().unwrap_or_else(|| "forced".to_owned());
    let what = facts(&made.report).map_or_else(String::new, |facts| format!(": {facts}"));
    terminal::say(&format!("{file}{what} ({reason})\n"));
    lock.output.insert(file.clone(), Made { sha256: import::sha256(&made.bytes), ..task.made.clone() });
    Ok(BuiltOutput {
        file: file.clone(),
        state: BuiltState::Built,
        reason: Some(reason),
        ..BuiltOutput::up_to_date(file)
    })
}

/// Duration and ink of a plan, by its report.
fn facts(report: &serde_json::Value) -> Option<String> {
    let ink = |value: &serde_json::Value| value["ink_mm"].as_f64().map(text::length);
    if let Some(time) = report["summary"]["duration_s"].as_f64() {
        let ink = ink(&report["certificate"]).map_or_else(String::new, |ink| format!(", {ink} of ink"));
        return Some(format!("{}{ink}", text::duration(time)));
    }
    ink(&report["outputs"][0]["drawing"]).map(|ink| format!("{ink} of ink"))
}

/// Compares an output with what would be made, in words.
fn compare(task: &Task<'_>, made: &Output) -> BuiltOutput {
    let file = &task.job.output;
    let differs = |reason: Option<String>, changes| BuiltOutput {
        state: BuiltState::Differs,
        reason,
        changes,
        ..BuiltOutput::up_to_date(file)
    };
    let Ok(found) = std::fs::read(file) else {
        terminal::always(&format!("{file}: is not there\n"));
        return differs(Some("is not there".to_owned()), None);
    };
    if found == made.bytes {
        return BuiltOutput::up_to_date(file);
    }
    let input = |bytes: Vec<u8>| Input { name: file.clone(), path: file.clone(), bytes };
    let machine = task.job.machine();
    let changes = diff::sides(&input(found.clone()), &input(made.bytes.clone()), machine)
        .map(|(old, new)| DiffReport::of(&Diff::of(old, new, None)))
        .filter(|report| !report.same);
    let words = changes.as_ref().map_or_else(|| first_difference(&found, &made.bytes), DiffReport::line);
    let why = task.reason.as_ref().map_or_else(String::new, |reason| format!(" ({reason})"));
    terminal::always(&format!("{file}: {words}{why}\n"));
    differs(task.reason.clone(), changes)
}

/// Where two files begin to differ.
fn first_difference(old: &[u8], new: &[u8]) -> String {
    let same = old.iter().zip(new).take_while(|(a, b)| a == b).count();
    let line = old[..same].split(|byte| *byte == b'\n').count();
    format!("differs from line {line}, byte {same}, on")
}
