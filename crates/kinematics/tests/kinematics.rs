//! Properties of the machines' mathematics: inverses, derivatives, bounds, coupling, reach.

use drawing::{Line, Point, Rect, Segment, Vec2};
use kinematics::{
    Cartesian, Coupling, Fault, Geometry, Joint, JointPos, Machine, MachineError, MachineParts, Motor,
    PenLimits, Polar, TwoLink,
};
use proptest::prelude::*;

fn motor(name: &str, counts: f64, offset: f64) -> Motor {
    Motor {
        name: name.into(),
        ticks_per_unit: counts,
        offset_ticks: offset,
        max_speed_ticks_s: 500.0,
        max_acceleration_ticks_s2: 2500.0,
        max_jerk_ticks_s3: None,
    }
}

fn machine(geometry: Geometry, coupling: [[f64; 2]; 2], counts: [f64; 2], start: JointPos) -> Machine {
    Machine::new(MachineParts {
        name: "test".into(),
        geometry,
        joints: [Joint::FREE, Joint::FREE],
        min_manipulability: 0.1,
        coupling,
        motors: [motor("a", counts[0], 3.0), motor("b", counts[1], -7.0)],
        pen: PenLimits {
            max_speed_mm_s: 50.0,
            max_travel_speed_mm_s: f64::INFINITY,
            lift_time_s: 0.1,
            drop_time_s: 0.1,
        },
        sheet: Rect::new(0.0, 0.0, 200.0, 200.0),
        start,
        period_s: 0.01,
    })
    .expect("the parts make a machine")
}

fn geometry() -> impl Strategy<Value = Geometry> {
    prop_oneof![
        Just(Geometry::Cartesian(Cartesian)),
        Just(Geometry::Polar(Polar)),
        (20.0..300.0f64, 20.0..300.0f64, any::<bool>())
            .prop_map(|(l1, l2, elbow_left)| Geometry::TwoLink(TwoLink { l1, l2, elbow_left })),
    ]
}

/// A pose well inside the geometry's range, on its own elbow branch.
fn pose(geometry: &Geometry, u: f64, v: f64) -> JointPos {
    match geometry {
        Geometry::Cartesian(_) => JointPos::new(300.0 * u, 300.0 * v),
        Geometry::Polar(_) => JointPos::new(3.0 * u, 200.0 + 190.0 * v),
        Geometry::TwoLink(arm) => {
            let beta = (1.6 + 1.45 * v) * if arm.elbow_left { -1.0 } else { 1.0 };
            JointPos::new(3.0 * u, 3.0 * u + beta)
        }
    }
}

fn regular_coupling() -> impl Strategy<Value = [[f64; 2]; 2]> {
    proptest::array::uniform4(-2.0..2.0f64)
        .prop_map(|[a, b, c, d]| [[a, b], [c, d]])
        .prop_filter("regular", |m| (m[0][0] * m[1][1] - m[0][1] * m[1][0]).abs() > 0.1)
}

fn size(p: Point) -> f64 {
    libm::hypot(p.x, p.y)
}

proptest! {
    #[test]
    fn forward_of_inverse_is_the_point(g in geometry(), x in -600.0..600.0f64, y in -600.0..600.0f64) {
        let p = Point::new(x, y);
        if let Ok(q) = g.inverse(p) {
            prop_assert!(size((g.forward(&q) - p).to_point()) < 1e-9);
        } else if let Geometry::TwoLink(arm) = g {
            prop_assert!(size(p) > arm.l1 + arm.l2 || size(p) < (arm.l1 - arm.l2).abs());
        } else {
            prop_assert!(false, "only arms have a limit");
        }
    }

    #[test]
    fn inverse_of_forward_is_the_pose(g in geometry(), u in -1.0..1.0f64, v in -1.0..1.0f64) {
        let q = pose(&g, u, v);
        let back = g.inverse(g.forward(&q)).unwrap();
        let turns = g.full_rotation().map_or(0.0, |turn| ((q[0] - back[0]) / turn[0]).round());
        let back = back + g.full_rotation().unwrap_or_default() * turns;
        prop_assert!((back - q).norm() < 1e-9, "{:?} against {:?}", back, q);
    }

    #[test]
    fn the_jacobian_agrees_with_differences(g in geometry(), u in -1.0..1.0f64, v in -1.0..1.0f64) {
        let (q, h) = (pose(&g, u, v), 1e-6);
        let jacobian = g.jacobian(&q);
        for joint in 0..2 {
            let mut step = JointPos::ZERO;
            step[joint] = h;
            let difference = (g.forward(&(q + step)) - g.forward(&(q - step))) / (2.0 * h);
            prop_assert!((difference - jacobian[joint]).hypot2().sqrt() < 1e-5);
        }
    }

    /// Along p(s) = p0 + v s + a s²/2 the closed forms must equal differences of the inverse itself.
    #[test]
    fn path_derivatives_agree_with_differences(
        g in geometry(), u in -1.0..1.0f64, v in -0.9..0.9f64, direction in 0.0..6.2f64, bend in -0.02..0.02f64,
    ) {
        let q = pose(&g, u, v);
        let p = g.forward(&q);
        let first = Vec2::new(libm::cos(direction), libm::sin(direction));
        let second = bend * Vec2::new(-first.y, first.x);
        let h = 1e-3;
        let at = |s: f64| {
            let back = g.inverse(p + s * first + 0.5 * s * s * second).unwrap();
            back + g.full_rotation().unwrap_or_default() * g.full_rotation().map_or(0.0, |turn| ((q[0] - back[0]) / turn[0]).round())
        };
        let (ahead, behind) = (at(h), at(-h));
        let (q_1, q_2) = g.path_derivatives(&q, first, second);
        let scale = 1.0 + q_1.norm() + q_2.norm();
        prop_assert!(((ahead - behind) / (2.0 * h) - q_1).norm() < 1e-4 * scale);
        prop_assert!(((ahead - 2.0 * q + behind) / (h * h) - q_2).norm() < 2e-3 * scale);
    }

    /// Along p(s) = p0 + v s + a s²/2 + j s³/6 the third derivative must equal differences of the second.
    #[test]
    fn third_derivatives_agree_with_differences(
        g in geometry(), u in -1.0..1.0f64, v in -0.9..0.9f64, direction in 0.0..6.2f64, bend in -0.02..0.02f64,
        jerk in (-1e-3..1e-3f64, -1e-3..1e-3f64),
    ) {
        let q = pose(&g, u, v);
        let p = g.forward(&q);
        let first = Vec2::new(libm::cos(direction), libm::sin(direction));
        let (second, third) = (bend * Vec2::new(-first.y, first.x), Vec2::new(jerk.0, jerk.1));
        let h = 1e-3;
        let second_at = |s: f64| {
            let there = g.inverse(p + s * first + 0.5 * s * s * second + s * s * s / 6.0 * third).unwrap();
            g.path_derivatives(&there, first + s * second + 0.5 * s * s * third, second + s * third).1
        };
        let difference = (second_at(h) - second_at(-h)) / (2.0 * h);
        let q_3 = g.path_third_derivative(&q, first, second, third);
        prop_assert!((difference - q_3).norm() < 1e-4 * (1e-4 + q_3.norm()), "{:?} {:?}", difference, q_3);
    }

    /// |f(u) - chord(u)| <= u (1 - u) / 2 * max |f''|: linear joint motion stays within bend / 8 of the chord.
    #[test]
    fn linear_joint_motion_leaves_the_chord_by_no_more_than_the_bound(
        g in geometry(), u in -1.0..1.0f64, v in -1.0..1.0f64, du in -0.5..0.5f64, dv in -0.5..0.5f64,
    ) {
        let from = pose(&g, u, v);
        let to = pose(&g, (u + du).clamp(-1.0, 1.0), (v + dv).clamp(-1.0, 1.0));
        let (p, r) = (g.forward(&from), g.forward(&to));
        let bound = g.second_derivative_bound(&from, &to);
        for k in 0..=20 {
            let t = f64::from(k) / 20.0;
            let off = g.forward(&(from + t * (to - from))) - (p + t * (r - p));
            prop_assert!(off.hypot2().sqrt() <= t * (1.0 - t) / 2.0 * bound + 1e-9);
        }
    }

    #[test]
    fn coupling_and_counts_go_there_and_back(
        g in geometry(), rows in regular_coupling(), a in 1.0..600.0f64, b in -600.0..-1.0f64,
        u in -1.0..1.0f64, v in -1.0..1.0f64,
    ) {
        let m = machine(g, rows, [a, b], pose(&g, 0.0, 0.0));
        let q = pose(&g, u, v);
        prop_assert!((m.joint_positions(&m.motor_positions(&q)) - q).norm() < 1e-8);
        let by_hand = a * (rows[0][0] * q[0] + rows[0][1] * q[1]) + 3.0;
        prop_assert!((m.motor_positions(&q)[0] - by_hand).abs() < 1e-8 * (1.0 + by_hand.abs()));
    }

    #[test]
    fn poses_are_unwrapped_to_the_nearest_turn(g in geometry(), u in -1.0..1.0f64, v in -1.0..1.0f64, turns in -3..=3i32) {
        let m = machine(g, [[1.0, 0.0], [0.0, 1.0]], [10.0, 10.0], pose(&g, 0.0, 0.0));
        let q = pose(&g, u, v);
        let near = q + g.full_rotation().unwrap_or_default() * f64::from(turns);
        let found = m.pose_near(g.forward(&q), &near).unwrap();
        prop_assert!((found - near).norm() < 1e-8);
    }

    /// No point of a segment that passes may be unreachable: reach is about the whole segment.
    #[test]
    fn a_segment_that_passes_is_reachable_throughout(
        x0 in -400.0..400.0f64, y0 in -400.0..400.0f64, x1 in -400.0..400.0f64, y1 in -400.0..400.0f64,
    ) {
        let arm = Geometry::TwoLink(TwoLink { l1: 206.0, l2: 256.0, elbow_left: true });
        let m = machine(arm, [[1.0, 0.0], [0.0, 1.0]], [500.0, 500.0], pose(&arm, 0.0, 0.0));
        let line = Line::new(Point::new(x0, y0), Point::new(x1, y1));
        let passes = m.check_segment(&Segment::Line(line)).is_ok();
        let points = (0..=500).map(|k| line.p0 + (f64::from(k) / 500.0) * (line.p1 - line.p0));
        let faults = points.filter(|p| m.check_point(*p).is_err()).count();
        prop_assert!(!passes || faults == 0);
        prop_assert!(passes || faults > 0 || size(line.p0) > 0.0);
    }
}

#[test]
fn a_line_between_two_reachable_points_may_pass_too_near_to_the_base() {
    let arm = Geometry::TwoLink(TwoLink { l1: 206.0, l2: 256.0, elbow_left: true });
    let m = machine(arm, [[1.0, 0.0], [0.0, 1.0]], [500.0, 500.0], pose(&arm, 0.0, 0.0));
    let line = Segment::Line(Line::new(Point::new(-100.0, 10.0), Point::new(100.0, 10.0)));
    assert!(m.check_point(Point::new(-100.0, 10.0)).is_ok());
    let fault = m.check_segment(&line).unwrap_err();
    assert_eq!(fault.point, Point::new(0.0, 10.0));
    assert_eq!(fault.fault, Fault::TooNear(40.0));
}

#[test]
fn a_stretched_arm_is_refused_as_singular() {
    let arm = Geometry::TwoLink(TwoLink { l1: 206.0, l2: 256.0, elbow_left: true });
    let m = machine(arm, [[1.0, 0.0], [0.0, 1.0]], [500.0, 500.0], pose(&arm, 0.0, 0.0));
    assert!(matches!(m.check_point(Point::new(0.0, 461.9)).unwrap_err().fault, Fault::Singular { .. }));
    assert_eq!(m.check_point(Point::new(0.0, 463.0)).unwrap_err().fault, Fault::TooFar(1.0));
}

#[test]
fn the_elbow_is_on_the_side_that_was_asked_for() {
    for elbow_left in [true, false] {
        let arm = Geometry::TwoLink(TwoLink { l1: 206.0, l2: 256.0, elbow_left });
        let p = Point::new(120.0, 250.0);
        let q = arm.inverse(p).unwrap();
        let elbow = 206.0 * Vec2::new(libm::cos(q[0]), libm::sin(q[0]));
        // Left of the ray from base to pen: positive cross product.
        assert_eq!(p.to_vec2().cross(elbow) > 0.0, elbow_left);
    }
}

#[test]
fn a_singular_coupling_is_refused() {
    assert!(Coupling::from_rows([[1.0, 1.0], [2.0, 2.0]]).is_err());
    assert!(Coupling::from_rows([[1.0, f64::NAN], [2.0, 2.0]]).is_err());
    assert!(Coupling::from_rows([[0.0, 0.0], [0.0, 1.0]]).is_err());
}

#[test]
fn a_start_pose_outside_the_joint_limits_is_refused() {
    let mut parts =
        machine(Geometry::Polar(Polar), [[1.0, 0.0], [0.0, 1.0]], [10.0, 10.0], JointPos::new(1.0, 50.0))
            .parts()
            .clone();
    parts.joints[1] = Joint { min: 60.0, max: 100.0 };
    assert!(matches!(Machine::new(parts), Err(MachineError::Start { .. })));
}

/// Half a tick on both motors of seed 1's arm: 0.4045 mm and 0.5027 mm a tick, 0.4536 mm at the worst when stretched.
#[test]
fn the_tick_floor_of_the_first_seeds_arm() {
    let arm = Geometry::TwoLink(TwoLink { l1: 206.0, l2: 256.0, elbow_left: true });
    let counts = 3200.0 / std::f64::consts::TAU;
    let m = machine(arm, [[1.0, 0.0], [0.0, -1.0]], [counts, counts], pose(&arm, 0.0, 0.0));
    let half = std::f64::consts::FRAC_PI_2;
    assert!((m.quantization_error(&JointPos::new(half, half)) - 0.4536).abs() < 1e-4);
    assert!(
        (m.quantization_error(&JointPos::new(half, 0.0)) - libm::hypot(0.4045, 0.5027) / 2.0).abs() < 1e-3
    );
}
