//! Machines by name: presets, the user's own, machine files.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use compiler::machine_file::{MachineFile, MachineFileError, PRESETS, nearest};
use compiler::paper;
use compiler::report::{ListedMachine, MachineSource};
use kinematics::Machine;

use crate::failure::Failure;
use crate::{cli, input};

/// A machine with the file it came from.
pub(crate) struct LoadedMachine {
    pub(crate) file: MachineFile,
    pub(crate) machine: Machine,
}

/// A machine that cannot be used, as the context of the reason.
#[derive(Clone, Debug, thiserror::Error)]
#[error("machine {name} cannot be used{}", line.map(|line| format!(": line {line}")).unwrap_or_default())]
pub(crate) struct Unusable {
    /// Its name or file, as given.
    pub(crate) name: String,
    /// The line of the file, where the reason does not give it.
    pub(crate) line: Option<usize>,
}

impl Unusable {
    /// The failure of a machine file for this reason.
    fn because(name: &str, toml: &str, error: MachineFileError) -> Failure {
        let line = match &error {
            MachineFileError::Syntax(_) => None,
            other => other.line_in(toml),
        };
        Failure::Usage(anyhow::Error::new(error).context(Self { name: name.to_owned(), line }))
    }
}

/// The machine that `--machine` names: a preset, or a machine file.
pub(crate) fn machine(name: &str) -> Result<LoadedMachine, Failure> {
    let toml = machine_toml(name)?;
    let wrong = |error| Unusable::because(name, &toml, error);
    let file = MachineFile::parse(&toml).map_err(wrong)?;
    let machine = file.machine().map_err(wrong)?;
    Ok(LoadedMachine { file, machine })
}

/// The machine that `--machine` names, with the sheet that `--paper` names.
pub(crate) fn machine_with_paper(name: &str, reading: &cli::Reading) -> Result<LoadedMachine, Failure> {
    with_paper(machine(name)?, reading)
}

/// The machine with the sheet that `--paper` names.
pub(crate) fn with_paper(machine: LoadedMachine, reading: &cli::Reading) -> Result<LoadedMachine, Failure> {
    let LoadedMachine { file, mut machine } = machine;
    if let Some(paper) = reading.paper.as_ref().filter(|_| reading.plotter.is_none()) {
        let [width_mm, height_mm] =
            paper::size_mm(paper).map_err(|what| Failure::Usage(anyhow::anyhow!("--paper: {what}")))?;
        machine = machine
            .with_sheet_size(width_mm, height_mm)
            .with_context(|| format!("--paper {paper}"))
            .map_err(Failure::Usage)?;
    }
    Ok(LoadedMachine { file, machine })
}

/// All machines that can be named: the presets, then the user's own.
pub(crate) fn listed() -> Vec<ListedMachine> {
    let own = own_machine_files();
    let hidden = |name: &str| own.iter().any(|(own, _)| own == name);
    let presets = PRESETS.iter().filter(|preset| !hidden(preset.name)).map(|preset| ListedMachine {
        name: preset.name.to_owned(),
        source: MachineSource::Preset,
        about: preset.about.to_owned(),
        error: None,
        hides_preset: false,
    });
    let mut all: Vec<ListedMachine> = presets.collect();
    all.extend(own.iter().map(|(name, path)| ListedMachine {
        name: name.clone(),
        source: MachineSource::Own,
        about: path.display().to_string(),
        error: unusable(path),
        hides_preset: PRESETS.iter().any(|preset| preset.name == name),
    }));
    all
}

/// Why a machine file cannot be used.
fn unusable(path: &Path) -> Option<String> {
    let toml = match text(path) {
        Ok(toml) => toml,
        Err(error) => return Some(error.to_string()),
    };
    let machine = MachineFile::parse(&toml).and_then(|file| file.machine());
    machine.err().map(|error| format!("{:#}", anyhow::Error::new(error)))
}

fn text(path: &Path) -> std::io::Result<String> {
    String::from_utf8(input::read_file(path)?)
        .map_err(|_| std::io::Error::new(std::io::ErrorKind::InvalidData, "it is not text"))
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

/// The text of the machine file that a name stands for: a file in the user's folder, a preset, a
/// machine in the user's folder whose file has another name, or a path.
pub(crate) fn machine_toml(name: &str) -> Result<String, Failure> {
    if let Some((_, path)) = own_machine_files().into_iter().find(|(own, _)| own == name) {
        return text(&path)
            .with_context(|| format!("cannot read the machine file {}", path.display()))
            .map_err(Failure::Io);
    }
    if let Some(preset) = PRESETS.iter().find(|preset| preset.name == name) {
        return Ok(preset.toml.to_owned());
    }
    let is_path = name.contains(['/', '\\']) || Path::new(name).extension().is_some_and(|e| e == "toml");
    if is_path || Path::new(name).is_file() {
        return text(Path::new(name))
            .with_context(|| format!("cannot read the machine file {name}"))
            .map_err(Failure::Io);
    }
    let own = own_machine_files();
    // A plan carries the machine's own name, which need not be the file's.
    let named = own.iter().filter_map(|(_, path)| text(path).ok()).find(|toml| {
        MachineFile::parse(toml).and_then(|file| file.machine()).is_ok_and(|machine| machine.name() == name)
    });
    if let Some(toml) = named {
        return Ok(toml);
    }
    let names: Vec<&str> =
        PRESETS.iter().map(|preset| preset.name).chain(own.iter().map(|(name, _)| name.as_str())).collect();
    let hint = nearest(name, names.iter().copied())
        .map_or_else(|| format!("there are {}", names.join(", ")), |near| format!("did you mean {near}?"));
    Err(Failure::Usage(anyhow::anyhow!(
        "there is no machine called {name}: {hint} (for a machine of your own: --machine FILE.toml)"
    )))
}
