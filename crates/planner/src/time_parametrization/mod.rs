//! Time parametrization: the fastest velocity profile along a joint path from rest to rest, under
//! the speed, acceleration and jerk limits of every motor.

mod acceleration;
mod barrier;
mod constraints;
mod fixed_duration;
mod jerk;
mod profile;
mod straight;

use kinematics::Machine;

use crate::joint_path::JointPath;

pub use fixed_duration::Easing;
pub(crate) use fixed_duration::fixed_duration;
#[cfg(feature = "unstable")]
pub use profile::Phase;
pub use profile::{LimitingConstraints, Profile, SpeedCap};

/// The fastest profile along `path` under the machine's motors and the cap.
pub fn profile(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    if jerk::applies(machine) {
        jerk::profile(machine, path, cap)
    } else {
        acceleration::profile(machine, path, cap)
    }
}

/// The duration on the path's own grid, without refinement and jerk limits, s.
pub(crate) fn rough_duration(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> f64 {
    acceleration::rough_duration(machine, path, cap)
}

/// The same on the path's own grid: without jerk limits and without refinement, ten times as fast
/// to compute, with a duration within a few per cent of the optimum.
#[cfg(feature = "unstable")]
pub fn profile_without_refinement(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    acceleration::profile_without_refinement(machine, path, cap)
}
