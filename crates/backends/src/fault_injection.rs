//! A wire with faults at given answers, bytes or times.

use std::collections::VecDeque;

use crate::device::Device;
use crate::homing::SwitchFault;

/// A fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The machine's answer of this number, from 0, is lost.
    LostAnswer(u64),
    /// That answer and those after it are delayed by this time, microseconds.
    LateAnswer(u64, u64),
    /// That answer is garbled.
    GarbledAnswer(u64),
    /// From this time the machine takes nothing out of its buffer, for this long, microseconds.
    FullBuffer(u64, u64),
    /// From this time the wire is unplugged, for this long, microseconds: everything in transit is lost. The machine keeps its
    /// power and executes what it received.
    Unplugged(u64, u64),
    /// One bit of the sent byte of this number is flipped.
    GarbledByte(u64),
    /// At this time the power fails and returns.
    PowerCut(u64),
    /// From this time the operator holds the machine, for this long, microseconds.
    Held(u64, u64),
    /// At this time a limit switch closes.
    Limit(u64),
    /// A switch does not work while the machine homes.
    Switch(SwitchFault),
}

/// A machine behind such a wire.
pub struct FaultInjector {
    device: Box<dyn Device>,
    faults: Vec<Fault>,
    answered: u64,
    received: u64,
    /// Power cuts and closed switches that have happened.
    cut: Vec<u64>,
    /// Answers on their way, with the time from which they may be heard.
    wire: VecDeque<(u64, Vec<u8>)>,
}

impl std::fmt::Debug for FaultInjector {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FaultInjector").field("faults", &self.faults).finish_non_exhaustive()
    }
}

impl FaultInjector {
    /// A machine behind a wire with these faults.
    pub fn new(device: Box<dyn Device>, faults: Vec<Fault>) -> Self {
        Self { device, faults, answered: 0, received: 0, cut: Vec::new(), wire: VecDeque::new() }
    }

    /// The machine.
    pub fn device(&self) -> &dyn Device {
        &*self.device
    }

    /// Whether the wire is plugged in.
    pub fn plugged(&self, now_us: u64) -> bool {
        !self
            .faults
            .iter()
            .any(|fault| matches!(fault, Fault::Unplugged(at, lasts) if (*at..at + lasts).contains(&now_us)))
    }

    /// Advances the clock.
    pub fn advance(&mut self, now_us: u64) {
        for fault in &self.faults {
            match fault {
                Fault::FullBuffer(at, lasts) if (*at..at + lasts).contains(&now_us) => {
                    self.device.stall(at + lasts);
                }
                Fault::Held(at, lasts) if now_us >= *at => {
                    self.device.hold((*at..at + lasts).contains(&now_us), now_us);
                }
                Fault::Limit(at) if now_us >= *at && !self.cut.contains(at) => {
                    self.cut.push(*at);
                    self.device.limit(now_us);
                }
                Fault::PowerCut(at) if now_us >= *at && !self.cut.contains(at) => {
                    self.cut.push(*at);
                    self.device.power_cut(now_us);
                }
                _ => {}
            }
        }
        self.device.advance(now_us);
        if !self.plugged(now_us) {
            self.device.disconnect();
        }
        self.collect(now_us);
    }

    fn collect(&mut self, now_us: u64) {
        for mut answer in self.device.answers() {
            let number = self.answered;
            self.answered += 1;
            let mut heard_us = now_us;
            let mut lost = !self.plugged(now_us);
            for fault in &self.faults {
                match fault {
                    Fault::LostAnswer(n) => lost |= *n == number,
                    Fault::LateAnswer(n, late_us) if *n == number => heard_us = now_us + late_us,
                    Fault::GarbledAnswer(n) if *n == number => {
                        for (k, byte) in answer.iter_mut().enumerate().filter(|(_, byte)| **byte > b' ') {
                            *byte = b'#' + ((number + 7 * k as u64) % 11) as u8;
                        }
                        answer.insert(0, 0xFE);
                    }
                    _ => {}
                }
            }
            if !lost {
                // Answers keep their order.
                let heard_us = self.wire.back().map_or(heard_us, |(before, _)| heard_us.max(*before));
                self.wire.push_back((heard_us, answer));
            }
        }
        if !self.plugged(now_us) {
            self.wire.clear();
        }
    }

    /// Bytes from the sender.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64) {
        self.advance(now_us);
        let mut bytes = bytes.to_vec();
        for byte in &mut bytes {
            if self.faults.contains(&Fault::GarbledByte(self.received)) {
                *byte ^= 0x04;
            }
            self.received += 1;
        }
        if self.plugged(now_us) {
            self.device.receive(&bytes, now_us);
        }
        self.collect(now_us);
    }

    /// The bytes that the sender receives now.
    pub fn heard(&mut self, now_us: u64) -> Vec<u8> {
        let mut bytes = Vec::new();
        while self.wire.front().is_some_and(|(heard_us, _)| *heard_us <= now_us) {
            bytes.extend(self.wire.pop_front().map(|(_, answer)| answer).unwrap_or_default());
        }
        bytes
    }

    /// When something next happens without input.
    pub fn wake_us(&self, now_us: u64) -> Option<u64> {
        let faults = self.faults.iter().flat_map(|fault| match fault {
            Fault::FullBuffer(at, lasts) | Fault::Unplugged(at, lasts) | Fault::Held(at, lasts) => {
                vec![*at, at + lasts]
            }
            Fault::PowerCut(at) | Fault::Limit(at) => vec![*at],
            _ => Vec::new(),
        });
        let heard = self.wire.front().map(|(heard_us, _)| *heard_us);
        let device = self.device.wake_us();
        faults.filter(|at| *at > now_us).chain(heard).chain(device).min()
    }
}
