//! `plotplan verify`: the certificate, recomputed from the plan's ticks.
//!
//! The machine decides: its limits, joints and pen times are verified, never those that the plan
//! states. Where the two differ, that is reported.

use ::verify::Mismatch;
use anyhow::Context as _;
use compiler::import::{self, ImportError};
use compiler::machine_file::MachineFile;
use compiler::report::{CertificateReport, Code, ErrorReport, text};
use compiler::{layout, replay};
use drawing::Affine;
use plan::file::PlanFile;

use crate::cli::Verify;
use crate::failure::Failure;
use crate::input::{self, Input, Inputs};
use crate::machines::{self, LoadedMachine};
use crate::{output, session, terminal};

/// The tolerance of plans that state none.
const DEFAULT_TOLERANCE_MM: f64 = 0.1;

pub(crate) fn run(arguments: &Verify) -> Result<(), Failure> {
    if arguments.plan == "-" && arguments.drawing.iter().any(|file| file == "-") {
        return Err(Failure::Usage(anyhow::anyhow!("plan and drawing cannot both be standard input")));
    }
    let input = input::read(&arguments.plan)?;
    let (plan, machine) = plan(&input, arguments.machine.as_deref())?;
    let machine = machines::with_paper(machine, &arguments.reading)?;
    let mut mismatches: Vec<String> =
        ::verify::mismatches(&machine.machine, &plan.table.header).iter().map(ToString::to_string).collect();
    let drawing = if arguments.drawing.is_empty() {
        None
    } else {
        let inputs = Inputs::read(&arguments.drawing)?;
        mismatches.extend(other_drawing(&plan, &inputs));
        let mut drawing = input::drawings(&inputs, &arguments.reading)?.drawing().clone();
        drawing.transform(Affine::new(plan.table.header.placement));
        let kept = layout::cropped(drawing, arguments.reading.layout.crop, machine.machine.sheet());
        Some(replay::on_carriage(kept, &machine.machine))
    };
    let own = plan.document.as_ref().and_then(|document| document.settings["tolerance_mm"].as_f64());
    let tolerance = arguments.tolerance.or(own).unwrap_or(DEFAULT_TOLERANCE_MM);
    let certificate = replay::certify(&plan, &machine.machine, drawing.as_ref(), tolerance);
    for mismatch in &mismatches {
        terminal::warning(Code::PlanMismatch, mismatch);
    }
    let (text, report) = if drawing.is_some() {
        (text::certificate(&certificate), CertificateReport::of(&certificate))
    } else {
        let what = "without --drawing only the motion is verified, not what it draws";
        terminal::warning(Code::MotionOnly, what);
        (text::motion(&certificate), CertificateReport::of_motion(&certificate))
    };
    session::report(|all| {
        all.certificate = Some(report);
        all.mismatches = Some(mismatches);
    });
    output::report(&text)?;
    if !certificate.holds {
        // The text names what failed; there is no need for another message.
        session::failed(ErrorReport {
            code: Code::Verification,
            message: certificate.failures.first().map_or_else(String::new, ToString::to_string),
            help: None,
            place: None,
        });
        return Err(Failure::Refused);
    }
    input::refuse_warnings(arguments.reading.strict)
}

/// Reports a drawing that is not the one that the plan document names, by its SHA-256.
fn other_drawing(plan: &PlanFile, drawing: &Inputs) -> Option<String> {
    let stated = &plan.document.as_ref()?.source.sha256;
    let found = drawing.sha256();
    (!stated.eq_ignore_ascii_case(&found)).then(|| {
        format!(
            "{} is not the drawing that the plan was made from: SHA-256 {found}, in the plan {stated}",
            drawing.path()
        )
    })
}

/// As [`plan()`], for commands that show the plan on its machine. Stops if the machine's motors are not
/// those of the plan, and warns if it has another name.
pub(super) fn plan_on_its_machine(
    input: &Input,
    machine: Option<&str>,
) -> Result<(PlanFile, LoadedMachine), Failure> {
    let (plan, machine) = plan(input, machine)?;
    let found = ::verify::mismatches(&machine.machine, &plan.table.header);
    let name = found.iter().find(|found| matches!(found, Mismatch::MachineName { .. }));
    let motor = found.iter().find(|found| matches!(found, Mismatch::MotorName { .. }));
    match (motor, name) {
        (Some(motor), name) => {
            Err(Failure::Usage(anyhow::anyhow!("{}: {}", input.path, name.unwrap_or(motor))))
        }
        (None, Some(name)) => {
            terminal::warning(Code::PlanMismatch, &name.to_string());
            Ok((plan, machine))
        }
        (None, None) => Ok((plan, machine)),
    }
}

/// Why a file that is no plan is none, if it is a drawing or a file of another kind.
fn other_kind(bytes: &[u8]) -> Option<String> {
    match import::read(bytes, &import::Options::default()) {
        Ok(document) if document.pages.iter().any(|page| !page.drawing.is_empty()) => Some(format!(
            "is a drawing ({}), not a plan: `plotplan convert` makes a plan of it",
            document.format
        )),
        Err(error @ ImportError::Foreign { .. }) => Some(format!("is not a plan: {error}")),
        _ => None,
    }
}

/// Reads a plan and finds its machine: the one named on the command line, the one in the plan document, or the preset of
/// its name.
pub(super) fn plan(input: &Input, machine: Option<&str>) -> Result<(PlanFile, LoadedMachine), Failure> {
    if !plan::file::is_plan(&input.bytes)
        && let Some(what) = other_kind(&input.bytes)
    {
        terminal::error(Code::NotAPlan, &format!("{} {what}", input.path));
        return Err(Failure::Refused);
    }
    let plan = plan::file::read(&input.bytes)
        .with_context(|| format!("{} is not a plan that can be used", input.path))
        .map_err(Failure::Drawing)?;
    let machine = match (machine, &plan.document) {
        (Some(name), _) => machines::machine(name)?,
        (None, Some(document)) => {
            let what = || "the machine in the plan document cannot be used";
            let file: MachineFile = serde_json::from_value(document.machine.clone())
                .with_context(what)
                .map_err(Failure::Drawing)?;
            let machine = file.machine().with_context(what).map_err(Failure::Drawing)?;
            LoadedMachine { file, machine }
        }
        (None, None) => {
            let name = &plan.table.header.machine;
            machines::machine(name).map_err(|failure| match failure {
                Failure::Usage(error) if !error.is::<machines::Unusable>() => Failure::Usage(anyhow::anyhow!(
                    "{} was made for the machine {name}, which is no preset and no machine of your own: give its file with --machine FILE.toml",
                    input.path
                )),
                other => other,
            })?
        }
    };
    Ok((plan, machine))
}
