//! Properties of the geometry: affine maps, reversal, flattening, clipping.

use drawing::{
    Affine, CubicBez, EllipticArc, Line, Pen, Pitch, Point, Rect, Segment, Side, Span, Stroke, Vec2,
    clip_segment, clip_stroke, distance_to_line,
};
use proptest::prelude::*;

fn point() -> impl Strategy<Value = Point> {
    (-200.0..200.0f64, -200.0..200.0f64).prop_map(|(x, y)| Point::new(x, y))
}

fn segment() -> impl Strategy<Value = Segment> {
    prop_oneof![
        (point(), point()).prop_map(|(a, b)| Segment::Line(Line::new(a, b))),
        (point(), 0.01..150.0f64, -7.0..7.0f64, -6.2..6.2f64)
            .prop_map(|(c, r, s, w)| Segment::Arc(EllipticArc::circular(c, r, s, w))),
        (point(), point(), point(), -7.0..7.0f64, -6.2..6.2f64).prop_map(|(c, a, b, s, w)| {
            Segment::Arc(EllipticArc {
                center: c,
                a: a.to_vec2(),
                b: b.to_vec2(),
                start_rad: s,
                sweep_rad: w,
            })
        }),
        (point(), point(), point(), point())
            .prop_map(|(a, b, c, d)| Segment::Cubic(CubicBez::new(a, b, c, d))),
    ]
}

fn map() -> impl Strategy<Value = Affine> {
    proptest::array::uniform6(-3.0..3.0f64).prop_map(Affine::new)
}

proptest! {
    #[test]
    fn affine_maps_commute_with_evaluation(s in segment(), m in map(), t in 0.0..=1.0f64) {
        let d = s.transformed(m).eval(t) - m * s.eval(t);
        prop_assert!(d.hypot2().sqrt() < 1e-9);
    }

    #[test]
    fn reversed_segments_run_backwards(s in segment(), t in 0.0..=1.0f64) {
        let d = s.reversed().eval(t) - s.eval(1.0 - t);
        prop_assert!(d.hypot2().sqrt() < 1e-9);
    }

    #[test]
    fn derivatives_agree_with_differences(s in segment(), t in 0.01..0.99f64) {
        let h = 1e-5;
        let (first, second) = s.derivatives(t);
        let f = (s.eval(t + h) - s.eval(t - h)) / (2.0 * h);
        let g = (s.derivatives(t + h).0 - s.derivatives(t - h).0) / (2.0 * h);
        prop_assert!((f - first).hypot2().sqrt() < 1e-3 * (1.0 + first.hypot2().sqrt()));
        prop_assert!((g - second).hypot2().sqrt() < 1e-3 * (1.0 + second.hypot2().sqrt()));
    }

    #[test]
    fn lattice_strokes_equal_polyline_strokes(
        cells in proptest::collection::vec((-300..300i32, -40_000..40_000i32), 1..6),
        more in segment(),
        m in map(),
    ) {
        let points: Vec<Point> =
            cells.iter().map(|&(x, y)| Point::new(0.025 * f64::from(x), 0.025 * f64::from(y))).collect();
        let source = Span { start: 3, end: 9 };
        let lattice = Stroke::on_lattice(Pen(2), &points, source, Pitch::from_mm(0.025).unwrap()).unwrap();
        let plain = Stroke::polyline(Pen(2), points, source).unwrap();
        let alike = |change: &dyn Fn(&mut Stroke)| -> Result<(), TestCaseError> {
            let (mut one, mut other) = (lattice.clone(), plain.clone());
            change(&mut one);
            change(&mut other);
            prop_assert_eq!(&one, &other);
            prop_assert_eq!(one.vertices(), other.vertices());
            prop_assert_eq!(one.segments().collect::<Vec<_>>(), other.segments().collect::<Vec<_>>());
            prop_assert_eq!((one.start(), one.end()), (other.start(), other.end()));
            prop_assert_eq!(one.segment_count(), other.segment_count());
            prop_assert_eq!((one.is_dot(), one.is_closed()), (other.is_dot(), other.is_closed()));
            prop_assert_eq!(one.source(), source);
            Ok(())
        };
        alike(&|_| {})?;
        alike(&Stroke::reverse)?;
        alike(&|stroke| stroke.transform(m))?;
        alike(&|stroke| stroke.push(more))?;
    }

    #[test]
    fn packed_strokes_are_restored(
        strokes in proptest::collection::vec((proptest::collection::vec(segment(), 0..4), 0..3_u16), 0..8),
        cells in proptest::collection::vec((-300..300i32, -40_000..40_000i32), 1..6),
        (cx, cy, dx, dy) in (-9999..9999i32, -9999..9999i32, -999..999i32, -999..999i32),
        (sweep, start) in (-400..400i32, 0..3),
        maps in proptest::collection::vec(map(), 0..3),
    ) {
        let pitch = Pitch::from_mm(0.025).unwrap();
        let at = |x: i32, y: i32| Point::new(0.025 * f64::from(x), 0.025 * f64::from(y));
        let mut all = Vec::new();
        for (index, (segments, pen)) in strokes.iter().enumerate() {
            let mut stroke = Stroke::new(Pen(*pen), at(cx, cy), Span { start: index, end: 2 * index + 1 });
            for segment in segments {
                stroke.push(*segment);
            }
            all.push(stroke);
        }
        let points: Vec<Point> = cells.iter().map(|&(x, y)| at(x, y)).collect();
        all.extend(Stroke::on_lattice(Pen(7), &points, Span::default(), pitch));
        // Arcs as importers have them: on the lattice or not, from a rounded start or not, closed or not.
        let a = at(dx, dy).to_vec2();
        let b = Vec2::new(-a.y, a.x) * f64::from(start - 1);
        let arc = EllipticArc {
            center: at(cx, cy), a, b, start_rad: 0.5 * f64::from(start), sweep_rad: f64::from(sweep).to_radians(),
        };
        let mut trail = drawing::Trail::default();
        let mut packed: drawing::Strokes = all.iter().cloned().collect();
        for first in [arc.eval(0.0), at(cx + dx, cy + dy)] {
            trail.begin(first);
            trail.push(&Segment::Arc(arc));
            packed.push_trail(Pen(9), Span::default(), &trail, Some(pitch));
            let mut stroke = Stroke::new(Pen(9), first, Span::default());
            stroke.arc(arc);
            all.push(stroke);
            let mut closed = Stroke::new(Pen(9), first, Span::default());
            closed.arc_to(arc, first);
            packed.push(&closed);
            all.push(closed);
        }
        prop_assert_eq!(packed.len(), all.len());
        for map in maps {
            packed.transform(map);
            for stroke in &mut all {
                stroke.transform(map);
            }
        }
        prop_assert_eq!(&packed.to_vec(), &all);
        prop_assert_eq!(&packed.clone().into_iter().collect::<Vec<_>>(), &all);
        for index in 0..=all.len() {
            prop_assert_eq!(packed.get(index), all.get(index).cloned());
        }
        packed.shift_sources(5);
        packed.change_pens(|pen| (pen != Pen(1)).then_some(Pen(pen.0 + 1)));
        all.retain(|stroke| stroke.pen != Pen(1));
        for stroke in &mut all {
            stroke.pen.0 += 1;
            let Span { start, end } = stroke.source();
            stroke.set_source(Span { start: start + 5, end: end + 5 });
        }
        prop_assert_eq!(packed.len(), all.len());
        prop_assert_eq!(&packed.to_vec(), &all);
        packed.append(drawing::Strokes::from(all.clone()));
        prop_assert_eq!(packed.to_vec(), [all.clone(), all].concat());
    }

    #[test]
    fn loose_box_contains_the_bounding_box(s in segment()) {
        prop_assert_eq!(s.loose_box().union(s.bounding_box()), s.loose_box());
    }

    #[test]
    fn chords_stay_within_the_tolerance(s in segment(), tolerance in 0.01..2.0f64) {
        let mut from = s.start();
        let count = s.chord_count(tolerance);
        let mut k = 0;
        s.flatten(tolerance, |to| {
            for i in 0..=8 {
                let t = (k as f64 + f64::from(i) / 8.0) / count as f64;
                let error = distance_to_line(s.eval(t), Line::new(from, to));
                assert!(error <= tolerance * (1.0 + 1e-9) + 1e-9);
            }
            k += 1;
            from = to;
        });
        prop_assert_eq!(k, count);
    }

    #[test]
    fn bounding_boxes_are_tight(s in segment()) {
        let b = s.bounding_box();
        let mut seen = Rect::from_points(s.start(), s.start());
        for k in 0..=2000 {
            let p = s.eval(f64::from(k) / 2000.0);
            prop_assert!(b.inflate(1e-9, 1e-9).contains(p));
            seen = seen.union_pt(p);
        }
        prop_assert!(b.width() - seen.width() < 0.05 && b.height() - seen.height() < 0.05);
    }

    #[test]
    fn length_lies_between_chords_and_bounds(s in segment()) {
        let n = 4000;
        let chords: f64 = (0..n)
            .map(|k| (s.eval(f64::from(k + 1) / f64::from(n)) - s.eval(f64::from(k) / f64::from(n))).hypot2().sqrt())
            .sum();
        let length = s.length();
        prop_assert!(length >= chords - 1e-3 && length <= chords + 1e-2, "{} against {}", length, chords);
    }

    #[test]
    fn clipping_keeps_exactly_the_inside(s in segment(), a in point(), b in point(), t in 0.0..=1.0f64) {
        let window = Rect::from_points(a, b);
        let parts = clip_segment(&s, window);
        let p = s.eval(t);
        let kept = parts.iter().any(|&(t0, t1)| t >= t0 && t <= t1);
        if window.inset(-1e-6).contains(p) != window.inset(1e-6).contains(p) {
            return Ok(()); // on the edge, within rounding
        }
        prop_assert_eq!(kept, window.contains(p), "t {} parts {:?}", t, parts);
    }

    #[test]
    fn clipped_strokes_conserve_length(
        list in proptest::collection::vec(segment(), 1..6),
        closed in any::<bool>(),
        a in point(),
        b in point(),
    ) {
        let mut stroke = Stroke::new(Pen(3), list[0].start(), Span { start: 5, end: 8 });
        for s in &list {
            stroke.line_to(s.start());
            stroke.push(*s);
        }
        if closed {
            stroke.line_to(list[0].start());
        }
        let window = Rect::from_points(a, b);
        let [inside, outside] = [Side::Inside, Side::Outside].map(|side| clip_stroke(&stroke, window, side));
        for part in &inside {
            let bounds = part.bounding_box();
            let larger = window.inflate(1e-6, 1e-6);
            prop_assert_eq!(larger.union(bounds), larger, "{:?} leaves {:?}", bounds, window);
            prop_assert_eq!((part.pen, part.source()), (stroke.pen, stroke.source()));
        }
        for part in &outside {
            for segment in part.segments() {
                prop_assert!(!window.inset(-1e-6).contains(segment.eval(0.5)), "{:?}", segment);
            }
        }
        let length = |parts: &[Stroke]| parts.iter().map(Stroke::length).sum::<f64>();
        let kinds = |strokes: &[Stroke], curved: bool| {
            let segments = strokes.iter().flat_map(Stroke::segments);
            let of_kind = segments.filter(|s| matches!(s, Segment::Line(_)) != curved);
            of_kind.map(|s| s.length()).sum::<f64>()
        };
        let all = [stroke.clone()];
        // Quadrature of each part of a cubic is accurate to 1e-6 mm.
        let tolerance = 1e-4 + 1e-9 * stroke.length();
        prop_assert!((length(&inside) + length(&outside) - stroke.length()).abs() < tolerance);
        for curved in [false, true] {
            let sum = kinds(&inside, curved) + kinds(&outside, curved);
            prop_assert!((sum - kinds(&all, curved)).abs() < tolerance, "curves stay curves");
        }
        // Every cut makes one part more at most.
        prop_assert!(inside.len() + outside.len() <= 1 + 12 * stroke.segment_count());
    }

    #[test]
    fn reversing_a_stroke_twice_restores_it(list in proptest::collection::vec(segment(), 0..8)) {
        let mut stroke = Stroke::new(Pen(1), Point::ZERO, Span::default());
        for s in list {
            stroke.push(s);
        }
        let mut twice = stroke.clone();
        twice.reverse();
        let backwards: Vec<Segment> = twice.segments().collect();
        let forwards: Vec<Segment> = stroke.segments().collect();
        prop_assert_eq!(backwards.len(), forwards.len());
        for (x, y) in backwards.iter().rev().zip(&forwards) {
            prop_assert!((x.eval(0.25) - y.eval(0.75)).hypot2().sqrt() < 1e-9);
        }
        twice.reverse();
        prop_assert!((twice.length() - stroke.length()).abs() < 1e-9 * (1.0 + stroke.length()));
    }
}

#[test]
fn mirrored_scaled_circle_is_a_reversed_ellipse() {
    let circle = EllipticArc::circular(Point::new(1.0, 2.0), 3.0, 0.0, std::f64::consts::TAU);
    assert_eq!(circle.circle_radius(), Some(3.0));
    let ellipse = circle.transformed(Affine::new([-2.0, 0.0, 0.0, 1.0, 0.0, 0.0]));
    assert_eq!(ellipse.circle_radius(), None);
    assert_eq!(ellipse.semi_axes(), (6.0, 3.0));
    let quarter = ellipse.eval(0.25);
    assert!((quarter - Point::new(-2.0, 5.0)).hypot2() < 1e-20);
    assert!((quarter.to_vec2() - Vec2::new(-2.0, 5.0)).hypot2() < 1e-20);
}

/// Found by `length_lies_between_chords_and_bounds`: quadrature with uniform steps was off by
/// 0.0035 mm on this flat ellipse.
#[test]
fn flat_ellipse_length_is_exact() {
    let arc = EllipticArc {
        center: Point::ZERO,
        a: Vec2::new(146.301_685_362_793_85, 149.415_614_786_869_18),
        b: Vec2::new(189.228_143_314_783_84, 190.361_240_409_773_9),
        start_rad: 1.838_120_244_464_899_9,
        sweep_rad: 4.370_669_527_526_015,
    };
    let n = 2_000_000;
    let at = |k: i32| arc.eval(f64::from(k) / f64::from(n));
    let chords: f64 = (0..n).map(|k| (at(k + 1) - at(k)).hypot2().sqrt()).sum();
    assert!((Segment::Arc(arc).length() - chords).abs() < 1e-5, "{chords}");
    // Degenerate: back and forth on a segment of 10 mm.
    let flat = EllipticArc {
        a: Vec2::new(3.0, 4.0),
        b: Vec2::ZERO,
        start_rad: 0.3,
        sweep_rad: std::f64::consts::TAU,
        ..arc
    };
    assert!((Segment::Arc(flat).length() - 20.0).abs() < 1e-6);
}

#[test]
fn dot_has_no_length_and_flattens_to_one_point() {
    let dot = Stroke::new(Pen(1), Point::new(1.0, 1.0), Span::default());
    assert!(dot.is_dot());
    assert_eq!(dot.length(), 0.0);
    assert_eq!(dot.flatten(0.1), vec![Point::new(1.0, 1.0)]);
}

#[test]
fn clipped_circle_continues_over_its_start() {
    let mut circle = Stroke::new(Pen(1), Point::new(10.0, 0.0), Span::default());
    let arc = EllipticArc::circular(Point::ZERO, 10.0, 0.0, std::f64::consts::TAU);
    circle.arc_to(arc, Point::new(10.0, 0.0));
    // The right half: one arc over the start.
    let window = Rect::new(0.0, -20.0, 20.0, 20.0);
    let parts = clip_stroke(&circle, window, Side::Inside);
    assert_eq!(parts.len(), 1);
    assert!((parts[0].length() - 10.0 * std::f64::consts::PI).abs() < 1e-9);
    assert!(parts[0].segments().all(|segment| matches!(segment, Segment::Arc(_))));
    assert!(parts[0].start().distance(Point::new(0.0, -10.0)) < 1e-9);
    // A tangent only touches: no ink inside, all of it outside.
    let beside = Rect::new(10.0, -5.0, 20.0, 5.0);
    assert!(clip_stroke(&circle, beside, Side::Inside).is_empty());
    let outside = clip_stroke(&circle, beside, Side::Outside);
    assert!((outside.iter().map(Stroke::length).sum::<f64>() - circle.length()).abs() < 1e-9);
    // Windows without area hold nothing.
    assert!(clip_stroke(&circle, Rect::ZERO, Side::Inside).is_empty());
    assert_eq!(clip_stroke(&circle, Rect::ZERO, Side::Outside), [circle]);
}

#[test]
fn clipped_dot_stays_or_goes() {
    let dot = Stroke::new(Pen(1), Point::new(1.0, 1.0), Span::default());
    let window = Rect::new(0.0, 0.0, 1.0, 1.0);
    assert_eq!(clip_stroke(&dot, window, Side::Inside), std::slice::from_ref(&dot));
    assert!(clip_stroke(&dot, window, Side::Outside).is_empty());
}
