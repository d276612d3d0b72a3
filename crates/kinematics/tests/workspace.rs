//! Outlines of the reach against the check of single points.

use drawing::{Line, Point, Rect, Segment, Vec2};
use kinematics::{
    Cartesian, FiveBar, JointKind, JointPos, JointRange, Machine, MachineParts, Mechanism, Motor, Polargraph,
    TwoLink, reach_outlines,
};
use test_support::machines;

fn build(mechanism: impl Mechanism + 'static, sheet: Rect, joints: [JointRange; 2]) -> Machine {
    let motors = ["a", "b"].map(|name| Motor::new(name, 500.0, 1.0, 5.0));
    let mut parts = MachineParts::new("test", mechanism, motors, sheet);
    parts.joints = joints;
    machines::build(parts)
}

fn five_bar() -> Machine {
    let bases = [Point::new(-40.0, 0.0), Point::new(40.0, 0.0)];
    let mechanism = FiveBar {
        bases,
        proximal_mm: [100.0, 100.0],
        distal_mm: [150.0, 150.0],
        elbow_left: [true, false],
        pen_left: true,
    };
    build(mechanism, Rect::new(-20.0, 150.0, 20.0, 170.0), [JointRange::FREE; 2])
}

fn polargraph() -> Machine {
    let anchors = [Point::new(0.0, 600.0), Point::new(700.0, 600.0)];
    let range = JointRange { min: 340.0, max: 900.0 };
    build(Polargraph { anchors }, Rect::new(300.0, 200.0, 400.0, 300.0), [range; 2])
}

/// Machines of each way to find outlines: on a grid, along rays, from a bed.
fn all() -> [Machine; 4] {
    let arm = TwoLink { l1_mm: 200.0, l2_mm: 120.0, elbow_left: true };
    let sheet = Rect::new(150.0, 150.0, 160.0, 160.0);
    let bed = [JointRange { min: 0.0, max: 300.0 }, JointRange { min: -20.0, max: 200.0 }];
    [
        five_bar(),
        polargraph(),
        build(arm, sheet, [JointRange::FREE; 2]),
        build(Cartesian, Rect::new(10.0, 10.0, 100.0, 100.0), bed),
    ]
}

/// Distance of a point from a closed outline, and how often a ray to the right crosses it.
fn place(outline: &[Point], p: Point) -> (f64, usize) {
    let mut found = (f64::INFINITY, 0);
    for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        let along = *b - *a;
        let t =
            if along.hypot2() > 0.0 { ((p - *a).dot(along) / along.hypot2()).clamp(0.0, 1.0) } else { 0.0 };
        found.0 = f64::min(found.0, (p - (*a + t * along)).hypot2().sqrt());
        let is_between = (a.y > p.y) != (b.y > p.y);
        if is_between && p.x < a.x + (p.y - a.y) / along.y * along.x {
            found.1 += 1;
        }
    }
    found
}

#[test]
fn points_inside_an_odd_number_of_outlines_are_reachable() {
    for machine in all() {
        let outlines = reach_outlines(&machine);
        assert!(!outlines.is_empty());
        let (mut within, mut compared) = (0, 0);
        for (x, y) in (0..3600).map(|k| (f64::from(k % 60), f64::from(k / 60))) {
            let p = Point::new(-350.0 + 17.3 * x, -350.0 + 17.3 * y);
            let places: Vec<(f64, usize)> = outlines.iter().map(|outline| place(outline, p)).collect();
            // Outlines are a polygon of 1 degree or of grid cells.
            if places.iter().any(|(distance, _)| *distance < 4.0) {
                continue;
            }
            let is_inside = places.iter().map(|(_, crossings)| crossings).sum::<usize>() % 2 == 1;
            let found = machine.check_point(p);
            assert_eq!(is_inside, found.is_ok(), "{:?} at {p}: {found:?}", machine.mechanism());
            within += usize::from(is_inside);
            compared += 1;
        }
        assert!(within > 50 && compared > 2500, "{:?}: {within} of {compared}", machine.mechanism());
    }
}

#[test]
fn outlines_on_a_grid_are_the_border_of_the_reach() {
    for machine in [five_bar(), polargraph()] {
        for vertex in reach_outlines(&machine).into_iter().flatten() {
            assert!(machine.check_point(vertex).is_ok(), "{vertex} is out of reach");
            // A cell is at most 4 mm wide, and halved eight times.
            let around = (0..32).map(|k| Vec2::from_angle(f64::from(k) * std::f64::consts::TAU / 32.0));
            let outside = around.filter(|way| machine.check_point(vertex + 0.04 * *way).is_err()).count();
            assert!(outside > 0, "{vertex} is {:?}", machine.check_point(vertex));
        }
    }
}

/// Lines between reachable points, by the points on them: a mechanism without a base is checked in steps.
#[test]
fn lines_that_leave_the_reach_between_their_ends_are_refused() {
    for machine in [five_bar(), polargraph()] {
        let mut reachable = Vec::new();
        for (x, y) in (0..144).map(|k| (f64::from(k % 12), f64::from(k / 12))) {
            let p = Point::new(-350.0 + 95.0 * x, -350.0 + 95.0 * y);
            reachable.extend(machine.check_point(p).is_ok().then_some(p));
        }
        let mut refused = 0;
        for (p0, p1) in reachable.iter().flat_map(|a| reachable.iter().map(move |b| (*a, *b))) {
            let leaves = (1..200).any(|k| machine.check_point(p0.lerp(p1, f64::from(k) / 200.0)).is_err());
            if leaves {
                let found = machine.check_segment(&Segment::Line(Line::new(p0, p1)));
                assert!(found.is_err(), "{p0} to {p1}");
                refused += 1;
            }
        }
        assert!(refused >= 4, "{refused} of {} points", reachable.len());
    }
}

/// A clearance that is too small would be safe, and slow.
#[test]
fn clearance_of_a_pose_far_from_the_border_is_some_millimetres() {
    for (machine, least_mm) in [(five_bar(), 10.0), (polargraph(), 10.0)] {
        let centre = machine.sheet().center();
        let pose = machine.mechanism().inverse(centre).expect("within reach");
        let clearance = machine.mechanism().clearance_mm(&pose, machine.parts().min_manipulability);
        assert!(clearance > least_mm, "{:?}: {clearance}", machine.mechanism());
        // Nothing within it is out of reach.
        let around = (0..64).map(|k| Vec2::from_angle(f64::from(k) * std::f64::consts::TAU / 64.0));
        for point in around.map(|way| centre + clearance * way) {
            assert!(machine.mechanism().inverse(point).is_ok(), "{point}");
        }
    }
}

/// By the second difference of the pen's path: the bound holds for every direction of the joints, and is not
/// far from what some direction takes.
#[test]
fn second_derivative_bound_holds_and_is_not_loose() {
    for machine in [five_bar(), polargraph()] {
        let mechanism = machine.mechanism();
        let from = mechanism.inverse(machine.sheet().center()).expect("within reach");
        let mut tightest = f64::INFINITY;
        for k in 0..64 {
            let way = Vec2::from_angle(f64::from(k) * std::f64::consts::TAU / 64.0);
            let step = if mechanism.joint_kinds()[0] == JointKind::Revolute { 0.001 } else { 0.1 };
            let at = |share: f64| from + JointPos::new(way.x, way.y) * (step * share);
            let [p0, p1, p2] = [0.0, 0.5, 1.0].map(|share| mechanism.forward(&at(share)));
            let second = 4.0 * ((p2 - p1) - (p1 - p0)).hypot();
            let bound = mechanism.second_derivative_bound(&from, &at(1.0));
            assert!(second <= bound * 1.001, "{mechanism:?}, direction {k}: {second} above {bound}");
            tightest = tightest.min(bound / second);
        }
        assert!(tightest < 8.0, "{mechanism:?}: at best {tightest} times the second derivative");
    }
}
