//! Puts the commit into `plotplan --version`, where there is one to be known, and the studio's files into
//! the program: those below the folder that `PLOTPLAN_STUDIO` names, as `cargo xtask web` makes it. Without
//! the variable the program has no studio of its own.

#![allow(clippy::disallowed_methods, reason = "cargo speaks to build scripts through the environment")]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

fn main() -> std::io::Result<()> {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=PLOTPLAN_COMMIT");
    let version = std::env::var("CARGO_PKG_VERSION").unwrap_or_default();
    // Whoever builds from an archive can say the commit; a checkout that is not ours must not.
    let ours = Path::new("../../crates/plotplan/build.rs").exists();
    let commit = std::env::var("PLOTPLAN_COMMIT").ok().or_else(|| {
        let head = git(&["rev-parse", "--git-path", "logs/HEAD"]).filter(|_| ours)?;
        println!("cargo:rerun-if-changed={head}");
        git(&["rev-parse", "--short=10", "HEAD"])
    });
    let version = commit.map_or(version.clone(), |commit| format!("{version} ({commit})"));
    println!("cargo:rustc-env=PLOTPLAN_VERSION={version}");
    studio()
}

/// Writes the list of the studio's files.
fn studio() -> std::io::Result<()> {
    println!("cargo:rerun-if-env-changed=PLOTPLAN_STUDIO");
    let mut list = String::new();
    if let Some(folder) = std::env::var_os("PLOTPLAN_STUDIO").filter(|folder| !folder.is_empty()) {
        // Relative to the top of the repository, not to this crate.
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder).canonicalize()?;
        assert!(
            folder.join("index.html").is_file(),
            "PLOTPLAN_STUDIO: no index.html in {}",
            folder.display()
        );
        add(&folder, "", &mut list)?;
    }
    let out = PathBuf::from(std::env::var_os("OUT_DIR").unwrap_or_default());
    std::fs::write(out.join("studio.rs"), format!("&[{list}]"))
}

/// Adds the files below a folder: their path in the studio, and their bytes.
fn add(folder: &Path, prefix: &str, list: &mut String) -> std::io::Result<()> {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    paths.sort();
    println!("cargo:rerun-if-changed={}", folder.display());
    for path in paths {
        let name = format!("{prefix}{}", path.file_name().unwrap_or_default().to_string_lossy());
        if path.is_dir() {
            add(&path, &format!("{name}/"), list)?;
        } else {
            println!("cargo:rerun-if-changed={}", path.display());
            let _ = writeln!(list, "({name:?}, include_bytes!({:?})),", path.display().to_string());
        }
    }
    Ok(())
}
