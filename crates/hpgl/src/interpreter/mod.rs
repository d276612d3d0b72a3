//! From commands to ink: the state of a plotter, and what each command does to it.

mod arcs;
mod characters;
mod fill;
mod frame;
mod label;
mod lettering;
mod line_type;
mod pages;
mod pens;
mod polygon;
mod setup;
mod ticks;
mod tracer;
mod travel;

use std::sync::Arc;

use drawing::{Drawing, Lettering, Pen, Point, Span};

use crate::codes;
use crate::codes::Code;
use crate::diagnostics::Findings;
use crate::document::{Document, Page};
use crate::fonts::Glyph;
use crate::mnemonic::Mnemonic;
use crate::profile::Options;
use crate::summary::{Profile, Summary, Wrappers};
use crate::syntax::{Command, Syntax};
use characters::Characters;
use fill::FillType;
use frame::Frame;
pub(crate) use frame::PageAxes;
use lettering::Style;
use line_type::LineType;
use pens::Pens;
use polygon::Polygon;
use ticks::Ticks;
use tracer::Tracer;

/// Interprets the commands of a file.
pub fn interpret(syntax: &Syntax<'_>, options: &Options) -> Document {
    on_fitting_page(|page_axes| {
        let mut interpreter = Interpreter::new(options, page_axes, syntax.bytes.len());
        let mut findings = syntax.findings.clone();
        let mut positioned = 0;
        for (command, found) in syntax.commands().zip(syntax.findings_until()) {
            if found > positioned {
                findings.set_pen_position(positioned, interpreter.pen_position());
                positioned = found;
            }
            interpreter.execute(&command);
        }
        findings.set_pen_position(positioned, interpreter.pen_position());
        interpreter.finish(syntax.command_count, syntax.hints.wrappers, findings)
    })
}

/// Reads a file with the lengths of `PS` as they are written. Where that cuts ink off, and more ink is
/// left on a page whose longer side lies along x, that page is meant.
pub(crate) fn on_fitting_page(read: impl Fn(PageAxes) -> (Document, bool)) -> Document {
    let (document, is_cut) = read(PageAxes::AsWritten);
    if !is_cut {
        return document;
    }
    let ink_mm = |document: &Document| document.pages.iter().map(|page| page.drawing.length()).sum::<f64>();
    let (turned, _) = read(PageAxes::LongerAlongX);
    if ink_mm(&turned) > ink_mm(&document) { turned } else { document }
}

/// Limit of hatch lines, and of dashes: this number plus [`SEGMENTS_PER_BYTE`] times the size of
/// the file. Enough for a large sheet filled solid; without a limit a few bytes could exhaust
/// memory.
const BASE_SEGMENT_BUDGET: u64 = 200_000;
const SEGMENTS_PER_BYTE: u64 = 4;

/// Which pen the plotter holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PenSelection {
    /// No `SP` yet.
    Default,
    /// `SP0`.
    Empty,
    /// A pen.
    Holds(u16),
}

/// The state of a plotter while it draws a file.
pub(crate) struct Interpreter {
    frame: Frame,
    pen_selection: PenSelection,
    down: bool,
    relative: bool,
    /// The parameter of `CT` is 1: chords are given by how far they leave their arc.
    chords_by_deviation: bool,
    /// Where the pen is, plotter units of the turned frame.
    position: Point,
    /// The same position on the page, mm.
    position_mm: Point,
    tracer: Tracer,
    polygon: Polygon,
    fill: FillType,
    line_type: LineType,
    ticks: Ticks,
    characters: Characters,
    pens: Pens,
    /// Where carriage returns lead, plotter units.
    margin: Point,
    /// Where the last label left the pen: if it is elsewhere, it has moved since.
    label_end: Option<Point>,
    /// The lettering of the last label, and room for its text.
    lettering: Option<(Style, Arc<dyn Lettering>)>,
    label_text: Vec<u8>,
    /// What `BL` kept, and where it stands in the file.
    label_buffer: (Vec<u8>, usize),
    /// The last `SC` while nothing was drawn with it: its bytes, number and pen position.
    unsettled_scale: Option<(Span, usize, Point)>,
    /// The symbol to draw at every point.
    symbol: Option<Glyph>,
    /// How many hatch lines may still be drawn.
    pieces_left: u64,
    pages: Vec<Page>,
    findings: Findings,
    /// The plotter that the file was read for, before a reset forgot it.
    profile: Option<Profile>,
    /// How often each command occurred, by the index of its letters.
    used: Vec<u64>,
    mnemonic: Mnemonic,
    span: Span,
    number: usize,
}

impl Interpreter {
    /// A plotter for a file of that many bytes.
    pub(crate) fn new(options: &Options, page_axes: PageAxes, length: usize) -> Self {
        let pieces = BASE_SEGMENT_BUDGET + SEGMENTS_PER_BYTE * length as u64;
        let frame = Frame::new(options, page_axes);
        let position_mm = frame.mm_of_plu(Point::ZERO);
        let mut tracer = Tracer::new(pieces as f64, options.plotter_unit_mm);
        tracer.set_clip(frame.clip());
        Self {
            frame,
            pen_selection: PenSelection::Default,
            down: false,
            relative: false,
            chords_by_deviation: false,
            position: Point::ZERO,
            position_mm,
            tracer,
            polygon: Polygon::default(),
            fill: FillType::default(),
            line_type: LineType::default(),
            ticks: Ticks::default(),
            characters: Characters::default(),
            pens: Pens::default(),
            margin: Point::ZERO,
            label_end: None,
            lettering: None,
            label_text: Vec::new(),
            label_buffer: (Vec::new(), 0),
            unsettled_scale: None,
            symbol: None,
            pieces_left: pieces,
            pages: Vec::new(),
            findings: Findings::default(),
            profile: None,
            used: vec![0; 26 * 26],
            mnemonic: Mnemonic::NONE,
            span: Span::default(),
            number: 0,
        }
    }

    /// Where the pen is, mm.
    pub(crate) fn pen_position(&self) -> Point {
        self.position_mm
    }

    /// Reports a finding about the command at work.
    fn report(&mut self, code: Code, message: impl FnOnce() -> String) {
        self.report_at(code, self.span, message);
    }

    fn report_at(&mut self, code: Code, span: Span, message: impl FnOnce() -> String) {
        self.findings.report(code, self.mnemonic, span, self.number, self.position_mm, || (message(), None));
    }

    /// Reports a finding about a setting that the command at work cannot make.
    fn bad_parameters(&mut self, expected: &str) {
        let mnemonic = self.mnemonic;
        self.report(codes::BAD_PARAMETERS, || format!("`{mnemonic}` takes {expected}; it has no effect"));
    }

    /// Reports a finding about ink that the command at work does not draw.
    fn report_dropped(&mut self, expected: &str) {
        let mnemonic = self.mnemonic;
        self.report(codes::LOST_DRAWING_COMMAND, || {
            format!("`{mnemonic}` takes {expected}; it draws nothing")
        });
    }

    /// Executes a command.
    pub(crate) fn execute(&mut self, command: &Command<'_>) {
        let mnemonic = command.mnemonic;
        let goes_on = self.number == command.number;
        self.mnemonic = mnemonic;
        self.span = command.span;
        self.number = command.number;
        self.tracer.set_command(command.span);
        let [first, second] = mnemonic.0;
        if first >= b'A' && !goes_on {
            self.used[usize::from(first - b'A') * 26 + usize::from(second - b'A')] += 1;
        }
        if !(self.draw(command) || self.write_text(command)) {
            self.configure(command);
        }
        self.report_given_up_dashes();
        for _ in 0..self.tracer.take_clipped() {
            if self.frame.has_window() {
                self.report(codes::CLIPPED, || "ink outside the window is cut off".into());
            } else if self.frame.has_page() {
                self.report(codes::CUT_AT_PAGE, || "ink outside the page that PS sets is cut off".into());
            } else {
                self.report(codes::CUT_AT_LIMITS, || "ink outside the plotter's limits is cut off".into());
            }
        }
    }

    /// Executes a command that moves the pen or draws; false if it is none.
    #[inline]
    fn draw(&mut self, command: &Command<'_>) -> bool {
        let p = command.parameters;
        match &command.mnemonic.0 {
            b"PU" => self.pen_up(p),
            b"PD" => self.pen_down(p),
            b"PA" => self.plot_absolute(p),
            b"PR" => self.plot_relative(p),
            b"PE" => self.polyline_encoded(command.text, command.reencoded),
            b"AA" => self.arc_absolute(p),
            b"AR" => self.arc_relative(p),
            b"AT" => self.arc_through_absolute(p),
            b"RT" => self.arc_through_relative(p),
            b"BZ" => self.bezier_absolute(p),
            b"BR" => self.bezier_relative(p),
            b"CI" => self.circle(p),
            b"EA" => self.edge_rectangle_absolute(p),
            b"ER" => self.edge_rectangle_relative(p),
            b"RA" => self.fill_rectangle_absolute(p),
            b"RR" => self.fill_rectangle_relative(p),
            b"EW" => self.edge_wedge(p),
            b"WG" => self.fill_wedge(p),
            b"PM" => self.polygon_mode(p),
            b"EP" => self.edge_polygon(),
            b"FP" => self.fill_polygon(p),
            b"XT" => self.x_tick(),
            b"YT" => self.y_tick(),
            _ => return false,
        }
        true
    }

    /// Executes a command of labels and symbols; false if it is none.
    fn write_text(&mut self, command: &Command<'_>) -> bool {
        let p = command.parameters;
        match &command.mnemonic.0 {
            b"LB" => self.label(command.text, command.text_span.start),
            b"BL" => self.buffer_label(command.text, command.text_span.start),
            b"PB" => self.print_buffer(),
            b"CP" => self.character_plot(p),
            b"SM" => self.symbol_mode(command.text, command.text_span.start),
            b"UC" => self.user_character(p),
            b"SI" => self.size_absolute(p),
            b"SR" => self.size_relative(p),
            b"DI" => self.direction_absolute(p),
            b"DR" => self.direction_relative(p),
            b"SL" => self.slant(p),
            b"ES" => self.extra_space(p),
            b"LO" => self.label_origin(p),
            b"DV" => self.text_path(p),
            b"CS" => self.character_set(p, false),
            b"CA" => self.character_set(p, true),
            b"SD" => self.font_definition(p, false),
            b"AD" => self.font_definition(p, true),
            b"SS" => self.select_font(false),
            b"SA" => self.select_font(true),
            _ => return false,
        }
        true
    }

    /// Executes a command that changes a setting, or reports one that has no meaning in a file.
    fn configure(&mut self, command: &Command<'_>) {
        let (mnemonic, p) = (command.mnemonic, command.parameters);
        match &mnemonic.0 {
            b"CT" => self.chord_type(p),
            b"FT" => self.fill_type(p),
            b"AC" => self.anchor_corner(p),
            b"PT" => self.pen_thickness(p),
            b"LT" => self.line_type(p),
            b"UL" => self.user_line_type(p),
            b"TL" => self.tick_length(p),
            b"VS" => self.pen_speed(p),
            b"FS" => self.pen_force(p),
            b"AS" => self.pen_acceleration(p),
            b"PW" => self.pen_width(p),
            b"WU" => self.width_unit(p),
            b"PC" => self.pen_colour(p),
            b"CR" => self.colour_range(p),
            // They have no effect on ink but that line patterns begin anew.
            b"LA" | b"RF" | b"TR" => self.apply_line_type(),
            b"SP" => self.select_pen(p),
            b"IN" => self.initialise(),
            b"DF" => self.set_defaults(),
            b"IP" => self.input_points(p),
            b"IR" => self.input_points_relative(p),
            b"SC" => self.scale(p),
            b"RO" => self.rotate(p),
            b"IW" => self.input_window(p),
            b"PS" => self.page_size(p),
            b"PG" | b"AF" | b"AH" | b"FR" => self.advance_page(),
            b"BP" => self.begin_plot(),
            b"OA" | b"OC" | b"OD" | b"OE" | b"OF" | b"OG" | b"OH" | b"OI" | b"OK" | b"OL" | b"OO" | b"OP"
            | b"OS" | b"OT" | b"OW" | b"DP" | b"DC" => {
                self.report(codes::OUTPUT_COMMAND, || format!("`{mnemonic}` has no meaning in a file"));
            }
            _ if mnemonic == Mnemonic::ENTER => self.enter_hpgl2(),
            _ if mnemonic == Mnemonic::RESET => self.reset(),
            _ if mnemonic == Mnemonic::PICTURE_FRAME => self.picture_frame(p),
            _ => {}
        }
    }

    /// Call before drawing: selects a pen if none is held, and reports that.
    #[inline]
    fn ink(&mut self) {
        if !(matches!(self.pen_selection, PenSelection::Holds(_)) && self.pens.are_noted()) {
            self.find_pen();
        }
    }

    fn find_pen(&mut self) {
        match self.pen_selection {
            PenSelection::Holds(_) => {}
            PenSelection::Default => {
                self.report(codes::NO_PEN_SELECTED, || "no SP has selected a pen: pen 1 is taken".into());
                self.hold(1);
            }
            // Kept as ink of pen 0 until the end of the file, when it is known whether there is any
            // other.
            PenSelection::Empty => {
                self.report(codes::PEN_PUT_AWAY, || "the pen is put away (SP0): nothing is drawn".into());
            }
        }
        self.report_assumed_points();
        self.note_pen();
    }

    fn hold(&mut self, pen: u16) {
        self.pen_selection =
            if pen == 0 && !self.pens.zero_draws { PenSelection::Empty } else { PenSelection::Holds(pen) };
        self.tracer.set_pen(Pen(pen));
        self.pens.touch();
    }

    /// Sets the pen position without drawing.
    fn set_pen_position(&mut self, position: Point) {
        self.position = position;
        self.position_mm = self.frame.mm_of_plu(position);
    }

    /// Whether a point is in range; if not, it is reported.
    #[inline]
    fn is_sane(&mut self, position: Point) -> bool {
        let sane = position.x.abs() <= crate::units::SANE_PLU && position.y.abs() <= crate::units::SANE_PLU;
        if !sane {
            self.report_far_point(position);
        }
        sane
    }

    #[cold]
    fn report_far_point(&mut self, position: Point) {
        let mnemonic = self.mnemonic;
        self.report(codes::COORDINATE_OUT_OF_RANGE, || {
            format!(
                "`{mnemonic}` leads to ({:.4e}, {:.4e}) plotter units; the point is left out",
                position.x, position.y
            )
        });
    }

    /// Ink that was drawn after `SP0` is none, unless there is no other in the whole file: then a
    /// pen in the holder is meant.
    fn settle_ink_of_no_pen(&mut self) {
        if self.pens.zero_draws {
            self.number_pen_zero();
            return;
        }
        if !self.findings.has(codes::PEN_PUT_AWAY) {
            return;
        }
        let pens: Vec<Pen> = self.pages.iter().flat_map(|page| page.drawing.pens()).collect();
        if pens.iter().all(|&pen| pen == Pen(0)) {
            if !pens.is_empty() {
                self.findings.recode(codes::PEN_PUT_AWAY, codes::ONLY_INK_WITHOUT_PEN, || {
                    "all drawing is done with the pen put away (SP0): pen 1 is taken".into()
                });
            }
            for page in &mut self.pages {
                page.drawing.strokes.change_pens(|_| Some(Pen(1)));
            }
            return;
        }
        for page in &mut self.pages {
            page.drawing.strokes.change_pens(|pen| (pen != Pen(0)).then_some(pen));
        }
        self.pages.retain(|page| !page.drawing.is_empty());
    }

    /// The end of the file: the document, and whether ink was cut off at a page that might lie otherwise.
    pub(crate) fn finish(
        mut self,
        commands: usize,
        wrappers: Wrappers,
        syntax_findings: Findings,
    ) -> (Document, bool) {
        if self.polygon.is_open() {
            self.report(codes::OPEN_POLYGON, || "the file ends inside a polygon (PM0 without PM2)".into());
        }
        let strokes = self.tracer.take_page();
        if !strokes.is_empty() || self.pages.is_empty() {
            self.pages.push(Page { drawing: Drawing { strokes }, pens: self.pens.take_used() });
        }
        self.settle_ink_of_no_pen();
        self.name_white_pens();
        self.report_pages();
        self.note_profile();
        let white_pens = self.white_pens();
        let profile = self.profile.unwrap_or_default();
        let mut diagnostics = syntax_findings.into_vec();
        diagnostics.extend(self.findings.into_vec());
        diagnostics.sort_by_key(|diagnostic| (diagnostic.span, diagnostic.code));
        let used = (0_u16..26 * 26)
            .map(|index| {
                (
                    Mnemonic([b'A' + (index / 26) as u8, b'A' + (index % 26) as u8]),
                    self.used[usize::from(index)],
                )
            })
            .filter(|&(_, count)| count > 0)
            .collect();
        let summary = Summary { commands, used, wrappers, profile, white_pens };
        let is_cut = self.frame.portrait_seen()
            && diagnostics.iter().any(|diagnostic| diagnostic.code == codes::CUT_AT_PAGE);
        (Document { pages: self.pages, diagnostics, summary }, is_cut)
    }
}
