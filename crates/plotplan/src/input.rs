//! Input files and standard input, and drawings read from them.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::Path;
use std::sync::Mutex;

use anyhow::Context as _;
use compiler::import::{self, Document, ImportError, Page, Severity};
use compiler::layout::{self, Crop};
use compiler::pipeline::Target;
use compiler::report::{Code, ErrorReport, Place, text};
use drawing::{Drawing, Span};

use crate::cli::{self, PageChoice};
use crate::failure::Failure;
use crate::{fonts, session, terminal};

/// A file's bytes and what to call it.
#[derive(Clone)]
pub(crate) struct Input {
    /// Its base name: a plan must not depend on the folder of the drawing.
    pub(crate) name: String,
    /// The path as given, for messages and reports.
    pub(crate) path: String,
    pub(crate) bytes: Vec<u8>,
}

/// What tells files apart, also through links.
#[cfg(unix)]
type FileId = (u64, u64);
#[cfg(not(unix))]
type FileId = std::path::PathBuf;

/// Device and inode: an open handle for each of many files would use up the process's limit.
#[cfg(unix)]
fn file_id(path: &Path) -> Option<FileId> {
    use std::os::unix::fs::MetadataExt as _;
    std::fs::metadata(path).ok().map(|metadata| (metadata.dev(), metadata.ino()))
}

#[cfg(not(unix))]
fn file_id(path: &Path) -> Option<FileId> {
    std::fs::canonicalize(path).ok()
}

/// Input files with their names: an output never replaces one of them.
static INPUTS: Mutex<BTreeMap<FileId, String>> = Mutex::new(BTreeMap::new());

/// Reads a file's bytes, and remembers the file as an input.
pub(crate) fn read_file(path: &Path) -> std::io::Result<Vec<u8>> {
    let bytes = std::fs::read(path)?;
    remember(path);
    Ok(bytes)
}

/// Remembers a file as an input.
pub(crate) fn remember(path: &Path) {
    if let (Some(id), Ok(mut inputs)) = (file_id(path), INPUTS.lock()) {
        inputs.entry(id).or_insert_with(|| path.display().to_string());
    }
}

/// The input that lies in the same file as `output`, also through links.
pub(crate) fn same_as(output: &Path) -> Option<String> {
    INPUTS.lock().ok()?.get(&file_id(output)?).cloned()
}

/// Reads a file, or standard input for `-`.
pub(crate) fn read(file: &str) -> Result<Input, Failure> {
    session::report(|report| report.inputs.push(file.to_owned()));
    if file == "-" {
        let mut bytes = Vec::new();
        std::io::stdin()
            .lock()
            .read_to_end(&mut bytes)
            .context("cannot read standard input")
            .map_err(Failure::Io)?;
        return Ok(Input { name: "standard input".into(), path: "standard input".into(), bytes });
    }
    let bytes =
        read_file(Path::new(file)).with_context(|| format!("cannot read {file}")).map_err(Failure::Io)?;
    let name = Path::new(file).file_name().map_or(file.into(), |name| name.to_string_lossy().into_owned());
    Ok(Input { name, path: file.to_owned(), bytes })
}

/// The files of a drawing, one or several that are drawn over each other.
#[derive(Clone)]
pub(crate) struct Inputs(Vec<Input>);

impl Inputs {
    /// Reads the files.
    pub(crate) fn read(files: &[String]) -> Result<Self, Failure> {
        if files.iter().filter(|file| *file == "-").count() > 1 {
            return Err(Failure::Usage(anyhow::anyhow!("standard input can be read once only")));
        }
        files.iter().map(|file| read(file)).collect::<Result<_, _>>().map(Self)
    }

    /// One file.
    pub(crate) fn of(input: Input) -> Self {
        Self(vec![input])
    }

    /// The first file.
    pub(crate) fn first(&self) -> &Input {
        &self.0[0]
    }

    /// The only file; `None` for several.
    pub(crate) fn single(&self) -> Option<&Input> {
        if let [input] = &self.0[..] { Some(input) } else { None }
    }

    /// All files, in their order.
    pub(crate) fn all(&self) -> &[Input] {
        &self.0
    }

    /// What to call the drawing: the files' names.
    pub(crate) fn name(&self) -> String {
        let names: Vec<&str> = self.0.iter().map(|input| &*input.name).collect();
        names.join(" + ")
    }

    /// The files' paths as given, for messages.
    pub(crate) fn path(&self) -> String {
        let paths: Vec<&str> = self.0.iter().map(|input| &*input.path).collect();
        paths.join(" + ")
    }

    /// SHA-256 of the files' bytes, one after the other.
    pub(crate) fn sha256(&self) -> String {
        match &self.0[..] {
            [input] => import::sha256(&input.bytes),
            all => import::sha256(&all.iter().flat_map(|input| &input.bytes).copied().collect::<Vec<u8>>()),
        }
    }

    /// The file in which a span of the whole drawing lies, and the span there.
    pub(crate) fn locate(&self, span: Span) -> (&Input, Span) {
        let mut offset = 0;
        for input in &self.0[..self.0.len() - 1] {
            if span.start < offset + input.bytes.len() {
                return (input, Span { start: span.start - offset, end: span.end - offset });
            }
            offset += input.bytes.len();
        }
        let last = &self.0[self.0.len() - 1];
        (last, Span { start: span.start.saturating_sub(offset), end: span.end.saturating_sub(offset) })
    }
}

/// A drawing's file, read, and the page that was asked for.
pub(crate) struct LoadedDrawing {
    pub(crate) document: Document,
    page: usize,
}

impl LoadedDrawing {
    /// The page that was asked for; the first one where all are.
    pub(crate) fn page(&self) -> &Page {
        &self.document.pages[self.page]
    }

    /// Cuts all pages where they lie, at a window of the drawing's own frame.
    pub(crate) fn crop(&mut self, crop: Option<Crop>) {
        let plane = Target::Plane.sheet();
        for page in &mut self.document.pages {
            page.drawing = layout::cropped(std::mem::take(&mut page.drawing), crop, plane);
        }
    }

    /// Its drawing.
    pub(crate) fn drawing(&self) -> &Drawing {
        &self.page().drawing
    }
}

/// Reads a drawing and prints its diagnostics. With `--strict` a warning stops here.
pub(crate) fn drawing(input: &Input, arguments: &cli::Reading) -> Result<LoadedDrawing, Failure> {
    let options = arguments.options(fonts::of(arguments)?);
    let mut loaded = load(input, arguments, &options)?;
    let layout = arguments.layout.to_layout();
    for page in &mut loaded.document.pages {
        layout.apply_pens(page);
        layout.apply_copies(&mut page.drawing);
    }
    Ok(loaded)
}

/// Reads drawings, lays them over each other and prints their diagnostics. Options of one format
/// apply to the files of that format.
pub(crate) fn drawings(inputs: &Inputs, arguments: &cli::Reading) -> Result<LoadedDrawing, Failure> {
    if let Some(input) = inputs.single() {
        return drawing(input, arguments);
    }
    if arguments.page() == PageChoice::All {
        let what = "--page all takes one drawing, or a folder as --output";
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    }
    let layout = arguments.layout.to_layout();
    let options = arguments.options(fonts::of(arguments)?);
    let formats: Vec<&str> = inputs.0.iter().map(|input| import::format(&input.bytes)).collect();
    let mut parts = Vec::new();
    for (input, format) in inputs.0.iter().zip(&formats) {
        let mut loaded = load(input, arguments, &options.for_format(format, &formats))?;
        let page = loaded.document.pages.swap_remove(loaded.page);
        parts.push(layout::Part { page, length: input.bytes.len(), format });
    }
    let is_one = formats.iter().all(|format| *format == formats[0]);
    let format = if is_one { formats[0] } else { "several formats" };
    let (page, conflicts) = layout::compose(parts, &layout);
    for conflict in conflicts {
        terminal::warning(Code::PenColors, &conflict.text(&inputs.0[conflict.page].path));
    }
    let size = format!("{} files", inputs.0.len());
    let document = Document { format, pages: vec![page], diagnostics: Vec::new(), size, facts: Vec::new() };
    Ok(LoadedDrawing { document, page: 0 })
}

/// Reads one file as it is, and prints its diagnostics.
fn load(
    input: &Input,
    arguments: &cli::Reading,
    options: &import::Options,
) -> Result<LoadedDrawing, Failure> {
    if plan::file::is_plan(&input.bytes) {
        terminal::error(Code::Foreign, &format!("{} is a plan, not a drawing", input.path));
        return Err(Failure::Refused);
    }
    if input.bytes.iter().all(u8::is_ascii_whitespace) {
        let what = if input.bytes.is_empty() { "is empty" } else { "holds blanks and line ends only" };
        terminal::error(Code::NoInk, &format!("{} {what}", input.path));
        return Err(Failure::Refused);
    }
    let document = import::read(&input.bytes, options).map_err(|error| match error {
        ImportError::Foreign { .. } => {
            Failure::Drawing(anyhow::Error::new(error).context(input.path.clone()))
        }
        _ => Failure::Usage(error.into()),
    })?;
    terminal::diagnostics(input, &document.diagnostics);
    let pages = document.pages.len();
    let page = match arguments.page() {
        PageChoice::All => 1,
        PageChoice::Number(number) => number,
    };
    if page == 0 || page > pages {
        let have = text::pluralize(pages, "page");
        let what = format!("{} has {have}, not page {page}", input.path);
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    }
    check_pens(input, &document, arguments)?;
    refuse_warnings(arguments.strict)?;
    Ok(LoadedDrawing { document, page: page - 1 })
}

/// Stops here if the reader reported an error, or the file draws nothing.
pub(crate) fn refuse_unusable(name: &str, document: &Document) -> Result<(), Failure> {
    if let Some(found) = document.diagnostics.iter().find(|found| found.severity == Severity::Error) {
        let place = Place {
            file: name.to_owned(),
            byte: Some(found.span.start),
            end: Some(found.span.end),
            line: found.line_column.map(|[line, _]| line),
            ..Place::default()
        };
        let (message, help) = (format!("{}: {}", found.code, found.message), found.help.clone());
        session::failed(ErrorReport { code: Code::Drawing, message, help, place: Some(place) });
        return Err(Failure::Refused);
    }
    if document.pages.iter().all(|page| page.drawing.is_empty()) {
        let size = &document.size;
        terminal::error(Code::NoInk, &format!("{name} draws nothing: no ink in its {size}"));
        return Err(Failure::Refused);
    }
    Ok(())
}

/// Stops here because of a warning, if that is asked for.
pub(crate) fn refuse_warnings(strict: bool) -> Result<(), Failure> {
    if strict && session::has_warning() {
        terminal::error(Code::Strict, "stopping because of warnings (--strict)");
        return Err(Failure::Refused);
    }
    Ok(())
}

/// Stops if the drawing cannot be used. Warns that one of several pages is taken, unless it was asked for.
pub(crate) fn use_page(
    inputs: &Inputs,
    drawn: &LoadedDrawing,
    arguments: &cli::Reading,
) -> Result<(), Failure> {
    refuse_unusable(&inputs.path(), &drawn.document)?;
    let pages = drawn.document.pages.len();
    let asked = match arguments.page {
        None => None,
        Some(PageChoice::Number(page)) => Some(page),
        Some(PageChoice::All) => return refuse_warnings(arguments.strict),
    };
    if let Some(what) = layout::several_pages(&inputs.path(), pages, asked) {
        match asked {
            None => terminal::warning(Code::SeveralPages, &what),
            Some(_) => terminal::note(Code::SeveralPages, &what),
        }
    }
    refuse_warnings(arguments.strict)
}

/// Reports pens of `--only-pens` and `--pen-map` that the drawing does not have. Refuses a selection
/// that leaves nothing.
fn check_pens(input: &Input, document: &Document, arguments: &cli::Reading) -> Result<(), Failure> {
    let pens = layout::pens_of(&document.pages);
    let missing = arguments.layout.to_layout().check_pens(&input.path, &pens);
    if let Some(what) = missing.map_err(|what| Failure::Drawing(anyhow::anyhow!(what)))? {
        terminal::warning(Code::PenMissing, &what);
    }
    Ok(())
}
