//! Outputs of a project.

use schemars::JsonSchema;
use serde::Serialize;

use super::{DiffReport, ErrorReport};

/// An output of `plotplan.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct BuiltOutput {
    /// The file, relative to the project.
    pub file: String,
    /// What became of it.
    pub state: BuiltState,
    /// Why it was out of date, in words.
    pub reason: Option<String>,
    /// With `--check`: how the file differs from what would be made; `null` where it cannot be compared
    /// stroke by stroke.
    pub changes: Option<DiffReport>,
    /// Why it could not be made.
    pub error: Option<ErrorReport>,
}

impl BuiltOutput {
    /// An output that is what the project makes.
    pub fn up_to_date(file: &str) -> Self {
        Self { file: file.to_owned(), state: BuiltState::UpToDate, reason: None, changes: None, error: None }
    }

    /// An output that could not be made.
    pub fn failed(file: &str, error: Option<ErrorReport>) -> Self {
        Self { state: BuiltState::Failed, error, ..Self::up_to_date(file) }
    }
}

/// What became of an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BuiltState {
    /// It was made.
    Built,
    /// It is what would be made.
    UpToDate,
    /// With `--check`: it is not what would be made, or not there.
    Differs,
    /// It could not be made.
    Failed,
}
