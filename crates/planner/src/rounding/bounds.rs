//! Bounds on finite differences of whole ticks.

use kinematics::Machine;

use super::Ticks;

/// First, second and third differences of whole ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Differences {
    pub(super) first: Ticks,
    pub(super) second: Ticks,
    pub(super) third: Ticks,
}

impl Differences {
    /// Those that end at `to`, one period after `from`, at which these end.
    pub(super) fn step(&self, from: Ticks, to: Ticks) -> Self {
        let first = [0, 1].map(|motor: usize| to[motor].saturating_sub(from[motor]));
        let second = [0, 1].map(|motor: usize| first[motor].saturating_sub(self.first[motor]));
        let third = [0, 1].map(|motor: usize| second[motor].saturating_sub(self.second[motor]));
        Self { first, second, third }
    }

    /// Whether each is within its bound.
    pub(super) fn within(&self, bounds: &Bounds) -> bool {
        let inside = |values: Ticks, bound: Ticks| values[0].abs() <= bound[0] && values[1].abs() <= bound[1];
        inside(self.first, bounds.first)
            && inside(self.second, bounds.second)
            && inside(self.third, bounds.third)
    }
}

/// Bounds of the absolute values of [`Differences`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Bounds {
    first: Ticks,
    second: Ticks,
    third: Ticks,
}

impl Bounds {
    /// Those that rounding to the nearest tick keeps on a motion within the limits: `v T + 1`,
    /// `a T² + 2` and `j T³ + 4` ticks.
    pub(super) fn of(machine: &Machine, period_us: u64) -> Self {
        let period = period_us as f64 * 1e-6;
        // The verifier forgives twice as much rounding error in the bound itself.
        let whole = |bound: f64| (bound * (1.0 + 5e-10)).floor() as i64;
        let motors = machine.motors().each_ref();
        Self {
            first: motors.map(|motor| whole(motor.max_speed_ticks_s * period + 1.0)),
            second: motors.map(|motor| whole(motor.max_acceleration_ticks_s2 * period * period + 2.0)),
            third: motors.map(|motor| {
                let jerk = motor.max_jerk_ticks_s3.unwrap_or(f64::INFINITY);
                whole(jerk * period * period * period + 4.0)
            }),
        }
    }

    /// These bounds, or what `differences` need where that is more.
    pub(super) fn or(self, differences: &Differences) -> Self {
        let more =
            |bound: Ticks, values: Ticks| [bound[0].max(values[0].abs()), bound[1].max(values[1].abs())];
        Self {
            first: more(self.first, differences.first),
            second: more(self.second, differences.second),
            third: more(self.third, differences.third),
        }
    }
}
