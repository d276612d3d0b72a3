//! The diagnostic codes: name, severity, title and explanation.

use std::fmt;

/// The severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Information; the drawing is what the file defines.
    Note,
    /// The file had to be interpreted: the drawing may differ from what was meant.
    Warning,
    /// Ink is missing: something that the file draws is not in the drawing.
    Error,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        })
    }
}

/// The stable name of a kind of finding, such as `H0101`.
///
/// A code never changes its meaning and is never given twice. [`Code::all`] lists them in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Code(u16);

impl Code {
    /// All codes, in the order of their numbers.
    pub fn all() -> impl Iterator<Item = Self> {
        CODES.iter().map(|entry| Self(entry.number))
    }

    /// The code of that name, in any case; `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        CODES
            .iter()
            .find(|entry| entry.name.eq_ignore_ascii_case(name.trim()))
            .map(|entry| Self(entry.number))
    }

    fn entry(self) -> &'static Entry {
        // Codes are made from the table only, so the search succeeds; the first entry stands in for
        // "not found".
        CODES.iter().find(|entry| entry.number == self.0).unwrap_or(&CODES[0])
    }

    /// Its name, such as `H0101`.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// What it is about, in a few words.
    pub fn title(self) -> &'static str {
        self.entry().title
    }

    /// How much a finding of this kind matters.
    pub fn severity(self) -> Severity {
        self.entry().severity
    }

    /// What happened, what was done about it, and what can be done in the file; a paragraph.
    pub fn explanation(self) -> &'static str {
        self.entry().explanation
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// One row of the table.
pub(crate) struct Entry {
    pub(crate) number: u16,
    pub(crate) name: &'static str,
    pub(crate) severity: Severity,
    pub(crate) title: &'static str,
    pub(crate) explanation: &'static str,
}

macro_rules! codes {
    ($($constant:ident = $number:literal $name:literal $severity:ident $title:literal $explanation:literal)*) => {
        $(pub(crate) const $constant: Code = Code($number);)*
        pub(crate) const CODES: &[Entry] = &[$(Entry {
            number: $number,
            name: $name,
            severity: Severity::$severity,
            title: $title,
            explanation: $explanation,
        }),*];
    };
}

codes! {
    UNKNOWN_COMMAND = 101 "H0101" Warning "unknown command"
        "Two letters that name no command of HP-GL or HP-GL/2, or a letter that stands alone. They are skipped with \
         their parameters, up to the next semicolon or letter, as a plotter does. Commands of particular cutters and \
         other vendors' dialects end up here; if one of them draws, its ink is missing."
    STRAY_BYTE = 102 "H0102" Note "stray character"
        "A character that has no meaning where it stands, such as `!` or `#` between commands or among numbers. It is \
         skipped. Many of them mean that the file is not HPGL, or that it was damaged on its way."
    CONTROL_BYTE = 103 "H0103" Note "control byte skipped"
        "NUL, ETX, form feed or another control byte, DEL, or a byte above 127 outside labels: padding of serial \
         lines, byte order marks and the like. Plotters skip them and so does this reader."
    NUMBERS_WITHOUT_COMMAND = 104 "H0104" Warning "numbers without command"
        "Numbers after a semicolon, or at the start of the file, belong to no command and are skipped. If they are \
         coordinates, the semicolon before them should be a comma."
    PROSE = 105 "H0105" Note "text between commands"
        "A word in small letters that is not made of names of commands: a remark or a message of some program that \
         got into the file. It is skipped whole, since some words hold names of commands that would draw."
    PARTED_NAME = 106 "H0106" Note "blank inside a name"
        "The two letters of a name stand apart (`P A0,0`). They are read as one name, as HP's interpreters do."
    EMPTY_PARAMETER = 107 "H0107" Warning "empty parameter"
        "Two separators with nothing between them, or one before the first number. The language has no empty \
         parameters: the gap is skipped, and the numbers after it move up."
    NUMBER_OUT_OF_RANGE = 108 "H0108" Warning "number out of range"
        "A number of 2^30 or more in size. In a coordinate list the pair that it belongs to is left out, any other \
         command with such a number has no effect."
    LINE_END_IN_NUMBER = 109 "H0109" Warning "line end between digits"
        "Only a line end stands between two digits. Plotters skip line ends, so that `40`, line end, `0` is 400, \
         and files wrapped at a fixed width need that. Files written by hand mean two numbers. In a coordinate list \
         the reading is chosen that gives whole pairs; if both do, line ends part numbers only where all of them \
         stand between pairs."
    LABEL_WITHOUT_TERMINATOR = 110 "H0110" Warning "label without terminator"
        "The text of LB, BL or WD ends at the byte 3 (ETX) or the one that DT names. Where none follows, the label is \
         ended at the next semicolon, at a line end before a command that moves the pen, or at the end of the file. \
         Where one follows but a command that moves the pen stands after a semicolon before it, the label is ended \
         there. If the file uses another terminator without saying so, name it in the options."
    BAD_TERMINATOR = 111 "H0111" Warning "impossible label terminator"
        "DT cannot make NUL, ENQ or ESC the terminator of labels. The terminator stays what it was."
    OPEN_COMMENT = 112 "H0112" Warning "comment without closing quote"
        "CO begins a comment with a quote that is never closed. The comment is ended at the next semicolon, so that it \
         does not swallow the rest of the file."
    DEVICE_CONTROL_WITHOUT_COLON = 113 "H0113" Note "device control without colon"
        "The parameters of a device control sequence (ESC . and a letter) end at a colon. Here it is missing; the \
         sequence is ended at the first character that cannot be a parameter."
    STRAY_ESCAPE = 114 "H0114" Note "unknown escape sequence"
        "ESC and something that is neither device control (ESC .) nor a change of language (ESC %) nor PCL. The \
         sequence is skipped."
    PCL_TEXT = 115 "H0115" Warning "text outside HP-GL/2"
        "The file is PCL or RTL with HP-GL/2 in it, and has characters between the two that a printer would set in \
         its own fonts. They are not drawn."
    RASTER = 116 "H0116" Warning "raster data skipped"
        "A raster picture, a font or other binary data, skipped by its own count of bytes. Pens cannot draw it."
    ENCODED_WITHOUT_TERMINATOR = 117 "H0117" Warning "encoded polyline without terminator"
        "The data of PE end at a semicolon. Here another byte comes first that cannot be data; the polyline is ended \
         after its last whole number, and reading continues there."
    ENCODED_DAMAGED = 118 "H0118" Warning "damaged encoded polyline"
        "The data of PE hold an unfinished number, half a pair, or a number of fractional bits beyond 26. What is \
         whole is drawn, the rest is left out. A file that went through a 7-bit line or a text editor looks like \
         that."
    ENCODED_REENCODED = 119 "H0119" Warning "encoded polyline repaired"
        "The file was saved as UTF-8 by an editor that took it for text, so that each byte above 127 became two. The \
         two are read as the one that they stand for."
    VENDOR_COMMAND = 120 "H0120" Warning "vendor command with `!`"
        "Engravers and mills (Roland, Gravograph) have commands of their own that begin with `!` and two letters, for \
         spindles, depths and the like. They are skipped with their parameters. If one of them draws, its ink is missing."
    NO_PEN_SELECTED = 201 "H0201" Warning "no pen selected"
        "The file draws before any SP selects a pen. A plotter without a pen draws nothing; what is meant is the pen \
         that is in the holder, so that pen 1 is taken."
    PEN_PUT_AWAY = 202 "H0202" Warning "drawing without a pen"
        "SP0 (or SP without a number) puts the pen away; pen-down moves after it leave no ink, as on a plotter. If a \
         file draws nothing else at all, see H0222."
    BAD_PARAMETERS = 203 "H0203" Warning "wrong parameters"
        "The command's parameters are too few, or not what it allows. It has no effect."
    LOST_DRAWING_COMMAND = 204 "H0204" Warning "drawing command with wrong parameters"
        "A command that draws has too few parameters, or some that it does not allow. It is skipped, and its ink is \
         missing."
    ODD_COORDINATES = 206 "H0206" Warning "odd number of coordinates"
        "A coordinate list has an x without its y at the end. That x is skipped."
    COORDINATE_OUT_OF_RANGE = 207 "H0207" Warning "coordinate beyond all paper"
        "After scaling, a point lies more than 25 km from the origin, or is no number at all. It is left out. The \
         scaling points (IP, IR) and the scale (SC) before it are the place to look."
    BAD_SCALE = 208 "H0208" Warning "impossible scale"
        "SC names a range without extent, or a scale factor of 0. The scale stays what it was."
    SCALING_POINTS_MEET = 209 "H0209" Note "scaling points coincide"
        "IP or IR puts P1 and P2 on one line. P2 is moved by one plotter unit, as HP-GL/2 does."
    CLIPPED = 210 "H0210" Note "clipped at the window"
        "Ink outside the window that IW sets is not drawn."
    EMPTY_WINDOW = 211 "H0211" Warning "window without extent"
        "IW sets a window that is empty or lies outside the page. Nothing is drawn until another one is set."
    OUTPUT_COMMAND = 212 "H0212" Note "command that asks the plotter"
        "The command asks a plotter for an answer, or an operator for a point. A file has nobody to ask; it is \
         skipped."
    PAPER_CODE = 213 "H0213" Note "paper size by code"
        "PS with one small number names a paper format by its code, as the 7475A and 7550A understand it. In HP-GL/2 \
         the same command gives lengths; a page of a few plotter units cannot be meant. Codes 0 to 3 are the larger \
         format (A3, B), 4 to 127 the smaller one (A4, A). Unless a plotter is named in the options, its scaling points and \
         hard clip limits are taken."
    SEVERAL_PAGES = 214 "H0214" Note "several pages"
        "The file draws on more than one sheet. Each is a page of its own."
    DEGENERATE_ARC = 215 "H0215" Note "arc that is none"
        "The three points of an arc lie on a line, or two of them coincide. What is left of the arc is drawn: a dot, \
         a line, two lines, or a full circle."
    NOT_IN_POLYGON = 216 "H0216" Warning "not allowed in a polygon"
        "Between PM0 and PM2 only commands that make outlines are allowed. This one is skipped."
    OPEN_POLYGON = 217 "H0217" Warning "polygon without end"
        "PM0 begins a polygon that no PM2 ends before the file does. What follows PM0 is in the polygon and is not \
         drawn by itself."
    EMPTY_POLYGON = 218 "H0218" Note "empty polygon"
        "EP or FP asks for a polygon, but the polygon buffer holds none."
    UNKNOWN_CHARACTER = 220 "H0220" Warning "character not drawn"
        "A character of a label or a symbol is not in the built-in stroke font, or its byte stands for none in the character \
         set. Its cell stays empty. The font has the Latin alphabets, Greek letters and the signs of the sets that \
         plotters knew; other scripts should be converted to outlines or strokes before."
    FILL_REPLACED = 221 "H0221" Warning "raster fill replaced by a hatch"
        "FT11 and FT22 fill areas with a raster of dots that only printers have. A pen draws lines: a hatch that covers \
         about a quarter of the paper is drawn instead."
    ONLY_INK_WITHOUT_PEN = 222 "H0222" Warning "drawing without a pen throughout"
        "The file puts the pen away (SP0) and then draws all that it draws. On a plotter with pens in a carousel the \
         sheet would stay empty; what is meant is a pen that somebody put into the holder, so that pen 1 is taken."
    TOO_MANY_PIECES = 223 "H0223" Warning "pattern too fine"
        "A hatch or a line pattern is so fine for the area or the line that it would come to millions of pieces. The \
         area is not filled, the line is drawn solid. As a rule the scale or the spacing is not what was meant."
    UNKNOWN_CHARACTER_SET = 224 "H0224" Note "character set not known"
        "CS, CA, SD or AD names a character set that is not built in. ISO 8859-1 is taken; bytes above 127, and a few signs \
         below, may come out as other characters than were meant."
    CUT_AT_PAGE = 225 "H0225" Warning "cut at the page"
        "Ink outside the page that PS sets is not drawn, as on a plotter of HP-GL/2. The page begins at the origin. The \
         first length of PS lies along x; or the longer one, where more ink fits then. If the ink should be drawn, the \
         lengths of PS are too small."
    ASSUMED_PLOTTER = 226 "H0226" Note "scaling points assumed"
        "SC maps user units to the scaling points P1 and P2, and the file does not set them. Those of the plotter \
         named in the options are taken, else of a 7475A with A4 paper, or the corners of the page in HP-GL/2. The size of the \
         drawing depends on it; so does its shape where the proportions differ."
    TOO_MANY_CHORDS = 227 "H0227" Note "arc of needless chords or turns"
        "An arc asks for chords so short that no plotter could draw them, or goes round more than once. It is drawn smooth; \
         turns that draw nothing new are drawn once, and the pen ends where the angle says."
    PEN_ZERO_DRAWS = 228 "H0228" Note "pen 0 with a colour"
        "Pen 0 is no pen on a pen plotter. On a plotter with a palette it is a colour like any other: white, until PC makes it \
         another one, as AutoCAD's driver does. Then it is drawn, with the first pen number that the file does not use."
    WHITE_PEN = 229 "H0229" Warning "white pen draws"
        "PC gives a pen the colour white, and the pen draws. Printers use white to erase ink or to draw nothing; a pen \
         plotter has no white ink, so that the pen in its place would draw over the rest. The ink is in the drawing. If \
         it is not wanted, remove the pen from the file."
    CUT_AT_LIMITS = 230 "H0230" Warning "cut at the plotter's limits"
        "Ink outside the hard clip limits of the plotter and paper named in the options is not drawn: the pen cannot go \
         there. Name a larger paper if it should be drawn. Without a named plotter, nothing is cut at its limits."
    PEN_RECOLORED = 231 "H0231" Warning "pen changes its colour"
        "PC gives a pen another colour after it has drawn. A printer draws each part in its own colour; a pen has one \
         ink. All is drawn with that pen, and its colour is the last one."
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn code_numbers_and_names_agree() {
        for pair in CODES.windows(2) {
            assert!(pair[0].number < pair[1].number, "{}", pair[1].name);
        }
        for entry in CODES {
            assert_eq!(entry.name, format!("H{:04}", entry.number));
            assert_eq!(Code::from_name(entry.name), Some(Code(entry.number)));
            assert!(entry.explanation.len() > entry.title.len());
        }
    }
}
