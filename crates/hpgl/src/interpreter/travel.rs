//! Moving the pen: `PU PD PA PR PE`.

use drawing::{Point, Vec2};

use super::Interpreter;
use crate::codes;
use crate::grammar::encoded::{Decoder, Item};

impl Interpreter {
    pub(super) fn pen_up(&mut self, parameters: &[f64]) {
        self.down = false;
        if !self.polygon.is_open() {
            self.tracer.finish();
        }
        self.travel(parameters);
    }

    pub(super) fn pen_down(&mut self, parameters: &[f64]) {
        self.lower();
        self.travel(parameters);
    }

    #[inline]
    fn lower(&mut self) {
        if !self.down {
            self.down = true;
            if !self.polygon.is_open() {
                self.ink();
                self.tracer.lower(self.position_mm);
            }
        }
    }

    pub(super) fn plot_absolute(&mut self, parameters: &[f64]) {
        self.relative = false;
        self.travel(parameters);
    }

    pub(super) fn plot_relative(&mut self, parameters: &[f64]) {
        self.relative = true;
        self.travel(parameters);
    }

    /// Visits the points of a coordinate list with the pen as it is.
    fn travel(&mut self, parameters: &[f64]) {
        let pairs = parameters.chunks_exact(2);
        if let [_] = pairs.remainder() {
            let mnemonic = self.mnemonic;
            self.report(codes::ODD_COORDINATES, || {
                format!("`{mnemonic}` ends with an x without y, which is skipped")
            });
        }
        if pairs.len() == 0 {
            return;
        }
        if self.polygon.is_open() || !self.down || self.symbol.is_some() {
            for pair in pairs {
                let to = self.target(self.position, pair[0], pair[1]);
                self.go(to);
                if let Some(symbol) = self.symbol
                    && !self.polygon.is_open()
                {
                    self.draw_symbol(symbol);
                }
            }
            return;
        }
        for pair in pairs {
            let to = self.target(self.position, pair[0], pair[1]);
            self.go(to);
        }
    }

    /// Plotter units of a pair of coordinates in the current mode.
    #[inline]
    fn target(&self, from: Point, x: f64, y: f64) -> Point {
        if self.relative {
            from + self.frame.plu_of_user_step(Vec2::new(x, y))
        } else {
            self.frame.plu_of_user(Point::new(x, y))
        }
    }

    /// Moves straight to a position in plotter units with the pen as it is.
    #[inline]
    pub(super) fn go(&mut self, to: Point) {
        if !self.is_sane(to) {
            return;
        }
        let to_mm = self.frame.mm_of_plu(to);
        if self.polygon.is_open() {
            self.polygon.line(self.position_mm, to_mm, self.down);
        } else if self.down {
            self.ink();
            self.tracer.line(self.position_mm, to_mm);
        }
        self.position = to;
        self.position_mm = to_mm;
    }

    /// `PE`: a polyline in few bytes. Its pairs are relative steps with the pen down unless flagged
    /// otherwise; `PA` or `PR` are as before afterwards, the pen is as it was last.
    pub(super) fn polyline_encoded(&mut self, data: &[u8], reencoded: bool) {
        let relative = self.relative;
        let reencoded = reencoded && data.iter().any(|b| matches!(b, 0xc2 | 0xc3));
        if reencoded {
            self.report(codes::ENCODED_REENCODED, || {
                "the data were re-encoded as UTF-8; pairs of bytes are read as the one they were".into()
            });
        }
        let (mut up, mut absolute) = (false, false);
        let mut x = None;
        for item in Decoder::new(data, reencoded) {
            match item {
                Item::Up => up = true,
                Item::Absolute => absolute = true,
                Item::Pen(pen) => self.change_pen(pen),
                Item::BadFraction(bits) => self.report(codes::ENCODED_DAMAGED, || {
                    format!("{bits} fractional bits are not allowed; the number of bits stays as it was")
                }),
                Item::Unfinished => self.report(codes::ENCODED_DAMAGED, || {
                    "a number lacks its last digit and is left out".into()
                }),
                Item::Coordinate(value) => match x.take() {
                    None => x = Some(value),
                    Some(x) => {
                        self.relative = !absolute;
                        let to = self.target(self.position, x, value);
                        if up {
                            self.down = false;
                            if !self.polygon.is_open() {
                                self.tracer.finish();
                            }
                        } else {
                            self.lower();
                        }
                        self.go(to);
                        (up, absolute) = (false, false);
                    }
                },
            }
        }
        if x.is_some() {
            self.report(codes::ENCODED_DAMAGED, || "an x lacks its y and is left out".into());
        }
        self.relative = relative;
    }
}
