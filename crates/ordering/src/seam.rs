//! Where closed strokes begin.

use drawing::{EllipticArc, Point, Segment, Stroke};

use crate::Cost;

/// Passes over the strokes; each can only make it cheaper, and few are left to move after two or three.
const PASSES: usize = 4;

/// At how many places a circle or an ellipse of one piece may begin.
const PLACES: u32 = 32;

/// Lets each stroke that is one whole turn of a circle or an ellipse begin where that is the cheapest between its
/// neighbours; whether any has changed. The points drawn are the same.
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
        for place in 1..PLACES {
            let detour = detour(arc.eval(f64::from(place) / f64::from(PLACES)));
            if detour < best.0 {
                best = (detour, place);
            }
        }
        if best.1 > 0 {
            let start = arc.start_rad + f64::from(best.1) / f64::from(PLACES) * arc.sweep_rad;
            let arc = EllipticArc { start_rad: start, ..arc };
            let mut stroke = Stroke::new(strokes[at].pen, arc.eval(0.0), strokes[at].source());
            stroke.arc(arc);
            strokes[at] = stroke;
            turned = true;
        }
    }
    turned
}

/// The arc that a stroke is made of, if it is one and goes round once.
fn whole_turn(stroke: &Stroke) -> Option<EllipticArc> {
    let mut segments = stroke.segments();
    let (Some(Segment::Arc(arc)), None) = (segments.next(), segments.next()) else { return None };
    ((arc.sweep_rad.abs() - std::f64::consts::TAU).abs() < 1e-9).then_some(arc)
}

/// Lets each closed stroke begin at the vertex that is the cheapest between its neighbours; whether any has changed.
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

/// Turns a closed stroke so that it begins, and ends, at another of its vertices.
fn begin_at(stroke: &mut Stroke, vertex: usize) {
    if vertex == 0 {
        return;
    }
    let mut turned = Stroke::new(stroke.pen, stroke.vertices()[vertex], stroke.source());
    stroke.segments().skip(vertex).for_each(|segment| turned.push(segment));
    stroke.segments().take(vertex).for_each(|segment| turned.push(segment));
    *stroke = turned;
}
