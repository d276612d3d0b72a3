//! The site: pages of the repository, pages printed by the program, mdbook, and a check of every link.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, ensure};

use crate::programs::{commands, execute, has, text_of, write};

/// Pages outside of docs/.
const PAGES: &[&str] =
    &["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "firmware/README.md"];
/// The contents of the site.
pub(crate) const SUMMARY: &str = "packaging/site/SUMMARY.md";
/// Where files that are no pages are shown.
const REPOSITORY: &str = "https://github.com/plotplan/plotplan/blob/main/";

/// Builds the site below target/site with the pages that `program` prints, by default a build of the
/// `test` profile; returns whether every link leads somewhere.
pub(crate) fn run(program: Option<&str>) -> Result<bool> {
    ensure!(has("mdbook"), "the site needs mdbook (`cargo install mdbook --locked`)");
    let top = crate::top();
    let program = if let Some(program) = program {
        std::path::absolute(program)?
    } else {
        execute(Command::new("cargo").args(["build", "--locked", "-p", "plotplan"]))?;
        std::path::absolute(top.join("target/debug/plotplan"))?
    };
    let site = top.join("target/site");
    let _ = std::fs::remove_dir_all(&site);
    let source = site.join("source");
    stage(&top, &source)?;
    reference(&program, &source)?;
    let packaging = top.join("packaging/site");
    for name in ["book.toml", "site.css"] {
        write(&site.join(name), std::fs::read(packaging.join(name))?)?;
    }
    write(&source.join("SUMMARY.md"), std::fs::read(top.join(SUMMARY))?)?;
    execute(Command::new("mdbook").arg("build").arg(&site))?;
    check_links(&site.join("book"))
}

/// Copies the pages, and the files that they link to, to where they are in the repository, so that links
/// stay as they are. Links to folders and sources go to the repository.
fn stage(top: &Path, source: &Path) -> Result<()> {
    let mut pages: Vec<PathBuf> =
        PAGES.iter().map(PathBuf::from).filter(|page| top.join(page).is_file()).collect();
    for entry in std::fs::read_dir(top.join("docs"))? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "md") {
            pages.push(Path::new("docs").join(path.file_name().context("a name")?));
        }
    }
    for page in &pages {
        let text = std::fs::read_to_string(top.join(page)).with_context(|| format!("{}", page.display()))?;
        let mut staged = String::new();
        let mut rest = text.as_str();
        // In `[text](target)`, only the target changes.
        while let Some((before, after)) = rest.split_once("](") {
            let (target, after) = after
                .split_once(')')
                .with_context(|| format!("{}: a link without an end", page.display()))?;
            write!(staged, "{before}]({})", link(top, source, page, target, &pages)?)?;
            rest = after;
        }
        staged += rest;
        write(&source.join(page), staged)?;
    }
    Ok(())
}

/// The target of a link as it is on the site; pictures are copied.
fn link(top: &Path, source: &Path, page: &Path, target: &str, pages: &[PathBuf]) -> Result<String> {
    let (file, _) = target.split_once('#').unwrap_or((target, ""));
    if file.is_empty() || target.contains("://") {
        return Ok(target.to_owned());
    }
    let path = normal(&page.parent().unwrap_or(Path::new("")).join(file));
    let from = top.join(&path);
    ensure!(from.exists(), "{}: no file {target}", page.display());
    let is_picture = path.extension().is_some_and(|e| ["svg", "png", "gif"].iter().any(|known| e == *known));
    if is_picture {
        write(&source.join(&path), std::fs::read(&from)?)?;
    } else if !pages.contains(&path) {
        return Ok(format!("{REPOSITORY}{}", path.display()));
    }
    // mdbook makes the index of a folder of its README.
    Ok(target.replace("README.md", "index.md"))
}

/// Without `..` and `.`.
fn normal(path: &Path) -> PathBuf {
    let mut parts = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                parts.pop();
            }
            Component::CurDir => {}
            other => parts.push(other),
        }
    }
    parts
}

/// Pages that the program prints: options of every command, diagnostics, formats, machines.
fn reference(program: &Path, source: &Path) -> Result<()> {
    let printed = |words: &[&str]| text_of(Command::new(program).args(words).env("COLUMNS", "96"));
    let mut options = "# Commands and options\n\nPrinted by `plotplan COMMAND --help`.\n".to_owned();
    for command in commands(program)? {
        let words: Vec<&str> = command.split(' ').chain(["--help"]).collect();
        let help = printed(&words)?;
        write!(options, "\n## plotplan {command}\n\n```text\n{}\n```\n", help.trim_end())?;
    }
    write(&source.join("reference/options.md"), options)?;

    let codes = printed(&["explain", "codes"])?;
    let mut diagnostics =
        "# Diagnostics\n\nPrinted by `plotplan explain CODE`. `H` codes are about HP-GL, `S` codes \
                           about SVG; the others are messages of the program.\n"
            .to_owned();
    for code in codes.lines().filter_map(|line| line.split_whitespace().next()) {
        let text = printed(&["explain", code])?;
        let (title, body) = text.trim_end().split_once('\n').unwrap_or((text.trim_end(), ""));
        write!(diagnostics, "\n## {}\n\n{}\n", plain(title), plain(body.trim()))?;
    }
    write(&source.join("reference/diagnostics.md"), diagnostics)?;

    let mut machines =
        "# Presets\n\nPrinted by `plotplan machine list` and `plotplan machine show NAME`: every key \
                        of a machine file in use.\n"
            .to_owned();
    for line in printed(&["machine", "list"])?.lines() {
        let Some((name, about)) = line.split_once(' ') else { continue };
        let toml = printed(&["machine", "show", name])?;
        write!(machines, "\n## {name}\n\n{}\n\n```toml\n{}\n```\n", plain(about.trim()), toml.trim_end())?;
    }
    write(&source.join("reference/machines.md"), machines)
}

/// Text without the signs of markdown and HTML.
fn plain(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('*', "\\*").replace('_', "\\_")
}

/// Every relative `href` and `src` of the pages leads to a file, and every `#` to an element with that id.
fn check_links(book: &Path) -> Result<bool> {
    let mut pages: BTreeMap<PathBuf, String> = BTreeMap::new();
    collect(book, &mut pages)?;
    let ids: BTreeMap<&Path, BTreeSet<&str>> =
        pages.iter().map(|(path, text)| (path.as_path(), attributes(text, "id").collect())).collect();
    let (mut links, mut broken) = (0, 0);
    for (page, text) in &pages {
        // The page of errors has links that begin at the root of the server; the printed one repeats all.
        if page.ends_with("404.html") || page.ends_with("print.html") {
            continue;
        }
        for target in attributes(text, "href").chain(attributes(text, "src")) {
            if target.contains("://") || target.starts_with("data:") || target.starts_with("mailto:") {
                continue;
            }
            links += 1;
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let path = if file.is_empty() {
                page.clone()
            } else {
                normal(&page.parent().unwrap_or(book).join(file))
            };
            let found = match ids.get(path.as_path()) {
                Some(ids) => anchor.is_empty() || ids.contains(anchor),
                None => path.is_file(),
            };
            if !found {
                broken += 1;
                println!("{}: {target} leads nowhere", page.strip_prefix(book).unwrap_or(page).display());
            }
        }
    }
    println!("{} pages, {links} links, {broken} broken", pages.len());
    Ok(broken == 0)
}

fn collect(folder: &Path, pages: &mut BTreeMap<PathBuf, String>) -> Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, pages)?;
        } else if path.extension().is_some_and(|extension| extension == "html") {
            let text = std::fs::read_to_string(&path)?;
            pages.insert(normal(&path), text);
        }
    }
    Ok(())
}

/// The values of an attribute, in double quotes as mdbook writes them.
fn attributes<'a>(html: &'a str, name: &str) -> impl Iterator<Item = &'a str> {
    let start = format!(" {name}=\"");
    let places: Vec<usize> = html.match_indices(&start).map(|(at, found)| at + found.len()).collect();
    places.into_iter().filter_map(|at| html[at..].split('"').next())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_of_a_page() {
        let html = "<a class=\"x\" href=\"a.html#b\">c</a><img src=\"p.svg\" id=\"q\">";
        assert_eq!(attributes(html, "href").collect::<Vec<_>>(), ["a.html#b"]);
        assert_eq!(attributes(html, "id").collect::<Vec<_>>(), ["q"]);
    }

    #[test]
    fn link_to_a_missing_anchor_is_broken() {
        let folder = tempfile::tempdir().unwrap();
        let page =
            |links: &str| write(&folder.path().join("a.html"), format!("<p id=\"there\">{links}")).unwrap();
        page("<a href=\"a.html#there\">");
        assert!(check_links(folder.path()).unwrap());
        page("<a href=\"#gone\">");
        assert!(!check_links(folder.path()).unwrap());
        page("<img src=\"gone.svg\">");
        assert!(!check_links(folder.path()).unwrap());
    }

    #[test]
    fn paths_without_dots() {
        assert_eq!(normal(Path::new("docs/../examples/./a.svg")), Path::new("examples/a.svg"));
    }
}
