//! An emulated EiBotBoard: commands in order, `OK` once the FIFO of one move had room, accumulators as in the command
//! reference.
//!
//! Every 40 us `Rate += Accel`, `Accumulator += Rate`, and a step when the accumulator reaches 2^31; the initial rate is
//! reduced by half the acceleration. USB flow control holds back what the board has no room for.

use std::collections::VecDeque;

use kinematics::Play;

use crate::device::{Device, Port};
use crate::ink::Ink;

/// Its receive buffer, bytes.
const BUFFER: usize = 256;
/// Moves that wait behind the current one.
const FIFO: usize = 1;
const INTERVAL_US: u64 = 40;
/// The board takes 32 bits; here a move ends within the hour.
const MOST_INTERVALS: i64 = 90_000_000;
const FULL: i64 = 1 << 31;

#[derive(Clone, Copy, Debug)]
enum Motion {
    /// A number of intervals at these rates and accelerations; set bits of `clear` clear accumulators first.
    Timed { intervals: u64, rates: [i64; 2], accelerations: [i64; 2], clear: u8 },
    /// Steps spread evenly over a time.
    Stepper { ms: u64, steps: [i64; 2] },
    /// A pen move and a wait.
    Pen { down: bool, ms: u64 },
}

/// The board with its motors.
#[derive(Debug)]
pub(super) struct Ebb {
    port: Port,
    fifo: VecDeque<Motion>,
    until_us: Option<u64>,
    accumulators: [i64; 2],
    /// The global step counters, and the motors' distance from where they were switched on.
    counters: [i64; 2],
    place: [i64; 2],
    up_position: Option<i64>,
    down: bool,
    now_us: u64,
}

impl Default for Ebb {
    fn default() -> Self {
        Self::new(None)
    }
}

impl Ebb {
    /// Switched on, with motors that have this play.
    pub(super) fn new(play: Option<Play>) -> Self {
        let mut port = Port::new(BUFFER);
        port.ink = Ink::through(play);
        Self {
            port,
            fifo: VecDeque::new(),
            until_us: None,
            accumulators: [0; 2],
            counters: [0; 2],
            place: [0; 2],
            up_position: None,
            down: false,
            now_us: 0,
        }
    }

    fn ok(&mut self) {
        self.port.answers.push(b"OK\r\n".to_vec());
    }

    /// Executes everything due up to `now_us`, in order.
    fn work(&mut self, now_us: u64) {
        loop {
            while self.take() || self.begin() {}
            let Some(next_us) = self.wake_us().filter(|next_us| *next_us <= now_us) else { break };
            self.now_us = next_us;
            if self.until_us == Some(next_us) {
                self.until_us = None;
                if let Some(motion) = self.fifo.pop_front() {
                    self.end(motion);
                }
            }
        }
        self.now_us = now_us;
    }

    fn begin(&mut self) -> bool {
        if self.until_us.is_some() {
            return false;
        }
        let Some(motion) = self.fifo.front().copied() else { return false };
        let duration_us = match motion {
            Motion::Timed { intervals, .. } => intervals * INTERVAL_US,
            Motion::Stepper { ms, .. } => ms * 1000,
            Motion::Pen { down, ms } => {
                self.down = down;
                self.port.ink.pen(u16::from(down), self.place.map(|steps| steps as f64));
                ms * 1000
            }
        };
        self.until_us = Some(self.now_us + duration_us);
        true
    }

    fn end(&mut self, motion: Motion) {
        let steps = match motion {
            Motion::Timed { intervals, rates, accelerations, clear } => [0, 1].map(|axis| {
                if clear & (1 << axis) != 0 {
                    self.accumulators[axis] = 0;
                }
                let (mut rate, acceleration) = (rates[axis].abs(), accelerations[axis]);
                rate -= acceleration / 2;
                let mut steps = 0;
                for _ in 0..intervals {
                    rate += acceleration;
                    if rate < 0 {
                        rate += FULL;
                    }
                    self.accumulators[axis] += rate;
                    if self.accumulators[axis] >= FULL {
                        self.accumulators[axis] -= FULL;
                        steps += 1;
                    }
                }
                steps * rates[axis].signum()
            }),
            Motion::Stepper { steps, .. } => steps,
            Motion::Pen { .. } => [0, 0],
        };
        for (axis, steps) in steps.into_iter().enumerate() {
            self.counters[axis] += steps;
            self.place[axis] += steps;
        }
        self.port.ink.go(self.place.map(|steps| steps as f64));
    }

    fn take(&mut self) -> bool {
        if self.now_us < self.port.stalled_us {
            return false;
        }
        let Some(end) = self.port.buffer.iter().position(|byte| *byte == b'\r') else { return false };
        let line = String::from_utf8_lossy(&self.port.buffer[..end]).trim().to_owned();
        let motion = match motion(&line, self.up_position) {
            Ok(motion) => motion,
            Err(why) => {
                self.port.buffer.drain(..=end);
                if let Some(why) = why {
                    self.port.answers.push(format!("!8 Err: {why}\r\n").into_bytes());
                } else {
                    self.query(&line);
                }
                return true;
            }
        };
        // One is being executed, one may wait; another stays in the buffer.
        if self.fifo.len() > FIFO {
            return false;
        }
        self.port.buffer.drain(..=end);
        if let (Motion::Pen { .. }, Some(position)) = (motion, servo_position(&line)) {
            self.up_position.get_or_insert(position);
        }
        self.fifo.push_back(motion);
        self.ok();
        true
    }

    fn query(&mut self, line: &str) {
        match line {
            "QM" => {
                let moving = u8::from(!self.fifo.is_empty());
                self.port.answers.push(format!("QM,{moving},{moving},{moving},0\r\n").into_bytes());
            }
            "QS" => {
                let [a, b] = self.counters;
                self.port.answers.push(format!("{a},{b}\r\n").into_bytes());
                self.ok();
            }
            _ => {
                if line.starts_with("EM,") {
                    self.counters = [0, 0];
                }
                self.ok();
            }
        }
    }
}

/// The position of `S2`.
fn servo_position(line: &str) -> Option<i64> {
    line.strip_prefix("S2,")?.split(',').next()?.parse().ok()
}

/// The motion of a line; `Err(None)` for a query or a setting, otherwise why it is wrong.
fn motion(line: &str, up_position: Option<i64>) -> Result<Motion, Option<String>> {
    let mut words = line.split(',');
    let verb = words.next().unwrap_or_default();
    if matches!(verb, "QM" | "QS" | "EM" | "") {
        return Err(None);
    }
    let wrong = || Some(format!("parameter of {line}"));
    let numbers: Option<Vec<i64>> = words.map(|word| word.parse().ok()).collect();
    let numbers = numbers.ok_or_else(wrong)?;
    let in_range = |rate: i64| rate.abs() < FULL;
    match (verb, &numbers[..]) {
        ("LT", [intervals, r1, a1, r2, a2, rest @ ..])
            if (1..=MOST_INTERVALS).contains(intervals)
                && [r1, r2, a1, a2].into_iter().all(|number| in_range(*number))
                && rest.len() < 2 =>
        {
            Ok(Motion::Timed {
                intervals: *intervals as u64,
                rates: [*r1, *r2],
                accelerations: [*a1, *a2],
                clear: rest.first().map_or(0, |clear| *clear as u8),
            })
        }
        ("SM", [ms, a, b]) if (1..=16_777_215).contains(ms) && in_range(*a) && in_range(*b) => {
            Ok(Motion::Stepper { ms: *ms as u64, steps: [*a, *b] })
        }
        ("SP", [value, ms]) if (0..65_536).contains(ms) => {
            Ok(Motion::Pen { down: *value == 0, ms: *ms as u64 })
        }
        ("S2", [position, _, _, ms]) if (0..65_536).contains(ms) => {
            Ok(Motion::Pen { down: up_position.is_some_and(|up| up != *position), ms: *ms as u64 })
        }
        _ => Err(wrong()),
    }
}

impl Device for Ebb {
    fn port(&self) -> &Port {
        &self.port
    }

    fn port_mut(&mut self) -> &mut Port {
        &mut self.port
    }

    fn advance(&mut self, now_us: u64) {
        self.work(now_us);
    }

    fn wake_us(&self) -> Option<u64> {
        let stalled = (self.port.stalled_us > self.now_us).then_some(self.port.stalled_us);
        self.until_us.into_iter().chain(stalled).min()
    }

    fn pen_is_down(&self) -> bool {
        self.down
    }
}
