//! What every machine has at its end of the wire, whatever it makes of the bytes.

use crate::ink::Ink;

/// A receive buffer, answers that wait to be heard, and the ink that came of it all.
#[derive(Clone, Debug)]
pub struct Port {
    size: usize,
    pub(super) buffer: Vec<u8>,
    pub(super) answers: Vec<Vec<u8>>,
    pub(super) lost: u64,
    /// Until then no line is taken out of the buffer.
    pub(super) stalled_us: u64,
    pub(super) ink: Ink,
}

impl Port {
    /// With a buffer of so many bytes.
    pub(super) fn new(size: usize) -> Self {
        Self { size, buffer: Vec::new(), answers: Vec::new(), lost: 0, stalled_us: 0, ink: Ink::default() }
    }

    /// Keeps a byte, or loses it where there is no room.
    pub(super) fn push(&mut self, byte: u8) {
        if self.room() > 0 {
            self.buffer.push(byte);
        } else {
            self.lost += 1;
        }
    }

    /// How many bytes it has room for.
    pub(super) fn room(&self) -> usize {
        self.size - self.buffer.len()
    }
}
