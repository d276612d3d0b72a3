//! Errors of machine files.

use std::fmt;

use kinematics::MachineError;
use kinematics::mechanism::ParameterError;

use super::nearest;
use crate::quantity::QuantityError;

/// Why a machine file makes no machine.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MachineFileError {
    /// Not TOML, a missing or unknown key, a value of the wrong type.
    #[error(transparent)]
    Syntax(SyntaxError),
    /// A quantity of the wrong kind.
    #[error("{key}")]
    Quantity {
        /// The key.
        key: String,
        /// The value and what is expected.
        source: QuantityError,
    },
    /// A parameter of the geometry cannot be read.
    #[error("geometry.{0}")]
    Geometry(ParameterError),
    /// The parts do not make a machine.
    #[error(transparent)]
    Machine(#[from] MachineError),
    /// A value of the drive that cannot be.
    #[error(transparent)]
    Drive(#[from] simulation::DriveError),
    /// The file contradicts itself.
    #[error("{0}")]
    Invalid(String),
}

/// A syntax error with its line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct SyntaxError {
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub help: Option<String>,
    /// Line number from 1, and the line; `None` where the whole file is meant.
    pub line: Option<(usize, String)>,
}

impl fmt::Display for SyntaxError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.line {
            None => write!(f, "{}", self.message)?,
            Some((number, text)) => {
                let gutter = " ".repeat(number.to_string().len());
                write!(f, "line {number}: {}\n{gutter} |\n{number} | {text}\n{gutter} |", self.message)?;
            }
        }
        match &self.help {
            Some(help) => write!(f, "\nhelp: {help}"),
            None => Ok(()),
        }
    }
}

impl SyntaxError {
    /// The error that `toml` reports for this text, at the key that causes it: for a table read as a
    /// map, `toml` points at the head of the table.
    pub(super) fn of(toml: &str, error: &toml::de::Error) -> Self {
        let start = error.span().map_or(0, |span| span.start.min(toml.len()));
        let (message, help, word) = explain(error.message(), key_at(toml, start));
        let at = word.and_then(|word| position_of(toml, start, &word)).unwrap_or(start);
        // A key missing from the file as a whole has no line.
        let line = (at > 0 || !message.ends_with("is missing")).then(|| {
            let number = toml[..at].matches('\n').count() + 1;
            (number, toml.lines().nth(number - 1).unwrap_or_default().to_owned())
        });
        Self { message, help, line }
    }
}

/// Message, help, and the key or value that the message is about.
fn explain(message: &str, key: &str) -> (String, Option<String>, Option<String>) {
    let quoted =
        |text: &str| -> Vec<String> { text.split('`').skip(1).step_by(2).map(ToOwned::to_owned).collect() };
    for (prefix, what) in [("unknown field ", "key"), ("unknown variant ", "value")] {
        if let Some(rest) = message.strip_prefix(prefix) {
            let names = quoted(rest);
            let Some((wrong, known)) = names.split_first() else { break };
            let list = known.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
            let help = match nearest(wrong, known.iter().map(String::as_str)) {
                Some(near) => format!("did you mean `{near}`? Known here: {list}"),
                None => format!("known here: {list}"),
            };
            return (format!("unknown {what} `{wrong}`"), Some(help), Some(wrong.clone()));
        }
    }
    if let Some(rest) = message.strip_prefix("missing field ") {
        let name = quoted(rest).into_iter().next().unwrap_or_default();
        return (format!("the key `{name}` is missing"), None, None);
    }
    let number = ["invalid type: integer ", "invalid type: floating point "]
        .iter()
        .find_map(|prefix| message.strip_prefix(prefix));
    if let Some(rest) = number.filter(|rest| rest.ends_with("expected a string")) {
        let value = quoted(rest).into_iter().next().unwrap_or_default();
        let help = format!("write the number with its unit as text, such as \"{value}{}\"", unit_of(key));
        return (format!("{value} has no unit"), Some(help), None);
    }
    if key == "matrix" {
        let help = "write the entries as numbers, such as [[1, 0], [0.5, 0.5]]".to_owned();
        return (message.to_owned(), Some(help), None);
    }
    (message.to_owned(), None, None)
}

/// The key of the line at a position.
fn key_at(toml: &str, at: usize) -> &str {
    let line_start = toml[..at].rfind('\n').map_or(0, |end| end + 1);
    let line = toml[line_start..].lines().next().unwrap_or_default();
    line.split_once('=').map_or("", |(key, _)| key.trim())
}

/// A unit that a key takes, as an example.
fn unit_of(key: &str) -> &'static str {
    match key {
        "counts" => "/rev",
        "max_speed" | "max_travel_speed" => "mm/s",
        "max_acceleration" => "mm/s2",
        "max_jerk" => "mm/s3",
        "lift_time" | "drop_time" | "period" => "ms",
        "theta" | "psi" | "phi" => "deg",
        _ => "mm",
    }
}

/// Where `word = ...` or `... = "word"` stands at or after `start`.
fn position_of(toml: &str, start: usize, word: &str) -> Option<usize> {
    let mut at = start;
    for line in toml[start..].split_inclusive('\n') {
        if let Some((key, value)) = line.split_once('=')
            && (key.trim() == word || value.trim_start().starts_with(&format!("\"{word}\"")))
        {
            return Some(at);
        }
        at += line.len();
    }
    None
}
