//! The workspace: the area that the pen can reach, as outlines.

use std::collections::BTreeMap;

use drawing::{Point, Rect, Vec2};

use crate::Machine;

/// The outlines of the machine's reach, machine mm: a point inside an odd number of them is
/// reachable. Empty where no joint limits it.
///
/// Along each ray from the base the reach is taken as one interval, found in steps of 1 mm up to
/// 3 m and refined to 0.01 mm. Mechanisms without a base are sampled on a grid of 240 x 240 points over
/// their [`crate::Mechanism::reach_box`]. For pictures, not for checks.
pub fn reach_outlines(machine: &Machine) -> Vec<Vec<Point>> {
    if machine.mechanism().base().is_none()
        && let Some(bounds) = machine.mechanism().reach_box()
    {
        return Grid::of(machine, bounds).outlines();
    }
    let Some(base) = machine.mechanism().base() else {
        let joints = machine.parts().joints;
        let bed = Rect::new(joints[0].min, joints[1].min, joints[0].max, joints[1].max);
        if !bed.is_finite() {
            return Vec::new();
        }
        return vec![vec![
            Point::new(bed.x0, bed.y0),
            Point::new(bed.x1, bed.y0),
            Point::new(bed.x1, bed.y1),
            Point::new(bed.x0, bed.y1),
        ]];
    };
    let reachable = |p: Point| machine.check_point(p).is_ok();
    let mut inner = Vec::new();
    let mut outer = Vec::new();
    let mut whole_turn = true;
    for degree in 0..=360 {
        let (sin, cos) = libm::sincos(f64::from(degree) * std::f64::consts::PI / 180.0);
        let at = |r: f64| base + r * Vec2::new(cos, sin);
        let Some((near, far)) = reach_along(&|r| reachable(at(r))) else {
            whole_turn = false;
            continue;
        };
        inner.push(at(near));
        outer.push(at(far));
    }
    if whole_turn {
        return vec![outer, inner];
    }
    inner.reverse();
    outer.extend(inner);
    vec![outer]
}

/// Grid points each way.
const GRID: usize = 240;

/// A grid of points, and which of them are within reach. Its border lies outside of the box.
struct Grid<'a> {
    machine: &'a Machine,
    corner: Point,
    step: Vec2,
    within: Vec<bool>,
}

/// An edge of the grid: from a point to the next one to the right (`false`) or up (`true`).
type Edge = (usize, usize, bool);

impl<'a> Grid<'a> {
    fn of(machine: &'a Machine, bounds: Rect) -> Self {
        let parts = (GRID - 3) as f64;
        let step = Vec2::new(bounds.width() / parts, bounds.height() / parts);
        let corner = Point::new(bounds.x0, bounds.y0) - step;
        let mut grid = Self { machine, corner, step, within: Vec::new() };
        let points = (0..GRID * GRID).map(|k| (k % GRID, k / GRID));
        let border = |k: usize| k == 0 || k == GRID - 1;
        grid.within = points
            .map(|(x, y)| !border(x) && !border(y) && machine.check_point(grid.at(x, y)).is_ok())
            .collect();
        grid
    }

    fn at(&self, x: usize, y: usize) -> Point {
        self.corner + Vec2::new(x as f64 * self.step.x, y as f64 * self.step.y)
    }

    fn is_within(&self, x: usize, y: usize) -> bool {
        self.within[y * GRID + x]
    }

    /// Marching squares: in each cell, lines between the edges on which the boundary passes.
    fn outlines(&self) -> Vec<Vec<Point>> {
        let mut next: BTreeMap<Edge, Vec<Edge>> = BTreeMap::new();
        for (x, y) in (0..(GRID - 1) * (GRID - 1)).map(|k| (k % (GRID - 1), k / (GRID - 1))) {
            // Counterclockwise from the lower edge.
            let corners = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)].map(|(x, y)| self.is_within(x, y));
            let edges = [(x, y, false), (x + 1, y, true), (x, y + 1, false), (x, y, true)];
            let crossed: Vec<Edge> =
                (0..4).filter(|k| corners[*k] != corners[(k + 1) % 4]).map(|k| edges[k]).collect();
            // Two parts that touch in a corner of four crossings stay apart.
            let pairs = if crossed.len() == 4 && corners[0] {
                vec![(crossed[0], crossed[3]), (crossed[1], crossed[2])]
            } else {
                crossed.chunks(2).map(|pair| (pair[0], pair[1])).collect()
            };
            for (a, b) in pairs {
                next.entry(a).or_default().push(b);
                next.entry(b).or_default().push(a);
            }
        }
        let mut outlines = Vec::new();
        while let Some((&first, _)) = next.first_key_value() {
            let (mut outline, mut edge) = (Vec::new(), first);
            while let Some(neighbours) = next.remove(&edge) {
                outline.push(self.crossing(edge));
                let Some(following) = neighbours.into_iter().find(|edge| next.contains_key(edge)) else {
                    break;
                };
                edge = following;
            }
            outlines.push(outline);
        }
        outlines
    }

    /// Where the boundary crosses an edge.
    fn crossing(&self, (x, y, up): Edge) -> Point {
        let (mut inside, mut outside) =
            (self.at(x, y), if up { self.at(x, y + 1) } else { self.at(x + 1, y) });
        if !self.is_within(x, y) {
            std::mem::swap(&mut inside, &mut outside);
        }
        for _ in 0..8 {
            let middle = inside.midpoint(outside);
            if self.machine.check_point(middle).is_ok() { inside = middle } else { outside = middle }
        }
        inside
    }
}

/// The first and the last distance at which `reachable` holds, mm.
fn reach_along(reachable: &dyn Fn(f64) -> bool) -> Option<(f64, f64)> {
    let samples = || (1..3000).map(f64::from);
    let first = samples().find(|r| reachable(*r))?;
    let last = samples().skip(first as usize).take_while(|r| reachable(*r)).last().unwrap_or(first);
    let border = |mut inside: f64, mut outside: f64| {
        while (inside - outside).abs() > 0.01 {
            let middle = 0.5 * (inside + outside);
            if reachable(middle) { inside = middle } else { outside = middle }
        }
        inside
    };
    Some((border(first, first - 1.0), border(last, last + 1.0)))
}
