//! `plotplan send`: a plan to a machine that answers, or to one that does not.

use std::fmt::Write as _;
use std::io::Write as _;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use backends::asking::Asking;
use backends::blind::Blind;
use backends::locating::{Located, Locating};
use backends::numbered::Numbered;
use backends::repeating::Repeating;
use backends::{Conversation, Dialect, Outcome, Script};
use backends::{ebb, gcode};
use serialport::FlowControl;

use super::firmware;
use crate::cli::{Flow, Protocol, Send};
use crate::failure::Failure;
use crate::input::{self, Input};
use crate::port::{Event, Events, Port, Settings};
use crate::terminal::SendingProgress;
use crate::{output, terminal};

/// Lines of tick lines that are on the way at once.
const WINDOW_LINES: usize = 8;
/// Bytes that grbl's receive buffer holds, less one.
const WINDOW_BYTES: usize = 127;
/// A port that is away is looked for so often.
const LOOK_AGAIN: Duration = Duration::from_millis(100);

pub(crate) fn run(arguments: &Send) -> Result<(), Failure> {
    let input = input::read(&arguments.plan)?;
    let script = script(arguments, &input)?;
    warn_of_pens(arguments.protocol, &input);
    if arguments.dry_run {
        let script = started(arguments, &script)?;
        return dry_run(arguments, &script);
    }
    let Some(path) = &arguments.port else {
        return Err(Failure::Usage(anyhow::anyhow!(
            "to which port? Give --port, or --dry-run to see what would be sent"
        )));
    };
    let settings = Settings {
        path: path.clone(),
        baud: arguments.baud,
        flow: match arguments.flow {
            Flow::None => FlowControl::None,
            Flow::Hardware => FlowControl::Hardware,
            Flow::Software => FlowControl::Software,
        },
    };
    let events = Events::new();
    let port = Port::open(&settings, 0, &events.sender)
        .with_context(|| format!("cannot open {path}"))
        .map_err(Failure::Io)?;
    events.catch_interrupts().context("cannot catch Ctrl-C").map_err(Failure::Io)?;
    let log = match &arguments.log {
        None => None,
        Some(name) => Some(
            std::fs::File::create(name)
                .with_context(|| format!("cannot write {name}"))
                .map_err(Failure::Io)?,
        ),
    };
    let mut wire = Wire { settings, events, port: Some(port), number: 0, log, begun: now(), lost_at: None };
    let script = match arguments.from {
        Some(row) if can_be_asked(arguments.protocol) => wire.go_on(&script, row)?,
        _ => started(arguments, &script)?,
    };
    let mut conversation = conversation(arguments, script);
    let outcome = wire.talk(&mut *conversation, arguments.reconnect);
    report(&outcome, &*conversation)
}

fn can_be_asked(protocol: Protocol) -> bool {
    matches!(protocol, Protocol::Ticks | Protocol::Ebb | Protocol::Gcode)
}

/// Says so where the machine will not hear of the plan's pens.
fn warn_of_pens(protocol: Protocol, input: &Input) {
    let what = match protocol {
        Protocol::Ticks | Protocol::Paced | Protocol::Raw => return,
        Protocol::XySerial | Protocol::Ebb => {
            "this protocol knows no pens, all strokes are drawn with the same one"
        }
        Protocol::Gcode => "the machine pauses (M0) where the pen is to be changed",
    };
    let Ok(plan) = plan::file::read(&input.bytes) else { return };
    let pens: std::collections::BTreeSet<u16> = plan.table.rows.iter().map(|row| row.pen).collect();
    let pens: Vec<String> = pens.into_iter().filter(|pen| *pen != 0).map(|pen| pen.to_string()).collect();
    if pens.len() > 1 {
        terminal::warning(&format!("the plan has pens {}: {what}", pens.join(", ")));
    }
}

/// The script from where it is to begin.
fn started(arguments: &Send, script: &Script) -> Result<Script, Failure> {
    let Some(row) = arguments.from else { return Ok(script.clone()) };
    script.from_row(row, None).map_err(|error| Failure::Usage(error.into()))
}

/// What is to be said: the lines of a plan, or those of a file in the machine's own words.
fn script(arguments: &Send, input: &Input) -> Result<Script, Failure> {
    let wrong = |what: String| Failure::Drawing(anyhow::anyhow!(what));
    let unfit = |error: backends::ScriptError| Failure::Drawing(anyhow::Error::new(error));
    if !plan::file::is_plan(&input.bytes) {
        let text = String::from_utf8_lossy(&input.bytes);
        return match arguments.protocol {
            Protocol::Gcode => Ok(Script::of_lines(Dialect::Gcode, &text)),
            Protocol::XySerial => Ok(Script::of_lines(Dialect::XySerial, &text)),
            Protocol::Raw => Ok(Script::raw(&text)),
            _ => Err(wrong(format!(
                "{} is not a plan; for this protocol a plan is needed (ticks, csv or json)",
                input.name
            ))),
        };
    }
    let with_machine = || super::verify::plan(input, arguments.machine.as_deref());
    let plan_alone = || {
        plan::file::read(&input.bytes)
            .with_context(|| format!("{} is not a plan that can be used", input.name))
            .map_err(Failure::Drawing)
    };
    match arguments.protocol {
        Protocol::Ticks | Protocol::Paced | Protocol::Raw => Ok(Script::ticks(plan_alone()?.table)),
        Protocol::Ebb => {
            let moves = if arguments.stepper_moves { ebb::Moves::Stepper } else { ebb::Moves::Timed };
            Script::ebb(plan_alone()?.table, moves, firmware::ebb_pen(arguments.pen)).map_err(unfit)
        }
        Protocol::XySerial => {
            let (plan, machine) = with_machine()?;
            let rows = plan.table.rows.iter();
            let machine = &machine.machine;
            let instants = rows.map(|row| firmware::instant(machine, *row, row.ticks.map(|t| t as f64)));
            Script::xy_serial(instants).map_err(unfit)
        }
        Protocol::Gcode => {
            let (plan, machine) = with_machine()?;
            let machine = &machine.machine;
            let rows = plan.table.rows.iter();
            let instants = rows.map(|row| firmware::instant(machine, *row, row.ticks.map(|t| t as f64)));
            let options = firmware::gcode_options(gcode::Flavour::Grbl, machine, arguments.pen);
            Ok(Script::gcode(gcode::timed(instants, &options, false)))
        }
    }
}

fn conversation(arguments: &Send, script: Script) -> Box<dyn Conversation> {
    let window = arguments.window;
    match arguments.protocol {
        Protocol::Ticks => Box::new(Numbered::new(script, window.unwrap_or(WINDOW_LINES))),
        Protocol::XySerial => Box::new(Repeating::new(script)),
        Protocol::Gcode => Box::new(Asking::new(script, window.unwrap_or(WINDOW_BYTES))),
        Protocol::Ebb => Box::new(Asking::new(script, 0)),
        Protocol::Raw => Box::new(Blind::new(script, None)),
        Protocol::Paced => Box::new(Blind::new(script, Some((arguments.lead * 1e6).round() as u64))),
    }
}

/// Every line with the time at which it would be sent if the machine kept to the plan.
fn dry_run(arguments: &Send, script: &Script) -> Result<(), Failure> {
    let lead_us =
        if arguments.protocol == Protocol::Paced { (arguments.lead * 1e6).round() as u64 } else { 0 };
    output::write("-", |out| {
        let mut clock_us: u64 = 0;
        for step in &script.steps {
            let at_us = clock_us.saturating_sub(lead_us);
            writeln!(out, "{}.{:03} {}", at_us / 1_000_000, at_us / 1000 % 1000, step.text.trim_end())?;
            clock_us += step.lasts_us;
        }
        Ok(())
    })
}

/// The clock that conversations are told of.
#[allow(clippy::disallowed_methods, reason = "a conversation with a machine is about time")]
fn now() -> Instant {
    Instant::now()
}

/// A port with what was said on it.
struct Wire {
    settings: Settings,
    events: Events,
    port: Option<Port>,
    /// How often the port was opened before.
    number: u32,
    log: Option<std::fs::File>,
    begun: Instant,
    lost_at: Option<Instant>,
}

impl Wire {
    fn now_us(&self) -> u64 {
        now().duration_since(self.begun).as_micros() as u64
    }

    fn note(&mut self, direction: char, bytes: &[u8]) {
        let now_us = self.now_us();
        let Some(log) = &mut self.log else { return };
        for line in bytes.split_inclusive(|byte| matches!(byte, b'\n' | b'\r')) {
            let (seconds, us) = (now_us / 1_000_000, now_us % 1_000_000);
            let _ = writeln!(log, "{seconds}.{us:06} {direction} {}", line.escape_ascii());
        }
    }

    fn write(&mut self, bytes: &[u8]) {
        self.note('>', bytes);
        let written = self.port.as_mut().map_or(Ok(()), |port| port.write(bytes));
        if written.is_err() {
            self.lose();
        }
    }

    fn lose(&mut self) {
        if self.port.take().is_some() {
            self.lost_at = Some(now());
            self.note('!', b"the port has gone away");
        }
    }

    /// Tries to open the port again; whether it is there.
    fn look_again(&mut self) -> bool {
        match Port::open(&self.settings, self.number + 1, &self.events.sender) {
            Ok(port) => {
                self.number += 1;
                self.port = Some(port);
                self.lost_at = None;
                self.note('!', b"the port is there again");
                true
            }
            Err(_) => false,
        }
    }

    /// The rest of the script from `row` on, or from where the machine says it is, if that is a little further.
    fn go_on(&mut self, script: &Script, row: u64) -> Result<Script, Failure> {
        let usage = |error: backends::ScriptError| Failure::Usage(error.into());
        // A row that there is not is no reason to ask anybody.
        script.from_row(row, None).map_err(usage)?;
        let start = script.start();
        let (place, standing) = match self.locate(script)? {
            None => (None, start),
            Some(at) if matches!(script.dialect, Dialect::Ebb(..)) => {
                (Some(at), [0, 1].map(|motor| start[motor] + at[motor]))
            }
            Some(at) => (Some(at), at),
        };
        let found = place.and_then(|place| script.standing_row(row, place));
        if let Some(found) = found.filter(|found| *found != row) {
            terminal::say(&format!("the machine has come to row {found}: it goes on from there\n"));
        }
        script.from_row(found.unwrap_or(row), Some(standing)).map_err(usage)
    }

    /// Asks where the machine stands; nothing if it has been homed and does not know yet.
    fn locate(&mut self, script: &Script) -> Result<Option<[i64; 2]>, Failure> {
        let mut question = Locating::new(script.dialect);
        loop {
            let bytes = question.transmit(self.now_us());
            if !bytes.is_empty() {
                self.write(&bytes);
            }
            match question.found() {
                Some(Located::At(at)) => return Ok(Some(at)),
                Some(Located::Unknown) => return Ok(None),
                Some(Located::Silent) => {
                    let what = "the machine does not answer where it stands";
                    return Err(Failure::Io(anyhow::anyhow!(what)));
                }
                None => {}
            }
            let within = Duration::from_micros(question.wake_us().saturating_sub(self.now_us()));
            match self.events.next(within.min(Duration::from_millis(500))) {
                Some(Event::Heard(bytes)) => {
                    self.note('<', &bytes);
                    question.receive(&bytes);
                }
                Some(Event::Lost(_)) => {
                    return Err(Failure::Io(anyhow::anyhow!("{} has gone away", self.settings.path)));
                }
                Some(Event::Interrupted) => return Err(Failure::Interrupted),
                Some(Event::Enter) | None => {}
            }
        }
    }

    /// Lets the conversation go on until it has ended.
    fn talk(&mut self, conversation: &mut dyn Conversation, reconnect_s: f64) -> Outcome {
        let progress = SendingProgress::new(conversation.progress().of_us);
        let mut interrupts = 0;
        let mut shown = self.begun;
        let mut waits = false;
        let outcome = loop {
            if now().duration_since(shown) >= LOOK_AGAIN {
                shown = now();
                progress.show(&conversation.progress());
            }
            if conversation.waits_for_hand() != waits {
                waits = !waits;
                if waits {
                    terminal::say(
                        "the machine waits for another pen: put it in, then press Enter (or the machine's cycle start)\n",
                    );
                    self.events.wait_for_enter();
                }
            }
            if let Some(lost_at) = self.lost_at {
                if self.look_again() {
                    conversation.reconnected(self.now_us());
                } else if now().duration_since(lost_at).as_secs_f64() > reconnect_s {
                    let backends::Progress { row, at_most, .. } = conversation.progress();
                    let why = format!("{} has gone away", self.settings.path);
                    break Outcome::Failed { row, at_most, why };
                }
            }
            let clear = self.port.as_ref().is_some_and(Port::is_clear);
            let bytes = if clear { conversation.transmit(self.now_us()) } else { Vec::new() };
            if !bytes.is_empty() || self.port.as_ref().is_some_and(|port| !port.is_clear()) {
                self.write(&bytes);
            }
            if self.port.as_ref().is_some_and(Port::is_clear)
                && let Some(outcome) = conversation.outcome()
            {
                break outcome.clone();
            }
            let within = match (&self.port, conversation.wake_us()) {
                (None, _) => LOOK_AGAIN,
                (Some(port), _) if !port.is_clear() => Duration::from_millis(1),
                (_, Some(wake_us)) => Duration::from_micros(wake_us.saturating_sub(self.now_us())),
                _ => LOOK_AGAIN,
            };
            match self.events.next(within.min(LOOK_AGAIN)) {
                Some(Event::Heard(bytes)) => {
                    self.note('<', &bytes);
                    conversation.receive(&bytes, self.now_us());
                }
                Some(Event::Lost(number)) if number == self.number => {
                    if let Some(port) = &mut self.port {
                        port.forget();
                    }
                    self.lose();
                }
                Some(Event::Enter) => conversation.go_on(),
                Some(Event::Interrupted) => {
                    interrupts += 1;
                    if interrupts > 1 {
                        let backends::Progress { row, at_most, .. } = conversation.progress();
                        let why = "interrupted again before the machine was at rest".to_owned();
                        break Outcome::Failed { row, at_most, why };
                    }
                    conversation.stop(self.now_us());
                }
                _ => {}
            }
        };
        progress.finish();
        outcome
    }
}

/// Says how it ended, and what to do to go on.
fn report(outcome: &Outcome, conversation: &dyn Conversation) -> Result<(), Failure> {
    let progress = conversation.progress();
    let mut extra = String::new();
    if progress.resent > 0 {
        let _ = write!(extra, ", {} said again", progress.resent);
    }
    match outcome {
        Outcome::Done => {
            terminal::say(&format!("sent {} lines{extra}\n", progress.lines));
            Ok(())
        }
        Outcome::Stopped { row } => {
            terminal::say(&format!(
                "stopped at row {row} with the pen up{extra}; go on with\n  {}\n",
                go_on(*row)
            ));
            Err(Failure::Interrupted)
        }
        Outcome::Failed { row, at_most, why } => {
            let unsure =
                if at_most > row { format!(" (it may have got to row {at_most})") } else { String::new() };
            let text = format!(
                "{why}; the machine has taken everything up to row {row}{unsure}. See that the pen is up; go on with\n  {}",
                go_on(*row)
            );
            Err(Failure::Io(anyhow::anyhow!(text)))
        }
    }
}

/// This command line again, from a row on.
fn go_on(row: u64) -> String {
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
