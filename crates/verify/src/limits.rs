//! One motor's column against its limits, in finite differences of whole ticks.

use crate::{JerkPeak, MotorPeak, histogram::Histogram, jerk::JerkCheck};

/// A finite difference beyond its bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Excess {
    /// The speed or acceleration.
    pub value: f64,
    /// The limit with the allowance for rounding.
    pub allowed: f64,
}

impl Excess {
    pub(crate) fn share(self) -> f64 {
        self.value / self.allowed
    }
}

/// Follows one motor from row to row.
///
/// Let the motor really follow `q(t)` with `|q'| <= v` and `|q''| <= a`, and let the table hold `q` at the rows' times
/// to half a tick. Over a step `h` the mean speed `V = (q1 - q0) / h` obeys `|V| <= v`, and the two ticks change it by
/// `(1/2 + 1/2) / h` at the most:
///
/// ```text
/// |V| <= v + 1/h                                    (1)   times h = T:  |first difference| <= v T + 1
/// ```
///
/// Over two neighbouring steps `h1`, `h2` the divided difference gives `V2 - V1 = q''(somewhere) (h1 + h2) / 2`; the
/// middle tick enters twice:
///
/// ```text
/// |V2 - V1| <= a (h1 + h2) / 2 + 1/h1 + 1/h2        (2)   times h = T:  |second difference| <= a T^2 + 2
/// ```
///
/// A step longer than the period stands for the rows that were left out of it, on which the motor moves evenly
/// (or not at all): at its ends it counts in (2) as one period at that speed. Before the first row and after the
/// last the motor is at rest.
#[derive(Clone, Debug)]
pub(crate) struct MotorCheck {
    motor: plan::Motor,
    period_s: f64,
    velocity: f64,
    step_s: f64,
    speed: f64,
    acceleration: f64,
    speed_share: f64,
    acceleration_share: f64,
    speed_shares: Histogram,
    acceleration_shares: Histogram,
    /// Where the motor states a limit for it.
    jerk: Option<JerkCheck>,
}

/// Comparisons forgive what computing the bound itself may cost.
const ROUNDING: f64 = 1.0 + 1e-9;

impl MotorCheck {
    pub(crate) fn new(motor: plan::Motor, period_us: u64) -> Self {
        let period_s = period_us.max(1) as f64 * 1e-6;
        let jerk = motor.limits.jerk.map(|limit| JerkCheck::new(limit, period_us));
        Self {
            motor,
            jerk,
            period_s,
            velocity: 0.0,
            step_s: period_s,
            speed: 0.0,
            acceleration: 0.0,
            speed_share: 0.0,
            acceleration_share: 0.0,
            speed_shares: Histogram::new(),
            acceleration_shares: Histogram::new(),
        }
    }

    pub(crate) fn name(&self) -> &str {
        &self.motor.name
    }

    /// The motor goes by `difference` ticks in `dt_us`: too fast by (1), and too sudden at the step's beginning by (2).
    pub(crate) fn step(&mut self, dt_us: u64, difference: i64) -> (Option<Excess>, Option<Excess>) {
        let dt_s = dt_us as f64 * 1e-6;
        let velocity = difference as f64 / dt_s;
        let mut fast = None;
        if difference != 0 {
            let allowed = self.motor.limits.speed + 1.0 / dt_s;
            let value = velocity.abs();
            let share = value / allowed;
            self.speed = self.speed.max(value);
            self.speed_share = self.speed_share.max(share);
            self.speed_shares.add(share, 1.0);
            fast = exceeds(value, allowed);
        }
        (fast, self.turn(velocity, dt_s.min(self.period_s)))
    }

    /// The motor stands still from now on.
    pub(crate) fn stop(&mut self) -> Option<Excess> {
        self.turn(0.0, self.period_s)
    }

    fn turn(&mut self, velocity: f64, step_s: f64) -> Option<Excess> {
        let (before, step_before) = (self.velocity, self.step_s);
        (self.velocity, self.step_s) = (velocity, step_s);
        if before == 0.0 && velocity == 0.0 {
            return None;
        }
        let mean_s = 0.5 * (step_before + step_s);
        let value = (velocity - before).abs() / mean_s;
        let allowed = self.motor.limits.acceleration + (1.0 / step_before + 1.0 / step_s) / mean_s;
        let share = value / allowed;
        self.acceleration = self.acceleration.max(value);
        self.acceleration_share = self.acceleration_share.max(share);
        self.acceleration_shares.add(share, 1.0);
        exceeds(value, allowed)
    }

    /// The same motion against the motor's jerk.
    pub(crate) fn jerk(&mut self, dt_us: u64, difference: i64) -> Option<Excess> {
        self.jerk.as_mut().and_then(|jerk| jerk.step(dt_us, difference))
    }

    /// The stop against the motor's jerk.
    pub(crate) fn jerk_of_stop(&mut self) -> Option<Excess> {
        self.jerk.as_mut().and_then(JerkCheck::stop)
    }

    pub(crate) fn limits(&self) -> plan::Limits {
        self.motor.limits
    }

    pub(crate) fn peak(self) -> MotorPeak {
        MotorPeak {
            speed_share_p999: self.speed_shares.percentile(0.999, self.speed_share),
            acceleration_share_p999: self.acceleration_shares.percentile(0.999, self.acceleration_share),
            jerk: self.jerk.map(|jerk| JerkPeak {
                jerk_ticks_s3: jerk.jerk,
                limit_ticks_s3: self.motor.limits.jerk.unwrap_or_default(),
                share: jerk.share,
                share_p999: jerk.share_p999(),
            }),
            name: self.motor.name,
            speed_ticks_s: self.speed,
            acceleration_ticks_s2: self.acceleration,
            speed_limit_ticks_s: self.motor.limits.speed,
            acceleration_limit_ticks_s2: self.motor.limits.acceleration,
            speed_share: self.speed_share,
            acceleration_share: self.acceleration_share,
        }
    }
}

/// A limit that is not a number is exceeded by everything.
fn exceeds(value: f64, allowed: f64) -> Option<Excess> {
    let within = value <= allowed * ROUNDING;
    (!within).then_some(Excess { value, allowed })
}

#[cfg(test)]
mod tests {
    use super::MotorCheck;

    const PERIOD_US: u64 = 10_000;

    /// 10,000 ticks/s and 100,000 ticks/s²: at 10 ms 100 + 1 ticks a step and 10 + 2 ticks a second difference.
    fn motor() -> MotorCheck {
        let limits = plan::Limits { speed: 1e4, acceleration: 1e5, jerk: None };
        MotorCheck::new(plan::Motor { name: "m".into(), limits }, PERIOD_US)
    }

    /// Steps of one period each, then rest; whether any is too fast, and the first one that is too sudden.
    fn run(steps: &[i64]) -> (bool, Option<usize>) {
        let mut motor = motor();
        let mut fast = false;
        let mut sudden = None;
        for (index, step) in steps.iter().enumerate() {
            let (too_fast, too_sudden) = motor.step(PERIOD_US, *step);
            fast |= too_fast.is_some();
            sudden = sudden.or(too_sudden.map(|_| index));
        }
        (fast, sudden.or(motor.stop().map(|_| steps.len())))
    }

    #[test]
    fn second_differences_up_to_twelve_ticks() {
        assert_eq!(run(&[12, 24, 36, 24, 12]), (false, None));
        assert_eq!(run(&[-12, 0, 12]), (false, None));
        assert_eq!(run(&[13, 25, 13]), (false, Some(0)));
        assert_eq!(run(&[12, 25, 13, 1]), (false, Some(1)));
        assert_eq!(run(&[12, 24, 13]), (false, Some(3)));
        // To and fro: 24 ticks, though no step is longer than a tick a millisecond.
        assert_eq!(run(&[12, -12]), (false, Some(1)));
    }

    #[test]
    fn first_differences_up_to_a_hundred_and_one_ticks() {
        let ramp = |top: i64| {
            (1..=8).map(|k| 12 * k).chain([top]).chain((1..=8).rev().map(|k| 12 * k)).collect::<Vec<_>>()
        };
        assert_eq!(run(&ramp(101)), (false, None));
        assert_eq!(run(&ramp(102)), (true, None));
    }

    #[test]
    fn a_thinned_standstill_is_no_gentle_stop() {
        for gap in [1, 2, 500] {
            let mut motor = motor();
            assert!(motor.step(PERIOD_US, 12).1.is_none());
            assert!(motor.step(gap * PERIOD_US, 0).1.is_none());
            assert!(motor.step(PERIOD_US, 13).1.is_some(), "{gap}");
            assert!(motor.step(gap * PERIOD_US, 0).1.is_some(), "{gap}");
        }
    }

    #[test]
    fn a_thinned_even_run_counts_as_its_rows() {
        let mut motor = motor();
        for step in [12, 24, 36] {
            assert_eq!(motor.step(PERIOD_US, step), (None, None));
        }
        assert_eq!(motor.step(10 * PERIOD_US, 360), (None, None));
        assert!(motor.step(PERIOD_US, 49).1.is_some());
    }

    #[test]
    fn short_steps_are_judged_by_mean_speeds() {
        let mut motor = motor();
        assert_eq!(motor.step(PERIOD_US, 12), (None, None));
        // 4 ms: 1e5 (10 + 4) ms / 2 + 1/10 ms + 1/4 ms = 1050 ticks/s more than 1200, so 9 ticks.
        assert_eq!(motor.clone().step(4_000, 9), (None, None));
        assert!(motor.step(4_000, 10).1.is_some());
    }

    #[test]
    fn limits_that_are_no_numbers_are_broken() {
        let limits = plan::Limits { speed: f64::NAN, acceleration: f64::NAN, jerk: None };
        let mut motor = MotorCheck::new(plan::Motor { name: "m".into(), limits }, 0);
        let (fast, sudden) = motor.step(1, 1);
        assert!(fast.is_some() && sudden.is_some());
    }
}
