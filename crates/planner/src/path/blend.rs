//! Corners as parabolas.
//!
//! At a corner the direction changes from the unit vector `u` to `v`. A parabola (quadratic Bézier curve) with legs of
//! the length `l` on both sides of the vertex P joins them tangentially:
//!
//! ```text
//!  P - l u  ------>  P          p(t) = P + l (-(1-t)² u + t² v),   p'(t) = 2 l ((1-t) u + t v),   p'' = 2 l (v - u)
//!            \.      |
//!              '.    |          its point nearest to P is in the middle: distance d = l |v - u| / 4
//!                 \  v
//!                   P + l v
//! ```
//! With t even in time the acceleration is constant, so where only acceleration is limited a parabola is driven with
//! the same motor at its limit from end to end: at the end speed c it is `c² |v - u| / (2 l)`, so for a given deviation
//! `c² = 8 d a / |v - u|²`. A circular arc of the same deviation allows `a d / (1 / cos(theta/2) - 1)`: the same for
//! small turns, 1.66 times less at a right angle. The vertex is missed by d and the blend strays by less.

use drawing::{CubicBez, Line, Point, Segment, Vec2};

use super::{direction_at, distance, is_smooth};

/// Directions that differ by more than this (cosine) turn back: 175 degrees.
const TURNS_BACK: f64 = -0.9962;

/// Blends shorter than this are not worth a piece, mm.
const SHORTEST: f64 = 1e-6;

/// End speed squared, mm²/s², of a blend that deviates by `deviation` mm at a corner between the unit vectors `u` and `v`
/// under a Cartesian acceleration of `acceleration` mm/s².
pub fn corner_speed_squared(u: Vec2, v: Vec2, deviation: f64, acceleration: f64) -> f64 {
    8.0 * deviation * acceleration / (v - u).hypot2()
}

/// The joint after each piece but the last.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Joint {
    /// The tangent goes on.
    Smooth,
    /// The pen rests.
    Stop,
    /// A blend with legs of this length.
    Blend(f64),
}

/// Smooth runs of curves: corners blended within `deviation` mm, cut where the pen turns back (or at every corner if
/// the deviation is 0).
pub(super) fn sections(pieces: &[Segment], deviation: f64) -> Vec<Vec<Segment>> {
    if pieces.is_empty() {
        return Vec::new();
    }
    let joints = joints(pieces, deviation);
    let mut sections = Vec::new();
    let mut section = Vec::new();
    // How much of the piece at hand its first blend has taken, mm.
    let mut taken = 0.0;
    for (index, piece) in pieces.iter().enumerate() {
        let joint = joints.get(index).copied().unwrap_or(Joint::Stop);
        let gives = if let Joint::Blend(leg) = joint { leg } else { 0.0 };
        let rest = trimmed(piece, taken, gives);
        taken = 0.0;
        section.extend(rest);
        match joint {
            Joint::Smooth => {}
            Joint::Stop => sections.push(std::mem::take(&mut section)),
            Joint::Blend(leg) => {
                section.push(parabola(piece, &pieces[index + 1], leg));
                taken = leg;
            }
        }
    }
    sections
}

/// Every joint, with legs such that neighbouring blends share the piece between them.
fn joints(pieces: &[Segment], deviation: f64) -> Vec<Joint> {
    let mut joints: Vec<Joint> =
        pieces.windows(2).map(|pair| wanted(&pair[0], &pair[1], deviation)).collect();
    // The piece between two blends: whoever wants less than half of it leaves the rest to the other.
    let leg = |joint: Option<&Joint>| match joint {
        Some(Joint::Blend(leg)) => *leg,
        _ => 0.0,
    };
    let shares: Vec<(f64, f64)> = pieces
        .iter()
        .enumerate()
        .map(|(index, piece)| {
            let length = straight_length(piece);
            let (before, after) =
                (leg(index.checked_sub(1).and_then(|k| joints.get(k))), leg(joints.get(index)));
            (before.min((length / 2.0).max(length - after)), after.min((length / 2.0).max(length - before)))
        })
        .collect();
    for (index, joint) in joints.iter_mut().enumerate() {
        if let Joint::Blend(leg) = joint {
            *leg = shares[index].1.min(shares[index + 1].0);
            if *leg < SHORTEST {
                *joint = Joint::Stop;
            }
        }
    }
    joints
}

/// What a joint would be if it had both pieces to itself.
fn wanted(before: &Segment, after: &Segment, deviation: f64) -> Joint {
    let (Some(u), Some(v)) = (direction_at(before, 1.0), direction_at(after, 0.0)) else {
        return Joint::Stop;
    };
    if is_smooth(u, v) {
        return Joint::Smooth;
    }
    let both_straight = matches!((before, after), (Segment::Line(_), Segment::Line(_)));
    if deviation <= 0.0 || u.dot(v) < TURNS_BACK || !both_straight {
        return Joint::Stop;
    }
    Joint::Blend(4.0 * deviation / (v - u).hypot2().sqrt())
}

/// What a blend may take from.
fn straight_length(piece: &Segment) -> f64 {
    match piece {
        Segment::Line(line) => distance(line.p0, line.p1),
        _ => 0.0,
    }
}

/// The piece without `start` mm at its start and `end` mm at its end; nothing if none of it is left.
fn trimmed(piece: &Segment, start: f64, end: f64) -> Option<Segment> {
    let Segment::Line(line) = piece else { return Some(*piece) };
    let length = distance(line.p0, line.p1);
    if length - start - end <= SHORTEST {
        return None;
    }
    let along = (line.p1 - line.p0) / length;
    Some(Segment::Line(Line::new(line.p0 + start * along, line.p1 - end * along)))
}

fn parabola(before: &Segment, after: &Segment, leg: f64) -> Segment {
    let vertex = before.end();
    let end = |to: Point| vertex + (leg / distance(vertex, to)) * (to - vertex);
    let (start, end) = (end(before.start()), end(after.end()));
    // A quadratic Bézier curve as a cubic.
    let third = |p: Point| p + (2.0 / 3.0) * (vertex - p);
    Segment::Cubic(CubicBez::new(start, third(start), third(end), end))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn off(p: Point, line: &[Point]) -> f64 {
        let to = |w: &[Point]| {
            let (d, v) = (w[1] - w[0], p - w[0]);
            (v - (v.dot(d) / d.hypot2()).clamp(0.0, 1.0) * d).hypot2().sqrt()
        };
        line.windows(2).map(to).fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn blends_stay_within_the_deviation_both_ways_and_are_smooth(
            turns in proptest::collection::vec((-3.0..3.0f64, 0.02..5.0f64), 2..12), deviation in 0.01..0.5f64,
        ) {
            let (mut at, mut angle) = (Point::ZERO, 0.0);
            let mut points = vec![at];
            for (turn, step) in turns {
                angle += turn;
                at += step * Vec2::new(libm::cos(angle), libm::sin(angle));
                points.push(at);
            }
            let lines: Vec<Segment> = points.windows(2).map(|w| Segment::Line(Line::new(w[0], w[1]))).collect();
            let sections = sections(&lines, deviation);
            let mut path = Vec::new();
            for section in &sections {
                for pair in section.windows(2) {
                    let (a, b) = (direction_at(&pair[0], 1.0).unwrap(), direction_at(&pair[1], 0.0).unwrap());
                    prop_assert!((pair[0].end() - pair[1].start()).hypot2() < 1e-10);
                    prop_assert!(a.dot(b) > 1.0 - 1e-9);
                }
                path.extend(section.iter().flat_map(|piece| (0..=32).map(|k| piece.eval(f64::from(k) / 32.0))));
            }
            for p in &path {
                prop_assert!(off(*p, &points) <= deviation * (1.0 + 1e-6) + 1e-5);
            }
            path.dedup();
            for p in &points {
                prop_assert!(off(*p, &path) <= deviation * (1.0 + 1e-3) + 1e-5);
            }
        }
    }

    #[test]
    fn a_right_angle_uses_all_of_its_deviation() {
        let corner = [Point::new(0.0, 0.0), Point::new(10.0, 0.0), Point::new(10.0, 10.0)];
        let lines: Vec<Segment> = corner.windows(2).map(|w| Segment::Line(Line::new(w[0], w[1]))).collect();
        let sections = sections(&lines, 0.1);
        assert_eq!(sections.len(), 1);
        let nearest = sections[0][1].eval(0.5);
        assert!((distance(nearest, corner[1]) - 0.1).abs() < 1e-12);
    }
}
