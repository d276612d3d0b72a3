//! The command line.

use std::process::ExitCode;

use clap::ValueEnum as _;
use compiler::report::{Code, ErrorReport};

use crate::failure::Failure;

mod cli;
mod command;
mod failure;
mod fonts;
mod input;
mod keys;
mod machines;
mod options;
mod output;
mod port;
#[cfg(unix)]
mod pseudo_terminal;
mod session;
mod terminal;
mod wire;

fn main() -> ExitCode {
    use clap::{CommandFactory as _, FromArgMatches as _};
    let mut command = cli::Arguments::command();
    if let Some(color) = early(&["--color"]).and_then(|color| cli::Color::from_str(&color, true).ok()) {
        // Errors of the command line are printed before its options are known.
        session::set_color(color);
        command = command.color(match color {
            cli::Color::Auto => clap::ColorChoice::Auto,
            cli::Color::Always => clap::ColorChoice::Always,
            cli::Color::Never => clap::ColorChoice::Never,
        });
    }
    let parsed = command
        .try_get_matches_from(cli::with_ink_color(std::env::args_os()))
        .and_then(|matches| Ok((cli::Arguments::from_arg_matches(&matches)?, matches)));
    let (mut arguments, matches) = match parsed {
        Ok(parsed) => parsed,
        Err(error) => return wrong_arguments(&error),
    };
    arguments.settle();
    session::begin(&arguments.messages, arguments.command.name());
    options::remember(&matches);
    let result = match options::without_effect(&matches) {
        Some(what) => Err(Failure::Usage(anyhow::anyhow!(what))),
        None => command::run(&arguments, &cli::plan_options(&matches)),
    };
    failure::finish(result)
}

/// The value of an option on a command line that could not be parsed, in either spelling.
fn early(names: &[&str]) -> Option<String> {
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if argument == "--" {
            return None;
        }
        if names.contains(&argument.as_str()) {
            return arguments.next();
        }
        if let Some((name, value)) = argument.split_once('=')
            && names.contains(&name)
        {
            return Some(value.to_owned());
        }
    }
    None
}

/// Prints help, version, or what is wrong with the command line.
fn wrong_arguments(error: &clap::Error) -> ExitCode {
    let _ = error.print();
    if !error.use_stderr() {
        return ExitCode::SUCCESS;
    }
    if early(&["--report"]).is_some_and(|form| form == "json") {
        let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
        let command = match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            ["machine", second, ..] => format!("machine {second}"),
            [first, ..] => first.to_owned(),
            [] => String::new(),
        };
        let messages = cli::Messages {
            report: cli::ReportForm::Json,
            message_format: cli::MessageFormat::Human,
            quiet: false,
            all: false,
            color: cli::Color::Auto,
        };
        session::begin(&messages, &command);
        let text = error.to_string();
        let message = text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
        session::failed(ErrorReport { code: Code::Usage, message, help: None, place: None });
        failure::write_report(2);
    }
    ExitCode::from(2)
}
