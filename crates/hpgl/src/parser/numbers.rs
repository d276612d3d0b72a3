//! Commands with numbers: lists in pieces, and line ends between digits.

use drawing::Span;

use super::state::{Head, Parser};
use crate::codes;
use crate::grammar::Input;
use crate::grammar::number::{LineEnds, plain};
use crate::grammar::parameters::{Part, list_end, part};
use crate::mnemonic::Mnemonic;
use crate::units::LARGEST_NUMBER;

/// Coordinate lists are handed over in pieces of at most this many numbers, so that memory does not
/// follow the length of one command.
const PIECE: usize = 8192;

/// How a list was read.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct List {
    /// Line ends that stood between digits.
    line_ends: usize,
    /// One of them stood between the numbers of a pair.
    broke_a_pair: bool,
    /// There is more of it.
    is_unfinished: bool,
}

fn is_coordinate_list(mnemonic: Mnemonic) -> bool {
    matches!(&mnemonic.0, b"PU" | b"PD" | b"PA" | b"PR")
}

impl<'a> Parser<'a> {
    /// A command with numbers.
    ///
    /// Plotters skip line ends inside numbers, and files wrapped at a column rely on that; files
    /// written by hand put a pair on each line without a comma. In a coordinate list the count
    /// decides.
    #[inline]
    pub(super) fn numbers(&mut self, mnemonic: Mnemonic, start: usize) -> Option<Head> {
        let input = self.rest;
        let mut list = self.number_list(mnemonic, LineEnds::Join, true);
        if list.line_ends > 0 {
            list = self.weigh_line_ends(mnemonic, start, input, list);
        }
        if list.is_unfinished {
            self.unfinished = Some((mnemonic, start));
        }
        if self.parameters.iter().any(|value| value.is_nan()) {
            self.drop_overflow(mnemonic, start);
            if !is_coordinate_list(mnemonic) {
                return None;
            }
        }
        Some(self.textless(mnemonic, start))
    }

    /// Decides what line ends between digits mean in the list that was just read from `input` on.
    #[cold]
    fn weigh_line_ends(&mut self, mnemonic: Mnemonic, start: usize, input: Input<'a>, joined: List) -> List {
        let count = self.parameters.len();
        let read = |parser: &mut Self, meaning| {
            parser.rest = input;
            parser.parameters.clear();
            parser.number_list(mnemonic, meaning, false)
        };
        let mut list = joined;
        let mut parted = false;
        if is_coordinate_list(mnemonic) {
            list = read(self, LineEnds::Part);
            let even = self.parameters.len().is_multiple_of(2);
            parted = even && (!count.is_multiple_of(2) || !list.broke_a_pair);
            if !parted {
                list = read(self, LineEnds::Join);
            }
        }
        let span = Span { start, end: self.at() };
        self.report(codes::LINE_END_IN_NUMBER, mnemonic, span, || {
            let what = if parted { "they are read as two numbers" } else { "they are read as one number" };
            (
                format!("only a line end stands between digits; {what}"),
                Some("put a comma between coordinates".into()),
            )
        });
        list
    }

    /// Takes the pairs with a number that is too large out of a coordinate list.
    #[cold]
    fn drop_overflow(&mut self, mnemonic: Mnemonic, start: usize) {
        let span = Span { start, end: self.at() };
        self.report(codes::NUMBER_OUT_OF_RANGE, mnemonic, span, || {
            (format!("`{mnemonic}` has a number of 2^30 or more, which is left out"), None)
        });
        let pairs = self.parameters.chunks(2).filter(|pair| !pair.iter().any(|value| value.is_nan()));
        self.parameters = pairs.flatten().copied().collect();
    }

    /// Reads numbers up to the end of the command, or to the end of a piece of a coordinate list.
    #[inline]
    pub(super) fn number_list(&mut self, mnemonic: Mnemonic, meaning: LineEnds, reports: bool) -> List {
        let mut list = List::default();
        let mut after_comma = false;
        let mut input = self.rest;
        loop {
            if let Ok((rest, value)) = plain(input) {
                self.parameters.push(value);
                match rest {
                    [b',', rest @ ..] => {
                        after_comma = true;
                        input = rest;
                    }
                    [b' ', rest @ ..] => {
                        after_comma = false;
                        input = rest;
                    }
                    [b';', rest @ ..] => {
                        self.rest = rest;
                        return list;
                    }
                    // The name of the next command.
                    _ => {
                        self.rest = rest;
                        return list;
                    }
                }
            } else if let [b' ', rest @ ..] = input {
                input = rest;
            } else {
                self.rest = input;
                if !self.part(mnemonic, meaning, reports, &mut after_comma, &mut list) {
                    self.take(list_end);
                    return list;
                }
                input = self.rest;
            }
            if self.parameters.len() >= PIECE
                && self.parameters.len().is_multiple_of(2)
                && is_coordinate_list(mnemonic)
            {
                list.is_unfinished = true;
                self.rest = input;
                return list;
            }
        }
    }

    /// Reads a part of a list that is no plain number; false where the list is at its end.
    fn part(
        &mut self,
        mnemonic: Mnemonic,
        meaning: LineEnds,
        reports: bool,
        after_comma: &mut bool,
        list: &mut List,
    ) -> bool {
        let at = self.at();
        match self.take(|input| part(input, meaning)) {
            None => return false,
            Some(Part::Number(number)) => {
                if number.line_ends > 0 {
                    list.line_ends += number.line_ends;
                    list.broke_a_pair |= self.parameters.len().is_multiple_of(2);
                }
                match number.value {
                    // NaN stands for a number out of range.
                    Some(value) => {
                        self.parameters.push(if value.abs() < LARGEST_NUMBER { value } else { f64::NAN });
                    }
                    None if reports => self.report_stray(mnemonic, at),
                    None => {}
                }
                *after_comma = false;
            }
            Some(Part::Comma) => {
                if reports && (*after_comma || self.parameters.is_empty()) {
                    let span = Span { start: at, end: at + 1 };
                    self.report(codes::EMPTY_PARAMETER, mnemonic, span, || {
                        (format!("`{mnemonic}` has an empty parameter, which is skipped"), None)
                    });
                }
                *after_comma = true;
            }
            Some(Part::Control) if reports => self.report_control(mnemonic, at),
            Some(Part::Stray) if reports => self.report_stray(mnemonic, at),
            Some(Part::DeviceControl) => self.hints.wrappers.device_control = true,
            Some(Part::Gap | Part::Control | Part::Stray | Part::Quoted) => {}
        }
        true
    }
}
