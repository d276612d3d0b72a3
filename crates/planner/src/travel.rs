//! The cost of travel, as motor time.

use drawing::Point;
use kinematics::{JointPos, Machine};

use crate::joint_path::travel_speed;

/// The pose that represents a point when travel times are compared: the one nearest to the start
/// pose. Returns `None` if the point is out of reach.
pub fn travel_pose(machine: &Machine, point: Point) -> Option<JointPos> {
    machine.pose_near(point, &machine.start()).ok()
}

/// The time to lift the pen in one pose, travel to another in joint space and lower it there, s:
/// the cost that ordering minimizes. Symmetric in the two poses.
///
/// All motors start and stop together on a trapezoidal velocity profile. With `v` and `a` the
/// smallest ratio of a motor's limit to its distance, the time is `2 / sqrt(a)` if the top speed is
/// not reached (`v² >= a`), else `1 / v + v / a`. Jerk limits are neglected.
pub fn travel_time(machine: &Machine, from: &JointPos, to: &JointPos) -> f64 {
    machine.pen().lift_time_s + joint_time(machine, from, to) + machine.pen().drop_time_s
}

/// The duration of the trapezoidal profile between two poses, s.
fn joint_time(machine: &Machine, from: &JointPos, to: &JointPos) -> f64 {
    let change = machine.motor_rates(&(*to - *from));
    let pen = machine.pen().max_travel_speed_mm_s / travel_speed(machine, *from, *to);
    let (mut speed, mut acceleration) = (pen, f64::INFINITY);
    for (k, motor) in machine.motors().iter().enumerate() {
        let distance = change[k].abs();
        if distance > 0.0 {
            speed = speed.min(motor.max_speed_ticks_s / distance);
            acceleration = acceleration.min(motor.max_acceleration_ticks_s2 / distance);
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
