//! Stroke ordering: merges, deduplicates, reorders and reverses strokes to reduce pen-up travel.
//!
//! [`optimize`] takes a drawing and returns the same ink in an order, and in directions, with less
//! pen-up travel. The caller defines the [`Cost`] of a pen-up move: the time on a machine, or mm.
//! Candidates for the next stroke are the nearest ones in the plane; gains are computed with the
//! cost.
//!
//! All strokes of a pen are drawn before the next pen. The result is deterministic to the last bit:
//! effort is counted in moves, ties go to the lower index, and the only arithmetic is `+ - * /` and
//! the square root.
//!
//! ```
//! use drawing::{Drawing, Pen, Point, Span, Stroke};
//! use ordering::{Options, optimize};
//!
//! let line = |x: f64| {
//!     let ends = vec![Point::new(x, 0.0), Point::new(x, 10.0)];
//!     Stroke::polyline(Pen(1), ends, Span::default()).expect("a polyline has points")
//! };
//! let drawing = Drawing::from(vec![line(0.0), line(20.0), line(10.0)]);
//! // Two independent axes at 100 mm/s: a move takes as long as its longer component.
//! let seconds = |a: Point, b: Point| f64::max((a.x - b.x).abs(), (a.y - b.y).abs()) / 100.0;
//! let start = Some(Point::new(0.0, 0.0));
//!
//! let (ordered, report) = optimize(drawing, &seconds, &Options { start, ..Options::default() });
//! assert_eq!(ordered.strokes.iter().map(|s| s.start().x).collect::<Vec<_>>(), [0.0, 10.0, 20.0]);
//! // The lines are drawn up, down, up: two moves of 10 mm instead of one of 20 and one of 10 mm.
//! assert!((report.travel_cost_before - 0.3).abs() < 1e-12);
//! assert!((report.travel_cost_after - 0.2).abs() < 1e-12);
//! ```

mod cost;
mod dedupe;
mod merge;
mod options;
mod progress;
mod report;
mod seam;
mod search;
mod touch;

use drawing::{Drawing, Pen, Point, Stroke, Strokes};

pub use cost::{Cost, CostPoint};
pub use dedupe::without_duplicates;
/// The distance in the plane, mm: the [`Cost`] without a machine.
pub use drawing::distance;
pub use options::Options;
use progress::Progress;
pub use report::Report;
use search::{End, Problem};

/// Reorders the strokes of a drawing to reduce pen-up travel, and reports the effect.
///
/// Strokes are grouped by pen, in `pen_order` or in the order of the pens' first strokes. The same
/// segments are drawn with the same pens, each forwards or backwards. The cost of travel is never
/// higher than in file order with the pens grouped. If the cost is not finite, file order is kept.
pub fn optimize(drawing: Drawing, cost: &dyn Cost, options: &Options) -> (Drawing, Report) {
    optimize_with_progress(drawing, cost, options, &|_| {})
}

/// As [`optimize()`]; `progress` is called now and then with the share of the search that is done.
pub fn optimize_with_progress(
    drawing: Drawing,
    cost: &dyn Cost,
    options: &Options,
    progress: &dyn Fn(f64),
) -> (Drawing, Report) {
    let strokes = drawing.strokes.to_vec();
    let strokes_before = strokes.len();
    let (travel_cost_before, travel_mm_before) = report::travel(&strokes, cost, options);
    let mut pens = in_file_order(strokes, options);
    let (limit, mm_in_file_order) = report::travel(pens.iter().flatten(), cost, options);
    let strokes_without_duplicates = pens.iter().map(Vec::len).sum::<usize>();
    if options.merge {
        pens = pens.into_iter().map(|strokes| merge::merge(strokes, options.keep_direction)).collect();
    }
    let ordered = search_each_pen(pens, cost, options, Progress::new(progress));

    let (found, found_mm) = report::travel(&ordered, cost, options);
    // With NaN the comparison is false and file order is kept. A rounding error must not decide.
    let (strokes, travel_cost_after, travel_mm_after) = if found <= limit + 1e-9 * limit {
        drop(drawing);
        (Strokes::from(ordered), found, found_mm)
    } else {
        // Made again: kept during the search, which seldom finds nothing, it would take memory.
        drop(ordered);
        let strokes = in_file_order(drawing.strokes.into_iter().collect(), options);
        (strokes.into_iter().flatten().collect(), limit, mm_in_file_order)
    };
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

/// The strokes of each pen in file order, without duplicates if the options say so.
fn in_file_order(strokes: Vec<Stroke>, options: &Options) -> Vec<Vec<Stroke>> {
    let pens = by_pen(strokes, options.pen_order.as_deref());
    if options.dedupe { pens.into_iter().map(dedupe::dedupe).collect() } else { pens }
}

/// The strokes of each pen in file order; pens as in `pen_order`, then by their first stroke.
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

/// The share of the first of two searches of a pen's strokes: eight times the work of the second.
const FIRST_SEARCH: f64 = 0.9;

/// Orders the strokes of each pen separately, starting where the previous pen ended.
fn search_each_pen(
    pens: Vec<Vec<Stroke>>,
    cost: &dyn Cost,
    options: &Options,
    progress: Progress<'_>,
) -> Vec<Stroke> {
    let mut ordered: Vec<Stroke> = Vec::new();
    let last = pens.len().saturating_sub(1);
    let all: usize = pens.iter().map(Vec::len).sum();
    let mut before = 0.0;
    for (at, strokes) in pens.into_iter().enumerate() {
        let start = ordered.last().map_or(options.start, |stroke| Some(stroke.end()));
        let park = if at == last { options.park } else { None };
        let after = before + strokes.len() as f64 / all as f64;
        let progress = progress.part(before, after);
        before = after;
        let first = progress.part(0.0, FIRST_SEARCH);
        let mut strokes = search(strokes, start, park, cost, options, (options.effort, all), first);
        // New start points of closed strokes may make another order better.
        let choose = |strokes: &mut [Stroke]| {
            let turned = seam::turn_circles(strokes, start, park, cost);
            seam::choose_seams(strokes, start, park, cost) || turned
        };
        if choose(&mut strokes) {
            let second = progress.part(FIRST_SEARCH, 1.0);
            strokes = search(strokes, start, park, cost, options, (options.effort.min(1), all), second);
            choose(&mut strokes);
        }
        ordered.append(&mut strokes);
    }
    ordered
}

/// Orders the strokes of one pen; start points of closed strokes are kept. `effort` is the effort
/// level and the number of strokes of all pens: each pen gets its share of the work.
fn search(
    strokes: Vec<Stroke>,
    start: Option<Point>,
    park: Option<Point>,
    cost: &dyn Cost,
    options: &Options,
    effort: (u8, usize),
    progress: Progress<'_>,
) -> Vec<Stroke> {
    let ends = strokes.iter().map(|stroke| [stroke.start(), stroke.end()]);
    let problem = Problem::new(ends, start, park, options.keep_direction, cost);
    let tour = search::solve(&problem, effort, progress);
    in_order_of(strokes, &tour)
}

/// The strokes in the order of a tour that begins with the depot, reversed where the tour enters
/// them at their end.
fn in_order_of(strokes: Vec<Stroke>, tour: &[End]) -> Vec<Stroke> {
    let mut strokes: Vec<Option<Stroke>> = strokes.into_iter().map(Some).collect();
    let in_turn = tour.iter().skip(1).filter_map(|&entry| {
        let mut stroke = strokes[entry as usize / 2 - 1].take()?;
        // Reversing a closed stroke does not change its ends.
        if entry % 2 == 1 && !stroke.is_closed() {
            stroke.reverse();
        }
        Some(stroke)
    });
    in_turn.collect()
}
