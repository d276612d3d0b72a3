//! The studio as static files: the compiler as WebAssembly, the page, the viewer's modules.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, ensure};

/// The target of the compiler in the page.
const TARGET: &str = "wasm32-unknown-unknown";

/// Folders of the page: where they are in the repository and in the studio, and which files they give.
const FOLDERS: &[(&str, &str, &[&str])] = &[
    ("studio/web", "", &["css"]),
    ("studio/web/js", "js", &["js"]),
    ("viewer", "viewer", &["css"]),
    ("viewer/js", "viewer/js", &["js"]),
    ("viewer/vendor/uplot", "viewer/vendor/uplot", &["js", "css"]),
];

/// Builds the studio into `target/studio`, and prints how to use it.
pub(crate) fn run() -> Result<bool> {
    let folder = build()?;
    let size: u64 =
        files_below(&folder)?.iter().map(|file| file.metadata().map_or(0, |data| data.len())).sum();
    println!("the studio: target/studio, {:.1} MB; any static host can serve it", size as f64 / 1e6);
    println!("  plotplan studio --files target/studio");
    println!(
        "  PLOTPLAN_STUDIO=target/studio cargo build --release -p plotplan   # puts it into the program"
    );
    Ok(true)
}

/// Builds the studio; returns its folder. Files that are as they should be keep their time, so that Cargo
/// builds the program again only where the studio has changed.
pub(crate) fn build() -> Result<PathBuf> {
    let top = std::path::absolute(crate::top())?;
    crate::ci::add_target(TARGET)?;
    let mut cargo = Command::new("cargo");
    cargo.args(["build", "--locked", "--profile", "quick", "--target", TARGET, "-p", "plotplan-studio-wasm"]);
    let status = cargo.current_dir(&top).status().context("cannot run cargo")?;
    ensure!(status.success(), "cargo build for {TARGET}: {status}");
    let folder = top.join("target/studio");
    std::fs::create_dir_all(&folder).with_context(|| format!("{}", folder.display()))?;
    let mut made = BTreeSet::new();
    let mut make = |to: PathBuf, bytes: Vec<u8>| -> Result<()> {
        if std::fs::read(&to).ok().as_ref() != Some(&bytes) {
            crate::programs::write(&to, bytes)?;
        }
        made.insert(to);
        Ok(())
    };
    let read = |path: &Path| std::fs::read(path).with_context(|| format!("{}", path.display()));
    for (from, to, extensions) in FOLDERS {
        let to = folder.join(to);
        for entry in std::fs::read_dir(top.join(from)).with_context(|| (*from).to_owned())? {
            let path = entry?.path();
            let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
            if extensions.contains(&extension) {
                make(to.join(path.file_name().context("a file without a name")?), read(&path)?)?;
            }
        }
    }
    make(folder.join("examples/house.hpgl"), read(&top.join("examples/house.hpgl"))?)?;
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| top.join("target"), PathBuf::from);
    let wasm = target.join(TARGET).join("quick/studio_wasm.wasm");
    make(folder.join("studio.wasm"), read(&wasm)?)?;
    make(folder.join("index.html"), page(&top)?.into_bytes())?;
    for file in files_below(&folder)?.iter().filter(|file| !made.contains(*file)) {
        std::fs::remove_file(file).with_context(|| format!("{}", file.display()))?;
    }
    Ok(folder)
}

/// The page: the viewer's markup, with the setup after its header.
fn page(top: &Path) -> Result<String> {
    let read = |name: &str| std::fs::read_to_string(top.join(name)).with_context(|| name.to_owned());
    let (page, setup, viewer) =
        (read("studio/web/index.html")?, read("studio/web/setup.html")?, read("viewer/index.html")?);
    let (marker, header) = ("<!-- viewer -->\n", "</header>\n");
    ensure!(
        page.matches(marker).count() == 1 && viewer.matches(header).count() == 1,
        "the page has another form"
    );
    Ok(page.replace(marker, &viewer.replace(header, &format!("{header}{setup}"))))
}

/// All files below a folder.
fn files_below(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            files.extend(files_below(&path)?);
        } else {
            files.push(path);
        }
    }
    Ok(files)
}
