//! Machines for the planner's tests: a coaxial arm, a CoreXY and a polar machine with round
//! numbers.
#![allow(dead_code, reason = "not every test that shares this module needs all of it")]

use drawing::Rect;
use kinematics::{
    Cartesian, Geometry, Joint, JointPos, Machine, MachineParts, Motor, PenLimits, Polar, TwoLink,
};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

pub(crate) fn motor(name: &str, counts: f64, offset: f64, max_speed: f64, max_acceleration: f64) -> Motor {
    Motor {
        name: name.into(),
        ticks_per_unit: counts,
        offset_ticks: offset,
        max_speed_ticks_s: max_speed,
        max_acceleration_ticks_s2: max_acceleration,
        max_jerk_ticks_s3: None,
    }
}

fn build(
    geometry: Geometry,
    joints: [Joint; 2],
    coupling: [[f64; 2]; 2],
    motors: [Motor; 2],
    sheet: Rect,
    start: JointPos,
) -> Machine {
    Machine::new(MachineParts {
        name: "test".into(),
        geometry,
        joints,
        min_manipulability: if matches!(geometry, Geometry::TwoLink(_)) { 0.1 } else { 0.0 },
        coupling,
        motors,
        pen: PenLimits {
            max_speed_mm_s: 60.0,
            max_travel_speed_mm_s: f64::INFINITY,
            lift_time_s: 0.12,
            drop_time_s: 0.15,
        },
        sheet,
        start,
        period_s: 0.01,
    })
    .expect("the parts make a machine")
}

pub(crate) fn arm() -> Machine {
    let counts = 3200.0 / TAU;
    build(
        Geometry::TwoLink(TwoLink { l1: 206.0, l2: 256.0, elbow_left: true }),
        [Joint::FREE, Joint::FREE],
        [[1.0, 0.0], [0.0, -1.0]],
        [motor("arm1", counts, 0.0, 533.0, 2667.0), motor("arm2", counts, 800.0, 533.0, 2667.0)],
        Rect::new(12.7, 76.2, 228.6, 355.6),
        JointPos::new(FRAC_PI_2, FRAC_PI_2),
    )
}

pub(crate) fn corexy() -> Machine {
    build(
        Geometry::Cartesian(Cartesian),
        [Joint { min: 0.0, max: 200.0 }, Joint { min: 0.0, max: 200.0 }],
        [[1.0, 1.0], [1.0, -1.0]],
        [motor("a", 92.0, 0.0, 4000.0, 30000.0), motor("b", 92.0, 0.0, 4000.0, 30000.0)],
        Rect::new(0.0, 0.0, 200.0, 200.0),
        JointPos::new(0.0, 0.0),
    )
}

pub(crate) fn polar() -> Machine {
    build(
        Geometry::Polar(Polar),
        [Joint { min: 0.0, max: PI }, Joint { min: 48.0, max: 138.0 }],
        [[-1.0, 0.0], [0.0, 1.0]],
        [
            motor("theta", 1856.0 / PI, 2400.0, 1000.0, 6000.0),
            motor("r", 360.0 / 44.0, -138.0 * 360.0 / 44.0, 360.0, 3600.0),
        ],
        Rect::new(-138.0, 0.0, 138.0, 138.0),
        JointPos::new(FRAC_PI_2, 138.0),
    )
}

/// The machine with jerk limits such that motors reach their largest acceleration in `build_up` s.
pub(crate) fn with_jerk(machine: &Machine, build_up: f64) -> Machine {
    let mut parts = machine.parts().clone();
    for motor in &mut parts.motors {
        motor.max_jerk_ticks_s3 = Some(motor.max_acceleration_ticks_s2 / build_up);
    }
    Machine::new(parts).expect("a machine with another limit is one")
}
