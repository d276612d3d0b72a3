//! One motor's column against its speed and acceleration limits, in finite differences of whole
//! ticks.

use kinematics::Motor;

use crate::{JerkPeak, MotorPeak, histogram::Histogram};

/// A finite difference that exceeds its bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Excess {
    /// The speed, acceleration or jerk.
    pub value: f64,
    /// The limit plus the rounding allowance.
    pub allowed: f64,
}

impl Excess {
    pub(crate) fn share(self) -> f64 {
        self.value / self.allowed
    }
}

/// Checks one motor row by row.
///
/// Let the motor follow `q(t)` with `|q'| <= v` and `|q''| <= a`, and let the table hold `q` at the
/// rows to half a tick. Over a step `h` the mean speed `V = (q1 - q0) / h` satisfies `|V| <= v`,
/// and the two roundings change it by `(1/2 + 1/2) / h` at most:
///
/// ```text
/// |V| <= v + 1/h                              (1)  times h = T: |first difference| <= v T + 1
/// ```
///
/// Over two neighbouring steps `h1`, `h2` the divided difference is
/// `V2 - V1 = q''(t) (h1 + h2) / 2` for some `t` between them; the tick in the middle enters twice:
///
/// ```text
/// |V2 - V1| <= a (h1 + h2) / 2 + 1/h1 + 1/h2  (2)  times h = T: |second difference| <= a T² + 2
/// ```
///
/// A step longer than the period replaces omitted rows, between which the motor moves uniformly or
/// rests: at its ends it counts in (2) as one period at that speed. The motor is at rest before the
/// first row and after the last one.
///
/// A share is a difference divided by its bound: above 1 exactly where (1) or (2) is violated. Exact
/// positions have no rounding allowance, so that their bound is the limit itself.
#[derive(Clone, Debug)]
pub(crate) struct MotorCheck {
    motor: Motor,
    period_s: f64,
    /// Size of a rounding step: 1 tick, or 0 for exact positions.
    rounding_ticks: f64,
    velocity: f64,
    step_s: f64,
    speed: Peak,
    acceleration: Peak,
}

/// The peak of a finite difference.
#[derive(Clone, Debug)]
struct Peak {
    limit: f64,
    /// The value with the largest share of its bound.
    value: f64,
    /// Its bound: the limit plus the rounding allowance.
    allowed: f64,
    share: f64,
    /// The shares of all values.
    shares: Histogram,
}

impl Peak {
    fn new(limit: f64) -> Self {
        Self { limit, value: 0.0, allowed: limit, share: 0.0, shares: Histogram::new() }
    }

    /// Adds a value; the excess over the limit plus its rounding allowance.
    fn add(&mut self, value: f64, allowance: f64) -> Option<Excess> {
        let allowed = self.limit + allowance;
        let share = value / allowed;
        if share > self.share {
            (self.value, self.allowed, self.share) = (value, allowed, share);
        }
        self.shares.add(share, 1.0);
        exceeds(value, allowed)
    }

    fn share_p999(&self) -> f64 {
        self.shares.percentile(0.999, self.share)
    }
}

/// Relative tolerance of comparisons, for rounding in the bound itself.
const ROUNDING: f64 = 1.0 + 1e-9;

impl MotorCheck {
    /// For whole ticks.
    pub(crate) fn new(motor: Motor, period_us: u64) -> Self {
        let period_s = period_us.max(1) as f64 * 1e-6;
        Self {
            period_s,
            rounding_ticks: 1.0,
            velocity: 0.0,
            step_s: period_s,
            speed: Peak::new(motor.max_speed_ticks_s),
            acceleration: Peak::new(motor.max_acceleration_ticks_s2),
            motor,
        }
    }

    /// For exact positions.
    pub(crate) fn exact(motor: Motor, period_us: u64) -> Self {
        Self { rounding_ticks: 0.0, ..Self::new(motor, period_us) }
    }

    /// The motor moves by `difference` ticks in `dt_us`. Returns the excess of (1) in this step,
    /// and of (2) at its beginning.
    pub(crate) fn step(&mut self, dt_us: u64, difference: f64) -> (Option<Excess>, Option<Excess>) {
        let dt_s = dt_us as f64 * 1e-6;
        let velocity = difference / dt_s;
        let mut fast = None;
        if difference != 0.0 {
            fast = self.speed.add(velocity.abs(), self.rounding_ticks / dt_s);
        }
        (fast, self.change_velocity(velocity, dt_s.min(self.period_s)))
    }

    /// The motor is at rest from now on.
    pub(crate) fn stop(&mut self) -> Option<Excess> {
        self.change_velocity(0.0, self.period_s)
    }

    fn change_velocity(&mut self, velocity: f64, step_s: f64) -> Option<Excess> {
        let (before, step_before) = (self.velocity, self.step_s);
        (self.velocity, self.step_s) = (velocity, step_s);
        if before == 0.0 && velocity == 0.0 {
            return None;
        }
        let mean_s = 0.5 * (step_before + step_s);
        let value = (velocity - before).abs() / mean_s;
        let allowance = self.rounding_ticks * (1.0 / step_before + 1.0 / step_s) / mean_s;
        self.acceleration.add(value, allowance)
    }

    /// The peaks of whole ticks; those of the motion from `exact`, where its positions are known.
    pub(crate) fn peak(self, exact: Option<&Self>, jerk: Option<JerkPeak>) -> MotorPeak {
        let motion = exact.unwrap_or(&self);
        MotorPeak {
            speed_ticks_s: exact.map(|exact| exact.speed.value),
            speed_share: motion.speed.share,
            speed_share_p999: motion.speed.share_p999(),
            speed_limit_ticks_s: self.motor.max_speed_ticks_s,
            whole_tick_speed_ticks_s: self.speed.value,
            whole_tick_speed_allowed_ticks_s: self.speed.allowed,
            acceleration_ticks_s2: exact.map(|exact| exact.acceleration.value),
            acceleration_share: motion.acceleration.share,
            acceleration_share_p999: motion.acceleration.share_p999(),
            acceleration_limit_ticks_s2: self.motor.max_acceleration_ticks_s2,
            whole_tick_acceleration_ticks_s2: self.acceleration.value,
            whole_tick_acceleration_allowed_ticks_s2: self.acceleration.allowed,
            jerk,
            name: self.motor.name.clone(),
        }
    }
}

/// `NaN` as a limit is exceeded by every value.
fn exceeds(value: f64, allowed: f64) -> Option<Excess> {
    let within = value <= allowed * ROUNDING;
    (!within).then_some(Excess { value, allowed })
}

#[cfg(test)]
mod tests {
    use super::{Motor, MotorCheck};

    const PERIOD_US: u64 = 10_000;

    fn with_limits(max_speed_ticks_s: f64, max_acceleration_ticks_s2: f64) -> Motor {
        Motor {
            name: "m".into(),
            ticks_per_unit: 1.0,
            offset_ticks: 0.0,
            max_speed_ticks_s,
            max_acceleration_ticks_s2,
            max_jerk_ticks_s3: None,
            backlash_ticks: 0.0,
        }
    }

    /// 10,000 ticks/s and 100,000 ticks/s²: at 10 ms 100 + 1 ticks a step and 10 + 2 ticks a second
    /// difference.
    fn motor() -> MotorCheck {
        MotorCheck::new(with_limits(1e4, 1e5), PERIOD_US)
    }

    /// Steps of one period each, then rest: whether (1) is exceeded, and the first step that
    /// exceeds (2).
    fn run(steps: &[i64]) -> (bool, Option<usize>) {
        let mut motor = motor();
        let mut fast = false;
        let mut sudden = None;
        for (index, step) in steps.iter().enumerate() {
            let (too_fast, too_sudden) = motor.step(PERIOD_US, *step as f64);
            fast |= too_fast.is_some();
            sudden = sudden.or(too_sudden.map(|_| index));
        }
        (fast, sudden.or(motor.stop().map(|_| steps.len())))
    }

    #[test]
    fn second_difference_limit_is_12_ticks() {
        assert_eq!(run(&[12, 24, 36, 24, 12]), (false, None));
        assert_eq!(run(&[-12, 0, 12]), (false, None));
        assert_eq!(run(&[13, 25, 13]), (false, Some(0)));
        assert_eq!(run(&[12, 25, 13, 1]), (false, Some(1)));
        assert_eq!(run(&[12, 24, 13]), (false, Some(3)));
        // Back and forth: a second difference of 24 ticks.
        assert_eq!(run(&[12, -12]), (false, Some(1)));
    }

    #[test]
    fn first_difference_limit_is_101_ticks() {
        let ramp = |top: i64| {
            (1..=8).map(|k| 12 * k).chain([top]).chain((1..=8).rev().map(|k| 12 * k)).collect::<Vec<_>>()
        };
        assert_eq!(run(&ramp(101)), (false, None));
        assert_eq!(run(&ramp(102)), (true, None));
    }

    #[test]
    fn omitted_rows_at_rest_do_not_soften_a_stop() {
        for gap in [1, 2, 500] {
            let mut motor = motor();
            assert!(motor.step(PERIOD_US, 12.0).1.is_none());
            assert!(motor.step(gap * PERIOD_US, 0.0).1.is_none());
            assert!(motor.step(PERIOD_US, 13.0).1.is_some(), "{gap}");
            assert!(motor.step(gap * PERIOD_US, 0.0).1.is_some(), "{gap}");
        }
    }

    #[test]
    fn omitted_rows_of_uniform_motion_count() {
        let mut motor = motor();
        for step in [12.0, 24.0, 36.0] {
            assert_eq!(motor.step(PERIOD_US, step), (None, None));
        }
        assert_eq!(motor.step(10 * PERIOD_US, 360.0), (None, None));
        assert!(motor.step(PERIOD_US, 49.0).1.is_some());
    }

    #[test]
    fn short_steps_use_mean_speeds() {
        let mut motor = motor();
        assert_eq!(motor.step(PERIOD_US, 12.0), (None, None));
        // 4 ms: 1e5 (10 + 4) ms / 2 + 1/10 ms + 1/4 ms = 1050 ticks/s more than 1200, so 9 ticks.
        assert_eq!(motor.clone().step(4_000, 9.0), (None, None));
        assert!(motor.step(4_000, 10.0).1.is_some());
    }

    #[test]
    fn shares_are_those_of_the_exact_motion_where_it_is_known() {
        let mut whole = motor();
        let mut exact = MotorCheck::exact(with_limits(1e4, 1e5), PERIOD_US);
        // The motion has 5 and 50 % of its limits; its second difference of 5 ticks is rounded to 6.
        assert_eq!(whole.step(PERIOD_US, 6.0), (None, None));
        assert_eq!(exact.step(PERIOD_US, 5.0), (None, None));
        let peak = whole.clone().peak(None, None);
        assert!((peak.speed_share - 6.0 / 101.0).abs() < 1e-12, "{peak:?}");
        assert!((peak.acceleration_share - 6.0 / 12.0).abs() < 1e-12, "{peak:?}");
        assert_eq!(peak.acceleration_ticks_s2, None);
        let peak = whole.peak(Some(&exact), None);
        assert!(peak.speed_ticks_s.is_some_and(|speed| (speed - 500.0).abs() < 1e-9), "{peak:?}");
        assert!((peak.speed_share - 0.05).abs() < 1e-12 && (peak.acceleration_share - 0.5).abs() < 1e-12);
        assert!((peak.whole_tick_acceleration_ticks_s2 - 6e4).abs() < 1e-6);
    }

    #[test]
    fn nan_limits_are_exceeded() {
        let mut motor = MotorCheck::new(with_limits(f64::NAN, f64::NAN), 0);
        let (fast, sudden) = motor.step(1, 1.0);
        assert!(fast.is_some() && sudden.is_some());
    }
}
