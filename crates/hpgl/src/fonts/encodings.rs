//! Character sets: what the bytes of labels stand for.

/// A set of characters for the bytes of labels. The first half is ASCII in all of them, but for the
/// ISO 646 variants.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum CharacterSet {
    /// Code page 1252, which holds ISO 8859-1: what files without a word about it are written in
    /// today.
    #[default]
    Latin1,
    /// HP's own 8-bit set.
    Roman8,
    /// The upper half of HP's set in the places of ASCII: the Roman extensions of plotters with
    /// seven bits.
    RomanExtensions,
    /// Code page 437 of the IBM PC.
    CodePage437,
    /// Code page 850.
    CodePage850,
    /// ISO 646 with letters of a language in the places that [`NATIONAL`] lists.
    Iso646(&'static str),
    /// ASCII but for these bytes. Accents are marks on the character before them, as Unicode has
    /// them.
    Plotter(&'static [(u8, char)]),
}

/// The places in ASCII that ISO 646 leaves to national letters.
const NATIONAL: &[u8] = b"#$@[\\]^`{|}~";

impl CharacterSet {
    /// The set of the `CS` and `CA` of HP-GL plotters, if its characters are known here.
    ///
    /// 30 to 39 are sets of ISO 646 by their registrations (ISO-IR): 30 Swedish (10), 31 the
    /// same for names (11), 32 and 39 Norwegian (60 and 61), 33 German (21), 34 French (25), 35 British
    /// (4), 36 Italian (15), 37 Spanish (17), 38 Portuguese (16). 6 is the Roman half of JIS X 0201
    /// (14), 9 the international reference version (2). 1 to 4 are HP's own, as the ROM of the 9872C
    /// draws them.
    pub(crate) fn of_plotter(number: f64) -> Option<Self> {
        Some(match number as i32 {
            0 => Self::Latin1,
            1 => Self::Plotter(HP_9825),
            2 => Self::Plotter(FRENCH_GERMAN),
            3 => Self::Plotter(SCANDINAVIAN),
            4 => Self::Plotter(SPANISH),
            6 => Self::Iso646("#$@[¥]^`{|}¯"),
            7 => Self::RomanExtensions,
            9 => Self::Iso646("#¤@[\\]^`{|}¯"),
            30 => Self::Iso646("#¤@ÄÖÅ^`äöå~"),
            31 => Self::Iso646("#¤ÉÄÖÅÜéäöåü"),
            32 => Self::Iso646("#$@ÆØÅ^`æøå~"),
            33 => Self::Iso646("#$§ÄÖÜ^`äöüß"),
            34 => Self::Iso646("£$à°ç§^`éùè¨"),
            35 => Self::Iso646("£$@[\\]^`{|}~"),
            36 => Self::Iso646("£$§°çé^ùàòèì"),
            37 => Self::Iso646("£$§¡Ñ¿^`°ñç~"),
            38 => Self::Iso646("#$§ÃÇÕ^`ãçõ°"),
            39 => Self::Iso646("§$@ÆØÅ^`æøå|"),
            _ => return None,
        })
    }

    /// The name of a set of HP-GL plotters that cannot be drawn: for 5 no table of its characters was
    /// found, for 8 (ISO-IR 13) the font has no letters.
    pub(crate) fn name_of_plotter_set(number: f64) -> Option<&'static str> {
        Some(match number as i32 {
            5 => "special symbols",
            8 => "Katakana",
            _ => return None,
        })
    }

    /// The set of HP-GL/2's `SD1,n` and `AD1,n`, if it is known here. A symbol set that PCL calls
    /// `8U` is 8 * 32 + 21: the number and the index of the letter after `@`.
    pub(crate) fn of_symbol_set(value: f64) -> Option<Self> {
        Some(match value as i32 {
            // 0U ASCII, 0N ECMA-94 Latin 1, 19U and 9U Windows
            21 | 14 | 629 | 309 => Self::Latin1,
            277 => Self::Roman8,
            // 10U, and 11U with other box drawings
            341 | 373 => Self::CodePage437,
            // 12U
            405 => Self::CodePage850,
            // 0S and 3S, 0D and 1D, 1G, 0F and 1F, 1E, 0I, 2S
            6 => Self::Iso646("£$à°ç§^`éùè¨"),
            19 => Self::Iso646("#¤@ÄÖÅ^`äöå~"),
            4 | 36 => Self::Iso646("#$@ÆØÅ^`æøå~"),
            39 => Self::Iso646("#$§ÄÖÜ^`äöüß"),
            38 => Self::Iso646("£$à°ç§^µéùè¨"),
            37 => Self::Iso646("£$@[\\]^`{|}~"),
            9 => Self::Iso646("£$§°çé^ùàòèì"),
            83 => Self::Iso646("£$§¡Ñ¿^`°ñç~"),
            _ => return None,
        })
    }

    /// The character of a byte that is none of the control bytes; the replacement character where
    /// there is none.
    pub(crate) fn character(self, byte: u8) -> char {
        let upper = match self {
            Self::Iso646(letters) => {
                let index = NATIONAL.iter().position(|&b| b == byte);
                return index.and_then(|index| letters.chars().nth(index)).unwrap_or(char::from(byte & 0x7f));
            }
            Self::Plotter(signs) => {
                let sign = signs.iter().find(|sign| sign.0 == byte);
                return sign.map_or(char::from(byte & 0x7f), |sign| sign.1);
            }
            Self::Latin1 => CODE_PAGE_1252,
            Self::RomanExtensions => {
                return Self::Roman8.character(if byte > b' ' { byte | 0x80 } else { byte });
            }
            Self::Roman8 => ROMAN_8,
            Self::CodePage437 => CODE_PAGE_437,
            Self::CodePage850 => CODE_PAGE_850,
        };
        if byte < 0x80 {
            return char::from(byte);
        }
        upper.chars().nth(usize::from(byte - 0x80)).unwrap_or(char::REPLACEMENT_CHARACTER)
    }
}

const GRAVE: char = '\u{300}';
const ACUTE: char = '\u{301}';
const CIRCUMFLEX: char = '\u{302}';
const TILDE: char = '\u{303}';
const DIAERESIS: char = '\u{308}';
const RING: char = '\u{30a}';
const LOW_LINE: char = '\u{332}';
/// Over the two characters before it.
const DOUBLE_TILDE: char = '\u{360}';

/// Set 1. Sets 1 to 4 are those of the HP 9872C, read from its ROM by F. Ulivi (`hp9872_re` and the
/// emulator in `mame_tools`); the 7470A and the 7475A have sets of the same names.
const HP_9825: &[(u8, char)] = &[
    (b'\\', '√'),
    (b'^', '↑'),
    (b'_', LOW_LINE),
    (b'`', GRAVE),
    (b'{', 'π'),
    (b'|', '⊢'),
    (b'}', '→'),
    (b'~', TILDE),
];
/// Set 2. It has a diaeresis for capitals and a lower one.
const FRENCH_GERMAN: &[(u8, char)] = &[
    (b'#', '£'),
    (b'\'', ACUTE),
    (b'\\', 'ç'),
    (b'^', CIRCUMFLEX),
    (b'_', LOW_LINE),
    (b'`', GRAVE),
    (b'{', DIAERESIS),
    (b'|', RING),
    (b'}', DIAERESIS),
    (b'~', '\''),
];
/// Set 3. It has a diaeresis and a ring for capitals and lower ones.
const SCANDINAVIAN: &[(u8, char)] = &[
    (b'#', '£'),
    (b'[', 'Ø'),
    (b'\\', 'Æ'),
    (b']', 'ø'),
    (b'^', 'æ'),
    (b'_', LOW_LINE),
    (b'{', DIAERESIS),
    (b'|', RING),
    (b'}', DIAERESIS),
    (b'~', RING),
];
/// Set 4. It has wide and narrow tildes for capitals and lower ones.
const SPANISH: &[(u8, char)] = &[
    (b'#', '¿'),
    (b'\'', ACUTE),
    (b'\\', '¡'),
    (b'^', CIRCUMFLEX),
    (b'_', LOW_LINE),
    (b'{', DOUBLE_TILDE),
    (b'|', TILDE),
    (b'}', DOUBLE_TILDE),
    (b'~', TILDE),
];

/// A mark, the sign that it is drawn as, and letters with their form under it.
type MarkRow = (char, char, &'static [(char, char)]);

/// The marks that the font can draw.
const MARKS: &[MarkRow] = &[
    (
        GRAVE,
        '`',
        &[
            ('A', 'À'),
            ('E', 'È'),
            ('I', 'Ì'),
            ('O', 'Ò'),
            ('U', 'Ù'),
            ('a', 'à'),
            ('e', 'è'),
            ('i', 'ì'),
            ('o', 'ò'),
            ('u', 'ù'),
        ],
    ),
    (
        ACUTE,
        '´',
        &[
            ('A', 'Á'),
            ('C', 'Ć'),
            ('E', 'É'),
            ('I', 'Í'),
            ('N', 'Ń'),
            ('O', 'Ó'),
            ('S', 'Ś'),
            ('U', 'Ú'),
            ('Y', 'Ý'),
            ('Z', 'Ź'),
            ('a', 'á'),
            ('c', 'ć'),
            ('e', 'é'),
            ('i', 'í'),
            ('n', 'ń'),
            ('o', 'ó'),
            ('s', 'ś'),
            ('u', 'ú'),
            ('y', 'ý'),
            ('z', 'ź'),
        ],
    ),
    (
        CIRCUMFLEX,
        '^',
        &[
            ('A', 'Â'),
            ('E', 'Ê'),
            ('I', 'Î'),
            ('O', 'Ô'),
            ('U', 'Û'),
            ('a', 'â'),
            ('e', 'ê'),
            ('i', 'î'),
            ('o', 'ô'),
            ('u', 'û'),
        ],
    ),
    (TILDE, '~', &[('A', 'Ã'), ('N', 'Ñ'), ('O', 'Õ'), ('a', 'ã'), ('n', 'ñ'), ('o', 'õ')]),
    (
        DIAERESIS,
        '¨',
        &[
            ('A', 'Ä'),
            ('E', 'Ë'),
            ('I', 'Ï'),
            ('O', 'Ö'),
            ('U', 'Ü'),
            ('Y', 'Ÿ'),
            ('a', 'ä'),
            ('e', 'ë'),
            ('i', 'ï'),
            ('o', 'ö'),
            ('u', 'ü'),
            ('y', 'ÿ'),
        ],
    ),
    (RING, '°', &[('A', 'Å'), ('U', 'Ů'), ('a', 'å'), ('u', 'ů')]),
    (LOW_LINE, '_', &[]),
    (DOUBLE_TILDE, '~', &[]),
];

/// A mark on the character before it, which takes no cell of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mark {
    /// The sign that it is drawn as where no letter with the mark exists.
    pub(crate) sign: char,
    /// The number of characters before it that it stands over.
    pub(crate) width: u8,
    /// It stands above the character.
    pub(crate) above: bool,
}

impl Mark {
    /// The mark that a character is, if it is one.
    pub(crate) fn of(character: char) -> Option<Self> {
        if character < GRAVE {
            return None;
        }
        let &(mark, sign, _) = MARKS.iter().find(|mark| mark.0 == character)?;
        Some(Self { sign, width: if mark == DOUBLE_TILDE { 2 } else { 1 }, above: mark != LOW_LINE })
    }
}

/// The letter with a mark as one character, if the font has it.
pub(crate) fn compose(letter: char, mark: char) -> Option<char> {
    let (_, _, letters) = MARKS.iter().find(|entry| entry.0 == mark)?;
    letters.iter().find(|pair| pair.0 == letter).map(|pair| pair.1)
}

const CODE_PAGE_1252: &str = "\
    €\u{fffd}‚ƒ„…†‡^‰Š‹Œ\u{fffd}Ž\u{fffd}\u{fffd}‘’“”•–—~™š›œ\u{fffd}žŸ\
    \u{20}¡¢£¤¥¦§¨©ª«¬-®¯°±²³´µ¶·¸¹º»¼½¾¿\
    ÀÁÂÃÄÅÆÇÈÉÊËÌÍÎÏÐÑÒÓÔÕÖ×ØÙÚÛÜÝÞß\
    àáâãäåæçèéêëìíîïðñòóôõö÷øùúûüýþÿ";

const ROMAN_8: &str = "\
    \u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\
    \u{20}ÀÂÈÊËÎÏ´`^¨~ÙÛ₤¯Ýý°ÇçÑñ¡¿¤£¥§ƒ¢\
    âêôûáéóúàèòùäëöüÅîØÆåíøæÄìÖÜÉïßÔ\
    ÁÃãÐðÍÌÓÒÕõŠšÚŸÿÞþ·µ¶¾—¼½ªº«■»±\u{fffd}";

const CODE_PAGE_437: &str = "\
    ÇüéâäàåçêëèïîìÄÅÉæÆôöòûùÿÖÜ¢£¥₧ƒ\
    áíóúñÑªº¿⌐¬½¼¡«»░▒▓│┤╡╢╖╕╣║╗╝╜╛┐\
    └┴┬├─┼╞╟╚╔╩╦╠═╬╧╨╤╥╙╘╒╓╫╪┘┌█▄▌▐▀\
    αßΓπΣσµτΦΘΩδ∞φε∩≡±≥≤⌠⌡÷≈°∙·√ⁿ²■ ";

const CODE_PAGE_850: &str = "\
    ÇüéâäàåçêëèïîìÄÅÉæÆôöòûùÿÖÜø£Ø×ƒ\
    áíóúñÑªº¿®¬½¼¡«»░▒▓│┤ÁÂÀ©╣║╗╝¢¥┐\
    └┴┬├─┼ãÃ╚╔╩╦╠═╬¤ðÐÊËÈıÍÎÏ┘┌█▄¦Ì▀\
    ÓßÔÒõÕµþÞÚÛÙýÝ¯´-±‗¾¶§÷¸°¨·¹³²■ ";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_has_128_upper_places() {
        for upper in [CODE_PAGE_1252, ROMAN_8, CODE_PAGE_437, CODE_PAGE_850] {
            assert_eq!(upper.chars().count(), 128);
        }
    }

    #[test]
    fn character_sets_agree_on_letters() {
        for (set, byte) in [
            (CharacterSet::Latin1, 0xfc),
            (CharacterSet::Roman8, 0xcf),
            (CharacterSet::RomanExtensions, 0x4f),
            (CharacterSet::CodePage437, 0x81),
            (CharacterSet::CodePage850, 0x81),
            (CharacterSet::Iso646("#$§ÄÖÜ^`äöüß"), b'}'),
        ] {
            assert_eq!(set.character(byte), 'ü');
        }
        assert_eq!(CharacterSet::Latin1.character(0x81), char::REPLACEMENT_CHARACTER);
    }
}
