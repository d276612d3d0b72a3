//! `plotplan.lock`: what each output was made from, by content.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::job::Job;
use crate::failure::Failure;
use crate::output;

/// The usual name of a lock file.
pub(super) const NAME: &str = "plotplan.lock";
const VERSION: u32 = 1;
const HEAD: &str = "# What each output was made from, as SHA-256. Written by `plotplan build`; keep it under version control.\n";

/// The outputs of a project as they were last made.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Lock {
    version: u32,
    #[serde(default)]
    pub(super) output: BTreeMap<String, Made>,
}

/// What an output was made from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Made {
    /// SHA-256 of the output.
    pub(super) sha256: String,
    /// The program and its version.
    pub(super) program: String,
    /// The options of `convert`.
    pub(super) options: Vec<String>,
    /// SHA-256 of the machine file's text, also of a preset's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) machine: Option<String>,
    /// SHA-256 of each file that was read: drawings, fonts, plotters.
    pub(super) files: BTreeMap<String, String>,
}

impl Lock {
    /// The lock of a project; an empty one if there is none, or if it was written by another version.
    pub(super) fn read(path: &Path) -> Self {
        let empty = Self { version: VERSION, output: BTreeMap::new() };
        let text = std::fs::read_to_string(path).unwrap_or_default();
        toml::from_str(&text).ok().filter(|lock: &Self| lock.version == VERSION).unwrap_or(empty)
    }

    /// Writes the lock, if it differs from the file.
    pub(super) fn write(&self, path: &Path) -> Result<(), Failure> {
        let body = toml::to_string(self).map_err(|error| Failure::Io(error.into()))?;
        let text = format!("{HEAD}{body}");
        if std::fs::read_to_string(path).is_ok_and(|old| old == text) {
            return Ok(());
        }
        output::write(&path.display().to_string(), |out| out.write_all(text.as_bytes()))
    }

    /// Why an output is out of date; `None` if it is not. `made` is what it would be made from now, `found` the SHA-256
    /// of the file as it is.
    pub(super) fn out_of_date(&self, job: &Job, made: &Made, found: Option<&str>) -> Option<String> {
        let Some(found) = found else { return Some("new".to_owned()) };
        let Some(last) = self.output.get(&job.output) else { return Some("not in the lock".to_owned()) };
        let mut reasons = Vec::new();
        if last.program != made.program {
            reasons.push(format!("{} instead of {}", made.program, last.program));
        }
        for file in made.files.keys().filter(|file| last.files.get(*file) != made.files.get(*file)) {
            reasons.push(format!("{file} changed"));
        }
        let gone = last.files.keys().filter(|file| !made.files.contains_key(*file));
        reasons.extend(gone.map(|file| format!("without {file}")));
        if last.machine != made.machine {
            reasons.push("the machine changed".to_owned());
        }
        let added = made.options.iter().filter(|option| !last.options.contains(option));
        reasons.extend(added.map(|option| format!("with {option}")));
        let gone = last.options.iter().filter(|option| !made.options.contains(option));
        reasons.extend(gone.map(|option| format!("without {option}")));
        if reasons.is_empty() && last.sha256 != found {
            reasons.push("the output was changed by hand".to_owned());
        }
        (!reasons.is_empty()).then(|| reasons.join(", "))
    }
}
