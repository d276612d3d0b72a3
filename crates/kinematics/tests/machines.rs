//! Properties of whole machines: coupling, ticks, turns, joint limits, what can be drawn.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use drawing::{EllipticArc, Line, Point, Rect, Segment, Vec2};
use kinematics::{
    Coupling, Fault, JointKind, JointPos, JointRange, Machine, MachineError, MachineParts, Mechanism, Motor,
    MotorPos, Polar, TwoLink,
};
use proptest::prelude::*;
use test_support::machines::{self, point_within};
use test_support::mechanisms::mechanism;

const ARM: TwoLink = TwoLink { l1_mm: 206.0, l2_mm: 256.0, elbow_left: true };

/// A machine with two motors of 500 ticks/rad and free joints.
fn machine(mechanism: impl Mechanism + 'static) -> Machine {
    let motors = ["a", "b"].map(|name| Motor::new(name, 500.0, 1.0, 5.0));
    machines::build(MachineParts::new("test", mechanism, motors, Rect::new(100.0, 100.0, 200.0, 200.0)))
}

/// Machines with joint ranges that have nothing to do with their sheets: up to 8 rad wide, so that
/// some leave a gap in the directions and others allow two turns, and up to 300 mm.
fn limited() -> impl Strategy<Value = Machine> {
    let range = || (-1.0..0.0f64, 0.0..1.0f64);
    let place = (0.0..TAU, 0.05..0.95f64, -1..=1i32);
    let parts = (mechanism(), range(), range(), place);
    parts.prop_filter_map("nothing regular", |(m, first, second, (direction, share, turns))| {
        let p = point_within(&*m, direction, share, 0.2)?;
        let start = m.inverse(p).expect("within reach");
        let start = start + m.full_rotation().unwrap_or_default() * f64::from(turns);
        let joints = [first, second];
        let range = |k: usize| {
            let unit = if m.joint_kinds()[k] == JointKind::Revolute { 4.0 } else { 150.0 };
            JointRange { min: start[k] + unit * joints[k].0 - 1e-3, max: start[k] + unit * joints[k].1 }
        };
        let mut parts = machine(ARM).parts().clone();
        parts.joints = [range(0), range(1)];
        parts.start = start;
        parts.min_manipulability = m.default_min_manipulability();
        parts.mechanism = m;
        Some(machines::build(parts))
    })
}

/// Lines and arcs that begin near the start pose.
fn segment() -> impl Strategy<Value = (Vec2, Vec2, f64)> {
    let vector = |size: f64| (-size..size, -size..size).prop_map(|(x, y)| Vec2::new(x, y));
    (vector(40.0), vector(300.0), -6.0..6.0f64)
}

/// By how far the joint limits are missed at a point, on the best of all turns; 0 where it can be
/// reached.
fn beyond_limits(m: &Machine, p: Point) -> f64 {
    let Ok(q) = m.mechanism().inverse(p) else { return f64::INFINITY };
    let rotation = m.mechanism().full_rotation().unwrap_or_default();
    let beyond = |turn: i32| {
        let q = q + rotation * f64::from(turn);
        let over = |k: usize| {
            let JointRange { min, max } = m.parts().joints[k];
            let unit = if m.mechanism().joint_kinds()[k] == JointKind::Revolute { 1.0 } else { 100.0 };
            (min - q[k]).max(q[k] - max).max(0.0) / unit
        };
        over(0).max(over(1))
    };
    (-6..=6).map(beyond).fold(f64::INFINITY, f64::min)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn joint_positions_of_motor_positions_are_the_pose(m in machines::machine(), a in -3.0..3.0f64, b in -3.0..3.0f64) {
        let q = JointPos::new(a, b);
        let motors = m.motor_positions(&q);
        prop_assert!((m.joint_positions(&motors) - q).norm() < 1e-7);
        let rows = m.coupling().rows();
        for (k, motor) in m.motors().iter().enumerate() {
            let by_hand = motor.ticks_per_unit * (rows[k][0] * a + rows[k][1] * b) + motor.offset_ticks;
            prop_assert!((motors[k] - by_hand).abs() < 1e-8 * (1.0 + by_hand.abs()));
        }
        prop_assert!((m.forward_from_motors(&motors) - m.mechanism().forward(&q)).hypot2() < 1e-10);
    }

    #[test]
    fn poses_are_unwrapped_to_the_nearest_turn(m in machines::machine(), turns in -3..=3i32) {
        let near = m.start() + m.mechanism().full_rotation().unwrap_or_default() * f64::from(turns);
        let found = m.pose_near(m.mechanism().forward(&m.start()), &near).expect("within reach");
        prop_assert!((found - near).norm() < 1e-8);
    }

    #[test]
    fn generated_machines_draw_on_their_whole_sheet(m in machines::machine(), x in 0.0..1.0f64, y in 0.0..1.0f64) {
        let sheet = m.sheet();
        let p = Point::new(sheet.x0 + x * sheet.width(), sheet.y0 + y * sheet.height());
        prop_assert!(m.check_point(p).is_ok(), "{:?}", m.check_point(p));
    }

    /// Both ways: a segment that passes has no point that fails, and one that fails has one.
    #[test]
    fn check_segment_agrees_with_its_points(
        m in limited(), (offset, along, sweep) in segment(), is_arc in any::<bool>(),
    ) {
        let p0 = m.mechanism().forward(&m.start()) + 0.1 * offset;
        let segment = if is_arc {
            let center = p0 + offset;
            let start = libm::atan2(-offset.y, -offset.x);
            Segment::Arc(EllipticArc::circular(center, offset.hypot2().sqrt(), start, sweep))
        } else {
            Segment::Line(Line::new(p0, p0 + along))
        };
        match m.check_segment(&segment) {
            Ok(()) => {
                for k in 0..=2000 {
                    let p = segment.eval(f64::from(k) / 2000.0);
                    if let Err(error) = m.check_point(p) {
                        // Chords leave curves by 1e-3 mm, which the limits may be missed by.
                        let near = is_arc && match error.fault {
                            Fault::JointLimit { .. } => beyond_limits(&m, p) < 1e-3,
                            Fault::Singular { manipulability, min } => manipulability > min - 1e-3,
                            Fault::TooFar(by) | Fault::TooNear(by) | Fault::Slack(by) => by < 1e-3,
                            Fault::OtherAssembly | Fault::BetweenBases => false,
                        };
                        let rounding = beyond_limits(&m, p) < 1e-6;
                        prop_assert!(near || rounding, "{error} although the segment passes");
                    }
                }
            }
            Err(error) => {
                let between_bases = error.fault == Fault::BetweenBases;
                prop_assert!(between_bases || m.check_point(error.point).is_err());
                prop_assert!(!between_bases || m.mechanism().kind() == "five-bar");
                let off = (0..=20_000)
                    .map(|k| (segment.eval(f64::from(k) / 20_000.0) - error.point).hypot2())
                    .fold(f64::INFINITY, f64::min);
                let step = segment.length() / 20_000.0;
                prop_assert!(off.sqrt() < step + 2e-3, "{error} is not on the segment");
            }
        }
    }
}

#[test]
fn line_between_reachable_points_passes_too_near_to_the_base() {
    let m = machine(ARM);
    let line = Segment::Line(Line::new(Point::new(-100.0, 10.0), Point::new(100.0, 10.0)));
    assert!(m.check_point(Point::new(-100.0, 10.0)).is_ok());
    let fault = m.check_segment(&line).unwrap_err();
    assert_eq!(fault.point, Point::new(0.0, 10.0));
    assert_eq!(fault.fault, Fault::TooNear(40.0));
}

#[test]
fn stretched_arm_is_singular() {
    let m = machine(ARM);
    assert!(matches!(m.check_point(Point::new(0.0, 461.9)).unwrap_err().fault, Fault::Singular { .. }));
    assert_eq!(m.check_point(Point::new(0.0, 463.0)).unwrap_err().fault, Fault::TooFar(1.0));
}

/// The shoulder's angle is largest inside the line, where the second link is perpendicular to it:
/// both ends are allowed, that point is not.
#[test]
fn arm_with_joint_limits_is_checked_between_the_ends_of_a_line() {
    let line = Line::new(Point::new(-300.0, 300.0), Point::new(100.0, 300.0));
    let theta = |t: f64| ARM.inverse(line.p0 + t * (line.p1 - line.p0)).expect("within reach")[0];
    let extremes = ARM.joint_extrema_on_line(&line);
    let highest = extremes.iter().copied().filter(|t| (0.0..1.0).contains(t)).map(theta).fold(0.0, f64::max);
    let ends = theta(0.0).max(theta(1.0));
    assert!(highest > ends + 1e-3, "the largest angle must be inside: {highest} and {ends}");
    let limited = |max: f64| {
        let mut parts = machine(ARM).parts().clone();
        parts.joints[0] = JointRange { min: 0.0, max };
        machines::build(parts)
    };
    assert!(limited(highest + 1e-8).check_segment(&Segment::Line(line)).is_ok());
    let fault = limited(highest - 1e-8).check_segment(&Segment::Line(line)).unwrap_err().fault;
    assert!(matches!(fault, Fault::JointLimit { joint: "theta", .. }), "{fault}");
}

/// The rail turns from 0 to 300 degrees. A line from 290 to 10 degrees crosses the gap.
#[test]
fn line_across_the_gap_of_a_joint_range_is_refused() {
    let mut parts = machine(Polar::default()).parts().clone();
    parts.joints[0] = JointRange { min: 0.0, max: 300.0_f64.to_radians() };
    let at = |degrees: f64| {
        let (sin, cos) = libm::sincos(degrees.to_radians());
        Point::new(100.0 * cos, 100.0 * sin)
    };
    // The foot of the perpendicular is at 295 degrees, which is allowed.
    let line = Segment::Line(Line::new(at(280.0), at(310.0).lerp(at(5.0), 1.0)));
    let m = machines::build(parts.clone());
    assert!(m.check_point(at(280.0)).is_ok() && m.check_point(at(5.0)).is_ok());
    assert!(m.check_segment(&line).is_err());
    parts.joints[0].max = TAU;
    assert!(machines::build(parts).check_segment(&line).is_ok());
}

#[test]
fn elbow_is_on_the_requested_side() {
    for elbow_left in [true, false] {
        let arm = TwoLink { elbow_left, ..ARM };
        let p = Point::new(120.0, 250.0);
        let q = arm.inverse(p).unwrap();
        let elbow = 206.0 * Vec2::new(libm::cos(q[0]), libm::sin(q[0]));
        // Left of the ray from base to pen: positive cross product.
        assert_eq!(p.to_vec2().cross(elbow) > 0.0, elbow_left);
    }
}

#[test]
fn singular_coupling_is_refused() {
    assert!(Coupling::from_rows([[1.0, 1.0], [2.0, 2.0]]).is_err());
    assert!(Coupling::from_rows([[1.0, f64::NAN], [2.0, 2.0]]).is_err());
    assert!(Coupling::from_rows([[0.0, 0.0], [0.0, 1.0]]).is_err());
}

#[test]
fn invalid_parts_are_refused() {
    let error = |change: &dyn Fn(&mut MachineParts)| {
        let mut parts = machine(Polar::default()).parts().clone();
        change(&mut parts);
        Machine::new(parts).map(|_| ()).unwrap_err()
    };
    let text = |change: &dyn Fn(&mut MachineParts)| error(change).to_string();
    assert_eq!(
        text(&|parts| parts.motors[1].max_speed_ticks_s = 0.0),
        "max_speed of motor b must be a positive number, not 0"
    );
    assert_eq!(
        text(&|parts| parts.mechanism = Arc::new(TwoLink { l1_mm: -1.0, ..ARM })),
        "l1 must be a positive number, not -1"
    );
    assert_eq!(text(&|parts| parts.period_s = 11.0), "period must be from 0.000001 to 10 s, not 11");
    assert_eq!(text(&|parts| parts.motors[1].name = "a".into()), "both motors are named a");
    assert_eq!(
        text(&|parts| parts.min_manipulability = 1.0),
        "min_dexterity must be at least 0 and below 1, not 1"
    );
    assert!(matches!(error(&|parts| parts.sheet = Rect::ZERO), MachineError::EmptySheet));
    assert!(matches!(
        error(&|parts| parts.pen.max_travel_speed_mm_s = f64::NAN),
        MachineError::NotPositive { .. }
    ));
    let range = JointRange { min: 60.0, max: 50.0 };
    assert!(matches!(error(&|parts| parts.joints[1] = range), MachineError::EmptyJointRange { joint: "r" }));
    let range = JointRange { min: 10.0, max: 100.0 };
    assert!(matches!(error(&|parts| parts.joints[1] = range), MachineError::Start { .. }));
}

/// Half a tick on both motors of the coaxial arm (docs/references.md): 0.4045 mm and 0.5027 mm per
/// tick, 0.4536 mm at the worst when stretched.
#[test]
fn quantization_error_of_the_coaxial_arm() {
    let ticks_per_rad = 3200.0 / TAU;
    let motors = ["a", "b"].map(|name| Motor::new(name, ticks_per_rad, 1.0, 5.0));
    let parts = MachineParts::new("coaxial", ARM, motors, Rect::new(100.0, 100.0, 200.0, 200.0));
    let m = machines::build(MachineParts { coupling: [[1.0, 0.0], [0.0, -1.0]], ..parts });
    assert!((m.quantization_error(&JointPos::new(FRAC_PI_2, FRAC_PI_2)) - 0.4536).abs() < 1e-4);
    let folded = libm::hypot(0.4045, 0.5027) / 2.0;
    assert!((m.quantization_error(&JointPos::new(FRAC_PI_2, 0.0)) - folded).abs() < 1e-3);
    let tick = m.joint_rates(&MotorPos::new(1.0, 0.0));
    assert!((m.mechanism().pen_velocity(&m.start(), &tick).hypot() - 0.4045).abs() < 1e-4);
}

#[test]
fn pole_that_the_radius_does_not_reach_is_refused_with_its_joint() {
    let mut parts = machine(Polar::default()).parts().clone();
    let towards = Point::new(0.0, 150.0);
    let whole = machines::build(parts.clone());
    let poses = whole.poses_at_pole(towards, &whole.start()).expect("no limits");
    assert!(!poses.is_empty() && poses.iter().all(|pose| pose[1] == 0.0), "{poses:?}");
    parts.joints[1] = JointRange { min: 5.0, max: 400.0 };
    let limited = machines::build(parts);
    let fault = limited.poses_at_pole(towards, &limited.start()).expect_err("the radius is 0 at the pole");
    assert!(matches!(fault, Fault::JointLimit { joint: "r", .. }), "{fault:?}");
}

#[test]
fn line_through_the_pole_of_a_polar_machine_is_allowed_and_found() {
    let m = machine(Polar::default());
    let through = Line::new((-80.0, -60.0), (40.0, 30.0));
    assert_eq!(m.pole_on(&through), Some(Point::ZERO));
    assert_eq!(m.check_segment(&Segment::Line(through)), Ok(()));
    let beside = Line::new((-80.0, -59.9), (40.0, 30.1));
    assert_eq!(m.pole_on(&beside), None);
    // An offset rack never brings the pen to the axis.
    let m = machine(Polar { rack_offset_mm: 3.0 });
    assert_eq!(m.pole_on(&through), None);
}
