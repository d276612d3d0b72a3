//! Input files and standard input, and drawings read from them.

use std::io::Read as _;
use std::path::Path;
use std::sync::Mutex;

use anyhow::Context as _;
use compiler::import::{self, Document, ImportError, Page, Severity};
use compiler::report::text;
use drawing::Drawing;

use crate::cli;
use crate::failure::Failure;
use crate::terminal;

/// A file's bytes and what to call it.
pub(crate) struct Input {
    pub(crate) name: String,
    pub(crate) bytes: Vec<u8>,
}

/// Files read so far: an output never replaces one of them.
static READ: Mutex<Vec<(String, same_file::Handle)>> = Mutex::new(Vec::new());

/// Reads a file's bytes, and remembers the file as an input.
pub(crate) fn read_file(path: &Path) -> std::io::Result<Vec<u8>> {
    let bytes = std::fs::read(path)?;
    if let (Ok(handle), Ok(mut read)) = (same_file::Handle::from_path(path), READ.lock()) {
        read.push((path.display().to_string(), handle));
    }
    Ok(bytes)
}

/// The input that lies in the same file as `output`, by device and inode, also through links.
pub(crate) fn same_as(output: &Path) -> Option<String> {
    let handle = same_file::Handle::from_path(output).ok()?;
    let read = READ.lock().ok()?;
    read.iter().find(|(_, input)| *input == handle).map(|(name, _)| name.clone())
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
    let bytes =
        read_file(Path::new(file)).with_context(|| format!("cannot read {file}")).map_err(Failure::Io)?;
    // The base name only: a plan must not depend on the folder of the drawing.
    let name = Path::new(file).file_name().map_or(file.into(), |name| name.to_string_lossy().into_owned());
    Ok(Input { name, bytes })
}

/// Why `--strict` refuses.
pub(crate) const STRICT: &str = "stopping because of warnings (--strict)";

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
    if plan::file::is_plan(&input.bytes) {
        let what = format!("{} is a plan, not a drawing", input.name);
        return Err(Failure::Drawing(anyhow::anyhow!(what)));
    }
    let options = arguments.options();
    let document = import::read(&input.bytes, &options).map_err(|error| match error {
        ImportError::Foreign { .. } => {
            Failure::Drawing(anyhow::Error::new(error).context(input.name.clone()))
        }
        _ => Failure::Usage(error.into()),
    })?;
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
