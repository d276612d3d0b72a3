//! Reading files and standard input, drawings and machines.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use compiler::import::{self, Document, Page, Severity};
use compiler::machine_file::{MachineFile, PRESETS, nearest};
use compiler::report::text;
use drawing::Drawing;
use kinematics::Machine;

use crate::cli;
use crate::failure::Failure;
use crate::terminal;

/// A file's bytes and what to call it.
pub(crate) struct Input {
    pub(crate) name: String,
    pub(crate) bytes: Vec<u8>,
}

/// Reads a file, or standard input for `-`.
pub(crate) fn read(file: &str) -> Result<Input, Failure> {
    if file == "-" {
        let mut bytes = Vec::new();
        std::io::stdin()
            .lock()
            .read_to_end(&mut bytes)
            .context("cannot read standard input")
            .map_err(Failure::Io)?;
        return Ok(Input { name: "standard input".into(), bytes });
    }
    let bytes = std::fs::read(file).with_context(|| format!("cannot read {file}")).map_err(Failure::Io)?;
    // Only the file's own name: a plan must not depend on where the drawing lies.
    let name = Path::new(file).file_name().map_or(file.into(), |name| name.to_string_lossy().into_owned());
    Ok(Input { name, bytes })
}

/// Why `--strict` refuses.
pub(crate) const STRICT: &str = "there are warnings, and --strict takes them for errors";

/// A drawing's file, read, and the page that was asked for.
pub(crate) struct LoadedDrawing {
    pub(crate) document: Document,
    page: usize,
}

impl LoadedDrawing {
    /// The page that was asked for.
    pub(crate) fn page(&self) -> &Page {
        &self.document.pages[self.page]
    }

    /// Its drawing.
    pub(crate) fn drawing(&self) -> &Drawing {
        &self.page().drawing
    }
}

/// Reads a drawing and prints its diagnostics. With `--strict` a warning stops here.
pub(crate) fn drawing(input: &Input, arguments: &cli::Reading) -> Result<LoadedDrawing, Failure> {
    let options = import::Options { plotter: arguments.plotter.clone(), paper: arguments.paper.clone() };
    let document = import::read(&input.bytes, &options).map_err(|error| Failure::Usage(error.into()))?;
    terminal::diagnostics(input, &document.diagnostics, arguments.message_format);
    let pages = document.pages.len();
    if arguments.page == 0 || arguments.page > pages {
        let have = text::pluralize(pages, "page");
        let what = format!("{} has {have}, not page {}", input.name, arguments.page);
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    }
    if arguments.strict && document.has(Severity::Warning) {
        terminal::error(STRICT);
        return Err(Failure::Refused);
    }
    Ok(LoadedDrawing { document, page: arguments.page - 1 })
}

/// A machine with the file it came from.
pub(crate) struct LoadedMachine {
    pub(crate) file: MachineFile,
    pub(crate) machine: Machine,
}

/// The machine that `--machine` names: a preset, or a machine file.
pub(crate) fn machine(name: &str) -> Result<LoadedMachine, Failure> {
    let toml = machine_toml(name)?;
    let wrong = || format!("machine {name} cannot be used");
    let file = MachineFile::parse(&toml).with_context(wrong).map_err(Failure::Usage)?;
    let machine = file.machine().with_context(wrong).map_err(Failure::Usage)?;
    Ok(LoadedMachine { file, machine })
}

/// Where the user's own machine files are: `plotplan/machines` in the configuration folder (`XDG_CONFIG_HOME` on Linux).
fn own_machines() -> Option<PathBuf> {
    use etcetera::BaseStrategy as _;
    Some(etcetera::choose_base_strategy().ok()?.config_dir().join("plotplan").join("machines"))
}

/// Names of the machines in the user's configuration folder, each with its file; in the order of their names.
pub(crate) fn own_machine_files() -> Vec<(String, PathBuf)> {
    let entries = own_machines().and_then(|folder| std::fs::read_dir(folder).ok());
    let paths = entries.into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
    let mut files: Vec<(String, PathBuf)> = paths
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .filter_map(|path| Some((path.file_stem()?.to_str()?.to_owned(), path)))
        .collect();
    files.sort();
    files
}

/// The text of the machine file that a name stands for: a file, one of the user's own machines, or a preset.
pub(crate) fn machine_toml(name: &str) -> Result<String, Failure> {
    if let Some((_, path)) = own_machine_files().into_iter().find(|(own, _)| own == name) {
        return std::fs::read_to_string(&path)
            .with_context(|| format!("cannot read the machine file {}", path.display()))
            .map_err(Failure::Io);
    }
    if let Some(preset) = PRESETS.iter().find(|preset| preset.name == name) {
        return Ok(preset.toml.to_owned());
    }
    let is_path = name.contains(['/', '\\']) || Path::new(name).extension().is_some_and(|e| e == "toml");
    if is_path || Path::new(name).is_file() {
        return std::fs::read_to_string(name)
            .with_context(|| format!("cannot read the machine file {name}"))
            .map_err(Failure::Io);
    }
    let own = own_machine_files();
    let names: Vec<&str> =
        PRESETS.iter().map(|preset| preset.name).chain(own.iter().map(|(name, _)| name.as_str())).collect();
    let hint = nearest(name, names.iter().copied())
        .map_or_else(|| format!("there are {}", names.join(", ")), |near| format!("did you mean {near}?"));
    Err(Failure::Usage(anyhow::anyhow!(
        "there is no machine called {name}: {hint} (or give a machine file, NAME.toml)"
    )))
}
