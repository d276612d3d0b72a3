//! Merging of strokes that touch at their ends.
//!
//! Ends that meet at a point are paired, and paired ends are joined. Pairing as many ends as
//! possible at every point leaves one trail for every two points at which an odd number of ends
//! meet (the minimum), and closed circuits. A circuit that touches another trail is spliced into it
//! (Euler 1736, Hierholzer 1873). Where more than two ends meet, the straightest pair is joined
//! first, because machines are fastest on straight lines.

use drawing::{Point, Stroke, Vec2};

use crate::touch::{Sets, same_points};

/// End `2s` is where stroke `s` starts, end `2s + 1` where it ends.
type End = usize;

/// Above this number of ends at a point they are paired in index order: the number of pairs to
/// compare grows with the square.
const MOST_COMPARED: usize = 64;

/// Joins touching strokes (all of one pen) into the fewest possible strokes. Dots are not joined.
///
/// A joined stroke takes the position, direction and source of its first stroke. With
/// `keep_direction`, ends are joined to starts only.
pub(crate) fn merge(strokes: Vec<Stroke>, keep_direction: bool) -> Vec<Stroke> {
    let partner = pair_ends(&strokes, keep_direction);
    let mut strokes: Vec<Option<Stroke>> = strokes.into_iter().map(Some).collect();
    let mut merged = Vec::new();
    for first in 0..strokes.len() {
        let Some(source) = strokes[first].as_ref().map(Stroke::source) else { continue };
        // Follow the trail back to its beginning, or around a circuit to this stroke.
        let mut entry = 2 * first;
        while let Some(before) = partner[entry] {
            entry = before ^ 1;
            if entry == 2 * first {
                break;
            }
        }
        let mut trail: Option<Stroke> = None;
        let mut next = Some(entry);
        while let Some(entry) = next {
            let Some(mut stroke) = strokes[entry / 2].take() else { break };
            if entry % 2 == 1 {
                stroke.reverse();
            }
            match &mut trail {
                None => trail = Some(stroke),
                Some(trail) => stroke.segments().for_each(|segment| trail.push(segment)),
            }
            next = partner[entry ^ 1];
        }
        if let Some(mut trail) = trail {
            trail.set_source(source);
            merged.push(trail);
        }
    }
    merged
}

/// For each end the end that it is joined to.
fn pair_ends(strokes: &[Stroke], keep_direction: bool) -> Vec<Option<End>> {
    let points: Vec<Point> = strokes.iter().flat_map(|stroke| [stroke.start(), stroke.end()]).collect();
    let node = same_points(&points);
    let mut ends: Vec<End> = (0..points.len()).filter(|&end| !strokes[end / 2].is_dot()).collect();
    ends.sort_by_key(|&end| node[end]);
    let mut partner = vec![None; points.len()];
    for meeting in ends.chunk_by(|&a, &b| node[a] == node[b]) {
        for (a, b) in straightest_pairs(strokes, meeting, keep_direction) {
            (partner[a], partner[b]) = (Some(b), Some(a));
        }
    }
    let mut circuits = Circuits::new(&partner);
    for meeting in ends.chunk_by(|&a, &b| node[a] == node[b]) {
        circuits.splice(meeting, &mut partner);
    }
    partner
}

/// The largest set of disjoint pairs of ends; with `keep_direction`, pairs of an end and a start.
fn straightest_pairs(strokes: &[Stroke], meeting: &[End], keep_direction: bool) -> Vec<(End, End)> {
    let mut left = meeting.to_vec();
    let mut pairs = Vec::with_capacity(meeting.len() / 2);
    if meeting.len() > 2 && meeting.len() <= MOST_COMPARED {
        let away: Vec<Vec2> = meeting.iter().map(|&end| direction(&strokes[end / 2], end % 2 == 1)).collect();
        let mut turns = Vec::new();
        for (i, &a) in meeting.iter().enumerate() {
            for (j, &b) in meeting.iter().enumerate().skip(i + 1) {
                if a / 2 != b / 2 && (!keep_direction || a % 2 != b % 2) {
                    turns.push((away[i].dot(away[j]), a, b));
                }
            }
        }
        turns.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for (_, a, b) in turns {
            if left.contains(&a) && left.contains(&b) {
                left.retain(|&end| end != a && end != b);
                pairs.push((a, b));
            }
        }
    }
    if keep_direction {
        let (arriving, leaving): (Vec<End>, Vec<End>) = left.into_iter().partition(|end| end % 2 == 1);
        pairs.extend(arriving.into_iter().zip(leaving));
    } else {
        pairs.extend(left.chunks_exact(2).map(|pair| (pair[0], pair[1])));
    }
    pairs
}

/// The unit vector from the start (or end) of a stroke into the stroke; 0 if it has no length.
fn direction(stroke: &Stroke, from_end: bool) -> Vec2 {
    // A point near the end, so that it works for curves too.
    let segment = if from_end { stroke.segments().last() } else { stroke.segments().next() };
    let Some(segment) = segment else { return Vec2::ZERO };
    let away =
        if from_end { segment.eval(0.99) - segment.end() } else { segment.eval(0.01) - segment.start() };
    let length = away.hypot2().sqrt();
    if length > 0.0 { away / length } else { Vec2::ZERO }
}

/// Connected sets of joined strokes, and which of them are closed circuits.
struct Circuits {
    sets: Sets,
    /// For the lowest stroke of each set: whether the set is a circuit.
    closed: Vec<bool>,
}

impl Circuits {
    fn new(partner: &[Option<End>]) -> Self {
        let count = partner.len() / 2;
        let mut sets = Sets::new(count);
        for (end, other) in partner.iter().enumerate() {
            if let Some(other) = other {
                sets.join(end as u32 / 2, *other as u32 / 2);
            }
        }
        let mut closed = vec![true; count];
        for (end, other) in partner.iter().enumerate() {
            if other.is_none() {
                closed[sets.find(end as u32 / 2) as usize] = false;
            }
        }
        Self { sets, closed }
    }

    /// Unites two sets if at least one of them is a circuit; returns whether it did.
    fn join(&mut self, a: End, b: End) -> bool {
        let (a, b) = (self.sets.find(a as u32 / 2), self.sets.find(b as u32 / 2));
        let (a_closed, b_closed) = (self.closed[a as usize], self.closed[b as usize]);
        if a == b || !(a_closed || b_closed) {
            return false;
        }
        self.sets.join(a, b);
        self.closed[a.min(b) as usize] = a_closed && b_closed;
        true
    }

    /// Splices the circuits through a point into the first trail through it, by exchanging
    /// partners.
    fn splice(&mut self, meeting: &[End], partner: &mut [Option<End>]) {
        let Some(&anchor) = meeting.first() else { return };
        for &end in meeting {
            if !self.join(anchor, end) {
                continue;
            }
            match (partner[anchor], partner[end]) {
                (Some(a), Some(b)) if anchor % 2 == end % 2 => exchange(partner, (anchor, a), (b, end)),
                (Some(a), Some(b)) => exchange(partner, (anchor, a), (end, b)),
                // A trail begins or ends here: it is extended by the circuit. A start is joined to
                // an end, in case directions must be kept.
                (None, Some(b)) => extend(partner, anchor, end, b),
                (Some(a), None) => extend(partner, end, anchor, a),
                (None, None) => {}
            }
        }
    }
}

/// Replaces the pairs `a` and `b` by `(a.0, b.0)` and `(a.1, b.1)`.
fn exchange(partner: &mut [Option<End>], a: (End, End), b: (End, End)) {
    (partner[a.0], partner[b.0]) = (Some(b.0), Some(a.0));
    (partner[a.1], partner[b.1]) = (Some(b.1), Some(a.1));
}

/// Separates the pair `(a, b)`, joins the one of the other kind (start or end) to `open`, and
/// leaves the other one open.
fn extend(partner: &mut [Option<End>], open: End, a: End, b: End) {
    let (join, leave) = if a % 2 == open % 2 { (b, a) } else { (a, b) };
    (partner[open], partner[join]) = (Some(join), Some(open));
    partner[leave] = None;
}
