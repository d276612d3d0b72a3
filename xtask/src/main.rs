//! Chores of the repository; `cargo xtask` alone lists them.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "chores talk to whoever runs them")]
#![expect(clippy::disallowed_methods, reason = "chores look at the clock and at cargo's environment")]

use std::process::ExitCode;

mod bench;
mod corpus;
mod order;
mod peers;
mod tidy;

const USAGE: &str = "usage: cargo xtask COMMAND

  tidy          fail when a crate depends on one that it must not know, and on other untidiness
  corpus DIR    run the release binary over every drawing below DIR: no panic, no hang, no plan without a certificate
  peers [DIR …] read our drawings, and those below DIR, beside hp2xx (skipped where it is not installed): length and distance
  order DIR     plan every drawing below DIR in the file's order and in ours, on two machines: a table of times
  bench order GENERATOR
                order the drawings that the script GENERATOR makes (python3 with numpy), beside references
  bench read [GENERATOR]
                bytes to drawing: speed, growth and memory, beside hp2xx and a ceiling; of inputs that the script GENERATOR
                (python3) makes, or of our own
  bench plan [PYTHON]
                the planner's workload: duration, limits and speed, beside toppra where PYTHON (python3) has it";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let result = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["tidy"] => tidy::run(),
        ["corpus", folder] => corpus::run(folder.as_ref()),
        ["bench", "order", generator] => order::bench(generator.as_ref()),
        ["peers", ref folders @ ..] => peers::run(&folders.iter().map(Into::into).collect::<Vec<_>>()),
        ["order", folder] => order::real(folder.as_ref()),
        ["bench", "read"] => bench::read(None),
        ["bench", "read", generator] => bench::read(Some(generator.as_ref())),
        ["bench", "read-once", file] => bench::read_once(file.as_ref()),
        ["bench", "plan"] => bench::plan("python3"),
        ["bench", "plan", python] => bench::plan(python),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// The repository's top folder.
fn top() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}
