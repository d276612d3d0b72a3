//! Failures of a command, with their exit codes.

use std::process::ExitCode;

use crate::terminal;

/// Why a command stops.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The drawing cannot be planned, or a certificate does not hold: exit 1. Already reported.
    Refused,
    /// The drawing cannot be planned: exit 1.
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
    /// Reports the failure and returns the exit code.
    pub(crate) fn report(self) -> ExitCode {
        let (code, error) = match self {
            Self::ClosedPipe => return ExitCode::SUCCESS,
            Self::Refused => return ExitCode::from(1),
            Self::Interrupted => return ExitCode::from(130),
            Self::Drawing(error) => (1, error),
            Self::Usage(error) => (2, error),
            Self::Io(error) => (3, error),
        };
        terminal::error(&format!("{error:#}"));
        ExitCode::from(code)
    }

    /// Reports the failure of one of several outputs, which does not end the command.
    pub(crate) fn describe(self, name: &str) {
        match self {
            Self::ClosedPipe | Self::Refused | Self::Interrupted => {}
            Self::Drawing(error) | Self::Usage(error) | Self::Io(error) => {
                let text = format!("{error:#}");
                let is_named = text.contains(name) || name.ends_with(text.split(':').next().unwrap_or(""));
                terminal::error(&if is_named { text } else { format!("{name}: {text}") });
            }
        }
    }

    /// A failure to write to `to`.
    pub(crate) fn writing(error: std::io::Error, to: &str) -> Self {
        if error.kind() == std::io::ErrorKind::BrokenPipe {
            Self::ClosedPipe
        } else {
            Self::Io(anyhow::Error::new(error).context(format!("cannot write {to}")))
        }
    }
}
