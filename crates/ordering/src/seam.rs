//! Start points of closed strokes.

use drawing::{EllipticArc, Point, Segment, Stroke};

use crate::Cost;

/// Passes over the strokes. The cost never increases; after two or three passes few seams move.
const PASSES: usize = 4;

/// Number of candidate start points on a full circle or ellipse.
const ARC_STARTS: u32 = 32;

/// Moves the start of each stroke that is a full circle or ellipse to the candidate with the lowest
/// cost between its neighbours. Returns whether any start has moved. The ink does not change.
pub(crate) fn turn_circles(
    strokes: &mut [Stroke],
    start: Option<Point>,
    park: Option<Point>,
    cost: &dyn Cost,
) -> bool {
    let circles: Vec<(usize, EllipticArc)> =
        strokes.iter().enumerate().filter_map(|(at, stroke)| Some((at, whole_turn(stroke)?))).collect();
    let mut turned = false;
    for (at, arc) in circles {
        let before = if at == 0 { start } else { Some(strokes[at - 1].end()) };
        let after = strokes.get(at + 1).map(Stroke::start).or(park);
        let detour = |point: Point| {
            before.map_or(0.0, |p| cost.between(p, point)) + after.map_or(0.0, |p| cost.between(point, p))
        };
        let mut best = (detour(strokes[at].start()), 0);
        for candidate in 1..ARC_STARTS {
            let detour = detour(arc.eval(f64::from(candidate) / f64::from(ARC_STARTS)));
            if detour < best.0 {
                best = (detour, candidate);
            }
        }
        if best.1 > 0 {
            let start = arc.start_rad + f64::from(best.1) / f64::from(ARC_STARTS) * arc.sweep_rad;
            let arc = EllipticArc { start_rad: start, ..arc };
            let mut stroke = Stroke::new(strokes[at].pen, arc.eval(0.0), strokes[at].source());
            stroke.arc(arc);
            strokes[at] = stroke;
            turned = true;
        }
    }
    turned
}

/// The arc of a stroke that consists of one full circle or ellipse.
fn whole_turn(stroke: &Stroke) -> Option<EllipticArc> {
    let mut segments = stroke.segments();
    let (Some(Segment::Arc(arc)), None) = (segments.next(), segments.next()) else { return None };
    ((arc.sweep_rad.abs() - std::f64::consts::TAU).abs() < 1e-9).then_some(arc)
}

/// Moves the start of each closed stroke to the vertex with the lowest cost between its neighbours.
/// Returns whether any start has moved.
pub(crate) fn choose_seams(
    strokes: &mut [Stroke],
    start: Option<Point>,
    park: Option<Point>,
    cost: &dyn Cost,
) -> bool {
    let closed: Vec<usize> = (0..strokes.len()).filter(|&at| strokes[at].is_closed()).collect();
    let mut seam = vec![0; strokes.len()];
    for _ in 0..PASSES {
        let mut moved = false;
        for &at in &closed {
            let ends = |other: usize| {
                let stroke = &strokes[other];
                if stroke.is_closed() {
                    [stroke.vertices()[seam[other]]; 2]
                } else {
                    [stroke.start(), stroke.end()]
                }
            };
            let before = if at == 0 { start } else { Some(ends(at - 1)[1]) };
            let after = if at + 1 == strokes.len() { park } else { Some(ends(at + 1)[0]) };
            let detour = |vertex: &Point| {
                before.map_or(0.0, |p| cost.between(p, *vertex))
                    + after.map_or(0.0, |p| cost.between(*vertex, p))
            };
            let vertices = strokes[at].vertices();
            let mut best = (detour(&vertices[seam[at]]), seam[at]);
            for (vertex, point) in vertices.iter().enumerate() {
                let detour = detour(point);
                if detour < best.0 {
                    best = (detour, vertex);
                }
            }
            moved |= best.1 != seam[at];
            seam[at] = best.1;
        }
        if !moved {
            break;
        }
    }
    for &at in &closed {
        begin_at(&mut strokes[at], seam[at]);
    }
    seam.iter().any(|&vertex| vertex > 0)
}

/// Makes a closed stroke begin and end at another of its vertices.
fn begin_at(stroke: &mut Stroke, vertex: usize) {
    if vertex == 0 {
        return;
    }
    let mut turned = Stroke::new(stroke.pen, stroke.vertices()[vertex], stroke.source());
    stroke.segments().skip(vertex).for_each(|segment| turned.push(segment));
    stroke.segments().take(vertex).for_each(|segment| turned.push(segment));
    *stroke = turned;
}
