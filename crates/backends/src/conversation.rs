//! What all conversations have in common.

use crate::script::Step;

/// How far a conversation has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Lines that the machine has taken.
    pub lines: u64,
    /// Lines in all.
    pub of_lines: u64,
    /// Time of the plan that these lines take, microseconds.
    pub done_us: u64,
    /// Of so much in all.
    pub of_us: u64,
    /// Index of the row that holds when they have been done.
    pub row: u64,
    /// Index of the row that holds when everything has been done that was said.
    pub at_most: u64,
    /// Lines that were sent more than once.
    pub resent: u64,
    /// Times that the machine was asked where it stands.
    pub asked: u64,
}

impl Progress {
    /// With so many of the steps taken by the machine, which holds `row` then, and may at most have come to `at_most`.
    pub(crate) fn of(steps: &[Step], taken: usize, row: u64, at_most: u64) -> Self {
        let time = |steps: &[Step]| steps.iter().map(|step| step.lasts_us).sum();
        let (lines, of_lines) = (taken as u64, steps.len() as u64);
        let (done_us, of_us) = (time(&steps[..taken]), time(steps));
        Self { lines, of_lines, done_us, of_us, row, at_most, resent: 0, asked: 0 }
    }
}

/// How a conversation ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The machine has done everything.
    Done,
    /// It was stopped: the pen is up, the machine at rest at this row.
    Stopped {
        /// From here it can be gone on with.
        row: u64,
    },
    /// It cannot go on.
    Failed {
        /// The machine has taken everything up to this row.
        row: u64,
        /// The last row of which anything was said: it may have got so far.
        at_most: u64,
        /// Why.
        why: String,
    },
}

/// A conversation with one machine about one script.
pub trait Conversation {
    /// Bytes have come in.
    fn receive(&mut self, bytes: &[u8], now_us: u64);
    /// Bytes that are to go out now; none where there is nothing to say yet.
    fn transmit(&mut self, now_us: u64) -> Vec<u8>;
    /// When it wants to be asked again if nothing comes in.
    fn wake_us(&self) -> Option<u64>;
    /// Whoever is in charge wants it to stop: soon, at rest, with the pen up.
    fn stop(&mut self, now_us: u64);
    /// The port is there again after it was away: whatever was on the way is lost.
    fn reconnected(&mut self, now_us: u64);
    /// Whether the machine has paused and waits for a hand: another pen is to be put in.
    fn waits_for_hand(&self) -> bool {
        false
    }
    /// The hand has done its work.
    fn go_on(&mut self) {}
    /// How far it has come.
    fn progress(&self) -> Progress;
    /// How it ended, once it has.
    fn outcome(&self) -> Option<&Outcome>;
}

/// Cuts what comes in into lines. CR and LF end one, empty ones are left out.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lines {
    pending: Vec<u8>,
}

/// Longer lines are noise.
const LONGEST: usize = 256;

impl Lines {
    pub(crate) fn add(&mut self, bytes: &[u8]) -> Vec<String> {
        let mut lines = Vec::new();
        for &byte in bytes {
            if byte == b'\n' || byte == b'\r' {
                if !self.pending.is_empty() {
                    lines.push(String::from_utf8_lossy(&self.pending).trim().to_owned());
                    self.pending.clear();
                }
            } else if self.pending.len() < LONGEST {
                self.pending.push(byte);
            }
        }
        lines
    }

    pub(crate) fn clear(&mut self) {
        self.pending.clear();
    }
}

/// The exclusive or of all bytes: what Marlin takes for a checksum.
pub(crate) fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum ^ byte)
}

/// `TEXT*SUM`.
pub(crate) fn framed(text: &str) -> String {
    format!("{text}*{}", checksum(text.as_bytes()))
}

/// The text of `TEXT*SUM`, if the sum is right.
pub(crate) fn unframed(line: &str) -> Option<&str> {
    let (text, sum) = line.rsplit_once('*')?;
    (sum.parse() == Ok(checksum(text.as_bytes()))).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documentation_shows_a_line_as_it_is_sent() {
        let documentation = include_str!("../../../docs/sending.md");
        assert!(documentation.contains(&format!("`{}`", framed("12:m 1 10000 804 -4"))));
    }

    #[test]
    fn a_changed_byte_is_noticed() {
        let line = framed("12:m 1 10000 804 -4");
        for at in 0..line.len() {
            for bit in 0..7 {
                let mut bytes = line.clone().into_bytes();
                bytes[at] ^= 1 << bit;
                let changed = String::from_utf8_lossy(&bytes).into_owned();
                assert_ne!(unframed(&changed), unframed(&line), "{changed}");
            }
        }
    }
}
