//! `plotplan diff`: what changed between two plans, drawings or machine files, in any mix.

use std::path::Path;

use compiler::diff::{self, Diff, Kind, Side};
use compiler::import;
use compiler::machine_file::MachineFile;
use compiler::report::{Code, DiffReport, ErrorReport};

use crate::cli;
use crate::failure::Failure;
use crate::input::{self, Input};
use crate::{output, session};

/// A picture's longer side, pixels.
const PIXELS: u32 = 1600;

pub(crate) fn run(arguments: &cli::Diff) -> Result<(), Failure> {
    if arguments.old == "-" && arguments.new == "-" {
        return Err(Failure::Usage(anyhow::anyhow!("only one side can be standard input")));
    }
    let [old, new] = [&arguments.old, &arguments.new].map(|file| input::read(file));
    let (old, new) = (old?, new?);
    let machine = arguments.machine.as_deref();
    let [old, new] = [side(&old, machine)?, side(&new, machine)?];
    if let (Kind::Drawing, Kind::Machine) | (Kind::Machine, Kind::Drawing) = (old.kind, new.kind) {
        let what = "a drawing and a machine file have nothing in common; compare either with a plan";
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    }
    let diff = Diff::of(old, new, arguments.within);
    let report = DiffReport::of(&diff);
    if let Some(to) = &arguments.output {
        picture(&diff, &report, to)?;
    }
    output::report(&report.text())?;
    let is_same = report.same;
    session::report(|all| all.diff = Some(report));
    if arguments.exit_code && !is_same {
        let message = format!("{} and {} differ", arguments.old, arguments.new);
        session::failed(ErrorReport { code: Code::Differs, message, help: None, place: None });
        return Err(Failure::Refused);
    }
    Ok(())
}

/// Both sides, if both can be understood.
pub(super) fn sides(old: &Input, new: &Input, machine: Option<&str>) -> Option<(Side, Side)> {
    Some((side(old, machine).ok()?, side(new, machine).ok()?))
}

/// A plan, a machine file or a drawing, by its content.
fn side(input: &Input, machine: Option<&str>) -> Result<Side, Failure> {
    if plan::file::is_plan(&input.bytes) {
        let (plan, machine) = super::verify::plan(input, machine)?;
        return Ok(Side::of_plan(&input.path, &plan, &machine.machine));
    }
    let is_toml =
        Path::new(&input.path).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    if is_toml {
        let wrong = |error: anyhow::Error| {
            Failure::Usage(error.context(format!("machine {} cannot be used", input.path)))
        };
        let text = std::str::from_utf8(&input.bytes).map_err(|error| wrong(error.into()))?;
        let file = MachineFile::parse(text).map_err(|error| wrong(error.into()))?;
        return Side::of_machine(&input.path, &file).map_err(|error| wrong(error.into()));
    }
    let document = import::read(&input.bytes, &import::Options::default())
        .map_err(|error| Failure::Drawing(anyhow::Error::new(error).context(input.path.clone())))?;
    input::refuse_unusable(&input.path, &document)?;
    Ok(Side::of_drawing(&input.path, &document.pages[0]))
}

/// Both sides in a picture.
fn picture(diff: &Diff, report: &DiffReport, to: &str) -> Result<(), Failure> {
    if [&diff.old, &diff.new].iter().any(|side| side.kind == Kind::Machine) {
        return Err(Failure::Usage(anyhow::anyhow!(
            "a machine file has no strokes: --output needs plans or drawings"
        )));
    }
    let scene = diff::scene(diff);
    let extension = Path::new(to).extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match extension.as_deref() {
        Some("svg") => output::write(to, |out| picture::scene::svg(&scene, out)),
        Some("png") => {
            let bytes =
                picture::png::encode(&scene, PIXELS).map_err(|error| Failure::Drawing(error.into()))?;
            output::write(to, |out| out.write_all(&bytes))
        }
        Some("html") => {
            let mut svg = Vec::new();
            picture::scene::svg(&scene, &mut svg).map_err(|error| Failure::Io(error.into()))?;
            let page = diff::html(diff, &String::from_utf8_lossy(&svg), &report.text());
            output::write(to, |out| out.write_all(page.as_bytes()))
        }
        _ => Err(Failure::Usage(anyhow::anyhow!(
            "{to}: the picture of a difference is NAME.svg, NAME.png or NAME.html"
        ))),
    }
}
