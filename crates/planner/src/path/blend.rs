//! Corner blends: parabolas, or splines where jerk is limited.
//!
//! At a corner the direction changes from the unit vector `u` to `v`. A parabola (quadratic Bézier
//! curve) with legs of length `l` on both sides of the vertex P joins them tangentially:
//!
//! ```text
//!  P - l u  ------>  P        p(t)  = P + l (-(1-t)² u + t² v)
//!            \.      |        p'(t) = 2 l ((1-t) u + t v),   p'' = 2 l (v - u)
//!              '.    |
//!                 \  v        distance to P, at the midpoint: d = l |v - u| / 4
//!                   P + l v
//! ```
//! With t proportional to time the acceleration is constant, so where only acceleration is limited
//! the same motor is at its limit along the whole parabola: at the end speed c the acceleration is
//! `c² |v - u| / (2 l)`, so a deviation d allows `c² = 8 d a / |v - u|²`. A circular arc of the
//! same deviation allows `a d / (1 / cos(theta/2) - 1)`: the same for small angles, 1.66 times less
//! at a right angle. The distance from the vertex is d; the blend's own deviation is smaller.
//!
//! Where a motor's jerk is limited the curvature must be continuous as well. There a uniform cubic
//! B-spline of three spans matches position, direction and curvature on both sides. Between lines,
//! with spans of h, it has legs of `1.5 h`:
//!
//! ```text
//! control points  P - 5/2 h u,  P - 3/2 h u,  P - 1/2 h u,  P + 1/2 h v,  P + 3/2 h v,  P + 5/2 h v
//! distance to P   d = 13 h |v - u| / 48
//! where |p'| = 1  |p''| <= |v - u| / (2 h),   |p'''| = |v - u| / (2 h²)
//! ```
//! Its legs are 1.4 times those of the parabola with the same deviation. The curvature also jumps
//! where a line meets an arc tangentially; such junctions become splines too.

use drawing::{CubicBez, Point, Segment, Vec2};

use super::tangent::{direction_at, distance, is_smooth};

/// A direction change with a smaller cosine is a reversal: 175 degrees.
const TURNS_BACK: f64 = -0.9962;

/// Relative difference of curvatures below which they count as equal.
const SAME_CURVATURE: f64 = 1e-9;

/// Shortest leg of a blend, mm.
const SHORTEST: f64 = 1e-6;

/// The shape of a corner blend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CornerBlend {
    /// A parabola. The curvature jumps at its ends. The fastest shape where only acceleration is
    /// limited.
    Parabola,
    /// A spline of three cubics with continuous curvature.
    Spline,
}

/// The junction after each piece except the last.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Junction {
    /// The tangent is continuous.
    Smooth,
    /// The pen stops.
    Stop,
    /// A blend with legs of this length, mm.
    Blend(f64),
}

/// Smooth sequences of curves: corners are blended within `deviation` mm, and sequences end at
/// reversals (at every corner if the deviation is 0).
pub(super) fn sections(pieces: &[Segment], deviation: f64, corner: CornerBlend) -> Vec<Vec<Segment>> {
    if pieces.is_empty() {
        return Vec::new();
    }
    let junctions = junctions(pieces, deviation, corner);
    let mut sections = Vec::new();
    let mut section = Vec::new();
    // How much of the current piece the blend at its start uses, mm.
    let mut taken = 0.0;
    for (index, piece) in pieces.iter().enumerate() {
        let junction = junctions.get(index).copied().unwrap_or(Junction::Stop);
        let gives = if let Junction::Blend(leg) = junction { leg } else { 0.0 };
        let rest = trimmed(piece, taken, gives);
        taken = 0.0;
        section.extend(rest);
        match junction {
            Junction::Smooth => {}
            Junction::Stop => sections.push(std::mem::take(&mut section)),
            Junction::Blend(leg) => {
                section.extend(corner.curve(piece, &pieces[index + 1], leg).into_iter().flatten());
                taken = leg;
            }
        }
    }
    sections
}

/// All junctions. The legs are chosen such that neighboring blends share the piece between them.
fn junctions(pieces: &[Segment], deviation: f64, corner: CornerBlend) -> Vec<Junction> {
    let mut junctions: Vec<Junction> =
        pieces.windows(2).map(|pair| ideal_junction(&pair[0], &pair[1], deviation, corner)).collect();
    // A blend that needs less than half of the piece leaves the rest to the other blend.
    let leg = |junction: Option<&Junction>| match junction {
        Some(Junction::Blend(leg)) => *leg,
        _ => 0.0,
    };
    let shares: Vec<(f64, f64)> = pieces
        .iter()
        .enumerate()
        .map(|(index, piece)| {
            let length = available(piece);
            let (before, after) =
                (leg(index.checked_sub(1).and_then(|k| junctions.get(k))), leg(junctions.get(index)));
            (before.min((length / 2.0).max(length - after)), after.min((length / 2.0).max(length - before)))
        })
        .collect();
    for (index, junction) in junctions.iter_mut().enumerate() {
        if let Junction::Blend(leg) = junction {
            *leg = shares[index].1.min(shares[index + 1].0);
            if *leg < SHORTEST {
                *junction = Junction::Stop;
            }
        }
    }
    junctions
}

/// The junction that would be best if both pieces were available completely.
fn ideal_junction(before: &Segment, after: &Segment, deviation: f64, corner: CornerBlend) -> Junction {
    let (Some(u), Some(v)) = (direction_at(before, 1.0), direction_at(after, 0.0)) else {
        return Junction::Stop;
    };
    if is_smooth(u, v) && (corner == CornerBlend::Parabola || is_as_curved(before, after)) {
        return Junction::Smooth;
    }
    if deviation <= 0.0 || u.dot(v) < TURNS_BACK {
        return Junction::Stop;
    }
    let share = match corner {
        CornerBlend::Parabola => 4.0,
        CornerBlend::Spline => 72.0 / 13.0,
    };
    let leg = share * deviation / (v - u).hypot2().sqrt();
    if matches!((before, after), (Segment::Line(_), Segment::Line(_))) {
        return Junction::Blend(leg);
    }
    // Between curves the closed form is only an initial value: shorten until the measured deviation
    // is within the limit.
    let mut leg = leg.min(available(before) / 2.0).min(available(after) / 2.0);
    while leg > SHORTEST {
        if corner
            .curve(before, after, leg)
            .is_some_and(|blend| strays(&blend, before, after, leg) <= deviation)
        {
            return Junction::Blend(leg);
        }
        leg *= 0.7;
    }
    Junction::Stop
}

/// The length of a piece that blends may use, mm; on a curve at most the length that turns by 0.5
/// rad.
fn available(piece: &Segment) -> f64 {
    match piece {
        Segment::Line(line) => distance(line.p0, line.p1),
        curve => {
            let bends = [0.0, 0.5, 1.0].map(|t| {
                let (first, second) = curve.derivatives(t);
                first.cross(second).abs() / (first.hypot2() * first.hypot2().sqrt())
            });
            curve.length().min(0.5 / bends.into_iter().fold(0.0, f64::max))
        }
    }
}

/// The piece without `start` mm at its start and `end` mm at its end; `None` if nothing is left.
fn trimmed(piece: &Segment, start: f64, end: f64) -> Option<Segment> {
    if start == 0.0 && end == 0.0 {
        return Some(*piece);
    }
    let (t0, t1) = (parameter(piece, start, true), parameter(piece, end, false));
    ((t1 - t0) * available(piece) > SHORTEST).then(|| piece.part(t0, t1))
}

/// The parameter about `leg` mm from an end: exact on lines and circles, a linear estimate from the
/// speed at the end on other curves.
fn parameter(piece: &Segment, leg: f64, at_start: bool) -> f64 {
    let end = if at_start { 0.0 } else { 1.0 };
    // A line may give more than half of itself to one blend if the other needs less.
    let most = if matches!(piece, Segment::Line(_)) { 1.0 } else { 0.5 * (1.0 + 1e-9) };
    let share = (leg / piece.derivatives(end).0.hypot2().sqrt()).min(most);
    if at_start { share } else { 1.0 - share }
}

impl CornerBlend {
    /// The blend at the junction of two pieces, from `leg` mm before it to `leg` mm after it,
    /// tangent to both; `None` if there is none.
    fn curve(self, before: &Segment, after: &Segment, leg: f64) -> Option<Vec<Segment>> {
        let (t0, t1) = (parameter(before, leg, false), parameter(after, leg, true));
        match self {
            Self::Parabola => Some(vec![parabola(before, t0, after, t1, leg)?]),
            Self::Spline => spline(before, t0, after, t1, leg),
        }
    }
}

fn parabola(before: &Segment, t0: f64, after: &Segment, t1: f64, leg: f64) -> Option<Segment> {
    let (start, end) = (before.eval(t0), after.eval(t1));
    let (u, v) = (direction_at(before, t0)?, direction_at(after, t1)?);
    // Solve start + x u = end - y v.
    let (across, turn) = (end - start, u.cross(v));
    let (x, y) = (across.cross(v) / turn, u.cross(across) / turn);
    let fair = |length: f64| length > 0.2 * leg && length < 5.0 * leg;
    if !(fair(x) && fair(y)) {
        return None;
    }
    let vertex = start + x * u;
    // Degree elevation: a quadratic Bézier curve as a cubic.
    let third = |p: Point| p + (2.0 / 3.0) * (vertex - p);
    Some(Segment::Cubic(CubicBez::new(start, third(start), third(end), end)))
}

/// The spline whose control points match position p, direction and curvature at both ends, from `p
/// = (c0 + 4 c1 + c2) / 6`, `h p' = (c2 - c0) / 2` and `h² p'' = c0 - 2 c1 + c2`.
fn spline(before: &Segment, t0: f64, after: &Segment, t1: f64, leg: f64) -> Option<Vec<Segment>> {
    let h = leg / 1.5;
    let (u, v) = (direction_at(before, t0)?, direction_at(after, t1)?);
    let (bend0, bend1) = (0.5 * h * h * curvature_at(before, t0), 0.5 * h * h * curvature_at(after, t1));
    let c1 = before.eval(t0) - bend0 / 3.0;
    let c4 = after.eval(t1) - bend1 / 3.0;
    let (c0, c2) = (c1 + bend0 - h * u, c1 + bend0 + h * u);
    let (c3, c5) = (c4 + bend1 - h * v, c4 + bend1 + h * v);
    let span = |[a, b, c, d]: [Point; 4]| {
        let mean = |x: Point, y: Point, z: Point| {
            Point::ORIGIN + (x.to_vec2() + 4.0 * y.to_vec2() + z.to_vec2()) / 6.0
        };
        let curve = CubicBez::new(mean(a, b, c), b.lerp(c, 1.0 / 3.0), b.lerp(c, 2.0 / 3.0), mean(b, c, d));
        Segment::Cubic(curve)
    };
    let spans = [[c0, c1, c2, c3], [c1, c2, c3, c4], [c2, c3, c4, c5]].map(span);
    // If the end directions differ too much the spline would form a loop.
    let forward = |segment: &Segment| {
        let (first, _) = segment.derivatives(0.5);
        first.dot(u + v) > 0.0
    };
    spans.iter().all(forward).then(|| spans.to_vec())
}

/// The second derivative with respect to a parameter in which the pen's speed is 1, 1/mm: the
/// curvature vector where that parameter is arc length.
fn curvature_at(piece: &Segment, t: f64) -> Vec2 {
    let (first, second) = piece.derivatives(t);
    second / first.hypot2()
}

/// Whether the curvature is continuous at a smooth junction.
fn is_as_curved(before: &Segment, after: &Segment) -> bool {
    let (one, other) = (curvature_at(before, 1.0), curvature_at(after, 0.0));
    (one - other).hypot2().sqrt() <= SAME_CURVATURE * (one.hypot2().sqrt() + other.hypot2().sqrt())
}

/// The deviation between a blend and the two pieces, in both directions, mm. Sampled; the factor
/// 1.02 covers the sampling error.
fn strays(blend: &[Segment], before: &Segment, after: &Segment, leg: f64) -> f64 {
    const SAMPLES: u32 = 16;
    let along = |segment: &Segment, from: f64, to: f64| -> Vec<Point> {
        (0..=SAMPLES).map(|k| segment.eval(from + (to - from) * f64::from(k) / f64::from(SAMPLES))).collect()
    };
    let mut corner = along(before, parameter(before, leg, false), 1.0);
    corner.extend(along(after, 0.0, parameter(after, leg, true)));
    let path: Vec<Point> = blend.iter().flat_map(|segment| along(segment, 0.0, 1.0)).collect();
    let off = |from: &[Point], to: &[Point]| {
        let nearest =
            |p: &Point| to.windows(2).map(|w| to_chord(*p, w[0], w[1])).fold(f64::INFINITY, f64::min);
        from.iter().map(nearest).fold(0.0, f64::max)
    };
    1.02 * off(&path, &corner).max(off(&corner, &path))
}

fn to_chord(p: Point, a: Point, b: Point) -> f64 {
    let (d, v) = (b - a, p - a);
    let t = if d.hypot2() > 0.0 { (v.dot(d) / d.hypot2()).clamp(0.0, 1.0) } else { 0.0 };
    (v - t * d).hypot2().sqrt()
}

#[cfg(test)]
mod tests {
    use drawing::{EllipticArc, Line, Vec2};
    use proptest::prelude::*;

    use super::*;

    fn off(p: Point, line: &[Point]) -> f64 {
        line.windows(2).map(|w| to_chord(p, w[0], w[1])).fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn blend_deviation_and_smoothness(
            turns in proptest::collection::vec((-3.0..3.0f64, 0.02..5.0f64), 2..12), deviation in 0.01..0.5f64,
            corner in prop_oneof![Just(CornerBlend::Parabola), Just(CornerBlend::Spline)],
        ) {
            let (mut at, mut angle) = (Point::ZERO, 0.0);
            let mut points = vec![at];
            for (turn, step) in turns {
                angle += turn;
                at += step * Vec2::new(libm::cos(angle), libm::sin(angle));
                points.push(at);
            }
            let lines: Vec<Segment> = points.windows(2).map(|w| Segment::Line(Line::new(w[0], w[1]))).collect();
            let sections = sections(&lines, deviation, corner);
            let mut path = Vec::new();
            for section in &sections {
                for pair in section.windows(2) {
                    let (a, b) = (direction_at(&pair[0], 1.0).unwrap(), direction_at(&pair[1], 0.0).unwrap());
                    prop_assert!((pair[0].end() - pair[1].start()).hypot2() < 1e-10);
                    prop_assert!(a.dot(b) > 1.0 - 1e-9);
                    if corner == CornerBlend::Spline {
                        let jump = curvature_at(&pair[0], 1.0) - curvature_at(&pair[1], 0.0);
                        prop_assert!(jump.hypot2().sqrt() < 1e-6, "curvature jumps by {:?}", jump);
                    }
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
    fn line_to_circle_corner_is_blended() {
        let line = Segment::Line(Line::new(Point::new(0.0, 0.0), Point::new(10.0, 0.0)));
        let arc = Segment::Arc(EllipticArc::circular(Point::new(10.0, 5.0), 5.0, -1.0, 2.0));
        let Segment::Arc(at) = arc else { unreachable!("it is an arc") };
        let to = Segment::Line(Line::new(line.end(), at.eval(0.0)));
        let sections = sections(&[line, to, arc], 0.05, CornerBlend::Parabola);
        assert_eq!(sections.len(), 1);
        for pair in sections[0].windows(2) {
            let (a, b) = (direction_at(&pair[0], 1.0).unwrap(), direction_at(&pair[1], 0.0).unwrap());
            assert!(distance(pair[0].end(), pair[1].start()) < 1e-9 && a.dot(b) > 1.0 - 1e-9);
        }
    }

    #[test]
    fn parabola_uses_full_deviation() {
        let corner = [Point::new(0.0, 0.0), Point::new(10.0, 0.0), Point::new(10.0, 10.0)];
        let lines: Vec<Segment> = corner.windows(2).map(|w| Segment::Line(Line::new(w[0], w[1]))).collect();
        let sections = sections(&lines, 0.1, CornerBlend::Parabola);
        assert_eq!(sections.len(), 1);
        let nearest = sections[0][1].eval(0.5);
        assert!((distance(nearest, corner[1]) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn spline_uses_full_deviation() {
        let corner = [Point::new(0.0, 0.0), Point::new(10.0, 0.0), Point::new(10.0, 10.0)];
        let lines: Vec<Segment> = corner.windows(2).map(|w| Segment::Line(Line::new(w[0], w[1]))).collect();
        let sections = sections(&lines, 0.1, CornerBlend::Spline);
        assert_eq!((sections.len(), sections[0].len()), (1, 5));
        let nearest = sections[0][2].eval(0.5);
        assert!((distance(nearest, corner[1]) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn tangent_line_to_circle_gets_spline() {
        let line = Segment::Line(Line::new(Point::new(0.0, 0.0), Point::new(10.0, 0.0)));
        let down = -std::f64::consts::FRAC_PI_2;
        let arc = Segment::Arc(EllipticArc::circular(Point::new(10.0, 5.0), 5.0, down, 2.0));
        assert_eq!(sections(&[line, arc], 0.05, CornerBlend::Parabola)[0].len(), 2);
        let splined = sections(&[line, arc], 0.05, CornerBlend::Spline);
        assert_eq!((splined.len(), splined[0].len()), (1, 5));
        for pair in splined[0].windows(2) {
            let jump = curvature_at(&pair[0], 1.0) - curvature_at(&pair[1], 0.0);
            assert!(jump.hypot2().sqrt() < 1e-9 && distance(pair[0].end(), pair[1].start()) < 1e-9);
        }
    }
}
