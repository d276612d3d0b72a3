//! `cargo xtask inkscape`: the SVG importer against Inkscape's own HP-GL export, by the length of
//! the ink.
//!
//! The export draws the outline of every visible shape and leaves text out, so our side reads with
//! the outlines of fills and without a font. Where the two draw different things, `peers.toml` names
//! causes. A cause is an edit of the file that makes the difference fall away: a style sheet that
//! overrides everything else, elements to remove, attributes of the root. With all edits of a file
//! both are measured again, and must agree.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context as _, Result};
use usvg::roxmltree;

use crate::peers::{NOTES, length, polylines, runs};
use crate::svg_peers::drawings;

/// Relative difference in length that needs a note.
const ALIKE: f64 = 0.01;
/// Steps of the export per inch: 0.0025 mm.
const STEPS_PER_INCH: f64 = 10_160.0;
/// Flatness of curves in steps of 0.025 mm, as the export counts it: fine, and where that takes
/// longer than the limit, coarse.
const FLATNESS: [f64; 2] = [0.1, 2.5];
const LIMIT: Duration = Duration::from_secs(400);
const EXTENSIONS: &str = "/usr/share/inkscape/extensions";

/// Why the two draw different things, and the edit after which they draw the same.
#[derive(Clone, Debug, Default)]
struct Cause {
    why: String,
    /// Rules for all elements.
    style: String,
    /// Elements to leave out.
    remove: Vec<String>,
    /// Attributes of the root, as `name="value"`.
    root: String,
}

/// Compares every SVG file of a folder; true if all lengths agree, or agree without their causes.
pub(crate) fn run(folder: &Path) -> Result<bool> {
    let work = tempfile::tempdir()?;
    let Some(python) = python() else {
        println!("skipped: Inkscape's extensions with python3-lxml and python3-numpy are not installed");
        return Ok(true);
    };
    let causes = causes()?;
    println!("{:<34} {:>11} {:>11} {:>9}  without", "drawing", "ours, mm", "theirs, mm", "length");
    let mut alike = true;
    for file in drawings(folder)? {
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let text = text(&file)?;
        let mut row = Row::measure(&text, &python, work.path())?;
        println!("{name:<34} {row}");
        let causes = causes.get(&name).map_or(&[][..], Vec::as_slice);
        if row.is_alike() {
            continue;
        }
        for (_, cause) in causes {
            println!("    {}", cause.why);
        }
        if !causes.is_empty() {
            let (names, all): (Vec<_>, Vec<_>) = causes.iter().cloned().unzip();
            row = Row::measure(&edited(&text, &all)?, &python, work.path())?;
            println!("{:<34} {row}  {}", "", names.join(", "));
        }
        if !row.is_alike() {
            println!("    NO CAUSE in peers.toml");
            alike = false;
        }
    }
    Ok(alike)
}

/// Lengths of one file.
#[derive(Clone, Copy, Debug)]
struct Row {
    ours_mm: f64,
    /// `None` where the export fails or takes too long.
    theirs_mm: Option<f64>,
    is_coarse: bool,
}

impl Row {
    fn measure(text: &str, python: &Path, work: &Path) -> Result<Self> {
        let options = svg::Options { outline_fills: true, ..svg::Options::default() };
        let ours_mm = svg::read(text.as_bytes(), &options).drawing.length();
        for flatness in FLATNESS {
            if let Some(theirs_mm) = export(text, flatness, python, work)? {
                return Ok(Self { ours_mm, theirs_mm: Some(theirs_mm), is_coarse: flatness > FLATNESS[0] });
            }
        }
        Ok(Self { ours_mm, theirs_mm: None, is_coarse: false })
    }

    fn is_alike(&self) -> bool {
        self.theirs_mm.is_some_and(|theirs| (self.ours_mm - theirs).abs() <= ALIKE * theirs)
    }
}

impl std::fmt::Display for Row {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Some(theirs) = self.theirs_mm else {
            return write!(out, "{:>11.1} {:>11} {:>9}", self.ours_mm, "none", "");
        };
        let part = if theirs > 0.0 { 100.0 * (self.ours_mm / theirs - 1.0) } else { 0.0 };
        let coarse = if self.is_coarse { "  coarse" } else { "" };
        write!(out, "{:>11.1} {theirs:>11.1} {part:>8.3}%{coarse}", self.ours_mm)
    }
}

/// Length of the export at a flatness, mm; 0 where it finds no paths, `None` where it takes too long.
fn export(text: &str, flatness: f64, python: &Path, work: &Path) -> Result<Option<f64>> {
    let (input, output) = (work.join("drawing.svg"), work.join("drawing.hpgl"));
    std::fs::write(&input, text)?;
    let _ = std::fs::remove_file(&output);
    let mut command = Command::new(python);
    command.arg(Path::new(EXTENSIONS).join("hpgl_output.py"));
    command.args([format!("--resolutionX={STEPS_PER_INCH}"), format!("--resolutionY={STEPS_PER_INCH}")]);
    command.args([format!("--flat={flatness}"), "--overcut=0".into(), "--toolOffset=0".into()]);
    command.arg("--precut=false").arg(format!("--output={}", output.display())).arg(&input);
    let began = std::time::Instant::now();
    let done = runs(&mut command, LIMIT)?;
    let hpgl = std::fs::read_to_string(&output).unwrap_or_default();
    if !done {
        return Ok((began.elapsed() < LIMIT).then_some(0.0));
    }
    Ok(Some(length(&polylines(&hpgl, 25.4 / STEPS_PER_INCH))))
}

/// A Python that runs Inkscape's extensions.
fn python() -> Option<PathBuf> {
    let imports = format!("import sys; sys.path.insert(0, '{EXTENSIONS}'); import inkex, hpgl_encoder");
    ["/usr/bin/python3", "python3"].into_iter().map(PathBuf::from).find(|python| {
        let mut command = Command::new(python);
        runs(command.args(["-c", &imports]), Duration::from_secs(60)).unwrap_or(false)
    })
}

/// The text of an SVG file, plain or compressed.
fn text(file: &Path) -> Result<String> {
    let mut bytes = Vec::new();
    std::fs::File::open(file)?.read_to_end(&mut bytes)?;
    if bytes.starts_with(&[0x1f, 0x8b]) {
        bytes = usvg::decompress_svgz(&bytes).context("the compression is damaged")?;
    }
    String::from_utf8(bytes).with_context(|| format!("{} is not UTF-8", file.display()))
}

/// The text with the edits of all causes.
fn edited(text: &str, causes: &[Cause]) -> Result<String> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() };
    let tree = roxmltree::Document::parse_with_options(text, options)?;
    let root = tree.root_element();
    // Places that are replaced, in the order of the text.
    let mut edits: Vec<(std::ops::Range<usize>, String)> = Vec::new();
    let styles = causes.iter().map(|cause| &cause.style[..]).filter(|style| !style.is_empty());
    let style = styles.collect::<Vec<_>>().join(";");
    for cause in causes.iter().filter(|cause| !cause.root.is_empty()) {
        let (name, _) = cause.root.split_once('=').context("peers.toml: root = 'name=\"value\"'")?;
        let attribute = root.attributes().find(|attribute| attribute.name() == name);
        let attribute = attribute.with_context(|| format!("the root has no {name}"))?;
        edits.push((attribute.range(), cause.root.clone()));
    }
    for node in root.descendants().filter(roxmltree::Node::is_element) {
        let is_removed = causes.iter().any(|cause| cause.remove.iter().any(|n| n == node.tag_name().name()));
        if is_removed && edits.last().is_none_or(|(last, _)| last.end <= node.range().start) {
            edits.push((node.range(), String::new()));
        }
    }
    let end = text[..root.range().end].rfind("</").context("the root is empty")?;
    edits.push((end..end, format!("<style xmlns=\"http://www.w3.org/2000/svg\">*{{{style}}}</style>")));
    edits.sort_by_key(|(range, _)| range.start);
    let (mut result, mut at) = (String::with_capacity(text.len()), 0);
    for (range, new) in edits {
        result.push_str(&text[at..range.start]);
        result.push_str(&new);
        at = range.end;
    }
    result.push_str(&text[at..]);
    Ok(result)
}

/// The causes of every file with their names, by the file's name without extension.
fn causes() -> Result<BTreeMap<String, Vec<(String, Cause)>>> {
    let table: toml::Table = NOTES.parse().context("peers.toml")?;
    let part = |name: &str| {
        let part = table.get("inkscape").and_then(|part| part.get(name)?.as_table());
        part.with_context(|| format!("peers.toml: no inkscape.{name}"))
    };
    let (known, files) = (part("cause")?, part("files")?);
    let cause = |name: &toml::Value| -> Result<(String, Cause)> {
        let name = name.as_str().context("peers.toml: the name of a cause is text")?;
        let found = known.get(name).with_context(|| format!("peers.toml: no cause {name}"))?;
        let word = |key: &str| found.get(key).and_then(|value| value.as_str()).unwrap_or("").to_owned();
        let list = found.get("remove").and_then(|list| list.as_array()).into_iter().flatten();
        let remove = list.filter_map(|value| Some(value.as_str()?.to_owned())).collect();
        let cause = Cause { why: word("why"), style: word("style"), remove, root: word("root") };
        Ok((name.to_owned(), cause))
    };
    let of_file = |(file, names): (&String, &toml::Value)| {
        let names = names.as_array().with_context(|| format!("peers.toml: {file} has no list"))?;
        Ok((file.clone(), names.iter().map(cause).collect::<Result<_>>()?))
    };
    files.iter().map(of_file).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_has_a_reason_and_an_edit() {
        for (file, causes) in causes().unwrap() {
            assert!(!causes.is_empty(), "{file}");
            for (name, Cause { why, style, remove, root }) in causes {
                assert!(!why.is_empty(), "{name}");
                assert!(!(style.is_empty() && remove.is_empty() && root.is_empty()), "{name}");
            }
        }
    }

    #[test]
    fn edits_leave_the_rest_of_the_file() {
        let cause = |style: &str, remove: &[&str], root: &str| Cause {
            why: String::new(),
            style: style.into(),
            remove: remove.iter().map(|&name| name.into()).collect(),
            root: root.into(),
        };
        let text = "<svg width='9'><image><g/><image/></image><g/><image/></svg>";
        let causes = [cause("", &["image"], ""), cause("marker:none", &[], "width=\"5\"")];
        let style = "<style xmlns=\"http://www.w3.org/2000/svg\">*{marker:none}</style>";
        assert_eq!(edited(text, &causes).unwrap(), format!("<svg width=\"5\"><g/>{style}</svg>"));
    }
}
