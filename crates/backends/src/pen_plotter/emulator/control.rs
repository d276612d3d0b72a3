//! Device control: `ESC.x` sequences, acted on as they are received.

/// What a received byte means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Received {
    /// A byte of HP-GL.
    Text(u8),
    /// A byte that is passed on to the terminal: the plotter is off.
    Passed(u8),
    /// Part of a sequence, or one without an answer.
    Nothing,
    /// `ESC.B`.
    Room,
    /// `ESC.L`.
    Size,
    /// `ESC.O`.
    Status,
    /// `ESC.E`.
    LineError,
    /// `ESC.J`.
    DropAnswers,
    /// `ESC.K`.
    DropBuffer,
    /// ENQ.
    Enquiry,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
enum Parsing {
    #[default]
    Text,
    /// After ESC.
    Escape,
    /// After ESC and a full stop.
    Dot,
    /// In the parameters of this letter.
    Parameters(u8, String),
}

const ESC: u8 = 0x1B;
const ENQ: u8 = 0x05;

/// The receiver's state.
#[derive(Clone, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of the machine")]
pub(super) struct Control {
    parsing: Parsing,
    /// Off: everything but device control is passed on to the terminal.
    is_off: bool,
    /// DTR is used.
    pub(super) hardwire: bool,
    /// Free bytes at which the sender is stopped.
    pub(super) block: usize,
    enquiry: u8,
    /// Text is kept until `ESC.E` ends the block.
    pub(super) block_mode: bool,
    /// XON, if XON/XOFF is on.
    xon: Option<u8>,
    /// What stops the sender: XOFF, or the immediate answer to an enquiry that has to wait.
    stop: Vec<u8>,
    /// Time between the bytes of an answer.
    pub(super) gap_us: u64,
    pub(super) turnaround_us: u64,
    /// An answer waits for this byte of the computer.
    pub(super) trigger: Option<u8>,
    /// The computer's echo of an answer ends with this byte.
    pub(super) echo_end: Option<u8>,
    pub(super) initiator: Option<u8>,
    pub(super) terminators: Vec<u8>,
    error: u8,
    pub(super) wants_size: bool,
    pub(super) owes_ack: bool,
}

impl Default for Control {
    fn default() -> Self {
        Self {
            parsing: Parsing::Text,
            is_off: false,
            hardwire: true,
            block: 80,
            enquiry: 0,
            block_mode: false,
            xon: None,
            stop: Vec::new(),
            gap_us: 0,
            turnaround_us: 0,
            trigger: None,
            echo_end: None,
            initiator: None,
            terminators: vec![13],
            error: 0,
            wants_size: false,
            owes_ack: false,
        }
    }
}

impl Control {
    /// A byte, 7 bits.
    pub(super) fn receive(&mut self, byte: u8) -> Received {
        match std::mem::take(&mut self.parsing) {
            _ if byte == ESC => self.parsing = Parsing::Escape,
            Parsing::Text if self.is_off => return Received::Passed(byte),
            Parsing::Text if byte == ENQ => return Received::Enquiry,
            Parsing::Escape if byte == b'.' => self.parsing = Parsing::Dot,
            // Not device control: the text of HP-GL, without the ESC.
            Parsing::Escape if self.is_off => return Received::Passed(byte),
            Parsing::Text | Parsing::Escape => return Received::Text(byte),
            Parsing::Dot => return self.letter(byte),
            Parsing::Parameters(letter, text) if byte == b':' => self.parameters(letter, &text),
            Parsing::Parameters(letter, mut text) => {
                if byte.is_ascii_digit() || byte == b';' {
                    text.push(char::from(byte));
                    self.parsing = Parsing::Parameters(letter, text);
                } else {
                    self.error(12);
                }
            }
        }
        Received::Nothing
    }

    fn letter(&mut self, letter: u8) -> Received {
        if self.is_off && !matches!(letter, b'(' | b'Y') {
            return Received::Nothing;
        }
        match letter {
            b'(' | b'Y' => self.is_off = false,
            b')' | b'Z' => self.off(),
            b'@' | b'H' | b'I' | b'M' | b'N' => self.parsing = Parsing::Parameters(letter, String::new()),
            b'B' => return Received::Room,
            b'E' => return Received::LineError,
            b'J' => return Received::DropAnswers,
            b'K' => return Received::DropBuffer,
            b'L' => return Received::Size,
            b'O' => return Received::Status,
            b'R' => {
                let (error, is_off) = (self.error, self.is_off);
                *self = Self { is_off, error, ..Self::default() };
            }
            _ => self.error(11),
        }
        Received::Nothing
    }

    fn parameters(&mut self, letter: u8, text: &str) {
        let values: Vec<Option<u32>> = text.split(';').map(|value| value.parse().ok()).collect();
        let value = |place: usize| values.get(place).copied().flatten();
        let byte = |place: usize| value(place).map(|value| value as u8).filter(|byte| *byte != 0);
        if values.len() > 12 {
            return self.error(14);
        }
        match letter {
            // The size of the buffer is cut to what there is.
            b'@' => {
                let bits = value(1).unwrap_or(1);
                (self.hardwire, self.block_mode) = (bits & 1 != 0, bits & 16 != 0);
            }
            b'H' | b'I' => {
                self.block = value(0).unwrap_or(80) as usize;
                self.enquiry = byte(1).unwrap_or(0);
                self.xon = byte(2).filter(|_| letter == b'I' && self.enquiry == 0);
            }
            b'M' => {
                self.turnaround_us = delay_us(value(0).unwrap_or(0));
                (self.trigger, self.echo_end) = (byte(1), byte(2));
                self.terminators = [byte(3).or(Some(13)), byte(4)].into_iter().flatten().collect();
                self.initiator = byte(5);
            }
            _ => {
                self.gap_us = delay_us(value(0).unwrap_or(0));
                self.stop = (1..=10).filter_map(byte).collect();
            }
        }
    }

    /// XOFF and XON, if that is on.
    pub(super) fn xon_xoff(&self) -> Option<(Vec<u8>, u8)> {
        Some((self.stop.clone(), self.xon?)).filter(|(stop, _)| !stop.is_empty())
    }

    /// What is answered at once to an enquiry that has to wait for room.
    pub(super) fn immediate_answer(&self) -> &[u8] {
        &self.stop
    }

    /// Whether an enquiry waits for room.
    pub(super) fn enquiry_is_honest(&self) -> bool {
        self.enquiry == ENQ
    }

    pub(super) fn off(&mut self) {
        self.is_off = true;
    }

    pub(super) fn error(&mut self, number: u8) {
        self.error = number;
    }

    pub(super) fn overflow(&mut self) {
        self.error(16);
    }

    /// The latched error, which is then cleared.
    pub(super) fn take_error(&mut self) -> u8 {
        std::mem::take(&mut self.error)
    }
}

/// The delay that a parameter stands for: 1.1875 p modulo 65536, in units of 1/1.2 ms (7475A's manual).
fn delay_us(parameter: u32) -> u64 {
    ((1.1875 * f64::from(parameter)) % 65_536.0 / 1.2 * 1000.0) as u64
}
