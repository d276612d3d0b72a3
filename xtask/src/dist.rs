//! What a release consists of: archives with checksums, the Debian package, the wheel. Tools are called as
//! programs: `cargo zigbuild` for macOS, `tar`, `gzip`, `zip`, `dpkg-deb`, `maturin`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, ensure};

use crate::programs::{commands, execute, output_of, text_of, version, write};

/// A system that archives are made for.
struct Target {
    triple: &'static str,
    /// The command of Cargo that builds it.
    tool: &'static str,
    windows: bool,
}

const TARGETS: &[Target] = &[
    Target { triple: NATIVE, tool: "build", windows: false },
    Target { triple: "aarch64-unknown-linux-musl", tool: "build", windows: false },
    Target { triple: "x86_64-pc-windows-gnu", tool: "build", windows: true },
    Target { triple: "aarch64-apple-darwin", tool: "zigbuild", windows: false },
];

/// Runs on the machine that builds, and is in the Debian package and the wheel too: man pages and completions
/// are printed by it.
pub(crate) const NATIVE: &str = "x86_64-unknown-linux-musl";
/// The folder that `cargo xtask web` makes.
const STUDIO: &str = "target/studio";
const MAINTAINER: &str = "The plotplan maintainers <plotplan@users.noreply.example>";
const FILES: &[&str] = &["README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE"];

/// Builds what is named, or everything. With `--program FILE`, that program is packed instead of building the
/// native one; `--studio FOLDER` packs a studio that is built already.
pub(crate) fn run(words: &[&str]) -> Result<bool> {
    let mut targets: Vec<&Target> = Vec::new();
    let (mut deb, mut wheel, mut studio, mut program) = (false, false, None, None);
    let mut rest = words.iter();
    while let Some(word) = rest.next() {
        match *word {
            "--deb" => deb = true,
            "--wheel" => wheel = true,
            "--program" => program = Some(rest.next().context("--program needs a file")?),
            "--studio" => studio = Some(rest.next().context("--studio needs a folder")?),
            triple => {
                let known = TARGETS.iter().find(|target| target.triple == triple);
                targets.push(known.with_context(|| format!("targets are {}", triples().join(", ")))?);
            }
        }
    }
    if words.is_empty() {
        (deb, wheel, studio) = (true, true, Some(&STUDIO));
        targets.extend(TARGETS);
    }
    let out = crate::top().join("target/dist");
    std::fs::create_dir_all(&out)?;
    let native = if let Some(program) = program {
        std::path::absolute(program)?
    } else {
        crate::web::build()?;
        build(NATIVE)?
    };
    let extras = extras(&native, &out)?;
    let mut failed = Vec::new();
    for target in targets {
        let built = if target.triple == NATIVE { Ok(native.clone()) } else { build(target.triple) };
        match built.and_then(|program| archive(target, &program, &extras, &out)) {
            Ok(file) => println!("{}", file.display()),
            // A system that cannot be built here does not keep the others back.
            Err(error) => failed.push(format!("{}: {error:#}", target.triple)),
        }
    }
    if deb {
        println!("{}", debian(&native, &extras, &out)?.display());
    }
    if wheel {
        build_wheel(&out)?;
    }
    if let Some(folder) = studio {
        println!("{}", studio_archive(&crate::top().join(folder), &out)?.display());
    }
    checksums(&out)?;
    for failure in &failed {
        println!("NOT BUILT {failure}");
    }
    Ok(failed.is_empty())
}

fn triples() -> Vec<&'static str> {
    TARGETS.iter().map(|target| target.triple).collect()
}

/// Builds the program for a target, with the studio that `cargo xtask web` made; returns its path.
pub(crate) fn build(triple: &str) -> Result<PathBuf> {
    let known = TARGETS.iter().find(|target| target.triple == triple);
    let target = known.with_context(|| format!("targets are {}", triples().join(", ")))?;
    add(triple)?;
    let mut command = Command::new("cargo");
    command.arg(target.tool);
    command.args(["--release", "--locked", "-p", "plotplan", "--target", target.triple]);
    command.env("PLOTPLAN_STUDIO", STUDIO);
    execute(with_linker(&mut command)).context(
        "Windows needs Debian's gcc-mingw-w64-x86-64; macOS needs cargo-zigbuild, zig and Apple's SDK",
    )?;
    let name = if target.windows { "plotplan.exe" } else { "plotplan" };
    Ok(crate::top().join("target").join(target.triple).join("release").join(name))
}

/// Installs the standard library of a target.
pub(crate) fn add(triple: &str) -> Result<()> {
    execute(Command::new("rustup").args(["target", "add", triple]))
}

/// The linkers of targets for Cargo. Pure Rust: its own linker is enough for another processor.
pub(crate) fn with_linker(command: &mut Command) -> &mut Command {
    command.env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_LINKER", "rust-lld")
}

/// Man pages, completions and machine files, printed by the program itself; returns their folder.
fn extras(program: &Path, out: &Path) -> Result<PathBuf> {
    let folder = out.join("extras");
    let _ = std::fs::remove_dir_all(&folder);
    let printed = |words: &[&str]| output_of(Command::new(program).args(words));
    write(&folder.join("man/plotplan.1"), printed(&["man"])?)?;
    for command in commands(program)? {
        let words: Vec<&str> = command.split(' ').collect();
        // The manual page of a group describes its commands too.
        if words.len() == 1 {
            write(&folder.join(format!("man/plotplan-{command}.1")), printed(&["man", words[0]])?)?;
        }
    }
    for (shell, file) in [
        ("bash", "plotplan.bash"),
        ("zsh", "_plotplan"),
        ("fish", "plotplan.fish"),
        ("powershell", "_plotplan.ps1"),
        ("elvish", "plotplan.elv"),
    ] {
        write(&folder.join("completions").join(file), printed(&["completions", shell])?)?;
    }
    for entry in std::fs::read_dir(crate::top().join("crates/compiler/machines"))? {
        let path = entry?.path();
        let name = path.file_name().context("a name")?;
        write(&folder.join("machines").join(name), std::fs::read(&path)?)?;
    }
    Ok(folder)
}

/// One archive: a folder with the program, its man pages, completions, machine files and licences.
fn archive(target: &Target, program: &Path, extras: &Path, out: &Path) -> Result<PathBuf> {
    let name = format!("plotplan-{}-{}", version()?, target.triple);
    let folder = out.join(&name);
    let _ = std::fs::remove_dir_all(&folder);
    copy_tree(extras, &folder)?;
    for file in FILES {
        write(&folder.join(file), std::fs::read(crate::top().join(file))?)?;
    }
    let to = folder.join(program.file_name().context("a name")?);
    std::fs::copy(program, &to).with_context(|| format!("{}", program.display()))?;
    let packed = pack(out, &name, target.windows)?;
    std::fs::remove_dir_all(&folder)?;
    Ok(packed)
}

/// Packs a folder below `out` so that the same files give the same bytes: sorted, without owners, with
/// the time of the commit.
fn pack(out: &Path, name: &str, zip: bool) -> Result<PathBuf> {
    let time = text_of(Command::new("git").args(["log", "-1", "--format=%ct"]).current_dir(crate::top()))?;
    let time = format!("@{}", time.trim());
    let script = if zip {
        "find \"$1\" -exec touch -d \"$2\" {} + && rm -f \"$1.zip\" && find \"$1\" -type f | LC_ALL=C sort | \
         TZ=UTC zip -q -X -9 -@ \"$1.zip\""
    } else {
        "tar --sort=name --owner=0 --group=0 --numeric-owner --mode=u+rwX,go+rX,go-w --mtime=\"$2\" -cf - \"$1\" | \
         gzip -n9 > \"$1.tar.gz\""
    };
    output_of(Command::new("sh").args(["-ec", script, "sh", name, &time]).current_dir(out))?;
    Ok(out.join(format!("{name}.{}", if zip { "zip" } else { "tar.gz" })))
}

fn copy_tree(from: &Path, to: &Path) -> Result<()> {
    for entry in std::fs::read_dir(from).with_context(|| format!("{}", from.display()))? {
        let path = entry?.path();
        let target = to.join(path.file_name().context("a name")?);
        if path.is_dir() {
            copy_tree(&path, &target)?;
        } else {
            write(&target, std::fs::read(&path)?)?;
        }
    }
    Ok(())
}

/// The Debian package: the static program, so that it depends on nothing.
fn debian(program: &Path, extras: &Path, out: &Path) -> Result<PathBuf> {
    let (version, root) = (version()?, out.join("debian"));
    let _ = std::fs::remove_dir_all(&root);
    let place = |from: &Path, to: &str| write(&root.join(to), std::fs::read(from)?);
    place(program, "usr/bin/plotplan")?;
    for entry in std::fs::read_dir(extras.join("man"))? {
        let path = entry?.path();
        let name = path.file_name().context("a name")?.to_string_lossy().into_owned();
        place(&path, &format!("usr/share/man/man1/{name}"))?;
        output_of(Command::new("gzip").arg("-n9f").arg(root.join("usr/share/man/man1").join(name)))?;
    }
    for (from, to) in [
        ("plotplan.bash", "usr/share/bash-completion/completions/plotplan"),
        ("_plotplan", "usr/share/zsh/vendor-completions/_plotplan"),
        ("plotplan.fish", "usr/share/fish/vendor_completions.d/plotplan.fish"),
    ] {
        place(&extras.join("completions").join(from), to)?;
    }
    let doc = "usr/share/doc/plotplan";
    for file in ["README.md", "CHANGELOG.md"] {
        place(&crate::top().join(file), &format!("{doc}/{file}"))?;
    }
    let licence = std::fs::read_to_string(crate::top().join("LICENSE-MIT"))?;
    write(&root.join(doc).join("copyright"), format!("Licence: MIT or Apache-2.0\n\n{licence}"))?;
    copy_tree(&crate::top().join("docs"), &root.join(doc).join("docs"))?;
    let size = text_of(Command::new("du").arg("-sk").arg(root.join("usr")))?;
    let size = size.split_whitespace().next().context("a size")?.to_owned();
    write(
        &root.join("DEBIAN/control"),
        format!(
            "Package: plotplan\nVersion: {version}\nArchitecture: amd64\nMaintainer: {MAINTAINER}\nInstalled-Size: {size}\n\
             Section: graphics\nPriority: optional\nDescription: compile pen-plotter drawings into motor motion\n \
             plotplan compiles drawings (HPGL, HP-GL/2, SVG) into motor trajectories for any mechanism\n with two \
             motors. Each plan is verified to draw the drawing within a tolerance and inside\n the limits of the \
             motors. It writes the formats of common firmware and sends plans over a\n serial port.\n"
        ),
    )?;
    let file = out.join(format!("plotplan_{version}_amd64.deb"));
    output_of(Command::new("chmod").args(["-R", "u+rwX,go+rX,go-w"]).arg(&root))?;
    output_of(Command::new("chmod").arg("755").arg(root.join("usr/bin/plotplan")))?;
    output_of(Command::new("dpkg-deb").args(["--root-owner-group", "--build"]).arg(&root).arg(&file))?;
    std::fs::remove_dir_all(&root)?;
    Ok(file)
}

/// The wheel: the static program, so that one file serves every Linux on x86-64.
fn build_wheel(out: &Path) -> Result<()> {
    crate::web::build()?;
    let mut command = Command::new("maturin");
    command.args(["build", "--release", "--locked", "--target", NATIVE]);
    // As in `build`: the same program as in the archive.
    command.env("PLOTPLAN_STUDIO", STUDIO);
    command
        .args(["--compatibility", "manylinux2014", "--auditwheel", "skip", "--out"])
        .arg(std::path::absolute(out)?);
    let command = command.current_dir(crate::top().join("packaging/wheel"));
    print!("{}", text_of(command).context("the wheel needs maturin (`pip install maturin`)")?);
    Ok(())
}

/// The studio as static files for any web server; `cargo xtask web` makes the folder.
fn studio_archive(folder: &Path, out: &Path) -> Result<PathBuf> {
    ensure!(folder.join("index.html").is_file(), "no index.html in {}", folder.display());
    let name = format!("plotplan-studio-{}", version()?);
    let copy = out.join(&name);
    let _ = std::fs::remove_dir_all(&copy);
    copy_tree(folder, &copy)?;
    let packed = pack(out, &name, false)?;
    std::fs::remove_dir_all(&copy)?;
    Ok(packed)
}

/// SHA-256 of every file of the release, in the form of `sha256sum --check`.
fn checksums(out: &Path) -> Result<()> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(out)? {
        let path = entry?.path();
        if path.is_file() && path.file_name().is_some_and(|name| name != "SHA256SUMS") {
            names.push(path.file_name().context("a name")?.to_owned());
        }
    }
    names.sort();
    let sums = output_of(Command::new("sha256sum").arg("--").args(&names).current_dir(out))?;
    write(&out.join("SHA256SUMS"), &sums)?;
    print!("{}", String::from_utf8_lossy(&sums));
    Ok(())
}

pub(crate) fn print_version() -> Result<bool> {
    println!("{}", version()?);
    Ok(true)
}

/// Sets the version of all crates: `workspace.package.version`, and the requirements between them, which
/// packages need. `cargo xtask tidy` checks that they agree.
pub(crate) fn set_version(to: &str) -> Result<bool> {
    let parts: Vec<&str> = to.split('.').collect();
    ensure!(parts.len() == 3 && parts.iter().all(|part| part.parse::<u32>().is_ok()), "a version is X.Y.Z");
    let path = crate::top().join("Cargo.toml");
    let from = version()?;
    let mut text = String::new();
    for line in std::fs::read_to_string(&path)?.lines() {
        let ours = line == format!("version = \"{from}\"") || line.contains("package = \"plotplan-");
        let quoted = |version: &str| format!("version = \"{version}\"");
        let line = if ours { line.replace(&quoted(&from), &quoted(to)) } else { line.to_owned() };
        writeln!(text, "{line}")?;
    }
    write(&path, text)?;
    // The Arduino library has the version of the program that writes its machine header.
    let path = crate::top().join(LIBRARY);
    let library =
        std::fs::read_to_string(&path)?.replace(&format!("version={from}\n"), &format!("version={to}\n"));
    write(&path, library)?;
    // Lock files name the version too: that of the workspace, and that of the fuzz targets.
    execute(Command::new("cargo").args(["update", "--workspace", "--offline"]))?;
    let metadata = ["metadata", "--format-version", "1", "--offline", "--manifest-path", "fuzz/Cargo.toml"];
    output_of(Command::new("cargo").args(metadata).current_dir(crate::top()))?;
    println!("{from} -> {}", version()?);
    Ok(true)
}

/// The description of the Arduino library.
pub(crate) const LIBRARY: &str = "firmware/library.properties";

/// Versions that are not that of the workspace: requirements between crates, the Arduino library; for `tidy`.
pub(crate) fn other_versions(manifest: &str, library: &str) -> Result<Vec<String>> {
    let table: toml::Table = manifest.parse()?;
    let workspace = &table["workspace"];
    let version = workspace["package"]["version"].as_str().context("a version")?;
    let dependencies = workspace["dependencies"].as_table().context("dependencies")?;
    let mut found = Vec::new();
    if !library.lines().any(|line| line.strip_prefix("version=") == Some(version)) {
        found.push(format!("{LIBRARY}: not version {version}: `cargo xtask version {version}`"));
    }
    for (name, dependency) in dependencies {
        let stated = dependency.get("version").and_then(toml::Value::as_str);
        let is_ours = dependency.get("path").is_some();
        if is_ours && stated.is_some_and(|stated| stated != version) {
            found.push(format!(
                "Cargo.toml: {name} is required as {stated:?}: `cargo xtask version {version}`"
            ));
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disagreeing_version_is_reported() {
        let manifest = |version: &str| {
            format!(
                "[workspace.package]\nversion = \"0.2.0\"\n[workspace.dependencies]\n\
                 drawing = {{ path = \"crates/drawing\", version = \"{version}\" }}\nlibm = \"0.2.16\"\n"
            )
        };
        let library = "name=plotplan\nversion=0.2.0\n";
        assert_eq!(other_versions(&manifest("0.2.0"), library).unwrap(), [] as [String; 0]);
        assert_eq!(other_versions(&manifest("0.1.0"), library).unwrap().len(), 1);
        assert_eq!(other_versions(&manifest("0.2.0"), "version=0.2.1\n").unwrap().len(), 1);
    }
}
