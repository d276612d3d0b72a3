//! Asking a machine where it stands, before a plan is gone on with.

use crate::asking::grbl_report;
use crate::conversation::{Lines, framed, unframed};
use crate::script::Dialect;

/// It is asked again after this, microseconds.
const AGAIN_US: u64 = 500_000;
/// So often without any answer.
const TRIES: u32 = 10;

/// What the machine says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Located {
    /// It rests there: ticks, steps from where the motors were switched on, or micrometres.
    At([i64; 2]),
    /// It does not know: nothing has been sent to it since it was homed.
    Unknown,
    /// It says nothing.
    Silent,
}

/// The question.
#[derive(Debug)]
pub struct Locating {
    dialect: Dialect,
    /// Where grbl was idle when it was last asked.
    stood: Option<[i64; 2]>,
    offset: [i64; 2],
    lines: Lines,
    tries: u32,
    again_us: u64,
    moving: bool,
    found: Option<Located>,
}

impl Locating {
    /// For machines of this dialect, which is one that can be asked.
    pub fn new(dialect: Dialect) -> Self {
        Self {
            dialect,
            stood: None,
            offset: [0; 2],
            lines: Lines::default(),
            tries: 0,
            again_us: 0,
            moving: true,
            found: None,
        }
    }

    /// Bytes have come in.
    pub fn receive(&mut self, bytes: &[u8]) {
        for line in self.lines.add(bytes) {
            self.tries = 0;
            match self.dialect {
                Dialect::Ebb(..) => {
                    if let Some(state) = line.strip_prefix("QM,") {
                        self.moving = state.split(',').any(|word| word != "0");
                    } else if let Some((a, b)) = line.split_once(',')
                        && let (Ok(a), Ok(b)) = (a.parse(), b.parse())
                        && !self.moving
                    {
                        self.found = Some(Located::At([a, b]));
                    }
                    continue;
                }
                Dialect::Gcode => {
                    if let Some((place, moving)) = grbl_report(&line, &mut self.offset) {
                        // It may be idle between two lines: it has to be so twice.
                        if !moving && self.stood == Some(place) {
                            self.found = Some(Located::At(place));
                        }
                        self.stood = (!moving).then_some(place);
                    }
                    continue;
                }
                _ => {}
            }
            let Some(text) = unframed(&line) else { continue };
            let words: Vec<&str> = text.split(' ').collect();
            match words[..] {
                ["at", "unknown"] => self.found = Some(Located::Unknown),
                ["at", a, b, "0"] => {
                    if let (Ok(a), Ok(b)) = (a.parse(), b.parse()) {
                        self.found = Some(Located::At([a, b]));
                    }
                }
                _ => {}
            }
        }
    }

    /// What is to be said now.
    pub fn transmit(&mut self, now_us: u64) -> Vec<u8> {
        if self.found.is_some() || now_us < self.again_us {
            return Vec::new();
        }
        self.tries += 1;
        if self.tries > TRIES {
            self.found = Some(Located::Silent);
            return Vec::new();
        }
        self.again_us = now_us + AGAIN_US;
        match self.dialect {
            Dialect::Ebb(..) => b"\rQM\rQS\r".to_vec(),
            Dialect::Gcode => b"?".to_vec(),
            _ => format!("\n{}\n", framed("where")).into_bytes(),
        }
    }

    /// When it wants to be asked again.
    pub fn wake_us(&self) -> u64 {
        self.again_us
    }

    /// What came of it, once something has.
    pub fn found(&self) -> Option<Located> {
        self.found
    }
}
