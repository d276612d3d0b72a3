//! The workspace: the area that the pen can reach, as outlines.

use drawing::{Point, Rect, Vec2};

use crate::Machine;

/// The outlines of the machine's reach, machine mm: a point inside an odd number of them is
/// reachable. Empty where no joint limits it.
///
/// Along each ray from the base the reach is taken as one interval, found in steps of 1 mm up to
/// 3 m and refined to 0.01 mm: for pictures, not for checks.
pub fn reach_outlines(machine: &Machine) -> Vec<Vec<Point>> {
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
