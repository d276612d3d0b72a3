//! Which strokes of one drawing are those of another.

use std::collections::{BTreeMap, BTreeSet};

use drawing::{Affine, Point, Rect, Vec2};

use crate::replay::Polyline;

/// Points spread along a stroke whose distance from the other stroke is measured, beside its vertices and the
/// middles of its segments.
const SAMPLES: usize = 32;
/// Strokes with the same bounding box, or of the same size, that are compared with a stroke.
const CANDIDATES: usize = 64;

/// How strokes of the old side became strokes of the new one; indices into both.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matching {
    /// The same ink with the same pen.
    pub same: Vec<Pair>,
    /// The same ink with another pen.
    pub repenned: Vec<Pair>,
    /// The same shape elsewhere, or at another size.
    pub moved: Vec<Pair>,
    /// Old strokes without a new one.
    pub gone: Vec<usize>,
    /// New strokes without an old one.
    pub added: Vec<usize>,
    /// The map of all strokes that moved together, old to new; `None` if they moved one by one.
    pub map: Option<Affine>,
}

/// An old stroke and its new one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pair {
    /// Index on the old side.
    pub old: usize,
    /// Index on the new side.
    pub new: usize,
    /// Whether it is drawn in the other direction.
    pub is_reversed: bool,
}

impl Matching {
    /// Pairs the strokes of both sides, each at most once. Two strokes are the same if their bounding
    /// boxes agree within `within_mm` and each lies within `within_mm` of the other at its vertices, at the
    /// middles of its segments and at 32 points spread along it; where a closed line begins does not matter.
    /// A stroke is compared with at most 64 others of its bounding box and as many of its size.
    pub fn of(old: &[Polyline], new: &[Polyline], within_mm: f64) -> Self {
        let [olds, news] = [old, new].map(|lines| lines.iter().map(Shape::of).collect::<Vec<_>>());
        let mut open = Open { olds: (0..old.len()).collect(), news: Grid::of(&news, within_mm) };
        let is_pen = |a: usize, b: usize| old[a].pen == new[b].pen;
        let same = open.pass(&olds, &news, Affine::default(), is_pen);
        let mut matching = Self { same, ..Self::default() };
        matching.repenned = open.pass(&olds, &news, Affine::default(), |_, _| true);
        // The whole drawing elsewhere or at another size.
        if let Some(map) = whole_map(&olds, &news).filter(|_| 2 * open.olds.len() > old.len()) {
            matching.moved = open.pass(&olds, &news, map, is_pen);
            matching.map = (!matching.moved.is_empty()).then_some(map);
        }
        matching.moved.extend(open.one_by_one(&olds, &news, is_pen));
        matching.gone = open.olds;
        matching.added = open.news.free();
        matching
    }

    /// Strokes of [`Self::same`] that are drawn at another place in the order: as many as must be
    /// taken out so that the others keep their order.
    pub fn reordered(&self) -> usize {
        let mut pairs = self.same.clone();
        pairs.sort_unstable_by_key(|pair| pair.old);
        // Longest increasing subsequence, by patience sorting.
        let mut piles: Vec<usize> = Vec::new();
        for pair in &pairs {
            let at = piles.partition_point(|top| *top < pair.new);
            if at == piles.len() {
                piles.push(pair.new);
            } else {
                piles[at] = pair.new;
            }
        }
        pairs.len() - piles.len()
    }

    /// Strokes of [`Self::same`] that are drawn in the other direction.
    pub fn reversed(&self) -> usize {
        self.same.iter().filter(|pair| pair.is_reversed).count()
    }

    /// Whether both sides draw the same strokes, in any order and direction.
    pub fn is_same_ink(&self) -> bool {
        self.repenned.is_empty() && self.moved.is_empty() && self.gone.is_empty() && self.added.is_empty()
    }
}

/// A stroke with its bounding box.
struct Shape<'a> {
    points: &'a [Point],
    bounds: Rect,
}

impl<'a> Shape<'a> {
    fn of(line: &'a Polyline) -> Self {
        let first = line.points.first().copied().unwrap_or_default();
        let start = Rect::from_points(first, first);
        let bounds = line.points.iter().fold(start, |bounds, point| bounds.union_pt(*point));
        Self { points: &line.points, bounds }
    }

    /// Points spread evenly along the stroke, its vertices and the middles of its segments, in order.
    fn samples(&self) -> Vec<Point> {
        let length: f64 = self.points.windows(2).map(|ends| ends[0].distance(ends[1])).sum();
        let Some((first, last)) = self.points.first().zip(self.points.last()) else { return Vec::new() };
        let mut all = vec![*first];
        let mut walked = 0.0;
        let mut spread = 1;
        for ends in self.points.windows(2) {
            all.extend([ends[0], ends[0].midpoint(ends[1])]);
            let step = ends[0].distance(ends[1]);
            while spread < SAMPLES && step > 0.0 {
                let next = length * spread as f64 / SAMPLES as f64;
                if next > walked + step {
                    break;
                }
                all.push(ends[0].lerp(ends[1], (next - walked) / step));
                spread += 1;
            }
            walked += step;
        }
        all.push(*last);
        all
    }

    /// Whether all of these points lie within a distance of the stroke. Points in the order of a line are
    /// near segments in their order: the search for each begins where the one before was found, so that
    /// equal strokes take linear time.
    fn holds(&self, points: &[Point], within_mm: f64) -> bool {
        let Some(end) = self.points.len().checked_sub(1) else { return points.is_empty() };
        // A dot is one segment without length.
        let segments = end.max(1);
        let mut last = 0;
        points.iter().all(|point| {
            let is_near = |index: &usize| {
                to_segment(*point, self.points[*index], self.points[(index + 1).min(end)]) <= within_mm
            };
            let around = (0..segments).flat_map(|away| {
                let after = Some(last + away).filter(|index| *index < segments);
                let before = last.checked_sub(away).filter(|_| away > 0);
                after.into_iter().chain(before)
            });
            let found = { around }.find(is_near);
            last = found.unwrap_or(last);
            found.is_some()
        })
    }
}

/// Distance of a point from a segment.
fn to_segment(p: Point, a: Point, b: Point) -> f64 {
    let ab = b - a;
    let square = ab.hypot2();
    let t = if square > 0.0 { ((p - a).dot(ab) / square).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(a + t * ab)
}

/// Whether `old` moved by `map` is `new`, and if so whether it is reversed.
fn compare(old: &Shape<'_>, new: &Shape<'_>, map: Affine, within_mm: f64) -> Option<bool> {
    let samples: Vec<Point> = old.samples().into_iter().map(|point| map * point).collect();
    let moved: Vec<Point> = old.points.iter().map(|point| map * *point).collect();
    let moved = Shape { points: &moved, bounds: new.bounds };
    if !(new.holds(&samples, within_mm) && moved.holds(&new.samples(), within_mm)) {
        return None;
    }
    // Along a closed line the ends say nothing: the sense of its area does.
    let (first, last) = (*moved.points.first()?, *moved.points.last()?);
    let (start, end) = (*new.points.first()?, *new.points.last()?);
    if first.distance(last) <= within_mm && start.distance(end) <= within_mm {
        return Some(area(moved.points) * area(new.points) < 0.0);
    }
    Some(first.distance(end) + last.distance(start) < first.distance(start) + last.distance(end))
}

/// Signed area of a closed polyline.
fn area(points: &[Point]) -> f64 {
    points.windows(2).map(|ends| ends[0].to_vec2().cross(ends[1].to_vec2())).sum()
}

/// New strokes not paired yet, by the centre of their bounding box.
struct Grid {
    cell_mm: f64,
    within_mm: f64,
    cells: BTreeMap<(i64, i64), BTreeSet<usize>>,
}

impl Grid {
    fn of(shapes: &[Shape<'_>], within_mm: f64) -> Self {
        let mut grid = Self { cell_mm: 2.0 * within_mm, within_mm, cells: BTreeMap::new() };
        for (index, shape) in shapes.iter().enumerate() {
            grid.cells.entry(grid.cell(shape)).or_default().insert(index);
        }
        grid
    }

    fn cell(&self, shape: &Shape<'_>) -> (i64, i64) {
        self.cell_at(shape.bounds.center())
    }

    fn cell_at(&self, point: Point) -> (i64, i64) {
        ((point.x / self.cell_mm).floor() as i64, (point.y / self.cell_mm).floor() as i64)
    }

    /// Strokes with this bounding box.
    fn near<'a>(&'a self, shapes: &'a [Shape<'_>], bounds: Rect) -> impl Iterator<Item = usize> + 'a {
        let (x, y) = self.cell_at(bounds.center());
        let around =
            (-1..=1).flat_map(move |dx| (-1..=1).map(move |dy| (x.saturating_add(dx), y.saturating_add(dy))));
        let is_near = move |index: &usize| {
            let other = shapes[*index].bounds;
            let sides =
                [other.x0 - bounds.x0, other.y0 - bounds.y0, other.x1 - bounds.x1, other.y1 - bounds.y1];
            sides.iter().all(|difference| difference.abs() <= self.within_mm)
        };
        around.filter_map(|cell| self.cells.get(&cell)).flatten().copied().filter(is_near)
    }

    fn is_free(&self, shapes: &[Shape<'_>], index: usize) -> bool {
        self.cells.get(&self.cell(&shapes[index])).is_some_and(|cell| cell.contains(&index))
    }

    fn remove(&mut self, shapes: &[Shape<'_>], index: usize) {
        let cell = self.cell(&shapes[index]);
        if let Some(cell) = self.cells.get_mut(&cell) {
            cell.remove(&index);
        }
    }

    /// The strokes not paired, in their order.
    fn free(&self) -> Vec<usize> {
        let all: BTreeSet<usize> = self.cells.values().flatten().copied().collect();
        all.into_iter().collect()
    }
}

/// Strokes not paired yet.
struct Open {
    olds: Vec<usize>,
    news: Grid,
}

impl Open {
    /// Pairs old strokes that `map` carries onto new ones.
    fn pass(
        &mut self,
        olds: &[Shape<'_>],
        news: &[Shape<'_>],
        map: Affine,
        may: impl Fn(usize, usize) -> bool,
    ) -> Vec<Pair> {
        self.pair_up(news, |free, old| {
            let shape = &olds[old];
            let candidates = free.near(news, map.transform_rect_bbox(shape.bounds));
            candidates.filter(|new| may(old, *new)).take(CANDIDATES).find_map(|new| {
                let is_reversed = compare(shape, &news[new], map, free.within_mm)?;
                Some(Pair { old, new, is_reversed })
            })
        })
    }

    /// Pairs strokes of the same shape anywhere; first at the last displacement that was found.
    fn one_by_one(
        &mut self,
        olds: &[Shape<'_>],
        news: &[Shape<'_>],
        may: impl Fn(usize, usize) -> bool,
    ) -> Vec<Pair> {
        let within_mm = self.news.within_mm;
        let width = |index: &usize| news[*index].bounds.width();
        let mut by_width = self.news.free();
        by_width.sort_by(|a, b| width(a).total_cmp(&width(b)).then(a.cmp(b)));
        let mut last = Vec2::ZERO;
        self.pair_up(news, |free, old| {
            let shape = &olds[old];
            let bounds = shape.bounds;
            let from = by_width.partition_point(|new| width(new) < bounds.width() - within_mm);
            let of_size = by_width[from..]
                .iter()
                .copied()
                .take_while(|new| width(new) <= bounds.width() + within_mm)
                .filter(|new| (news[*new].bounds.height() - bounds.height()).abs() <= within_mm)
                .take(CANDIDATES);
            let nearby = free.near(news, bounds + last).take(CANDIDATES);
            let mut candidates =
                nearby.chain(of_size).filter(|new| free.is_free(news, *new) && may(old, *new));
            candidates.find_map(|new| {
                let shift = news[new].bounds.center() - bounds.center();
                let is_reversed = compare(shape, &news[new], Affine::translate(shift), within_mm)?;
                last = shift;
                Some(Pair { old, new, is_reversed })
            })
        })
    }

    /// Pairs each old stroke with the new one that `find` names; the others stay open.
    fn pair_up(
        &mut self,
        news: &[Shape<'_>],
        mut find: impl FnMut(&Grid, usize) -> Option<Pair>,
    ) -> Vec<Pair> {
        let mut pairs = Vec::new();
        let free = &mut self.news;
        self.olds.retain(|old| {
            let pair = find(free, *old);
            if let Some(pair) = pair {
                free.remove(news, pair.new);
                pairs.push(pair);
            }
            pair.is_none()
        });
        pairs
    }
}

/// The map of the whole old drawing's bounding box to the new one's, if it is a shift or a uniform scale.
fn whole_map(olds: &[Shape<'_>], news: &[Shape<'_>]) -> Option<Affine> {
    let bounds =
        |shapes: &[Shape<'_>]| shapes.iter().map(|shape| shape.bounds).reduce(|all, next| all.union(next));
    let (old, new) = (bounds(olds)?, bounds(news)?);
    let long = old.width().max(old.height());
    if long <= 0.0 {
        return None;
    }
    let factor = new.width().max(new.height()) / long;
    let is_uniform = (old.width() * factor - new.width()).abs() <= 0.01 * new.width().max(new.height())
        && (old.height() * factor - new.height()).abs() <= 0.01 * new.width().max(new.height());
    (factor > 0.0 && is_uniform).then(|| {
        let center = Affine::translate(new.center().to_vec2()) * Affine::scale(factor);
        center * Affine::translate(-old.center().to_vec2())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(pen: u16, points: &[(f64, f64)]) -> Polyline {
        Polyline { pen, points: points.iter().map(|&(x, y)| Point::new(x, y)).collect() }
    }

    fn triangle(at: f64) -> Polyline {
        line(1, &[(at, 0.0), (at + 3.0, 0.0), (at, 4.0), (at, 0.0)])
    }

    #[test]
    fn equal_drawings_match_in_order() {
        let all = [line(1, &[(0.0, 0.0), (5.0, 0.0)]), triangle(9.0), line(2, &[(1.0, 1.0)])];
        let matching = Matching::of(&all, &all, 0.01);
        assert!(matching.is_same_ink());
        assert_eq!((matching.same.len(), matching.reordered(), matching.reversed()), (3, 0, 0));
    }

    #[test]
    fn reversed_and_reordered_strokes_are_the_same_ink() {
        let old = [line(1, &[(0.0, 0.0), (5.0, 0.0)]), triangle(9.0), line(1, &[(0.0, 7.0), (5.0, 7.0)])];
        let turned = line(1, &[(0.0, 4.0), (3.0, 0.0), (0.0, 0.0), (0.0, 4.0)]);
        let turned =
            Polyline { pen: 1, points: turned.points.iter().map(|p| *p + Vec2::new(9.0, 0.0)).collect() };
        let new = [line(1, &[(5.0, 7.0), (0.0, 7.0)]), old[0].clone(), turned];
        let matching = Matching::of(&old, &new, 0.01);
        assert!(matching.is_same_ink(), "{matching:?}");
        // The third stroke became the first; it and the triangle are drawn backwards.
        assert_eq!((matching.reordered(), matching.reversed()), (1, 2));
    }

    #[test]
    fn moved_repenned_gone_and_added_strokes() {
        let fixed = |k: usize| line(1, &[(10.0 * k as f64, 50.0), (10.0 * k as f64 + 1.0, 60.0 + k as f64)]);
        let mut old: Vec<Polyline> = (0..6).map(fixed).collect();
        let mut new = old.clone();
        old.extend([
            triangle(0.0),
            line(1, &[(0.0, 20.0), (9.0, 21.0)]),
            line(3, &[(2.0, 30.0), (9.0, 30.0)]),
        ]);
        new.extend([
            triangle(20.0),
            line(2, &[(0.0, 20.0), (9.0, 21.0)]),
            line(3, &[(2.0, 40.0), (2.0, 49.0)]),
        ]);
        let matching = Matching::of(&old, &new, 0.01);
        assert_eq!(matching.same.len(), 6);
        assert_eq!(matching.moved, [Pair { old: 6, new: 6, is_reversed: false }]);
        assert_eq!(matching.repenned, [Pair { old: 7, new: 7, is_reversed: false }]);
        assert_eq!((matching.gone, matching.added), (vec![8], vec![8]));
    }

    #[test]
    fn scaled_drawing_moved_as_a_whole() {
        let old = [triangle(0.0), triangle(9.0), line(1, &[(0.0, 7.0), (5.0, 7.0)])];
        let map = Affine::translate((100.0, 3.0)) * Affine::scale(1.5);
        let new = old
            .clone()
            .map(|line| Polyline { pen: 1, points: line.points.iter().map(|p| map * *p).collect() });
        let matching = Matching::of(&old, &new, 0.01);
        assert_eq!(matching.moved.len(), 3);
        let found = matching.map.unwrap().as_coeffs();
        assert!(found.iter().zip(map.as_coeffs()).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
    }

    #[test]
    fn bent_stroke_with_the_same_box_is_another() {
        let old = [line(1, &[(0.0, 0.0), (5.0, 5.0)])];
        let new = [line(1, &[(0.0, 0.0), (5.0, 0.0), (5.0, 5.0)])];
        let matching = Matching::of(&old, &new, 0.1);
        assert_eq!((matching.gone, matching.added), (vec![0], vec![0]));
    }

    #[test]
    fn one_vertex_of_many_makes_another_stroke() {
        let wave = |k: i32| Point::new(f64::from(k), f64::from(k % 7));
        let old = Polyline { pen: 1, points: (0..500).map(wave).collect() };
        for changed in 1..499 {
            let mut new = old.clone();
            new.points[changed].y += 0.1;
            // Inside the bounding box of the whole.
            new.points[changed].y = new.points[changed].y.min(5.9);
            let matching = Matching::of(std::slice::from_ref(&old), &[new], 0.01);
            assert_eq!((matching.gone.len(), matching.added.len()), (1, 1), "vertex {changed}");
        }
    }

    #[test]
    fn long_strokes_are_compared_in_linear_time() {
        let spiral = |k: i32| {
            let t = f64::from(k) * 0.01;
            Point::new(t * libm::cos(t), t * libm::sin(t))
        };
        let old = Polyline { pen: 1, points: (0..200_000).map(spiral).collect() };
        let mut new = old.clone();
        new.points.reverse();
        let matching = Matching::of(&[old], &[new], 0.01);
        assert_eq!((matching.same.len(), matching.reversed()), (1, 1));
    }

    #[test]
    fn many_strokes_at_one_place_are_paired_in_linear_time() {
        let dots = vec![line(1, &[(1.0, 1.0)]); 50_000];
        let matching = Matching::of(&dots, &dots[..49_000], 0.01);
        assert_eq!((matching.same.len(), matching.gone.len()), (49_000, 1_000));
    }
}
