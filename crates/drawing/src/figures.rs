//! The figures of a drawing in one pass over its strokes.

use std::collections::BTreeMap;

use kurbo::Rect;

use crate::{Drawing, Pen};

/// Counts, lengths and bounds of a drawing. Strokes are made when they are asked for, so that each pass
/// over them has a cost, which [`Drawing::figures`] pays once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figures {
    /// The bounding box of all strokes, mm; `None` without strokes. See [`Drawing::bounding_box`].
    pub bounds: Option<Rect>,
    /// The length of all strokes, mm, to the bit that of [`Drawing::length`].
    pub length_mm: f64,
    /// Number of dots.
    pub dots: usize,
    /// For each pen the number of its strokes and their length, mm.
    pub pens: BTreeMap<Pen, (usize, f64)>,
}

impl Drawing {
    /// All of its figures at once.
    pub fn figures(&self) -> Figures {
        let mut figures = Figures::default();
        for stroke in &self.strokes {
            let bounds = stroke.bounding_box();
            figures.bounds = Some(figures.bounds.map_or(bounds, |all| all.union(bounds)));
            let length = stroke.length();
            figures.length_mm += length;
            figures.dots += usize::from(stroke.is_dot());
            let (count, of_pen) = figures.pens.entry(stroke.pen).or_default();
            *count += 1;
            *of_pen += length;
        }
        figures
    }
}

#[cfg(test)]
mod tests {
    use kurbo::Point;
    use proptest::prelude::*;

    use super::*;
    use crate::{Span, Stroke};

    proptest! {
        #[test]
        fn figures_are_those_of_single_passes(
            strokes in prop::collection::vec(
                (0..3_u16, prop::collection::vec((-99.0..99.0, -99.0..99.0), 1..5)), 0..12)
        ) {
            let strokes = strokes.into_iter().filter_map(|(pen, points)| {
                Stroke::polyline(Pen(pen), points.into_iter().map(Point::from).collect(), Span::default())
            });
            let drawing = Drawing { strokes: strokes.collect() };
            let figures = drawing.figures();
            prop_assert_eq!(figures.bounds, drawing.bounding_box());
            prop_assert_eq!(figures.length_mm.to_bits(), drawing.length().to_bits());
            prop_assert_eq!(figures.dots, drawing.strokes.iter().filter(Stroke::is_dot).count());
            prop_assert_eq!(figures.pens.keys().copied().collect::<Vec<_>>(), drawing.pens());
            for (pen, of_pen) in figures.pens {
                let mine = drawing.strokes.iter().filter(|stroke| stroke.pen == pen);
                let expected = mine.fold((0, 0.0), |(n, l), stroke| (n + 1, l + stroke.length()));
                prop_assert_eq!(of_pen, expected);
            }
        }
    }
}
