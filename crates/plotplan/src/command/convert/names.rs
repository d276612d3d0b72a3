//! Names of output files: folders and patterns.

use std::path::Path;

use crate::cli::{Convert, Format, PageChoice};

/// What one output file holds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part<'a> {
    /// The drawing's name.
    pub(super) drawing: &'a str,
    /// Number of the page, from 1.
    pub(super) page: usize,
    /// The pen, where there is a file for each.
    pub(super) pen: Option<u16>,
}

/// How output files are named.
#[derive(Clone, Debug)]
pub(super) struct Names {
    pattern: String,
    /// `%p` is the page; else the pen.
    pages: bool,
    pens: bool,
}

impl Names {
    /// The names that the options ask for, for files of this format.
    pub(super) fn of(arguments: &Convert, format: Format) -> Self {
        let output = &arguments.output;
        let pages = arguments.reading.page() == PageChoice::All;
        let pens = arguments.split.is_some();
        let mut pattern = output.clone();
        if is_folder(output) {
            let page = if pages { "-%p" } else { "" };
            let pen = if pens { "-pen%n" } else { "" };
            let folder = output.trim_end_matches(std::path::is_separator);
            pattern = format!("{folder}/%f{page}{pen}.{}", format.name());
        }
        Self { pattern, pages, pens }
    }

    /// Whether every drawing has its own output.
    pub(super) fn is_one_per_drawing(&self) -> bool {
        self.pattern.contains("%f")
    }

    /// The folder that the files are written to, where they have one.
    pub(super) fn folder(&self) -> Option<&Path> {
        Path::new(&self.pattern).parent().filter(|folder| !folder.as_os_str().is_empty())
    }

    /// The name of a file.
    pub(super) fn file(&self, part: Part<'_>) -> String {
        let stem =
            Path::new(part.drawing).file_stem().map_or("drawing".into(), |stem| stem.to_string_lossy());
        let pen = part.pen.map_or_else(String::new, |pen| pen.to_string());
        let page = if self.pens && !self.pages { pen.clone() } else { part.page.to_string() };
        self.pattern.replace("%p", &page).replace("%n", &pen).replace("%f", &stem)
    }

    /// Why several parts of a drawing cannot have names of their own.
    pub(super) fn lacks(&self) -> String {
        let (option, sign) = match (self.pages, self.pens) {
            (true, true) => ("--page all with --split pens", "%p for the page and %n for the pen"),
            (true, false) => ("--page all", "%p for the page"),
            _ => ("--split pens", "%p for the pen"),
        };
        format!("{option} writes several files: give --output a name with {sign}, such as out-%p.ticks")
    }
}

/// Whether an output is a folder: it exists as one, or ends with a separator.
fn is_folder(output: &str) -> bool {
    output.ends_with(std::path::is_separator) || Path::new(output).is_dir()
}
