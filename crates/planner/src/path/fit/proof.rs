//! Proof that a fitted spline is within the tolerance of the drawing, in both directions.
//!
//! Span j of the spline runs along part j of the drawing, from one sample to the next, and every
//! knot is within the radius r of its sample. A Bézier curve lies in the convex hull of its control
//! points, and the distance from a convex set (a point, a segment, a line) is a convex function, so
//! a bound at all four control points holds on the whole curve.
//!
//! - **Equal parameters**: if the difference of span and drawing, itself a Bézier curve, has no
//!   control point longer than r, each point of one is within r of a point of the other.
//! - **Spline to drawing**: the control points are within r of one segment of the drawing.
//! - **Drawing to spline**, on a line: the span's projection on the line is continuous, so it covers
//!   all of the part between the projections of its ends; a point there is within r if the whole
//!   span is within r of the line. A point x of the part that is not covered lies between a sample
//!   and the projection of its knot, and `|x - knot| <= |sample - knot| <= r`.
//!
//! Where a bound fails the span is halved (de Casteljau), down to 1/64 of it.

use drawing::{CubicBez, Point, Segment};

/// How often a span is halved.
const HALVINGS: u32 = 6;

/// Number of parts of the drawing before and after a span that may be near it.
const NEIGHBORS: usize = 14;

/// Whether span `curve`, along part `index` of the drawing, is within `radius`; otherwise a distance
/// by which it is not, mm.
pub(super) fn excess(curve: &CubicBez, index: usize, parts: &[Segment], radius: f64) -> Option<f64> {
    let own = as_cubic(&parts[index]);
    let near = &parts[index.saturating_sub(NEIGHBORS)..parts.len().min(index + NEIGHBORS + 1)];
    beyond(curve, &own, &parts[index], near, radius, HALVINGS)
}

fn as_cubic(part: &Segment) -> CubicBez {
    match part {
        Segment::Cubic(cubic) => *cubic,
        other => {
            let (a, b) = (other.start(), other.end());
            CubicBez::new(a, a.lerp(b, 1.0 / 3.0), a.lerp(b, 2.0 / 3.0), b)
        }
    }
}

fn points(curve: &CubicBez) -> [Point; 4] {
    [curve.p0, curve.p1, curve.p2, curve.p3]
}

fn beyond(
    curve: &CubicBez,
    drawn: &CubicBez,
    part: &Segment,
    near: &[Segment],
    radius: f64,
    halvings: u32,
) -> Option<f64> {
    let hull = points(curve);
    let apart = hull.iter().zip(points(drawn)).map(|(p, q)| (*p - q).hypot2().sqrt()).fold(0.0, f64::max);
    if apart <= radius {
        return None;
    }
    let mut least = apart;
    if let Segment::Line(line) = part {
        let own = most(&hull, line.p0, line.p1);
        if own <= radius {
            return None;
        }
        least = least.min(own);
        let along = line.p1 - line.p0;
        let length = along.hypot2().sqrt();
        let from_line = hull.iter().map(|p| (*p - line.p0).cross(along).abs() / length).fold(0.0, f64::max);
        let is_near =
            |other: &Segment| matches!(other, Segment::Line(line) if most(&hull, line.p0, line.p1) <= radius);
        if from_line <= radius && near.iter().any(is_near) {
            return None;
        }
    }
    if halvings == 0 {
        return Some(least);
    }
    let worst = halves(curve)
        .into_iter()
        .zip(halves(drawn))
        .filter_map(|(curve, drawn)| beyond(&curve, &drawn, part, near, radius, halvings - 1));
    worst.reduce(f64::max)
}

fn halves(curve: &CubicBez) -> [CubicBez; 2] {
    let [a, b, c, d] = points(curve);
    let (ab, bc, cd) = (a.midpoint(b), b.midpoint(c), c.midpoint(d));
    let (abc, bcd) = (ab.midpoint(bc), bc.midpoint(cd));
    let middle = abc.midpoint(bcd);
    [CubicBez::new(a, ab, abc, middle), CubicBez::new(middle, bcd, cd, d)]
}

/// The largest distance of some points from a segment.
fn most(points: &[Point], a: Point, b: Point) -> f64 {
    let along = b - a;
    let square = along.hypot2();
    let distance = |p: &Point| {
        let from = *p - a;
        let t = if square > 0.0 { (from.dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
        (from - t * along).hypot2()
    };
    points.iter().map(distance).fold(0.0, f64::max).sqrt()
}

#[cfg(test)]
mod tests {
    use drawing::Line;
    use proptest::prelude::*;

    use super::*;

    fn line(a: (f64, f64), b: (f64, f64)) -> Segment {
        Segment::Line(Line::new(Point::from(a), Point::from(b)))
    }

    #[test]
    fn detour_off_a_line_is_found_and_measured() {
        let parts = [line((0.0, 0.0), (1.0, 0.0))];
        // Its middle is 3/4 of 0.2 away.
        let curve = CubicBez::new((0.0, 0.0), (0.3, 0.2), (0.7, 0.2), (1.0, 0.0));
        assert_eq!(excess(&curve, 0, &parts, 0.1501), None);
        let found = excess(&curve, 0, &parts, 0.14).expect("it is 0.15 mm away");
        assert!((found - 0.15).abs() < 1e-3, "{found}");
    }

    #[test]
    fn span_that_only_follows_a_neighbor_leaves_its_own_part_uncovered() {
        // Along y, where the drawing goes on, and back: not along its own part.
        let parts = [line((0.0, 0.0), (1.0, 0.0)), line((1.0, 0.0), (1.0, 1.0))];
        let curve = CubicBez::new((1.0, 0.0), (1.0, 0.5), (1.0, 0.5), (1.0, 0.05));
        assert!(excess(&curve, 0, &parts, 0.1).is_some());
    }

    proptest! {
        /// Sampled distances in both directions never exceed the radius that is proved.
        #[test]
        fn proved_radius_holds_for_samples(
            ends in [-0.1..0.1f64, -0.1..0.1, -0.1..0.1, -0.1..0.1],
            inner in [-0.3..0.3f64, -0.3..0.3, -0.3..0.3, -0.3..0.3], radius in 0.05..0.4f64,
        ) {
            let parts = [line((0.0, 0.0), (1.0, 0.0))];
            let curve = CubicBez::new(
                (ends[0], ends[1]), (0.33 + inner[0], inner[1]), (0.66 + inner[2], inner[3]), (1.0 + ends[2], ends[3]),
            );
            let knots = libm::hypot(ends[0], ends[1]).max(libm::hypot(ends[2], ends[3]));
            if knots <= radius && excess(&curve, 0, &parts, radius).is_none() {
                let along: Vec<Point> = (0..=200).map(|k| Segment::Cubic(curve).eval(f64::from(k) / 200.0)).collect();
                for p in &along {
                    prop_assert!(most(&[*p], Point::ZERO, Point::new(1.0, 0.0)) <= radius * (1.0 + 1e-9));
                }
                for k in 0..=50 {
                    let x = Point::new(f64::from(k) / 50.0, 0.0);
                    let near = along.windows(2).map(|w| most(&[x], w[0], w[1])).fold(f64::INFINITY, f64::min);
                    prop_assert!(near <= radius + 1e-3, "{} at {}", near, x.x);
                }
            }
        }
    }
}
