//! Convex polygons in the plane.

/// A point of the plane.
pub(super) type Vertex = [f64; 2];

/// Largest number of corners; beyond it the corners with the least area are removed.
const CORNERS: usize = 24;

/// A convex polygon with its corners in counterclockwise order; without corners it is empty.
#[derive(Clone, Debug, Default)]
pub(super) struct Polygon(pub(super) Vec<Vertex>);

impl Polygon {
    /// Its edges as constraints `x p + y q <= offset` on a point (p, q) inside.
    pub(super) fn edges(&self) -> impl Iterator<Item = [f64; 3]> {
        let edges = self.0.iter().zip(self.0.iter().cycle().skip(1));
        edges.map(|(p, q)| {
            // The interior is to the left of the edge.
            let (x, y) = (q[1] - p[1], p[0] - q[0]);
            [x, y, x * p[0] + y * p[1]]
        })
    }

    /// Intersects with the half-plane `x p + y q <= offset`.
    pub(super) fn clip(&mut self, x: f64, y: f64, offset: f64) {
        let off = |p: &Vertex| x * p[0] + y * p[1] - offset;
        let scale = self.0.iter().map(|p| (x * p[0]).abs() + (y * p[1]).abs()).fold(offset.abs(), f64::max);
        let slack = 1e-13 * scale;
        if self.0.iter().all(|p| off(p) <= slack) {
            return;
        }
        let corners = std::mem::take(&mut self.0);
        for (p, q) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let (d0, d1) = (off(p), off(q));
            if d0 <= slack {
                self.0.push(*p);
            }
            if (d0 > slack && d1 < -slack) || (d0 < -slack && d1 > slack) {
                let share = d0 / (d0 - d1);
                self.0.push([p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])]);
            }
        }
    }

    /// Removes bounds `offset - x p - y q` that are nowhere on this polygon below another one.
    pub(super) fn keep_tight(&self, bounds: &mut Vec<[f64; 3]>) {
        let at = |[x, y, offset]: &[f64; 3], p: &Vertex| offset - x * p[0] - y * p[1];
        let mut kept: Vec<[f64; 3]> = Vec::with_capacity(bounds.len());
        for bound in bounds.iter() {
            let above = |one: &[f64; 3], other: &[f64; 3]| self.0.iter().all(|p| at(one, p) >= at(other, p));
            if kept.iter().any(|other| above(bound, other)) {
                continue;
            }
            kept.retain(|other| !above(other, bound));
            kept.push(*bound);
        }
        *bounds = kept;
    }

    /// The largest p on the ray `q = slope p`; `None` if the ray does not meet the polygon.
    pub(super) fn farthest(&self, slope: f64) -> Option<f64> {
        let corners = &self.0;
        let mut far: Option<f64> = None;
        for (p, q) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let (d0, d1) = (p[1] - slope * p[0], q[1] - slope * q[0]);
            if (d0 <= 0.0) != (d1 <= 0.0) {
                let b = p[0] + (q[0] - p[0]) * d0 / (d0 - d1);
                far = Some(far.map_or(b, |far| far.max(b)));
            }
        }
        far
    }

    /// Removes the corners with the least area until at most [`CORNERS`] are left.
    pub(super) fn simplify(&mut self) {
        while self.0.len() > CORNERS {
            let count = self.0.len();
            let area = |k: usize| {
                let (a, b, c) = (self.0[(k + count - 1) % count], self.0[k], self.0[(k + 1) % count]);
                ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
            };
            let least = (0..count).min_by(|a, b| area(*a).total_cmp(&area(*b)));
            if let Some(least) = least {
                self.0.remove(least);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn inside(set: &Polygon, [p, q]: Vertex) -> bool {
        !set.0.is_empty() && set.edges().all(|[x, y, offset]| x * p + y * q <= offset)
    }

    proptest! {
        /// What is removed violates a constraint; what is left satisfies all of them.
        #[test]
        fn clipped_polygon_satisfies_constraints(
            conditions in proptest::collection::vec((-3.0..3.0f64, -3.0..3.0f64, -0.5..2.0f64), 0..40),
            points in proptest::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 20),
        ) {
            let mut set = Polygon(vec![[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]);
            for (x, y, offset) in &conditions {
                set.clip(*x, *y, *offset);
            }
            let whole = set.clone();
            set.simplify();
            prop_assert!(set.0.len() <= CORNERS);
            for (p, q) in points {
                let fulfils = |slack: f64| conditions.iter().all(|(x, y, offset)| x * p + y * q <= offset + slack);
                prop_assert!(!inside(&whole, [p, q]) || fulfils(1e-9));
                prop_assert!(inside(&whole, [p, q]) || !fulfils(-1e-6));
                prop_assert!(!inside(&set, [p, q]) || fulfils(1e-9));
            }
        }
    }

    #[test]
    fn ray_through_square() {
        let square = Polygon(vec![[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
        assert_eq!(square.farthest(0.5), Some(2.0));
        assert_eq!(square.farthest(4.0), Some(0.5));
        let beside = Polygon(vec![[1.0, 5.0], [2.0, 5.0], [2.0, 6.0]]);
        assert_eq!(beside.farthest(0.1), None);
    }
}
