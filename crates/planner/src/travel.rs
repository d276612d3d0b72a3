//! What travel costs, in the motors' own time.

use drawing::Point;
use kinematics::{JointPos, Machine};

use crate::joint_path::travel_speed;

/// The pose in which the pen is taken to be at a point when travel is compared: that nearest to the start pose. Nothing
/// where the point is out of reach.
pub fn travel_pose(machine: &Machine, point: Point) -> Option<JointPos> {
    machine.pose_near(point, &machine.start()).ok()
}

/// How long it takes to lift the pen in one pose, travel to another in joint space and lower it there, s: what ordering
/// minimises. Symmetric.
///
/// All motors start and stop together on a trapezoid: with `v` and `a` the smallest of each motor's limit over its way,
/// the time is `2 / sqrt(a)` when the top speed is not reached (`v² >= a`), else `1 / v + v / a`.
pub fn travel_time(machine: &Machine, from: &JointPos, to: &JointPos) -> f64 {
    machine.pen().lift_time_s + joint_time(machine, from, to) + machine.pen().drop_time_s
}

/// The trapezoid's time from pose to pose, s.
fn joint_time(machine: &Machine, from: &JointPos, to: &JointPos) -> f64 {
    let change = machine.motor_rates(&(*to - *from));
    let pen = machine.pen().max_travel_speed_mm_s / travel_speed(machine, *from, *to);
    let (mut speed, mut acceleration) = (pen, f64::INFINITY);
    for (k, motor) in machine.motors().iter().enumerate() {
        let way = change[k].abs();
        if way > 0.0 {
            speed = speed.min(motor.max_speed_ticks_s / way);
            acceleration = acceleration.min(motor.max_acceleration_ticks_s2 / way);
        }
    }
    if acceleration == f64::INFINITY {
        0.0
    } else if speed * speed >= acceleration {
        2.0 / acceleration.sqrt()
    } else {
        1.0 / speed + speed / acceleration
    }
}
