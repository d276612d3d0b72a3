//! Tests of the viewer and the studio in a browser: playwright's core package with Debian's Chromium.

use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, ensure};

/// Strokes of the drawing that must stay smooth.
const MANY: u32 = 100_000;

/// The pages that the tests open, and the command that writes each.
const PAGES: &[(&str, &str)] = &[
    ("house.html", "preview examples/house.hpgl --machine coaxial --fit"),
    ("zot.html", "preview examples/zot.hpgl --machine coaxial"),
    ("rings.html", "preview examples/rings.svg --machine corexy --align center"),
    ("polar.html", "preview examples/rosette.hpgl --machine polar --fit"),
    ("five-bar.html", "preview examples/zot.hpgl --machine five-bar --fit"),
    ("simulation.html", "simulate examples/house.hpgl --machine coaxial --fit --setpoints interpolated"),
];

/// Installs what is missing, type-checks the viewer, writes the pages with `program` (by default it is
/// built) and runs the tests. With `write`, screenshots become the new references.
pub(crate) fn run(program: Option<&str>, write: bool) -> Result<bool> {
    let top = crate::top();
    let (tests, pages) = (top.join("viewer/test"), top.join("target/web-test"));
    install(&tests)?;
    for project in ["viewer", "studio"] {
        execute(Command::new(tests.join("node_modules/.bin/tsc")).args(["-p", project]))?;
    }
    let studio = crate::web::build()?;
    let program =
        if let Some(program) = program { PathBuf::from(program) } else { crate::programs::build("quick")? };
    std::fs::create_dir_all(&pages).with_context(|| format!("{}", pages.display()))?;
    write_pages(&program, &pages)?;
    let mut command = Command::new("node");
    command.args(["--test", "--test-reporter=spec", "--test-concurrency=2"]);
    command.args(["viewer/test/viewer.test.mjs", "viewer/test/studio.test.mjs"]);
    command.env("PLOTPLAN_PAGES", std::path::absolute(&pages)?);
    command.env("PLOTPLAN_PROGRAM", std::path::absolute(&program)?);
    command.env("PLOTPLAN_STUDIO_FILES", studio);
    if write {
        command.env("PLOTPLAN_WRITE_SCREENSHOTS", "1");
    }
    execute(&mut command)?;
    Ok(true)
}

fn execute(command: &mut Command) -> Result<()> {
    let line = format!("{command:?}");
    println!("$ {line}");
    let status = command.current_dir(crate::top()).status().with_context(|| format!("cannot run {line}"))?;
    ensure!(status.success(), "{line}: {status}");
    Ok(())
}

/// Whether a program runs.
fn has(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

fn install(tests: &Path) -> Result<()> {
    let missing: Vec<&str> = [("node", "nodejs"), ("npm", "npm"), ("chromium", "chromium")]
        .into_iter()
        .filter(|(program, _)| !has(program))
        .map(|(_, package)| package)
        .collect();
    if !missing.is_empty() {
        let as_root: &[&str] = if has("sudo") { &["sudo", "apt-get"] } else { &["apt-get"] };
        let apt = |words: &[&str]| {
            let words = [&as_root[1..], words].concat();
            execute(Command::new(as_root[0]).args(words)).context("the tests need nodejs, npm and chromium")
        };
        apt(&["update", "--quiet"])?;
        // The references are drawn with this font.
        let packages = [&["install", "--yes", "--no-install-recommends", "fonts-dejavu-core"], &missing[..]];
        apt(&packages.concat())?;
    }
    let npm = ["ci", "--no-audit", "--no-fund", "--prefix"];
    execute(Command::new("npm").args(npm).arg(tests))
}

fn write_pages(program: &Path, pages: &Path) -> Result<()> {
    // The folder's name may have blanks.
    let write = |words: &mut dyn Iterator<Item = &OsStr>, to: &str| {
        execute(Command::new(program).args(words).args(["--quiet", "--output"]).arg(pages.join(to)))
    };
    for (name, command) in PAGES {
        write(&mut command.split(' ').map(OsStr::new), name)?;
    }
    write(&mut "convert examples/zot.hpgl --machine coaxial".split(' ').map(OsStr::new), "zot.ticks")?;
    let plan = pages.join("zot.ticks");
    write(&mut ["preview".as_ref(), plan.as_os_str()].into_iter(), "plan.html")?;
    let drawing = pages.join("many.hpgl");
    std::fs::write(&drawing, many()).with_context(|| format!("{}", drawing.display()))?;
    let options = "--machine corexy --order file".split(' ').map(OsStr::new);
    write(&mut ["preview".as_ref(), drawing.as_os_str()].into_iter().chain(options), "many.html")
}

/// A drawing of many short strokes, one beside the other.
fn many() -> String {
    let mut text = String::from("IN;SP1;\n");
    for k in 0..MANY {
        let (column, row) = (k % 400, k / 400);
        let (x, y) = (18 * column + 200, 28 * row + 200);
        // Directions that repeat every eleven strokes, in plotter units of 0.025 mm.
        let (dx, dy) = [
            (14, 3),
            (5, 22),
            (12, 12),
            (0, 24),
            (9, 18),
            (14, 0),
            (3, 20),
            (13, 8),
            (7, 15),
            (1, 9),
            (10, 5),
        ][(k % 11) as usize];
        let _ = writeln!(text, "PU{x},{y};PD{},{};", x + dx, y + dy);
    }
    text.push_str("PU;SP0;\n");
    text
}
