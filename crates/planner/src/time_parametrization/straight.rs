//! Travel under jerk limits: rest to rest on a line in joint space, in closed form.

use kinematics::{Machine, MotorPos};

use super::profile::{Phase, Profile};

/// Seven phases of constant jerk on a line in joint space, no faster than `fastest`, symmetric in
/// time.
pub(super) fn profile(machine: &Machine, change: MotorPos, fastest: f64) -> Profile {
    let least = |of: &dyn Fn(usize) -> f64| of(0).min(of(1));
    let motors = machine.motors();
    let v = least(&|k| motors[k].max_speed_ticks_s / change[k].abs()).min(fastest);
    let a = least(&|k| motors[k].max_acceleration_ticks_s2 / change[k].abs());
    let j = least(&|k| motors[k].max_jerk_ticks_s3.unwrap_or(f64::INFINITY) / change[k].abs());
    // The time to reach the speed V is V/a + a/j, or 2 √(V/j) where a is not reached. The distance
    // from rest to rest without a phase at V is V times that.
    let time_to = |speed: f64| if speed >= a * a / j { speed / a + a / j } else { 2.0 * (speed / j).sqrt() };
    let mut top = v;
    if top * time_to(top) > 1.0 {
        let r = a / j;
        top = 0.5 * a * ((r * r + 4.0 / a).sqrt() - r);
        if top < a * r {
            top = libm::cbrt(0.25 * j);
        }
    }
    let peak = a.min((top * j).sqrt());
    let ramp = if j.is_finite() { peak / j } else { 0.0 };
    let steady = (top / peak - ramp).max(0.0);
    let cruise = ((1.0 - top * (2.0 * ramp + steady)) / top).max(0.0);
    let mut profile = Profile::new();
    let (mut s, mut speed, mut acceleration) = (0.0, 0.0, 0.0);
    let jerk = if j.is_finite() { j } else { 0.0 };
    for (jerk, time) in [
        (jerk, ramp),
        (0.0, steady),
        (-jerk, ramp),
        (0.0, cruise),
        (-jerk, ramp),
        (0.0, steady),
        (jerk, ramp),
    ] {
        if time > 0.0 {
            let phase = Phase { jerk, ..Phase::even(0, s, speed, acceleration, time) };
            profile.push(phase);
            s = phase.position_at(time);
            speed += time * (acceleration + 0.5 * jerk * time);
            acceleration += jerk * time;
        }
    }
    profile
}
