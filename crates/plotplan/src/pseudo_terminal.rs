//! A pseudo-terminal: this end, and the path of the other end, which a sender opens as a serial port.

use std::io;
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, fcntl_getfl, fcntl_setfl, open};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// Both ends. The other one is held open, so that a program may come and go.
pub(crate) struct PseudoTerminal {
    ours: OwnedFd,
    _theirs: OwnedFd,
    path: PathBuf,
}

impl PseudoTerminal {
    /// Opens a new one, without echo and without any change to what goes through.
    pub(crate) fn open() -> io::Result<Self> {
        let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        fcntl_setfl(&ours, fcntl_getfl(&ours)? | OFlags::NONBLOCK)?;
        grantpt(&ours)?;
        unlockpt(&ours)?;
        let name = ptsname(&ours, Vec::new())?;
        let theirs = open(name.as_c_str(), OFlags::RDWR | OFlags::NOCTTY, Mode::empty())?;
        let mut attributes = tcgetattr(&theirs)?;
        attributes.make_raw();
        tcsetattr(&theirs, OptionalActions::Now, &attributes)?;
        Ok(Self { ours, _theirs: theirs, path: name.to_string_lossy().into_owned().into() })
    }

    /// What programs open.
    pub(crate) fn path(&self) -> &PathBuf {
        &self.path
    }

    /// Reads at most `most` bytes; waits for the first one up to `within`.
    pub(crate) fn read(&self, most: usize, within: Duration) -> io::Result<Vec<u8>> {
        if most == 0 {
            std::thread::sleep(within.min(Duration::from_millis(1)));
            return Ok(Vec::new());
        }
        let mut wanted = [PollFd::new(&self.ours, PollFlags::IN)];
        let within = Timespec { tv_sec: within.as_secs() as i64, tv_nsec: i64::from(within.subsec_nanos()) };
        match poll(&mut wanted, Some(&within)) {
            Ok(0) | Err(rustix::io::Errno::INTR) => return Ok(Vec::new()),
            other => other?,
        };
        let mut buffer = vec![0; most.min(4096)];
        let count = rustix::io::read(&self.ours, &mut buffer)?;
        buffer.truncate(count);
        Ok(buffer)
    }

    /// Writes it, as far as somebody listens: like on a wire, what nobody takes off it is lost.
    pub(crate) fn write(&self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            match rustix::io::write(&self.ours, bytes) {
                Ok(count) => bytes = &bytes[count..],
                Err(rustix::io::Errno::AGAIN) => return Ok(()),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }
}
