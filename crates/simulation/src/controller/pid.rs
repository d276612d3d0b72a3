//! P, PI, PD and PID with feed-forward and saturation.
//!
//! Once a period `T`, with the error `e` in ticks:
//!
//! ```text
//! u = kp e + ki sum(e T) + kd d + u_forward,   clamped to +-100 %
//! d = d + T / (T + T_f) ((e - e_before) / T - d)
//! ```
//!
//! The sum holds the errors up to the previous period. `T_f` filters the derivative, which would
//! otherwise turn one count of the encoder into `kd / T` percent.

use super::{Controller, FULL_DUTY_PERCENT, FeedForward, Measurement, MotorModel, Setpoint};

/// Gains of a [`Pid`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PidGains {
    /// Proportional gain, % per tick.
    pub kp: f64,
    /// Integral gain, % per tick and s.
    pub ki: f64,
    /// Derivative gain, % per tick/s.
    pub kd: f64,
    /// Time constant of the derivative's filter, s; 0 for none.
    pub kd_filter_s: f64,
}

/// What becomes of the integral while the output is limited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AntiWindup {
    /// It goes on: overshoots after every saturation.
    None,
    /// It waits, except for errors that lead out of saturation.
    #[default]
    Conditional,
    /// Its share of the duty is limited to 100 %.
    Clamp,
}

/// A PID controller.
#[derive(Clone, Copy, Debug)]
pub struct Pid {
    gains: PidGains,
    anti_windup: AntiWindup,
    forward: FeedForward,
    model: MotorModel,
    period_s: f64,
    sum: f64,
    before: Option<f64>,
    derivative: f64,
    saturated: bool,
}

impl Pid {
    /// A controller that is called once every `period_s`.
    pub fn new(
        gains: PidGains,
        anti_windup: AntiWindup,
        forward: FeedForward,
        model: MotorModel,
        period_s: f64,
    ) -> Self {
        Self {
            gains,
            anti_windup,
            forward,
            model,
            period_s,
            sum: 0.0,
            before: None,
            derivative: 0.0,
            saturated: false,
        }
    }
}

impl Controller for Pid {
    fn update(&mut self, setpoint: &Setpoint, measured: &Measurement) -> f64 {
        let PidGains { kp, ki, kd, kd_filter_s } = self.gains;
        let error = setpoint.position - measured.position;
        // At the first call there is no error before.
        let slope = (error - self.before.unwrap_or(error)) / self.period_s;
        self.before = Some(error);
        self.derivative += self.period_s / (self.period_s + kd_filter_s) * (slope - self.derivative);
        let wanted =
            kp * error + ki * self.sum + kd * self.derivative + self.forward.duty(&self.model, setpoint);
        self.saturated = wanted.abs() >= FULL_DUTY_PERCENT;
        let integrates = match self.anti_windup {
            AntiWindup::Conditional => !self.saturated || wanted * error < 0.0,
            AntiWindup::None | AntiWindup::Clamp => true,
        };
        if integrates {
            self.sum += error * self.period_s;
        }
        if self.anti_windup == AntiWindup::Clamp && ki > 0.0 {
            let most = FULL_DUTY_PERCENT / ki;
            self.sum = self.sum.clamp(-most, most);
        }
        wanted.clamp(-FULL_DUTY_PERCENT, FULL_DUTY_PERCENT)
    }

    fn is_saturated(&self) -> bool {
        self.saturated
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pid(gains: PidGains, anti_windup: AntiWindup) -> Pid {
        let model = MotorModel {
            speed_per_duty_ticks_s: 100.0,
            time_constant_s: 0.1,
            friction_percent: 6.0,
            viscous_percent: 0.0,
        };
        let forward = FeedForward { speed: 1.0, acceleration: 1.0, friction: 1.0 };
        Pid::new(gains, anti_windup, forward, model, 0.01)
    }

    fn at(position: f64) -> Setpoint {
        Setpoint { position, ..Setpoint::default() }
    }

    #[test]
    fn terms_add_up() {
        let mut pid = pid(PidGains { kp: 0.5, ki: 2.0, kd: 0.01, kd_filter_s: 0.0 }, AntiWindup::default());
        assert_eq!(pid.update(&at(10.0), &Measurement::default()), 5.0);
        // Sum 10 * 0.01; the error grew by 2 in 10 ms.
        let u = pid.update(&at(12.0), &Measurement::default());
        assert!((u - (6.0 + 0.2 + 2.0)).abs() < 1e-12, "{u}");
    }

    #[test]
    fn feed_forward_is_the_model() {
        let mut pid = pid(PidGains::default(), AntiWindup::default());
        let setpoint = Setpoint { position: 0.0, speed: -300.0, acceleration: 2000.0 };
        let u = pid.update(&setpoint, &Measurement::default());
        assert!((u - (-3.0 + 2.0 - 6.0)).abs() < 1e-12, "{u}");
    }

    #[test]
    fn integral_waits_while_saturated() {
        let gains = PidGains { kp: 1.0, ki: 10.0, ..PidGains::default() };
        for (anti_windup, after) in
            [(AntiWindup::Conditional, -1.0), (AntiWindup::None, 100.0), (AntiWindup::Clamp, 99.0)]
        {
            let mut pid = pid(gains, anti_windup);
            for _ in 0..200 {
                assert_eq!(pid.update(&at(1000.0), &Measurement::default()), 100.0);
            }
            assert!(pid.is_saturated());
            let u = pid.update(&at(-1.0), &Measurement::default());
            assert_eq!(u, after, "{anti_windup:?}");
        }
    }
}
