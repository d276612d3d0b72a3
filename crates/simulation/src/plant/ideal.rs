//! The ideal drive: the position is the command.

use super::{Motor, STEP_S};

/// A drive without any error: it shows what the plan alone draws.
#[derive(Clone, Copy, Debug)]
pub struct Ideal {
    position: f64,
    speed: f64,
}

impl Ideal {
    /// A drive at rest at this position, ticks.
    pub fn new(position: f64) -> Self {
        Self { position, speed: 0.0 }
    }
}

impl Motor for Ideal {
    fn advance(&mut self, command: f64, steps: u32) {
        if steps > 0 {
            self.speed = (command - self.position) / (f64::from(steps) * STEP_S);
            self.position = command;
        }
    }

    fn position(&self) -> f64 {
        self.position
    }

    fn speed(&self) -> f64 {
        self.speed
    }
}
