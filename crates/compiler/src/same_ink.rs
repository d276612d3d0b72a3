//! Equality of drawings as ink.

use std::collections::BTreeMap;

use drawing::{Drawing, Point, Segment};

/// Strokes between two reports of progress.
const PROGRESS_STROKES: usize = 4096;

/// Whether two drawings consist of the same pieces with the same pens, in any order and direction.
/// `progress` is called now and then with the number of strokes read, of both drawings.
pub(crate) fn same_ink(one: &Drawing, other: &Drawing, progress: &dyn Fn(usize)) -> bool {
    let pieces = pieces_of(one, progress);
    pieces == pieces_of(other, &|done| progress(one.strokes.len() + done))
}

/// A piece: its ends (the smaller first) and its middle, in nm. The middle distinguishes curves between the
/// same ends; reversing a curve may move it by a rounding error. A dot is a piece.
type Piece = [[i64; 2]; 3];

/// The pieces of one pen, each list sorted. A piece is in the first list if it can be [`packed`] and in the
/// second one otherwise, so that equal lists mean equal pieces.
#[derive(Debug, Default, PartialEq)]
struct Pieces {
    packed: Vec<u128>,
    others: Vec<Piece>,
}

/// A straight piece within ±2^30 nm (1 m) in 16 bytes instead of 48: four coordinates of its ends with 31
/// bits each, and for each coordinate of its middle 2 bits. Rounding puts the middle at most 1 nm from the
/// mean of the ends.
fn packed([a, b, middle]: Piece) -> Option<u128> {
    let limit = 1 << 30;
    let mut code = 0;
    for axis in 0..2 {
        let ends = [a[axis], b[axis]];
        for nm in ends {
            if !(-limit..limit).contains(&nm) {
                return None;
            }
            code = code << 31 | (nm + limit) as u128;
        }
        let beside = middle[axis].checked_sub((ends[0] + ends[1]).div_euclid(2))?;
        if !(-1..=2).contains(&beside) {
            return None;
        }
        code = code << 2 | (beside + 1) as u128;
    }
    // 2 (31 + 31 + 2) bits.
    Some(code)
}

/// The pieces of each pen. `progress` is called with the number of strokes read.
fn pieces_of(drawing: &Drawing, progress: &dyn Fn(usize)) -> BTreeMap<u16, Pieces> {
    let nanometres = |p: Point| [p.x, p.y].map(|mm| (mm * 1e6).round() as i64);
    let mut pens: BTreeMap<u16, Pieces> = BTreeMap::new();
    for (index, stroke) in drawing.strokes.iter().enumerate() {
        if index.is_multiple_of(PROGRESS_STROKES) {
            progress(index);
        }
        let pieces = pens.entry(stroke.pen.0).or_default();
        let mut add = |a: Point, b: Point, middle: Point| {
            let (a, b) = (nanometres(a), nanometres(b));
            let piece = [a.min(b), a.max(b), nanometres(middle)];
            match packed(piece) {
                Some(code) => pieces.packed.push(code),
                None => pieces.others.push(piece),
            }
        };
        if stroke.is_dot() {
            add(stroke.start(), stroke.start(), stroke.start());
        }
        for (ends, segment) in stroke.vertices().windows(2).zip(stroke.segments()) {
            if let Segment::Arc(arc) = segment
                && (arc.sweep_rad.abs() - std::f64::consts::TAU).abs() < 1e-9
            {
                // A full circle may begin at any of its points.
                add(arc.center + arc.a, arc.center - arc.a, arc.center + arc.b);
                continue;
            }
            add(ends[0], ends[1], segment.eval(0.5));
        }
    }
    for pieces in pens.values_mut() {
        pieces.packed.sort_unstable();
        pieces.others.sort_unstable();
    }
    pens
}

#[cfg(test)]
mod tests {
    use drawing::{EllipticArc, Pen, Span, Stroke};
    use proptest::prelude::*;

    use super::*;

    fn drawing(points: &[&[(f64, f64)]]) -> Drawing {
        let stroke = |points: &&[(f64, f64)]| {
            let points = points.iter().map(|&(x, y)| Point::new(x, y)).collect();
            Stroke::polyline(Pen(1), points, Span::default()).unwrap()
        };
        Drawing { strokes: points.iter().map(stroke).collect() }
    }

    /// The piece of a code of [`packed`].
    fn unpacked(code: u128) -> Piece {
        let axis = |code: u128| {
            let coordinate = |shift: u32| ((code >> shift) & ((1 << 31) - 1)) as i64 - (1 << 30);
            let [a, b] = [33, 2].map(coordinate);
            [a, b, (a + b).div_euclid(2) + (code & 3) as i64 - 1]
        };
        let [x, y] = [axis(code >> 64), axis(code)];
        [0, 1, 2].map(|k| [x[k], y[k]])
    }

    proptest! {
        #[test]
        fn packed_piece_is_restored(
            a in prop::array::uniform2(-1_100_000_000_i64..1_100_000_000),
            b in prop::array::uniform2(-1_100_000_000_i64..1_100_000_000),
            beside in prop::array::uniform2(-3_i64..4),
        ) {
            let middle = [0, 1].map(|axis| (a[axis] + b[axis]).div_euclid(2) + beside[axis]);
            let piece = [a, b, middle];
            let limit = 1 << 30;
            let fits = a.iter().chain(&b).all(|nm| (-limit..limit).contains(nm))
                && beside.iter().all(|nm| (-1..=2).contains(nm));
            prop_assert_eq!(packed(piece).map(unpacked), fits.then_some(piece));
        }

        #[test]
        fn lines_are_packed(ends in prop::array::uniform4(-1000.0..1000.0)) {
            let [a, b] = [Point::new(ends[0], ends[1]), Point::new(ends[2], ends[3])];
            let stroke = Stroke::polyline(Pen(1), vec![a, b], Span::default()).unwrap();
            let pieces = pieces_of(&Drawing::from(vec![stroke]), &|_| {});
            prop_assert_eq!((pieces[&1].packed.len(), pieces[&1].others.len()), (1, 0));
        }
    }

    #[test]
    fn same_ink_ignores_order_direction_and_joining() {
        let one = drawing(&[&[(0.0, 0.0), (1.0, 0.0)], &[(1.0, 0.0), (1.0, 2.0)], &[(5.0, 5.0)]]);
        let other = drawing(&[&[(5.0, 5.0)], &[(1.0, 2.0), (1.0, 0.0), (0.0, 0.0)]]);
        assert!(same_ink(&one, &other, &|_| {}));
    }

    #[test]
    fn same_ink_of_a_circle_with_another_start() {
        let circle = |radius: f64, start: f64| {
            let arc = EllipticArc::circular(Point::new(5.0, 5.0), radius, start, std::f64::consts::TAU);
            let mut stroke = Stroke::new(Pen(1), arc.eval(0.0), Span::default());
            stroke.arc(arc);
            Drawing::from(vec![stroke])
        };
        assert!(same_ink(&circle(2.0, 0.0), &circle(2.0, 1.0), &|_| {}));
        assert!(!same_ink(&circle(2.0, 0.0), &circle(2.1, 0.0), &|_| {}));
    }

    #[test]
    fn same_ink_notices_lost_moved_and_bent_pieces() {
        let one = drawing(&[&[(0.0, 0.0), (1.0, 0.0)], &[(5.0, 5.0)]]);
        assert!(!same_ink(&one, &drawing(&[&[(0.0, 0.0), (1.0, 0.0)]]), &|_| {}));
        assert!(!same_ink(&one, &drawing(&[&[(0.0, 0.0), (1.0, 1e-5)], &[(5.0, 5.0)]]), &|_| {}));
        let half = |sweep: f64| {
            let arc = EllipticArc::circular(Point::ZERO, 1.0, 0.0, sweep);
            let mut stroke = Stroke::new(Pen(1), Point::new(1.0, 0.0), Span::default());
            stroke.arc(arc);
            Drawing::from(vec![stroke])
        };
        assert!(!same_ink(&half(std::f64::consts::PI), &half(-std::f64::consts::PI), &|_| {}));
        let mut turned = half(2.0);
        turned.strokes.update(Stroke::reverse);
        assert!(same_ink(&half(2.0), &turned, &|_| {}));
    }
}
