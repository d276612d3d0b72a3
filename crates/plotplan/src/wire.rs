//! The sender's event loop: one session on one port.

use std::io::Write as _;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use backends::homing::HomingRun;
use backends::status::StatusProtocol;
use backends::{Outcome, PositionQuery, Progress, ReportedPosition, Session, Waiting};

use crate::failure::Failure;
use crate::keys::Keys;
use crate::port::{Event, Events, Port, Settings};
use crate::terminal::{self, SendingProgress};

/// A lost port is looked for at this interval.
const REOPEN_INTERVAL: Duration = Duration::from_millis(100);
/// A machine that never answered is not waited for any longer than this after an interrupt.
const SILENT_STOP: Duration = Duration::from_millis(300);

/// The sender's clock, which sessions run by.
#[allow(clippy::disallowed_methods, reason = "a session with a machine runs in real time")]
fn now() -> Instant {
    Instant::now()
}

/// A port with a log of what was sent and received.
pub(crate) struct Wire {
    settings: Settings,
    events: Events,
    port: Option<Port>,
    /// How many times the port was opened before.
    number: u32,
    log: Option<std::fs::File>,
    begun: Instant,
    lost_at: Option<Instant>,
    /// Whether the machine has sent anything.
    heard: bool,
    /// When SIGINT or SIGTERM arrived.
    interrupted: Option<Instant>,
}

impl Wire {
    /// Opens the port, and the log if it has a name.
    pub(crate) fn open(settings: Settings, log: Option<&str>) -> Result<Self, Failure> {
        let events = Events::new();
        let port = Port::open(&settings, 0, &events.sender)
            .with_context(|| format!("cannot open {}", settings.path))
            .map_err(Failure::Io)?;
        events.catch_interrupts().context("cannot catch Ctrl-C").map_err(Failure::Io)?;
        let log = log
            .map(|name| std::fs::File::create(name).with_context(|| format!("cannot write {name}")))
            .transpose()
            .map_err(Failure::Io)?;
        let (number, lost_at) = (0, None);
        Ok(Self {
            settings,
            events,
            port: Some(port),
            number,
            log,
            begun: now(),
            lost_at,
            heard: false,
            interrupted: None,
        })
    }

    /// Whether SIGINT or SIGTERM arrived.
    pub(crate) fn is_interrupted(&self) -> bool {
        self.interrupted.is_some()
    }

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
        if !bytes.is_empty() {
            self.note('>', bytes);
            if let Some(port) = &self.port {
                port.write(bytes);
            }
        }
    }

    fn received(&mut self, bytes: &[u8]) {
        self.heard = true;
        self.note('<', bytes);
    }

    fn lose(&mut self) {
        if self.port.take().is_some() {
            self.lost_at = Some(now());
            self.note('!', b"the port was lost");
        }
    }

    /// Tries to open the port again; whether it is open.
    fn reopen(&mut self) -> bool {
        match Port::open(&self.settings, self.number + 1, &self.events.sender) {
            Ok(port) => {
                self.number += 1;
                self.port = Some(port);
                self.lost_at = None;
                self.note('!', b"the port is open again");
                true
            }
            Err(_) => false,
        }
    }

    /// Asks the machine for its position; `None` if it was homed and does not know it yet.
    pub(crate) fn query_position(
        &mut self,
        status: Box<dyn StatusProtocol>,
    ) -> Result<Option<[i64; 2]>, Failure> {
        match self.ask_position(status)? {
            ReportedPosition::At(at) => Ok(Some(at)),
            ReportedPosition::Unknown => Ok(None),
            ReportedPosition::Alarm(what) => Err(Failure::Io(anyhow::anyhow!(what))),
            ReportedPosition::Silent => {
                Err(Failure::Io(anyhow::anyhow!("the machine does not answer the query for its position")))
            }
        }
    }

    /// Homes the machine.
    pub(crate) fn home(&mut self, mut run: HomingRun) -> Result<(), Failure> {
        loop {
            let bytes = run.transmit(self.now_us());
            self.write(&bytes);
            match run.outcome() {
                Some(Ok(())) => return Ok(()),
                Some(Err(why)) => return Err(Failure::Io(anyhow::anyhow!(why.clone()))),
                None => {}
            }
            match self.events.next(REOPEN_INTERVAL) {
                Some(Event::Received(bytes)) => {
                    self.received(&bytes);
                    run.receive(&bytes);
                }
                Some(Event::Lost(_)) => {
                    return Err(Failure::Io(anyhow::anyhow!("{} was lost", self.settings.path)));
                }
                Some(Event::Interrupted) => {
                    let bytes = run.abort();
                    self.write(&bytes);
                    // Closing the port at once may lose them.
                    std::thread::sleep(REOPEN_INTERVAL);
                    return Err(Failure::Interrupted);
                }
                Some(Event::Enter | Event::Pause | Event::Written) | None => {}
            }
        }
    }

    /// Waits for a line from the operator; `false` where standard input ends without one.
    pub(crate) fn wait_for_enter(&mut self) -> Result<bool, Failure> {
        let (sender, answer) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let read = std::io::stdin().read_line(&mut String::new());
            let _ = sender.send(read.is_ok_and(|count| count > 0));
        });
        loop {
            if let Ok(confirmed) = answer.try_recv() {
                return Ok(confirmed);
            }
            match self.events.next(REOPEN_INTERVAL) {
                Some(Event::Interrupted) => return Err(Failure::Interrupted),
                Some(Event::Received(bytes)) => self.received(&bytes),
                _ => {}
            }
        }
    }

    /// Asks the machine for its position.
    pub(crate) fn ask_position(
        &mut self,
        status: Box<dyn StatusProtocol>,
    ) -> Result<ReportedPosition, Failure> {
        let mut query = PositionQuery::new(status);
        loop {
            let bytes = query.transmit(self.now_us());
            self.write(&bytes);
            if let Some(found) = query.found() {
                return Ok(found.clone());
            }
            let within = Duration::from_micros(query.wake_us().saturating_sub(self.now_us()));
            match self.events.next(within.min(Duration::from_millis(500))) {
                Some(Event::Received(bytes)) => {
                    self.received(&bytes);
                    query.receive(&bytes);
                }
                Some(Event::Lost(_)) => {
                    return Err(Failure::Io(anyhow::anyhow!("{} was lost", self.settings.path)));
                }
                Some(Event::Interrupted) => return Err(Failure::Interrupted),
                Some(Event::Enter | Event::Pause | Event::Written) | None => {}
            }
        }
    }

    /// Runs a short session to its end without showing its progress. `stops` is called all the time, and may
    /// end it.
    pub(crate) fn run_watched(
        &mut self,
        session: &mut dyn Session,
        stops: &mut dyn FnMut() -> bool,
    ) -> Outcome {
        let mut stopping = false;
        loop {
            if !stopping && (stops() || self.interrupted.is_some()) {
                stopping = true;
                session.stop(self.now_us());
            }
            let clear = self.port.as_ref().is_some_and(Port::is_clear);
            if clear {
                let bytes = session.transmit(self.now_us());
                self.write(&bytes);
                if let Some(outcome) = session.outcome() {
                    return outcome.clone();
                }
            }
            if self.port.is_none() {
                return failed(session, format!("{} was lost", self.settings.path));
            }
            let within = match session.wake_us() {
                Some(wake_us) if clear => Duration::from_micros(wake_us.saturating_sub(self.now_us())),
                _ => REOPEN_INTERVAL,
            };
            match self.events.next(within.min(REOPEN_INTERVAL)) {
                Some(Event::Received(bytes)) => {
                    self.received(&bytes);
                    session.receive(&bytes, self.now_us());
                }
                Some(Event::Lost(number)) if number == self.number => self.lose(),
                Some(Event::Interrupted) => self.interrupted = Some(now()),
                Some(Event::Enter | Event::Pause | Event::Lost(_) | Event::Written) | None => {}
            }
        }
    }

    /// Runs the session to its end. With `keys` the operator may pause it.
    pub(crate) fn run(&mut self, session: &mut dyn Session, reconnect_s: f64, keys: bool) -> Outcome {
        let progress = SendingProgress::new(session.progress().of_us);
        let keys = keys.then(|| Keys::listen(self.events.sender.clone()));
        let mut operator = Operator::new(keys.as_ref().is_some_and(|keys| keys.interactive));
        let outcome = self.run_with(session, reconnect_s, &progress, &mut operator);
        progress.finish();
        outcome
    }

    fn run_with(
        &mut self,
        session: &mut dyn Session,
        reconnect_s: f64,
        shown: &SendingProgress,
        operator: &mut Operator,
    ) -> Outcome {
        let mut shown_at = self.begun;
        loop {
            if now().duration_since(shown_at) >= REOPEN_INTERVAL {
                shown_at = now();
                shown.show(&session.progress());
            }
            operator.watch(session, self.now_us());
            if let Some(why) = self.reconnect(session, reconnect_s) {
                return failed(session, why);
            }
            if self.port.as_ref().is_some_and(Port::is_clear) {
                let bytes = session.transmit(self.now_us());
                self.write(&bytes);
            }
            let clear = self.port.as_ref().is_some_and(Port::is_clear);
            if clear && let Some(outcome) = session.outcome() {
                return outcome.clone();
            }
            let silent = !self.heard || !clear;
            if silent && self.interrupted.is_some_and(|at| now().duration_since(at) >= SILENT_STOP) {
                let why = match &self.port {
                    None => "the port was lost",
                    Some(_) if clear => "the machine never answered",
                    Some(_) => "the port takes no more bytes",
                };
                return failed(session, format!("interrupted; {why}"));
            }
            let within = match session.wake_us() {
                Some(wake_us) if clear => Duration::from_micros(wake_us.saturating_sub(self.now_us())),
                _ => REOPEN_INTERVAL,
            };
            match self.events.next(within.min(REOPEN_INTERVAL)) {
                Some(Event::Received(bytes)) => {
                    self.received(&bytes);
                    session.receive(&bytes, self.now_us());
                }
                Some(Event::Lost(number)) if number == self.number => self.lose(),
                Some(Event::Enter) => operator.confirm(session, self.now_us()),
                Some(Event::Pause) => operator.pause(session, self.now_us()),
                Some(Event::Interrupted) if self.interrupted.is_some() => {
                    return failed(session, "interrupted again before the machine was at rest".to_owned());
                }
                Some(Event::Interrupted) => {
                    self.interrupted = Some(now());
                    session.stop(self.now_us());
                }
                Some(Event::Lost(_) | Event::Written) | None => {}
            }
        }
    }

    /// Opens a lost port again; why the session fails if it stays away.
    fn reconnect(&mut self, session: &mut dyn Session, reconnect_s: f64) -> Option<String> {
        let lost_at = self.lost_at?;
        if self.reopen() {
            session.reconnected(self.now_us());
        } else if now().duration_since(lost_at).as_secs_f64() > reconnect_s {
            return Some(format!("{} was lost", self.settings.path));
        }
        None
    }
}

/// The operator at the keyboard.
struct Operator {
    /// Whether keys are pressed when they are needed; otherwise they were written in advance and are kept.
    interactive: bool,
    confirmations: u32,
    waiting: Option<Waiting>,
    pausing: bool,
}

impl Operator {
    fn new(interactive: bool) -> Self {
        Self { interactive, confirmations: 0, waiting: None, pausing: false }
    }

    /// Shows what the session waits for, and confirms what was confirmed in advance.
    fn watch(&mut self, session: &mut dyn Session, now_us: u64) {
        let waiting = session.waiting_for();
        if waiting != self.waiting {
            match &waiting {
                Some(Waiting::Machine(comment)) => {
                    let what = if comment.is_empty() { "the operator" } else { comment };
                    terminal::always(&format!(
                        "the machine waits for a pen change: {what}, then press Enter (or the machine's cycle start)\n"
                    ));
                }
                Some(Waiting::Operator) => terminal::always("paused with the pen up; p resumes\n"),
                None => {}
            }
            self.waiting = waiting;
        }
        if matches!(self.waiting, Some(Waiting::Machine(_))) && self.confirmations > 0 {
            self.confirmations -= 1;
            session.resume(now_us);
        }
    }

    fn confirm(&mut self, session: &mut dyn Session, now_us: u64) {
        if self.waiting.is_some() {
            self.pausing &= self.waiting != Some(Waiting::Operator);
            session.resume(now_us);
        } else if !self.interactive {
            self.confirmations += 1;
        }
    }

    /// Pauses at the next pen-up, or resumes.
    fn pause(&mut self, session: &mut dyn Session, now_us: u64) {
        self.pausing = !self.pausing && session.waiting_for() != Some(Waiting::Operator);
        if self.pausing {
            session.pause();
            terminal::always("pausing at the next pen-up; p resumes\n");
        } else {
            session.resume(now_us);
            terminal::always("resumed\n");
        }
    }
}

fn failed(session: &dyn Session, why: String) -> Outcome {
    let Progress { row, last_sent_row, .. } = session.progress();
    Outcome::Failed { row, last_sent_row, why }
}
