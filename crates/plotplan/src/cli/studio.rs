//! Options of the studio.

use clap::Args;

#[derive(Debug, Args)]
pub(crate) struct Studio {
    /// Port on 127.0.0.1; 0 for any. The page remembers its drawing by the port
    #[arg(long, value_name = "NUMBER", default_value_t = 7475)]
    pub(crate) port: u16,
    /// Print the address only, and open no browser
    #[arg(long)]
    pub(crate) no_open: bool,
    /// Serve the files of this folder, as `cargo xtask web` makes it, instead of those in the program
    #[arg(long, value_name = "FOLDER")]
    pub(crate) files: Option<String>,
}
