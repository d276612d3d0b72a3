//! The emulated single-belt plotter: homing and `0`, one line of 20 characters at a time, `1` on arrival or for a pen
//! state, no answer to anything out of range.
//!
//! Its parser reads from the end of the line and takes the last digit for tenths; bytes that come while it homes are lost,
//! and so is what does not fit into its 20 characters. After homing it moves to 125, 125 by itself and answers `1`.

use crate::device::{Device, Port};

/// Characters of a line, its end included.
const BUFFER: usize = 20;
/// Period of its main loop, which polls the receive buffer, microseconds.
const LOOP_US: u64 = 1000;
/// Homing takes this long, microseconds.
const HOMING_US: u64 = 3_000_000;
/// Its speed, mm/s.
const SPEED: f64 = 100.0;
/// Both coordinates are below this, mm.
const RANGE: f64 = 250.0;

/// The plotter.
#[derive(Debug)]
pub(super) struct XyPlotter {
    port: Port,
    /// When the main loop looks at a whole line.
    flag_us: Option<u64>,
    from: [f64; 2],
    to: [f64; 2],
    /// When it started towards `to`.
    since_us: u64,
    locked: bool,
    homed_us: u64,
    homed: bool,
    within_mm: f64,
    down: bool,
    now_us: u64,
}

impl XyPlotter {
    /// Switched on now (or homed already), answering from within `within_mm` of a point: 0 for an exact plotter, 1 for its
    /// actual program.
    pub(super) fn new(homed: bool, within_mm: f64) -> Self {
        let middle = [125.0, 125.0];
        Self {
            port: Port::new(BUFFER),
            flag_us: None,
            from: if homed { middle } else { [0.0; 2] },
            to: middle,
            since_us: if homed { 0 } else { HOMING_US },
            locked: homed,
            homed_us: if homed { 0 } else { HOMING_US },
            homed,
            within_mm,
            down: false,
            now_us: 0,
        }
    }

    fn way(&self) -> f64 {
        libm::hypot(self.to[0] - self.from[0], self.to[1] - self.from[1])
    }

    fn arrives_us(&self) -> u64 {
        self.since_us + (self.way() / SPEED * 1e6).ceil() as u64
    }

    /// When it answers `1`: both coordinates are near enough.
    fn answers_us(&self) -> u64 {
        let farthest = (self.to[0] - self.from[0]).abs().max((self.to[1] - self.from[1]).abs());
        if farthest <= self.within_mm || farthest == 0.0 {
            return self.since_us;
        }
        let share = 1.0 - self.within_mm / farthest;
        self.since_us + (share * self.way() / SPEED * 1e6).ceil() as u64
    }

    fn at(&self, now_us: u64) -> [f64; 2] {
        if now_us >= self.arrives_us() {
            return self.to;
        }
        let share = now_us.saturating_sub(self.since_us) as f64 * 1e-6 * SPEED / self.way();
        [0, 1].map(|axis| self.from[axis] + share * (self.to[axis] - self.from[axis]))
    }

    fn work(&mut self, now_us: u64) {
        if !self.homed && now_us >= self.homed_us {
            self.homed = true;
            self.port.answers.push(b"0\n".to_vec());
        }
        if !self.homed {
            return;
        }
        if !self.locked && now_us >= self.answers_us() {
            self.locked = true;
            self.port.answers.push(b"1\n".to_vec());
        }
        if now_us >= self.arrives_us() {
            self.port.ink.go(self.to);
        }
        if self.flag_us.is_some_and(|flag_us| now_us >= flag_us) && now_us >= self.port.stalled_us {
            self.flag_us = None;
            let line = std::mem::take(&mut self.port.buffer);
            self.command(&line, now_us);
        }
    }

    fn command(&mut self, line: &[u8], now_us: u64) {
        let Some(last) = line.len().checked_sub(2) else { return };
        match line[last] {
            b'p' | b'P' => {
                self.down = line[last] == b'P';
                let here = self.at(now_us);
                self.port.ink.go(here);
                self.port.ink.pen(u16::from(self.down), here);
                self.port.answers.push(b"1\n".to_vec());
            }
            _ => {
                // From the end: the last digit is tenths, points are skipped, there are no signs.
                let Some(comma) = line[..=last].iter().rposition(|byte| *byte == b',') else { return };
                let number = |digits: &[u8]| {
                    let mut place = 0.1;
                    digits.iter().rev().filter(|byte| **byte != b'.').fold(0.0, |sum, byte| {
                        let next = sum + (f64::from(*byte) - 48.0) * place;
                        place *= 10.0;
                        next
                    })
                };
                // Noise may make it negative, which the frame prevents.
                let tenth = |mm: f64| (mm * 10.0).round().max(0.0) / 10.0;
                let (y, x) = (tenth(number(&line[..comma])), tenth(number(&line[comma + 1..=last])));
                if x < RANGE && y < RANGE {
                    let here = self.at(now_us);
                    // It turns here; the same place again is no turn.
                    if here == self.to || self.to != [x, y] {
                        self.port.ink.go(here);
                    }
                    self.from = here;
                    self.to = [x, y];
                    self.since_us = now_us;
                    self.locked = false;
                }
            }
        }
    }
}

impl Device for XyPlotter {
    fn port(&self) -> &Port {
        &self.port
    }

    fn port_mut(&mut self) -> &mut Port {
        &mut self.port
    }

    fn advance(&mut self, now_us: u64) {
        // In order: an answer is due before the line that follows it.
        while let Some(next_us) = self.wake_us().filter(|next_us| *next_us <= now_us) {
            let next_us = next_us.max(self.now_us);
            let before = (self.flag_us, self.locked, self.homed, self.now_us);
            self.now_us = next_us;
            self.work(next_us);
            if before == (self.flag_us, self.locked, self.homed, self.now_us) {
                break;
            }
        }
        self.now_us = now_us;
        self.work(now_us);
    }

    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        self.advance(now_us);
        for &byte in bytes {
            if !self.homed || self.port.buffer.len() >= BUFFER {
                self.port.lost += u64::from(self.homed);
                continue;
            }
            self.port.buffer.push(byte);
            if byte == b'\n' && self.flag_us.is_none() {
                self.flag_us = Some(now_us + LOOP_US);
            }
        }
    }

    fn room(&self) -> usize {
        // No flow control.
        usize::MAX
    }

    fn wake_us(&self) -> Option<u64> {
        let homing = (!self.homed).then_some(self.homed_us);
        let answering = (self.homed && !self.locked).then(|| self.answers_us());
        let arriving = (self.homed && self.arrives_us() > self.now_us).then(|| self.arrives_us());
        let flag = self.flag_us.map(|flag_us| flag_us.max(self.port.stalled_us));
        homing.into_iter().chain(answering).chain(arriving).chain(flag).min()
    }

    fn pen_is_down(&self) -> bool {
        self.down
    }
}
