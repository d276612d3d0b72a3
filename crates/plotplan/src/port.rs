//! Ports: a serial device, a pseudo-terminal or a TCP connection, read and written in the background, and opened again
//! after it was lost.

use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use anyhow::Context as _;
use serialport::FlowControl;

/// Prefix of a port that is a TCP connection: `tcp:HOST:PORT`.
const TCP: &str = "tcp:";
/// How long a TCP connection may take to open.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
/// The same when it is opened again: the sender must stay responsive.
const RECONNECT_TIMEOUT: Duration = Duration::from_millis(250);
/// Reads and writes return after this, so that a port that was closed is noticed.
const IO_TIMEOUT: Duration = Duration::from_millis(20);

/// How a port is set.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    pub(crate) path: String,
    pub(crate) baud: u32,
    pub(crate) flow: FlowControl,
}

/// What happens while a plan is sent.
#[derive(Debug)]
pub(crate) enum Event {
    /// The port delivered these bytes.
    Received(Vec<u8>),
    /// Everything handed to the port is written.
    Written,
    /// The port with this number was lost.
    Lost(u32),
    /// SIGINT or SIGTERM.
    Interrupted,
    /// The operator pressed Enter.
    Enter,
    /// The operator pressed the key that pauses and resumes.
    Pause,
}

/// An open port. What it receives goes to the channel that it was opened with.
pub(crate) struct Port {
    out: Sender<Vec<u8>>,
    /// Bytes handed over and not written yet.
    pending: Arc<AtomicUsize>,
}

impl Port {
    /// Opens it.
    pub(crate) fn open(settings: &Settings, number: u32, events: &Sender<Event>) -> anyhow::Result<Self> {
        let (out, input) = match settings.path.strip_prefix(TCP) {
            Some(address) => connect(address, if number == 0 { CONNECT_TIMEOUT } else { RECONNECT_TIMEOUT })?,
            None => open_serial(settings)?,
        };
        let (sender, bytes) = channel();
        let pending = Arc::new(AtomicUsize::new(0));
        let writer = Writer { out, bytes, pending: Arc::clone(&pending), number, events: events.clone() };
        std::thread::spawn(move || writer.run());
        let events = events.clone();
        std::thread::spawn(move || listen(input, number, &events));
        Ok(Self { out: sender, pending })
    }

    /// Whether everything is written.
    pub(crate) fn is_clear(&self) -> bool {
        self.pending.load(Ordering::Acquire) == 0
    }

    /// Writes these bytes in the background; a lost port reports itself.
    pub(crate) fn write(&self, bytes: &[u8]) {
        self.pending.fetch_add(bytes.len(), Ordering::AcqRel);
        let _ = self.out.send(bytes.to_vec());
    }
}

type Ends = (Box<dyn Write + Send>, Box<dyn Read + Send>);

fn connect(address: &str, timeout: Duration) -> anyhow::Result<Ends> {
    let addresses = address.to_socket_addrs().context("expected tcp:HOST:PORT")?;
    let mut failed = None;
    for address in addresses {
        match TcpStream::connect_timeout(&address, timeout) {
            Ok(stream) => {
                // Lines are short, and the machine waits for them.
                stream.set_nodelay(true)?;
                stream.set_write_timeout(Some(IO_TIMEOUT))?;
                return Ok((Box::new(stream.try_clone()?), Box::new(stream)));
            }
            Err(error) => failed = Some(error),
        }
    }
    Err(failed.map_or_else(|| anyhow::anyhow!("{address} has no address"), Into::into))
}

fn open_serial(settings: &Settings) -> anyhow::Result<Ends> {
    refuse_other_files(&settings.path)?;
    let builder = serialport::new(&settings.path, settings.baud).timeout(IO_TIMEOUT);
    let port = builder.flow_control(settings.flow).open()?;
    let input = port.try_clone()?;
    Ok((Box::new(port), Box::new(input)))
}

/// Refuses what exists and is not a terminal: a regular file would be overwritten, and `/dev/null` never answers.
#[cfg(unix)]
fn refuse_other_files(path: &str) -> anyhow::Result<()> {
    use std::io::IsTerminal as _;
    use std::os::unix::fs::{FileTypeExt as _, OpenOptionsExt as _};

    let what = "not a serial port (expected a serial device, a pseudo-terminal or tcp:HOST:PORT)";
    let is_character_device = std::fs::metadata(path)?.file_type().is_char_device();
    anyhow::ensure!(is_character_device, what);
    // Without waiting for a modem's carrier.
    let flags = (rustix::fs::OFlags::NONBLOCK | rustix::fs::OFlags::NOCTTY).bits() as i32;
    let file = std::fs::OpenOptions::new().read(true).write(true).custom_flags(flags).open(path)?;
    anyhow::ensure!(file.is_terminal(), what);
    Ok(())
}

#[cfg(not(unix))]
fn refuse_other_files(path: &str) -> anyhow::Result<()> {
    let is_file = std::fs::metadata(path).is_ok_and(|data| data.is_file());
    anyhow::ensure!(!is_file, "not a serial port (expected COM1, COM2, ... or tcp:HOST:PORT)");
    Ok(())
}

fn is_pause(error: &std::io::Error) -> bool {
    use std::io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), Interrupted | TimedOut | WouldBlock)
}

fn listen(mut input: Box<dyn Read + Send>, number: u32, events: &Sender<Event>) {
    let mut buffer = [0; 4096];
    loop {
        let event = match input.read(&mut buffer) {
            Ok(count) if count > 0 => Event::Received(buffer[..count].to_vec()),
            Err(error) if is_pause(&error) => continue,
            _ => Event::Lost(number),
        };
        let lost = matches!(event, Event::Lost(_));
        if events.send(event).is_err() || lost {
            return;
        }
    }
}

/// Writes in a thread of its own: flow control may block a write for any time, and the sender must stay responsive.
struct Writer {
    out: Box<dyn Write + Send>,
    bytes: Receiver<Vec<u8>>,
    pending: Arc<AtomicUsize>,
    number: u32,
    events: Sender<Event>,
}

impl Writer {
    fn run(mut self) {
        while let Ok(bytes) = self.bytes.recv() {
            let mut rest = &bytes[..];
            while !rest.is_empty() {
                match self.out.write(rest) {
                    Ok(count) if count > 0 => rest = &rest[count..],
                    Err(error) if is_pause(&error) => {}
                    _ => {
                        let _ = self.events.send(Event::Lost(self.number));
                        return;
                    }
                }
            }
            if self.pending.fetch_sub(bytes.len(), Ordering::AcqRel) == bytes.len() {
                let _ = self.events.send(Event::Written);
            }
        }
    }
}

/// Events of ports, signals and the operator.
pub(crate) struct Events {
    pub(crate) sender: Sender<Event>,
    receiver: Receiver<Event>,
}

impl Events {
    pub(crate) fn new() -> Self {
        let (sender, receiver) = channel();
        Self { sender, receiver }
    }

    /// Delivers SIGINT and SIGTERM as events.
    pub(crate) fn catch_interrupts(&self) -> Result<(), ctrlc::Error> {
        let sender = self.sender.clone();
        ctrlc::set_handler(move || {
            let _ = sender.send(Event::Interrupted);
        })
    }

    /// The next event, if one arrives in time.
    pub(crate) fn next(&self, within: Duration) -> Option<Event> {
        self.receiver.recv_timeout(within).ok()
    }
}
