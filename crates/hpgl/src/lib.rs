//! HP-GL and HP-GL/2, the languages of pen plotters: from bytes to a [`Drawing`], and back.
//!
//! ```
//! let file = b"IN;SP1;PU0,0;PD400,0,400,400;QQ7;PU;";
//! let document = hpgl::read(file, &hpgl::Options::default());
//!
//! // One page with one stroke of pen 1: 10 mm to the right, 10 mm up.
//! let drawing = &document.pages[0].drawing;
//! assert_eq!(drawing.strokes.len(), 1);
//! assert_eq!(drawing.pens(), [hpgl::Pen(1)]);
//! assert_eq!(drawing.length(), 20.0);
//!
//! // `QQ` is no command: it is skipped and reported with its bytes.
//! let diagnostic = &document.diagnostics[0];
//! assert_eq!(diagnostic.code.name(), "H0101");
//! assert_eq!(&file[diagnostic.span.start..diagnostic.span.end], b"QQ");
//! assert_eq!(diagnostic.to_string(), "warning[H0101] byte 29: unknown command `QQ` is skipped");
//!
//! // Written again as clean HP-GL.
//! let clean = hpgl::emit(drawing, &hpgl::EmitOptions::default());
//! assert_eq!(hpgl::read(&clean, &hpgl::Options::default()).pages[0].drawing.length(), 20.0);
//! ```
//!
//! Two passes, two types: [`parse`] turns bytes into a [`Syntax`] (commands, numbers, where they
//! stand), [`interpret`] gives them their meaning. [`read`] does both at once without keeping the
//! syntax. None of them fails: what cannot be understood is skipped and reported as
//! [`Diagnostic`]s. [`emit()`] writes a drawing as clean HP-GL.
//!
//! Positions come out in millimetres, plotter units times [`Options::plotter_unit_mm`] after the
//! file's own scaling and rotation, y up.

mod codes;
mod diagnostics;
mod document;
mod emit;
mod fonts;
mod grammar;
mod interpreter;
mod mnemonic;
mod parser;
mod producers;
mod profile;
mod summary;
mod syntax;
mod units;

pub use codes::{Code, Severity};
pub use diagnostics::Diagnostic;
pub use document::{Document, Page, PenSettings};
pub use drawing::{Drawing, Pen, Point, Span};
pub use emit::{EmitOptions, Encoding, emit};
pub use fonts::{CAP_HEIGHT as FONT_CAP_HEIGHT, Glyph};
pub use grammar::name::known_commands;
pub use interpreter::interpret;
pub use mnemonic::Mnemonic;
pub use producers::producer;
pub use profile::{Options, Paper, Plotter, plotters};
pub use summary::{Generation, Profile, ProfileReason, Summary, Wrappers};
pub use syntax::{Command, Syntax};
pub use units::{PLOTTER_UNIT_7475A_MM, PLOTTER_UNIT_MM};

/// Parses a file without interpreting it; linear in its length.
pub fn parse<'a>(bytes: &'a [u8], options: &Options) -> Syntax<'a> {
    parser::Parser::new(bytes, options.label_terminator).collect()
}

/// Reads a file: parse and interpret in one go, in memory that follows the drawing.
///
/// The result is the same as that of [`interpret`] on [`parse`].
pub fn read(bytes: &[u8], options: &Options) -> Document {
    interpreter::on_fitting_page(|page_axes| {
        let mut parser = parser::Parser::new(bytes, options.label_terminator);
        let mut interpreter = interpreter::Interpreter::new(options, page_axes, bytes.len());
        let mut positioned = 0;
        loop {
            let before = interpreter.pen_position();
            let more = parser.next().map(|command| interpreter.execute(&command)).is_some();
            if parser.findings.len() > positioned {
                parser.findings.set_pen_position(positioned, before);
                positioned = parser.findings.len();
            }
            if !more {
                break;
            }
        }
        interpreter.finish(parser.number(), parser.hints.wrappers, parser.findings)
    })
}
