//! Nearest ends in the plane: a static k-d tree with deletion (Bentley 1975, 1990).
//!
//! A tree instead of a grid, because drawings are clustered: small lettering in the corner of a
//! large sheet, a thousand strokes through one point. The depth depends on the number of points
//! only.

use drawing::Point;

use super::problem::{End, Problem};

const LEAF: usize = 8;

#[derive(Clone, Copy)]
struct Node {
    first: u32,
    last: u32,
    alive: u32,
    low: Point,
    high: Point,
}

impl Node {
    /// Square of the distance from `p` to the node's box, mm².
    fn distance2(&self, p: Point) -> f64 {
        let dx = (self.low.x - p.x).max(p.x - self.high.x).max(0.0);
        let dy = (self.low.y - p.y).max(p.y - self.high.y).max(0.0);
        dx * dx + dy * dy
    }
}

/// A k-d tree of ends; node `i` has the children `2i` and `2i + 1`.
pub(crate) struct Tree {
    nodes: Vec<Node>,
    items: Vec<(End, Point)>,
    /// The index of each end in `items`, or `u32::MAX`.
    place: Vec<u32>,
}

fn distance2(a: Point, b: Point) -> f64 {
    let (dx, dy) = (a.x - b.x, a.y - b.y);
    dx * dx + dy * dy
}

impl Tree {
    pub(crate) fn new(problem: &Problem, ends: impl Iterator<Item = End>) -> Self {
        let mut items: Vec<(End, Point)> =
            ends.filter(|&end| problem.is_placed(end)).map(|end| (end, problem.point(end))).collect();
        let empty = Node { first: 0, last: 0, alive: 0, low: Point::ZERO, high: Point::ZERO };
        let mut nodes = vec![empty; 2 * (2 * items.len() / LEAF + 1).next_power_of_two()];
        build(&mut nodes, &mut items, 1, 0);
        let mut place = vec![u32::MAX; problem.end_count()];
        for (at, &(end, _)) in items.iter().enumerate() {
            place[end as usize] = at as u32;
        }
        Self { nodes, items, place }
    }

    /// Removes an end; ends that are not in the tree are ignored.
    pub(crate) fn remove(&mut self, end: End) {
        let at = std::mem::replace(&mut self.place[end as usize], u32::MAX);
        if at == u32::MAX {
            return;
        }
        let mut index = 1;
        loop {
            self.nodes[index].alive -= 1;
            if self.is_leaf(index) {
                return;
            }
            index = 2 * index + usize::from(at >= self.nodes[2 * index].last);
        }
    }

    /// The `count` ends nearest to `p`, except the two in `but`, nearest first, as
    /// (squared distance, end).
    pub(crate) fn nearest(&self, p: Point, count: usize, but: [End; 2], found: &mut Vec<(f64, End)>) {
        found.clear();
        if count > 0 {
            self.descend(1, p, count, but, found);
        }
    }

    fn is_leaf(&self, index: usize) -> bool {
        let node = &self.nodes[index];
        (node.last - node.first) as usize <= LEAF
    }

    fn descend(&self, index: usize, p: Point, count: usize, but: [End; 2], found: &mut Vec<(f64, End)>) {
        let node = &self.nodes[index];
        if node.alive == 0 || (found.len() == count && node.distance2(p) >= found[count - 1].0) {
            return;
        }
        if !self.is_leaf(index) {
            let (left, right) = (2 * index, 2 * index + 1);
            let right_first = self.nodes[right].distance2(p) < self.nodes[left].distance2(p);
            let (near, far) = if right_first { (right, left) } else { (left, right) };
            self.descend(near, p, count, but, found);
            self.descend(far, p, count, but, found);
            return;
        }
        for &(end, point) in &self.items[node.first as usize..node.last as usize] {
            if self.place[end as usize] == u32::MAX || but.contains(&end) {
                continue;
            }
            let distance = distance2(p, point);
            if found.len() == count {
                if distance >= found[count - 1].0 {
                    continue;
                }
                found.pop();
            }
            let at = found.partition_point(|&(other, _)| other <= distance);
            found.insert(at, (distance, end));
        }
    }
}

/// Splits `items`, which begin at `first`, at the median of the longer side of their box.
fn build(nodes: &mut [Node], items: &mut [(End, Point)], index: usize, first: usize) {
    let mut low = Point::new(f64::INFINITY, f64::INFINITY);
    let mut high = Point::new(f64::NEG_INFINITY, f64::NEG_INFINITY);
    for (_, p) in items.iter() {
        low = Point::new(low.x.min(p.x), low.y.min(p.y));
        high = Point::new(high.x.max(p.x), high.y.max(p.y));
    }
    nodes[index] = Node {
        first: first as u32,
        last: (first + items.len()) as u32,
        alive: items.len() as u32,
        low,
        high,
    };
    if items.len() <= LEAF {
        // The order after the partition is not specified by the standard library.
        items.sort_unstable_by_key(|&(end, _)| end);
        return;
    }
    let middle = items.len() / 2;
    if high.x - low.x >= high.y - low.y {
        items.select_nth_unstable_by(middle, |a, b| a.1.x.total_cmp(&b.1.x).then(a.0.cmp(&b.0)));
    } else {
        items.select_nth_unstable_by(middle, |a, b| a.1.y.total_cmp(&b.1.y).then(a.0.cmp(&b.0)));
    }
    let (left, right) = items.split_at_mut(middle);
    build(nodes, left, 2 * index, first);
    build(nodes, right, 2 * index + 1, first + middle);
}
