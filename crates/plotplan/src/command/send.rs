//! `plotplan send`: a plan to a machine.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use anyhow::Context as _;
use backends::pen_plotter::plotter::{Handshake, Plotter};
use backends::{Backend, Outcome, PlanSource, Program, ProgramError, RowIter, Session, SessionOptions};
use compiler::import;
use compiler::report::text::pluralize;
use compiler::report::{Code, SendEnd, SendReport, SendUnit};
use kinematics::Machine;
use plan::TickTable;
use serialport::FlowControl;

use super::homing;
use crate::cli::{Flow, Send};
use crate::failure::Failure;
use crate::input::{self, Input};
use crate::port::Settings;
use crate::wire::Wire;
use crate::{machines, output, session, terminal};

pub(crate) fn run(arguments: &Send) -> Result<(), Failure> {
    let backend = arguments.protocol.0;
    if let Some(what) = arguments.pen.wrong_positions() {
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    }
    let input = input::read(&arguments.plan)?;
    let (program, machine) = program(arguments, backend, &input)?;
    if arguments.dry_run {
        return dry_run(arguments, &from_row(arguments, &program, None)?);
    }
    let Some(path) = &arguments.port else {
        return Err(Failure::Usage(anyhow::anyhow!("no port given: use --port PATH, or --dry-run")));
    };
    let flow = match arguments.flow {
        Flow::None => FlowControl::None,
        Flow::Hardware => FlowControl::Hardware,
        Flow::Software => FlowControl::Software,
    };
    let settings = Settings { path: path.clone(), baud: arguments.baud, flow };
    // A row that does not exist is no reason to open the port.
    from_row(arguments, &program, None)?;
    let options = session_options(arguments)?;
    check_handshake(&options)?;
    if let Some(why) = backend.fault(&program, &options) {
        return Err(Failure::Drawing(anyhow::anyhow!(why)));
    }
    let mut wire = Wire::open(settings, arguments.log.as_deref())?;
    match &machine {
        Some(machine) => {
            homing::ensure(arguments.datum, arguments.from.is_some(), backend, machine, &mut wire)?;
        }
        None if arguments.datum.home => {
            return Err(Failure::Usage(anyhow::anyhow!("--home: give the machine file with --machine")));
        }
        None => {}
    }
    let program = match (arguments.from, backend.status()) {
        (Some(row), Some(status)) => {
            let position = wire.query_position(status)?;
            let found = position.and_then(|position| program.row_at_position(row, position));
            if let Some(found) = found.filter(|found| *found != row) {
                terminal::say(&format!(
                    "the machine has reached {} {found}: resuming from there\n",
                    backend.row_name()
                ));
            }
            let position = position.or(program.start_position());
            program.from_row(found.unwrap_or(row), position).map_err(|error| Failure::Usage(error.into()))?
        }
        _ => from_row(arguments, &program, None)?,
    };
    let Some(mut session) = backend.session(program, &options) else {
        return Err(Failure::Usage(anyhow::anyhow!("{} cannot be sent", backend.name())));
    };
    // Standard input has the plan, or the operator's keys.
    let outcome = wire.run(&mut *session, arguments.reconnect, arguments.plan != "-");
    session::report(|report| report.sending = Some(sent(arguments, path, backend, &outcome, &*session)));
    report(&outcome, &*session, wire.is_interrupted(), backend.row_name())
}

/// How the session sends.
fn session_options(arguments: &Send) -> Result<SessionOptions, Failure> {
    Ok(SessionOptions {
        window: arguments.window,
        lead_us: (arguments.lead * 1e6).round() as u64,
        plotter: plotter(arguments.plotter.as_deref())?.map(Arc::new),
        handshake: Some(match arguments.flow {
            Flow::None => Handshake::Polling,
            Flow::Hardware => Handshake::Hardware,
            Flow::Software => Handshake::XonXoff,
        }),
    })
}

/// The plotter of this name, or the one that this file describes.
pub(super) fn plotter(name: Option<&str>) -> Result<Option<Plotter>, Failure> {
    let Some(name) = name else { return Ok(None) };
    if !Path::new(name).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
        return Plotter::named(name).cloned().map(Some).map_err(|error| Failure::Usage(error.into()));
    }
    let bytes = input::read_file(Path::new(name)).with_context(|| format!("cannot read {name}"));
    let text = String::from_utf8_lossy(&bytes.map_err(Failure::Io)?).into_owned();
    Plotter::parse(name, &text).map(Some).map_err(|error| Failure::Usage(error.into()))
}

/// Refuses a handshake that the plotter does not have.
fn check_handshake(options: &SessionOptions) -> Result<(), Failure> {
    let (Some(plotter), Some(handshake)) = (&options.plotter, options.handshake) else { return Ok(()) };
    if plotter.has(handshake) {
        return Ok(());
    }
    let known: Vec<&str> = plotter
        .handshakes
        .iter()
        .map(|handshake| match handshake {
            Handshake::Polling => "--flow none (polling)",
            Handshake::XonXoff => "--flow software",
            Handshake::Hardware => "--flow hardware",
        })
        .collect();
    let what = format!("{} is not sent to without flow control: use {}", plotter.title, known.join(" or "));
    Err(Failure::Usage(anyhow::anyhow!(what)))
}

/// The program from the row where it is to begin.
fn from_row(arguments: &Send, program: &Program, position: Option<[i64; 2]>) -> Result<Program, Failure> {
    let Some(row) = arguments.from else { return Ok(program.clone()) };
    program.from_row(row, position).map_err(|error| {
        let is_strokes = arguments.protocol.0.row_name() == "stroke";
        Failure::Usage(match error {
            ProgramError::NoRow { row, last } if is_strokes => {
                let strokes = pluralize(last as usize, "stroke");
                anyhow::anyhow!("the drawing has {strokes}: --from takes 0 to {last}, not {row}")
            }
            error => error.into(),
        })
    })
}

/// What is sent: the lines of a plan, or those of a file in the machine's own language.
fn program(
    arguments: &Send,
    backend: &dyn Backend,
    input: &Input,
) -> Result<(Program, Option<Machine>), Failure> {
    if !plan::file::is_plan(&input.bytes) {
        if backend.name() == "hpgl" {
            refuse_other_drawings(input)?;
        }
        let what = || format!("{} is not a plan; this protocol sends plans (ticks, csv or json)", input.path);
        let program = backend.parse_program(&input.bytes);
        let program = program.ok_or_else(|| Failure::Drawing(anyhow::anyhow!(what())))?;
        let machine = arguments.machine.as_deref().map(machines::machine).transpose()?;
        return Ok((program, machine.map(|machine| machine.machine)));
    }
    let (table, machine) = if backend.needs_machine() {
        let (plan, machine) = super::verify::plan(input, arguments.machine.as_deref())?;
        (plan.table, Some(machine.machine))
    } else {
        let plan = plan::file::read(&input.bytes);
        let plan = plan.with_context(|| format!("{} is not a plan that can be used", input.path));
        // Its machine has the pulses of the pen's servo, if it is known.
        let machine = super::verify::plan(input, arguments.machine.as_deref()).ok();
        (plan.map_err(Failure::Drawing)?.table, machine.map(|(_, machine)| machine.machine))
    };
    warn_of_losses(backend, &table);
    let rows = || -> RowIter<'_> {
        Box::new(table.rows.iter().map(|row| (*row, row.ticks.map(|ticks| ticks as f64))))
    };
    let mut source = PlanSource::new(&table.header, &rows);
    if let Some(machine) = &machine {
        source = source.on_machine(machine);
    }
    let mut encode = arguments.pen.encode_options();
    encode.legacy_moves = arguments.stepper_moves;
    let unfit = |error: ProgramError| Failure::Drawing(error.into());
    let program = backend.program(&source, &encode).map_err(unfit)?;
    let program = match &machine {
        Some(machine) => program.on_machine(machine),
        None => program,
    };
    warn_of_play(arguments, &program, machine.as_ref());
    Ok((program, machine))
}

/// Refuses what a plotter cannot be sent: anything but HP-GL.
fn refuse_other_drawings(input: &Input) -> Result<(), Failure> {
    let document = import::read(&input.bytes, &import::Options::default())
        .map_err(|error| Failure::Drawing(anyhow::Error::new(error).context(input.name.clone())))?;
    if document.format == "HP-GL" {
        return Ok(());
    }
    let what = format!(
        "{} is {}; a plotter takes HP-GL: plotplan convert --format hpgl --plotter NAME writes it",
        input.name, document.format
    );
    Err(Failure::Drawing(anyhow::anyhow!(what)))
}

/// Warns where the machine will not receive the plan's pens.
fn warn_of_losses(backend: &dyn Backend, table: &TickTable) {
    let mut pens: Vec<u16> = table.rows.iter().map(|row| row.pen).filter(|pen| *pen != 0).collect();
    pens.sort_unstable();
    pens.dedup();
    for loss in backend.losses(&table.header, &pens) {
        terminal::warning(Code::FormatLoss, &loss.to_string());
    }
}

/// Warns that a plan in the machine's own language is resumed without taking up the backlash.
fn warn_of_play(arguments: &Send, program: &Program, machine: Option<&Machine>) {
    let has_play = machine.is_some_and(Machine::has_backlash);
    if arguments.from.is_some() && has_play && program.table().is_none() {
        terminal::warning(
            Code::FormatLoss,
            "the backlash is not taken up where this plan is resumed: ink may be off by it until each motor has \
             reversed",
        );
    }
}

/// Every line with the time at which it is sent if the machine keeps to the plan.
fn dry_run(arguments: &Send, program: &Program) -> Result<(), Failure> {
    let lead_us = arguments.protocol.0.lead_us((arguments.lead * 1e6).round() as u64);
    output::write("-", |out| {
        let mut clock_us: u64 = 0;
        for line in &program.lines {
            let at_us = clock_us.saturating_sub(lead_us);
            writeln!(out, "{}.{:03} {}", at_us / 1_000_000, at_us / 1000 % 1000, line.text.trim_end())?;
            clock_us += line.duration_us;
        }
        Ok(())
    })
}

/// What was sent, for the report.
fn sent(
    arguments: &Send,
    port: &str,
    backend: &dyn Backend,
    outcome: &Outcome,
    session: &dyn Session,
) -> SendReport {
    let progress = session.progress();
    let (end, row) = match outcome {
        Outcome::Done => (SendEnd::Done, None),
        Outcome::Stopped { row } => (SendEnd::Stopped, Some(*row)),
        Outcome::Failed { row, .. } => (SendEnd::Failed, Some(*row)),
    };
    SendReport {
        protocol: arguments.protocol.0.protocol().map_or("", |(name, _)| name).to_owned(),
        port: port.to_owned(),
        end,
        lines: progress.lines,
        of_lines: progress.of_lines,
        retransmitted: progress.retransmitted,
        acknowledged: progress.acknowledged,
        unit: if backend.row_name() == "stroke" { SendUnit::Stroke } else { SendUnit::Row },
        row: row.unwrap_or(progress.row),
        last_sent_row: progress.last_sent_row,
        resume: row.map(resume_command),
    }
}

/// Reports how it ended, and how to resume.
fn report(outcome: &Outcome, session: &dyn Session, interrupted: bool, name: &str) -> Result<(), Failure> {
    let progress = session.progress();
    let mut extra = String::new();
    if progress.retransmitted > 0 {
        let _ = write!(extra, ", {} retransmitted", progress.retransmitted);
    }
    let failed = |text: String| {
        if interrupted {
            terminal::error(Code::Interrupted, &text);
            return Err(Failure::Interrupted);
        }
        Err(Failure::Io(anyhow::anyhow!(text)))
    };
    match outcome {
        Outcome::Done => {
            let ink = progress.ink_mm.map(|[drawn, _]| format!(", {} m of ink drawn", drawn as f64 / 1000.0));
            let ink = ink.unwrap_or_default();
            terminal::say(&format!("sent {} lines{extra}{ink}\n", progress.lines));
            Ok(())
        }
        Outcome::Stopped { row } if !progress.acknowledged => {
            terminal::always(&format!(
                "stopped after sending everything up to {name} {row}; the machine acknowledged nothing. Check that the pen is up, then resume with\n  {}\n",
                resume_command(*row)
            ));
            Err(Failure::Interrupted)
        }
        Outcome::Stopped { row } => {
            terminal::always(&format!(
                "stopped at {name} {row} with the pen up{extra}; resume with\n  {}\n",
                resume_command(*row)
            ));
            Err(Failure::Interrupted)
        }
        Outcome::Failed { row, why, .. } if !progress.acknowledged => {
            let text = format!(
                "{why}; the machine acknowledged nothing. Check that the pen is up, then start again with\n  {}",
                resume_command(*row)
            );
            failed(text)
        }
        Outcome::Failed { row, last_sent_row, why } => {
            let unsure = if last_sent_row > row {
                format!(" (it may have reached {name} {last_sent_row})")
            } else {
                String::new()
            };
            let text = format!(
                "{why}; the machine has acknowledged everything up to {name} {row}{unsure}. Check that the pen is up, then resume with\n  {}",
                resume_command(*row)
            );
            failed(text)
        }
    }
}

/// This command line again, from a row on.
fn resume_command(row: u64) -> String {
    let mut words = vec!["plotplan".to_owned()];
    let mut arguments = std::env::args().skip(1);
    while let Some(word) = arguments.next() {
        if word == "--from" {
            arguments.next();
        } else if !word.starts_with("--from=") {
            let plain = word.bytes().all(|b| b.is_ascii_alphanumeric() || b"-_./:=,+@%".contains(&b));
            words.push(if plain { word } else { format!("'{}'", word.replace('\'', "'\\''")) });
        }
    }
    format!("{} --from {row}", words.join(" "))
}
