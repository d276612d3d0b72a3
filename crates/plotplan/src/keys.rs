//! Keys of the operator while a plan is sent: `p` or space pauses and resumes, Enter confirms.

use std::io::Read as _;
use std::sync::mpsc::Sender;

use crate::port::Event;

/// Reads keys in the background. A terminal delivers them without Enter until this is dropped.
pub(crate) struct Keys {
    /// Whether keys come from a terminal; otherwise they were written in advance.
    pub(crate) interactive: bool,
    #[cfg(unix)]
    restore: Option<rustix::termios::Termios>,
}

impl Keys {
    /// Delivers keys of standard input as events.
    pub(crate) fn listen(sender: Sender<Event>) -> Self {
        use std::io::IsTerminal as _;
        let interactive = std::io::stdin().is_terminal();
        #[cfg(unix)]
        let keys = Self { interactive, restore: if interactive { deliver_at_once() } else { None } };
        #[cfg(not(unix))]
        let keys = Self { interactive };
        #[cfg(unix)]
        if interactive && keys.restore.is_none() {
            // In the background: reading would stop the program.
            return keys;
        }
        std::thread::spawn(move || {
            let mut key = [0];
            while std::io::stdin().lock().read(&mut key).is_ok_and(|count| count > 0) {
                let event = match key[0] {
                    b'p' | b'P' | b' ' => Event::Pause,
                    b'\n' | b'\r' => Event::Enter,
                    _ => continue,
                };
                if sender.send(event).is_err() {
                    return;
                }
            }
        });
        keys
    }
}

/// Makes the terminal deliver keys at once; how it was before. `None` for a program in the background.
#[cfg(unix)]
fn deliver_at_once() -> Option<rustix::termios::Termios> {
    use rustix::termios::{LocalModes, OptionalActions, tcgetattr, tcgetpgrp, tcsetattr};

    let stdin = std::io::stdin();
    if tcgetpgrp(&stdin).ok()? != rustix::process::getpgrp() {
        return None;
    }
    let before = tcgetattr(&stdin).ok()?;
    let mut modes = before.clone();
    modes.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
    tcsetattr(&stdin, OptionalActions::Now, &modes).ok()?;
    Some(before)
}

#[cfg(unix)]
impl Drop for Keys {
    fn drop(&mut self) {
        if let Some(before) = &self.restore {
            let _ =
                rustix::termios::tcsetattr(std::io::stdin(), rustix::termios::OptionalActions::Now, before);
        }
    }
}
