//! HP-GL and HP-GL/2, the languages of pen plotters: from bytes to a [`Drawing`], and back.
//!
//! ```
//! let document = hpgl::read(b"IN;SP1;PU0,0;PD400,0,400,400;PU;", &hpgl::Options::default());
//! assert_eq!(document.pages[0].drawing.length(), 20.0); // mm
//! assert!(document.diagnostics.is_empty());
//! ```
//!
//! Two passes, two types: [`parse`] turns bytes into a [`Syntax`] (commands, numbers, where they stand),
//! [`interpret`] gives them their meaning. [`read`] does both at once without keeping the syntax. None of them
//! fails: what cannot be understood is passed over and told in [`Diagnostic`]s. [`emit()`] writes a drawing as clean
//! HP-GL.
//!
//! Positions come out in millimetres, plotter units times [`Options::plotter_unit_mm`] after the file's own scaling and
//! rotation, y up.

mod codes;
mod diagnostics;
mod emit;
mod encoded;
mod envelope;
mod fonts;
mod interpreter;
mod lexer;
mod mnemonics;
mod parser;
mod producers;
mod profile;
mod summary;
mod syntax;
mod units;

use std::collections::BTreeMap;

pub use diagnostics::{Code, Diagnostic, Severity};
pub use drawing::{Drawing, Pen, Point, Span};
pub use emit::{EmitOptions, Encoding, emit};
pub use fonts::{CAP_HEIGHT as FONT_CAP_HEIGHT, Glyph};
pub use interpreter::interpret;
pub use mnemonics::all as known_commands;
pub use producers::producer;
pub use profile::{Options, Paper, Plotter, plotters};
pub use summary::{Generation, Profile, ProfileReason, Summary, Wrappers};
pub use syntax::{Command, Mnemonic, Syntax};
pub use units::{PLOTTER_UNIT_7475A_MM, PLOTTER_UNIT_MM};

/// What a file draws, and what there is to say about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// The sheets in order; at least one, even where nothing is drawn.
    pub pages: Vec<Page>,
    /// What was found, one entry a kind, in the order of their first places.
    pub diagnostics: Vec<Diagnostic>,
    /// What the file consists of, and what it was read for.
    pub summary: Summary,
}

/// One sheet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    /// Its ink; mm, y up, the origin where the file has it.
    pub drawing: Drawing,
    /// What the file says about each pen that draws on it.
    pub pens: BTreeMap<Pen, PenSettings>,
}

/// What a file says about a pen. Where it says different things in the course of a page, the least speed, force and
/// acceleration, and the last width.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PenSettings {
    /// Speed with the pen down, mm/s (`VS`).
    pub speed_mm_s: Option<f64>,
    /// Force in the plotter's own steps (`FS`).
    pub force: Option<f64>,
    /// Acceleration in the plotter's own steps (`AS`).
    pub acceleration: Option<f64>,
    /// Width of the line, mm (`PW`).
    pub width_mm: Option<f64>,
}

/// Takes a file apart without giving it a meaning; linear in its length.
pub fn parse<'a>(bytes: &'a [u8], options: &Options) -> Syntax<'a> {
    parser::Parser::new(bytes, options.label_terminator).collect()
}

/// Reads a file: parse and interpret in one go, in memory that follows the drawing.
///
/// The result is the same as that of [`interpret`] on [`parse`].
pub fn read(bytes: &[u8], options: &Options) -> Document {
    let mut parser = parser::Parser::new(bytes, options.label_terminator);
    let mut interpreter = interpreter::Interpreter::new(options, bytes.len());
    let mut placed = 0;
    loop {
        let before = interpreter.pen_position();
        let more = parser.next().map(|command| interpreter.execute(&command)).is_some();
        if parser.findings.len() > placed {
            parser.findings.place(placed, before);
            placed = parser.findings.len();
        }
        if !more {
            break;
        }
    }
    interpreter.finish(parser.number(), parser.hints.wrappers, parser.findings)
}
