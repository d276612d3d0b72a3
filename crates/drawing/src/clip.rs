//! Clipping to an axis-aligned rectangle.

use kurbo::{Point, Rect};

use crate::Segment;

/// The parts of `segment` inside `window`, in order, as ranges of the parameter.
///
/// The window's edges count as inside. Lines, arcs and cubics are cut exactly at the edges and keep
/// their type. A window without area, or with negative width or height, contains nothing.
pub fn clip_segment(segment: &Segment, window: Rect) -> Vec<(f64, f64)> {
    if !(window.x1 > window.x0 && window.y1 > window.y0) {
        return Vec::new();
    }
    let bounds = segment.bounding_box();
    if window.x0 <= bounds.x0 && bounds.x1 <= window.x1 && window.y0 <= bounds.y0 && bounds.y1 <= window.y1 {
        return vec![(0.0, 1.0)];
    }
    if bounds.x1 < window.x0 || bounds.x0 > window.x1 || bounds.y1 < window.y0 || bounds.y0 > window.y1 {
        return Vec::new();
    }
    let mut cuts = vec![0.0, 1.0];
    for (axis, edge) in [(0, window.x0), (0, window.x1), (1, window.y0), (1, window.y1)] {
        crossings(segment, axis, edge, &mut cuts);
    }
    cuts.sort_unstable_by(f64::total_cmp);
    let mut parts: Vec<(f64, f64)> = Vec::new();
    for pair in cuts.windows(2) {
        let (t0, t1) = (pair[0], pair[1]);
        if t1 <= t0 || !inside(segment.eval(0.5 * (t0 + t1)), window) {
            continue;
        }
        match parts.last_mut() {
            Some(last) if last.1 == t0 => last.1 = t1,
            _ => parts.push((t0, t1)),
        }
    }
    parts
}

fn inside(p: Point, window: Rect) -> bool {
    // The middle of a part that runs along an edge may be outside by a rounding error.
    let slack = 1e-9;
    p.x >= window.x0 - slack
        && p.x <= window.x1 + slack
        && p.y >= window.y0 - slack
        && p.y <= window.y1 + slack
}

/// Adds the parameters in the open interval (0, 1) at which the coordinate `axis` equals `edge`.
fn crossings(segment: &Segment, axis: usize, edge: f64, cuts: &mut Vec<f64>) {
    let of = |p: Point| if axis == 0 { p.x } else { p.y };
    let mut add = |t: f64| {
        if t > 0.0 && t < 1.0 {
            cuts.push(t);
        }
    };
    match segment {
        Segment::Line(line) => {
            let (from, to) = (of(line.p0), of(line.p1));
            if from != to {
                add((edge - from) / (to - from));
            }
        }
        Segment::Arc(arc) => {
            // c + a cos u + b sin u = c + r cos(u - phi) = edge
            let (a, b) = (of(arc.a.to_point()), of(arc.b.to_point()));
            let r = libm::hypot(a, b);
            let cosine = (edge - of(arc.center)) / r;
            if cosine.abs() <= 1.0 && arc.sweep_rad != 0.0 {
                let (phi, half) = (libm::atan2(b, a), libm::acos(cosine));
                for base in [phi - half, phi + half] {
                    for u in arc.angles_within(base, std::f64::consts::TAU) {
                        add((u - arc.start_rad) / arc.sweep_rad);
                    }
                }
            }
        }
        Segment::Cubic(c) => {
            let (p0, p1, p2, p3) = (of(c.p0), of(c.p1), of(c.p2), of(c.p3));
            let roots = kurbo::common::solve_cubic(
                p0 - edge,
                3.0 * (p1 - p0),
                3.0 * (p0 - 2.0 * p1 + p2),
                p3 - p0 + 3.0 * (p1 - p2),
            );
            roots.into_iter().for_each(add);
        }
    }
}
