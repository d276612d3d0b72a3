//! The names of commands.

use std::fmt;

/// The two letters that name a command, in capitals.
///
/// Three names are not part of the language: they stand for sequences of the wrappers around it
/// ([`Mnemonic::RESET`], ...), and print in angle brackets.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Mnemonic(pub [u8; 2]);

impl Mnemonic {
    /// A printer reset (`ESC E`) or the end of a job (`ESC %-12345X`): what was drawn so far is a
    /// page of its own.
    pub const RESET: Self = Self([0, 1]);
    /// A PCL picture frame (`ESC *c #x#Y`) or plot size (`ESC *c #k#L`). Four parameters: width and
    /// height of the frame, then of the plot that is scaled to it, plotter units; NaN where one is not
    /// given.
    pub const PICTURE_FRAME: Self = Self([0, 2]);
    /// Entry into HP-GL/2 from PCL or RTL (`ESC %#B`); parameter: the number.
    pub const ENTER: Self = Self([0, 3]);
    /// No command: the name of findings between commands.
    pub(crate) const NONE: Self = Self([0, 0]);
}

impl fmt::Display for Mnemonic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::RESET => f.write_str("<reset>"),
            Self::PICTURE_FRAME => f.write_str("<picture frame>"),
            Self::ENTER => f.write_str("<enter HP-GL/2>"),
            Self::NONE => f.write_str("<none>"),
            Self([a, b]) => write!(f, "{}{}", a.escape_ascii(), b.escape_ascii()),
        }
    }
}

impl fmt::Debug for Mnemonic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}
