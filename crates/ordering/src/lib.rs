//! The order of strokes: merge, remove duplicates, reorder, reverse, by a cost that is handed in.
//!
//! [`optimize`] takes a drawing and gives back the same ink in an order, and in directions, that cost less to travel
//! with the pen up. What a move costs is the caller's [`Cost`]: the time a machine needs, or millimetres. Candidates
//! for the next stroke come from the plane, gains from the cost.
//!
//! Strokes keep to their pen: all strokes of one pen are drawn before the next pen is taken. The result depends on
//! the arguments alone, to the last bit: effort is counted in moves, ties go to the lower index, and the only
//! arithmetic is `+ - * /` and the square root.

mod dedupe;
mod merge;
mod report;
mod seam;
mod search;
mod touch;

use drawing::{Drawing, Pen, Point, Stroke};

pub use report::Report;
use search::{End, Problem};

/// A point in the cost function's own terms: joints for a machine, the plane itself without one.
pub type CostPoint = [f64; 2];

/// The cost of a pen-up move between two points, mm; in seconds for a machine, in millimetres without one.
///
/// It must be symmetric, not negative, and the same for the same points. Any function or closure of two points is a
/// cost. The search asks for the same points many times: where finding out what a point means is dear (inverse
/// kinematics), a cost says so once in `to_cost_space` and compares places.
pub trait Cost {
    /// The point in the cost's own terms.
    fn to_cost_space(&self, point: Point) -> CostPoint;

    /// What the move from one place to another (or back) costs.
    fn between_cost_points(&self, a: CostPoint, b: CostPoint) -> f64;

    /// What the move from `a` to `b` (or back) costs.
    fn between(&self, a: Point, b: Point) -> f64 {
        self.between_cost_points(self.to_cost_space(a), self.to_cost_space(b))
    }
}

impl<F: Fn(Point, Point) -> f64 + Sync> Cost for F {
    fn to_cost_space(&self, point: Point) -> CostPoint {
        [point.x, point.y]
    }

    fn between_cost_points(&self, a: CostPoint, b: CostPoint) -> f64 {
        self(Point::from((a[0], a[1])), Point::from((b[0], b[1])))
    }
}

/// The distance in the plane, mm: the [`Cost`] where there is no machine.
pub fn distance(a: Point, b: Point) -> f64 {
    let (dx, dy) = (a.x - b.x, a.y - b.y);
    (dx * dx + dy * dy).sqrt()
}

/// What [`optimize`] may do, and how hard it tries.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// 0: good starts improved until nothing gains. 1, 2 (the default), 3: then searched on, eight times as long each.
    pub effort: u8,
    /// Removes strokes all of whose pieces are drawn by other strokes of the same pen.
    pub dedupe: bool,
    /// Joins strokes that touch at their ends (within 1e-6 mm) into the fewest possible.
    pub merge: bool,
    /// No stroke is drawn from its other end.
    pub keep_direction: bool,
    /// Where the pen is before the first stroke; the first stroke costs nothing to reach if nothing is said.
    pub start: Option<Point>,
    /// Where the pen goes after the last stroke; nowhere if nothing is said.
    pub park: Option<Point>,
    /// The order of the pens. Pens not named come after those that are; without it, the file's order.
    pub pen_order: Option<Vec<Pen>>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            effort: 2,
            dedupe: false,
            merge: true,
            keep_direction: false,
            start: None,
            park: None,
            pen_order: None,
        }
    }
}

/// Reorders the strokes of a drawing so that they cost less to travel between, and says what that brought.
///
/// All strokes of a pen come together, in the order in which the pens first appear, or in `pen_order`. The same
/// pieces are drawn with the same pens, each forwards or backwards. The travel, by `cost`, is never dearer than that
/// of the file's order with the pens put together.
pub fn optimize(drawing: Drawing, cost: &dyn Cost, options: &Options) -> (Drawing, Report) {
    let strokes_before = drawing.strokes.len();
    let (travel_cost_before, travel_mm_before) = report::travel(&drawing.strokes, cost, options);
    let mut pens = by_pen(drawing.strokes, options.pen_order.as_deref());
    if options.dedupe {
        pens = pens.into_iter().map(dedupe::dedupe).collect();
    }
    let in_file_order: Vec<Stroke> = pens.iter().flatten().cloned().collect();
    let strokes_without_duplicates = in_file_order.len();
    if options.merge {
        pens = pens.into_iter().map(|strokes| merge::merge(strokes, options.keep_direction)).collect();
    }
    let ordered = search_each_pen(pens, cost, options);

    let (limit, _) = report::travel(&in_file_order, cost, options);
    let (found, _) = report::travel(&ordered, cost, options);
    // A cost that is not a number is no reason to reorder anything, and a rounding error none not to.
    let strokes = if found <= limit + 1e-9 * limit { ordered } else { in_file_order };
    let (travel_cost_after, travel_mm_after) = report::travel(&strokes, cost, options);
    let report = Report {
        strokes_before,
        strokes_after: strokes.len(),
        merged: strokes_without_duplicates - strokes.len(),
        duplicates_removed: strokes_before - strokes_without_duplicates,
        travel_cost_before,
        travel_cost_after,
        travel_mm_before,
        travel_mm_after,
    };
    (Drawing { strokes }, report)
}

/// The strokes of each pen in the file's order, the pens in the order they are asked for or first seen.
fn by_pen(strokes: Vec<Stroke>, pen_order: Option<&[Pen]>) -> Vec<Vec<Stroke>> {
    let mut pens = pen_order.unwrap_or_default().to_vec();
    let mut groups: Vec<Vec<Stroke>> = pens.iter().map(|_| Vec::new()).collect();
    for stroke in strokes {
        let at = pens.iter().position(|&pen| pen == stroke.pen).unwrap_or_else(|| {
            pens.push(stroke.pen);
            groups.push(Vec::new());
            pens.len() - 1
        });
        groups[at].push(stroke);
    }
    groups.retain(|group| !group.is_empty());
    groups
}

/// Orders the strokes of each pen for itself, from where the pen before it ended.
fn search_each_pen(pens: Vec<Vec<Stroke>>, cost: &dyn Cost, options: &Options) -> Vec<Stroke> {
    let mut ordered: Vec<Stroke> = Vec::new();
    let last = pens.len().saturating_sub(1);
    let all = pens.iter().map(Vec::len).sum();
    for (at, strokes) in pens.into_iter().enumerate() {
        let start = ordered.last().map_or(options.start, |stroke| Some(stroke.end()));
        let park = if at == last { options.park } else { None };
        let mut strokes = search(strokes, start, park, cost, options, (options.effort, all));
        // Where closed strokes begin, they are reached elsewhere: another order may be better now.
        let choose = |strokes: &mut [Stroke]| {
            let turned = seam::turn_circles(strokes, start, park, cost);
            seam::choose_seams(strokes, start, park, cost) || turned
        };
        if choose(&mut strokes) {
            strokes = search(strokes, start, park, cost, options, (options.effort.min(1), all));
            choose(&mut strokes);
        }
        ordered.append(&mut strokes);
    }
    ordered
}

/// Orders the strokes of a pen; closed strokes keep where they begin. The effort is that for so many strokes in all, of
/// which this pen gets its share.
fn search(
    strokes: Vec<Stroke>,
    start: Option<Point>,
    park: Option<Point>,
    cost: &dyn Cost,
    options: &Options,
    effort: (u8, usize),
) -> Vec<Stroke> {
    let ends = strokes.iter().map(|stroke| [stroke.start(), stroke.end()]);
    let problem = Problem::new(ends, start, park, options.keep_direction, cost);
    let tour = search::solve(&problem, effort);
    in_order_of(strokes, &tour)
}

/// The strokes in the order of a tour, which begins with the depot, turned to be entered as it says.
fn in_order_of(strokes: Vec<Stroke>, tour: &[End]) -> Vec<Stroke> {
    let mut strokes: Vec<Option<Stroke>> = strokes.into_iter().map(Some).collect();
    let in_turn = tour.iter().skip(1).filter_map(|&entry| {
        let mut stroke = strokes[entry as usize / 2 - 1].take()?;
        // A closed stroke ends where it begins: there is no reason to turn it.
        if entry % 2 == 1 && !stroke.is_closed() {
            stroke.reverse();
        }
        Some(stroke)
    });
    in_turn.collect()
}
