//! Polyline simplification within a tolerance.

use crate::Point;

/// The vertices of a polyline that are kept so that every point of either polyline is within `tolerance` mm of the
/// other: indices, the first and the last among them. Empty for no points.
///
/// From each kept vertex a chord is extended over the following vertices as long as all of them lie
/// within the tolerance of the chord and each step advances along it. Then the normal through any
/// point of the chord also meets the polyline within the tolerance, so the bound holds in both
/// directions. The directions from the kept vertex that satisfy the tolerance form an interval, the
/// intersection of the cones that touch the disc around each vertex, so one pass is sufficient.
/// Method: Reumann & Witkam 1974; Imai & Iri 1988 for the cone.
pub fn kept_vertices(run: &[Point], tolerance: f64) -> Vec<usize> {
    let mut kept = Vec::new();
    if run.is_empty() {
        return kept;
    }
    let mut from = 0;
    kept.push(from);
    while from + 1 < run.len() {
        from = farthest(run, from, tolerance);
        kept.push(from);
    }
    kept
}

fn reach(a: Point, b: Point) -> f64 {
    libm::hypot(a.x - b.x, a.y - b.y)
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
        let r = reach(point, anchor);
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
        if step.dot(to) <= 0.0 || reach(run[next], anchor) <= reach(run[next - 1], anchor) {
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
    use super::*;

    #[test]
    fn vertices_on_a_line_and_repeated_ones_are_dropped_and_corners_kept() {
        let points =
            [(0.0, 0.0), (1.0, 0.01), (2.0, 0.0), (2.0, 1.0), (2.0, 1.0), (2.0, 0.5)].map(Point::from);
        assert_eq!(kept_vertices(&points, 0.05), [0, 2, 3, 5]);
        assert_eq!(kept_vertices(&points, 0.0), [0, 1, 2, 3, 5]);
        assert_eq!(kept_vertices(&points[..1], 0.05), [0]);
        assert_eq!(kept_vertices(&[], 0.05), [0_usize; 0]);
    }
}
