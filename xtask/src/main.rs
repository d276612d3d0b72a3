//! Development tasks of the repository; `cargo xtask` without arguments lists them.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "tasks print their results")]
#![expect(clippy::disallowed_methods, reason = "tasks measure time and read cargo's environment")]

use std::process::ExitCode;

mod bench;
mod bound;
mod ci;
mod corpus;
mod dist;
mod firmware;
mod fuzz;
mod inkscape;
mod order;
mod peers;
mod programs;
mod site;
mod svg_peers;
mod tidy;
mod trust;
mod web;
mod web_test;

const USAGE: &str = "usage: cargo xtask COMMAND

  ci [STEP …]   run every check that a change must pass, or only the steps named
  tidy          check the dependency rules between crates, and tracked files
  corpus DIR [--jerk]
                run the program on every drawing below DIR: no panic, no timeout, no plan without a
                certificate; --jerk: on three machines with limits of jerk
  firmware [NAME …]
                build the firmware, test it on the host and on an emulated ATmega328P; NAME selects
                checks by a part of their name
  peers [DIR …] compare the interpretation of our drawings, and those below DIR, with hp2xx
                (skipped if it is not installed): length and distance
  usvg DIR      compare the SVG importer with usvg on every SVG file in DIR: length and distance
  inkscape DIR  compare the SVG importer with Inkscape's HP-GL export on every SVG file in DIR: length,
                and again without the cause that peers.toml names (skipped if it is not installed)
  order DIR     plan every drawing below DIR in file order and in optimized order, on two machines
  web           build the studio's static files into target/studio
  web-test [PROGRAM] [--write]
                test animated previews, written by PROGRAM or a build of it, and the studio in a
                browser; installs Node.js, Chromium and npm packages if missing; --write makes new
                reference screenshots
  bound [PYTHON] [--all]
                the fastest motion within the tolerance for a set of strokes, with casadi, which is
                installed below target/; computes what the table of the planner's tests lacks
  dist [TARGET …] [--deb] [--wheel] [--studio FOLDER] [--program FILE]
                archives with checksums, man pages and completions below target/dist, for all targets or
                those named; the Debian package; the wheel; an archive of the studio's static files.
                FILE is packed as the program of this system instead of building it
  version [X.Y.Z]
                print the version of all crates, or set it
  site [PROGRAM]
                build the site from docs/ below target/site with mdbook, and check its links
  trust [CAMPAIGN …] [--seed N] [--percent P]
                the campaigns behind docs/trust.md, all or those named
  nightly [CAMPAIGN …] [--percent P] [--short]
                the same with a new seed; --short is one per cent of each
  bench order GENERATOR
                order the drawings of the script GENERATOR (python3 with numpy); compare with
                reference solutions
  bench read [GENERATOR]
                bytes to drawing: throughput, scaling and memory, compared with hp2xx; inputs from
                the script GENERATOR (python3) or built in
  bench rounding [DIR]
                ink of whole ticks along the path and of the nearest ticks, on the examples and the
                drawings in DIR: distances from the exact path, CPU time
  bench throughput [PROGRAM]
                CPU time of drawings of more than a megabyte by step, beside that of commit 5e26b6c or
                of PROGRAM
  bench large [PROGRAM]
                CPU time and memory of plans of 1, 10 and 100 MB of text by PROGRAM or the released
                program: half an hour
  bench place   what the search for the best place gains on the examples
  bench simulate
      speed of simulations and of a search of gains
  bench plan [PYTHON]
                the planner's workload: duration, limits and throughput, compared with toppra if
                PYTHON (python3) has it
";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let result = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["ci", ref steps @ ..] => ci::run_steps(steps),
        ["tidy"] => tidy::run(),
        ["dist", ref words @ ..] => dist::run(words),
        ["version"] => dist::print_version(),
        ["version", version] => dist::set_version(version),
        ["site"] => site::run(None),
        ["site", program] => site::run(Some(program)),
        ["trust", "--needs"] => trust::needs(),
        ["trust", ref words @ ..] => trust::run(words),
        ["nightly", ref words @ ..] => trust::nightly(words),
        ["web"] => web::run(),
        ["corpus", folder] => corpus::run(folder.as_ref(), false),
        ["corpus", folder, "--jerk"] => corpus::run(folder.as_ref(), true),
        ["bound"] => bound::run("python3", false),
        ["bound", "--all"] => bound::run("python3", true),
        ["bound", python] => bound::run(python, false),
        ["bound", python, "--all"] => bound::run(python, true),
        ["bench", "order", generator] => order::bench(generator.as_ref()),
        ["firmware", ref filters @ ..] => firmware::run(filters),
        ["peers", ref folders @ ..] => peers::run(&folders.iter().map(Into::into).collect::<Vec<_>>()),
        ["usvg", folder] => svg_peers::run(folder.as_ref()),
        ["inkscape", folder] => inkscape::run(folder.as_ref()),
        ["web-test"] => web_test::run(None, false),
        ["web-test", "--write"] => web_test::run(None, true),
        ["web-test", program] => web_test::run(Some(program), false),
        ["web-test", program, "--write"] => web_test::run(Some(program), true),
        ["order", folder] => order::real(folder.as_ref()),
        ["bench", "read"] => bench::read(None),
        ["bench", "read", generator] => bench::read(Some(generator.as_ref())),
        ["bench", "read-once", file] => bench::read_once(file.as_ref()),
        ["bench", "rounding"] => bench::rounding(None),
        ["bench", "rounding", folder] => bench::rounding(Some(folder.as_ref())),
        ["bench", "throughput"] => bench::throughput(None),
        ["bench", "throughput", program] => bench::throughput(Some(program.as_ref())),
        ["bench", "large"] => bench::large(None),
        ["bench", "large", program] => bench::large(Some(program.as_ref())),
        ["bench", "place"] => bench::place(),
        ["bench", "simulate"] => bench::simulate(),
        ["bench", "plan"] => bench::plan("python3"),
        ["bench", "plan", python] => bench::plan(python),
        _ => {
            eprintln!("{USAGE}\nsteps of ci:\n{}\ncampaigns of trust:\n{}", ci::list(), trust::list());
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

/// The top folder of the repository.
fn top() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}
