//! An RC servo: a position drive with a limited rate, a dead band and a resolution.

use super::{Motor, STEP_S};

/// Parameters of an [`RcServo`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RcServoParameters {
    /// Largest speed, ticks/s.
    pub rate_ticks_s: f64,
    /// The servo does not move while it is within this distance of its command, ticks.
    pub dead_band_ticks: f64,
    /// Commands are rounded to multiples of this, counted from the start, ticks; 0 for none.
    pub resolution_ticks: f64,
    /// Time between pulses: a command is taken over with the next one, s.
    pub frame_s: f64,
}

/// An RC servo under a position in ticks.
#[derive(Clone, Debug)]
pub struct RcServo {
    parameters: RcServoParameters,
    origin: f64,
    position: f64,
    speed: f64,
    held: f64,
    /// Steps since the start, and the number of pulses since then.
    steps: u64,
    pulses: u64,
}

impl RcServo {
    /// A servo at rest at this position, ticks.
    pub fn new(parameters: RcServoParameters, position: f64) -> Self {
        Self { parameters, origin: position, position, speed: 0.0, held: position, steps: 0, pulses: 0 }
    }

    fn step(&mut self, command: f64) {
        let p = &self.parameters;
        if self.steps as f64 * STEP_S >= self.pulses as f64 * p.frame_s - 1e-9 {
            self.pulses += 1;
            self.held = if p.resolution_ticks > 0.0 {
                self.origin + ((command - self.origin) / p.resolution_ticks).round() * p.resolution_ticks
            } else {
                command
            };
        }
        self.steps += 1;
        let error = self.held - self.position;
        let way = (error.abs() - p.dead_band_ticks).max(0.0).min(p.rate_ticks_s * STEP_S).copysign(error);
        self.position += way;
        self.speed = way / STEP_S;
    }
}

impl Motor for RcServo {
    fn advance(&mut self, command: f64, steps: u32) {
        for _ in 0..steps {
            self.step(command);
        }
    }

    fn position(&self) -> f64 {
        self.position
    }

    fn speed(&self) -> f64 {
        self.speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn servo(dead_band_ticks: f64, resolution_ticks: f64) -> RcServo {
        let parameters =
            RcServoParameters { rate_ticks_s: 3000.0, dead_band_ticks, resolution_ticks, frame_s: 0.02 };
        RcServo::new(parameters, 1472.0)
    }

    #[test]
    fn rate_bounds_the_speed() {
        let mut servo = servo(0.0, 0.0);
        servo.advance(2072.0, 500);
        assert!((servo.position() - 1772.0).abs() < 1e-9);
        servo.advance(2072.0, 1000);
        assert!((servo.position() - 2072.0).abs() < 1e-9);
        assert_eq!(servo.speed(), 0.0);
    }

    #[test]
    fn dead_band_is_left_over() {
        let mut servo = servo(5.0, 0.0);
        servo.advance(1476.0, 1000);
        assert_eq!(servo.position(), 1472.0);
        servo.advance(1480.0, 1000);
        assert!((servo.position() - 1475.0).abs() < 1e-9);
    }

    #[test]
    fn resolution_rounds_and_frames_delay() {
        let mut servo = servo(0.0, 10.0);
        servo.advance(1472.0, 1);
        // The first pulse has passed; the next one comes 20 ms later.
        servo.advance(1479.0, 99);
        assert_eq!(servo.position(), 1472.0);
        servo.advance(1479.0, 200);
        assert!((servo.position() - 1482.0).abs() < 1e-9);
    }
}
