//! Machines with round numbers, similar to the presets, and random machines.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use drawing::{Point, Rect, Vec2};
use kinematics::{
    Cartesian, JointKind, JointPos, JointRange, Machine, MachineParts, Mechanism, Motor, PenLimits, Polar,
    TwoLink,
};
use proptest::prelude::*;

use crate::mechanisms::{mechanism, unwrapped};

/// The pen of these machines.
const PEN: PenLimits = PenLimits {
    max_speed_mm_s: 60.0,
    max_travel_speed_mm_s: f64::INFINITY,
    lift_time_s: 0.12,
    drop_time_s: 0.15,
};

/// A motor with limits in ticks.
pub fn motor(
    name: &str,
    ticks_per_unit: f64,
    offset_ticks: f64,
    max_speed_ticks_s: f64,
    max_acceleration_ticks_s2: f64,
) -> Motor {
    Motor {
        name: name.into(),
        ticks_per_unit,
        offset_ticks,
        max_speed_ticks_s,
        max_acceleration_ticks_s2,
        max_jerk_ticks_s3: None,
        backlash_ticks: 0.0,
    }
}

/// The machine of these parts.
pub fn build(parts: MachineParts) -> Machine {
    Machine::new(parts).expect("the parts make a machine")
}

/// A two-link arm with both motors on the base, the elbow on the left.
pub fn arm() -> Machine {
    let ticks_per_rad = 3200.0 / TAU;
    build(MachineParts {
        coupling: [[1.0, 0.0], [0.0, -1.0]],
        pen: PEN,
        start: JointPos::new(FRAC_PI_2, FRAC_PI_2),
        ..MachineParts::new(
            "test",
            TwoLink { l1_mm: 206.0, l2_mm: 256.0, elbow_left: true },
            [
                motor("arm1", ticks_per_rad, 0.0, 533.0, 2667.0),
                motor("arm2", ticks_per_rad, 800.0, 533.0, 2667.0),
            ],
            Rect::new(12.7, 76.2, 228.6, 355.6),
        )
    })
}

/// A CoreXY table, 200 x 200 mm.
pub fn corexy() -> Machine {
    build(MachineParts {
        joints: [JointRange { min: 0.0, max: 200.0 }; 2],
        coupling: [[1.0, 1.0], [1.0, -1.0]],
        pen: PEN,
        start: JointPos::ZERO,
        ..MachineParts::new(
            "test",
            Cartesian,
            [motor("a", 92.0, 0.0, 4000.0, 30000.0), motor("b", 92.0, 0.0, 4000.0, 30000.0)],
            Rect::new(0.0, 0.0, 200.0, 200.0),
        )
    })
}

/// A rail that turns through half a turn, with a sliding rack, r = 48 to 138 mm.
pub fn polar() -> Machine {
    build(MachineParts {
        joints: [JointRange { min: 0.0, max: PI }, JointRange { min: 48.0, max: 138.0 }],
        min_manipulability: 0.0,
        coupling: [[-1.0, 0.0], [0.0, 1.0]],
        pen: PEN,
        start: JointPos::new(FRAC_PI_2, 138.0),
        ..MachineParts::new(
            "test",
            Polar::default(),
            [
                motor("theta", 1856.0 / PI, 2400.0, 1000.0, 6000.0),
                motor("r", 360.0 / 44.0, -138.0 * 360.0 / 44.0, 360.0, 3600.0),
            ],
            Rect::new(-138.0, 0.0, 138.0, 138.0),
        )
    })
}

/// The machine with motors that take `build_up_s` to reach their largest acceleration.
pub fn with_jerk(machine: &Machine, build_up_s: f64) -> Machine {
    let mut parts = machine.parts().clone();
    for motor in &mut parts.motors {
        motor.max_jerk_ticks_s3 = Some(motor.max_acceleration_ticks_s2 / build_up_s);
    }
    build(parts)
}

/// Couplings: the identity, CoreXY, H-bot, elbow belts of ratio 0.4 to 3, open and crossed, a motor on
/// the elbow, with or without a gear, and any other matrix that is not nearly singular.
pub fn coupling() -> impl Strategy<Value = [[f64; 2]; 2]> {
    let regular = proptest::array::uniform4(-2.0..2.0f64)
        .prop_map(|[a, b, c, d]| [[a, b], [c, d]])
        .prop_filter("nearly singular", |m| (m[0][0] * m[1][1] - m[0][1] * m[1][0]).abs() > 0.1);
    prop_oneof![
        Just([[1.0, 0.0], [0.0, 1.0]]),
        Just([[1.0, 1.0], [1.0, -1.0]]),
        Just([[1.0, 1.0], [-1.0, 1.0]]),
        Just([[1.0, 0.0], [-1.0, 1.0]]),
        (-3.0..-0.4f64).prop_map(|gear| [[1.0, 0.0], [-gear, gear]]),
        (0.4..3.0f64).prop_map(|ratio| [[1.0, 0.0], [1.0 - 1.0 / ratio, 1.0 / ratio]]),
        (-3.0..-0.4f64).prop_map(|crossed| [[1.0, 0.0], [1.0 - 1.0 / crossed, 1.0 / crossed]]),
        regular,
    ]
}

/// Random machines of every registered kind that can draw on all of their sheet.
///
/// Links have ratios from 0.3 to 3, elbows are on both sides, couplings as of [`coupling`], ticks
/// per unit are negative for half the motors. The sheet may lie in any direction from the base, also
/// where an angle passes from pi to -pi, the start pose may be any number of turns away from the
/// principal values, and half the machines have joint ranges that end closely beyond what the sheet
/// needs.
pub fn machine() -> impl Strategy<Value = Machine> {
    let ticks = || {
        let size = prop_oneof![Just(3200.0 / TAU), 5.0..20.0f64, 100.0..2000.0f64];
        (size, any::<bool>(), -3000.0..3000.0f64)
            .prop_map(|(ticks, negative, offset)| (if negative { -ticks } else { ticks }, offset))
    };
    let place = (0.0..TAU, 0.15..0.85f64, 20.0..60.0f64, -2..=2i32);
    let limits = proptest::option::of(proptest::array::uniform4(0.01..0.5f64));
    let speeds = (0.5..4.0f64, 2.0..20.0f64);
    (mechanism(), coupling(), [ticks(), ticks()], place, limits, speeds).prop_filter_map(
        "no sheet of this size within reach",
        |(mechanism, coupling, ticks, (direction, share, size, turns), limits, (speed, build_up))| {
            let center = point_within(&*mechanism, direction, share, 0.3)?;
            let half = Vec2::new(0.5 * size, 0.5 * size);
            let sheet = Rect::from_points(center - half, center + half);
            let middle = mechanism.inverse(center).ok()?;
            let poses: Option<Vec<JointPos>> = grid(sheet)
                .map(|p| {
                    let q = unwrapped(&*mechanism, p, &middle)?;
                    (mechanism.manipulability(&q) > 0.15).then_some(q)
                })
                .collect();
            let poses = poses.filter(|poses| is_in_one_part(&*mechanism, poses))?;
            let start = middle + mechanism.full_rotation().unwrap_or_default() * f64::from(turns);
            let range = |k: usize| {
                let Some(margins) = limits else { return JointRange::FREE };
                let unit = if mechanism.joint_kinds()[k] == JointKind::Revolute { 1.0 } else { 50.0 };
                let offset = start[k] - middle[k];
                let low = poses.iter().map(|q| q[k]).fold(f64::INFINITY, f64::min);
                let high = poses.iter().map(|q| q[k]).fold(f64::NEG_INFINITY, f64::max);
                JointRange {
                    min: low + offset - unit * margins[2 * k],
                    max: high + offset + unit * margins[2 * k + 1],
                }
            };
            let motor = |k: usize| {
                let (ticks_per_unit, offset_ticks) = ticks[k];
                let unit = if mechanism.joint_kinds()[k] == JointKind::Revolute { 1.0 } else { 100.0 };
                let name = ["a", "b"][k];
                Motor {
                    offset_ticks,
                    ..Motor::new(name, ticks_per_unit, unit * speed, unit * speed * build_up)
                }
            };
            let parts = MachineParts {
                name: "random".into(),
                joints: [range(0), range(1)],
                min_manipulability: mechanism.default_min_manipulability(),
                coupling,
                motors: [motor(0), motor(1)],
                pen: PEN,
                pen_servo: None,
                pen_offsets_mm: std::collections::BTreeMap::new(),
                homing: None,
                sheet,
                start,
                period_s: 0.01,
                mechanism: mechanism.clone(),
            };
            Machine::new(parts).ok()
        },
    )
}

/// A point in a direction from the centre, at a share of the distances at which the
/// manipulability is at least `least`.
pub fn point_within(mechanism: &dyn Mechanism, direction: f64, share: f64, least: f64) -> Option<Point> {
    let (sin, cos) = libm::sincos(direction);
    let base = mechanism.center();
    let at = |r: f64| base + r * Vec2::new(cos, sin);
    let good = |r: &f64| mechanism.inverse(at(*r)).is_ok_and(|q| mechanism.manipulability(&q) >= least);
    let distances: Vec<f64> = (1..1000).map(f64::from).filter(good).collect();
    let index = (share * distances.len() as f64) as usize;
    distances.get(index).map(|r| at(*r))
}

/// Whether no angle jumps between neighbours of a [`grid`]: a sheet across the line between the bases of a
/// five-bar lies in two parts of the reach.
fn is_in_one_part(mechanism: &dyn Mechanism, poses: &[JointPos]) -> bool {
    let turns = mechanism.joint_kinds().map(|kind| kind == JointKind::Revolute);
    let near = |from: usize, to: usize| {
        let change = (poses[to] - poses[from]).abs();
        (0..2).all(|k| !turns[k] || change[k] < PI)
    };
    (0..poses.len()).all(|k| (k % 9 == 8 || near(k, k + 1)) && (k + 9 >= poses.len() || near(k, k + 9)))
}

/// Points over a sheet, its border included.
fn grid(sheet: Rect) -> impl Iterator<Item = Point> {
    let share = |k: usize| f64::from(u8::try_from(k).expect("small")) / 8.0;
    (0..81).map(move |k| {
        Point::new(sheet.x0 + share(k % 9) * sheet.width(), sheet.y0 + share(k / 9) * sheet.height())
    })
}
