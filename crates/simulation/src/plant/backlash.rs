//! Backlash between a motor and its load.

use super::Motor;

/// A motor whose load follows with a gap: the load moves only when the motor has taken up the play.
///
/// With play `b` the load `y` stays within `b / 2` of the motor `x`: `y = clamp(y, x - b/2, x + b/2)`
/// (a backlash without inertia of the load, M. Nordin, P.-O. Gutman: "Controlling mechanical systems
/// with backlash - a survey", Automatica 2002). The encoder is on the motor's side.
#[derive(Debug)]
pub struct Backlash {
    motor: Box<dyn Motor>,
    half: f64,
    load: f64,
}

impl Backlash {
    /// Play of `gap` ticks behind the motor; the load starts in the middle of it.
    pub fn new(motor: Box<dyn Motor>, gap: f64) -> Self {
        let load = motor.position();
        Self { motor, half: 0.5 * gap, load }
    }
}

impl Motor for Backlash {
    fn advance(&mut self, command: f64, steps: u32) {
        // Step by step: a reversal within the call takes up the play, too.
        for _ in 0..steps {
            self.motor.advance(command, 1);
            let at = self.motor.position();
            self.load = self.load.clamp(at - self.half, at + self.half);
        }
    }

    fn position(&self) -> f64 {
        self.motor.position()
    }

    fn speed(&self) -> f64 {
        self.motor.speed()
    }

    fn load(&self) -> f64 {
        self.load
    }

    fn current_a(&self, duty: f64) -> f64 {
        self.motor.current_a(duty)
    }

    fn lost_ticks(&self) -> f64 {
        self.motor.lost_ticks()
    }

    fn torque_margin(&self) -> Option<(f64, f64)> {
        self.motor.torque_margin()
    }
}
