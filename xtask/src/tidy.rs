//! The walls of the house: who may know whom, read off the manifests.

use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, Result};

/// Which crates of the workspace each crate may depend on. What is not listed must not be known.
const MAY_KNOW: &[(&str, &[&str])] = &[
    ("drawing", &[]),
    ("plan", &[]),
    ("hpgl", &["drawing"]),
    ("ordering", &["drawing"]),
    ("kinematics", &["drawing"]),
    ("planner", &["drawing", "kinematics", "plan"]),
    ("verify", &["drawing", "kinematics", "plan"]),
    ("picture", &["drawing", "plan"]),
    ("backends", &["drawing", "kinematics", "plan"]),
    ("compiler", &["drawing", "hpgl", "kinematics", "ordering", "plan", "planner", "verify"]),
    (
        "plotplan",
        &[
            "backends",
            "compiler",
            "drawing",
            "hpgl",
            "kinematics",
            "ordering",
            "picture",
            "plan",
            "planner",
            "verify",
        ],
    ),
    ("xtask", &["drawing", "hpgl", "kinematics", "plan", "planner"]),
];

/// Outside crates that only some may use: the command line's, and formats' serialisation.
const RESERVED: &[(&str, &[&str])] = &[
    ("anyhow", &["plotplan", "xtask"]),
    ("clap", &["plotplan"]),
    ("serialport", &["plotplan"]),
    ("indicatif", &["plotplan"]),
    ("toml", &["compiler", "xtask"]),
    ("serde", &["backends", "compiler", "plan", "plotplan"]),
    ("serde_json", &["backends", "compiler", "plan", "plotplan", "xtask"]),
];

/// Paths of a machine have no business in the repository.
const MACHINE_PATHS: &[&str] = &["/work/", "/root/", "/tmp/target"];

/// Files beyond this many lines want a second look.
const LONG: usize = 800;

/// Prints what is untidy; true if nothing is.
pub(crate) fn run() -> Result<bool> {
    let top = crate::top();
    let mut complaints = Vec::new();
    let mut manifests = vec![top.join("xtask/Cargo.toml")];
    for entry in std::fs::read_dir(top.join("crates")).context("no folder crates")? {
        manifests.push(entry?.path().join("Cargo.toml"));
    }
    manifests.sort();
    for manifest in &manifests {
        let text = std::fs::read_to_string(manifest).with_context(|| format!("{}", manifest.display()))?;
        complaints.extend(forbidden(&text).with_context(|| format!("{}", manifest.display()))?);
    }
    let listed = Command::new("git").arg("-C").arg(&top).arg("ls-files").output().context("git ls-files")?;
    for file in String::from_utf8_lossy(&listed.stdout).lines() {
        complaints.extend(untidy(file, &std::fs::read(top.join(file)).unwrap_or_default()));
    }
    for complaint in &complaints {
        println!("{complaint}");
    }
    println!("tidy: {} manifests, {} complaints", manifests.len(), complaints.len());
    Ok(complaints.is_empty())
}

/// The dependencies of a manifest that its crate must not have.
fn forbidden(manifest: &str) -> Result<Vec<String>> {
    let table: toml::Table = manifest.parse()?;
    let name = table
        .get("package")
        .and_then(|package| package.get("name"))
        .and_then(toml::Value::as_str)
        .context("a package without a name")?;
    // Packages are `plotplan-FOLDER`; inside the workspace a crate goes by its folder's name.
    let name = name.strip_prefix("plotplan-").unwrap_or(name);
    let Some((_, allowed)) = MAY_KNOW.iter().find(|(krate, _)| *krate == name) else {
        return Ok(vec![format!(
            "{name}: a crate that xtask/src/tidy.rs does not know; say what it may know"
        )]);
    };
    let mut complaints = Vec::new();
    for section in ["dependencies", "build-dependencies", "dev-dependencies"] {
        let Some(dependencies) = table.get(section).and_then(toml::Value::as_table) else { continue };
        for dependency in dependencies.keys() {
            let ours = MAY_KNOW.iter().any(|(krate, _)| krate == dependency);
            if ours && !allowed.contains(&dependency.as_str()) {
                complaints.push(format!("{name} must not know {dependency} ({section})"));
            }
            let reserved = RESERVED.iter().find(|(krate, _)| krate == dependency);
            if section != "dev-dependencies" && reserved.is_some_and(|(_, users)| !users.contains(&name)) {
                complaints.push(format!("{name} must not use {dependency} ({section})"));
            }
        }
    }
    Ok(complaints)
}

/// What is untidy about a tracked file.
fn untidy(file: &str, bytes: &[u8]) -> Option<String> {
    let source =
        Path::new(file).extension().is_some_and(|e| ["rs", "toml", "md"].iter().any(|known| e == *known));
    if !source || file == "xtask/src/tidy.rs" {
        return None;
    }
    let text = String::from_utf8_lossy(bytes);
    if let Some(path) = MACHINE_PATHS.iter().find(|path| text.contains(**path)) {
        return Some(format!("{file}: names a path of some machine: {path}"));
    }
    if text.contains('\r') {
        return Some(format!("{file}: carriage returns"));
    }
    let code = Path::new(file).extension().is_some_and(|e| e == "rs");
    if code && file.contains("/src/") && text.lines().count() > LONG {
        println!("note: {file} has {} lines", text.lines().count());
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest(name: &str, section: &str, dependency: &str) -> String {
        format!("[package]\nname = \"{name}\"\n[{section}]\n{dependency}.workspace = true\n")
    }

    #[test]
    fn a_wall_that_is_broken_is_named() {
        let broken = forbidden(&manifest("drawing", "dependencies", "kinematics")).unwrap();
        assert_eq!(broken, ["drawing must not know kinematics (dependencies)"]);
        let broken = forbidden(&manifest("verify", "dev-dependencies", "planner")).unwrap();
        assert_eq!(broken, ["verify must not know planner (dev-dependencies)"]);
        let broken = forbidden(&manifest("kinematics", "dependencies", "serde")).unwrap();
        assert_eq!(broken, ["kinematics must not use serde (dependencies)"]);
        assert!(forbidden(&manifest("planner", "dependencies", "kinematics")).unwrap().is_empty());
        assert_eq!(forbidden(&manifest("newcomer", "dependencies", "libm")).unwrap().len(), 1);
    }

    #[test]
    fn paths_of_a_machine_are_found() {
        assert!(untidy("a.md", b"see /root/x").is_some());
        assert!(untidy("a.rs", b"fn f() {}\n").is_none());
    }
}
