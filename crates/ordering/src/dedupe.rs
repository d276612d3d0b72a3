//! Removal of duplicate strokes.

use drawing::{Drawing, Point, Segment, Stroke};

use crate::touch::square;

/// Key of a segment, equal in both directions: the grid squares of its points at t = 0, 1/4, 3/4,
/// 1.
type SegmentKey = [[i64; 2]; 4];

fn segment_key(segment: &Segment) -> SegmentKey {
    // Offset by half a square, so that round coordinates are far from the edge of a square.
    let at = |t| {
        let p = segment.eval(t);
        square(Point::new(p.x + 0.25e-6, p.y + 0.25e-6))
    };
    let forward = [at(0.0), at(0.25), at(0.75), at(1.0)];
    let mut backward = forward;
    backward.reverse();
    forward.min(backward)
}

/// Removes each stroke whose segments are all drawn by other strokes of its pen, starting with the
/// last stroke. Order and direction stay.
#[must_use]
pub fn without_duplicates(drawing: Drawing) -> Drawing {
    let pens = drawing.pens();
    let all: Vec<Stroke> = drawing.strokes.into_iter().collect();
    let mut keep = vec![true; all.len()];
    for pen in pens {
        let mine: Vec<usize> = (0..keep.len()).filter(|&at| all[at].pen == pen).collect();
        let strokes: Vec<&Stroke> = mine.iter().map(|&at| &all[at]).collect();
        for (at, keeps) in mine.into_iter().zip(kept(&strokes)) {
            keep[at] = keeps;
        }
    }
    let strokes = all.into_iter().zip(keep).filter_map(|(stroke, keep)| keep.then_some(stroke));
    Drawing { strokes: strokes.collect() }
}

/// Removes the duplicates among strokes of one pen.
pub(crate) fn dedupe(strokes: Vec<Stroke>) -> Vec<Stroke> {
    let keep = kept(&strokes.iter().collect::<Vec<_>>());
    strokes.into_iter().zip(keep).filter_map(|(stroke, keep)| keep.then_some(stroke)).collect()
}

/// For each stroke (all of one pen) whether it stays: not if all of its segments are drawn by other
/// strokes. A dot on a vertex of a stroke, or on another dot, is a duplicate too.
fn kept(strokes: &[&Stroke]) -> Vec<bool> {
    let (number, mut drawn) = repeated(strokes);
    let mut keep = vec![true; strokes.len()];
    let mut end = number.len();
    for (at, stroke) in strokes.iter().enumerate().rev().filter(|(_, stroke)| !stroke.is_dot()) {
        let own = &number[end - stroke.segment_count()..end];
        end -= own.len();
        let repeated = || own.iter().filter(|&&number| number != ONCE).map(|&number| number as usize);
        repeated().for_each(|number| drawn[number] -= 1);
        keep[at] = own.contains(&ONCE) || repeated().any(|number| drawn[number] == 0);
        if keep[at] {
            repeated().for_each(|number| drawn[number] += 1);
        }
    }
    drop_dots(strokes, &mut keep);
    keep
}

/// The number of a segment that is drawn once.
const ONCE: u32 = u32::MAX;

/// For every segment a number that equal segments share, or [`ONCE`]; for each number how often the segment
/// is drawn.
///
/// Most segments are drawn once. Hashes find them in 8 bytes a segment; keys, of 64 bytes, are compared
/// among the others only.
fn repeated(strokes: &[&Stroke]) -> (Vec<u32>, Vec<u32>) {
    let segments = || strokes.iter().flat_map(|stroke| stroke.segments());
    // The hash above the index.
    let mut hashes: Vec<u64> = Vec::with_capacity(strokes.iter().map(|stroke| stroke.segment_count()).sum());
    for segment in segments() {
        hashes.push(u64::from(hash(&segment_key(&segment))) << 32 | hashes.len() as u64);
    }
    hashes.sort_unstable();
    let mut number = vec![ONCE; hashes.len()];
    for same in hashes.chunk_by(|a, b| a >> 32 == b >> 32).filter(|same| same.len() > 1) {
        for item in same {
            number[*item as u32 as usize] = 0;
        }
    }
    drop(hashes);
    let mut keys: Vec<(SegmentKey, u32)> = segments()
        .zip(0..)
        .filter(|(_, index)| number[*index as usize] != ONCE)
        .map(|(segment, index)| (segment_key(&segment), index))
        .collect();
    keys.sort_unstable();
    let mut drawn = Vec::new();
    for same in keys.chunk_by(|a, b| a.0 == b.0) {
        let shared = if same.len() > 1 { drawn.len() as u32 } else { ONCE };
        for (_, index) in same {
            number[*index as usize] = shared;
        }
        if same.len() > 1 {
            drawn.push(same.len() as u32);
        }
    }
    (number, drawn)
}

/// A hash of a key; equal hashes are compared by key, so that its quality matters for speed only.
fn hash(key: &SegmentKey) -> u32 {
    // Multiplication by the golden ratio times 2^64 (Knuth, The Art of Computer Programming 3, 6.4).
    let mix =
        |sum: u64, number: &i64| (sum.rotate_left(23) ^ *number as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (key.iter().flatten().fold(0, mix) >> 32) as u32
}

/// Drops dots on a vertex of another stroke, and all but the first dot at a point.
fn drop_dots(strokes: &[&Stroke], keep: &mut [bool]) {
    let dot = |p: Point| square(Point::new(p.x + 0.25e-6, p.y + 0.25e-6));
    let mut dots: Vec<([i64; 2], usize)> = (0..strokes.len())
        .filter(|&at| strokes[at].is_dot())
        .map(|at| (dot(strokes[at].start()), at))
        .collect();
    dots.sort_unstable();
    let mut inked = vec![false; dots.len()];
    for vertex in
        strokes.iter().filter(|stroke| !stroke.is_dot() && !dots.is_empty()).flat_map(|s| s.points())
    {
        let vertex = dot(vertex);
        let first = dots.partition_point(|&(point, _)| point < vertex);
        if dots.get(first).is_some_and(|&(point, _)| point == vertex) {
            inked[first] = true;
        }
    }
    let mut first = 0;
    for same in dots.chunk_by(|a, b| a.0 == b.0) {
        for (nth, &(_, at)) in same.iter().enumerate() {
            keep[at] = nth == 0 && !inked[first];
        }
        first += same.len();
    }
}

#[cfg(test)]
mod tests {
    use drawing::{EllipticArc, Pen, Span};
    use proptest::prelude::*;

    use super::*;

    /// The same by definition: one stroke after the other, from the last one, against all others left.
    fn kept_by_comparison(strokes: &[&Stroke]) -> Vec<bool> {
        let key = |stroke: &Stroke| -> Vec<SegmentKey> {
            stroke.segments().map(|segment| segment_key(&segment)).collect()
        };
        let dot = |p: Point| square(Point::new(p.x + 0.25e-6, p.y + 0.25e-6));
        let mut keep = vec![true; strokes.len()];
        for at in (0..strokes.len()).rev() {
            let others = (0..strokes.len()).filter(|&other| other != at);
            keep[at] = if strokes[at].is_dot() {
                let mine = dot(strokes[at].start());
                !others.clone().any(|other| {
                    if strokes[other].is_dot() {
                        other < at && dot(strokes[other].start()) == mine
                    } else {
                        strokes[other].points().any(|vertex| dot(vertex) == mine)
                    }
                })
            } else {
                let drawn: Vec<SegmentKey> =
                    others.filter(|&other| keep[other]).flat_map(|other| key(strokes[other])).collect();
                key(strokes[at]).iter().any(|segment| !drawn.contains(segment))
            };
        }
        keep
    }

    proptest! {
        #[test]
        fn kept_strokes_are_those_found_by_comparison(
            corners in prop::collection::vec(prop::collection::vec((0..3_u8, 0..3_u8, any::<bool>()), 1..5), 1..14)
        ) {
            let strokes: Vec<Stroke> = corners
                .iter()
                .map(|corners| {
                    let point = |x: u8, y: u8| Point::new(f64::from(x), f64::from(y));
                    let mut stroke = Stroke::new(Pen(1), point(corners[0].0, corners[0].1), Span::default());
                    for &(x, y, curved) in &corners[1..] {
                        if curved {
                            let arc = EllipticArc::circular(stroke.end(), 1.0, 0.0, f64::from(x) - 1.5);
                            stroke.arc(arc);
                        } else {
                            stroke.line_to(point(x, y));
                        }
                    }
                    stroke
                })
                .collect();
            let strokes: Vec<&Stroke> = strokes.iter().collect();
            prop_assert_eq!(kept(&strokes), kept_by_comparison(&strokes));
        }
    }

    #[test]
    fn equal_hashes_do_not_make_segments_equal() {
        // Two keys with one hash are found within 2^18 segments (birthday).
        let line = |k: u32| {
            let ends = vec![Point::ZERO, Point::new(f64::from(k), 1.0)];
            Stroke::polyline(Pen(1), ends, Span::default()).expect("two points")
        };
        let strokes: Vec<Stroke> = (0..1 << 18).map(line).collect();
        let mut hashes: Vec<u32> =
            strokes.iter().flat_map(|stroke| stroke.segments().map(|s| hash(&segment_key(&s)))).collect();
        hashes.sort_unstable();
        assert!(hashes.windows(2).any(|pair| pair[0] == pair[1]));
        assert!(kept(&strokes.iter().collect::<Vec<_>>()).into_iter().all(|keep| keep));
    }
}
