//! Several drawings, each with an output of its own, on all cores.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

use compiler::report::{Code, ErrorReport};

use super::names::{Names, Part};
use super::{Job, Written};
use crate::failure::Failure;
use crate::input::{self, Inputs};
use crate::{session, terminal};

/// Converts each file. The others are written even if one fails; then the command fails.
pub(super) fn run(job: &Job<'_>, names: &Names) -> Result<(), Failure> {
    let files = &job.arguments.files;
    check_names(files, names, job)?;
    if let Some(folder) = names.folder() {
        std::fs::create_dir_all(folder)
            .map_err(|error| Failure::writing(error, &folder.display().to_string()))?;
    }
    // Outputs replace none of the inputs, also of those that are read later.
    for file in files {
        input::remember(Path::new(file));
    }
    let next = AtomicUsize::new(0);
    let (sender, receiver) = mpsc::channel();
    let workers = std::thread::available_parallelism().map_or(1, usize::from).min(files.len());
    let mut converted = 0;
    std::thread::scope(|scope| {
        for _ in 0..workers {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(file) = files.get(index) else { return };
                    let result = terminal::captured(|| convert(job, file, names));
                    if sender.send((index, result)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        // In the order of the files, whichever is done first.
        let mut waiting = BTreeMap::new();
        let mut printed = 0;
        for (index, result) in receiver {
            waiting.insert(index, result);
            while let Some((is_written, text)) = waiting.remove(&printed) {
                terminal::always(&text);
                converted += usize::from(is_written);
                printed += 1;
            }
        }
    });
    terminal::say(&format!("{converted} of {} drawings converted\n", files.len()));
    if converted == files.len() {
        return Ok(());
    }
    let message = format!("{} of {} drawings were not converted", files.len() - converted, files.len());
    session::failed(ErrorReport { code: Code::Drawing, message, help: None, place: None });
    Err(Failure::Refused)
}

/// Converts one file, and prints a line about it. Whether it was written.
fn convert(job: &Job<'_>, file: &str, names: &Names) -> bool {
    session::next_drawing();
    let result =
        Inputs::read(&[file.to_owned()]).and_then(|inputs| super::convert_parts(job, &inputs, names));
    match result {
        Ok(written) => {
            for (output, Written { line, .. }) in written {
                terminal::say(&format!("{file} -> {output}: {line}\n"));
            }
            true
        }
        Err(failure) => {
            // Reported with its own code elsewhere; here the file's name comes first.
            failure.describe(file);
            terminal::always(&format!("{file}: not converted\n"));
            false
        }
    }
}

/// Refuses files whose outputs would have the same name.
fn check_names(files: &[String], names: &Names, job: &Job<'_>) -> Result<(), Failure> {
    let mut seen: BTreeMap<String, &String> = BTreeMap::new();
    let pen = job.arguments.split.map(|_| 1);
    for file in files {
        let output = names.file(Part { drawing: file, page: 1, pen });
        if let Some(other) = seen.insert(output.clone(), file) {
            let what = format!("{other} and {file} would both be written to {output}");
            return Err(Failure::Usage(anyhow::anyhow!(what)));
        }
    }
    Ok(())
}
