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
}

/// The places in ASCII that ISO 646 leaves to national letters.
const NATIONAL: &[u8] = b"#$@[\\]^`{|}~";

impl CharacterSet {
    /// The set of the `CS` and `CA` of HP-GL plotters, if its characters are known here.
    ///
    /// 30 to 39 are sets of ISO 646 by their registrations (ISO-IR): 30 Swedish (10), 31 the
    /// same for names (11), 32 and 39 Norwegian (60 and 61), 33 German (21), 34 French (69), 35 British
    /// (4), 36 Italian (15), 37 Spanish (17), 38 Portuguese (16). 6 is the Roman half of JIS X 0201
    /// (14), 9 the international reference version (2).
    pub(crate) fn of_plotter(number: f64) -> Option<Self> {
        Some(match number as i32 {
            0 => Self::Latin1,
            6 => Self::Iso646("#$@[¥]^`{|}¯"),
            7 => Self::RomanExtensions,
            9 => Self::Iso646("#¤@[\\]^`{|}¯"),
            30 => Self::Iso646("#¤@ÄÖÅ^`äöå~"),
            31 => Self::Iso646("#¤ÉÄÖÅÜéäöåü"),
            32 => Self::Iso646("#$@ÆØÅ^`æøå~"),
            33 => Self::Iso646("#$§ÄÖÜ^`äöüß"),
            34 => Self::Iso646("£$à°ç§^µéùè¨"),
            35 => Self::Iso646("£$@[\\]^`{|}~"),
            36 => Self::Iso646("£$§°çé^ùàòèì"),
            37 => Self::Iso646("£$§¡Ñ¿^`°ñç~"),
            38 => Self::Iso646("#$§ÃÇÕ^`ãçõ°"),
            39 => Self::Iso646("§$@ÆØÅ^`æøå|"),
            _ => return None,
        })
    }

    /// The name of a set of HP-GL plotters whose characters are not known here (HP 7470A, Interfacing
    /// and Programming Manual, page C-7, and 7475A).
    pub(crate) fn name_of_plotter_set(number: f64) -> Option<&'static str> {
        Some(match number as i32 {
            1 => "HP 9825",
            2 => "French/German",
            3 => "Scandinavian",
            4 => "Spanish/Latin American",
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
            // 0S and 3S, 0D and 1D, 1G, 1F, 1E, 0I, 2S
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
