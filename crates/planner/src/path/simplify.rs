//! Polyline simplification within a tolerance: many vertices only reflect the grid of the program
//! that made the file.

use drawing::{Line, Point, Segment};

use super::tangent::distance;

/// Replaces sequences of lines by fewer lines, such that every point of either polyline is within
/// `tolerance` mm of the other.
///
/// From each kept vertex a chord is extended over the following vertices as long as all of them lie
/// within the tolerance of the chord and each step advances along it. Then the normal through any
/// point of the chord also meets the polyline within the tolerance, so the bound holds in both
/// directions. The directions from the kept vertex that satisfy the tolerance form an interval, the
/// intersection of the cones that touch the disc around each vertex, so one pass is sufficient.
/// Method: Reumann & Witkam 1974; Imai & Iri 1988 for the cone.
pub(super) fn simplify(pieces: Vec<Segment>, tolerance: f64) -> Vec<Segment> {
    let mut simplified = Vec::with_capacity(pieces.len());
    let mut run: Vec<Point> = Vec::new();
    for piece in pieces {
        match piece {
            Segment::Line(line) => {
                if run.is_empty() {
                    run.push(line.p0);
                }
                run.push(line.p1);
            }
            curve => {
                flush(&mut run, tolerance, &mut simplified);
                simplified.push(curve);
            }
        }
    }
    flush(&mut run, tolerance, &mut simplified);
    simplified
}

fn flush(run: &mut Vec<Point>, tolerance: f64, to: &mut Vec<Segment>) {
    let mut from = 0;
    while from + 1 < run.len() {
        let end = farthest(run, from, tolerance);
        to.push(Segment::Line(Line::new(run[from], run[end])));
        from = end;
    }
    run.clear();
}

/// The last vertex that a chord from `from` can reach.
fn farthest(run: &[Point], from: usize, tolerance: f64) -> usize {
    let anchor = run[from];
    // Angles are relative to the direction of the first step, which avoids wrapping.
    let first = run[from + 1] - anchor;
    let (mut low, mut high) = (-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2);
    let mut end = from + 1;
    let narrow = |point: Point, low: &mut f64, high: &mut f64| {
        let to = point - anchor;
        let r = distance(point, anchor);
        if r > tolerance {
            let angle = libm::atan2(first.cross(to), first.dot(to));
            let half = libm::asin(tolerance / r);
            *low = low.max(angle - half);
            *high = high.min(angle + half);
        }
    };
    narrow(run[end], &mut low, &mut high);
    for next in from + 2..run.len() {
        let to = run[next] - anchor;
        let angle = libm::atan2(first.cross(to), first.dot(to));
        // The chord to `next` must pass through all previous discs.
        if !(angle >= low && angle <= high) {
            break;
        }
        // Every step must advance along the chord: checking the last one is sufficient, given the
        // cone.
        let step = run[next] - run[next - 1];
        if step.dot(to) <= 0.0 || distance(run[next], anchor) <= distance(run[next - 1], anchor) {
            break;
        }
        end = next;
        narrow(run[next], &mut low, &mut high);
        if low > high {
            break;
        }
    }
    end
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn lines(points: &[Point]) -> Vec<Segment> {
        points.windows(2).map(|w| Segment::Line(Line::new(w[0], w[1]))).collect()
    }

    fn off(p: Point, line: &[Segment]) -> f64 {
        let to = |segment: &Segment| {
            let (a, b) = (segment.start(), segment.end());
            let (d, v) = (b - a, p - a);
            let t = if d.hypot2() > 0.0 { (v.dot(d) / d.hypot2()).clamp(0.0, 1.0) } else { 0.0 };
            (v - t * d).hypot2().sqrt()
        };
        line.iter().map(to).fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn simplified_polyline_within_tolerance(
            turns in proptest::collection::vec((-0.9..0.9f64, 0.01..0.5f64), 2..60), tolerance in 0.005..0.2f64,
        ) {
            let (mut at, mut angle) = (Point::ZERO, 0.0);
            let mut points = vec![at];
            for (turn, step) in turns {
                angle += turn;
                at += step * drawing::Vec2::new(libm::cos(angle), libm::sin(angle));
                // Round to plotter units.
                at = Point::new((at.x * 40.0).round() / 40.0, (at.y * 40.0).round() / 40.0);
                if points.last() != Some(&at) {
                    points.push(at);
                }
            }
            let before = lines(&points);
            let after = simplify(before.clone(), tolerance);
            prop_assert!(after.len() <= before.len());
            for (one, other) in [(&before, &after), (&after, &before)] {
                for segment in one {
                    for k in 0..=20 {
                        let off = off(segment.eval(f64::from(k) / 20.0), other);
                        prop_assert!(off <= tolerance * (1.0 + 1e-9) + 1e-12, "{} of {}", off, tolerance);
                    }
                }
            }
        }
    }
}
