//! `plotplan init`: a project file for a folder of drawings.

use std::fmt::Write as _;
use std::path::Path;

use super::project;
use crate::cli::Init;
use crate::failure::Failure;
use crate::{machines, output, terminal};

/// Extensions of drawings.
const DRAWINGS: [&str; 8] = ["hpgl", "hpg", "hgl", "plt", "hp", "pl", "svg", "svgz"];
/// With more drawings than this a pattern stands for them.
const LISTED: usize = 20;

pub(crate) fn run(arguments: &Init) -> Result<(), Failure> {
    let folder = Path::new(&arguments.folder);
    let path = folder.join(project::NAME);
    if path.exists() {
        let what = format!("{} exists already; it is not replaced", path.display());
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    }
    if !folder.is_dir() {
        return Err(Failure::Usage(anyhow::anyhow!("{} is not a folder", folder.display())));
    }
    let machine = arguments.machine.as_deref();
    if let Some(name) = machine {
        machines::machine(name)?;
    }
    let drawings = drawings(folder)?;
    let text = project_file(machine, &drawings);
    output::write(&path.display().to_string(), |out| out.write_all(text.as_bytes()))?;
    let count = compiler::report::text::pluralize(drawings.len(), "drawing");
    terminal::say(&format!("{}: {count}; `plotplan build` makes the plans\n", path.display()));
    Ok(())
}

/// The drawings of a folder, in the order of their names.
fn drawings(folder: &Path) -> Result<Vec<String>, Failure> {
    let entries = std::fs::read_dir(folder).map_err(|error| {
        Failure::Io(anyhow::Error::new(error).context(format!("cannot read {}", folder.display())))
    })?;
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let is_drawing = |name: &String| {
        let extension = Path::new(name).extension().and_then(|extension| extension.to_str());
        extension.is_some_and(|extension| DRAWINGS.contains(&extension.to_ascii_lowercase().as_str()))
    };
    let mut found: Vec<String> = names.filter(is_drawing).collect();
    found.sort_unstable();
    Ok(found)
}

fn project_file(machine: Option<&str>, drawings: &[String]) -> String {
    let mut text = String::from(
        "# Plans of this folder: `plotplan build` makes those that are out of date, `plotplan build --check`\n\
         # compares them. Keys are options of `plotplan convert`, with _ for -.\n\n\
         # Options of all plans. The machine is a name from `plotplan machine list`, or a file of your own.\n\
         [options]\n",
    );
    let machine = toml_edit::Value::from(machine.unwrap_or("coaxial"));
    let _ = writeln!(text, "machine = {machine}");
    text.push_str("fit = true\n# tolerance = \"0.1mm\"\n");
    let mut plan = |drawing: &str, output: &str| {
        let [drawing, output] = [drawing, output].map(toml_edit::Value::from);
        let _ = write!(text, "\n[[plan]]\ndrawing = {drawing}\noutput = {output}\n");
    };
    if drawings.is_empty() {
        plan("drawing.hpgl", "plans/drawing.ticks");
    } else if drawings.len() > LISTED {
        let mut extensions: Vec<&str> =
            drawings.iter().filter_map(|name| Some(name.rsplit_once('.')?.1)).collect();
        extensions.sort_unstable();
        extensions.dedup();
        // Two drawings may have the same name but for the extension.
        for extension in extensions {
            plan(&format!("*.{extension}"), &format!("plans/%f.{extension}.ticks"));
        }
    } else {
        let stem = |name: &str| name.rsplit_once('.').map_or(name.to_owned(), |(stem, _)| stem.to_owned());
        for name in drawings {
            let is_alone = drawings.iter().filter(|other| stem(other) == stem(name)).count() == 1;
            let of = if is_alone { stem(name) } else { name.clone() };
            plan(name, &format!("plans/{of}.ticks"));
        }
    }
    text
}
