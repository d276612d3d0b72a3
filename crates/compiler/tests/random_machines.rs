//! Plans on random machines: everything on the sheet can be planned, and its certificate holds.
//!
//! The machines come from `test_support::machines::machine`: every registered mechanism, link ratios
//! from 0.3 to 3, elbows on both sides, elbow belts of other ratios than 1, motors that count
//! backwards, joint ranges that pass from pi to -pi or lie turns away from the principal values.

use compiler::pipeline::{Order, Request, compile};
use drawing::{Drawing, EllipticArc, Pen, Point, Span, Stroke, Vec2};
use kinematics::{JointPos, Machine, TwoLink};
use planner::{PlacementOptions, Scale, TimingLaw};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;
use test_support::{machines, polyline};

/// Strokes within the unit square.
fn stroke() -> impl Strategy<Value = Stroke> {
    let point = || (0.02..0.98f64, 0.02..0.98f64).prop_map(|(x, y)| Point::new(x, y));
    prop_oneof![
        proptest::collection::vec(point(), 1..6).prop_map(polyline),
        (point(), 0.01..0.3f64, -7.0..7.0f64, -6.2..6.2f64).prop_map(|(center, radius, start, sweep)| {
            let inside = |x: f64| x.clamp(radius + 0.02, 0.98 - radius);
            let center = Point::new(inside(center.x), inside(center.y));
            let arc = EllipticArc::circular(center, radius, start, sweep);
            let mut stroke = Stroke::new(Pen(2), arc.eval(0.0), Span::default());
            stroke.arc(arc);
            stroke
        }),
        (point(), point(), point(), point()).prop_map(|(a, b, c, d)| {
            let mut stroke = Stroke::new(Pen(1), a, Span::default());
            stroke.cubic_to(b, c, d);
            stroke
        }),
    ]
}

/// Plans a drawing of the unit square, scaled to the sheet.
fn is_certified(machine: &Machine, strokes: Vec<Stroke>) -> Result<(), TestCaseError> {
    let scale = Scale::Explicit { factor: machine.sheet().width(), origin_mm: Vec2::ZERO };
    let request = Request {
        tolerance_mm: 0.1,
        period_us: 10_000,
        order: Order::File,
        placement: PlacementOptions { scale, ..PlacementOptions::default() },
        search: None,
        crop: None,
        pen_speeds: Vec::new(),
        pen_colors: std::collections::BTreeMap::new(),
        lift_overlap_s: 0.0,
        timing_law: TimingLaw::default(),
        rounding: planner::Rounding::Path,
        joint_fit: true,
        allow_over_limit: false,
    };
    let drawing = Drawing::from(strokes);
    let compiled = compile(&drawing, machine, &request, &|_| ());
    let compiled = compiled.map_err(|error| TestCaseError::fail(format!("{error:?}")))?;
    // Where half a tick is a tenth of the sheet, whole ticks may lie out of reach: such a plan is refused.
    let is_coarse = compiled.certificate.quantization_error.worst_mm > 0.1 * machine.sheet().width();
    prop_assert!(compiled.certificate.holds || is_coarse, "{:?}", compiled.certificate.failures);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn plans_on_random_machines_are_certified(
        plain in machines::machine(),
        build_up_s in proptest::option::weighted(0.3, 0.005..0.1f64),
        strokes in proptest::collection::vec(stroke(), 1..4),
    ) {
        let machine = build_up_s.map_or(plain.clone(), |build_up_s| machines::with_jerk(&plain, build_up_s));
        is_certified(&machine, strokes)?;
    }
}

/// The preset-like arm with its elbow on the other side.
#[test]
fn plan_with_the_elbow_on_the_right_is_certified() {
    let mut parts = machines::arm().parts().clone();
    parts.mechanism = std::sync::Arc::new(TwoLink { l1_mm: 206.0, l2_mm: 256.0, elbow_left: false });
    parts.start = JointPos::new(0.5, 2.0);
    let machine = machines::build(parts);
    is_certified(&machine, vec![polyline([(0.1, 0.1), (0.9, 0.2), (0.5, 0.9), (0.1, 0.1)])]).unwrap();
}
