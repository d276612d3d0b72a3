//! Travel with the pen up: its cost as motor time, and the poses that it passes.

use drawing::{Line, Point, Segment};
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
#[inline]
pub fn travel_time(machine: &Machine, from: &JointPos, to: &JointPos) -> f64 {
    machine.pen().lift_time_s + joint_time(machine, from, to) + machine.pen().drop_time_s
}

/// The duration of the trapezoidal profile between two poses, s.
#[inline]
fn joint_time(machine: &Machine, from: &JointPos, to: &JointPos) -> f64 {
    let change = machine.motor_rates(&(*to - *from));
    let pen = machine.pen().max_travel_speed_mm_s / travel_speed(machine, *from, *to);
    let (mut speed, mut acceleration) = (pen, f64::INFINITY);
    for (motor, change) in machine.motors().iter().zip(change.0) {
        // Infinite where the motor stands still, which limits nothing.
        speed = speed.min(motor.max_speed_ticks_s / change.abs());
        acceleration = acceleration.min(motor.max_acceleration_ticks_s2 / change.abs());
    }
    if acceleration == f64::INFINITY {
        0.0
    } else if speed * speed >= acceleration {
        2.0 / acceleration.sqrt()
    } else {
        1.0 / speed + speed / acceleration
    }
}

/// Parts of a straight line on which waypoints are looked for.
const WAYPOINTS: u32 = 64;

/// Points over the sheet, each way, that travel may pass.
const DETOURS: u32 = 7;

/// The poses through which the joints move linearly from one pose to another so that the mechanism
/// passes no singular pose: only the last one where the direct way is regular, as it always is on an
/// arm. Otherwise poses over the straight line of the pen, else over two lines with a point on the
/// sheet, or the start pose, between them. `None` if none of these ways is within the reach.
pub(crate) fn waypoints(machine: &Machine, from: JointPos, to: JointPos) -> Option<Vec<JointPos>> {
    let mechanism = machine.mechanism();
    if mechanism.stays_regular(&from, &to) {
        return Some(vec![to]);
    }
    let (start, end) = (mechanism.forward(&from), mechanism.forward(&to));
    if let Some(direct) = along_line(machine, from, end).filter(|poses| is_pose(poses, to)) {
        return Some(direct);
    }
    let sheet = machine.sheet();
    let grid = (0..DETOURS * DETOURS).map(|k| {
        let share = |k: u32| (f64::from(k) + 0.5) / f64::from(DETOURS);
        let (x, y) = (share(k % DETOURS), share(k / DETOURS));
        Point::new(sheet.x0 + x * sheet.width(), sheet.y0 + y * sheet.height())
    });
    let mut between: Vec<Point> = grid.chain([mechanism.forward(&machine.start())]).collect();
    between.sort_by(|a, b| {
        let detour = |p: &Point| (*p - start).hypot2().sqrt() + (end - *p).hypot2().sqrt();
        detour(a).total_cmp(&detour(b))
    });
    between.into_iter().find_map(|middle| {
        let mut poses = along_line(machine, from, middle)?;
        poses.extend(along_line(machine, *poses.last()?, end)?);
        is_pose(&poses, to).then_some(poses)
    })
}

/// Whether the last of the poses is this one, and not another turn about the base.
fn is_pose(poses: &[JointPos], to: JointPos) -> bool {
    poses.last().is_some_and(|last| (*last - to).max_abs() < 1e-6)
}

/// As few poses as possible over the straight line from a pose to a point, between which the joints may
/// move linearly; the first one is left out.
fn along_line(machine: &Machine, from: JointPos, end: Point) -> Option<Vec<JointPos>> {
    let mechanism = machine.mechanism();
    let start = mechanism.forward(&from);
    if start == end {
        return Some(vec![from]);
    }
    machine.check_segment(&Segment::Line(Line::new(start, end))).ok()?;
    let mut along = vec![from];
    for k in 1..=WAYPOINTS {
        let p = start.lerp(end, f64::from(k) / f64::from(WAYPOINTS));
        along.push(machine.pose_near(p, along.last()?).ok()?);
    }
    let (mut poses, mut here) = (Vec::new(), 0);
    while here < along.len() - 1 {
        here = (here + 1..along.len())
            .rev()
            .find(|next| mechanism.stays_regular(&along[here], &along[*next]))?;
        poses.push(along[here]);
    }
    Some(poses)
}
