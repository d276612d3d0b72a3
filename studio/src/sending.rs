//! Sending from the page: the conversations of `plotplan send`, bytes in, bytes out, time passed in.
//!
//! The page owns the port and the clock ([Web Serial](https://wicg.github.io/serial/)). Whatever it reads goes
//! to [`Sending::step`], whose bytes it writes; [`Step::wake_us`] is when the next step is due.

use std::fmt;

use backends::homing::HomingRun;
use backends::{
    Backend, EncodeOptions, Outcome, PlanSource, PositionQuery, Program, Progress, ReportedPosition, RowIter,
    Session, SessionOptions, Waiting,
};
use kinematics::{HomingMethod, Machine};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::job::MachineChoice;
use crate::problem::{About, Problem, Problems};

/// Homing is polled at this interval, as in the program, microseconds.
const POLL_US: u64 = 100_000;
/// A machine that never answered is not waited for any longer than this after Stop, microseconds.
const SILENT_STOP_US: u64 = 300_000;
/// `send --lead` without the option, microseconds.
const LEAD_US: u64 = 200_000;

/// How a plan is to be sent: the options of `plotplan send`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SendJob {
    /// `--protocol`
    pub protocol: String,
    /// The machine.
    pub machine: MachineChoice,
    /// `--from`
    pub from: Option<u64>,
    /// What is known of the machine's position.
    pub datum: Datum,
    /// `--reconnect`, seconds.
    pub reconnect_s: f64,
}

impl Default for SendJob {
    fn default() -> Self {
        Self {
            protocol: String::new(),
            machine: MachineChoice::default(),
            from: None,
            datum: Datum::Ask,
            reconnect_s: 60.0,
        }
    }
}

/// What is known of the machine's position before a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Datum {
    /// The machine is asked.
    #[default]
    Ask,
    /// `--home`
    Home,
    /// `--assume-homed`
    Assume,
}

/// What happened at the page's end of the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Event {
    /// Bytes came, or time has passed.
    #[default]
    Time,
    /// Pause at the next pen-up.
    Pause,
    /// The operator confirmed.
    Resume,
    /// Stop: decelerate and lift.
    Stop,
    /// The port is away.
    Lost,
    /// It is open again.
    Reconnected,
}

/// Where the conversation is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// The operator is to bring the machine into its pose.
    Pose,
    /// The machine homes.
    Homing,
    /// The machine is asked where it is.
    Asking,
    /// Lines are sent.
    Sending,
    /// The session pauses at the next pen-up.
    Pausing,
    /// The pen is up and the session waits for the operator.
    Paused,
    /// The machine waits for the operator, for instance for another pen.
    Waiting,
    /// The session decelerates and lifts the pen.
    Stopping,
    /// The port is away.
    Lost,
    /// The machine has done everything.
    Done,
    /// Stopped on request.
    Stopped,
    /// The session cannot continue.
    Failed,
}

/// What the page does next.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Bytes to write.
    pub bytes: Vec<u8>,
    /// When [`Sending::step`] is to be called again if nothing happens, microseconds; `None` once it has ended.
    pub wake_us: Option<u64>,
    /// Where the conversation is.
    pub phase: Phase,
    /// The same, for the page: phase, text, progress, the row to resume from.
    pub state: Value,
}

/// What the conversation does now.
enum Talk {
    Pose(String),
    Homing(HomingRun),
    /// Asked whether the machine knows where it is.
    Datum(PositionQuery),
    /// Asked where it is, to resume there.
    Position(PositionQuery),
    Session(Box<dyn Session>),
    Ended(End),
}

/// How it ended.
struct End {
    phase: Phase,
    text: String,
    /// The row to resume from.
    row: Option<u64>,
    /// How far it came, if a session had begun.
    progress: Option<Progress>,
}

/// A conversation with one machine.
pub struct Sending {
    backend: &'static dyn Backend,
    program: Program,
    from: Option<u64>,
    reconnect_us: u64,
    talk: Talk,
    is_pausing: bool,
    /// Whether the machine has sent anything.
    has_heard: bool,
    stopped_us: Option<u64>,
    lost_us: Option<u64>,
}

impl fmt::Debug for Sending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sending").field("backend", &self.backend).finish_non_exhaustive()
    }
}

fn wrong(what: impl Into<String>) -> Problems {
    Problem::new(About::Plan, what).into()
}

/// A protocol of `send`, for the page's list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ProtocolInfo {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
    /// The output that is sent: a format of [`crate::formats`].
    pub format: &'static str,
    /// Whether the studio can emulate the machine.
    pub is_emulated: bool,
}

/// All protocols of `send --protocol`, in the order of its help.
pub fn protocols() -> Vec<ProtocolInfo> {
    let protocols = backends::ALL.iter().filter_map(|backend| Some((backend, backend.protocol()?)));
    protocols
        .map(|(backend, (name, about))| ProtocolInfo {
            name,
            about,
            format: if name == "hpgl" { "hpgl" } else { "ticks" },
            is_emulated: backend.emulator_help().is_some(),
        })
        .collect()
}

/// The backend with this protocol.
pub(crate) fn backend_of(protocol: &str) -> Result<&'static dyn Backend, Problems> {
    let mut all = backends::ALL.iter().copied();
    let found = all.find(|backend| backend.protocol().is_some_and(|(name, _)| name == protocol));
    found.ok_or_else(|| {
        let about = Problem::new(About::Option, format!("no protocol is called {protocol}"));
        Problem { option: Some("protocol"), ..about }.into()
    })
}

/// The program that is sent: the lines of a plan, or those of a file in the machine's own language.
fn program(backend: &dyn Backend, machine: &Machine, file: &[u8]) -> Result<Program, Problems> {
    if !plan::file::is_plan(file) {
        let what = "this protocol sends plans (ticks, csv or json)";
        return backend.parse_program(file).ok_or_else(|| wrong(what));
    }
    let table = plan::file::read(file).map_err(|error| wrong(error.to_string()))?.table;
    let rows = || -> RowIter<'_> {
        Box::new(table.rows.iter().map(|row| (*row, row.ticks.map(|ticks| ticks as f64))))
    };
    let source = PlanSource::new(&table.header, &rows).on_machine(machine);
    let program = backend.program(&source, &EncodeOptions::default());
    program.map(|program| program.on_machine(machine)).map_err(|error| wrong(error.to_string()))
}

impl Sending {
    /// A conversation that sends `file`, a plan or a file in the machine's own language.
    ///
    /// # Errors
    /// What cannot be sent, and why.
    pub fn new(job: &SendJob, file: &[u8]) -> Result<Self, Problems> {
        let backend = backend_of(&job.protocol)?;
        let (_, machine) = job.machine.read()?;
        let program = program(backend, &machine, file)?;
        if let Some(why) = backend.fault(&program, &session_options()) {
            return Err(wrong(why));
        }
        let mut sending = Self {
            backend,
            program,
            from: job.from,
            reconnect_us: (job.reconnect_s * 1e6) as u64,
            talk: Talk::Ended(End { phase: Phase::Failed, text: String::new(), row: None, progress: None }),
            is_pausing: false,
            has_heard: false,
            stopped_us: None,
            lost_us: None,
        };
        // A row that does not exist is no reason to open the port.
        sending.rest(None)?;
        sending.talk = match sending.first(&machine, job.datum)? {
            Some(talk) => talk,
            None => sending.after_datum()?,
        };
        Ok(sending)
    }

    /// The program from the row where it is to begin.
    fn rest(&self, position: Option<[i64; 2]>) -> Result<Program, Problems> {
        let Some(row) = self.from else { return Ok(self.program.clone()) };
        let found = position.and_then(|position| self.program.row_at_position(row, position));
        let position = position.or(self.program.start_position());
        let wrong = |error: backends::ProgramError| Problem {
            option: Some("from"),
            ..Problem::new(About::Option, error.to_string())
        };
        self.program.from_row(found.unwrap_or(row), position).map_err(|error| wrong(error).into())
    }

    /// How the machine's position is made sure of; `None` where nothing is to be done.
    fn first(&self, machine: &Machine, datum: Datum) -> Result<Option<Talk>, Problems> {
        let backend = self.backend;
        let Some(homing) = &machine.parts().homing else {
            let what = format!("the machine file of {} has no [homing]", machine.name());
            return if datum == Datum::Home { Err(wrong(what)) } else { Ok(None) };
        };
        let is_known = backend.homes_itself() || (self.from.is_some() && !backend.knows_datum());
        match (datum, &homing.method) {
            (Datum::Assume, _) => Ok(None),
            (Datum::Ask, _) if is_known => Ok(None),
            (Datum::Home, HomingMethod::Pose(pose)) => Ok(Some(Talk::Pose(pose.clone()))),
            (Datum::Home, HomingMethod::Moves(_)) => {
                let what = "this protocol cannot home: home the machine by other means, and choose that it stands in its start pose";
                let steps = backend.homing(machine).ok_or_else(|| wrong(what))?;
                Ok(Some(Talk::Homing(HomingRun::new(steps, homing))))
            }
            (Datum::Ask, _) => {
                let status = backend.status().filter(|_| backend.knows_datum());
                let what = "this protocol cannot report whether the machine was homed: home it first, or choose that it stands in its start pose";
                Ok(Some(Talk::Datum(PositionQuery::new(status.ok_or_else(|| wrong(what))?))))
            }
        }
    }

    /// Once the machine's datum is known: a plan that is resumed begins where the machine is.
    fn after_datum(&self) -> Result<Talk, Problems> {
        match self.backend.status().filter(|_| self.from.is_some()) {
            Some(status) => Ok(Talk::Position(PositionQuery::new(status))),
            None => self.session(None),
        }
    }

    fn session(&self, position: Option<[i64; 2]>) -> Result<Talk, Problems> {
        let session = self.backend.session(self.rest(position)?, &session_options());
        let what = || wrong(format!("{} cannot be sent", self.backend.name()));
        session.map(Talk::Session).ok_or_else(what)
    }

    /// Takes what was received and what happened; returns what is to be written. `is_clear` is whether everything
    /// written before has left.
    pub fn step(&mut self, now_us: u64, event: Event, received: &[u8], is_clear: bool) -> Step {
        self.has_heard |= !received.is_empty();
        match event {
            Event::Lost => self.lost_us = self.lost_us.or(Some(now_us)),
            Event::Reconnected => self.lost_us = None,
            Event::Stop if self.stopped_us.is_none() => self.stopped_us = Some(now_us),
            _ => {}
        }
        let (bytes, wake_us) = if matches!(self.talk, Talk::Session(_)) {
            self.step_session(now_us, event, received, is_clear)
        } else {
            let bytes = self.step_before(now_us, event, received);
            // A session that has just begun has something to send.
            let is_begun = matches!(self.talk, Talk::Session(_));
            (bytes, if is_begun { now_us } else { now_us + POLL_US })
        };
        let phase = self.phase();
        let has_ended = matches!(self.talk, Talk::Ended(_));
        Step { bytes, wake_us: (!has_ended).then_some(wake_us), phase, state: self.state(phase) }
    }

    /// Pose, homing and questions, before the session.
    fn step_before(&mut self, now_us: u64, event: Event, received: &[u8]) -> Vec<u8> {
        if matches!(self.talk, Talk::Ended(_)) {
            return Vec::new();
        }
        if self.lost_us.is_some() {
            self.fail("the port was lost");
            return Vec::new();
        }
        if event == Event::Stop {
            let bytes = if let Talk::Homing(run) = &mut self.talk { run.abort() } else { Vec::new() };
            self.end(Phase::Stopped, "Stopped before anything was drawn.".to_owned(), self.from);
            return bytes;
        }
        let mut bytes = Vec::new();
        let mut next = None;
        match &mut self.talk {
            Talk::Pose(_) if event == Event::Resume => next = Some(self.after_datum()),
            Talk::Homing(run) => {
                run.receive(received);
                bytes = run.transmit(now_us);
                match run.outcome() {
                    Some(Ok(())) => next = Some(self.after_datum()),
                    Some(Err(why)) => next = Some(Err(wrong(why.clone()))),
                    None => {}
                }
            }
            Talk::Datum(query) => {
                query.receive(received);
                bytes = query.transmit(now_us);
                next = query.found().cloned().map(|found| match found {
                    ReportedPosition::At(_) => self.after_datum(),
                    ReportedPosition::Unknown => Err(wrong(
                        "the machine does not know where it is: home it first, or choose that it stands in its start pose",
                    )),
                    other => Err(unknown(other)),
                });
            }
            Talk::Position(query) => {
                query.receive(received);
                bytes = query.transmit(now_us);
                next = query.found().cloned().map(|found| match found {
                    ReportedPosition::At(at) => self.session(Some(at)),
                    ReportedPosition::Unknown => self.session(None),
                    other => Err(unknown(other)),
                });
            }
            Talk::Pose(_) | Talk::Session(_) | Talk::Ended(_) => {}
        }
        match next {
            Some(Ok(talk)) => self.talk = talk,
            Some(Err(problems)) => self.fail(&problems.to_string()),
            None => {}
        }
        bytes
    }

    fn step_session(&mut self, now_us: u64, event: Event, received: &[u8], is_clear: bool) -> (Vec<u8>, u64) {
        let is_again = event == Event::Stop && self.stopped_us.is_some_and(|at_us| at_us < now_us);
        let Talk::Session(session) = &mut self.talk else { return (Vec::new(), now_us) };
        match event {
            Event::Stop if !is_again => session.stop(now_us),
            Event::Pause => {
                session.pause();
                self.is_pausing = true;
            }
            Event::Resume => {
                session.resume(now_us);
                self.is_pausing = false;
            }
            Event::Reconnected => session.reconnected(now_us),
            Event::Time | Event::Stop | Event::Lost => {}
        }
        if !received.is_empty() {
            session.receive(received, now_us);
        }
        let is_clear = is_clear && self.lost_us.is_none();
        let bytes = if is_clear { session.transmit(now_us) } else { Vec::new() };
        let wake_us = session.wake_us().filter(|_| is_clear).unwrap_or(u64::MAX).min(now_us + POLL_US);
        let outcome = session.outcome().filter(|_| is_clear).cloned();
        if let Some(outcome) = outcome {
            self.ended(outcome);
        } else if is_again {
            self.fail("interrupted again before the machine was at rest");
        } else if self.lost_us.is_some_and(|at_us| now_us - at_us > self.reconnect_us) {
            self.fail("the port was lost");
        } else if self.stopped_us.is_some_and(|at_us| now_us - at_us >= SILENT_STOP_US)
            && (!self.has_heard || !is_clear)
        {
            let why = if self.lost_us.is_some() {
                "the port was lost"
            } else if is_clear {
                "the machine never answered"
            } else {
                "the port takes no more bytes"
            };
            self.fail(&format!("interrupted; {why}"));
        }
        (bytes, wake_us)
    }

    fn end(&mut self, phase: Phase, text: String, row: Option<u64>) {
        let progress = if let Talk::Session(session) = &self.talk { Some(session.progress()) } else { None };
        self.talk = Talk::Ended(End { phase, text, row, progress });
    }

    /// Ends in the middle, with what is known of the row.
    fn fail(&mut self, why: &str) {
        match &self.talk {
            Talk::Session(session) => {
                let progress = session.progress();
                let (row, last_sent_row) = (progress.row, progress.last_sent_row);
                self.ended(Outcome::Failed { row, last_sent_row, why: why.to_owned() });
            }
            _ => self.end(Phase::Failed, format!("{}.", capitalized(why)), self.from),
        }
    }

    fn ended(&mut self, outcome: Outcome) {
        let Talk::Session(session) = &self.talk else { return };
        let progress = session.progress();
        let name = self.backend.row_name();
        let again = match progress.retransmitted {
            0 => String::new(),
            count => format!(", {count} of them sent again"),
        };
        let unheard = "the machine acknowledged nothing. Check that the pen is up.";
        match outcome {
            Outcome::Done => {
                self.end(Phase::Done, format!("Sent {} lines{again}.", progress.lines), None);
            }
            Outcome::Stopped { row } => {
                let text = if progress.acknowledged {
                    format!("Stopped at {name} {row} with the pen up{again}.")
                } else {
                    format!("Stopped after sending everything up to {name} {row}; {unheard}")
                };
                self.end(Phase::Stopped, text, Some(row));
            }
            Outcome::Failed { row, last_sent_row, why } => {
                let unsure = if last_sent_row > row {
                    format!(" (it may have reached {name} {last_sent_row})")
                } else {
                    String::new()
                };
                let known = if progress.acknowledged {
                    format!(
                        "the machine has acknowledged everything up to {name} {row}{unsure}. Check that the pen is up."
                    )
                } else {
                    unheard.to_owned()
                };
                self.end(Phase::Failed, format!("{}; {known}", capitalized(&why)), Some(row));
            }
        }
    }

    fn phase(&self) -> Phase {
        match &self.talk {
            Talk::Ended(end) => end.phase,
            _ if self.lost_us.is_some() => Phase::Lost,
            Talk::Pose(_) => Phase::Pose,
            Talk::Homing(_) => Phase::Homing,
            Talk::Datum(_) | Talk::Position(_) => Phase::Asking,
            Talk::Session(_) if self.stopped_us.is_some() => Phase::Stopping,
            Talk::Session(session) => match session.waiting_for() {
                Some(Waiting::Machine(_)) => Phase::Waiting,
                Some(Waiting::Operator) => Phase::Paused,
                None if self.is_pausing => Phase::Pausing,
                None => Phase::Sending,
            },
        }
    }

    fn state(&self, phase: Phase) -> Value {
        let session = if let Talk::Session(session) = &self.talk { Some(session) } else { None };
        let text = match &self.talk {
            Talk::Ended(end) => end.text.clone(),
            Talk::Pose(pose) => format!("{}, then continue.", capitalized(pose)),
            _ => match (phase, session.and_then(|session| session.waiting_for())) {
                (Phase::Waiting, Some(Waiting::Machine(comment))) if !comment.is_empty() => {
                    format!("The machine waits: {comment}, then continue.")
                }
                (Phase::Waiting, _) => {
                    "The machine waits for a pen change. Continue when it is done.".to_owned()
                }
                (Phase::Homing, _) => "The machine homes.".to_owned(),
                (Phase::Asking, _) => "The machine is asked where it is.".to_owned(),
                (Phase::Pausing, _) => "Pausing at the next pen-up.".to_owned(),
                (Phase::Paused, _) => "Paused with the pen up.".to_owned(),
                (Phase::Stopping, _) => "Stopping: the pen goes up.".to_owned(),
                (Phase::Lost, _) => {
                    "The port is away. Plug it in again: sending goes on by itself.".to_owned()
                }
                _ => session.and_then(|session| session.progress().note).unwrap_or("Sending.").to_owned(),
            },
        };
        let row = if let Talk::Ended(end) = &self.talk { end.row } else { None };
        let progress = match &self.talk {
            Talk::Session(session) => Some(session.progress()),
            Talk::Ended(end) => end.progress,
            _ => None,
        };
        let progress = progress.map(|progress| {
            json!({
                "lines": progress.lines,
                "of_lines": progress.of_lines,
                "done_us": progress.done_us,
                "of_us": progress.of_us,
                "row": progress.row,
                "retransmitted": progress.retransmitted,
                "ink_mm": progress.ink_mm,
            })
        });
        json!({ "phase": phase, "text": text, "progress": progress, "row": row })
    }
}

fn session_options() -> SessionOptions {
    SessionOptions { lead_us: LEAD_US, ..SessionOptions::default() }
}

/// The machine does not answer, or with an alarm.
fn unknown(found: ReportedPosition) -> Problems {
    match found {
        ReportedPosition::Alarm(what) => wrong(what),
        _ => wrong("the machine does not answer the query for its position"),
    }
}

fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| format!("{}{}", first.to_uppercase(), letters.as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EmulateJob, Emulated, Job, Kind, Options, Studio};

    /// A small drawing, in what the protocol sends, for the first preset that it is for.
    fn file(protocol: &ProtocolInfo) -> (MachineChoice, Vec<u8>) {
        let mut studio = Studio::default();
        studio.open("a.hpgl", b"IN;SP1;PU400,400;PD1200,400,1200,800;PU;PU400,800;PD600,900;PU;");
        let mut presets = compiler::machine_file::PRESETS.iter();
        presets
            .find_map(|preset| {
                let machine = MachineChoice { name: preset.name.to_owned(), toml: String::new() };
                // A plotter's paper is smaller than the sheets of most machines.
                let options = Options { fit: protocol.format != "hpgl", ..Options::default() };
                let job = Job { machine: machine.clone(), options, draft: false };
                let bytes = studio.output(&job, Kind::Format(protocol.format), &|_| {}).ok()?.bytes;
                let job = send_job(protocol.name, &machine);
                Sending::new(&job, &bytes).ok().map(|_| (machine, bytes))
            })
            .unwrap_or_else(|| panic!("no machine for {}", protocol.name))
    }

    fn send_job(protocol: &str, machine: &MachineChoice) -> SendJob {
        let (protocol, machine) = (protocol.to_owned(), machine.clone());
        SendJob { protocol, machine, datum: Datum::Assume, ..SendJob::default() }
    }

    fn emulated(protocol: &str, machine: &MachineChoice) -> Emulated {
        let (protocol, machine) = (protocol.to_owned(), machine.clone());
        Emulated::new(&EmulateJob { protocol, machine, homed: true }).unwrap()
    }

    /// Both ends in memory until the conversation has ended. `act` is asked for what happens before each step.
    fn run(
        sending: &mut Sending,
        machine: &mut Emulated,
        from_us: u64,
        act: &mut dyn FnMut(u64, &Step) -> Event,
    ) -> (Step, u64) {
        let (mut now_us, mut event) = (from_us, Event::Time);
        let mut received = Vec::new();
        let mut is_away = false;
        for _ in 0..200_000 {
            is_away = event == Event::Lost || (is_away && event != Event::Reconnected);
            let step = sending.step(now_us, event, if is_away { &[] } else { &received }, true);
            if step.wake_us.is_none() {
                return (step, now_us);
            }
            let (found, answers) = machine.step(now_us, &step.bytes);
            received = answers;
            let wake_us = found["wake_us"].as_u64().unwrap_or(u64::MAX).min(step.wake_us.unwrap_or(u64::MAX));
            now_us = if received.is_empty() { wake_us.max(now_us + 200) } else { now_us + 200 };
            event = act(now_us, &step);
        }
        panic!("it never ends")
    }

    #[test]
    fn every_emulated_protocol_draws_what_the_program_draws() {
        let mut count = 0;
        for protocol in protocols().iter().filter(|protocol| protocol.is_emulated) {
            let (choice, bytes) = file(protocol);
            let mut machine = emulated(protocol.name, &choice);
            let mut sending = Sending::new(&send_job(protocol.name, &choice), &bytes).unwrap();
            let (step, _) = run(&mut sending, &mut machine, 0, &mut |_, _| Event::Time);
            assert_eq!(step.phase, Phase::Done, "{}: {}", protocol.name, step.state);
            // The session of the program, with the same emulated machine.
            let backend = backend_of(protocol.name).unwrap();
            let (_, kinematic) = choice.read().unwrap();
            let program = program(backend, &kinematic, &bytes).unwrap();
            let mut session = backend.session(program, &session_options()).unwrap();
            let ticks = kinematic.motor_positions(&kinematic.start());
            let options = backends::EmulatorOptions {
                start: Some([ticks[0].round() as i64, ticks[1].round() as i64]),
                homed: true,
                ..backends::EmulatorOptions::default()
            };
            let mut wired = backends::FaultInjector::new(backend.emulator(&options).unwrap(), Vec::new());
            backends::simulate::run(&mut *session, &mut wired, 0, None, 3_600_000_000);
            let wanted = crate::emulated::ink_text(wired.device().ink());
            assert!(wanted.lines().count() > 4, "{}: {wanted}", protocol.name);
            assert_eq!(machine.ink(), wanted, "{}", protocol.name);
            count += 1;
        }
        assert!(count >= 5, "{count} protocols");
    }

    #[test]
    fn pause_stop_and_resume_draw_everything_once() {
        let protocol = protocols().into_iter().find(|protocol| protocol.name == "ticks").unwrap();
        let (choice, bytes) = file(&protocol);
        let mut whole = emulated("ticks", &choice);
        let mut sending = Sending::new(&send_job("ticks", &choice), &bytes).unwrap();
        let (_, duration_us) = run(&mut sending, &mut whole, 0, &mut |_, _| Event::Time);
        let mut machine = emulated("ticks", &choice);
        let mut sending = Sending::new(&send_job("ticks", &choice), &bytes).unwrap();
        let (mut is_paused, mut is_stopped) = (false, false);
        let (step, now_us) = run(&mut sending, &mut machine, 0, &mut |now_us, step| {
            if step.phase == Phase::Paused {
                return Event::Resume;
            }
            if now_us > duration_us / 4 && !is_paused {
                is_paused = true;
                return Event::Pause;
            }
            if now_us > duration_us * 2 / 3 && !is_stopped {
                is_stopped = true;
                return Event::Stop;
            }
            Event::Time
        });
        assert_eq!(step.phase, Phase::Stopped, "{}", step.state);
        let row = step.state["row"].as_u64().unwrap();
        assert!(row > 0, "{}", step.state);
        let job = SendJob { from: Some(row), ..send_job("ticks", &choice) };
        let mut sending = Sending::new(&job, &bytes).unwrap();
        let (step, _) = run(&mut sending, &mut machine, now_us, &mut |_, _| Event::Time);
        assert_eq!(step.phase, Phase::Done, "{}", step.state);
        assert!(is_paused && is_stopped);
        // Where it stopped in the middle of a line of ink, the line has two parts.
        let places = |ink: &str| {
            ink.lines()
                .skip(1)
                .map(|line| line.splitn(3, ',').nth(2).unwrap().to_owned())
                .collect::<std::collections::BTreeSet<_>>()
        };
        assert_eq!(places(&machine.ink()), places(&whole.ink()));
    }

    #[test]
    fn port_away_is_waited_for_then_given_up() {
        let protocol = protocols().into_iter().find(|protocol| protocol.name == "ticks").unwrap();
        let (choice, bytes) = file(&protocol);
        for away_us in [500_000_u64, 90_000_000] {
            let mut machine = emulated("ticks", &choice);
            let mut sending = Sending::new(&send_job("ticks", &choice), &bytes).unwrap();
            let mut lost_us = None;
            let (step, _) = run(&mut sending, &mut machine, 0, &mut |now_us, step| match lost_us {
                None if now_us > 800_000 => {
                    lost_us = Some(now_us);
                    Event::Lost
                }
                Some(at_us) if step.phase == Phase::Lost && now_us > at_us + away_us => Event::Reconnected,
                _ => Event::Time,
            });
            let wanted = if away_us < 60_000_000 { Phase::Done } else { Phase::Failed };
            assert_eq!(step.phase, wanted, "{}", step.state);
        }
    }

    #[test]
    fn unknown_datum_is_refused_and_homing_mends_it() {
        let protocol = protocols().into_iter().find(|protocol| protocol.name == "ticks").unwrap();
        let (mut choice, bytes) = file(&protocol);
        let preset = choice.text().to_owned();
        choice.toml = format!("{preset}\n[homing]\npose = \"hold both arms against the stop\"\n");
        let job = SendJob { datum: Datum::Ask, ..send_job("ticks", &choice) };
        let off = EmulateJob { protocol: "ticks".to_owned(), machine: choice.clone(), homed: false };
        let mut sending = Sending::new(&job, &bytes).unwrap();
        let mut machine = Emulated::new(&off).unwrap();
        let (step, _) = run(&mut sending, &mut machine, 0, &mut |_, _| Event::Time);
        assert_eq!(step.phase, Phase::Failed);
        assert!(step.state["text"].as_str().unwrap().contains("does not know where it is"), "{}", step.state);
        let mut sending = Sending::new(&SendJob { datum: Datum::Home, ..job }, &bytes).unwrap();
        let mut asked = String::new();
        let (step, _) = run(&mut sending, &mut machine, 0, &mut |_, step| {
            if step.phase == Phase::Pose {
                step.state["text"].as_str().unwrap().clone_into(&mut asked);
                return Event::Resume;
            }
            Event::Time
        });
        assert_eq!(step.phase, Phase::Done, "{}", step.state);
        assert_eq!(asked, "Hold both arms against the stop, then continue.");
    }
}
