//! An emulated reader of tick lines, after the reference reader in docs/tick-lines.md, with a queue of moves. Numbered
//! lines get the answers of [`super::framing`]; lines without a number get `ok`, or `error` and the reason.

use std::collections::VecDeque;

use super::framing::{framed, unframed};
use crate::backend::EmulatorOptions;
use crate::device::{Device, Port};
use crate::homing::{Datum, EmulatedHoming};
use crate::ink::Ink;

/// Its receive buffer unless another size is asked for, bytes.
const BUFFER: usize = 512;
/// Capacity of the queue, lines.
const QUEUE: usize = 16;

#[derive(Clone, Copy, Debug)]
enum Order {
    Begin,
    Move { pen: u16, duration_us: u64, to: [i64; 2] },
    End { pen: u16 },
}

/// The machine.
#[derive(Debug)]
pub(super) struct TickLineReader {
    port: Port,
    /// Room announced in the answer to line 0, bytes.
    announced: Option<usize>,
    queue: VecDeque<Order>,
    /// When the first of the queue is done, once it has begun.
    until_us: Option<u64>,
    next: usize,
    /// Where its motors are; unknown before the first sync line.
    position: Option<[i64; 2]>,
    /// Where they will be once the queue is done, and what has been taken of the plan.
    planned: Option<[i64; 2]>,
    moves: u64,
    clock_us: u64,
    pen: u16,
    now_us: u64,
    homing: Option<EmulatedHoming>,
    datum: Datum,
    /// Its start pose.
    home: Option<[i64; 2]>,
}

impl TickLineReader {
    /// Homed at the start position, if there is one.
    pub(super) fn new(options: &EmulatorOptions) -> Self {
        let datum = Datum::at_start(options.homing, options.homed);
        let position = options.start.filter(|_| datum == Datum::Known);
        let buffer = options.buffer.unwrap_or(BUFFER);
        let mut port = Port::new(buffer);
        port.ink = Ink::through(options.play);
        Self {
            port,
            // One byte is kept free, as in a ring.
            announced: options.announces_room.then_some(buffer.saturating_sub(1)),
            queue: VecDeque::new(),
            until_us: None,
            next: 0,
            position,
            planned: position,
            moves: 0,
            clock_us: 0,
            pen: 0,
            now_us: 0,
            homing: options.homing,
            datum,
            home: options.start,
        }
    }

    fn answer(&mut self, text: &str) {
        self.port.answers.push(format!("{text}\n").into_bytes());
    }

    fn set_pen(&mut self, pen: u16) {
        self.pen = pen;
        let at = self.position.unwrap_or_default().map(|ticks| ticks as f64);
        self.port.ink.pen(pen, at);
    }

    /// Executes everything due up to `now_us`, in order.
    fn work(&mut self, now_us: u64) {
        loop {
            while self.take() || self.begin() {}
            let Some(next_us) = self.wake_us().filter(|next_us| *next_us <= now_us) else { break };
            self.now_us = next_us;
            if self.datum.advance(next_us) && self.datum == Datum::Known {
                (self.position, self.planned) = (self.home, self.home);
            }
            if self.until_us == Some(next_us) {
                self.until_us = None;
                if let Some(Order::Move { to, .. }) = self.queue.pop_front() {
                    self.position = Some(to);
                    self.port.ink.go(to.map(|ticks| ticks as f64));
                }
            }
        }
        self.now_us = now_us;
    }

    /// Begins the first of the queue, or does it if that takes no time; whether there was anything to do.
    fn begin(&mut self) -> bool {
        if self.until_us.is_some() {
            return false;
        }
        match self.queue.front().copied() {
            Some(Order::Move { pen, duration_us, .. }) => {
                self.set_pen(pen);
                self.until_us = Some(self.now_us.saturating_add(duration_us));
                return true;
            }
            Some(Order::Begin) => {}
            Some(Order::End { pen }) => self.set_pen(pen),
            None => return false,
        }
        self.queue.pop_front();
        true
    }

    /// Takes a line out of the buffer if the queue has room; whether it did.
    fn take(&mut self) -> bool {
        if self.queue.len() >= QUEUE || self.now_us < self.port.stalled_us {
            return false;
        }
        let Some(end) = self.port.buffer.iter().position(|byte| *byte == b'\n') else { return false };
        let line: Vec<u8> = self.port.buffer.drain(..=end).collect();
        let line = String::from_utf8_lossy(&line).trim().to_owned();
        match unframed(&line) {
            Some(text) => self.numbered(text),
            // Only a line with a checksum can have a wrong one.
            None if line.contains('*') => self.answer(&framed(&format!("ok {}", self.next))),
            None => self.plain(&line),
        }
        true
    }

    /// Whether it homes by switches or stops.
    fn homes_by_moves(&self) -> bool {
        self.homing.is_some_and(|homing| homing.moves_us[0].is_some())
    }

    /// The answer to `home`.
    fn home(&mut self) -> &'static str {
        if matches!(self.datum, Datum::Homing { .. }) {
            return "error homing";
        }
        if !self.queue.is_empty() {
            return "error moving";
        }
        let now_us = self.now_us;
        if !self.homes_by_moves() || !self.datum.begin(self.homing, now_us) {
            return "error no switches";
        }
        (self.position, self.planned, self.next) = (None, None, 0);
        "ok"
    }

    /// Stops: the motors are somewhere.
    fn lose(&mut self, datum: Datum) {
        self.datum = datum;
        self.queue.clear();
        self.until_us = None;
        self.set_pen(0);
        (self.position, self.planned) = (None, None);
    }

    fn plain(&mut self, line: &str) {
        let line = line.split(';').next().unwrap_or_default().trim();
        if line.is_empty() {
            return;
        }
        match self.follow(line) {
            Ok(()) => self.answer("ok"),
            Err(why) => self.answer(&format!("error {why}")),
        }
    }

    fn numbered(&mut self, text: &str) {
        if text == "home" {
            let answer = self.home();
            self.answer(&framed(answer));
            return;
        }
        if text == "stop" {
            self.lose(Datum::Unknown);
            self.answer(&framed("ok"));
            return;
        }
        if text == "status" {
            let state = match self.datum {
                Datum::Homing { .. } => "homing",
                Datum::Failed(_) => "home",
                Datum::Limit => "limit",
                _ if self.queue.is_empty() => "idle",
                _ => "moving",
            };
            self.answer(&framed(&format!("status {state} late 0 start power")));
            return;
        }
        if text == "where" {
            let moving = u8::from(!self.queue.is_empty());
            let at = self.position.map(|[a, b]| format!("at {a} {b} {moving}"));
            self.answer(&framed(&at.unwrap_or_else(|| "at unknown".to_owned())));
            return;
        }
        let Some((number, line)) = text.split_once(':') else { return };
        let Ok(number) = number.parse::<usize>() else { return };
        // 0 begins a session; the same twice does no harm, as nothing else has been taken.
        if number == 0 || number == self.next {
            match self.follow(line) {
                Ok(()) => {
                    self.next = number.saturating_add(1);
                    if let Some(room) = self.announced.filter(|_| number == 0) {
                        self.answer(&framed(&format!("ok 1 room {room}")));
                        return;
                    }
                }
                Err(why) => {
                    self.answer(&framed(&format!("error {number} {why}")));
                    return;
                }
            }
        }
        self.answer(&framed(&format!("ok {}", self.next)));
    }

    fn follow(&mut self, line: &str) -> Result<(), &'static str> {
        let line = line.split(';').next().unwrap_or_default().trim_end();
        let mut words = line.split(' ');
        let verb = words.next().unwrap_or_default();
        let numbers: Option<Vec<i64>> = words.map(|word| word.parse().ok()).collect();
        let numbers = numbers.ok_or("not a whole number")?;
        match (self.datum, verb) {
            (Datum::Limit, "begin") if self.queue.is_empty() => return Err("home"),
            (Datum::Limit, _) => return Err("limit"),
            (Datum::Homing { .. }, _) => return Err("homing"),
            // A reader without homing moves takes the place of the first sync line for its own.
            (Datum::Unknown | Datum::Failed(_), _) if self.homes_by_moves() => return Err("home"),
            _ => {}
        }
        match (verb, &numbers[..]) {
            ("begin", [1, _, _]) => {
                (self.moves, self.clock_us) = (0, 0);
                self.queue.push_back(Order::Begin);
            }
            ("s", [row, time, a, b]) => {
                let here = self.planned.get_or_insert([*a, *b]);
                if self.position.is_none() {
                    self.position = Some([*a, *b]);
                }
                if *here != [*a, *b] {
                    return Err("the motors are not there");
                }
                if (*row, *time) != (self.moves as i64, self.clock_us as i64) {
                    return Err("lines are missing or doubled");
                }
            }
            ("m", [pen, duration_us, a, b]) if *pen >= 0 && *duration_us > 0 => {
                let to = [*a, *b];
                self.queue.push_back(Order::Move { pen: *pen as u16, duration_us: *duration_us as u64, to });
                self.planned = Some(to);
                self.moves += 1;
                self.clock_us = self.clock_us.saturating_add(*duration_us as u64);
            }
            ("end", [pen, moves, time]) if *pen >= 0 => {
                if (*moves, *time) != (self.moves as i64, self.clock_us as i64) {
                    return Err("lines are missing or doubled");
                }
                self.queue.push_back(Order::End { pen: *pen as u16 });
            }
            _ => return Err("not a tick line"),
        }
        Ok(())
    }
}

impl Device for TickLineReader {
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
        self.until_us.into_iter().chain(stalled).chain(self.datum.wake_us()).min()
    }

    fn limit(&mut self, _now_us: u64) {
        // Homing runs into its switches on purpose.
        if !matches!(self.datum, Datum::Homing { .. }) {
            self.lose(Datum::Limit);
        }
    }

    fn pen_is_down(&self) -> bool {
        self.pen != 0
    }
}
