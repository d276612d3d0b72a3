//! Line types: `LT UL`. A pattern of strokes and gaps along the path.

use drawing::{Line, Point, Segment};

use super::Interpreter;
use crate::codes;

/// The fixed patterns 1 to 8: stroke and gap in turn, as parts of the pattern's length.
const FIXED: [&[f64]; 8] = [
    &[0.0, 1.0],
    &[0.5, 0.5],
    &[0.7, 0.3],
    &[0.8, 0.1, 0.0, 0.1],
    &[0.7, 0.1, 0.1, 0.1],
    &[0.5, 0.1, 0.1, 0.1, 0.1, 0.1],
    &[0.7, 0.1, 0.0, 0.1, 0.0, 0.1],
    &[0.5, 0.1, 0.0, 0.1, 0.1, 0.1, 0.0, 0.1],
];

/// The adaptive patterns -1 to -8, which begin and end with the same half.
const ADAPTIVE: [&[f64]; 8] = [
    &[0.0, 1.0, 0.0],
    &[0.25, 0.5, 0.25],
    &[0.35, 0.3, 0.35],
    &[0.4, 0.1, 0.0, 0.1, 0.4],
    &[0.35, 0.1, 0.1, 0.1, 0.35],
    &[0.25, 0.1, 0.1, 0.1, 0.1, 0.1, 0.25],
    &[0.35, 0.1, 0.0, 0.1, 0.0, 0.1, 0.35],
    &[0.25, 0.1, 0.0, 0.1, 0.1, 0.1, 0.0, 0.1, 0.25],
];

/// How far chords may leave curves that dashes are measured along, mm.
const FLATTENING: f64 = 0.005;
/// Remainders of a pattern below this (mm) are rounding.
const NOTHING: f64 = 1e-9;

/// What a line type does to lines.
#[derive(Clone, Debug, PartialEq)]
enum Kind {
    /// Only the ends of each piece, as dots.
    Ends,
    /// The pattern continues over corners.
    Fixed,
    /// Every piece has a whole number of patterns.
    Adaptive,
}

/// A pattern at work, with how far it has come.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Dashes {
    kind: Kind,
    /// Strokes and gaps in turn, mm; all together positive.
    lengths: Vec<f64>,
    /// The stroke or gap at work, and what is left of it.
    index: usize,
    left: f64,
}

/// A piece of ink.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Dash {
    Piece(Segment),
    Dot(Point),
}

impl Dashes {
    fn new(kind: Kind, parts: &[f64], length_mm: f64) -> Self {
        let lengths: Vec<f64> = parts.iter().map(|part| part * length_mm).collect();
        let left = lengths.first().copied().unwrap_or(0.0);
        Self { kind, lengths, index: 0, left }
    }

    /// From the pattern's beginning.
    pub(crate) fn restarted(&self) -> Self {
        Self { index: 0, left: self.lengths.first().copied().unwrap_or(0.0), ..self.clone() }
    }

    /// How many pieces of ink a path of that length (mm) comes to, at the most.
    pub(crate) fn pieces_along(&self, length: f64) -> f64 {
        if self.kind == Kind::Ends {
            return 2.0;
        }
        let pattern: f64 = self.lengths.iter().sum();
        (length / pattern + 1.0) * self.lengths.len() as f64
    }

    /// Cuts a piece of a path into ink.
    pub(crate) fn cut(&mut self, segment: &Segment, mut ink: impl FnMut(Dash)) {
        if self.kind == Kind::Ends {
            ink(Dash::Dot(segment.start()));
            ink(Dash::Dot(segment.end()));
            return;
        }
        // Along lines and circular arcs length is in proportion to the parameter; other curves are
        // taken as chords.
        let uniform = match segment {
            Segment::Line(_) => true,
            Segment::Arc(arc) => arc.circle_radius().is_some(),
            Segment::Cubic(_) => false,
        };
        let mut pieces = Vec::new();
        if uniform {
            pieces.push(*segment);
        } else {
            let mut from = segment.start();
            segment.flatten(FLATTENING, |to| {
                pieces.push(Segment::Line(Line::new(from, to)));
                from = to;
            });
        }
        let mut stretch = 1.0;
        if self.kind == Kind::Adaptive {
            *self = self.restarted();
            let total: f64 = pieces.iter().map(Segment::length).sum();
            let pattern: f64 = self.lengths.iter().sum();
            stretch = total / (pattern * (total / pattern).round().max(1.0));
        }
        for piece in &pieces {
            self.cut_uniform(piece, stretch, &mut ink);
        }
    }

    fn cut_uniform(&mut self, segment: &Segment, stretch: f64, ink: &mut impl FnMut(Dash)) {
        let length = segment.length();
        let mut at = 0.0;
        while length - at > NOTHING {
            let left = self.left * stretch;
            let step = left.min(length - at);
            if self.index.is_multiple_of(2) {
                if self.left == 0.0 {
                    ink(Dash::Dot(segment.eval(at / length)));
                } else if step > NOTHING {
                    let whole = at == 0.0 && step == length;
                    ink(Dash::Piece(if whole {
                        *segment
                    } else {
                        segment.part(at / length, (at + step) / length)
                    }));
                }
            }
            at += step;
            self.left -= step / stretch;
            if self.left <= NOTHING {
                self.index = (self.index + 1) % self.lengths.len();
                self.left = self.lengths[self.index];
            }
        }
    }
}

/// The line type that is set, and what would set it again.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LineType {
    /// -8 to 8; nothing for solid lines.
    number: Option<i8>,
    /// What `LT99` brings back, and where the pen was when it was set aside.
    previous: Option<(Option<i8>, Point)>,
    /// Pattern length: percent of the diagonal between P1 and P2, or mm.
    length: Option<f64>,
    in_mm: bool,
    /// Patterns that `UL` defined, from 1.
    user: [Option<Vec<f64>>; 8],
}

/// Pattern length where none is given, percent of the diagonal between P1 and P2.
const DEFAULT_LENGTH: f64 = 4.0;

impl Interpreter {
    /// `LT`: without a number solid lines; else the pattern, its length, and what that is measured
    /// in.
    pub(super) fn line_type(&mut self, p: &[f64]) {
        let line_type = &mut self.line_type;
        match *p {
            [] => {
                line_type.previous = Some((line_type.number, self.position));
                line_type.number = None;
            }
            [99.0, ..] => {
                if let Some((number, position)) = line_type.previous
                    && position == self.position
                {
                    line_type.number = number;
                }
            }
            [number, ref rest @ ..] if (-8.0..=8.0).contains(&number.trunc()) => {
                line_type.number = Some(number.trunc() as i8);
                if let Some(&length) = rest.first() {
                    if length > 0.0 {
                        line_type.length = Some(length);
                    }
                    line_type.in_mm = rest.get(1) == Some(&1.0);
                }
            }
            _ => {
                self.bad_parameters("a line type from -8 to 8");
                return;
            }
        }
        self.apply_line_type();
    }

    /// `UL`: a pattern of the user's. Without gaps the usual pattern, without anything all usual
    /// ones.
    pub(super) fn user_line_type(&mut self, p: &[f64]) {
        match *p {
            [] => self.line_type.user = Default::default(),
            [index, ref gaps @ ..] if (1.0..9.0).contains(&index.abs()) => {
                let total: f64 = gaps.iter().sum();
                let slot = &mut self.line_type.user[index.abs() as usize - 1];
                if gaps.is_empty() {
                    *slot = None;
                } else if gaps.len() > 20 || gaps.iter().any(|&gap| gap < 0.0) || total <= 0.0 {
                    self.bad_parameters("a line type from 1 to 8 and at most 20 lengths");
                    return;
                } else {
                    let mut parts: Vec<f64> = gaps.iter().map(|gap| gap / total).collect();
                    if parts.len() % 2 == 1 {
                        // Stroke and gap change places each time round otherwise; as written, the
                        // last meets the first.
                        parts.push(0.0);
                    }
                    *slot = Some(parts);
                }
            }
            _ => {
                self.bad_parameters("a line type from 1 to 8 and at most 20 lengths");
                return;
            }
        }
        self.apply_line_type();
    }

    /// Puts the line type to work, from its pattern's beginning.
    pub(super) fn apply_line_type(&mut self) {
        let dashes = self.line_type.number.and_then(|number| {
            if number == 0 {
                return Some(Dashes::new(Kind::Ends, &[0.0], 1.0));
            }
            let (p1, p2) = self.frame.points();
            let diagonal_mm = (p2 - p1).hypot2().sqrt() * self.frame.unit_mm();
            let length = self.line_type.length.unwrap_or(DEFAULT_LENGTH);
            let length_mm = if self.line_type.in_mm { length } else { diagonal_mm * length / 100.0 };
            let index = usize::from(number.unsigned_abs()) - 1;
            let user = self.line_type.user[index].as_deref();
            let (kind, usual) =
                if number > 0 { (Kind::Fixed, FIXED[index]) } else { (Kind::Adaptive, ADAPTIVE[index]) };
            (length_mm > 0.0).then(|| Dashes::new(kind, user.unwrap_or(usual), length_mm))
        });
        self.tracer.set_dashes(dashes);
    }

    /// Reports lines that are drawn solid because their pattern has too many dashes.
    pub(super) fn report_given_up_dashes(&mut self) {
        if self.tracer.take_given_up() {
            self.report(codes::TOO_MANY_PIECES, || {
                "the line pattern is too fine for lines of this length: they are drawn solid".into()
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strokes(dashes: &mut Dashes, from: f64, to: f64) -> Vec<(f64, f64)> {
        let mut found = Vec::new();
        dashes.cut(&Segment::Line(Line::new((from, 0.0), (to, 0.0))), |dash| match dash {
            Dash::Piece(piece) => found.push((piece.start().x, piece.end().x)),
            Dash::Dot(at) => found.push((at.x, at.x)),
        });
        found
    }

    #[test]
    fn pattern_continues_over_corners() {
        let mut dashes = Dashes::new(Kind::Fixed, FIXED[1], 4.0);
        assert_eq!(strokes(&mut dashes, 0.0, 5.0), [(0.0, 2.0), (4.0, 5.0)]);
        assert_eq!(strokes(&mut dashes, 5.0, 9.0), [(5.0, 6.0), (8.0, 9.0)]);
    }

    #[test]
    fn adaptive_pattern_lengths() {
        let mut dashes = Dashes::new(Kind::Adaptive, ADAPTIVE[1], 4.0);
        assert_eq!(strokes(&mut dashes, 0.0, 9.0), [(0.0, 1.125), (3.375, 4.5), (4.5, 5.625), (7.875, 9.0)]);
    }

    #[test]
    fn dots_in_patterns() {
        let mut dashes = Dashes::new(Kind::Fixed, FIXED[0], 2.0);
        assert_eq!(strokes(&mut dashes, 0.0, 5.0), [(0.0, 0.0), (2.0, 2.0), (4.0, 4.0)]);
    }
}
