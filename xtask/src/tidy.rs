//! Dependency rules between crates, read from the manifests, and checks of tracked files.

use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, Result};

/// For each crate, the workspace crates that it may depend on. Any other dependency is an error.
const ALLOWED: &[(&str, &[&str])] = &[
    ("drawing", &[]),
    ("plan", &[]),
    ("viewer", &[]),
    ("test-support", &["drawing", "kinematics"]),
    ("hpgl", &["drawing"]),
    ("svg", &["drawing"]),
    ("ordering", &["drawing"]),
    ("kinematics", &["drawing"]),
    ("planner", &["drawing", "kinematics", "plan"]),
    ("verify", &["drawing", "kinematics", "plan"]),
    ("simulation", &["drawing", "kinematics", "plan"]),
    ("calibration", &["drawing", "kinematics"]),
    ("picture", &["drawing", "plan"]),
    ("backends", &["drawing", "hpgl", "kinematics", "plan"]),
    (
        "compiler",
        &[
            "calibration",
            "drawing",
            "hpgl",
            "kinematics",
            "ordering",
            "picture",
            "plan",
            "planner",
            "simulation",
            "svg",
            "verify",
            "viewer",
        ],
    ),
    (
        "studio",
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
            "viewer",
        ],
    ),
    ("studio-wasm", &["studio"]),
    (
        "plotplan",
        &[
            "backends",
            "calibration",
            "compiler",
            "drawing",
            "hpgl",
            "kinematics",
            "ordering",
            "picture",
            "plan",
            "planner",
            "simulation",
            // Its outputs are compared with the program's.
            "studio",
            "verify",
        ],
    ),
    (
        "xtask",
        &[
            "compiler",
            "drawing",
            "hpgl",
            "kinematics",
            "ordering",
            "plan",
            "planner",
            "simulation",
            "svg",
            // The strokes of `bound`.
            "test-support",
        ],
    ),
];

/// Any crate may use this one in its tests, and only the development tasks outside of them.
const FOR_TESTS: &str = "test-support";

/// External crates that only the listed crates may use.
const RESERVED: &[(&str, &[&str])] = &[
    ("anyhow", &["plotplan", "xtask"]),
    ("clap", &["plotplan"]),
    ("serialport", &["plotplan"]),
    ("indicatif", &["plotplan"]),
    // In the binary for projects, whose keys are options of the command line.
    ("toml", &["backends", "compiler", "plotplan", "xtask"]),
    ("toml_edit", &["compiler", "plotplan"]),
    ("serde", &["backends", "compiler", "plan", "plotplan", "studio"]),
    ("serde_json", &["backends", "compiler", "plan", "plotplan", "studio", "xtask"]),
];

/// Absolute paths of a development machine, which must not be committed.
const LOCAL_PATHS: &[&str] = &["/work/", "/root/", "/tmp/target"];

/// Source files with more lines are listed as a note.
const LONG: usize = 800;

/// Prints all violations; returns whether there were none.
pub(crate) fn run() -> Result<bool> {
    let top = crate::top();
    let mut violations = Vec::new();
    let folders = ["viewer", "studio", "studio/wasm", "xtask"];
    let mut manifests: Vec<_> = folders.iter().map(|folder| top.join(folder).join("Cargo.toml")).collect();
    for entry in std::fs::read_dir(top.join("crates")).context("cannot list the folder crates")? {
        manifests.push(entry?.path().join("Cargo.toml"));
    }
    manifests.sort();
    for manifest in &manifests {
        let text = std::fs::read_to_string(manifest).with_context(|| format!("{}", manifest.display()))?;
        violations.extend(forbidden(&text).with_context(|| format!("{}", manifest.display()))?);
    }
    let listed = Command::new("git").arg("-C").arg(&top).arg("ls-files").output().context("git ls-files")?;
    let summary = std::fs::read_to_string(top.join(crate::site::SUMMARY)).context(crate::site::SUMMARY)?;
    for file in String::from_utf8_lossy(&listed.stdout).lines() {
        // Links to a page that the site does not have would lead nowhere.
        let is_page = file.starts_with("docs/") && file.strip_suffix(".md").is_some();
        if is_page && !summary.contains(&format!("({file})")) {
            violations.push(format!("{} does not list {file}", crate::site::SUMMARY));
        }
        violations.extend(untidy(file, &std::fs::read(top.join(file)).unwrap_or_default()));
    }
    let workspace = std::fs::read_to_string(top.join("Cargo.toml")).context("Cargo.toml")?;
    let library = std::fs::read_to_string(top.join(crate::dist::LIBRARY)).context(crate::dist::LIBRARY)?;
    violations.extend(crate::dist::other_versions(&workspace, &library)?);
    for violation in &violations {
        println!("{violation}");
    }
    println!("tidy: {} manifests, {} violations", manifests.len(), violations.len());
    Ok(violations.is_empty())
}

/// The dependencies of a manifest that break a rule.
fn forbidden(manifest: &str) -> Result<Vec<String>> {
    let table: toml::Table = manifest.parse()?;
    let name = table
        .get("package")
        .and_then(|package| package.get("name"))
        .and_then(toml::Value::as_str)
        .context("package without a name")?;
    // Packages are named `plotplan-FOLDER`; the rules use the names of the folders.
    let name = name.strip_prefix("plotplan-").unwrap_or(name);
    let Some((_, allowed)) = ALLOWED.iter().find(|(krate, _)| *krate == name) else {
        return Ok(vec![format!("{name}: add its allowed dependencies to xtask/src/tidy.rs")]);
    };
    let mut violations = Vec::new();
    for section in ["dependencies", "build-dependencies", "dev-dependencies"] {
        let Some(dependencies) = table.get(section).and_then(toml::Value::as_table) else { continue };
        for dependency in dependencies.keys() {
            let ours = ALLOWED.iter().any(|(krate, _)| krate == dependency);
            let for_tests = section == "dev-dependencies" && dependency == FOR_TESTS;
            if ours && !for_tests && !allowed.contains(&dependency.as_str()) {
                violations.push(format!("{name} must not depend on {dependency} ({section})"));
            }
            let reserved = RESERVED.iter().find(|(krate, _)| krate == dependency);
            if section != "dev-dependencies" && reserved.is_some_and(|(_, users)| !users.contains(&name)) {
                violations.push(format!("{name} must not depend on {dependency} ({section})"));
            }
        }
    }
    Ok(violations)
}

/// The violation found in a tracked file.
fn untidy(file: &str, bytes: &[u8]) -> Option<String> {
    let source =
        Path::new(file).extension().is_some_and(|e| ["rs", "toml", "md"].iter().any(|known| e == *known));
    if !source || file == "xtask/src/tidy.rs" {
        return None;
    }
    let text = String::from_utf8_lossy(bytes);
    if let Some(path) = LOCAL_PATHS.iter().find(|path| text.contains(**path)) {
        return Some(format!("{file}: contains a local path: {path}"));
    }
    if text.contains('\r') {
        return Some(format!("{file}: contains carriage returns"));
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
    fn forbidden_dependency_is_reported() {
        let broken = forbidden(&manifest("drawing", "dependencies", "kinematics")).unwrap();
        assert_eq!(broken, ["drawing must not depend on kinematics (dependencies)"]);
        let broken = forbidden(&manifest("verify", "dev-dependencies", "planner")).unwrap();
        assert_eq!(broken, ["verify must not depend on planner (dev-dependencies)"]);
        let broken = forbidden(&manifest("kinematics", "dependencies", "serde")).unwrap();
        assert_eq!(broken, ["kinematics must not depend on serde (dependencies)"]);
        assert!(forbidden(&manifest("planner", "dependencies", "kinematics")).unwrap().is_empty());
        assert_eq!(forbidden(&manifest("newcomer", "dependencies", "libm")).unwrap().len(), 1);
    }

    #[test]
    fn local_path_is_reported() {
        assert!(untidy("a.md", b"see /root/x").is_some());
        assert!(untidy("a.rs", b"fn f() {}\n").is_none());
    }
}
