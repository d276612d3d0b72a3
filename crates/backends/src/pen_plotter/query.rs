//! What the sender asks a plotter, and what the answers mean.

/// A question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Query {
    /// Errors of the serial line, `ESC.E`.
    LineError,
    /// Free bytes in the buffer, `ESC.B`.
    Room,
    /// Buffer empty, VIEW, lever: `ESC.O`.
    Status,
    /// The model, `OI`.
    Model,
    /// The hard-clip limits, `OH`.
    HardClip,
    /// P1 and P2, `OP`.
    Points,
    /// Position and pen, `OA`.
    Position,
    /// Whether it was initialized since it was last asked, `OS`.
    Initialized,
    /// Errors of instructions, `OE`.
    Error,
}

impl Query {
    /// The bytes that ask it. The plotter answers instructions in the order of its buffer, escape
    /// sequences at once.
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::LineError => "\u{1b}.E",
            Self::Room => "\u{1b}.B",
            Self::Status => "\u{1b}.O",
            Self::Model => "OI;",
            Self::HardClip => "OH;",
            Self::Points => "OP;",
            Self::Position => "OA;",
            Self::Initialized => "OS;",
            Self::Error => "OE;",
        }
    }

    /// How many numbers the answer has; 0 for a name.
    pub(crate) fn numbers(self) -> usize {
        match self {
            Self::Model => 0,
            Self::LineError | Self::Room | Self::Status | Self::Initialized | Self::Error => 1,
            Self::Position => 3,
            Self::HardClip | Self::Points => 4,
        }
    }

    /// Its name in messages.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::LineError => "ESC.E",
            Self::Room => "ESC.B",
            Self::Status => "ESC.O",
            _ => &self.text()[..2],
        }
    }

    /// The numbers of an answer to it; `None` for anything else. A name has no numbers.
    pub(crate) fn parse(self, line: &str) -> Option<Vec<i64>> {
        if self == Self::Model {
            let is_name = line.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-,./ ".contains(&byte));
            let has = |kind: fn(&u8) -> bool| line.as_bytes().iter().any(kind);
            // Numbers alone answer other questions.
            let is_model = is_name && has(u8::is_ascii_digit) && has(u8::is_ascii_alphabetic);
            return is_model.then(Vec::new);
        }
        let values: Option<Vec<i64>> = line.split(',').map(|number| number.trim().parse().ok()).collect();
        values.filter(|values| values.len() == self.numbers())
    }
}

/// A question that was asked and may still be answered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked {
    pub(crate) query: Query,
    /// When, microseconds.
    pub(crate) at_us: u64,
    /// HP-GL bytes sent before it.
    pub(crate) sent_bytes: u64,
    /// Instructions sent before it.
    pub(crate) sent: usize,
}

/// An error of the serial line, by the number that `ESC.E` answers.
pub(crate) fn line_error(number: i64) -> &'static str {
    match number {
        10 => "an answer was asked for while another one was being sent",
        11 => "a byte after ESC. was not understood",
        12 => "a byte in the parameters of a device control sequence was not understood",
        13 => "a parameter of a device control sequence is out of range",
        14 => "a device control sequence has too many parameters",
        15 => "framing, parity or overrun error: check speed and parity of the port",
        16 => "the input buffer overflowed and bytes were lost: check the flow control of the cable",
        _ => "unknown error of the serial line",
    }
}

/// An error of an instruction, by the number that `OE` answers.
pub(crate) fn instruction_error(number: i64) -> &'static str {
    match number {
        1 => "unknown instruction",
        2 => "wrong number of parameters",
        3 => "parameter out of range",
        5 => "unknown character set",
        6 => "position beyond the largest coordinate",
        7 => "buffer overflow",
        8 => "the lever was up or the pinch wheels were raised while a vector was drawn",
        _ => "unknown error",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_by_their_shape() {
        assert_eq!(Query::Room.parse("1024"), Some(vec![1024]));
        assert_eq!(Query::Position.parse("10365, 7962,0"), Some(vec![10_365, 7962, 0]));
        assert_eq!(Query::Position.parse("1024"), None);
        assert_eq!(Query::Room.parse("what?"), None);
        assert_eq!(Query::Model.parse("7475A"), Some(Vec::new()));
        assert_eq!(Query::Model.parse("DXY-1100"), Some(Vec::new()));
        assert_eq!(Query::Model.parse("1024"), None);
        assert_eq!(Query::Model.parse("0,0,1,1"), None);
        assert_eq!((Query::Model.name(), Query::Room.name()), ("OI", "ESC.B"));
    }
}
