//! From bytes to commands.
//!
//! The parser never fails. It keeps just enough state to know where a command ends (the label terminator, and
//! whether the bytes are HP-GL, PCL or job control) and leaves meaning to the interpreter.

mod texts;
mod wrappers;

use drawing::{Point, Span};

use crate::codes;
use crate::diagnostics::{Code, Findings};
use crate::envelope;
use crate::lexer::{Class, class, scan_number};
use crate::mnemonics::{Form, form_of};
use crate::summary::Wrappers;
use crate::syntax::{Command, Entry, Mnemonic, Syntax};

/// The terminator of labels until `DT` names another: ETX.
pub(crate) const ETX: u8 = 3;

/// Coordinate lists are handed over in pieces of at most this many numbers, so that memory does not follow the
/// length of one command.
const PIECE: usize = 8192;

/// In what language the next byte is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Language {
    HpGl,
    Pcl,
    Job,
}

/// The result of a search that is done at most once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Searched {
    NotYet,
    Nowhere,
    At(usize),
}

/// What one step of reading comes to.
enum Step {
    /// The file is at its end.
    End,
    /// Something was read that is no command.
    Nothing,
    Command(Head),
}

impl From<Option<Head>> for Step {
    fn from(head: Option<Head>) -> Self {
        head.map_or(Self::Nothing, Self::Command)
    }
}

/// What the parser noticed about the file as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Hints {
    /// The file is UTF-8 made from Latin-1: bytes above 127 arrive as two.
    pub(crate) reencoded: bool,
    /// What stands around the commands.
    pub(crate) wrappers: Wrappers,
}

/// A command without its parameters, which the parser keeps.
#[derive(Clone, Copy, Debug)]
struct Head {
    mnemonic: Mnemonic,
    span: Span,
    number: usize,
    text: Span,
}

/// Reads commands one after the other.
pub(crate) struct Parser<'a> {
    bytes: &'a [u8],
    at: usize,
    language: Language,
    default_terminator: u8,
    terminator: u8,
    /// The terminator is printed too (`DT` with mode 0).
    prints_terminator: bool,
    number: usize,
    parameters: Vec<f64>,
    /// The mnemonic and start of a coordinate list whose next piece begins at `at`.
    unfinished: Option<(Mnemonic, usize)>,
    pub(crate) findings: Findings,
    pub(crate) hints: Hints,
    /// Where each byte value occurs last, as far as it was asked for.
    last: Vec<Searched>,
    /// The next entry into HP-GL/2, once searched for.
    next_entry: Searched,
    encoding_known: bool,
}

impl<'a> Parser<'a> {
    pub(crate) fn new(bytes: &'a [u8], label_terminator: Option<u8>) -> Self {
        let terminator = label_terminator.unwrap_or(ETX);
        Self {
            bytes,
            at: 0,
            language: Language::HpGl,
            default_terminator: terminator,
            terminator,
            prints_terminator: false,
            number: 0,
            parameters: Vec::new(),
            unfinished: None,
            findings: Findings::default(),
            hints: Hints::default(),
            last: vec![Searched::NotYet; 256],
            next_entry: Searched::NotYet,
            encoding_known: false,
        }
    }

    /// The next command; nothing at the end of the file.
    #[inline]
    pub(crate) fn next(&mut self) -> Option<Command<'_>> {
        let head = self.head()?;
        Some(Command {
            mnemonic: head.mnemonic,
            span: head.span,
            number: head.number,
            parameters: &self.parameters,
            text: &self.bytes[head.text.start..head.text.end],
            text_span: head.text,
            reencoded: self.hints.reencoded,
        })
    }

    /// All commands.
    pub(crate) fn collect(mut self) -> Syntax<'a> {
        let mut entries = Vec::new();
        let mut parameters = Vec::new();
        while let Some(head) = self.head() {
            let first_parameter = parameters.len();
            parameters.extend_from_slice(&self.parameters);
            entries.push(Entry {
                mnemonic: head.mnemonic,
                span: head.span,
                number: head.number,
                first_parameter,
                last_parameter: parameters.len(),
                text: head.text,
                findings: self.findings.len(),
            });
        }
        Syntax {
            bytes: self.bytes,
            entries,
            parameters,
            findings: self.findings,
            hints: self.hints,
            command_count: self.number,
        }
    }

    /// How many commands were met so far, unknown ones included.
    pub(crate) fn number(&self) -> usize {
        self.number
    }

    /// Whether the file is Latin-1 that was saved as UTF-8: all of it reads as UTF-8, no character is beyond Latin-1,
    /// and some byte pair stands for one of the bytes that end numbers in encoded polylines.
    fn is_reencoded(&mut self) -> bool {
        if !self.encoding_known {
            self.encoding_known = true;
            self.hints.reencoded = std::str::from_utf8(self.bytes).is_ok_and(|text| {
                text.chars().all(|c| c <= '\u{ff}')
                    && text.chars().any(|c| ('\u{c0}'..='\u{fe}').contains(&c))
            });
        }
        self.hints.reencoded
    }

    fn report(
        &mut self,
        code: Code,
        mnemonic: Mnemonic,
        span: Span,
        message: impl FnOnce() -> (String, Option<String>),
    ) {
        // The pen's place is not the parser's business: the interpreter fills it in.
        self.findings.report(code, mnemonic, span, self.number.max(1), Point::ZERO, message);
    }

    #[inline]
    fn head(&mut self) -> Option<Head> {
        self.parameters.clear();
        if let Some((mnemonic, start)) = self.unfinished.take() {
            let head = self.numbers(mnemonic, start);
            if head.is_some() {
                return head;
            }
        }
        loop {
            let step = match self.language {
                Language::HpGl => self.hpgl(),
                Language::Pcl => self.pcl(),
                Language::Job => self.job(),
            };
            match step {
                Step::End => return None,
                Step::Nothing => {}
                Step::Command(head) => return Some(head),
            }
        }
    }

    /// A wrapper's word as a command of its own.
    fn wrapper(&mut self, mnemonic: Mnemonic, start: usize) -> Head {
        self.number += 1;
        let span = Span { start, end: self.at };
        Head { mnemonic, span, number: self.number, text: Span { start: self.at, end: self.at } }
    }

    /// One step between commands.
    #[inline]
    fn hpgl(&mut self) -> Step {
        let start = self.at;
        let Some(&byte) = self.bytes.get(start) else { return Step::End };
        match class(byte) {
            Class::Letter => return self.letters().into(),
            Class::Terminator | Class::Blank | Class::Comma | Class::LineEnd => self.at += 1,
            Class::Escape => return self.escape().into(),
            Class::Control => {
                self.at += 1;
                self.report_control(Mnemonic::NONE, start);
            }
            Class::Digit | Class::Sign | Class::Point => {
                self.skip_parameters();
                let span = Span { start, end: self.at };
                self.report(codes::NUMBERS_WITHOUT_COMMAND, Mnemonic::NONE, span, || {
                    ("numbers that belong to no command are skipped".into(), None)
                });
            }
            Class::Other if self.bytes[start..].starts_with(b"@PJL") => self.language = Language::Job,
            Class::Other => {
                self.at += 1;
                self.report_stray(Mnemonic::NONE, start);
            }
        }
        Step::Nothing
    }

    fn report_control(&mut self, mnemonic: Mnemonic, at: usize) {
        let byte = self.bytes[at];
        self.report(codes::CONTROL_BYTE, mnemonic, Span { start: at, end: at + 1 }, || {
            (format!("byte {byte} is passed over"), None)
        });
    }

    fn report_stray(&mut self, mnemonic: Mnemonic, at: usize) {
        let byte = self.bytes[at];
        self.report(codes::STRAY_BYTE, mnemonic, Span { start: at, end: at + 1 }, || {
            (format!("`{}` has no meaning here and is skipped", byte.escape_ascii()), None)
        });
    }

    /// At a letter: a command, an unknown command, or something that is none.
    #[inline]
    fn letters(&mut self) -> Option<Head> {
        let start = self.at;
        let first = self.bytes[start];
        let Some(&second) = self.bytes.get(start + 1) else {
            self.at += 1;
            self.report_unknown(start, start + 1);
            return None;
        };
        if class(second) != Class::Letter {
            return self.parted_letters();
        }
        let mnemonic = Mnemonic([first.to_ascii_uppercase(), second.to_ascii_uppercase()]);
        let third_is_small = self.bytes.get(start + 2).is_some_and(u8::is_ascii_lowercase);
        if second.is_ascii_lowercase() && third_is_small && self.is_prose(start) {
            self.skip_word(start);
            return None;
        }
        let Some(form) = form_of(mnemonic) else {
            self.resynchronise(start);
            return None;
        };
        self.at += 2;
        self.command(mnemonic, form, start)
    }

    /// A letter with something else than a letter after it. GhostPDL lets blanks and control bytes pass between
    /// the two letters of a name; a lone letter is nothing.
    fn parted_letters(&mut self) -> Option<Head> {
        let start = self.at;
        let mut next = start + 1;
        while self.bytes.get(next).is_some_and(|&b| {
            matches!(class(b), Class::Blank | Class::Control | Class::LineEnd | Class::Comma)
        }) {
            next += 1;
        }
        let first = self.bytes[start].to_ascii_uppercase();
        if let Some(&second) = self.bytes.get(next)
            && class(second) == Class::Letter
        {
            let mnemonic = Mnemonic([first, second.to_ascii_uppercase()]);
            // `P PA0,0` is a stray letter before a command, not `PP`: a whole name right there goes first.
            let whole = self.bytes.get(next + 1).is_some_and(|&b| class(b) == Class::Letter)
                && form_of(Mnemonic([
                    second.to_ascii_uppercase(),
                    self.bytes[next + 1].to_ascii_uppercase(),
                ]))
                .is_some();
            if !whole && let Some(form) = form_of(mnemonic) {
                self.at = next + 1;
                let span = Span { start, end: self.at };
                self.report(codes::PARTED_NAME, mnemonic, span, || {
                    (format!("the letters of `{mnemonic}` stand apart; they are read as one name"), None)
                });
                return self.command(mnemonic, form, start);
            }
        }
        self.at = start + 1;
        self.report_unknown(start, start + 1);
        self.skip_parameters();
        None
    }

    fn report_unknown(&mut self, start: usize, end: usize) {
        let name = self.bytes[start..end].to_ascii_uppercase();
        let mnemonic = Mnemonic([name[0], name.get(1).copied().unwrap_or(b' ')]);
        self.number += 1;
        self.report(codes::UNKNOWN_COMMAND, mnemonic, Span { start, end }, || {
            (format!("unknown command `{}` is skipped", name.escape_ascii()), None)
        });
    }

    /// Length of the run of letters at `start`, as far as it matters.
    fn run_of_letters(&self, start: usize) -> usize {
        self.bytes[start..].iter().take(64).take_while(|&&b| class(b) == Class::Letter).count()
    }

    /// How the letters from `start` to `end` read: as names of commands only, or with something else among them.
    fn reads_as_commands(&self, start: usize, end: usize) -> bool {
        let mut at = start;
        while at < end {
            let Some(pair) = self.bytes.get(at..(at + 2).min(end)).filter(|pair| pair.len() == 2) else {
                return false;
            };
            match form_of(Mnemonic([pair[0].to_ascii_uppercase(), pair[1].to_ascii_uppercase()])) {
                None => return false,
                Some(Form::Numbers) => at += 2,
                // Whatever follows is the command's own.
                Some(_) => return true,
            }
        }
        true
    }

    /// A word in small letters that is not made of commands is text that got into the file.
    fn is_prose(&self, start: usize) -> bool {
        let length = self.run_of_letters(start);
        self.bytes[start + 1..start + length].iter().all(u8::is_ascii_lowercase)
            && !self.reads_as_commands(start, start + length)
    }

    fn skip_word(&mut self, start: usize) {
        let length = self.run_of_letters(start);
        self.at = start + length;
        self.number += 1;
        self.report(codes::PROSE, Mnemonic::NONE, Span { start, end: start + length }, || {
            ("text between commands is skipped".into(), None)
        });
        self.skip_parameters();
    }

    /// An unknown pair of letters: find where the next command begins in the same run of letters, if it does.
    ///
    /// A stray letter before a command (`ZPD1,2`) and an unknown command without terminator (`ZQPD1,2`) both occur.
    /// The rest of the run counts as commands only if it reads as such to its end and parameters or a terminator
    /// follow; otherwise words like TEXT would draw.
    fn resynchronise(&mut self, start: usize) {
        let end = start + self.run_of_letters(start);
        let mut after = end;
        while self.bytes.get(after).is_some_and(|&b| class(b) == Class::Blank) {
            after += 1;
        }
        let goes_on = self
            .bytes
            .get(after)
            .is_none_or(|&b| !matches!(class(b), Class::Letter | Class::Other) || b == b'"');
        for next in [start + 1, start + 2] {
            if next < end && goes_on && self.reads_as_commands(next, end) {
                self.report_unknown(start, next);
                self.at = next;
                return;
            }
        }
        self.report_unknown(start, start + 2);
        self.at = end;
        self.skip_parameters();
    }

    /// Passes over what looks like parameters of something that is not understood.
    fn skip_parameters(&mut self) {
        while let Some(&byte) = self.bytes.get(self.at) {
            match class(byte) {
                Class::Letter | Class::Escape => return,
                Class::Terminator => {
                    self.at += 1;
                    return;
                }
                _ => self.at += 1,
            }
        }
    }

    /// The rest of a command whose name ends at `at`.
    #[inline]
    fn command(&mut self, mnemonic: Mnemonic, form: Form, start: usize) -> Option<Head> {
        self.number += 1;
        if matches!(&mnemonic.0, b"IN" | b"DF" | b"BP") {
            self.restore_terminator();
        }
        Some(match form {
            Form::Numbers => return self.numbers(mnemonic, start),
            Form::Label => self.label(mnemonic, start),
            Form::Terminator => self.define_terminator(mnemonic, start),
            Form::Symbol => self.symbol(mnemonic, start),
            Form::Comment => self.comment(mnemonic, start),
            Form::Encoded => self.encoded(mnemonic, start),
        })
    }

    #[inline]
    fn finish(&mut self, mnemonic: Mnemonic, start: usize, text: Span) -> Head {
        Head { mnemonic, span: Span { start, end: self.at }, number: self.number, text }
    }

    #[inline]
    fn textless(&mut self, mnemonic: Mnemonic, start: usize) -> Head {
        let text = Span { start: self.at, end: self.at };
        self.finish(mnemonic, start, text)
    }

    /// A command with numbers.
    ///
    /// Interpreters of the time pass over line ends inside numbers, so that files wrapped at a column read; files
    /// written by hand put a pair on each line without a comma. In a coordinate list the count tells which it is.
    #[inline]
    fn numbers(&mut self, mnemonic: Mnemonic, start: usize) -> Option<Head> {
        let first = self.at;
        let coordinates = matches!(&mnemonic.0, b"PU" | b"PD" | b"PA" | b"PR");
        let joined = self.number_list(mnemonic, false, true);
        if joined.line_ends > 0 {
            self.weigh_line_ends(mnemonic, start, first, coordinates);
        }
        if self.unfinished.is_some() {
            self.unfinished = Some((mnemonic, start));
        }
        if self.parameters.iter().any(|value| value.is_nan()) {
            self.drop_overflow(mnemonic, start);
            if !coordinates {
                return None;
            }
        }
        Some(self.textless(mnemonic, start))
    }

    /// Decides what line ends between digits mean in the numbers that were just read from `first` on.
    #[cold]
    fn weigh_line_ends(&mut self, mnemonic: Mnemonic, start: usize, first: usize, coordinates: bool) {
        let (count, at) = (self.parameters.len(), self.at);
        let mut parted = false;
        if coordinates {
            self.at = first;
            self.parameters.clear();
            let apart = self.number_list(mnemonic, true, false);
            let apart_even = self.parameters.len().is_multiple_of(2);
            parted = apart_even && (!count.is_multiple_of(2) || !apart.broke_a_pair);
            if !parted {
                self.at = first;
                self.parameters.clear();
                self.number_list(mnemonic, false, false);
                debug_assert_eq!(self.at, at);
            }
        }
        let span = Span { start, end: self.at };
        self.report(codes::LINE_END_IN_NUMBER, mnemonic, span, || {
            let what = if parted { "they are read as two numbers" } else { "they are read as one number" };
            (
                format!("only a line end stands between digits; {what}"),
                Some("put a comma between coordinates".into()),
            )
        });
    }

    /// Takes the pairs with a number that is too large out of a coordinate list.
    #[cold]
    fn drop_overflow(&mut self, mnemonic: Mnemonic, start: usize) {
        let span = Span { start, end: self.at };
        self.report(codes::NUMBER_OUT_OF_RANGE, mnemonic, span, || {
            (format!("`{mnemonic}` has a number of 2^30 or more, which is left out"), None)
        });
        let pairs = self.parameters.chunks(2).filter(|pair| !pair.iter().any(|value| value.is_nan()));
        self.parameters = pairs.flatten().copied().collect();
    }

    /// Reads numbers up to the end of the command, or to the end of a piece of a coordinate list.
    fn number_list(&mut self, mnemonic: Mnemonic, lines_part: bool, reports: bool) -> LineEnds {
        let bytes = self.bytes;
        let mut at = self.at;
        let mut comma = false;
        let mut line_ends = LineEnds::default();
        self.unfinished = None;
        loop {
            // The everyday number: a sign, up to 15 digits, a point among them, and a separator. What it cannot read
            // goes the long way below.
            let mut i = at;
            let negative = match bytes.get(i) {
                Some(b'-') => {
                    i += 1;
                    true
                }
                Some(b'+') => {
                    i += 1;
                    false
                }
                _ => false,
            };
            let first = i;
            let mut whole: u64 = 0;
            while let Some(digit) = bytes.get(i).map(|b| b.wrapping_sub(b'0'))
                && digit < 10
            {
                whole = whole.wrapping_mul(10).wrapping_add(u64::from(digit));
                i += 1;
            }
            let mut digits = i - first;
            let mut scale = 1.0;
            if bytes.get(i) == Some(&b'.') {
                i += 1;
                let point = i;
                while let Some(digit) = bytes.get(i).map(|b| b.wrapping_sub(b'0'))
                    && digit < 10
                {
                    whole = whole.wrapping_mul(10).wrapping_add(u64::from(digit));
                    i += 1;
                }
                digits += i - point;
                scale = POWERS_OF_TEN[(i - point).min(15)];
            }
            if (1..=15).contains(&digits)
                && let Some(&after) = bytes.get(i)
                && matches!(after, b',' | b';' | b' ' | b'A'..=b'D' | b'F'..=b'Z')
            {
                // Both are exact, so that the quotient is the nearest f64.
                let size = if scale == 1.0 { whole as f64 } else { whole as f64 / scale };
                let size = if size < crate::units::LARGEST_NUMBER { size } else { f64::NAN };
                self.parameters.push(if negative { -size } else { size });
                match after {
                    b',' => {
                        comma = true;
                        at = i + 1;
                    }
                    b' ' => {
                        comma = false;
                        at = i + 1;
                    }
                    b';' => {
                        self.at = i + 1;
                        return line_ends;
                    }
                    _ => {
                        self.at = i;
                        return line_ends;
                    }
                }
                if self.parameters.len() >= PIECE && self.piece_ends(mnemonic) {
                    self.at = at;
                    return line_ends;
                }
                continue;
            }
            let Some(&byte) = bytes.get(at) else {
                self.at = at;
                return line_ends;
            };
            match class(byte) {
                Class::Comma => {
                    if reports && (comma || self.parameters.is_empty()) {
                        self.report(
                            codes::EMPTY_PARAMETER,
                            mnemonic,
                            Span { start: at, end: at + 1 },
                            || (format!("`{mnemonic}` has an empty parameter, which is passed over"), None),
                        );
                    }
                    comma = true;
                    at += 1;
                }
                Class::Blank | Class::LineEnd => at += 1,
                Class::Control => {
                    if reports {
                        self.report_control(mnemonic, at);
                    }
                    at += 1;
                }
                Class::Letter => {
                    self.at = at;
                    return line_ends;
                }
                Class::Terminator => {
                    self.at = at + 1;
                    return line_ends;
                }
                Class::Escape => {
                    let Some(length) = envelope::device_control(&bytes[at..]) else {
                        self.at = at;
                        return line_ends;
                    };
                    self.hints.wrappers.device_control = true;
                    at += length.bytes;
                }
                Class::Digit | Class::Sign | Class::Point => {
                    let scanned = scan_number(&bytes[at..], lines_part);
                    if scanned.line_ends > 0 {
                        line_ends.line_ends += scanned.line_ends;
                        line_ends.broke_a_pair |= self.parameters.len().is_multiple_of(2);
                    }
                    match scanned.value {
                        Some(value) => {
                            let fits = value.abs() < crate::units::LARGEST_NUMBER;
                            self.parameters.push(if fits { value } else { f64::NAN });
                        }
                        None if reports => self.report_stray(mnemonic, at),
                        None => {}
                    }
                    comma = false;
                    at += scanned.bytes;
                    if self.parameters.len() >= PIECE && self.piece_ends(mnemonic) {
                        self.at = at;
                        return line_ends;
                    }
                }
                Class::Other => {
                    if byte == b'"' {
                        at = self.quoted(mnemonic, at);
                        continue;
                    }
                    if reports {
                        self.report_stray(mnemonic, at);
                    }
                    at += 1;
                }
            }
        }
    }

    /// Whether a coordinate list may be handed over here: after whole pairs.
    fn piece_ends(&mut self, mnemonic: Mnemonic) -> bool {
        let ends =
            matches!(&mnemonic.0, b"PU" | b"PD" | b"PA" | b"PR") && self.parameters.len().is_multiple_of(2);
        if ends {
            self.unfinished = Some((mnemonic, self.at));
        }
        ends
    }

    /// The place after a quoted string (`BP` names the plot in one); a quote that is never closed is a stray byte.
    fn quoted(&mut self, mnemonic: Mnemonic, at: usize) -> usize {
        if self.last_of(b'"') > Some(at) {
            let length = self.bytes[at + 1..].iter().position(|&b| b == b'"').unwrap_or(0);
            return at + length + 2;
        }
        self.report_stray(mnemonic, at);
        at + 1
    }

    /// Where a byte occurs last in the file.
    fn last_of(&mut self, byte: u8) -> Option<usize> {
        let bytes = self.bytes;
        let last = &mut self.last[usize::from(byte)];
        if *last == Searched::NotYet {
            *last = bytes.iter().rposition(|&b| b == byte).map_or(Searched::Nowhere, Searched::At);
        }
        match *last {
            Searched::At(place) => Some(place),
            _ => None,
        }
    }
}

/// Line ends that stood between digits.
#[derive(Clone, Copy, Debug, Default)]
struct LineEnds {
    line_ends: usize,
    broke_a_pair: bool,
}

const POWERS_OF_TEN: [f64; 16] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
