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
    let mut keys: Vec<(SegmentKey, u32)> = Vec::new();
    for stroke in strokes {
        for segment in stroke.segments() {
            keys.push((segment_key(&segment), keys.len() as u32));
        }
    }
    keys.sort_unstable();
    // `number[i]` is the key number of segment `i`, `drawn[k]` the count of segments with key `k`.
    let mut number = vec![0; keys.len()];
    let mut drawn: Vec<u32> = Vec::new();
    for same in keys.chunk_by(|a, b| a.0 == b.0) {
        for &(_, at) in same {
            number[at as usize] = drawn.len();
        }
        drawn.push(same.len() as u32);
    }
    let dot = |p: Point| square(Point::new(p.x + 0.25e-6, p.y + 0.25e-6));
    let lines = strokes.iter().filter(|stroke| !stroke.is_dot());
    let mut inked: Vec<([i64; 2], usize)> =
        lines.flat_map(|stroke| stroke.points()).map(|vertex| (dot(vertex), 0)).collect();
    inked.extend(
        strokes.iter().enumerate().filter(|(_, s)| s.is_dot()).map(|(at, s)| (dot(s.start()), at + 1)),
    );
    inked.sort_unstable();

    let mut end = number.len();
    let mut keep = vec![true; strokes.len()];
    for (at, stroke) in strokes.iter().enumerate().rev() {
        if stroke.is_dot() {
            let first = inked.partition_point(|&(point, _)| point < dot(stroke.start()));
            keep[at] = inked[first].1 == at + 1;
            continue;
        }
        let own = &number[end - stroke.segment_count()..end];
        end -= own.len();
        for &key in own {
            drawn[key] -= 1;
        }
        keep[at] = own.iter().any(|&key| drawn[key] == 0);
        if keep[at] {
            for &key in own {
                drawn[key] += 1;
            }
        }
    }
    keep
}
