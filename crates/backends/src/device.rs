//! Emulated devices: each behaves on its wire as its firmware does, and records the ink that it draws.
//!
//! A device receives bytes and the time and returns answers. [`crate::FaultInjector`] stands between a device and its
//! wire and injects faults.

use crate::ink::Ink;

/// An emulated machine at the other end of the wire.
pub trait Device {
    /// Its end of the wire.
    fn port(&self) -> &Port;
    /// The same, to change it.
    fn port_mut(&mut self) -> &mut Port;
    /// Advances its clock.
    fn advance(&mut self, now_us: u64);
    /// When it next does something without input.
    fn wake_us(&self) -> Option<u64>;
    /// Whether the pen is down now.
    fn pen_is_down(&self) -> bool;

    /// Receives bytes. What its buffer has no room for is lost.
    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        self.advance(now_us);
        for byte in bytes {
            self.port_mut().push(*byte);
        }
        self.advance(now_us);
    }

    /// The wire is unplugged: bytes in transit are lost.
    fn disconnect(&mut self) {}

    /// The power fails and returns: the machine forgets everything, but for where it stands.
    fn power_cut(&mut self, _now_us: u64) {}

    /// A limit switch closes.
    fn limit(&mut self, _now_us: u64) {}

    /// The operator holds the machine, or lets it go.
    fn hold(&mut self, _held: bool, _now_us: u64) {}

    /// Free bytes in the receive buffer: flow control lets no more through.
    fn room(&self) -> usize {
        self.port().room()
    }

    /// Its answers since the last call, each with its line end.
    fn answers(&mut self) -> Vec<Vec<u8>> {
        std::mem::take(&mut self.port_mut().answers)
    }

    /// What it has drawn, in its own units: ticks, steps or mm.
    fn ink(&self) -> &Ink {
        &self.port().ink
    }

    /// Bytes lost because the buffer was full.
    fn lost_bytes(&self) -> u64 {
        self.port().lost
    }

    /// Makes it take no line out of its buffer until then.
    fn stall(&mut self, until_us: u64) {
        self.port_mut().stalled_us = until_us;
    }
}

/// What every emulated device has at its end of the wire: a receive buffer, answers not yet collected, and the ink.
#[derive(Clone, Debug)]
pub struct Port {
    size: usize,
    pub(crate) buffer: Vec<u8>,
    pub(crate) answers: Vec<Vec<u8>>,
    pub(crate) lost: u64,
    /// Until then no line is taken out of the buffer.
    pub(crate) stalled_us: u64,
    pub(crate) ink: Ink,
}

impl Port {
    /// With a receive buffer of `size` bytes.
    pub(crate) fn new(size: usize) -> Self {
        Self { size, buffer: Vec::new(), answers: Vec::new(), lost: 0, stalled_us: 0, ink: Ink::default() }
    }

    /// Stores a byte, or drops it if the buffer is full.
    pub(crate) fn push(&mut self, byte: u8) {
        if self.room() > 0 {
            self.buffer.push(byte);
        } else {
            self.lost += 1;
        }
    }

    /// Free bytes.
    pub(crate) fn room(&self) -> usize {
        self.size - self.buffer.len()
    }
}
