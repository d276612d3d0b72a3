//! A cascade of three loops, as in the H-bot (docs/references.md, report 2): position (P) gives a
//! speed, speed (PI) a current, current (PI) the duty.
//!
//! All loops run once a period; the speed is measured over a longer time, as an encoder interface
//! that counts edges does. While the duty is limited, the integrals of speed and current do not grow
//! towards the limit.

use super::{Controller, FULL_DUTY_PERCENT, Measurement, Setpoint};

/// Gains of a [`Cascade`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CascadeGains {
    /// Speed per error of position, 1/s.
    pub position_per_s: f64,
    /// Current per error of speed, A per tick/s.
    pub speed_kp: f64,
    /// Current per integrated error of speed, A per tick.
    pub speed_ki: f64,
    /// Duty per error of current, % per A.
    pub current_kp: f64,
    /// Duty per integrated error of current, % per A s.
    pub current_ki: f64,
    /// Time over which the speed is measured, s.
    pub speed_window_s: f64,
    /// Time constant of winding and low-pass filter between duty and measured current, s; 0 for none.
    pub current_filter_s: f64,
}

/// A cascade of position, speed and current.
#[derive(Clone, Copy, Debug)]
pub struct Cascade {
    gains: CascadeGains,
    period_s: f64,
    /// Calls in a window of the speed measurement, calls since its start, position at its start.
    window: u32,
    calls: u32,
    window_start: Option<f64>,
    speed: f64,
    current_a: f64,
    speed_sum: f64,
    current_sum: f64,
    saturated: bool,
}

impl Cascade {
    /// A controller that is called once every `period_s`.
    pub fn new(gains: CascadeGains, period_s: f64) -> Self {
        Self {
            gains,
            period_s,
            window: (gains.speed_window_s / period_s).round().max(1.0) as u32,
            calls: 0,
            window_start: None,
            speed: 0.0,
            current_a: 0.0,
            speed_sum: 0.0,
            current_sum: 0.0,
            saturated: false,
        }
    }

    fn measure_speed(&mut self, position: f64) {
        let start = *self.window_start.get_or_insert(position);
        if self.calls == self.window {
            self.speed = (position - start) / (f64::from(self.window) * self.period_s);
            self.window_start = Some(position);
            self.calls = 0;
        }
        self.calls += 1;
    }
}

impl Controller for Cascade {
    fn update(&mut self, setpoint: &Setpoint, measured: &Measurement) -> f64 {
        self.measure_speed(measured.position);
        let gains = self.gains;
        let share = -libm::expm1(-self.period_s / gains.current_filter_s.max(f64::MIN_POSITIVE));
        self.current_a += share * (measured.current_a - self.current_a);
        let speed_error = gains.position_per_s * (setpoint.position - measured.position) - self.speed;
        let speed_sum = self.speed_sum + speed_error * self.period_s;
        let current_error = gains.speed_kp * speed_error + gains.speed_ki * speed_sum - self.current_a;
        let current_sum = self.current_sum + current_error * self.period_s;
        let wanted = gains.current_kp * current_error + gains.current_ki * current_sum;
        self.saturated = wanted.abs() >= FULL_DUTY_PERCENT;
        // Towards the limit neither integral grows.
        let grows = |sum: f64, before: f64| self.saturated && (sum - before) * wanted > 0.0;
        if !grows(speed_sum, self.speed_sum) {
            self.speed_sum = speed_sum;
        }
        if !grows(current_sum, self.current_sum) {
            self.current_sum = current_sum;
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

    fn gains() -> CascadeGains {
        CascadeGains {
            position_per_s: 20.0,
            speed_kp: 1e-3,
            speed_ki: 1e-3,
            current_kp: 100.0,
            current_ki: 100.0,
            speed_window_s: 0.01,
            current_filter_s: 0.0,
        }
    }

    #[test]
    fn speed_is_measured_over_its_window() {
        let mut cascade = Cascade::new(gains(), 0.001);
        for call in 0..=10 {
            let measured = Measurement { position: f64::from(call), current_a: 0.0 };
            cascade.update(&Setpoint::default(), &measured);
            let expected = if call < 10 { 0.0 } else { 1000.0 };
            assert!((cascade.speed - expected).abs() < 1e-9, "call {call}: {}", cascade.speed);
        }
    }

    #[test]
    fn integrals_do_not_wind_up() {
        let mut cascade = Cascade::new(gains(), 0.001);
        let far = Setpoint { position: 1e5, ..Setpoint::default() };
        for _ in 0..5000 {
            assert_eq!(cascade.update(&far, &Measurement::default()), 100.0);
        }
        assert_eq!((cascade.speed_sum, cascade.current_sum), (0.0, 0.0));
    }
}
