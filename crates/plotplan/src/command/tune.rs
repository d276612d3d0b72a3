//! `plotplan tune`: gains for a machine, or a motor's parameters from a record.

use anyhow::Context as _;
use compiler::machine_file::{drive_keys, with_drive};
use compiler::report::{Code, tuning};
use compiler::tune;

use super::simulate::{LoadedPlan, drive, load_drawing};
use crate::cli::Tune;
use crate::failure::Failure;
use crate::input::{self, Input, Inputs};
use crate::machines::{self, LoadedMachine};
use crate::{output, session, terminal};

pub(crate) fn run(arguments: &Tune) -> Result<(), Failure> {
    if let Some(file) = &arguments.from_step {
        return from_step(file);
    }
    let name = arguments.machine.as_deref().unwrap_or_default();
    let toml = machines::machine_toml(name)?;
    let loaded = machines::machine_with_paper(name, &arguments.reading)?;
    let mut drive = drive(&loaded.file, &loaded.machine)?;
    if let Some(period_s) = arguments.loop_period {
        drive.period_s = period_s;
        drive.validate().context("--loop-period").map_err(Failure::Usage)?;
    }
    let finer = tune::finer_machine(&loaded.machine).map_err(|error| Failure::Usage(error.into()))?;
    let finer = LoadedMachine { file: loaded.file.clone(), machine: finer };
    let (plan, finer) = if arguments.drawing.is_empty() {
        (test_pattern(loaded)?, test_pattern(finer)?)
    } else {
        let inputs = Inputs::read(&arguments.drawing)?;
        let planned = |machine| load_drawing(&inputs, machine, &arguments.reading, &arguments.planning);
        (planned(loaded)?, planned(finer)?)
    };
    let tuned = tune::tune(&plan.plan(), &finer.plan(), &drive)
        .with_context(|| format!("{name} cannot be tuned"))
        .map_err(Failure::Drawing)?;
    if let Some(to) = &arguments.output {
        let text = with_drive(&toml, &tuned.drive).context("the machine file").map_err(Failure::Usage)?;
        output::write(to, |out| out.write_all(text.as_bytes()))?;
    }
    let keys = drive_keys(&tuned.drive);
    let keys = keys.iter().map(|(key, value)| format!("{key} = {}\n", value.to_string().trim()));
    let table: String = keys.collect();
    let text = tuning::text(&plan.name, plan.machine.name(), &tuned);
    session::report(|all| all.tuning = Some(tuning::TuningReport::of(&tuned)));
    output::report(&format!("{text}\n[drive]\n{table}"))?;
    input::refuse_warnings(arguments.reading.strict)
}

/// The plan of the test pattern in the middle of the sheet, as large as it is or smaller.
fn test_pattern(machine: LoadedMachine) -> Result<LoadedPlan, Failure> {
    use clap::Parser as _;
    // The options of a drawing as the command line would give them.
    let words = ["plotplan", "tune", "--machine", "x", "--drawing", "x", "--shrink"];
    let arguments = crate::cli::Arguments::try_parse_from(words);
    let Ok(crate::cli::Arguments { command: crate::cli::Command::Tune(options), .. }) = arguments else {
        return Err(Failure::Usage(anyhow::anyhow!("the test pattern needs --shrink")));
    };
    let input = Input {
        name: "test pattern".into(),
        path: "test pattern".into(),
        bytes: tune::TEST_PATTERN.to_vec(),
    };
    load_drawing(&Inputs::of(input), machine, &options.reading, &options.planning)
}

fn from_step(file: &str) -> Result<(), Failure> {
    let input = input::read(file)?;
    let text = String::from_utf8_lossy(&input.bytes);
    let record = tune::read_record(&text)
        .map_err(|what| Failure::Drawing(anyhow::anyhow!("{}: {what}", input.name)))?;
    let found = simulation::identify(&record)
        .with_context(|| format!("{} cannot be used", input.name))
        .map_err(Failure::Drawing)?;
    let report = tuning::MotorEstimates::of(&found);
    let (text, open) = (report.text(record.len()), report.advice());
    session::report(|all| all.motor = Some(report));
    output::report(&text)?;
    let Some(what) = open else { return Ok(()) };
    terminal::error(Code::Undetermined, &format!("{}: {what}", input.name));
    Err(Failure::Refused)
}
