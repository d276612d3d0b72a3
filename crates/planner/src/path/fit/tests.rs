use drawing::{EllipticArc, Pen, Span};
use proptest::prelude::*;
use test_support::machines;

use super::*;

fn polyline(points: &[Point]) -> Stroke {
    Stroke::polyline(Pen(1), points.to_vec(), Span::default()).expect("there are points")
}

/// Distances from one chain of points to another, sampled.
fn farthest(from: &[Point], to: &[Point]) -> f64 {
    let nearest = |p: &Point| {
        let of = |w: &[Point]| {
            let (along, from) = (w[1] - w[0], *p - w[0]);
            let t =
                if along.hypot2() > 0.0 { (from.dot(along) / along.hypot2()).clamp(0.0, 1.0) } else { 0.0 };
            (from - t * along).hypot()
        };
        to.windows(2).map(of).fold(f64::INFINITY, f64::min)
    };
    from.iter().map(nearest).fold(0.0, f64::max)
}

fn chain(curves: impl Iterator<Item = Segment>, steps: u32) -> Vec<Point> {
    curves.flat_map(|curve| (0..=steps).map(move |k| curve.eval(f64::from(k) / f64::from(steps)))).collect()
}

/// Noise, grids, retraces and long legs.
fn strokes() -> impl Strategy<Value = Stroke> {
    let noise = proptest::collection::vec((-3.2..3.2f64, 0.001..1.0f64), 2..60);
    let grid = proptest::collection::vec((0..8_u8, 1..40_u8), 2..40);
    let points = prop_oneof![
        noise.prop_map(|steps| {
            let mut at = Point::new(10.0, 10.0);
            let mut points = vec![at];
            for (angle, length) in steps {
                at += length * Vec2::new(libm::cos(angle), libm::sin(angle));
                points.push(at);
            }
            points
        }),
        grid.prop_map(|steps| {
            let mut at = Point::new(10.0, 10.0);
            let mut points = vec![at];
            for (way, length) in steps {
                let angle = std::f64::consts::FRAC_PI_4 * f64::from(way);
                let length = f64::from(length);
                at += 0.025 * length * length * Vec2::new(libm::cos(angle), libm::sin(angle));
                points.push(at);
            }
            points
        }),
    ];
    points.prop_map(|points| polyline(&points))
}

proptest! {
    /// The share of the tolerance that the fit may use holds in both directions, and the derivative
    /// of the path is continuous.
    #[test]
    fn spline_is_within_tolerance_and_smooth(stroke in strokes(), exponent in -2.3..0.0f64, smooth in any::<bool>()) {
        let machine = machines::corexy();
        let limits = Limits::new(&machine, 60.0);
        let tolerance = libm::pow(10.0, exponent);
        let aim = if smooth { Aim::Smoothest } else { Aim::Fastest };
        let Some(section) = fitted(&stroke, &limits, tolerance, aim, false) else { return Ok(()) };
        let path = chain(section.iter().map(|piece| piece.curve), 8);
        let drawn = chain(stroke.segments(), 40);
        let least = 1.001 * tolerance + 1e-9;
        prop_assert!(farthest(&path, &drawn) <= least, "{} of {}", farthest(&path, &drawn), tolerance);
        // A chord of an eighth of a span leaves the curve by its own sagitta.
        let sagitta = section.iter().map(|piece| {
            let (_, start) = piece.curve.derivatives(0.0);
            let (_, end) = piece.curve.derivatives(1.0);
            start.hypot().max(end.hypot()) / 512.0
        });
        let sagitta = sagitta.fold(0.0, f64::max);
        prop_assert!(farthest(&drawn, &path) <= least + sagitta, "{} of {}", farthest(&drawn, &path), tolerance);
        prop_assert!((path[0] - stroke.start()).hypot() < 1e-12);
        prop_assert!((path[path.len() - 1] - stroke.end()).hypot() < 1e-12);
        for pair in section.windows(2) {
            prop_assert!((pair[0].curve.end() - pair[1].curve.start()).hypot() < 1e-12);
            let (before, after) = (pair[0].curve.derivatives(1.0), pair[1].curve.derivatives(0.0));
            let jump = pair[0].rate * before.0 - pair[1].rate * after.0;
            prop_assert!(jump.hypot() < 1e-6, "{:?}", jump);
        }
    }
}

#[test]
fn fit_of_arcs_and_cubics_stays_within_tolerance() {
    let mut stroke = Stroke::new(Pen(1), Point::new(3.0, 0.0), Span::default());
    stroke.arc(EllipticArc::circular(Point::ZERO, 3.0, 0.0, 4.0));
    let end = stroke.end();
    stroke.cubic_to(end + Vec2::new(1.0, 0.0), end + Vec2::new(2.0, 3.0), end + Vec2::new(4.0, 0.5));
    stroke.line_to(end + Vec2::new(9.0, 0.5));
    for machine in [machines::corexy(), machines::arm(), machines::polar()] {
        let center = machine.sheet().center();
        let mut stroke = stroke.clone();
        stroke.transform(drawing::Affine::translate(center.to_vec2()));
        let limits = Limits::new(&machine, 60.0);
        for tolerance in [0.1, 0.01] {
            let section = fitted(&stroke, &limits, tolerance, Aim::Fastest, false).expect("a spline");
            let path = chain(section.iter().map(|piece| piece.curve), 8);
            let drawn = chain(stroke.segments(), 400);
            assert!(
                farthest(&path, &drawn) <= 1.01 * tolerance,
                "{} of {tolerance}",
                farthest(&path, &drawn)
            );
            assert!(
                farthest(&drawn, &path) <= 1.01 * tolerance,
                "{} of {tolerance}",
                farthest(&drawn, &path)
            );
        }
    }
}

#[test]
fn lines_and_dots_are_not_fitted() {
    let machine = machines::corexy();
    let limits = Limits::new(&machine, 60.0);
    for points in [vec![(1.0, 1.0)], vec![(1.0, 1.0), (5.0, 1.0)], vec![(1.0, 1.0), (3.0, 1.0), (5.0, 1.0)]] {
        let points: Vec<Point> = points.into_iter().map(Point::from).collect();
        assert!(fitted(&polyline(&points), &limits, 0.1, Aim::Fastest, false).is_none());
    }
}

#[test]
fn long_stroke_in_blocks_is_as_smooth_as_its_parts() {
    let machine = machines::corexy();
    let limits = Limits::new(&machine, 60.0);
    let wave = |k: u32| Point::new(0.1 * f64::from(k), 3.0 * libm::sin(0.05 * f64::from(k)));
    let stroke = polyline(&(0..3000).map(wave).collect::<Vec<_>>());
    let section = fitted(&stroke, &limits, 0.02, Aim::Fastest, false).expect("a spline");
    let bends = section.iter().map(|piece| {
        let (first, second) = piece.curve.derivatives(0.0);
        first.cross(second).abs() / (first.hypot() * first.hypot2())
    });
    // The curvature of the wave is 0.75 / mm at most.
    let sharpest = bends.fold(0.0, f64::max);
    assert!(sharpest < 1.0, "{sharpest}");
}

#[test]
fn small_circle_does_not_shrink_to_a_dot() {
    let machine = machines::corexy();
    let limits = Limits::new(&machine, 60.0);
    let mut stroke = Stroke::new(Pen(1), Point::new(0.05, 0.0), Span::default());
    stroke.arc(EllipticArc::circular(Point::ZERO, 0.05, 0.0, std::f64::consts::TAU));
    let section = fitted(&stroke, &limits, 0.1, Aim::Fastest, false).expect("a spline");
    let path = chain(section.iter().map(|piece| piece.curve), 8);
    let width = path.iter().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max)
        - path.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
    assert!(width > 0.04, "{width} mm");
}

#[test]
fn merged_vertices_move_by_less_than_the_bound() {
    let points: Vec<Point> = (0..100).map(|k| Point::new(0.003 * f64::from(k), 0.0)).collect();
    let lines: Vec<Segment> =
        points.windows(2).map(|pair| Segment::Line(Line::new(pair[0], pair[1]))).collect();
    let merged = merge(lines, 0.02);
    assert!(merged.len() < 30 && merged.iter().all(|line| line.length() >= 0.01), "{}", merged.len());
    assert_eq!(merged[merged.len() - 1].end(), points[99]);
}

/// The tube's barrier let the knot at the sharp turn of this stroke leave its disc by 1 %.
#[test]
fn knots_outside_their_discs_are_fitted_again() {
    let points = [
        (10.0, 10.0),
        (10.001, 10.0),
        (9.831_962_470_972_961, 9.656_886_810_128_954),
        (9.926_137_294_197_707, 9.809_822_301_887_383),
        (10.542_648_450_504_341, 9.809_822_301_887_383),
        (10.579_402_001_599_759, 9.821_882_716_660_351),
        (10.447_297_881_044_88, 9.323_313_187_761_489),
        (10.754_865_404_943_07, 9.184_270_198_094_401),
    ];
    let stroke = polyline(&points.map(Point::from));
    let machine = machines::corexy();
    let tolerance = 0.017_583_124_389_724_272;
    let section =
        fitted(&stroke, &Limits::new(&machine, 60.0), tolerance, Aim::Fastest, false).expect("a spline");
    let path = chain(section.iter().map(|piece| piece.curve), 64);
    assert!(farthest(&chain(stroke.segments(), 40), &path) <= tolerance);
}
