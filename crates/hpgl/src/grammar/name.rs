//! Names of commands: which there are, how their parameters are written, and what else letters can
//! be.

use nom::Parser as _;
use nom::branch::alt;
use nom::bytes::complete::{take, take_while, take_while_m_n, take_while1};
use nom::character::complete::char;
use nom::combinator::{eof, map, map_opt, not, peek, recognize, value, verify};
use nom::multi::many0_count;
use nom::sequence::{pair, preceded, terminated};

use super::bytes::{Class, class, one, unread};
use super::{Input, Parsed, mismatch};
use crate::mnemonic::Mnemonic;

/// How the parameters of a command are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// Numbers.
    Numbers,
    /// Text up to the label terminator.
    Label,
    /// One byte, the label terminator, then numbers.
    Terminator,
    /// One byte, a symbol.
    Symbol,
    /// A string in quotes.
    Comment,
    /// Encoded numbers.
    Encoded,
}

/// The names of both generations of the language whose parameters are numbers.
const NUMERIC: &[u8] = b"AA AC AD AF AH AP AR AS AT BP BR BZ CA CC CF CI CM CP CR CS CT CV DC DF DI DL DP DR DS DV \
EA EC EP ER ES EW FI FN FP FR FS FT GC GM GP IM IN IP IR IV IW KY LA LM LO LT MC MT NP NR OA OC OD OE OF OG OH OI \
OK OL OO OP OS OT OW PA PB PC PD PG PM PP PR PS PT PU PW QL RA RF RO RP RQ RR RT SA SB SC SD SI SL SP SR SS ST SV \
TD TL TR UC UF UL VS WG WU XT YT";

const FORMS: [[Option<Form>; 26]; 26] = {
    let mut forms = [[None; 26]; 26];
    let mut at = 0;
    while at + 1 < NUMERIC.len() {
        forms[(NUMERIC[at] - b'A') as usize][(NUMERIC[at + 1] - b'A') as usize] = Some(Form::Numbers);
        at += 3;
    }
    let special = [
        (b"LB", Form::Label),
        (b"BL", Form::Label),
        (b"WD", Form::Label),
        (b"DT", Form::Terminator),
        (b"SM", Form::Symbol),
        (b"CO", Form::Comment),
        (b"PE", Form::Encoded),
    ];
    let mut next = 0;
    while next < special.len() {
        let (name, form) = special[next];
        forms[(name[0] - b'A') as usize][(name[1] - b'A') as usize] = Some(form);
        next += 1;
    }
    forms
};

/// How the parameters of that command are written; `None` if there is no such command.
pub(crate) fn form_of(mnemonic: Mnemonic) -> Option<Form> {
    let [first, second] = mnemonic.0;
    let index = |letter: u8| usize::from(letter.wrapping_sub(b'A'));
    FORMS.get(index(first)).and_then(|row| row.get(index(second))).copied().flatten()
}

/// Every known name, in alphabetical order.
pub fn known_commands() -> impl Iterator<Item = Mnemonic> {
    (b'A'..=b'Z')
        .flat_map(|first| (b'A'..=b'Z').map(move |second| Mnemonic([first, second])))
        .filter(|mnemonic| form_of(*mnemonic).is_some())
}

/// `name = letter letter`, in any case.
pub(crate) fn name(input: Input<'_>) -> Parsed<'_, Mnemonic> {
    map(pair(one(Class::Letter), one(Class::Letter)), capitals).parse(input)
}

fn capitals((first, second): (u8, u8)) -> Mnemonic {
    Mnemonic([first.to_ascii_uppercase(), second.to_ascii_uppercase()])
}

/// A name that is a command's.
fn known_name(input: Input<'_>) -> Parsed<'_, Form> {
    map_opt(name, form_of).parse(input)
}

/// `parted-name = letter filler { filler } letter`, `filler = blank | line-end | control | ","`.
///
/// GhostPDL lets blanks and control bytes pass between the letters of a name. `P PA0,0` is a stray
/// letter before a command, not `PP`: a whole name at the second letter goes first.
pub(crate) fn parted_name(input: Input<'_>) -> Parsed<'_, (Mnemonic, Form)> {
    let filler =
        take_while1(|b| matches!(class(b), Class::Blank | Class::Control | Class::LineEnd | Class::Comma));
    let parts = (one(Class::Letter), filler, not(known_name), one(Class::Letter));
    map_opt(parts, |(first, _, (), second)| {
        let mnemonic = capitals((first, second));
        form_of(mnemonic).map(|form| (mnemonic, form))
    })
    .parse(input)
}

/// `vendor-command = "!" ( name - "IN" ) unread`: a command of engravers and mills.
///
/// `!IN` begins files that have a stray `!` before everything else.
pub(crate) fn vendor_command(input: Input<'_>) -> Parsed<'_, Input<'_>> {
    let own_name = verify(name, |mnemonic| mnemonic.0 != *b"IN");
    terminated(recognize((char('!'), own_name)), unread).parse(input)
}

/// `word = letter { letter }`. More than 64 letters are two words, so that a long run is not looked
/// at again and again.
pub(crate) fn word(input: Input<'_>) -> Parsed<'_, Input<'_>> {
    take_while_m_n(1, 64, |b| class(b) == Class::Letter).parse(input)
}

/// `run-on = { name } ( end | name-with-text )`: letters that read as names of commands only. What
/// follows a name that takes text is the command's own.
fn run_on(word: Input<'_>) -> Parsed<'_, ()> {
    let with_numbers = verify(known_name, |&form| form == Form::Numbers);
    preceded(many0_count(with_numbers), alt((value((), eof), value((), known_name)))).parse(word)
}

/// `prose = letter small small { small }` that is no `run-on`: text that got into the file.
pub(crate) fn prose(input: Input<'_>) -> Parsed<'_, Input<'_>> {
    // Most names are in capitals: look no further then.
    if !matches!(input, [_, b'a'..=b'z', b'a'..=b'z', ..]) {
        return mismatch(input);
    }
    verify(word, |word: &[u8]| word[1..].iter().all(u8::is_ascii_lowercase) && run_on(word).is_err())
        .parse(input)
}

/// `stray-letters = letter [ letter ]` before a `run-on` that is used as commands are: a stray
/// letter before a command (`ZPD1,2`), or an unknown command without terminator (`ZQPD1,2`).
///
/// The rest of the word counts as commands only if it reads as such to its end and parameters or a
/// terminator follow: otherwise words like TEXT would draw.
pub(crate) fn stray_letters(input: Input<'_>) -> Parsed<'_, Input<'_>> {
    let (after, word) = word(input)?;
    let blanks = take_while(|b| class(b) == Class::Blank);
    let parameter = map_opt(take(1_usize), |byte: &[u8]| {
        (!matches!(class(byte[0]), Class::Letter | Class::Other) || byte[0] == b'"').then_some(())
    });
    peek(preceded(blanks, alt((value((), eof), parameter)))).parse(after)?;
    for length in [1, 2] {
        let (stray, rest) = word.split_at(length.min(word.len()));
        if !rest.is_empty() && run_on(rest).is_ok() {
            return Ok((&input[length..], stray));
        }
    }
    mismatch(input)
}
