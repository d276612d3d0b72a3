//! The command line.

use std::process::ExitCode;

mod cli;
mod command;
mod failure;
mod input;
mod keys;
mod machines;
mod options;
mod output;
mod port;
#[cfg(unix)]
mod pseudo_terminal;
mod terminal;
mod wire;

fn main() -> ExitCode {
    use clap::{CommandFactory as _, FromArgMatches as _};
    let matches = cli::Arguments::command().get_matches();
    let mut arguments = cli::Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    arguments.settle();
    if let Some(what) = options::without_effect(&matches) {
        return failure::Failure::Usage(anyhow::anyhow!(what)).report();
    }
    match command::run(&arguments, &cli::plan_options(&matches)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
