//! The problem: strokes reduced to their two ends, and a depot.

use drawing::Point;

use crate::{Cost, CostPoint};

/// One end of a stroke: stroke `s` has the ends `2s` and `2s + 1`, so the other end of `e` is
/// `e ^ 1`.
pub(crate) type End = u32;

/// The other end of the same stroke.
pub(crate) fn mate(end: End) -> End {
    end ^ 1
}

/// Ends of strokes, and the cost of a pen-up move between two ends.
///
/// An open path is a closed tour through one more stroke, the **depot** (number 0). The pen leaves
/// it by end 1 (the start) and returns to end 0 (the park position). Moves to an end of the depot
/// that is not placed cost nothing. So one search covers paths with and without a fixed start and
/// a fixed end.
pub(crate) struct Problem<'a> {
    points: Vec<Point>,
    /// The points mapped by [`Cost::to_cost_space`].
    cost_points: Vec<CostPoint>,
    placed: [bool; 2],
    /// Strokes may not be reversed: every move leads from an odd end to an even one.
    pub(crate) one_way: bool,
    cost: &'a dyn Cost,
}

impl<'a> Problem<'a> {
    /// `strokes` are the ends of the strokes in file order; they become the strokes 1, 2, ….
    pub(crate) fn new(
        strokes: impl Iterator<Item = [Point; 2]>,
        start: Option<Point>,
        park: Option<Point>,
        one_way: bool,
        cost: &'a dyn Cost,
    ) -> Self {
        let mut points = vec![park.unwrap_or_default(), start.unwrap_or_default()];
        points.extend(strokes.flatten());
        let cost_points = points.iter().map(|point| cost.to_cost_space(*point)).collect();
        Self { points, cost_points, placed: [park.is_some(), start.is_some()], one_way, cost }
    }

    /// A problem with other strokes and the same depot and cost.
    pub(crate) fn with_strokes(&self, strokes: impl Iterator<Item = [Point; 2]>) -> Self {
        let mut points = self.points[..2].to_vec();
        points.extend(strokes.flatten());
        let cost_points = points.iter().map(|point| self.cost.to_cost_space(*point)).collect();
        Self { points, cost_points, ..*self }
    }

    /// Replaces the ends of a stroke.
    pub(crate) fn set_ends(&mut self, stroke: usize, ends: [Point; 2]) {
        self.points[2 * stroke..2 * stroke + 2].copy_from_slice(&ends);
        self.cost_points[2 * stroke..2 * stroke + 2]
            .copy_from_slice(&ends.map(|point| self.cost.to_cost_space(point)));
    }

    /// The number of strokes, including the depot.
    pub(crate) fn stroke_count(&self) -> usize {
        self.points.len() / 2
    }

    /// The number of ends, including those of the depot.
    pub(crate) fn end_count(&self) -> usize {
        self.points.len()
    }

    pub(crate) fn point(&self, end: End) -> Point {
        self.points[end as usize]
    }

    /// Whether an end has a position: all do, except ends of the depot without start or park
    /// position.
    pub(crate) fn is_placed(&self, end: End) -> bool {
        end > 1 || self.placed[end as usize]
    }

    /// The cost of the pen-up move between two ends, in the unit of the cost function.
    pub(crate) fn cost(&self, a: End, b: End) -> f64 {
        if self.is_placed(a) && self.is_placed(b) {
            self.cost.between_cost_points(self.cost_points[a as usize], self.cost_points[b as usize])
        } else {
            0.0
        }
    }

    /// The tour in file order.
    pub(crate) fn file_order(&self) -> Vec<End> {
        (0..self.end_count() as End).step_by(2).collect()
    }

    /// The cost of a tour, given by the ends at which its strokes are entered.
    pub(crate) fn tour_cost(&self, tour: &[End]) -> f64 {
        let next = tour.iter().cycle().skip(1);
        tour.iter().zip(next).map(|(&from, &to)| self.cost(mate(from), to)).sum()
    }

    /// Rotates (and reverses) a tour so that it begins with the depot, entered at the park position
    /// and left at the start.
    pub(crate) fn canonical(tour: &mut [End]) {
        let Some(at) = tour.iter().position(|&end| end < 2) else { return };
        tour.rotate_left(at);
        if tour[0] == 1 {
            tour[1..].reverse();
            for end in tour {
                *end = mate(*end);
            }
        }
    }
}
