//! Strokes that touch at their ends become one.
//!
//! Where ends of strokes meet, they are paired; what is paired is drawn in one go. Pairing as many ends as possible at
//! every point leaves one trail for every two points at which an odd number of ends meet, which is the fewest there
//! can be, and closed circuits; a circuit that meets anything else is let into it (Euler 1736, Hierholzer 1873). Which
//! ends are paired where more than two meet is free: the straightest first, because a machine is fastest straight on.

use drawing::{Point, Stroke, Vec2};

use crate::touch::{Sets, same_points};

/// End `2s` is where stroke `s` starts, end `2s + 1` where it ends.
type End = usize;

/// Above this many ends at a point they are paired as they come: all pairs would be too many to compare.
const MOST_COMPARED: usize = 64;

/// Joins strokes that touch, all of one pen, into the fewest possible. Dots stay for themselves.
///
/// A joined stroke stands where the first of its strokes stood, is drawn in that stroke's direction, and has its
/// source. With `keep_direction`, ends are joined to starts only.
pub(crate) fn merge(strokes: Vec<Stroke>, keep_direction: bool) -> Vec<Stroke> {
    let partner = pair_ends(&strokes, keep_direction);
    let mut strokes: Vec<Option<Stroke>> = strokes.into_iter().map(Some).collect();
    let mut merged = Vec::new();
    for first in 0..strokes.len() {
        let Some(source) = strokes[first].as_ref().map(Stroke::source) else { continue };
        // Back to where the trail begins, or around to where we are.
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

/// The end that each end is joined to.
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

/// As many disjoint pairs of ends as there are; with `keep_direction`, of an end and a start.
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

/// The unit vector from a stroke's start, or its end, into the stroke; 0 if it does not go anywhere.
fn direction(stroke: &Stroke, from_end: bool) -> Vec2 {
    // The end of the first piece would do for lines; a point early on it does for curves too.
    let piece = if from_end { stroke.segments().last() } else { stroke.segments().next() };
    let Some(piece) = piece else { return Vec2::ZERO };
    let away = if from_end { piece.eval(0.99) - piece.end() } else { piece.eval(0.01) - piece.start() };
    let length = away.hypot2().sqrt();
    if length > 0.0 { away / length } else { Vec2::ZERO }
}

/// Which strokes hang together, and what of it has no ends.
struct Circuits {
    sets: Sets,
    /// For the lowest stroke of each set: whether the set is a closed circuit.
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

    /// Makes one of two sets of which one is a circuit; whether they are such.
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

    /// Lets circuits through a point into the first of what else goes through it, by changing partners there.
    fn splice(&mut self, meeting: &[End], partner: &mut [Option<End>]) {
        let Some(&anchor) = meeting.first() else { return };
        for &end in meeting {
            if !self.join(anchor, end) {
                continue;
            }
            match (partner[anchor], partner[end]) {
                (Some(a), Some(b)) if anchor % 2 == end % 2 => exchange(partner, (anchor, a), (b, end)),
                (Some(a), Some(b)) => exchange(partner, (anchor, a), (end, b)),
                // A trail begins or ends here: it goes on around the circuit first. What it is joined to must be
                // of the other kind, a start to an end, in case directions count.
                (None, Some(b)) => extend(partner, anchor, end, b),
                (Some(a), None) => extend(partner, end, anchor, a),
                (None, None) => {}
            }
        }
    }
}

/// Instead of `a.0` with `a.1` and `b.0` with `b.1`, joins `a.0` with `b.0` and `a.1` with `b.1`.
fn exchange(partner: &mut [Option<End>], a: (End, End), b: (End, End)) {
    (partner[a.0], partner[b.0]) = (Some(b.0), Some(a.0));
    (partner[a.1], partner[b.1]) = (Some(b.1), Some(a.1));
}

/// Joins the open end to that of `a` and `b`, which were joined, that is of the other kind; the other one stays open.
fn extend(partner: &mut [Option<End>], open: End, a: End, b: End) {
    let (join, leave) = if a % 2 == open % 2 { (b, a) } else { (a, b) };
    (partner[open], partner[join]) = (Some(join), Some(open));
    partner[leave] = None;
}
