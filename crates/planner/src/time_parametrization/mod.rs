//! Time parametrization: the fastest velocity profile along a joint path from rest to rest, under
//! the speed, acceleration and jerk limits of every motor.

mod acceleration;
mod arcs;
mod barrier;
mod constraints;
mod fixed_duration;
mod jerk;
mod profile;
mod straight;

use kinematics::Machine;

use crate::joint_path::JointPath;

pub(crate) use arcs::hermite;
pub use fixed_duration::Easing;
pub(crate) use fixed_duration::fixed_duration;
#[cfg(feature = "unstable")]
pub use profile::Phase;
pub use profile::{LimitingConstraints, Profile, SpeedCap};

/// The fastest profile along `path` under the machine's motors and the cap.
pub fn profile(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    if jerk::applies(machine) { jerk::profile(machine, path, cap) } else { without_jerk(machine, path, cap) }
}

/// The fastest profile whatever the jerk.
pub(crate) fn without_jerk(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    arcs::profile(machine, path, cap).unwrap_or_else(|| acceleration::profile(machine, path, cap))
}

/// The profile with one acceleration on each of the path's intervals: what plans fall back on where
/// no arcs are found, with a duration within some per cent of the optimum.
#[cfg(feature = "unstable")]
pub fn profile_on_grid(machine: &Machine, path: &JointPath, cap: &SpeedCap) -> Profile {
    acceleration::profile(machine, path, cap)
}
