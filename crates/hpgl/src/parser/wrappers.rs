//! The parser outside HP-GL: PCL, RTL, job control, and the ways in and out.

use drawing::Span;

use super::state::{Head, Language, Parser, Searched, Step};
use crate::codes;
use crate::grammar::bytes::{Class, class};
use crate::grammar::escape::{Escape, escape, text};
use crate::grammar::job::job_line;
use crate::mnemonic::Mnemonic;

/// Plotter units in a decipoint, the unit of picture frames: 1016 / 720.
const PLU_PER_DECIPOINT: f64 = PLU_PER_INCH / 720.0;
const PLU_PER_INCH: f64 = 1016.0;

impl Parser<'_> {
    /// Hands a wrapper's sequence to the interpreter as a command.
    fn wrapper(&mut self, mnemonic: Mnemonic, start: usize) -> Head {
        self.number += 1;
        self.textless(mnemonic, start)
    }

    /// At ESC, in any language.
    pub(super) fn escape(&mut self) -> Option<Head> {
        let start = self.at();
        let found = self.take(escape)?;
        let span = Span { start, end: self.at() };
        match found {
            Escape::DeviceControl(control) => {
                self.hints.wrappers.device_control = true;
                if !control.terminated {
                    self.report(codes::DEVICE_CONTROL_WITHOUT_COLON, Mnemonic::NONE, span, || {
                        (
                            "a device control sequence lacks its colon; it is ended where its parameters end"
                                .into(),
                            None,
                        )
                    });
                }
                None
            }
            Escape::EnterHpGl(parameter) => {
                self.hints.wrappers.pcl = true;
                self.language = Language::HpGl;
                self.parameters.push(f64::from(parameter));
                Some(self.wrapper(Mnemonic::ENTER, start))
            }
            Escape::LeaveHpGl => {
                self.language = Language::Pcl;
                None
            }
            Escape::EndOfJob => {
                self.language = Language::Job;
                self.restore_terminator();
                Some(self.wrapper(Mnemonic::RESET, start))
            }
            Escape::Reset => {
                self.restore_terminator();
                self.language = if self.hpgl_is_entered_later() { Language::Pcl } else { Language::HpGl };
                Some(self.wrapper(Mnemonic::RESET, start))
            }
            Escape::Pcl(pcl) => {
                if pcl.binary {
                    self.report(codes::RASTER, Mnemonic::NONE, span, || {
                        ("raster or other binary data is skipped".into(), None)
                    });
                }
                let plu = |size: Option<f64>, unit: f64| size.map_or(f64::NAN, |size| size * unit);
                let sizes = [
                    plu(pcl.frame.0, PLU_PER_DECIPOINT),
                    plu(pcl.frame.1, PLU_PER_DECIPOINT),
                    plu(pcl.plot_size.0, PLU_PER_INCH),
                    plu(pcl.plot_size.1, PLU_PER_INCH),
                ];
                if sizes.iter().all(|size| size.is_nan()) {
                    return None;
                }
                self.parameters.extend(sizes);
                Some(self.wrapper(Mnemonic::PICTURE_FRAME, start))
            }
            Escape::Unknown => {
                self.report(codes::STRAY_ESCAPE, Mnemonic::NONE, span, || {
                    ("an unknown escape sequence is skipped".into(), None)
                });
                None
            }
        }
    }

    /// Whether HP-GL/2 is entered after this byte by `ESC %#B` or by job control; if not, what
    /// looks like PCL cannot be meant as such.
    fn hpgl_is_entered_later(&mut self) -> bool {
        let at = self.at();
        match self.next_entry {
            Searched::Nowhere => return false,
            Searched::At(entry) if entry >= at => return true,
            _ => {}
        }
        let found = (at..self.bytes.len()).find(|&at| {
            let rest = &self.bytes[at..];
            match rest {
                [0x1b, b'%', ..] => matches!(escape(rest), Ok((_, Escape::EnterHpGl(_)))),
                [b'L', ..] => rest.starts_with(b"LANGUAGE"),
                _ => false,
            }
        });
        self.next_entry = found.map_or(Searched::Nowhere, Searched::At);
        found.is_some()
    }

    /// One step in PCL or RTL: everything up to the next ESC is text on the page, which no pen
    /// draws.
    pub(super) fn pcl(&mut self) -> Step {
        let Some(text) = self.take(text) else { return Step::End };
        if text.iter().any(u8::is_ascii_graphic) {
            self.report(codes::PCL_TEXT, Mnemonic::NONE, self.span_of(text), || {
                ("text outside HP-GL/2 (PCL) is not drawn".into(), None)
            });
        }
        if self.rest.is_empty() { Step::End } else { self.escape().into() }
    }

    /// One step in job control: lines that begin with `@PJL`.
    pub(super) fn job(&mut self) -> Step {
        let Some(&byte) = self.rest.first() else { return Step::End };
        if let Some(language) = self.take(job_line) {
            self.hints.wrappers.job_control = true;
            if let Some(language) = language {
                let hpgl = language.to_ascii_uppercase().starts_with(b"HPGL");
                self.language = if hpgl { Language::HpGl } else { Language::Pcl };
            }
            return Step::Nothing;
        }
        match class(byte) {
            Class::Escape => self.escape().into(),
            Class::Blank | Class::LineEnd | Class::Control => {
                self.rest = &self.rest[1..];
                Step::Nothing
            }
            // A plotter's own language needs no announcement.
            _ => {
                self.language = Language::HpGl;
                // The parser's own test for `@PJL` has failed here, so that this cannot go round in
                // circles.
                Step::Nothing
            }
        }
    }
}
