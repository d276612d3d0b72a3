//! Why a job cannot be done, for the page to show at the right place.

use std::fmt;

use serde::Serialize;

/// What a problem is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum About {
    /// The machine file.
    Machine,
    /// The drawing's file.
    Drawing,
    /// An option.
    Option,
    /// The drawing on this machine.
    Plan,
}

/// A problem.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Problem {
    /// What it is about.
    pub about: About,
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub help: Option<String>,
    /// Line of the machine file, from 1.
    pub line: Option<usize>,
    /// Name of the option, as on the command line.
    pub option: Option<&'static str>,
    /// Byte range of the drawing's file.
    pub bytes: Option<[usize; 2]>,
    /// The place, machine mm.
    pub at_mm: Option<[f64; 2]>,
}

impl Problem {
    /// A problem without a place.
    pub fn new(about: About, message: impl Into<String>) -> Self {
        let message = message.into();
        Self { about, message, help: None, line: None, option: None, bytes: None, at_mm: None }
    }

    /// With a remedy.
    #[must_use]
    pub fn with_help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }
}

/// All problems that stop a job, as an error.
#[derive(Clone, Debug, PartialEq)]
pub struct Problems(pub Vec<Problem>);

impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let messages: Vec<&str> = self.0.iter().map(|problem| problem.message.as_str()).collect();
        f.write_str(&messages.join("; "))
    }
}

impl std::error::Error for Problems {}

impl From<Problem> for Problems {
    fn from(problem: Problem) -> Self {
        Self(vec![problem])
    }
}
