//! What every mechanism promises, tested for each registered kind: inverses, derivatives, bounds,
//! manipulability, extreme values on lines. A new mechanism is tested here by its line in `KINDS`.

use std::f64::consts::TAU;
use std::sync::Arc;

use drawing::{Line, Point, Rect, Vec2};
use kinematics::mechanism::KINDS;
use kinematics::{Anchor, FiveBar, JointKind, JointPos, Mechanism, Polar, Polargraph, Unreachable};
use proptest::prelude::*;
use test_support::machines::point_within;
use test_support::mechanisms::{mechanism, unwrapped};

/// A mechanism and a pose that is at least 0.05 away from a singular one, on any turn.
fn posed() -> impl Strategy<Value = (Arc<dyn Mechanism>, JointPos)> {
    let place = (mechanism(), 0.0..TAU, 0.0..1.0f64, -2..=2i32);
    place.prop_filter_map("nothing regular in this direction", |(m, direction, share, turns)| {
        let p = point_within(&*m, direction, share, 0.05);
        assert!(p.is_some() || m.base().is_none(), "there are regular poses in any direction from a base");
        let q = m.inverse(p?).expect("within reach");
        let q = q + m.full_rotation().unwrap_or_default() * f64::from(turns);
        Some((m, q))
    })
}

/// Parts of a line in which joints are tested to be monotone.
const PARTS: u32 = 400;

fn size(v: Vec2) -> f64 {
    v.hypot2().sqrt()
}

/// The determinant of the Jacobian.
fn determinant(m: &dyn Mechanism, q: &JointPos) -> f64 {
    let [a, b] = m.jacobian(q);
    a.cross(b)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn forward_of_inverse_is_the_point(m in mechanism(), x in -900.0..900.0f64, y in -900.0..900.0f64) {
        let p = Point::new(x, y);
        match m.inverse(p) {
            Ok(q) => prop_assert!(size(m.forward(&q) - p) < 1e-9),
            Err(Unreachable::OtherAssembly | Unreachable::Slack(_)) => prop_assert!(m.base().is_none()),
            // Of two bases, the other one may be out of reach as well.
            Err(_) if m.base().is_none() => {}
            Err(unreachable) => {
                // As far as it says towards the base, or away from it, there is a pose.
                let base = m.base().expect("without a base every point is reachable");
                let outwards = (p - base) / size(p - base);
                let by = match unreachable {
                    Unreachable::TooFar(by) => -by,
                    Unreachable::TooNear(by) => by,
                    _ => unreachable!("see above"),
                };
                prop_assert!(m.inverse(p + (by + 1e-9 * by.signum()) * outwards).is_ok());
                prop_assert!(m.inverse(p + (by - 1e-9 * by.signum()) * outwards).is_err());
            }
        }
    }

    #[test]
    fn linkage_ends_at_the_pen_and_its_anchors_follow_earlier_ones((m, q) in posed()) {
        let linkage = m.linkage(Rect::new(20.0, 40.0, 230.0, 340.0));
        let points = linkage.points(&q);
        prop_assert!(size(points[linkage.pen] - m.forward(&q)) < 1e-9);
        for (index, anchor) in linkage.anchors.iter().enumerate() {
            if let Anchor::Moving { from, .. } = anchor {
                prop_assert!(*from < index);
            }
        }
        for part in &linkage.parts {
            prop_assert!(part.from < points.len() && part.to < points.len());
        }
        // Some part moves: a picture of the machine shows its pose.
        let moved = linkage.points(&(q + JointPos::new(0.1, 0.1)));
        prop_assert!(linkage.parts.iter().any(|part| size(points[part.to] - moved[part.to]) > 0.0));
    }

    #[test]
    fn inverse_of_forward_is_the_pose((m, q) in posed()) {
        let back = unwrapped(&*m, m.forward(&q), &q).expect("within reach");
        prop_assert!((back - q).norm() < 1e-9, "{back:?} against {q:?}");
    }

    #[test]
    fn full_rotation_leaves_the_pen_in_place((m, q) in posed()) {
        if let Some(rotation) = m.full_rotation() {
            prop_assert!(rotation[0] != 0.0, "the first joint takes part");
            prop_assert!(size(m.forward(&(q + rotation)) - m.forward(&q)) < 1e-9);
        }
    }

    #[test]
    fn jacobian_agrees_with_finite_differences((m, q) in posed()) {
        for joint in 0..2 {
            let mut rates = JointPos::ZERO;
            rates[joint] = 1.0;
            let difference = |h: f64| (m.forward(&(q + h * rates)) - m.forward(&(q - h * rates))) / (2.0 * h);
            let (coarse, fine) = (difference(2e-6), difference(1e-6));
            let allowed = if m.base().is_some() { 1e-5 } else { 1e-5 + size(coarse - fine) };
            prop_assert!(size(fine - m.jacobian(&q)[joint]) < allowed);
            prop_assert_eq!(m.pen_velocity(&q, &rates), m.jacobian(&q)[joint]);
        }
    }

    /// Along p(s) = p0 + v s + a s²/2 the closed forms must equal differences of the inverse.
    #[test]
    fn path_derivatives_agree_with_finite_differences(
        (m, q) in posed(), direction in 0.0..TAU, curvature in -0.02..0.02f64,
    ) {
        let p = m.forward(&q);
        let first = Vec2::new(libm::cos(direction), libm::sin(direction));
        let second = curvature * Vec2::new(-first.y, first.x);
        let h = 1e-3;
        let at = |s: f64| unwrapped(&*m, p + s * first + 0.5 * s * s * second, &q).expect("within reach");
        let (ahead, behind) = (at(h), at(-h));
        let (q_1, q_2) = m.path_derivatives(&q, first, second);
        let q_3 = m.path_third_derivative(&q, first, second, Vec2::ZERO);
        let scale = 1.0 + q_1.norm() + q_2.norm() + q_3.norm();
        prop_assert!(((ahead - behind) / (2.0 * h) - q_1).norm() < 1e-4 * scale);
        prop_assert!(((ahead - 2.0 * q + behind) / (h * h) - q_2).norm() < 2e-3 * scale);
    }

    /// Along p(s) = p0 + v s + a s²/2 + j s³/6 the third derivative must equal differences of the
    /// second.
    #[test]
    fn third_derivatives_agree_with_finite_differences(
        (m, q) in posed(), direction in 0.0..TAU, curvature in -0.02..0.02f64,
        jerk in (-1e-3..1e-3f64, -1e-3..1e-3f64),
    ) {
        let p = m.forward(&q);
        let first = Vec2::new(libm::cos(direction), libm::sin(direction));
        let (second, third) = (curvature * Vec2::new(-first.y, first.x), Vec2::new(jerk.0, jerk.1));
        let second_at = |s: f64| {
            let there = m.inverse(p + s * first + 0.5 * s * s * second + s * s * s / 6.0 * third);
            let there = there.expect("within reach");
            m.path_derivatives(&there, first + s * second + 0.5 * s * s * third, second + s * third).1
        };
        let difference = |h: f64| (second_at(h) - second_at(-h)) / (2.0 * h);
        let q_3 = m.path_third_derivative(&q, first, second, third);
        // The error of a difference falls with h²: what it still changes by tells how large it is.
        let (coarse, fine) = (difference(2e-4), difference(1e-4));
        let allowed = 1e-7 + 1e-4 * q_3.norm() + (coarse - fine).norm();
        prop_assert!((fine - q_3).norm() < allowed, "{fine:?} {q_3:?}");
    }

    /// |p(u) - chord(u)| <= u (1 - u) / 2 * max |p''|, and p'' itself by differences.
    #[test]
    fn second_derivative_bound_holds(
        (m, from) in posed(), share in -1.0..1.0f64, other in -1.0..1.0f64,
    ) {
        // Up to a fifth of a turn, or 100 mm; less where the mechanism comes to another branch.
        let scale = if m.base().is_some() || m.is_linear() { 1.0 } else { 0.1 };
        let reach = m.joint_kinds();
        let reach = reach.map(|kind| scale * if kind == JointKind::Revolute { 1.2 } else { 100.0 });
        let change = JointPos::new(share * reach[0], other * reach[1]);
        let to = from + change;
        let bound = m.second_derivative_bound(&from, &to);
        if bound == f64::INFINITY {
            // Near a singular pose only.
            prop_assert!(m.base().is_none());
            return Ok(());
        }
        let at = |u: f64| m.forward(&(from + u * change));
        // Rounding of positions of 1 m is 1e-5 in the second difference.
        let h = 3e-4;
        for k in 0..=20 {
            let u = f64::from(k) / 20.0;
            let off = at(u) - (at(0.0) + u * (at(1.0) - at(0.0)));
            prop_assert!(size(off) <= u * (1.0 - u) / 2.0 * bound + 1e-9);
            if k > 0 && k < 20 {
                let second = (at(u + h) - at(u)) - (at(u) - at(u - h));
                prop_assert!(size(second) / (h * h) <= bound * (1.0 + 1e-6) + 1e-4);
            }
        }
    }

    /// Manipulability is from 0 to 1, 0 exactly where the Jacobian is singular, and as small as the
    /// least singular value against its largest possible one.
    #[test]
    fn manipulability_vanishes_with_the_determinant(
        m in mechanism(), a in -3.0..3.0f64, b in -3.0..3.0f64, near in 0.0..1e-3f64, direction in 0.0..TAU,
    ) {
        let Some(base) = m.base() else { return Ok(()) };
        let unit = m.joint_kinds().map(|kind| if kind == JointKind::Revolute { 1.0 } else { 100.0 });
        let q = JointPos::new(a * unit[0], b * unit[1]);
        let value = m.manipulability(&q);
        prop_assert!((0.0..=1.0).contains(&value));
        prop_assert_eq!(value > 1e-9, determinant(&*m, &q).abs() > 1e-9);
        // Along a ray from the base: at the limits of the reach, and at the base itself, the
        // mechanism is singular, if it is singular anywhere.
        let ray = Vec2::new(libm::cos(direction), libm::sin(direction));
        let reachable = |r: f64| m.inverse(base + r * ray).is_ok();
        let inside = (1..2000).map(f64::from).find(|r| reachable(*r)).expect("reachable in any direction");
        let (mut low, mut high) = (0.0, inside);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if reachable(middle) { high = middle } else { low = middle }
        }
        let q = m.inverse(base + (high + near * near * near) * ray).expect("within reach");
        prop_assert!(m.manipulability(&q) < 1e-3, "{} at {high}", m.manipulability(&q));
    }

    /// Between an end, the foot of the perpendicular from the base and the extrema, joints are
    /// monotone.
    #[test]
    fn joints_are_monotone_between_their_extrema(
        (m, q) in posed(), direction in 0.0..TAU, length in 1.0..600.0f64,
    ) {
        let p = m.forward(&q);
        let along = length * Vec2::new(libm::cos(direction), libm::sin(direction));
        let line = Line::new(p, p + along);
        let mut parameters = m.joint_extrema_on_line(&line);
        parameters.extend(m.base().map(|base| (base - p).dot(along) / along.hypot2()));
        let cut = |low: f64, high: f64| parameters.iter().any(|t| *t >= low && *t <= high);
        let pose = |k: u32| m.inverse(p + f64::from(k) / f64::from(PARTS) * along).ok();
        let mut last: Option<JointPos> = None;
        let mut from = Some(q);
        for k in 1..=PARTS {
            let to = from.and_then(|from| {
                let q = pose(k)?;
                let near = unwrapped(&*m, m.forward(&q), &from)?;
                Some(near)
            });
            let change = from.zip(to).map(|(from, to)| to - from);
            let jumps = |change: &JointPos| {
                (0..2).any(|k| m.joint_kinds()[k] == JointKind::Revolute && change[k].abs() > 3.0)
            };
            let change = change.filter(|change| m.base().is_some() || !jumps(change));
            if let (Some(before), Some(now)) = (last, change)
                && !cut(f64::from(k - 2) / f64::from(PARTS), f64::from(k) / f64::from(PARTS))
            {
                for joint in 0..2 {
                    prop_assert!(before[joint] * now[joint] > -1e-18, "joint {joint} turns back at {k}");
                }
            }
            last = change;
            from = to;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// Mechanisms without a base: along a line that leaves the reach, the manipulability vanishes at its
    /// boundary; inside, the Jacobian has an inverse.
    #[test]
    fn manipulability_vanishes_at_the_boundary_of_the_reach(
        (m, q) in posed(), direction in 0.0..TAU,
    ) {
        if m.base().is_some() || m.is_linear() {
            return Ok(());
        }
        let value = m.manipulability(&q);
        prop_assert!((0.0..=1.0).contains(&value));
        let size_of_inverse = determinant(&*m, &q).abs();
        prop_assert!(size_of_inverse > 1e-9 && size_of_inverse < 1e9);
        let (p, along) = (m.forward(&q), Vec2::new(libm::cos(direction), libm::sin(direction)));
        let Some(outside) = (1..3000).map(f64::from).find(|r| m.inverse(p + *r * along).is_err()) else {
            return Ok(());
        };
        let (mut inside, mut outside) = (outside - 1.0, outside);
        for _ in 0..60 {
            let middle = 0.5 * (inside + outside);
            if m.inverse(p + middle * along).is_ok() { inside = middle } else { outside = middle }
        }
        let q = m.inverse(p + inside * along).expect("within reach");
        prop_assert!(m.manipulability(&q) < 1e-3, "{} at {inside}", m.manipulability(&q));
    }

    /// Everything within the clearance is reachable, without a jump, at the manipulability.
    #[test]
    fn clearance_holds(
        (m, q) in posed(), direction in 0.0..TAU, share in 0.0..1.0f64, least in 0.0..0.3f64,
    ) {
        let clearance = m.clearance_mm(&q, least);
        prop_assert_eq!(clearance == f64::INFINITY, m.base().is_some() || m.is_linear());
        if clearance > 0.0 && clearance.is_finite() {
            let p = m.forward(&q) + share * clearance * Vec2::new(libm::cos(direction), libm::sin(direction));
            let there = unwrapped(&*m, p, &q);
            let there = there.expect("within reach");
            prop_assert!(m.manipulability(&there) >= least - 1e-9);
            prop_assert!(m.stays_regular(&q, &q));
        } else if m.base().is_none() {
            prop_assert!(clearance == f64::INFINITY || m.manipulability(&q) <= least + 1e-9);
        }
    }

    /// Poses on a way that stays regular are those of their points.
    #[test]
    fn regular_ways_have_no_other_branch(
        (m, from) in posed(), share in -1.0..1.0f64, other in -1.0..1.0f64,
    ) {
        let reach = m.joint_kinds().map(|kind| if kind == JointKind::Revolute { 2.0 } else { 200.0 });
        let change = JointPos::new(share * reach[0], other * reach[1]);
        if m.base().is_some() || m.is_linear() || !m.stays_regular(&from, &(from + change)) {
            return Ok(());
        }
        for k in 0..=50 {
            let q = from + f64::from(k) / 50.0 * change;
            let back = m.inverse(m.forward(&q)).expect("within reach");
            let turns = (q - back) / TAU;
            let off = if m.joint_kinds()[0] == JointKind::Revolute {
                JointPos::new(turns[0] - turns[0].round(), turns[1] - turns[1].round())
            } else {
                q - back
            };
            prop_assert!(off.norm() < 1e-6, "{q:?} {back:?}");
        }
    }
}

/// The vectors of independent code (issue 18).
#[test]
fn five_bar_against_independent_vectors() {
    let arm = FiveBar {
        bases: [Point::new(-40.0, 0.0), Point::new(40.0, 0.0)],
        proximal_mm: [100.0; 2],
        distal_mm: [140.0; 2],
        elbow_left: [true, false],
        pen_left: true,
    };
    for (x, y, theta1, theta2) in [
        (-60.0, 150.0, 2.819_164_162_7, 1.276_181_650_2),
        (0.0, 180.0, 2.199_922_670_4, 0.941_669_983_2),
        (75.5, 130.25, 1.779_259_895_1, 0.059_062_847_4),
        (20.0, 110.0, 2.396_359_180_7, 0.309_911_792_0),
    ] {
        let q = arm.inverse(Point::new(x, y)).unwrap();
        assert!((q - JointPos::new(theta1, theta2)).norm() < 1e-9, "{q:?}");
        assert!(size(arm.forward(&q) - Point::new(x, y)) < 1e-9);
    }
}

#[test]
fn polargraph_against_independent_vectors() {
    let cords = Polargraph { anchors: [Point::ZERO, Point::new(1000.0, 0.0)] };
    for (x, y, left, right) in [
        (200.0, -300.0, 360.555_127_546, 854.400_374_532),
        (500.0, -700.0, 860.232_526_704, 860.232_526_704),
        (812.5, -410.25, 910.198_501_702, 451.066_860_343),
    ] {
        let q = cords.inverse(Point::new(x, y)).unwrap();
        assert!((q - JointPos::new(left, right)).norm() < 1e-8, "{q:?}");
        assert!(size(cords.forward(&q) - Point::new(x, y)) < 1e-9);
    }
    assert_eq!(cords.inverse(Point::new(-2.0, -100.0)), Err(Unreachable::Slack(2.0)));
    assert_eq!(cords.inverse(Point::new(500.0, 3.0)), Err(Unreachable::Slack(3.0)));
}

#[test]
fn rack_offset_against_independent_vectors() {
    let polar = Polar { rack_offset_mm: 8.0 };
    for (x, y, phi, r) in [
        (-60.0, 90.0, 2.084_771_309_7, 107.870_292_481),
        (0.0, 120.0, 1.504_080_178_4, 119.733_036_377),
        (75.5, 60.25, 0.590_612_083_5, 96.261_687_602),
    ] {
        let q = polar.inverse(Point::new(x, y)).unwrap();
        assert!((q - JointPos::new(phi, r)).norm() < 1e-8, "{q:?}");
    }
    assert_eq!(polar.inverse(Point::new(0.0, 5.0)), Err(Unreachable::TooNear(3.0)));
}

/// The generator of random mechanisms reaches every kind, or the properties above would test nothing.
#[test]
fn random_mechanisms_are_of_every_kind() {
    use proptest::strategy::ValueTree as _;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let kinds: std::collections::BTreeSet<_> =
        (0..200).map(|_| mechanism().new_tree(&mut runner).expect("a mechanism").current().kind()).collect();
    assert_eq!(kinds.len(), KINDS.len(), "{kinds:?}");
}

#[test]
fn kinds_have_different_names_and_joints_of_their_own() {
    for (index, kind) in KINDS.iter().enumerate() {
        assert!(KINDS[..index].iter().all(|other| other.name != kind.name), "{}", kind.name);
    }
}
