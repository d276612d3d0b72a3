//! An emulated HP 7475A with A4 paper: what its manual says it does on the wire, and how long it takes.
//!
//! The receiver picks device control out of the bytes as they come, the rest goes into the buffer. The
//! interpreter takes bytes out only as it executes them: one vector is in execution at a time.

mod answers;
mod control;
mod execute;
mod motion;

use std::collections::VecDeque;

use control::{Control, Received};
use execute::Interpreter;

use super::plotter::Plotter;
use crate::device::{Device, Port};

/// Size of the input buffer, bytes.
const BUFFER_BYTES: usize = 1024;
/// Time of one byte at 9600 baud, 10 bits, microseconds.
const BYTE_US: u64 = 1042;
/// DTR goes low with fewer free bytes than this.
const DTR_BYTES: usize = 80;
/// XON goes out with this many free bytes.
const XON_BYTES: usize = 512;
/// The pen lifts by itself after this time without an instruction, microseconds.
const AUTO_LIFT_US: u64 = 55_000_000;

/// The emulated plotter.
#[derive(Debug)]
pub(crate) struct Emulator {
    port: Port,
    /// Bytes on the wire, each with the time of its arrival.
    wire: VecDeque<(u64, u8)>,
    control: Control,
    interpreter: Interpreter,
    /// Until then a vector is drawn, or a pen is changed.
    busy_us: u64,
    /// The answer that waits for the turnaround delay: when it is sent.
    outbox: VecDeque<(u64, Vec<u8>)>,
    /// Answers that wait for the trigger.
    untriggered: VecDeque<Vec<u8>>,
    /// Bytes are dropped up to this one: the computer's echo of an answer.
    echo: Option<u8>,
    /// The block of block mode that has not ended.
    block: Vec<u8>,
    /// Bytes passed on to the terminal while the plotter is off.
    passed: Vec<u8>,
    /// The next byte has a framing or parity error.
    is_damaged: bool,
    /// XOFF was sent.
    is_off: bool,
    /// When the pen went down or last moved.
    moved_us: u64,
    view: bool,
}

impl Emulator {
    pub(crate) fn new() -> Self {
        Self {
            port: Port::new(BUFFER_BYTES),
            wire: VecDeque::new(),
            control: Control::default(),
            interpreter: Interpreter::new(Plotter::named("hp7475a").unwrap_or(Plotter::generic())),
            busy_us: 0,
            outbox: VecDeque::new(),
            untriggered: VecDeque::new(),
            echo: None,
            block: Vec::new(),
            passed: Vec::new(),
            is_damaged: false,
            is_off: false,
            moved_us: 0,
            view: false,
        }
    }

    /// A byte has arrived.
    fn arrive(&mut self, byte: u8, now_us: u64) {
        let mut byte = byte & 0x7F;
        if std::mem::take(&mut self.is_damaged) {
            // The byte is used as it was understood.
            self.control.error(15);
            byte ^= 0x01;
        }
        if let Some(end) = self.echo {
            if byte == end {
                self.echo = None;
            }
            return;
        }
        if self.control.trigger == Some(byte)
            && let Some(answer) = self.untriggered.pop_front()
        {
            return self.post(answer, now_us + self.control.turnaround_us);
        }
        match self.control.receive(byte) {
            Received::Text(byte) => self.text(byte),
            Received::Passed(byte) => self.passed.push(byte),
            Received::Nothing => {}
            Received::Room => self.answer(&self.room_for_text().to_string(), now_us),
            Received::Size => self.control.wants_size = true,
            Received::Status => {
                let status = self.status();
                self.answer(&status.to_string(), now_us);
            }
            Received::LineError => {
                let error = self.control.take_error();
                self.end_block(error);
                self.answer(&error.to_string(), now_us);
            }
            Received::DropAnswers => {
                self.outbox.clear();
                self.untriggered.clear();
            }
            Received::DropBuffer => {
                self.port.buffer.clear();
                self.block.clear();
                self.interpreter.forget();
                self.control.wants_size = false;
            }
            Received::Enquiry => {
                // Without a character for it the answer is sent at once, however full the buffer is.
                if self.control.enquiry_is_honest() && self.room_for_text() < self.control.block {
                    self.control.owes_ack = true;
                    let immediate = self.control.immediate_answer().to_vec();
                    if !immediate.is_empty() {
                        self.post(immediate, now_us);
                    }
                } else {
                    self.outbox.push_back((now_us, vec![0x06]));
                }
            }
        }
        self.flow(now_us);
    }

    /// A byte of HP-GL, for the buffer, or for the block that has not ended.
    fn text(&mut self, byte: u8) {
        if self.room_for_text() == 0 {
            // New bytes are dropped.
            return self.control.overflow();
        }
        if self.control.block_mode {
            self.block.push(byte);
        } else {
            self.port.push(byte);
        }
    }

    /// Free bytes for HP-GL.
    fn room_for_text(&self) -> usize {
        self.port.room().saturating_sub(self.block.len())
    }

    /// The end of a block: without an error it goes into the buffer, else it is dropped.
    fn end_block(&mut self, error: u8) {
        for byte in std::mem::take(&mut self.block) {
            if error == 0 {
                self.port.push(byte);
            }
        }
    }

    /// Sends bytes, with the gap of `ESC.N` between them; an echo may follow.
    fn post(&mut self, bytes: Vec<u8>, at_us: u64) {
        self.echo = self.control.echo_end;
        if self.control.gap_us == 0 {
            return self.outbox.push_back((at_us, bytes));
        }
        for (index, byte) in (0..).zip(bytes) {
            self.outbox.push_back((at_us + index * self.control.gap_us, vec![byte]));
        }
    }

    /// `ESC.O`.
    fn status(&self) -> u32 {
        let is_empty = self.port.buffer.is_empty() && self.interpreter.is_between();
        let suspended = u32::from(self.view) * 16 + u32::from(self.interpreter.lever_is_up()) * 32;
        8 * u32::from(is_empty) + suspended
    }

    /// An answer with what `ESC.M` puts around it.
    fn answer(&mut self, text: &str, now_us: u64) {
        if !self.outbox.is_empty() && self.outbox.iter().any(|(at, _)| *at > now_us) {
            // The answer before it is not out yet.
            self.control.error(10);
        }
        let mut bytes = self.control.initiator.iter().copied().collect::<Vec<u8>>();
        bytes.extend_from_slice(text.as_bytes());
        bytes.extend_from_slice(&self.control.terminators);
        if self.control.trigger.is_some() {
            self.untriggered.push_back(bytes);
        } else {
            self.post(bytes, now_us + self.control.turnaround_us);
        }
    }

    /// XOFF, XON and ACK as the buffer fills and empties.
    fn flow(&mut self, now_us: u64) {
        let room = self.room_for_text();
        if let Some((xoff, xon)) = self.control.xon_xoff() {
            if !self.is_off && room <= self.control.block {
                self.is_off = true;
                self.outbox.push_back((now_us, xoff));
            } else if self.is_off && room >= XON_BYTES.max(self.control.block + 1) {
                self.is_off = false;
                self.outbox.push_back((now_us, vec![xon]));
            }
        }
        if self.control.owes_ack && room >= self.control.block {
            self.control.owes_ack = false;
            self.outbox.push_back((now_us, vec![0x06]));
        }
        if self.control.wants_size && self.port.buffer.is_empty() {
            self.control.wants_size = false;
            self.answer(&BUFFER_BYTES.to_string(), now_us);
        }
    }

    /// Executes what the buffer holds until a vector is in execution.
    fn execute(&mut self, now_us: u64) {
        while self.busy_us <= now_us && !self.view && self.port.stalled_us <= now_us {
            let Some(step) = self.interpreter.step(&mut self.port.buffer, &mut self.port.ink) else { break };
            if let Some(answer) = step.answer {
                self.answer(&answer, now_us);
            }
            self.busy_us = now_us + step.duration_us;
            self.moved_us = self.busy_us;
        }
        self.flow(now_us);
    }

    /// When something next happens by itself, at or after `now_us`.
    fn next_event(&self) -> Option<u64> {
        let arrival = self.wire.front().map(|(at, _)| *at);
        let can_run = !self.view && !self.port.buffer.is_empty();
        let run = can_run.then(|| self.busy_us.max(self.port.stalled_us));
        let lift = self.interpreter.pen_is_down().then(|| self.moved_us + AUTO_LIFT_US);
        arrival.into_iter().chain(run).chain(lift).min()
    }
}

impl Device for Emulator {
    fn port(&self) -> &Port {
        &self.port
    }

    fn port_mut(&mut self) -> &mut Port {
        &mut self.port
    }

    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        self.advance(now_us);
        let mut at_us = self.wire.back().map_or(now_us, |(last, _)| (*last).max(now_us));
        for byte in bytes {
            at_us += BYTE_US;
            self.wire.push_back((at_us, *byte));
        }
    }

    fn disconnect(&mut self) {
        self.wire.clear();
    }

    fn power_cut(&mut self, now_us: u64) {
        let mut ink = std::mem::take(&mut self.port.ink);
        ink.pen(0, self.interpreter.at());
        let at = self.interpreter.at();
        *self = Self { busy_us: now_us, ..Self::new() };
        self.interpreter.move_to(at);
        self.port.ink = ink;
    }

    fn hold(&mut self, held: bool, _now_us: u64) {
        self.view = held;
    }

    fn room(&self) -> usize {
        let room = self.port.room().saturating_sub(self.wire.len());
        // DTR stops the sender of a hardwired port.
        if self.control.hardwire && room < DTR_BYTES { 0 } else { room.max(1) }
    }

    fn advance(&mut self, now_us: u64) {
        while let Some(at_us) = self.next_event().filter(|at_us| *at_us <= now_us) {
            while let Some((arrival_us, byte)) = self.wire.front().copied().filter(|(at, _)| *at <= at_us) {
                self.wire.pop_front();
                self.arrive(byte, arrival_us);
            }
            if self.interpreter.pen_is_down() && self.moved_us + AUTO_LIFT_US <= at_us {
                self.interpreter.rest(&mut self.port.ink);
            }
            self.execute(at_us);
        }
        while let Some((_, answer)) = self.outbox.front().cloned().filter(|(at, _)| *at <= now_us) {
            self.outbox.pop_front();
            self.port.answers.push(answer);
        }
    }

    fn wake_us(&self) -> Option<u64> {
        let answer = self.outbox.front().map(|(at, _)| *at);
        self.next_event().into_iter().chain(answer).min()
    }

    fn pen_is_down(&self) -> bool {
        self.interpreter.pen_is_down()
    }
}

#[cfg(test)]
mod tests;
