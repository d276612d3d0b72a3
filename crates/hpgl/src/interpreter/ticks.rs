//! Ticks: `TL XT YT`.

use drawing::{Line, Point, Segment, Vec2};

use super::Interpreter;

/// Tick lengths, percent of P2 - P1: towards larger coordinates, and towards smaller ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ticks {
    positive: f64,
    negative: f64,
}

impl Default for Ticks {
    fn default() -> Self {
        Self { positive: 0.5, negative: 0.5 }
    }
}

impl Interpreter {
    /// `TL`: with one length, ticks have no other side.
    pub(super) fn tick_length(&mut self, p: &[f64]) {
        self.ticks = match *p {
            [] => Ticks::default(),
            [positive] => Ticks { positive, negative: 0.0 },
            [positive, negative, ..] => Ticks { positive, negative },
        };
    }

    /// `XT`: a tick across the x axis.
    pub(super) fn x_tick(&mut self) {
        let (p1, p2) = self.frame.points();
        self.tick(Vec2::new(0.0, (p2.y - p1.y) / 100.0));
    }

    /// `YT`: a tick across the y axis.
    pub(super) fn y_tick(&mut self) {
        let (p1, p2) = self.frame.points();
        self.tick(Vec2::new((p2.x - p1.x) / 100.0, 0.0));
    }

    fn tick(&mut self, percent: Vec2) {
        if !self.leaves_polygons_alone() {
            return;
        }
        let at = |length: f64| -> Point { self.position + length * percent };
        let (from, to) = (at(-self.ticks.negative), at(self.ticks.positive));
        if !self.is_sane(from) || !self.is_sane(to) {
            return;
        }
        self.ink();
        let line = Line::new(self.frame.mm_of_plu(from), self.frame.mm_of_plu(to));
        let dashes = self.tracer.swap_dashes(None);
        self.tracer.outline(std::iter::once((Segment::Line(line), true)));
        self.tracer.swap_dashes(dashes);
    }
}
