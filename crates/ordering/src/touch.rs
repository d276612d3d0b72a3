//! Points that touch.

use drawing::Point;

/// Side of the grid squares, mm. Points in the same or in neighbouring squares touch: all points
/// within 0.5e-6 mm do, and none more than 1.5e-6 mm apart.
const SQUARE: f64 = 0.5e-6;

/// The grid square of a point.
pub(crate) fn square(p: Point) -> [i64; 2] {
    [(p.x / SQUARE).floor() as i64, (p.y / SQUARE).floor() as i64]
}

/// A number for each point; points that touch, directly or through others, get the same number.
pub(crate) fn same_points(points: &[Point]) -> Vec<u32> {
    let mut sorted: Vec<([i64; 2], u32)> = points.iter().map(|&p| square(p)).zip(0..).collect();
    sorted.sort_unstable();
    let mut sets = Sets::new(points.len());
    for pair in sorted.windows(2) {
        if pair[0].0 == pair[1].0 {
            sets.join(pair[0].1, pair[1].1);
        }
    }
    for (at, &([x, y], index)) in sorted.iter().enumerate() {
        if at > 0 && sorted[at - 1].0 == [x, y] {
            continue;
        }
        for beside in [[0, 1], [1, -1], [1, 0], [1, 1]] {
            let beside = [x.saturating_add(beside[0]), y.saturating_add(beside[1])];
            let found = sorted.partition_point(|&(square, _)| square < beside);
            if let Some(&(square, other)) = sorted.get(found)
                && square == beside
            {
                sets.join(index, other);
            }
        }
    }
    (0..points.len() as u32).map(|index| sets.find(index)).collect()
}

/// Disjoint sets (union-find), each represented by its lowest member.
pub(crate) struct Sets(Vec<u32>);

impl Sets {
    pub(crate) fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    pub(crate) fn find(&mut self, member: u32) -> u32 {
        let mut at = member;
        while self.0[at as usize] != at {
            // Path halving.
            self.0[at as usize] = self.0[self.0[at as usize] as usize];
            at = self.0[at as usize];
        }
        at
    }

    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
