//! Clipping to an axis-aligned rectangle.

use kurbo::{Point, Rect};

use crate::{Segment, Stroke};

/// Parts of strokes shorter than this are rounding errors of cuts, mm.
const SHORTEST_MM: f64 = 1e-9;

/// A side of a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// In the window or on its edges.
    Inside,
    /// Outside the window.
    Outside,
}

/// The parts of a stroke on one side of the window, in drawing order.
///
/// Lines, arcs and cubics are cut at the edges and keep their type; the two sides together are the
/// whole stroke. A closed stroke that is kept at its start continues there: its first and last part
/// are one. A stroke that only touches the window has no part inside.
pub fn clip_stroke(stroke: &Stroke, window: Rect, side: Side) -> Vec<Stroke> {
    let keep_all = |keep: bool| if keep { vec![stroke.clone()] } else { Vec::new() };
    let is_window = window.x1 > window.x0 && window.y1 > window.y0;
    let bounds = stroke.bounding_box();
    let within = |a: f64, low: f64, high: f64| low <= a && a <= high;
    let is_inside = is_window
        && [bounds.x0, bounds.x1].iter().all(|&x| within(x, window.x0, window.x1))
        && [bounds.y0, bounds.y1].iter().all(|&y| within(y, window.y0, window.y1));
    if is_inside || !is_window || stroke.is_dot() {
        return keep_all(is_inside == (side == Side::Inside));
    }
    let mut parts = Parts::default();
    let vertices = stroke.vertices();
    for (index, segment) in stroke.segments().enumerate() {
        let inside = clip_segment(&segment, window);
        let ranges = if side == Side::Inside { inside } else { complement(&inside) };
        parts.add(&segment, vertices[index + 1], &ranges);
    }
    parts.finish(stroke)
}

/// The ranges of (0, 1) that are not in `ranges`.
fn complement(ranges: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut from = 0.0;
    let mut others = Vec::new();
    for &(start, end) in ranges {
        others.extend((start > from).then_some((from, start)));
        from = end;
    }
    others.extend((from < 1.0).then_some((from, 1.0)));
    others
}

/// The kept parts of a stroke: connected segments, each with its exact end.
#[derive(Default)]
struct Parts {
    runs: Vec<Vec<(Segment, Point)>>,
    /// The last segment was kept up to its end.
    continues: bool,
    /// The first segment was kept from its start.
    from_start: bool,
    segments: usize,
}

impl Parts {
    fn add(&mut self, segment: &Segment, end: Point, ranges: &[(f64, f64)]) {
        let mut continues = false;
        for &(from, to) in ranges {
            let part = if (from, to) == (0.0, 1.0) { *segment } else { segment.part(from, to) };
            let part_end = if to == 1.0 { end } else { part.end() };
            self.from_start |= self.segments == 0 && from == 0.0;
            match self.runs.last_mut() {
                Some(run) if self.continues && from == 0.0 => run.push((part, part_end)),
                _ => self.runs.push(vec![(part, part_end)]),
            }
            continues = to == 1.0;
            self.continues = false;
        }
        self.continues = continues;
        self.segments += 1;
    }

    fn finish(mut self, stroke: &Stroke) -> Vec<Stroke> {
        if stroke.is_closed() && self.from_start && self.continues && self.runs.len() > 1 {
            let first = self.runs.remove(0);
            if let Some(last) = self.runs.last_mut() {
                last.extend(first);
            }
        }
        let is_long = |run: &Vec<(Segment, Point)>| {
            run.iter().map(|(segment, _)| segment.length()).sum::<f64>() >= SHORTEST_MM
        };
        self.runs.into_iter().filter(is_long).filter_map(|run| of_run(stroke, &run)).collect()
    }
}

/// A stroke of connected segments.
fn of_run(stroke: &Stroke, run: &[(Segment, Point)]) -> Option<Stroke> {
    let start = run.first()?.0.start();
    if run.iter().all(|(segment, _)| matches!(segment, Segment::Line(_))) {
        let points = std::iter::once(start).chain(run.iter().map(|(_, end)| *end)).collect();
        return Stroke::polyline(stroke.pen, points, stroke.source());
    }
    let mut part = Stroke::new(stroke.pen, start, stroke.source());
    for (segment, end) in run {
        match segment {
            Segment::Line(_) => part.line_to(*end),
            Segment::Arc(arc) => part.arc_to(*arc, *end),
            Segment::Cubic(cubic) => part.cubic_to(cubic.p1, cubic.p2, *end),
        }
    }
    part.shrink_to_fit();
    Some(part)
}

/// The parts of `segment` inside `window`, in order, as ranges of the parameter.
///
/// The window's edges count as inside. Lines, arcs and cubics are cut exactly at the edges and keep
/// their type. A window without area, or with negative width or height, contains nothing.
pub fn clip_segment(segment: &Segment, window: Rect) -> Vec<(f64, f64)> {
    if !(window.x1 > window.x0 && window.y1 > window.y0) {
        return Vec::new();
    }
    let is_within = |bounds: Rect| {
        window.x0 <= bounds.x0 && bounds.x1 <= window.x1 && window.y0 <= bounds.y0 && bounds.y1 <= window.y1
    };
    if is_within(segment.loose_box()) {
        return vec![(0.0, 1.0)];
    }
    let bounds = segment.bounding_box();
    if is_within(bounds) {
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
