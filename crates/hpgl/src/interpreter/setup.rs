//! Configuration: `IN DF IP IR SC RO IW PS SP CT`.

use drawing::{Point, Vec2};

use super::characters::Characters;
use super::fill::FillType;
use super::frame::{Rotation, Scale};
use super::line_type::LineType;
use super::ticks::Ticks;
use super::{Interpreter, PenSelection};
use crate::codes;
use crate::mnemonic::Mnemonic;
use crate::profile::paper_of_code;

/// `PS` with one number up to this is the code of a paper format (7475A, 7550A); more is a length
/// in plotter units.
const LARGEST_PAPER_CODE: f64 = 130.0;

impl Interpreter {
    /// `IN`: everything as it is when the plotter is switched on; the pen goes up and to the
    /// origin.
    pub(super) fn initialise(&mut self) {
        self.tracer.finish();
        self.down = false;
        self.relative = false;
        self.chords_by_deviation = false;
        if self.pen_selection == PenSelection::Empty {
            self.pen_selection = PenSelection::Default;
        }
        self.polygon.clear();
        self.fill = FillType::default();
        self.line_type = LineType::default();
        self.ticks = Ticks::default();
        self.characters = Characters::default();
        self.symbol = None;
        self.reset_palette();
        self.unsettled_scale = None;
        self.tracer.set_dashes(None);
        self.frame.initialise();
        self.tracer.set_clip(self.frame.clip());
        self.set_pen_position(Point::ZERO);
    }

    /// `DF`: settings of drawing as `IN` makes them; P1, P2, rotation and the pen position stay.
    pub(super) fn set_defaults(&mut self) {
        self.relative = false;
        self.chords_by_deviation = false;
        self.polygon.clear();
        self.fill = FillType::with_pen(self.fill.pen_thickness);
        self.line_type = LineType::default();
        self.ticks = Ticks::default();
        self.characters = Characters::default();
        self.symbol = None;
        self.unsettled_scale = None;
        self.tracer.set_dashes(None);
        self.frame.set_defaults();
        self.tracer.set_clip(self.frame.clip());
    }

    /// `IP`: P1 and P2 in plotter units. With one point only, P2 follows P1.
    pub(super) fn input_points(&mut self, p: &[f64]) {
        let (p1, p2) = self.frame.points();
        match *p {
            [] => {
                self.frame.reset_points();
                self.frame_changed();
            }
            [x, y] => self.set_points(Point::new(x, y), Point::new(x, y) + (p2 - p1)),
            [x1, y1, x2, y2] => self.set_points(Point::new(x1, y1), Point::new(x2, y2)),
            _ => self.bad_parameters("two or four numbers"),
        }
    }

    /// `IR`: P1 and P2 in percent of the area that the plotter reaches.
    pub(super) fn input_points_relative(&mut self, p: &[f64]) {
        let (p1, p2) = self.frame.points();
        let reach = self.frame.reach();
        let at = |x: f64, y: f64| {
            Point::new(reach.x0 + reach.width() * x / 100.0, reach.y0 + reach.height() * y / 100.0)
        };
        match *p {
            [] => self.set_points(at(0.0, 0.0), at(100.0, 100.0)),
            [x, y] => self.set_points(at(x, y), at(x, y) + (p2 - p1)),
            [x1, y1, x2, y2] => self.set_points(at(x1, y1), at(x2, y2)),
            _ => self.bad_parameters("two or four numbers"),
        }
    }

    fn set_points(&mut self, p1: Point, p2: Point) {
        if self.frame.set_points(p1, p2) {
            self.report(codes::SCALING_POINTS_MEET, || {
                "P1 and P2 coincide on an axis; P2 is moved by one plotter unit".into()
            });
        }
        self.frame_changed();
    }

    /// Updates what depends on the frame: the window, and the line pattern, whose length follows P1
    /// and P2 and which begins anew.
    fn frame_changed(&mut self) {
        self.tracer.set_clip(self.frame.clip());
        self.apply_line_type();
    }

    /// `SC`: user units. The pen stays where it is.
    pub(super) fn scale(&mut self, p: &[f64]) {
        let scale = match *p {
            [] => None,
            [x1, x2, y1, y2] | [x1, x2, y1, y2, 0.0] => Some(Scale::Anisotropic { x: (x1, x2), y: (y1, y2) }),
            [x1, x2, y1, y2, 1.0] => {
                Some(Scale::Isotropic { x: (x1, x2), y: (y1, y2), left: 50.0, bottom: 50.0 })
            }
            [x1, x2, y1, y2, 1.0, left] => {
                Some(Scale::Isotropic { x: (x1, x2), y: (y1, y2), left, bottom: 50.0 })
            }
            [x1, x2, y1, y2, 1.0, left, bottom] => {
                Some(Scale::Isotropic { x: (x1, x2), y: (y1, y2), left, bottom })
            }
            [x1, xf, y1, yf, 2.0] => Some(Scale::PointFactor { origin: (x1, y1), factor: (xf, yf) }),
            _ => {
                self.bad_parameters("four numbers, or a type from 0 to 2 after them");
                return;
            }
        };
        let possible = match scale {
            Some(Scale::PointFactor { factor, .. }) => factor.0 != 0.0 && factor.1 != 0.0,
            Some(Scale::Anisotropic { x, y } | Scale::Isotropic { x, y, .. }) => x.0 != x.1 && y.0 != y.1,
            None => true,
        };
        if !possible {
            self.report(codes::BAD_SCALE, || "`SC` names a range without extent; it has no effect".into());
            return;
        }
        // P1 and P2 count when something is drawn: an IP may follow.
        self.unsettled_scale = scale.map(|_| (self.span, self.number, self.position_mm));
        self.pens.touch();
        self.frame.set_scale(scale);
        self.frame_changed();
    }

    /// Reports that ink is scaled by assumed P1 and P2, at the `SC` that did so.
    pub(super) fn report_assumed_points(&mut self) {
        let Some((span, number, position_mm)) = self.unsettled_scale.take() else { return };
        if !self.frame.points_are_assumed() {
            return;
        }
        let (p1, p2) = self.frame.points();
        self.findings.report(codes::ASSUMED_PLOTTER, Mnemonic(*b"SC"), span, number, position_mm, || {
            let message =
                format!("no IP sets P1 and P2: ({}, {}) and ({}, {}) are taken", p1.x, p1.y, p2.x, p2.y);
            (message, None)
        });
    }

    /// `RO`: turns the frame by quarters. The pen stays where it is on the paper.
    pub(super) fn rotate(&mut self, p: &[f64]) {
        let Some(rotation) = Rotation::from_degrees(p.first().copied().unwrap_or(0.0)) else {
            self.bad_parameters("0, 90, 180 or 270");
            return;
        };
        self.tracer.finish();
        let position = self.frame.rotate(rotation, self.position);
        self.set_pen_position(position);
        self.frame_changed();
    }

    /// `IW`: the window that ink is clipped to.
    pub(super) fn input_window(&mut self, p: &[f64]) {
        match *p {
            [] => self.frame.set_window(None),
            [x1, y1, x2, y2] => {
                self.frame.set_window(Some((Point::new(x1, y1), Point::new(x2, y2))));
                if self.frame.clip().is_some_and(|clip| clip.width() <= 0.0 || clip.height() <= 0.0) {
                    self.report(codes::EMPTY_WINDOW, || "the window holds nothing".into());
                }
            }
            _ => {
                self.bad_parameters("four numbers or none");
                return;
            }
        }
        self.frame_changed();
    }

    /// `PS`: the page of HP-GL/2, or the paper format of HP-GL plotters.
    pub(super) fn page_size(&mut self, p: &[f64]) {
        match *p {
            [] => {}
            [code] if code <= LARGEST_PAPER_CODE => {
                self.report(codes::PAPER_CODE, || format!("PS{code} is the code of a paper format"));
                self.frame.set_paper(paper_of_code(code));
                self.frame_changed();
                self.set_pen_position(self.position);
            }
            [length] => self.set_page(length, None),
            [length, width, ..] if length > LARGEST_PAPER_CODE && width > LARGEST_PAPER_CODE => {
                self.set_page(length, Some(width));
            }
            _ => self.bad_parameters("a length and a width"),
        }
    }

    fn set_page(&mut self, length: f64, width: Option<f64>) {
        self.tracer.finish();
        self.frame.set_page(length, width);
        self.frame_changed();
        self.set_pen_position(self.position);
    }

    /// A PCL picture frame: the page of HP-GL/2, as far as its size is given; or the size of the plot
    /// that is scaled to the frame.
    pub(super) fn picture_frame(&mut self, p: &[f64]) {
        let [width, height, plot_width, plot_height] = *p else { return };
        if !(width.is_nan() && height.is_nan()) {
            let reach = self.frame.reach();
            let width = if width > 0.0 { width } else { reach.width() };
            let height = if height > 0.0 { height } else { reach.height() };
            self.frame.set_picture_frame(width, height);
        }
        self.frame.set_plot_size(plot_width, plot_height);
        self.frame_changed();
        self.set_pen_position(self.position);
    }

    /// `SP`.
    pub(super) fn select_pen(&mut self, p: &[f64]) {
        self.change_pen(p.first().copied().unwrap_or(0.0));
    }

    pub(super) fn change_pen(&mut self, number: f64) {
        let number = number.round();
        if !(0.0..=f64::from(u16::MAX)).contains(&number) {
            self.bad_parameters("a pen number from 0 to 65535");
            return;
        }
        self.hold(number as u16);
        self.apply_line_type();
    }

    /// `CT`: what the chord parameter of arcs is.
    pub(super) fn chord_type(&mut self, p: &[f64]) {
        match p.first().copied().unwrap_or(0.0) {
            0.0 => self.chords_by_deviation = false,
            1.0 => self.chords_by_deviation = true,
            _ => self.bad_parameters("0 or 1"),
        }
    }

    /// The pen position in current units.
    pub(super) fn user_position(&self) -> Point {
        self.frame.user_of_plu(self.position)
    }

    /// The position in current units at the given offset from the pen.
    pub(super) fn user_offset(&self, dx: f64, dy: f64) -> Point {
        self.user_position() + Vec2::new(dx, dy)
    }
}
