//! The command line.

use std::process::ExitCode;

mod cli;
mod command;
mod failure;
mod input;
mod output;
mod port;
#[cfg(unix)]
mod pseudo_terminal;
mod terminal;

fn main() -> ExitCode {
    use clap::Parser as _;
    let arguments = cli::Arguments::parse();
    match command::run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
