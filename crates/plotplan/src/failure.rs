//! Failures of a command, with their exit codes.

use std::process::ExitCode;

use compiler::import::ImportError;
use compiler::machine_file::MachineFileError;
use compiler::report::{Code, ErrorReport, Place};
use planner::PlanError;

use crate::{cli, machines, session, terminal};

/// Why a command stops.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The failure was reported with [`terminal::error`] or [`terminal::error_at`]; exit by its code.
    Refused,
    /// The drawing or plan cannot be used: exit 1.
    Drawing(anyhow::Error),
    /// The command line or a machine file is wrong: exit 2.
    Usage(anyhow::Error),
    /// Reading or writing failed: exit 3.
    Io(anyhow::Error),
    /// Interrupted by the user: exit 130, by shell convention. Already reported.
    Interrupted,
    /// Standard output was closed (EPIPE): quiet, exit 0.
    ClosedPipe,
}

impl Failure {
    /// A failure to write to `to`.
    pub(crate) fn writing(error: std::io::Error, to: &str) -> Self {
        if error.kind() == std::io::ErrorKind::BrokenPipe {
            Self::ClosedPipe
        } else {
            let folder = std::path::Path::new(to).parent().filter(|folder| !folder.as_os_str().is_empty());
            let what = match folder {
                Some(folder) if error.kind() == std::io::ErrorKind::NotFound && !folder.exists() => {
                    return Self::Io(anyhow::anyhow!(
                        "cannot write {to}: there is no folder {}",
                        folder.display()
                    ));
                }
                _ => format!("cannot write {to}"),
            };
            // An error that the system did not number has Rust's own words, such as "entity not found".
            if error.raw_os_error().is_none() && error.kind() == std::io::ErrorKind::NotFound {
                return Self::Io(anyhow::anyhow!("{what}: the folder does not take files"));
            }
            Self::Io(anyhow::Error::new(error).context(what))
        }
    }

    /// Reports the failure of one of several outputs, which does not end the command; `None` if it was
    /// reported before.
    pub(crate) fn describe(self, name: &str) -> Option<ErrorReport> {
        let (code, error) = match self {
            Self::ClosedPipe | Self::Refused | Self::Interrupted => return None,
            Self::Drawing(error) => (kind_of(&error).unwrap_or(Code::Drawing), error),
            Self::Usage(error) => (usage_kind(&error), error),
            Self::Io(error) => (Code::Io, error),
        };
        let text = format!("{error:#}");
        let is_named = text.contains(name) || name.ends_with(text.split(':').next().unwrap_or(""));
        let message = if is_named { text } else { format!("{name}: {text}") };
        terminal::error_of_one(code, &message);
        Some(ErrorReport { code, message, help: None, place: place_of(&error) })
    }

    /// Prints and records the failure, unless that was done already; returns the exit code.
    fn report(self) -> u8 {
        let (code, error) = match self {
            Self::ClosedPipe => return 0,
            Self::Refused => return session::failure().map_or(1, Code::exit_code),
            Self::Interrupted => {
                let message = "interrupted".to_owned();
                session::failed(ErrorReport { code: Code::Interrupted, message, help: None, place: None });
                return 130;
            }
            Self::Drawing(error) => (kind_of(&error).unwrap_or(Code::Drawing), error),
            Self::Usage(error) => (usage_kind(&error), error),
            Self::Io(error) => (Code::Io, error),
        };
        terminal::error_at(code, &format!("{error:#}"), place_of(&error));
        code.exit_code()
    }
}

/// Ends the program: prints the failure and the report.
pub(crate) fn finish(result: Result<(), Failure>) -> ExitCode {
    let code = match result {
        Ok(()) => 0,
        Err(Failure::ClosedPipe) => return ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    };
    if session::is_json() {
        write_report(code);
    }
    ExitCode::from(code)
}

/// Writes the report as a line of JSON.
pub(crate) fn write_report(exit_code: u8) {
    let Some((command, line)) = session::end(exit_code) else { return };
    if cli::reports_on_stdout(&command) {
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout(), "{line}");
    } else {
        terminal::always(&format!("{line}\n"));
    }
}

/// The kind of a failure of a drawing or plan, by its cause.
fn kind_of(error: &anyhow::Error) -> Option<Code> {
    error.chain().find_map(|cause| {
        if let Some(error) = cause.downcast_ref::<PlanError>() {
            return Some(match error {
                PlanError::OutOfReach { .. } | PlanError::NoTravel { .. } => Code::OutOfReach,
                PlanError::NoInk => Code::NoInk,
                PlanError::NoPlacement { .. } => Code::NoPlacement,
                PlanError::TooManyRows { .. } => Code::TooLong,
                PlanError::Setting { .. } => Code::Usage,
            });
        }
        if cause.is::<ImportError>() {
            return Some(Code::Foreign);
        }
        if cause.is::<plan::file::ReadError>() {
            return Some(Code::NotAPlan);
        }
        let is_format = cause.is::<backends::WriteError>()
            || cause.is::<backends::ProgramError>()
            || cause.is::<backends::Unrepresentable>();
        is_format.then_some(Code::Format)
    })
}

/// Whether the command line or the machine file is wrong.
fn usage_kind(error: &anyhow::Error) -> Code {
    if error.chain().any(<dyn std::error::Error>::is::<MachineFileError>) {
        Code::MachineFile
    } else {
        Code::Usage
    }
}

/// The line of a machine file that a message is about.
fn place_of(all: &anyhow::Error) -> Option<Place> {
    let file = all.chain().find_map(|cause| cause.downcast_ref::<MachineFileError>())?;
    let line = match file {
        MachineFileError::Syntax(error) => error.line.as_ref().map(|(line, _)| *line),
        _ => all.downcast_ref::<machines::Unusable>().and_then(|unusable| unusable.line),
    };
    let file = error_name(all);
    line.map(|line| Place { file, line: Some(line), ..Place::default() })
}

/// The machine that cannot be used, as given.
fn error_name(error: &anyhow::Error) -> String {
    error.downcast_ref::<machines::Unusable>().map_or_else(String::new, |unusable| unusable.name.clone())
}
