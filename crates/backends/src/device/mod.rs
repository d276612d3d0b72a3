//! Machines to talk to that are not there: each behaves on its wire as its firmware does, and keeps the ink it was told to
//! draw.
//!
//! They are handed bytes and the time, and give answers; [`Faulty`] stands between a machine and its wire and makes
//! things go wrong.

mod ebb;
mod faulty;
mod grbl;
mod port;
mod ticks;
mod xy_plotter;

pub use ebb::Ebb;
pub use faulty::{Fault, Faulty};
pub use grbl::Grbl;
pub use port::Port;
pub use ticks::Ticks;
pub use xy_plotter::XyPlotter;

use crate::Ink;

/// A machine at the other end of the wire.
pub trait Device {
    /// Its end of the wire.
    fn port(&self) -> &Port;
    /// The same, to change it.
    fn port_mut(&mut self) -> &mut Port;
    /// Time has come so far.
    fn advance(&mut self, now_us: u64);
    /// When it does something next by itself.
    fn wake_us(&self) -> Option<u64>;
    /// Whether the pen is down now.
    fn pen_is_down(&self) -> bool;

    /// Bytes have come in. What the machine's buffer has no room for is lost.
    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        self.advance(now_us);
        for byte in bytes {
            self.port_mut().push(*byte);
        }
        self.advance(now_us);
    }

    /// How many bytes it has room for: with flow control no more are let through.
    fn room(&self) -> usize {
        self.port().room()
    }

    /// Its answers since it was last asked, each with its line end.
    fn answers(&mut self) -> Vec<Vec<u8>> {
        std::mem::take(&mut self.port_mut().answers)
    }

    /// What it has drawn, in its own units: ticks, steps or mm.
    fn ink(&self) -> &Ink {
        &self.port().ink
    }

    /// Bytes that were lost because its buffer was full.
    fn lost_bytes(&self) -> u64 {
        self.port().lost
    }

    /// Until then it takes no line out of its buffer.
    fn stall(&mut self, until_us: u64) {
        self.port_mut().stalled_us = until_us;
    }
}
