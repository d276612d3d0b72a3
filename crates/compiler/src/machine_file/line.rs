//! The line of a machine file that an error is about.

use std::ops::Range;

use kinematics::mechanism::ParameterError;
use kinematics::{Fault, MachineError};
use toml_edit::{Document, Item};

use super::MachineFileError;

impl MachineFileError {
    /// The line of the value that the error is about, from 1, in the text of the file; `None` where no
    /// single value is.
    pub fn line_in(&self, toml: &str) -> Option<usize> {
        if let Self::Syntax(error) = self {
            return error.line.as_ref().map(|(line, _)| *line);
        }
        let document = Document::parse(toml).ok()?;
        let span = span_of(document.as_item(), &self.key()?)?;
        Some(toml[..span.start].matches('\n').count() + 1)
    }

    /// The value's key: tables and keys with dots between, `KEY of motor NAME` for a motor's.
    fn key(&self) -> Option<String> {
        Some(match self {
            Self::Syntax(_) | Self::Drive(_) | Self::Invalid(_) => return None,
            Self::Quantity { key, .. } => key.clone(),
            Self::Geometry(
                ParameterError::Unreadable { key, .. } | ParameterError::NotAChoice { key, .. },
            ) => format!("geometry.{key}"),
            Self::Geometry(_) => "geometry".into(),
            Self::Machine(error) => match error {
                MachineError::Coupling(_) => "coupling.matrix".into(),
                MachineError::NotPositive { quantity, .. }
                | MachineError::OutOfRange { quantity, .. }
                | MachineError::NotFinite { quantity } => match &quantity.motor {
                    Some(_) => quantity.to_string(),
                    None => quantity.name.to_owned(),
                },
                MachineError::MinManipulability { .. } => "geometry.min_dexterity".into(),
                MachineError::EmptyJointRange { joint } => format!("joints.{joint}"),
                MachineError::EmptySheet => "sheet".into(),
                MachineError::DuplicateMotorName { name } => format!("name of motor {name}"),
                MachineError::Start { fault: Fault::JointLimit { joint, .. } } => format!("start.{joint}"),
                MachineError::Start { .. } => "start".into(),
                _ => return None,
            },
        })
    }
}

/// Where the value of a key stands.
fn span_of(document: &Item, key: &str) -> Option<Range<usize>> {
    if let Some((key, motor)) = key.split_once(" of motor ") {
        let motors = document.get("motor")?.as_array_of_tables()?;
        let mine = motors.iter().filter(|table| table.get("name").and_then(Item::as_str) == Some(motor));
        return mine.last()?.get(key)?.span();
    }
    let item = key.split('.').try_fold(document, |item, key| item.get(key));
    // A parameter of the geometry may be named without its table.
    let item = item.or_else(|| document.get("geometry")?.get(key));
    item.or_else(|| ["pen", "plan"].iter().find_map(|table| document.get(table)?.get(key)))?.span()
}

#[cfg(test)]
mod tests {
    use super::super::{MachineFile, PRESETS};

    #[test]
    fn lines_of_values_in_machine_files() {
        for (from, to) in [
            ("l1 = \"206mm\"", "l1 = \"206deg\""),
            ("l1 = \"206mm\"", "l1 = \"-206mm\""),
            ("counts = \"3200/rev\"", "counts = \"3200\""),
            ("max_acceleration = \"300deg/s2\"", "max_acceleration = \"300deg/s\""),
            ("max_acceleration = \"300deg/s2\"", "max_acceleration = \"0deg/s2\""),
            ("matrix = [[1, 0], [0, -1]]", "matrix = [[1, 1], [1, 1]]"),
            ("theta = \"90deg\"", "theta = \"400\""),
            ("lift_time = \"150ms\"", "lift_time = \"150\""),
        ] {
            let toml = PRESETS[0].toml.replacen(from, to, 1);
            let line = toml.lines().position(|line| line.contains(to)).expect("the line was changed") + 1;
            let error = MachineFile::parse(&toml).and_then(|file| file.machine()).expect_err(to);
            assert_eq!(error.line_in(&toml), Some(line), "{to}: {error}");
        }
    }
}
