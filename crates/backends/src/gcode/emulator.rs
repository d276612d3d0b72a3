//! An emulated grbl: a receive buffer of 128 bytes, a planner of 15 blocks, `ok` once a line is parsed and queued, `?`
//! answered at once.
//!
//! It moves at the feed rate without accelerations, along true arcs. The first `S` (or `Z`) that it receives is pen up.

use std::collections::VecDeque;

use crate::backend::EmulatorOptions;
use crate::device::{Device, Port};
use crate::homing::{Datum, EmulatedHoming, SwitchFault};

/// Its receive buffer, bytes.
const BUFFER: usize = 128;
/// Its planner, blocks.
const BLOCKS: usize = 15;
/// It reports positions in whole steps.
const STEPS_PER_MM: f64 = 80.0;
/// Rapid moves, mm/s.
const RAPID: f64 = 100.0;
/// Chords of an arc in the ink.
const CHORDS: u32 = 24;

#[derive(Clone, Debug)]
struct Block {
    duration_us: u64,
    points: Vec<[f64; 2]>,
}

/// The machine.
#[derive(Debug)]
pub(super) struct Grbl {
    port: Port,
    blocks: VecDeque<Block>,
    /// When the first block is done.
    until_us: Option<u64>,
    /// Until when a dwell keeps the next line from being read.
    dwell_us: u64,
    place: [f64; 2],
    planned: [f64; 2],
    inverse: bool,
    feed: Option<f64>,
    motion: u8,
    up: Option<f64>,
    down: bool,
    now_us: u64,
    /// At `M0`, until `~`.
    paused: bool,
    homing: Option<EmulatedHoming>,
    datum: Datum,
    /// Work coordinates less those of the machine.
    offset: [f64; 2],
}

impl Default for Grbl {
    fn default() -> Self {
        Self::new(&EmulatorOptions::default())
    }
}

impl Grbl {
    /// Switched on: homed at 0, 0, or in alarm until it is homed (`$22=1`).
    pub(super) fn new(options: &EmulatorOptions) -> Self {
        let mut port = Port::new(BUFFER);
        port.answers.push(b"\r\nGrbl 1.1h ['$' for help]\r\n".to_vec());
        Self {
            port,
            blocks: VecDeque::new(),
            until_us: None,
            dwell_us: 0,
            place: [0.0; 2],
            planned: [0.0; 2],
            inverse: false,
            feed: None,
            motion: 0,
            up: None,
            down: false,
            now_us: 0,
            paused: false,
            homing: options.homing.filter(|homing| homing.moves_us[0].is_some()),
            datum: Datum::at_start(
                options.homing.filter(|homing| homing.moves_us[0].is_some()),
                options.homed,
            ),
            offset: [0.0; 2],
        }
    }

    fn answer(&mut self, text: &str) {
        self.port.answers.push(format!("{text}\r\n").into_bytes());
    }

    fn report(&mut self) {
        let state = if matches!(self.datum, Datum::Homing { .. }) {
            "Home"
        } else if self.datum != Datum::Known {
            "Alarm"
        } else if self.now_us < self.port.stalled_us || self.paused {
            "Hold:0"
        } else if self.blocks.is_empty() && self.now_us >= self.dwell_us {
            "Idle"
        } else {
            "Run"
        };
        let [x, y] = self.place.map(|mm| (mm * STEPS_PER_MM).round() / STEPS_PER_MM);
        let [wx, wy] = self.offset;
        let report = if self.offset == [0.0; 2] {
            format!("<{state}|MPos:{x:.3},{y:.3},0.000|FS:0,0>")
        } else {
            // The machine's own zero is where it was homed.
            format!("<{state}|MPos:{:.3},{:.3},0.000|FS:0,0|WCO:{:.3},{:.3},0.000>", x - wx, y - wy, -wx, -wy)
        };
        self.answer(&report);
    }

    /// Executes everything due up to `now_us`, in order.
    fn work(&mut self, now_us: u64) {
        loop {
            while self.take() {}
            if self.until_us.is_none() {
                self.until_us =
                    self.blocks.front().map(|block| self.now_us.saturating_add(block.duration_us));
            }
            let Some(next_us) = self.wake_us().filter(|next_us| *next_us <= now_us) else { break };
            self.now_us = next_us;
            if self.datum.advance(next_us) {
                match self.datum {
                    Datum::Failed(SwitchFault::Stuck(_)) => self.answer("ALARM:8"),
                    Datum::Failed(SwitchFault::Broken(_)) => self.answer("ALARM:9"),
                    _ => {
                        (self.place, self.planned) = ([0.0; 2], [0.0; 2]);
                        self.answer("ok");
                    }
                }
            }
            if self.until_us == Some(next_us) {
                self.until_us = None;
                for point in self.blocks.pop_front().map_or_else(Vec::new, |block| block.points) {
                    self.place = point;
                    self.port.ink.go(point);
                }
            }
        }
        self.now_us = now_us;
    }

    /// Takes one line out of the buffer if possible; whether it did.
    fn take(&mut self) -> bool {
        if self.paused
            || matches!(self.datum, Datum::Homing { .. })
            || self.now_us < self.dwell_us
            || self.now_us < self.port.stalled_us
            || self.blocks.len() >= BLOCKS
        {
            return false;
        }
        let Some(end) = self.port.buffer.iter().position(|byte| *byte == b'\n') else { return false };
        let line = String::from_utf8_lossy(&self.port.buffer[..end]).trim().to_owned();
        // Spindle, dwell and (here) the pen's axis wait until all queued motion is done.
        let waits = line.starts_with('M') || line.starts_with("G4") || line.contains('Z');
        if waits && !self.blocks.is_empty() {
            return false;
        }
        self.port.buffer.drain(..=end);
        if line.split([' ', ';']).next() == Some("M0") {
            // It is acknowledged on cycle start.
            self.paused = true;
            return true;
        }
        if line == "$H" {
            let now_us = self.now_us;
            if !self.datum.begin(self.homing, now_us) {
                self.answer("error:5");
            }
            return true;
        }
        if self.datum != Datum::Known {
            // Locked: `$X` unlocks it without a datum.
            let unlocks = line == "$X";
            if unlocks {
                self.datum = Datum::Known;
            }
            self.answer(if unlocks { "ok" } else { "error:9" });
            return true;
        }
        if let Some(words) = line.strip_prefix("G10 L20 P1 ") {
            let word = |axis: char| {
                let found = words.split(' ').find_map(|word| word.strip_prefix(axis));
                found.and_then(|value| value.parse::<f64>().ok()).unwrap_or(0.0)
            };
            // The ink is in work coordinates.
            (self.place, self.planned) = ([word('X'), word('Y')], [word('X'), word('Y')]);
            self.offset = self.place;
            self.answer("ok");
            return true;
        }
        let answer = match self.follow(&line) {
            Ok(()) => "ok".to_owned(),
            Err(code) => format!("error:{code}"),
        };
        self.answer(&answer);
        true
    }

    fn set_pen(&mut self, value: f64) {
        let up = *self.up.get_or_insert(value);
        self.down = value != up;
        self.port.ink.pen(u16::from(self.down), self.place);
    }

    fn follow(&mut self, line: &str) -> Result<(), u8> {
        let (mut x, mut y, mut i, mut j) = (None, None, 0.0, 0.0);
        let (mut p, mut s, mut z, mut dwell, mut spindle) = (0.0, None, None, false, None);
        let mut feed = None;
        let line = line.split(';').next().unwrap_or_default();
        for word in line.split_ascii_whitespace() {
            let (letter, number) = word.split_at_checked(1).ok_or(1_u8)?;
            let value: f64 = number.parse().ok().filter(|value: &f64| value.abs() < 1e9).ok_or(2_u8)?;
            match (letter, number) {
                ("G", "0" | "1" | "2" | "3") => self.motion = value as u8,
                ("G", "4") => dwell = true,
                ("G", "17" | "21" | "90") => {}
                ("G", "93") => self.inverse = true,
                ("G", "94") => (self.inverse, self.feed) = (false, None),
                ("M", "3") => spindle = Some(true),
                ("M", "5") => spindle = Some(false),
                ("F", _) => feed = Some(value),
                ("X", _) => x = Some(value),
                ("Y", _) => y = Some(value),
                ("Z", _) => z = Some(value),
                ("I", _) => i = value,
                ("J", _) => j = value,
                ("P", _) => p = value,
                ("S", _) => s = Some(value),
                _ => return Err(20),
            }
        }
        if dwell {
            self.dwell_us = self.now_us.saturating_add((p * 1e6) as u64);
            return Ok(());
        }
        if let Some(on) = spindle {
            self.set_pen(if on { s.unwrap_or(0.0) } else { 0.0 });
        }
        if let Some(z) = z {
            self.set_pen(z);
        }
        if feed.is_some() && !self.inverse {
            self.feed = feed;
        }
        if x.is_none() && y.is_none() {
            return Ok(());
        }
        let from = self.planned;
        let to = [x.unwrap_or(from[0]), y.unwrap_or(from[1])];
        let (points, length) = match self.motion {
            2 | 3 => arc(from, to, [from[0] + i, from[1] + j], self.motion == 2)?,
            _ => (vec![to], libm::hypot(to[0] - from[0], to[1] - from[1])),
        };
        let seconds = match (self.motion, self.inverse) {
            (0, _) => length / RAPID,
            (_, true) => 60.0 / feed.filter(|feed| *feed > 0.0).ok_or(22_u8)?,
            (_, false) => length * 60.0 / self.feed.filter(|feed| *feed > 0.0).ok_or(22_u8)?,
        };
        self.planned = to;
        self.blocks.push_back(Block { duration_us: (seconds * 1e6).ceil() as u64, points });
        Ok(())
    }
}

/// Points of an arc and its length; an error, as in grbl, if the radii at both ends differ.
fn arc(from: [f64; 2], to: [f64; 2], center: [f64; 2], clockwise: bool) -> Result<(Vec<[f64; 2]>, f64), u8> {
    let polar = |p: [f64; 2]| {
        let (x, y) = (p[0] - center[0], p[1] - center[1]);
        (libm::hypot(x, y), libm::atan2(y, x))
    };
    let ((r0, a0), (r1, a1)) = (polar(from), polar(to));
    let off = (r0 - r1).abs();
    if off > 0.5 || off > 0.005 && off > 0.001 * r0 {
        return Err(33);
    }
    let tau = std::f64::consts::TAU;
    let mut sweep = a1 - a0;
    if clockwise && sweep >= -1e-9 {
        sweep -= tau;
    }
    if !clockwise && sweep <= 1e-9 {
        sweep += tau;
    }
    let mut points: Vec<[f64; 2]> = (1..CHORDS)
        .map(|k| {
            let share = f64::from(k) / f64::from(CHORDS);
            let (sin, cos) = libm::sincos(a0 + share * sweep);
            let r = r0 + share * (r1 - r0);
            [center[0] + r * cos, center[1] + r * sin]
        })
        .collect();
    points.push(to);
    Ok((points, r0 * sweep.abs()))
}

impl Device for Grbl {
    fn port(&self) -> &Port {
        &self.port
    }

    fn port_mut(&mut self) -> &mut Port {
        &mut self.port
    }

    fn advance(&mut self, now_us: u64) {
        self.work(now_us);
    }

    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        self.advance(now_us);
        for &byte in bytes {
            match byte {
                b'?' => self.report(),
                b'~' => {
                    if std::mem::take(&mut self.paused) {
                        self.answer("ok");
                    }
                }
                b'!' | 0x18 | b'\r' => {}
                _ => self.port.push(byte),
            }
        }
        self.advance(now_us);
    }

    fn wake_us(&self) -> Option<u64> {
        let later = |us: u64| (us > self.now_us).then_some(us);
        let timers = later(self.dwell_us).into_iter().chain(later(self.port.stalled_us));
        self.until_us.into_iter().chain(timers).chain(self.datum.wake_us()).min()
    }

    fn limit(&mut self, _now_us: u64) {
        if matches!(self.datum, Datum::Homing { .. }) {
            return;
        }
        // A hard limit: everything stops.
        self.datum = Datum::Limit;
        self.blocks.clear();
        self.until_us = None;
        self.planned = self.place;
        self.answer("ALARM:1");
    }

    fn pen_is_down(&self) -> bool {
        self.down
    }
}
