//! Where two pieces cross.

use drawing::{CubicBez, EllipticArc, Line, Point, Rect, Segment, Vec2};

/// Chords that bracket crossings of two curves stay this close to them, mm.
const CHORD_MM: f64 = 0.02;
/// Largest number of chords per curve.
const MOST_CHORDS: usize = 256;
/// Crossings of two curves are refined until both points are this close, mm.
const CLOSE_MM: f64 = 1e-10;

/// Adds the parameters strictly inside (0, 1) at which `piece` crosses `edge`. A touch may count or
/// not; a piece that runs along the edge has no crossings but, possibly, at the edge's ends.
/// Returns the work done, in tests of a pair's bounding boxes.
pub(crate) fn crossings(piece: &Segment, edge: &Segment, cuts: &mut Vec<f64>) -> u64 {
    let mut add = |t: f64| {
        if t > 0.0 && t < 1.0 {
            cuts.push(t);
        }
    };
    let slack = 1e-12;
    let within = |u: f64| (-slack..=1.0 + slack).contains(&u);
    match (piece, edge) {
        (Segment::Line(line), _) => {
            let direction = line.p1 - line.p0;
            let along = |p: Point| (p - line.p0).dot(direction) / direction.hypot2();
            if let Segment::Line(other) = edge
                && parallel(line, other)
            {
                // Ends of an edge on the piece's line: where the piece enters or leaves the edge.
                for end in [other.p0, other.p1] {
                    add(along(end));
                }
                return 1;
            }
            line_crossings(line, edge, |u| {
                if within(u) {
                    add(along(edge.eval(u)));
                }
            });
        }
        (_, Segment::Line(line)) => {
            let direction = line.p1 - line.p0;
            line_crossings(line, piece, |t| {
                if within((piece.eval(t) - line.p0).dot(direction) / direction.hypot2()) {
                    add(t);
                }
            });
        }
        _ => return curve_crossings(piece, edge, add),
    }
    10
}

fn parallel(one: &Line, other: &Line) -> bool {
    let (a, b) = (one.p1 - one.p0, other.p1 - other.p0);
    a.cross(b).abs() <= 1e-12 * (a.hypot2() * b.hypot2()).sqrt()
}

/// The parameters at which a piece crosses the whole line through `line`.
fn line_crossings(line: &Line, piece: &Segment, mut to: impl FnMut(f64)) {
    let direction = line.p1 - line.p0;
    let side = |p: Point| direction.cross(p - line.p0);
    match piece {
        Segment::Line(other) => {
            let (from, end) = (side(other.p0), side(other.p1));
            if from != end {
                to(from / (from - end));
            }
        }
        Segment::Arc(arc) => arc_crossings(direction, line.p0, arc, to),
        Segment::Cubic(cubic) => {
            let f = [cubic.p0, cubic.p1, cubic.p2, cubic.p3].map(side);
            for root in cubic_roots(f) {
                to(root);
            }
        }
    }
}

/// `cross(d, c - p + a cos u + b sin u) = 0` is `r cos(u - phi) = -cross(d, c - p)`.
fn arc_crossings(direction: Vec2, through: Point, arc: &EllipticArc, mut to: impl FnMut(f64)) {
    let (a, b) = (direction.cross(arc.a), direction.cross(arc.b));
    let r = libm::hypot(a, b);
    let cosine = -direction.cross(arc.center - through) / r;
    if cosine.is_nan() || cosine.abs() > 1.0 || arc.sweep_rad == 0.0 {
        return;
    }
    let (phi, half) = (libm::atan2(b, a), libm::acos(cosine));
    let tau = std::f64::consts::TAU;
    let (low, high) =
        (arc.start_rad.min(arc.start_rad + arc.sweep_rad), arc.start_rad.max(arc.start_rad + arc.sweep_rad));
    for base in [phi - half, phi + half] {
        let mut u = base + ((low - 1e-9 - base) / tau).ceil() * tau;
        while u <= high + 1e-9 {
            to((u - arc.start_rad) / arc.sweep_rad);
            u += tau;
        }
    }
}

/// The roots near [0, 1] of a cubic in Bernstein form, refined by Newton steps.
fn cubic_roots(f: [f64; 4]) -> Vec<f64> {
    let [f0, f1, f2, f3] = f;
    let (c1, c2, c3) = (3.0 * (f1 - f0), 3.0 * (f0 - 2.0 * f1 + f2), f3 - f0 + 3.0 * (f1 - f2));
    let mut roots: Vec<f64> = kurbo::common::solve_cubic(f0, c1, c2, c3).into_iter().collect();
    for root in &mut roots {
        for _ in 0..2 {
            let value = f0 + *root * (c1 + *root * (c2 + *root * c3));
            let slope = c1 + *root * (2.0 * c2 + *root * 3.0 * c3);
            let step = value / slope;
            if step.is_finite() && step.abs() < 1e-3 {
                *root -= step;
            }
        }
    }
    roots
}

/// Crossings of two curves: pairs of chords that come close, refined by Newton's method on both
/// parameters.
fn curve_crossings(piece: &Segment, edge: &Segment, mut add: impl FnMut(f64)) -> u64 {
    let (one, other) = (chords(piece), chords(edge));
    let near = |a: Rect, b: Rect| {
        a.x0 <= b.x1 + CHORD_MM
            && b.x0 <= a.x1 + CHORD_MM
            && a.y0 <= b.y1 + CHORD_MM
            && b.y0 <= a.y1 + CHORD_MM
    };
    let counts = [one.len() as f64, other.len() as f64];
    let mut work = (one.len() * other.len()) as u64;
    for (i, a) in one.iter().enumerate() {
        for (j, b) in other.iter().enumerate() {
            if near(a.inflate(CHORD_MM, CHORD_MM), *b) {
                let guess = [(i as f64 + 0.5) / counts[0], (j as f64 + 0.5) / counts[1]];
                work += 1000;
                if let Some(t) = refine(piece, edge, guess) {
                    add(t);
                }
            }
        }
    }
    work
}

/// The boxes of chords of equal steps of the parameter.
fn chords(segment: &Segment) -> Vec<Rect> {
    let count = segment.chord_count(CHORD_MM).clamp(4, MOST_CHORDS);
    let mut from = segment.start();
    (1..=count)
        .map(|step| {
            let to = segment.eval(step as f64 / count as f64);
            Rect::from_points(std::mem::replace(&mut from, to), to)
        })
        .collect()
}

fn refine(piece: &Segment, edge: &Segment, [mut t, mut u]: [f64; 2]) -> Option<f64> {
    for _ in 0..12 {
        let gap = edge.eval(u) - piece.eval(t);
        if gap.hypot2() <= CLOSE_MM * CLOSE_MM {
            let inside = (-1e-9..=1.0 + 1e-9).contains(&t) && (-1e-9..=1.0 + 1e-9).contains(&u);
            return inside.then_some(t);
        }
        let (dt, du) = (piece.derivatives(t).0, edge.derivatives(u).0);
        let determinant = dt.cross(du);
        if determinant == 0.0 {
            return None;
        }
        t += (gap.cross(du) / determinant).clamp(-0.5, 0.5);
        u += (gap.cross(dt) / determinant).clamp(-0.5, 0.5);
        if !(-1.0..=2.0).contains(&t) || !(-1.0..=2.0).contains(&u) {
            return None;
        }
    }
    None
}

/// The pieces of a segment between its extremes in y.
pub(crate) fn monotone(segment: &Segment) -> Vec<Segment> {
    let mut cuts = vec![0.0, 1.0];
    let mut add = |t: f64| {
        if t > 0.0 && t < 1.0 {
            cuts.push(t);
        }
    };
    match segment {
        Segment::Line(_) => return vec![*segment],
        // dy/du = b.y cos u - a.y sin u
        Segment::Arc(arc) => {
            let base = libm::atan2(arc.b.y, arc.a.y);
            let pi = std::f64::consts::PI;
            let (low, high) = (
                arc.start_rad.min(arc.start_rad + arc.sweep_rad),
                arc.start_rad.max(arc.start_rad + arc.sweep_rad),
            );
            let mut u = base + ((low - base) / pi).ceil() * pi;
            while u <= high {
                add((u - arc.start_rad) / arc.sweep_rad);
                u += pi;
            }
        }
        Segment::Cubic(CubicBez { p0, p1, p2, p3 }) => {
            let (a, b, c) = (p1.y - p0.y, p2.y - p1.y, p3.y - p2.y);
            kurbo::common::solve_quadratic(a, 2.0 * (b - a), a - 2.0 * b + c).into_iter().for_each(add);
        }
    }
    cuts.sort_unstable_by(f64::total_cmp);
    cuts.dedup();
    cuts.windows(2).map(|pair| segment.part(pair[0], pair[1])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(piece: &Segment, edge: &Segment) -> Vec<Point> {
        let mut cuts = Vec::new();
        crossings(piece, edge, &mut cuts);
        cuts.sort_unstable_by(f64::total_cmp);
        cuts.into_iter().map(|t| piece.eval(t)).collect()
    }

    #[test]
    fn circles_cross_at_exact_points() {
        let circle = |x: f64, r: f64| {
            Segment::Arc(EllipticArc::circular(Point::new(x, 0.0), r, -3.0, std::f64::consts::TAU))
        };
        let mut points = at(&circle(0.0, 5.0), &circle(6.0, 5.0));
        points.sort_unstable_by(|a, b| a.y.total_cmp(&b.y));
        points.dedup_by(|a, b| (*a - *b).hypot2() < 1e-18);
        assert_eq!(points.len(), 2);
        for (point, y) in points.iter().zip([-4.0, 4.0]) {
            assert!((*point - Point::new(3.0, y)).hypot2().sqrt() < 1e-9, "{point:?}");
        }
    }

    #[test]
    fn lines_and_cubics_cross_at_exact_points() {
        let cubic = Segment::Cubic(CubicBez::new((0.0, 0.0), (0.0, 10.0), (10.0, 10.0), (10.0, 0.0)));
        let line = Segment::Line(Line::new((5.0, -1.0), (5.0, 20.0)));
        for points in [at(&cubic, &line), at(&line, &cubic)] {
            assert_eq!(points.len(), 1);
            assert!((points[0] - Point::new(5.0, 7.5)).hypot2() < 1e-24);
        }
    }
}
