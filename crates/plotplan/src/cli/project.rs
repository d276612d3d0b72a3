//! Options of projects and of differences.

use clap::Args;

use super::values::{distance, jobs};

#[expect(clippy::struct_excessive_bools, reason = "a flag of the command line is a bool")]
#[derive(Debug, Args)]
pub(crate) struct Build {
    /// Outputs to make [default: all of the project]
    #[arg(value_name = "OUTPUT")]
    pub(crate) outputs: Vec<String>,
    /// The project: a folder with a plotplan.toml, or that file
    #[arg(short, long, value_name = "FOLDER|FILE", default_value = ".")]
    pub(crate) project: String,
    /// Make all outputs in memory and compare; exit with 1 where a file differs, and print what changed
    #[arg(long, conflicts_with_all = ["watch", "list", "force"])]
    pub(crate) check: bool,
    /// Make outputs also where they are up to date
    #[arg(long, conflicts_with_all = ["list", "watch"])]
    pub(crate) force: bool,
    /// Make outputs again whenever a drawing, machine file or the project changes, until Ctrl-C
    #[arg(long, conflicts_with = "list")]
    pub(crate) watch: bool,
    /// Print the command line of each output, for a shell in the project's folder, and make nothing
    #[arg(long)]
    pub(crate) list: bool,
    /// Outputs made at the same time [default: number of cores]
    #[arg(short, long, value_name = "NUMBER", value_parser = jobs, conflicts_with = "list")]
    pub(crate) jobs: Option<usize>,
}

#[derive(Debug, Args)]
pub(crate) struct Init {
    /// The folder of the drawings
    #[arg(value_name = "FOLDER", default_value = ".")]
    pub(crate) folder: String,
    /// Machine of all plans [default: coaxial]
    #[arg(short, long, value_name = "NAME|FILE.toml")]
    pub(crate) machine: Option<String>,
}

#[derive(Debug, Args)]
pub(crate) struct Diff {
    /// The old plan, drawing or machine file; `-` for standard input
    #[arg(value_name = "OLD")]
    pub(crate) old: String,
    /// The new one
    #[arg(value_name = "NEW")]
    pub(crate) new: String,
    /// Show both: NAME.svg, NAME.png, or NAME.html with a switch for old, new and same
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: Option<String>,
    /// Machine of plans that do not hold their own
    #[arg(short, long, value_name = "NAME|FILE.toml")]
    pub(crate) machine: Option<String>,
    /// Distance within which strokes are the same [default: 0.01 mm; for plans tolerance and whole ticks]
    #[arg(long, value_name = "LENGTH", value_parser = distance)]
    pub(crate) within: Option<f64>,
    /// Exit with 1 if anything differs
    #[arg(long)]
    pub(crate) exit_code: bool,
    /// The same as --report json
    #[arg(long)]
    pub(crate) json: bool,
}
