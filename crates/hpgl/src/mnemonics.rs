//! Which names are commands, and how their parameters are written.

use crate::syntax::Mnemonic;

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

/// How the parameters of that command are written; nothing if there is no such command.
pub(crate) fn form_of(mnemonic: Mnemonic) -> Option<Form> {
    let [first, second] = mnemonic.0;
    let index = |letter: u8| usize::from(letter.wrapping_sub(b'A'));
    FORMS.get(index(first)).and_then(|row| row.get(index(second))).copied().flatten()
}

/// Every known name, in the order of the alphabet.
pub fn all() -> impl Iterator<Item = Mnemonic> {
    (b'A'..=b'Z')
        .flat_map(|first| (b'A'..=b'Z').map(move |second| Mnemonic([first, second])))
        .filter(|mnemonic| form_of(*mnemonic).is_some())
}
