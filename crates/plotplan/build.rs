//! Puts the commit into `plotplan --version`, where there is one to be known.

#![allow(clippy::disallowed_methods, reason = "cargo speaks to build scripts through the environment")]

use std::path::Path;
use std::process::Command;

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

fn main() {
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
}
