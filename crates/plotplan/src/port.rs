//! A serial port, opened, read in the background, and opened again when it was away.

use std::io::{Read, Write};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use serialport::FlowControl;

/// How a port is set.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    pub(crate) path: String,
    pub(crate) baud: u32,
    pub(crate) flow: FlowControl,
}

/// What comes from a port, or from whoever is in charge.
#[derive(Debug)]
pub(crate) enum Event {
    /// Bytes have come in.
    Heard(Vec<u8>),
    /// The port with this number has gone away.
    Lost(u32),
    /// Somebody wants it to stop.
    Interrupted,
    /// Somebody has pressed Enter.
    Enter,
}

/// An open port. What it hears goes to the channel that it was opened with.
pub(crate) struct Port {
    out: Box<dyn Write + Send>,
    /// What could not be written yet.
    pending: Vec<u8>,
}

/// A write that is held up by flow control for longer is tried again.
const PATIENCE: Duration = Duration::from_millis(20);

impl Port {
    /// Opens it: as a serial port, or as the file it is where it is none.
    pub(crate) fn open(settings: &Settings, number: u32, events: &Sender<Event>) -> std::io::Result<Self> {
        let builder = serialport::new(&settings.path, settings.baud).timeout(PATIENCE);
        let opened = builder.flow_control(settings.flow).open();
        let (out, input): (Box<dyn Write + Send>, Box<dyn Read + Send>) = match opened {
            Ok(port) => {
                let input = port.try_clone()?;
                (Box::new(port), Box::new(input))
            }
            Err(error) => {
                // A pipe or a socket of a program that plays a port: no baud rate, but bytes.
                let is_file = std::fs::metadata(&settings.path).is_ok_and(|data| !data.is_dir());
                if !is_file || matches!(error.kind(), serialport::ErrorKind::NoDevice) {
                    return Err(error.into());
                }
                let file = std::fs::OpenOptions::new().read(true).write(true).open(&settings.path)?;
                (Box::new(file.try_clone()?), Box::new(file))
            }
        };
        let events = events.clone();
        std::thread::spawn(move || listen(input, number, &events));
        Ok(Self { out, pending: Vec::new() })
    }

    /// Whether everything has been written.
    pub(crate) fn is_clear(&self) -> bool {
        self.pending.is_empty()
    }

    /// Writes these bytes, as far as they can be written now; the rest at the next call.
    pub(crate) fn write(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.pending.extend_from_slice(bytes);
        while !self.pending.is_empty() {
            match self.out.write(&self.pending) {
                Ok(0) => return Err(std::io::ErrorKind::WriteZero.into()),
                Ok(count) => {
                    self.pending.drain(..count);
                }
                Err(error) if is_pause(&error) => break,
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Forgets what could not be written.
    pub(crate) fn forget(&mut self) {
        self.pending.clear();
    }
}

fn is_pause(error: &std::io::Error) -> bool {
    use std::io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), Interrupted | TimedOut | WouldBlock)
}

fn listen(mut input: Box<dyn Read + Send>, number: u32, events: &Sender<Event>) {
    let mut buffer = [0; 4096];
    loop {
        let event = match input.read(&mut buffer) {
            Ok(count) if count > 0 => Event::Heard(buffer[..count].to_vec()),
            Err(error) if is_pause(&error) => continue,
            _ => Event::Lost(number),
        };
        let lost = matches!(event, Event::Lost(_));
        if events.send(event).is_err() || lost {
            return;
        }
    }
}

/// Events of ports and of whoever is in charge.
pub(crate) struct Events {
    pub(crate) sender: Sender<Event>,
    receiver: Receiver<Event>,
}

impl Events {
    pub(crate) fn new() -> Self {
        let (sender, receiver) = channel();
        Self { sender, receiver }
    }

    /// Lets Ctrl-C and requests to end come as events.
    pub(crate) fn catch_interrupts(&self) -> Result<(), ctrlc::Error> {
        let sender = self.sender.clone();
        ctrlc::set_handler(move || {
            let _ = sender.send(Event::Interrupted);
        })
    }

    /// Lets the next line of standard input come as an event.
    pub(crate) fn wait_for_enter(&self) {
        let sender = self.sender.clone();
        std::thread::spawn(move || {
            if std::io::stdin().read_line(&mut String::new()).is_ok_and(|bytes| bytes > 0) {
                let _ = sender.send(Event::Enter);
            }
        });
    }

    /// The next event, if one comes in time.
    pub(crate) fn next(&self, within: Duration) -> Option<Event> {
        self.receiver.recv_timeout(within).ok()
    }
}
