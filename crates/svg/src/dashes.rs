//! Dashes: the parts of a path that a pattern of dashes and gaps leaves.

use drawing::{EllipticArc, Segment};
use kurbo::ParamCurveArclen as _;

use crate::path::Subpath;

/// Accuracy of lengths along curves, user units relative to the length.
const ACCURACY: f64 = 1e-9;

/// The dashes of a subpath, each a list of pieces; `None` where there would be more than `left`.
///
/// `lengths` are dashes and gaps in turn, an even number of them. The pattern starts `offset` into
/// itself at the start of every subpath.
pub(crate) fn cut(
    subpath: &Subpath,
    lengths: &[f64],
    offset: f64,
    left: &mut u64,
) -> Option<Vec<Vec<Segment>>> {
    let period: f64 = lengths.iter().sum();
    let total: f64 = subpath.segments.iter().map(Segment::length).sum();
    let count = (total / period).ceil() * lengths.len() as f64;
    if count.is_nan() || count > *left as f64 {
        return None;
    }
    *left -= count as u64;
    let mut rest = libm::fmod(offset, period);
    if rest < 0.0 {
        rest += period;
    }
    let mut index = 0;
    while rest >= lengths[index] && index + 1 < lengths.len() {
        rest -= lengths[index];
        index += 1;
    }
    let mut remaining = (lengths[index] - rest).max(0.0);
    let mut dashes: Vec<Vec<Segment>> = Vec::new();
    let mut dash: Vec<Segment> = Vec::new();
    for segment in &subpath.segments {
        let along = Lengths::of(*segment);
        let mut done = 0.0;
        let mut from = 0.0;
        while along.total - done > remaining {
            done += remaining;
            let to = along.parameter(done);
            if index % 2 == 0 {
                if to > from {
                    dash.push(segment.part(from, to));
                }
                dashes.extend((!dash.is_empty()).then(|| std::mem::take(&mut dash)));
            }
            from = to;
            index = (index + 1) % lengths.len();
            remaining = lengths[index];
        }
        remaining -= along.total - done;
        if index % 2 == 0 && from < 1.0 {
            dash.push(if from == 0.0 { *segment } else { segment.part(from, 1.0) });
        }
    }
    if !dash.is_empty() {
        dashes.push(dash);
    }
    Some(dashes)
}

/// A piece measured along its length.
#[derive(Debug)]
pub(crate) struct Lengths {
    pub(crate) segment: Segment,
    pub(crate) total: f64,
    /// Lengths up to equal steps of the parameter, for ellipses.
    table: Vec<f64>,
}

const STEPS: usize = 64;

impl Lengths {
    pub(crate) fn of(segment: Segment) -> Self {
        let mut table = Vec::new();
        let total = match &segment {
            Segment::Arc(arc) if arc.circle_radius().is_none() => {
                table.push(0.0);
                for step in 0..STEPS {
                    let t = [step, step + 1].map(|step| step as f64 / STEPS as f64);
                    table.push(table[step] + gauss(arc, t[0], t[1]));
                }
                table[STEPS]
            }
            Segment::Cubic(cubic) => cubic.arclen(ACCURACY * (1.0 + cubic.p0.distance(cubic.p3))),
            _ => segment.length(),
        };
        Self { segment, total, table }
    }

    /// The parameter at a length from the start.
    pub(crate) fn parameter(&self, length: f64) -> f64 {
        let t = match &self.segment {
            Segment::Cubic(cubic) => cubic.inv_arclen(length, ACCURACY * (1.0 + self.total)),
            Segment::Arc(arc) if !self.table.is_empty() => {
                let step = self.table.partition_point(|&to| to <= length).clamp(1, STEPS) - 1;
                let start = step as f64 / STEPS as f64;
                let mut t = start;
                for _ in 0..8 {
                    let speed = arc.derivatives(t).0.hypot2().sqrt();
                    let error = length - self.table[step] - gauss(arc, start, t);
                    if speed > 0.0 {
                        t = (t + error / speed).clamp(start, start + 1.0 / STEPS as f64);
                    }
                }
                t
            }
            _ => length / self.total,
        };
        t.clamp(0.0, 1.0)
    }
}

/// Length of an arc between two parameters, by Gauss and Legendre's rule with five points.
fn gauss(arc: &EllipticArc, from: f64, to: f64) -> f64 {
    const NODES: [(f64, f64); 5] = [
        (0.0, 0.568_888_888_888_888_9),
        (-0.538_469_310_105_683, 0.478_628_670_499_366_5),
        (0.538_469_310_105_683, 0.478_628_670_499_366_5),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let speed = |node: f64| arc.derivatives(middle + half * node).0.hypot2().sqrt();
    half * NODES.iter().map(|&(node, weight)| weight * speed(node)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use drawing::{Point, Vec2};

    use super::*;

    fn lengths(segment: Segment, pattern: &[f64], offset: f64) -> Vec<f64> {
        let subpath = Subpath { start: segment.start(), segments: vec![segment], closed: false };
        let dashes = cut(&subpath, pattern, offset, &mut 1000).unwrap();
        dashes.iter().map(|dash| dash.iter().map(Segment::length).sum()).collect()
    }

    #[test]
    fn dashes_of_all_curves_have_their_lengths() {
        let ellipse = EllipticArc {
            center: Point::ZERO,
            a: Vec2::new(10.0, 0.0),
            b: Vec2::new(1.0, 4.0),
            start_rad: 0.3,
            sweep_rad: 4.0,
        };
        for segment in [
            Segment::Line(drawing::Line::new((0.0, 0.0), (30.0, 0.0))),
            Segment::Arc(EllipticArc::circular(Point::ZERO, 10.0, 1.0, -3.0)),
            Segment::Arc(ellipse),
            Segment::Cubic(drawing::CubicBez::new((0.0, 0.0), (20.0, 5.0), (-5.0, 20.0), (30.0, 10.0))),
        ] {
            let found = lengths(segment, &[3.0, 2.0], 4.0);
            // The pattern starts in the gap, 1 before its end.
            assert!(found.len() >= 5);
            for length in &found[..found.len() - 1] {
                assert!((length - 3.0).abs() < 1e-5, "{segment:?}: {length}");
            }
        }
    }

    #[test]
    fn endless_patterns_are_refused() {
        let segment = Segment::Line(drawing::Line::new((0.0, 0.0), (30.0, 0.0)));
        let subpath = Subpath { start: Point::ZERO, segments: vec![segment], closed: false };
        assert!(cut(&subpath, &[1e-9, 1e-9], 0.0, &mut 1000).is_none());
    }
}
