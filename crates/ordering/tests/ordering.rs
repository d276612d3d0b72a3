//! Ordering keeps the ink and the pens, never increases the cost, and finds known optima.

use drawing::{Drawing, EllipticArc, Pen, Point, Segment, Span, Stroke, Vec2};
use ordering::{Options, Report, distance, optimize};
use proptest::prelude::*;

fn stroke(pen: u16, points: &[(f64, f64)]) -> Stroke {
    let points = points.iter().map(|&(x, y)| Point::new(x, y)).collect();
    Stroke::polyline(Pen(pen), points, Span::default()).expect("a stroke has points")
}

fn order(strokes: Vec<Stroke>, options: &Options) -> (Vec<Stroke>, Report) {
    let (drawing, report) = optimize(Drawing::from(strokes), &distance, options);
    assert_eq!(report.strokes_after, drawing.strokes.len());
    assert_eq!(report.strokes_before - report.duplicates_removed - report.merged, report.strokes_after);
    (drawing.strokes.to_vec(), report)
}

fn plain() -> Options {
    Options { merge: false, effort: 1, ..Options::default() }
}

/// Segments with their pens, equal in both directions: points at t = 0, 1/4, 3/4, 1, rounded to 1
/// nm.
fn pieces(strokes: &[Stroke]) -> Vec<(u16, [[i64; 2]; 4])> {
    let mut pieces = Vec::new();
    for stroke in strokes {
        for piece in stroke.segments() {
            let at = |t| [piece.eval(t).x, piece.eval(t).y].map(|x| (x * 1e6).round() as i64);
            let forward = [at(0.0), at(0.25), at(0.75), at(1.0)];
            let mut backward = forward;
            backward.reverse();
            pieces.push((stroke.pen.0, forward.min(backward)));
        }
    }
    pieces.sort_unstable();
    pieces
}

fn dots(strokes: &[Stroke]) -> Vec<(u16, [u64; 2])> {
    let dots = strokes.iter().filter(|stroke| stroke.is_dot());
    let mut dots: Vec<_> =
        dots.map(|dot| (dot.pen.0, [dot.start().x, dot.start().y].map(f64::to_bits))).collect();
    dots.sort_unstable();
    dots
}

/// Points on a coarse grid, so that ends touch, strokes coincide, and strokes are closed.
fn point() -> impl Strategy<Value = Point> {
    (0..8i32, 0..8i32).prop_map(|(x, y)| Point::new(f64::from(x) * 1.25, f64::from(y) * 1.25))
}

prop_compose! {
    fn any_stroke()(
        pen in 1..3u16,
        points in prop::collection::vec(point(), 1..5),
        arc in prop::option::of(-3.0..3.0f64),
        at in 0..1000usize,
    ) -> Stroke {
        let mut stroke = Stroke::polyline(Pen(pen), points, Span { start: at, end: at + 1 }).expect("points");
        if let Some(sweep) = arc {
            let center = stroke.end() - Vec2::new(1.0, 0.0);
            stroke.arc(EllipticArc { center, a: Vec2::new(1.0, 0.0), b: Vec2::new(0.0, 1.0), start_rad: 0.0, sweep_rad: sweep });
        }
        stroke
    }
}

prop_compose! {
    fn any_options()(
        effort in 0..2u8,
        merge: bool,
        keep_direction: bool,
        start in prop::option::of(point()),
        park in prop::option::of(point()),
    ) -> Options {
        Options { effort, merge, keep_direction, start, park, ..Options::default() }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn ordering_keeps_ink_never_costs_more_and_is_deterministic(
        strokes in prop::collection::vec(any_stroke(), 0..30),
        options in any_options(),
    ) {
        let (ordered, report) = order(strokes.clone(), &options);
        prop_assert_eq!(pieces(&ordered), pieces(&strokes));
        prop_assert_eq!(dots(&ordered), dots(&strokes));
        let (again, report_again) = order(strokes.clone(), &options);
        prop_assert_eq!(&ordered, &again);
        prop_assert_eq!(report, report_again);

        // Each pen is taken once, in the order of its first stroke in the file.
        let mut pens: Vec<Pen> = ordered.iter().map(|stroke| stroke.pen).collect();
        pens.dedup();
        let mut in_file: Vec<Pen> = Vec::new();
        for stroke in &strokes {
            if !in_file.contains(&stroke.pen) {
                in_file.push(stroke.pen);
            }
        }
        prop_assert_eq!(&pens, &in_file);

        // Never more than in file order with the pens grouped.
        let mut together = strokes;
        together.sort_by_key(|stroke| in_file.iter().position(|&pen| pen == stroke.pen));
        let mut from = options.start;
        let mut limit = 0.0;
        for stroke in &together {
            limit += from.map_or(0.0, |from| distance(from, stroke.start()));
            from = Some(stroke.end());
        }
        if let (Some(from), Some(park)) = (from, options.park) {
            limit += distance(from, park);
        }
        prop_assert!(report.travel_cost_after <= limit * (1.0 + 1e-8), "{report:?} {limit}");
    }

    #[test]
    fn keep_direction_keeps_directions(strokes in prop::collection::vec(any_stroke(), 0..30), merge: bool) {
        let options = Options { keep_direction: true, effort: 1, merge, ..Options::default() };
        let directed = |strokes: &[Stroke]| {
            let mut all = Vec::new();
            for stroke in strokes {
                for piece in stroke.segments() {
                    let [p, q] = [piece.eval(0.25), piece.eval(0.75)];
                    all.push((stroke.pen.0, [p.x, p.y, q.x, q.y].map(|x| (x * 1e6).round() as i64)));
                }
            }
            all.sort_unstable();
            all
        };
        let (ordered, _) = order(strokes.clone(), &options);
        prop_assert_eq!(directed(&ordered), directed(&strokes));
    }

    /// Euler: a connected component with 2k > 0 odd points takes k trails; without odd points, one.
    #[test]
    fn merging_reaches_eulers_minimum(
        lines in prop::collection::vec((0..4u8, 0..4u8, 0..4u8, 0..4u8), 1..24),
    ) {
        let at = |x: u8, y: u8| usize::from(x) * 4 + usize::from(y);
        let strokes: Vec<Stroke> = lines
            .iter()
            .map(|&(x, y, u, v)| stroke(1, &[(x.into(), y.into()), (0.3, 9.7), (u.into(), v.into())]))
            .collect();
        let mut component: Vec<usize> = (0..16).collect();
        let mut degree = [0; 16];
        for &(x, y, u, v) in &lines {
            let (a, b) = (component[at(x, y)], component[at(u, v)]);
            component.iter_mut().filter(|c| **c == a).for_each(|c| *c = b);
            degree[at(x, y)] += 1;
            degree[at(u, v)] += 1;
        }
        let mut fewest = 0;
        for c in 0..16 {
            let members: Vec<usize> = (0..16).filter(|&p| component[p] == c && degree[p] > 0).collect();
            let odd = members.iter().filter(|&&p| degree[p] % 2 == 1).count();
            fewest += if members.is_empty() { 0 } else { (odd / 2).max(1) };
        }
        // With a constant cost merging is never undone because of travel.
        let free = |_: Point, _: Point| 0.0;
        let (merged, report) = optimize(Drawing::from(strokes.clone()), &free, &Options::default());
        prop_assert_eq!(merged.strokes.len(), fewest);
        prop_assert_eq!(report.merged, strokes.len() - fewest);
        prop_assert_eq!(pieces(&merged.strokes.to_vec()), pieces(&strokes));
    }

    #[test]
    fn dedupe_keeps_the_set_of_segments(strokes in prop::collection::vec(any_stroke(), 0..40)) {
        let options = Options { dedupe: true, merge: false, effort: 0, ..Options::default() };
        let doubled: Vec<Stroke> = strokes.iter().cloned().chain(strokes.iter().cloned().map(|mut stroke| {
            stroke.reverse();
            stroke
        })).collect();
        let (ordered, report) = order(doubled, &options);
        prop_assert!(report.duplicates_removed >= strokes.len());
        let set = |strokes: &[Stroke]| {
            let mut set = pieces(strokes);
            set.dedup();
            set
        };
        prop_assert_eq!(set(&ordered), set(&strokes));
    }
}

#[test]
fn empty_and_tiny_drawings() {
    assert_eq!(order(vec![], &Options::default()), (vec![], Report::default()));
    for strokes in [
        vec![stroke(1, &[(1.0, 1.0)])],
        vec![stroke(1, &[(1.0, 1.0), (1.0, 1.0)]), stroke(1, &[(1.0, 1.0), (1.0, 1.0)])],
        vec![stroke(1, &[(0.0, 0.0), (5.0, 0.0)])],
    ] {
        for start in [None, Some(Point::new(6.0, 0.0))] {
            let options = Options { start, park: start, ..plain() };
            let (ordered, _) = order(strokes.clone(), &options);
            assert_eq!(pieces(&ordered), pieces(&strokes));
        }
    }
}

#[test]
fn coincident_dots_and_strokes_are_kept() {
    let mut strokes = vec![stroke(1, &[(3.0, 3.0)]); 3000];
    strokes.extend(vec![stroke(1, &[(3.0, 3.0), (4.0, 4.0)]); 3000]);
    let (ordered, report) = order(strokes, &plain());
    assert_eq!(ordered.len(), 6000);
    assert!(report.travel_mm_after < 1e-9, "{report:?}");
}

#[test]
fn start_and_park_position_count() {
    let strokes: Vec<Stroke> =
        [4.0, 0.0, 3.0, 1.0, 2.0].iter().map(|&x| stroke(1, &[(x, 0.0), (x + 0.5, 0.0)])).collect();
    let right = Some(Point::new(10.0, 0.0));
    let left = Some(Point::new(-1.0, 0.0));
    let (ordered, report) = order(strokes.clone(), &Options { start: right, park: left, ..plain() });
    assert_eq!(ordered[0].start(), Point::new(4.5, 0.0));
    assert!((report.travel_mm_after - (5.5 + 4.0 * 0.5 + 1.0)).abs() < 1e-9, "{report:?}");
    // Without reversal the strokes are drawn left to right.
    let options = Options { start: right, park: left, keep_direction: true, ..plain() };
    let (ordered, _) = order(strokes, &options);
    assert!(ordered.iter().all(|stroke| stroke.end().x > stroke.start().x));
}

#[test]
fn pen_order_is_followed() {
    let strokes =
        (0..12u16).map(|k| stroke(1 + k % 3, &[(f64::from(k), 0.0), (f64::from(k), 1.0)])).collect();
    let options = Options { pen_order: Some(vec![Pen(3), Pen(9), Pen(1)]), ..plain() };
    let (ordered, _) = order(strokes, &options);
    let pens: Vec<u16> = ordered.iter().map(|stroke| stroke.pen.0).collect();
    assert_eq!(pens, [3, 3, 3, 3, 1, 1, 1, 1, 2, 2, 2, 2]);
}

#[test]
fn closed_stroke_starts_at_the_nearest_vertex() {
    let square = stroke(1, &[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0), (0.0, 0.0)]);
    let line = stroke(1, &[(9.0, 4.0), (5.0, 4.0)]);
    let (ordered, report) = order(vec![square, line], &plain());
    assert!((report.travel_mm_after - 1.0).abs() < 1e-12, "{report:?}");
    let closed = ordered.iter().find(|stroke| stroke.is_closed()).unwrap();
    assert_eq!(closed.start(), Point::new(4.0, 4.0));
}

#[test]
fn crossing_strokes_are_merged_straight() {
    let strokes = vec![
        stroke(1, &[(0.0, 0.0), (1.0, 0.0)]),
        stroke(1, &[(1.0, 0.0), (1.0, 1.0)]),
        stroke(1, &[(2.0, 0.0), (1.0, 0.0)]),
        stroke(1, &[(1.0, 0.0), (1.0, -1.0)]),
    ];
    let free = |_: Point, _: Point| 0.0;
    let (merged, _) = optimize(Drawing::from(strokes), &free, &Options::default());
    assert_eq!(merged.strokes.len(), 2);
    for stroke in &merged.strokes {
        let (from, to) = (stroke.start(), stroke.end());
        assert!(from.x == to.x || from.y == to.y, "{stroke:?}");
    }
}

#[test]
fn merging_tolerates_rounding_and_keeps_arcs() {
    let mut arc = Stroke::new(Pen(1), Point::new(2.0, 0.0), Span { start: 10, end: 20 });
    let quarter = std::f64::consts::FRAC_PI_2;
    let (a, b) = (Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0));
    arc.arc(EllipticArc { center: Point::new(1.0, 0.0), a, b, start_rad: 0.0, sweep_rad: quarter });
    let line = stroke(1, &[(1.0, 1.0 + 3e-8), (0.0, 1.0)]);
    let far = stroke(1, &[(0.0, 1.0 + 1e-5), (0.0, 5.0)]);
    let (ordered, report) = order(vec![line, arc, far], &Options::default());
    assert_eq!((ordered.len(), report.merged), (2, 1));
    assert!(ordered.iter().any(|stroke| stroke.segments().any(|piece| matches!(piece, Segment::Arc(_)))));
}

#[test]
fn dedupe_removes_duplicate_strokes_and_dots() {
    let strokes = vec![
        stroke(1, &[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)]),
        stroke(1, &[(1.0, 1.0), (1.0, 0.0)]),
        stroke(1, &[(1.0, 0.0), (1.0, 2.0)]),
        stroke(1, &[(1.0, 0.0)]),
        stroke(1, &[(7.0, 7.0)]),
        stroke(2, &[(0.0, 0.0), (1.0, 0.0)]),
    ];
    assert_eq!(order(strokes.clone(), &plain()).1.duplicates_removed, 0);
    let (ordered, report) = order(strokes, &Options { dedupe: true, ..plain() });
    assert_eq!((report.duplicates_removed, ordered.len()), (2, 4));
}

/// Regression: an exchange of links of equal length split the tour, and the search did not end.
#[test]
fn hatch_of_equal_lines_is_drawn_back_and_forth() {
    let heights = (0..100).map(|i| f64::from((i * 37) % 100));
    let strokes = heights.map(|y| stroke(1, &[(0.0, y), (30.0, y)])).collect();
    let (_, report) = order(strokes, &Options { merge: false, ..Options::default() });
    assert!((report.travel_mm_after - 99.0).abs() < 1e-9, "{report:?}");
}

#[test]
fn nan_cost_keeps_file_order() {
    let strokes: Vec<Stroke> = [5.0, 1.0, 3.0].iter().map(|&x| stroke(1, &[(x, 0.0), (x, 1.0)])).collect();
    let nan = |_: Point, _: Point| f64::NAN;
    let (ordered, _) = optimize(Drawing::from(strokes.clone()), &nan, &plain());
    assert_eq!(ordered.strokes.to_vec(), strokes);
}

/// A circle of one arc that starts at its far side in the file.
#[test]
fn circle_starts_at_the_cheapest_point() {
    let center = Point::new(100.0, 0.0);
    let arc = EllipticArc::circular(center, 10.0, 0.0, std::f64::consts::TAU);
    let mut circle = Stroke::new(Pen(1), arc.eval(0.0), Span { start: 7, end: 9 });
    circle.arc(arc);
    let options = Options { start: Some(Point::ZERO), park: Some(Point::ZERO), ..Options::default() };
    let (ordered, report) = order(vec![circle], &options);
    assert!((ordered[0].start().x - 90.0).abs() < 1e-9, "{}", ordered[0].start());
    assert!((report.travel_mm_after - 180.0).abs() < 1e-6, "{}", report.travel_mm_after);
    let segments: Vec<Segment> = ordered[0].segments().collect();
    let [Segment::Arc(turned)] = segments[..] else { panic!("{segments:?}") };
    assert_eq!(
        (turned.center, turned.a, turned.b, turned.sweep_rad),
        (arc.center, arc.a, arc.b, arc.sweep_rad)
    );
    assert_eq!(ordered[0].source(), Span { start: 7, end: 9 });
}
