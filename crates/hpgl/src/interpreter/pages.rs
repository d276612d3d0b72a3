//! Sheets: `PG AF AH FR BP`, and resets of the wrappers.

use drawing::Drawing;

use super::Interpreter;
use crate::codes;
use crate::document::Page;
use crate::summary::ProfileReason;

impl Interpreter {
    /// Ends the sheet if anything is on it.
    fn end_page(&mut self) {
        if !self.tracer.has_ink() {
            return;
        }
        let strokes = self.tracer.take_page();
        self.pages.push(Page { drawing: Drawing { strokes }, pens: self.pens.take_used() });
    }

    /// `PG` and its like: a new sheet; coordinates continue.
    pub(super) fn advance_page(&mut self) {
        self.tracer.finish();
        self.down = false;
        self.end_page();
    }

    /// `BP`: a new plot on a new sheet, with everything as at the start.
    pub(super) fn begin_plot(&mut self) {
        self.advance_page();
        self.enter_hpgl2();
        self.initialise();
    }

    /// The file is HP-GL/2: P1 and P2 are the corners of the page unless `IP` sets them.
    pub(super) fn enter_hpgl2(&mut self) {
        self.frame.use_corners();
    }

    /// A reset of the printer, or the end of its job.
    pub(super) fn reset(&mut self) {
        self.advance_page();
        self.note_profile();
        self.frame.forget_page();
        self.initialise();
    }

    /// Records the plotter profile, unless it is only assumed and one was recorded before.
    pub(super) fn note_profile(&mut self) {
        let now = self.frame.profile();
        if self.profile.is_none() || now.reason != ProfileReason::Assumed {
            self.profile = Some(now);
        }
    }

    /// Reports more than one sheet.
    pub(super) fn report_pages(&mut self) {
        let count = self.pages.len();
        if count > 1 {
            self.report(codes::SEVERAL_PAGES, || format!("the file draws {count} pages"));
        }
    }
}
