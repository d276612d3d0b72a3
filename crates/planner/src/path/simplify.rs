//! Polyline simplification within a tolerance: many vertices only reflect the grid of the program
//! that made the file.

use drawing::{Line, Point, Segment, distance_to_line, kept_vertices};

/// Replaces sequences of lines by fewer lines, such that every point of either polyline is within
/// `tolerance` mm of the other ([`drawing::kept_vertices`]).
pub(super) fn simplify(pieces: &[Segment], tolerance: f64) -> Vec<Segment> {
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
                simplified.push(*curve);
            }
        }
    }
    flush(&mut run, tolerance, &mut simplified);
    simplified
}

/// The largest distance of a vertex of `pieces` from the line that replaces it in `simplified`, which
/// is the result of [`simplify`]; at most its tolerance, and the deviation in both directions.
pub(super) fn deviation(pieces: &[Segment], simplified: &[Segment]) -> f64 {
    let mut pieces = pieces.iter();
    let mut largest = 0.0_f64;
    for piece in simplified {
        let Some(before) = pieces.next() else { break };
        let Segment::Line(line) = piece else { continue };
        let mut vertex = before.end();
        while vertex != line.p1 {
            largest = largest.max(distance_to_line(vertex, *line));
            let Some(next) = pieces.next() else { return largest };
            vertex = next.end();
        }
    }
    largest
}

fn flush(run: &mut Vec<Point>, tolerance: f64, to: &mut Vec<Segment>) {
    let kept = kept_vertices(run, tolerance);
    to.extend(kept.windows(2).map(|pair| Segment::Line(Line::new(run[pair[0]], run[pair[1]]))));
    run.clear();
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
            let after = simplify(&before, tolerance);
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
